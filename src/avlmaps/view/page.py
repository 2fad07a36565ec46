"""The page itself: one HTML text with its style and its script inside, served live or written as one file."""

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Sequence
from functools import cache, partial
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.progress import progress
from avlmaps.core.question import Modality, Part, Question
from avlmaps.view.labels import TOP, MapOnPage, palettes

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.view.labels import Labels

SCRIPTS = ("matrix.js", "source.js", "shaders.js", "renderer.js", "camera.js", "marks.js", "viewer.js", "address.js",
           "saving.js", "panel.js")  # fmt: skip
_MARK = re.compile(r"\{\{(\w+)\}\}")
_MOST_PICTURES = 60
# Voxels of a map in a file. Of a larger one a file shows one voxel of each small block, so that it stays within some
# 30 MB and opens in a browser; answers and heat are computed on all voxels.
MOST_VOXELS = 1_500_000
_COMPRESSION = 2  # 6 takes three times as long, and a page is 2 % smaller
_POLICY = (
    "default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src 'self' data: blob:; "
    "media-src 'self' data: blob:; connect-src {connect}; base-uri 'none'; form-action 'none'"
)


@cache
def live_page() -> bytes:
    """Return the page that queries its server."""
    return _page("avlmaps view", None).encode("utf-8")


def write_page(
    out: Path, maps: "Sequence[AVLMap]", questions: "Sequence[str | tuple[str, Question]]" = ()
) -> dict[str, Any]:
    """Write one file that opens from the disk without a network: one map or two, their contents, some questions' heat.

    The questions, sentences or queries with their titles, are answered now; by default some that fit the first map. It
    returns the file, its size, and the questions with what became of them.

    Raises:
        QueryError: a question is not understood, or the file cannot be written.
    """
    shown = [MapOnPage(avlmap, MOST_VOXELS) for avlmap in maps]
    sentences = list(questions) or default_questions(shown[0].labels)
    data: dict[str, Any] = {
        "maps": [one.layout.describe() for one in shown],
        "palettes": palettes(),
        "robot": False,
        "contents": [one.describe_contents() for one in shown],
        "records": [_packed(one.layout.records) for one in shown],
        "labels": [_packed(one.labels.voxels.tobytes()) for one in shown],
        "pictures": [_pictures(one) for one in shown],
        "clips": [_clips(one) for one in shown],
        "questions": [],
    }
    for one in progress(sentences, "asking", unit="question"):
        sentence, question = (one, None) if isinstance(one, str) else one
        try:
            answers = [on_page.avlmap.ask(question or sentence, TOP) for on_page in shown]
        except QueryError as fault:
            raise QueryError(f"{sentence!r}: {fault}") from None
        heat = b"".join(on_page.heat_of(answer) for on_page, answer in zip(shown, answers, strict=True))
        told = [answer.to_dict() for answer in answers]
        data["questions"].append({"question": sentence, "answers": told, "heat": _packed(heat)})
    names = " and ".join(one.layout.avlmap.path.name.removesuffix(".avlmap") for one in shown)
    content = _page(names, data).encode("utf-8")
    try:
        write_bytes_atomically(out, content)
    except OSError as fault:
        raise QueryError(f"{out} cannot be written: {fault.strerror or fault}; check the folder.") from fault
    return {
        "page": str(out),
        "bytes": len(content),
        "voxels": [len(one.layout) for one in shown],
        "voxels_of_maps": [len(one.avlmap.space) for one in shown],
        "questions": [{"question": one["question"], "found": one["answers"][0]["found"]} for one in data["questions"]],
    }


def default_questions(labels: "Labels") -> "list[tuple[str, Question]]":
    """Return queries that fit a map, with their titles: its most certain things, a sound, a room, a thing in a room.

    The names are the map's own, so the parts are given as they are: a sentence would have to be read again.
    """
    things = list(dict.fromkeys(thing.name for thing in labels.things))
    rooms = list(dict.fromkeys(room.name for room in labels.rooms))
    sounds = list(dict.fromkeys(sound.names[0] for sound in labels.sounds if sound.names))
    thing, sound, room = (partial(Part, modality) for modality in (Modality.OBJECT, Modality.SOUND, Modality.AREA))
    parts = [(f"the {name}", [thing(name)]) for name in things[:3]]
    parts += [(f"the sound of {name}", [sound(name)]) for name in sounds[:1]]
    parts += [(f"the {name}", [room(name)]) for name in rooms[:1]]
    if things and rooms:
        parts.append((f"the {things[0]} in the {rooms[0]}", [thing(things[0]), room(rooms[0])]))
    return [(title, Question.of(of)) for title, of in parts]


def _page(title: str, data: dict[str, Any] | None) -> str:
    own = files("avlmaps.view") / "assets"
    script = "\n".join((own / name).read_text(encoding="utf-8") for name in SCRIPTS)
    script = f'"use strict";\n(() => {{\n{script}\n}})();\n'
    digest = base64.b64encode(hashlib.sha256(script.encode("utf-8")).digest()).decode("ascii")
    policy = _POLICY.format(digest=digest, connect="'self'" if data is None else "'none'")
    texts = {
        "title": escape(title),
        "policy": escape(policy),
        "style": (own / "page.css").read_text(encoding="utf-8"),
        # In a script element only the end of one must not stand.
        "data": json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        "script": script,
    }
    page = (own / "page.html").read_text(encoding="utf-8")
    return _MARK.sub(lambda mark: texts[mark[1]], page)


def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, _COMPRESSION, mtime=0)).decode("ascii")


def _pictures(one: MapOnPage) -> dict[str, str]:
    count = len(one.avlmap.data.keyframes)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_PICTURES)).round().astype(int)) if count else ()
    pictures = {str(number): one.layout.thumbnail(int(number)) for number in chosen}
    return {number: base64.b64encode(jpeg).decode("ascii") for number, jpeg in pictures.items() if jpeg}


def _clips(one: MapOnPage) -> list[str]:
    clips = one.avlmap.data.sounds.clips
    return [base64.b64encode(clip.read_bytes()).decode("ascii") for clip in clips]
