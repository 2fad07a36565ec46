"""A question of one word loads none of the heavy packages, and answers as the loaded ones do."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from avlmaps.cli import main
from avlmaps.core.question import Question
from avlmaps.core.registry import Kind, load
from avlmaps.language.questions import parse_sentence
from avlmaps.query.asking import Asked, thing_alone

HEAVY = {
    "numba", "llvmlite", "scipy", "onnxruntime", "av", "matplotlib", "trimesh", "soundfile", "PIL",
    "avlmaps.language", "avlmaps_sim", "typeguard", "jaxtyping", "asyncio", "numpy.ma", "numpy.random",
    "importlib.resources", "starlette", "uvicorn", "torch", "rosbags", "cv2",
    "avlmaps.cli.build", "avlmaps.cli.go", "avlmaps.cli.serve", "avlmaps.cli.shell", "avlmaps.cli.view",
    "avlmaps.days", "avlmaps.live", "avlmaps.navigate", "avlmaps.serve", "avlmaps.view",
    "avlmaps.maps.audio.events", "avlmaps.maps.audio.background", "avlmaps.maps.build",
    "avlmaps.maps.fusion.accumulator", "avlmaps.maps.gravity",
}  # fmt: skip
ASK = """
import json, sys
from avlmaps.cli.main import main
try:
    main(["query", sys.argv[1], sys.argv[2], "--json"])
except SystemExit as end:
    assert not end.code, end.code
print(json.dumps(sorted(sys.modules)))
"""


@pytest.fixture(scope="module")
def encoder():
    return load(Kind.PIXELS, "embedded")


@pytest.fixture(scope="module")
def room_map(walk: Path) -> Path:
    out = walk.parent / "embedded.avlmap"
    with pytest.raises(SystemExit) as stop:
        main(["build", str(walk), "--out", str(out), "--voxel-size-m", "0.1", "--frame-step", "8"])
    assert stop.value.code == 0
    return out


def asked(word: str, encoder: object) -> Question | None:
    data = SimpleNamespace(info=SimpleNamespace(doubts=()))
    avlmap = SimpleNamespace(data=data, encoders=SimpleNamespace(pixels=encoder), has=lambda kind: kind is Kind.PIXELS)
    return thing_alone(Asked(sentence=word), avlmap)  # pyright: ignore[reportArgumentType]


@pytest.mark.nightly  # it builds a map of its own
def test_one_word_loads_no_heavy_package(room_map: Path) -> None:
    done = subprocess.run([sys.executable, "-c", ASK, room_map, "chair"], capture_output=True, text=True, timeout=200)
    assert done.returncode == 0, done.stderr
    answer, loaded = (json.loads(line) for line in done.stdout.splitlines())
    assert answer["parts"][0]["query"] == "chair" and HEAVY & set(loaded) == set()


def test_a_name_is_read_as_the_grammar_reads_it(encoder: object) -> None:
    alone = {word: asked(word, encoder) for word in encoder.vocabulary}  # pyright: ignore[reportAttributeAccessIssue]
    short = {word: question for word, question in alone.items() if question is not None}
    assert len(short) > 0.75 * len(alone)  # the others are sounds or areas as well
    assert {word: parse_sentence(word) for word in short} == short
