"""A tiny random Wav2CLIP in the layout of Wav2CLIP.pt, and the CLIP that its words come from."""

from pathlib import Path

import torch

from tiny.audioclip import layout
from tiny.clip import DIM, write_clip

MODEL, WORDS = "Wav2CLIP.pt", "openai/clip-vit-base-patch32"


def write_wav2clip(folder: Path, tiny: bool = True) -> None:
    """Write both where they are looked for; training's own tensors are in the file, too.

    Args:
        folder: of models.
        tiny: else the published sizes; a CLIP must lie there already then.
    """
    state = tiny_state(tiny)
    dim = DIM if tiny else 512
    state["image_transform.sequential.0.weight"] = torch.zeros(dim, dim)
    state["loss_fn_a.logit_scale"] = torch.tensor(2.66)
    torch.save(state, folder / MODEL)
    if not (folder / WORDS).exists():
        write_clip(folder, WORDS)


def tiny_state(tiny: bool = True) -> dict[str, torch.Tensor]:
    """Return the two parts that hear, with the published names."""
    generator = torch.Generator().manual_seed(6)
    shapes = layout("wav2clip").items()
    return {key: _values(key, _small(key, shape) if tiny else shape, generator) for key, shape in shapes}


def _small(key: str, shape: tuple[int, ...]) -> tuple[int, ...]:
    if key.endswith("spectrogram.window"):
        return shape
    return tuple(size * DIM // 512 if size >= 64 else size for size in shape)


def _values(key: str, shape: tuple[int, ...], generator: torch.Generator) -> torch.Tensor:
    noise = torch.randn(shape, generator=generator)
    if key.endswith("spectrogram.window"):
        return torch.hann_window(shape[0])
    if key.endswith("num_batches_tracked"):
        return torch.tensor(1000)
    if key.endswith("running_var"):
        return (1.0 + 0.3 * noise).abs()
    if key.endswith("weight") and len(shape) == 1:
        return 1.0 + 0.2 * noise
    fan_in = max(1, int(torch.tensor(shape[1:]).prod())) if len(shape) > 1 else 10
    return noise * fan_in**-0.5
