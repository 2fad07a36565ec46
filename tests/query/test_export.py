"""Exports are read back by other libraries: points, blocks, an occupancy grid and a table."""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import furnished_map

from avlmaps.core.errors import QueryError
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.obstacles import CellState, Obstacles
from avlmaps.perception.embedded.colours import COLOURS, memberships
from avlmaps.query.export import (
    heat_colors,
    palette,
    shades_of,
    thing_colors,
    voxel_mesh,
    write_glb,
    write_occupancy,
    write_ply,
    write_table,
)
from avlmaps.query.voxel_space import Space


def _space(index: np.ndarray) -> Space:
    return Space(GridSpec(0.05), index, np.array([0.0, 0.0, 1.0]))


CELLS = st.sets(st.tuples(*[st.integers(-4, 4)] * 3), min_size=1, max_size=40)


def test_a_ply_holds_the_points_colours_and_columns(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    space = _space(np.argwhere(rng.random((8, 8, 8)) < 0.1))
    colors = rng.integers(0, 256, (len(space), 3)).astype(np.uint8)
    write_ply(tmp_path / "a.ply", space, colors, {"heat": np.linspace(0, 1, len(space))})
    read = trimesh.load(tmp_path / "a.ply")
    np.testing.assert_allclose(np.asarray(read.vertices), space.centres, atol=1e-6)
    np.testing.assert_array_equal(np.asarray(read.colors)[:, :3], colors)
    assert b"property float heat" in (tmp_path / "a.ply").read_bytes()


@given(CELLS)
def test_the_mesh_of_voxels_is_closed_and_has_their_volume(cells: set[tuple[int, int, int]]) -> None:
    index = np.array(sorted(cells))
    vertices, triangles, _ = voxel_mesh(_space(index), np.zeros((len(index), 3), np.uint8))
    a, b, c = (vertices[triangles[:, k]].astype(np.float64) for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(len(index) * 0.05**3, rel=1e-4)
    assert np.allclose(np.cross(b - a, c - a).sum(axis=0), 0.0, atol=1e-7), "what looks one way has a counterpart"


def test_no_face_lies_between_two_voxels() -> None:
    _, two, _ = voxel_mesh(_space(np.array([[0, 0, 0], [1, 0, 0]])), np.zeros((2, 3), np.uint8))
    assert len(two) == 2 * (6 + 6 - 2)


def test_a_glb_has_the_maps_extent_and_colours(tmp_path: Path) -> None:
    opened = furnished_map()
    write_glb(tmp_path / "a.glb", opened.space, opened.colors)
    read = trimesh.load(tmp_path / "a.glb", force="mesh")
    np.testing.assert_allclose(read.bounds, [[0.0, 0.0, 0.0], [6.0, 4.0, 0.45]], atol=1e-5)
    assert tuple(np.asarray(read.visual.vertex_colors)[0, :3]) == (120, 90, 60)


def test_a_map_without_voxels_has_no_mesh(tmp_path: Path) -> None:
    with pytest.raises(QueryError, match="no voxels"):
        write_glb(tmp_path / "a.glb", _space(np.zeros((0, 3), int)), np.zeros((0, 3), np.uint8))


def test_the_occupancy_grid_lies_as_map_server_reads_it(tmp_path: Path) -> None:
    states = np.full((4, 3), CellState.UNKNOWN, np.uint8)
    states[0, 0], states[3, 2] = CellState.FREE, CellState.OCCUPIED
    grid = Obstacles(np.eye(3), np.array([-1.0, 2.0]), 0.05, 0.1, states)
    picture, described = write_occupancy(tmp_path / "floor.pgm", grid)
    read = cv2.imread(str(picture), cv2.IMREAD_UNCHANGED)
    assert read.shape == (3, 4)
    assert (read[2, 0], read[0, 3], read[1, 1]) == (254, 0, 205), "cell (0, 0) is at the bottom left"
    text = described.read_text()
    assert "image: floor.pgm" in text
    assert "origin: [-1.000000, 2.000000, 0.0]" in text
    assert "resolution: 0.05" in text


def test_the_table_has_a_row_for_each_thing(tmp_path: Path) -> None:
    opened = furnished_map()
    things = opened.things(least_confidence=0.0)
    write_table(tmp_path / "a.csv", [thing.to_json() for thing in things], [one.to_json() for one in opened.sounds()])
    rows = list(csv.DictReader((tmp_path / "a.csv").open()))
    assert [row["name"] for row in rows] == [thing.name for thing in things]
    assert float(rows[0]["x_m"]) == pytest.approx(things[0].position[0], abs=1e-3)


def test_colours_tell_things_and_heat_apart() -> None:
    opened = furnished_map()
    things = opened.things(least_confidence=0.0)
    colors = thing_colors(len(opened.space), things)
    chair, table = (next(t for t in things if t.name == name) for name in ("chair", "table"))
    assert len({tuple(c) for c in colors[chair.rows]}) == 1
    assert tuple(colors[chair.rows[0]]) != tuple(colors[table.rows[0]])
    hot = heat_colors(np.array([0.0, 0.5, 1.0], np.float32))
    assert tuple(hot[0]) == (170, 170, 170)
    assert hot[2].sum() > hot[1].sum()


def test_a_file_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(QueryError, match="cannot be written"):
        write_ply(tmp_path / "file" / "a.ply", _space(np.zeros((1, 3), int)), np.zeros((1, 3), np.uint8))


def test_the_name_of_a_colour_is_drawn_in_it_and_others_as_before() -> None:
    names = (*COLOURS, "sofa")
    shades = shades_of(names)
    taken = memberships(shades[:-1] / 255.0)[:, : len(COLOURS)].argmax(axis=1)
    assert [COLOURS[row] for row in taken] == list(COLOURS)
    np.testing.assert_array_equal(shades[-1], palette(len(names))[-1])
