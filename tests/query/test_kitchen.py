"""Questions to a map of the real kitchen: what is there is found, what is not there is said to be absent."""

from types import SimpleNamespace

import numpy as np
import pytest
from query_fakes import asked, fake_map

from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.grid import GridSpec
from avlmaps.perception.embedded.colours import ColourWords
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording

# Up was found from the planes of the whole recording; the camera looked down by some 27 degrees.
UP = np.array([0.0, -0.891, -0.453])


@pytest.fixture(scope="module")
def kitchen(shared_data) -> AVLMap:
    recording, encoder = open_recording(shared_data / "data/redkitchen"), ColourWords()
    fused = VoxelAccumulator(GridSpec(0.05), encoder.card.dim)
    for index in range(0, len(recording), 20):
        frame = recording.frame(index)
        fused.add(frame, encoder.encode(frame))
    stored = fake_map(fused.voxels(), encoders=SimpleNamespace(pixels=encoder))
    stored.data.up_in_world = UP / np.linalg.norm(UP)
    return asked(stored)


def test_what_is_red_is_the_cabinets_and_large(kitchen: AVLMap) -> None:
    heat = kitchen.object("red cabinet", primary=True)
    goal = heat.goals()[0]
    assert not heat.found, "a colour is no cabinet"
    assert heat.factors[0].understood == "red"
    assert goal.score > 0.6
    assert max(goal.size[:2]) > 1.5  # they run along two walls
    assert goal.size[2] < 1.2


@pytest.mark.parametrize("phrase", ["red thing", "brown things", "grey", "something white", "purple object"])
def test_colours_that_are_there_are_found(kitchen: AVLMap, phrase: str) -> None:
    assert kitchen.object(phrase).found


@pytest.mark.parametrize("phrase", ["green plant", "orange lamp", "light green towel", "light red curtain"])
def test_colours_that_are_not_there_are_absent(kitchen: AVLMap, phrase: str) -> None:
    heat = kitchen.object(phrase)
    assert not heat.found
    assert all(goal.score < 0.5 for goal in heat.goals())
