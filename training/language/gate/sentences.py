"""Sentences of frames with their slots filled, and the orders and refusals of the lists."""

import csv
import json
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random

HERE = Path(__file__).parent
_FORMS = ("vp", "ving", "ved", "vpp", "vs")
_KEPT_BACK = ("v33", "v36")


def frames(name: str) -> list[tuple[str, str]]:
    """Return the kind of each frame of a file, and the frame."""
    with (HERE / f"{name}.tsv").open(encoding="utf-8", newline="") as file:
        return [(row["kind"], row["frame"]) for row in csv.DictReader(file, delimiter="\t")]


def filled(random: Random, name: str, times: int) -> Iterator[tuple[bool, str]]:
    """Yield each frame of a file several times with other words, and whether it is no order."""
    slots = _slots()
    for kind, frame in frames(name):
        for _ in range(times):
            text = frame
            whole = random.random() < 0.07
            verb = random.choice(slots["whole" if whole else "verbs"])
            place = "" if whole else f" {random.choice(slots['P'])}"
            for form, said in zip(_FORMS, verb, strict=True):
                text = text.replace(f"{{{form}}}", said + place)
            text = text.replace("{trip}", f"{random.choice(slots['trip'])} {random.choice(slots['P'])}")
            for slot in ("P", "NAME", "FAM", "ASSISTANT"):
                text = text.replace(f"{{{slot}}}", random.choice(slots[slot]))
            first = random.random()
            text = text[0].lower() + text[1:] if first < 0.25 else text[0].upper() + text[1:] if first < 0.4 else text
            yield kind != "order", text.rstrip(".!") if random.random() < 0.3 else text


def of_lists() -> Iterator[tuple[bool, str]]:
    """Yield the orders of the training lists, and what is refused there as talk or as a question."""
    for path in sorted((HERE.parent / "data").glob("v*.jsonl")):
        for row in () if path.stem in _KEPT_BACK else map(json.loads, path.read_text(encoding="utf-8").splitlines()):
            first = row.get("intents", [{"do": "refuse"}])[0]
            if first["do"] == "refuse" and first.get("reason") in ("chat", "question"):
                yield True, row["say"]
            elif first["do"] not in ("refuse", "clarify"):
                yield False, row["say"]


def of_hands(hands: str) -> Iterator[tuple[bool, str]]:
    """Yield the sentences of some hands in `hands.tsv`, and whether each is no order: they had seen no frame."""
    with (HERE / "hands.tsv").open(encoding="utf-8", newline="") as file:
        rows = (row for row in csv.DictReader(file, delimiter="\t") if row["hand"] in hands)
        yield from ((row["is"] == "no", row["sentence"]) for row in rows)


@cache
def _slots() -> dict[str, list]:  # pyright: ignore[reportMissingTypeArgument] - words, or the five forms of verbs
    told = tomllib.loads((HERE / "slots.toml").read_text(encoding="utf-8"))
    verbs = {name: [line.split(" | ") for line in told.pop(name).strip().splitlines()] for name in ("verbs", "whole")}
    return {name: text.split(" | ") for name, text in told.items()} | verbs
