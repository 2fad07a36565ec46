"""Each address of the server, end to end without a network: its answer is that of the package, its errors are JSON."""

from pathlib import Path
from typing import Any

from starlette.testclient import TestClient

from avlmaps.query.avlmap import AVLMap


def plain(answer: dict[str, Any]) -> dict[str, Any]:
    """Return an answer without its time."""
    return {key: value for key, value in answer.items() if key != "elapsed_ms"}


def test_ask_answers_as_the_package_does(client: TestClient, room: Path) -> None:
    answer = client.get("/maps/room/ask", params={"object": "red thing", "top": 5}).json()
    expected = AVLMap.open(room).ask("the red thing", top=5).to_json()
    assert plain(answer)["goals"] == plain(expected)["goals"]
    assert answer["found"] == expected["found"]
    assert answer["frame"] == "recording"


def test_contents_are_those_of_the_package(client: TestClient, room: Path) -> None:
    answer = client.get("/maps/room/contents", params={"least": 0.2}).json()
    assert answer == AVLMap.open(room).contents(0.2).to_json("room")
