"""Where a drive came back to a place, seen in its own pictures, and the poses that this gives.

Keyframes are located in much earlier ones that look alike. Each that is located is a *closure*: a measured motion from
the earlier keyframe to the later one. A pose graph of odometry and closures gives corrected poses, which the map then
follows. Where closures are few or contradict each other, nothing is done.
"""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.camera import Rig
from avlmaps.core.errors import MapError
from avlmaps.core.poses import from_rotation, inverse, mean_rotation, rotation_angle_rad, rotation_to_level
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.days.align import local_features, spread_out
from avlmaps.days.pose_graph import Edges, optimise
from avlmaps.maps.corrected import Corrected, correct_stored, require_submaps
from avlmaps.maps.store.reader import StoredMap
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.query.locate import LocateSettings, locate_features
from avlmaps.recordings.types import Recording

_NEEDED = (Kind.LOCAL, Kind.PLACE, Kind.MATCHER)


@dataclass(frozen=True, slots=True)
class LoopSettings:
    """When a drive counts as come back."""

    tried: int = 150
    """Keyframes that are looked for among earlier ones, at most, spread over the drive."""
    candidates: int = 10
    """Earlier keyframes that look the most alike, which each is located in, one by one until one is right."""
    least_score: float = 0.55
    """A located keyframe counts from this score on. Measured: wrong ones by half a metre reach 0.53."""
    later_s: float = 10.0
    """A keyframe is earlier where it was taken this long before, ..."""
    way_m: float = 3.0
    """... and the robot drove this far since."""
    least: int = 4
    """Fewer closures close nothing."""
    agree_m: float = 0.1
    """A closure agrees with the corrected poses within this, ..."""
    agree_rad: float = float(np.deg2rad(3.0))
    """... and this angle."""
    least_share: float = 0.7
    """This part of the closures must agree."""
    known_m: float = 0.02
    """How well a located keyframe is known."""
    known_rad: float = 0.006
    """And its angle."""
    strays: float = 0.015
    """How far odometry strays, metres and radians, for the root of a metre (and of a radian turned)."""
    most_strain: float = 4.0
    """Odometry may be bent by this many of its standard deviations (root mean square) before it is refused."""


@dataclass(frozen=True, slots=True)
class Loops:
    """What was found, and what it says.

    Attributes:
        stamps_s: of the keyframes.
        poses: corrected poses of the keyframes.
        tried: keyframes that were looked for.
        closures: how many were located in earlier ones.
        agreeing: how many of these agree with the corrected poses.
        apart_before_m: how far the closures are from the poses before, median.
        apart_m: from the corrected poses.
    """

    stamps_s: Float[np.ndarray, " k"]
    poses: Float[np.ndarray, "k 4 4"]
    tried: int
    closures: int
    agreeing: int
    apart_before_m: float
    apart_m: float

    def report(self) -> dict[str, float]:
        """Return the numbers."""
        return {
            "tried": self.tried,
            "closures": self.closures,
            "agreeing": self.agreeing,
            "apart_before_m": round(self.apart_before_m, 4),
            "apart_m": round(self.apart_m, 4),
        }


@dataclass(frozen=True, slots=True)
class _Earlier:
    """One keyframe as a map to be located in."""

    keyframes: Keyframes
    place_state: dict[str, np.ndarray]
    encoders: Encoders
    rig: Rig


def close_loops(
    stored: StoredMap, settings: LoopSettings = LoopSettings(), recording: Recording | None = None
) -> tuple[StoredMap, Corrected, Loops]:
    """Find where the drive came back, correct the poses by it, and make the map follow them, in its folder.

    Raises:
        MapError: the map has no submaps, or no models to find places by; too few closures were found, or they
            contradict each other. It stays as it was.
    """
    require_submaps(stored)  # before the long search
    found = find_loops(stored, settings)
    moved, done = correct_stored(stored, found.stamps_s, found.poses, recording)
    return moved, done, found


def find_loops(stored: StoredMap, settings: LoopSettings = LoopSettings()) -> Loops:
    """Return corrected poses of the keyframes of a map; see ``close_loops``. The map is not touched."""
    for kind in _NEEDED:
        stored.require_model(kind)
    keyframes = stored.keyframes
    poses = np.asarray(keyframes.world_from_camera, np.float64)
    closures, tried = _closures(stored, poses, settings)
    if len(closures) < settings.least:
        raise MapError(
            f"The drive of {stored.path} is not seen to come back: of {tried} keyframes {len(closures)} were located "
            f"in earlier ones (at least {settings.later_s:g} s and {settings.way_m:g} m before); {settings.least} are "
            "needed. The map stays as it was."
        )
    odometry = _odometry(poses, settings)
    found = optimise(poses, _joined(odometry, closures))
    agree = _agreeing(closures, found, settings)
    if 0 < agree.sum() < len(agree):
        found = optimise(poses, _joined(odometry, closures.only(agree)))
        agree = _agreeing(closures, found, settings)
    found = _upright(found, poses, stored.up_in_world)
    strain = odometry.errors(found) / np.repeat(np.stack([odometry.sigma_m, odometry.sigma_rad], axis=1), 3, axis=1)
    bent = float(np.sqrt(np.mean(strain**2))) if len(odometry) else 0.0
    before, after = (np.linalg.norm(closures.errors(of)[:, :3], axis=1) for of in (poses, found))
    said = (
        f"{len(closures)} keyframes of {tried} were located in earlier ones, {np.median(before):.2f} m from where the "
        f"poses put them (median); {int(agree.sum())} agree with each other within {settings.agree_m:g} m"
    )
    if agree.sum() < max(settings.least, settings.least_share * len(agree)):
        raise MapError(
            f"The loops of {stored.path} contradict each other: {said}, and "
            f"{int(np.ceil(max(settings.least, settings.least_share * len(agree))))} must. Rooms that look alike do "
            "that; the map stays as it was."
        )
    if bent > settings.most_strain:
        raise MapError(
            f"The loops of {stored.path} contradict its odometry: {said}, but the drive would be bent by {bent:.1f} "
            f"standard deviations ({settings.most_strain:g} at most). The map stays as it was."
        )
    return Loops(
        np.asarray(keyframes.stamp_s), found, tried, len(closures), int(agree.sum()), float(np.median(before)),
        float(np.median(after[agree])),
    )  # fmt: skip


def _closures(stored: StoredMap, poses: Float[np.ndarray, "k 4 4"], settings: LoopSettings) -> tuple[Edges, int]:
    """Return what was seen again, and how many keyframes were looked for."""
    keyframes, rng = stored.keyframes, np.random.default_rng(0)
    stamps_s, place = np.asarray(keyframes.stamp_s), np.asarray(keyframes.place)
    way_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1))])
    first: list[int] = []
    second: list[int] = []
    measured: list[np.ndarray] = []
    tried = 0
    rows = np.sort(spread_out(len(keyframes), settings.tried))
    for row in progress(rows.tolist(), "looking back", total=len(rows), unit="keyframe"):
        earlier = np.flatnonzero(
            (stamps_s <= stamps_s[row] - settings.later_s) & (way_m <= way_m[row] - settings.way_m)
        )
        if not len(earlier):
            continue
        tried += 1
        alike = earlier[np.argsort(-(place[earlier] @ place[row]), kind="stable")[: settings.candidates]]
        local = local_features(stored, row)
        for other in alike.tolist():
            there = _Earlier(keyframes.take(np.array([other])), stored.place_state, stored.encoders, stored.rig)
            chosen = LocateSettings(refine_focal=False)
            located = locate_features(there, local, place[row], stored.rig.rgb, rng, chosen)
            found = located.world_from_camera
            if found is not None and located.score >= settings.least_score:
                first.append(other)
                second.append(row)
                measured.append(inverse(poses[other]) @ found @ stored.rig.rgb_from_depth)
                break
    count = len(first)
    edges = Edges(
        np.array(first, np.int64), np.array(second, np.int64), np.array(measured).reshape(-1, 4, 4),
        np.full(count, settings.known_m), np.full(count, settings.known_rad), np.ones(count, bool),
    )  # fmt: skip
    return edges, tried


def _odometry(poses: Float[np.ndarray, "k 4 4"], settings: LoopSettings) -> Edges:
    row: Int[np.ndarray, " e"] = np.arange(len(poses) - 1)
    step = inverse(poses[:-1]) @ poses[1:]
    way = np.linalg.norm(step[:, :3, 3], axis=1) + rotation_angle_rad(step, np.tile(np.eye(4), (len(step), 1, 1)))
    sigma = settings.strays * np.sqrt(way + 0.01)
    return Edges(row, row + 1, step, sigma, sigma, np.zeros(len(row), bool))


def _upright(
    found: Float[np.ndarray, "k 4 4"], before: Float[np.ndarray, "k 4 4"], up: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "k 4 4"]:
    tipped = mean_rotation(found @ inverse(before)) @ up
    to_level = rotation_to_level(up).T @ rotation_to_level(rotation_to_level(up) @ tipped) @ rotation_to_level(up)
    return from_rotation(to_level, found[0, :3, 3] - to_level @ found[0, :3, 3]) @ found


def _joined(one: Edges, other: Edges) -> Edges:
    return Edges(*(np.concatenate([getattr(of, name) for of in (one, other)]) for name in Edges.__dataclass_fields__))


def _agreeing(closures: Edges, poses: Float[np.ndarray, "k 4 4"], settings: LoopSettings) -> np.ndarray:
    error = closures.errors(poses)
    near = np.linalg.norm(error[:, :3], axis=1) <= settings.agree_m
    return near & (np.linalg.norm(error[:, 3:], axis=1) <= settings.agree_rad)
