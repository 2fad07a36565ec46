"""What people corrected in a map, found in it as it is now and applied to every question, list and path."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import plain_point
from avlmaps.core.question import Part
from avlmaps.core.wording import place_text
from avlmaps.maps.store.edits import Edit, EditedSpot, World, in_force
from avlmaps.query.contents import Thing, plain_name, thing_of
from avlmaps.query.factors import NearAnchors, NearThings
from avlmaps.query.objects import Instances, colour_in, colour_share
from avlmaps.query.settings import FOUND_AT, HeatSettings
from avlmaps.query.voxel_space import linked

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import ForbiddenArea
    from avlmaps.maps.store.life import Life
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Room
    from avlmaps.query.rooms import RoomField

# Share of two boxes together that both hold: perhaps one thing. Chosen on maps of two simulated homes and four rebuilds
# of them: of every second or third frame, and by poses that drift by .15, .37 and 1.1 m. Of 94 pairs of one thing 91
# have this share; of 110 pairs of a thing and the other one that is most like it 5. By name first, 89 of 110 things are
# found again, 15 are lost, and 6 find a thing of their name of which the truth is not clear.
_ALIKE_BOX = 0.2
# Certainly one thing: 71 of the 94 right pairs have it and none of the 110 wrong ones (.34 at most).
_SAME_BOX = 0.5
# Share of a room's outline and a region together that both hold: perhaps one room. On the same maps the regions most
# like the 16 rooms have .39 to .97 (one was split: .36), and those of other rooms .15 at most.
_SAME_ROOM = 0.25
_HALF = 0.5  # of its voxels: then a thing is in the claim
_SPECK = 0.05  # share of a thing; smaller pieces belong to the nearest larger one
_AT_M = 1e-3
_DONE = {"rename": "named", "rename room": "named", "merge": "made one thing", "split": "split", "pin": "named",
         "forbid": "forbidden"}  # fmt: skip

Rows = Int[np.ndarray, " m"]
Box = tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """Voxels that an edit made one thing."""

    name: str
    rows: Rows  # numbers of its voxels in the map, ascending
    confidence: float  # that it has this name, in [0, 1]; 1 where a person said so
    is_named: bool  # whether a person said so
    edit: Edit  # the last one that made it


@dataclass(frozen=True, slots=True)
class LostEdit:
    """An edit that finds nothing to apply to, and why."""

    edit: Edit
    why: str

    def __str__(self) -> str:
        edit = self.edit
        did = f"{edit.does} {' and '.join(filter(None, (spot.name for spot in edit.at)))}".strip()
        to = f" to {edit.name}" if edit.name and edit.does.startswith("rename") else ""
        return f"Edit {edit.id} of {edit.day} ({did}{to}) finds nothing to apply to: {self.why}."


def said(edit: Edit) -> str:
    """Return who did what and when: ``named by a person on 2026-11-26``."""
    return f"{_DONE[edit.does]} by {edit.by or 'a person'} on {edit.day}"


def means(asked: str) -> Callable[[str], bool]:
    """Return whether the name of a thing is meant by a word: it is the same, another word for it, or a narrower one."""
    known, word = lexicon(), plain_name(asked)
    if known.find(word, EntryKind.THING) is None:
        word = word.removesuffix(" thing")  # "red thing", of a map of colours
    entry = known.find(word, EntryKind.THING) or known.head(word, EntryKind.THING)

    def is_meant(name: str) -> bool:
        own = plain_name(name)
        if own == word:
            return True
        of = known.find(own, EntryKind.THING) or known.head(own, EntryKind.THING)
        return entry is not None and of is not None and known.is_a(of.name, entry.name, EntryKind.THING)

    return is_meant


class Edited:
    """What follows from the edits in force (``edits``) for questions and lists of a map."""

    def __init__(self, edits: Sequence[Edit], avlmap: "AVLMap") -> None:
        # Takes all edits of a log, the oldest first; those that are undone do not count.
        self.edits = in_force(edits)
        self._map = avlmap
        self._lost: dict[str, LostEdit] = {}

    def __bool__(self) -> bool:
        return bool(self.edits)

    def _of(self, *does: str) -> list[Edit]:
        own: list[Edit] = []
        for edit in self.edits:
            if edit.does not in does:
                continue
            if edit.world is None or edit.world.is_that_of(World.of(self._map.data.info)):
                own.append(edit)
            else:
                self._lose(edit, f"it was made in a map of another recording, {edit.world.name}")
        return own

    def _lose(self, edit: Edit, why: str) -> None:
        self._lost[edit.id] = LostEdit(edit, why)

    def _now(self, spot: EditedSpot) -> EditedSpot:
        return spot.now(self._map.data.keyframes)

    @property
    def lost(self) -> tuple[LostEdit, ...]:
        """The edits that find nothing to apply to; finding that out looks for what each is about."""
        _ = self.claims, self.rooms, self.pins, self.forbidden
        return tuple(self._lost[edit.id] for edit in self.edits if edit.id in self._lost)

    # Where edits are in the map as it is now.

    @cached_property
    def claims(self) -> tuple[Claim, ...]:
        """The things that were renamed, merged or split, by their first voxel."""
        claims: list[Claim] = []
        for edit in self._of("rename", "merge", "split"):
            found = [self._targets(self._now(spot), claims) for spot in edit.at]
            if not all(found):
                at = edit.at[[bool(one) for one in found].index(False)]
                self._lose(edit, f"nothing like the {at.name or 'thing'} is at {place_text(at.middle)} any more")
                continue
            targets = list({one.rows[0]: one for each in found for one in each}.values())
            claims = [one for one in claims if all(one is not other for other in targets)]
            claims += self._made(edit, targets)
        return tuple(sorted(claims, key=lambda one: int(one.rows[0])))

    def _made(self, edit: Edit, targets: Sequence[Claim]) -> list[Claim]:
        if edit.does == "rename":
            return [replace(one, name=edit.name, confidence=1.0, is_named=True, edit=edit) for one in targets]
        if edit.does == "split":
            return [replace(one, rows=rows, edit=edit) for one in targets for rows in self._pieces(one.rows, edit)]
        first = targets[0]
        sure = 1.0 if edit.name else max(one.confidence for one in targets if one.name == first.name)
        rows = np.unique(np.concatenate([one.rows for one in targets]))
        return [Claim(edit.name or first.name, rows, sure, bool(edit.name) or first.is_named, edit)]

    def _pieces(self, rows: Rows, edit: Edit) -> list[Rows]:
        from avlmaps.query.floor_plan import in_polygon

        space, spot = self._map.space, edit.at[0]
        level = space.level(space.centres_of(rows))
        if edit.cut:
            with_cut = self._now(EditedSpot(middle=spot.middle, corners=edit.cut, seen_from=spot.seen_from))
            cut = space.level(np.array(with_cut.corners, np.float64))[:, :2]
            if len(cut) == 2:
                along = cut[1] - cut[0]
                which = (level[:, :2] - cut[0]) @ np.array([-along[1], along[0]]) > 0.0
            else:
                which = in_polygon(level[:, :2], cut)
        else:
            which = _without_specks(linked(np.asarray(space.index)[rows], 1), level)
        return [rows[which == number] for number in np.unique(which)]

    def _targets(self, spot: EditedSpot, claims: Sequence[Claim]) -> list[Claim]:
        # The claims, or the thing of the map, that a spot is about; none where there is nothing like it.
        own = [(self._overlap(spot, self._box(one.rows)), one) for one in claims]
        share, best = max(own, key=lambda one: one[0], default=(0.0, None))
        if best is not None and share >= _SAME_BOX:
            return [best]
        thing = self._thing_at(spot) or self._thing_at(self._carried(spot))
        if thing is None:
            return [best] if best is not None and share >= _ALIKE_BOX else []
        holding = [one for one in claims if np.isin(thing.rows, one.rows).mean() >= _HALF]
        inside = [one for one in claims if np.isin(one.rows, thing.rows).mean() >= _HALF]
        if holding or inside:
            return holding[:1] or inside
        rows = np.setdiff1d(thing.rows, np.concatenate([np.zeros(0, np.int64), *(one.rows for one in claims)]))
        nobody = Edit(schema=1, id="", does="rename", made="")
        return [Claim(thing.name, rows, thing.confidence, False, nobody)] if len(rows) else []

    def _thing_at(self, spot: EditedSpot | None) -> "Thing | None":
        # The thing of the map, as its encoder sees it, that fills the box of a spot best; of the spot's name first.
        if spot is None:
            return None
        for name in (spot.name, None):
            found = [(self._overlap(spot, self._box(one.rows)), one) for one in self._map.things_to_edit(name)]
            share, best = max(reversed(found), key=lambda one: one[0], default=(0.0, None))
            if share >= _ALIKE_BOX:
                return best
        return None

    def _carried(self, spot: EditedSpot) -> EditedSpot | None:
        # Where a later day found the thing of a spot, of which an earlier day knew.
        life = self._map.data.life if self._map.data.info.visits else None
        number = None if life is None else self._stay_at(life, spot)
        if life is None or number is None or life.stays[number].moved_to is None:
            return None
        while (after := life.stays[number].moved_to) is not None:
            number = after
        return self._spot(spot.name, self._box_of(self._map.space.grid.centre_of(life.voxels(number))))

    def _stay_at(self, life: "Life", spot: EditedSpot) -> int | None:
        centre_of = self._map.space.grid.centre_of
        stays = ((number, life.voxels(number)) for number in range(len(life)))
        near = [(self._overlap(spot, self._box_of(centre_of(own))), number) for number, own in stays if len(own)]
        share, number = max(near, default=(0.0, 0))
        return number if share >= _ALIKE_BOX else None

    def _box(self, rows: Rows) -> Box:
        return self._box_of(self._map.space.centres_of(rows))

    def _box_of(self, points: Float[np.ndarray, "m 3"]) -> Box:
        level, half = self._map.space.level(points), self._map.space.grid.voxel_size_m / 2.0
        return level.min(axis=0) - half, level.max(axis=0) + half

    def _overlap(self, spot: EditedSpot, box: Box) -> float:
        middle, size = self._map.space.level(np.array(spot.middle)), np.array(spot.size)
        low, high = middle - size / 2.0, middle + size / 2.0
        both = np.prod(np.clip(np.minimum(high, box[1]) - np.maximum(low, box[0]), 0.0, None))
        whole = np.prod(size) + np.prod(box[1] - box[0]) - both
        return float(both / whole) if whole > 0.0 else 0.0

    def _spot(self, name: str, box: Box) -> EditedSpot:
        middle = self._map.space.world((box[0] + box[1]) / 2.0)
        return EditedSpot(name=name, middle=plain_point(middle), size=plain_point(box[1] - box[0]))

    def spot_of(self, name: str, rows: Rows) -> EditedSpot:
        """Return what an edit is about: the thing of some voxels."""
        return self._spot(name, self._box(rows)).anchored(self._map.data.keyframes)

    @cached_property
    def rooms(self) -> Mapping[int, Edit]:
        """The edits of rooms, by the number of the region in ``AVLMap.room_regions``."""
        found: dict[int, Edit] = {}
        for edit in self._of("rename room"):
            spot, regions, share = self._now(edit.at[0]), self._map.room_regions, np.zeros(1)
            if regions is not None and len(regions) and spot.corners:
                share = regions.shares_of(np.array(spot.middle), np.array(spot.corners))
            number = int(share.argmax())
            if share[number] < _SAME_ROOM:
                self._lose(edit, f"no room like the {spot.name} is at {place_text(spot.middle)} any more")
            else:
                found[number] = edit
        return found

    @cached_property
    def pins(self) -> Mapping[str, tuple[Edit, Float[np.ndarray, "3"]]]:
        """The places that were named, by plain names: the last place of each."""
        return {plain_name(edit.name): (edit, np.array(self._now(edit.at[0]).middle)) for edit in self._of("pin")}

    @cached_property
    def forbidden(self) -> "tuple[ForbiddenArea, ...]":
        """The areas that no robot enters; several may have one name, as each wet floor has."""
        from avlmaps.maps.obstacles import ForbiddenArea

        areas: list[ForbiddenArea] = []
        storeys = self._map.storeys
        for edit in self._of("forbid"):
            corners = np.array(self._now(edit.at[0]).corners, np.float64)
            storey = 0 if storeys is None else int(storeys.of_places(corners.mean(axis=0))[0])
            areas.append(ForbiddenArea(edit.name, said(edit), self._map.space.level(corners)[:, :2], storey))
        return tuple(areas)

    @property
    def unheeded(self) -> tuple[str, ...]:
        """A sentence for each area that was forbidden and that this map does not know, so that a robot may enter it."""
        _ = self.forbidden
        lost = (self._lost[edit.id] for edit in self.edits if edit.does == "forbid" and edit.id in self._lost)
        return tuple(f"The robot may enter {one.edit.name}, which was forbidden: {one.why}." for one in lost)

    # What follows for questions and lists.

    @property
    def own_names(self) -> tuple[tuple[str, bool], ...]:
        """The names that people gave, plain, and whether each is that of a room."""
        named = [(plain_name(edit.name), edit.does == "rename room") for edit in self.edits if edit.does != "forbid"]
        return tuple(dict.fromkeys(one for one in named if one[0]))

    def knows(self, phrase: str) -> bool:
        """Return whether a person named something so."""
        return any(name == plain_name(phrase) for name, _ in self.own_names)

    def is_room(self, phrase: str) -> bool:
        """Return whether a person named a room so, and nothing else."""
        return {is_room for name, is_room in self.own_names if name == plain_name(phrase)} == {True}

    def pinned(self, part: Part, heat: HeatSettings) -> NearAnchors | None:
        """Return the heat of a place that a person named; None where nobody named one so."""
        known = self.pins.get(plain_name(part.query)) if self.edits else None
        if known is None:
            return None
        anchor = known[1][None], np.ones(1), np.zeros(1, np.int64)
        return NearAnchors(self._map.space, part, heat.falloff_per_m(part.role), *anchor, True, part.query)

    def object_factor(self, part: Part, heat: HeatSettings, find: Callable[[], NearThings]) -> NearThings:
        """Return the heat of the things that a part of a question names, as people corrected them."""
        if not self.edits or not self.claims:
            return find()
        try:
            raw = find()
        except QueryError:
            if not any(map(means(part.query), (one.name for one in self.claims))):
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
        if colour is not None and lexicon().find(word, EntryKind.THING) is None:
            rgb = np.asarray(self._map.data.voxels.rgb)
            for number, claim in enumerate(given, len(confidence) - len(given)):
                own = np.zeros(len(claim.rows), np.int64)
                confidence[number] *= colour_share(rgb, claim.rows, own, colour)[0]
        mask = np.zeros(len(raw.mask), np.bool_)
        mask[rows] = True
        is_named, uncertain = raw.is_named or bool(given), raw.with_uncertain
        found = float(confidence.max(initial=0.0)) >= FOUND_AT and is_named
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
        margin, score = np.ones(len(self._map.space), np.float32), np.ones(len(self._map.space), np.float32)
        margin[found.rows], score[found.rows] = found.margin, found.score
        return Instances(rows, instance, margin[rows], score[rows], confidence.astype(np.float32))

    def _claimed(
        self, rows: Rows, instance: Rows, confidence: Float[np.ndarray, " i"], word: str
    ) -> tuple[Rows, Rows, Float[np.ndarray, " j"], list[Claim]]:
        # Instances without what people named otherwise, with the claims that the word means behind them.
        exact = [one for one in self.claims if plain_name(one.name) == plain_name(word)]
        is_meant = means(word)
        given = exact or [one for one in self.claims if is_meant(one.name)]
        taken = self._voxels(one for one in self.claims if one.is_named or one in given)
        count = np.bincount(instance, minlength=len(confidence))
        left = np.bincount(instance[~taken[rows]], minlength=len(confidence))
        stays = (left > 0) & (left >= _HALF * count)
        own = stays[instance] & ~taken[rows]
        kept = int(stays.sum())
        new_rows = np.concatenate([rows[own], *(one.rows for one in given)])
        of_given = [np.full(len(one.rows), kept + k) for k, one in enumerate(given)]
        new_instance = np.concatenate([(np.cumsum(stays) - 1)[instance[own]], *of_given]).astype(np.int64)
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
        taken = self._voxels(self.claims)
        things = [one for one in found if not len(one.rows) or taken[one.rows].mean() < _HALF]
        wanted = None if names is None else [means(name) for name in names]

        def is_wanted(name: str, sure: float) -> bool:
            return sure >= least_confidence and (wanted is None or any(one(name) for one in wanted))

        for one in self.claims:
            if is_wanted(one.name, one.confidence):
                thing = thing_of(self._map, one.name, one.confidence, one.rows)
                things.append(replace(thing, edited=said(one.edit)))
        for edit, place in self.pins.values():
            if is_wanted(edit.name, 1.0):
                nothing = (0.0, 0.0, 0.0), (0, 0, 0), np.zeros(0, np.int64), place[None]
                things.append(Thing(edit.name, 1.0, plain_point(place), *nothing, said(edit)))
        return sorted(things, key=lambda one: -one.confidence)

    def named_at(self, rows: Rows) -> str | None:
        """Return what people named most of some voxels; None where they named nothing there."""
        if not self.edits or not len(rows):
            return None
        named = [(float(np.isin(rows, one.rows).mean()), one.name) for one in self.claims if one.is_named]
        share, name = max(named, default=(0.0, ""))
        return name if share >= _HALF else None

    def room_field(self, field: "RoomField") -> "RoomField":
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
        named = {number: said(edit) for number, edit in self.rooms.items()}
        return [replace(room, edited=named[room.region]) if room.region in named else room for room in rooms]

    def life(self, life: "Life") -> "Life":
        """Return what became of things over days, under the names that people gave them, wherever they moved."""
        if not self.edits:
            return life
        import msgspec

        stays, changed = list(life.stays), False
        for edit in self._of("rename"):
            number = self._stay_at(life, self._now(edit.at[0]))
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
        from avlmaps.query.rooms import same_place

        space, names, rooms = self._map.space, set(map(plain_name, named)), list(map(plain_name, areas))
        points = np.asarray(places, np.float64).reshape(-1, 1, 3)

        def is_at(own: Float[np.ndarray, "m 3"]) -> bool:
            return any(float(np.linalg.norm(own - point, axis=1).min()) < _AT_M for point in points)

        made = [(edit.name, edit) for name, (edit, at) in self.pins.items() if name in names or is_at(at[None])]
        made += [
            (edit.name, edit) for edit in self.rooms.values() if any(same_place(edit.name, room) for room in rooms)
        ]
        for one in self.claims:
            if plain_name(one.name) in names or is_at(space.centres_of(one.rows)):
                made.append((one.name, one.edit))
        told = [f"The {plain_name(name)} was {said(edit)}." for name, edit in made]
        told += [str(one) for one in self._lost.values() if plain_name(one.edit.name) in {*names, *rooms}]
        return tuple(dict.fromkeys(told))


def _without_specks(which: Rows, level: Float[np.ndarray, "m 3"]) -> Rows:
    from scipy.spatial import KDTree

    count = np.bincount(which)
    large = count >= max(2.0, _SPECK * len(which))
    if large.all() or not large.any():
        return which
    on_large, out = large[which], which.copy()
    out[~on_large] = which[on_large][KDTree(level[on_large]).query(level[~on_large])[1]]
    return out
