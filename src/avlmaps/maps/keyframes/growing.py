"""Keyframes of a walk that is not over: chosen as in a build, each looked at once, as soon as it is decided."""

import tempfile
import weakref
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter
from typing import BinaryIO

import cv2
import numpy as np

from avlmaps.core.arrays import Float32, UInt8
from avlmaps.core.errors import MapError
from avlmaps.core.numbers import unmasked
from avlmaps.core.poses import apply
from avlmaps.core.registry import Kind
from avlmaps.maps.keyframes.describe import (
    DescribedKeyframe,
    KeyframeSettings,
    describe_keyframe,
    keyframes_by_motion,
    learn_from,
    next_keyframe,
    stack_keyframes,
)
from avlmaps.maps.perceived import as_row, perceiving
from avlmaps.maps.pose_correction import PoseCorrection, moved_frame
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import Frame

# What places are learnt from grows by this much before they are learnt again for a question.
_GROWN = 1.25
# Keyframes that are left to be looked at later; each holds its frame.
_MOST_LEFT = 40


@dataclass(frozen=True, slots=True)
class PicturedKeyframe:
    """A keyframe without its place, and what reads its picture for that."""

    index: int
    keyframe: DescribedKeyframe
    picture: Callable[[], UInt8[np.ndarray, "h w 3"]] | None


@dataclass(frozen=True, slots=True)
class FrozenKeyframes:
    """The keyframes at a moment: how many are decided, and the frames that would be more of them if no other came."""

    decided: int
    last: list[Frame]


class GrowingKeyframes:
    """Takes frames in the order of time and stores what a map holds of the keyframes among them."""

    def __init__(self, encoders: Encoders, settings: KeyframeSettings, *, looks_later: bool = False) -> None:
        """Begin without frames.

        Args:
            encoders: the encoders; that of pixels is not called.
            settings: when a frame becomes a keyframe.
            looks_later: frames are looked at by ``keyframes``, which another thread may call, and not by ``add``.
        """
        self._looks_later = looks_later
        self._encoders, self._settings = encoders, settings
        self._decided: list[PicturedKeyframe | Frame | None] = []  # to be looked at; None was left out
        self._maybe: dict[int, PicturedKeyframe] = {}
        self._recent: list[Frame] = []
        self._described: dict[int, PicturedKeyframe] | None = None
        self._state: dict[str, np.ndarray] = {}
        self._learnt_from: list[int] = []
        self._places: dict[int, Float32[np.ndarray, " d"]] = {}
        self._stacked: tuple[Sequence[object], Keyframes | None] = ([], None)
        self._pictures = _PictureFile()

    def share(self, described: "dict[int, PicturedKeyframe]") -> None:
        """Take keyframes that were looked at before, by their number, and add those that are looked at."""
        self._described = described

    def move(self, step: PoseCorrection) -> None:
        """Move the keyframes, and the frames that may become some, by a correction of their poses."""
        self._decided = [one if one is None else _moved(one, step) for one in self._decided]
        self._maybe = {index: _moved_keyframe(one, step) for index, one in self._maybe.items()}
        self._recent = [moved_frame(frame, step) for frame in self._recent]

    @property
    def undecided(self) -> list[Frame]:
        """The frames since the last keyframe, that one left out."""
        return self._recent[1:]

    def add(self, frame: Frame) -> Iterator[Frame]:
        """Take the next frame; yield each frame that is decided to be a keyframe, after it was looked at.

        Raises:
            BackendError: an encoder gives something else than its protocol says; that keyframe is left out.
        """
        self._recent.append(frame)
        if len(self._recent) == 1 and not self._decided:
            self._decided.append(frame if self._looks_later else self._describe(frame))
            yield frame
        while (index := self._next()) is not None:
            decided, self._recent = self._recent[index], self._recent[index:]
            known = self._maybe.pop(decided.index, None)
            self._maybe.clear()
            self._decided.append(known or (decided if self._looks_later else self._describe(decided)))
            yield decided

    def _next(self) -> int | None:
        if len(self._recent) < 3:
            return None
        return next_keyframe(*_path(self._recent), self._settings)

    def last(self) -> list[Frame]:
        """Return the frames that would be keyframes if no other came."""
        if len(self._recent) < 2:
            return []
        return [self._recent[index] for index in keyframes_by_motion(*_path(self._recent), self._settings)[1:]]

    def freeze(self) -> FrozenKeyframes:
        """Return the keyframes until now, which frames to come do not change."""
        return FrozenKeyframes(len(self._decided), self.last())

    def keyframes(
        self, rng: np.random.Generator, came: FrozenKeyframes, *, final: bool, within_s: float = np.inf
    ) -> tuple[Keyframes, dict[str, np.ndarray]]:
        """Return the keyframes as if no other frame came, and what places are known by.

        Args:
            rng: for what the place encoder learns.
            came: from ``freeze``.
            final: learn places again, as a build does; else only where enough has come since.
            within_s: seconds for keyframes that were not looked at; the rest is left for the next time, unless that is
                more than 40 of them, each with its frame. So are the frames that may become keyframes.

        Raises:
            BackendError: an encoder gives something else than its protocol says; that keyframe is left out.
        """
        end_s = perf_counter() + within_s
        for at in range(came.decided):
            one = self._decided[at]
            if isinstance(one, Frame) and (perf_counter() < end_s or came.decided - at > _MOST_LEFT):
                self._decided[at] = None
                self._decided[at] = self._maybe.pop(one.index, None) or self._describe(one)
        last = came.last if np.isinf(within_s) else []  # of frames that come on, another one will be it
        maybe = {frame.index: self._maybe.get(frame.index) or self._describe(frame) for frame in last}
        self._maybe.update(maybe)
        seen = [one for one in (*self._decided[: came.decided], *maybe.values()) if isinstance(one, PicturedKeyframe)]
        places = (
            self._placed(seen, rng, final) if Kind.PLACE in self._encoders and Kind.LOCAL in self._encoders else None
        )
        parts = [*seen, *(places or [])]
        known, stacked = self._stacked
        same = len(parts) == len(known) and all(one is other for one, other in zip(parts, known, strict=True))
        if stacked is None or not same:  # else the arrays are those of before, which a save need not write again
            whole = [one.keyframe for one in seen]
            if places is not None:
                whole = [replace(one, place=place) for one, place in zip(whole, places, strict=True)]
            stacked = stack_keyframes(whole)
            self._stacked = parts, stacked
        return stacked, self._state

    def _placed(
        self, seen: list[PicturedKeyframe], rng: np.random.Generator, final: bool
    ) -> list[Float32[np.ndarray, " d"]]:
        """Return the descriptor of each keyframe's place; learnt again, all are encoded again."""
        encoder, numbers = self._encoders.place, [one.index for one in seen]
        few = not self._learnt_from or len(seen) >= _GROWN * len(self._learnt_from)
        if few or (final and numbers != self._learnt_from):
            with perceiving(f"The place encoder {encoder.card.id}", "the keyframes"):
                self._state = encoder.fit([seen[int(at)].keyframe.local for at in learn_from(len(seen))], rng)
            self._learnt_from = numbers
            if self._state:
                self._places.clear()
        for one in seen:
            if one.index not in self._places:
                with perceiving(f"The place encoder {encoder.card.id}", f"frame {one.index}"):
                    assert one.picture is not None
                    found = encoder.encode(one.picture(), one.keyframe.local, self._state)
                self._places[one.index] = np.asarray(unmasked(found), np.float32)
        return [self._places[one.index] for one in seen]

    def _describe(self, frame: Frame) -> PicturedKeyframe:
        if self._described is None:
            return self._described_now(frame)
        if frame.index not in self._described:
            self._described[frame.index] = self._described_now(frame)
        return self._described[frame.index]

    def _described_now(self, frame: Frame) -> PicturedKeyframe:
        with perceiving("An encoder of keyframes", frame.name):
            seen = describe_keyframe(frame, self._encoders.without(Kind.PLACE), {}, self._settings)
        if Kind.VIEWS in self._encoders:
            card = self._encoders.card(Kind.VIEWS)
            seen = replace(seen, view=as_row(seen.view, card.dim, f"The view encoder {card.id}", frame))
        if Kind.PLACE not in self._encoders:
            return PicturedKeyframe(frame.index, seen, None)
        return PicturedKeyframe(frame.index, seen, self._pictures.put(frame.rgb))


def _moved(one: PicturedKeyframe | Frame, step: PoseCorrection) -> PicturedKeyframe | Frame:
    return moved_frame(one, step) if isinstance(one, Frame) else _moved_keyframe(one, step)


def _moved_keyframe(one: PicturedKeyframe, step: PoseCorrection) -> PicturedKeyframe:
    seen = one.keyframe
    motion = step.at(np.array([seen.stamp_s]))[0]
    moved = replace(
        seen,
        world_from_camera=motion @ seen.world_from_camera,
        centre=apply(motion, seen.centre.astype(np.float64)).astype(np.float32),
        points_world=apply(motion, seen.points_world.astype(np.float64)).astype(np.float32),
    )
    return replace(one, keyframe=moved)


def _path(frames: list[Frame]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([frame.stamp_s for frame in frames]), np.stack([frame.world_from_camera for frame in frames])


class _PictureFile:
    """Pictures on the disk, in a file without a name that goes with this object: half a megabyte each."""

    def __init__(self) -> None:
        self._file: BinaryIO | None = None
        self._end = 0

    def put(self, rgb: UInt8[np.ndarray, "h w 3"]) -> Callable[[], UInt8[np.ndarray, "h w 3"]]:
        """Store a picture, without loss, and return what reads it.

        Raises:
            MapError: the disk is full.
        """
        _, png = cv2.imencode(".png", rgb, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="avlmaps-keyframes-")  # noqa: SIM115 - it goes with us
                weakref.finalize(self, self._file.close)
            self._file.seek(self._end)
            self._file.write(png.data)
            self._file.flush()
        except OSError as fault:
            raise MapError(
                f"A keyframe's picture cannot be stored in {tempfile.gettempdir()} ({fault.strerror or fault}), and is "
                "left out; make room there, or name another folder in TMPDIR."
            ) from fault
        read = partial(self._read, self._end, len(png))
        self._end += len(png)
        return read

    def _read(self, at: int, size: int) -> UInt8[np.ndarray, "h w 3"]:
        """Return a picture: written of RGB as if it were BGR, and read likewise, which are the same numbers again."""
        assert self._file is not None
        self._file.seek(at)
        picture = cv2.imdecode(np.frombuffer(self._file.read(size), np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None
        return picture
