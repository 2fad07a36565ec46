"""The tables of the contents of rooms: what is counted in a scene, and what an encoder's mistakes make of it."""

from pathlib import Path

import numpy as np
import pytest
from training.rooms.furnished import kind_of_room, mean_surfaces, rooms_of, scenes, write_table
from training.rooms.named import named_surfaces

from avlmaps.perception.protocols import read_room_contents
from avlmaps_sim.scenes import open_scene


def test_surfaces_are_means_over_the_rooms_of_a_kind() -> None:
    rooms = [
        ("kitchen", [("stove", 1.0), ("stove", 2.0), ("wall", 30.0)]),
        ("kitchen", []),
        ("toilet", [("toilet", 0.5)]),
        ("volcano", [("stove", 9.0)]),
    ]
    assert mean_surfaces(rooms) == {"stove": {"kitchen": 1.5}, "toilet": {"bathroom": 0.5}}


@pytest.mark.parametrize(
    ("kind", "name"), [("storage", "storage room"), ("corridor", "hallway"), ("toilet", "bathroom"), ("gym", "gym")]
)
def test_rooms_are_called_as_the_view_encoder_calls_them(kind: str, name: str) -> None:
    assert kind_of_room(kind) == name


@pytest.mark.nightly
def test_a_scene_is_counted_room_by_room() -> None:
    scene = open_scene("house:300000:training")
    rooms = rooms_of(scene)
    assert [kind for kind, _ in rooms] == [area.kind for area in scene.areas]
    assert sum(len(things) for _, things in rooms) == sum(thing.area >= 0 for thing in scene.objects)
    assert all(0.0 < surface <= 6.0 for _, things in rooms for _, surface in things)


def test_the_scenes_are_none_of_a_benchmarks_and_have_the_trainings_families() -> None:
    names = scenes(300_000, 16)
    assert len(set(names)) == 16
    assert sum(name.startswith("office") for name in names) == 2
    assert all(name.endswith(":training") and int(name.split(":")[1]) < 1_000_000 for name in names)


def test_an_encoder_that_errs_names_what_it_takes_things_for() -> None:
    names = ("wall", "toilet", "bed", "stove")
    furnished = {"toilet": {"bathroom": 2.0}, "bed": {"bedroom": 3.0}}
    counts = np.zeros((4, 4))
    counts[1] = [0.0, 2.5, 7.5, 0.0]  # three of four voxels of a toilet are called a bed
    counts[0, 2] = 100.0  # so is much of the walls, in every room alike
    named = named_surfaces(furnished, names, counts)
    assert named["toilet"] == pytest.approx({"bathroom": 0.5, "bedroom": 0.0})
    assert named["bed"] == pytest.approx({"bathroom": 1.5, "bedroom": 3.0}), "a thing without counts is itself"
    assert "wall" not in named and "stove" not in named


def test_a_table_is_read_as_it_was_written(tmp_path: Path) -> None:
    write_table({"bed": {"bedroom": 3.0}, "stove": {"kitchen": 1.25}}, tmp_path / "room_contents.csv")
    read = read_room_contents(tmp_path)
    assert set(read.things) == {"bed", "stove"} and set(read.kinds) == {"bedroom", "kitchen"}
    assert read.surface_m2[read.things.index("stove"), read.kinds.index("kitchen")] == 1.25
    assert read.surface_m2[read.things.index("bed"), read.kinds.index("kitchen")] == 0.0
