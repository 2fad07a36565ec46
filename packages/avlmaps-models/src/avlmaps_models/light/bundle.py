"""The files of the profile ``light``: one folder with a manifest, found where models lie, checked before they are used.

``python -m training.light`` makes the folder, ``avlmaps profiles --fetch light`` brings it.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec

from avlmaps.core.errors import BackendError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular
from avlmaps.perception.models import folders_of
from avlmaps.perception.networks import open_network
from avlmaps_models.common.checksums import checksum_of, remembered_sha256

MODEL = "avlmaps/light-1"
MANIFEST = "manifest.json"
HOW_TO_GET = "avlmaps profiles --fetch light --from URL|DIR"
FORMAT = 1
PICTURES, PICTURE_WORDS, PICTURE_TOKENS = "pixels.onnx", "pixels-text.onnx", "pixels-tokens.json.gz"
SOUNDS, SOUND_WORDS, SOUND_TOKENS = "sounds.onnx", "sounds-text.onnx", "sounds-tokens.json.gz"
KNOWN_WORDS = "words.npz"
FILES = (PICTURES, PICTURE_WORDS, PICTURE_TOKENS, SOUNDS, SOUND_WORDS, SOUND_TOKENS, KNOWN_WORDS)
_MOST_THREADS = 4


class FileNote(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One file: its size and its hex SHA-256."""

    bytes: int
    sha256: str


class PictureNote(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The towers of pictures and their words.

    Attributes:
        source: the published model that they were made from.
        revision: of the hub's repository; ``""`` where they were made from a folder that does not say it.
        source_sha256: of its weights.
        licence: of the weights.
        dim: of a feature.
        patch: edge of a patch, pixels.
        grid: position embeddings along one side.
        short_side: shorter side of the picture that the tower sees, pixels.
        logit_scale: by how much cosines count.
        prompts: sentences round the name of a thing.
        view_prompts: sentences round the name of a room.
        most_tokens: of a text.
    """

    source: str
    revision: str
    source_sha256: str
    licence: str
    dim: int
    patch: int
    grid: int
    short_side: int
    logit_scale: float
    prompts: tuple[str, ...]
    view_prompts: tuple[str, ...]
    most_tokens: int


class MelNote(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The spectrogram that the tower of sounds sees; see ``mel.log_mel``."""

    rate_hz: int
    window: int
    fft: int
    hop: int
    bands: int
    lowest_hz: float
    highest_hz: float


class SoundNote(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The towers of sounds and their words; attributes as of ``PictureNote``."""

    source: str
    revision: str
    source_sha256: str
    licence: str
    dim: int
    logit_scale: float
    prompts: tuple[str, ...]
    most_tokens: int
    mel: MelNote


class Manifest(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All that must be known of the files.

    Attributes:
        format: of the folder; this release reads 1.
        id: the name and version of the whole.
        files: by name.
        pictures: see ``PictureNote``.
        sounds: see ``SoundNote``.
        measured: figures of the export, float against small weights.
    """

    format: int
    id: str
    files: dict[str, FileNote]
    pictures: PictureNote
    sounds: SoundNote
    measured: dict[str, float] = {}


@dataclass(frozen=True, eq=False)
class Bundle:
    """The folder of the files.

    Attributes:
        folder: where they lie.
        manifest: what they are.
    """

    folder: Path
    manifest: Manifest

    def path(self, name: str) -> Path:
        """Return where a file lies, after a check that it is the one of the manifest.

        Raises:
            BackendError: it is missing, or another file.
        """
        path, note = self.folder / name, self.manifest.files[name]
        try:
            size = path.stat().st_size
            right = size == note.bytes and remembered_sha256(path) == note.sha256
        except OSError as fault:
            raise BackendError(
                f"{path} cannot be read ({fault.strerror or fault}); get the files again with: {HOW_TO_GET}"
            ) from fault
        if not right:
            raise BackendError(
                f"{path} is not the file that {MANIFEST} describes ({size:,} bytes for {note.bytes:,}, or another "
                f"checksum); get the files again with: {HOW_TO_GET}"
            )
        return path

    def session(self, name: str) -> Any:
        """Return a network, ready to run.

        Raises:
            BackendError: the file is missing, another one, or no network that onnxruntime can run.
        """
        path = self.path(name)
        try:
            return open_network(str(path), _MOST_THREADS)
        except Exception as fault:  # onnxruntime raises types of its own
            import onnxruntime

            raise BackendError(
                f"{path} cannot be run by onnxruntime {onnxruntime.__version__} ({type(fault).__name__}); update "
                f"onnxruntime, or get the files again with: {HOW_TO_GET}"
            ) from fault

    def checksum(self, *names: str, constants: tuple[str, ...] = ()) -> str:
        """Return the hex SHA-256 of some of the files and of constants that matter as much.

        Raises:
            BackendError: a file is missing or another one.
        """
        return checksum_of([self.path(name) for name in names], *constants)


def open_bundle(model: str = MODEL) -> Bundle:
    """Return the files of a name, or of a folder, with a manifest that holds together.

    Raises:
        BackendError: they are not here, or the manifest is damaged or of another release.
    """
    looked = folders_of(model)
    for folder in looked:
        if (folder / MANIFEST).is_file():
            return _opened(folder.absolute(), (folder / MANIFEST).stat().st_mtime_ns)
    raise BackendError(
        f"The model {model} is not here (looked in {', '.join(map(str, looked[:-1]))} and {looked[-1]}); get it with: "
        f"{HOW_TO_GET} (how to make it: docs/guides/light.md)"
    )


@lru_cache(maxsize=4)
def _opened(folder: Path, changed_ns: int) -> Bundle:
    return Bundle(folder, read_manifest(folder / MANIFEST))


def read_manifest(path: Path) -> Manifest:
    """Return a manifest.

    Raises:
        BackendError: it cannot be read, or names files that are not of this profile.
    """
    try:
        return parse_manifest(read_regular(path, DESCRIPTION_BYTES), str(path))
    except OSError as fault:
        raise BackendError(
            f"{path} cannot be read ({fault.strerror or fault}); get the files again with: {HOW_TO_GET}"
        ) from fault


def parse_manifest(content: bytes, said: str) -> Manifest:
    """Return a manifest from its bytes.

    Raises:
        BackendError: it is no manifest of this profile, or one of another release.
    """
    try:
        made: Manifest = decode_json(content, Manifest)
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise BackendError(f"{said} is no manifest of the profile light ({fault}); get the files again.") from fault
    if made.format != FORMAT:
        raise BackendError(
            f"{said} has the format {made.format}, and this release reads {FORMAT}; update avlmaps, or get other files."
        )
    if set(made.files) != set(FILES):
        raise BackendError(
            f"{said} names the files {', '.join(sorted(made.files))}, expected are {', '.join(sorted(FILES))}; get the "
            "files again."
        )
    return made
