"""What flat surfaces show of a camera and a drive: a lens, squeezed pictures, a heading that drifts.

Each frame alone shows whether surfaces are flat and meet at right angles, as most of floors, walls and tables do; all
frames show whether walls keep their directions.
"""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.wording import option
from avlmaps.recordings.consistency.flats import Flats, find_flats
from avlmaps.recordings.consistency.levels import Levels
from avlmaps.recordings.consistency.sample import Sample
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Recording

# Normals in the camera's axes, and of lenses the camera's place and direction, that round to the same steps of this are
# one view. Surfaces of one view may be curved, or need not be at right angles.
_VIEW, _FEWEST_VIEWS = 0.3, 2.5
# Bends, in the middle and in the nearer quartile, and of how many surfaces that would count equally. In right
# recordings (20 rendered homes, 18 drawn walks, 19 stretches of a Kinect's walk, 33 times 24 real frames) -0.06 to 0.12
# in the middle; with k1 = -0.2 from 0.20 on in all walks.
_LEAST_BEND, _LEAST_QUARTER, _FEWEST_BENT, _MOST_SURE = 0.17, 0.06, 8.0, 0.75
# Of the square of the radius of a corner: there both conventions of a lens are compared.
_WITHIN = 0.67
# Pairs of surfaces of a frame: nearly at right angles, large, and turned by a change of the focal lengths; logarithms
# of that, and of how many pairs that would count equally. In the same recordings up to 0.04, and 0.15 in depth in steps
# of 4 cm; 0.27 and more where one focal length is wrong by 4/3.
_CROSS, _LARGE, _TURNED, _FEWEST_PAIRS = 0.5, 0.08, 0.15, 6.0
_LEAST_FACTOR, _LEAST_FACTOR_QUARTER, _MOST_LEFT = 0.2, 0.12, 0.35
# Walls: how far off upright, their share of a picture, their number, and how many of six parts of the drive show some.
_UPRIGHT, _WALL, _FEWEST_WALLS, _PARTS, _FEWEST_PARTS = 0.2, 0.06, 24, 6, 5
# Degrees that the heading drifts in the drive, how alike directions are then, and what share of that they are without.
# Simulated odometry drifts by up to 21.
_LEAST_DRIFT_DEG, _MOST_DRIFT_DEG, _ALIKE, _WITHOUT = 25.0, 90, 0.85, 0.9
_AXES = {"fx": (1.0, 0.0, 0.0), "fy": (0.0, 1.0, 0.0), "fx and fy": (1.0, 1.0, 0.0)}


@dataclass(frozen=True, slots=True)
class _Spread:
    """Quartiles of what surfaces or pairs say, each by its weight, and how many would count equally."""

    low: float
    middle: float
    high: float
    count: float
    views: float

    @staticmethod
    def of(
        values: Float[np.ndarray, " n"], weight: Float[np.ndarray, " n"], seen: Float[np.ndarray, "n k"]
    ) -> "_Spread":
        """Return those of values; nearly the same rows of ``seen`` are one view."""
        if not len(values) or not weight.sum() > 0.0:
            return _Spread(0.0, 0.0, 0.0, 0.0, 0.0)
        order = np.argsort(values)
        sums = np.cumsum(weight[order])
        rows = order[np.searchsorted(sums, np.array([0.25, 0.5, 0.75]) * sums[-1])]
        low, middle, high = values[rows].tolist()
        _, view = np.unique((seen / _VIEW).round(), axis=0, return_inverse=True)
        count, views = (float(w.sum() ** 2 / (w @ w)) for w in (weight, np.bincount(view.reshape(-1), weight)))
        return _Spread(low, middle, high, count, views)

    def is_enough(self, fewest: float) -> bool:
        """Return whether there are enough values, not all of one view."""
        return self.count >= fewest and self.views >= _FEWEST_VIEWS

    def beyond(self, least: float, quarter: float) -> bool:
        """Return whether the middle is as far from 0, and its nearer quartile."""
        return (self.middle >= least and self.low >= quarter) or (-self.middle >= least and -self.high >= quarter)


@dataclass(frozen=True, slots=True, eq=False)
class RightAngles:
    """Flat surfaces of a sample, and what they show."""

    sample: Sample
    flats: Flats

    @staticmethod
    def of(sample: Sample) -> "RightAngles":
        """Find them."""
        return RightAngles(sample, find_flats(sample))

    @property
    def lens_would_show(self) -> bool:
        """Whether there are enough surfaces to show a lens."""
        return self._bend().is_enough(_FEWEST_BENT)

    @property
    def squeeze_would_show(self) -> bool:
        """Whether there are enough surfaces at right angles to distinguish fx from fy."""
        return self._factors()["fy"][0].is_enough(_FEWEST_PAIRS)

    def finding(self, recording: Recording, levels: Levels) -> Finding | None:
        """Return what cannot be right, one thing at most."""
        return self.lens() or self._squeezed(recording) or self._drift(levels)

    def _bend(self) -> _Spread:
        sure = self.flats.sure
        most = np.quantile(sure, _MOST_SURE) if len(sure) else 0.0
        camera = self.sample.world_from_camera[self.flats.frame]
        seen = np.hstack([self.flats.normal, camera[:, :3, 2], camera[:, :3, 3]])
        return _Spread.of(self.flats.bend, np.minimum(sure, most), seen)

    def lens(self) -> Finding | None:
        """Return that the distortion of a wide lens was not taken out."""
        bend = self._bend()
        if not bend.is_enough(_FEWEST_BENT) or bend.middle < 0.0 or not bend.beyond(_LEAST_BEND, _LEAST_QUARTER):
            return None
        camera = self.sample.rig.depth
        corner = bend.middle * ((camera.width / 2.0 / camera.fx) ** 2 + (camera.height / 2.0 / camera.fy) ** 2)
        within = 1.0 + corner * _WITHIN
        k1 = (1.0 / within - 1.0) * bend.middle / (within**2 * corner * _WITHIN)
        sentence = (
            f"Flat surfaces are curved in the depth of single frames as behind a wide lens: things lie about "
            f"{corner:.0%} farther out at the corners of the pictures than a pinhole's numbers say, by "
            f"{len(self.flats.bend)} surfaces (k1 about {k1:.2g})."
        )
        remedy = (
            "Take the distortion of the lens out of the colour and the depth pictures, and give the intrinsics of the "
            "new pictures; else walls are bent in the map."
        )
        return Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, remedy)

    def _pairs(self) -> tuple[Float[np.ndarray, "p 3"], Float[np.ndarray, "p 3"], Float[np.ndarray, " p"]]:
        """Return the normals of two surfaces of one frame, and the share of the smaller one."""
        flats = self.flats
        large = flats.share > _LARGE
        pairs = (flats.frame[:, None] == flats.frame) & (large[:, None] & large) & np.tri(len(large), k=-1, dtype=bool)
        one, other = np.nonzero(pairs & (np.abs(flats.normal @ flats.normal.T) < _CROSS))
        return flats.normal[one], flats.normal[other], np.minimum(flats.share[one], flats.share[other])

    def _factors(self) -> dict[str, tuple[_Spread, float, float]]:
        """Return the logarithms of a factor of focal lengths, and by how many degrees pairs are off without and with.

        An angle is that of normals whose x and y grow with the focal lengths.
        """
        one, other, share = self._pairs()
        cross, both = (one * other).sum(axis=1), np.hstack([one, other])
        slopes = {name: 2.0 * (one * other) @ of - cross * ((one**2 + other**2) @ of) for name, of in _AXES.items()}
        by_any = np.stack([np.abs(slope) > _TURNED for slope in slopes.values()]).any(axis=0)
        found: dict[str, tuple[_Spread, float, float]] = {}
        for name, slope in slopes.items():
            turned = np.abs(slope) > _TURNED
            values, weight = -cross[turned] / slope[turned], slope[turned] ** 2 * share[turned]
            spread = _Spread.of(values, weight, both[turned])
            found[name] = spread, _mean_deg(cross[by_any]), _mean_deg((cross + slope * spread.middle)[by_any])
        return found

    def _squeezed(self, recording: Recording) -> Finding | None:
        tried = self._factors()
        sure = [
            (left_deg, axes)
            for axes, (found, off_deg, left_deg) in tried.items()
            if found.is_enough(_FEWEST_PAIRS) and left_deg <= _MOST_LEFT * off_deg
            if found.beyond(_LEAST_FACTOR, _LEAST_FACTOR_QUARTER)
        ]
        if not sure:
            return None
        _, axes = min(sure)
        found, off_deg, left_deg = tried[axes]
        factor, camera = float(np.exp(found.middle)), recording.rig.depth
        fx, fy = (old * factor if name in axes else old for name, old in (("fx", camera.fx), ("fy", camera.fy)))
        sentence = (
            f"Floors, walls and tables do not meet at right angles in single frames: pairs of flat surfaces are off by "
            f"{off_deg:.0f} degrees (their mean), and by {left_deg:.0f} if {axes} were {factor:.2f} times as large."
        )
        size = f"{camera.width}x{camera.height}"
        given = "as the camera" if is_of_program(recording) else f"with {option('intrinsics', 'fx,fy,cx,cy')}"
        what = (
            "The intrinsics are those of other pictures" if " " in axes else "The pictures look squeezed along one axis"
        )
        remedy = f"{what}: give those of the {size} pictures as they are (about fx {fx:.4g}, fy {fy:.4g}) {given}."
        return Finding(Reason.INTRINSICS, Grade.SUSPICIOUS, sentence, remedy)

    def _drift(self, levels: Levels) -> Finding | None:
        stamps_s, turned = self._walls(levels)
        lasted_s = float(np.ptp(self.sample.stamps_s))
        if len(turned) < _FEWEST_WALLS or lasted_s <= 0.0:
            return None
        share = (stamps_s - self.sample.stamps_s.min()) / lasted_s
        if len(np.unique(np.minimum(share * _PARTS, _PARTS - 1).astype(int))) < _FEWEST_PARTS:
            return None
        tried = np.radians(np.arange(-_MOST_DRIFT_DEG, _MOST_DRIFT_DEG + 1))
        alike = np.abs(np.exp(4j * (turned - tried[:, None] * share)).mean(axis=1))
        best = int(alike.argmax())
        drift_deg, without = float(np.degrees(tried[best])), float(alike[_MOST_DRIFT_DEG])
        order = np.exp(4j * turned[np.argsort(share)])
        two = (np.abs(np.cumsum(order)) + np.abs(np.append(np.cumsum(order[::-1])[-2::-1], 0.0))) / len(order)
        if abs(drift_deg) < _LEAST_DRIFT_DEG or alike[best] < max(_ALIKE, float(two.max())):
            return None  # or a part of the building is turned against the other
        if without > _WITHOUT * alike[best]:
            return None
        sentence = (
            f"Walls turn evenly during the drive: those seen last lie {abs(drift_deg):.0f} degrees off those seen "
            f"first ({len(turned)} walls), {abs(drift_deg) / lasted_s:.2g} degrees a second."
        )
        remedy = (
            "The heading of the poses drifts, as of a gyro whose bias was not taken out: calibrate it, or use poses in "
            "which a SLAM closed loops."
        )
        return Finding(Reason.GEOMETRY, Grade.SUSPICIOUS, sentence, remedy)

    def _walls(self, levels: Levels) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Return when walls were seen, and their directions about what is up by the floors."""
        if not len(levels.up):
            return np.zeros(0), np.zeros(0)
        up = np.einsum("fij,fj->fi", levels.world_from_camera, levels.up).mean(axis=0)
        up /= max(float(np.linalg.norm(up)), 1e-12)
        flats, rotation = self.flats, self.sample.world_from_camera[:, :3, :3]
        world = np.einsum("nij,nj->ni", rotation[flats.frame], flats.normal)
        kept = (np.abs(world @ up) < _UPRIGHT) & (flats.share > _WALL)
        across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
        world, across = world[kept], across / np.linalg.norm(across)
        return self.sample.stamps_s[flats.frame[kept]], np.arctan2(world @ np.cross(up, across), world @ across)


def _mean_deg(cross: Float[np.ndarray, " p"]) -> float:
    return float(np.degrees(np.abs(cross).mean())) if len(cross) else 0.0
