"""How the published code looks at a picture with LSeg: resized, padded, in overlapping windows that are averaged.

The longer side becomes 520 pixels; where the shorter is below 480 the picture is padded to it (below and at the right,
with black); windows of 480 pixels start every 320, the last ones cut off at the picture's edge and padded again. Each
window's features, half its size, are doubled bilinearly, and where windows overlap their features are averaged. All
resizing puts corner on corner (``align_corners``). The result has a feature for each pixel of the resized picture
before padding, 520x390 for 640x480; nothing is resized back.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Int, UInt8
from torch.nn import functional

WINDOW, LONG_SIDE = 480, 520
STRIDE = WINDOW * 2 // 3
_BLACK = -1.0  # of a picture in [-1, 1]


@dataclass(frozen=True, slots=True)
class Windows:
    """A picture cut into windows.

    Attributes:
        pixels: (n, 3, 480, 480) in [-1, 1].
        corners: the row and column in the padded picture at which each window starts.
        size: (height, width) of the resized picture.
        padded: the same with the padding.
    """

    pixels: torch.Tensor
    corners: tuple[tuple[int, int], ...]
    size: tuple[int, int]
    padded: tuple[int, int]


def resized_size(height: int, width: int) -> tuple[int, int]:
    """Return the (height, width) at which the published code looks at a picture."""
    if height > width:
        return LONG_SIDE, max(1, int(width * LONG_SIDE / height + 0.5))
    return max(1, int(height * LONG_SIDE / width + 0.5)), LONG_SIDE


def cut_into_windows(rgb: UInt8[np.ndarray, "h w 3"], device: torch.device) -> Windows:
    """Resize, pad and cut a picture."""
    picture = torch.from_numpy(np.ascontiguousarray(rgb)).to(device).permute(2, 0, 1)[None].float() / 255.0
    size = resized_size(*rgb.shape[:2])
    picture = functional.interpolate((picture - 0.5) / 0.5, size, mode="bilinear", align_corners=True)
    picture = _padded_to_window(picture)
    height, width = picture.shape[-2:]
    corners = tuple((top, left) for top in _starts(height) for left in _starts(width))
    cut = [picture[..., top : top + WINDOW, left : left + WINDOW] for top, left in corners]
    return Windows(torch.cat([_padded_to_window(window) for window in cut]), corners, size, (height, width))


def joined(
    windows: Windows, features: torch.Tensor, rows: Int[np.ndarray, " r"], columns: Int[np.ndarray, " c"]
) -> torch.Tensor:
    """Return the published code's features at some pixels of the resized picture, (r, c, d) in float32.

    Args:
        windows: the picture.
        features: (n, d, 240, 240) of each window.
        rows: which rows of the resized picture, rising.
        columns: which columns, rising.
    """
    device = features.device
    total = torch.zeros((features.shape[1], len(rows), len(columns)), device=device)
    count = torch.zeros((len(rows), len(columns)), device=device)
    for (top, left), of_window in zip(windows.corners, features, strict=True):
        down, across = _inside(rows, top), _inside(columns, left)
        if down.start == down.stop or across.start == across.stop:
            continue
        doubled = _doubled_at(of_window.float(), rows[down] - top, 1)
        total[:, down, across] += _doubled_at(doubled, columns[across] - left, 2)
        count[down, across] += 1.0
    return (total / count).permute(1, 2, 0)


def every_nth(size: tuple[int, int], n: int) -> tuple[Int[np.ndarray, " r"], Int[np.ndarray, " c"]]:
    """Return rows and columns of a resized picture: about every n-th, spread evenly over the whole picture."""
    height, width = size
    return _spread(height, -(-height // n)), _spread(width, -(-width // n))


def _spread(length: int, count: int) -> Int[np.ndarray, " n"]:
    """Return the pixels at the middles of ``count`` equal parts."""
    return ((2 * np.arange(count) + 1) * length) // (2 * count)


def _starts(length: int) -> Sequence[int]:
    """Return where windows start along a side that is at least one window long."""
    return range(0, -(-(length - WINDOW) // STRIDE) * STRIDE + 1, STRIDE)


def _padded_to_window(picture: torch.Tensor) -> torch.Tensor:
    height, width = picture.shape[-2:]
    missing = (0, max(0, WINDOW - width), 0, max(0, WINDOW - height))
    return functional.pad(picture, missing, value=_BLACK)


def _inside(pixels: Int[np.ndarray, " n"], start: int) -> slice:
    first, end = np.searchsorted(pixels, (start, start + WINDOW))
    return slice(int(first), int(end))


def _doubled_at(features: torch.Tensor, pixels: Int[np.ndarray, " n"], axis: int) -> torch.Tensor:
    """Return features at some pixels of the window, by bilinear interpolation along one axis, corner on corner."""
    known = features.shape[axis]
    places = pixels.astype(np.float32) * (np.float32(known - 1) / np.float32(WINDOW - 1))
    before = np.minimum(places.astype(np.int64), known - 1)
    share = torch.from_numpy(places - before.astype(np.float32)).to(features.device)
    share = share.reshape([-1 if i == axis else 1 for i in range(features.ndim)])
    near, far = (torch.from_numpy(i).to(features.device) for i in (before, np.minimum(before + 1, known - 1)))
    return features.index_select(axis, near) * (1.0 - share) + features.index_select(axis, far) * share
