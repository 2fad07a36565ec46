"""RTAB-Map's databases (``.db``, SQLite): colour, depth, calibration and poses of every node of its graph.

Facts of the data (RTAB-Map's schema and its code): ``Data.image`` is a JPEG or PNG; ``Data.depth`` a PNG of 16-bit
millimetres, a PNG of four channels whose bytes are a float32 in metres, or RVL; ``Data.calibration`` has, since 0.18,
a header of eleven int32 for each camera (version, type, size, and how many numbers of K, D, R, P and the local
transform follow), before that fx fy cx cy width height as float32 and the transform. ``Node.pose`` is the odometry,
3x4 float32, of the robot's base; ``Admin.opt_poses`` and ``opt_ids`` are the poses after optimisation, compressed by
zlib, and go before where they are. The local transform leads from the base to the camera; the world has z up (ROS).
"""

import sqlite3
import struct
import threading
import zlib
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import SAMPLED_BYTES, checked_size
from avlmaps.recordings import images
from avlmaps.recordings.faults import note, readable
from avlmaps.recordings.formats.file_recording import Shots, StoredRecording, left_out, opener, settle
from avlmaps.recordings.formats.tables import DISTORTED, fitted_rig, pinhole

_SQLITE = b"SQLite format 3\0"
_RVL = b"DEPTHRVL"
_HEADER = struct.Struct("<11i")
_TRANSFORM_NUMBERS = 12
_STEREO = 1
_MOST_POSES_BYTES = 1 << 30


def is_rtabmap(path: Path) -> bool:
    """Return whether a file is a SQLite database that is called one of RTAB-Map's."""
    if path.suffix.lower() != ".db" or not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(_SQLITE)) == _SQLITE


class _Database:
    def __init__(self, path: Path) -> None:
        self.path = path
        self._local = threading.local()
        with readable(path):
            checked_size(path, SAMPLED_BYTES)
        wal = path.with_name(path.name + "-wal")
        if wal.is_file() and wal.stat().st_size > 0:
            raise RecordingError(f"{wal} holds changes that are not in {path.name}; open it in RTAB-Map, and close it.")

    @contextmanager
    def told(self) -> Generator[None]:
        try:
            yield
        except (sqlite3.Error, zlib.error, struct.error, ValueError) as error:
            raise RecordingError(
                f"{self.path} cannot be read as a database of RTAB-Map ({error}); if it was cut off, recover it with "
                "`rtabmap-recovery`, or copy it again."
            ) from None

    def rows(self, query: str, *values: Any) -> list[tuple[Any, ...]]:
        with self.told():
            if not hasattr(self._local, "connection"):
                # immutable: nothing is written beside the file, not even a lock.
                uri = f"{self.path.resolve().as_uri()}?mode=ro&immutable=1"
                self._local.connection = sqlite3.connect(uri, uri=True)
            return self._local.connection.execute(query, values).fetchall()

    def blob(self, column: str, node: str) -> bytes:
        found = self.rows(f"SELECT {column} FROM Data WHERE id = ?", int(node))
        if not found or not isinstance(found[0][0], bytes) or not found[0][0]:
            raise RecordingError(f"Node {node} of {self.path} has no {column}.")
        return found[0][0]


class _Pictures:
    def __init__(self, database: _Database) -> None:
        self._database = database

    def colour(self, name: str, camera: Pinhole) -> UInt8[np.ndarray, "h w 3"]:
        return images.decode_colour(self._place(name, "colour"), self._database.blob("image", name), camera)

    def depth(self, name: str, camera: Pinhole) -> Float32[np.ndarray, "h w"]:
        place = self._place(name, "depth")
        depth_m = _unpacked_depth(place, self._database.blob("depth", name))
        images.check_size(place, depth_m.shape, camera)
        return depth_m

    def _place(self, name: str, what: str) -> Path:
        return self._database.path / f"node {name}, {what}"


def _unpacked_depth(place: Path, content: bytes) -> Float32[np.ndarray, "h w"]:
    if content.startswith(_RVL):
        return images.metres(images.decode_rvl_depth(place, content, 16), 1000.0)
    import cv2

    images.check_whole(place, content)
    images.picture_size(place, content)
    raw = images.decode_picture(content, cv2.IMREAD_UNCHANGED)
    if raw is not None and raw.dtype == np.uint16 and raw.ndim == 2:
        return images.metres(raw, 1000.0)
    if raw is not None and raw.dtype == np.uint8 and raw.ndim == 3 and raw.shape[2] == 4:
        return images.metres(np.ascontiguousarray(raw).view("<f4")[..., 0], 1.0)
    raise RecordingError(f"{place} is no depth picture (it may be the right picture of a stereo camera).")


@opener
def open_rtabmap(path: Path) -> StoredRecording:
    """Open a database in place."""
    database = _Database(path)
    tables = {name for (name,) in database.rows("SELECT name FROM sqlite_master WHERE type = 'table'")}
    columns = {row[1] for row in database.rows("PRAGMA table_info(Data)")}
    if missing := ({"Node", "Data", "Admin"} - tables) or ({"image", "depth", "calibration"} - columns):
        raise RecordingError(
            f"{database.path} is a SQLite database without RTAB-Map's {sorted(missing)[0]}; give one that RTAB-Map "
            "recorded, and open one of a version before 0.10 in today's, which converts it."
        )
    said = database.rows("SELECT version FROM Admin")
    version = tuple(int(word) for word in str(said[0][0] if said else "").split(".") if word.isdigit())
    optimised = _optimised(database)
    rows = database.rows(
        "SELECT Node.id, Node.stamp, Node.pose, Data.calibration, length(Data.image), length(Data.depth) FROM Node "
        "JOIN Data ON Data.id = Node.id ORDER BY Node.stamp, Node.id"
    )
    whole = [row for row in rows if isinstance(row[3], bytes) and row[3] and row[4] and row[5]]
    if not whole:
        raise RecordingError(
            f"{path} has {len(rows)} node(s), and none with colour, depth and calibration; record with "
            "Mem/BinDataKept true (and Mem/ImageKept), or export it again."
        )
    if optimised:
        note(f"Poses are the optimised ones of {len(optimised)} of the graph's nodes.")
    else:
        note(
            f"The database has no optimised poses, so that odometry is used for its {len(whole)} nodes, which drifts; "
            "open it in rtabmap-databaseViewer (or reprocess it) and save to have them."
        )
    used = [row for row in whole if row[0] in optimised] if optimised else whole
    if not used:
        raise RecordingError(f"{path} has optimised poses for none of its {len(whole)} nodes with pictures.")
    if len(used) < len(rows):
        sentence = f"{len(rows) - len(used)} node(s) lack colour, depth, calibration or pose and are left out."
        left_out(path, sentence)
    with database.told():
        seen = [_calibration(path, row[0], row[3], version) for row in used]
        base = np.stack([optimised[row[0]] if optimised else _transform(row[2] or b"") for row in used])
    shots = Shots(
        names=[str(row[0]) for row in used],
        colour=[str(row[0]) for row in used],
        depth=[str(row[0]) for row in used],
        stamps_s=np.array([float(row[1] or 0.0) for row in used]),
        world_from_camera=base @ np.stack([base_from_camera for _, base_from_camera, _ in seen]),
    )
    camera, _, distorted = seen[0]
    if distorted:
        note(DISTORTED)
    rig, unit_m = _rig(path, database, shots, camera)
    shots = settle(path, shots, lambda _: path)
    start_s = float(shots.stamps_s[0]) if len(shots.names) else 0.0
    shots = replace(shots, stamps_s=shots.stamps_s - start_s)
    return StoredRecording(
        path=path, format="rtabmap", rig=rig, shots=shots, pictures=_Pictures(database),
        up_in_world=np.array([0.0, 0.0, 1.0]), stored_depth_unit_m=unit_m, begins_s=start_s,
    )  # fmt: skip


def _optimised(database: _Database) -> dict[int, np.ndarray]:
    columns = {row[1] for row in database.rows("PRAGMA table_info(Admin)")}
    if not {"opt_ids", "opt_poses"} <= columns:
        return {}
    for blobs in database.rows("SELECT opt_ids, opt_poses FROM Admin"):
        if not all(blobs):
            continue
        with database.told():
            raw = [zlib.decompressobj().decompress(blob, _MOST_POSES_BYTES) for blob in blobs]
            ids, numbers = np.frombuffer(raw[0], "<i4"), np.frombuffer(raw[1], "<f4")
            poses = map(_matrix, numbers.reshape(-1, _TRANSFORM_NUMBERS))
            return dict(zip(ids.tolist(), poses, strict=True))
    return {}


def _transform(blob: bytes) -> Float[np.ndarray, "4 4"]:
    if len(blob) != 4 * _TRANSFORM_NUMBERS:
        return np.full((4, 4), np.nan)
    return _matrix(np.frombuffer(blob, "<f4"))


def _matrix(numbers: np.ndarray) -> Float[np.ndarray, "4 4"]:
    full = np.eye(4)
    full[:3] = numbers.astype(np.float64).reshape(3, 4)
    return full if np.any(full[:3, :3]) else np.full((4, 4), np.nan)  # all zero: RTAB-Map's word for none


def _calibration(path: Path, node: int, blob: bytes, version: tuple[int, ...]) -> tuple[Pinhole, Any, bool]:
    if version and version < (0, 18):
        raise RecordingError(f"{path} is of RTAB-Map before 0.18; open it in today's, which converts it.")
    head = _HEADER.unpack_from(blob)
    kind, width, height, (k, d, r, p, local) = head[3], head[4], head[5], head[6:]
    if kind == _STEREO:
        raise RecordingError(f"{path} was recorded with a stereo camera, without depth; record depth (RGB-D) instead.")
    if min(k, d, r, p, local) < 0 or max(k, d, r, p, local) > 64 or k != 9 or local not in (0, _TRANSFORM_NUMBERS):
        raise ValueError(f"the calibration of node {node} is damaged")
    size = _HEADER.size + 8 * (k + d + r + p) + 4 * local
    if len(blob) > size:
        raise RecordingError(f"{path} has several cameras in one picture; record or export one of them.")
    numbers = np.frombuffer(blob, "<f8", k + d + r + p, _HEADER.size)
    distortion, projection = numbers[k : k + d], numbers[k + d + r :]
    fx, fy, cx, cy = numbers[[0, 4, 2, 5]]
    if p == _TRANSFORM_NUMBERS and projection[0] > 0.0:  # pictures are rectified where there is a projection
        fx, fy, cx, cy = projection[[0, 5, 2, 6]]
        distortion = distortion[:0]
    base_from_camera = _matrix(np.frombuffer(blob, "<f4", local, size - 4 * local)) if local else np.eye(4)
    # OpenCV counts pixel centres as whole numbers
    camera = pinhole(path / f"node {node}, calibration", fx, fy, cx + 0.5, cy + 0.5, width, height)
    return camera, base_from_camera, bool(np.abs(distortion).max(initial=0.0) > 1e-9)


def _rig(path: Path, database: _Database, shots: Shots, camera: Pinhole) -> tuple[Rig, float]:
    first = shots.names[0]
    rgb_size = images.picture_size(path / f"node {first}, colour", database.blob("image", first))
    blob = database.blob("depth", first)
    height, width = _unpacked_depth(path / f"node {first}, depth", blob).shape
    rig = fitted_rig(camera, rgb_size, (width, height), path)
    floats = not blob.startswith(_RVL) and blob[25:26] == b"\x06"  # a PNG's colour type: four channels
    return rig, 1.0 if floats else 1e-3
