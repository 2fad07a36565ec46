"""Writing recordings in our own folder format, frame by frame, so that one that was cut short is recognised."""

import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, TextIO

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core import poses
from avlmaps.core.camera import Rig
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.files import lasting_path, sync_folder, user_path, write_bytes_atomically
from avlmaps.core.timeline import Trajectory
from avlmaps.recordings import layout
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.channels import ChannelSound, write_channels
from avlmaps.recordings.memory import FARTHEST_MIDDLE_M, same_rig
from avlmaps.recordings.microphones import DIRECTIONS, DirectionTrack, MicrophoneNumbers, Microphones, write_directions
from avlmaps.recordings.types import BaseHeight, Frame

_JPEG_QUALITY = 95
_MAX_DEPTH_VALUE = 65534
_COPIED_AUDIO = (".flac", ".wav", ".ogg")
_FLAC_CHANNELS = 8


@dataclass(eq=False)
class RecordingWriter:
    """Writes a recording; use it in a ``with`` block. What an error or a kill leaves behind is refused by readers.

    Attributes:
        path: the folder to make; it must not exist, be empty, or hold an unfinished recording.
        up_in_world: unit vector against gravity, None where it is not known.
        colour: ``png`` preserves every bit, ``jpg`` takes a tenth of the space.
        depth_units_per_m: units of the depth files in a metre; 1000 says millimetres.
        origin: what makes the recording, for its description.
        begins_s: what the clock said at time 0, seconds since 1970; 0 where nobody knows.
        trajectory: the poses at their own rate, from which a reader interpolates the frames'.
        base_height: of the robot's base under the camera, metres; None where it is not known.
    """

    path: Path
    rig: Rig
    up_in_world: Float[np.ndarray, "3"] | None = None
    colour: Literal["png", "jpg"] = "png"
    depth_units_per_m: float = 1000.0
    origin: str = ""
    begins_s: float = 0.0
    trajectory: Trajectory | None = None
    base_height: BaseHeight | None = None
    _stamps_s: list[float] = field(default_factory=list, init=False)
    _names: set[str] = field(default_factory=set, init=False)
    _audio_start_s: float = field(default=0.0, init=False)
    _microphones: MicrophoneNumbers | None = field(default=None, init=False)
    _poses: TextIO | None = field(default=None, init=False)
    _frames: TextIO | None = field(default=None, init=False)

    def __enter__(self) -> "RecordingWriter":
        if not isinstance(self.rig, Rig):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise RecordingError(f"rig must be an avlmaps.Rig, not {type(self.rig).__name__}.")
        if self.colour not in ("png", "jpg"):
            raise RecordingError(f"colour is {self.colour!r}; it must be png or jpg.")
        if fault := layout.impossible(self._described()):
            raise RecordingError(f"{fault}.")
        self.path = lasting_path(self.path)
        _make_empty(self.path)
        # Who reads a recording that is being written finds its cameras here.
        write_bytes_atomically(self.path / layout.UNFINISHED, self._description())
        for folder in ("rgb", "depth"):
            (self.path / folder).mkdir(exist_ok=True)
        self._poses = (self.path / layout.POSES).open("w", encoding="utf-8", newline="\n")
        self._frames = (self.path / layout.FRAMES).open("w", encoding="utf-8", newline="\n")
        self._poses.write(layout.POSES_HEADER + "\n")
        self._frames.write(layout.FRAMES_HEADER + "\n")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for stream in (self._poses, self._frames):
            if stream is not None:
                stream.flush()
                os.fsync(stream.fileno())
                stream.close()
        self._poses = self._frames = None
        if kind is None:
            self._finish()

    def add(self, frame: Frame) -> None:
        """Write one frame; depth is rounded to the format's unit, 0 beyond its range (65.534 m for millimetres).

        RecordingError: the depth is not in metres, the pose is no rigid motion, the name was used before, the stamp is
        not after the last, or the disk is full.
        """
        if not same_rig(frame.rig, self.rig):
            raise RecordingError(f"Frame {frame.name} was taken by another camera than the recording's first frame.")
        self._announce(frame.name, frame.stamp_s, frame.world_from_camera)
        raw = np.rint(frame.depth_m.astype(np.float64) * self.depth_units_per_m)
        raw = np.where((raw > 0) & (raw <= _MAX_DEPTH_VALUE), raw, 0).astype(np.uint16)
        if not raw.any() and (middle_m := _middle_m(frame.depth_m)) > FARTHEST_MIDDLE_M:
            raise RecordingError(
                f"No depth of frame {frame.name} can be written: its median is {middle_m:,.0f}, which looks like "
                "millimetres; depth_m is in metres."
            )
        write_picture(self.path / "rgb" / f"{frame.name}.{self.colour}", frame.rgb[..., ::-1])
        write_picture(self.path / "depth" / f"{frame.name}.png", raw)
        self._log(frame.name, frame.stamp_s, frame.world_from_camera)

    def add_files(
        self,
        name: str,
        stamp_s: float,
        world_from_camera: Float[np.ndarray, "4 4"],
        colour: Path,
        depth: Path,
        link: bool = True,
    ) -> None:
        """Take over a frame's PNG or JPEG, and its 16-bit PNG of depth in this recording's units, undecoded.

        With ``link`` a hard link will do: nothing in this package writes into a picture. Errors as of ``add``.
        """
        self._announce(name, stamp_s, world_from_camera)
        take_file(colour, self.path / "rgb" / f"{name}{colour.suffix.lower()}", link)
        take_file(depth, self.path / "depth" / f"{name}.png", link)
        self._log(name, stamp_s, world_from_camera)

    def set_audio(self, audio: Any, start_s: float = 0.0, microphones: Microphones | None = None) -> None:
        """Give the recording its sound track; an ``AudioTrack`` says its start and its microphones itself.

        ``start_s``: the recording's time at which the track begins, seconds.
        A FLAC, WAV or OGG file is copied as it is; samples, and the sound of a video, are written as FLAC.
        RecordingError says that a file cannot be copied, AudioError that the track cannot be read, or is none.
        """
        audio = user_path(audio) if isinstance(audio, str | Path) else audio
        if not isinstance(audio, Path | Sound | ChannelSound | AudioTrack):
            raise AudioError(
                f"A track is a path, an avlmaps.Sound or an avlmaps.ChannelSound, not {type(audio).__name__}."
            )
        for old in self.path.glob("audio.*"):
            old.unlink()
        self._audio_start_s = audio.start_s if isinstance(audio, AudioTrack) else start_s
        placed = audio.microphones if isinstance(audio, AudioTrack) else microphones
        self._microphones = None if placed is None else MicrophoneNumbers.of(placed)
        if isinstance(audio, AudioTrack) and audio.directions is not None:
            self.set_directions(audio.directions)
        if isinstance(audio, AudioTrack) and audio.files and self._microphones is not None:
            names = [f"audio.{number + 1}{path.suffix.lower()}" for number, path in enumerate(audio.files)]
            for path, name in zip(audio.files, names, strict=True):
                take_file(path, self.path / name, link=False)
            self._microphones = msgspec.structs.replace(self._microphones, files=names)
            return
        if isinstance(audio, ChannelSound):
            write_channels(self.path / ("audio.flac" if len(audio.samples) <= _FLAC_CHANNELS else "audio.wav"), audio)
            return
        if isinstance(audio, AudioTrack) and audio.path.suffix.lower() in _COPIED_AUDIO:
            audio = audio.path
        if isinstance(audio, Path):
            if audio.suffix.lower() not in _COPIED_AUDIO:
                raise RecordingError(f"{audio} is not FLAC, WAV or OGG; open it with AudioTrack.open and give that.")
            take_file(audio, self.path / f"audio{audio.suffix.lower()}", link=False)
        else:
            write_flac(self.path / "audio.flac", audio.blocks() if isinstance(audio, AudioTrack) else audio)

    def set_directions(self, directions: DirectionTrack) -> None:
        write_directions(self.path / DIRECTIONS, directions)

    def _announce(self, name: str, stamp_s: float, world_from_camera: Float[np.ndarray, "4 4"]) -> None:
        if self._poses is None:
            raise ValueError("the writer is not open; use it in a with block")
        if not name or name in self._names or any(c in name for c in "/\\\0\n,"):
            raise RecordingError(f"{self.path} cannot hold a frame called {name!r}: the name is taken or no file name.")
        if not np.isfinite(stamp_s) or (self._stamps_s and stamp_s <= self._stamps_s[-1]):
            last = self._stamps_s[-1] if self._stamps_s else None
            raise RecordingError(f"Frame {name} has the stamp {stamp_s} s after {last} s; stamps must rise.")
        poses.orthonormalize(world_from_camera, f"frame {name}")  # or it has no quaternion

    def _log(self, name: str, stamp_s: float, world_from_camera: Float[np.ndarray, "4 4"]) -> None:
        assert self._poses is not None and self._frames is not None
        self._poses.writelines(_pose_lines(np.array([stamp_s]), world_from_camera[None]))
        self._poses.flush()
        self._frames.write(f"{name},{float(stamp_s)!r}\n")
        self._frames.flush()  # last: a frame that is listed is whole
        self._names.add(name)
        self._stamps_s.append(float(stamp_s))

    def _finish(self) -> None:
        if not self._stamps_s:
            raise RecordingError(f"{self.path} got no frame, so there is no recording to finish.")
        if self.trajectory is not None:
            lines = [
                layout.POSES_HEADER + "\n",
                *_pose_lines(self.trajectory.stamps_s, self.trajectory.world_from_body),
            ]
            write_bytes_atomically(self.path / layout.POSES, "".join(lines).encode())
        for folder in (self.path / "rgb", self.path / "depth", self.path):
            sync_folder(folder)
        write_bytes_atomically(self.path / layout.DESCRIPTION, self._description())
        (self.path / layout.UNFINISHED).unlink()

    def _description(self) -> bytes:
        return msgspec.json.format(msgspec.json.encode(self._described()), indent=2) + b"\n"

    def _described(self) -> layout.Description:
        rate_hz = _rate_hz(self._stamps_s)
        rig = self.rig
        return layout.Description(
            schema_version=layout.SCHEMA_VERSION,
            intrinsics=layout.Intrinsics(
                rgb=layout.CameraNumbers.of(rig.rgb),
                depth=layout.CameraNumbers.of(rig.depth),
                rgb_from_depth=None if np.array_equal(rig.rgb_from_depth, np.eye(4)) else rig.rgb_from_depth.tolist(),
            ),
            depth_units_per_m=self.depth_units_per_m,
            rgb_rate_hz=rate_hz,
            pose_rate_hz=rate_hz if self.trajectory is None else _rate_hz(self.trajectory.stamps_s),
            up_in_world=None if self.up_in_world is None else _triple(self.up_in_world),
            audio_start_s=self._audio_start_s,
            frames=len(self._stamps_s),
            origin=self.origin,
            microphones=self._microphones or msgspec.UNSET,
            begins_s=self.begins_s or msgspec.UNSET,
            base_height=self.base_height or msgspec.UNSET,
        )


def _rate_hz(stamps_s: Sequence[float] | Float[np.ndarray, " n"]) -> float | None:
    interval_s = float(np.median(np.diff(stamps_s))) if len(stamps_s) > 1 else 0.0
    return round(1.0 / interval_s, 6) if interval_s > 0.0 else None


def _pose_lines(stamps_s: Float[np.ndarray, " n"], world_from_camera: Float[np.ndarray, "n 4 4"]) -> Iterator[str]:
    rows = np.column_stack([stamps_s, world_from_camera[:, :3, 3], poses.to_quaternion(world_from_camera)])
    yield from (",".join(map(repr, row)) + "\n" for row in rows.tolist())


def _make_empty(path: Path) -> None:
    if path.is_dir() and (path / layout.UNFINISHED).exists() and not (path / layout.DESCRIPTION).exists():
        for folder in ("rgb", "depth"):
            shutil.rmtree(path / folder, ignore_errors=True)
        for file in (*(path / name for name in (layout.POSES, layout.FRAMES, DIRECTIONS)), *path.glob("audio.*")):
            file.unlink(missing_ok=True)
        (path / layout.UNFINISHED).unlink()
    try:
        path.mkdir(parents=True, exist_ok=True)
        taken = next(path.iterdir(), None)
    except OSError as error:
        raise RecordingError(f"{path} cannot be made a folder ({error.strerror or error}); choose another.") from None
    if taken is not None:
        raise RecordingError(f"{path} is not empty (it holds {taken.name}); choose another folder or empty it.")


def _triple(vector: Float[np.ndarray, "3"]) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


def write_picture(path: Path, picture: np.ndarray) -> None:
    """Write a picture as OpenCV has it, by the ending of its path: PNG or JPEG."""
    import cv2

    # Level 1: a third larger than the default and five times as fast.
    options = [cv2.IMWRITE_PNG_COMPRESSION, 1] if path.suffix == ".png" else [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY]
    done, content = cv2.imencode(path.suffix, np.ascontiguousarray(picture), options)
    if not done:
        raise RecordingError(f"{path} could not be encoded; its picture is {picture.dtype} of {picture.shape}.")
    try:
        path.write_bytes(content.tobytes())
    except OSError as error:
        raise RecordingError(f"{path} could not be written ({error.strerror or error}).") from None


def take_file(source: Path, target: Path, link: bool) -> None:
    """Link or copy a file, following a symbolic link to what it stands for."""
    try:
        if link:
            with suppress(OSError):
                os.link(source.resolve(), target)
                return
        shutil.copyfile(source, target)
    except OSError as error:
        where = error.filename or source
        raise RecordingError(f"{source} could not be copied to {target} ({where}: {error.strerror}).") from None


def _middle_m(depth_m: Float[np.ndarray, "h w"]) -> float:
    known = depth_m[np.isfinite(depth_m) & (depth_m > 0.0)]
    return float(np.median(known)) if len(known) else 0.0
