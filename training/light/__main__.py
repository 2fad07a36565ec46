"""Make the files of the profile ``light``: ``python -m training.light --out DIR [--models DIR]``."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
import tyro
from training.light.export import export_pictures, export_sounds, write_manifest, write_words

from avlmaps.core.errors import BackendError
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps_models.light.bundle import MODEL


@dataclass(frozen=True)
class Options:
    """What to make."""

    out: Path
    """Folder of the files: they are written into DIR/avlmaps/light-1."""
    models: Path | None = None
    """Folder of models, searched before the hub's cache."""
    pictures: str = "google/tipsv2-b14"
    """TIPSv2 that sees: a hub's id or a folder."""
    sounds: str = "laion/clap-htsat-unfused"
    """CLAP without fusion, for sounds."""
    short_side: int = 336
    """Shorter side of the picture that the tower sees, pixels."""
    text_bits: Literal[4, 8] = 4
    """Bits of the text towers' weights. With 8 all files together take about 360 MB: allow them by --most-mb."""
    most_mb: float = 250.0
    """Refuse files that are larger together."""
    least_kept: float = 0.95
    """Refuse files that keep less of float's ranking, for phrases of the lexicon."""
    most_phrases: int | None = None
    """Phrases of each table of words; all names and synonyms of the lexicon if none."""
    photos: Path | None = None
    """Folder of pictures to compare float with small weights on; made-up ones if none."""
    seed: int = 0
    """Of the pictures and sounds that are made up."""


def main(options: Options) -> int:
    """Make them; return the exit status."""
    out = options.out / MODEL
    out.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(options.seed)
    pictures = read_pictures(options.photos) if options.photos else [made_up_picture(rng) for _ in range(12)]
    bits, most = options.text_bits, options.most_phrases
    try:
        with using_models(ModelSettings(folder=options.models, device="cpu")):
            seen = export_pictures(options.pictures, out, options.short_side, bits, pictures, most)
            heard = export_sounds(options.sounds, out, bits, [made_up_sound(rng) for _ in range(24)], most)
    except (BackendError, ValueError) as fault:
        print(f"refused: {fault}", file=sys.stderr)
        return 1
    write_words(out, (seen, heard))
    manifest = write_manifest(out, seen, heard)
    measured = {**seen.measured, **heard.measured}
    for what, figures in measured.items():
        print(
            f"{what}: cosine {figures.cosine:.4f}, order of the phrases {figures.phrases:.4f}, of the items "
            f"{figures.items:.4f}, best phrase the same {figures.first:.3f}"
        )
    sizes = {name: note.bytes / 1e6 for name, note in manifest.files.items()}
    for name, size in sizes.items():
        print(f"{name}: {size:.1f} MB")
    print(f"together: {sum(sizes.values()):.1f} MB in {out}")
    refused = [what for what in ("patches", "sounds") if measured[what].kept < options.least_kept]
    if refused:
        print(f"refused: {', '.join(refused)}: less than {options.least_kept} of float's ranking", file=sys.stderr)
    if sum(sizes.values()) > options.most_mb:
        print(f"refused: more than {options.most_mb:g} MB", file=sys.stderr)
        refused.append("size")
    if refused:
        (out / "manifest.json").unlink()
    return 1 if refused else 0


def read_pictures(folder: Path) -> list[np.ndarray]:
    """Return the pictures of a folder, RGB."""
    paths = [path for path in sorted(folder.iterdir()) if path.suffix.lower() in (".jpg", ".jpeg", ".png")]
    read = [cv2.imread(str(path)) for path in paths]
    return [cv2.cvtColor(picture, cv2.COLOR_BGR2RGB) for picture in read if picture is not None]


def made_up_picture(rng: np.random.Generator, size: tuple[int, int] = (640, 480)) -> np.ndarray:
    """Return a picture of random shapes over a random slope of colours."""
    corners = rng.integers(0, 256, (2, 2, 3)).astype(np.float32)
    rgb = np.clip(cv2.resize(corners, size, interpolation=cv2.INTER_LINEAR), 0, 255).astype(np.uint8)
    for _ in range(120):
        centre, half = rng.integers(0, size).tolist(), (4 + rng.exponential(30, 2)).astype(int).tolist()
        cv2.ellipse(rgb, centre, half, rng.uniform(0, 180), 0, 360, rng.integers(0, 256, 3).tolist(), -1, cv2.LINE_AA)
    return rgb


def made_up_sound(rng: np.random.Generator, seconds: float = 4.0, rate_hz: int = 48_000) -> np.ndarray:
    """Return tones and noise that come and go."""
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    swell = np.interp(t, np.linspace(0, seconds, 12), rng.uniform(0, 1, 12) ** 3)
    pitches = rng.uniform(80.0, 8000.0, rng.integers(1, 6))
    tones = sum(0.2 * np.sin(2 * np.pi * pitch * t) for pitch in pitches)
    return (swell * tones + rng.uniform(0.0, 0.1) * rng.standard_normal(len(t))).astype(np.float32)


if __name__ == "__main__":
    sys.exit(main(tyro.cli(Options)))
