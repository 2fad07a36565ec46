"""The live tree of frames against matrices, and against everything that must not reach it."""

import contextlib
import json
from itertools import pairwise
from math import pi

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from avlmaps.core.motion import GroundPose
from avlmaps_ros.messages import Incoming, sanitize_line, stamped_pose, transforms_in
from avlmaps_ros.tree import LiveTree


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def message(*transforms: dict) -> msgspec.Raw:
    return msgspec.Raw(json.dumps({"transforms": transforms}).encode())


def transform(parent: str, child: str, place=(0.0, 0.0, 0.0), quaternion=(0.0, 0.0, 0.0, 1.0)) -> dict:
    translation = dict(zip("xyz", place, strict=True))
    rotation = dict(zip("xyzw", quaternion, strict=True))
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": parent, "seq": 7},
        "child_frame_id": child,
        "transform": {"translation": translation, "rotation": rotation},
    }


def turned(yaw_rad: float) -> tuple[float, ...]:
    return tuple(Rotation.from_euler("z", yaw_rad).as_quat().tolist())


@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_a_chain_is_the_product_of_its_transforms(length, seed):
    rng = np.random.default_rng(seed)
    tree, expected = LiveTree(), np.eye(4)
    names = ["map", *(f"frame{i}" for i in range(length))]
    order = []
    for parent, child in pairwise(names):
        rotation = Rotation.from_euler("zyx", [rng.uniform(-3, 3), *rng.uniform(-0.2, 0.2, 2)])
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = rotation.as_matrix(), rng.uniform(-5, 5, 3)
        expected = expected @ step
        order.append(transform(parent, child, step[:3, 3].tolist(), rotation.as_quat().tolist()))
    for told in rng.permutation(np.array(order, object)):
        tree.hear(message(told), static=bool(rng.integers(2)))
    seen = tree.seen("map", names[-1])
    assert seen is not None
    np.testing.assert_allclose([seen.pose.x_m, seen.pose.y_m], expected[:2, 3], atol=1e-9)
    ahead = expected[:2, 0] / np.linalg.norm(expected[:2, 0])
    np.testing.assert_allclose([np.cos(seen.pose.heading_rad), np.sin(seen.pose.heading_rad)], ahead, atol=1e-9)


def test_the_oldest_moving_transform_tells_the_age_and_static_ones_never_age():
    clock = Clock()
    tree = LiveTree(clock)
    tree.hear(message(transform("base_footprint", "base_link")), static=True)
    tree.hear(message(transform("map", "odom")), static=False)
    clock.now += 4.0
    tree.hear(message(transform("odom", "base_footprint")), static=False)
    clock.now += 1.0
    seen = tree.seen("map", "base_link")
    assert seen is not None
    assert (seen.taken_s, seen.age_s) == (pytest.approx(clock.now - 5.0), pytest.approx(5.0))
    assert seen.heard_s == pytest.approx(clock.now - 1.0)  # the newest
    tree.hear(message(transform("map", "odom")), static=False)
    assert tree.seen("map", "base_link").age_s == pytest.approx(1.0)


def test_the_newest_transform_counts_and_a_frame_may_change_its_parent():
    tree = LiveTree()
    tree.hear(message(transform("map", "base_link", (1.0, 2.0, 0.0), turned(pi / 2))), static=False)
    tree.hear(message(transform("/odom", "/base_link", (0.0, 0.0, 0.0))), static=False)
    assert tree.seen("map", "base_link") is None
    tree.hear(message(transform("map", "odom", (3.0, 0.0, 0.0), turned(pi))), static=False)
    assert tree.seen("map", "base_link").pose == GroundPose(3.0, 0.0, pi)


@pytest.mark.parametrize(
    "spoiled",
    [
        transform("map", "base_link", (None, 0.0, 0.0)),
        transform("map", "base_link", (float("nan"), 0.0, 0.0)),
        transform("map", "base_link", (1e9, 0.0, 0.0)),
        transform("map", "base_link", quaternion=(0.0, 0.0, 0.0, 0.0)),
        transform("map", "base_link", quaternion=(1.0, 1.0, 1.0, 1.0)),
        transform("map", "base_link", quaternion=(None, None, None, None)),
        transform("map", "base_link", ("1", 0.0, 0.0)),
        transform("map", "b" * 300),
        {"header": {"frame_id": "map"}, "child_frame_id": "base_link"},
    ],
)
def test_a_spoiled_transform_leaves_the_last_good_one_and_its_neighbours(spoiled):
    tree = LiveTree()
    tree.hear(message(transform("map", "base_link", (1.0, 2.0, 0.0))), static=False)
    text = json.dumps({"transforms": [transform("base_link", "laser"), spoiled]})
    if "NaN" in text:  # no JSON at all: the whole message is refused
        with pytest.raises(ValueError, match="malformed"):
            tree.hear(msgspec.Raw(text.encode()), static=False)
    else:
        tree.hear(msgspec.Raw(text.encode()), static=False)
        assert tree.refused == 1
        assert tree.seen("map", "laser") is not None
    assert tree.seen("map", "base_link").pose == GroundPose(1.0, 2.0, 0.0)


def test_a_ring_of_frames_ends():
    tree = LiveTree()
    ring = [transform("a", "b"), transform("b", "c"), transform("c", "a"), transform("x", "x"), transform("", "y")]
    tree.hear(message(*ring), static=False)
    assert tree.seen("map", "a") is None
    assert "not to 'map'" in tree.why_not("map", "a")


def test_a_flood_of_frames_does_not_grow_without_end():
    tree = LiveTree()
    for block in range(4):
        many = [transform("map", f"frame {block} {i}") for i in range(2000)]
        tree.hear(message(*many), static=False)
    tree.hear(message(transform("map", "late")), static=False)
    assert tree.seen("map", "late") is None
    with pytest.raises(ValueError, match="length"):
        tree.hear(message(*(transform("map", str(i)) for i in range(2001))), static=False)


def test_what_is_missing_is_told():
    tree = LiveTree()
    assert tree.why_not("map", "base_link") == "nothing arrives on /tf"
    tree.hear(message(transform("odom", "base_footprint")), static=False)
    assert tree.why_not("map", "base_link") == "/tf has no frame 'base_link'; it has base_footprint, odom"
    expected = "/tf leads from 'base_footprint' up to 'odom' and not to 'map'; it has base_footprint, odom"
    assert tree.why_not("map", "base_footprint") == expected


def test_a_body_on_end_heads_nowhere_and_has_no_pose():
    tree = LiveTree()
    on_end = Rotation.from_euler("y", -90, degrees=True).as_quat().tolist()
    tree.hear(message(transform("map", "base_link", (0.0, 0.0, 0.0), on_end)), static=False)
    assert tree.seen("map", "base_link") is None


@given(st.floats(-100, 100), st.floats(-100, 100), st.floats(-10, 10), st.sampled_from([1, 2]))
def test_a_pose_that_is_sent_says_what_a_transform_that_comes_says(x_m, y_m, heading_rad, ros):
    pose = GroundPose(x_m, y_m, heading_rad)
    sent = stamped_pose(pose, "map", ros)
    place, turn = sent["pose"]["position"], sent["pose"]["orientation"]
    tree = LiveTree()
    tree.hear(message(transform("map", "b", tuple(place.values()), tuple(turn.values()))), static=False)
    seen = tree.seen("map", "b").pose
    assert seen.distance_m(pose) < 1e-9
    assert np.cos(seen.heading_rad - pose.heading_rad) == pytest.approx(1.0)
    assert set(sent["header"]["stamp"]) == ({"secs", "nsecs"} if ros == 1 else {"sec", "nanosec"})


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["transforms", "op", "x"]), inner),
    max_leaves=8,
)


@given(json_values)
def test_no_json_raises_anything_but_value_errors(value):
    payload = json.dumps(value).encode()
    for read in (lambda: msgspec.json.decode(payload, type=Incoming), lambda: transforms_in(msgspec.Raw(payload))):
        with contextlib.suppress(ValueError):
            read()


@given(st.text())
def test_text_from_outside_is_one_clean_line(text):
    line = sanitize_line(text, 50)
    assert len(line) <= 50
    assert not any(ord(c) < 32 or 127 <= ord(c) < 160 for c in line)
