"""Homes with people, clothes and papers: the home stays, and what is added is where it should be."""

import numpy as np
import pytest

from avlmaps_sim.furniture import make
from avlmaps_sim.homes import lived_in, make_home, make_office
from avlmaps_sim.homes.lived_in import with_curtains_apart
from avlmaps_sim.scene import Scene, SceneBuilder
from avlmaps_sim.scenes import SceneError, open_scene

ADDED = ("person", "clothing", "paper", "shower curtain")


@pytest.fixture(scope="module")
def worlds() -> list[tuple[Scene, Scene]]:
    """Return homes and an office, each as it is made and with people in it."""
    made = [make_home(seed, "training") for seed in (3, 4)] + [make_office(5, "training")]
    return [(scene, lived_in(scene, np.random.default_rng(n), "training")) for n, scene in enumerate(made)]


def test_the_home_stays_and_things_are_added_after_it(worlds: list[tuple[Scene, Scene]]) -> None:
    for before, after in worlds:
        assert after.objects[: len(before.objects)] == before.objects
        assert {thing.category for thing in after.objects[len(before.objects) :]} <= set(ADDED)
        count = len(before.mesh.triangle)
        np.testing.assert_array_equal(after.mesh.corners()[:count], before.mesh.corners())
        assert after.areas == before.areas and after.lights == before.lights
        names = [thing.name for thing in after.objects]
        assert all(names) and len(set(names)) == len(names)
    added = {thing.category for before, after in worlds for thing in after.objects[len(before.objects) :]}
    assert {"person", "clothing", "paper"} <= added


def test_what_is_added_lies_in_the_building(worlds: list[tuple[Scene, Scene]]) -> None:
    for before, after in worlds:
        low, high = before.mesh.low - 0.5, before.mesh.high + 0.5
        for number, thing in enumerate(after.objects[len(before.objects) :], start=len(before.objects)):
            assert (np.array(thing.low) >= low).all() and (np.array(thing.high) <= high).all()
            at = after.mesh.corners()[after.instance == number].reshape(-1, 3)
            np.testing.assert_allclose(at.min(axis=0), thing.low, atol=1e-5)
            np.testing.assert_allclose(at.max(axis=0), thing.high, atol=1e-5)


def test_people_stand_or_sit_on_a_floor_or_lie_on_a_bed(worlds: list[tuple[Scene, Scene]]) -> None:
    people = [(scene, thing) for _, scene in worlds for thing in scene.objects if thing.category == "person"]
    assert people
    for scene, thing in people:
        over_floor = min(abs(thing.low[2] - area.floor_m) for area in scene.areas)
        if over_floor > 0.3:
            assert max(thing.size[:2]) > 0.9 and thing.size[2] < 0.9, "who is not on a floor lies"
        else:
            assert 0.7 < thing.size[2] < 2.2


def test_the_generator_alone_decides() -> None:
    scene = make_home(3, "training")
    one, two = (lived_in(scene, np.random.default_rng(8), "training") for _ in range(2))
    assert one.objects == two.objects
    np.testing.assert_array_equal(one.mesh.vertex, two.mesh.vertex)


def test_the_cloth_of_a_tub_becomes_a_shower_curtain() -> None:
    builder = SceneBuilder("bath")
    piece = make("bathtub", np.random.default_rng(2), name="with shower curtain")
    builder.add("bathtub", piece.mesh, family=piece.family)
    builder.add("bathtub", make("bathtub", np.random.default_rng(2), name="built in").mesh.moved(x=3.0))
    scene = with_curtains_apart(builder.build())
    assert [thing.category for thing in scene.objects] == ["bathtub", "bathtub", "shower curtain"]
    cloth = scene.objects[2]
    assert cloth.size[2] > 1.4 and cloth.high[0] < 2.0
    assert (scene.instance == 0).any() and (scene.instance == 2).any()


@pytest.mark.slow
def test_a_scene_of_that_name_holds_people_and_mirrors_that_reflect() -> None:
    bare, full = open_scene("house:3:training"), open_scene("house:3:training:lived-in")
    assert full.objects[: len(bare.objects)] == bare.objects and len(full.objects) > len(bare.objects)
    assert full.mirrors and not bare.mirrors
    assert open_scene("house:3:lived-in").objects == open_scene("house:3:all:lived-in").objects


@pytest.mark.parametrize("words", ["3:lived", "lived-in", "3:lived-in:lived-in", "3:all:training"])
def test_other_words_are_refused(words: str) -> None:
    with pytest.raises(SceneError, match="lived-in"):
        open_scene(f"house:{words}")
