"""The network behind the embedded pixel and view encoders: how large it looks, and what it gives back."""

from importlib.resources import files

import msgspec
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.perception.embedded.scene_network import (
    DEFAULT_WEIGHTS,
    SYNTHETIC_WEIGHTS,
    at_working_size,
    checksum_of,
    load_network,
)
from avlmaps.recordings.types import Frame


def frame_of(width: int, height: int, focal_px: float) -> Frame:
    """Return a picture of a wall two metres ahead."""
    camera = Pinhole(focal_px, focal_px, width / 2, height / 2, width, height)
    rgb = np.full((height, width, 3), 128, np.uint8)
    return Frame(0, "0", 0.0, rgb, np.full((height, width), 2.0, np.float32), np.eye(4), Rig(camera, camera))


@given(
    st.integers(40, 700), st.integers(40, 500), st.floats(0.4, 4.0), st.sampled_from([120, 160, 240]), st.integers(1, 2)
)  # fmt: skip
@example(40, 40, 2.6964907678356185, 120, 1)  # 44.504 columns are 45
def test_a_picture_is_looked_at_no_wider_and_no_longer_than_the_network_knows(
    width: int, height: int, focal_per_width: float, width_px: int, fineness: int
) -> None:
    frame = frame_of(width, height, focal_per_width * width)
    camera, depth_m, rgb = at_working_size(frame, width_px, fineness)
    assert camera.width <= width_px
    assert camera.fx * (camera.width - 0.5) <= width_px * camera.width + 1e-6  # up to half a column of rounding
    assert depth_m.shape == (camera.height, camera.width)
    assert rgb.shape[:2] == (fineness * camera.height, fineness * camera.width)
    # The same rays: the field of view is kept.
    assert camera.width / camera.fx == pytest.approx(1 / focal_per_width)


@pytest.mark.parametrize("size", [(640, 480), (320, 240), (90, 70)])
def test_each_cell_is_a_distribution_on_a_grid_of_half_the_size(size: tuple[int, int]) -> None:
    network = load_network()
    frame = frame_of(*size, focal_px=size[0] * 0.9)
    camera, _, _ = at_working_size(frame, network.notes.width_px)
    seen = network.see(frame)
    assert seen.category.shape[:2] == seen.known.shape == ((camera.height + 1) // 2, (camera.width + 1) // 2)
    np.testing.assert_allclose(seen.category.sum(axis=-1), 1.0, atol=1e-4)
    assert seen.room.sum() == pytest.approx(1.0, abs=1e-4)
    assert seen.known.all()


@pytest.mark.parametrize("weights", [DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS])
def test_the_checksum_beside_the_weights_is_theirs(weights: str) -> None:
    notes = load_network(weights).notes
    content = (files("avlmaps.perception.embedded") / "weights" / f"{weights}.onnx").read_bytes()
    assert (known := notes.checksum) == checksum_of(content, notes)
    assert checksum_of(content, msgspec.structs.replace(notes, called={}, note="said otherwise")) == known
    assert checksum_of(content + b" ", notes) != known
    assert checksum_of(content, msgspec.structs.replace(notes, fineness=notes.fineness + 1)) != known
    assert checksum_of(content, msgspec.structs.replace(notes, temperature=notes.temperature + 0.1)) != known
