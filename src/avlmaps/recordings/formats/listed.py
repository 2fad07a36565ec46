"""Pictures in lists, or named by stamps, with poses at their own stamps or numbers: TUM, ORB-SLAM, ICL-NUIM.

tum: TUM RGB-D: three streams with stamps of their own; 5000 units a metre; poses of the colour camera; motion
    capture's z is up in freiburg1 to freiburg3.
orb-slam: ORB-SLAM's associations of colour and depth with its trajectory (TUM's columns); the settings' YAML has the
    camera and DepthMapFactor; up is not known.
icl-nuim: ICL-NUIM, "TUM compatible": 5000 units a metre; 30 frames/s; ``*.gt.freiburg`` begins with frame 1 or 2;
    camera and world are left-handed with y up, so that both are mirrored.
rtabmap-export: ``rtabmap-export --images --poses``: NAME_rgb/, NAME_depth/ (millimetres), NAME_calib/*.yaml and
    NAME_poses.txt or NAME_camera_poses.txt; files are called by stamps or ids; z up.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core import timeline
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import note
from avlmaps.recordings.formats import tables
from avlmaps.recordings.formats.file_recording import (
    FileRecording,
    Shots,
    list_names,
    natural_key,
    opener,
    sizes,
    whole_frames,
)
from avlmaps.recordings.formats.layouts import Z_UP, Cameras, fitted_cameras
from avlmaps.recordings.images import COLOUR_SUFFIXES, DEPTH_SUFFIXES
from avlmaps.recordings.plausible import date_fault, pace_fault, repeat_fault

RATE_HZ = 30.0


@dataclass(frozen=True, slots=True)
class _Stream:
    stamps_s: Float[np.ndarray, " n"]
    files: list[str]


TRAJECTORIES = ("groundtruth.txt", "CameraTrajectory.txt", "KeyFrameTrajectory.txt", "*[Tt]rajectory*.txt", "poses.txt")
_PAIR_TOLERANCE_S = 0.02  # half the interval of a 30 Hz camera, and a little: as the benchmark's own association
# fx, fy, cx, cy at 640x480, the first pixel's centre at (0, 0).
_FREIBURG = {
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
    "default": (525.0, 525.0, 319.5, 239.5),
}


def find_associations(path: Path) -> Path | None:
    """Return the list of pictures that belong together, or None."""
    return next(iter(sorted(path.glob("assoc*.txt"))), None) if path.is_dir() else None


def find_trajectory(path: Path) -> Path | None:
    """Return the file of poses with stamps beside lists of pictures, or None."""
    return next((file for pattern in TRAJECTORIES for file in sorted(path.glob(pattern))), None)


def is_orb_slam(path: Path) -> bool:
    """Return whether a folder has associated pictures and a trajectory with stamps."""
    return find_associations(path) is not None and find_trajectory(path) is not None


@opener
def open_tum(path: Path) -> FileRecording:
    """Open a sequence of the TUM RGB-D benchmark, or one laid out like it, in place.

    Pictures that are each other's nearest in time, within 20 ms, are a frame at the depth picture's stamp.
    """
    colour, depth = (_stream(path / name) for name in ("rgb.txt", "depth.txt"))
    of_colour, of_depth = timeline.associate(colour.stamps_s, depth.stamps_s, _PAIR_TOLERANCE_S)
    if len(of_colour) == 0:
        raise RecordingError(
            f"{path}: no picture of rgb.txt ({len(colour.files)}) is within {_PAIR_TOLERANCE_S} s of one of depth.txt "
            f"({len(depth.files)}): they go from {colour.stamps_s[0]:.3f} to {colour.stamps_s[-1]:.3f} s, and from "
            f"{depth.stamps_s[0]:.3f} to {depth.stamps_s[-1]:.3f} s; check that both use one clock."
        )
    if unpaired := len(colour.files) - len(of_colour):
        note(f"{unpaired} colour picture(s) have no depth picture within {_PAIR_TOLERANCE_S} s; left out.")
    rows: list[tuple[int, int]] = list(zip(of_colour.tolist(), of_depth.tolist(), strict=True))
    files = [(colour.files[i], depth.files[j]) for i, j in rows]
    start_s = min(colour.stamps_s[0], depth.stamps_s[0])
    return _timed(path, "tum", depth.stamps_s[of_depth], files, float(start_s))


@opener
def open_orb_slam(path: Path) -> FileRecording:
    """Open associated pictures with a trajectory of ORB-SLAM, or of another that writes TUM's columns, in place."""
    listed = find_associations(path)
    assert listed is not None
    rows = _associations(listed)
    order = timeline.in_order(np.array([row[0] for row in rows]), f"lines of {listed.name}")
    at: list[int] = order.index.tolist()
    kept = [rows[i] for i in at]
    stamps_s = np.array([row[0] for row in kept])
    if not kept:
        raise RecordingError(f"{listed} lists no frame, so there is nothing to map.")
    note(*order.notices)
    return _timed(path, "orb-slam", stamps_s, [row[1:] for row in kept], stamps_s[0])


def _timed(
    path: Path, name: str, stamps_s: Float[np.ndarray, " n"], files: list[tuple[str, str]], start_s: float
) -> FileRecording:
    file = find_trajectory(path) or path / TRAJECTORIES[0]
    trajectory = tables.read_poses(file).trajectory(file.name)
    assert trajectory is not None
    known_s = trajectory.stamps_s
    note(*timeline.gap_notices(known_s, f"poses in {file.name}"))
    if fault := pace_fault(stamps_s, "pictures") or pace_fault(known_s, f"poses of {file.name}"):
        raise RecordingError(f"{path}: {fault}")
    covered = trajectory.covers(stamps_s)
    if not covered.any():
        raise RecordingError(
            f"{file} goes from {known_s[0]:.3f} to {known_s[-1]:.3f} s, but the pictures from {stamps_s[0]:.3f} to "
            f"{stamps_s[-1]:.3f} s; check that both use one clock."
        )
    if not covered.all():
        note(f"{int((~covered).sum())} frame(s) lie outside {file.name} or in a gap of it; left out.")
    rows, stamps_s = np.flatnonzero(covered).tolist(), stamps_s[covered]
    shots = Shots(
        names=[Path(files[i][0]).stem for i in rows],
        colour=[files[i][0] for i in rows],
        depth=[files[i][1] for i in rows],
        stamps_s=stamps_s - start_s,
        world_from_camera=trajectory.at(stamps_s),
    )
    found, up_in_world = _tum_camera(path, shots)
    return FileRecording.settled(
        path, name, found.rig, shots, None, depth_units=found.units_per_m,
        up_in_world=up_in_world, begins_s=float(start_s), posed=float(covered.mean()),
        trajectory=timeline.Trajectory(known_s - start_s, trajectory.world_from_body),
    )  # fmt: skip


def _stream(path: Path) -> _Stream:
    rows = tables.read_list(path, tables.NAMED_FILE[::-1])
    stamps, files = [row[0] for row in rows], [row[1] for row in rows]
    if not files:
        raise RecordingError(f"{path} lists no picture, so there is nothing to map.")
    what = f"pictures of {path.name}"
    if fault := date_fault(np.array(stamps), f"the {what}") or repeat_fault(np.array(stamps), what):
        raise RecordingError(f"{path}: {fault}")
    order = timeline.in_order(np.array(stamps), f"pictures of {path.name}")
    note(*order.notices)
    return _Stream(np.array(stamps)[order.index], [files[i] for i in order.index])


def _tum_camera(path: Path, shots: Shots) -> tuple[Cameras, Float[np.ndarray, "3"] | None]:
    rgb_size, depth_size = sizes(path, shots)
    for file in sorted((*path.glob("*.yaml"), *path.glob("*.yml"))):
        if found := _orb_camera(file, rgb_size):
            camera, units = found
            return Cameras(Rig(camera.resized(*rgb_size), camera.resized(*depth_size)), units), None
    name = path.resolve().name.lower()
    key = next((k for k in _FREIBURG if k in name), "default")
    fx, fy, cx, cy = _FREIBURG[key]
    camera = Pinhole(fx, fy, cx + 0.5, cy + 0.5, 640, 480)
    rig = Rig(camera.resized(*rgb_size), camera.resized(*depth_size))
    if key == "default":
        note("The folder is not called freiburg1, 2 or 3, so the default camera (525) is assumed; up is not known.")
        return Cameras(rig, 5000.0), None
    return Cameras(rig, 5000.0), np.array(Z_UP)


def _orb_camera(file: Path, size: tuple[int, int]) -> tuple[Pinhole, float] | None:
    settings = tables.read_opencv_yaml(file)

    def number(*names: str) -> float | None:
        nodes = (settings.getNode(f"{part}.{name}") for part in ("Camera", "Camera1") for name in names)
        return next((float(node.real()) for node in nodes if not node.empty()), None)

    fx, fy, cx, cy = (number(name) for name in ("fx", "fy", "cx", "cy"))
    if fx is None or fy is None or cx is None or cy is None:
        return None
    factors = (settings.getNode(name) for name in ("DepthMapFactor", "RGBD.DepthMapFactor"))
    units = next((float(node.real()) for node in factors if not node.empty()), 5000.0)
    if not units > 0.0:
        raise RecordingError(f"{file} has the DepthMapFactor {units}; it must be positive: 1000 for millimetres.")
    width, height = number("width") or size[0], number("height") or size[1]
    camera = tables.pinhole(file, fx, fy, cx + 0.5, cy + 0.5, round(width), round(height))
    camera = tables.fitted(camera, size, file, "colour")
    if any(abs(number(name) or 0.0) > 1e-9 for name in ("k1", "k2", "p1", "p2", "k3")):
        note(tables.DISTORTED)
    return camera, units


def _associations(file: Path) -> list[tuple[float, str, str]]:
    found = tables.read_list(file, ("stamp_s", "name", "stamp_s", "name"))
    return [(row[2], row[3], row[1]) if "depth" in row[1] else (row[0], row[1], row[3]) for row in found]


@opener
def open_icl_nuim(path: Path) -> FileRecording:
    """Open a sequence of ICL-NUIM in place."""
    listed = path / "associations.txt"
    rows = [(int(key), colour, depth) for key, colour, depth in _associations(listed)]
    if not rows:
        raise RecordingError(f"{listed} lists no frame, so there is nothing to map.")
    truth = next(iter(sorted(path.glob("*.gt.freiburg"))), None)
    if truth is None:
        raise RecordingError(
            f"{path} has no poses: put ICL-NUIM's livingRoomN.gt.freiburg or trajN.gt.freiburg, or a trajectory with "
            f"stamps (CameraTrajectory.txt), beside {listed.name}."
        )
    table = tables.read_poses(truth)
    usable = np.flatnonzero(table.usable)
    known = dict(zip(table.stamps_s[usable].astype(int).tolist(), table.pose[usable], strict=True))
    listed_rows = {row[0]: row for row in rows}
    posed = [listed_rows[number] for number in whole_frames(path, associations=listed_rows, pose=known)]
    mirror, numbers = np.diag([1.0, -1.0, 1.0, 1.0]), np.array([row[0] for row in posed], np.float64)
    shots = Shots(
        names=[f"{number}" for number, _, _ in posed],
        colour=[colour for _, colour, _ in posed],
        depth=[depth for _, _, depth in posed],
        stamps_s=(numbers - numbers[0]) / RATE_HZ,
        world_from_camera=mirror @ np.stack([known[number] for number, _, _ in posed]) @ mirror,
    )
    found = fitted_cameras(path, shots, Pinhole(481.20, 480.00, 320.0, 240.0, 640, 480), path, 5000.0)
    return FileRecording.settled(
        path, "icl-nuim", found.rig, shots, lambda _: truth, depth_units=found.units_per_m,
        up_in_world=np.array([0.0, -1.0, 0.0]), posed=len(posed) / len(rows),
    )  # fmt: skip


# What rtabmap-export writes


def export_of(path: Path) -> str:
    """Return the name before _rgb, _depth and _calib in a folder of rtabmap-export; empty where it is none."""
    folders = sorted(path.glob("*_rgb")) if path.is_dir() else []
    names = [folder.name.removesuffix("_rgb") for folder in folders]
    return next((name for name in names if (path / f"{name}_depth").is_dir()), "")


@opener
def open_rtabmap_export(path: Path) -> FileRecording:
    """Open what rtabmap-export wrote, in place."""
    name = export_of(path)
    kinds = {"rgb": COLOUR_SUFFIXES, "depth": DEPTH_SUFFIXES, "calib": (".yaml", ".yml")}
    files = {kind: list_names(path / f"{name}_{kind}", suffixes) for kind, suffixes in kinds.items()}
    stems = {kind: {file.rsplit(".", 1)[0]: file for file in of} for kind, of in files.items()}
    whole = [stem for stem in stems["rgb"] if stem in stems["depth"]]
    file = next((f for kind in ("camera_poses", "poses") if (f := path / f"{name}_{kind}.txt").is_file()), None)
    if not whole or not files["calib"] or file is None:
        raise RecordingError(
            f"{path} has {len(files['rgb'])} pictures in {name}_rgb/, {len(files['depth'])} in {name}_depth/, "
            f"{len(files['calib'])} calibrations and {'no ' if file is None else ''}poses; export it with "
            "`rtabmap-export --images --poses --poses_camera`."
        )
    camera, base_from_camera = _exported_camera(path / f"{name}_calib" / files["calib"][0])
    table = tables.read_poses(file, (8, 9, 12))
    pose = table.pose
    if file.name.endswith("_poses.txt") and not file.name.endswith("camera_poses.txt"):
        pose = pose @ base_from_camera
    whole = sorted(whole, key=natural_key)
    rows, stamps_s = _exported_rows(path, whole, table)
    if len(rows) < len(whole):
        note(f"{len(whole) - len(rows)} frame(s) have no pose in {file.name} and are left out.")
    shots = Shots(
        names=[whole[frame] for frame, _ in rows],
        colour=[f"{name}_rgb/{stems['rgb'][whole[frame]]}" for frame, _ in rows],
        depth=[f"{name}_depth/{stems['depth'][whole[frame]]}" for frame, _ in rows],
        stamps_s=stamps_s - stamps_s[0],
        world_from_camera=pose[[row for _, row in rows]],
    )
    found = fitted_cameras(path, shots, camera, path / f"{name}_calib", 1000.0)
    return FileRecording.settled(
        path, "rtabmap-export", found.rig, shots, lambda _: file, up_in_world=np.array(Z_UP),
        begins_s=float(stamps_s[0]), posed=len(rows) / len(whole),
    )  # fmt: skip


def _exported_rows(
    path: Path, stems: Sequence[str], table: tables.PoseTable
) -> tuple[list[tuple[int, int]], Float[np.ndarray, " k"]]:
    keys = np.array([float(stem) if re.fullmatch(r"\d+(\.\d+)?", stem) else np.nan for stem in stems])
    for own in (table.stamps_s, table.ids) if table.stamped else ():
        order = np.argsort(own, kind="stable")
        a, b = timeline.associate(np.sort(keys), own[order], 1e-3)
        if 2 * len(a) > min(len(keys), len(own)):
            frames = np.argsort(keys, kind="stable")[a]
            return list(zip(frames.tolist(), order[b].tolist(), strict=True)), table.stamps_s[order[b]]
    if len(table.pose) != len(stems):
        raise RecordingError(
            f"{path} has {len(stems)} pictures and {len(table.pose)} poses, and the names of the pictures are neither "
            "stamps nor ids of the poses; export both at once, with `--poses_format 10`."
        )
    if not table.stamped:
        note("The poses have no stamps; 30 frames/s are assumed.")
    return [(i, i) for i in range(len(stems))], table.stamps_s / (1.0 if table.stamped else RATE_HZ)


def _exported_camera(file: Path) -> tuple[Pinhole, Float[np.ndarray, "4 4"]]:
    content = tables.read_opencv_yaml(file)

    def matrix(name: str) -> list[float]:
        node = content.getNode(name)
        data = node.getNode("data") if not node.empty() and node.isMap() else node
        return [float(data.at(i).real()) for i in range(data.size())] if not data.empty() and data.isSeq() else []

    k, local = matrix("camera_matrix"), matrix("local_transform")
    size = [round(content.getNode(name).real()) for name in ("image_width", "image_height")]
    if len(k) != 9:
        raise RecordingError(f"{file} has no camera_matrix of nine numbers; export the calibration again.")
    base_from_camera = np.eye(4)
    if len(local) == 12:
        base_from_camera[:3] = np.array(local).reshape(3, 4)
    return tables.pinhole(file, k[0], k[4], k[2] + 0.5, k[5] + 0.5, size[0], size[1]), base_from_camera
