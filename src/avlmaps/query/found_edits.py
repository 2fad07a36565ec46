"""What people corrected, found in a map as it is now: things, rooms, places and areas, and the edits that find none."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float, Int
from avlmaps.core.wording import place_text
from avlmaps.maps.store.edits import Edit, EditedSpot, World
from avlmaps.query.components import linked
from avlmaps.query.edit_spots import ALIKE_BOX, SeenMap, Spots
from avlmaps.query.raster import in_polygon

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import ForbiddenArea

_SAME_BOX = 0.5
"""Share of two boxes together that both hold from which they are certainly one thing: measured as ``ALIKE_BOX``, 71 of
94 right pairs have it and none of 110 wrong ones (.34 at most); the half of a thing has no more."""
HALF = 0.5  # of its voxels: then a thing is in the claim
_SPECK = 0.05  # share of a thing; smaller pieces belong to the nearest larger one
_SAME_ROOM = 0.25
"""Share of a room's outline and a region together that both hold: perhaps one room. On the maps of ``ALIKE_BOX`` the
regions that are most like the 16 rooms have .39 to .97, and those of other rooms .15 at most. A region that holds the
room's middle may have less: one room was split in the rebuild, .36 and .57."""
_POSSESSIVES = ("the ", "a ", "an ", "my ", "your ", "our ")
_DONE = {"rename": "named", "rename room": "named", "merge": "made one thing", "split": "split", "pin": "named",
         "forbid": "forbidden"}  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Claim:
    """Voxels that an edit made one thing.

    Attributes:
        name: of the thing.
        rows: numbers of its voxels in the map, ascending.
        confidence: that it has this name, in [0, 1]; 1 where a person said so.
        is_named: whether a person said so.
        edit: the last one that made it.
    """

    name: str
    rows: Int[np.ndarray, " m"]
    confidence: float
    is_named: bool
    edit: Edit


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
    """Return who did what and when, in words: ``named by a person on 2026-11-26``."""
    return f"{_DONE[edit.does]} by {edit.by or 'a person'} on {edit.day}"


def plain_name(name: str) -> str:
    """Return a name in lower case without the words before it: "My charging dock" is "charging dock"."""
    word = " ".join(name.casefold().split())
    return next((word.removeprefix(one) for one in _POSSESSIVES if word.startswith(one)), word)


class FoundEdits:
    """Edits, and what each is about. What is computed of them once is stored.

    Attributes:
        edits: those in force.
    """

    def __init__(self, edits: tuple[Edit, ...], avlmap: SeenMap) -> None:
        self.edits = edits
        self._map, self._spots = avlmap, Spots(avlmap)
        self._lost: dict[str, LostEdit] = {}

    def __bool__(self) -> bool:
        return bool(self.edits)

    @cached_property
    def claims(self) -> tuple[Claim, ...]:
        """The things that were renamed, merged or split, by their first voxel."""
        claims: list[Claim] = []
        for edit in self._of("rename", "merge", "split"):
            found = [self._targets(spot.now(self._map.stored.keyframes), claims) for spot in edit.at]
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
        named = bool(edit.name) or first.is_named
        sure = 1.0 if edit.name else max(one.confidence for one in targets if one.name == first.name)
        rows = np.unique(np.concatenate([one.rows for one in targets]))
        return [Claim(edit.name or first.name, rows, sure, named, edit)]

    def _pieces(self, rows: Int[np.ndarray, " m"], edit: Edit) -> list[Int[np.ndarray, " m"]]:
        space = self._map.space
        level = space.level(space.centres_of(rows))
        cut = self._cut_of(edit)
        if len(cut) == 2:
            along = cut[1] - cut[0]
            which = ((level[:, :2] - cut[0]) @ np.array([-along[1], along[0]]) > 0.0).astype(np.int64)
        elif len(cut):
            which = in_polygon(level[:, :2], cut).astype(np.int64)
        else:
            which = linked(np.asarray(space.index)[rows], 1)
            which = _without_specks(which, level)
        return [rows[which == number] for number in np.unique(which)]

    def _cut_of(self, edit: Edit) -> Float[np.ndarray, "k 2"]:
        if not edit.cut:
            return np.zeros((0, 2))
        spot = edit.at[0]
        with_cut = EditedSpot(middle=spot.middle, corners=edit.cut, seen_from=spot.seen_from).now(
            self._map.stored.keyframes
        )
        return self._map.space.level(np.array(with_cut.corners, np.float64))[:, :2]

    def _targets(self, spot: EditedSpot, claims: Sequence[Claim]) -> list[Claim]:
        """Return the claims, or the thing of the map, that a spot is about; none where there is nothing like it."""
        own = [(self._spots.overlap(spot, self._spots.box(one.rows)), one) for one in claims]
        share, best = max(own, key=lambda one: one[0], default=(0.0, None))
        if best is not None and share >= _SAME_BOX:
            return [best]
        thing = self._spots.thing_at(spot) or self._spots.thing_at(self._spots.carried(spot))
        if thing is None:
            return [best] if best is not None and share >= ALIKE_BOX else []
        holding = [one for one in claims if share_in(thing.rows, one.rows) >= HALF]
        inside = [one for one in claims if share_in(one.rows, thing.rows) >= HALF]
        if holding or inside:
            return holding[:1] or inside
        taken = np.concatenate([np.zeros(0, np.int64), *(one.rows for one in claims)])
        rows = np.setdiff1d(thing.rows, taken)
        nobody = Edit(schema=1, id="", does="rename", made="")
        return [Claim(thing.name, rows, thing.confidence, False, nobody)] if len(rows) else []

    def spot_of(self, name: str, rows: Int[np.ndarray, " m"]) -> EditedSpot:
        """Return what an edit is about: the thing of some voxels."""
        return self._spots.spot_of(name, rows)

    @cached_property
    def rooms(self) -> Mapping[int, Edit]:
        """The edits of rooms, by the number of the region in ``AVLMap.room_regions``."""
        edits, regions = self._of("rename room"), None
        if edits:
            regions = self._map.room_regions
        found: dict[int, Edit] = {}
        for edit in edits:
            spot = edit.at[0].now(self._map.stored.keyframes)
            share = np.zeros(1)
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
        keyframes = self._map.stored.keyframes
        return {plain_name(edit.name): (edit, np.array(edit.at[0].now(keyframes).middle)) for edit in self._of("pin")}

    @cached_property
    def forbidden(self) -> "tuple[ForbiddenArea, ...]":
        """The areas that no robot enters; several may have one name, as each wet floor has."""
        from avlmaps.maps.obstacles import ForbiddenArea

        areas: list[ForbiddenArea] = []
        storeys = self._map.storeys
        for edit in self._of("forbid"):
            corners = np.array(edit.at[0].now(self._map.stored.keyframes).corners, np.float64)
            storey = 0 if storeys is None else int(storeys.of_places(corners.mean(axis=0))[0])
            level = self._map.space.level(corners)[:, :2]
            areas.append(ForbiddenArea(edit.name, said(edit), level, storey))
        return tuple(areas)

    @property
    def unheeded(self) -> tuple[str, ...]:
        """A sentence for each area that was forbidden and that this map does not know, so that a robot may enter it."""
        _ = self.forbidden
        lost = (self._lost[edit.id] for edit in self.edits if edit.does == "forbid" and edit.id in self._lost)
        return tuple(f"The robot may enter {one.edit.name}, which was forbidden: {one.why}." for one in lost)

    @property
    def lost(self) -> tuple[LostEdit, ...]:
        """The edits that find nothing to apply to; finding that out looks for what each is about."""
        _ = self.claims, self.rooms, self.pins, self.forbidden
        return tuple(self._lost[edit.id] for edit in self.edits if edit.id in self._lost)

    def _of(self, *does: str) -> list[Edit]:
        wanted = [edit for edit in self.edits if edit.does in does]
        own: list[Edit] = []
        for edit in wanted:
            if edit.world is None or edit.world.is_that_of(World.of(self._map.stored.info)):
                own.append(edit)
            else:
                self._lose(edit, f"it was made in a map of another recording, {edit.world.name}")
        return own

    def _lose(self, edit: Edit, why: str) -> None:
        self._lost[edit.id] = LostEdit(edit, why)


def _without_specks(which: Int[np.ndarray, " m"], level: Float[np.ndarray, "m 3"]) -> Int[np.ndarray, " m"]:
    from scipy.spatial import KDTree

    count = np.bincount(which)
    large = count >= max(2.0, _SPECK * len(which))
    if large.all() or not large.any():
        return which
    on_large = large[which]
    nearest = KDTree(level[on_large]).query(level[~on_large])[1]
    out = which.copy()
    out[~on_large] = which[on_large][nearest]
    return out


def share_in(rows: Int[np.ndarray, " m"], others: Int[np.ndarray, " k"]) -> float:
    """Return which share of some voxels are among others."""
    return float(np.isin(rows, others).mean()) if len(rows) else 0.0
