"""Where the microphones of a recording are, and what a device said of where sounds came from.

Microphones are one, two or an array, rigid on the robot. Directions are azimuths with stamps, as arrays with a chip
publish them: on the plan, from where the depth camera looks, counter-clockwise (to the left); a device that counts from
elsewhere has an offset, which a build finds along the walk (``avlmaps.maps.sources.bearings``).
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import isnan
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core import files, poses
from avlmaps.core.arrays import Float
from avlmaps.core.columns import concat, take
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.faults import readable

# Two microphones nearer than this hear the same; a robot is smaller than this.
LEAST_APART_M, MOST_APART_M = 0.01, 5.0
MOST_CHANNELS = 64
# A channel that is later than this against the others is not of their clock.
MOST_DELAY_S = 0.01
# x forward, y left, z up, at the camera: how the robot's frame lies in the camera's (x right, y down, z forward).
LEVEL_CAMERA_FROM_ROBOT = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64)


class MicrophoneNumbers(msgspec.Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """Microphones as JSON has them: those of ``Microphones``, and one sound file for each channel if they have some.

    ``channels`` count from 1. By default the robot's frame has its origin at the camera, which looks level.
    """

    positions_m: list[list[float]]
    camera_from_robot: list[list[float]] | None = None
    files: list[str] | None = None
    delays_s: list[float] | None = None
    channels: list[int] | None = None

    def microphones(self) -> "Microphones":
        for name in self.files or ():
            if not name or Path(name).name != name or "\0" in name:
                raise RecordingError(f"microphones.files names {name!r}; name files that lie beside recording.json.")
        position_m, turn = _numbers(self.positions_m, "positions_m"), LEVEL_CAMERA_FROM_ROBOT
        if self.camera_from_robot is not None:
            turn = _numbers(self.camera_from_robot, "camera_from_robot")
        if position_m.shape[1:] != (3,) or turn.shape != (4, 4):
            raise RecordingError(
                "microphones.positions_m are three numbers, x, y and z in metres, for each channel, and "
                "microphones.camera_from_robot is a matrix of 4x4."
            )
        late_s = None if self.delays_s is None else np.array(self.delays_s, np.float64)
        return Microphones(position_m, turn, late_s, tuple(number - 1 for number in self.channels or ()))

    @staticmethod
    def of(microphones: "Microphones") -> "MicrophoneNumbers":
        level = np.array_equal(microphones.camera_from_robot, LEVEL_CAMERA_FROM_ROBOT)
        return MicrophoneNumbers(
            microphones.position_m.tolist(),
            None if level else microphones.camera_from_robot.tolist(),
            delays_s=None if microphones.delay_s is None else microphones.delay_s.tolist(),
            channels=[channel + 1 for channel in microphones.channels] or None,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Microphones:
    """The microphones, one for each channel of the track.

    Attributes:
        position_m: (m, 3) places in the robot's frame (x forward, y left, z up), metres.
        camera_from_robot: 4x4, from the robot's frame to the depth camera's.
        delay_s: (m,) by how much each channel is late, seconds; None where none is.
        channels: which channels of the track they are, from 0; empty where they are all of them.
    """

    position_m: Float[np.ndarray, "m 3"]
    camera_from_robot: Float[np.ndarray, "4 4"] = field(default_factory=lambda: LEVEL_CAMERA_FROM_ROBOT)
    delay_s: Float[np.ndarray, " c"] | None = None
    channels: tuple[int, ...] = ()

    @property
    def longest_m(self) -> float:
        """The distance of the farthest two, metres."""
        return float(np.linalg.norm(self.position_m[:, None] - self.position_m[None], axis=2).max())

    def __post_init__(self) -> None:
        for name in ("position_m", "camera_from_robot", "delay_s"):
            given = getattr(self, name)
            if name != "delay_s" or given is not None:
                object.__setattr__(self, name, _numbers(given, name))
        place, known = self.position_m, set(self.channels)
        fits = place.ndim == 2 and place.shape[1] == 3 and 1 <= len(place) <= MOST_CHANNELS
        if not fits or not np.isfinite(place).all():
            raise RecordingError(
                f"The microphones' positions have shape {place.shape}; give three finite numbers, metres, for each of "
                f"1 to {MOST_CHANNELS} channels."
            )
        late = np.zeros(len(place)) if self.delay_s is None else self.delay_s
        if late.shape != (len(place),) or not (np.abs(late) <= MOST_DELAY_S).all():  # NaN is not
            raise RecordingError(
                f"The delays of the channels are {late.tolist()} s; give one for each of the {len(place)}, at most "
                f"{MOST_DELAY_S:g} s either way, or align the files of the channels first."
            )
        if known and not (len(known) == len(self.channels) == len(place) and min(known) >= 0):
            numbers = ", ".join(str(channel + 1) for channel in self.channels)
            raise RecordingError(
                f"microphones.channels are {numbers}; name {len(place)} different ones, counted from 1."
            )
        poses.orthonormalize(self.camera_from_robot, "the robot's frame in the camera, microphones.camera_from_robot,")
        for one, other in itertools.combinations(range(len(place)), 2):
            apart_m = float(np.linalg.norm(place[one] - place[other]))
            if not LEAST_APART_M <= apart_m <= MOST_APART_M:
                raise RecordingError(
                    f"The microphones of channels {one + 1} and {other + 1} are {apart_m:.3g} m apart, and those of a "
                    f"robot that show a direction {LEAST_APART_M:g} to {MOST_APART_M:g} m; give their places in metres."
                )

    def __len__(self) -> int:
        return len(self.position_m)

    def in_world_m(self, world_from_camera: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n m 3"]:
        in_camera_m = poses.apply(self.camera_from_robot, self.position_m)
        turned = np.einsum("nij,mj->nmi", world_from_camera[:, :3, :3], in_camera_m)
        return turned + world_from_camera[:, None, :3, 3]

    def take(self, channels: Sequence[int]) -> "Microphones":
        """Return some of them, as those of a track that has no other channels."""
        late_s = None if self.delay_s is None else self.delay_s[list(channels)]
        return Microphones(self.position_m[list(channels)], self.camera_from_robot, late_s)


def _numbers(given: Any, name: str) -> Float[np.ndarray, "*n"]:
    try:
        array = np.asarray(given)
    except (TypeError, ValueError, RuntimeError):  # rows of several lengths, or a tensor of a GPU
        array = np.array(None)
    if array.dtype.kind not in "fiu":
        raise RecordingError(f"{name} of microphones must be an array of numbers, not {given!r}.")
    return np.asarray(array, np.float64)


PRESETS: dict[str, list[list[float]]] = {
    "mono": [[0.0, 0.0, 0.0]],
    "stereo": [[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]],
    "square4": [[0.1, 0.1, 0.0], [0.1, -0.1, 0.0], [-0.1, -0.1, 0.0], [-0.1, 0.1, 0.0]],
}
"""Places of the arrays that have a name, metres: the left of two is first, the square begins in front on the left."""


def microphones_named(words: str) -> Microphones:
    """Return the array of a name, or of a JSON file with ``positions_m``; RecordingError where there is neither."""
    if words in PRESETS:
        return Microphones(np.array(PRESETS[words], np.float64))
    path = files.user_path(words)
    try:
        return files.decode_json(files.read_regular(path, files.DESCRIPTION_BYTES), MicrophoneNumbers).microphones()
    except OSError as error:
        raise RecordingError(
            f"There are no microphones called {words!r} and no such file ({error.strerror or error}); choose "
            f"{', '.join(PRESETS)}, or a JSON file with positions_m."
        ) from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise RecordingError(f'{path} is no microphones ({error}); write {{"positions_m": [[x, y, z]]}}.') from None


def given_microphones(given: Any) -> Microphones:
    """Return the array that a program gave: itself, its name or a JSON file; else RecordingError."""
    if isinstance(given, Microphones):
        return given
    if not isinstance(given, str | Path):
        raise RecordingError(f"microphones: Microphones, a name ({', '.join(PRESETS)}) or a JSON file, not {given!r}.")
    return microphones_named(str(given))


def write_microphones(path: Path, microphones: Microphones) -> None:
    """Write an array as a JSON file that ``microphones_named`` reads; all or nothing."""
    content = msgspec.json.format(msgspec.json.encode(MicrophoneNumbers.of(microphones)), indent=2) + b"\n"
    try:
        files.write_bytes_atomically(path, content)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written ({error.strerror or error}); choose another file.") from None


DIRECTIONS = "directions.csv"
COLUMNS = ("stamp_s", "azimuth_rad", "elevation_rad", "confidence")
_OUTSIDE_S = 1.0  # devices start a moment before the sound, and stop after it
_TURN_RAD = 2.0 * np.pi + 1e-3
_SHOWN = 30


@dataclass(frozen=True, slots=True, eq=False)
class DirectionTrack:
    """Directions on the recording's clock.

    Attributes:
        stamp_s: (n,) strictly rising seconds.
        azimuth_rad: (n,) from where the depth camera looks, counter-clockwise, but for the device's offset.
        elevation_rad: (n,) over the horizon; NaN where it is not known.
        confidence: (n,) how much each counts, 0 to 1.
        known_rad: the device's offset and its standard deviation, as an earlier recording has shown them.
    """

    stamp_s: Float[np.ndarray, " n"]
    azimuth_rad: Float[np.ndarray, " n"]
    elevation_rad: Float[np.ndarray, " n"]
    confidence: Float[np.ndarray, " n"]
    known_rad: tuple[float, float] | None = None

    @classmethod
    def of(cls, stamp_s: Any, azimuth_rad: Any, elevation_rad: Any = None, confidence: Any = None) -> "DirectionTrack":
        """Return a track; what is not given is not known, or counts wholly."""
        stamps = np.asarray(stamp_s, np.float64)
        unknown, whole = np.full(len(stamps), np.nan), np.ones(len(stamps))
        return cls(
            stamps, np.asarray(azimuth_rad, np.float64), unknown if elevation_rad is None else elevation_rad,
            whole if confidence is None else confidence,
        )  # fmt: skip

    def __post_init__(self) -> None:
        if fault := self._fault():
            raise RecordingError(f"The directions cannot be used: {fault}.")

    def __len__(self) -> int:
        return len(self.stamp_s)

    def _fault(self) -> str:
        stamp, azimuth, elevation, sure = self.stamp_s, self.azimuth_rad, self.elevation_rad, self.confidence
        degrees = "more than any angle in radians, so they look like degrees; multiply them by pi/180"
        checks = (
            *(
                (name, value, np.isfinite(value), "which is NaN or infinite; leave such rows out")
                for name, value in (("stamp", stamp), ("azimuth", azimuth), ("confidence", sure))
            ),
            ("stamp", stamp, np.diff(stamp, prepend=-np.inf) > 0.0, "not after the one before; stamps must rise"),
            ("azimuth", azimuth, np.abs(azimuth) <= _TURN_RAD, degrees),
            ("elevation", elevation, np.abs(np.nan_to_num(elevation)) <= np.pi / 2 + 1e-3, degrees),
            ("confidence", sure, (sure >= 0.0) & (sure <= 1.0), "and it must be from 0 to 1"),
        )
        for name, value, fine, what in checks:
            if not fine.all():
                row = int(np.argmin(fine))
                return f"the {name} of row {row + 1} is {value[row]:g}, {what}"
        return ""

    @classmethod
    def joined(cls, parts: "Sequence[DirectionTrack]") -> "DirectionTrack":
        """Return parts that follow one another as one track, with what the first knows of the device."""
        return concat(parts, known_rad=parts[0].known_rad)

    def between(self, onset_s: float, offset_s: float) -> "DirectionTrack":
        rows = slice(*np.searchsorted(self.stamp_s, [onset_s, offset_s]).tolist())
        return take(replace(self, known_rad=None), rows)

    def require_beside(self, start_s: float, end_s: float, where: str) -> None:
        """Refuse directions of another clock than the sound's: more than half of the stamps lie outside of it."""
        inside = (self.stamp_s >= start_s - _OUTSIDE_S) & (self.stamp_s <= end_s + _OUTSIDE_S)
        if len(self) and inside.mean() < 0.5:
            raise RecordingError(
                f"{where}: {int((~inside).sum())} of {len(self)} stamps, from {self.stamp_s[0]:.2f} to "
                f"{self.stamp_s[-1]:.2f} s, lie outside of the sound ({start_s:.2f} to {end_s:.2f} s); give them in "
                "seconds of the recording's clock."
            )


def given_directions(stamp_s: Any, azimuth_rad: Any, elevation_rad: Any, confidence: Any) -> DirectionTrack:
    """Return the directions that a program gave, of one moment or of some; RecordingError where they do not fit."""
    column: dict[str, np.ndarray] = {}
    for name, given in zip(COLUMNS, (stamp_s, azimuth_rad, elevation_rad, confidence), strict=True):
        if given is None and name in COLUMNS[2:]:
            continue
        try:
            array = np.atleast_1d(np.asarray(given))
            column[name] = array.astype(np.float64)
            fits = array.dtype.kind in "fiu" and array.ndim == 1 and column[name].shape == column["stamp_s"].shape
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise RecordingError(
                f"Directions are a number, or as many numbers as there are stamps, for each of {', '.join(COLUMNS)} "
                f"(the last two may be left out); {name} is {repr(given)[:_SHOWN]}."
            )
    return DirectionTrack.of(*map(column.get, COLUMNS))


def read_directions(path: Path) -> DirectionTrack:
    """Read ``directions.csv``: a line of column names, then numbers; RecordingError names the file and the row."""
    try:
        with readable(path):
            lines = files.read_regular(path, files.TABLE_BYTES).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise RecordingError(f"{path} is not UTF-8 text; save the file as UTF-8.") from None
    rows = [line.strip().split(",") for line in lines if line.strip() and not line.startswith("#")]
    names = [name.strip() for name in rows[0]] if rows else []
    if not {*COLUMNS[:2]} <= set(names) <= set(COLUMNS) or len(set(names)) < len(names):
        raise RecordingError(
            f"{path} begins with {','.join(names)[:_SHOWN]!r}; its first line names the columns: stamp_s,azimuth_rad, "
            "and perhaps elevation_rad and confidence."
        )
    values = np.full((len(rows) - 1, len(names)), np.nan)
    for number, words in enumerate(rows[1:]):
        try:
            if len(words) != len(names):  # NumPy would repeat a single number
                raise ValueError
            values[number] = [float(word) if word.strip() else np.nan for word in words]
        except ValueError:
            row = f"{path}, row {number + 1}: {','.join(words)[:_SHOWN]!r}"
            raise RecordingError(f"{row} is not {len(names)} numbers ({', '.join(names)}); fix it.") from None
    try:
        return DirectionTrack.of(*map(dict(zip(names, values.T, strict=True)).get, COLUMNS))
    except RecordingError as error:
        raise RecordingError(f"{path}: {str(error).partition(': ')[2]}") from None


def write_directions(path: Path, track: DirectionTrack) -> None:
    """Write a track as ``read_directions`` reads it; all or nothing."""
    told = (True, True, np.isfinite(track.elevation_rad).any(), (track.confidence != 1.0).any())
    names = [name for name, is_told in zip(COLUMNS, told, strict=True) if is_told]
    columns = [getattr(track, name).tolist() for name in names]
    rows = [",".join("" if isnan(value) else repr(value) for value in row) for row in zip(*columns, strict=True)]
    files.write_bytes_atomically(path, ("\n".join([",".join(names), *rows]) + "\n").encode())
