"""What the page reads of a map is the map: places, colours, labels and heat, in one order."""

from copy import copy

import numpy as np
import pytest

from avlmaps.maps.storeys import Storey, Storeys
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.words import keyframes_that_saw
from avlmaps.view.labels import Labels
from avlmaps.view.layout import RECORD, Layout, as_bytes


@pytest.fixture(scope="module")
def layout(room: AVLMap) -> Layout:
    return Layout(room)


@pytest.fixture(scope="module")
def labels(layout: Layout) -> Labels:
    return Labels.of(layout)


def test_the_records_are_the_maps_voxels_in_the_order_of_drawing(layout: Layout, room: AVLMap) -> None:
    records = np.frombuffer(layout.records, RECORD)
    assert len(records) == len(room.points)
    middles = np.column_stack([records["cell"] + 0.5, np.ones(len(records))])
    level = (middles @ layout.level_from_cells.T)[:, :3]
    np.testing.assert_allclose(level, room.space.level(room.points)[layout.order], atol=1e-6)
    np.testing.assert_array_equal(records["rgb"], room.colors[layout.order])
    seen_s = records["seen"] / 65535 * layout.duration_s
    np.testing.assert_allclose(seen_s, room.data.voxels.last_seen_s[layout.order], atol=layout.duration_s / 65535)


def test_heat_has_the_same_order_and_any_heat_is_seen(layout: Layout, room: AVLMap) -> None:
    heat = room.object("red", primary=True).shown
    drawn = np.frombuffer(as_bytes(heat[layout.order]), np.uint8)
    np.testing.assert_array_equal(drawn > 0, (heat > 0)[layout.order])
    np.testing.assert_allclose(drawn / 255, heat[layout.order], atol=1 / 255 + 1e-6)


def test_the_description_places_the_cameras_in_the_map(layout: Layout) -> None:
    told = layout.describe()
    assert told["voxels"] == len(layout) == told["levels"][-1][0]
    low, high = np.array(told["low"]), np.array(told["high"])
    for frame in told["keyframes"]:
        assert (np.array(frame["position"])[:2] > low[:2]).all() and (np.array(frame["position"])[:2] < high[:2]).all()
        np.testing.assert_allclose(np.cross(frame["right"], frame["down"]), frame["ahead"], atol=1e-3)
    assert told["floor_m"] == pytest.approx(0.0, abs=0.15) and told["floor_m"] < told["ceiling_m"]


def test_the_description_of_a_map_of_several_storeys_cuts_each_out(layout: Layout, room: AVLMap) -> None:
    assert "storeys" not in layout.describe()
    two = copy(room)
    two.storeys = Storeys((Storey(0, 0.0, -np.inf, 2.6), Storey(1, 2.8, 2.6, np.inf)))
    ground, first = Layout(two).describe()["storeys"]
    assert (ground["name"], first["name"]) == ("ground floor", "first floor")
    assert ground["cut"][0] < ground["floor_m"] < ground["cut"][1] == pytest.approx(2.3)
    assert first["cut"][0] == first["low_m"] == 2.6
    assert all(np.isfinite(one["cut"]).all() for one in (ground, first))


def test_each_voxel_of_a_thing_has_the_things_label(layout: Layout, labels: Labels) -> None:
    assert labels.voxels.shape == (len(layout), 4)
    by_row = np.zeros(len(layout), np.uint8)
    by_row[layout.order] = labels.voxels[:, 0]
    assert (by_row > 0).sum() == len(np.unique(np.concatenate([thing.rows for thing in labels.things])))
    first = labels.things[0]
    assert labels.names[np.bincount(by_row[first.rows]).argmax() - 1] == first.name


def test_contents_are_described_with_boxes_round_their_voxels(layout: Layout, labels: Labels) -> None:
    told = labels.describe(layout)
    assert len(told["things"]) == len(labels.things) > 0
    for told_thing, thing in zip(told["things"], labels.things, strict=True):
        sides = np.array(told_thing["high"]) - told_thing["low"]
        np.testing.assert_allclose(sides, thing.size, atol=1e-3)
    assert len(told["sounds"]) == 1 and "clip" not in told["sounds"][0]


def test_a_keyframe_saw_what_stood_open_before_it_and_nothing_behind_a_wall(room: AVLMap) -> None:
    stored = room.data
    number = len(stored.keyframes) // 2
    pose = np.asarray(stored.keyframes.world_from_camera[number])
    start, ahead = pose[:3, 3], pose[:3, 2]
    along = start + np.arange(0.2, 8.0, 0.02)[:, None] * ahead
    cells = np.floor(along / room.space.grid.voxel_size_m).astype(int)
    first = cells[np.flatnonzero(room.space.rows_of(cells) >= 0)[0]]
    row = int(np.flatnonzero((np.asarray(room.space.index) == first).all(axis=1))[0])
    assert number in keyframes_that_saw(room, room.space, row)
    behind = int(np.argmin((room.points - start) @ ahead))
    assert ((room.points[behind] - start) @ ahead) < 0
    assert number not in keyframes_that_saw(room, room.space, behind)
