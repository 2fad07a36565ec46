"""A recording against itself: right ones pass, wrong ones are named, and what is named puts them right."""

import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.cli.verb import Reading as GivenReading
from avlmaps.cli.verbs import CONFIG
from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.wording import Spelling, asked_as, options_as
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.channels import level_faults
from avlmaps.recordings.conformance import example_truth, see
from avlmaps.recordings.consistency.agreement import NOTHING
from avlmaps.recordings.consistency.check import Grade, Reason, Verdict, check_recording
from avlmaps.recordings.consistency.flats import Flats
from avlmaps.recordings.consistency.readings import Reading, cause_of, rig_of
from avlmaps.recordings.consistency.sample import Sample, choose_pairs, draw_sample
from avlmaps.recordings.consistency.suspicions import examine_recording, find_edges
from avlmaps.recordings.corrections import Corrections, PoseKind, opencv_from_axes
from avlmaps.recordings.memory import MemoryRecording, is_of_program
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Recording
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.outcomes import Judge, Outcome
from avlmaps_sim.bench.recordings.situations import situations

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # none reaches a user
CAMERA, WIDE = Pinhole(48.0, 48.0, 32.0, 24.0, 64, 48), Pinhole(96.0, 96.0, 64.0, 48.0, 128, 96)
EVERY = {one.name: one for one in situations()}


@pytest.fixture(scope="module")
def right() -> Draft:
    return RoomWalk("room", seed=51, frames=30).draft(CAMERA)


def verdict(draft: Draft, folder: Path, given: Corrections | None = None) -> Verdict:
    path = folder / "walk"
    if not path.exists():
        draft.write(path)
    return examine_recording(open_recording(path, corrections=given))


RIGHT = [
    RoomWalk("people and noise", seed=53, frames=30, people=3, noise=0.0019),
    RoomWalk("a moved chair, holes", seed=54, frames=30, moved_chair=True, holes=0.3),
    RoomWalk("drift and flicker", seed=55, frames=30, drift=0.008, flicker=0.3),
    RoomWalk("slow", seed=56, frames=40, rate_hz=30.0, turn_rad_s=0.2),
]


@pytest.mark.few(2)
@pytest.mark.parametrize("walk", RIGHT, ids=lambda walk: walk.name)
def test_a_right_recording_passes_without_a_word(walk: RoomWalk, tmp_path: Path) -> None:
    found = verdict(walk.draft(CAMERA), tmp_path)
    assert found.grade is Grade.FINE and not found.sentences()
    assert found.agreeing > 0.8 and found.pairs >= 8


def axes(name: str) -> np.ndarray:
    turn = np.eye(4)
    turn[:3, :3] = opencv_from_axes(name)
    return turn


WRONG = {
    "camera_from_world": lambda d: replace(d, poses=poses.inverse(d.poses)),
    "wxyz and inverse": lambda d: replace(d, poses=poses.inverse(d.poses), quaternion_roll=1),
    "OpenGL": lambda d: replace(d, poses=d.poses @ axes("opengl")),
    "rolled by 90 degrees": lambda d: replace(d, poses=d.poses @ axes("DLF")),
    "late": lambda d: replace(d, pose_stamps_s=d.pose_stamps_s + 0.37),
    "depth ten times": lambda d: replace(d, units_per_m=100.0),
}


@pytest.mark.few(3)
@pytest.mark.parametrize(("name",), [(name,) for name in WRONG])
def test_the_remedy_that_the_door_names_puts_the_recording_right(name: str, right: Draft, tmp_path: Path) -> None:
    import tyro

    path = WRONG[name](right).write(tmp_path / "walk")
    with options_as(Spelling.FLAG):
        found = check_recording(open_recording(path))
    remedy = next(f.remedy for f in found.findings if f.reason is Reason.GEOMETRY)
    words = re.search(r"build again with (--[^:]*?)(?:, (?:or|multiply|turn|write)|\.$|\. )", remedy + " ")
    assert words, remedy
    options = tyro.cli(GivenReading, args=shlex.split(words[1]), config=CONFIG).corrections()
    again = examine_recording(open_recording(path, corrections=options))
    assert again.grade is Grade.FINE, (remedy, again.sentences())


def test_a_wrong_option_is_found_out(right: Draft, tmp_path: Path) -> None:
    found = verdict(right, tmp_path, Corrections(camera_axes="opengl", depth_unit_m=0.001))
    assert found.grade is Grade.IMPOSSIBLE and "Corrections.camera_axes=opencv" in found.findings[0].remedy


MISTAKES: list[tuple[str, Reason, str]] = [
    ("colour mirrored", Reason.COLOUR, ""),
    ("depth constant", Reason.DEPTH, ""),
    ("depth of noise", Reason.DEPTH, ""),
    ("colour 10 frames late", Reason.COLOUR, ""),
    ("principal point at the corner", Reason.INTRINSICS, ""),
    ("poses jump by 0.5 m", Reason.GEOMETRY, ""),
    ("poses turn by 20 degrees", Reason.GEOMETRY, ""),
    ("positions x0.5", Reason.GEOMETRY, ""),
    ("principal point off by a sixteenth", Reason.GEOMETRY, ""),
    ("half of the pictures BGR", Reason.COLOUR, ""),
    ("all pictures BGR", Reason.COLOUR, ""),
    ("colour camera 0.3 m beside", Reason.COLOUR, ""),
    ("colour shifted by a sixteenth", Reason.COLOUR, ""),
    ("poses jump by 2.5 m", Reason.MOTION, ""),
    ("a third of the pictures black", Reason.COLOUR, ""),
    ("depth in cm, of which 8 bits are stored", Reason.DEPTH, ""),
    ("frames sorted as text", Reason.GEOMETRY, ""),
    ("every second pose is the one before", Reason.GEOMETRY, ""),
    ("all poses the same", Reason.GEOMETRY, "All poses are the same"),
    ("depth cut off at 2 m", Reason.DEPTH, "exactly the largest one, 2 m"),
]


@pytest.mark.few(4)
@pytest.mark.parametrize(("name", "reason", "said"), MISTAKES)
def test_a_mistake_is_named(name: str, reason: Reason, said: str, right: Draft, tmp_path: Path) -> None:
    found = verdict(EVERY[name].change(right, right, np.random.default_rng(0)), tmp_path)
    assert reason in {finding.reason for finding in found.findings}
    assert re.search(said or EVERY[name].cause, " ".join(found.sentences())), found.sentences()


def with_depth(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Draft], Draft]:
    return lambda draft: replace(
        draft, depth=tuple(np.where(z > 0, change(z.astype(float)), 0.0).astype(z.dtype) for z in draft.depth)
    )


def late(frames: int) -> Callable[[Draft], Draft]:
    def change(draft: Draft) -> Draft:
        order = np.clip(np.arange(len(draft)) - frames, 0, len(draft) - 1)
        return replace(draft, depth=tuple(draft.depth[i] for i in order))

    return change


def posed(count: int) -> Callable[[Draft], Draft]:
    return lambda draft: replace(draft, poses=draft.poses[:count], pose_stamps_s=draft.pose_stamps_s[:count])


def frozen_poses(draft: Draft) -> Draft:
    rows = np.where(np.abs(np.arange(len(draft)) - 15) < 5, 15, np.arange(len(draft)))
    return replace(draft, poses=draft.poses[rows])


OTHERS: list[tuple[str, Callable[[Draft], Draft], str]] = [
    ("depth a frame late", late(1), r"epth pictures look 1 frame\(s\) late"),
    ("depth two early", late(-2), r"epth pictures look 2 frame\(s\) early"),
    ("depth 0.15 m short", with_depth(lambda z: z - 150.0), "m too small everywhere|do not agree"),
    ("few poses", posed(12), "Only 40% of the frames have a pose"),
    ("enough poses", posed(24), "^$"),
    ("poses froze", frozen_poses, "pose is the same although|do not agree|far off"),
]


@pytest.mark.few(3)
@pytest.mark.parametrize(("name", "change", "said"), OTHERS)
def test_what_field_recordings_have_is_said(
    name: str, change: Callable[[Draft], Draft], said: str, right: Draft, tmp_path: Path
) -> None:
    sentences = " ".join(verdict(change(right), tmp_path).sentences())
    assert re.search(said, sentences), sentences


@pytest.mark.parametrize(
    ("round_rad_s", "times", "farther_m", "said"),
    [
        (0.5, 1.15, 0.0, "The depth looks 1.15 times too large, or the positions 1.15 times too small"),
        (0.5, 0.87, 0.0, "The depth looks 1.15 times too small, or the positions 1.15 times too large"),
        (0.0, 1.0, 0.3, "The depth looks 0.3 m too large everywhere: write the depth from the camera's centre (-0.3"),
    ],
)  # fmt: skip
def test_depth_that_is_a_little_off_is_named(
    round_rad_s: float, times: float, farther_m: float, said: str, tmp_path: Path
) -> None:
    walk = RoomWalk("turn", seed=57, frames=30, round_rad_s=round_rad_s).draft(CAMERA)
    found = verdict(with_depth(lambda z: z * times + 1000.0 * farther_m)(walk), tmp_path)
    assert found.grade is Grade.SUSPICIOUS and said in " ".join(found.sentences())


def test_a_program_is_told_what_to_give_instead() -> None:
    walk, opengl = example_truth(frames=16), np.diag([1.0, -1.0, -1.0, 1.0])
    frames = [
        Frame(i, f"{i:06d}", i / 10.0, walk.rgb[i], walk.depth_m[i], pose @ opengl, walk.rig)
        for i, pose in enumerate(walk.world_from_camera)
    ]
    said = " ".join(check_recording(MemoryRecording(frames)).sentences())
    matrix = opengl[:3, :3].astype(int).tolist()
    assert f"give frames with poses of OpenCV's axes, world_from_camera[:3, :3] @ {matrix}" in said
    assert "Corrections" not in said
    inverted = Reading(Corrections(poses=(PoseKind.CAMERA_FROM_WORLD,)), scale=0.001)
    said = cause_of(inverted, MemoryRecording(frames), 2000.0)
    assert "give frames with the inverse of each pose and depth_m times 0.001." in said
    with asked_as(Spelling.FLAG):  # of a live map that plays a recording
        assert not is_of_program(MemoryRecording(frames))


def test_intrinsics_that_fit_already_are_no_cause() -> None:
    assert rig_of(Rig(CAMERA, CAMERA), Reading(centred=True)) is None
    assert rig_of(Rig(CAMERA, CAMERA), Reading(focal=1.25)) is not None


def test_two_cameras_that_take_turns_are_compared_each_with_itself(tmp_path: Path) -> None:
    ahead = RoomWalk("turns", seed=59, frames=24, turn_rad_s=0.5).draft(CAMERA)
    beside = poses.from_quaternion(np.zeros((1, 3)), np.array([[0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]]))[0]
    pose = np.stack([one @ beside if i % 2 else one for i, one in enumerate(ahead.poses)])
    seen = [see(CAMERA, one) for one in pose]
    depth = tuple(np.rint(1000.0 * depth_m).astype(np.uint16) for _, depth_m in seen)
    found = verdict(replace(ahead, rgb=tuple(rgb for rgb, _ in seen), depth=depth, poses=pose), tmp_path)
    assert found.grade is Grade.FINE and found.pairs >= 8 and not found.sentences()


SPOTS = {
    "keyframes": (RoomWalk("keyframes", seed=52, frames=4, rate_hz=0.2, turn_rad_s=0.3), {"hardly any two frames"}),
    "stands and turns evenly": (RoomWalk("turn", seed=57, frames=30, round_rad_s=0.0, even=True),
                                {"twice as far", "clock of"}),
    "hardly moves": (RoomWalk("still", seed=58, frames=30, round_rad_s=0.02, turn_rad_s=0.02, noise=0.0019, even=True),
                     {"twice as far", "clock of", "focal"}),
    "mostly turns": (RoomWalk("walk", seed=51, frames=30), {"15% or 0.3 m too large"}),
    "walks": (RoomWalk("turn", seed=57, frames=30, round_rad_s=0.5), set[str]()),
}  # fmt: skip


@pytest.mark.few(2)
@pytest.mark.parametrize("name", SPOTS)
def test_what_would_not_show_is_said(name: str, tmp_path: Path) -> None:
    walk, spots = SPOTS[name]
    found = verdict(walk.draft(CAMERA), tmp_path)
    assert found.grade is (Grade.UNCHECKED if name == "keyframes" else Grade.FINE) and not found.sentences()
    every = ("hardly any two frames", "twice as far", "15% or 0.3 m too large", "clock of", "focal", "the ray")
    assert {spot for spot in every if spot in " ".join(found.unchecked)} == spots


def parts(recording: Recording, moved: np.ndarray) -> Recording:
    """Return a recording whose second half begins ten minutes later, elsewhere."""
    late = [
        replace(frame, stamp_s=frame.stamp_s + 600.0, world_from_camera=moved @ frame.world_from_camera)
        for frame in recording
    ]
    return MemoryRecording([*list(recording)[:15], *late[15:]])


@pytest.mark.parametrize(("degrees", "by_m", "said"), [(0, 0.0, ""), (0, 0.8, "origins|jump"), (180, 0.0, "origins")])
@pytest.mark.nightly
def test_a_second_part_with_another_origin_is_doubted(
    degrees: int, by_m: float, said: str, right: Draft, tmp_path: Path
) -> None:
    recording = open_recording(right.write(tmp_path / "walk"))
    middle, turn = recording.world_from_camera[:, :3, 3].mean(axis=0), np.eye(4)
    turn[:2, :2] = np.round([[np.cos(a := np.radians(degrees)), -np.sin(a)], [np.sin(a), np.cos(a)]])
    turn[:3, 3] = middle - turn[:3, :3] @ middle + (by_m, by_m, 0.0)
    sentences = examine_recording(parts(recording, turn)).sentences()
    assert any(re.search(f"{said}|do not agree", one) for one in sentences) if said else not sentences


def test_a_second_part_that_sees_nothing_of_the_first_is_said_to_be_unchecked(right: Draft, tmp_path: Path) -> None:
    away = np.eye(4)
    away[0, 3] = 40.0
    found = examine_recording(parts(open_recording(right.write(tmp_path / "walk")), away))
    assert any("one origin before and after the gap of 600 s between 000014 and 000015" in it for it in found.unchecked)


# Sound

LENGTHS = {
    "as long": (16_000, 1.0, 0.0, ""), "begins before, ends after": (16_000, 1.3, -2.0, ""),
    "twice the rate": (8_000, 2.0, 0.0, "16000 samples a second were called 8000"),
    "48 for 16 kHz": (16_000, 3.0, 0.05, "48000 samples a second were called 16000"),
    "44.1 for 48 kHz": (48_000, 44.1 / 48.0, 0.0, ""), "goes on": (16_000, 2.0, -8.0, ""),
}  # fmt: skip


def test_a_track_of_another_rate_is_doubted(right: Draft, tmp_path: Path) -> None:
    recording = open_recording(right.write(tmp_path / "walk"))
    for rate_hz, longer, start_s, said in LENGTHS.values():
        recording.audio = AudioTrack(tmp_path / "sound.wav", rate_hz, longer * recording.duration_s, start_s)
        found = [one for one in check_recording(recording).findings if one.reason is Reason.SOUND]
        assert [said in str(one) for one in found] == [True] * bool(said)


SILENCES = {
    "all of it": (lambda n: np.zeros(n), "is silent throughout: every sample is 0"),
    "from the middle on": (lambda n: noise(n) * (np.arange(n) < 0.4 * n), "is silent in one piece from about"),
    "until the end": (lambda n: noise(n) * (np.arange(n) > 0.7 * n), "is silent in one piece from about 2 to"),
    "none": (lambda n: noise(n), ""),
    "quiet": (lambda n: np.round(3.0 * noise(n)) / 32768, ""),
    "a third": (lambda n: noise(n) * (np.arange(n) < 0.66 * n), ""),
    "sounds on silence": (lambda n: noise(n) * (np.arange(n) % (n // 4) < n // 16), ""),
}


def noise(count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(-0.5, 0.5, count)


@pytest.mark.few(2)
@pytest.mark.parametrize("case", SILENCES)
def test_a_track_that_a_microphone_did_not_record_is_doubted(case: str, tmp_path: Path) -> None:
    make, said = SILENCES[case]
    write_flac(tmp_path / "sound.flac", Sound(make(200_000).astype(np.float32), 4_000))
    silent, clipped = level_faults(AudioTrack.open(tmp_path / "sound.flac", 2.0))
    assert [said in one for one in silent] == [True] * bool(said) and not clipped


@pytest.mark.parametrize(("gain", "doubted"), [(1.0, False), (4.0, True)])
def test_a_clipped_track_is_doubted(gain: float, doubted: bool, right: Draft, tmp_path: Path) -> None:
    sound = np.sin(np.arange(round(16_000 * float(right.stamps_s[-1]))) * 0.2).astype(np.float32)
    sound[: len(sound) // 2] *= 0.1
    right.write(tmp_path / "walk")
    write_flac(tmp_path / "walk" / "audio.flac", Sound(np.clip(gain * sound, -1.0, 1.0), 16_000))
    found = check_recording(open_recording(tmp_path / "walk"))
    assert [one.reason for one in found.findings] == [Reason.SOUND] * doubted
    assert all("is clipped in" in one and "audio.flac" in one for one in found.sentences())


# Flat surfaces, edges and pairs


@pytest.fixture(scope="module")
def wide(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    walk = RoomWalk("right round", seed=59, frames=24, rate_hz=2.5, noise=0.0019).draft(WIDE)
    return draw_sample(open_recording(walk.write(tmp_path_factory.mktemp("wide") / "walk")))


def behind_a_lens(sample: Sample, k1: float) -> Sample:
    seen = np.moveaxis(np.mgrid[:96, :128][::-1], 0, -1).astype(np.float32).reshape(-1, 1, 2)
    matrix = WIDE.matrix - [[0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]
    at = cv2.undistortPoints(seen, matrix, np.array([k1, 0.0, 0.0, 0.0]), P=matrix).reshape(96, 128, 2)
    bent = [cv2.remap(one, at[..., 0], at[..., 1], cv2.INTER_NEAREST) for one in sample.depth_m]
    return replace(sample, depth_m=np.stack(bent))


@pytest.mark.few(2)
@pytest.mark.parametrize(("k1", "is_lens"), [(-0.3, True), (-0.15, True), (0.0, False), (-0.04, False), (0.3, False)])
def test_a_wide_lens_is_found_with_its_strength(k1: float, is_lens: bool, wide: Sample) -> None:
    flats = Flats.of(behind_a_lens(wide, k1) if k1 else wide)
    found = flats.lens()
    assert (found is not None) == is_lens
    assert found is None or found[0] == pytest.approx(k1, rel=0.25)
    assert k1 or flats.lens_would_show


@pytest.mark.few(2)
@pytest.mark.parametrize(("axis", "degrees"), [(0, 6.0), (0, -6.0), (2, 6.0), (2, -6.0), (0, 14.0)])
def test_floors_show_how_a_camera_sits_in_its_mount(wide: Sample, axis: int, degrees: float) -> None:
    half = np.radians(degrees) / 2.0
    off = poses.from_quaternion(np.zeros((1, 3)), np.array([[*(np.sin(half) * np.eye(3)[axis]), np.cos(half)]]))[0]
    found = Flats.of(replace(wide, world_from_camera=wide.world_from_camera @ off)).levels().tilt
    assert found is not None and found.left_deg < 1.5 < found.off_deg
    expected = (degrees, 0.0) if axis == 0 else (0.0, -degrees)
    assert (found.down_deg, found.right_deg) == pytest.approx(expected, abs=1.5)


@pytest.mark.few(1)
@pytest.mark.parametrize("degrees", [0.0, 5.0, 12.0])
def test_a_slope_is_no_tilt_of_the_camera(wide: Sample, degrees: float) -> None:
    half = np.radians(degrees) / 2.0
    slope = poses.from_quaternion(np.zeros((1, 3)), np.array([[np.sin(half), 0.0, 0.0, np.cos(half)]]))[0]
    levels = Flats.of(replace(wide, world_from_camera=slope @ wide.world_from_camera)).levels()
    assert levels.tilt is None


@pytest.mark.parametrize("size", [(16, 12), (8, 8), (128, 96)])
def test_small_pictures_and_no_depth_have_no_surfaces(size: tuple[int, int], wide: Sample) -> None:
    small = WIDE.resized(*size)
    empty = replace(wide, depth_m=np.zeros((len(wide), *size[::-1]), np.float32), rig=Rig(small, small))
    flats = Flats.of(empty)
    assert len(flats.frame) == 0 and not flats.lens_would_show and flats.levels().tilt is None


@given(st.integers(-16, 16), st.integers(-16, 16))
def test_edges_of_colour_are_found_where_they_were_moved_to(wide: Sample, x: int, y: int) -> None:
    found = find_edges(replace(wide, grey=np.roll(wide.grey, (y, x), axis=(1, 2)))).shift()
    if np.hypot(x, y) <= 1.0:
        assert found is None
    elif np.hypot(x, y) >= 8.0:
        assert found is not None and np.hypot(found[0] - x, found[1] - y) <= 3.0


@pytest.mark.parametrize("count", [2, 7, 5000])
def test_pairs_are_of_the_recording_in_the_order_of_time(count: int) -> None:
    pose = np.tile(np.eye(4), (count, 1, 1))
    pose[:, 0, 3] = np.linspace(0.0, 0.05 * count, count)
    pairs, follows = choose_pairs(pose)
    assert len(pairs) == len(follows) and 1 <= len(pairs) <= 60
    assert (pairs[:, 0] < pairs[:, 1]).all() and pairs.min() >= 0 and pairs.max() < count


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("lenses as they are, by a pinhole's numbers", "behind a wide lens"),
        ("camera tilted by 8 degrees in its mount", "mount|Floors"),
        ("cut to 16:9, with the old middle", "cy"),
    ],
)
@pytest.mark.nightly
def test_flat_surfaces_of_a_recording_say_it(name: str, cause: str, tmp_path: Path) -> None:
    walk = RoomWalk("right round", seed=59, frames=24, rate_hz=2.5, noise=0.0019).draft(WIDE)
    found = verdict(EVERY[name].change(walk, walk, np.random.default_rng(0)), tmp_path)
    assert re.search(cause, " ".join(found.sentences())), found.sentences()


@pytest.mark.nightly
def test_the_bench_knows_a_right_map_from_a_wrong_one(right: Draft) -> None:
    """A world that is turned and moved holds the same map; colours of other frames do not."""
    judge = Judge(right)
    turn = poses.from_quaternion(np.array([[3.0, -1.0, 2.0]]), np.array([[0.1, 0.2, 0.3, 0.9]]))[0]
    moved = EVERY["OpenGL camera in a y-up world"]
    same = replace(moved, change=lambda d, o, g: replace(d, poses=turn @ d.poses))
    outcomes = [case.outcome for one in (same, moved) if (case := judge.judge(one, right, 0))]
    assert outcomes == [Outcome.RIGHT, Outcome.REFUSED]


def test_a_comparison_of_too_few_points_has_no_difference_and_no_warning() -> None:
    assert np.isnan(replace(NOTHING, off=np.array([np.nan, np.nan])).median_off) and np.isnan(NOTHING.median_off)
    assert replace(NOTHING, off=np.array([0.25, np.nan, 0.75])).median_off == 0.5
