"""`avlmaps changes`: what is new, moved and gone in a map of several days."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import arg

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verb import MapVerb
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from collections.abc import Mapping

    from avlmaps.query.schema import ChangesAnswer


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

    def run(self) -> None:
        """List the changes."""
        answer = list_changes(self)
        emit(answer, change_lines(answer), self.json)


def list_changes(verb: Changes) -> "ChangesAnswer":
    """Return what changed in a map."""
    from avlmaps.query.avlmap import AVLMap

    return AVLMap.open(verb.map).changes(1 if verb.since is None else verb.since, first_seen=verb.first_seen)


def change_lines(answer: "Mapping[str, Any]") -> list[str]:
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
