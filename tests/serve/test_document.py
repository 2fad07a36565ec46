"""The OpenAPI document against the server: what fits it is answered as it says, and what does not fit is refused."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from starlette.testclient import TestClient

from avlmaps.core.version import __version__

# Of a query with neither a sentence nor a part, or with both: OpenAPI cannot state that of an address.
MAY_LACK_WORDS = ("ask", "askByPost", "askInView", "drawAnswer", "drawAnswerByPost")
light = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def document(client: TestClient) -> dict[str, Any]:
    return client.get("/openapi.json").json()


def operations(document: dict[str, Any]) -> list[tuple[str, dict[str, Any]]]:
    """Return path and description of all that is read by an address."""
    return [(path, item["get"]) for path, item in document["paths"].items() if "get" in item]


def values(schema: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Return values that fit a schema, for those kinds that parameters have."""
    if "enum" in schema:
        return st.sampled_from([value for value in schema["enum"] if value is not None])
    if "anyOf" in schema:
        return st.one_of([values(one) for one in schema["anyOf"] if one.get("type") != "null"])
    kind = schema["type"]
    if kind == "boolean":
        return st.booleans()
    if kind in ("integer", "number"):
        low, high = schema.get("minimum", schema.get("exclusiveMinimum", -(10**6))), schema.get("maximum", 10**6)
        if kind == "integer":
            return st.integers(int(low), int(high)) | st.sampled_from([int(low), int(high)])
        return st.floats(low, high, exclude_min="exclusiveMinimum" in schema)
    if kind == "array":
        return st.lists(values(schema["items"]), max_size=3)
    assert kind == "string", schema
    most = schema.get("maxLength", 40)
    free = st.text(st.characters(codec="utf-8", exclude_characters="\x00"), max_size=30)
    words = st.sampled_from(["red", "the red thing", "kitchen", "how many chairs", "the biggest room", "upstairs"])
    fits = re.compile(schema.get("pattern", ""))
    made = st.from_regex(fits) if "pattern" in schema else free
    return (words | made).filter(lambda text: len(text) <= most and bool(fits.search(text)))


def as_text(value: Any) -> Any:
    return str(value).lower() if isinstance(value, bool) else value


def told_right(document: dict[str, Any], operation: dict[str, Any], answered: Any) -> None:
    """Fail where an answer is not what the document says of its status."""
    status = str(answered.status_code)
    assert status in operation["responses"] and answered.status_code < 500, answered.text[:300]
    content = operation["responses"][status]["content"]
    kind = answered.headers["content-type"].partition(";")[0]
    assert kind in content and answered.content, (status, kind)
    if kind == "application/json":
        schema = content[kind]["schema"] | {"components": document["components"]}
        Draft202012Validator(schema).validate(answered.json())


@light
@given(data=st.data())
def test_what_fits_is_answered_as_the_document_says(
    client: TestClient, document: dict[str, Any], data: st.DataObject
) -> None:
    path, operation = data.draw(st.sampled_from(operations(document)))
    query: dict[str, Any] = {}
    for one in operation.get("parameters", []):
        if one["in"] == "path":
            drawn = "room" if one["name"] == "map" else data.draw(st.integers(0, 2))
            path = path.replace(f"{{{one['name']}}}", str(drawn))
        elif one["required"] or data.draw(st.booleans()):
            query[one["name"]] = as_text(data.draw(values(one["schema"])))
    answered = client.get(path, params=query)
    told_right(document, operation, answered)
    assert answered.status_code != 400 or operation["operationId"] in MAY_LACK_WORDS, answered.text


@light
@given(data=st.data())
def test_a_value_of_another_kind_or_range_is_refused(
    client: TestClient, document: dict[str, Any], data: st.DataObject
) -> None:
    typed = [
        (path, operation, one)
        for path, operation in operations(document)
        for one in operation.get("parameters", [])
        if one["in"] == "query" and ("enum" in one["schema"] or one["schema"].get("type") not in ("string", "array"))
    ]
    path, operation, one = data.draw(st.sampled_from(typed))
    wrong = ["x1", "[1]", "1e999", "nan"]
    if one["schema"].get("type") in ("integer", "number") and "maximum" in one["schema"]:
        wrong.append(str(one["schema"]["maximum"] + 1))
    path = re.sub(r"{\w+}", "0", path.replace("{map}", "room"))
    query = {"sentence": "red"} if operation["operationId"] in MAY_LACK_WORDS else {}
    needed = {other["name"]: "1" for other in operation["parameters"] if other["in"] == "query" and other["required"]}
    answered = client.get(path, params={**needed, **query, one["name"]: data.draw(st.sampled_from(wrong))})
    assert answered.status_code == 400, answered.text
    told_right(document, operation, answered)


def test_intrinsics_without_a_photo_are_refused(client: TestClient) -> None:
    for values in ({}, {"sentence": "the red thing"}):
        refused = client.post("/maps/room/picture", files={"intrinsics": (None, "525,525,320,240")}, data=values)
        assert refused.status_code == 400 and "photo" in refused.json()["error"]["message"]


# What OpenAPI cannot state of an address: words and parts that exclude or need one another.
AT_ODDS = (
    ({"sentence": "red", "object": "red"}, 400, "takes a sentence, or parts"),
    ({"sentence": "red", "primary": "sound"}, 422, "has no sound to be its primary part"),
    ({"object": "red", "primary": "area"}, 422, "has no area to be its primary part"),
    ({"object": "red", "intrinsics": "1,1,1,1"}, 400, "Intrinsics belong to a photo"),
    ({"object": "red", "intrinsics": "x"}, 400, "Intrinsics are fx,fy,cx,cy"),
    ({"sound": "dog", "at": "source"}, 422, "room.avlmap does not know where sounds came from"),
)


@pytest.mark.parametrize("path", ["ask", "view/ask", "picture"])
def test_parts_of_a_query_that_are_at_odds_are_refused_with_one_sentence(client: TestClient, path: str) -> None:
    nothing = client.get(f"/maps/room/{path}", params={"sentence": " "})
    assert nothing.status_code == (200 if path == "picture" else 400)  # without a query the map is drawn
    for query, status, said in AT_ODDS:
        answered = client.get(f"/maps/room/{path}", params=query)
        assert answered.status_code == status, (query, answered.text[:200])
        message = answered.json()["error"]["message"]
        assert said in message and "/" not in message, query


def test_server_json_is_of_this_release() -> None:
    entry = json.loads((Path(__file__).parents[2] / "server.json").read_text(encoding="utf-8"))
    (package,) = entry["packages"]
    assert entry["version"] == package["version"] == __version__
    assert re.fullmatch(r"[a-zA-Z0-9.-]+/[a-zA-Z0-9._-]+", entry["name"])
    assert len(entry["description"]) <= 100 and package["identifier"] == "avlmaps"
    assert package["transport"] == {"type": "stdio"}
    assert f"avlmaps=={__version__}" == package["runtimeArguments"][0]["value"]
    assert [one.get("value") or one.get("name") or one["valueHint"] for one in package["packageArguments"]] == [
        "serve", "map", "--stdio",
    ]  # fmt: skip
