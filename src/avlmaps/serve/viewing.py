"""The page of a map: what the browser draws, asks and drives by; see ``avlmaps.view`` for what is on it."""

import tempfile
from pathlib import Path
from typing import Any

import msgspec

from avlmaps.core.motion import GroundPose
from avlmaps.serve.errors import RequestError
from avlmaps.serve.requests import AskQuery, NoQuery, RehearseQuery, ViewQuery
from avlmaps.serve.work import File, WorkInput, ask_map

_BYTES = "application/octet-stream"


def viewer(task: WorkInput, query: ViewQuery) -> File:
    """Return the page; it learns from its address which maps it shows."""
    from avlmaps.view.page import live_page

    del task, query
    return File(live_page(), "text/html")


def drawn_map(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    """Return what the page needs before it draws the first voxel."""
    from avlmaps.view.labels import palettes

    del query
    told = {"map": task.map.page.layout.describe(), "palettes": palettes(), "robot": task.map.guide.has_robot}
    return told | {"version": task.map.voxels_version}


def drawn_voxels(task: WorkInput, query: NoQuery) -> File:
    """Return the voxels in the order of drawing (``layout.RECORD``)."""
    del query
    return File(task.map.page.layout.records, _BYTES)


def drawn_labels(task: WorkInput, query: NoQuery) -> File:
    """Return four bytes for each voxel: thing, room, name, confidence of the name."""
    del query
    return File(task.map.page.labels.voxels.tobytes(), _BYTES)


def drawn_contents(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    """Return things, sounds and rooms with the colours of the page."""
    del query
    return task.map.page.describe_contents()


def drawn_voxel(task: WorkInput, query: NoQuery) -> dict[str, Any]:
    """Return what one voxel is taken for."""
    del query
    page, number = task.map.page, int(task.path["voxel"])
    if number >= len(page.layout):
        raise RequestError(f"There is no voxel {number}; the page draws {len(page.layout):,}.", 404)
    return page.describe_voxel(number)


def keyframe(task: WorkInput, query: NoQuery) -> File:
    """Return the picture of a keyframe."""
    del query
    number, keyframes = int(task.path["keyframe"]), task.map.avlmap.stored.keyframes
    jpeg = task.map.page.layout.thumbnail(number)
    if jpeg is None:
        raise RequestError(
            f"The map has {len(keyframes)} keyframes, counted from 0; there is no picture of {number}.", 404
        )
    return File(jpeg, "image/jpeg", {"etag": f'"{task.map.version}"'})


def ask_in_view(task: WorkInput, query: AskQuery) -> File:
    """Return the length of the answer's JSON (4 bytes, little-endian), the JSON, and the heat of each drawn voxel."""
    answer = ask_map(task, query)
    told = msgspec.json.encode({"answer": answer.to_dict(), "version": task.map.voxels_version})
    return File(len(told).to_bytes(4, "little") + told + task.map.page.heat_of(answer), _BYTES)


def rehearse(task: WorkInput, query: RehearseQuery) -> dict[str, Any]:
    """Plan a command on the map; drive it where the server has the robot of a scene."""
    start = None if query.start is None else GroundPose(*(float(word) for word in query.start.split(",")))
    _ = task.uploads.attachments(task.limits)  # what is no photo and no clip is refused here
    with tempfile.TemporaryDirectory(prefix="avlmaps-serve-") as name:
        folder = Path(name)
        photo, clip = task.uploads.written(folder)
        told = task.map.guide.obey(query.command, start, folder=folder, photo=photo, clip=clip)
        return _without(told, f"{folder}/")


def _without(told: Any, folder: str) -> Any:
    """Return JSON whose texts do not name a folder of this machine."""
    if isinstance(told, str):
        return told.replace(folder, "")
    if isinstance(told, dict):
        return {key: _without(value, folder) for key, value in told.items()}
    return [_without(value, folder) for value in told] if isinstance(told, list | tuple) else told
