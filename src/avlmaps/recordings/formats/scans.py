"""Scans of phones and their conversions: Polycam's raw export, Stray Scanner's folder, Nerfstudio's transforms.json.

Polycam's raw export (an iPhone or iPad with LiDAR): ``keyframes/`` with images, depth and cameras.
Facts of the data (nerfstudio's converter; Polycam's page on raw data): ``cameras/N.json`` has ``fx fy cx cy width
height`` and ``t_00`` to ``t_23``, the rows of a camera-to-world matrix in ARKit's axes (camera: y up, looking along
-z; world: y up). ``corrected_cameras/`` and ``corrected_images/`` are what remains after Polycam's own bundle
adjustment, and go before. Depth is in 16-bit millimetres, and where ``confidence/`` is 0 it is left out.

Stray Scanner (an iPhone or iPad with LiDAR): ``rgb.mp4``, ``depth/``, ``odometry.csv``, ``camera_matrix.csv``.
Facts of the data (docs/format.md of the app, and its encoder): ``odometry.csv`` has a row a frame, with a stamp in
seconds and a quaternion x y z w; the app turns ARKit's camera by half a turn, so that the poses are of a camera with
y down and z forward in ARKit's world, which has y up. Depth is in 16-bit millimetres, 256x192; ``confidence/`` has 0
(low), 1 and 2, and low depth is left out. ``camera_matrix.csv`` is of the video's size; newer versions add fx fy cx
cy to each row.

Nerfstudio's ``transforms.json`` with depth, as Polycam, Record3D and others are converted to it.
Facts of the data (nerfstudio's page on data conventions): each frame has a ``file_path``, a ``depth_file_path`` and a
camera-to-world ``transform_matrix`` of a camera with y up that looks along -z (OpenGL); ``fl_x`` and the like stand
for all frames or in each; the centre of the first pixel is (0.5, 0.5). Depth is in 16-bit millimetres unless
``depth_unit_scale_factor`` (metres of a unit) or ``integer_depth_scale`` says otherwise, or NPY in metres. The frames
have no clock, and the world may be turned and moved, so that up is not known. Positions that were scaled
(``applied_scale``) are scaled back to metres.

Record3D (an iPhone or iPad with LiDAR): its own ``.r3d``, that file unpacked, or its export "EXR + JPG sequence".

Facts of the data (nerfstudio's and viser's readers; Record3D's notes on its export): a JSON ``metadata`` has the
intrinsics ``K`` column by column, of colour pictures of ``w`` x ``h``, or ``perFrameIntrinsicCoeffs`` (fx fy cx cy);
``poses`` are qx qy qz qw tx ty tz in ARKit's axes (camera: y up, looking along -z; world: y up); ``frameTimestamps``
are seconds, else ``fps`` counts. In a ``.r3d``, which is a ZIP archive, ``rgbd/N.jpg``, ``N.depth`` and ``N.conf``
belong together; depth is float32 metres of ``dw`` x ``dh``, compressed by LZFSE, and where the confidence is 0 it is
left out. The export has ``EXR_RGBD/metadata.json``, ``rgb/N.jpg`` and ``depth/N.exr``.
"""

import os
import shutil
import tempfile
import weakref
import zipfile
import zlib
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, MANIFEST_BYTES, PICTURE_BYTES, SOUND_BYTES
from avlmaps.recordings import images
from avlmaps.recordings.corrections import UP_IN_WORLD, from_opengl
from avlmaps.recordings.faults import note
from avlmaps.recordings.formats import tables
from avlmaps.recordings.formats.file_recording import (
    FileRecording,
    Shots,
    StoredRecording,
    left_out,
    likeliest_sound,
    list_names,
    number_of,
    open_audio,
    opener,
    sizes,
    whole_frames,
)
from avlmaps.recordings.images import COLOUR_SUFFIXES, VideoFrames, first_picture_size
from avlmaps.recordings.plausible import pace_fault

DESCRIPTION = "transforms.json"
# Pictures of a scan are chosen, not filmed; a second apart they satisfy every rule about speed.
INTERVAL_S = 1.0
_NO_CLOCK = "The scan has no clock; its frames are taken to be one second apart."
_MILLIMETRE = 1e-3
_PINHOLES = ("", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")
_DISTORTION = ("k1", "k2", "k3", "k4", "p1", "p2")
_SUFFIXES = (*COLOUR_SUFFIXES, ".JPG", ".PNG")
_IDLE = (
    "aabb_scale", "applied_transform", "camera_angle_y", "ply_file_path", "frames", "orientation_override",
    "auto_scale_poses_override", "crop", "train_filenames", "val_filenames", "test_filenames", "scale", "offset",
)  # fmt: skip
# Of a frame; other pictures of it (..._path) are not read either.
_IDLE_OF_FRAME = ("camera_angle_y", "colmap_im_id", "time", "timestamp", "camera_id", "sharpness", "blur_score")


class _Camera(msgspec.Struct, frozen=True):
    fl_x: float | None = None
    fl_y: float | None = None
    cx: float | None = None
    cy: float | None = None
    w: float | None = None
    h: float | None = None
    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    k4: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    camera_angle_x: float | None = None
    camera_model: str = ""
    is_fisheye: bool = False


class _Frame(_Camera, frozen=True, kw_only=True):
    file_path: str
    transform_matrix: list[list[float]]
    depth_file_path: str = ""


class _Transforms(_Camera, frozen=True, kw_only=True):
    frames: list[_Frame]
    depth_unit_scale_factor: float | None = None
    integer_depth_scale: float | None = None
    applied_scale: float = 1.0


@opener
def open_nerfstudio(path: Path) -> FileRecording:
    """Open a scan in place."""
    file = path / DESCRIPTION
    given, plain = tables.read_json(file, _Transforms)
    known = {name for kind in (_Transforms, _Camera) for name in kind.__struct_fields__}
    tables.note_unread(file, plain, (*known, *_IDLE))
    present = {key: None for frame in plain["frames"] for key in frame if not key.endswith("_path")}
    tables.note_unread(file, present, (*_Frame.__struct_fields__, *_IDLE_OF_FRAME))
    note(_NO_CLOCK)
    if given.applied_scale != 1.0:
        note(f"The positions were scaled by {given.applied_scale:g}; they are scaled back to metres.")
    frames = [frame for frame in given.frames if frame.depth_file_path]
    if not frames:
        raise RecordingError(
            f"{file} names no depth (depth_file_path) for any of its {len(given.frames)} frames, and a map needs it; "
            "convert the scan again with its depth (ns-process-data polycam --use-depth, or record3d)."
        )
    if lost := len(given.frames) - len(frames):
        left_out(file, f"{lost} frame(s) have no depth_file_path and are left out.")
    units = _units_per_m(file, given)
    colour = [_found(path, frame.file_path) for frame in frames]
    shots = Shots(
        names=[name.rsplit("/", 1)[-1].rsplit(".", 1)[0] for name in colour],
        colour=colour,
        depth=[_found(path, frame.depth_file_path) for frame in frames],
        stamps_s=np.arange(len(frames)) * INTERVAL_S,
        world_from_camera=_matrices(file, frames, given.applied_scale),
    )
    rig = _rig(file, given, frames, shots)
    return FileRecording.settled(path, "nerfstudio", rig, shots, lambda _: file, depth_units=units)


def _units_per_m(file: Path, given: _Transforms) -> float:
    said = {given.integer_depth_scale, given.depth_unit_scale_factor} - {None}
    metres = next((value for value in said if value is not None), _MILLIMETRE)
    if len(said) > 1 or not all(np.isfinite(value) and value > 0.0 for value in (metres, given.applied_scale)):
        raise RecordingError(
            f"{file} says that a unit of depth is {' and '.join(map(str, said)) or metres} m, and the scale of "
            f"positions {given.applied_scale}; give one positive number of each."
        )
    return 1.0 / metres


def _found(folder: Path, name: str) -> str:
    name = name.replace("\\", "/").removeprefix("./")
    if name.startswith("/") or ".." in name.split("/"):
        raise RecordingError(f"{folder / DESCRIPTION} names {name!r}, which lies outside of its folder; move it there.")
    if Path(name).suffix or os.path.lexists(folder / name):
        return name
    return next((name + suffix for suffix in _SUFFIXES if os.path.lexists(folder / (name + suffix))), name)


def _matrices(file: Path, frames: list[_Frame], scale: float) -> Float[np.ndarray, "n 4 4"]:
    pose = np.tile(np.eye(4), (len(frames), 1, 1))
    for i, frame in enumerate(frames):
        rows = frame.transform_matrix
        if len(rows) not in (3, 4) or any(len(row) != 4 for row in rows):
            raise RecordingError(f"{file}: the transform_matrix of {frame.file_path!r} is not 4x4; convert it again.")
        pose[i, : len(rows)] = rows
    pose[:, :3, 3] /= scale
    return from_opengl(pose)


def _rig(file: Path, given: _Transforms, frames: list[_Frame], shots: Shots) -> Rig:
    models = {frame.camera_model or given.camera_model for frame in frames}
    if any(camera_.is_fisheye for camera_ in (given, *frames)):
        models = {"fisheye"}
    if odd := sorted(models - set(_PINHOLES)):
        raise RecordingError(
            f"{file} is of the camera model {odd[0]!r}; pinholes are read ({', '.join(_PINHOLES[1:])}): undistort it."
        )
    rgb_size = first_picture_size(file.parent, shots.colour)
    said = {(round(f.w or given.w or rgb_size[0]), round(f.h or given.h or rgb_size[1])) for f in frames}
    if len(said) > 1:
        shown = " and ".join(f"{width}x{height}" for width, height in sorted(said)[:2])
        raise RecordingError(f"{file} has frames of {shown}; the frames of a recording must have one size.")
    size = said.pop()
    numbers = np.array([_numbers(file, frame, given, size) for frame in frames])
    camera = tables.median_camera(file, numbers, *size)
    if any(abs(getattr(camera_, name)) > 1e-9 for camera_ in (given, *frames) for name in _DISTORTION):
        note(tables.DISTORTED)
    return tables.fitted_rig(camera, *sizes(file.parent, shots), file)


def _numbers(file: Path, frame: _Frame, given: _Transforms, size: tuple[int, int]) -> list[float]:
    def said(name: str) -> Any:
        own = getattr(frame, name)
        return getattr(given, name) if own is None else own

    fx, angle = said("fl_x"), said("camera_angle_x")
    if fx is None and angle is not None and 0.0 < angle < np.pi:
        fx = size[0] / 2.0 / np.tan(angle / 2.0)
    if fx is None:
        raise RecordingError(f"{file} has no focal length (fl_x, or camera_angle_x) for {frame.file_path!r}; add it.")
    fy, cx, cy = said("fl_y"), said("cx"), said("cy")
    return [fx, fx if fy is None else fy, size[0] / 2 if cx is None else cx, size[1] / 2 if cy is None else cy]


# What the app writes beside; it says nothing about how the pictures are read.
_POLYCAM_IDLE = ("blur_score", "center_depth", "neighbors", "angular_velocity", "manual_keyframe")
_POLYCAM_POSE = tuple(f"t_{row}{column}" for row in range(4) for column in range(4))
_UNITS_S = (1.0, 1e-3, 1e-6, 1e-9)
# Keyframes of a scan follow one another at such a pace, by which the unit of their stamps is known.
_LEAST_INTERVAL_S, _MOST_INTERVAL_S = 0.02, 20.0


class _PolycamCamera(msgspec.Struct, frozen=True):
    fx: float
    fy: float
    cx: float
    cy: float
    width: int | None = None
    height: int | None = None
    timestamp: float | None = None


def keyframes_of(path: Path) -> Path:
    """Return the folder that holds the keyframes: the export's ``keyframes/``, or the folder itself."""
    return path / "keyframes" if (path / "keyframes").is_dir() else path


def is_polycam(path: Path) -> bool:
    """Return whether a folder is a raw export."""
    frames = keyframes_of(path)
    return (frames / "cameras").is_dir() and (frames / "images").is_dir()


@opener
def open_polycam(path: Path) -> FileRecording:
    """Open a raw export in place."""
    frames = keyframes_of(path)
    below = "keyframes/" if frames != path else ""
    mended = all((frames / f"corrected_{kind}").is_dir() for kind in ("cameras", "images"))
    cameras, images = ("corrected_cameras", "corrected_images") if mended else ("cameras", "images")
    colour = _by_stem(frames / images, COLOUR_SUFFIXES)
    depth, described = _by_stem(frames / "depth", (".png",)), _by_stem(frames / cameras, (".json",))
    names = whole_frames(path, cameras=described, colour=colour, depth=depth)
    files = [frames / cameras / described[stem] for stem in names]
    read = [tables.read_json(file, _PolycamCamera, DESCRIPTION_BYTES) for file in files]
    found, matrices = [camera for camera, _ in read], list(map(_matrix, files, (plain for _, plain in read)))
    present = {key: None for _, plain in read for key in plain}
    tables.note_unread(
        files[0], present, (*_PolycamCamera.__struct_fields__, *_POLYCAM_POSE, *_POLYCAM_IDLE), strict=False
    )
    sure = _by_stem(frames / "confidence", (".png",)) if (frames / "confidence").is_dir() else {}
    shots = Shots(
        names=names,
        colour=[f"{below}{images}/{colour[stem]}" for stem in names],
        depth=[f"{below}depth/{depth[stem]}" for stem in names],
        stamps_s=_keyframe_stamps(found, names),
        world_from_camera=from_opengl(np.stack(matrices)),
        confidence=[f"{below}confidence/{sure[s]}" for s in names] if all(s in sure for s in names) else (),
    )
    numbers = np.array([(c.fx, c.fy, c.cx, c.cy) for c in found])
    rgb_size, depth_size = sizes(path, shots)
    # corrected cameras have no size: it is that of the corrected pictures
    camera = tables.median_camera(files[0], numbers, found[0].width or rgb_size[0], found[0].height or rgb_size[1])
    rig = tables.fitted_rig(camera, rgb_size, depth_size, files[0])
    return FileRecording.settled(path, "polycam", rig, shots, files.__getitem__, up_in_world=UP_IN_WORLD.copy())


def _by_stem(folder: Path, suffixes: tuple[str, ...]) -> dict[str, str]:
    return {name.split(".", 1)[0]: name for name in list_names(folder, suffixes)}


def _matrix(file: Path, plain: dict[str, Any]) -> Float[np.ndarray, "4 4"]:
    try:
        rows = msgspec.convert([plain[name] for name in _POLYCAM_POSE[:12]], list[float])
    except (KeyError, msgspec.ValidationError) as error:
        raise RecordingError(f"{file} has no pose, t_00 to t_23 ({error}); export the scan again.") from None
    return tables.as_poses(np.array([rows]))[0]


def _keyframe_stamps(cameras: list[_PolycamCamera], names: list[str]) -> Float[np.ndarray, " n"]:
    for stamps in ([c.timestamp for c in cameras], [float(n) if n.isascii() and n.isdigit() else None for n in names]):
        known = np.array([stamp for stamp in stamps if stamp is not None], np.float64)
        interval = float(np.median(np.diff(known))) if len(known) == len(cameras) > 1 else 0.0
        unit_s = next((u for u in _UNITS_S if _LEAST_INTERVAL_S <= interval * u <= _MOST_INTERVAL_S), None)
        if unit_s is not None and (
            unit_s < 1.0 or np.any(known % 1.0 != 0.0)
        ):  # whole numbers that only count are none
            return (known - known[0]) * unit_s
    note(_NO_CLOCK)
    return np.arange(len(cameras)) * INTERVAL_S


_HEADER = ["timestamp", "frame", "x", "y", "z", "qx", "qy", "qz", "qw"]
_MORE = ["fx", "fy", "cx", "cy"]


@opener
def open_stray_scanner(path: Path) -> FileRecording:
    """Open a recording in place."""
    rows = _odometry(path / "odometry.csv")
    video = VideoFrames(path / "rgb.mp4")
    depth = {number_of(name): name for name in list_names(path / "depth", (".png",))}
    inside = path / "confidence"
    sure = {number_of(name): name for name in (list_names(inside, (".png",)) if inside.is_dir() else ())}
    numbers = rows[:, 1].astype(int)
    row_of = {int(number): row for row, number in enumerate(numbers)}
    whole = whole_frames(path, odometry=row_of, depth=depth, video=dict(enumerate(video.stamps_s)))
    rows, numbers = rows[[row_of[number] for number in whole]], np.array(whole)
    shots = Shots(
        names=[f"{n:06d}" for n in numbers],
        colour=[],
        depth=[f"depth/{depth[int(n)]}" for n in numbers],
        stamps_s=rows[:, 0] - rows[0, 0],
        world_from_camera=tables.rigid(rows[:, 2:5], rows[:, 5:9]),
        video_frames=numbers.tolist(),
        confidence=[f"confidence/{sure[int(n)]}" for n in numbers] if all(int(n) in sure for n in numbers) else (),
    )
    if fault := pace_fault(shots.stamps_s, "rows of odometry.csv"):
        raise RecordingError(f"{path}: {fault}")
    rig = _stray_rig(path, rows, video, shots)
    return FileRecording.settled(
        path, "stray-scanner", rig, shots, lambda _: path / "odometry.csv",
        up_in_world=UP_IN_WORLD.copy(), video=video,
    )  # fmt: skip


def _odometry(file: Path) -> np.ndarray:
    header = next(tables.text_lines(file), (0, ""))[1].replace(" ", "").split(",")
    if header not in (_HEADER, _HEADER + _MORE):
        raise RecordingError(
            f"{file} begins with {','.join(header)[:60]!r} where the header {','.join(_HEADER)} belongs; is it another "
            "app's, or another version's?"
        )
    table = tables.read_table(file, (len(header),))
    finite = table.values[np.isfinite(table.values[:, :2]).all(axis=1)]
    if len(finite) == 0:
        raise RecordingError(f"{file} holds no pose, so there is nothing to map.")
    return finite


def _stray_rig(path: Path, rows: np.ndarray, video: VideoFrames, shots: Shots) -> Rig:
    file, size = path / "camera_matrix.csv", (video.width, video.height)
    k = tables.read_matrix(file, 3, 3)
    per_frame = rows[:, 9:13] if rows.shape[1] > len(_HEADER) else np.zeros((0, 4))
    known = per_frame[np.isfinite(per_frame).all(axis=1) & (per_frame > 0.0).all(axis=1)]
    numbers = known if len(known) else np.array([[k[0, 0], k[1, 1], k[0, 2], k[1, 2]]])
    camera = tables.median_camera(file, numbers, *size)
    if not (0.0 < camera.cx < camera.width and 0.0 < camera.cy < camera.height):
        raise RecordingError(
            f"{file} has its centre at {camera.cx:.1f}, {camera.cy:.1f}, outside of the video's {size[0]}x{size[1]}; "
            "was the video resized? Give the matrix of its present size."
        )
    return Rig(camera, tables.fitted(camera, first_picture_size(path, shots.depth), file, "depth"))


_FPS = 60.0
_LZFSE_END, _HEAD_BYTES = b"bvx$", 4096  # of an LZFSE stream
# What the app writes beside; poses do not depend on initPose.
_RECORD3D_IDLE = ("initPose", "cameraType")


class _Metadata(msgspec.Struct, frozen=True):
    w: int
    h: int
    poses: list[list[float]]
    K: list[float] = []
    perFrameIntrinsicCoeffs: list[list[float]] = []  # noqa: N815 - Record3D's names
    frameTimestamps: list[float] = []  # noqa: N815
    fps: float | None = None
    dw: int = 0
    dh: int = 0


def is_record3d(path: Path) -> bool:
    """Return whether a file or folder is Record3D's."""
    if path.is_file():
        return path.suffix.lower() == ".r3d"
    return (path / "EXR_RGBD/metadata.json").is_file() or _record3d_layout(path) is not None


def _record3d_layout(path: Path) -> tuple[str, str, str] | None:
    for names in (("metadata.json", "rgb", "depth"), ("metadata", "rgbd", "rgbd")):
        if (path / names[0]).is_file() and (path / names[1]).is_dir() and (path / names[2]).is_dir():
            return names
    return None


Place = Path | zipfile.Path  # in a folder, or in a .r3d


def _inside(path: Path) -> Place:
    try:
        return zipfile.Path(path) if path.is_file() else path / "EXR_RGBD" if (path / "EXR_RGBD").is_dir() else path
    except (zipfile.BadZipFile, OSError) as error:
        raise RecordingError(f"{path} is no whole .r3d, a ZIP archive ({error}); share it again.") from None


def _names(folder: Place, suffixes: tuple[str, ...]) -> list[str]:
    if isinstance(folder, Path):
        return list_names(folder, suffixes)
    return [file.name for file in folder.iterdir() if file.name.lower().endswith(suffixes)] if folder.is_dir() else []


def _read(place: Place, limit: int = PICTURE_BYTES) -> bytes:
    if isinstance(place, Path):
        return images.read_bytes(place)
    try:
        if place.root.getinfo(place.at).file_size > limit:
            raise ValueError(f"it has more than {limit:,} bytes")
        return place.read_bytes()
    except (KeyError, ValueError, zipfile.BadZipFile, OSError, EOFError, zlib.error, RuntimeError) as error:
        raise RecordingError(f"{place} cannot be read ({error}); share it again.") from None


class _Pictures:
    def __init__(self, inside: Place) -> None:
        self._inside = inside

    def colour(self, name: str, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
        return images.decode_colour(Path(str(self._inside / name)), _read(self._inside / name), camera)

    def depth(self, name: str, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
        place, shape = self._inside / name, (camera.height, camera.width)
        if name.endswith(".exr"):
            depth_m = _exr(place)
            images.check_size(str(place), depth_m.shape, camera)
            return images.metres(depth_m, 1.0)
        depth_m = images.metres(_unfolded(place, 4 * camera.width * camera.height).view("<f4").reshape(shape), 1.0)
        confidence = self._inside / (name.removesuffix(".depth") + ".conf")
        if confidence.is_file():
            depth_m[_unfolded(confidence, depth_m.size).reshape(shape) == 0] = 0.0
        return depth_m


def _unfolded(place: Place, size: int) -> UInt8[np.ndarray, " n"]:
    content = _read(place)
    raw = content if len(content) == size else _decompressed(place, content, size)
    if len(raw) != size:
        raise RecordingError(f"{place} has {len(raw):,} bytes where {size:,} belong; share it again.")
    return np.frombuffer(raw, np.uint8)


def _decompressed(place: Place, content: bytes, most: int) -> bytes:
    import lzfse

    library: Any = lzfse
    try:
        if not content.endswith(_LZFSE_END) or len(content) > most + _HEAD_BYTES:
            raise ValueError("it is cut off, or longer than what it holds")
        return library.decompress(content)
    except (library.error, ValueError, MemoryError) as error:
        reason = str(error) or "it is no LZFSE stream"
        raise RecordingError(f"{place} cannot be read: {reason}; share or copy it again.") from None


def _exr(place: Place) -> Float32[np.ndarray, "h w"]:
    import OpenEXR

    library: Any = OpenEXR
    try:
        header = library.File(BytesIO(_read(place)), header_only=True).header()
        (x0, y0), (x1, y1) = header["dataWindow"]
        if (int(x1) - int(x0) + 1) * (int(y1) - int(y0) + 1) > images.MOST_PIXELS:
            raise ValueError("it is larger than any depth picture")
        channels: dict[str, Any] = library.File(BytesIO(_read(place)), separate_channels=True).channels()
        likely = next((n for n in ("Z", "R", "Y", "A") if n in channels), next(iter(channels)))
        return np.asarray(channels[likely].pixels, np.float32)
    except (RuntimeError, ValueError, TypeError, KeyError, StopIteration, MemoryError) as error:
        raise RecordingError(
            f"{place} is no OpenEXR ({str(error).splitlines()[0][:120]}); copy it again, or share the .r3d instead."
        ) from None


@opener
def open_record3d(path: Path) -> StoredRecording:
    """Open a recording in place."""
    inside = _inside(path)
    layout = _record3d_layout(inside) if isinstance(inside, Path) else ("metadata", "rgbd", "rgbd")
    if layout is None:
        raise RecordingError(f"{path} holds neither metadata with rgbd/ nor metadata.json with rgb/ and depth/.")
    described, colour_in, depth_in = layout
    file = Path(str(inside / described))
    given, plain = tables.parse_json(file, _read(inside / described, MANIFEST_BYTES), _Metadata)
    _require_whole(file, given)
    colour = {number_of(name): name for name in _names(inside / colour_in, images.COLOUR_SUFFIXES)}
    depth = {number_of(name): name for name in _names(inside / depth_in, (".depth", ".exr"))}
    numbers = whole_frames(path, pose=dict(enumerate(given.poses)), colour=colour, depth=depth)
    tables.note_unread(file, plain, (*_Metadata.__struct_fields__, *_RECORD3D_IDLE), strict=False)
    given_s = _record3d_stamps(given)
    shots = Shots(
        names=[str(n) for n in numbers],
        colour=[f"{colour_in}/{colour[n]}" for n in numbers],
        depth=[f"{depth_in}/{depth[n]}" for n in numbers],
        stamps_s=given_s[numbers],
        world_from_camera=_record3d_poses(given)[numbers],
    )
    if fault := pace_fault(shots.stamps_s, "frames", 1.0 / _fps(given)):
        raise RecordingError(f"{file}: {fault}")
    rig = _record3d_rig(inside, file, given, shots)
    folder = None
    if isinstance(inside, zipfile.Path):
        folder = Path(tempfile.mkdtemp(prefix="avlmaps-r3d-"))
        if (sound := likeliest_sound(inside.root.namelist())) is not None:
            (folder / f"audio{Path(sound).suffix.lower()}").write_bytes(_read(inside / sound, SOUND_BYTES))
    audio = open_audio(folder or path, float(given_s[0]))
    if audio is not None and folder is not None:
        audio = replace(audio, label=f"{path.name}/{audio.path.name}")
    recording = StoredRecording.settled(
        path, "record3d", rig, shots, lambda _: file, pictures=_Pictures(inside),
        up_in_world=UP_IN_WORLD.copy(), audio=audio,
    )  # fmt: skip
    if folder is not None:  # a track is read by pieces, for as long as the recording is open
        weakref.finalize(recording, shutil.rmtree, folder, ignore_errors=True)
    return recording


def _fps(given: _Metadata) -> float:
    return given.fps if given.fps is not None and given.fps > 0.0 else _FPS


def _record3d_stamps(given: _Metadata) -> Float[np.ndarray, " n"]:
    if given.frameTimestamps:
        return np.array(given.frameTimestamps, np.float64)
    note(f"The recording has no stamps; {_fps(given):g} frames/s are assumed.")
    return np.arange(len(given.poses)) / _fps(given)


def _require_whole(file: Path, given: _Metadata) -> None:
    rows, k, stamps = given.perFrameIntrinsicCoeffs, given.K, given.frameTimestamps
    wrong = {
        "a pose of other than seven numbers (qx qy qz qw tx ty tz)": any(len(row) != 7 for row in given.poses),
        f"{len(stamps)} frameTimestamps for {len(given.poses)} poses": len(stamps) not in (0, len(given.poses)),
        "a row of perFrameIntrinsicCoeffs of other than four numbers": any(len(row) != 4 for row in rows),
        f"K of {len(k)} numbers, where nine belong": not rows and len(k) != 9,
    }
    if any(wrong.values()):
        what = " and ".join(name for name, is_wrong in wrong.items() if is_wrong)
        raise RecordingError(f"{file} has {what}; share it from Record3D again.")


def _record3d_poses(given: _Metadata) -> Float[np.ndarray, "n 4 4"]:
    rows = np.array(given.poses, np.float64).reshape(-1, 7)
    return from_opengl(tables.rigid(rows[:, 4:], rows[:, :4]))


def _record3d_rig(inside: Place, file: Path, given: _Metadata, shots: Shots) -> Rig:
    k = given.K
    numbers = np.array(given.perFrameIntrinsicCoeffs or [[k[0], k[4], k[6] or k[2], k[7] or k[5]]], np.float64)
    camera = tables.median_camera(file, numbers, given.w, given.h)
    first, deep = inside / shots.colour[0], inside / shots.depth[0]
    rgb_size = images.picture_size(Path(str(first)), _read(first))
    depth_size = (given.dw, given.dh)
    if deep.name.endswith(".exr"):
        height, width = _exr(deep).shape
        depth_size = (width, height)
    elif not (given.dw > 0 and given.dh > 0):
        count = len(_decompressed(deep, _read(deep), 4 * camera.width * camera.height)) // 4
        width = max(1, round((count * camera.width / camera.height) ** 0.5))
        depth_size = (width, count // width)
    return tables.fitted_rig(camera, rgb_size, depth_size, file)
