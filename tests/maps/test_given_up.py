"""An up direction that was given is held against the planes, the camera and the walk."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.maps.gravity import up_doubts
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Frame, Recording
from helpers.walked_room import shared_walk


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return open_recording(shared_walk(tmp_path_factory))


def doubts(recording: Recording, up: tuple[float, float, float] | None) -> tuple[str, ...]:
    recording.up_in_world = None if up is None else np.array(up) / np.linalg.norm(up)
    return tuple(map(str, up_doubts(recording)))


@pytest.mark.parametrize("up", [(0, 0, 1), (0.1, 0, 1), None])
def test_what_is_up_is_not_doubted(walk: Recording, up: tuple[float, float, float] | None) -> None:
    assert doubts(walk, up) == ()


@pytest.mark.parametrize("up", [(0, 1, 0), (1, 0, 0), (0, 0, -1), (0, 1, 1)])
def test_what_is_not_up_is_said_with_what_is(walk: Recording, up: tuple[float, float, float]) -> None:
    (said,) = doubts(walk, up)
    assert "Up is given as" in said and "Give Corrections.up_in_world=0.00,0.00,1.00" in said


def test_a_camera_on_its_side_is_believed_where_the_walk_is_level(walk: Recording) -> None:
    """Its planes say that a wall is a floor, and so does how it is held."""
    side = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])

    class OnItsSide(Recording):
        stamps_s, path, rig, audio, notices = walk.stamps_s, Path("side"), walk.rig, None, ()
        world_from_camera = walk.world_from_camera @ side
        up_in_world = np.array([0.0, 0.0, 1.0])
        fingerprint = ""

        def frame(self, index: int) -> Frame:
            seen = walk.frame(index)
            return replace(seen, world_from_camera=self.world_from_camera[index], depth_m=_turned(seen.depth_m))

    recording = OnItsSide()
    assert np.std(recording.world_from_camera[:, 2, 3]) < 0.05
    assert up_doubts(recording) == ()


def _turned(depth_m: np.ndarray) -> np.ndarray:
    """Turn the square in the middle with the camera, so that the intrinsics stay."""
    height, width = depth_m.shape
    square = depth_m[:, (width - height) // 2 : (width - height) // 2 + height]
    out = np.zeros_like(depth_m)
    out[:, (width - height) // 2 : (width - height) // 2 + height] = np.rot90(square)
    return out
