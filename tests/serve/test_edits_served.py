"""A map that is corrected through the server: the next request knows it, and others' edits are seen as well."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from avlmaps.maps.store.edits import EDITS, read_edits
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.service import Service


@pytest.fixture
def place(room: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(room, tmp_path / "home.avlmap"))


def test_an_edit_is_made_listed_known_and_undone(place: Path, serving: Callable[..., TestClient]) -> None:
    client = serving(Service.open({"home": place}))
    assert client.get("/maps/home/ask?sentence=where+is+the+zorb+pad").status_code == 422
    version = client.get("/maps").json()["maps"][0]["version"]
    made = client.post(
        "/maps/home/edit", json={"does": "pin", "name": "my zorb pad", "at": "0.5,0.5,0.1", "by": "Anna"}
    )
    assert made.status_code == 200 and "my zorb pad is at (0.50, 0.50, 0.10) m from now on" in made.json()["text"]
    after = client.get("/maps/home/ask?sentence=where+is+the+zorb+pad").json()
    assert after["found"] and after["goals"][0]["position"] == [0.5, 0.5, 0.1]
    assert any(note.startswith("The zorb pad was named by Anna on ") for note in after["notes"])
    assert client.get("/maps").json()["maps"][0]["version"] != version
    assert client.get("/maps/home/things").json()["things"][0]["name"] == "my zorb pad"
    (row,) = client.get("/maps/home/edits").json()["edits"]
    assert (row["state"], row["by"]) == ("applied", "Anna")
    assert client.post("/maps/home/edit", json={"does": "undo", "edit": row["id"]}).status_code == 200
    assert client.get("/maps/home/ask?sentence=where+is+the+zorb+pad").status_code == 422
    assert [edit.does for edit in read_edits(place)] == ["pin", "undo"]


def test_an_edit_from_beside_the_server_is_seen_at_the_next_request(
    place: Path, serving: Callable[..., TestClient]
) -> None:
    service = Service.open({"home": place})
    client = serving(service)
    first = service.shelf.get("home")
    AVLMap.open(place).edit.pin("zorb pad", (0.5, 0.5, 0.1))
    assert client.get("/maps/home/ask?sentence=the+zorb+pad").json()["found"]
    second = service.shelf.get("home")
    assert second is not first and second.avlmap.space is first.avlmap.space, "the voxels are not read again"
    assert not first.avlmap.edited, "who holds the old map goes on with it"
    (place / EDITS).write_text("{\n")
    assert client.get("/maps/home/ask?sentence=the+zorb+pad").json()["found"], (
        "a damaged log leaves the edits of before"
    )


@pytest.mark.parametrize(
    ("body", "status", "why"),
    [
        ({"does": "rename", "name": "red"}, 400, "rename needs to"),
        ({"does": "explode"}, 400, "does not fit"),
        ({"does": "pin", "name": "x", "at": "here"}, 400, "A place is x,y"),
        ({"does": "merge"}, 422, "fewer than two"),
        ({"does": "undo", "edit": "12345678"}, 422, "no edit '12345678'"),
        ({"does": "forbid", "name": "x", "box": [0.0, 0.0, 1.0]}, 422, "A box is x0,y0,x1,y1"),
        ({"does": "rename", "name": "unicorn", "to": "horse"}, 422, "The map shows no unicorn"),
    ],
)
def test_what_cannot_be_made_is_refused_in_a_sentence(
    client: TestClient, body: dict[str, object], status: int, why: str, room: Path
) -> None:
    answer = client.post("/maps/room/edit", json=body)
    assert answer.status_code == status and why in answer.json()["error"]["message"], answer.text
    assert not (room / EDITS).exists()
