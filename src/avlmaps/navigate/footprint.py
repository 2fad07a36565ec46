"""The ground that a thing covers: its top-down outline, and the places beside, before and between outlines.

Level frame, metres. Nothing here prefers an axis: a world that is turned gives turned answers, a mirrored one mirrored.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
from jaxtyping import Bool, Float, UInt8

from avlmaps.query.floor_plan import in_polygon

# Pairs of points whose distance differs by less are equally near; their middle is taken (two cupboards that face).
_AS_NEAR_M = 0.03
_FINE = 3  # cells of the raster along the edge of a voxel, so that an outline is right to a sixth of a voxel
_MOST_CELLS = 4000


@dataclass(frozen=True, slots=True, eq=False)
class Outline:
    """A polygon on the ground, or a single point."""

    corners: Float[np.ndarray, "k 2"]  # level x and y, counter-clockwise; one row for a point

    def __post_init__(self) -> None:
        if self.corners.ndim != 2 or self.corners.shape[1] != 2 or not len(self.corners):
            raise ValueError(f"an outline has corners of shape (k, 2) with k of 1 or more, not {self.corners.shape}")

    @classmethod
    def at(cls, xy: Float[np.ndarray, "2"]) -> "Outline":
        """Return the outline of a single point."""
        return cls(np.asarray(xy, np.float64).reshape(1, 2))

    @classmethod
    def round(cls, ground: Float[np.ndarray, "n 2"], size_m: float, join_m: float = 0.1) -> "Outline":
        """Return the outline of columns of voxels, gaps up to ``join_m`` filled; of several pieces their hull.

        ``ground`` has the middles of the voxels, level x and y; at least one.
        """
        import cv2

        mask, corner, cell_m = _raster(ground, size_m, join_m)
        found, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        line = found[0] if len(found) == 1 else cv2.convexHull(np.concatenate(found))
        line = cv2.approxPolyDP(line, 1.0, True)
        corners = corner + (line.reshape(-1, 2).astype(np.float64) + 0.5) * cell_m
        return cls(corners if _signed_area_m2(corners) >= 0.0 else corners[::-1])

    def within(self, margin_m: float) -> "Outline | None":
        """Return the outline of what lies so far inside it; None where nothing does."""
        low, high = self.corners.min(axis=0), self.corners.max(axis=0)
        cells = np.stack(np.meshgrid(*map(np.arange, low, high, (0.1, 0.1))), axis=-1).reshape(-1, 2)
        inside = cells[in_polygon(cells, self.corners) & (self._to_edge_m(cells) >= margin_m)]
        return Outline.round(inside, 0.1) if len(inside) else None

    @property
    def centre(self) -> Float[np.ndarray, "2"]:
        """The middle of its area; that of its corners where it has none."""
        area = _signed_area_m2(self.corners)
        if abs(area) < 1e-9:
            return self.corners.mean(axis=0)
        first = self.corners[0]
        a = self.corners - first  # so that a small outline far from the origin loses no digits
        b = np.roll(a, -1, axis=0)
        cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
        return first + ((a + b) * cross[:, None]).sum(axis=0) / (6.0 * area)

    def nearest_to(self, xy: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
        """Return the point of its edge that is nearest to a place."""
        feet = self._feet(np.asarray(xy, np.float64).reshape(1, 2))[0]
        return feet[np.argmin(np.linalg.norm(feet - xy, axis=-1))]

    def distance_m(self, xy: Float[np.ndarray, "2"]) -> float:
        """Return the distance of a place from it; 0 inside."""
        return float(self.distances_m(np.asarray(xy, np.float64).reshape(1, 2))[0])

    def distances_m(self, places: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, " m"]:
        """Return the distance of each place from it; 0 inside."""
        return np.where(in_polygon(places, self.corners), 0.0, self._to_edge_m(places))

    def _to_edge_m(self, places: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, " m"]:
        return np.linalg.norm(self._feet(places) - places[:, None], axis=-1).min(axis=1)

    def before(self, xy: Float[np.ndarray, "2"], distance_m: float) -> Float[np.ndarray, "2"]:
        """Return the place so far from its edge on the straight way to it from a place."""
        edge, away_m = self.nearest_to(xy), self.distance_m(xy)
        return edge + (xy - edge) * (distance_m / away_m if away_m else 0.0)

    def beside(self, direction: Float[np.ndarray, "2"], distance_m: float) -> Float[np.ndarray, "2"]:
        """Return the place in a direction (unit vector) from its middle, so far beyond its outermost corner there."""
        middle = self.centre
        reach = float(((self.corners - middle) @ direction).max())
        return middle + direction * (reach + distance_m)

    def gap_to(self, other: "Outline") -> tuple[Float[np.ndarray, "2"], Float[np.ndarray, "2"]]:
        """Return the nearest points of two edges, the first on this one: of equally near ones their middle."""
        mine, theirs = self._feet(other.corners), other._feet(self.corners)
        here = np.concatenate([mine.reshape(-1, 2), np.repeat(self.corners, theirs.shape[1], axis=0)])
        there = np.concatenate([np.repeat(other.corners, mine.shape[1], axis=0), theirs.reshape(-1, 2)])
        apart = np.linalg.norm(here - there, axis=1)
        best = int(np.argmin(apart))
        near = apart <= apart[best] + _AS_NEAR_M
        a, b = _middle_of(here[near]), _middle_of(there[near])
        # Where the nearest places are several (the two ends of a U), what lies between them is none of them.
        if np.linalg.norm(a - b) > apart[best] + _AS_NEAR_M or self._off_edge(a) or other._off_edge(b):
            return here[best], there[best]
        return a, b

    def _off_edge(self, xy: Float[np.ndarray, "2"]) -> bool:
        return float(np.linalg.norm(self.nearest_to(xy) - xy)) > 2 * _AS_NEAR_M

    def _feet(self, places: Float[np.ndarray, "m 2"]) -> Float[np.ndarray, "m k 2"]:
        a = self.corners
        side = np.roll(a, -1, axis=0) - a
        length = np.maximum((side**2).sum(axis=1), 1e-18)
        share = np.clip(((places[:, None] - a) * side).sum(axis=-1) / length, 0.0, 1.0)
        return a + share[..., None] * side


def middle_between(a: Outline, b: Outline) -> Float[np.ndarray, "2"]:
    """Return the middle between the nearest points of two outlines."""
    here, there = a.gap_to(b)
    return (here + there) / 2


def bearing_rad(start: Float[np.ndarray, "2"], end: Float[np.ndarray, "2"]) -> float | None:
    """Return the heading that looks from a place to another, counter-clockwise from +x; None where they are one."""
    dx, dy = np.asarray(end, np.float64) - np.asarray(start, np.float64)
    return None if float(np.hypot(dx, dy)) < 1e-6 else float(np.arctan2(dy, dx))


def to_the_left(direction: Float[np.ndarray, "2"]) -> Float[np.ndarray, "2"]:
    """Return a direction turned by a quarter counter-clockwise, which is to the left of one who looks along it."""
    return np.array([-direction[1], direction[0]])


def _middle_of(points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "2"]:
    spread = points - points.mean(axis=0)
    axis = np.linalg.eigh(spread.T @ spread)[1][:, -1]
    along = spread @ axis
    return (points[np.argmin(along)] + points[np.argmax(along)]) / 2


def _raster(
    ground: Float[np.ndarray, "n 2"], size_m: float, join_m: float
) -> tuple[UInt8[np.ndarray, "h w"], Float[np.ndarray, "2"], float]:
    """Return a picture of what the voxels cover (row for y), the place of its corner, and the edge of its cells."""
    import cv2

    extent = float(np.ptp(ground, axis=0).max())
    cell_m = max(size_m / _FINE, extent / _MOST_CELLS)
    close = 2 * int(np.ceil(0.5 * join_m / cell_m)) + 1
    margin = close + _FINE
    cell = np.floor(ground / cell_m).astype(np.int64)
    low = cell.min(axis=0) - margin
    width, height = cell.max(axis=0) - low + margin + 1
    mask: Bool[np.ndarray, "h w"] = np.zeros((height, width), np.uint8)
    mask[cell[:, 1] - low[1], cell[:, 0] - low[0]] = 1
    wide = 2 * round((size_m / cell_m - 1) / 2) + 1
    mask = cv2.dilate(mask, np.ones((wide, wide), np.uint8))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (close, close))
    return cast("np.ndarray", cv2.morphologyEx(mask, cv2.MORPH_CLOSE, disc)), low * cell_m, cell_m


def _signed_area_m2(corners: Float[np.ndarray, "k 2"]) -> float:
    x, y = (corners - corners[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
