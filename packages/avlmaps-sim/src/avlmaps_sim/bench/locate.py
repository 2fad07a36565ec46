"""How well photos are located: some frames of a recording become the map, others are located in it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import inverse, rotation_angle_rad
from avlmaps.core.progress import progress
from avlmaps.maps.keyframes import perceive_keyframes, select_keyframes
from avlmaps.maps.settings import KeyframeSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.query.locate import LocatableMap, Located, LocateSettings, locate
from avlmaps.recordings.types import Recording, Subset
from avlmaps_sim.bench.harness.figures import in_percent, wilson

COLUMNS = (
    "map", "keyframes", "photos", "of the place", "located %", "95 %", "median error cm", "degrees",
    "95th percentile cm", "degrees", "within 5 cm and 5° %", "95 %", "ms a photo: median", "95th percentile",
)  # fmt: skip
NEAR_CM, NEAR_DEG = 5.0, 5.0
_LOCATING, _KEYFRAMES = LocateSettings(), KeyframeSettings()


@dataclass(frozen=True, slots=True)
class Errors:
    """Results of some photos. Distances to the true place and angles are infinite where a photo was not located."""

    cm: Float[np.ndarray, " n"]
    deg: Float[np.ndarray, " n"]
    elapsed_ms: Float[np.ndarray, " n"]


def run(
    recording: Recording,
    seed: int = 0,
    *,
    steps: Sequence[int] = (2, 10, 50),
    photos: int = 250,
    foreign: Iterable[UInt8[np.ndarray, "h w 3"]] | None = None,
    used: Encoders | None = None,
    settings: LocateSettings = _LOCATING,
) -> dict[str, Any]:
    """Measure on one recording, once for each density of the map.

    Frames 0, s, 2s ... are all that the map's recording holds (of which keyframes are chosen as usual); the photos are
    spread over the other frames, and their own poses are the truth. Photos of another place are tried, too. ``foreign``
    photos are as large as the recording's; None takes the photos themselves, mirrored: a place that is not there,
    through the same camera. ``photos`` limits how many are located, ``steps`` are the densities s, and encoders are the
    embedded ones if None.

    Returns:
        ``columns`` and ``rows``: for each density one row for the photos of the place and one for the others.
        Intervals are Wilson's.
    """
    rows: list[list[object]] = []
    used = used or Encoders.named("embedded")
    foreign = None if foreign is None else list(foreign)
    for step in steps:
        kept = np.arange(0, len(recording), step)
        asked = _spread(np.setdiff1d(np.arange(len(recording)), kept), photos)
        stored = map_of(Subset(recording, kept), used, np.random.default_rng(seed))
        name = f"every {step}th frame" if step > 2 else "every other frame"
        errors = errors_of(stored, recording, asked, seed, settings)
        rows.append([name, len(stored.keyframes), len(asked), "yes", *_figures(errors)])
        others = foreign if foreign is not None else (_mirrored(recording, int(index)) for index in asked)
        refused = foreign_errors(stored, others, seed, settings)
        kind = "no: mirrored" if foreign is None else "no"
        rows.append([name, len(stored.keyframes), len(refused.cm), kind, *_figures(refused)])
    return {"columns": list(COLUMNS), "rows": rows}


def map_of(recording: Recording, used: Encoders, rng: np.random.Generator) -> LocatableMap:
    """Return the pictures of a map of a recording, without its voxels, its sounds and the features of its views."""
    used = used.having(views=None)
    keyframes, place_state = perceive_keyframes(
        recording, select_keyframes(recording, _KEYFRAMES), used, rng, settings=_KEYFRAMES
    )
    return LocatableMap(keyframes, place_state, used, recording.rig)


def errors_of(
    stored: LocatableMap,
    recording: Recording,
    asked: Int[np.ndarray, " n"],
    seed: int,
    settings: LocateSettings = _LOCATING,
    camera: Pinhole | None = None,
) -> Errors:
    """Locate frames of a recording and compare with their own poses."""
    answers: list[tuple[float, float, float]] = []
    for index in progress(asked, "locating", unit="photo"):
        frame = recording.frame(int(index))
        found = locate(stored, frame.rgb, camera, np.random.default_rng(seed), settings)
        answers.append(_error(found, frame.world_from_camera @ inverse(recording.rig.rgb_from_depth)))
    return Errors(*np.array(answers, np.float64).reshape(-1, 3).T)


def foreign_errors(
    stored: LocatableMap,
    pictures: Iterable[UInt8[np.ndarray, "h w 3"]],
    seed: int,
    settings: LocateSettings = _LOCATING,
) -> Errors:
    """Locate photos of another place; the errors of those that were located are not numbers."""
    answers: list[tuple[float, float, float]] = []
    for rgb in progress(pictures, "locating others", unit="photo"):
        found = locate(stored, rgb, None, np.random.default_rng(seed), settings)
        error = np.inf if found.world_from_camera is None else np.nan
        answers.append((error, error, found.elapsed_ms))
    return Errors(*np.array(answers, np.float64).reshape(-1, 3).T)


def _error(found: Located, world_from_rgb: Float[np.ndarray, "4 4"]) -> tuple[float, float, float]:
    pose = found.world_from_camera
    if pose is None:
        return np.inf, np.inf, found.elapsed_ms
    distance_cm = 100.0 * float(np.linalg.norm(pose[:3, 3] - world_from_rgb[:3, 3]))
    return distance_cm, float(np.rad2deg(rotation_angle_rad(pose, world_from_rgb))), found.elapsed_ms


def _figures(errors: Errors) -> list[object]:
    count, located = len(errors.cm), ~np.isinf(errors.cm)
    near = (errors.cm <= NEAR_CM) & (errors.deg <= NEAR_DEG)
    has_truth = located.any() and not np.isnan(errors.cm[located]).any()
    middle = [_percentile(values, q) if has_truth else "" for q in (50, 95) for values in (errors.cm, errors.deg)]
    within: list[object] = (
        [_percent(int(near.sum()), count), in_percent(wilson(int(near.sum()), count))] if has_truth else ["", ""]
    )
    return [
        _percent(int(located.sum()), count),
        in_percent(wilson(int(located.sum()), count)),
        *middle,
        *within,
        round(float(np.median(errors.elapsed_ms)), 1) if count else "",
        round(float(np.percentile(errors.elapsed_ms, 95)), 1) if count else "",
    ]


def _percentile(values: Float[np.ndarray, " n"], q: float) -> object:
    value = float(np.sort(values)[min(len(values) - 1, int(len(values) * q / 100))])
    return round(value, 2) if np.isfinite(value) else "not located"


def _percent(hits: int, count: int) -> float:
    return round(100.0 * hits / count, 1) if count else 0.0


def _spread(indices: Int[np.ndarray, " n"], count: int) -> Int[np.ndarray, " k"]:
    if len(indices) <= count:
        return indices
    return indices[np.linspace(0, len(indices) - 1, count).round().astype(int)]


def _mirrored(recording: Recording, index: int) -> UInt8[np.ndarray, "h w 3"]:
    return np.ascontiguousarray(recording.frame(index).rgb[:, ::-1])
