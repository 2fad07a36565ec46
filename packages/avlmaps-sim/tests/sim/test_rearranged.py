"""A building on later days: what changed is what its truth says, and nothing else."""

import json

import numpy as np
import pytest

from avlmaps_sim import scenes
from avlmaps_sim.free_space import free_space, reaching_part
from avlmaps_sim.mesh import Material
from avlmaps_sim.rearranged import Change, rearranged, to_json
from avlmaps_sim.scene import Area, Scene, SceneBuilder
from avlmaps_sim.scenes import SceneError, on_day, open_changed, open_scene
from avlmaps_sim.shapes import box

THINGS = (
    ("table", (0.6, 0.6, 0.0), (1.8, 1.4, 0.75)),
    ("wardrobe", (5.2, 0.2, 0.0), (5.8, 1.8, 2.2)),
    ("chair", (2.0, 3.2, 0.0), (2.45, 3.65, 0.9)),
    ("chair", (4.0, 4.2, 0.0), (4.45, 4.65, 0.9)),
    ("bag", (0.5, 4.0, 0.0), (0.8, 4.2, 0.35)),
    ("box", (3.0, 1.0, 0.0), (3.4, 1.4, 0.4)),
    ("stool", (4.8, 3.2, 0.0), (5.1, 3.5, 0.5)),
    ("cup", (1.0, 1.0, 0.75), (1.1, 1.1, 0.85)),
)
DAYS = 4


@pytest.fixture(scope="module")
def scene() -> Scene:
    builder = SceneBuilder("a room")
    square = np.array([[0.0, 0.0], [6.0, 0.0], [6.0, 5.0], [0.0, 5.0]])
    builder.areas.append(Area("living room", square, 0.0, 2.6, "living room 1"))
    plain = Material()

    def block(low: tuple[float, float, float], high: tuple[float, float, float]):
        return box(low, high, plain)

    builder.add("floor", block((0.0, 0.0, -0.1), (6.0, 5.0, 0.0)), area=0)
    for low, high in (((-0.1, 0, 0), (0, 5, 2.6)), ((6, 0, 0), (6.1, 5, 2.6)), ((0, -0.1, 0), (6, 0, 2.6))):
        builder.add("wall", block(low, high))
    for category, low, high in THINGS:
        builder.add(category, block(low, high), area=0)
    return builder.build()


@pytest.fixture(scope="module")
def days(scene: Scene) -> list[tuple[Scene, tuple[Change, ...]]]:
    return [rearranged(scene, day) for day in range(DAYS + 1)]


def _named(scene: Scene) -> dict[str, object]:
    return {thing.name: thing for thing in scene.objects}


@pytest.mark.parametrize("day", range(1, DAYS + 1))
def test_a_day_differs_from_the_one_before_by_its_changes_alone(days: list, day: int) -> None:
    (before, earlier), (after, changes) = days[day - 1 : day + 1]
    assert changes[: len(earlier)] == earlier
    new = changes[len(earlier) :]
    assert new and {one.day for one in new} == {day}
    then, now = _named(before), _named(after)
    assert len(now) == len(after.objects), "two things of one name"
    assert then.keys() - now.keys() == {one.name for one in new if one.kind == "removed"}
    assert now.keys() - then.keys() == {one.name for one in new if one.kind == "added"}
    touched = {one.name for one in new}
    for name in now.keys() & then.keys() - touched:
        assert now[name] == then[name]
    for one in new:
        if one.kind == "moved":
            assert np.hypot(*np.subtract(one.after, one.before)[:2]) > 0.9
            assert np.allclose(then[one.name].size[2], now[one.name].size[2], atol=1e-5)
            assert one.after == now[one.name].centre


def test_triangles_lie_in_the_boxes_of_their_things_and_nothing_stands_in_another(days: list) -> None:
    after, _ = days[DAYS]
    corners = after.mesh.corners()
    for number, thing in enumerate(after.objects):
        own = corners[after.instance == number].reshape(-1, 3)
        assert np.allclose(own.min(axis=0), thing.low, atol=1e-4) and np.allclose(
            own.max(axis=0), thing.high, atol=1e-4
        )
    moved = [one for one in after.objects if one.category in ("chair", "bag", "box", "stool")]
    for number, one in enumerate(moved):
        for other in moved[number + 1 :]:
            apart = np.maximum(np.subtract(one.low, other.high), np.subtract(other.low, one.high)).max()
            assert apart > -0.01, f"{one.name} stands in {other.name}"


def test_a_robot_reaches_most_of_the_floor_on_every_day(days: list) -> None:
    free = reaching_part(days[0][0], free_space(days[0][0])).area_m2
    for day in range(1, DAYS + 1):
        after, _ = days[day]
        assert reaching_part(after, free_space(after)).area_m2 > 0.9**day * free


def test_what_bears_something_stays(days: list) -> None:
    after, changes = days[DAYS]
    assert not {"table#1", "cup#1", "wardrobe#1"} & {one.name for one in changes}
    assert {"table#1", "cup#1"} <= _named(after).keys()


def test_the_same_day_is_the_same_scene_and_its_truth_is_json(scene: Scene, days: list) -> None:
    one, changes = days[2]
    other, again = rearranged(scene, 2)
    assert changes == again and np.array_equal(one.mesh.vertex, other.mesh.vertex)
    first, earlier = days[1]
    other, later = rearranged(first, 2, since=1)
    assert changes == (*earlier, *later) and np.array_equal(one.mesh.vertex, other.mesh.vertex)
    assert [entry["name"] for entry in json.loads(json.dumps(to_json(changes)))] == [one.name for one in changes]
    with pytest.raises(ValueError, match="day -1"):
        rearranged(scene, -1)


def test_the_name_of_a_scene_says_its_day(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(scenes._MAKERS, "house", lambda *_: scene)  # pyright: ignore[reportPrivateUsage]
    assert on_day("house:7", 0) == "house:7" and on_day("house:7:held-out", 3) == "house:7:held-out:day-3"
    same, none = open_changed("house:7:day-0")
    assert not none and [one.name for one in same.objects] == [one.name for one in open_scene("house:7").objects]
    for spec, day, said in (("house:7", -1, "0 or more"), ("house:7:day-1", 2, "already"), ("a.glb", 1, "only house")):
        with pytest.raises(SceneError, match=said):
            on_day(spec, day)
