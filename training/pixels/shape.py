"""The channels of ``perception/embedded/scene_network.py`` for a whole batch, computed where the network is."""

import torch
from torch import Tensor
from torch.nn import functional

from avlmaps.perception.embedded.scene_network import CHANNELS

_LARGEST_STEP, _REACH_PX = 0.06, 3  # as in the running system's loop


def channels_of(depth_m: Tensor, camera: Tensor, multiple: int) -> Tensor:
    """Return the geometry of depth pictures, zero in the margin and (but for the rise of the ray) where depth is none.

    Args:
        depth_m: (n, h, w) z-depth, 0 where there is none.
        camera: (n, 8) fx, fy, cx, cy, the unit vector up, the height over the floor.
        multiple: h and w are padded to multiples of this.

    Returns:
        (n, 8, h', w'); they agree with ``channels`` but where a step is as large as an edge's to the last bits.
    """
    n, h, w = depth_m.shape
    device, z = depth_m.device, depth_m
    fx, fy, cx, cy = camera[:, :4].T[..., None, None]
    up, height = camera[:, 4:7], camera[:, 7, None, None]
    column = torch.arange(w, device=device)[None, None] + 0.5 - cx
    row = torch.arange(h, device=device)[None, :, None] + 0.5 - cy
    x, y = column / fx, row / fy
    ux, uy, uz = up.T[..., None, None]
    rise = ux * x + uy * y + uz
    there = z > 0.0

    wide = functional.pad(z, (_REACH_PX,) * 4)

    def along(dr: int, dc: int) -> tuple[Tensor, Tensor]:
        """Return how many pixels away the same surface still is, and its depth there."""
        reach, depth = torch.zeros_like(z), z
        for step in (1, _REACH_PX):
            r, c = _REACH_PX + dr * step, _REACH_PX + dc * step
            other = wide[:, r : r + h, c : c + w]
            same = (other > 0.0) & ((other - z).abs() < _LARGEST_STEP * z)
            reach, depth = torch.where(same, float(step), reach), torch.where(same, other, depth)
        return reach, depth

    (left, z_left), (right, z_right) = along(0, -1), along(0, 1)
    (above, z_above), (below, z_below) = along(-1, 0), along(1, 0)
    ax, az = ((column + right) * z_right - (column - left) * z_left) / fx, z_right - z_left
    by, bz = ((row + below) * z_below - (row - above) * z_above) / fy, z_below - z_above
    ay, bx = y * az, x * bz
    normal = by * az - bz * ay, bz * ax - bx * az, bx * ay - by * ax
    length = (normal[0].square() + normal[1].square() + normal[2].square()).sqrt()
    facing = torch.where(normal[0] * x + normal[1] * y + normal[2] > 0.0, -1.0, 1.0)
    known = there & (left + right > 0.0) & (above + below > 0.0)
    scale = torch.where(known, facing / length.clamp_min(1e-30), 0.0)
    size = (z.clamp_min(1e-6) / (0.5 * (fx + fy))).log() + 4.6
    shown = torch.where(there, size, 0.0), 0.25 * z, torch.where(there, (height + z * rise).clamp(-1.0, 4.0), 0.0)
    out = z.new_zeros(n, CHANNELS, h + -h % multiple, w + -w % multiple)
    inside = out[:, :, :h, :w]
    for channel, value in enumerate(shown):
        inside[:, channel] = value
    for channel, axis in enumerate((up, *_level_axes(up)), len(shown)):
        a, b, c = axis.T[..., None, None]
        inside[:, channel] = (normal[0] * a + normal[1] * b + normal[2] * c) * scale
    inside[:, 6] = there
    inside[:, 7] = rise / (x.square() + y.square() + 1.0).sqrt()
    return out


def _level_axes(up: Tensor) -> tuple[Tensor, Tensor]:
    ahead = torch.where(up[:, 2:].abs() < 0.99, up.new_tensor([0.0, 0.0, 1.0]), up.new_tensor([0.0, -1.0, 0.0]))
    forward = functional.normalize(ahead - up * (up * ahead).sum(dim=1, keepdim=True), dim=1)
    return torch.linalg.cross(forward, up), forward
