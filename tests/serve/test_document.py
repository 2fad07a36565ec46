"""The OpenAPI document fits what the server takes."""

import pytest
from jsonschema import Draft202012Validator
from starlette.testclient import TestClient

from avlmaps.core.errors import NoFloorError


def test_the_document_says_which_bodies_fit(client: TestClient) -> None:
    """Checked with schemathesis by hand, too: docs/guides/ask-it-from-your-program.md."""
    described = client.get("/openapi.json").json()
    ask, draw = (described["paths"][f"/maps/{{map}}/{name}"]["post"]["requestBody"] for name in ("ask", "picture"))
    bodies = [
        ({"sentence": "the red thing"}, True), ({"object": "red", "top": 3.0}, True), ({}, False),
        ({"sentence": "a chair", "object": "red"}, False), ({"sentence": None}, False), ({"top": 3}, False),
        ({"object": "red", "sentence": None, "area": None}, True), ({"object": "red", "more": 1}, False),
    ]  # fmt: skip
    for body, fits in bodies:
        schema = ask["content"]["application/json"]["schema"] | {"components": described["components"]}
        assert Draft202012Validator(schema).is_valid(body) == fits, body
        assert (client.post("/maps/room/ask", json=body).status_code == 200) == fits, body
    schema = draw["content"]["application/json"]["schema"]
    assert Draft202012Validator(schema).is_valid({}) and client.post("/maps/room/picture").status_code == 200
    (start, *_) = [one for one in described["paths"]["/maps/{map}/path"]["get"]["parameters"] if one["name"] == "from"]
    for text, fits in (("1.5,2", True), ("-1,2,0.25", True), ("", False), ("here", False), ("1", False)):
        assert Draft202012Validator(start["schema"]).is_valid(text) == fits
        answered = client.get("/maps/room/path", params={"from": text, "to": "1,1"})
        assert (answered.status_code == 200) == fits, answered.text


def test_a_map_without_a_floor_is_no_fault_of_the_server(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    def bare(*_: object) -> None:
        raise NoFloorError("None of the map's voxels was hit, so that no floor can be found; map more frames.")

    monkeypatch.setattr("avlmaps.navigate.paths.PathFinder.answer", bare)
    answered = client.get("/maps/room/path", params={"from": "1,1", "to": "1,2"})
    assert answered.status_code == 422 and answered.json()["error"]["kind"] == "map"
