"""How well commands and questions are understood, on lists that strangers wrote before the parser saw them.

Each list is a file ``data/language/NAME.jsonl`` (docs/language-intents.md says how rows are written). ``sealed.json``
holds its SHA-256 and what was counted when it was first used; later counts are of a development list.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

from avlmaps.core.errors import LanguageError, QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.words import singulars_of, stem_of
from avlmaps.language.intents import Ask, Inquiry, Target
from avlmaps.language.list_questions import Listed
from avlmaps.language.sentence import Attachments
from avlmaps_sim.bench.harness.figures import wilson

OUTCOMES = ("right", "harmless", "asked back", "misread")
_STOPS = frozenset({"refuse", "clarify"})
_LOOKS = frozenset({"wait", "face", "turn"})
_WHO = frozenset({
    "anyone", "anybody", "someone", "somebody", "person", "people", "a", "an", "the", "sound", "sounds", "noise", "of",
    "on",
})  # fmt: skip
LISTED = {
    Ask.LARGEST_ROOM: ("rooms", "biggest"), Ask.SMALLEST_ROOM: ("rooms", "smallest"),
    Ask.FIRST_SOUND: ("sounds", "first"), Ask.LAST_SOUND: ("sounds", "last"),
    **{Ask(name): ("names", name) for name in ("rooms", "sounds", "things")},
    **{Ask(f"count_{name}"): ("counts", name) for name in ("rooms", "sounds", "things")},
    Ask.CONTENTS: ("in", ""), Ask.BESIDE: ("near", ""),
    **{ask: (str(ask), "") for ask in (
        Ask.ROOM_OF, Ask.WHEN, Ask.HEARD, Ask.BEFORE, Ask.AFTER, Ask.BETWEEN, Ask.MOST, Ask.ROOMS_WITH,
    )},
}  # fmt: skip
"""How lists write the questions to a map's lists: a key, and its value where no target is."""
Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Judged:
    """One row and what became of it.

    ``outcome`` is one of `OUTCOMES`; a wrong motion may hurt where the list says ``danger``.
    """

    say: str
    is_question: bool
    outcome: str
    got: Any
    wanted: Any
    danger: bool = False


def read_list(path: Path) -> list[Row]:
    """Return the rows of a list."""
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]


def judge(row: Row) -> Judged:
    """Return the outcome of a row."""
    if "question" in row:
        return _judge_question(row)
    got = _intents_of(row)
    return Judged(str(row["say"]), False, judge_intents(got, row), got, row["intents"], bool(row.get("danger")))


def judge_intents(got: Sequence[Any], row: Row) -> str:
    """Return the outcome of intents, as JSON, for a row of a command."""
    return min((_outcome(got, each) for each in (row["intents"], *row.get("also", []))), key=OUTCOMES.index)


def judge_question(got: Mapping[str, Any], row: Row) -> str:
    """Return the outcome of an inquiry, as JSON, for a row of a question."""
    return min((_answered(got, each) for each in (row["question"], *row.get("also", []))), key=OUTCOMES.index)


def _intents_of(row: Row) -> list[Any]:
    from avlmaps.language.commands import read_command
    from avlmaps.language.intents import to_json

    try:
        read = read_command(str(row["say"]), Attachments(row.get("image"), row.get("clip")))
    except LanguageError as fault:
        return [{"do": "refuse", "reason": "unknown", "said": str(fault)}]
    return [to_json(intent) for intent in read.intents]


def _judge_question(row: Row) -> Judged:
    try:
        got: Any = _asked(str(row["say"]), Attachments(row.get("image"), row.get("clip"), lambda _: True))
    except QueryError as fault:
        got = {"ask": "refuse", "said": str(fault)}
    return Judged(str(row["say"]), True, judge_question(got, row), got, row["question"])


def _asked(sentence: str, given: Attachments) -> dict[str, Any]:
    """Return the query of a sentence, as JSON; `query` takes storeys, lists and numbers in the same order.

    ``QueryError``: the sentence is not understood.
    """
    from avlmaps.language.list_questions import read_list, said_alternatives
    from avlmaps.language.questions import read_question
    from avlmaps.language.said_places import asks_how_many_storeys, said_storeys

    if asks_how_many_storeys(sentence):
        return {"ask": "list", "counts": "storeys"}
    storeys = said_storeys(sentence)
    if storeys and (storeys[0].lists or not storeys[0].said):
        return {"ask": "list", "storey": storeys[0].said or storeys[0].rest}
    if storeys:
        return {**_asked(storeys[0].rest, given), "storey": storeys[0].said}
    listed = read_list(sentence)
    if listed is not None and listed.of is not Listed.AT_LEAST:
        return {"ask": "list", "near": {"object": listed.name}}
    if listed is not None:
        of = read_question(f"how many {listed.name} are there", given).inquiry.to_json()["of"]
        return {"ask": "list", "at_least": listed.number, "of": of[0]}
    inquiries = [read_question(words, given).inquiry for words in said_alternatives(sentence) or (sentence,)]
    return told(inquiries[0], [target for one in inquiries for target in one.of])


def told(inquiry: Inquiry, targets: Sequence[Target] = ()) -> dict[str, Any]:
    """Return an inquiry as lists write it; ``targets``: instead of its own."""
    ask, of = inquiry.ask, [one.to_json() for one in targets or inquiry.of]
    key, value = LISTED.get(ask, ("", ""))
    if ask is Ask.AT_LEAST:
        return {"ask": "list", "at_least": inquiry.number, "of": of[0]}
    if not key:
        return {"ask": str(ask), "of": of}
    number = {"number": inquiry.number} if ask is Ask.ROOMS_WITH else {}
    return {"ask": "list", key: value or (of if ask.of_two else of[0]), **number}


def _answered(got: Mapping[str, Any], wanted: Any) -> str:
    if not isinstance(wanted, dict) or wanted.get("ask") in _STOPS:
        return "right" if got["ask"] in _STOPS else "misread"
    if got["ask"] in _STOPS:
        return "asked back"
    if "either" in wanted:
        wanted = {"ask": "where", "of": wanted["either"]}
    if wanted["ask"] != "list" and got["ask"] == "list":
        got = _plainly(got, wanted["ask"])
    if "at_least" in wanted and "rooms_with" in got:  # older lists write both alike
        got = {"ask": "list", "at_least": got["number"], "of": got["rooms_with"]}
    if got["ask"] == wanted["ask"] == "list":
        return "right" if _listed(got) == _listed(wanted) else "misread"
    if got["ask"] != wanted["ask"]:
        return "misread"
    targets = [_target(one) for one in got["of"]]
    sought = [_without_storey(one, got["storey"]) if "storey" in got else one for one in wanted["of"]]
    return "right" if all(_target(one) in targets for one in sought) else "misread"


def _plainly(got: Mapping[str, Any], ask: str) -> Mapping[str, Any]:
    if "room_of" in got and ask == "where":
        return {"ask": "where", "of": [got["room_of"]]}
    if "at_least" in got:
        return {"ask": ask, "of": [got["of"]]}
    return {"ask": "how_many", "of": [{"object": got["counts"]}]} if "counts" in got else got


def _without_storey(target: Any, said: str) -> Any:
    near = [_without_storey(one, said) for one in target.get("near", ()) if one.get("area") != said]
    plain = {key: value.replace(said, "").strip() if isinstance(value, str) else value for key, value in target.items()}
    return {**plain, "near": near} if near else {key: value for key, value in plain.items() if key != "near"}


def _listed(asked: Mapping[str, Any]) -> dict[str, Any]:
    told = {name: _target(value) if isinstance(value, dict) else value for name, value in asked.items()}
    return {name: [_target(one) for one in value] if isinstance(value, list) else value for name, value in told.items()}


def _outcome(got: Sequence[Any], wanted: Sequence[Any]) -> str:
    stopped, to_stop = got[0]["do"] in _STOPS, any(each["do"] in _STOPS for each in wanted)
    if stopped or to_stop:
        return "right" if stopped and to_stop else "asked back" if stopped else "misread"
    ours, theirs = _plain(got), _plain(wanted)
    if not any(each.get("way") for each in _flat(wanted)):  # a list need not say which way round
        ours = _plain([_without_way(each) for each in got])
    if ours == theirs:
        return "right"
    return "harmless" if _places(ours) == _places(theirs) else "misread"


def _plain(intents: Sequence[Any]) -> list[Any]:
    return [_intent(each) for each in intents]


def _intent(intent: Mapping[str, Any]) -> tuple[Any, ...]:
    do = intent["do"]
    of, to = intent.get("of"), intent.get("to")
    if do == "repeat":
        return do, int(intent["times"]), tuple(_plain(intent["body"]))
    if do == "between":
        return do, frozenset(_target(one) for one in intent["of"])
    target = _target(of if of is not None else to) if of is not None or to is not None else None
    numbers = tuple(_rounded(intent.get(name)) for name in ("metres", "seconds", "heading", "views", "times"))
    degrees = _rounded(intent.get("degrees"))
    degrees = 180.0 if degrees == -180.0 else degrees
    return do, target, str(intent.get("side", intent.get("way", "ahead"))), degrees, *numbers


def _flat(intents: Sequence[Any]) -> list[Any]:
    return [part for each in intents for part in (each, *_flat(each.get("body", ())))]


def _without_way(intent: Mapping[str, Any]) -> dict[str, Any]:
    plain = {name: value for name, value in intent.items() if name != "way"}
    return {**plain, "body": [_without_way(each) for each in intent["body"]]} if "body" in intent else plain


def _rounded(value: Any) -> float | None:
    return None if value is None else round(float(value), 2)


def _places(intents: Sequence[Any]) -> list[Any]:
    flat = [part for each in intents for part in (each[2] * each[1] if each[0] == "repeat" else (each,))]
    keeps = _LOOKS - ({"turn", "face"} if any(each[0] == "move" for each in flat) else frozenset())
    return [each for each in flat if each[0] not in keeps]


def _target(target: Any) -> Any:
    if isinstance(target, str):
        target = {"object": target}
    kind = next(name for name in ("object", "sound", "area", "image", "clip", "here") if name in target)
    if kind == "object" and (placed := lexicon().in_room(target[kind])):
        target = {**target, kind: placed[0], "near": [*target.get("near", ()), {"area": placed[1]}]}
    target = _storey_apart(target, kind)
    pick, number = target.get("pick", ""), target.get("number", 1)
    name = _name(kind, target[kind])
    if kind in ("object", "area") and _is_both(str(target[kind])):
        kind, name = "area", _name("area", target[kind])  # "the closet": a list may call it a thing or a room
    # A chain counts alike whether a list has it nested or flat: the program multiplies all heats.
    near = [_target(one) for one in target.get("near", ())]
    flat = frozenset(each for one in near for each in ((*one[:2], frozenset(), one[3]), *one[2]))
    return kind, name, flat, f"{pick} {number}" if number > 1 else "" if pick == "nearest" else pick


def _storey_apart(target: Any, kind: str) -> Any:
    from avlmaps.language.said_places import said_storeys

    storeys = said_storeys(str(target[kind])) if kind in ("object", "area") else ()
    if len(storeys) != 1 or not storeys[0].said or not storeys[0].rest:
        return target
    near = [*target.get("near", ()), {"area": storeys[0].said}]
    return {**target, kind: storeys[0].rest, "near": near}


def _is_both(name: str) -> bool:
    words = name.lower().split()
    tail = words[-1] if words else ""
    return lexicon().find(tail, EntryKind.THING) is not None and lexicon().find(tail, EntryKind.ROOM) is not None


def _name(kind: str, name: Any) -> Any:
    if kind in ("image", "clip", "here"):
        return name
    if kind == "sound":
        joined = str(name).lower().replace("door bell", "doorbell")
        return frozenset(stem_of(word) for word in joined.split() if word not in _WHO)
    plain = str(name).lower().replace("-", " ").replace("s' ", "s ")  # an apostrophe that nobody hears
    words = [word for word in plain.split() if word not in ("the", "a", "an", "my")]
    wanted = EntryKind.ROOM if kind == "area" else EntryKind.THING
    for start in range(len(words)):
        entry = lexicon().find(" ".join(words[start:]), wanted)
        if entry is not None:
            return (*words[:start], entry.name)
    return (*words[:-1], next(iter(singulars_of(words[-1])), words[-1])) if words else ()


def counts(judged: Sequence[Judged]) -> dict[str, int]:
    """Return how many rows had each outcome."""
    return {outcome: sum(one.outcome == outcome for one in judged) for outcome in OUTCOMES}


def dangerous(judged: Sequence[Judged]) -> tuple[int, int]:
    """Return how many rows in which a wrong motion may hurt were driven wrongly, and how many such rows there are."""
    rows = [one for one in judged if one.danger]
    return sum(one.outcome in ("misread", "harmless") for one in rows), len(rows)


def row_of(name: str, judged: Sequence[Judged]) -> list[str]:
    """Return a row of the suite's table: counts and shares with 95 % intervals, and how many dangers were driven."""
    found = counts(judged)
    driven, rows = dangerous(judged)
    shares = (_share(found[outcome], len(judged)) for outcome in OUTCOMES)
    return [name, str(len(judged)), *shares, _driven(driven, rows)]


def _driven(driven: int, rows: int) -> str:
    return f"{driven} of {rows}" if rows else "-"


def _share(hits: int, count: int) -> str:
    low, high = wilson(hits, count)
    return f"{hits} ({100 * hits / max(count, 1):.1f} % [{100 * low:.1f}, {100 * high:.1f}])"


def sealed() -> dict[str, Any]:
    """Return for each shipped list its hash and its counts at first use.

    ``possible since`` holds what sentences mean that could not be done or answered when their list was sealed, and the
    list says are to be asked back: "the third door from the right".
    """
    return json.loads(files("avlmaps_sim.bench").joinpath("data/language/sealed.json").read_text(encoding="utf-8"))


def shipped(name: str) -> list[Row]:
    """Return the rows of a shipped list. ``ValueError``: the file is not the one that was sealed."""
    content = files("avlmaps_sim.bench").joinpath(f"data/language/{name}.jsonl").read_bytes()
    if hashlib.sha256(content).hexdigest() != sealed()[name]["sha256"]:
        raise ValueError(f"the list {name} is not the one that was sealed")
    since: Mapping[str, Any] = sealed()[name].get("possible since", {})
    rows = (json.loads(line) for line in content.decode("utf-8").splitlines() if line.strip())
    return [{**row, "also": [*row.get("also", []), since[row["say"]]]} if row["say"] in since else row for row in rows]


def run() -> dict[str, dict[str, list[Any]]]:
    """Return two tables: counts at the first use of each list, and counts now, when the lists are development lists."""
    columns = ["list", "sentences", *OUTCOMES, "dangers driven"]
    first, now = [], []
    parts = {"commands": False, "questions": True}
    at_first_use: dict[str, Counter[str]] = {}  # each round met another parser, so they are not added up
    dangers: dict[str, tuple[int, int]] = {}
    every: list[Judged] = []
    for name, seal in sealed().items():
        if "first use" not in seal:
            continue  # sealed, not yet used
        for part, at_first in seal["first use"].items():
            each_round = f"{seal['round']}, {part}"
            at_first_use.setdefault(each_round, Counter()).update(at_first)
            at_risk = seal.get("dangers at first use") if part == "commands" else None
            if at_risk:
                before = dangers.get(each_round, (0, 0))
                dangers[each_round] = before[0] + at_risk[0], before[1] + at_risk[1]
            first.append([*_counted(f"{name}, {part}", at_first), _driven(*at_risk) if at_risk else "-"])
        judged = [judge(row) for row in shipped(name)]
        every += judged
        now += [row_of(f"{name}, {part}", these) for part, these in _by_part(judged, parts).items() if these]
    first += [[*_counted(name, count), _driven(*dangers.get(name, (0, 0)))] for name, count in at_first_use.items()]
    now += [row_of(f"all, {part}", these) for part, these in _by_part(every, parts).items()]
    return {
        "blind, at first use": {"columns": columns, "rows": first},
        "the same lists now (development)": {"columns": columns, "rows": now},
    }


def _counted(name: str, count: Mapping[str, int]) -> list[str]:
    total = sum(count.values())
    return [name, str(total), *(_share(count.get(outcome, 0), total) for outcome in OUTCOMES)]


def _by_part(judged: Sequence[Judged], parts: Mapping[str, bool]) -> dict[str, list[Judged]]:
    return {part: [one for one in judged if one.is_question is question] for part, question in parts.items()}
