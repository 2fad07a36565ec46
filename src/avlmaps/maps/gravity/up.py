"""Finding the up direction from what a depth camera saw, and holding one that a recording gives against it.

Floors, table tops and ceilings share one normal. A direction that many surfaces share is found by RANSAC over
surface normals; the camera decides which of a room's three directions is up: people and robots hold it nearly
level: its x axis is horizontal, however far it looks down, and its -y axis points upwards.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.errors import RecordingError
from avlmaps.core.wording import option
from avlmaps.recordings.consistency.check import Finding, Grade, Reason
from avlmaps.recordings.memory import is_of_program
from avlmaps.recordings.types import Frame, Recording

STEP_PIXELS = 6  # of a picture 640 wide: normals are measured over twice this distance
MAX_DEPTH_M = 4.0  # beyond, a depth camera's noise tilts normals
MAX_JUMP = 0.05  # of the depth: a greater step between neighbours is an edge, not a surface
NORMALS_PER_FRAME = 800
CANDIDATES = 600
NEAR_RAD = np.deg2rad(8.0)
REFINED_RAD = np.deg2rad(4.0)
FEWEST_NORMALS = 200


@dataclass(frozen=True, slots=True)
class Up:
    """The up direction.

    Attributes:
        direction: unit vector in the world.
        support: share of the measured surface normals within 8 degrees of up or of down, in [0, 1]; below 0.05
            there is hardly a level surface in view and the direction is a guess.
    """

    direction: Float[np.ndarray, "3"]
    support: float


def find_up(frames: Iterable[Frame], rng: np.random.Generator) -> Up:
    """Find the direction that level surfaces share.

    Args:
        frames: spread over the recording, some ten or more; one after the other is held in memory.
        rng: draws the normals.
    """
    normals: list[Float[np.ndarray, "n 3"]] = []
    rotations: list[Float[np.ndarray, "3 3"]] = []
    count = 0
    for frame in frames:
        rotation = np.asarray(frame.world_from_camera[:3, :3], np.float64)
        found = surface_normals(frame, rng)
        normals.append(found @ rotation.T)
        rotations.append(rotation)
        count += 1
    normal = np.concatenate(normals) if normals else np.zeros((0, 3))
    if len(normal) < FEWEST_NORMALS:
        raise RecordingError(
            f"The up direction cannot be found: {count} frames show {len(normal)} places with a smooth surface within "
            f"{MAX_DEPTH_M} m, and {FEWEST_NORMALS} are needed; write the recording's up direction into it."
        )
    direction = _refined(_most_shared(normal, np.stack(rotations), rng), normal)
    along: Bool[np.ndarray, " n"] = np.abs(normal @ direction) > np.cos(NEAR_RAD)
    return Up(direction, float(along.mean()))


def surface_normals(frame: Frame, rng: np.random.Generator) -> Float[np.ndarray, "n 3"]:
    """Return unit normals of smooth surfaces in the camera's frame, facing the camera; at most 800, drawn evenly."""
    step = max(1, round(STEP_PIXELS * frame.rig.depth.width / 640))
    depth = frame.depth_m.astype(np.float64)
    points = frame.rig.depth.backproject(np.where(np.isfinite(depth) & (depth < MAX_DEPTH_M), depth, 0.0))
    grid = points[::step, ::step]
    z = grid[..., 2]
    centre, left, right, above, below = z[1:-1, 1:-1], z[1:-1, :-2], z[1:-1, 2:], z[:-2, 1:-1], z[2:, 1:-1]
    smooth = centre > 0.0
    for neighbour in (left, right, above, below):
        smooth &= (neighbour > 0.0) & (np.abs(neighbour - centre) < MAX_JUMP * centre)
    across = grid[1:-1, 2:] - grid[1:-1, :-2]
    down = grid[2:, 1:-1] - grid[:-2, 1:-1]
    normal = np.cross(down[smooth], across[smooth])
    length = np.linalg.norm(normal, axis=1)
    normal = normal[length > 0.0] / length[length > 0.0, None]
    if len(normal) > NORMALS_PER_FRAME:
        normal = normal[rng.choice(len(normal), NORMALS_PER_FRAME, replace=False)]
    return normal


def _most_shared(
    normals: Float[np.ndarray, "n 3"], rotations: Float[np.ndarray, "k 3 3"], rng: np.random.Generator
) -> Float[np.ndarray, "3"]:
    candidates = normals[rng.integers(len(normals), size=CANDIDATES)]
    camera_x, camera_up = rotations[:, :, 0], -rotations[:, :, 1]
    candidates = np.where((candidates @ camera_up.mean(axis=0) < 0.0)[:, None], -candidates, candidates)
    votes = normals[rng.permutation(len(normals))[:10_000]]
    support = np.mean(np.abs(candidates @ votes.T) > np.cos(NEAR_RAD), axis=1)
    upright = np.clip(candidates @ camera_up.T, 0.0, 1.0).mean(axis=1)
    level = np.sqrt(np.clip(1.0 - np.square(candidates @ camera_x.T), 0.0, 1.0)).mean(axis=1)
    return candidates[np.argmax(support * upright**2 * level**4)]


def _refined(direction: Float[np.ndarray, "3"], normals: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"]:
    for cone_rad in (NEAR_RAD, NEAR_RAD, REFINED_RAD, REFINED_RAD, REFINED_RAD):
        along = np.abs(normals @ direction)
        level, upright = normals[along > np.cos(cone_rad)], normals[along < np.sin(cone_rad)]
        main = np.linalg.eigh(level.T @ level - upright.T @ upright)[1][:, -1]
        direction = main if main @ direction > 0.0 else -main
    return direction / np.linalg.norm(direction)


_FRAMES = 16
# Given and found directions closer than this are one; beside it, a slope or a tilted sensor explains the difference.
_APART_DEG = 20.0
# Planes count where so large a share of the surface agrees and the camera was held within this angle of them.
_LEAST_SUPPORT, _HELD_DEG = 0.1, 40.0
# A walk is level: along what is up it spreads less than half as far as along what is not.
_FLATTER, _STILL_M = 0.5, 0.15


def up_doubts(recording: Recording, frames: Iterator[Frame], rng: np.random.Generator) -> tuple[Finding, ...]:
    """Return a finding where the up direction of a recording is not that of what it shows, or nothing.

    A camera that is mounted on its side shows walls where floors are expected; then the walk decides: nobody walks
    up and down as far as along.
    """
    given = recording.up_in_world
    if given is None:
        return ()
    try:
        found = find_up(frames, rng)
    except RecordingError:  # too little smooth surface
        return ()
    held = -recording.world_from_camera[:, :3, 1].mean(axis=0)
    apart = _angle_deg(given, found.direction)
    if apart < _APART_DEG or found.support < _LEAST_SUPPORT or _angle_deg(held, found.direction) > _HELD_DEG:
        return ()
    places = recording.world_from_camera[:, :3, 3]
    along_given_m, along_found_m = (float(np.std(places @ up)) for up in (given, found.direction))
    if max(along_given_m, along_found_m) > _STILL_M and along_found_m > _FLATTER * along_given_m:
        return ()
    said, is_so = (_words(up) for up in (given, found.direction))
    sentence = (
        f"Up is given as {said}, but {found.support:.0%} of the surface in view is level along {is_so}, {apart:.0f} "
        "degrees away, and so was the camera held."
    )
    up = f"up_in_world=({is_so})" if is_of_program(recording) else option("up", is_so)
    return (Finding(Reason.UP, Grade.SUSPICIOUS, sentence, f"Give {up}, or fix the poses."),)


def some_frames(recording: Recording) -> Iterator[Frame]:
    """Read a few frames, evenly spread; those that cannot be read are left out."""
    for index in np.unique(np.linspace(0, len(recording) - 1, _FRAMES).round().astype(int)).tolist():
        try:
            yield recording.frame(index)
        except RecordingError:
            continue


def _words(up: Float[np.ndarray, "3"]) -> str:
    return ",".join(f"{value + 0.0:.2f}" for value in np.round(up, 2).tolist())  # + 0.0 turns -0.0 into 0.0


def _angle_deg(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> float:
    length = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(a @ b / max(length, 1e-12), -1.0, 1.0))))
