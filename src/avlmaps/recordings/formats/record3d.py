"""Record3D (an iPhone or iPad with LiDAR): its own ``.r3d``, that file unpacked, or its export "EXR + JPG sequence".

Facts of the data (nerfstudio's and viser's readers; Record3D's notes on its export): a JSON ``metadata`` has the
intrinsics ``K`` column by column, of colour pictures of ``w`` x ``h``, or ``perFrameIntrinsicCoeffs`` (fx fy cx cy);
``poses`` are qx qy qz qw tx ty tz in ARKit's axes (camera: y up, looking along -z; world: y up); ``frameTimestamps``
are seconds, else ``fps`` counts. In a ``.r3d``, which is a ZIP archive, ``rgbd/N.jpg``, ``N.depth`` and ``N.conf``
belong together; depth is float32 metres of ``dw`` x ``dh``, compressed by LZFSE, and where the confidence is 0 it is
left out. The export has ``EXR_RGBD/metadata.json``, ``rgb/N.jpg`` and ``depth/N.exr``.
"""

import shutil
import tempfile
import weakref
import zipfile
import zlib
from io import BytesIO
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import MANIFEST_BYTES, PICTURE_BYTES, SOUND_BYTES
from avlmaps.recordings import images
from avlmaps.recordings.corrections import UP_IN_WORLD, from_opengl
from avlmaps.recordings.faults import Report, stop_at_first
from avlmaps.recordings.formats.file_recording import (
    Shots,
    StoredRecording,
    left_out,
    likeliest_sound,
    list_names,
    number_of,
    open_audio,
)
from avlmaps.recordings.formats.tables import (
    fitted_rig,
    median_camera,
    parse_json,
    read_json,
    resized_notice,
    rigid,
    unread_notice,
)
from avlmaps.recordings.plausible import pace_fault

_FPS = 60.0
_END, _HEAD_BYTES = b"bvx$", 4096  # of an LZFSE stream
# What the app writes beside; poses do not depend on initPose.
_IDLE = ("initPose", "cameraType")


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
    return (path / "EXR_RGBD/metadata.json").is_file() or _layout(path) is not None


def _layout(path: Path) -> tuple[str, str, str] | None:
    for names in (("metadata.json", "rgb", "depth"), ("metadata", "rgbd", "rgbd")):
        if (path / names[0]).is_file() and (path / names[1]).is_dir() and (path / names[2]).is_dir():
            return names
    return None


class _Files:
    """The files of a recording by name, in a folder or in an archive."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._archive = zipfile.ZipFile(path) if path.is_file() else None
        except (zipfile.BadZipFile, OSError) as error:
            raise RecordingError(
                f"{path} is no whole .r3d, which is a ZIP archive ({error}); share it from Record3D again."
            ) from None

    def names(self, folder: str, suffixes: tuple[str, ...]) -> list[str]:
        if self._archive is None:
            return list_names(self.path / folder, suffixes)
        every = [name.split("/") for name in self._archive.namelist()]
        return [name[-1] for name in every if name[:-1] == [folder] and name[-1].lower().endswith(suffixes)]

    def read(self, name: str, limit: int = PICTURE_BYTES) -> bytes:
        if self._archive is None:
            return images.read_bytes(self.path / name)
        try:
            if self._archive.getinfo(name).file_size > limit:
                raise RecordingError(f"{self.path} says that {name} has more than {limit:,} bytes; share it again.")
            return self._archive.read(name)
        except KeyError:
            raise RecordingError(f"{self.path} has no {name}; share it from Record3D again.") from None
        except (zipfile.BadZipFile, OSError, EOFError, zlib.error, NotImplementedError, RuntimeError) as error:
            raise RecordingError(f"{name} in {self.path} cannot be read ({error}); share it again.") from None

    def unpack_sound(self, folder: Path) -> None:
        """Write the archive's sound track into a folder, where it has one."""
        name = likeliest_sound(self._archive.namelist() if self._archive is not None else ())
        if name is not None:
            (folder / f"audio{Path(name).suffix.lower()}").write_bytes(self.read(name, SOUND_BYTES))

    def has(self, name: str) -> bool:
        if self._archive is None:
            return (self.path / name).is_file()
        return name in self._archive.NameToInfo


class _Pictures:
    """Colour as files, depth as LZFSE or EXR."""

    def __init__(self, files: _Files) -> None:
        self._files = files

    def colour(self, name: str, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
        return images.decode_colour(self._files.path / name, self._files.read(name), camera)

    def depth(self, name: str, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
        depth_m = _depth(self._files, name, (camera.width, camera.height))
        confidence = name.removesuffix(".depth") + ".conf"
        if name.endswith(".depth") and self._files.has(confidence):
            depth_m[_unfolded(self._files, confidence, depth_m.size).reshape(depth_m.shape) == 0] = 0.0
        return depth_m


def _unfolded(files: _Files, name: str, size: int) -> UInt8[np.ndarray, " n"]:
    content = files.read(name)
    raw = content if len(content) == size else _decompressed(files, name, content, size)
    if len(raw) != size:
        raise RecordingError(
            f"{name} in {files.path} has {len(raw):,} bytes where {size:,} belong; share or copy it again."
        )
    return np.frombuffer(raw, np.uint8)


def _decompressed(files: _Files, name: str, content: bytes, most: int) -> bytes:
    import lzfse

    library: Any = lzfse
    try:
        if not content.endswith(_END) or len(content) > most + _HEAD_BYTES:
            raise ValueError("it is cut off, or longer than what it holds")
        return library.decompress(content)
    except (library.error, ValueError, MemoryError) as error:
        reason = str(error) or "it is no LZFSE stream"
        raise RecordingError(f"{name} in {files.path} cannot be read: {reason}; share or copy it again.") from None


def _depth(files: _Files, name: str, size: tuple[int, int]) -> Float32[np.ndarray, "h w"]:
    width, height = size
    if name.endswith(".exr"):
        depth_m = _exr(files, name)
        if depth_m.shape != (height, width):
            raise RecordingError(
                f"{files.path / name} is {depth_m.shape[1]}x{depth_m.shape[0]}, the others {width}x{height}; every "
                "picture of a recording must have one size."
            )
    else:
        depth_m = _unfolded(files, name, 4 * width * height).view("<f4").reshape(height, width)
    return images.metres(depth_m, 1.0)


def _exr(files: _Files, name: str) -> Float32[np.ndarray, "h w"]:
    import OpenEXR

    library: Any = OpenEXR
    try:
        header = library.File(BytesIO(files.read(name)), header_only=True).header()
        (x0, y0), (x1, y1) = header["dataWindow"]
        if (int(x1) - int(x0) + 1) * (int(y1) - int(y0) + 1) > images.MOST_PIXELS:
            raise ValueError("it is larger than any depth picture")
        channels: dict[str, Any] = library.File(BytesIO(files.read(name)), separate_channels=True).channels()
        likely = next((n for n in ("Z", "R", "Y", "A") if n in channels), next(iter(channels)))
        return np.asarray(channels[likely].pixels, np.float32)
    except (RuntimeError, ValueError, TypeError, KeyError, StopIteration, MemoryError) as error:
        raise RecordingError(
            f"{files.path / name} cannot be read as OpenEXR ({str(error).splitlines()[0][:120]}); copy it again, or "
            "share the .r3d instead."
        ) from None


def open_record3d(path: Path, report: Report = stop_at_first) -> StoredRecording:
    """Open a recording in place."""
    inside = path / "EXR_RGBD" if (path / "EXR_RGBD").is_dir() else path
    layout = ("metadata", "rgbd", "rgbd") if path.is_file() else _layout(inside)
    if layout is None:
        raise RecordingError(f"{path} holds neither metadata with rgbd/ nor metadata.json with rgb/ and depth/.")
    files = _Files(inside)
    described, colour_in, depth_in = layout
    file = inside / described
    given, plain = _metadata(files, file, described)
    colour = {number_of(name): name for name in files.names(colour_in, images.COLOUR_SUFFIXES)}
    depth = {number_of(name): name for name in files.names(depth_in, (".depth", ".exr"))}
    numbers = [n for n in range(len(given.poses)) if n in colour and n in depth]
    if not numbers:
        raise RecordingError(
            f"{inside} has {len(given.poses)} poses, {len(colour)} colour and {len(depth)} depth pictures, and no "
            "frame with all three; was it recorded with LiDAR?"
        )
    notices = [*unread_notice(file, plain, (*_Metadata.__struct_fields__, *_IDLE), strict=False)]
    if len(numbers) < max(len(given.poses), len(colour)):
        lost = max(len(given.poses), len(colour)) - len(numbers)
        sentence = f"{lost} frame(s) lack one of colour, depth and pose and are left out."
        notices += left_out(inside, report, sentence, file)
    given_s = _stamps(file, given, notices)
    shots = Shots(
        names=[str(n) for n in numbers],
        colour=[f"{colour_in}/{colour[n]}" for n in numbers],
        depth=[f"{depth_in}/{depth[n]}" for n in numbers],
        stamps_s=given_s[numbers],
        world_from_camera=_poses(file, given)[numbers],
    )
    if fault := pace_fault(shots.stamps_s, "frames", 1.0 / _fps(given)):
        raise RecordingError(f"{file}: {fault}")
    rig, more = _rig(files, file, given, shots)
    folder = Path(tempfile.mkdtemp(prefix="avlmaps-r3d-")) if path.is_file() else None
    if folder is not None:
        files.unpack_sound(folder)
    audio, sound = open_audio(folder or path, float(given_s[0]))
    recording = StoredRecording.settled(
        path, "record3d", rig, shots, (*notices, *more, *sound), report, lambda _: file, pictures=_Pictures(files),
        up_in_world=UP_IN_WORLD.copy(), audio=audio,
    )  # fmt: skip
    if folder is not None:  # a track is read by pieces, for as long as the recording is open
        weakref.finalize(recording, shutil.rmtree, folder, ignore_errors=True)
    return recording


def _metadata(files: _Files, file: Path, name: str) -> tuple[_Metadata, dict[str, Any]]:
    if files.path.is_dir():
        return read_json(file, _Metadata)
    return parse_json(file, files.read(name, MANIFEST_BYTES), _Metadata)


def _fps(given: _Metadata) -> float:
    return given.fps if given.fps is not None and given.fps > 0.0 else _FPS


def _stamps(file: Path, given: _Metadata, notices: list[str]) -> Float[np.ndarray, " n"]:
    stamps = given.frameTimestamps
    if len(stamps) == len(given.poses):
        return np.array(stamps, np.float64)
    if stamps:
        raise RecordingError(
            f"{file} has {len(stamps)} frameTimestamps for {len(given.poses)} poses, so that it is not known which "
            "belong together; share it again, or remove the stamps and give fps."
        )
    notices.append(f"The recording has no stamps; {_fps(given):g} frames/s are assumed.")
    return np.arange(len(given.poses)) / _fps(given)


def _poses(file: Path, given: _Metadata) -> Float[np.ndarray, "n 4 4"]:
    if any(len(row) != 7 for row in given.poses):
        raise RecordingError(f"{file} has a pose of other than seven numbers (qx qy qz qw tx ty tz); share it again.")
    rows = np.array(given.poses, np.float64).reshape(-1, 7)
    return from_opengl(rigid(rows[:, 4:], rows[:, :4]))


def _rig(files: _Files, file: Path, given: _Metadata, shots: Shots) -> tuple[Rig, tuple[str, ...]]:
    per_frame = given.perFrameIntrinsicCoeffs
    if odd := next((row for row in per_frame if len(row) != 4), None):
        raise RecordingError(
            f"{file} has {len(odd)} numbers in a row of perFrameIntrinsicCoeffs, not the four fx fy cx cy; share it "
            "again."
        )
    k = given.K
    if not per_frame and len(k) != 9:
        raise RecordingError(f"{file} has no intrinsics (K has {len(k)} numbers, not 9); share it again.")
    numbers = np.array(per_frame or [[k[0], k[4], k[6] or k[2], k[7] or k[5]]], np.float64)
    camera, notices = median_camera(file, numbers, given.w, given.h)
    rgb_size = images.picture_size(files.path / shots.colour[0], files.read(shots.colour[0]))
    depth_size = (given.dw, given.dh)
    if shots.depth[0].endswith(".exr"):
        height, width = _exr(files, shots.depth[0]).shape
        depth_size = (width, height)
    elif not (given.dw > 0 and given.dh > 0):
        depth_size = _size_like(files, shots.depth[0], camera)
    rig = fitted_rig(camera, rgb_size, depth_size, file)
    return rig, (*notices, *resized_notice(camera, rgb_size))


def _size_like(files: _Files, name: str, camera: Pinhole) -> tuple[int, int]:
    count = len(_decompressed(files, name, files.read(name), 4 * camera.width * camera.height)) // 4
    width = max(1, round((count * camera.width / camera.height) ** 0.5))
    return width, count // width
