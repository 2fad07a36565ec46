"""Flat surfaces show a lens, squeezed pictures and a heading that drifts, and nothing of a right recording."""

import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.consistency.check import check_recording
from avlmaps.recordings.consistency.flats import RightAngles, find_flats, find_levels
from avlmaps.recordings.consistency.sample import Sample, draw_sample
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.situations import situations

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")
CAMERA = Pinhole(96.0, 96.0, 64.0, 48.0, 128, 96)


@pytest.fixture(scope="module")
def walk() -> Draft:
    return RoomWalk("right round", seed=59, frames=24, rate_hz=2.5, noise=0.0019).draft(CAMERA)


@pytest.fixture(scope="module")
def recording(walk: Draft, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return open_recording(walk.write(tmp_path_factory.mktemp("walk") / "walk"))


@pytest.fixture(scope="module")
def right(recording: Recording) -> Sample:
    return draw_sample(recording)


def said(sample: Sample, recording: Recording) -> str:
    found = RightAngles.of(sample).finding(recording, find_levels(sample))
    return "" if found is None else str(found)


def behind_a_lens(sample: Sample, k1: float) -> Sample:
    """Return what a lens shows of the same places."""
    seen = np.moveaxis(np.mgrid[:96, :128][::-1], 0, -1).astype(np.float32).reshape(-1, 1, 2)
    matrix = CAMERA.matrix - [[0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]
    at = cv2.undistortPoints(seen, matrix, np.array([k1, 0.0, 0.0, 0.0]), P=matrix).reshape(96, 128, 2)
    bent = [cv2.remap(one, at[..., 0], at[..., 1], cv2.INTER_NEAREST) for one in sample.depth_m]
    return replace(sample, depth_m=np.stack(bent))


def with_focal_lengths(sample: Sample, fx: float, fy: float) -> Sample:
    camera = replace(CAMERA, fx=CAMERA.fx * fx, fy=CAMERA.fy * fy)
    return replace(sample, rig=Rig(camera, camera))


def turned(sample: Sample, degrees: np.ndarray) -> Sample:
    poses = sample.world_from_camera.copy()
    for pose, angle in zip(poses, np.radians(degrees), strict=True):
        pose[:3, :3] = cv2.Rodrigues(np.array([0.0, 0.0, angle]))[0] @ pose[:3, :3]
    return replace(sample, world_from_camera=poses)


def test_nothing_is_said_of_a_right_recording_and_all_would_show(right: Sample, recording: Recording) -> None:
    angles = RightAngles.of(right)
    assert said(right, recording) == "" and angles.lens_would_show and angles.squeeze_would_show


@pytest.mark.parametrize("k1", [-0.3, -0.2, -0.15])
def test_a_lens_is_named_with_its_strength(k1: float, right: Sample, recording: Recording) -> None:
    sentence = said(behind_a_lens(right, k1), recording)
    found = re.search(r"as behind a wide lens.*k1 about (-0\.\d+)\).*Take the distortion", sentence)
    assert found is not None and float(found[1]) == pytest.approx(k1, rel=0.25)


@pytest.mark.parametrize("k1", [-0.04, 0.04, 0.3])
def test_a_slight_lens_and_one_that_bends_outwards_are_not(k1: float, right: Sample, recording: Recording) -> None:
    assert said(behind_a_lens(right, k1), recording) == ""


@pytest.mark.parametrize(
    ("times", "axes"), [((1.0, 0.75), "fy"), ((1.0, 1.333), "fy"), ((0.75, 1.0), "fx"), ((0.7, 0.7), "fx and fy")]
)
def test_the_focal_length_is_named_that_makes_angles_right(
    times: tuple[float, float], axes: str, right: Sample, recording: Recording
) -> None:
    sentence = said(with_focal_lengths(right, *times), recording)
    found = re.search(r"at right angles.* if (f.*) were ([\d.]+) times as large", sentence)
    assert found is not None and found[1] == axes
    assert float(found[2]) == pytest.approx(1.0 / max(times, key=lambda by: abs(by - 1.0)), rel=0.08)


@pytest.mark.parametrize("times", [(1.0, 0.93), (1.06, 1.0), (1.05, 1.05)])
def test_a_rough_calibration_is_no_doubt(times: tuple[float, float], right: Sample, recording: Recording) -> None:
    assert said(with_focal_lengths(right, *times), recording) == ""


def test_surfaces_of_one_view_decide_nothing(right: Sample, recording: Recording) -> None:
    rows = np.full(24, 5)
    still = replace(right, depth_m=right.depth_m[rows], world_from_camera=right.world_from_camera[rows])
    angles = RightAngles.of(with_focal_lengths(still, 1.0, 0.7))
    assert len(angles.flats.frame) >= 24 and not angles.squeeze_would_show and not angles.lens_would_show
    assert said(with_focal_lengths(still, 1.0, 0.7), recording) == ""


@pytest.mark.parametrize("degrees", [40.0, -60.0])
def test_walls_that_turn_evenly_are_a_heading_that_drifts(degrees: float, right: Sample, recording: Recording) -> None:
    share = (right.stamps_s - right.stamps_s[0]) / np.ptp(right.stamps_s)
    found = re.search(r"lie (\d+) degrees off those seen first", said(turned(right, degrees * share), recording))
    assert found is not None and float(found[1]) == pytest.approx(abs(degrees), abs=4.0)


@pytest.mark.parametrize("degrees", [20.0, 35.0, 45.0])
def test_a_part_of_a_building_that_is_turned_is_none(degrees: float, right: Sample, recording: Recording) -> None:
    assert said(turned(right, np.where(np.arange(len(right)) < len(right) // 2, 0.0, degrees)), recording) == ""


def test_flat_surfaces_have_their_normals_and_bends(right: Sample) -> None:
    normal = np.array([0.2, 0.8, 0.5]) / np.linalg.norm([0.2, 0.8, 0.5])
    rays = CAMERA.rays()
    r2 = (rays[..., :2] ** 2).sum(axis=-1, keepdims=True)
    for bend in (0.0, 0.3):
        farther = np.concatenate([rays[..., :2] * (1.0 + bend * r2), rays[..., 2:]], axis=-1)
        inverse = farther @ normal / 1.2
        depth_m = np.where(inverse > 0.2, 1.0 / np.maximum(inverse, 0.1), 0.0).astype(np.float32)
        flats = find_flats(replace(right, depth_m=depth_m[None].repeat(len(right), 0)))
        largest = flats.share > 0.2
        assert largest.any() and flats.bend[largest] == pytest.approx(bend, abs=0.01)
        assert np.degrees(np.arccos(np.clip(flats.normal[largest] @ normal, -1.0, 1.0))).max() < 0.5


@pytest.mark.parametrize("size", [(16, 12), (8, 8), (128, 96)])
def test_small_pictures_and_no_depth_have_no_surfaces(
    size: tuple[int, int], right: Sample, recording: Recording
) -> None:
    small = CAMERA.resized(*size)
    empty = replace(right, depth_m=np.zeros((len(right), *size[::-1]), np.float32), rig=Rig(small, small))
    assert len(find_flats(empty).frame) == 0 and said(empty, recording) == ""
    assert not RightAngles.of(empty).lens_would_show


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("lenses as they are, by a pinhole's numbers", "behind a wide lens"),
        ("16:9 squeezed into 4:3", "fy were 1.3"),
        ("headings drift by 50 degrees", "Walls turn|do not agree"),
    ],
)
def test_the_check_of_a_recording_says_it(name: str, cause: str, walk: Draft, tmp_path: Path) -> None:
    situation = next(one for one in situations() if one.name == name)
    wrong = situation.change(walk, walk, np.random.default_rng(0))
    sentences = check_recording(open_recording(wrong.write(tmp_path / "walk"))).sentences()
    assert re.search(cause, " ".join(sentences)), sentences


@pytest.mark.nightly
def test_a_lens_is_said_also_where_a_shorter_focal_length_would_let_frames_agree(tmp_path: Path) -> None:
    walk = RoomWalk("right round", seed=60, frames=24, rate_hz=2.5, noise=0.0019).draft(CAMERA)
    lens = next(one for one in situations() if one.name.startswith("lenses as they are"))
    written = lens.change(walk, walk, np.random.default_rng(0)).write(tmp_path / "walk")
    (sentence,) = check_recording(open_recording(written)).sentences()
    assert "do not agree" in sentence and "behind a wide lens" in sentence and "focal length looks" not in sentence


def test_what_would_not_show_is_said(tmp_path: Path) -> None:
    far = RoomWalk("few surfaces", seed=59, frames=24, rate_hz=2.5, holes=0.3).draft(CAMERA)
    unchecked = " ".join(check_recording(open_recording(far.write(tmp_path / "walk"))).unchecked)
    assert "distortion of the lens" in unchecked and "ratio of fx to fy" in unchecked
