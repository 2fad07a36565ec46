"""Decoding, encoding and fusion overlap, frames keep their places, batches keep to their stretch."""

from collections.abc import Iterator, Sequence
from itertools import islice, pairwise
from pathlib import Path
from time import perf_counter, sleep

import numpy as np
import pytest
from build_fakes import SETTINGS, Corners, Pixels, Walk, register_fakes
from hypothesis import given, settings
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.build import build_map
from avlmaps.maps.encoding import encode_frames
from avlmaps.maps.prefetch import run_ahead
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.perception.profiles import Profile, profile
from avlmaps.recordings.types import Frame

PROFILE = register_fakes()
EVERY_S = 0.02


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


@settings(max_examples=15)
@given(
    bad=st.sets(st.integers(0, 11)),
    cuts=st.sets(st.integers(1, 11), max_size=3),
    size=st.integers(1, 5),
)
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
        good = [index for index in stretch if index not in bad]
        expected += [good[start : start + size] for start in range(0, len(good), size)]
    assert encoder.given == [group for group in expected if len(group) > 1], "full batches, none across stretches"


def test_without_an_encoder_frames_come_alone() -> None:
    seen = list(encode_frames(Walk(4, bad=(2,)), [range(4)], None))
    assert [features for _, features in seen] == [None] * 4
    assert isinstance(seen[2][0], BadFrame)


def test_batches_and_single_frames_make_the_same_map(tmp_path: Path) -> None:
    register(Backend(Kind.PIXELS, "fake-batches", f"{__name__}:InBatches"))
    used = Profile("fake-batches", pixels="fake-batches", local="fake", place="fake", sounds="fake")
    one = build_map(Walk(bad=(5,)), tmp_path / "one", PROFILE, SETTINGS)
    other = build_map(Walk(bad=(5,)), tmp_path / "other", used, SETTINGS)
    for name in ("index", "feature", "colour", "hits", "weight"):
        if hasattr(one.voxels, name):
            assert np.array_equal(getattr(one.voxels, name), getattr(other.voxels, name)), name
    assert one.info.bad_frames == other.info.bad_frames


class SlowWalk(Walk):
    def frame(self, index: int) -> Frame:
        sleep(EVERY_S)
        return super().frame(index)


class SlowPixels(Pixels):
    def encode(self, frame: Frame) -> np.ndarray:
        sleep(EVERY_S)
        return super().encode(frame)


def test_the_slowest_of_three_stages_sets_the_pace() -> None:
    def elapsed_s(count: int) -> float:
        begin = perf_counter()
        for _ in encode_frames(SlowWalk(count), [range(count)], SlowPixels()):
            sleep(EVERY_S)  # fusion
        return perf_counter() - begin

    # One after the other they take 3 each frame; of three tries a busy machine lets one through.
    assert min(elapsed_s(30) for _ in range(3)) < 1.8 * 30 * EVERY_S


class SlowViews:
    card = Pixels.card

    def encode(self, frames: Sequence[Frame]) -> np.ndarray:
        sleep(EVERY_S * len(frames))
        rows = np.stack([[frame.index + 1.0, 1.0, 0.0, 0.0] for frame in frames])
        return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)


class SlowCorners(Corners):
    def encode(self, rgb: np.ndarray):
        sleep(EVERY_S)
        return super().encode(rgb)


@pytest.mark.slow
def test_keyframes_are_read_looked_at_and_described_side_by_side(tmp_path: Path) -> None:
    register(Backend(Kind.VIEWS, "slow", f"{__name__}:SlowViews"))
    register(Backend(Kind.LOCAL, "slow", f"{__name__}:SlowCorners"))
    used = Profile("slow", views="slow", local="slow")
    taken = []
    for turn in range(3):
        stored = build_map(SlowWalk(60), tmp_path / str(turn), used, SETTINGS)
        taken.append(stored.info.timings.stages_s["keyframes"] / len(stored.keyframes))
        frame = np.round(stored.keyframes.stamp_s / 0.1).astype(int)  # views stand with their own frames
        assert np.allclose(stored.keyframes.view[:, 0] / stored.keyframes.view[:, 1], frame + 1, rtol=1e-5)
    assert min(taken) < 2.2 * EVERY_S, "one after the other they take 3 each keyframe"


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


def test_a_profile_of_ones_own_is_known_after_a_build() -> None:
    own = Profile("of-my-own", pixels="fake")
    assert profile(own) is own
    assert profile("of-my-own") is own
