"""Locating by keypoints and matchers of another kind than ours: what they are given, and that the answer is right."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from avlmaps.core.columns import concat
from avlmaps.core.poses import inverse, rotation_angle_rad
from avlmaps.maps.keyframes import describe_keyframe
from avlmaps.maps.settings import KeyframeSettings
from avlmaps.perception.embedded.keypoints import XFeat
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import LocalFeatures, ModelCard
from avlmaps.query.locate import LocateSettings, locate, locate_features
from avlmaps_sim.bench.locate import LocatableMap, map_of
from helpers.picture_room import CAMERA, RoomWalk

WALK = RoomWalk(frames=12)
CARD = ModelCard("fake/learned", 4, "CC0-1.0", "0" * 64)


def score_of(xy: np.ndarray) -> np.ndarray:
    """Return a score that a keypoint's place tells, so that a test can tell whose it is."""
    return ((xy[:, 0] + 2.0 * xy[:, 1]) / 1000.0).astype(np.float32)


@dataclass
class Scored:
    """XFeat's keypoints with scores of a test's own, or with none."""

    card = XFeat().card
    told: bool = True
    finder: XFeat = field(default_factory=XFeat)

    def encode(self, rgb: np.ndarray) -> LocalFeatures:
        found = self.finder.encode(rgb)
        if not self.told:
            return LocalFeatures(found.xy, found.descriptors)
        return replace(found, score=score_of(found.xy), size=(rgb.shape[1], rgb.shape[0]))


@dataclass
class Watching:
    """A matcher that keeps what it was given."""

    card = CARD
    given: list[tuple[LocalFeatures, LocalFeatures]] = field(default_factory=list)

    def match(self, a: LocalFeatures, b: LocalFeatures) -> np.ndarray:
        self.given.append((a, b))
        return Encoders.named("colours").matcher.match(a, b)


def encoders_of(local: Any, matcher: Any) -> Any:
    return Encoders(local=local, place="xfeat", matcher=matcher)


def stored_by(local: Any, matcher: Any) -> LocatableMap:
    return map_of(WALK, encoders_of(local, matcher), np.random.default_rng(0))


@pytest.fixture
def watching() -> Watching:
    return Watching()


@pytest.mark.slow
@pytest.mark.nightly
def test_a_matcher_is_given_the_scores_and_the_sizes_of_both_pictures(watching: Watching) -> None:
    stored = stored_by(Scored(), watching)
    large = WALK.room.render(WALK.world_from_camera[4], CAMERA.resized(480, 360))[0]
    assert locate(stored, large, None, np.random.default_rng(0)).world_from_camera is not None
    for asked, kept in watching.given:
        assert (asked.size, kept.size) == ((480, 360), (320, 240))
        np.testing.assert_allclose(1.5 * asked.score, score_of(asked.xy), rtol=1e-5)  # found at the size of the map's
        np.testing.assert_allclose(kept.score, score_of(kept.xy), atol=5e-4)
        assert kept.score.dtype == np.float32 and len(kept.score) == len(kept.xy) > 100


def test_a_map_of_pictures_with_and_without_scores_has_none() -> None:
    seen = [describe_keyframe(WALK.frame(i), encoders_of(Scored(told=i > 0), None)) for i in range(3)]
    assert concat(seen).score.shape == (0,)
    pieces = [seen[0], concat(seen[1:])]
    assert len(pieces[1].score) == len(pieces[1].xy) > 0
    whole = concat(pieces)
    assert whole.score.shape == (0,) and len(whole.xy) == sum(len(piece.xy) for piece in pieces)


def test_scores_stay_with_their_keypoints_when_lots_are_joined() -> None:
    seen = [describe_keyframe(WALK.frame(i), encoders_of(Scored(), None)) for i in range(3)]
    nothing = {name: getattr(seen[0], name)[:0] for name in ("xy", "descriptors", "points_world", "score")}
    blank = replace(seen[0], offsets=np.zeros(2, np.int64), **nothing)
    whole = concat([seen[0], blank, *seen[1:]])
    np.testing.assert_array_equal(whole.score, score_of(whole.xy).astype(np.float16))


@dataclass
class Planted:
    """Any picture's keypoints are the same 3D points, seen from a pose; descriptors tell nothing but their number."""

    card = CARD

    def match(self, a: LocalFeatures, b: LocalFeatures) -> np.ndarray:
        rows = np.arange(min(len(a.xy), len(b.xy)))
        return np.stack([rows, rows], axis=1)


@pytest.mark.parametrize("count, located", [(400, True), (40, True), (5, False)])
def test_planted_matches_of_few_or_many_keypoints_are_believed_by_the_same_rules(count: int, located: bool) -> None:
    """DISK and SuperPoint find 2,000 keypoints, or far fewer; one set of thresholds is for all."""
    rng = np.random.default_rng(1)
    frame = WALK.frame(4)
    xy = rng.uniform((8, 8), (312, 232), (4 * count, 2)).astype(np.float32)
    kept = LocalFeatures(xy, np.zeros((len(xy), 4), np.float32))
    used = Encoders(local=SimpleNamespace(encode=lambda rgb: kept), matcher=Planted())
    seen = describe_keyframe(frame, used, KeyframeSettings(max_depth_m=20.0))
    good = np.flatnonzero(np.isfinite(seen.points_world[:, 0]))[:count]
    seen = replace(
        seen,
        offsets=np.array([0, len(good)]),
        xy=xy[good],
        descriptors=seen.descriptors[good],
        points_world=seen.points_world[good],
        place=np.ones((1, 1), np.float32),
    )
    stored = LocatableMap(seen, {}, used, WALK.rig)
    whole_pixels = np.floor(xy[good]) + 0.5  # as DISK and SuperPoint tell them
    found = locate_features(
        stored,
        LocalFeatures(whole_pixels.astype(np.float32), kept.descriptors[good]),
        np.ones(1, np.float32),
        CAMERA,
        np.random.default_rng(0),
        LocateSettings(),
    )
    assert (found.world_from_camera is not None) == located
    if found.world_from_camera is not None:
        true = frame.world_from_camera @ inverse(WALK.rig.rgb_from_depth)
        assert np.linalg.norm(found.world_from_camera[:3, 3] - true[:3, 3]) < 0.03
        assert np.rad2deg(rotation_angle_rad(found.world_from_camera, true)) < 1.0
        assert found.inliers > 0.9 * len(good)
