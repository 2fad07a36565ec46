"""Where a drive came back to a place, seen in its own pictures, and the poses that this gives.

Keyframes are located in much earlier ones that look alike. Each that is located is a *closure*: a measured motion from
the earlier keyframe to the later one. A pose graph of odometry and closures gives corrected poses, which the map then
follows. Where closures are few or contradict each other, nothing is done.

The graph minimises Σ ρ(|Σᵢⱼ⁻½ log(Zᵢⱼ⁻¹ Tᵢ⁻¹ Tⱼ)|²) over the poses T, where Zᵢⱼ is a measured motion from pose i to
pose j. Odometry counts in full; ρ is Cauchy's function for closures, so that a wrong one hardly counts (Gauss and
Newton's steps; sparse, by SciPy).
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.columns import concat, take
from avlmaps.core.errors import MapError
from avlmaps.core.poses import from_rotation, inverse, mean_rotation, rotation_angle_rad, rotation_to_level
from avlmaps.core.progress import progress
from avlmaps.days.find import NEEDED, features_of, spread_out
from avlmaps.maps.corrected import Corrected, correct_map, require_submaps
from avlmaps.query.avlmap import AVLMap, with_findings
from avlmaps.query.locate import LocatableMap, LocateSettings, locate_features
from avlmaps.recordings.types import Recording

MOST_TRIED = 150  # keyframes that are looked for among earlier ones, spread over the drive
CANDIDATES = 10  # earlier keyframes that look the most alike, which each is located in, one by one until one is right
LEAST_SCORE = 0.55  # a located keyframe counts from this score on. Measured: wrong ones by half a metre reach 0.53
LATER_S, WAY_M = 10.0, 3.0  # a keyframe is earlier where it was taken this long, and this way of the robot, before
LEAST_CLOSURES = 4  # fewer close nothing
AGREE_M, AGREE_RAD = 0.1, math.radians(3.0)  # a closure agrees with the corrected poses within these
LEAST_SHARE = 0.7  # this part of the closures must agree
KNOWN_M, KNOWN_RAD = 0.02, 0.006  # how well a located keyframe is known
STRAYS = 0.015  # how far odometry strays, metres and radians, for the root of a metre (and of a radian turned)
MOST_STRAIN = 4.0  # of its standard deviations (root mean square) by which odometry is bent
_STEPS, _STILL = 60, 1e-7


@dataclass(frozen=True, slots=True, eq=False)
class Edges:
    """Measured motions, metres: pose j (``second``) in the frame of pose i (``first``), with their standard deviations.

    A closure may be wrong altogether.
    """

    first: Int[np.ndarray, " e"]
    second: Int[np.ndarray, " e"]
    measured: Float[np.ndarray, "e 4 4"]
    sigma_m: Float[np.ndarray, " e"]
    sigma_rad: Float[np.ndarray, " e"]
    is_closure: Bool[np.ndarray, " e"]

    def __len__(self) -> int:
        return len(self.first)

    def sigmas(self) -> Float[np.ndarray, "e 6"]:
        """Return the standard deviations of ``errors``."""
        return np.repeat(np.stack([self.sigma_m, self.sigma_rad], axis=1), 3, axis=1)

    def errors(self, poses: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "e 6"]:
        """Return how far each is from what the poses say: translation, metres; rotation, axis times angle, radians."""
        from scipy.spatial.transform import Rotation

        found = inverse(poses[self.first]) @ poses[self.second]
        off = inverse(self.measured) @ found
        return np.concatenate([off[:, :3, 3], Rotation.from_matrix(off[:, :3, :3]).as_rotvec()], axis=1)


def optimise(poses: Float[np.ndarray, "n 4 4"], edges: Edges) -> Float[np.ndarray, "n 4 4"]:
    """Return the poses that fit the edges best; the first stays where it is."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import spsolve

    shape, found = (6 * len(edges), 6 * len(poses)), poses.copy()
    scale = 1.0 / edges.sigmas()
    of_both = (6 * np.stack([edges.first, edges.second], axis=1)[:, :, None] + np.arange(6)).reshape(-1, 12)
    row, column = np.broadcast_arrays(np.arange(shape[0]).reshape(-1, 6, 1), of_both[:, None])
    free = np.arange(shape[1] - 6)
    damping = csc_matrix((np.full(len(free), 1e-9), (free, free)))
    for _ in range(_STEPS):
        error = edges.errors(found) * scale
        weight = np.where(edges.is_closure, 1.0 / (1.0 + (error**2).sum(axis=1) / 6.0), 1.0)
        root = np.sqrt(weight)[:, None]
        value = _slopes(found, edges) * (scale * root)[:, :, None]
        slope = csc_matrix((value.ravel(), (row.ravel(), column.ravel())), shape)[:, 6:]
        step = -spsolve(slope.T @ slope + damping, slope.T @ (error * root).ravel()).reshape(-1, 6)
        found[1:] = found[1:] @ motions(step)
        if np.abs(step).max(initial=0.0) < _STILL:
            break
    return found


def _slopes(poses: Float[np.ndarray, "n 4 4"], edges: Edges) -> Float[np.ndarray, "e 6 12"]:
    # How errors change with small motions of both poses, in their own frames. Of the rotation's
    # logarithm the slope is taken at 0, which is exact where the edges fit.
    off = inverse(edges.measured) @ inverse(poses[edges.first]) @ poses[edges.second]
    between = inverse(poses[edges.second]) @ poses[edges.first]  # of a motion of i, seen from j
    second = np.zeros((len(edges), 6, 6))
    second[:, :3, :3], second[:, 3:, 3:] = off[:, :3, :3], np.eye(3)
    carried = np.zeros((len(edges), 6, 6))
    turn = between[:, :3, :3]
    carried[:, :3, :3], carried[:, 3:, 3:] = turn, turn
    carried[:, :3, 3:] = crosses(between[:, :3, 3]) @ turn
    return np.concatenate([-second @ carried, second], axis=2)


def crosses(vectors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Return the matrices of the cross product with each vector."""
    out = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    return out - np.swapaxes(out, 1, 2)


def motions(steps: Float[np.ndarray, "n 6"]) -> Float[np.ndarray, "n 4 4"]:
    """Return small motions: a translation, metres, and a rotation as axis times angle."""
    from scipy.spatial.transform import Rotation

    return from_rotation(Rotation.from_rotvec(steps[:, 3:]).as_matrix(), steps[:, :3])


@dataclass(frozen=True, slots=True)
class Loops:
    """Corrected poses of the keyframes, and how they were found."""

    stamps_s: Float[np.ndarray, " k"]
    poses: Float[np.ndarray, "k 4 4"]
    tried: int  # keyframes that were looked for
    closures: int  # how many of them were located in earlier ones
    agreeing: int  # how many of these agree with the corrected poses
    apart_before_m: float  # of the closures from the poses before, median
    apart_m: float  # from the corrected poses

    def report(self) -> dict[str, float]:
        """Return the numbers."""
        names = ("tried", "closures", "agreeing", "apart_before_m", "apart_m")
        return {name: round(getattr(self, name), 4) for name in names}


def close_loops(avlmap: AVLMap, recording: Recording | None = None) -> tuple[Corrected, Loops]:
    """Find where the drive came back, correct the poses by it, and make the map follow them, in its folder.

    ``MapError``: the map has no submaps, or no models to find places by; too few closures were found, or they
    contradict each other. It stays as it was.
    """
    require_submaps(avlmap.path, avlmap.data)  # before the long search
    found = find_loops(avlmap)
    return correct_map(avlmap.path, found.stamps_s, found.poses, recording, with_findings), found


def find_loops(avlmap: AVLMap) -> Loops:
    """Return corrected poses of the keyframes of a map; see ``close_loops``. The map is not touched."""
    for kind in NEEDED:
        avlmap.require_model(kind)
    keyframes = avlmap.data.keyframes
    poses = np.asarray(keyframes.world_from_camera, np.float64)
    closures, tried = _closures(avlmap, poses)
    if len(closures) < LEAST_CLOSURES:
        raise MapError(
            f"The drive of {avlmap.path} is not seen to come back: of {tried} keyframes {len(closures)} were located "
            f"in earlier ones (at least {LATER_S:g} s and {WAY_M:g} m before); {LEAST_CLOSURES} are "
            "needed. The map stays as it was."
        )
    odometry = _odometry(poses)
    found = optimise(poses, concat([odometry, closures]))
    agree = _agreeing(closures, found)
    if 0 < agree.sum() < len(agree):
        found = optimise(poses, concat([odometry, take(closures, agree)]))
        agree = _agreeing(closures, found)
    found = _upright(found, poses, avlmap.data.up_in_world)
    strain = odometry.errors(found) / odometry.sigmas()
    bent = float(np.sqrt(np.mean(strain**2))) if len(odometry) else 0.0
    before, after = (np.linalg.norm(closures.errors(of)[:, :3], axis=1) for of in (poses, found))
    said = (
        f"{len(closures)} keyframes of {tried} were located in earlier ones, {np.median(before):.2f} m from where the "
        f"poses put them (median); {int(agree.sum())} agree with each other within {AGREE_M:g} m"
    )
    if agree.sum() < max(LEAST_CLOSURES, LEAST_SHARE * len(agree)):
        raise MapError(
            f"The loops of {avlmap.path} contradict each other: {said}, and "
            f"{int(np.ceil(max(LEAST_CLOSURES, LEAST_SHARE * len(agree))))} must. Rooms that look alike do "
            "that; the map stays as it was."
        )
    if bent > MOST_STRAIN:
        raise MapError(
            f"The loops of {avlmap.path} contradict its odometry: {said}, but the drive would be bent by {bent:.1f} "
            f"standard deviations ({MOST_STRAIN:g} at most). The map stays as it was."
        )
    return Loops(
        np.asarray(keyframes.stamp_s), found, tried, len(closures), int(agree.sum()), float(np.median(before)),
        float(np.median(after[agree])),
    )  # fmt: skip


def _closures(avlmap: AVLMap, poses: Float[np.ndarray, "k 4 4"]) -> tuple[Edges, int]:
    keyframes, rng, every = avlmap.data.keyframes, np.random.default_rng(0), LocatableMap.of(avlmap)
    stamps_s, place = np.asarray(keyframes.stamp_s), np.asarray(keyframes.place)
    way_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1))])
    first: list[int] = []
    second: list[int] = []
    measured: list[np.ndarray] = []
    tried = 0
    rows = np.sort(spread_out(len(keyframes), MOST_TRIED))
    for row in progress(rows.tolist(), "looking back", total=len(rows), unit="keyframe"):
        earlier = np.flatnonzero((stamps_s <= stamps_s[row] - LATER_S) & (way_m <= way_m[row] - WAY_M))
        if not len(earlier):
            continue
        tried += 1
        alike = earlier[np.argsort(-(place[earlier] @ place[row]), kind="stable")[:CANDIDATES]]
        local = features_of(avlmap, row)
        for other in alike.tolist():
            there = replace(every, keyframes=take(keyframes, np.array([other])))
            chosen = LocateSettings(refine_focal=False)
            located = locate_features(there, local, place[row], avlmap.data.rig.rgb, rng, chosen)
            found = located.world_from_camera
            if found is not None and located.score >= LEAST_SCORE:
                first.append(other)
                second.append(row)
                measured.append(inverse(poses[other]) @ found @ avlmap.data.rig.rgb_from_depth)
                break
    count = len(first)
    edges = Edges(
        np.array(first, np.int64), np.array(second, np.int64), np.array(measured).reshape(-1, 4, 4),
        np.full(count, KNOWN_M), np.full(count, KNOWN_RAD), np.ones(count, bool),
    )  # fmt: skip
    return edges, tried


def _odometry(poses: Float[np.ndarray, "k 4 4"]) -> Edges:
    row: Int[np.ndarray, " e"] = np.arange(len(poses) - 1)
    step = inverse(poses[:-1]) @ poses[1:]
    way = np.linalg.norm(step[:, :3, 3], axis=1) + rotation_angle_rad(step, np.tile(np.eye(4), (len(step), 1, 1)))
    sigma = STRAYS * np.sqrt(way + 0.01)
    return Edges(row, row + 1, step, sigma, sigma, np.zeros(len(row), bool))


def _upright(
    found: Float[np.ndarray, "k 4 4"], before: Float[np.ndarray, "k 4 4"], up: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "k 4 4"]:
    tipped = mean_rotation(found @ inverse(before)) @ up
    to_level = rotation_to_level(up).T @ rotation_to_level(rotation_to_level(up) @ tipped) @ rotation_to_level(up)
    return from_rotation(to_level, found[0, :3, 3] - to_level @ found[0, :3, 3]) @ found


def _agreeing(closures: Edges, poses: Float[np.ndarray, "k 4 4"]) -> np.ndarray:
    error = closures.errors(poses)
    near = np.linalg.norm(error[:, :3], axis=1) <= AGREE_M
    return near & (np.linalg.norm(error[:, 3:], axis=1) <= AGREE_RAD)
