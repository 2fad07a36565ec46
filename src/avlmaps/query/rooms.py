"""What kind of room each place of a map is: views and things vote, and walls bound how far a vote reaches."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, Float64, Int
from avlmaps.core.lexicon import Entry, EntryKind, lexicon
from avlmaps.core.question import Part, Role
from avlmaps.maps.types import Keyframes
from avlmaps.perception.protocols import NamedViewEncoder, RoomContents, ScaledEncoder, ViewEncoder
from avlmaps.query.factors import Factor, NearAnchors, stretch_scores
from avlmaps.query.floor_plan import CELL_M, FloorPlan
from avlmaps.query.room_regions import NONE, RoomRegions
from avlmaps.query.settings import FEWEST_VIEWS, FOUND_AT, LEAST_PART, AreaSettings, HeatSettings, RoomSettings
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import encoded_words, unknown_note

# A kind of room in which a thing was never counted holds it as often as this share of the mean of all kinds.
_ELSEWHERE = 0.1


@cache
def _log_ratios(contents: RoomContents) -> Float64[np.ndarray, "t r"]:
    return _nats_of(contents, contents.surface_m2)


def _nats_of(contents: RoomContents, surface_m2: Float64[np.ndarray, "t r"]) -> Float64[np.ndarray, "t r"]:
    share = surface_m2 / np.maximum(contents.surface_m2.sum(axis=0), 1e-9)
    usual = share.mean(axis=1, keepdims=True)
    return np.log((share + _ELSEWHERE * usual + 1e-9) / ((1.0 + _ELSEWHERE) * usual + 1e-9))


def votes(things: Sequence[str], kinds: Sequence[str], contents: RoomContents) -> Float[np.ndarray, "t n"]:
    """Return by how much, in nats, a square metre of each thing speaks for each kind of room.

    A thing that the table does not hold speaks for none, and against no kind of room that its entry of the lexicon
    lists. A kind that the table does not hold gets that of a wider kind that it holds (of a kitchenette the kitchen),
    or else the mean vote of all, which for most things is against it.
    """
    ratios, known = _log_ratios(contents), lexicon()
    row_of = {known.find(name, EntryKind.THING): number for number, name in enumerate(contents.things)}
    out = np.zeros((len(things), len(kinds)))
    for number, thing in enumerate(things):
        entry = known.find(thing, EntryKind.THING)
        row = row_of.get(entry)
        if entry is not None and row is not None:
            out[number] = _not_against(_for_kinds(ratios[row], kinds, contents), kinds, (entry,))
    return out


def commonness(things: Sequence[str], kinds: Sequence[str], contents: RoomContents) -> Float[np.ndarray, " n"] | None:
    """Return ln of how many times as common things are in rooms of each kind as on average; None if unknown."""
    is_a = lexicon().is_a
    rows = [
        number
        for number, name in enumerate(contents.things)
        if any(name == thing or is_a(name, thing, EntryKind.THING) for thing in things)
    ]
    surface_m2 = contents.surface_m2[rows].sum(axis=0, keepdims=True)
    if not surface_m2.any():
        return None
    entries = filter(None, (lexicon().find(thing, EntryKind.THING) for thing in things))
    return _not_against(_for_kinds(_nats_of(contents, surface_m2)[0], kinds, contents), kinds, entries)


def _not_against(
    nats: Float[np.ndarray, " n"], kinds: Sequence[str], entries: Iterable[Entry]
) -> Float[np.ndarray, " n"]:
    # The homes that are counted have tables to dine at in dining rooms alone; many a kitchen has one.
    usual = {room for entry in entries for room in entry.rooms}
    return np.where([kind in usual for kind in kinds], np.maximum(nats, 0.0), nats)


def _for_kinds(
    nats: Float64[np.ndarray, " r"], kinds: Sequence[str], contents: RoomContents
) -> Float[np.ndarray, " n"]:
    columns = _columns(tuple(kinds), contents)
    return np.array([nats.mean() if column is None else nats[column] for column in columns])


@cache
def _columns(kinds: tuple[str, ...], contents: RoomContents) -> tuple[int | None, ...]:
    column_of = {lexicon().find(name, EntryKind.ROOM): number for number, name in enumerate(contents.kinds)}
    return tuple(_column(kind, column_of) for kind in kinds)


def _column(kind: str, column_of: Mapping[Entry | None, int]) -> int | None:
    known = lexicon()
    entry = known.find(kind, EntryKind.ROOM) or known.head(kind, EntryKind.ROOM)
    if entry is None:
        return None
    family = (entry, *known.wider(entry.name, EntryKind.ROOM))
    return next((column_of[each] for each in family if each in column_of), None)


# Voxels whose names vote: one of q, so that their features' products with the names cost some tens of milliseconds.
_MOST_PRODUCTS = 200_000_000
# Far from all views a place is any kind of room: each kind has this number of views everywhere, divided among them.
_PRIOR_VIEWS = 0.01
_CHUNK = 1 << 15  # voxels that are looked at at once: they stay in the processor's cache
_PASSAGES = ("hallway", "corridor", "entrance hall", "staircase")
# How much less likely a passage is for a room that has none, one, two or more rooms beside it.
_PASSAGE_ODDS = (0.2, 0.2, 0.4, 1.0)
_LEAST_SHARE = 0.003  # no view rules a kind of room out by more than this
_LOOKS = 2.0  # looks that agree count as so many independent ones
_LEAST_PART_M2 = 1.0  # of an open plan's floor
_OPEN = ("kitchen", "living room", "dining room", "office", "reception")  # kinds that may be parts of an open plan


@dataclass(frozen=True, slots=True)
class NamedVoxels:
    """Some voxels of the map, and how likely each is each thing."""

    rows: Int[np.ndarray, " m"]  # their numbers in the map
    names: tuple[str, ...]  # the things
    confidence: Float32[np.ndarray, "m t"]  # of each name
    area_m2: float  # surface of the map that each voxel stands for
    contents: RoomContents  # what the encoder that named them names in rooms of each kind, or what stands there


@dataclass(frozen=True, eq=False)
class RoomField:
    """How likely each cell of the floor plan is each kind of room."""

    plan: FloorPlan  # the cells
    kinds: tuple[str, ...]  # kinds of room
    share: Float32[np.ndarray, "c n"]  # of each cell; rows add up to 1
    rooms: "tuple[RoomRegions, Int[np.ndarray, ' c']] | None" = None  # once settled, and the room of each cell

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Float32[np.ndarray, "m n"]:
        """Return how likely each point is in each kind of room: what hangs in a thin wall by its region."""
        cells = self.plan.cells_of(points_world)
        if self.rooms is not None:
            own, room_of_cell = self.room_of(points_world), self.rooms[1]
            behind = own != room_of_cell[cells]
            for room in np.unique(own[behind]):
                of_room, there = np.flatnonzero(room_of_cell == room), np.flatnonzero(behind & (own == room))
                cells[there] = of_room[self.plan.nearest_of(of_room, np.asarray(points_world)[there])]
        return self.share[cells]

    def room_of(self, points_world: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
        """Return the room of each point of a settled field: its region, else that of the cell nearest to it."""
        assert self.rooms is not None
        regions, room_of_cell = self.rooms
        own = regions.at(points_world)
        is_room = (own != NONE) & np.isin(own, room_of_cell)
        return np.where(is_room, own, room_of_cell[self.plan.cells_of(points_world)])

    def with_certain(self, named: "Sequence[tuple[str, Bool[np.ndarray, ' c']]]") -> "RoomField":
        """Return the field with new kinds behind the others, of which some cells are certain; of several the last."""
        kinds = list(dict.fromkeys([*self.kinds, *(name for name, _ in named)]))
        share = np.zeros((len(self.share), len(kinds)), np.float32)
        share[:, : len(self.kinds)] = self.share
        for name, cells in named:
            share[cells] = 0.0
            share[cells, kinds.index(name)] = 1.0
        return replace(self, kinds=tuple(kinds), share=share)

    def of_cells(self, weights: Float[np.ndarray, " n"]) -> Float32[np.ndarray, " c"]:
        """Return how likely every cell is in a room of some kinds, each meant with a weight in [0, 1]."""
        return np.clip(self.share @ weights, 0.0, 1.0).astype(np.float32)

    def of_rooms(self, regions: RoomRegions) -> Float[np.ndarray, "r n"]:
        """Return which share of each room's floor is of each kind; rows add up to 1."""
        total = self._over_floors(regions, self.share) + 1e-6
        return total / total.sum(axis=1, keepdims=True)

    def surest_of_rooms(self, regions: RoomRegions) -> Float[np.ndarray, "r n"]:
        """Return how likely each kind is where a room is most likely of it: in an open plan, in its part."""
        return self._over_floors(regions, self.share, np.maximum)

    def _over_floors(
        self, regions: RoomRegions, of_cells: Float[np.ndarray, "c n"] | Bool[np.ndarray, "c n"], by: np.ufunc = np.add
    ) -> Float[np.ndarray, "r n"]:
        room = np.where(self.plan.open.reshape(-1), regions.of_plan_cells, NONE)
        own = np.flatnonzero(room != NONE)
        total = np.zeros((len(regions), of_cells.shape[1]))
        by.at(total, room[own], of_cells[own])
        return total

    def parts_of_rooms(self, regions: RoomRegions) -> Bool[np.ndarray, "r n"]:
        """Return which kinds are parts of which rooms: of an open plan, those of much of its sure floor."""
        sure = self._over_floors(regions, self.share >= FOUND_AT)
        parts = sure >= np.maximum(LEAST_PART * sure.sum(axis=1, keepdims=True), _LEAST_PART_M2 / CELL_M**2)
        parts &= _among(self.kinds, _OPEN)
        parts[np.count_nonzero(parts, axis=1) < 2] = False
        return parts

    def settled(self, regions: RoomRegions, room_of_cell: Int[np.ndarray, " c"]) -> "RoomField":
        """Return the field in which a room, or each part of an open plan, is of one kind, as likely everywhere."""
        inside = np.flatnonzero(room_of_cell != NONE)
        room, own = room_of_cell[inside], self.share[inside]
        kind = np.where(self.parts_of_rooms(regions)[room], own, -1.0).argmax(axis=1)
        parts, part = np.unique(room * len(self.kinds) + kind, return_inverse=True)
        # The looks at different places of one floor are evidence for one room: their mean log counts ``_LOOKS`` times.
        # A room that leads to few others is seldom a passage, though one sees a hallway through its door.
        floor = self.plan.open.reshape(-1)[inside] & (regions.of_plan_cells[inside] == room)
        nats = np.zeros((len(parts), len(self.kinds)))
        np.add.at(nats, part[floor], np.log(np.maximum(own[floor], _LEAST_SHARE)))
        nats /= np.maximum(np.bincount(part, floor, len(parts)), 1.0)[:, None]
        neighbours = np.bincount(regions.beside.reshape(-1), minlength=regions.count)
        fewest = np.minimum(neighbours[parts // len(self.kinds)], len(_PASSAGE_ODDS) - 1)
        passage = _among(self.kinds, _PASSAGES)
        whole = np.exp(_LOOKS * nats) * np.where(passage, np.array(_PASSAGE_ODDS)[fewest][:, None], 1.0)
        share = self.share.copy()
        share[inside] = (whole / whole.sum(axis=1, keepdims=True))[part]
        return replace(self, share=share, rooms=(regions, room_of_cell))


def rooms_of_cells(regions: RoomRegions, places: Float[np.ndarray, "k 3"]) -> Int[np.ndarray, " c"]:
    """Return the room that each cell of the floor plan belongs to: its region, or that of the nearest view.

    Regions into which fewer than ``FEWEST_VIEWS`` views (``places``: metres, world) looked are no rooms. ``NONE``: near
    views beyond all floors.
    """
    own = regions.at(places)
    is_room = np.append(np.bincount(own[own != NONE], minlength=len(regions)) >= FEWEST_VIEWS, False)
    kept = np.flatnonzero(is_room[own] | (own == NONE))
    nearest = np.append(own[kept], NONE)[regions.plan.nearest(places[kept])]
    return np.where(is_room[regions.of_plan_cells], regions.of_plan_cells, nearest)


@cache
def _among(kinds: tuple[str, ...], names: tuple[str, ...]) -> Bool[np.ndarray, " n"]:
    find = lexicon().find
    known = [entry for entry in (find(name, EntryKind.ROOM) for name in names) if entry is not None]
    return np.array([kind in names or find(kind, EntryKind.ROOM) in known for kind in kinds], bool)


class Rooms:
    """The kinds of room of one map; what depends on the map alone is computed once.

    ``places``: middle of what each keyframe saw, metres, world. ``named``: the voxels whose names vote, if any.
    """

    def __init__(
        self, plan: FloorPlan, places: Float[np.ndarray, "k 3"], named: Callable[[], NamedVoxels | None],
        settings: RoomSettings,
    ) -> None:  # fmt: skip
        self.plan, self.settings, self._named = plan, settings, named
        self._places = np.asarray(places, np.float64).reshape(-1, 3)
        self._votes: dict[tuple[str, ...], Float32[np.ndarray, "c n"]] = {}

    def field(self, kinds: Sequence[str], share: Float[np.ndarray, "k n"]) -> RoomField:
        """Return how likely each place is each kind of room; ``share``: how likely each view shows each of them."""
        settings = self.settings
        mass = np.zeros((len(self.plan), len(kinds) + 1))
        np.add.at(mass, self.plan.cells_of(self._places), np.c_[share, np.ones(len(share))])
        per_view = 2.0 * np.pi * (settings.views_m / CELL_M) ** 2  # a view in the open has this weight at its place: 1
        spread = self.plan.spread(mass, settings.views_m) * np.float32(per_view)
        views = spread[:, -1:]
        mean = (spread[:, :-1] + _PRIOR_VIEWS / len(kinds)) / (views + _PRIOR_VIEWS)
        logits = np.clip(views, 1.0, settings.view_weight) * np.log(mean + _LEAST_SHARE) + self.thing_votes(kinds)
        raised = np.exp(logits - logits.max(axis=1, keepdims=True))
        likely = (raised / raised.sum(axis=1, keepdims=True)).astype(np.float32)
        return RoomField(self.plan, tuple(kinds), likely)

    def thing_votes(self, kinds: Sequence[str]) -> Float32[np.ndarray, "c n"]:
        """Return by how much, in nats, the things near each cell speak for each kind of room."""
        key = tuple(kinds)
        if key not in self._votes:
            self._votes[key] = self._count_votes(key)
        return self._votes[key]

    @cached_property
    def _named_voxels(self) -> NamedVoxels | None:
        return self._named()

    def _count_votes(self, kinds: tuple[str, ...]) -> Float32[np.ndarray, "c n"]:
        settings, counted = self.settings, np.zeros((len(self.plan), len(kinds)))
        named = self._named_voxels if settings.thing_weight > 0.0 else None
        if named is None or not len(named.rows):
            return counted.astype(np.float32)
        nats = named.confidence @ votes(named.names, kinds, named.contents) * named.area_m2
        np.add.at(counted, self.plan.voxel_cells[named.rows], nats)
        per_cell = 2.0 * np.pi * (settings.things_m / CELL_M) ** 2
        near = self.plan.spread(counted, settings.things_m) * np.float32(settings.thing_weight * per_cell)
        # Behind the likeliest kind: what a bathroom lacks says nothing of whether a kitchen is a living room.
        behind = near.max(axis=1, keepdims=True) - near
        return (-behind / (1.0 + behind / settings.most_nats)).astype(np.float32)


def voting_rows(index: Int[np.ndarray, "n 3"], products: int) -> tuple[Int[np.ndarray, " m"], int]:
    """Return the voxels whose names vote, one of q planes across the diagonal whatever their order, and q."""
    every = max(1, int(np.ceil(len(index) * products / _MOST_PRODUCTS)))
    chosen = np.empty(len(index), bool)
    for a in range(0, len(index), _CHUNK):
        x, y, z = np.asarray(index[a : a + _CHUNK], np.int64).T
        chosen[a : a + _CHUNK] = (x + y + z) % every == 0
    return np.flatnonzero(chosen), every


@dataclass(frozen=True, eq=False, kw_only=True)
class InRooms(NearAnchors):
    """Heat of an area as context: how likely each place is in a room of that kind, the same at every height."""

    kinds: RoomField  # how likely each place is each kind of room
    weights: Float[np.ndarray, " n"]  # how much the query means each of them
    regional: bool = field(default=True, init=False)

    def heat_and_anchors(
        self, among: Bool[np.ndarray, " n"] | None = None
    ) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return the heat, and the anchor nearest to each voxel on its storey."""
        cells = self.kinds.plan.voxel_cells
        rows = np.arange(len(cells)) if among is None else np.flatnonzero(among)
        heat, anchor = np.zeros(len(cells), np.float32), np.full(len(cells), -1, np.int64)
        heat[rows] = self.kinds.of_cells(self.weights)[cells[rows]]
        anchor[rows] = np.where(heat[rows] > 0.0, self._nearest[cells[rows]], -1)
        return heat, anchor

    @cached_property
    def _nearest(self) -> Int[np.ndarray, " c"]:
        return self.kinds.plan.nearest(self.anchors)

    def cones(self) -> NearAnchors:
        """Return the heat that falls off round the places that look like such an area."""
        own = (getattr(self, each.name) for each in fields(NearAnchors) if each.init)
        return NearAnchors(*own)

    def held(self, lead: Factor) -> Float[np.ndarray, " i"]:
        """Return how likely each instance is in such a room: it is in one, that of its middle, as in lists."""
        return self.at(lead.middles)

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        """Return the heat at any points."""
        return np.clip(self.kinds.at(points_world) @ self.weights, 0.0, 1.0).astype(np.float64)


# What one room says about one thing lies between these, in nats. Much may stand in an unusual room, and
# a thing in its usual room may still be another.
_LEAST_NATS, _MOST_NATS = -3.0, 1.0


class ThingsInRooms:
    """The evidence of the rooms of a map on the things in it."""

    def __init__(self, field: RoomField, contents: RoomContents) -> None:
        self._field, self._contents = field, contents
        self._nats: dict[tuple[str, ...], Float32[np.ndarray, " c"] | None] = {}

    def nats(
        self, names: tuple[str, ...], rows: Int[np.ndarray, " a"], instance: Int[np.ndarray, " a"], count: int
    ) -> Float[np.ndarray, " i"] | None:
        """Return for each instance the mean of ln of how many times as common such things are there, in [−3, 1]."""
        if names not in self._nats:
            self._nats[names] = self._of_cells(names)
        of_cells = self._nats[names]
        if of_cells is None:
            return None
        total = np.bincount(instance, of_cells[self._field.plan.voxel_cells[rows]], minlength=count)
        mean = total / np.maximum(np.bincount(instance, minlength=count), 1)
        return np.clip(mean, _LEAST_NATS, _MOST_NATS)

    def _of_cells(self, names: tuple[str, ...]) -> Float32[np.ndarray, " c"] | None:
        nats = commonness(names, self._field.kinds, self._contents)
        if nats is None:
            return None
        return np.log(np.maximum(self._field.share @ np.exp(nats), 1e-9)).astype(np.float32)


# Names that compete with the queried area.
AREA_NAMES = (
    "kitchen", "living room", "bedroom", "bathroom", "dining room", "office", "corridor", "staircase", "entrance hall",
    "laundry room", "storage room", "garage", "balcony", "garden", "gym", "library", "meeting room", "workshop",
    "laboratory", "classroom", "waiting area", "shop", "lounge", "children's room",
)  # fmt: skip

# For an encoder that has no scale for its cosines.
_UNKNOWN_TEMPERATURE = 0.05


@dataclass(frozen=True, slots=True)
class ViewShares:
    """How a queried name competes with others over some views."""

    kinds: tuple[str, ...]  # names that compete, the queried one among them unless the encoder has names of its own
    share: Float[np.ndarray, "k n"]  # how likely each view shows each of them; rows add up to 1
    weights: Float[np.ndarray, " n"]  # how much the query means each of them
    raw: Float[np.ndarray, " k"]  # score of the query by itself: its probability, or its cosine


def area_scores(
    view: Float32[np.ndarray, "k d"], encoder: ViewEncoder, name: str, settings: AreaSettings
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return for each keyframe the posterior of the name among all area names, and its score in [0, 1]."""
    shares = view_shares(view, encoder, name, settings)
    posterior = np.clip(shares.share @ shares.weights, 0.0, 1.0)
    if settings.score == "min-max":
        return posterior, stretch_scores(shares.raw)
    return posterior, posterior


def view_shares(
    view: Float32[np.ndarray, "k d"], encoder: ViewEncoder, name: str, settings: AreaSettings
) -> ViewShares:
    """Return how likely each view shows the queried area and each name that competes with it."""
    if isinstance(encoder, NamedViewEncoder):
        share = _named_shares(view, encoder)
        weights = np.asarray(encoder.name_weights(name), np.float64)
        return ViewShares(encoder.names, share, weights, np.clip(share @ weights, 0.0, 1.0))
    others = [area for area in AREA_NAMES if not same_place(area, name)]
    words = encoded_words(encoder, [name, *others]).astype(np.float64)
    apart = words - (words.mean(axis=0) if isinstance(encoder, ScaledEncoder) else 0.0)
    apart /= np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-6)
    competes = np.r_[True, apart[1:] @ apart[0] < settings.same_word_cosine]
    cosine = _cosines(view, words[competes])
    kinds = tuple(kind for kind, does in zip([name, *others], competes, strict=True) if does)
    return ViewShares(kinds, _softmax(cosine, encoder, settings), np.eye(1, len(kinds))[0], cosine[:, 0])


def area_names(encoder: ViewEncoder) -> tuple[str, ...]:
    """Return the kinds of area that compete where none is queried: the encoder's own, or ``AREA_NAMES``."""
    return encoder.names if isinstance(encoder, NamedViewEncoder) else AREA_NAMES


def name_shares(
    view: Float32[np.ndarray, "k d"], encoder: ViewEncoder, settings: AreaSettings
) -> Float[np.ndarray, "k n"]:
    """Return how likely each view shows each of ``area_names``; rows add up to 1."""
    if isinstance(encoder, NamedViewEncoder):
        share = _named_shares(view, encoder)
        return share / np.maximum(share.sum(axis=1, keepdims=True), 1e-12)
    words = encoded_words(encoder, AREA_NAMES).astype(np.float64)
    return _softmax(_cosines(view, words), encoder, settings)


def same_place(area: str, asked: str) -> bool:
    """Return whether an area's name and a wanted phrase mean one kind of place, or the phrase one such place.

    The bare name would beat a "large kitchen" wherever that is right. For some models the features of two words of one
    sense lie as far apart as kitchen and dining room.
    """
    words = " ".join(word for word in asked.casefold().split() if word not in ("a", "an", "the"))
    known, name = lexicon(), area.casefold()
    if name == words or words.endswith(f" {name}"):
        return True
    ours, theirs = known.senses(name, EntryKind.ROOM), known.senses(words, EntryKind.ROOM)
    if any(entry in theirs for entry in ours):
        return True
    return any(
        not wide.generic and wide in theirs for entry in ours for wide in known.wider(entry.name, EntryKind.ROOM)
    ) or any(wide in ours for entry in theirs for wide in known.wider(entry.name, EntryKind.ROOM))


def _named_shares(view: Float32[np.ndarray, "k d"], encoder: NamedViewEncoder) -> Float[np.ndarray, "k n"]:
    return np.square(np.asarray(view, np.float64).reshape(-1, encoder.codes.shape[1]) @ encoder.codes.T)


def _cosines(view: Float32[np.ndarray, "k d"], words: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "k n"]:
    return np.asarray(view, np.float64).reshape(-1, words.shape[1]) @ words.T


def _softmax(
    cosine: Float[np.ndarray, "k n"], encoder: ViewEncoder, settings: AreaSettings
) -> Float[np.ndarray, "k n"]:
    logits = cosine / _temperature(encoder, settings)
    weight = np.exp(logits - logits.max(axis=1, keepdims=True, initial=-np.inf))
    return weight / weight.sum(axis=1, keepdims=True)


def _temperature(encoder: ViewEncoder, settings: AreaSettings) -> float:
    if settings.temperature is not None:
        return settings.temperature
    return 1.0 / encoder.logit_scale if isinstance(encoder, ScaledEncoder) else _UNKNOWN_TEMPERATURE


def modes(points: Float[np.ndarray, "a 2"], score: Float[np.ndarray, " a"], link_m: float) -> Int[np.ndarray, " a"]:
    """Group anchors round the local maxima of their score (quick shift); groups are numbered, the best first."""
    from scipy.spatial import KDTree

    order = np.argsort(-score, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    group = np.empty(len(order), np.int64)
    count = 0
    near: Sequence[Sequence[int]] = KDTree(points).query_ball_point(points, link_m).tolist() if len(points) else []
    for row in order:
        uphill = [other for other in near[int(row)] if rank[other] < rank[row]]
        if uphill:
            group[row] = group[min(uphill, key=lambda other: rank[other])]
        else:
            group[row] = count
            count += 1
    return group


# Of what is seen at a place, beside the kind of its room: rooms are misnamed, and open plans are parted wrongly. Table
# III's first goals in two homes: 21 of 40 right without it, 26 with it, 28 by what is seen alone.
_SEEN = 0.2


def _beside(room: RoomField, seen: RoomField) -> RoomField:
    known = len(seen.kinds)
    is_named = room.share.max(axis=1, keepdims=True, initial=0.0) >= 1.0
    mixed = (1.0 - _SEEN) * room.share[:, :known] + _SEEN * seen.share
    share = np.hstack([np.where(is_named, room.share[:, :known], mixed), room.share[:, known:]])
    return replace(room, share=share.astype(np.float32))


def area_factor(
    space: Space, keyframes: Keyframes, encoder: ViewEncoder, part: Part, settings: AreaSettings, heat: HeatSettings,
    rooms: Rooms | None = None, settled: Callable[[RoomField], RoomField] = lambda field: field,
) -> NearAnchors:  # fmt: skip
    """Return the heat of an area: one anchor a keyframe.

    As context it is how likely each place is in such an area; of what is sought it falls from the places that look most
    like it. ``settled`` puts in the rooms that people named, behind the kinds that the encoder knows; one without a
    name is the room that the query names by its number.
    """
    anchors = area_anchors(keyframes, settings)
    view = np.asarray(keyframes.view)
    kinds: RoomField | None = None
    # Stretched cosines are no probabilities to vote with.
    by_room = settings.extent == "rooms" and settings.score == "posterior"
    if rooms is None or not by_room or not len(keyframes):
        posterior, scores = area_scores(view, encoder, part.query, settings)
        weights = np.zeros(0)
    else:
        shares = view_shares(view, encoder, part.query, settings)
        seen, weights = rooms.field(shares.kinds, shares.share), shares.weights
        kinds = settled(seen)
        named = [1.0 if same_place(kind, part.query) else 0.0 for kind in kinds.kinds[len(weights) :]]
        weights = np.concatenate([weights, named])
        if not kinds.kinds[-1]:
            weights = np.eye(1, len(kinds.kinds), len(kinds.kinds) - 1)[0]
        posterior = scores = np.clip(kinds.at(anchors) @ weights, 0.0, 1.0).astype(np.float64)
        kinds = _beside(kinds, seen)
    best = float(posterior.max(initial=0.0))
    missed = f"no view is like {part.query!r}; the best score is {best:.2f}, below {FOUND_AT:.2f}"
    note = "" if best >= FOUND_AT else missed
    if isinstance(encoder, NamedViewEncoder) and not (encoder.name_weights(part.query).any() or weights.any()):
        note = f"{unknown_note(part.query, EntryKind.ROOM)}; it knows: {', '.join(encoder.names)}"
    if not len(keyframes):
        note = "the map holds no keyframes"
    group = modes(space.level(anchors)[:, :2], scores, settings.link_m)
    if kinds is not None and kinds.rooms is not None:  # however far apart the views of a room look
        room = kinds.room_of(anchors)
        group = np.unique(np.where(room >= 0, room, 1 + room.max(initial=-1) + group), return_inverse=True)[1]
    falloff, found = heat.falloff_per_m(part.role), best >= FOUND_AT
    if kinds is None or part.role is Role.PRIMARY:
        return NearAnchors(space, part, falloff, anchors, scores, group, found, part.query, note)
    return InRooms(
        space, part, falloff, anchors, scores, group, found, part.query, note, kinds=kinds, weights=weights
    )  # fmt: skip


def area_anchors(keyframes: Keyframes, settings: AreaSettings) -> Float[np.ndarray, "k 3"]:
    """Return the place that each keyframe speaks for, metres, world: of the camera, or the middle of what it saw."""
    places = keyframes.world_from_camera[:, :3, 3] if settings.anchor == "camera" else keyframes.centre
    return np.asarray(places, np.float64).reshape(-1, 3)
