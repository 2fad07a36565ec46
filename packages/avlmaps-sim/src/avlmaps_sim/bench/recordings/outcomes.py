"""The outcome of a recording in each format it is written in: opened and checked as a build does it."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from avlmaps.core import poses
from avlmaps.core.arrays import Float
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.poses import to_quaternion
from avlmaps.recordings.consistency.check import Verdict
from avlmaps.recordings.consistency.suspicions import examine_recording
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording
from avlmaps_sim.bench.recordings.drafts import Draft, Picture, camera_numbers, write_lines, write_picture
from avlmaps_sim.bench.recordings.situations import Situation

# What is assumed of a TUM sequence that is not of freiburg1 to 3.
TUM_CAMERA = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
_RATE_HZ = 30.0  # of the numbers in the names of 7-Scenes
_TUM_UNITS, _MILLIMETRES = 5000.0, 1000.0
_MOST = 65_535


@dataclass(frozen=True, slots=True)
class Format:
    """How a draft is written."""

    name: str  # of the format on the command line
    write: Callable[[Draft, Path], Path]  # writes a draft into a new folder and returns it
    holds: Callable[[Draft], bool]  # whether the format can hold a draft: its unit, clocks and cameras


def _write_tum(draft: Draft, path: Path) -> Path:
    lists: dict[str, list[str]] = {"rgb": [], "depth": []}
    for stamp_s, rgb, depth in zip(draft.stamps_s, draft.rgb, _stored(draft, _TUM_UNITS), strict=True):
        for kind, picture in (("rgb", rgb), ("depth", depth)):
            write_picture(path / kind / f"{stamp_s:.6f}.png", picture)
            lists[kind].append(f"{stamp_s:.6f} {kind}/{stamp_s:.6f}.png")
    quaternion = np.roll(to_quaternion(draft.poses), draft.quaternion_roll, axis=1)
    rows = np.column_stack([draft.pose_stamps_s, draft.poses[:, :3, 3], quaternion])
    for name, lines in {**lists, "groundtruth": map(_row, rows)}.items():
        write_lines(path / f"{name}.txt", list(lines))
    return path


def _write_seven_scenes(draft: Draft, path: Path) -> Path:
    c = draft.rig.depth
    for stamp_s, rgb, depth, pose in zip(
        draft.stamps_s, draft.rgb, _stored(draft, _MILLIMETRES), draft.poses, strict=True
    ):
        stem = f"frame-{round(stamp_s * _RATE_HZ):06d}"
        write_picture(path / f"{stem}.color.png", rgb)
        write_picture(path / f"{stem}.depth.png", depth)
        write_lines(path / f"{stem}.pose.txt", [_row(row) for row in pose])
    write_lines(path / "camera-intrinsics.txt", [f"{c.fx} 0 {c.cx}", f"0 {c.fy} {c.cy}", "0 0 1"])
    return path


def _write_replica(draft: Draft, path: Path) -> Path:
    import json

    for number, (rgb, depth) in enumerate(zip(draft.rgb, draft.depth, strict=True)):
        write_picture(path / f"results/frame{number:06d}.png", rgb)
        write_picture(path / f"results/depth{number:06d}.png", depth)
    write_lines(path / "traj.txt", [_row(pose.ravel()) for pose in draft.poses])
    numbers = camera_numbers(draft.rig.depth)
    camera = {"w": numbers["width"], "h": numbers["height"], "fx": numbers["fx"], "fy": numbers["fy"]}
    camera |= {"cx": numbers["cx"] - 0.5, "cy": numbers["cy"] - 0.5, "scale": draft.units_per_m}
    write_lines(path / "cam_params.json", [json.dumps({"camera": camera})])
    return path


def _row(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _stored(draft: Draft, units_per_m: float) -> list[Picture]:
    pictures = [np.rint(depth * (units_per_m / draft.units_per_m)) for depth in draft.depth]
    return [np.clip(picture, 0, _MOST).astype(np.uint16) for picture in pictures]


def _of_tum(draft: Draft) -> bool:
    camera = draft.rig.depth
    return _of_one_camera(draft) and camera == TUM_CAMERA.resized(camera.width, camera.height)


def _reaches(draft: Draft, units_per_m: float) -> bool:
    return max(int(depth.max()) for depth in draft.depth) * units_per_m / draft.units_per_m <= _MOST


def _of_one_camera(draft: Draft) -> bool:
    rig = draft.rig
    return rig.rgb == rig.depth and np.array_equal(rig.rgb_from_depth, np.eye(4)) and not draft.keys


def _of_matrices(draft: Draft) -> bool:
    return draft.quaternion_roll == 0 and np.array_equal(draft.stamps_s, draft.pose_stamps_s)


FORMATS = (
    Format(
        "tum",
        _write_tum,
        lambda d: _of_tum(d) and _reaches(d, _TUM_UNITS),
    ),
    Format(
        "7scenes",
        _write_seven_scenes,
        lambda d: _of_one_camera(d) and _of_matrices(d) and _reaches(d, _MILLIMETRES),
    ),
    Format("replica", _write_replica, lambda d: _of_one_camera(d) and _of_matrices(d)),
)
FOLDER = Format("folder", lambda draft, path: draft.write(path), lambda _: True)


# A point this far from the true surface is wrong: two voxels.
WRONG_M = 0.1
# A camera this far from the true one is wrong, although its pictures may show a wall that looks the same there.
WRONG_CAMERA_M = 0.25
MOST_WRONG = 0.1
MOST_COLOUR_ERROR = 12.0
_FRAMES, _STEP = 12, 5
# What `info` says that cannot be checked, where a mistake of a group would not show.
_UNCHECKED = {
    "poses": r"Poses|clock of the poses|Jumps of the poses|in its mount",
    "scale": r"Poses|scale of positions",
    "depth": r"Poses|measured along|colour lies on depth",
    "colour": r"Poses|colour lies on depth|colour channels",
    "pictures": r"Poses",
    "intrinsics": r"Poses|focal length|principal point|colour lies on depth|of the lens|fx to fy",
    "clock": r"Poses|clock of the poses",
}
_CLOUD_STEP = 3


class Outcome(StrEnum):
    """What came of a recording."""

    RIGHT = "right"  # no word, and the map would be right
    NAMED = "notice names the cause"
    NOTICED = "notice without the cause"
    REFUSED = "refused, cause named"
    REFUSED_PLAIN = "refused"
    UNCHECKED = "unchecked, info says so"  # the map would be wrong, and `info` names what cannot be checked
    SILENT = "silent wrong"


@dataclass(frozen=True, slots=True)
class Case:
    """One recording and its outcome. The situation is empty for a right recording."""

    source: str
    situation: str
    group: str
    outcome: Outcome
    said: tuple[str, ...]
    format: str = FOLDER.name


class Judge:
    """Judges recordings that were made of one right draft."""

    def __init__(self, right: Draft, form: Format = FOLDER) -> None:
        """Open the right one, to know its usual notices and its surface."""
        from scipy.spatial import KDTree

        self.right, self.form = right, form
        with TemporaryDirectory() as folder:
            opened = open_recording(form.write(right, Path(folder) / "walk"))
            self.usual = frozenset(opened.notices)
            self._tree = KDTree(np.concatenate([_points(opened, i, _CLOUD_STEP) for i in range(len(opened))]))
            self.poses = {opened.name(i): opened.world_from_camera[i] for i in range(len(opened))}
            self._rgb = {opened.name(i): opened.frame(i).rgb for i in _spread(len(opened))}
            self.verdict = examine_recording(opened)

    def judge(self, situation: Situation, other: Draft, seed: int) -> Case | None:
        """Make a mistake, read what was written and return the outcome; None where the format cannot hold it."""
        changed = situation.change(self.right, other, np.random.default_rng(seed))
        if not self.form.holds(changed):
            return None
        with TemporaryDirectory() as folder:
            outcome, said = self._outcome(self.form.write(changed, Path(folder) / "walk"), situation)
        return Case(self.right.name, situation.name, situation.group, outcome, said, self.form.name)

    def _outcome(self, path: Path, situation: Situation) -> tuple[Outcome, tuple[str, ...]]:
        try:
            opened = open_recording(path)
            verdict = examine_recording(opened)
        except AvlmapsError as error:
            return (Outcome.REFUSED if re.search(situation.cause, str(error)) else Outcome.REFUSED_PLAIN), (str(error),)
        notices = tuple(notice for notice in opened.notices if notice not in self.usual)
        said = (*verdict.sentences(), *notices)
        named = re.search(situation.cause, " ".join(said)) is not None
        if verdict.refused(()) is not None:
            return (Outcome.REFUSED if named else Outcome.REFUSED_PLAIN), said
        if said:
            return (Outcome.NAMED if named else Outcome.NOTICED), said
        if self.is_right(opened):
            return Outcome.RIGHT, ()
        told = re.search(_UNCHECKED[situation.group], " ".join(verdict.unchecked)) is not None
        return (Outcome.UNCHECKED, verdict.unchecked) if told else (Outcome.SILENT, ())

    def is_right(self, opened: Recording) -> bool:
        """Return whether surfaces, cameras and colours are the right recording's, up to a motion of the world."""
        rows = [i for i in range(len(opened)) if opened.name(i) in self.poses]
        middle = rows[len(rows) // 2]
        to_true = self.poses[opened.name(middle)] @ poses.inverse(opened.world_from_camera[middle])
        there_m = poses.apply(to_true, opened.world_from_camera[rows, :3, 3])
        true_m = np.stack([self.poses[opened.name(i)][:3, 3] for i in rows])
        if float((np.linalg.norm(there_m - true_m, axis=1) > WRONG_CAMERA_M).mean()) > MOST_WRONG:
            return False
        chosen = [rows[i] for i in _spread(len(rows))]
        points = np.concatenate([poses.apply(to_true, _points(opened, i, _STEP)) for i in chosen])
        coloured = [i for i in chosen if opened.name(i) in self._rgb]
        errors = [
            float(np.abs(opened.frame(i).rgb.astype(float) - self._rgb[opened.name(i)]).mean())
            for i in coloured
            if opened.frame(i).rgb.shape == self._rgb[opened.name(i)].shape
        ]
        wrong_colour = len(errors) > 0 and float(np.mean(errors)) > MOST_COLOUR_ERROR
        return self.is_surface(points) and not wrong_colour

    def is_surface(self, points: Float[np.ndarray, "k 3"]) -> bool:
        """Return whether nearly all points, in the right recording's world, lie on its surface."""
        away_m, _ = self._tree.query(points, distance_upper_bound=WRONG_M)
        return float((~np.isfinite(away_m)).mean()) <= MOST_WRONG


def right_case(draft: Draft) -> tuple[Case, Verdict | None]:
    """Return the outcome of a recording that is right: anything said of it is a false alarm."""
    with TemporaryDirectory() as folder:
        opened = open_recording(draft.write(Path(folder) / "walk"))
        try:
            verdict = examine_recording(opened)
        except RecordingError as error:
            return Case(draft.name, "", "", Outcome.REFUSED_PLAIN, (str(error),)), None
    said = verdict.sentences()
    refused = verdict.refused(()) is not None
    outcome = Outcome.REFUSED_PLAIN if refused else Outcome.NOTICED if said else Outcome.RIGHT
    return Case(draft.name, "", "", outcome, said), verdict


def _spread(count: int) -> list[int]:
    return np.unique(np.linspace(0, count - 1, min(_FRAMES, count)).round().astype(int)).tolist()


def _points(recording: Recording, index: int, step: int) -> Float[np.ndarray, "k 3"]:
    frame = recording.frame(index)
    camera = recording.rig.depth
    points = camera.backproject(frame.depth_m.astype(np.float64))[::step, ::step].reshape(-1, 3)
    return poses.apply(frame.world_from_camera, points[points[:, 2] > 0.0])
