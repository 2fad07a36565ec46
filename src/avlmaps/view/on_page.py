"""One map on the page: how it is drawn, what is written on it, what a voxel is, and the heat of an answer."""

import threading
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.naming import VoxelNamer, keyframes_that_saw
from avlmaps.view.labels import Labels, palettes
from avlmaps.view.layout import Layout, as_bytes

if TYPE_CHECKING:
    from avlmaps.query.answer import Answer
    from avlmaps.query.contents import Thing

TOP = 5  # goals on a page
_MOST_VIEWS = 12  # keyframes that are named of those which saw a voxel


class MapOnPage:
    """One map on the page. Safe to use from several threads.

    Attributes:
        avlmap: the map.
        layout: how it is drawn.
    """

    def __init__(self, avlmap: AVLMap, most: int | None = None) -> None:
        """Lay out a map, for a file with up to ``most`` voxels."""
        self.avlmap = avlmap
        self.layout = Layout(avlmap, most)
        self._labels: Labels | None = None
        self._lock = threading.Lock()

    @property
    def labels(self) -> Labels:
        """Its contents; the first call computes them, others wait for it."""
        with self._lock:
            if self._labels is None:
                self._labels = Labels.of(self.layout)
            return self._labels

    @cached_property
    def _namer(self) -> VoxelNamer:
        return VoxelNamer(self.avlmap)

    def heat_of(self, answer: "Answer") -> bytes:
        """Return the heat of an answer at each voxel that is drawn, a byte each, in the order of drawing."""
        return bytes(len(self.layout)) if answer.heat is None else as_bytes(answer.heat.shown_at(self.layout.order))

    def describe_contents(self) -> dict[str, Any]:
        """Return things, sounds and rooms with the colours of the page."""
        labels = self.labels
        return labels.describe(self.layout) | {"palettes": palettes(labels)}

    def describe_voxel(self, drawn: int) -> dict[str, Any]:
        """Return what a voxel is taken for, by its number in the order of drawing."""
        if not 0 <= drawn < len(self.layout):
            raise QueryError(f"There is no voxel {drawn}; the map has {len(self.layout):,}.")
        row, avlmap = int(self.layout.order[drawn]), self.avlmap
        names: list[tuple[str, float]] = []
        note, calibrated = "", True
        try:
            names, calibrated = self._namer.likeliest(row), self._namer.calibrated
        except AvlmapsError as fault:
            note = str(fault)
        if (said := avlmap.edited.named_at(np.array([row]))) is not None:
            names = [(said, 1.0), *names]
        views = keyframes_that_saw(avlmap, avlmap.space, row)
        voxels = avlmap.data.voxels
        thing = self._thing_at(row)
        return {
            "position": [round(float(value), 4) for value in avlmap.points[row]],
            "color": [int(value) for value in voxels.rgb[row]],
            "names": [{"name": name, "confidence": round(share, 4)} for name, share in names],
            "calibrated": calibrated,
            "thing": None if thing is None else {"name": thing.name, "confidence": thing.confidence},
            "last_seen_s": round(float(voxels.last_seen_s[row]), 3),
            "pixels": int(voxels.hits[row]),
            "views": len(views),
            "seen_by": [int(number) for number in views[:_MOST_VIEWS]],
            "note": note,
        }

    def _thing_at(self, row: int) -> "Thing | None":
        if self._labels is None:  # not computed yet: nothing waits for it here
            return None
        return next((thing for thing in self._labels.things if (thing.rows == row).any()), None)
