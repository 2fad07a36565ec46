"""A tiny random AudioCLIP in the layout of AudioCLIP-Partial-Training.pt: all its names, small sizes, its pickling."""

from pathlib import Path

import torch

MODEL = "AudioCLIP-Partial-Training.pt"
DIM, TOKENS, TEXT_WIDTH, BINS, WINDOW, STEM, GROUPS = 24, 49408, 32, 129, 200, 8, 4
_LAYOUT = Path(__file__).parent.parent / "layouts" / "audioclip.txt"


def layout(name: str = "audioclip") -> dict[str, tuple[int, ...]]:
    """Return the names and shapes of a published checkpoint."""
    rows = (_LAYOUT.parent / f"{name}.txt").read_text().split("\n")
    pairs = (row.split() for row in rows if row)
    return {key: () if shape == "()" else tuple(map(int, shape.split("x"))) for key, shape in pairs}


def write_audioclip(folder: Path, name: str = MODEL, tiny: bool = True) -> None:
    """Write the checkpoint where ``model_file`` finds it; of the published sizes unless ``tiny``."""
    torch.save(tiny_state(tiny), folder / name)


def tiny_state(tiny: bool = True) -> dict[str, torch.Tensor]:
    """Return a checkpoint with the published names; parameters are pickled as parameters, as in the published file."""
    generator = torch.Generator().manual_seed(5)
    state = {}
    for key, published in layout().items():
        shape = _small(key, published) if tiny else published
        values = _values(key, shape, generator)
        is_buffer = key.endswith(("window", "running_mean", "running_var", "num_batches_tracked"))
        state[key] = values if is_buffer else torch.nn.Parameter(values)
    return state


def _small(key: str, shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the tiny shape of a published one: the towers' widths are divided, what is looked at has one number."""
    if key.startswith("visual."):
        return tuple(1 for _ in shape)
    if not key.startswith("audio."):
        return tuple(DIM if size == 1024 else size * TEXT_WIDTH // 512 if size % 512 == 0 else size for size in shape)
    if key.startswith("audio.fbsp."):
        return tuple(BINS if size else 0 for size in shape)
    if key == "audio.window":
        return (WINDOW,)
    if key.startswith("audio.fc."):
        return (DIM, *(size * STEM // 64 for size in shape[1:]))
    if ".conv2." in key:
        inside = shape[0] * STEM // 64
        return (inside, inside // GROUPS, *shape[2:])
    return tuple(size * STEM // 64 if size >= 64 else size for size in shape)


def _values(key: str, shape: tuple[int, ...], generator: torch.Generator) -> torch.Tensor:
    noise = torch.randn(shape, generator=generator)
    if key.endswith("num_batches_tracked"):
        return torch.tensor(1000)
    if key.startswith("logit_scale"):
        return torch.log(torch.tensor(70.0))
    if key == "audio.window":
        from scipy.signal import get_window

        return torch.from_numpy(get_window("blackmanharris", shape[0])).float()
    if key == "audio.fbsp.fc":
        return torch.arange(shape[0], dtype=torch.float32) + 0.1 * noise
    if key.startswith("audio.fbsp."):
        return (1.0 + 0.3 * noise).abs()  # orders and bandwidths are positive
    if key == "audio.bn1.running_mean":
        return -20.0 + noise  # decibels
    if key.endswith("running_var"):
        return (1.0 + 0.3 * noise).abs() * (400.0 if key == "audio.bn1.running_var" else 1.0)
    if key.endswith("weight") and len(shape) == 1:
        return 1.0 + 0.2 * noise
    fan_in = max(1, int(torch.tensor(shape[1:]).prod())) if len(shape) > 1 else 10
    return noise * (1.0 if "embedding" in key else fan_in**-0.5)
