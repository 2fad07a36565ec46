"""Where sounds came from, as a page draws it: the regions that hold a source, and from where the robot heard it."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Bool, Float
from avlmaps.maps.sources.candidates import CELL_M

if TYPE_CHECKING:
    from avlmaps.maps.sources.density import Plan
    from avlmaps.query.avlmap import AVLMap

SHARES = (0.5, 0.9)
"""Probabilities with which the regions hold a source; the first lies within the others."""
_LEAST_CELLS = 4  # of a piece of a region that is drawn; others are specks
_LOOSE_CELLS, _MOST_CORNERS = 0.5, 80
_MOST_PIECES = 12


def drawn_sources(avlmap: "AVLMap") -> list[dict[str, Any]]:
    """Return the sources of a map's sounds, most confident first; none where it does not know where they came from.

    Each is as ``avlmaps sources --json`` prints it, with ``regions``: for each of ``SHARES`` the outlines of its
    pieces, places of the level frame (metres, at the height of the source).
    """
    if avlmap.stored.sources() is None:
        return []
    known = avlmap.source_map
    told: list[dict[str, Any]] = []
    for source in avlmap.sources():
        joined = known.joined(source.events, source.name)
        height = float(avlmap.space.level(np.array(source.position))[2])
        regions = [
            {"probability": share, "outlines": [_placed(corners, height) for corners in outlines]}
            for share in SHARES
            for outlines in [list(_outlines(joined.density.region(share), known.plan))]
        ]
        told.append(source.to_json() | {"regions": regions})
    return told


def _outlines(cells: Bool[np.ndarray, "nx ny"], plan: "Plan") -> Iterator[Float[np.ndarray, "k 2"]]:
    """Yield the corners of each piece of a region, level frame, the largest first."""
    from scipy.ndimage import label

    from avlmaps.query.raster import outline

    pieces, count = label(cells)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    for number in np.argsort(-sizes, kind="stable")[:_MOST_PIECES].tolist():
        if sizes[number] >= min(_LEAST_CELLS, int(sizes.max())):
            yield (outline(pieces == number + 1, _LOOSE_CELLS, _MOST_CORNERS) + plan.low) * CELL_M


def _placed(corners: Float[np.ndarray, "k 2"], height: float) -> list[list[float]]:
    return [[round(float(x), 3), round(float(y), 3), round(height, 3)] for x, y in corners]
