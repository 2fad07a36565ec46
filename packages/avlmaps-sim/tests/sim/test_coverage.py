"""Buildings with a floor, without one, in the wrong unit and on their side; and how much of a floor a walk sees."""

from pathlib import Path

import numpy as np
import pytest
from scene_writers import boxes_glb

from avlmaps.core.errors import RecordingError
from avlmaps_sim.coverage import floor_coverage, require_floor
from avlmaps_sim.driving import WalkSettings
from avlmaps_sim.files import load_scene
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.scenes import open_scene

WALK = WalkSettings()


def room(size=(6.0, 5.0, 2.6)):
    """Return a room with a closed wardrobe; the wardrobe's bottom is level, as a floor is."""
    x, y, z = size
    walls = {
        "wall south": ((0, 0, 0), (x, 0.1, z)),
        "wall north": ((0, y - 0.1, 0), (x, y, z)),
        "wall west": ((0, 0, 0), (0.1, y, z)),
        "wall east": ((x - 0.1, 0, 0), (x, y, z)),
    }
    wardrobe = {
        "wardrobe bottom": ((1.0, 1.0, 0.0), (1.9, 1.6, 0.05)),
        "wardrobe top": ((1.0, 1.0, 2.0), (1.9, 1.6, 2.05)),
        "wardrobe left": ((1.0, 1.0, 0.0), (1.02, 1.6, 2.0)),
        "wardrobe right": ((1.88, 1.0, 0.0), (1.9, 1.6, 2.0)),
        "wardrobe back": ((1.0, 1.58, 0.0), (1.9, 1.6, 2.0)),
        "wardrobe front": ((1.0, 1.0, 0.0), (1.9, 1.02, 2.0)),
    }
    return walls | wardrobe


FLOOR = {"floor": ((0.0, 0.0, -0.1), (6.0, 5.0, 0.0))}


def scene_of(path: Path, boxes, factor=1.0, z_up=False):
    scaled = [(name, tuple(tuple(factor * v for v in corner) for corner in box)) for name, box in boxes.items()]
    return open_scene(str(boxes_glb(path, scaled, z_up)))


def test_a_room_with_a_floor_can_be_walked(tmp_path: Path) -> None:
    space = require_floor(scene_of(tmp_path / "room.glb", FLOOR | room()), WALK)
    assert 15.0 < space.area_m2 < 28.0


def test_a_building_without_a_floor_is_refused_and_nothing_is_recorded(tmp_path: Path) -> None:
    scene = scene_of(tmp_path / "bare.glb", room())
    with pytest.raises(RecordingError) as error:
        record_scene(scene, tmp_path / "rec", RecordSettings(size=(32, 24), hearing="none", workers=1))
    assert "has no floor to speak of: a robot of 0.22 m radius can stand on" in str(error.value)
    assert "add a level floor mesh" in str(error.value)
    assert not (tmp_path / "rec").exists()


@pytest.mark.parametrize(("factor", "sides"), [(100.0, "600 x 500 x 270"), (1000.0, "6e+03 x 5e+03 x 2.7e+03")])
def test_a_building_in_another_unit_is_refused_with_its_size(tmp_path: Path, factor, sides) -> None:
    with pytest.raises(RecordingError, match="not a size of a building; scale it so that a unit is a metre") as error:
        require_floor(scene_of(tmp_path / "large.glb", FLOOR | room(), factor), WALK)
    assert sides in str(error.value)


def test_a_building_much_too_small_is_refused_as_well(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="not a size of a building"):
        require_floor(scene_of(tmp_path / "small.glb", FLOOR | room(), 0.001), WALK)


def test_a_building_that_lies_on_its_side_is_refused(tmp_path: Path) -> None:
    scene_of(tmp_path / "side.glb", FLOOR | room(), z_up=True)
    with pytest.raises(RecordingError, match=r"lies on its side: .* faces y; turn it so that up is \+z"):
        require_floor(load_scene(tmp_path / "side.glb", up_axis="y"), WALK)
    require_floor(load_scene(tmp_path / "side.glb"), WALK)  # the named floor says which axis is up


def test_a_building_without_floor_or_walls_to_stand_on_says_to_check_the_axis(tmp_path: Path) -> None:
    plane = {"slab": FLOOR["floor"], "post": ((0, 0, 0), (0.1, 0.1, 2.6))}
    scene_of(tmp_path / "side.glb", plane, z_up=True)
    with pytest.raises(RecordingError, match=r"no floor to speak of.* check the scale .* and the up axis"):
        require_floor(load_scene(tmp_path / "side.glb", up_axis="y"), WALK)


def test_the_share_of_the_floor_in_view_grows_with_the_walk(tmp_path: Path) -> None:
    scene = scene_of(tmp_path / "room.glb", FLOOR | room())
    space = require_floor(scene, WALK)
    poses = np.tile(np.eye(4), (8, 1, 1))
    for pose, heading in zip(poses, np.linspace(0, 2 * np.pi, 8, endpoint=False), strict=True):
        c, s = np.cos(heading), np.sin(heading)
        pose[:3, :3] = np.array([[s, 0, c], [-c, 0, s], [0, -1, 0]])
        pose[:3, 3] = 3.5, 3.0, 1.3
    one, turned = (floor_coverage(scene, space, some, 63.0) for some in (poses[:1], poses))
    assert one.walkable_m2 == turned.walkable_m2 == pytest.approx(space.area_m2)
    assert 0.1 < one.seen_share < 0.5 < 0.85 < turned.seen_share <= 1.0
    assert one.driven_share == turned.driven_share == pytest.approx(np.pi * 0.25 / space.area_m2, rel=0.15)
    assert one.reached_share == 1.0
