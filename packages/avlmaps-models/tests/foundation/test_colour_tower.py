"""The tower on colour: a network with one begins as the network without, and sees the same view twice as fine."""

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")
from training.pixels.batches import Frames, View, draw_batch  # noqa: E402
from training.pixels.light import in_other_light  # noqa: E402
from training.pixels.network import RoomNetwork  # noqa: E402
from training.pixels.tower import TOWER_WIDTHS, Tower  # noqa: E402

CATEGORIES, ROOMS = 7, 3


def test_it_begins_as_the_network_without() -> None:
    torch.manual_seed(0)
    plain = RoomNetwork(CATEGORIES, ROOMS).eval()
    towered = RoomNetwork(CATEGORIES, ROOMS, has_tower=True).eval()
    own = towered.state_dict()
    towered.load_state_dict({**own, **plain.state_dict()})
    geometry, colour = torch.randn(2, 8, 64, 96), torch.randn(2, 3, 128, 192)
    with torch.no_grad():
        expected = plain(geometry, torch.nn.functional.avg_pool2d(colour, 2))
        for one, other in zip(towered(geometry, colour), expected, strict=True):
            torch.testing.assert_close(one, other, rtol=1e-4, atol=1e-4)


def test_what_leaves_the_tower_has_the_sizes_that_the_network_meets() -> None:
    tower = Tower().train()
    leaving = tower(torch.randn(1, 3, 64, 96))
    assert [tuple(x.shape[1:]) for x in leaving] == [
        (width, 64 // stride, 96 // stride) for width, stride in zip(TOWER_WIDTHS, (4, 8, 16, 32), strict=True)
    ]
    assert not any(module.training for module in tower.modules() if isinstance(module, torch.nn.BatchNorm2d))


class _OneFrame:
    """A source of one frame: a ramp of colour, at one depth."""

    def __init__(self) -> None:
        rows, columns = np.mgrid[0:240, 0:320]
        ramp = np.stack([columns * 0.7, rows * 0.9, 0.3 * (rows + columns)], axis=-1).astype(np.uint8)
        self.frames = Frames(
            depth=np.full((1, 240, 320), 2000, np.uint16),
            label=np.zeros((1, 240, 320), np.uint8),
            rgb=ramp[None],
            rgb_row=np.zeros(1, np.int32),
            room=np.zeros((1, 16), np.float32),
            camera=np.array([[280.0, 280.0, 160.0, 120.0, 0.0, -1.0, 0.0, 1.3]]),
        )

    def draw_category(self, rng: np.random.Generator) -> tuple[Frames, int, int]:
        rng.random()
        return self.frames, 0, -1


def test_the_finer_colour_shows_the_same_view() -> None:
    view = View(colour_kept=1.1)
    for seed in range(5):
        coarse = draw_batch([(_OneFrame(), 1)], view, np.random.default_rng(seed)).rgb[0]
        fine = draw_batch([(_OneFrame(), 1)], replace(view, fineness=2), np.random.default_rng(seed)).rgb[0]
        assert fine.shape == (240, 320, 3)
        pooled = fine.reshape(120, 2, 160, 2, 3).mean(axis=(1, 3))
        # Where the view leaves the frame both show grey; the seam and the blur of the coarse one differ.
        assert np.median(np.abs(pooled - coarse)) < 2.6


def test_withheld_colour_and_the_margin_are_zero_in_any_light() -> None:
    rgb = torch.randint(0, 256, (6, 30, 40, 3), dtype=torch.uint8)
    kept = torch.tensor([1.0, 0.0, 1.0, 0.0, 1.0, 1.0])
    x = in_other_light(rgb, kept, 32, torch.Generator().manual_seed(1))
    assert x.shape == (6, 3, 32, 64)
    assert bool((x[kept == 0.0] == 0.0).all())
    assert bool((x[:, :, 30:] == 0.0).all()) and bool((x[:, :, :, 40:] == 0.0).all())
    assert float(x.abs().max()) <= 1.4 + 1e-6
    assert all(float(x[i].std()) > 0.05 for i in (0, 2, 4, 5))


def test_light_of_a_seed_is_the_same_light() -> None:
    rgb = torch.randint(0, 256, (3, 16, 16, 3), dtype=torch.uint8)
    one, other = (in_other_light(rgb, torch.ones(3), 16, torch.Generator().manual_seed(7)) for _ in range(2))
    torch.testing.assert_close(one, other)
    assert not torch.equal(one, in_other_light(rgb, torch.ones(3), 16, torch.Generator().manual_seed(8)))
