"""From published checkpoints to the files of the profile ``light``."""

import tempfile
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import torch
from training.light.parity import Parity, parity
from training.light.quantise import Bits, quantise
from training.light.tokenizers import write_tokens
from training.light.towers import PictureTower, PictureWords, SoundTower, SoundWords

from avlmaps.core.files import sha256_of_file
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.perception.models import public_name
from avlmaps_models.common.checksums import checksum_of, weights_in
from avlmaps_models.common.pretrained import load_helper, load_pretrained, pretrained_folder
from avlmaps_models.common.prompts import AREA_PROMPTS, TIPS_PROMPTS, clean, mean_direction
from avlmaps_models.common.sound_scores import OTHERS
from avlmaps_models.foundation.clap import PROMPT as SOUND_PROMPT
from avlmaps_models.light import bundle as files
from avlmaps_models.light.sounds import log_mel
from avlmaps_models.light.tokens import Tokens
from avlmaps_models.light.tower import interpolation, resized

_CPU = torch.device("cpu")
_OPSET = 17
_MOST_SOUND_TOKENS = 77
_LEAST_WORDS = 128  # phrases of new words whose small vectors are compared with float's


@dataclass(frozen=True)
class Made:
    """One exported model.

    Attributes:
        note: for the manifest.
        words: the tables of phrases and their float vectors, by module.
        measured: figures, float against small weights, by what was compared.
    """

    note: Any
    words: dict[str, tuple[list[str], np.ndarray]]
    measured: dict[str, Parity]


def export_pictures(
    model: str,
    out: Path,
    short_side: int,
    text_bits: Bits,
    pictures: Sequence[np.ndarray],
    most_phrases: int | None = None,
) -> Made:
    """Write the towers of pictures and of their words.

    Args:
        model: hub id or folder of a TIPSv2.
        out: folder of the files.
        short_side: shorter side of the picture that the tower sees, pixels.
        text_bits: of the text tower's weights.
        pictures: (h, w, 3) uint8, to compare float with small weights on.
        most_phrases: of each table of words.
    """
    from transformers import Tipsv2Model, Tipsv2Tokenizer

    folder = pretrained_folder(model)
    network: Any = load_pretrained(Tipsv2Model, folder, model, _CPU, torch.float32)
    tokenizer = load_helper(Tipsv2Tokenizer, folder, model)
    most = int(network.config.text_config.max_position_embeddings)
    patch = int(network.config.vision_config.patch_size)
    things, rooms = (phrases_of(kind)[:most_phrases] for kind in (EntryKind.THING, EntryKind.ROOM))
    sentences = [*_sentences(things, TIPS_PROMPTS), *_sentences(rooms, AREA_PROMPTS)]
    tokens = write_tokens(tokenizer, out / files.PICTURE_TOKENS, most, sentences)

    tower, reader = PictureTower(network.vision_model).eval(), PictureWords(network.text_model).eval()
    shape = {"pixels": {2: "height", 3: "width"}, "rows": {0: "h"}, "columns": {0: "w"}, "patches": {0: "patches"}}
    given = (torch.zeros(1, 3, 2 * patch, 3 * patch), torch.ones(2, tower.grid), torch.ones(3, tower.grid))
    _write(tower, given, ["pixels", "rows", "columns"], ["patches", "view"], shape, out / files.PICTURES, 8)
    _write_text(reader, out / files.PICTURE_WORDS, text_bits)

    words = {
        "pixels": (things, _vectors(reader, tokens, things, TIPS_PROMPTS)),
        "views": (rooms, _vectors(reader, tokens, rooms, AREA_PROMPTS)),
    }
    note = files.PictureNote(
        source=public_name(model),
        revision=revision_of(folder),
        source_sha256=checksum_of(weights_in(folder)),
        licence="Apache-2.0",
        dim=int(network.config.vision_config.hidden_size),
        patch=patch,
        grid=tower.grid,
        short_side=short_side,
        logit_scale=1.0 / float(network.temperature.detach()),
        prompts=TIPS_PROMPTS,
        view_prompts=AREA_PROMPTS,
        most_tokens=most,
    )
    given_all = [_picture_input(rgb, note) for rgb in pictures]
    exact = [tuple(part.numpy() for part in _run(tower, *map(torch.from_numpy, row.values()))) for row in given_all]
    session = _session(out / files.PICTURES)
    small = [session.run(["patches", "view"], row) for row in given_all]
    some = _some(things)
    new = _small_vectors(out / files.PICTURE_WORDS, tokens, [things[i] for i in some], TIPS_PROMPTS)
    known = words["pixels"][1]
    patches = np.concatenate([row[0] for row in exact]), np.concatenate([row[0] for row in small])
    views = np.stack([row[1] for row in exact]), np.stack([row[1] for row in small])
    measured = {
        "patches": parity(*patches, known, _as_stored(known)),
        "patches with new words": parity(*patches, known[some], new),
        "new words of pictures": parity(known[some], new, patches[0][:: max(1, len(patches[0]) // 512)]),
    }
    if len(pictures) > 2:
        measured["views"] = parity(*views, words["views"][1], _as_stored(words["views"][1]))
    return Made(note, words, measured)


def export_sounds(
    model: str, out: Path, text_bits: Bits, sounds: Sequence[np.ndarray], most_phrases: int | None = None
) -> Made:
    """Write the towers of sounds and of their words.

    Args:
        model: hub id or folder of a CLAP without fusion.
        out: folder of the files.
        text_bits: of the text tower's weights.
        sounds: samples at the model's rate, at most a window, to compare float with small weights on.
        most_phrases: of the table of words.

    Raises:
        ValueError: it is a CLAP with fusion, which draws crops at random.
    """
    from transformers import AutoTokenizer, ClapFeatureExtractor, ClapModel

    folder = pretrained_folder(model)
    network: Any = load_pretrained(ClapModel, folder, model, _CPU, torch.float32)
    if network.config.audio_config.enable_fusion:
        raise ValueError(f"{model} is a CLAP with fusion; choose one without, such as laion/clap-htsat-unfused.")
    tokenizer = load_helper(AutoTokenizer, folder, model)
    heard = load_helper(ClapFeatureExtractor, folder, model)
    mel = files.MelNote(
        rate_hz=int(heard.sampling_rate), window=int(heard.nb_max_samples), fft=int(heard.fft_window_size),
        hop=int(heard.hop_length), bands=int(heard.feature_size), lowest_hz=float(heard.frequency_min),
        highest_hz=float(heard.frequency_max),
    )  # fmt: skip
    phrases = phrases_of(EntryKind.SOUND)[:most_phrases]
    tokens = write_tokens(tokenizer, out / files.SOUND_TOKENS, _MOST_SOUND_TOKENS, _sentences(phrases, (SOUND_PROMPT,)))

    tower, reader = SoundTower(network).eval(), SoundWords(network).eval()
    frames = mel.window // mel.hop + 1
    _write(tower, (torch.zeros(1, 1, frames, mel.bands),), ["mels"], ["feature"], {}, out / files.SOUNDS, 8)
    _write_text(reader, out / files.SOUND_WORDS, text_bits)

    words = {"sounds": (phrases, _vectors(reader, tokens, phrases, (SOUND_PROMPT,)))}
    note = files.SoundNote(
        source=public_name(model),
        revision=revision_of(folder),
        source_sha256=checksum_of(weights_in(folder)),
        licence="Apache-2.0",
        dim=int(network.config.projection_dim),
        logit_scale=float(network.logit_scale_a.detach().exp()),
        prompts=(SOUND_PROMPT,),
        most_tokens=_MOST_SOUND_TOKENS,
        mel=mel,
    )
    mels = [log_mel(samples, mel)[None, None] for samples in sounds]
    session = _session(out / files.SOUNDS)
    exact = np.stack([_run(tower, torch.from_numpy(row)).numpy() for row in mels])
    small = np.stack([session.run(None, {"mels": row})[0].reshape(-1) for row in mels])
    some, known = _some(phrases), words["sounds"][1]
    new = _small_vectors(out / files.SOUND_WORDS, tokens, [phrases[i] for i in some], (SOUND_PROMPT,))
    measured = {
        "sounds": parity(exact, small, known, _as_stored(known)),
        "sounds with new words": parity(exact, small, known[some], new),
        "new words of sounds": parity(known[some], new, exact),
    }
    return Made(note, words, measured)


def write_words(out: Path, made: Iterable[Made]) -> None:
    """Write the vectors of all phrases in bytes; only their directions count, so that no scale is stored."""
    arrays: dict[str, np.ndarray] = {}
    for one in made:
        for table, (names, rows) in one.words.items():
            arrays[f"{table}_names"] = np.frombuffer("\n".join(names).encode(), np.uint8)
            arrays[f"{table}_rows"] = in_bytes(rows)
    np.savez(out / files.KNOWN_WORDS, **arrays)  # pyright: ignore[reportArgumentType]


def in_bytes(rows: np.ndarray) -> np.ndarray:
    """Return the directions of vectors in bytes."""
    return np.round(127.0 * rows / np.abs(rows).max(axis=1, keepdims=True)).astype(np.int8)


def _as_stored(rows: np.ndarray) -> np.ndarray:
    """Return unit vectors as they are read back from bytes."""
    back = in_bytes(rows).astype(np.float32)
    return back / np.linalg.norm(back, axis=1, keepdims=True)


def write_manifest(out: Path, pictures: Made, sounds: Made) -> files.Manifest:
    """Write the manifest, last of all: a folder without one is no model."""
    notes = {
        name: files.FileNote((out / name).stat().st_size, sha256_of_file(out / name)) for name in sorted(files.FILES)
    }
    figures = {
        f"{what}: {figure}": round(value, 5)
        for made in (pictures, sounds)
        for what, parity_of in made.measured.items()
        for figure, value in asdict(parity_of).items()
    }
    made = files.Manifest(files.FORMAT, files.MODEL, notes, pictures.note, sounds.note, figures)
    (out / files.MANIFEST).write_bytes(msgspec.json.format(msgspec.json.encode(made), indent=1))
    return made


def revision_of(folder: Path) -> str:
    """Return the revision of a model in the hub's cache, ``""`` for another folder."""
    return folder.name if folder.parent.name == "snapshots" else ""


def phrases_of(kind: EntryKind) -> list[str]:
    """Return the names and synonyms of the lexicon's entries of a kind, as they are looked up; the names first."""
    entries = lexicon().entries(kind)
    names = [*(["other"] if kind is EntryKind.THING else []), *(entry.name for entry in entries)]
    names += [*(OTHERS if kind is EntryKind.SOUND else []), *(name for entry in entries for name in entry.synonyms)]
    return list(dict.fromkeys(map(clean, names)))


def _sentences(phrases: Iterable[str], prompts: Sequence[str]) -> list[str]:
    return [prompt.replace("{}", phrase) for phrase in phrases for prompt in prompts]


def _some(phrases: Sequence[str]) -> list[int]:
    return list(range(0, len(phrases), max(1, len(phrases) // _LEAST_WORDS)))


def _vectors(reader: torch.nn.Module, tokens: Tokens, phrases: Sequence[str], prompts: Sequence[str]) -> np.ndarray:
    """Return the float vectors of phrases, the mean direction over their sentences."""

    def one(text: str) -> np.ndarray:
        return _run(reader, torch.tensor([tokens.encode(text)])).numpy()

    return np.stack([mean_direction(np.stack([one(t) for t in _sentences([phrase], prompts)])) for phrase in phrases])


def _small_vectors(path: Path, tokens: Tokens, phrases: Sequence[str], prompts: Sequence[str]) -> np.ndarray:
    session = _session(path)

    def one(text: str) -> np.ndarray:
        return session.run(None, {"ids": np.array([tokens.encode(text)], np.int64)})[0].reshape(-1)

    return np.stack([mean_direction(np.stack([one(t) for t in _sentences([phrase], prompts)])) for phrase in phrases])


def _picture_input(rgb: np.ndarray, note: files.PictureNote) -> dict[str, np.ndarray]:
    from avlmaps_models.common.picture_sizes import working_size

    height, width = working_size(rgb.shape[0], rgb.shape[1], note.short_side, note.patch)
    return {
        "pixels": resized(rgb, height, width).transpose(2, 0, 1)[None].copy(),
        "rows": interpolation(note.grid, height // note.patch),
        "columns": interpolation(note.grid, width // note.patch),
    }


def _run(network: torch.nn.Module, *given: torch.Tensor) -> Any:
    with torch.inference_mode():
        return network(*given)


def _session(path: Path) -> Any:
    import onnxruntime

    return onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])


def _write_text(reader: torch.nn.Module, path: Path, bits: Bits) -> None:
    _write(reader, (torch.ones(1, 5, dtype=torch.long),), ["ids"], ["feature"], {"ids": {1: "tokens"}}, path, bits)


def _write(
    network: torch.nn.Module,
    given: tuple[torch.Tensor, ...],
    inputs: list[str],
    outputs: list[str],
    sizes: dict[str, dict[int, str]],
    path: Path,
    bits: Bits,
) -> None:
    """Write a network with small weights."""
    with tempfile.TemporaryDirectory() as scratch, torch.no_grad(), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # tracing takes sizes as constants, as it shall
        whole = Path(scratch) / "float.onnx"
        torch.onnx.export(
            network, given, str(whole), input_names=inputs, output_names=outputs, dynamic_axes=sizes,
            opset_version=_OPSET, do_constant_folding=True, dynamo=False,
        )  # fmt: skip
        quantise(whole, path, bits)
