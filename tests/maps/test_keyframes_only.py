"""A pixel encoder that takes a second a frame is given keyframes alone; the other frames add surfaces and colours."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Pixels, Walk, register_fakes
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.registry import Backend, Kind, register
from avlmaps.maps.build import build_map, encode_frames
from avlmaps.maps.keyframes import select_keyframes
from avlmaps.maps.store.folder import read
from avlmaps.perception.cache import CacheSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.query.settings import Rules, build_settings, rules_of

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


def test_only_keyframes_are_encoded_and_every_frame_adds_its_surfaces(tmp_path: Path) -> None:
    walk = Walk()
    SEEN.clear()
    few = build_map(walk, tmp_path / "few", ALONE, SETTINGS, cache=NO_CACHE, progress=False)
    chosen = select_keyframes(walk, SETTINGS.keyframes).tolist()
    assert chosen == SEEN and 1 < len(chosen) <= len(walk) / 2
    all_of_them = build_map(walk, tmp_path / "all", EVERY, SETTINGS, cache=NO_CACHE, progress=False)
    assert SEEN[len(chosen) :] == list(range(len(walk)))
    one, other = few.voxels, all_of_them.voxels
    for name in ("index", "rgb", "hits"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    seen, known = (np.asarray(voxels.feature).any(axis=1) for voxels in (one, other))
    assert not (seen & ~known).any() and seen.sum() > 0.5 * known.sum()


@pytest.mark.parametrize(("rules", "step", "few"), [("ours", 1, True), ("ours", 3, False), ("paper", 1, False)])
def test_looks_are_5_cm_apart_but_not_by_the_papers_rules(tmp_path: Path, rules: Rules, step: int, few: bool) -> None:
    SEEN.clear()
    walk, path, settings = Walk(), tmp_path / "map", replace(SETTINGS, frames=replace(SETTINGS.frames, step=step))
    walk.world_from_camera[:, 0, 3] *= 0.2  # 2 cm a frame
    build_map(walk, path, EVERY, build_settings(rules, settings), cache=NO_CACHE, progress=False)
    assert 8 <= len(SEEN) <= len(walk) - 8 if few else list(range(0, len(walk), step)) == SEEN
    manifest = json.loads((path / "map.json").read_text())
    for _ in ("as it is", "as of an avlmaps that did not say how far apart"):
        assert rules_of(read(path).info.settings) == rules
        manifest["settings"]["frames"] = {"step": step, "per_part": 4, "max_bad_share": 0.2}
        (path / "map.json").write_text(json.dumps(manifest))


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
