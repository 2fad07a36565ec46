"""Everything that a client can do, as one table: the routes of HTTP, the OpenAPI document, and the tools of agents."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import msgspec

from avlmaps.core.version import __version__
from avlmaps.navigate.paths import PathAnswer
from avlmaps.query import schema as answers
from avlmaps.query.places import PlaceAnswer
from avlmaps.serve import requests as ask
from avlmaps.serve import work
from avlmaps.serve.drawn import TilesAnswer


@dataclass(frozen=True, slots=True)
class Operation:
    """One thing that a client can do."""

    name: str  # ``operationId`` of the OpenAPI document; of what agents alone can do, their name of it
    path: str | None  # below its mount, with ``{name}`` for values of the request; None for what agents alone can do
    about: str  # one sentence
    query: type[msgspec.Struct]  # the request
    answer: Any  # the type of the answer's JSON, or a media type
    work: Callable[..., Any]
    slow: bool = False  # whether it waits for other slow work, as all but queries in words do
    methods: tuple[str, ...] = ("GET",)  # GET has its values in the address; POST takes JSON (files in base64), a form
    files: tuple[str, ...] = ()  # that it takes, by name; a photo may be the body itself
    needs: tuple[str, ...] = ()  # the files without which it does nothing
    status: int = 200  # where it is done
    tool: str = ""  # as agents call it; "" where they cannot
    brief: str = ""  # ``about`` for agents, who read it before every conversation
    read_only: bool = True  # whether it changes nothing, in the map or in the world
    destructive: bool = False  # whether what it changes cannot be taken back


_BYTES = "application/octet-stream"
_BOTH, _POST, _FILES = ("GET", "POST"), ("POST",), (ask.PHOTO, ask.CLIP)
OPERATIONS = (
    Operation("describeMap", "", "Describe a map, as `avlmaps info` does.",
              ask.NoQuery, dict, work.describe_map, slow=True),
    Operation("listContents", "/contents", "List things, sounds and rooms, as `avlmaps things` does.",
              ask.ThingsQuery, answers.ContentsAnswer, work.list_contents, slow=True),
    Operation("listThings", "/things", "List the things of a map, a room or a day, or near a place; a page of them.",
              ask.ListedThingsQuery, work.ListedThingsAnswer, work.list_things, slow=True),
    Operation("listSounds", "/sounds", "List the sounds of a map.",
              ask.NoQuery, work.SoundsAnswer, work.list_sounds, slow=True),
    Operation("getSound", "/sounds/{sound}/clip", "Return the clip of a sound, counted from 0.",
              ask.SoundQuery, "audio/flac", work.sound_clip, slow=True),
    Operation("listRooms", "/rooms", "List the rooms of a map, as `avlmaps rooms` does.",
              ask.RoomsQuery, answers.RoomsAnswer, work.list_rooms, slow=True),
    Operation("listSources", "/sources", "List where the sounds came from, as `avlmaps sources` does.",
              ask.SourcesQuery, answers.SourcesAnswer, work.list_sources, slow=True),
    Operation("listChanges", "/changes", "List what is new, moved and gone since a day, as `avlmaps changes` does.",
              ask.ChangesQuery, answers.ChangesAnswer, work.list_changes, slow=True),
    Operation("listEdits", "/edits", "List what people corrected, as `avlmaps edit --list` does.",
              ask.NoQuery, answers.EditsAnswer, work.list_edits, slow=True),
    Operation("editMap", "/edit", "Correct the map, as `avlmaps edit` does; later queries know it.",
              ask.EditQuery, answers.EditsAnswer, work.edit, slow=True, methods=_POST),
    Operation("describe_map", None, "Start here: floors, kinds of room, and how many things of each name.",
              ask.NoQuery, dict, work.describe_building, slow=True, tool="describe_map"),
    Operation("list_rooms", None, "List the rooms, each with the number of its things.",
              ask.RoomsToolQuery, dict, work.tool_rooms, slow=True, tool="list_rooms"),
    Operation("list_things", None, "List the things of a room, near a place, or of a name; total counts them.",
              ask.ThingsToolQuery, dict, work.tool_things, slow=True, tool="list_things"),
    Operation("list_sounds", None, "List recorded sounds: name, time, the robot's position then.",
              ask.SoundsToolQuery, dict, work.tool_sounds, slow=True, tool="list_sounds"),
    Operation("ask", "/ask", "Query a map in a sentence or part by part, as `avlmaps query` does.",
              ask.AskQuery, answers.QueryAnswer, work.ask, methods=_BOTH, files=_FILES, tool="ask",
              brief="Find places by a sentence, or by parts (object, sound, area, photo, clip). With found=false goals "
              "are guesses."),
    Operation("locate", "/locate", "Return the camera pose of a photo, as `avlmaps locate` does.",
              ask.LocateQuery, answers.LocateAnswer, work.locate, slow=True, methods=_POST, files=_FILES[:1],
              needs=_FILES[:1], tool="locate_photo", brief="Return the pose of the camera that took a photo here."),
    Operation("describePlace", "/place", "Return what is at a place.",
              ask.PlaceQuery, PlaceAnswer, work.place, tool="describe_place",
              brief="Return what is at a place: names, kind of room, last seen."),
    Operation("last_seen", None, "Return where a thing is and when the robot last saw it.",
              ask.LastSeenQuery, dict, work.seen_last, tool="last_seen"),
    Operation("goal_near", None, "Return goals by the length of the path from a place, and where to stop.",
              ask.GoalNearQuery, dict, work.goal_near, slow=True, tool="goal_near"),
    Operation("findPath", "/path", "Return the path between two places for a robot's body.",
              ask.PathQuery, PathAnswer, work.path, slow=True),
    Operation("drawAnswer", "/picture", "Draw the answer of a query, or the map.",
              ask.PictureQuery, "image/png", work.picture, slow=True, methods=_BOTH, files=_FILES),
    Operation("listTiles", "/tiles", "List the tiles of a map's voxels, by level of detail.",
              ask.NoQuery, TilesAnswer, work.tiles, slow=True),
    Operation("getTile", "/tiles/{level}/{i}/{j}/{k}", "Return one tile of voxels.",
              ask.TilesQuery, _BYTES, work.tile, slow=True),
    Operation("getKeyframe", "/keyframes/{keyframe}", "Return the picture of a keyframe, counted from 0.",
              ask.KeyframeQuery, "image/jpeg", work.keyframe),
    Operation("view", "/view", "Show the map in a browser, as `avlmaps view` does.",
              ask.ViewQuery, "text/html", work.viewer),
    Operation("viewMap", "/view/map", "Return what the page of `view` needs to begin.",
              ask.NoQuery, dict, work.drawn_map),
    Operation("viewVoxels", "/view/voxels", "Return the voxels that the page draws, in the order of drawing.",
              ask.NoQuery, _BYTES, work.drawn_voxels),
    Operation("viewLabels", "/view/labels", "Return the thing, the room and the name of each voxel that is drawn.",
              ask.NoQuery, _BYTES, work.drawn_labels, slow=True),
    Operation("viewContents", "/view/contents", "Return things, sounds and rooms with the colours of the page.",
              ask.NoQuery, dict, work.drawn_contents, slow=True),
    Operation("viewVoxel", "/view/voxels/{voxel}", "Return what a voxel that is drawn is taken for.",
              ask.VoxelQuery, dict, work.drawn_voxel),
    Operation("askInView", "/view/ask", "Query a map, and return the answer with the heat of each voxel that is drawn.",
              ask.AskQuery, _BYTES, work.ask_in_view, methods=_BOTH, files=_FILES),
    Operation("rehearse", "/view/rehearse", "Plan a command on the map; no real robot moves.",
              ask.RehearseQuery, dict, work.rehearse, slow=True, methods=_POST, files=_FILES),
)  # fmt: skip

_ERRORS = {
    "400": "The request does not fit this document, or holds neither a sentence nor a part.",
    "401": "The token is missing or wrong.",
    "403": "The token names no plan that waits.",
    "404": "There is no such map, tile or voxel.",
    "409": "The robot drives already, or the plan no longer holds.",
    "410": "The plan is too old.",
    "413": "The body, the photo or the clip is too large.",
    "415": "A file cannot be read.",
    "422": "The query or the order cannot be answered; the sentence says why.",
    "503": "Too much is waiting, a file of the map cannot be read, or the robot does not answer.",
    "504": "The answer took too long.",
}
_ABOUT = """Answers are the JSON that the command line prints under `--json`. Positions are metres in the frame that
`frame` names. A query is a sentence or parts, and not both. Work that takes long sends its progress as server-sent
events (`progress`, then `answer` or `error`) to clients that accept text/event-stream."""


def document(
    maps: Iterable[str], url: str, with_token: bool, mounts: Mapping[str, Sequence[Operation]]
) -> dict[str, Any]:
    """Return the OpenAPI document of a server: its maps, and the operations of further applications by their paths."""
    paths: dict[str, Any] = {
        "/maps": {"get": {"operationId": "listMaps", "summary": "List the maps of this server.", "parameters": []}},
        "/health": {"get": {"operationId": "health", "summary": "Answer that the server runs. Needs no token.",
                            "security": [], "responses": {"200": _content("It runs.", {"type": "object"})}}},
    }  # fmt: skip
    every = [("/maps/{map}", one) for one in OPERATIONS if one.path is not None]
    every += [(mount, one) for mount, operations in mounts.items() for one in operations if one.path is not None]
    types = [work.MapsAnswer, answers.ErrorAnswer]
    types += [one.answer for _, one in every if isinstance(one.answer, type) and one.answer is not dict]
    types = list(dict.fromkeys(types))
    schemas, components = msgspec.json.schema_components(types, ref_template="#/components/schemas/{name}")
    of = {dict: {"type": "object"}, **dict(zip(types, schemas, strict=True))}
    errors = {status: _content(about, of[answers.ErrorAnswer]) for status, about in _ERRORS.items()}
    paths["/maps"]["get"]["responses"] = {"200": _content("The maps.", of[work.MapsAnswer]), **errors}
    named = {"name": "map", "in": "path", "required": True, "schema": {"type": "string", "examples": list(maps)}}
    for mount, one in every:
        item = paths.setdefault(mount + (one.path or ""), {})
        for method in one.methods:
            described = _described(one, method, [named] if "{map}" in mount else [], of)
            item[method.lower()] = described | {"responses": {**errors, **described["responses"]}}
    secured = {"securitySchemes": {"token": {"type": "http", "scheme": "bearer"}}} if with_token else {}
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
        "components": {"schemas": components, **secured},
        **({"security": [{"token": []}]} if with_token else {}),
    }


def _described(one: Operation, method: str, parameters: list[Any], of: Mapping[Any, Any]) -> dict[str, Any]:
    schema = ask.schema_of(one.query)
    in_path = re.findall(r"{(\w+)}", one.path or "")
    for name, value in schema["properties"].items():
        # intrinsics belong to a photo
        if name in in_path or (method == "GET" and not (name == "intrinsics" and one.files)):
            place = {"in": "path" if name in in_path else "query", "required": name in schema.get("required", ())}
            about = {"description": value.get("description", ""), "schema": value}
            parameters = [*parameters, {"name": name, **place, **about}]
    text = {"schema": {"type": "string"}}
    if isinstance(one.answer, str):
        content = {one.answer: text}
    else:
        content = {"application/json": {"schema": of[one.answer]}, "text/event-stream": text}
    described = {
        "operationId": one.name if method == one.methods[0] else f"{one.name}By{method.title()}",
        "summary": one.about,
        "parameters": parameters,
        "responses": {str(one.status): {"description": "The answer.", "content": content}},
    }
    if one.name == "getTile":
        from avlmaps.serve import drawn

        described["description"] = (drawn.__doc__ or "").partition("\n\n")[2]
    return described | ({"requestBody": _body(one, schema)} if method == "POST" else {})


def _content(about: str, schema: Any) -> dict[str, Any]:
    return {"description": about, "content": {"application/json": {"schema": schema}}}


def _body(one: Operation, schema: dict[str, Any]) -> dict[str, Any]:
    required = [*schema.get("required", ()), *one.needs]

    def with_files(of_file: dict[str, Any]) -> dict[str, Any]:
        values = {**schema["properties"], **dict.fromkeys(one.files, of_file)}
        return {"schema": {**schema, "properties": values, **({"required": required} if required else {})}}

    content = {"application/json": with_files({"type": "string", "contentEncoding": "base64"})}
    if one.files:
        content["multipart/form-data"] = with_files({"type": "string", "contentMediaType": _BYTES})
    if ask.PHOTO in one.needs:
        content |= {kind: {"schema": {}} for kind in ("image/jpeg", "image/png")}
    return {"required": bool(required), "content": content}


# What of an argument's schema an agent can do without; a value that does not fit is answered with a sentence.
_WORDLESS = ("maxLength", "maxItems", "minimum", "maximum", "exclusiveMinimum", "pattern")


def tool_schema(one: Operation, more: Mapping[str, Any], reads_files: bool = False) -> dict[str, Any]:
    """Return the schema of a tool's arguments in few words: those of its request, its files, and some more."""
    schema = ask.schema_of(one.query)
    brief = {name: _brief(value) for name, value in schema["properties"].items()}
    path = "path of a file, or " if reads_files else ""
    files = {name: {"type": "string", "description": f"{path}base64"} for name in one.files}
    required = [*schema.get("required", ()), *one.needs]
    return {"type": "object", "properties": {**brief, **files, **more}, **({"required": required} if required else {})}


def _brief(schema: dict[str, Any]) -> dict[str, Any]:
    brief = {key: value for key, value in schema.items() if key not in _WORDLESS}
    if brief.get("default") == 1:
        del brief["default"]  # which an agent expects
    return brief | ({"items": _brief(brief["items"])} if "items" in brief else {})


CONTENT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; base-uri 'none'"


def html_page(address: str) -> str:
    """Return the page of the server at an address, such as ``http://127.0.0.1:8750``."""
    rows = "\n".join(
        f"<li><code>{' '.join(one.methods)} /maps/NAME{escape(one.path)}</code><br>{escape(one.about)}"
        for one in OPERATIONS
        if one.path is not None
    )
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<title>avlmaps server</title>
<style>body{{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;color-scheme:light dark}}</style>
</head><body><h1>avlmaps server {escape(__version__)}</h1>
<p>The maps: <a href="maps">maps</a>. In the browser: <code>/maps/NAME/view</code>. For programs:
<a href="openapi.json">openapi.json</a> (OpenAPI 3.1). For agents: MCP by streamable HTTP at <code>/mcp</code>.</p>
<pre>curl -G {escape(address)}/maps/NAME/ask --data-urlencode "sentence=the chair near the table"
curl -F photo=@photo.jpg {escape(address)}/maps/NAME/locate</pre>
<p>Answers are the JSON that the command line prints under <code>--json</code>, errors
<code>{{"error": {{"kind": ..., "message": ...}}}}</code>. Send <code>Accept: text/event-stream</code> for the
progress of work that takes long.</p>
<ul>{rows}</ul></body></html>
"""
