"""`avlmaps merge` and `changes`: another day, or another robot, becomes part of a map, and what changed."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from tyro.conf import Positional, arg

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verb import MapVerb, ModelVerb
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap


@dataclass(frozen=True, kw_only=True)
class Changes(MapVerb):
    """List what is new, moved and gone in a map of several days, each with the day on which it was noticed.

    Gone means that a later day looked through its place from where it had been seen. Things whose place nobody looked
    at again are counted as unknown, and stay where they were. `avlmaps merge` adds a day.

    Example: avlmaps changes home.avlmap --since 2026-11-24
    """

    since: Annotated[str | None, arg(metavar="DAY")] = None
    """List what changed after this day: a date such as 2026-11-24, or the number of a visit, from 1. Default: the
    first."""
    first_seen: bool = False
    """List also what was seen first on a later day where nobody had looked before."""

    def answer(self, avlmap: "AVLMap") -> Mapping[str, Any]:
        """Return what changed in a map."""
        return avlmap.changes(1 if self.since is None else self.since, first_seen=self.first_seen)

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        """Lay out the changes."""
        return change_lines(answer)


def change_lines(answer: Mapping[str, Any]) -> list[str]:
    """Lay out changes as a table, and what is not known."""
    from avlmaps.query.changes import said

    unknown = answer["unknown"]
    not_known = [f"{unknown} things are unknown: nobody looked at their place again"] if unknown else []
    if not answer["changes"]:
        return [f"nothing is known to have changed since {said(answer['since'])}", *not_known]
    rows = [
        (
            one["kind"], one["name"], f"{one['confidence']:.2f}", place_text(one["position"]),
            place_text(one["from"]) if one["from"] else "", one["room"] or "", said(one["noticed"]),
            said(one["last_seen"]),
        )
        for one in answer["changes"]
    ]  # fmt: skip
    head = ("change", "thing", "confidence", "position", "from", "room", "noticed on", "last seen on")
    return [*table_lines(head, rows), *not_known]


@dataclass(frozen=True, kw_only=True)
class Merge(ModelVerb):
    """Make one map of a map and of another day's: it is found in the first by its pictures, and updates it.

    The other map needs no guess of where it is; it may be of another robot with other cameras. It is refused, with the
    numbers, where its pictures or its surfaces do not say that it is the same place. Things of the first map are gone
    only where the other day looked through their place; where it did not look, nothing is known of them.

    Example: avlmaps merge monday.avlmap tuesday.avlmap --out home.avlmap --first-day 2026-11-23 --day 2026-11-24

    Example: avlmaps changes home.avlmap
    """

    compiles: ClassVar[bool] = True

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder, of one day or of several."""
    other: Annotated[Positional[Path], arg(metavar="OTHER")]
    """Map folder of a later day, built with the same profile and voxels."""
    out: Annotated[Path, arg(metavar="MAP")]
    """Map folder to write; both others stay as they are."""
    day: Annotated[str | None, arg(metavar="DAY")] = None
    """Day of OTHER, such as 2026-11-24. Default: by its stamps, if those are of a clock."""
    first_day: Annotated[str | None, arg(metavar="DAY")] = None
    """Day of MAP, if it is of one day, likewise."""
    overwrite: bool = False
    """Replace a map at --out."""

    def run(self) -> None:
        """Merge."""
        answer = merge(self)
        emit(answer, merge_lines(answer), self.json)


def merge(verb: Merge) -> dict[str, Any]:
    """Merge two maps and return by what the place was found, and what changed."""
    from avlmaps.days.merge import merge_maps
    from avlmaps.query.avlmap import AVLMap, with_findings

    begin_s = perf_counter()
    made = merge_maps(
        AVLMap.open(verb.map), AVLMap.open(verb.other), verb.out, day=verb.day or "",
        first_day=verb.first_day or "",
        overwrite=verb.overwrite,
    )  # fmt: skip
    made = with_findings(made)
    return {**merged_answer(made), "elapsed_s": round(perf_counter() - begin_s, 3)}


def merged_answer(made: "AVLMap") -> dict[str, Any]:
    """Return what is known of a merged map's last day."""
    from avlmaps.days.merge import NO_SOURCES
    from avlmaps.query.changes import Days, changes_answer

    days = Days.of(made)
    visit = made.data.info.visits[-1]
    notes = [notice for notice in made.data.info.notices if notice.startswith(NO_SOURCES)]
    return {
        **({"notes": notes} if notes else {}),
        "path": str(made.path),
        "voxels": made.data.info.counts.voxels,
        "keyframes": made.data.info.counts.keyframes,
        "map_from_recording": [list(row) for row in visit.map_from_recording],
        "checks": visit.checks,
        **{key: value for key, value in changes_answer(days, str(made.path), days.last - 1).items() if key != "map"},
    }


def merge_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out what `merge` reports."""
    checks = answer["checks"]
    found = (
        f"found: {checks['agreeing']:.0f} of {checks['located']:.0f} located keyframes agree "
        f"({checks['keyframes_tried']:.0f} tried), over {checks['spread_m']:g} m; {checks['agreement']:.1%} of "
        f"{checks['looked']:.0f} voxels lie on the map's surface"
    )
    notes = [f"note: {note}" for note in answer.get("notes", ())]
    return [found, *notes, *change_lines(answer), f"wrote {answer['path']}: {answer['voxels']} voxels"]
