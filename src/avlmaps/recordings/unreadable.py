"""What people record that cannot be read: it is recognised, so that the sentence says why, and what to do."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from avlmaps.recordings.known_formats import holds, some_name

_EXPORT = "export its colour, depth and poses as a folder of recording.json, rgb/, depth/ and poses.csv"


@dataclass(frozen=True, slots=True)
class _Unreadable:
    """Something that is recognised and not read.

    Attributes:
        matches: recognises it.
        why: what it is, what is missing, and what to do: a sentence without its subject.
    """

    matches: Callable[[Path], bool]
    why: str


def _suffix(*suffixes: str) -> Callable[[Path], bool]:
    return lambda path: path.is_file() and path.suffix.lower() in suffixes


def _euroc(path: Path) -> bool:
    """A folder of EuRoC's layout: an IMU, and cameras without depth or none at all."""
    inside = path / "mav0" if (path / "mav0").is_dir() else path
    return some_name(inside, "imu[0-9]*", "imu.csv") and not (inside / "depth").exists()


def _euroc_cameras(path: Path) -> bool:
    inside = path / "mav0" if (path / "mav0").is_dir() else path
    return _euroc(path) and some_name(inside, "cam[0-9]*")


_UNREADABLE = (
    _Unreadable(
        _euroc_cameras,
        "is a recording of EuRoC's layout: an IMU and cameras without depth, from which no map is built; compute depth "
        "from the stereo pair first, and give a folder of recording.json, rgb/, depth/ and poses.csv.",
    ),
    _Unreadable(
        _euroc,
        "holds measurements of an IMU and no pictures, from which no map can be built; record colour and depth "
        "beside it.",
    ),
    _Unreadable(
        _suffix(".sens"),
        "is ScanNet's packed recording; unpack it with ScanNet's SensReader (color/, depth/, pose/, intrinsic/), and "
        "open that folder.",
    ),
    _Unreadable(
        lambda path: some_name(path, "frame-*.depth.pgm"),
        "is unpacked by ScanNet's C++ reader, whose .depth.pgm is not read; unpack the .sens with the Python reader "
        "(color/, depth/, pose/, intrinsic/).",
    ),
    _Unreadable(
        _suffix(".svo", ".svo2"),
        f"is a recording of a ZED camera, which its own SDK alone reads; {_EXPORT} with it, or record a ROS bag.",
    ),
    _Unreadable(
        _suffix(".oni", ".klg", ".rrf", ".rrd", ".xef"),
        f"is a packed recording that is not read; {_EXPORT}.",
    ),
    _Unreadable(
        _suffix(".db"),
        "is no database of RTAB-Map (it is no SQLite file); copy it again.",
    ),
    _Unreadable(
        _suffix(".ply", ".pcd", ".las", ".laz", ".obj", ".glb", ".usdz", ".splat"),
        "is a finished model, without the pictures that a map is built from; give the recording it was made of.",
    ),
    _Unreadable(
        lambda path: some_name(path, "scene_*_*.depth"),
        "is ICL-NUIM in POV-Ray's own files; download its TUM RGB-D compatible PNGs and open those.",
    ),
    _Unreadable(
        holds("images", "sparse"),
        "is a reconstruction of COLMAP, whose scale is not metres and which has no depth; record with a depth "
        f"camera, or {_EXPORT}.",
    ),
)


def why_unreadable(path: Path) -> str:
    """Return a sentence about a place that is recognised and not read, or nothing."""
    return next((f"{path} {known.why}" for known in _UNREADABLE if known.matches(path)), "")
