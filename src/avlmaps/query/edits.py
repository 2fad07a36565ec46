"""What people corrected in a map, applied: ``apply`` is the one place, for every question, list, picture and path.

A thing that was edited is a ``Claim``: voxels with a name. What the encoder sees in these voxels counts no more where
a person named them; a name that means the claim's finds it. A room's name is put into the field of kinds of room, from
which rooms and areas follow.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import plain_point
from avlmaps.core.question import Part
from avlmaps.maps.store.edits import Edit, in_force
from avlmaps.query.colour_filter import colour_in, colour_share
from avlmaps.query.edit_spots import SeenMap
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearAnchors, NearThings
from avlmaps.query.found_edits import HALF, Claim, FoundEdits, plain_name, said, share_in
from avlmaps.query.instances import Instances
from avlmaps.query.modalities.area import same_place
from avlmaps.query.rooms import RoomField

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Life
    from avlmaps.query.contents import Room, Thing

_AT_M = 1e-3


def means(asked: str) -> Callable[[str], bool]:
    """Return whether the name of a thing is meant by a word: it is the same, another word for it, or a narrower one."""
    known, word = lexicon(), plain_name(asked)
    entry = known.find(word, EntryKind.THING) or known.head(word, EntryKind.THING)

    def is_meant(name: str) -> bool:
        own = plain_name(name)
        if own == word:
            return True
        of = known.find(own, EntryKind.THING) or known.head(own, EntryKind.THING)
        return entry is not None and of is not None and known.is_a(of.name, entry.name, EntryKind.THING)

    return is_meant


def apply(edits: Sequence[Edit], avlmap: SeenMap) -> "Edited":
    """Return what edits make of a map: of no edits, everything stays the same object.

    Args:
        edits: all of a log, the oldest first; those that are undone do not count.
        avlmap: the map.
    """
    return Edited(in_force(edits), avlmap)


class Edited(FoundEdits):
    """What follows from edits for questions and lists of a map."""

    @property
    def own_names(self) -> tuple[tuple[str, bool], ...]:
        """The names that people gave, plain, and whether each is that of a room."""
        named = [(plain_name(edit.name), edit.does == "rename room") for edit in self.edits if edit.does != "forbid"]
        return tuple(dict.fromkeys(one for one in named if one[0]))

    def knows(self, phrase: str) -> bool:
        """Return whether a person named something so."""
        word = plain_name(phrase)
        return any(name == word for name, _ in self.own_names)

    def is_room(self, phrase: str) -> bool:
        """Return whether a person named a room so, and nothing else."""
        word = plain_name(phrase)
        kinds = {is_room for name, is_room in self.own_names if name == word}
        return kinds == {True}

    def pinned(self, part: Part, heat: HeatSettings) -> NearAnchors | None:
        """Return the heat of a place that a person named; None where nobody named one so."""
        known = self.pins.get(plain_name(part.query)) if self.edits else None
        if known is None:
            return None
        falloff = heat.falloff_per_m(part.role)
        return NearAnchors(
            self._map.space, part, falloff, known[1][None], np.ones(1), np.zeros(1, np.int64), True, part.query
        )

    def object_factor(self, part: Part, heat: HeatSettings, find: Callable[[], NearThings]) -> NearThings:
        """Return the heat of the things that a part of a question names, as people corrected them."""
        if not self.edits or not self.claims:
            return find()
        try:
            raw = find()
        except QueryError:
            is_meant = means(part.query)
            if not any(is_meant(one.name) for one in self.claims):
                raise
            nothing = np.zeros(len(self._map.space), np.bool_), np.zeros(0, np.int64), np.zeros(0, np.float32)
            raw = NearThings(self._map.space, part, heat.falloff_per_m(part.role), *nothing, found=False)
        return self._corrected(raw, part.query)

    def _corrected(self, raw: NearThings, word: str) -> NearThings:
        colour = colour_in(word)
        if colour is not None and not colour.thing:
            return raw
        rows = np.flatnonzero(raw.mask)
        rows, instance, confidence, given = self._claimed(rows, raw.instance, raw.confidence, word)
        if colour is not None and lexicon().find(word, EntryKind.THING) is None and len(given):
            last = np.arange(len(confidence) - len(given), len(confidence))
            rgb = np.asarray(self._map.stored.voxels.rgb)
            for number, claim in zip(last, given, strict=True):
                own = np.zeros(len(claim.rows), np.int64)
                confidence[number] *= colour_share(rgb, claim.rows, own, colour)[0]
        mask = np.zeros(len(raw.mask), np.bool_)
        mask[rows] = True
        best, uncertain = float(confidence.max(initial=0.0)), raw.with_uncertain
        is_named = raw.is_named or bool(given)
        found = best >= FOUND_AT and is_named
        lost = f"what looks like {word!r} was named otherwise by a person" if raw.found else raw.note
        return replace(
            raw, mask=mask, instance=instance, confidence=confidence, found=found, is_named=is_named,
            understood=raw.understood or (word if given else ""), note="" if found else lost,
            with_uncertain=None if uncertain is None else lambda: self._corrected(uncertain(), word),
        )  # fmt: skip

    def instances(self, found: Instances, word: str) -> Instances:
        """Return the instances of a word as people corrected them; those of voxels that they added are certain."""
        if not self.edits or not self.claims:
            return found
        rows, instance, confidence, _ = self._claimed(found.rows, found.instance, found.confidence, word)
        margin, score = np.ones(len(rows), np.float32), np.ones(len(rows), np.float32)
        at = np.minimum(np.searchsorted(found.rows, rows), max(len(found.rows) - 1, 0))
        if len(found.rows):
            known = found.rows[at] == rows
            margin[known], score[known] = found.margin[at[known]], found.score[at[known]]
        return Instances(rows, instance, margin, score, confidence.astype(np.float32))

    def _claimed(
        self,
        rows: Int[np.ndarray, " a"],
        instance: Int[np.ndarray, " a"],
        confidence: Float[np.ndarray, " i"],
        word: str,
    ) -> tuple[Int[np.ndarray, " b"], Int[np.ndarray, " b"], Float[np.ndarray, " j"], list[Claim]]:
        """Return instances without what people named otherwise, with the claims that the word means behind them."""
        is_meant = means(word)
        exact = [one for one in self.claims if plain_name(one.name) == plain_name(word)]
        given = exact or [one for one in self.claims if is_meant(one.name)]
        taken = self._voxels(one for one in self.claims if one.is_named or one in given)
        count = np.bincount(instance, minlength=len(confidence))
        left = np.bincount(instance[~taken[rows]], minlength=len(confidence))
        stays = (left > 0) & (left >= HALF * count)
        own = stays[instance] & ~taken[rows]
        number = np.cumsum(stays) - 1
        kept = int(stays.sum())
        new_rows = np.concatenate([rows[own], *(one.rows for one in given)])
        new_instance = np.concatenate(
            [number[instance[own]], *(np.full(len(one.rows), kept + k) for k, one in enumerate(given))]
        ).astype(np.int64)
        order = np.argsort(new_rows, kind="stable")
        sure = np.concatenate([confidence[stays], [one.confidence for one in given]])
        return new_rows[order], new_instance[order], sure, given

    def _voxels(self, claims: Iterable[Claim]) -> Bool[np.ndarray, " n"]:
        taken = np.zeros(len(self._map.space), np.bool_)
        for one in claims:
            taken[one.rows] = True
        return taken

    def things(self, found: "list[Thing]", names: Sequence[str] | None, least_confidence: float) -> "list[Thing]":
        """Return a list of things as people corrected it, most confident first."""
        if not self.edits or not (self.claims or self.pins):
            return found
        from avlmaps.query.contents import thing_of

        taken = self._voxels(self.claims)
        kept = [one for one in found if not len(one.rows) or taken[one.rows].mean() < HALF]
        wanted = None if names is None else [means(name) for name in names]

        def is_wanted(name: str, sure: float) -> bool:
            return sure >= least_confidence and (wanted is None or any(one(name) for one in wanted))

        stored, space = self._map.stored, self._map.space
        own = [
            replace(thing_of(stored, space, one.name, one.confidence, one.rows), edited=said(one.edit))
            for one in self.claims
            if is_wanted(one.name, one.confidence)
        ]
        pinned = [_pinned(edit, place) for edit, place in self.pins.values() if is_wanted(edit.name, 1.0)]
        return sorted([*kept, *own, *pinned], key=lambda one: -one.confidence)

    def named_at(self, rows: Int[np.ndarray, " m"]) -> str | None:
        """Return what people named most of some voxels; None where they named nothing there."""
        if not self.edits or not len(rows):
            return None
        named = [(share_in(rows, one.rows), one.name) for one in self.claims if one.is_named]
        share, name = max(named, default=(0.0, ""))
        return name if share >= HALF else None

    def room_field(self, field: RoomField) -> RoomField:
        """Return how likely each place is each kind of room, where people said so with certainty."""
        if not self.edits or not self.rooms:
            return field
        regions = self._map.room_regions
        assert regions is not None
        return field.with_certain([(edit.name, regions.of_plan_cells == n) for n, edit in self.rooms.items()])

    def listed_rooms(self, rooms: "list[Room]") -> "list[Room]":
        """Return rooms that say who named them."""
        if not self.edits or not self.rooms:
            return rooms
        return [
            room if (edit := self.rooms.get(room.region)) is None else replace(room, edited=said(edit))
            for room in rooms
        ]

    def life(self, life: "Life") -> "Life":
        """Return what became of things over days, under the names that people gave them, wherever they moved."""
        if not self.edits:
            return life
        import msgspec

        stays, changed = list(life.stays), False
        for edit in self._of("rename"):
            number = self._spots.stay_at(life, edit.at[0].now(self._map.stored.keyframes))
            if number is None:
                continue
            while (before := stays[number].moved_from) is not None:
                number = before
            while number is not None:
                stays[number] = msgspec.structs.replace(stays[number], name=edit.name)
                number, changed = stays[number].moved_to, True
        return replace(life, stays=tuple(stays)) if changed else life

    def said_of(
        self, places: Sequence[Sequence[float]], named: Iterable[str] = (), areas: Iterable[str] = ()
    ) -> tuple[str, ...]:
        """Return who corrected what an answer is about, and when, in a sentence each."""
        if not self.edits:
            return ()
        space, names, rooms = self._map.space, set(map(plain_name, named)), list(map(plain_name, areas))
        points = np.asarray(places, np.float64).reshape(-1, 1, 3)

        def is_at(own: Float[np.ndarray, "m 3"]) -> bool:
            return any(float(np.linalg.norm(own - point, axis=1).min()) < _AT_M for point in points)

        told = [edit for name, (edit, place) in self.pins.items() if name in names or is_at(place[None])]
        told += [edit for edit in self.rooms.values() if any(same_place(edit.name, room) for room in rooms)]
        said_of = [f"{_the(edit.name)} was {said(edit)}." for edit in told]
        said_of += [
            f"{_the(one.name)} was {said(one.edit)}."
            for one in self.claims
            if plain_name(one.name) in names or is_at(space.centres_of(one.rows))
        ]
        said_of += [str(one) for one in self._lost.values() if plain_name(one.edit.name) in {*names, *rooms}]
        return tuple(dict.fromkeys(said_of))


def _pinned(edit: Edit, place: Float[np.ndarray, "3"]) -> "Thing":
    from avlmaps.query.contents import Thing

    no_voxels = np.zeros(0, np.int64)
    return Thing(edit.name, 1.0, plain_point(place), (0.0, 0.0, 0.0), (0, 0, 0), no_voxels, place[None], said(edit))


def _the(name: str) -> str:
    return f"The {plain_name(name)}"
