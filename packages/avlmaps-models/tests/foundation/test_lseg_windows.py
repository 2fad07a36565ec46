"""The windows through which LSeg sees a picture, against a dense way that builds everything."""

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn.functional import interpolate

from avlmaps_models.paper.lseg_windows import Windows, cut_into_windows, every_nth, joined, resized_size

CPU = torch.device("cpu")
SIDES = st.integers(40, 700)


def dense(windows: Windows, features: torch.Tensor) -> torch.Tensor:
    """Return (h, w, d) of every pixel: each window doubled whole, summed up, divided by how many saw it."""
    height, width = windows.padded
    total, count = torch.zeros(features.shape[1], height, width), torch.zeros(height, width)
    for (top, left), one in zip(windows.corners, features, strict=True):
        doubled = interpolate(one[None], (480, 480), mode="bilinear", align_corners=True)[0]
        rows, columns = min(480, height - top), min(480, width - left)
        total[:, top : top + rows, left : left + columns] += doubled[:, :rows, :columns]
        count[top : top + rows, left : left + columns] += 1
    assert (count > 0).all()
    return (total / count)[:, : windows.size[0], : windows.size[1]].permute(1, 2, 0)


@pytest.mark.parametrize(
    ("width", "height", "size", "corners"),
    [
        (640, 480, (390, 520), [(0, 0), (0, 320)]),
        (1080, 720, (347, 520), [(0, 0), (0, 320)]),
        (480, 640, (520, 390), [(0, 0), (320, 0)]),
        (100, 100, (520, 520), [(0, 0), (0, 320), (320, 0), (320, 320)]),
        (520, 480, (480, 520), [(0, 0), (0, 320)]),
        (3000, 2, (1, 520), [(0, 0), (0, 320)]),
    ],
)
def test_pictures_are_cut_as_the_published_code_cuts_them(
    width: int, height: int, size: tuple[int, int], corners: list[tuple[int, int]]
) -> None:
    windows = cut_into_windows(np.zeros((height, width, 3), np.uint8), CPU)
    assert windows.size == size == resized_size(height, width)
    assert list(windows.corners) == corners
    assert windows.pixels.shape == (len(corners), 3, 480, 480)


def test_a_picture_of_the_working_size_is_taken_as_it_is_and_padded_with_black() -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (390, 520, 3), np.uint8)
    windows = cut_into_windows(rgb, CPU)
    expected = torch.from_numpy(rgb).permute(2, 0, 1) / 127.5 - 1.0
    torch.testing.assert_close(windows.pixels[0, :, :390], expected[:, :, :480], atol=1e-5, rtol=0.0)
    torch.testing.assert_close(windows.pixels[1, :, :390, :200], expected[:, :, 320:], atol=1e-5, rtol=0.0)
    assert (windows.pixels[:, :, 390:] == -1.0).all()
    assert (windows.pixels[1, :, :, 200:] == -1.0).all()


@given(SIDES, SIDES, st.integers(1, 5))
@settings(max_examples=8, deadline=None)
def test_some_pixels_have_what_all_of_them_have(height: int, width: int, every: int) -> None:
    windows = cut_into_windows(np.zeros((height, width, 3), np.uint8), CPU)
    features = torch.randn(len(windows.corners), 3, 240, 240, generator=torch.Generator().manual_seed(3))
    rows, columns = every_nth(windows.size, every)
    sampled = joined(windows, features, rows, columns)
    torch.testing.assert_close(sampled, dense(windows, features)[rows][:, columns], rtol=1e-5, atol=2e-5)


def test_what_all_windows_agree_on_is_kept() -> None:
    windows = cut_into_windows(np.zeros((600, 500, 3), np.uint8), CPU)
    features = torch.full((len(windows.corners), 2, 240, 240), 3.0)
    torch.testing.assert_close(
        joined(windows, features, *every_nth(windows.size, 7)), torch.full((75, 62, 2), 3.0), rtol=0.0, atol=1e-5
    )


@given(st.integers(1, 520), st.integers(1, 520), st.integers(1, 4))
def test_the_chosen_pixels_cover_the_picture_evenly(height: int, width: int, every: int) -> None:
    for chosen, length in zip(every_nth((height, width), every), (height, width), strict=True):
        assert len(chosen) == -(-length // every)
        middles = (np.arange(len(chosen)) + 0.5) * length / len(chosen)
        assert (np.abs(chosen + 0.5 - middles) <= 0.5).all()
        assert (np.diff(chosen) >= 1).all()
