"""A recording against itself: right ones pass, wrong ones are named, and what is named puts them right."""

import re
import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.cli.verb import Reading as GivenReading
from avlmaps.cli.verbs import CONFIG
from avlmaps.core import poses
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.wording import Spelling, asked_as, options_as
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps.recordings.channels import level_faults
from avlmaps.recordings.conformance import example_truth, see
from avlmaps.recordings.consistency.agreement import choose_pairs
from avlmaps.recordings.consistency.check import Grade, Reason, Verdict, check_recording
from avlmaps.recordings.consistency.readings import Reading, rig_of
from avlmaps.recordings.consistency.suspicions import examine_recording
from avlmaps.recordings.corrections import Corrections, opencv_from_axes
from avlmaps.recordings.memory import MemoryRecording, is_of_program
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from avlmaps_sim.bench.recordings.outcomes import Judge, Outcome
from avlmaps_sim.bench.recordings.situations import situations

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")  # none reaches a user
CAMERA = Pinhole(48.0, 48.0, 32.0, 24.0, 64, 48)
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


@pytest.mark.few(2)
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
    ("all pictures BGR", Reason.COLOUR, ""),
    ("poses jump by 2.5 m", Reason.MOTION, ""),
    ("a third of the pictures black", Reason.COLOUR, ""),
    ("frames sorted as text", Reason.GEOMETRY, ""),
    ("every second pose is the one before", Reason.GEOMETRY, ""),
    ("all poses the same", Reason.GEOMETRY, "All poses are the same"),
    ("half of the pictures BGR", Reason.COLOUR, ""),
    ("colour camera 0.15 m above", Reason.COLOUR, ""),
    ("colour is a drawing of the depth", Reason.COLOUR, "drawings of the depth"),
    ("depth in cm, of which 8 bits are stored", Reason.DEPTH, ""),
    ("camera rolled by 8 degrees, the other way", Reason.GEOMETRY, ""),
    ("lenses as they are, by a pinhole's numbers", Reason.GEOMETRY, "wide lens"),
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
    ("few poses", posed(12), "Only 40% of the frames have a pose"),
    ("enough poses", posed(24), "^$"),
    ("poses froze", frozen_poses, "pose is the same although|do not agree|far off"),
]


@pytest.mark.few(2)
@pytest.mark.parametrize(("name", "change", "said"), OTHERS)
def test_what_field_recordings_have_is_said(
    name: str, change: Callable[[Draft], Draft], said: str, right: Draft, tmp_path: Path
) -> None:
    sentences = " ".join(verdict(change(right), tmp_path).sentences())
    assert re.search(said, sentences), sentences


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("round_rad_s", "times", "said"),
    [
        (0.5, 1.15, "The depth looks 1.15 times too large, or the positions 1.15 times too small"),
        (0.5, 0.87, "The depth looks 1.15 times too small, or the positions 1.15 times too large"),
    ],
)  # fmt: skip
def test_depth_that_is_a_little_off_is_named(round_rad_s: float, times: float, said: str, tmp_path: Path) -> None:
    walk = RoomWalk("turn", seed=57, frames=30, round_rad_s=round_rad_s).draft(CAMERA)
    found = verdict(with_depth(lambda z: z * times)(walk), tmp_path)
    assert found.grade is Grade.SUSPICIOUS and said in " ".join(found.sentences())


def test_a_program_is_told_what_to_give_instead() -> None:
    walk, opengl = example_truth(frames=16), np.diag([1.0, -1.0, -1.0, 1.0])
    frames = [
        Frame(i, f"{i:06d}", i / 10.0, walk.rgb[i], walk.depth_m[i], pose @ opengl, walk.rig)
        for i, pose in enumerate(walk.world_from_camera)
    ]
    said = " ".join(check_recording(MemoryRecording(frames)).sentences())
    assert "an OpenGL camera" in said and "give frames with world_from_camera of an OpenCV camera" in said
    assert "Corrections" not in said
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
                                {"twice as far", "15% too large", "clock of"}),
    "hardly moves": (RoomWalk("still", seed=58, frames=30, round_rad_s=0.02, turn_rad_s=0.02, noise=0.0019, even=True),
                     {"twice as far", "15% too large", "clock of", "focal"}),
    "mostly turns": (RoomWalk("walk", seed=51, frames=30), {"15% too large"}),
    "walks": (RoomWalk("turn", seed=57, frames=30, round_rad_s=0.5), set[str]()),
}  # fmt: skip


@pytest.mark.few(2)
@pytest.mark.parametrize("name", SPOTS)
def test_what_would_not_show_is_said(name: str, tmp_path: Path) -> None:
    walk, spots = SPOTS[name]
    found = verdict(walk.draft(CAMERA), tmp_path)
    assert found.grade is (Grade.UNCHECKED if name == "keyframes" else Grade.FINE) and not found.sentences()
    every = ("hardly any two frames", "twice as far", "15% too large", "clock of", "focal", "along the ray")
    assert {spot for spot in every if spot in " ".join(found.unchecked)} == spots


# Sound

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


@pytest.mark.parametrize("count", [2, 7, 5000])
def test_pairs_are_of_the_recording_in_the_order_of_time(count: int) -> None:
    pose = np.tile(np.eye(4), (count, 1, 1))
    pose[:, 0, 3] = np.linspace(0.0, 0.05 * count, count)
    pairs, follows = choose_pairs(pose)
    assert len(pairs) == len(follows) and 1 <= len(pairs) <= 60
    assert (pairs[:, 0] < pairs[:, 1]).all() and pairs.min() >= 0 and pairs.max() < count


@pytest.mark.nightly
def test_the_bench_knows_a_right_map_from_a_wrong_one(right: Draft) -> None:
    """A world that is turned and moved holds the same map; colours of other frames do not."""
    judge = Judge(right)
    turn = poses.from_quaternion(np.array([[3.0, -1.0, 2.0]]), np.array([[0.1, 0.2, 0.3, 0.9]]))[0]
    moved = EVERY["OpenGL camera in a y-up world"]
    same = replace(moved, change=lambda d, o, g: replace(d, poses=turn @ d.poses))
    outcomes = [case.outcome for one in (same, moved) if (case := judge.judge(one, right, 0))]
    assert outcomes == [Outcome.RIGHT, Outcome.REFUSED]
