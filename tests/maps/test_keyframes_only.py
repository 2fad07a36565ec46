"""A pixel encoder that takes a second a frame is given keyframes alone; the other frames add surfaces and colours."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Pixels, Walk, register_fakes
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.build import build_map, build_part
from avlmaps.maps.keyframes.describe import KeyframeSettings, select_keyframes
from avlmaps.maps.pipeline.encode_fuse import encode_frames
from avlmaps.maps.pipeline.plan import encoded_frames, fusion_key
from avlmaps.maps.settings import FrameSettings
from avlmaps.perception.cache.feature_store import CacheSettings
from avlmaps.perception.encoders import Encoders

register_fakes()
SEEN: list[int] = []
NO_CACHE = CacheSettings("off")


class SlowPixels(Pixels):
    def encode(self, frame) -> np.ndarray:
        SEEN.append(frame.index)
        return super().encode(frame)


for name, only in (("every-frame", False), ("keyframes-alone", True)):
    register(Backend(Kind.PIXELS, name, "test_keyframes_only:SlowPixels", keyframes_only=only))
ALONE, EVERY = (Encoders(name, pixels=name) for name in ("keyframes-alone", "every-frame"))


@pytest.fixture(autouse=True)
def nothing_seen() -> None:
    SEEN.clear()


def test_the_light_profile_is_such_a_one_and_others_are_not() -> None:
    assert Encoders.named("light").keyframes_only
    assert not Encoders.named("embedded").keyframes_only
    assert not Encoders.named("light", pixels="colours").keyframes_only
    assert Encoders.named("embedded", pixels="light").keyframes_only


def test_only_keyframes_are_encoded_and_every_frame_adds_its_surfaces(tmp_path: Path) -> None:
    walk = Walk()
    few = build_map(walk, tmp_path / "few", ALONE, SETTINGS, cache=NO_CACHE, progress=False)
    chosen = select_keyframes(walk, SETTINGS.keyframes).tolist()
    assert chosen == SEEN and 1 < len(chosen) <= len(walk) / 2
    SEEN.clear()
    all_of_them = build_map(walk, tmp_path / "all", EVERY, SETTINGS, cache=NO_CACHE, progress=False)
    assert list(range(len(walk))) == SEEN
    one, other = few.voxels, all_of_them.voxels
    np.testing.assert_array_equal(one.index, other.index)
    np.testing.assert_array_equal(one.rgb, other.rgb)
    np.testing.assert_array_equal(one.hits, other.hits)
    with_feature = [np.asarray(voxels.feature).any(axis=1) for voxels in (one, other)]
    assert not (with_feature[0] & ~with_feature[1]).any()
    assert with_feature[0].sum() > 0.5 * with_feature[1].sum()


def test_the_parts_of_several_machines_make_the_map_of_one(tmp_path: Path) -> None:
    walk = Walk()
    parts = [tmp_path / "a", tmp_path / "b"]
    for (start, stop), out in zip(((0, 9), (9, 22)), parts, strict=True):
        build_part(walk, start, stop, out, ALONE, SETTINGS, NO_CACHE)
    assert select_keyframes(walk, SETTINGS.keyframes).tolist() == SEEN
    together = build_map(walk, tmp_path / "m", ALONE, SETTINGS, cache=NO_CACHE, parts=parts, progress=False)
    alone = build_map(walk, tmp_path / "n", ALONE, SETTINGS, cache=NO_CACHE, progress=False)
    np.testing.assert_array_equal(together.voxels.index, alone.voxels.index)
    np.testing.assert_allclose(together.voxels.feature, alone.voxels.feature, atol=2e-3)


def test_other_keyframes_are_another_map_for_such_an_encoder_alone() -> None:
    walk, other = Walk(), replace(SETTINGS, keyframes=KeyframeSettings(translation_m=0.6))
    assert fusion_key(walk, SETTINGS, ALONE) != fusion_key(walk, other, ALONE)
    assert fusion_key(walk, SETTINGS, EVERY) == fusion_key(walk, other, EVERY)


@given(st.integers(1, 40), st.integers(1, 5))
def test_the_chosen_are_among_the_frames_that_are_fused(frames: int, step: int) -> None:
    chosen = encoded_frames(Walk(frames), replace(SETTINGS, frames=FrameSettings(step=step)), ALONE)
    assert chosen is not None and 0 in chosen
    assert chosen <= set(range(0, frames, step))


@given(st.sets(st.integers(0, 21)), st.sets(st.integers(0, 21), max_size=3), st.integers(1, 5))
def test_frames_come_in_their_order_and_the_chosen_with_features(chosen: set[int], bad: set[int], batch: int) -> None:
    class Batched(SlowPixels):
        def encode_batch(self, frames) -> list[np.ndarray]:
            assert 0 < len(frames) <= batch
            return [self.encode(frame) for frame in frames]

    encoder = Batched()
    encoder.batch = batch
    came = list(encode_frames(Walk(bad=tuple(bad)), [range(9), range(9, 22)], encoder, chosen))
    assert [frame.index for frame, _ in came] == list(range(22))
    assert [frame.index for frame, features in came if features is not None] == sorted(chosen - bad)
