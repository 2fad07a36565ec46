"""The formats of others that a draft is also written in, and which mistakes they can hold."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import to_quaternion
from avlmaps_sim.bench.recordings.drafts import Draft, Picture, camera_numbers, write_lines, write_picture

# What is assumed of a TUM sequence that is not of freiburg1 to 3.
TUM_CAMERA = Pinhole(525.0, 525.0, 320.0, 240.0, 640, 480)
_RATE_HZ = 30.0  # of the numbers in the names of 7-Scenes
_TUM_UNITS, _MILLIMETRES = 5000.0, 1000.0
_MOST = 65_535


@dataclass(frozen=True, slots=True)
class Format:
    """How a draft is written.

    Attributes:
        name: of the format on the command line.
        write: writes a draft into a new folder and returns it.
        holds: whether the format can hold a draft: its unit, clocks and cameras.
    """

    name: str
    write: Callable[[Draft, Path], Path]
    holds: Callable[[Draft], bool]


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
