"""The keyframes of a map that is made: what is stored of each, and what its places are known by."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from avlmaps.core.arrays import Float32, Int, UInt8
from avlmaps.core.numbers import unmasked
from avlmaps.core.poses import apply
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.maps.keyframes.choose import DEFAULT_KEYFRAMES, KeyframeSettings
from avlmaps.maps.keyframes.describe import DescribedKeyframe, describe_keyframe, stack_keyframes, unstack_keyframes
from avlmaps.maps.perceived import perceiving
from avlmaps.maps.pose_correction import PoseCorrection
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import Frame, Recording

LEARN_FROM_KEYFRAMES = 64
# What places are learnt from grows by this much before they are learnt again for a question.
_GROWN = 1.25


class KeyframeAlbum:
    """Takes frames that are keyframes, in the order of time, and looks at each once."""

    def __init__(self, encoders: Encoders, settings: KeyframeSettings) -> None:
        self._encoders, self._settings = encoders, settings
        self._seen: list[DescribedKeyframe] = []  # their places are in _places
        self._places: list[Float32[np.ndarray, " d"]] = []
        self._learns: bool | None = None  # whether the place encoder learns from the map's keyframes
        self._state: dict[str, np.ndarray] = {}
        self._learnt_from = 0
        self._stacked: Keyframes | None = None

    def __len__(self) -> int:
        return len(self._seen)

    def add(self, frame: Frame) -> None:
        """Describe a frame.

        Raises:
            BackendError: an encoder fails, or gives something else than its protocol says; the frame is left out.
        """
        seen = describe_keyframe(frame, self._encoders, self._settings)
        if Kind.PLACE in self._encoders and Kind.LOCAL in self._encoders:
            with perceiving("The place encoder", frame.name):
                encoder = self._encoders.place
                if self._learns is None:
                    self._learns = bool(encoder.fit([seen.local], np.random.default_rng(0)))
                if not self._learns:
                    seen = replace(seen, place=np.asarray(unmasked(encoder.encode(frame.rgb.copy(), seen.local, {}))))
        self._seen.append(seen)
        self._stacked = None

    def add_stacked(self, keyframes: Keyframes, size: tuple[int, int]) -> None:
        """Add keyframes that were described before; ``size`` is the width and height of their pictures."""
        self._seen += unstack_keyframes(keyframes, size)
        self._stacked = None

    def move(self, step: PoseCorrection) -> None:
        """Move the keyframes by a correction of their poses."""
        self._seen = [_moved(one, step) for one in self._seen]
        self._stacked = None

    def plain(self) -> Keyframes:
        """Return the keyframes without places that are learnt."""
        return stack_keyframes(self._seen)

    def keyframes(self, rng: np.random.Generator, *, final: bool = True) -> tuple[Keyframes, dict[str, np.ndarray]]:
        """Return the keyframes, and what places are known by: the same objects as before where nothing came.

        Args:
            rng: for what the place encoder learns.
            final: learn places again; else only where enough has come since.

        Raises:
            BackendError: the place encoder fails, or gives something else than its protocol says.
        """
        known = final and self._learnt_from != len(self._seen)
        if self._stacked is not None and not known:
            return self._stacked, self._state
        seen = self._seen
        if Kind.PLACE in self._encoders and Kind.LOCAL in self._encoders and not (seen and len(seen[0].place)):
            seen = [replace(one, place=place) for one, place in zip(seen, self._placed(rng, final), strict=True)]
        self._stacked = stack_keyframes(seen)
        return self._stacked, self._state

    def _placed(self, rng: np.random.Generator, final: bool) -> list[Float32[np.ndarray, " d"]]:
        encoder, count = self._encoders.place, len(self._seen)
        with perceiving(f"The place encoder {encoder.card.id}", "the keyframes"):
            few = not self._learnt_from or count >= _GROWN * self._learnt_from
            if few or (final and count != self._learnt_from):
                self._state = encoder.fit([self._seen[int(at)].local for at in learn_from(count)], rng)
                self._learnt_from, self._places = count, []
            for one in self._seen[len(self._places) :]:
                found = encoder.encode(_picture(one), one.local, self._state)
                self._places.append(np.asarray(unmasked(found), np.float32))
        return self._places


def perceive_keyframes(
    recording: Recording,
    indices: Sequence[int] | Int[np.ndarray, " k"],
    encoders: Encoders,
    rng: np.random.Generator,
    settings: KeyframeSettings = DEFAULT_KEYFRAMES,
) -> tuple[Keyframes, dict[str, np.ndarray]]:
    """Describe chosen frames of a recording; return them, and what the place encoder learned."""
    album = KeyframeAlbum(encoders, settings)
    for index in progress(indices, "seeing", total=len(indices), unit="keyframe"):
        album.add(recording.frame(int(index)))
    return album.keyframes(rng)


def learn_from(keyframes: int) -> Int[np.ndarray, " k"]:
    """Return the numbers of the keyframes that places are learnt from: up to 64, spread evenly."""
    return np.unique(np.linspace(0, keyframes - 1, min(keyframes, LEARN_FROM_KEYFRAMES)).round().astype(int))


def _picture(one: DescribedKeyframe) -> UInt8[np.ndarray, "h w 3"]:
    small = cv2.imdecode(np.frombuffer(one.thumbnail, np.uint8), cv2.IMREAD_COLOR_RGB)
    assert small is not None
    return small if one.local.size in ((0, 0), small.shape[1::-1]) else cv2.resize(small, one.local.size)


def _moved(one: DescribedKeyframe, step: PoseCorrection) -> DescribedKeyframe:
    motion = step.at(np.array([one.stamp_s]))[0]
    return replace(
        one,
        world_from_camera=motion @ one.world_from_camera,
        centre=apply(motion, one.centre.astype(np.float64)).astype(np.float32),
        points_world=apply(motion, one.points_world.astype(np.float64)).astype(np.float32),
    )
