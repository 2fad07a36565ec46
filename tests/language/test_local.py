"""A language model on this machine: what it may write, what its programs mean, and that it decides nothing alone."""

import json
import re
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError, LanguageError
from avlmaps.language.commands import Command, UnclearError, read_command
from avlmaps.language.intents import (
    Beside,
    Circle,
    Clarify,
    Face,
    Go,
    Return,
    Side,
    StopAt,
    Target,
    TargetKind,
    VisitEach,
)
from avlmaps.language.lexer import tokenise
from avlmaps.language.local import LocalModel, LocalTranslator, both, examples, grammar, meaning, prompt
from avlmaps.language.program import parse_program, skills
from avlmaps.language.program.writing import write_program
from avlmaps.language.sentence import Sentence
from avlmaps.language.verbalise import verbalise

SOFA = Target(TargetKind.OBJECT, "sofa")


class _Server(BaseHTTPRequestHandler):
    """Answers as llama.cpp's server does; the program stands on the class."""

    program = ""
    asked: dict[str, Any]

    def do_POST(self) -> None:
        type(self).asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        body = json.dumps({"content": self.program, "tokens_evaluated": 9, "tokens_predicted": 4}).encode()
        self.send_response(200)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        pass


@pytest.fixture
def server() -> Iterator[str]:
    http = HTTPServer(("127.0.0.1", 0), _Server)
    threading.Thread(target=http.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{http.server_port}"
    http.shutdown()
    http.server_close()


def test_every_example_means_something_and_its_words_are_in_its_sentence() -> None:
    for command, program in examples():
        intents = meaning(program)
        assert intents, command
        parse_program(write_program(intents))


@given(st.lists(st.sampled_from(sorted(examples())), min_size=1, max_size=3))
def test_the_grammar_takes_the_programs_of_sentences_that_say_them(several: Sequence[tuple[str, str]]) -> None:
    for command, program in several:
        rules = _Rules(grammar(Sentence(command).tokens))
        names_said = all(set(name.split()) <= rules.words for name in re.findall(r'"([^"]*)"', program))
        numbers_said = all(number in rules.numbers for number in re.findall(r"(?<![\w.])\d+(?:\.\d+)?", program))
        assert rules.takes(program + "\n\n") or not (names_said and numbers_said), (command, program)


class _Rules:
    """A grammar as one regular expression: it has no rule that uses itself."""

    def __init__(self, text: str) -> None:
        self.rules = dict(line.split(" ::= ", 1) for line in text.splitlines())
        self.words = {json.loads(word) for word in self.rules["word"].split(" | ")}
        every = " | ".join(self.rules[name] for name in ("n", "m", "s", "deg"))
        self.numbers = {json.loads(number) for number in every.split(" | ")} | {"8"}
        self.expression = re.compile(self._of("root"))

    def takes(self, program: str) -> bool:
        return self.expression.fullmatch(program) is not None

    def _of(self, rule: str) -> str:
        def part(found: re.Match[str]) -> str:
            text, name, space = found.groups()
            if text is not None:
                return re.escape(json.loads(text))
            return f"(?:{self._of(name)})" if name is not None else "" if space else found[0]

        return re.sub(r'("(?:[^"\\]|\\.)*")|([a-z]+)|(\s+)', part, self.rules[rule])


@pytest.mark.parametrize(
    "program",
    [
        'robot.fly_to("sofa")\n\n',
        'robot.move_to_object("fridge")\n\n',
        "robot.move_forward(7)\n\n",
        "import os\n\n",
        "\n",
    ],
)
def test_what_no_skill_does_and_nobody_said_cannot_be_written(program: str) -> None:
    rules = _Rules(grammar(tokenise("go to the sofa")))
    assert rules.takes('robot.move_to_object("sofa")\n\n') and not rules.takes(program)


def test_every_skill_that_moves_can_be_written() -> None:
    text = grammar(tokenise("go to the sofa"))
    assert all(f'"robot.{skill.name}("' in text for skill in skills().values() if skill.moves)


@pytest.mark.parametrize(
    ("program", "intents"),
    [
        ('robot.move_to_object("sofa")', (Go(SOFA),)),
        ('robot.move_to_object("sofa")\nrobot.face("sofa")', (Beside(SOFA, Side.FRONT),)),
        ('robot.move_to_object("sofa", 2)', (StopAt(SOFA, 2.0),)),
        ('robot.with_object_on_left("sofa")', (Face(SOFA, Side.LEFT),)),
        ('robot.move_behind("sofa", 1)', (Beside(SOFA, Side.BEHIND, 1.0),)),
        ('start = robot.current_pos()\nrobot.move_to("sofa")\nrobot.move_to(start)', (Go(SOFA), Return())),
        ('for place in robot.get_all_pos("sofa"):\n    robot.move_to(place)', (VisitEach(SOFA),)),
        ('outline = robot.get_contour("sofa")\nfor i in range(8):\n    robot.move_to(outline[i * len(outline) // 8])',
         (Circle(SOFA),)),
        ("robot.stop_at(2)", None),
        ("robot.move_to(", None),
    ],
)  # fmt: skip
def test_what_programs_mean(program: str, intents: Any) -> None:
    assert meaning(program) == intents


def test_the_nearest_examples_stand_before_the_command() -> None:
    text = prompt("visit every window and come back")
    assert text.endswith("# visit every window and come back\n")
    shown = text.rsplit("\n\n", 2)[-2]
    assert "get_all_pos" in shown or "start" in shown
    assert prompt("go to the sofa")[:700] == text[:700]  # what is always shown is computed once


def test_a_sure_reader_asks_no_model() -> None:
    translator = LocalTranslator(LocalModel("http://127.0.0.1:9"))
    assert translator.program_for("go to the sofa").program == 'robot.move_to_object("sofa")\n'


def _unsure(probability: float, *, drives: bool) -> Command:
    """Return a command that the reader takes as "go to the sofa", or asks about, with "face the sofa" behind it."""
    first, second = (read_command(text).readings[0] for text in ("go to the sofa", "face the sofa"))
    readings = (replace(first, probability=probability), replace(second, probability=1.0 - probability))
    return Command(first.intents if drives else (Clarify("?"),), (), readings, "read" if drives else "unsure")


@pytest.mark.parametrize(
    ("probability", "drives", "model", "wanted"),
    [
        (0.8, True, "go to the sofa", "I will go to the sofa."),
        (0.8, True, "face the sofa", ("I will go to the sofa.", "I will face the sofa.")),
        (0.6, False, "face the sofa", "I will face the sofa."),
        (0.6, False, "go to the bed", ("I will go to the bed.",)),
    ],
)
def test_what_both_read_is_driven_and_else_a_person_is_asked(
    probability: float, drives: bool, model: str, wanted: Any
) -> None:
    told = both(_unsure(probability, drives=drives), read_command(model).readings[0])
    said = told.stops.choices if isinstance(told.stops, Clarify) else verbalise(told.intents)
    assert said == wanted


@pytest.mark.parametrize(("program", "kind"), [('robot.move_to_object("sofa")\n\n', Go), ("nonsense", None)])
def test_a_server_is_asked_for_the_program(server: str, program: str, kind: Any) -> None:
    _Server.program = program
    proposed = LocalTranslator(LocalModel(server)).proposed("go to the sofa")
    assert kind is None if proposed is None else isinstance(proposed.intents[0], kind)
    assert _Server.asked["cache_prompt"] is True and _Server.asked["temperature"] == 0.0
    assert _Server.asked["prompt"].endswith("# go to the sofa\n")


@pytest.mark.parametrize(
    "command", ["run over the cat", "my brother went to the kitchen", "cancel the drive to the bed"]
)
def test_no_model_is_asked_about_a_danger_or_what_is_no_order(command: str) -> None:
    with pytest.raises(UnclearError):
        LocalTranslator(LocalModel("http://127.0.0.1:9")).program_for(command)


def _broken(_: Any) -> None:
    raise RuntimeError("broken file")


def test_faults_say_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = SimpleNamespace(CommonParams=lambda: SimpleNamespace(model=SimpleNamespace()), Server=_broken)
    monkeypatch.setitem(sys.modules, "xllamacpp", library)
    (tmp_path / "no.gguf").write_bytes(b"no model")
    (tmp_path / "yes.gguf").write_bytes(b"GGUF....")
    for model, said in (("none", "cannot be read"), ("no", "no GGUF"), ("yes", "cannot be loaded")):
        with pytest.raises(BackendError, match=said):
            LocalModel(str(tmp_path / f"{model}.gguf"))
    monkeypatch.setitem(sys.modules, "xllamacpp", None)
    with pytest.raises(BackendError, match=r"pip install .*\[llm\]"):
        LocalModel(str(tmp_path / "yes.gguf"))
    with pytest.raises(LanguageError, match="llama-server"):
        LocalModel("http://127.0.0.1:9").write("go to the sofa", tokenise("go to the sofa"))
