"""Messages of a robot become frames: of one moment, with the pose of that moment; else they are left out, and why."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

sys.path.insert(0, str(Path(__file__).parents[3] / "tests/live"))

from live_frames import ENCODERS, UP, frame

from avlmaps.core.errors import BackendError, RecordingError
from avlmaps.live.live_map import LiveMap
from avlmaps.live.status import LiveSettings
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.channels import ChannelSound
from avlmaps.recordings.formats.ros_messages import RosTopics
from avlmaps.recordings.formats.ros_sound import Pcm
from avlmaps.recordings.microphones import Microphones
from avlmaps_ros.live.frames import PARTNER_WITHIN_S, POSE_WITHIN_S, RosFrames
from avlmaps_ros.live.sound import HELD, RosDirections, RosSound
from avlmaps_ros.live.source import follow_ros2, open_ros2, ros_topics
from helpers import ros_messages as ros

START_S = 1_700_000_000.0


class Robot:
    """Gives messages to what puts frames together."""

    def __init__(self, told: Callable[[str], None] = lambda _: None, knows: bool = True) -> None:
        self.frames, self.now_s = RosFrames({"rgb": "/rgb", "depth": "/depth"}, told), 100.0
        if knows:
            self.give("tf_static", ros.mount())
            for kind in ("rgb_info", "depth_info"):
                self.give(kind, ros.camera_info(frame(0).rig.rgb))

    def give(self, kind, message) -> None:
        self.frames.take(kind, message, self.now_s)

    def see(self, number: int, off_s: float = 0.0, **kinds) -> None:
        one, stamp_s = frame(number), START_S + 0.1 * number
        self.give("rgb", kinds.get("rgb", ros.colour)(one, stamp_s + off_s))
        self.give("depth", kinds.get("depth", ros.depth)(one, stamp_s))

    def be(self, number: int, parent: str = "odom") -> None:
        self.give("tf", ros.moved(frame(number).world_from_camera, START_S + 0.1 * number, parent))

    def wait(self, seconds: float):
        self.now_s += seconds
        return self.frames.ready(self.now_s)


@pytest.mark.parametrize("packed", [False, True])
def test_pictures_and_transforms_become_frames_of_a_recording(packed: bool) -> None:
    robot = Robot()
    kinds = {"rgb": ros.compressed_colour, "depth": ros.compressed_depth} if packed else {}
    for number in range(6):
        robot.be(number)
        robot.see(number, **kinds)
    found = robot.wait(0.2)
    assert len(found) == 6
    for number, one in enumerate(found):
        wanted = frame(number)
        np.testing.assert_array_equal(one.rgb, wanted.rgb)
        np.testing.assert_allclose(one.depth_m, wanted.depth_m, atol=6e-4)
        np.testing.assert_allclose(one.world_from_camera, wanted.world_from_camera, atol=1e-6)
        assert one.stamp_s == pytest.approx(START_S + 0.1 * number, abs=1e-6)
        assert one.rig.depth == wanted.rig.depth


def moved_at(one, stamp_s: float):
    return ros.moved(one.world_from_camera, stamp_s)


@given(st.integers(0, 10_000))
def test_frames_come_once_and_in_order_however_messages_are_mixed(seed: int) -> None:
    rng, robot = np.random.default_rng(seed), Robot()
    events = [(kind, number) for number in range(8) for kind in ("tf", "rgb", "depth")]
    late = {"tf": 0.08, "rgb": 0.15, "depth": 0.15}  # of one kind the order stays
    events.sort(key=lambda event: 0.1 * event[1] + rng.uniform(0.0, late[event[0]] / 2))
    seen: dict[str, int] = {}
    found = []
    for kind, number in events:
        if number < seen.get(kind, -1):
            continue
        seen[kind] = number
        one, stamp_s = frame(number), START_S + 0.1 * number
        made = {"tf": moved_at, "rgb": ros.colour, "depth": ros.depth}[kind]
        robot.give(kind, made(one, stamp_s))
        found += robot.wait(0.03)
    found += robot.wait(PARTNER_WITHIN_S + 0.01)
    found += robot.wait(POSE_WITHIN_S + 0.01)
    stamps = [one.stamp_s for one in found]
    assert stamps == sorted(set(stamps))
    for one in found:
        wanted = frame(round((one.stamp_s - START_S) / 0.1))
        np.testing.assert_array_equal(one.rgb, wanted.rgb)
        np.testing.assert_allclose(one.world_from_camera, wanted.world_from_camera, atol=1e-6)
    assert len(found) + robot.frames.unpaired + robot.frames.unplaced == 8


def test_a_pose_between_two_transforms_lies_between_them() -> None:
    robot = Robot()
    for number in (0, 2):
        robot.be(number)
    robot.see(1)
    (one,) = robot.wait(0.0)
    middle = 0.5 * (frame(0).world_from_camera[:3, 3] + frame(2).world_from_camera[:3, 3])
    np.testing.assert_allclose(one.world_from_camera[:3, 3], middle, atol=0.02)


def test_the_world_stays_when_a_map_comes_above_odometry() -> None:
    robot = Robot()
    for number in range(2):
        robot.be(number)
        robot.see(number)
    before = robot.wait(0.2)
    off = np.eye(4)
    off[:3, 3] = 5.0, 0.0, 0.0
    robot.give("tf", ros.tf(ros.transform("map", "odom", off, START_S + 0.2)))
    for number in range(2, 4):
        robot.be(number)
        robot.see(number)
    after = robot.wait(0.2)
    assert (len(before), len(after)) == (2, 2)
    np.testing.assert_allclose(after[1].world_from_camera, frame(3).world_from_camera, atol=1e-6)


def test_a_robot_without_transforms_moves_by_odometry() -> None:
    robot = Robot(knows=False)
    robot.give("tf_static", ros.mount())
    robot.give("rgb_info", ros.camera_info(frame(0).rig.rgb))
    one = frame(3)
    body = one.world_from_camera @ np.linalg.inv(ros.BODY_FROM_CAMERA)
    moved = ros.transform("odom", "base_link", body, START_S + 0.3)
    at = SimpleNamespace(position=moved.transform.translation, orientation=moved.transform.rotation)
    robot.see(3)
    robot.give("pose", SimpleNamespace(header=moved.header, child_frame_id="base_link", pose=SimpleNamespace(pose=at)))
    assert robot.wait(0.1) == []  # the depth's own calibration may yet come
    robot.now_s += 3.0
    robot.see(4)
    robot.give("pose", SimpleNamespace(header=ros.header(START_S + 0.4, "odom"), child_frame_id="base_link",
                                       pose=SimpleNamespace(pose=at)))  # fmt: skip
    assert len(robot.wait(0.0)) == 2


LEFT_OUT = {
    "no transform": (lambda robot: robot.see(0), "nothing moves the camera 'camera'"),
    "another clock": (
        lambda robot: (robot.give("tf", ros.moved(np.eye(4), 5.0)), robot.see(0)), "check that both have one clock",
    ),
    "another clock, later": (
        lambda robot: (robot.give("tf", ros.moved(np.eye(4), START_S - 7.25)), robot.see(0)),
        "7.250 s after the last pose",
    ),
    "an encoding": (
        lambda robot: (robot.be(0), robot.see(0, rgb=lambda f, s: ros.colour(f, s, "nv21"))),
        "the encoding 'nv21'",
    ),
    "another size": (
        lambda robot: (
            robot.give("rgb_info", ros.camera_info(frame(0).rig.rgb.resized(64, 48))), robot.be(0), robot.see(0)
        ),
        "their calibration says 64x48",
    ),
    "no stamps": (
        lambda robot: robot.give("rgb", ros.colour(frame(0), 0.0)), "have no stamps",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", LEFT_OUT)
def test_what_cannot_be_a_frame_is_left_out_with_a_reason_once(case: str) -> None:
    told: list[str] = []
    happens, said = LEFT_OUT[case]
    robot = Robot(told.append)
    for _ in range(2):
        happens(robot)
        assert robot.wait(POSE_WITHIN_S + 0.1) == []
    assert len(told) == 1 and said in told[0]


def test_pictures_of_two_moments_are_no_frame() -> None:
    robot = Robot()
    for number in range(3):
        robot.be(number)
        robot.see(number, off_s=0.055)
    assert len(robot.wait(PARTNER_WITHIN_S + 0.1)) <= 2  # the last colour picture is 45 ms before the next depth
    assert robot.frames.unpaired >= 1
    assert "no colour picture has come" in RosFrames({"rgb": "/rgb", "depth": "/depth"}, print).missing()


@pytest.mark.parametrize("off_s", [0.25, -3600.0])
def test_pictures_of_two_clocks_are_said_to_differ_and_by_how_much(off_s: float) -> None:
    robot = Robot()
    robot.be(0)
    robot.see(0, off_s=off_s)
    assert robot.wait(PARTNER_WITHIN_S + 0.1) == []
    robot.frames.ready(robot.now_s)
    said = robot.frames.missing()
    assert "no depth picture" not in said
    assert f"the last of colour is {abs(off_s):.3f} s {'after' if off_s > 0 else 'before'} the last of depth" in said


MISSING = {
    "colour": (lambda robot: robot.give("depth", ros.depth(frame(0), START_S)), "no colour picture has come on /rgb"),
    "depth": (lambda robot: robot.give("rgb", ros.colour(frame(0), START_S)), "no depth picture has come on /depth"),
    "stamps": (lambda robot: robot.see(0, depth=lambda one, _: ros.depth(one, 0.0)), "on /depth have no stamps"),
    "encoding": (
        lambda robot: (robot.be(0), robot.see(0, rgb=lambda f, s: ros.colour(f, s, "nv21"))), "none of 1 frames can",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MISSING)
def test_the_stream_that_is_missing_is_named(case: str) -> None:
    happens, said = MISSING[case]
    robot = Robot()
    happens(robot)
    robot.wait(PARTNER_WITHIN_S + 0.1)
    assert said in robot.frames.missing()


def test_calibration_that_has_not_come_is_not_taken_for_a_missing_pose() -> None:
    told: list[str] = []
    robot = Robot(told.append, knows=False)
    robot.give("rgb_info", ros.camera_info(frame(0).rig.rgb))
    robot.give("tf_static", ros.mount())
    robot.be(0)
    robot.see(0)
    robot.wait(0.0)
    assert robot.wait(POSE_WITHIN_S + 0.1) == []
    assert told == ["note: Frames are left out: no CameraInfo has come beside /depth yet."]


def test_what_robots_say_of_sound_is_read() -> None:
    samples = np.array([[0, 16384], [-16384, 0]], "<i2")
    data = SimpleNamespace(data=np.frombuffer(samples.tobytes(), np.uint8))
    told: list[str] = []
    sound = RosSound("/audio", told.append, Pcm(16_000, 2))
    assert sound.take(data, None, 10.0) is None  # no picture says by which clock
    heard, begin_s = sound.take(data, START_S, 10.0) or (None, 0.0)
    assert heard is not None and begin_s == pytest.approx(START_S + 10.0 - 2 / 16_000)
    np.testing.assert_allclose(heard.samples, [0.25, -0.25])
    _, again_s = sound.take(data, START_S, 10.02) or (None, 0.0)
    assert again_s == pytest.approx(begin_s + 2 / 16_000)  # right after the one before
    sound.inform(audio_info("mp3"))  # pcm was given
    assert sound.take(data, START_S, 10.1) is not None
    assert (sound.unheard, told) == (1, [])  # the one before the first picture


def test_every_channel_is_heard_where_its_microphones_are_described() -> None:
    samples = np.array([[0, 16384], [-16384, 0]], "<i2")
    data = SimpleNamespace(data=np.frombuffer(samples.tobytes(), np.uint8))
    told: list[str] = []
    two, four = (Microphones(0.1 * np.eye(4, 3)[:count]) for count in (2, 4))
    heard, _ = RosSound("/audio", told.append, Pcm(16_000, 2), two).take(data, START_S, 10.0) or (None, 0.0)
    assert isinstance(heard, ChannelSound) and not told
    np.testing.assert_allclose(heard.samples, [[0.0, -0.5], [0.5, 0.0]])
    one = Microphones(np.zeros((1, 3)), channels=(1,))
    second = RosSound("/audio", told.append, Pcm(16_000, 2), one).take(data, START_S, 10.0)
    assert second is not None and np.array_equal(second[0].samples, heard.samples[1:])
    sound = RosSound("/audio", told.append, Pcm(16_000, 2), four)
    for _ in range(3):
        heard, _ = sound.take(data, START_S, 10.0) or (None, 0.0)
        assert isinstance(heard, Sound) and len(heard.samples) == 2
    assert len(told) == 1 and "2 channel(s), but 4 microphone(s) are described" in told[0]


@given(
    st.lists(st.floats(-180.0, 360.0), min_size=1, max_size=2 * HELD), st.sampled_from(["whole", "degrees", "radians"])
)
def test_directions_are_in_radians_and_none_is_lost_whichever_the_device_says(azimuths: list[float], unit: str) -> None:
    degrees = [float(round(value)) for value in azimuths] if unit == "whole" else azimuths
    assume(unit != "degrees" or max(map(abs, degrees[:HELD])) > 7.0)
    said = [int(v) if unit == "whole" else np.deg2rad(v) if unit == "radians" else v for v in degrees]
    told: list[str] = []
    device = RosDirections("/doa", told.append)
    assert device.take(SimpleNamespace(data=said[0]), None, 9.0) == [] and device.unread == 1
    found = [
        one
        for number, value in enumerate(said)
        for one in device.take(SimpleNamespace(data=value), START_S, 10.0 + 0.1 * number)
    ]
    found += device.rest()
    np.testing.assert_allclose([stamp for stamp, _ in found], START_S + 10.0 + 0.1 * np.arange(len(said)), atol=1e-6)
    off = np.angle(np.exp(1j * (np.array([azimuth for _, azimuth in found]) - np.deg2rad(degrees))))
    np.testing.assert_allclose(off, 0.0, atol=1e-9)
    assert told == ([] if unit == "radians" else ["note: The directions of /doa are taken as degrees."])


def audio_info(coding: str = "wave", rate_hz: int = 16_000) -> SimpleNamespace:
    return SimpleNamespace(coding_format=coding, sample_format="", sample_rate=rate_hz, channels=1)


def audio_data(count: int = 1600) -> SimpleNamespace:
    return SimpleNamespace(data=np.zeros(2 * count, np.uint8))


def test_sound_is_heard_from_when_its_rate_is_known_and_what_came_before_is_counted() -> None:
    told: list[str] = []
    sound = RosSound("/audio", told.append)
    for tenth in range(30):
        assert sound.take(audio_data(), START_S, 10.0 + 0.1 * tenth) is None
    assert len(told) == 1 and "audio_pcm=16000,1" in told[0]
    sound.inform(audio_info("mp3"))
    assert sound.take(audio_data(), START_S, 13.0) is None
    assert len(told) == 2 and "is coded as 'mp3'" in told[1]
    for _ in range(2):  # a latched one may come again
        sound.inform(audio_info())
    assert told[2:] == [
        "note: The sound on /audio is used from now on: 16000 samples a second, 1 channel(s); 31 messages before "
        "could not be used."
    ]
    heard, begin_s = sound.take(audio_data(), START_S, 13.1) or (None, 0.0)
    assert heard is not None and heard.rate_hz == 16_000
    assert begin_s == pytest.approx(START_S + 13.0)
    assert sound.unheard == 31


@given(st.lists(st.sampled_from(["sound", "wave", "mp3", "9 Hz"]), max_size=20))
def test_each_message_of_sound_is_heard_or_counted(events: list[str]) -> None:
    sound, given_, heard = RosSound("/audio", lambda _: None), 0, 0
    for number, event in enumerate(events):
        if event == "sound":
            given_ += 1
            heard += sound.take(audio_data(), START_S, 10.0 + number) is not None
        else:
            sound.inform(audio_info("wave" if event == "9 Hz" else event, 9 if event == "9 Hz" else 16_000))
    assert heard + sound.unheard == given_
    last = [event for event in events if event != "sound"][-1:]
    assert (sound.take(audio_data(), START_S, 99.0) is not None) == (last == ["wave"])


class Played:
    """What a network gave, at once."""

    def __init__(self, messages: list, chosen: dict[str, str] | None = None) -> None:
        self.chosen = {"rgb": "/rgb", "depth": "/depth"} if chosen is None else chosen
        self.fault, self.described, self._messages = "", "The network has nothing", messages

    def __enter__(self) -> "Played":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def take(self, wait_s: float) -> list:
        some, self._messages = self._messages[:6], self._messages[6:]
        return some


def messages(count: int, sound: bool = False) -> list:
    rig = frame(0).rig
    every = [("tf_static", ros.mount()), ("rgb_info", ros.camera_info(rig.rgb)),
             ("depth_info", ros.camera_info(rig.depth))]  # fmt: skip
    for number in range(count):
        one, stamp_s = frame(number), START_S + 0.1 * number
        every += [("tf", ros.moved(one.world_from_camera, stamp_s)), ("rgb", ros.colour(one, stamp_s)),
                  ("depth", ros.depth(one, stamp_s))]  # fmt: skip
        if sound:  # how it is coded is known after the sixth piece
            every += [("audio_info", audio_info())] if number == 6 else []
            every += [("audio", SimpleNamespace(header=ros.header(stamp_s, "ear"), audio=audio_data()))]
    return [(kind, message, 100.0) for kind, message in every]


def test_a_robot_is_mapped_and_what_never_arrived_is_told(tmp_path: Path) -> None:
    told: list[str] = []
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=replace(LiveSettings(gates=False), most_waiting=50))
    with live:
        every = messages(18)
        del every[3 + 3 * 10 : 3 + 3 * 13]  # three frames, with their transforms
        follow_ros2(live, RosTopics(), Played(every), 1.0, told.append)
    status = live.status()
    assert status.frames_in == status.fused == 15
    assert not status.dropped
    assert any("note: 3 of about 18 frames never arrived" in said for said in told)
    assert any("Mapping from ROS 2: rgb /rgb, depth /depth" in said for said in told)
    assert live.map.data.info.counts.voxels > 100


def test_a_live_map_hears_when_its_coding_is_known_after_its_sound(tmp_path: Path) -> None:
    told: list[str] = []
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=replace(LiveSettings(gates=False), most_waiting=50))
    with live, pytest.MonkeyPatch.context() as patch:
        heard: list[float] = []
        patch.setattr(live, "add_audio", lambda chunk, stamp_s: heard.append(stamp_s))
        follow_ros2(live, RosTopics(), Played(messages(12, sound=True)), 1.0, told.append)
    np.testing.assert_allclose(heard, START_S + 0.1 * np.arange(6, 12))
    assert any("used from now on" in said for said in told)
    assert "note: 6 messages of sound could not be used and are left out." in told


def test_a_live_map_takes_directions_of_a_topic_and_says_what_is_no_direction(tmp_path: Path) -> None:
    told: list[str] = []
    every = messages(12)
    for number, value in enumerate([10, 20, float("nan"), 200]):
        every.insert(30 + number, ("directions", SimpleNamespace(data=value), 100.0 + 0.1 * number))
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=replace(LiveSettings(gates=False), most_waiting=50))
    with live, pytest.MonkeyPatch.context() as patch:
        said: list[tuple[float, float]] = []
        plain = live.add_directions

        def add(stamp_s: float, azimuth_rad: float) -> None:
            plain(stamp_s, azimuth_rad)
            said.append((stamp_s, azimuth_rad))

        patch.setattr(live, "add_directions", add)
        chosen = {"rgb": "/rgb", "depth": "/depth", "directions": "/doa"}
        follow_ros2(live, RosTopics(directions="/doa"), Played(every, chosen), 1.0, told.append)
    np.testing.assert_allclose(np.rad2deg([azimuth for _, azimuth in said]), [10.0, 20.0, -160.0], atol=1e-6)
    assert any("azimuth of row 1 is nan" in one for one in told)
    assert any("directions /doa" in one for one in told)
    with LiveMap(tmp_path / "none", ENCODERS, up_in_world=UP) as live:
        follow_ros2(live, ros_topics({"directions": "/doa"}), Played(messages(6)), 1.0, told.append)
    assert "No direction came on /doa" in told[-1]


def test_ctrl_c_loses_no_direction_that_is_held_back(tmp_path: Path) -> None:
    class Stopped(Played):
        def take(self, wait_s: float) -> list:
            if not (some := super().take(wait_s)):
                raise KeyboardInterrupt
            return some

    told: list[str] = []
    every = [*messages(6), *(("directions", SimpleNamespace(data=0.1), 100.0 + at) for at in range(3))]
    live = LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP, live=replace(LiveSettings(gates=False), most_waiting=50))
    chosen = {"rgb": "/rgb", "depth": "/depth", "directions": "/doa"}
    with live, pytest.MonkeyPatch.context() as patch:
        said: list[float] = []
        patch.setattr(live, "add_directions", lambda stamp_s, azimuth_rad: said.append(azimuth_rad))
        with pytest.raises(KeyboardInterrupt):
            follow_ros2(live, RosTopics(directions="/doa"), Stopped(every, chosen), 9.0, told.append)
    assert said == pytest.approx([0.1, 0.1, 0.1])


def test_samples_a_second_that_cannot_be_are_refused_before_the_drive(tmp_path: Path) -> None:
    with (
        pytest.raises(RecordingError, match="audio_pcm takes samples a second"),
        LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP) as live,
    ):
        follow_ros2(live, RosTopics(audio_pcm="loud"), Played([]), 1.0, lambda _: None)


@pytest.mark.parametrize(
    ("given", "chosen", "said"),
    [
        ([], {}, "nobody publishes pictures of colour and of depth. The network has nothing"),
        ([], None, "no colour picture has come on /rgb"),
        (messages(2)[3:], None, "no CameraInfo has come beside /rgb"),
    ],
)
def test_a_robot_that_gives_no_frame_is_said(tmp_path: Path, given: list, chosen, said: str) -> None:
    with (
        pytest.raises(RecordingError, match="No frame came from ROS 2 within 1 s") as fault,
        LiveMap(tmp_path / "map", ENCODERS, up_in_world=UP) as live,
    ):
        follow_ros2(live, RosTopics(), Played(given, chosen), 0.7, lambda _: None)
    assert said in str(fault.value)
    assert not (tmp_path / "map" / "map.json").exists()


def test_ros_that_is_not_here_and_topics_of_no_kind_are_said() -> None:
    with pytest.raises(RecordingError, match="no 'colour' among the topics"):
        ros_topics({"colour": "/rgb"})
    try:
        import rclpy  # noqa: F401  # pyright: ignore[reportMissingImports]
    except ImportError:
        with pytest.raises(BackendError, match="needs ROS 2's rclpy"):
            open_ros2(RosTopics())
