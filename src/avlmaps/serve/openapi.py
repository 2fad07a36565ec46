"""The operations of the HTTP interface: one table that makes routes, the OpenAPI document and the page at the root."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any, Literal

import msgspec

from avlmaps.core.version import __version__
from avlmaps.navigate.paths import PathAnswer
from avlmaps.query.places import PlaceAnswer
from avlmaps.query.schema import (
    ChangesAnswer,
    ContentsAnswer,
    EditsAnswer,
    ErrorAnswer,
    LocateAnswer,
    QueryAnswer,
    RoomsAnswer,
    SourcesAnswer,
)
from avlmaps.serve import requests, tiles, work
from avlmaps.serve.tiles import TilesAnswer
from avlmaps.serve.work import MapsAnswer


@dataclass(frozen=True, slots=True)
class Operation:
    """One thing that a client can do with a map.

    Attributes:
        name: for the OpenAPI document, ``operationId``.
        path: below ``/maps/{map}``; ``{name:count}`` and ``{name:index}`` are
            whole numbers, the latter also below 0.
        about: one sentence.
        query: the type of the request.
        answer: the type of the answer's JSON, or a media type.
        work: makes the answer, in a thread.
        lane: quick for queries in words, slow for all else.
        body: what a POST may bring: nothing (then there is only GET), a query as JSON or a form, a command likewise
            (then there is only POST), or a form or a photo as the body (likewise).
        files: names of the files of a form.
    """

    name: str
    path: str
    about: str
    query: type
    answer: Any
    work: Callable[[Any, Any], Any]
    lane: Literal["quick", "slow"] = "quick"
    body: Literal["none", "form", "command", "photo"] = "none"
    files: tuple[str, ...] = ()

    @property
    def methods(self) -> tuple[str, ...]:
        """HTTP methods: GET with values in the address, POST with a body."""
        if self.body == "none":
            return ("GET",)
        return ("GET", "POST") if self.body == "form" else ("POST",)


OPERATIONS = (
    Operation("describeMap", "", "Describe a map, as `avlmaps info` does.",
              requests.NoQuery, dict, work.describe_map, "slow"),
    Operation("listContents", "/contents", "List things, sounds and rooms, as `avlmaps things` does.",
              requests.ThingsQuery, ContentsAnswer, work.list_contents, "slow"),
    Operation("listThings", "/things", "List the things of a map, a room or a day, or near a place; a page of them.",
              requests.ListedThingsQuery, work.ListedThingsAnswer, work.list_things, "slow"),
    Operation("listSounds", "/sounds", "List the sounds of a map.",
              requests.NoQuery, work.SoundsAnswer, work.list_sounds, "slow"),
    Operation("getSound", "/sounds/{sound:count}/clip", "Return the clip of a sound, counted from 0.",
              requests.NoQuery, "audio/flac", work.sound_clip, "slow"),
    Operation("listRooms", "/rooms", "List the rooms of a map, as `avlmaps rooms` does.",
              requests.RoomsQuery, RoomsAnswer, work.list_rooms, "slow"),
    Operation("listSources", "/sources", "List where the sounds came from, as `avlmaps sources` does.",
              requests.SourcesQuery, SourcesAnswer, work.list_sources, "slow"),
    Operation("listChanges", "/changes", "List what is new, moved and gone since a day, as `avlmaps changes` does.",
              requests.ChangesQuery, ChangesAnswer, work.list_changes, "slow"),
    Operation("listEdits", "/edits", "List what people corrected, as `avlmaps edit --list` does.",
              requests.NoQuery, EditsAnswer, work.list_edits, "slow"),
    Operation("editMap", "/edit", "Correct the map, as `avlmaps edit` does; later queries know it.",
              requests.EditQuery, EditsAnswer, work.edit, "slow", "command"),
    Operation("ask", "/ask", "Query a map in a sentence or part by part, as `avlmaps query` does.",
              requests.AskQuery, QueryAnswer, work.ask, "quick", "form", ("photo", "clip")),
    Operation("locate", "/locate", "Return the camera pose of a photo, as `avlmaps locate` does.",
              requests.LocateQuery, LocateAnswer, work.locate, "slow", "photo", ("photo",)),
    Operation("describePlace", "/place", "Return what is at a place.", requests.PlaceQuery, PlaceAnswer, work.place),
    Operation("findPath", "/path", "Return the path between two places for a robot's body.",
              requests.PathQuery, PathAnswer, work.path, "slow"),
    Operation("drawAnswer", "/picture", "Draw the answer of a query, or the map.",
              requests.PictureQuery, "image/png", work.picture, "slow", "form", ("photo", "clip")),
    Operation("listTiles", "/tiles", "List the tiles of a map's voxels, by level of detail.",
              requests.NoQuery, TilesAnswer, work.tiles, "slow"),
    Operation("getTile", "/tiles/{level:count}/{i:index}/{j:index}/{k:index}", "Return one tile of voxels.",
              requests.TilesQuery, "application/octet-stream", work.tile, "slow"),
    Operation("getKeyframe", "/keyframes/{keyframe:count}", "Return the picture of a keyframe, counted from 0.",
              requests.NoQuery, "image/jpeg", work.keyframe),
    Operation("view", "/view", "Show the map in a browser, as `avlmaps view` does.",
              requests.ViewQuery, "text/html", work.viewer),
    Operation("viewMap", "/view/map", "Return what the page of `view` needs to begin.",
              requests.NoQuery, dict, work.drawn_map),
    Operation("viewVoxels", "/view/voxels", "Return the voxels that the page draws, in the order of drawing.",
              requests.NoQuery, "application/octet-stream", work.drawn_voxels),
    Operation("viewLabels", "/view/labels", "Return the thing, the room and the name of each voxel that is drawn.",
              requests.NoQuery, "application/octet-stream", work.drawn_labels, "slow"),
    Operation("viewContents", "/view/contents", "Return things, sounds and rooms with the colours of the page.",
              requests.NoQuery, dict, work.drawn_contents, "slow"),
    Operation("viewVoxel", "/view/voxels/{voxel:count}", "Return what a voxel that is drawn is taken for.",
              requests.NoQuery, dict, work.drawn_voxel),
    Operation("askInView", "/view/ask", "Query a map, and return the answer with the heat of each voxel that is drawn.",
              requests.AskQuery, "application/octet-stream", work.ask_in_view, "quick", "form", ("photo", "clip")),
    Operation("rehearse", "/view/rehearse", "Plan a command on the map; no real robot moves.",
              requests.RehearseQuery, dict, work.rehearse, "slow", "command", ("photo", "clip")),
)  # fmt: skip


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
    found = re.findall(r"{(\w+):(count|index)}", path)
    return [(name, {"minimum": 0} if kind == "count" else {}) for name, kind in found]


CONTENT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'"
_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#26292e;background:#fff}
code,pre{font:14px/1.4 ui-monospace,monospace;background:#f6f5f1;border-radius:4px}
code{padding:.1em .3em}pre{padding:.8em;overflow:auto}
table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.3em .6em}
th,td{border-top:1px solid #ddd;vertical-align:top}
h2{margin-top:2rem}h3{margin-bottom:.2rem}
@media(prefers-color-scheme:dark){body{background:#16181b;color:#e4e2dc}code,pre{background:#22252a}
th,td{border-color:#3a3d42}}
"""


def html_page(address: str) -> str:
    """Return the page of the server at an address, such as ``http://127.0.0.1:8750``."""
    described = document([], "", False)
    sections = "\n".join(
        _section(path, method.upper(), operation)
        for path, item in described["paths"].items()
        for method, operation in item.items()
    )
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<title>avlmaps server</title><style>{_STYLE}</style></head><body>
<h1>avlmaps server</h1>
<p>Version {escape(__version__)}, {len(OPERATIONS)} operations on each map. The maps: <a href="maps">maps</a>.
In the browser, a map is at <code>/maps/NAME/view</code>.
For programs: <a href="openapi.json">openapi.json</a> (OpenAPI 3.1). For agents: MCP by streamable HTTP at
<code>/mcp</code>.</p>
<pre>curl -G {escape(address)}/maps/NAME/ask --data-urlencode "sentence=the chair near the table"
curl -F photo=@photo.jpg {escape(address)}/maps/NAME/locate</pre>
<p>Answers are the JSON that the command line prints under <code>--json</code>. Errors are
<code>{{"error": {{"kind": ..., "message": ...}}}}</code>. Send <code>Accept: text/event-stream</code> for the
progress of work that takes long.</p>
<h2>Operations</h2>
{sections}
</body></html>
"""


def _section(path: str, method: str, operation: dict) -> str:
    rows = "".join(
        f"<tr><td><code>{escape(one['name'])}</code></td><td>{escape(one['in'])}</td>"
        f"<td>{'required' if one['required'] else ''}</td><td>{escape(one.get('description', ''))}</td></tr>"
        for one in operation.get("parameters", [])
    )
    table = f"<table><tr><th>value</th><th>in</th><th></th><th></th></tr>{rows}</table>" if rows else ""
    bodies = ", ".join(operation.get("requestBody", {}).get("content", {}))
    body = f"<p>Body: <code>{escape(bodies)}</code></p>" if bodies else ""
    more = f"<pre>{escape(operation['description'])}</pre>" if "description" in operation else ""
    return f"<h3><code>{method} {escape(path)}</code></h3><p>{escape(operation['summary'])}</p>{table}{body}{more}"
