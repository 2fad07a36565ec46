"""The lines that a person types: each is tried on one small map."""

import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as some

import avlmaps
from avlmaps.cli.main import main
from avlmaps.cli.output import query_lines
from avlmaps.core.errors import AudioError, AvlmapsError, BackendError, MapError, QueryError, RecordingError
from avlmaps.core.question import Question
from avlmaps.maps.settings import GravitySettings
from avlmaps.query.asking import _OF_A_LIST
from avlmaps.query.export_viewers import layers_of
from avlmaps.recordings.conformance import example_truth
from avlmaps.recordings.memory import MemoryRecording
from helpers.raycast import render
from helpers.room import Room
from helpers.walked_room import RATE_HZ, beeps

CAMERA = avlmaps.Pinhole(107.0, 107.0, 80.0, 60.0, 160, 120)
COARSE = avlmaps.BuildSettings(voxel_size_m=0.1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of six frames with a sound, and its map."""
    folder = tmp_path_factory.mktemp("face")
    room, rig = Room(), avlmaps.Rig(CAMERA, CAMERA)
    silence = 0.0005 * np.random.default_rng(0).standard_normal(2 * RATE_HZ).astype(np.float32)
    with avlmaps.RecordingWriter(folder / "rec", rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index, pose in enumerate(room.walk()[100:190:15]):
            view = render(room.scene, CAMERA, pose)
            writer.add(avlmaps.Frame(index, f"{index:06d}", float(index), view.rgb, view.depth_m, pose, rig))
        writer.set_audio(avlmaps.Sound(np.concatenate([silence, beeps(), silence]), RATE_HZ))
    avlmaps.build_map(folder / "rec", folder / "home.avlmap", settings=COARSE, progress=False)
    cv2.imwrite(str(folder / "photo.png"), np.ascontiguousarray(view.rgb[:, :, ::-1]))
    return folder


@pytest.fixture(scope="module")
def m(folder: Path) -> avlmaps.AVLMap:
    return avlmaps.open_map(folder / "home.avlmap")


def test_a_sentence_is_answered_with_count_notes_and_alternatives(m: avlmaps.AVLMap) -> None:
    answer = m.ask("where can I sit?")
    assert {one.to_dict()["query"] for one in answer.alternatives} >= {"chair"} or answer.parts[0].part.query == "chair"
    assert isinstance(answer.notes, tuple) and answer.count is None
    assert answer.to_dict()["text"] == answer.text
    assert m.ask("how many chairs are there?").count is not None


def test_the_nearest_of_what_is_found_comes_first(folder: Path) -> None:
    m = avlmaps.AVLMap.open(folder / "home.avlmap", avlmaps.QuerySettings(found_at=0.2))
    likeliest = m.ask("the chair near the sofa")
    first, second, third = likeliest.goals
    assert third.probability < first.probability / 2.0 <= second.probability + 0.01
    for near in (second.position, ",".join(map(str, second.position)), m.space.level(np.array(second.position))[:2]):
        answer = m.ask("the nearest chair near the sofa", near=near)
        counting = [goal for goal in likeliest.goals if goal.probability >= first.probability / 2.0]
        assert answer.found and answer.goals[0] == min(
            counting, key=lambda goal: np.linalg.norm(np.subtract(goal.position, second.position))
        )
    assert any("No position is known" in note for note in m.ask("the nearest chair").notes)
    assert not m.ask("the nearest chair", near=first.position).notes
    question = Question.of([one.part for one in likeliest.parts])
    assert m.ask(question, near=second.position).goals == answer.goals
    with pytest.raises(avlmaps.QueryError, match="A place is x,y or x,y,z in metres"):
        m.ask("chair", near="here")
    with pytest.raises(avlmaps.QueryError, match="A place is x,y or x,y,z in metres"):
        m.ask("chair", near=5)  # pyright: ignore[reportArgumentType]
    with pytest.raises(avlmaps.QueryError, match="top must be a whole number of goals, not '2'"):
        m.ask("chair", top="2")  # pyright: ignore[reportArgumentType]
    assert len(m.ask("chair", top=np.int64(2)).goals) <= 2


def test_a_place_to_count_from_leaves_a_list_in_its_own_order(m: avlmaps.AVLMap) -> None:
    for question in ("the last sound", "what is in the kitchen?", "which things are there?"):
        alone, near = m.ask(question), m.ask(question, near=(0, 0))
        assert near.goals == alone.goals and near.text == alone.text and near.when == alone.when
        assert near.notes == (*alone.notes, *([_OF_A_LIST] if alone.goals else ())), "of nothing there is no order"
        table = query_lines(alone.to_dict())[-len(alone.goals) :]
        assert all(goal.name in line for goal, line in zip(alone.goals, table, strict=bool(alone.goals)))


def test_what_was_heard_and_when_is_answered_with_times(m: avlmaps.AVLMap) -> None:
    sounds = sorted(m.sounds(), key=lambda sound: sound.onset_s)
    assert sounds
    for sound in sounds:
        answer = m.ask(f"when did you hear {sound.names[0]}")
        assert answer.count and f"at {sound.onset_s:.1f} s" in answer.text
        assert m.ask(f"how often did you hear {sound.names[0]}?").count == answer.count
    other = m.ask("when did you hear a volcano")
    assert not other.found and other.count == 0 and sounds[0].names[0] in other.text
    assert [m.ask(f"did you hear {one}?").text[:3] for one in ("a volcano", sounds[0].names[0])] == ["No ", "Yes"]
    with pytest.raises(QueryError, match="There is no room 'kitchen'"):
        m.ask("what noises are in the kitchen?")


def test_heat_is_an_array_and_has_arithmetic(m: avlmaps.AVLMap) -> None:
    chair, sound = m.object("chair"), m.sound("dog bark")
    heat = 0.7 * chair + 0.3 * sound
    expected = 0.7 * np.asarray(chair) + 0.3 * np.asarray(sound)
    np.testing.assert_allclose(np.asarray(heat), expected, atol=1e-6)
    assert heat.max() == pytest.approx(expected.max(), abs=1e-6) and heat.min() >= 0.0
    assert np.asarray(heat).shape == (len(m.points),) and np.asarray(heat, np.float64).dtype == np.float64
    np.testing.assert_allclose(heat.at(m.points[::50]), np.asarray(heat)[::50], atol=1e-4)
    assert heat.at((0.0, 0.0, 0.0)).shape == () and heat.at(np.zeros((2, 4, 3))).shape == (2, 4)
    assert repr(heat) == f"Blend('0.7 * chair + 0.3 * dog bark', {len(heat):,} voxels)"


@given(a=st.floats(-3, 3, width=32), b=st.floats(0.25, 3, width=32))
def test_arithmetic_of_heat_is_that_of_its_arrays(m: avlmaps.AVLMap, a: float, b: float) -> None:
    one, two = m.object("sofa"), m.object("table")
    x, y = np.asarray(one), np.asarray(two)
    for heat, array in (
        (a * one - two / b, a * x - y / b),
        (np.float32(a) * one + sum([one, two]), a * x + x + y),
        ((a * one + two) * b, (a * x + y) * b),
        (-one, -x),
        (np.ones(len(x)) * one, x),
        (1 - one, 1 - x),
        (abs(-one) ** 2, x**2),
        (np.float32(b) * two + x, np.float32(b) * y + x),
        (np.maximum(one, two)[3:], np.maximum(x, y)[3:]),
    ):
        np.testing.assert_allclose(np.asarray(heat), array, atol=1e-4)
    for asked, known in ((one > 0.5, x > 0.5), (one == two, x == y), (np.max(one), x.max()), (np.sum(two), y.sum())):
        np.testing.assert_array_equal(asked, known)
    assert isinstance(np.float32(a) * one, type(-one)) and {one: 1}[one] == 1
    product = np.asarray((a * one) * two)
    np.testing.assert_allclose(product, a * np.asarray(one * two), atol=1e-4)


def test_a_map_draws_into_axes_and_lists_things_with_their_rooms(m: avlmaps.AVLMap) -> None:
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots()
    assert m.plot(ax=axes) is figure and axes.has_data()
    rooms, things = m.rooms(), m.things()
    assert {thing.room for thing in things} & {room.name for room in rooms}
    assert [one.name for one in m.things(room=rooms[0])] == [one.name for one in m.things(room=m.where.names[0])]
    assert {"goals", "values", "plot", "found"} <= set(dir(m.object("chair"))) and "factors" not in dir(
        m.object("chair")
    )
    for number in re.findall(
        r"\d+\.\d+", str(m.ask("the chair near the sofa").to_dict() | {"level_from_recording": 0})
    ):
        assert len(number.partition(".")[2]) <= 4


def test_heat_of_two_maps_does_not_mix(m: avlmaps.AVLMap) -> None:
    other = avlmaps.AVLMap(m.data, m.encoders, path=m.path)
    with pytest.raises(ValueError, match="different maps cannot be added"):
        m.object("chair") + other.object("chair")
    with pytest.raises(TypeError):
        m.object("chair") * "sofa"


@pytest.mark.parametrize("points", [np.zeros((3, 2)), "here", np.full((1, 3), np.nan), 1.0])
def test_what_is_no_point_is_refused(m: avlmaps.AVLMap, points: object) -> None:
    with pytest.raises(QueryError, match=r"Points are finite x, y, z in metres"):
        m.object("chair").at(points)  # pyright: ignore[reportArgumentType]


def test_arrays_are_read_only_and_not_copied(m: avlmaps.AVLMap) -> None:
    count = m.data.info.counts.voxels
    shapes = {"points": (count, 3), "colors": (count, 3), "voxel_index": (count, 3)}
    for name in ("points", "colors", "voxel_index", "features"):
        array = getattr(m, name)
        assert isinstance(array, np.ndarray) and array.shape == shapes.get(name, array.shape) and len(array) == count
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    for name, field in (("colors", "rgb"), ("features", "feature"), ("voxel_index", "index")):
        assert np.shares_memory(getattr(m, name), getattr(m.data.voxels, field))
    np.testing.assert_allclose(m.points, (m.voxel_index + 0.5) * 0.1)


def test_frames_of_a_recording_come_one_by_one(folder: Path) -> None:
    recording = avlmaps.open_recording(folder / "rec")
    frames = list(recording)
    assert len(frames) == len(recording) == 6
    for frame in frames:
        assert frame.rgb.shape == (120, 160, 3) and frame.depth_m.shape == (120, 160)
        assert frame.world_from_camera.shape == (4, 4) and isinstance(frame.camera, avlmaps.Pinhole)


def test_a_photo_is_located_by_its_file(m: avlmaps.AVLMap, folder: Path) -> None:
    by_file = m.locate(folder / "photo.png")
    by_array = m.locate(cv2.imread(str(folder / "photo.png"))[:, :, ::-1])
    assert by_file.inliers == by_array.inliers and len(repr(by_file)) < 100
    with pytest.raises(QueryError, match="is not there"):
        m.locate("nowhere.png")


def test_what_python_prints_is_short(m: avlmaps.AVLMap, folder: Path) -> None:
    recording = avlmaps.open_recording(folder / "rec")
    parts = [m, m, m.data.voxels, m.data.keyframes, m.data.sounds, recording, recording.frame(0)]
    values = [m.object("chair"), m.ask("the chair"), avlmaps.Encoders.named("embedded"), avlmaps.VoxelMap()]
    for thing in (*parts, *values):
        assert len(repr(thing)) < 260 and "array(" not in repr(thing), repr(thing)


# A map in memory


def add(live: avlmaps.VoxelMap, frame: avlmaps.Frame, **parts: object) -> None:
    live.add(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s, **parts)  # pyright: ignore


def test_a_map_of_frames_one_by_one_is_the_built_one(folder: Path, tmp_path: Path) -> None:
    recording = avlmaps.open_recording(folder / "rec")
    frames = list(recording)
    built = avlmaps.build_map(MemoryRecording(frames), tmp_path / "built", settings=COARSE, progress=False)
    live = avlmaps.VoxelMap(voxel_size_m=0.1)
    for frame in frames:
        add(live, frame)
    np.testing.assert_array_equal(live.voxel_index, built.voxel_index)
    np.testing.assert_allclose(live.features.astype(float), built.features.astype(float), atol=5e-3)
    np.testing.assert_allclose(live.colors.astype(int), built.colors, atol=1)
    np.testing.assert_allclose(live.map.data.up_in_world, built.data.up_in_world, atol=1e-9)
    saved = live.save(tmp_path / "live.avlmap")
    assert saved.ask("the sofa").probability == pytest.approx(built.ask("the sofa").probability, abs=0.02)
    assert live.ask("the sofa").found == saved.ask("the sofa").found


class Hues:
    """The direction of a colour, which is near the direction of its name; six lines, no card, no registry."""

    vocabulary = ("red", "green", "blue")

    def encode(self, frame: avlmaps.Frame) -> np.ndarray:
        rgb = frame.rgb[::4, ::4].astype(np.float32) + 1.0
        return rgb / np.linalg.norm(rgb, axis=2, keepdims=True)

    def encode_words(self, words: list[str]) -> np.ndarray:
        return np.array([[w == "red", w == "green", w == "blue"] for w in words], np.float32)


def test_a_map_of_an_object_opens_without_it_and_says_what_needs_it(folder: Path, tmp_path: Path) -> None:
    mine = avlmaps.Encoders.named("colours", pixels=Hues())
    built = avlmaps.build_map(folder / "rec", tmp_path / "m", settings=COARSE, encoders=mine, progress=False)
    assert built.object("red").peak > 0.0
    opened = avlmaps.open_map(tmp_path / "m")
    assert len(opened.points) == len(opened.colors) == len(built.points)
    assert len(opened.sounds()) == 1 and opened.sound("alarm clock") is not None
    assert opened.locate(folder / "photo.png").inliers >= 0
    with pytest.raises(BackendError, match=r"an object of the class Hues.*encoders=avlmaps\.Encoders\(pixels=\.\.\.\)"):
        opened.object("red")
    again = avlmaps.open_map(tmp_path / "m", encoders=avlmaps.Encoders(pixels=Hues()))
    np.testing.assert_allclose(np.asarray(again.object("red")), np.asarray(built.object("red")))
    assert [one.names for one in again.sounds()] == [one.names for one in built.sounds()]


def test_raw_features_are_queried_by_words_of_ones_own(folder: Path, tmp_path: Path) -> None:
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders())
    for frame in avlmaps.open_recording(folder / "rec"):
        add(live, frame, features=Hues().encode(frame))
    assert live.features.shape[1] == 3
    with pytest.raises(BackendError, match="no pixels backend"):
        live.ask("red")
    live.save(tmp_path / "raw")
    worded = avlmaps.open_map(tmp_path / "raw", encoders=avlmaps.Encoders(pixels=Hues()))
    assert worded.object("red").peak > 0.0


def test_a_map_without_a_model_for_things_says_so_and_is_exported(folder: Path) -> None:
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders())
    for frame in avlmaps.open_recording(folder / "rec"):
        add(live, frame)
    layers = layers_of(live.map)
    assert layers.things == () and len(layers.points) == len(live.points) and layers.sounds == ()
    assert any("names none" in doubt for doubt in live.map.contents().doubts)
    with pytest.raises((BackendError, MapError), match=r"no pixels backend; .* encoders=avlmaps.Encoders\(pixels"):
        live.ask("the chair")


@pytest.fixture
def frame(folder: Path) -> avlmaps.Frame:
    return avlmaps.open_recording(folder / "rec").frame(0)


UPRIGHT = np.broadcast_to(np.float32([1, 0, 0]), (40, 30, 3))  # of pictures of 160x120
FAR_AWAY = np.eye(4)
FAR_AWAY[:3, 3] = 500_000.0, 4_649_776.0, 30.0  # metres of UTM


class OnAnotherDevice:
    """An array that numpy cannot read, as a tensor of a GPU."""

    def __array__(self, dtype: object = None, copy: object = None) -> np.ndarray:
        raise TypeError("can't convert cuda:0 device type tensor to numpy")


BAD_FRAMES = {
    "rgb of floats": (dict(rgb=np.zeros((120, 160, 3))), r"rgb .* must be uint8 of shape \(h, w, 3\), not float64"),
    "channels first": (dict(rgb=np.zeros((3, 120, 160), np.uint8)), r"rgb.transpose\(1, 2, 0\)"),
    "a tensor of a GPU": (dict(depth_m=OnAnotherDevice()), "depth_m .* not OnAnotherDevice .*cuda:0"),
    "a pose in two parts": (dict(world_from_camera=([0, 0, 0], [0, 0, 0, 1])), "world_from_camera .* not tuple"),
    "features on their side": (dict(features=UPRIGHT), "40 rows and 30 columns .* look exchanged"),
    "features of a GPU": (dict(features=OnAnotherDevice()), "no array but OnAnotherDevice"),
    "rgba": (dict(rgb=np.zeros((120, 160, 4), np.uint8)), "without a fourth"),
    "millimetres": (dict(depth_m=np.full((120, 160), 1200.0)), r"must be in metres; its median is 1,200"),
    "centimetres": (dict(depth_m=np.full((120, 160), 250.0)), "or centimetres"),
    "whole numbers": (dict(depth_m=np.full((120, 160), 1200, np.uint16)), r"not uint16 .* up to 1200; millimetres"),
    "kilometres": (dict(depth_m=np.full((120, 160), 0.002)), r"must be in metres; .* largest 0.002"),
    "negative depth": (dict(depth_m=np.full((120, 160), -1.0)), "its least -1"),
    "depth on its side": (dict(depth_m=np.ones((160, 120))), "depth_m 120x160, the camera 160x120"),
    "a matrix for a camera": (dict(camera=np.eye(3)), r"must be an avlmaps.Pinhole.* not ndarray"),
    "a camera of another size": (dict(camera=CAMERA.resized(320, 240)), "rgb .* 160x120 pixels .* the camera 320x240"),
    "a pose that mirrors": (dict(world_from_camera=np.diag([1.0, 1, -1, 1])), "not a rigid transform"),
    "a pose of three rows": (dict(world_from_camera=np.eye(4)[:3]), r"has shape \(3, 4\); it must be 4x4"),
    "a pose of nothing": (dict(world_from_camera=np.full((4, 4), np.nan)), "NaN or infinity"),
    "a pose on the Earth": (dict(world_from_camera=FAR_AWAY), "4.64978e.06 m from the origin"),
    "a stamp that is none": (dict(stamp_s=np.nan), "stamp_s .* must be a finite number of seconds"),
    "features of two axes": (dict(features=np.ones((4, 3), np.float32)), r"given are float32 of \(4, 3\)"),
    "features of other length": (dict(features=np.ones((2, 2, 5), np.float32)), r"\(rows, columns, 3\)"),
    "features without end": (dict(features=np.full((2, 2, 3), np.inf, np.float32)), "NaN or infinite features"),
    "features that are long": (dict(features=np.full((2, 2, 3), 2.0, np.float32)), r"length 3.46 to 3.46"),
}


@pytest.mark.parametrize("kind", BAD_FRAMES)
def test_bad_input_gets_a_sentence_and_costs_nothing(frame: avlmaps.Frame, kind: str) -> None:
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders(pixels=Hues()))
    add(live, frame)
    before = len(live.points)
    good = {name: getattr(frame, name) for name in ("rgb", "depth_m", "camera", "world_from_camera")} | {"stamp_s": 9.0}
    wrong, said = BAD_FRAMES[kind]
    with pytest.raises((RecordingError, BackendError), match=said):
        live.add(**{**good, **wrong})  # pyright: ignore[reportArgumentType]
    assert len(live) == 1 and len(live.points) == before
    live.add(**good)  # pyright: ignore[reportArgumentType]
    assert len(live) == 2


def test_depths_that_are_masked_are_none(frame: avlmaps.Frame) -> None:
    live, near = avlmaps.VoxelMap(0.1, avlmaps.Encoders()), avlmaps.VoxelMap(0.1, avlmaps.Encoders())
    add(live, replace(frame, depth_m=np.ma.masked_where(frame.depth_m > 2.0, frame.depth_m)))
    add(near, replace(frame, depth_m=np.where(frame.depth_m > 2.0, 0.0, frame.depth_m)))
    np.testing.assert_array_equal(live.voxel_index, near.voxel_index)


@pytest.mark.parametrize(
    ("begin", "names"),
    [
        (lambda _, **given: avlmaps.VoxelMap(**given), ("settings", "query")),
        (lambda out, **given: avlmaps.LiveMap(out, **given), ("settings", "live", "query")),
        (lambda out, **given: avlmaps.build_map("walk", out, **given), ("settings",)),
    ],
    ids=["VoxelMap", "LiveMap", "build_map"],
)
def test_settings_of_another_kind_are_refused_at_once(begin: Callable, names: tuple[str, ...], tmp_path: Path) -> None:
    for name in names:
        with pytest.raises(MapError, match=rf"{name} must be an avlmaps\.\w+Settings, not dict"):
            begin(tmp_path / "map", **{name: {}})
    assert not (tmp_path / "map").exists()


@pytest.mark.few(1)
@pytest.mark.parametrize("words", [None, 5, ["chair"], b"chair"])
def test_what_is_no_phrase_is_refused_in_a_sentence(m: avlmaps.AVLMap, words: object) -> None:
    kind = type(words).__name__
    with pytest.raises(QueryError, match=f"A query is a sentence, .* not {kind}"):
        m.ask(words)
    for find in (m.object, m.area, m.sound):
        with pytest.raises(QueryError, match="must be text, not"):
            find(words)
    with pytest.raises(QueryError, match="primary is one of object, sound, area, image, not"):
        m.ask(object="chair", primary="colour" if words is None else words)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda m: m.things(5), "names must be a list of words, not 5"),
        (lambda m: m.things(least_confidence=None), "least_confidence must be a number, not None"),
        (lambda m: m.things(structure="no"), "structure must be True or False, not 'no'"),
        (lambda m: m.contents(names=[5]), r"names must be a list of words, not \[5\]"),
        (lambda m: m.rooms(least_confidence="half"), "least_confidence must be a number, not 'half'"),
        (lambda m: m.sounds(most_names=1.5), "most_names must be a whole number, not 1.5"),
        (lambda m: m.object("chair", primary="False"), "primary must be True or False, not 'False'"),
        (lambda m: m.object("chair", vocabulary=5), "vocabulary must be a list of words, not 5"),
        (lambda m: m.knows(5), "phrase must be text, not 5"),
        (lambda m: m.object("xqzt"), "'xqzt' .*; name a thing that it knows"),
        (lambda m: m.instances(np.zeros((3, 3))), "word must be text, not ndarray"),
        (lambda m: m.ask("the chair", at=5), "at is robot, where a sound was heard, .* not 5"),
        (lambda m: m.locate(np.zeros((9, 9, 3), np.uint8), focal_35mm=-1), "focal_35mm is a length over 0 mm, not -1"),
        (lambda m: m.ask(image=np.zeros((9, 9, 3), np.uint8)), "image is .* of a file, not ndarray; .*image='it'"),
        (lambda m: m.ask(clip=avlmaps.Sound(beeps(), RATE_HZ)), "clip is the path of a file, not Sound; .*clip='it'"),
        (lambda m: m.sound_clip(beeps()), r"or an avlmaps\.Sound\(samples, rate_hz\), not ndarray"),
        (lambda m: m.sound("dog bark", at="moon"), "at is robot, .*, or source, .*; not 'moon'"),
        (lambda m: m.locate(np.zeros((9, 9, 3), np.uint8), (1.0, 1.0, 4.0, 4.0)), r"avlmaps\.Pinhole\(.*, not tuple"),
    ],
)
def test_an_argument_of_another_kind_is_named(m: avlmaps.AVLMap, call: Callable, said: str) -> None:
    with pytest.raises(QueryError, match=said):
        call(m)


def test_one_name_is_a_name_and_not_its_letters(m: avlmaps.AVLMap) -> None:
    name = m.things(least_confidence=0.0)[0].name
    listed = m.things([name], 0.0)
    assert listed and [one.position for one in m.things(name, 0.0)] == [one.position for one in listed]
    assert len(m.contents(0.0, name).things) == len(listed)


def test_one_reason_to_allow_is_a_reason_and_not_its_letters(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="There is nothing called 'poses' to allow"):
        avlmaps.build_map(folder / "rec", tmp_path / "map", "colours", COARSE, allow="poses", progress=False)


def test_frames_of_ones_own_are_sent_to_a_map_in_memory(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="not of list; add frames of your own to a VoxelMap"):
        avlmaps.build_map(list(avlmaps.open_recording(folder / "rec")), tmp_path / "map")


@given(
    rgb=some.arrays(
        st.sampled_from([np.uint8, np.float32, np.int64]), some.array_shapes(min_dims=1, max_dims=4, max_side=4)
    ),
    depth=some.arrays(st.sampled_from([np.float32, np.uint16]), some.array_shapes(min_dims=1, max_dims=3, max_side=4)),
    pose=some.arrays(np.float64, st.sampled_from([(4, 4), (3, 4), (4,)])),
    stamp=st.one_of(st.floats(), st.text(max_size=2), st.none()),
)
def test_any_arrays_make_a_frame_or_a_sentence(rgb, depth, pose, stamp) -> None:
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders())
    try:
        live.add(rgb, depth, avlmaps.Pinhole(2.0, 2.0, 2.0, 2.0, 4, 4), pose, stamp)
    except AvlmapsError as fault:
        assert str(fault).endswith(".") and "\n" not in str(fault)
    assert len(live) in (0, 1)


ASIDE = np.zeros((4, 4))
ASIDE[0, 3] = 1.0
WRONG_WALKS = {
    "poses the other way round": (lambda i, pose: np.linalg.inv(pose), "look like camera_from_world"),
    "poses of OpenGL": (lambda i, pose: pose @ np.diag([1.0, -1, -1, 1]), "OpenGL camera"),
    "a jump": (lambda i, pose: pose + 5.0 * (i > 6) * ASIDE, r"jumps by 5\.0"),
    "one pose elsewhere": (lambda i, pose: pose + 90.0 * (i == 5) * ASIDE, r"1 frame\(s\) are up to 90 m from"),
}


@pytest.mark.few(2)
@pytest.mark.parametrize("kind", WRONG_WALKS)
def test_frames_that_contradict_one_another_are_said_with_every_answer(kind: str, tmp_path: Path) -> None:
    truth, (moved, said) = example_truth(frames=14), WRONG_WALKS[kind]
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders(pixels=Hues()))
    for index, pose in enumerate(truth.world_from_camera):
        live.add(truth.rgb[index], truth.depth_m[index], truth.rig.rgb, moved(index, pose))
    assert any(re.search(said, doubt) for doubt in live.doubts), live.doubts
    assert set(live.doubts) <= set(live.ask("red").notes)
    assert set(live.doubts) <= set(live.save(tmp_path / "m").data.info.doubts)


def test_stamps_in_milliseconds_are_doubted_and_frames_that_agree_are_not() -> None:
    truth, plain, slow = example_truth(frames=14), *(avlmaps.VoxelMap(0.1, avlmaps.Encoders()) for _ in range(2))
    for index, pose in enumerate(truth.world_from_camera):
        plain.add(truth.rgb[index], truth.depth_m[index], truth.rig.rgb, pose)
        slow.add(truth.rgb[index], truth.depth_m[index], truth.rig.rgb, pose, 100.0 * index)
    assert plain.doubts == ()
    assert any("100 s apart, so their stamps look like milliseconds" in doubt for doubt in slow.doubts), slow.doubts


def test_an_encoder_that_is_interrupted_costs_no_frame_that_waits() -> None:
    class Interrupted(Hues):
        left = 5

        def encode(self, frame: avlmaps.Frame) -> np.ndarray:
            self.left -= 1
            if self.left == 0:
                raise KeyboardInterrupt
            return super().encode(frame)

    truth = example_truth(frames=10)
    few = avlmaps.BuildSettings(voxel_size_m=0.1, gravity=GravitySettings(frames=8))
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders(pixels=Interrupted()), settings=few)
    for index in range(7):
        live.add(truth.rgb[index], truth.depth_m[index], truth.rig.rgb, truth.world_from_camera[index])
    with pytest.raises(KeyboardInterrupt):
        live.add(truth.rgb[7], truth.depth_m[7], truth.rig.rgb, truth.world_from_camera[7])
    assert len(live) == 8
    live.add(truth.rgb[8], truth.depth_m[8], truth.rig.rgb, truth.world_from_camera[8])
    assert len(live) == 9 and live.map.data.info.counts.frames == 9


def test_sound_of_another_clock_than_the_frames_is_refused_from_its_first_piece(frame: avlmaps.Frame) -> None:
    live = avlmaps.VoxelMap(0.1, avlmaps.Encoders(pixels=Hues()))
    add(live, frame)
    piece = avlmaps.Sound(np.zeros(1600, np.float32), 16_000)
    for stamp_s, said in ((1.7e9, "more than 600 s from the frames"), (1.7e18, "nanoseconds since 1970")):
        with pytest.raises(AudioError, match=said):
            live.add_audio(piece, stamp_s)
    live.add_audio(piece, 0.0)


def test_what_is_no_map_size_up_or_profile_is_refused() -> None:
    for size in (0.0, -1.0, "5 cm", 50.0):
        with pytest.raises(MapError, match="voxel"):
            avlmaps.VoxelMap(size)  # pyright: ignore[reportArgumentType]
    for up in ((0, 0, 0), "z", (0, 1), (np.nan, 0, 1)):
        with pytest.raises(MapError, match="up_in_world must be a direction"):
            avlmaps.VoxelMap(up_in_world=up)  # pyright: ignore[reportArgumentType]
    with pytest.raises(BackendError, match="no profile called 'embeded'"):
        avlmaps.VoxelMap(encoders="embeded")
    with pytest.raises(BackendError, match=r"not Hues; an encoder of your own goes in as avlmaps.Encoders"):
        avlmaps.VoxelMap(encoders=Hues())  # pyright: ignore[reportArgumentType]
    with pytest.raises(MapError, match="has no frame yet"):
        avlmaps.VoxelMap(encoders="colours").ask("the chair")


def test_a_program_may_change_its_folder_while_it_uses_relative_paths(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    shutil.copytree(folder / "rec", tmp_path / "rec")
    monkeypatch.chdir(tmp_path)
    recording, rig = avlmaps.open_recording("rec"), avlmaps.Rig(CAMERA, CAMERA)
    grown = avlmaps.VoxelMap(encoders=avlmaps.Encoders.named("colours"), up_in_world=(0, 0, 1))
    add(grown, next(iter(recording)))
    saved = grown.save("grown.avlmap")
    opened, same = avlmaps.open_map("grown.avlmap"), avlmaps.AVLMap.open("grown.avlmap")
    live = avlmaps.LiveMap("live.avlmap", avlmaps.Encoders.named("colours"), up_in_world=(0, 0, 1))
    with live, avlmaps.RecordingWriter(Path("walk"), rig) as writer:
        monkeypatch.chdir(tmp_path / "elsewhere")
        for frame in recording:
            writer.add(frame)
        live.add_frame(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s)
    place = saved.points[0]
    for number, one in enumerate((saved, opened, same)):
        one.edit.pin(f"dock {number}", at=place)
    assert list(Path().iterdir()) == []
    assert len(avlmaps.open_map("../grown.avlmap").edit.history()["edits"]) == 3
    assert len(avlmaps.open_map("../live.avlmap").points) and len(avlmaps.open_recording("../walk")) == len(recording)


def test_maps_recordings_and_pictures_are_written_and_opened_under_the_home(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "home"
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("USERPROFILE", str(home))
    monkeypatch.chdir(tmp_path)
    camera, encoders = avlmaps.Pinhole(40.0, 40.0, 20.0, 15.0, 40, 30), avlmaps.Encoders.named("colours")
    frame = np.full((30, 40, 3), 200, np.uint8), np.full((30, 40), 2.0, np.float32), camera, np.eye(4)
    grown = avlmaps.VoxelMap(encoders=encoders, up_in_world=(0, -1, 0))
    grown.add(*frame)
    grown.save("~/grown.avlmap")
    with avlmaps.LiveMap("~/live.avlmap", encoders, up_in_world=(0, -1, 0)) as live:
        live.add_frame(*frame)
    with avlmaps.RecordingWriter(Path("~/walk"), avlmaps.Rig(camera, camera), np.array([0.0, -1.0, 0.0])) as writer:
        writer.add(avlmaps.Frame(0, "000000", 0.0, *frame[:2], np.eye(4), avlmaps.Rig(camera, camera)))
    assert len(avlmaps.open_recording("~/walk")) == 1
    built = avlmaps.build_map("~/walk", "~/built.avlmap", encoders=encoders, progress=False)
    built.object("white").plot("~/heat.png")
    for name in ("grown", "live", "built"):
        assert len(avlmaps.open_map(f"~/{name}.avlmap").points) == len(avlmaps.AVLMap.open(f"~/{name}.avlmap").points)
    with pytest.raises(SystemExit):
        main(["export", "~/built.avlmap", "--out=~/cloud.ply"])  # a shell leaves the second ~
    written = "built.avlmap cloud.ply grown.avlmap heat.png live.avlmap walk"
    assert sorted(one.name for one in home.glob("[!.]*")) == written.split()
    assert list(tmp_path.iterdir()) == [home]
