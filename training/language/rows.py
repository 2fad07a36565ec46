"""Rows of the lists: a sentence with what it means, typed, and the voice that wrote it."""

import json
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from avlmaps.language.intents import (
    Ask,
    Beside,
    Between,
    Circle,
    Clarify,
    Face,
    Go,
    If,
    Inquiry,
    Intent,
    Move,
    Pick,
    RefusalReason,
    Refuse,
    Repeat,
    Return,
    Side,
    StopAt,
    Target,
    TargetKind,
    Turn,
    TurnSense,
    VisitEach,
    Wait,
)  # fmt: skip
from avlmaps_sim.bench.language import LISTED, sealed

ROOT = Path(__file__).parents[2]
BLIND = ROOT / "packages/avlmaps-sim/src/avlmaps_sim/bench/data/language"
LISTS = ROOT / "tests/language/commands"
VOICES = Path(__file__).parent / "data"
_WHICH_PLACE = re.compile(r"\b(?:rooms?|where|which|\w+where|zones|places)\b", re.IGNORECASE)
_WHICH_ROOM = re.compile(r"\b(?:which|what) room\b", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Example:
    """A sentence and one thing that it means.

    Attributes:
        say: the sentence.
        meaning: intents of a command, or the inquiry of a question (None: it cannot be answered).
        is_question: which of the two.
        voice: the name of the list.
        image: the file that came along.
        clip: the file that came along.
        row: the row of the list, to be judged by.
        also: other voices whose rows it is made from.
    """

    say: str
    meaning: "tuple[Intent, ...] | Inquiry | None"
    is_question: bool
    voice: str
    image: str | None = None
    clip: str | None = None
    row: Mapping[str, Any] = field(default_factory=dict)
    also: tuple[str, ...] = ()


def target_of(said: Any) -> Target:
    """Return a target of its JSON."""
    if isinstance(said, str):
        said = {"object": said}
    kind = next(kind for kind in TargetKind if str(kind) in said)
    name = "" if kind is TargetKind.HERE else str(said[str(kind)])
    near = tuple(target_of(one) for one in said.get("near", ()))
    return Target(kind, name, near, Pick(said.get("pick", "")), int(said.get("number", 1)))


def intent_of(said: Mapping[str, Any]) -> Intent:  # noqa: C901
    """Return an intent of its JSON."""
    do = said["do"]
    to = said.get("to", said.get("of"))
    metres = None if said.get("metres") is None else float(said["metres"])
    match do:
        case "go":
            return Go(target_of(to))
        case "face":
            return Face(target_of(to), Side(said.get("side", "ahead")))
        case "turn":
            return Turn(said.get("degrees"), said.get("heading"))
        case "move":
            return Move(float(said["metres"]))
        case "between":
            a, b = to
            return Between((target_of(a), target_of(b)))
        case "beside":
            return Beside(target_of(to), Side(said["side"]), metres)
        case "stop_at":
            return StopAt(target_of(to), float(said["metres"]))
        case "circle":
            return Circle(target_of(to), said.get("views"), TurnSense(said.get("way", "")))
        case "visit_each":
            return VisitEach(target_of(to))
        case "wait":
            return Wait(said.get("seconds"))
        case "return":
            return Return()
        case "repeat":
            return Repeat(int(said["times"]), tuple(intent_of(one) for one in said["body"]))
        case "refuse":
            return Refuse(RefusalReason(said.get("reason") or "unknown"))
        case "if":
            then, otherwise = (tuple(intent_of(one) for one in said.get(key, ())) for key in ("body", "otherwise"))
            return If(target_of(to), then, otherwise)
        case _:
            return Clarify()


def meanings(row: Mapping[str, Any]) -> "list[tuple[Intent, ...] | Inquiry | None]":
    """Return what a row means, and what else it may mean."""
    if "question" in row:
        readings = [one for one in (row["question"], *row.get("also", ())) if isinstance(one, dict)]
        # Some lists are older than the lists of a map: what they refuse is answered now.
        readings.sort(key=lambda one: one["ask"] != "list")
        found = (
            _listed(one, row["say"]) if one["ask"] == "list" else _inquiry(one) for one in readings if _is_read(one)
        )
        asks_room = _WHICH_ROOM.search(row["say"]) is not None
        return [_of_room(one) if asks_room else one for one in found]
    # What is done at each of several places is written behind the visit; `claims.at_each` puts it inside.
    every = (row["intents"], *row.get("also", ()))
    return [tuple(intent_of(step) for one in each for step in (one, *_at_each(one))) for each in every]


def _at_each(said: Mapping[str, Any]) -> Sequence[Any]:
    return said.get("body", ()) if said["do"] == "visit_each" else ()


def _of_room(asked: Inquiry | None) -> Inquiry | None:
    """Return a question that an older list takes for one where a thing is."""
    if asked is None or asked.ask is not Ask.WHERE or asked.of[0].kind is TargetKind.AREA:
        return asked
    return replace(asked, ask=Ask.ROOM_OF)


def _inquiry(said: Mapping[str, Any]) -> Inquiry | None:
    if said["ask"] in ("refuse", "clarify"):
        return None
    return Inquiry(Ask(said["ask"]), tuple(target_of(one) for one in said["of"]))


_LISTED = {told: ask for ask, told in LISTED.items()}


def _listed(said: Mapping[str, Any], say: str) -> Inquiry:
    if "at_least" in said:  # older lists write both alike
        target = target_of(said["of"])
        ask = Ask.ROOMS_WITH if _WHICH_PLACE.search(say) and not target.near else Ask.AT_LEAST
        return Inquiry(ask, (target,), int(said["at_least"]))
    ((key, of),) = ((key, of) for key, of in said.items() if key not in ("ask", "number"))
    ask = _LISTED.get((key, "")) or _LISTED[key, of]
    targets = () if ask.of_map else tuple(map(target_of, of if isinstance(of, list) else [of]))
    return Inquiry(ask, targets, int(said.get("number", 1)))


def _is_read(said: Mapping[str, Any]) -> bool:
    """Return whether the networks read a question, not rows of `list_questions.toml`."""
    return said["ask"] != "list" or bool({"at_least", *(key for key, _ in _LISTED)} & set(said))


def examples_of(path: Path) -> Iterator[Example]:
    """Yield the rows of a list with all that each may mean; the first is what it means most likely."""
    since = sealed().get(path.stem, {}).get("possible since", {})  # the list is older, and refuses it
    for line in path.read_text(encoding="utf-8").splitlines():
        if not line.strip():
            continue
        row = json.loads(line)
        if row["say"] in since:
            row["question" if "question" in row else "intents"] = since[row["say"]]
        try:
            found = meanings(row)
        except (KeyError, ValueError, TypeError, StopIteration) as fault:
            print(f"{path.name}: {row.get('say')!r}: {fault!r}", file=sys.stderr)
            continue
        for at, meaning in enumerate(found):
            said = str(row["say"])
            yield Example(said, meaning, "question" in row, path.stem, row.get("image"), row.get("clip"),
                          row if at == 0 else {})  # fmt: skip


def lists() -> dict[str, list[Path]]:
    """Return the files of rows: the blind lists, the lists of speakers, and the voices written for training."""
    return {
        "blind": sorted(BLIND.glob("*.jsonl")),
        "speakers": [*sorted(LISTS.glob("speakers_*.jsonl")), LISTS / "intents.jsonl"],
        "voices": sorted(VOICES.glob("*.jsonl")),
    }  # fmt: skip
