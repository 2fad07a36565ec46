"""The geometry of a whole batch is that of the running system, frame by frame."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")
from training.pixels.batches import Frames, View, draw_batch  # noqa: E402
from training.pixels.shape import channels_of  # noqa: E402

from avlmaps.core.camera import Pinhole  # noqa: E402
from avlmaps.perception.embedded.scene_network import channels  # noqa: E402

UP = ((0.0, -1.0, 0.0), (0.3, -0.8, -0.5), (0.0, -0.02, -1.0))


def room(rng: np.random.Generator) -> np.ndarray:
    """Return a floor, a wall and boxes before it, some of it without depth."""
    rows = np.mgrid[0:60, 0:100][0]
    depth = np.minimum(3.0, 90.0 / np.maximum(rows - 25.0, 1.0))
    for _ in range(4):
        row, column = rng.integers(0, 50), rng.integers(0, 80)
        depth[row : row + 15, column : column + 20] = rng.uniform(0.8, 2.8)
    depth += rng.normal(0.0, 0.004, depth.shape)
    depth[rng.random(depth.shape) < 0.05] = 0.0
    return depth.astype(np.float32)


def test_it_agrees_with_the_running_system_and_is_zero_in_the_margin() -> None:
    rng = np.random.default_rng(0)
    pictures, cameras = [], []
    for up in UP:
        pictures.append(room(rng))
        cameras.append([*rng.uniform(60, 110, 2), *rng.uniform(20, 60, 2), *np.array(up) / np.linalg.norm(up), 1.2])
    depth, camera = np.stack(pictures), np.array(cameras, np.float32)
    found = channels_of(torch.from_numpy(depth), torch.from_numpy(camera), 32).numpy()
    assert found.shape == (3, 8, 64, 128)
    assert not found[:, :, 60:].any() and not found[:, :, :, 100:].any()
    for one, picture, numbers in zip(found, depth, camera.astype(float), strict=True):
        expected = channels(picture, Pinhole(*numbers[:4], 100, 60), numbers[4:7], numbers[7])
        differs = np.abs(one[:, :60, :100] - expected) > 2e-3
        # A step that is as large as an edge's to the last bit may fall on either side.
        assert differs.mean() < 1e-3


class _Floor:
    """A source of one frame: an endless floor under a camera that looks down at it."""

    def __init__(self) -> None:
        rise = (np.mgrid[0:240, 0:320][0] + 0.5 - 120) / 280
        up = np.array([0.0, -np.cos(0.6), -np.sin(0.6)])
        down = -(rise * up[1] + up[2])
        depth = np.where(down > 0.1, 1300.0 / np.maximum(down, 0.1), 0.0)
        self.frames = Frames(
            depth=depth.astype(np.uint16)[None],
            label=np.zeros((1, 240, 320), np.uint8),
            rgb=np.zeros((0, 240, 320, 3), np.uint8),
            rgb_row=-np.ones(1, np.int32),
            room=np.zeros((1, 16), np.float32),
            camera=np.array([[280.0, 280.0, 160.0, 120.0, *up, 1.3]]),
        )

    def draw_category(self, rng: np.random.Generator) -> tuple[Frames, int, int]:
        rng.random()
        return self.frames, 0, -1


def test_a_floor_stays_a_floor_however_a_view_is_turned_zoomed_and_mirrored(monkeypatch: pytest.MonkeyPatch) -> None:
    """Depth and the camera that goes with it are drawn apart; here they must meet again."""
    monkeypatch.setattr("training.pixels.batches.degraded", lambda depth, real, rng: depth)
    monkeypatch.setattr("training.pixels.batches.mistaken", lambda up, known, rng: (up, 0.0))
    drawn = draw_batch([(_Floor(), 24)], View(), np.random.default_rng(3))
    seen = channels_of(torch.from_numpy(drawn.depth), torch.from_numpy(drawn.camera), 32).numpy()
    there = seen[:, 6] > 0.0
    assert there.mean() > 0.5
    assert np.abs(seen[:, 2][there]).max() < 0.06  # of pixels that are sampled, not interpolated
    assert np.median(seen[:, 3][there]) > 0.99
