"""Decoding, encoding and fusion overlap, frames keep their places, batches keep to their stretch."""

from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from pathlib import Path
from threading import Condition, current_thread, main_thread
from unittest.mock import Mock

import numpy as np
import pytest
from build_fakes import SETTINGS, Pixels, Walk, register_fakes
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError
from avlmaps.core.machine import run_ahead
from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.build import build_map, encode_frames
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.perception.encoders import Encoders, encoders_of, profile
from avlmaps.recordings.types import Frame

PROFILE = register_fakes()
# A stage that waits in vain for another one fails its test after this.
PATIENCE_S = 20.0


class InBatches(Pixels):
    """Likes so many frames at once, and remembers which it was given."""

    def __init__(self, batch: int = 3) -> None:
        self.batch, self.given = batch, []

    def encode_batch(self, frames: Sequence[Frame]) -> list[np.ndarray]:
        self.given.append([frame.index for frame in frames])
        return [self.encode(frame) for frame in frames]

    def encode_words(self, words: Sequence[str]) -> np.ndarray:
        return np.zeros((len(words), 4), np.float32)

    def understood(self, word: str) -> str:
        return ""


@given(bad=st.sets(st.integers(0, 11)), cuts=st.sets(st.integers(1, 11), max_size=3), size=st.integers(1, 5))
def test_each_frame_comes_in_its_place_with_its_own_features(bad: set[int], cuts: set[int], size: int) -> None:
    walk, encoder = Walk(12, bad=tuple(bad)), InBatches(size)
    edges = [0, *sorted(cuts), 12]
    stretches = [range(a, b) for a, b in pairwise(edges)]
    seen = list(encode_frames(walk, stretches, encoder))
    assert [frame.index for frame, _ in seen] == list(range(12))
    for frame, features in seen:
        assert isinstance(frame, BadFrame) == (frame.index in bad)
        if isinstance(frame, Frame):
            assert np.array_equal(features, Pixels().encode(frame))
        else:
            assert features is None
            assert "/nowhere" not in frame.why
    expected = []
    for stretch in stretches:
        groups = (stretch[start : start + size] for start in range(0, len(stretch), size))
        expected += [[index for index in group if index not in bad] for group in groups]
    assert encoder.given == [group for group in expected if len(group) > 1], "no batch across stretches"


def test_without_an_encoder_frames_come_alone() -> None:
    seen = list(encode_frames(Walk(4, bad=(2,)), [range(4)], None))
    assert [features for _, features in seen] == [None] * 4
    assert isinstance(seen[2][0], BadFrame)


def test_batches_and_single_frames_make_the_same_map(tmp_path: Path) -> None:
    register(Backend(Kind.PIXELS, "fake-batches", f"{__name__}:InBatches"))
    used = Encoders("fake-batches", pixels="fake-batches", local="fake", place="fake", sounds="fake")
    one = build_map(Walk(bad=(5,)), tmp_path / "one", PROFILE, SETTINGS)
    other = build_map(Walk(bad=(5,)), tmp_path / "other", used, SETTINGS)
    for name in ("index", "feature", "colour", "hits", "weight"):
        if hasattr(one.voxels, name):
            assert np.array_equal(getattr(one.voxels, name), getattr(other.voxels, name)), name
    assert one.info.bad_frames == other.info.bad_frames


class Begun:
    """What each stage has begun, and in which thread; a stage may wait for what another one begins."""

    def __init__(self) -> None:
        self._told, self._changed = [], Condition()
        self.met: list[bool] = []

    def __call__(self, stage: str, frame: int) -> bool:
        """Note that a stage begins a frame; return whether it is the stage's first."""
        with self._changed:
            first = all(name != stage for name, *_ in self._told)
            self._told.append((stage, frame, current_thread()))
            self._changed.notify_all()
            return first

    def meet(self, stage: str, after: int) -> None:
        """Note whether a thread other than this one and the main one begins a later frame while this stage waits."""

        def met() -> bool:
            others = [
                one for one in self._told if one[2] not in (current_thread(), main_thread()) and one[2].is_alive()
            ]
            return any(name == stage and frame > after for name, frame, _ in others)

        with self._changed:
            self.met.append(self._changed.wait_for(met, PATIENCE_S))


class ToldWalk(Walk):
    begun = Begun()

    def frame(self, index: int) -> Frame:
        self.begun("read", index)
        return super().frame(index)


class MeetingPixels(Pixels):
    def encode(self, frame: Frame) -> np.ndarray:
        if ToldWalk.begun("encode", frame.index):
            ToldWalk.begun.meet("read", 0)
        return super().encode(frame)


def test_frames_are_read_and_encoded_while_others_are_fused(monkeypatch: pytest.MonkeyPatch) -> None:
    begun = Begun()
    monkeypatch.setattr(ToldWalk, "begun", begun)
    for frame, _ in encode_frames(ToldWalk(6), [range(6)], MeetingPixels()):
        if isinstance(frame, Frame) and frame.index == 0:
            begun.meet("encode", 0)
            begun.meet("read", 1)
    assert begun.met == [True, True, True]


def test_producers_in_a_row_stop_with_their_consumer() -> None:
    ended: list[str] = []

    def counting() -> Iterator[int]:
        try:
            yield from range(1000)
        finally:
            ended.append("first")

    def doubled(items: Iterator[int]) -> Iterator[int]:
        try:
            for item in items:
                yield 2 * item
        finally:
            ended.append("second")

    row = run_ahead(doubled(run_ahead(counting())))
    assert list(islice(row, 3)) == [0, 2, 4]
    row.close()
    assert sorted(ended) == ["first", "second"]


def test_what_an_encoder_raises_ends_the_build_with_its_sentence(tmp_path: Path) -> None:
    class Broken(InBatches):
        def encode_batch(self, frames: Sequence[Frame]) -> list[np.ndarray]:
            raise BackendError("The model is out of memory; take a smaller --batch.")

    with pytest.raises(BackendError, match="smaller --batch"):
        list(encode_frames(Walk(6), [range(6)], Broken()))


def test_a_stopped_build_names_where_it_continues(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.maps.build.map_span", Mock(side_effect=[None, KeyboardInterrupt]))
    with pytest.raises(KeyboardInterrupt, match=f"continues from frame {SETTINGS.frames.per_part}"):
        build_map(Walk(), tmp_path / "m", PROFILE, SETTINGS)


def test_a_profile_of_ones_own_is_itself_and_nobody_elses() -> None:
    own = Encoders("of-my-own", pixels="fake")
    assert encoders_of(own) is own
    with pytest.raises(BackendError, match="no profile called 'of-my-own'"):
        profile("of-my-own")
