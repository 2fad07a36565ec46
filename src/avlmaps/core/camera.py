"""Pinhole cameras: OpenCV axes (x right, y down, z forward), the centre of pixel (u, v) at (u + 0.5, v + 0.5)."""

from dataclasses import dataclass, field

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AskError
from avlmaps.core.numbers import as_number, as_whole

# Focal lengths and principal points beyond this many image sizes are mistakes, and would overflow further on.
_MOST_SIZES = 1e6
_MOST_PIXELS = 1 << 28


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A pinhole camera without distortion: focal lengths and principal point, and the image's size, in pixels.

    The middle of the image is at ``(width / 2, height / 2)``.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    width: int
    height: int

    def __post_init__(self) -> None:
        given = (self.fx, self.fy, self.cx, self.cy, self.width, self.height)
        held = (*(as_number(number) for number in given[:4]), *(as_whole(number) for number in given[4:]))
        for name, number in zip(("fx", "fy", "cx", "cy", "width", "height"), held, strict=True):
            if number is None:
                what = "a whole number of pixels" if name in ("width", "height") else "a number"
                raise ValueError(f"a camera needs {what} for {name}, not {getattr(self, name)!r}")
            object.__setattr__(self, name, number)
        numbers = (self.fx, self.fy, self.cx, self.cy)
        if not np.isfinite(numbers).all() or self.fx <= 0 or self.fy <= 0:
            raise ValueError(f"a camera needs finite numbers and positive focal lengths, not {numbers}")
        if self.width < 1 or self.height < 1:
            raise ValueError(f"a camera needs at least one pixel, not {self.width}x{self.height}")
        if self.width * self.height > _MOST_PIXELS:
            raise ValueError(f"a camera of {self.width}x{self.height} pixels is larger than any that is known")
        most = _MOST_SIZES * max(self.width, self.height)
        if max(abs(number) for number in numbers) > most or min(self.fx, self.fy) < 1.0 / _MOST_SIZES:
            raise ValueError(f"{numbers} cannot be fx, fy, cx, cy of a {self.width}x{self.height} picture")

    @property
    def matrix(self) -> Float[np.ndarray, "3 3"]:
        """The calibration matrix K."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def resized(self, width: int, height: int) -> "Pinhole":
        """Return the camera of the same picture sampled at another size."""
        sx, sy = width / self.width, height / self.height
        return Pinhole(self.fx * sx, self.fy * sy, self.cx * sx, self.cy * sy, width, height)

    def shaped(self, width: int, height: int) -> bool:
        """Return whether a picture of that size has this camera's shape."""
        most = max(width, height, self.width, self.height)
        return abs(width * self.height - height * self.width) <= most

    def project(self, points_camera: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 2"]:
        """Return image coordinates (u, v) in pixels of points in front of the camera (z > 0), in metres."""
        z = points_camera[..., 2]
        u = self.fx * points_camera[..., 0] / z + self.cx
        v = self.fy * points_camera[..., 1] / z + self.cy
        return np.stack([u, v], axis=-1)

    def rays(self) -> Float[np.ndarray, "h w 3"]:
        """Return for each pixel's centre the camera-frame direction with z = 1."""
        x = (np.arange(self.width) + 0.5 - self.cx) / self.fx
        y = (np.arange(self.height) + 0.5 - self.cy) / self.fy
        grid = np.ones((self.height, self.width, 3))
        grid[..., 0], grid[..., 1] = x[None, :], y[:, None]
        return grid

    def backproject(self, depth_m: Float[np.ndarray, "h w"]) -> Float[np.ndarray, "h w 3"]:
        """Return camera-frame points, in metres, of a z-depth image; depth 0 gives the origin."""
        if depth_m.shape != (self.height, self.width):
            raise ValueError(f"depth has shape {depth_m.shape}; this camera has {(self.height, self.width)}")
        return self.rays() * depth_m[..., None]


@dataclass(frozen=True, slots=True)
class Rig:
    """The colour and the depth camera of a robot, and how they sit to one another.

    The pose of a frame is that of the depth camera. ``rgb_from_depth`` is the identity where depth was registered to
    colour.
    """

    rgb: Pinhole
    depth: Pinhole
    rgb_from_depth: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))

    @property
    def registered(self) -> bool:
        """Whether a depth pixel and the colour pixel at the same place of the picture see the same thing."""
        own, other = self.rgb, self.depth.resized(self.rgb.width, self.rgb.height)
        same_view = np.allclose([own.fx, own.fy, own.cx, own.cy], [other.fx, other.fy, other.cx, other.cy], rtol=1e-9)
        return bool(same_view) and np.array_equal(self.rgb_from_depth, np.eye(4))


def intrinsics_of(text: str) -> tuple[float, float, float, float]:
    """Read ``fx,fy,cx,cy`` in pixels. ``AskError``: no camera has them."""
    try:
        fx, fy, cx, cy = (float(word) for word in text.split(","))
        Pinhole(fx, fy, cx, cy, width=1, height=1)
    except ValueError:
        raise AskError(f"Intrinsics are fx,fy,cx,cy in pixels, such as 525,525,320,240; not {text[:80]!r}.") from None
    return fx, fy, cx, cy
