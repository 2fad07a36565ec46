"""The laws of typed intents."""

from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.language import intents as act
from avlmaps.language.intents import Clarify, Go, Intent, Refuse, Side, Target, TargetKind, Wait, paths_in, row_of
from avlmaps.language.program import parse_program
from avlmaps.language.program.writing import write_program
from avlmaps.language.verbalise import verbalise
from avlmaps.language.word_classes import table

NAMES = st.sampled_from(["lamp", "table", "sofa", "door", "plant"])
LEAVES = st.builds(Target, st.sampled_from([TargetKind.OBJECT, TargetKind.AREA, TargetKind.SOUND]), NAMES)
CHAINS = st.recursive(
    LEAVES, lambda inner: st.builds(Target, st.just(TargetKind.OBJECT), NAMES, st.lists(inner, max_size=2).map(tuple))
)


def said(target: Target) -> set[str]:
    """Return every name in a target, before it is made."""
    return {target.name, *(name for one in target.near for name in said(one))}


@given(NAMES, st.lists(CHAINS, min_size=1, max_size=3))
def test_no_part_of_a_chain_is_lost_in_the_program(name: str, near: list[Target]) -> None:
    target = Target(TargetKind.OBJECT, name, tuple(near))
    assert all(not one.near for one in target.near)
    program = write_program((Go(target),))
    for word in set().union({name}, *(said(one) for one in near)):
        assert f'"{word}"' in program


def test_a_chain_keeps_the_order_of_its_words() -> None:
    table = Target(TargetKind.OBJECT, "table", (Target(TargetKind.OBJECT, "sofa"), Target(TargetKind.AREA, "kitchen")))
    lamp = Target(TargetKind.OBJECT, "lamp", (table, Target(TargetKind.OBJECT, "door")))
    assert [one.name for one in lamp.near] == ["table", "sofa", "kitchen", "door"]


SOFA, LAMP, HERE = Target(TargetKind.OBJECT, "sofa"), Target(TargetKind.OBJECT, "lamp"), Target(TargetKind.HERE)
VALUES = {"to": SOFA, "of": SOFA, "metres": 2.0, "degrees": 30.0, "heading": 45.0, "seconds": 5.0, "times": 3,
          "views": 3, "body": (Wait(),), "otherwise": (Go(SOFA),)}  # fmt: skip
CLASSES = {one.do: one for one in get_args(Intent) if one not in (Refuse, Clarify)}
ROWS = table("intents")["row"]


@pytest.mark.parametrize("intent", [act.VisitEach(HERE), act.If(HERE, (Go(SOFA),)), act.Turn(), Clarify()])
def test_an_intent_that_is_no_program_is_refused(intent: Intent) -> None:
    with pytest.raises(ValueError, match=r"has no row|cannot look up where"):
        write_program((intent,))


def test_a_place_that_a_loop_looked_up_has_its_name_behind_it_and_one_of_a_condition_has_none() -> None:
    looked_up = (act.VisitEach(SOFA), Go(SOFA))
    assert write_program((act.Repeat(2, looked_up), Go(SOFA))).endswith("\nrobot.move_to_object(sofa)\n")
    assert write_program((act.If(LAMP, looked_up), Go(SOFA))).endswith("\nrobot.move_to_object(sofa2)\n")


def test_every_intent_has_a_row() -> None:
    assert {row["do"] for row in ROWS} == CLASSES.keys()


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["words"])
def test_every_row_is_chosen_and_its_program_parses(row: dict[str, Any]) -> None:
    intent, where = CLASSES[row["do"]], row.get("where", {})
    said = {path.partition("[")[0].partition(".")[0] for path in paths_in(row["words"] + row["program"])}
    values = {name: VALUES[name] for name in said & VALUES.keys()} | {name: one[0] for name, one in where.items()}
    if "of[0].kind" in where or "of[1].kind" in where or row["do"] == "between":
        values = {"of": (HERE, LAMP) if "of[0].kind" in where else (SOFA, HERE if where else LAMP)}
    if "side" in intent.__dataclass_fields__:
        values["side"] = Side(values.get("side", "left" if row["do"] == "face" else "north"))
    made = intent(**values)
    assert row_of(made).words == row["words"] and row_of(made).program == row["program"]
    assert parse_program(write_program((made,))).statements and "{" not in verbalise((made,))
