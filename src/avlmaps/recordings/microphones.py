"""Where the microphones of a recording are: one, two or an array, rigid on the robot."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from avlmaps.core import poses
from avlmaps.core.arrays import Float
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular, user_path, write_bytes_atomically

# Two microphones nearer than this hear the same; a robot is smaller than this.
LEAST_APART_M, MOST_APART_M = 0.01, 5.0
MOST_CHANNELS = 64
# A channel that is later than this against the others is not of their clock.
MOST_DELAY_S = 0.01
# x forward, y left, z up, at the camera: how the robot's frame lies in the camera's (x right, y down, z forward).
LEVEL_CAMERA_FROM_ROBOT = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1]], np.float64)


class MicrophoneNumbers(msgspec.Struct, forbid_unknown_fields=True, frozen=True, omit_defaults=True):
    """Microphones as JSON has them.

    Attributes:
        positions_m: one for each channel, in the robot's frame: x forward, y left, z up.
        camera_from_robot: 4x4; by default the robot's frame has its origin at the camera, and the camera looks level.
        files: one sound file for each channel, where they are not channels of one file.
        delays_s: by how much each channel is late, seconds; none is if None.
        channels: which channels of the track they are, counted from 1, where others hold no microphone.
    """

    positions_m: list[list[float]]
    camera_from_robot: list[list[float]] | None = None
    files: list[str] | None = None
    delays_s: list[float] | None = None
    channels: list[int] | None = None

    def microphones(self) -> "Microphones":
        """Return them as the package works with them.

        Raises:
            RecordingError: the positions or the transform cannot be.
        """
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
        """Return the numbers of microphones."""
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
                f"microphones.channels are {numbers}; name {len(place)} different ones, counted from 1, one for each "
                "position."
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

    @property
    def in_camera_m(self) -> Float[np.ndarray, "m 3"]:
        """The places in the depth camera's frame, metres."""
        return poses.apply(self.camera_from_robot, self.position_m)

    def in_world_m(self, world_from_camera: Float[np.ndarray, "n 4 4"]) -> Float[np.ndarray, "n m 3"]:
        """Return the places in the world at each of several poses of the camera, metres."""
        turned = np.einsum("nij,mj->nmi", world_from_camera[:, :3, :3], self.in_camera_m)
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


def _square(side_m: float) -> list[list[float]]:
    half = side_m / 2
    return [[half, half, 0.0], [half, -half, 0.0], [-half, -half, 0.0], [-half, half, 0.0]]


PRESETS: dict[str, list[list[float]]] = {
    "mono": [[0.0, 0.0, 0.0]],
    "stereo": [[0.0, 0.1, 0.0], [0.0, -0.1, 0.0]],
    "square4": _square(0.2),
}
"""Places of the arrays that have a name, metres: the left of two is first, the square begins in front on the left."""


def microphones_named(words: str) -> Microphones:
    """Return the array of a name, or of a JSON file with ``positions_m``, perhaps more of ``MicrophoneNumbers``.

    Raises:
        RecordingError: there is no such name and no such file, or what it holds cannot be.
    """
    if words in PRESETS:
        return Microphones(np.array(PRESETS[words], np.float64))
    path = user_path(words)
    try:
        return decode_json(read_regular(path, DESCRIPTION_BYTES), MicrophoneNumbers).microphones()
    except OSError as error:
        raise RecordingError(
            f"There are no microphones called {words!r} and no such file ({error.strerror or error}); choose "
            f"{', '.join(PRESETS)}, or a JSON file with positions_m."
        ) from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise RecordingError(
            f'{path} describes no microphones ({error}); write {{"positions_m": [[x, y, z], ...]}} in metres.'
        ) from None


def given_microphones(given: Any) -> Microphones:
    """Return the array that a program gave: itself, its name or a JSON file.

    Raises:
        RecordingError: it is none of them, or ``microphones_named`` refuses it.
    """
    if isinstance(given, Microphones):
        return given
    if not isinstance(given, str | Path):
        raise RecordingError(
            f"microphones are an avlmaps.Microphones, a name ({', '.join(PRESETS)}) or a JSON file; not {given!r}."
        )
    return microphones_named(str(given))


def write_microphones(path: Path, microphones: Microphones) -> None:
    """Write an array as a JSON file that ``microphones_named`` reads; all or nothing.

    Raises:
        RecordingError: it cannot be written there.
    """
    content = msgspec.json.format(msgspec.json.encode(MicrophoneNumbers.of(microphones)), indent=2) + b"\n"
    try:
        write_bytes_atomically(path, content)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written ({error.strerror or error}); choose another file.") from None
