"""``map.json`` on the disk: written with its own checksum, and held against itself and the arrays that it lists.

A map that was edited, or put together from two, is of the right form and still wrong: positions are twice as far,
up is down, a sound ends before it begins. Each ``..._fault`` returns the first such fault in words, or nothing.
"""

import hashlib
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import MANIFEST_BYTES, decode_json, read_regular, write_bytes_atomically
from avlmaps.core.registry import Kind
from avlmaps.core.wording import coordinates
from avlmaps.maps.grid import index_ends
from avlmaps.maps.store.array_files import explain_write_errors
from avlmaps.maps.store.manifest import SCHEMA_VERSION, MapInfo
from avlmaps.maps.types import HeardSounds, Keyframes, SourceEvidence, Voxels

MANIFEST = "map.json"
RESTORE = "restore it from a copy, or build the map again in its place"


class _Ident(msgspec.Struct):
    format: str = ""
    schema_version: int = 0


def write_manifest(folder: Path, info: MapInfo) -> None:
    """Write ``map.json``; with it the folder becomes this map, and not before."""
    signed = msgspec.structs.replace(info, checksum=checksum_of(msgspec.json.encode(info)))
    content = msgspec.json.format(msgspec.json.encode(signed), indent=2)
    with explain_write_errors(folder):
        write_bytes_atomically(folder / MANIFEST, content + b"\n")


def read_manifest(path: Path) -> bytes:
    """Return the content of ``map.json``.

    Raises:
        FileNotFoundError, NotADirectoryError: there is none.
        MapError: it cannot be read, or is not a regular file of a possible size.
    """
    try:
        return read_regular(path, MANIFEST_BYTES)
    except (FileNotFoundError, NotADirectoryError):
        raise
    except OSError as fault:
        raise MapError(f"{path} cannot be read ({fault.strerror or fault}); check the file.") from fault


def parse_manifest(content: bytes, path: Path) -> MapInfo:
    """Return the content of ``map.json``.

    Raises:
        MapError: it is not JSON, not UTF-8, of no map, of another schema version, lacks something, contradicts itself,
            or is not what was written.
    """
    try:
        ident = decode_json(content, _Ident)
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise MapError(f"{path} is damaged: it is not JSON in UTF-8 ({fault}); restore it from a copy.") from fault
    if ident.format != "avlmap":
        raise MapError(f"{path} belongs to no map of avlmaps; give the folder that `avlmaps build` wrote.")
    if ident.schema_version != SCHEMA_VERSION:
        how = "upgrade avlmaps" if ident.schema_version > SCHEMA_VERSION else "build the map again in its place"
        raise MapError(
            f"{path} has schema version {ident.schema_version}, this avlmaps reads version {SCHEMA_VERSION}; {how}."
        )
    try:
        info = decode_json(content, MapInfo)
    except (msgspec.DecodeError, ValueError, MapError) as fault:
        raise MapError(f"{path} is damaged: {str(fault).rstrip('.')}; restore it from a copy.") from fault
    fault = manifest_fault(info)
    if not fault and info.checksum and info.checksum != checksum_of(content):
        fault = "it was changed after it was written (its checksum is another)"
    if fault:
        raise MapError(f"{path} is damaged: {fault}; {RESTORE}.")
    return info


_UNIT = 1e-3
_ROTATION = 1e-3
_PROBABILITY = 0.01
# Corners of the box are written with six digits.
_BOX_M = 1e-4
# No camera, nothing that it saw and no sound lies farther outside of a map's voxels.
_OUTSIDE_M = 1000.0


def checksum_of(content: bytes) -> str:
    """Return the hex SHA-256 of all that ``map.json`` says but for its own checksum and the timings.

    Layout and the order of keys make no difference; every key counts, known or not. Without the timings, two builds of
    one recording have one checksum.

    Raises:
        msgspec.DecodeError, UnicodeDecodeError: it is not JSON.
    """
    said: dict[str, Any] = decode_json(content, dict[str, Any])
    for key in ("checksum", "timings"):
        said.pop(key, None)
    return hashlib.sha256(msgspec.json.encode(said, order="deterministic")).hexdigest()


def manifest_fault(info: MapInfo) -> str:
    """Return how ``map.json`` contradicts itself."""
    return next(chain(_number_faults(info), _floor_faults(info), _geometry_faults(info), _file_faults(info)), "")


def _number_faults(info: MapInfo) -> Iterator[str]:
    sizes = info.voxel_size_m, info.settings.voxel_size_m
    if not np.isclose(*sizes, rtol=1e-9):
        yield f"voxel_size_m is {sizes[0]:g} and its settings say {sizes[1]:g}"
    if info.seed != info.settings.seed:
        yield f"seed is {info.seed} and its settings say {info.settings.seed}"
    counts = msgspec.structs.asdict(info.counts)
    if odd := [f"{what} {count}" for what, count in counts.items() if count < 0]:
        yield f"there cannot be {odd[0]}"
    if not (np.isfinite(info.recording.duration_s) and info.recording.duration_s >= 0.0):
        yield f"the recording's duration_s is {info.recording.duration_s:g}"
    if any(bad.index < 0 for bad in info.bad_frames):
        yield "a bad frame has a negative index"


def _floor_faults(info: MapInfo) -> Iterator[str]:
    for floor in info.ground.floors if info.ground else ():
        for guess in (floor.best, *([floor.runner_up] if floor.runner_up else [])):
            shares = np.array([guess.confidence, guess.below, floor.cameras])
            numbers = np.array([guess.height_m, guess.camera_height_m, guess.level_m2])
            if not (np.isfinite(numbers).all() and guess.level_m2 >= 0.0):
                yield "a floor's heights or area are no numbers"
            if not ((shares >= 0.0) & (shares <= 1.0 + 1e-6)).all():
                yield f"a floor's confidence or share is {shares.min():g} or {shares.max():g}; they lie in [0, 1]"


def _geometry_faults(info: MapInfo) -> Iterator[str]:
    length = float(np.linalg.norm(info.up.direction))
    if not abs(length - 1.0) <= _UNIT:
        yield f"the up direction has length {length:g}, not 1"
    if not 0.0 <= info.up.support <= 1.0 + 1e-6:
        yield f"the support of the up direction is {info.up.support:g}; it lies in [0, 1]"
    rigid = {"rgb_from_depth": info.rig.rgb_from_depth}
    for number, visit in enumerate(info.visits, 1):
        rigid |= {
            f"map_from_recording of visit {number}": visit.map_from_recording,
            f"rgb_from_depth of visit {number}": visit.rig.rgb_from_depth,
        }
    for what, rows in rigid.items():
        if fault := _rigid_fault(np.array(rows, np.float64)[None]):
            yield f"{what} {fault}"
    low, high = np.array(info.bounding_box_m.low), np.array(info.bounding_box_m.high)
    if not (np.isfinite([low, high]).all() and (low <= high).all()):
        yield f"the bounding box goes from {low.tolist()} to {high.tolist()}"


def _file_faults(info: MapInfo) -> Iterator[str]:
    size = sum(file.bytes for file in info.files.values())
    if size != info.bytes:
        yield f"bytes is {info.bytes}, the files have {size} together"
    owners: dict[str, str] = {}
    for name, file in info.files.items():
        if (other := owners.setdefault(file.path, name)) != name:
            yield f"{other} and {name} are one file ({file.path})"


def arrays_fault(info: MapInfo, voxels: Voxels, keyframes: Keyframes, sounds: HeardSounds) -> str:
    """Return how the arrays contradict ``map.json`` or what their kind is; cheap, large features are not looked at."""
    return next(
        chain(
            _model_faults(info, voxels, keyframes, sounds),
            _voxel_faults(info, voxels),
            _keyframe_faults(keyframes),
            _sound_faults(sounds),
            _place_faults(info, voxels, keyframes, sounds),
        ),
        "",
    )


def sources_fault(info: MapInfo, sources: SourceEvidence) -> str:
    """Return how the evidence of where sounds came from contradicts the map, or probability."""
    if len(sources) != info.counts.sounds:
        return f"it has evidence of {len(sources)} sounds, the map has {info.counts.sounds}"
    total = float(sources.prior.sum(dtype=np.float64))
    if (sources.prior < 0.0).any() or (len(sources.prior) and not abs(total - 1.0) < _PROBABILITY):
        return f"its probabilities add up to {total:g}, or one is negative"
    if sources.heard.max(initial=0.0) > _PROBABILITY:
        return "a likelihood is over that of the likeliest place"
    return _outside(info, "a place where sounds may come from", sources.place)


def _model_faults(info: MapInfo, voxels: Voxels, keyframes: Keyframes, sounds: HeardSounds) -> Iterator[str]:
    columns = (
        (Kind.PIXELS, "voxels", voxels.feature.shape[1]),
        (Kind.VIEWS, "keyframes", keyframes.view.shape[1]),
        (Kind.SOUNDS, "sounds", sounds.feature.shape[1] if len(sounds) else 0),
    )
    for kind, what, width in columns:
        model = info.models.get(kind.value)
        if model is not None and width not in (0, model.dim):
            yield f"the features of its {what} have {width} numbers, those of {model.id} have {model.dim}"


def _voxel_faults(info: MapInfo, voxels: Voxels) -> Iterator[str]:
    index = np.asarray(voxels.index)
    if len(index):
        low, high = index_ends(index)
        box = np.stack([low, high + 1]) * info.voxel_size_m
        said = np.array([info.bounding_box_m.low, info.bounding_box_m.high])
        if not np.abs(box - said).max() <= _BOX_M + 1e-9 * np.abs(said).max():
            yield (
                f"its bounding box goes from {_place(said[0])} to {_place(said[1])}, but its voxels of "
                f"{info.voxel_size_m:g} m from {_place(box[0])} to {_place(box[1])}"
            )
        seen_s = float(np.ptp(voxels.last_seen_s))
        if seen_s > info.recording.duration_s + 1.0:
            yield f"its voxels were seen over {seen_s:.6g} s, and the recording has {info.recording.duration_s:.6g} s"
    if len(index) and (np.min(voxels.weight) < 0.0 or np.min(voxels.hits) < 1):
        yield "a voxel has a negative weight or was hit by no pixel"


def _keyframe_faults(keyframes: Keyframes) -> Iterator[str]:
    if (np.diff(keyframes.stamp_s) <= 0.0).any():
        yield "its keyframes are not in the order of time"
    if fault := _rigid_fault(np.asarray(keyframes.world_from_camera)):
        yield f"a keyframe's pose {fault}"


def _sound_faults(sounds: HeardSounds) -> Iterator[str]:
    if (np.diff(sounds.onset_s) < 0.0).any():
        yield "its sounds are not in the order of their onset"
    if (length_s := np.asarray(sounds.offset_s) - np.asarray(sounds.onset_s)).min(initial=0.0) < 0.0:
        worst = int(np.argmin(length_s))
        yield f"sound {worst} ends at {sounds.offset_s[worst]:.2f} s, before it begins at {sounds.onset_s[worst]:.2f} s"


def _place_faults(info: MapInfo, voxels: Voxels, keyframes: Keyframes, sounds: HeardSounds) -> Iterator[str]:
    places = {
        "a keyframe": keyframes.world_from_camera[:, :3, 3],
        "what a keyframe saw": keyframes.centre,
        "where a sound was heard": sounds.track,
    }
    if len(voxels):
        yield from filter(None, (_outside(info, what, found) for what, found in places.items()))


def _outside(info: MapInfo, what: str, places: np.ndarray) -> str:
    low, high = np.array(info.bounding_box_m.low), np.array(info.bounding_box_m.high)
    away_m = float(np.maximum(low - places, places - high).max(initial=0.0))
    return f"{what} lies {away_m:,.0f} m outside of its voxels" if away_m > _OUTSIDE_M else ""


def _rigid_fault(poses: np.ndarray) -> str:
    rotation = poses[:, :3, :3]
    if not np.isfinite(poses).all() or not np.allclose(poses[:, 3], (0.0, 0.0, 0.0, 1.0), atol=1e-6):
        return "is no rigid transform"
    off = float(np.abs(np.swapaxes(rotation, 1, 2) @ rotation - np.eye(3)).max(initial=0.0))
    if off > _ROTATION or (np.linalg.det(rotation) < 0.0).any():
        return f"is no rotation (off orthonormal by {off:.3g}, or mirrored)"
    return ""


def _place(point: np.ndarray) -> str:
    return f"({coordinates(point)})"
