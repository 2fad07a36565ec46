"""The operations of the HTTP interface: one table that makes the routes and the OpenAPI document."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from avlmaps.navigate.paths import PathAnswer
from avlmaps.query.places import PlaceAnswer
from avlmaps.query.schema import (
    ChangesAnswer,
    ContentsAnswer,
    EditsAnswer,
    LocateAnswer,
    QueryAnswer,
    RoomsAnswer,
    SourcesAnswer,
)
from avlmaps.serve import requests, viewing, work
from avlmaps.serve.tiles import TilesAnswer


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
              requests.NoQuery, "image/jpeg", viewing.keyframe),
    Operation("view", "/view", "Show the map in a browser, as `avlmaps view` does.",
              requests.ViewQuery, "text/html", viewing.viewer),
    Operation("viewMap", "/view/map", "Return what the page of `view` needs to begin.",
              requests.NoQuery, dict, viewing.drawn_map),
    Operation("viewVoxels", "/view/voxels", "Return the voxels that the page draws, in the order of drawing.",
              requests.NoQuery, "application/octet-stream", viewing.drawn_voxels),
    Operation("viewLabels", "/view/labels", "Return the thing, the room and the name of each voxel that is drawn.",
              requests.NoQuery, "application/octet-stream", viewing.drawn_labels, "slow"),
    Operation("viewContents", "/view/contents", "Return things, sounds and rooms with the colours of the page.",
              requests.NoQuery, dict, viewing.drawn_contents, "slow"),
    Operation("viewVoxel", "/view/voxels/{voxel:count}", "Return what a voxel that is drawn is taken for.",
              requests.NoQuery, dict, viewing.drawn_voxel),
    Operation("askInView", "/view/ask", "Query a map, and return the answer with the heat of each voxel that is drawn.",
              requests.AskQuery, "application/octet-stream", viewing.ask_in_view, "quick", "form", ("photo", "clip")),
    Operation("rehearse", "/view/rehearse", "Plan a command on the map; no real robot moves.",
              requests.RehearseQuery, dict, viewing.rehearse, "slow", "command", ("photo", "clip")),
)  # fmt: skip
