"""One frame in each answer, picture and file: the recording's, or the level one, here turned against one another."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import asked, furnished_map

from avlmaps.core.poses import FrameName
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.export import write_glb, write_ply, write_table
from avlmaps.query.places import answer_in
from avlmaps.query.plots import picture_frame

UPS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda up: np.linalg.norm(up) > 0.1)


def tilted(up: Any) -> AVLMap:
    """Return the furnished map in a world where up is another direction."""
    stored = furnished_map()
    stored.data.up_in_world = np.asarray(up, np.float64) / np.linalg.norm(up)
    return asked(stored)


@given(UPS, st.lists(st.tuples(*[st.floats(-50.0, 50.0)] * 3), min_size=1, max_size=4))
def test_positions_poses_and_sentences_turn_together_and_sizes_stay(up: Any, places: list[Any]) -> None:
    space = tilted(up).space
    pose = np.eye(4)
    pose[:3, 3] = places[0]
    spoken = "(" + ", ".join(f"{value:.2f}" for value in places[0]) + ")"
    answer = {
        "goals": [{"position": list(place), "size": [1.0, 2.0, 3.0]} for place in places],
        "world_from_camera": pose.tolist(), "text": f"It is at {spoken} m.", "frame": "recording",
    }  # fmt: skip
    before = json.dumps(answer)
    turned = answer_in(answer, FrameName.LEVEL, space.level_from_recording)
    level = space.level(np.array(places))
    np.testing.assert_allclose([goal["position"] for goal in turned["goals"]], level, atol=1e-9)
    np.testing.assert_allclose(np.array(turned["world_from_camera"])[:3, 3], level[0], atol=1e-9)
    said = [float(value) for value in re.findall(r"-?\d+\.\d+", turned["text"])]
    np.testing.assert_allclose(said, level[0], atol=0.02)  # the sentence has two digits, before and after
    assert [goal["size"] for goal in turned["goals"]] == [[1.0, 2.0, 3.0]] * len(places)
    assert turned["frame"] == "level"
    assert json.dumps(answer) == before
    assert answer_in(answer, FrameName.RECORDING, space.level_from_recording) == answer


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (0.2, 0.3, 0.9)])
def test_a_glb_stands_upright_with_y_up_and_says_so(up: tuple[float, ...], tmp_path: Path) -> None:
    avlmap = tilted(up)
    write_glb(tmp_path / "a.glb", avlmap.space, avlmap.colors, FrameName.LEVEL)
    read = trimesh.load_scene(tmp_path / "a.glb")
    level = avlmap.space.level(avlmap.space.centres)
    corners = (
        np.array([[a, b, c] for a in (-0.5, 0.5) for b in (-0.5, 0.5) for c in (-0.5, 0.5)])
        * avlmap.space.grid.voxel_size_m
    )
    reach = np.abs(avlmap.space.level_from_world @ corners.T).max(axis=1)
    low, high = level.min(axis=0) - reach, level.max(axis=0) + reach
    np.testing.assert_allclose(read.bounds, [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]], atol=1e-4)
    assert read.metadata["frame"] == "level, y up"
    np.testing.assert_allclose(read.metadata["level_from_recording"], avlmap.space.level_from_recording, atol=1e-8)


def test_ply_and_csv_say_their_frame(tmp_path: Path) -> None:
    avlmap = tilted((0.2, 0.3, 0.9))
    things = avlmap.things(least_confidence=0.0)
    for frame, at in ((FrameName.RECORDING, avlmap.points), (FrameName.LEVEL, avlmap.space.level(avlmap.points))):
        write_ply(tmp_path / "a.ply", avlmap.space, avlmap.colors, None, frame)
        head = (tmp_path / "a.ply").read_bytes().partition(b"end_header")[0].decode().splitlines()
        assert f"comment metres, {frame} frame" in head
        (matrix,) = [line.split()[2:] for line in head if "level_from_recording" in line]
        stated = np.array(matrix, float).reshape(4, 4)
        np.testing.assert_allclose(stated, avlmap.space.level_from_recording, atol=1e-8)
        read: Any = trimesh.load(tmp_path / "a.ply")
        np.testing.assert_allclose(np.asarray(read.vertices), at, atol=1e-5)
        told = {"frame": "recording", "things": [thing.to_json() for thing in things]}
        told = answer_in(told, frame, avlmap.space.level_from_recording)
        write_table(tmp_path / "a.csv", told["things"], [], told["frame"])
        rows = list(csv.DictReader((tmp_path / "a.csv").open()))
        assert {row["frame"] for row in rows} == {str(frame)} and {row["size_frame"] for row in rows} == {"level"}
        given_at = np.array([thing.position for thing in things])
        expected = given_at if frame is FrameName.RECORDING else avlmap.space.level(given_at)
        np.testing.assert_allclose([[float(row[f"{axis}_m"]) for axis in "xyz"] for row in rows], expected, atol=6e-4)


@pytest.mark.parametrize(("up", "frame"), [((0, 0, 1), "recording"), ((0, -1, 0), "level"), ((1, 1, 1), "level")])
def test_a_picture_has_one_frame_and_names_it(up: tuple[int, ...], frame: str) -> None:
    avlmap = tilted(up)
    assert picture_frame(avlmap.space) == frame
    heat = avlmap.object("chair", primary=True)
    figure = heat.plot()
    ax = figure.axes[-2] if len(figure.axes) > 1 else figure.axes[0]
    named = [axis.get_label_text() for axis in (ax.xaxis, ax.yaxis)]
    assert all(("level frame" in name) == (frame == "level") for name in named), named
    first = heat.goals()[0].position
    shown = avlmap.space.level(np.array(first)) if frame == "level" else np.array(first)
    texts = [text.get_text() for one in figure.axes for legend in [one.get_legend()] if legend for text in legend.texts]
    wanted = ", ".join(f"{value:.2f}" for value in shown)
    assert any(wanted in text and ("level frame" in text) == (frame == "level") for text in texts), texts
