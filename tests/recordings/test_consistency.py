"""A recording against itself: right ones pass, wrong ones are named, and what is named puts them right."""

import re
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.cli.verb import Reading
from avlmaps.cli.verbs import CONFIG
from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.wording import Spelling, asked_as, options_as
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.channels import level_faults
from avlmaps.recordings.conformance import example_truth, see
from avlmaps.recordings.consistency.agreement import NOTHING
from avlmaps.recordings.consistency.check import check_recording, pose_at
from avlmaps.recordings.consistency.edges import find_edges, shift_of
from avlmaps.recordings.consistency.flats import find_levels, offset_in_planes
from avlmaps.recordings.consistency.sample import Sample, choose_pairs, draw_sample
from avlmaps.recordings.consistency.single_frames import of_sound
from avlmaps.recordings.consistency.suspects import Suspect, Trials, cause_of, suspected_rig
from avlmaps.recordings.consistency.verdict import Grade, Reason, Verdict
from avlmaps.recordings.corrections import Corrections, PoseKind, opencv_from_axes
from avlmaps.recordings.memory import MemoryRecording, is_of_program
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Recording
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.outcomes import Judge, Outcome
from avlmaps_sim.bench.recordings.situations import situations

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # none reaches a user
CAMERA = Pinhole(48.0, 48.0, 32.0, 24.0, 64, 48)


@pytest.fixture(scope="module")
def right() -> Draft:
    return RoomWalk("room", seed=51, frames=30).draft(CAMERA)


def verdict(draft: Draft, folder: Path, given: Corrections | None = None) -> Verdict:
    path = folder / "walk"
    if not path.exists():
        draft.write(path)
    return check_recording(open_recording(path, corrections=given))


def options_in(sentence: str) -> Corrections:
    """Return what the options in a sentence say, read as the command line reads them."""
    import tyro

    words = re.search(r"build again with (--[^:]*?)(?:, (?:or|multiply|turn|write)|\.$|\. )", sentence + " ")
    assert words, sentence
    return tyro.cli(Reading, args=shlex.split(words[1]), config=CONFIG).corrections()


@pytest.mark.parametrize(
    "walk",
    [
        RoomWalk("people and noise", seed=53, frames=30, people=3, noise=0.0019),
        RoomWalk("a moved chair, holes", seed=54, frames=30, moved_chair=True, holes=0.3),
        RoomWalk("drift and flicker", seed=55, frames=30, drift=0.008, flicker=0.3),
        RoomWalk("slow", seed=56, frames=40, rate_hz=30.0, turn_rad_s=0.2),
    ],
    ids=lambda walk: walk.name,
)
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


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_the_remedy_that_is_named_puts_the_recording_right(name: str, right: Draft, tmp_path: Path) -> None:
    wrong = WRONG[name](right)
    with options_as(Spelling.FLAG):
        found = verdict(wrong, tmp_path)
    assert found.grade is not Grade.FINE
    geometry = next(f for f in found.findings if f.reason is Reason.GEOMETRY)
    again = verdict(wrong, tmp_path, options_in(geometry.remedy))
    assert again.grade is Grade.FINE, (geometry.remedy, again.sentences())


@pytest.mark.parametrize("late", [1, -2])
def test_depth_that_is_frames_late_is_said_to_be(late: int, right: Draft, tmp_path: Path) -> None:
    order = np.clip(np.arange(len(right)) - late, 0, len(right) - 1)
    said = " ".join(verdict(replace(right, depth=tuple(right.depth[i] for i in order)), tmp_path).sentences())
    assert f"epth pictures look {abs(late)} frame(s) {'late' if late > 0 else 'early'}" in said


def test_a_wrong_option_is_found_out(right: Draft, tmp_path: Path) -> None:
    found = verdict(right, tmp_path, Corrections(camera_axes="opengl", depth_unit_m=0.001))
    assert found.grade is Grade.IMPOSSIBLE
    assert "Corrections.camera_axes=opencv" in found.findings[0].remedy


MISTAKES = [
    ("colour mirrored", Reason.COLOUR),
    ("depth constant", Reason.DEPTH),
    ("depth of noise", Reason.DEPTH),
    ("colour 10 frames late", Reason.COLOUR),
    ("principal point at the corner", Reason.INTRINSICS),
    ("poses jump by 0.5 m", Reason.GEOMETRY),
    ("poses turn by 20 degrees", Reason.GEOMETRY),
    ("positions x0.5", Reason.GEOMETRY),
    ("two neighbours exchanged", Reason.GEOMETRY),
    ("principal point off by a sixteenth", Reason.GEOMETRY),
    ("half of the pictures BGR", Reason.COLOUR),
    ("all pictures BGR", Reason.COLOUR),
    ("colour camera 0.3 m beside", Reason.COLOUR),
    ("colour shifted by a sixteenth", Reason.COLOUR),
    ("poses jump by 2.5 m", Reason.MOTION),
    ("a third of the pictures black", Reason.COLOUR),
    ("camera tilted by 8 degrees in its mount", Reason.GEOMETRY),
    ("camera rolled by 8 degrees, the other way", Reason.GEOMETRY),
    ("cut to 16:9, with the old middle", Reason.GEOMETRY),
    ("depth in cm, of which 8 bits are stored", Reason.DEPTH),
    ("frames sorted as text", Reason.GEOMETRY),
    ("every second pose is the one before", Reason.GEOMETRY),
]


@pytest.mark.parametrize(
    ("name", "reason"),
    [pytest.param(*case, marks=pytest.mark.nightly) if row % 4 else case for row, case in enumerate(MISTAKES)],
)
def test_a_mistake_is_named(name: str, reason: Reason, right: Draft, tmp_path: Path) -> None:
    situation = next(one for one in situations() if one.name == name)
    found = verdict(situation.change(right, right, np.random.default_rng(0)), tmp_path)
    assert reason in {finding.reason for finding in found.findings}
    assert re.search(situation.cause, " ".join(found.sentences()))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("all poses the same", "All poses are the same"),
        ("depth cut off at 2 m", "exactly the largest one, 2 m"),
    ],
)
def test_its_very_cause_is_said(name: str, said: str, right: Draft, tmp_path: Path) -> None:
    situation = next(one for one in situations() if one.name == name)
    found = verdict(situation.change(right, right, np.random.default_rng(0)), tmp_path)
    assert said in " ".join(found.sentences())


@pytest.mark.parametrize(("seed", "late"), [(15, -3), (15, 0), (15, 3), (23, -3), (23, 0), (23, 3)])
@pytest.mark.nightly
def test_late_colour_shows_where_the_camera_turns_evenly(seed: int, late: int, tmp_path: Path) -> None:
    draft = RoomWalk("even", seed=seed, round_rad_s=0.0, even=True).draft()
    order = np.clip(np.arange(len(draft)) + late, 0, len(draft) - 1)
    found = verdict(replace(draft, rgb=tuple(draft.rgb[i] for i in order)), tmp_path)
    assert [one.reason for one in found.findings] == [Reason.COLOUR] * bool(late), found.sentences()
    assert all("do not lie on those of depth" in one for one in found.sentences())


def test_grey_pictures_have_no_order_of_channels(right: Draft, tmp_path: Path) -> None:
    grey = replace(
        right, rgb=tuple(np.repeat(c.mean(axis=2, keepdims=True), 3, axis=2).astype(np.uint8) for c in right.rgb)
    )
    found = verdict(grey, tmp_path)
    assert not found.sentences()
    assert any("order of the colour channels" in one for one in found.unchecked)


def test_rotations_and_positions_of_two_conventions_are_read_as_they_were() -> None:
    walk = example_truth(frames=16)
    frames = [
        Frame(i, f"{i:06d}", i / 10.0, walk.rgb[i], walk.depth_m[i], pose, walk.rig)
        for i, pose in enumerate(walk.world_from_camera)
    ]
    other, turned = walk.world_from_camera.copy(), walk.world_from_camera.copy()
    other[:, :3, 3] = other[:, [2, 0, 1], 3]
    turned[:, :3, :3] = np.swapaxes(turned[:, :3, :3], 1, 2)
    for written, suspect in ((other, Suspect(places=(2, 3, 1))), (turned, Suspect(turned_back=True))):
        read = [replace(frame, world_from_camera=pose) for frame, pose in zip(frames, written, strict=True)]
        recording = MemoryRecording(read)
        sample = draw_sample(recording)
        trial = Trials(sample, pose_at(recording, sample)).run(suspect)
        assert trial.agreement.same_share > 0.99
    words = cause_of(Suspect(places=(2, -3, 1)), walk.rig, 0.001, 2.0, "")
    assert "whose x, y, z they call y, -z, x: write rotations and positions in the axes of one world" in words


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
    inverted = Suspect(Corrections(poses=(PoseKind.CAMERA_FROM_WORLD,)), scale=0.001)
    said = cause_of(inverted, walk.rig, 1.0, 2000.0, "", of_program=True)
    assert "give frames with the inverse of each pose and depth_m times 0.001." in said
    with asked_as(Spelling.FLAG):  # of a live map that plays a recording
        assert not is_of_program(MemoryRecording(frames))


def test_one_frame_and_none_that_overlaps_say_nothing(right: Draft, tmp_path: Path) -> None:
    rows = np.array([0])
    one = replace(
        right, rgb=right.rgb[:1], depth=right.depth[:1], poses=right.poses[rows],
        stamps_s=right.stamps_s[rows], pose_stamps_s=right.pose_stamps_s[rows],
    )  # fmt: skip
    found = verdict(one, tmp_path)
    assert found.grade is Grade.UNCHECKED and found.pairs == 0 and np.isnan(found.agreeing)
    assert not found.sentences() and "there is one frame" in found.unchecked[0]


@pytest.mark.parametrize(("kept", "said"), [(12, "Only 40% of the frames have a pose"), (24, "")])
def test_a_drive_most_of_which_has_no_pose_is_doubted(kept: int, said: str, right: Draft, tmp_path: Path) -> None:
    found = verdict(replace(right, poses=right.poses[:kept], pose_stamps_s=right.pose_stamps_s[:kept]), tmp_path)
    assert (found.grade is Grade.SUSPICIOUS) == bool(said)
    assert [one.startswith(said) for one in found.sentences()] == [True] * bool(said)


def test_a_clock_that_is_set_back_in_the_middle_is_doubted(right: Draft, tmp_path: Path) -> None:
    stamps_s = right.stamps_s - np.where(np.arange(len(right.stamps_s)) < 16, 0.0, 40.0)
    found = verdict(replace(right, stamps_s=stamps_s, pose_stamps_s=stamps_s.copy(), poses=right.poses), tmp_path)
    assert found.sentences()[0].startswith("Only 53% of the frames have a pose on one clock")


LENGTHS = {
    "as long": (16_000, 1.0, 0.0, ""), "begins before, ends after": (16_000, 1.3, -2.0, ""),
    "twice the rate": (8_000, 2.0, 0.0, "16000 samples a second were called 8000"),
    "half the rate": (16_000, 0.5, 0.0, "8000 samples a second were called 16000"),
    "48 for 16 kHz": (16_000, 3.0, 0.05, "48000 samples a second were called 16000"),
    "44.1 for 48 kHz": (48_000, 44.1 / 48.0, 0.0, ""), "goes on": (16_000, 2.0, -8.0, ""),
    "two of fifteen": (16_000, 2.0 / 15.0, 3.0, "of the drive has sound"),
    "another clock": (16_000, 1.0, 500.0, "0% of the drive has sound"),
}  # fmt: skip


@pytest.mark.parametrize("case", LENGTHS)
def test_a_track_of_another_rate_or_clock_is_doubted(case: str, right: Draft, tmp_path: Path) -> None:
    rate_hz, longer, start_s, said = LENGTHS[case]
    right.write(tmp_path / "walk")
    recording = open_recording(tmp_path / "walk")
    recording.audio = AudioTrack(tmp_path / "sound.wav", rate_hz, longer * recording.duration_s, start_s)
    found = list(of_sound(recording))
    assert [said in str(one) and one.reason is Reason.SOUND for one in found] == [True] * bool(said)


@pytest.mark.parametrize(("gain", "doubted"), [(0.5, False), (1.0, False), (4.0, True)])
def test_a_clipped_track_is_doubted(gain: float, doubted: bool, right: Draft, tmp_path: Path) -> None:
    sound = np.sin(np.arange(round(16_000 * float(right.stamps_s[-1]))) * 0.2).astype(np.float32)
    sound[: len(sound) // 2] *= 0.1
    right.write(tmp_path / "walk")
    write_flac(tmp_path / "walk" / "audio.flac", Sound(np.clip(gain * sound, -1.0, 1.0), 16_000))
    found = check_recording(open_recording(tmp_path / "walk"))
    assert [one.reason for one in found.findings] == [Reason.SOUND] * doubted
    assert all("is clipped in" in one and "audio.flac" in one for one in found.sentences())


SILENCES = {
    "all of it": (lambda n: np.zeros(n), "is silent throughout: every sample is 0"),
    "another number": (lambda n: np.full(n, 0.25), "is silent throughout: every sample is 0.25"),
    "from the middle on": (lambda n: noise(n) * (np.arange(n) < 0.4 * n), "is silent in one piece from about"),
    "until the end": (lambda n: noise(n) * (np.arange(n) > 0.7 * n), "is silent in one piece from about 2 to"),
    "none": (lambda n: noise(n), ""),
    "quiet": (lambda n: np.round(3.0 * noise(n)) / 32768, ""),
    "a third": (lambda n: noise(n) * (np.arange(n) < 0.66 * n), ""),
    "one short sound": (lambda n: noise(n) * (np.abs(np.arange(n) - 0.53 * n) < 0.01 * n), ""),
    "sounds on silence": (lambda n: noise(n) * (np.arange(n) % (n // 4) < n // 16), ""),
    "sounds of a gate": (lambda n: noise(n) * (np.arange(n) < 0.4 * n) * (np.arange(n) % (n // 40) > n // 160), ""),
    "short, then nothing": (lambda n: noise(n)[: n // 10] * (np.arange(n // 10) < 0.04 * n), "is silent in one piece"),
}


def noise(count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(-0.5, 0.5, count)


@pytest.mark.parametrize("case", SILENCES)
def test_a_track_that_a_microphone_did_not_record_is_doubted(case: str, tmp_path: Path) -> None:
    make, said = SILENCES[case]
    write_flac(tmp_path / "sound.flac", Sound(make(200_000).astype(np.float32), 4_000))
    silent, clipped = level_faults(AudioTrack.open(tmp_path / "sound.flac", 2.0))
    assert [said in one for one in silent] == [True] * bool(said) and not clipped


@pytest.mark.parametrize(("turned", "doubted"), [(0.0, True), (0.9, False)])
def test_frames_whose_clock_skips_what_the_sound_does_not_are_doubted(
    turned: float, doubted: bool, right: Draft, tmp_path: Path
) -> None:
    right.write(tmp_path / "walk")
    recording = open_recording(tmp_path / "walk")
    recording.audio = AudioTrack(tmp_path / "sound.wav", 16_000, recording.duration_s, 0.0)
    assert not list(of_sound(recording))
    recording.stamps_s = recording.stamps_s + 40.0 * (np.arange(len(recording)) >= 20)
    cos, sin = np.cos(turned), np.sin(turned)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    recording.world_from_camera = recording.world_from_camera.copy()
    recording.world_from_camera[20:, :3, :3] = turn @ recording.world_from_camera[20:, :3, :3]
    found = [str(one) for one in of_sound(recording) if "The clock of the frames looks set there" in str(one)]
    assert len(found) == doubted and all("ends 40.0 s before the frames do" in one for one in found)
    recording.audio = replace(recording.audio, duration_s=recording.duration_s)  # the robot waited, and listened on
    assert not list(of_sound(recording))


def test_two_cameras_that_take_turns_are_compared_each_with_itself(tmp_path: Path) -> None:
    walk = RoomWalk("turns", seed=59, frames=24, turn_rad_s=0.5)
    ahead = walk.draft(CAMERA)
    beside = poses.from_quaternion(np.zeros((1, 3)), np.array([[0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]]))[0]
    pose = np.stack([one @ beside if i % 2 else one for i, one in enumerate(ahead.poses)])
    seen = [see(CAMERA, one) for one in pose]
    depth = tuple(np.rint(1000.0 * depth_m).astype(np.uint16) for _, depth_m in seen)
    found = verdict(replace(ahead, rgb=tuple(rgb for rgb, _ in seen), depth=depth, poses=pose), tmp_path)
    assert found.grade is Grade.FINE and found.pairs >= 8 and not found.sentences()


def test_frames_that_see_nothing_in_common_are_not_called_fine(tmp_path: Path) -> None:
    sparse = RoomWalk("keyframes", seed=52, frames=4, rate_hz=0.2, turn_rad_s=0.3).draft(CAMERA)
    found = verdict(sparse, tmp_path)
    assert found.grade is Grade.UNCHECKED and not found.sentences()
    assert "hardly any two frames see the same place" in found.unchecked[0]


SPOTS = {
    "stands and turns evenly": (RoomWalk("turn", seed=57, frames=30, round_rad_s=0.0, even=True),
                                {"twice as far", "clock of"}),
    "hardly moves": (RoomWalk("still", seed=58, frames=30, round_rad_s=0.02, turn_rad_s=0.02, noise=0.0019, even=True),
                     {"twice as far", "clock of", "focal"}),
    "mostly turns": (RoomWalk("walk", seed=51, frames=30), {"15% or 0.3 m too large"}),
    "walks": (RoomWalk("turn", seed=57, frames=30, round_rad_s=0.5), set[str]()),
}  # fmt: skip


@pytest.mark.parametrize("name", SPOTS)
def test_what_would_not_show_is_said(name: str, tmp_path: Path) -> None:
    walk, spots = SPOTS[name]
    found = verdict(walk.draft(CAMERA), tmp_path)
    assert found.grade is Grade.FINE and not found.sentences()
    said = " ".join(found.unchecked)
    every = ("twice as far", "15% or 0.3 m too large", "clock of", "focal", "the ray")
    assert {spot for spot in every if spot in said} == spots


@pytest.mark.parametrize(
    ("round_rad_s", "times", "farther_m", "said"),
    [
        (0.5, 1.15, 0.0, "The depth looks 1.15 times too large, or the positions 1.15 times too small"),
        (0.5, 0.87, 0.0, "The depth looks 1.15 times too small, or the positions 1.15 times too large"),
        (0.0, 1.0, 0.3, "The depth looks 0.3 m too large everywhere: write the depth from the camera's centre (-0.3"),
    ],
)
def test_depth_that_is_a_little_off_is_named(
    round_rad_s: float, times: float, farther_m: float, said: str, tmp_path: Path
) -> None:
    walk = RoomWalk("turn", seed=57, frames=30, round_rad_s=round_rad_s).draft(CAMERA)
    farther = farther_m * walk.units_per_m
    depth = tuple(np.where(one > 0, one * times + farther, 0).astype(one.dtype) for one in walk.depth)
    found = verdict(replace(walk, depth=depth), tmp_path)
    assert found.grade is Grade.SUSPICIOUS and said in " ".join(found.sentences())


@pytest.mark.parametrize(("level", "is_dark"), [(15, True), (30, False)])
def test_dark_pictures_are_doubted(level: int, is_dark: bool, right: Draft, tmp_path: Path) -> None:
    share = level / float(np.median(np.stack(right.rgb)))
    dark = replace(right, rgb=tuple((rgb * share).round().astype(np.uint8) for rgb in right.rgb))
    said = " ".join(verdict(dark, tmp_path).sentences())
    assert ("The colour pictures are dark: the middle brightness is" in said) == is_dark


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    wide = Pinhole(96.0, 96.0, 64.0, 48.0, 128, 96)
    walk = RoomWalk("edges", seed=59, frames=20, people=2).draft(wide)
    return draw_sample(open_recording(walk.write(tmp_path_factory.mktemp("edges") / "walk")))


@given(st.integers(-16, 16), st.integers(-16, 16))
def test_edges_of_colour_are_found_where_they_were_moved_to(drawn: Sample, x: int, y: int) -> None:
    moved = replace(drawn, grey=np.roll(drawn.grey, (y, x), axis=(1, 2)))
    found = shift_of(find_edges(moved), moved)
    if np.hypot(x, y) <= 1.0:
        assert found is None
    elif np.hypot(x, y) >= 8.0:
        assert found is not None
        assert np.hypot(found.columns * 128 - x, found.rows * 128 - y) <= 3.0


@pytest.fixture(scope="module")
def turning(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    walk = RoomWalk("right round", seed=59, frames=24, rate_hz=2.5, noise=0.0019).draft(
        Pinhole(96.0, 96.0, 64.0, 48.0, 128, 96)
    )
    return draw_sample(open_recording(walk.write(tmp_path_factory.mktemp("turning") / "walk")))


@pytest.mark.parametrize(("axis", "degrees"), [(0, 6.0), (0, -6.0), (2, 6.0), (2, -6.0), (0, 14.0)])
def test_floors_show_how_a_camera_sits_in_its_mount(turning: Sample, axis: int, degrees: float) -> None:
    half = np.radians(degrees) / 2.0
    off = poses.from_quaternion(np.zeros((1, 3)), np.array([[*(np.sin(half) * np.eye(3)[axis]), np.cos(half)]]))[0]
    found = find_levels(replace(turning, world_from_camera=turning.world_from_camera @ off)).tilt
    assert found is not None and found.left_deg < 1.5 < found.off_deg
    expected = (degrees, 0.0) if axis == 0 else (0.0, -degrees)
    assert (found.down_deg, found.right_deg) == pytest.approx(expected, abs=1.5)


@pytest.mark.parametrize("degrees", [0.0, 5.0, 12.0])
def test_a_slope_is_no_tilt_of_the_camera(turning: Sample, degrees: float) -> None:
    half = np.radians(degrees) / 2.0
    slope = poses.from_quaternion(np.zeros((1, 3)), np.array([[np.sin(half), 0.0, 0.0, np.cos(half)]]))[0]
    levels = find_levels(replace(turning, world_from_camera=slope @ turning.world_from_camera))
    assert levels.tilt is None and levels.would_show


@pytest.mark.parametrize("count", [2, 3, 7, 200, 5000])
def test_pairs_are_of_the_recording_in_the_order_of_time(count: int) -> None:
    pose = np.tile(np.eye(4), (count, 1, 1))
    pose[:, 0, 3] = np.linspace(0.0, 0.05 * count, count)
    pairs, follows = choose_pairs(pose)
    assert len(pairs) == len(follows) and 1 <= len(pairs) <= 60
    assert (pairs[:, 0] < pairs[:, 1]).all() and pairs.min() >= 0 and pairs.max() < count
    assert len({tuple(pair) for pair in pairs.tolist()}) == len(pairs)


@pytest.mark.nightly
def test_the_bench_knows_a_right_map_from_a_wrong_one(right: Draft) -> None:
    """A world that is turned and moved holds the same map; colours of other frames do not."""
    judge = Judge(right)
    turn = poses.from_quaternion(np.array([[3.0, -1.0, 2.0]]), np.array([[0.1, 0.2, 0.3, 0.9]]))[0]
    moved = next(one for one in situations() if one.name == "OpenGL camera in a y-up world")
    same = replace(moved, change=lambda d, o, g: replace(d, poses=turn @ d.poses))
    outcomes = [case.outcome for one in (same, moved) if (case := judge.judge(one, right, 0))]
    assert outcomes == [Outcome.RIGHT, Outcome.REFUSED]


@pytest.mark.parametrize(
    ("degrees", "by_m", "said"),
    [(0, 0.0, ""), (0, 0.8, "origins|jump"), (90, 0.0, "origins|do not agree"), (180, 0.0, "origins|do not agree")],
)
@pytest.mark.nightly
def test_a_second_part_with_another_origin_is_doubted(
    degrees: int, by_m: float, said: str, right: Draft, tmp_path: Path
) -> None:
    right.write(tmp_path / "walk")
    recording = open_recording(tmp_path / "walk")
    middle, turn = recording.world_from_camera[:, :3, 3].mean(axis=0), np.eye(4)
    turn[:2, :2] = np.round([[np.cos(a := np.radians(degrees)), -np.sin(a)], [np.sin(a), np.cos(a)]])
    turn[:3, 3] = middle - turn[:3, :3] @ middle + (by_m, by_m, 0.0)
    sentences = check_recording(_parted(recording, turn)).sentences()
    assert any(re.search(said, one) for one in sentences) if said else not sentences


def test_a_second_part_that_sees_nothing_of_the_first_is_said_to_be_unchecked(right: Draft, tmp_path: Path) -> None:
    right.write(tmp_path / "walk")
    away = np.eye(4)
    away[0, 3] = 40.0
    found = check_recording(_parted(open_recording(tmp_path / "walk"), away))
    assert any("one origin before and after the gap of 600 s between 000014 and 000015" in it for it in found.unchecked)


def _parted(recording: Recording, moved: np.ndarray) -> Recording:
    """Return a recording whose second half begins ten minutes later, elsewhere."""
    late = [
        replace(frame, stamp_s=frame.stamp_s + 600.0, world_from_camera=moved @ frame.world_from_camera)
        for frame in recording
    ]
    return MemoryRecording([*list(recording)[:15], *late[15:]])


def test_intrinsics_that_fit_already_are_no_cause() -> None:
    rig = Rig(CAMERA, CAMERA)
    assert suspected_rig(rig, Suspect(centred=True)) is None
    assert suspected_rig(rig, Suspect(focal=1.25)) is not None


@pytest.mark.parametrize("added_m", [0.0, 0.15, -0.15, 0.4])
def test_flat_surfaces_show_what_is_added_to_all_depths(added_m: float) -> None:
    rng, rays = np.random.default_rng(7), Pinhole(120.0, 110.0, 60.0, 50.0, 128, 96).rays()
    floors = [1.2 / (rays @ normal) for normal in ([0.1, 0.7, 0.5], [-0.5, 0.4, 0.6], [0.3, -0.6, 0.5])]
    depth_m = np.stack([np.where((z > 0.3) & (z < 6.0), z + added_m, 0.0) for z in floors]).astype(np.float32)
    assert offset_in_planes(depth_m) == pytest.approx(added_m, rel=0.2, abs=0.01)
    noisy = depth_m + (rng.normal(0.0, 0.0008, depth_m.shape) * depth_m**2).astype(np.float32)
    assert offset_in_planes(noisy) == pytest.approx(added_m, rel=0.2, abs=0.02)
    assert np.isnan(offset_in_planes(np.full((3, 96, 128), 2.0 + added_m, np.float32)))  # seen face on


@pytest.mark.parametrize(("added_m", "said"), [(0.15, "m too large everywhere"), (-0.15, "m too small everywhere")])
def test_depths_that_are_off_by_one_length_are_doubted(added_m: float, said: str, right: Draft, tmp_path: Path) -> None:
    depth = tuple(np.where(z > 0, z + 1000.0 * added_m, 0.0).astype(z.dtype) for z in right.depth)
    (sentence,) = verdict(replace(right, depth=depth), tmp_path).sentences()
    assert said in sentence and ("Flat surfaces are curved" in sentence) == (added_m > 0.0)  # else frames alone show it


def test_a_comparison_of_too_few_points_has_no_difference_and_no_warning() -> None:
    assert np.isnan(replace(NOTHING, off=np.array([np.nan, np.nan])).median_off) and np.isnan(NOTHING.median_off)
    assert replace(NOTHING, off=np.array([0.25, np.nan, 0.75])).median_off == 0.5
