"""A real hand-held walk, a few frames of it, from the camera's files to an opened map."""

from pathlib import Path

import numpy as np
import pytest

from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings, FrameSettings
from avlmaps.maps.store.map_data import MapData, describe
from avlmaps.perception.encoders import Encoders, register_profile
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Subset

# Normal of the floor and the table, measured on all 500 frames; the world is the first camera's.
UP_IN_WORLD = np.array([0.0, -0.892, -0.452])


@pytest.fixture(scope="module")
def kitchen(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> MapData:
    register_profile(Encoders("seeing", pixels="colours", local="xfeat", place="xfeat", matcher="xfeat"))
    walk = Subset(open_recording(shared_data / "data" / "redkitchen"), range(0, 500, 50))
    path = tmp_path_factory.mktemp("maps") / "kitchen.avlmap"
    return build_map(walk, path, "seeing", BuildSettings(frames=FrameSettings(per_part=4)), progress=False)


@pytest.mark.nightly
@pytest.mark.shared
def test_the_kitchen_is_of_a_kitchens_size_and_stands_upright(kitchen: MapData) -> None:
    assert kitchen.info.counts.frames == 10
    low, high = describe(Path("kitchen.avlmap"), kitchen)["bounding_box_m"]
    assert (np.subtract(high, low) > 1.5).all() and (np.subtract(high, low) < 9.0).all()
    assert np.degrees(np.arccos(kitchen.up_in_world @ (UP_IN_WORLD / np.linalg.norm(UP_IN_WORLD)))) < 5.0
    assert kitchen.info.up.known_from == "planes" and kitchen.info.counts.voxels > 5_000


@pytest.mark.nightly
@pytest.mark.shared
def test_its_keyframes_keep_points_where_their_cameras_looked(kitchen: MapData) -> None:
    keyframes = kitchen.keyframes
    assert len(keyframes) >= 8 and keyframes.offsets[-1] > 100 * len(keyframes)
    points = keyframes.points_world[np.isfinite(keyframes.points_world).all(axis=1)]
    occupied = {tuple(index) for index in kitchen.voxels.index.tolist()}
    seen = [tuple(index) in occupied for index in kitchen.grid.index_of(points).tolist()]
    assert np.mean(seen) > 0.7
    assert kitchen.place_state and np.allclose(np.linalg.norm(keyframes.place, axis=1), 1.0, atol=1e-3)
