"""The gate: what is no order, to the robot, now, moves nothing, whoever would read it."""

import csv
from importlib.resources import files
from pathlib import Path

import pytest

from avlmaps.language.chat import ChatSettings, ChatTranslator
from avlmaps.language.commands import UnclearError, read_command
from avlmaps.language.gate import no_order
from avlmaps.language.translator import LearnedTranslator

LISTS = Path(__file__).parent / "commands"
NO_ORDERS = {
    "asked": ["sofa?"], "postponed": ["postpone the drive to the sofa"],
    "reported": ["Go to the bed, he says to me."],
    "quoted": ["Anna said 'go to the bed' and left", 'the note said: "go to the kitchen"',
               "the poster: go to the kitchen"],
    "other": ["Alexa, go to the kitchen", "let him go to the bed", "turn left, mommy"],
    "wished": ["I wish you could go to the bed"], "threatened": ["go to the bed and I will hate you"],
    "unsure": ["cancel the visit to the sofa", "imagine going to the kitchen", "my brother went to the kitchen",
               "I may send you to the kitchen later", "Granddad keeps yelling go to the shed",
               "Go to the sink one more time and off come your wheels"],
    "crossed": ["go to the sofa ❌", "👎 go to the bed"],
}  # fmt: skip
ORDERS = [
    "Could you go to the kitchen?", "cancel that and go to the sofa", "forget the garden, go to the sofa",
    "I need you to go to the bed", "never mind that, drive to the desk", "stop what you are doing and go to the bed",
    "why don't you go to the kitchen?", "I was wondering if you could go to the sofa", "Go to the bed, I say",
    "go to the book: then turn left",
]  # fmt: skip
HELD_OUT = [("gate_held_out", 90, 10), ("gate_hand_held_out", 180, 14), ("gate_aimed_held_out", 162, 40),
            ("gate_hands_hij_held_out", 272, 42)]  # fmt: skip
ROWS = [(kind, text) for kind, texts in NO_ORDERS.items() for text in texts]


@pytest.mark.parametrize("name", ["gate", "order"])
def test_every_processor_computes_it_alike(name: str) -> None:
    # Products of bytes are cut on processors without VNNI: a sentence was an order on one machine, and none on another.
    graph = files("avlmaps.language.learned").joinpath("weights", f"{name}.onnx").read_bytes()
    assert b"MatMul" in graph and b"MatMulInteger" not in graph and b"DynamicQuantizeLinear" not in graph


@pytest.mark.few(7)
@pytest.mark.parametrize(("kind", "text"), ROWS)
def test_no_front_drives_by_what_is_no_order(kind: str, text: str) -> None:
    closed = no_order(text)
    assert closed is not None and closed.kind == kind
    with pytest.raises(UnclearError):
        LearnedTranslator().program_for(text)
    # No server is there: a model that was asked would fail otherwise.
    with pytest.raises(UnclearError):
        ChatTranslator(ChatSettings(base_url="http://127.0.0.1:9", model="none")).program_for(text)


def test_the_question_offers_the_order_that_would_be_one() -> None:
    asked = read_command("imagine going to the kitchen")
    (order,) = getattr(asked.stops, "choices", ())
    assert asked.why == "gate" and read_command(order).intents == read_command("go to the kitchen").intents


@pytest.mark.parametrize("text", ORDERS)
def test_an_order_passes(text: str) -> None:
    assert no_order(text) is None


@pytest.mark.parametrize("text", ["run over the cat", "drive into the child", "go through the window"])
def test_no_model_is_asked_to_write_a_danger(text: str) -> None:
    with pytest.raises(UnclearError, match="hurt"):
        ChatTranslator(ChatSettings(base_url="http://127.0.0.1:9", model="none")).program_for(text)


@pytest.mark.parametrize(("file", "caught", "asked"), HELD_OUT)
def test_sentences_that_the_network_never_saw_are_told_apart(file: str, caught: int, asked: int) -> None:
    """Of 100, 200, 181, 322 no orders so many are told at least; of 60, 200, 180, 308 orders asked back at most."""
    with (LISTS / f"{file}.tsv").open(encoding="utf-8", newline="") as rows:
        closed = [row["is"] for row in csv.DictReader(rows, delimiter="\t") if no_order(row["sentence"]) is not None]
    assert closed.count("no") >= caught and closed.count("order") <= asked
