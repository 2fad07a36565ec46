"""Sounds that a person taught: a name and the features of a few clips, stored in the person's own folder.

One folder each, ``sounds/<slug>/`` with ``sound.json`` and ``features.npy``; nothing is ever unpickled.
"""

import re
import shutil
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import msgspec
import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import AudioError, BackendError
from avlmaps.core.files import replace_atomically, user_path, write_bytes_atomically
from avlmaps.core.registry import Kind, load
from avlmaps.perception.models import user_folder
from avlmaps.perception.protocols import SoundEncoder
from avlmaps.recordings.audio import AudioTrack, Sound

SCHEMA = 1
SILENT_PEAK = 1e-4  # three steps of 16-bit sound
LONGEST_CLIP_S = 600.0
LONGEST_NAME = 80


@dataclass(frozen=True, slots=True)
class TaughtSound:
    """A kind of sound learnt from clips: the unit features of their windows, by the encoder of that id and checksum."""

    name: str
    features: Float32[np.ndarray, "windows d"]
    clips: tuple[str, ...]
    model: str
    checksum: str


class _Notes(msgspec.Struct):
    schema: int
    name: str
    clips: tuple[str, ...]
    model: str
    checksum: str


def sounds_folder(folder: Path | None = None) -> Path:
    """Return the folder of taught sounds."""
    return (user_folder() if folder is None else user_path(folder)) / "sounds"


def teach_sound(
    name: str, clips: Sequence[Path | str | Sound], folder: Path | None = None, encoder: SoundEncoder | None = None
) -> TaughtSound:
    """Learn a new kind of sound from clips, and keep it; a sound of the same name is replaced.

    Args:
        name: as one would ask for it: "our kettle's whistle".
        clips: files or sounds, one at least; three to five different ones serve well.
        folder: a profile folder other than the user's own.
        encoder: the encoder to learn with; the embedded one if None.

    Raises:
        AudioError: a clip cannot be read, is silent or much too long, or there is none.
        BackendError: the name is empty or too long.
    """
    name = " ".join(name.split())
    if not name:
        raise BackendError("A taught sound needs a name; give one, as you would ask for it.")
    if len(name) > LONGEST_NAME:
        raise BackendError(f"The name has {len(name)} characters; choose one of at most {LONGEST_NAME}.")
    if not clips:
        raise AudioError(f"No clips were given to learn {name!r} from; give at least one sound file.")
    used: SoundEncoder = load(Kind.SOUNDS, "embedded") if encoder is None else encoder
    sounds = [_audible(clip) for clip in clips]
    taught = TaughtSound(
        name=name,
        features=np.concatenate([used.encode(sound) for _, sound in sounds]).astype(np.float32),
        clips=tuple(label for label, _ in sounds),
        model=used.card.id,
        checksum=used.card.checksum,
    )
    _keep(taught, sounds_folder(folder))
    return taught


def enrolled_sounds(folder: Path | None = None) -> list[TaughtSound]:
    """Return every sound that was taught, by name; ``BackendError`` names the file of one that is damaged."""
    root = sounds_folder(folder)
    found = [_read(notes) for notes in sorted(root.glob("*/sound.json"))] if root.is_dir() else []
    return sorted(found, key=lambda taught: taught.name.casefold())


def forget_sound(name: str, folder: Path | None = None) -> None:
    """Forget a taught sound; ``BackendError`` where none of that name was taught."""
    place = sounds_folder(folder) / _slug(name)
    if not (place / "sound.json").is_file():
        known = ", ".join(taught.name for taught in enrolled_sounds(folder)) or "none"
        raise BackendError(f"No sound called {name!r} was taught; taught are: {known}.")
    _refuse_link(place)
    (place / "sound.json").unlink()  # first: a folder without notes is not a sound, even with other files left in it
    shutil.rmtree(place)


def _slug(name: str) -> str:
    # A short hash, so that no two names meet.
    folded = " ".join(name.split()).casefold()
    plain = unicodedata.normalize("NFKD", folded).encode("ascii", "ignore").decode()
    return f"{re.sub('[^a-z0-9]+', '-', plain).strip('-')[:40] or 'sound'}-{sha256(folded.encode()).hexdigest()[:8]}"


def _audible(clip: Path | str | Sound) -> tuple[str, Sound]:
    if isinstance(clip, Sound):
        label, sound = "the clip", clip
    else:
        label = Path(clip).name
        track = AudioTrack.open(user_path(clip))
        if track.duration_s > LONGEST_CLIP_S:
            raise AudioError(
                f"{clip} is {track.duration_s:.0f} s long; cut out a piece of at most {LONGEST_CLIP_S:.0f} s "
                "that holds the sound."
            )
        sound = track.read()
    peak = float(np.abs(sound.samples).max(initial=0.0))
    if peak < SILENT_PEAK:  # NaN continues to the encoder, which refuses it
        raise AudioError(
            f"There is nothing to hear in {label} (peak {peak:.6f} of 1); give a clip that holds the sound."
        )
    return label, sound


def _keep(taught: TaughtSound, root: Path) -> None:
    place = root / _slug(taught.name)
    _refuse_link(place)
    place.mkdir(parents=True, exist_ok=True)
    (place / "sound.json").unlink(missing_ok=True)
    with replace_atomically(place / "features.npy") as stream:
        np.save(stream, taught.features, allow_pickle=False)
    notes = msgspec.json.encode(_Notes(SCHEMA, taught.name, taught.clips, taught.model, taught.checksum))
    write_bytes_atomically(place / "sound.json", msgspec.json.format(notes, indent=1))


def _refuse_link(place: Path) -> None:
    if place.is_symlink():
        raise BackendError(f"{place} is a symbolic link; avlmaps writes nothing behind it: remove the link first.")


def _read(notes_file: Path) -> TaughtSound:
    try:
        notes = msgspec.json.decode(notes_file.read_bytes(), type=_Notes)
        if notes.schema != SCHEMA:
            raise BackendError(
                f"{notes_file} has schema {notes.schema}, this version reads {SCHEMA}; teach the sound again."
            )
        features = np.load(notes_file.with_name("features.npy"), allow_pickle=False)
        if features.ndim != 2 or features.dtype != np.float32 or not np.isfinite(features).all():
            raise ValueError(f"features are {features.dtype} of {features.shape}")
        return TaughtSound(notes.name, features, notes.clips, notes.model, notes.checksum)
    except (OSError, ValueError, EOFError) as error:
        raise BackendError(
            f"The taught sound in {notes_file.parent} is damaged ({error}); delete it and teach it again."
        ) from error
