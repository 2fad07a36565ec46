"""One query has one answer, by whichever front it is asked: Python, command line, shell, HTTP, agent, viewer."""

import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from avlmaps.cli import main
from avlmaps.core.printable import shortened
from avlmaps.core.question import Modality, Part, Question
from avlmaps.maps.build import build_map
from avlmaps.maps.settings import BuildSettings
from avlmaps.query.asking import AskError
from avlmaps.query.avlmap import AVLMap
from avlmaps.recordings.open import open_recording
from avlmaps.serve.agents import agent_server, compact, fitting
from avlmaps.serve.app import create_app
from avlmaps.serve.service import Service
from avlmaps.view.labels import TOP
from helpers.agent_talk import Agent

pytestmark = (
    pytest.mark.nightly
)  # its map takes 15 s of the processor; each front by itself is held to the package by day
SENTENCES = ["where can I sit?", "how many chairs are there", "the chiar in the kitchen", "a zebra", "the last sound"]
PARTS = [
    {"object": "sofa", "area": "kitchen"},
    {"object": "chair", "near": "1.0,2.0"},
    {"sound": "doorbell", "object": "table", "primary": "sound"},
]


@pytest.fixture(scope="module")
def home(walk: Path) -> Path:
    """A map of the same room by an encoder of names."""
    path = walk.parent / "home.avlmap"
    build_map(open_recording(walk), path, "synthetic", BuildSettings(voxel_size_m=0.1), progress=False)
    return path


@pytest.fixture(scope="module")
def opened(home: Path) -> AVLMap:
    return AVLMap.open(home)


@pytest.fixture(scope="module")
def home_service(home: Path) -> Iterator[Service]:
    service = Service.open({"home": home})
    yield service
    service.close()


def plain(answer: dict[str, Any]) -> dict[str, Any]:
    """Return an answer as JSON has it, without its time."""
    return json.loads(json.dumps(shortened(answer))) | {"elapsed_ms": None}


def by_command_line(home: Path, query: dict[str, str], capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    words = [query["sentence"]] if "sentence" in query else []
    options = [word for key, value in query.items() if key != "sentence" for word in (f"--{key}", value)]
    capsys.readouterr()
    with pytest.raises(SystemExit) as stop:
        main(["query", str(home), *words, *options, "--json", "--top", str(TOP)])
    assert stop.value.code == 0
    return json.loads(capsys.readouterr().out)


def by_shell(home: Path, query: dict[str, str], capsys: Any, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    words = query.get("sentence") or " ".join(f'--{key} "{value}"' for key, value in query.items() if key != "sentence")
    words = f"query --top {TOP} " + (f'"{words}"' if "sentence" in query else words)
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(f"{words}\n".encode()), encoding="utf-8"))
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(["shell", str(home), "--json"])
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize(
    "query", [{"sentence": words} for words in SENTENCES] + PARTS, ids=lambda one: "+".join(one.values())
)
def test_every_front_gives_the_answer_of_the_package(
    home: Path,
    opened: AVLMap,
    home_service: Service,
    query: dict[str, str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    given: dict[str, Any] = {**query}
    expected = plain({**opened.ask(given.pop("sentence", ""), TOP, **given).to_dict()})
    with TestClient(create_app(home_service), base_url="http://127.0.0.1:8750") as client:
        served = client.get("/maps/home/ask", params={**query, "top": TOP}).json()
        seen = client.get("/maps/home/view/ask", params={**query, "top": TOP}).content
    fronts = {
        "command line": by_command_line(home, query, capsys),
        "shell": by_shell(home, query, capsys, monkeypatch),
        "server": served,
    }
    fronts["viewer"] = json.loads(seen[4 : 4 + int.from_bytes(seen[:4], "little")])["answer"]
    for front, answer in fronts.items():
        assert plain(answer) == expected, front
    told = Agent(agent_server(home_service)).call("ask", **query, top=TOP)
    assert told == fitting(compact(expected)), "the same, rounded and cut for an agent"


NOTHING: list[tuple[Callable[[AVLMap], object], str]] = [
    (lambda m: m.ask(), "takes a sentence, or parts"),
    (lambda m: m.ask(" "), "takes a sentence, or parts"),
    (lambda m: m.ask("chair", object="chair"), "not both"),
    (lambda m: m.ask("the chair", image="photo.png"), "does not speak of the file"),
    (lambda m: m.ask("chair", 0), "0 goals"),
    (lambda m: m.ask("chair", intrinsics=(1, 1, 1, 1)), "there is none"),
    (lambda m: m.ask(Question.of([Part(Modality.OBJECT, "chair")]), area="kitchen"), "holds its parts already"),
]


@pytest.mark.parametrize(("ask", "says"), NOTHING, ids=[says for _, says in NOTHING])
def test_what_does_not_fit_together_is_refused(opened: AVLMap, ask: Callable[[AVLMap], object], says: str) -> None:
    with pytest.raises(AskError, match=says):
        ask(opened)
