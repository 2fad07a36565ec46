"""Tiles: every voxel is in one tile of each level, with its colour; coarser levels are means and maxima."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from avlmaps.serve.drawn import HEADER, SIDE, Level, Pyramid

INDICES = hnp.arrays(np.int32, st.tuples(st.integers(1, 60), st.just(3)), elements=st.integers(-200, 200)).map(
    lambda rows: np.unique(rows, axis=0)
)


def read(content: bytes) -> tuple[tuple, np.ndarray]:
    """Decode a tile by its documentation."""
    magic, version, level, stride, edge, x, y, z, count = HEADER.unpack_from(content)
    assert (magic, version) == (b"AVLT", 1)
    body = np.frombuffer(content, np.uint8, offset=HEADER.size).reshape(-1, stride)
    assert len(body) == count
    return (level, edge, np.array([x, y, z])), body


def whole(pyramid: Pyramid, level: int, heat: np.ndarray | None = None) -> dict[tuple[int, ...], tuple[int, ...]]:
    """Return colour (and heat) of each voxel of a level, from all its tiles."""
    found: dict[tuple[int, ...], tuple[int, ...]] = {}
    for i, j, k, count in pyramid.index("v")["levels"][level]["tiles"]:
        content = pyramid.tile(level, (i, j, k), heat)
        assert content is not None
        (_, edge, origin), body = read(content)
        assert len(body) == count
        np.testing.assert_allclose(origin, np.array([i, j, k]) * SIDE * edge, rtol=1e-5)
        for row in body:
            voxel = tuple(int(value) for value in row[:3].astype(int) + SIDE * np.array([i, j, k]))
            assert voxel not in found, "a voxel is in one tile only"
            found[voxel] = tuple(int(value) for value in row[3:])
    return found


@given(INDICES, st.integers(0, 2**32 - 1))
def test_the_finest_level_is_the_map(index: np.ndarray, seed: int) -> None:
    rgb = np.random.default_rng(seed).integers(0, 256, (len(index), 3), dtype=np.uint8)
    found = whole(Pyramid(index, rgb, 0.05), 0)
    assert found == {tuple(map(int, at)): tuple(map(int, colour)) for at, colour in zip(index, rgb, strict=True)}


@given(INDICES, st.integers(0, 2**32 - 1))
def test_a_coarser_voxel_has_the_mean_colour_and_the_highest_heat_of_its_own(index: np.ndarray, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rgb, heat = rng.integers(0, 256, (len(index), 3), dtype=np.uint8), rng.random(len(index), dtype=np.float32)
    pyramid = Pyramid(index, rgb, 0.05)
    if len(pyramid.levels) < 2:
        pyramid.levels.append(Level.of(index, rgb, 1))
    found = whole(pyramid, 1, heat)
    coarse = index >> 1
    for voxel, (r, g, b, hot) in found.items():
        mine = (coarse == np.array(voxel)).all(axis=1)
        assert mine.any()
        np.testing.assert_allclose([r, g, b], rgb[mine].mean(axis=0), atol=0.51)
        assert abs(hot - 255 * heat[mine].max()) <= 0.51
    assert len(found) == len(np.unique(coarse, axis=0))
