"""The OpenAPI 3.1 document of the server, made of the types of requests and answers."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from avlmaps.core.version import __version__
from avlmaps.query.schema import ErrorAnswer
from avlmaps.serve import tiles
from avlmaps.serve.operations import OPERATIONS, Operation
from avlmaps.serve.work import MapsAnswer

_OF_FILES = ("intrinsics",)  # values that only a form with a photo can hold
_DRAWS_MAP = ("drawAnswer",)  # what needs no query
_TEMPLATE = "#/components/schemas/{name}"
_ERRORS = {
    "400": "The request does not fit this document, or holds neither a sentence nor a part.",
    "401": "The token is missing or wrong.",
    "404": "There is no such map, tile or voxel.",
    "413": "The body, the photo or the clip is too large.",
    "415": "A file cannot be read.",
    "422": "The query cannot be answered; the sentence says why.",
    "503": "Too many queries are waiting, or a file of the map cannot be read.",
    "504": "The answer took too long.",
}


_ABOUT = """Answers are the JSON that the command line prints under `--json`. Positions are metres in the frame that
`frame` names. Work that takes long sends its progress as server-sent events (`progress`, then `answer` or `error`) to
clients that accept text/event-stream."""


def document(maps: Iterable[str], url: str, with_token: bool) -> dict[str, Any]:
    """Return the document."""
    types = [MapsAnswer, ErrorAnswer, *(one.query for one in OPERATIONS)]
    types += [one.answer for one in OPERATIONS if isinstance(one.answer, type) and one.answer is not dict]
    types = list(dict.fromkeys(types))
    schemas, components = msgspec.json.schema_components(types, ref_template=_TEMPLATE)
    of = dict(zip(types, schemas, strict=True))
    paths: dict[str, Any] = {
        "/maps": {"get": _operation("listMaps", "List the maps of this server.", [], of[MapsAnswer], of[ErrorAnswer])},
        "/health": {
            "get": {
                "operationId": "health",
                "summary": "Answer that the server runs. Needs no token.",
                "security": [],
                "responses": {"200": {"description": "It runs.", "content": {"application/json": {"schema": {
                    "type": "object", "properties": {"status": {"const": "ok"}, "version": {"type": "string"}},
                    "required": ["status", "version"]}}}}},
            }
        },
    }  # fmt: skip
    for one in OPERATIONS:
        item = paths.setdefault(f"/maps/{{map}}{_plain(one.path)}", {})
        for method in one.methods:
            item[method.lower()] = _described(one, method, of, components, list(maps))
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "avlmaps",
            "version": __version__,
            "summary": "Query maps of what a robot saw and heard.",
            "description": _ABOUT,
            "license": {"name": "MIT", "identifier": "MIT"},
        },
        "servers": [{"url": url}],
        "paths": paths,
        "components": {
            "schemas": components,
            **({"securitySchemes": {"token": {"type": "http", "scheme": "bearer"}}} if with_token else {}),
        },
        **({"security": [{"token": []}]} if with_token else {}),
    }


def _plain(path: str) -> str:
    return re.sub(r":(count|index)}", "}", path)


def _operation(name: str, about: str, parameters: list[Any], schema: Any, error: Any) -> dict[str, Any]:
    return {
        "operationId": name,
        "summary": about,
        "parameters": parameters,
        "responses": {
            "200": {"description": "The answer.", "content": {"application/json": {"schema": schema}}},
            **_errors(error),
        },
    }


def _errors(error: Any) -> dict[str, Any]:
    content = {"application/json": {"schema": error}}
    return {status: {"description": about, "content": content} for status, about in _ERRORS.items()}


def _described(one: Operation, method: str, of: dict[Any, Any], components: dict[str, Any], maps: list[str]) -> Any:
    in_path = [{"name": "map", "in": "path", "required": True, "schema": {"type": "string", "examples": maps}}]
    in_path += [
        {"name": name, "in": "path", "required": True, "schema": {"type": "integer", **least}}
        for name, least in _numbers(one.path)
    ]
    schema = components[of[one.query]["$ref"].rpartition("/")[2]]
    required = set(schema.get("required", []))
    in_query = [
        {
            "name": name,
            "in": "query",
            "required": name in required,
            "description": described.get("description", ""),
            "schema": {key: value for key, value in _in_form(described).items() if key != "description"},
        }
        for name, described in schema.get("properties", {}).items()
        if name not in _OF_FILES or not one.files
    ]
    name = one.name if method == one.methods[0] else f"{one.name}By{method.title()}"
    answer = one.answer
    operation = _operation(name, one.about, in_path + (in_query if method == "GET" else []), {}, of[ErrorAnswer])
    if isinstance(answer, str):
        content = {answer: {"schema": {"type": "string", "contentMediaType": answer}}}
    else:
        given = of[answer] if answer is not dict else {"type": "object"}
        content = {"application/json": {"schema": given}, "text/event-stream": {"schema": {"type": "string"}}}
    operation["responses"]["200"] = {"description": "The answer.", "content": content}
    if one.name == "getTile":
        operation["description"] = (tiles.__doc__ or "").partition("\n\n")[2]
    if method == "POST":
        needed = one.body != "form" or one.name not in _DRAWS_MAP
        operation["requestBody"] = {"required": needed, "content": _bodies(one, schema)}
    return operation


def _bodies(one: Operation, schema: dict[str, Any]) -> dict[str, Any]:
    files = {name: {"type": "string", "contentMediaType": "application/octet-stream"} for name in one.files}
    values = {name: _in_form(described) for name, described in schema.get("properties", {}).items()}
    form = {"type": "object", "properties": {**values, **files}, "additionalProperties": False}
    if one.body == "photo":
        form["required"] = ["photo"]
    elif one.body == "form":
        form |= _words_or_parts(one, one.files) | {"dependentRequired": {"intrinsics": ["photo"]}}
    else:
        form["required"] = schema["required"]
    bodies: dict[str, Any] = {"multipart/form-data": {"schema": form}}
    if one.body == "command":
        bodies["application/json"] = {"schema": schema}
    elif one.body == "form":
        plain = {name: value for name, value in schema["properties"].items() if name not in _OF_FILES}
        bodies["application/json"] = {"schema": {**schema, "properties": plain, **_words_or_parts(one)}}
    else:
        bodies |= {kind: {"schema": {}} for kind in ("image/jpeg", "image/png")}
    return bodies


def _words_or_parts(one: Operation, files: Sequence[str] = ()) -> dict[str, Any]:
    """Return the rule of a query: a sentence or parts, not both, or a file; a picture needs none of them."""

    def given(name: str, pattern: str) -> dict[str, Any]:
        return {"required": [name], "properties": {name: {"type": "string", "pattern": pattern}}}

    parts = [given(name, r"\S") for name in ("object", "sound", "area")]
    rule: dict[str, Any] = {"not": {"allOf": [given("sentence", r"\S"), {"anyOf": parts}]}}
    if one.name not in _DRAWS_MAP:
        rule["anyOf"] = [given("sentence", "[A-Za-z]"), *parts, *({"required": [name]} for name in files)]
    return rule


def _in_form(described: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a value of a form, in which nothing is null: it is left out."""
    kinds = [kind for kind in described.get("anyOf", []) if kind.get("type") != "null"]
    plain = {key: value for key, value in described.items() if key not in ("anyOf", "default")}
    return {**plain, **kinds[0]} if len(kinds) == 1 else described


def _numbers(path: str) -> list[tuple[str, dict[str, int]]]:
    """Return the numbers in a path, and the least that each can be."""
    found = re.findall(r"{(\w+):(count|index)}", path)
    return [(name, {"minimum": 0} if kind == "count" else {}) for name, kind in found]
