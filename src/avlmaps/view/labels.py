"""One map on the page: its things, sounds, rooms and sources, what each voxel is, and the heat of an answer."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Int, UInt8

from avlmaps.core.arrays import Bool, Float
from avlmaps.core.errors import AvlmapsError, QueryError
from avlmaps.maps.sources.candidates import CELL_M
from avlmaps.query.contents import joined, listed_rooms, own_names_of
from avlmaps.query.export import heat_colors, shades_of
from avlmaps.query.words import VoxelNamer, keyframes_that_saw
from avlmaps.view.layout import Layout, as_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from avlmaps.maps.sources.candidates import CandidateGrid
    from avlmaps.query.answer import Answer
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Room, SoundEvent, Thing


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
    if avlmap.data.sources is None:
        return []
    known = avlmap.source_map
    told: list[dict[str, Any]] = []
    for source in avlmap.sources():
        joined = known.joined(source.events, source.name)
        height = float(avlmap.space.level(np.array(source.position))[2])
        regions = [
            {
                "probability": share,
                "outlines": [_placed(one, height) for one in _outlines(joined.density.region(share), known.plan)],
            }
            for share in SHARES
        ]
        told.append(source.to_json() | {"regions": regions})
    return told


def _outlines(cells: Bool[np.ndarray, "nx ny"], plan: "CandidateGrid") -> Iterator[Float[np.ndarray, "k 2"]]:
    from scipy.ndimage import label

    from avlmaps.query.floor_plan import outline

    pieces, count = label(cells)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)[1:]
    for number in np.argsort(-sizes, kind="stable")[:_MOST_PIECES].tolist():
        if sizes[number] >= min(_LEAST_CELLS, int(sizes.max())):
            yield (outline(pieces == number + 1, _LOOSE_CELLS, _MOST_CORNERS) + plan.low) * CELL_M


def _placed(corners: Float[np.ndarray, "k 2"], height: float) -> list[list[float]]:
    return [[round(float(x), 3), round(float(y), 3), round(height, 3)] for x, y in corners]


NONE = 0
"""The label of a voxel that is no thing, in no room, or without a name; others count from 1."""
_MOST = 255
_GRAY = (150, 150, 150)


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """The contents of a map, and what each voxel is."""

    things: "tuple[Thing, ...]"  # most confident first
    sounds: "tuple[SoundEvent, ...]"  # in the order of their onset
    rooms: "tuple[Room, ...]"  # those with most views first
    sources: "tuple[dict[str, Any], ...]"  # where sounds came from; none where the map does not know
    # Labels count from 1 into these: of things in the order of their colours, of rooms, of voxels.
    names: tuple[str, ...]
    room_names: tuple[str, ...]
    voxel_names: tuple[str, ...]
    voxels: UInt8[np.ndarray, "n 4"]  # in the order of drawing: thing, room, name, confidence of the name
    notes: tuple[str, ...]  # one sentence each on what could not be computed

    @classmethod
    def of(cls, layout: Layout) -> "Labels":
        """Compute all; a map whose models are not here has less, and its notes say why."""
        avlmap, notes = layout.avlmap, []
        things = _or_note(avlmap.things, notes)
        sounds = _or_note(avlmap.sounds, notes)
        rooms = _or_note(avlmap.rooms, notes)
        sources = _or_note(lambda: drawn_sources(avlmap), notes)
        names = tuple(sorted({thing.name for thing in things}))[:_MOST]
        label = np.zeros(len(avlmap.space), np.uint8)
        for thing in reversed(things):  # the most confident is drawn last
            label[thing.rows] = 1 + names.index(thing.name) if thing.name in names else NONE
        room_names, room = _room_labels(avlmap, rooms, layout.order)
        voxel_names, best, confidence = _name_labels(avlmap, notes, layout.order)
        voxels = np.stack([label[layout.order], room, best, confidence], axis=1)
        return cls(
            tuple(things), tuple(sounds), tuple(rooms), tuple(sources), names, room_names, voxel_names, voxels,
            tuple(dict.fromkeys(notes)),
        )  # fmt: skip

    def describe(self, layout: Layout) -> dict[str, Any]:
        """Return things, sounds and rooms as the page reads them; boxes and places in the level frame."""
        level = layout.avlmap.space.level
        things = []
        for thing in self.things:
            points, half_m = level(thing.points), 0.5 * layout.avlmap.space.grid.voxel_size_m
            things.append(
                {
                    **thing.to_json(),
                    "label": 1 + self.names.index(thing.name) if thing.name in self.names else NONE,
                    "low": (points.min(axis=0) - half_m).round(4).tolist(),
                    "high": (points.max(axis=0) + half_m).round(4).tolist(),
                }
            )
        return {
            "things": things,
            "sounds": [
                {key: value for key, value in sound.to_json().items() if key != "clip"}
                | {"track": level(sound.track).round(4).tolist()}
                for sound in self.sounds
            ],
            "sources": list(self.sources),
            "rooms": [
                row | {"label": number if number <= _MOST else NONE}
                for number, row in enumerate(listed_rooms(self.rooms, layout.avlmap.storeys), 1)
            ],
            "names": list(self.names),
            "room_names": list(self.room_names),
            "voxel_names": list(self.voxel_names),
            "notes": list(self.notes),
        }


def palettes(labels: Labels | None = None) -> dict[str, list[int]]:
    """Return 256 colours each, red, green and blue in turn, for things, rooms, height and heat."""
    from matplotlib import colormaps

    ramp = np.linspace(0.0, 1.0, 256)
    heights = (255 * colormaps["viridis"](ramp)[:, :3]).round().astype(np.uint8)
    return {
        "thing": _padded(() if labels is None else labels.names),
        "room": _padded(() if labels is None else labels.room_names),
        "height": heights.ravel().tolist(),
        "heat": heat_colors(np.maximum(ramp, 1 / 255).astype(np.float32)).ravel().tolist(),
    }


def _padded(names: tuple[str, ...]) -> list[int]:
    colours = np.full((256, 3), _GRAY, np.uint8)
    colours[1 : 1 + len(names)] = shades_of(names)
    return colours.ravel().tolist()


def _or_note(find: "Callable[[], Sequence[Any]]", notes: list[str]) -> "Sequence[Any]":
    try:
        return find()
    except AvlmapsError as fault:
        notes.append(str(fault))
        return ()


def _room_labels(
    avlmap: "AVLMap", rooms: "Sequence[Room]", rows: Int[np.ndarray, " m"]
) -> tuple[tuple[str, ...], UInt8[np.ndarray, " m"]]:
    names = tuple(map(joined, own_names_of(rooms)))[:_MOST]
    regions = avlmap.room_regions
    if not names or not len(rows) or regions is None:
        return names, np.zeros(len(rows), np.uint8)
    label_of = np.full(len(regions) + 1, NONE, np.uint8)  # the last is that of no room
    label_of[[room.region for room in rooms[:_MOST]]] = 1 + np.arange(len(names))
    return names, label_of[regions.at(avlmap.space.centres_of(rows))]


def _name_labels(
    avlmap: "AVLMap", notes: list[str], rows: Int[np.ndarray, " m"]
) -> tuple[tuple[str, ...], UInt8[np.ndarray, " m"], UInt8[np.ndarray, " m"]]:
    """Give each of some voxels its likeliest name; where there are more than 255, the rarest are left out."""
    n = len(rows)
    try:
        namer = VoxelNamer(avlmap)
        number, confidence = namer.best(rows, avlmap.closest_words())
    except AvlmapsError as fault:
        notes.append(str(fault))
        return (), np.zeros(n, np.uint8), np.zeros(n, np.uint8)
    count = np.bincount(number[number >= 0], minlength=len(namer.names))
    kept: Int[np.ndarray, " k"] = np.argsort(-count, kind="stable")[:_MOST]
    kept = kept[count[kept] > 0]
    label_of = np.zeros(len(namer.names) + 1, np.uint8)  # the last is that of no name
    label_of[kept] = 1 + np.arange(len(kept))
    return (
        tuple(namer.names[k] for k in kept), label_of[number],
        np.round(255 * np.clip(confidence, 0.0, 1.0)).astype(np.uint8),
    )  # fmt: skip


TOP = 5  # goals on a page
_MOST_VIEWS = 12  # keyframes that are named of those which saw a voxel


class MapOnPage:
    """One map on the page, or in a file with up to ``most`` voxels. Safe to use from several threads."""

    def __init__(self, avlmap: "AVLMap", most: int | None = None) -> None:
        self.avlmap, self.layout = avlmap, Layout(avlmap, most)
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
