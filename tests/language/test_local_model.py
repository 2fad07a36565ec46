"""A real language model writes programs: `make test-llm GGUF=FILE`."""

import os
from pathlib import Path

import pytest

from avlmaps.core.errors import BackendError
from avlmaps.language.intents import Go, Turn
from avlmaps.language.local import LocalModel, LocalTranslator, meaning
from avlmaps.language.sentence import Sentence

FILE = os.environ.get("AVLMAPS_LLM", "")
pytestmark = [
    pytest.mark.nightly,
    pytest.mark.skipif(not FILE, reason="no weights: make test-llm GGUF=FILE.gguf"),
    pytest.mark.timeout(3600),
]


@pytest.fixture(scope="module")
def model() -> LocalModel:
    pytest.importorskip("xllamacpp", reason="the extra llm is not installed")
    return LocalModel(FILE)


@pytest.mark.parametrize(
    ("command", "kinds"),
    [
        ("go to the sofa", (Go,)),
        ("turn hundred eighty degrees", (Turn,)),
        ("go to the chair near the sound of glass breaking", (Go,)),
    ],
)
def test_programs_are_of_the_vocabulary(model: LocalModel, command: str, kinds: tuple[type, ...]) -> None:
    written = model.write(command, Sentence(command).tokens)
    intents = meaning(written.program)
    assert intents is not None and tuple(map(type, intents)) == kinds, written.program
    assert min(written.tokens) > 0


def test_what_the_reader_is_unsure_of_is_driven_where_it_agrees(model: LocalModel) -> None:
    told = LocalTranslator(model).program_for("1. go to the sofa 2. go to the bed")
    assert told.program.count("move_to_object") == 2 and any("likewise" in note for note in told.notes)


def test_a_file_that_only_begins_like_a_model_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("xllamacpp", reason="the extra llm is not installed")
    (tmp_path / "cut.gguf").write_bytes(Path(FILE).read_bytes()[:4096])
    with pytest.raises(BackendError, match="cannot be loaded"):
        LocalModel(str(tmp_path / "cut.gguf"))
