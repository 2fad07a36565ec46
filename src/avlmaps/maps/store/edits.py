"""What a person corrected in a map: ``edits.jsonl`` beside ``map.json``, one edit a line, and no line is ever changed.

An edit says what it is about by place and extent, never by a number, so that it holds for a map that is built again,
merged with another day, or moved to corrected poses: beside the place lies the keyframe that looked at it, and where
that one has another pose by now, the place moves with it. ``query.edits`` applies them.
"""

import hashlib
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import MapError
from avlmaps.core.files import DESCRIPTION_BYTES, decode_json, read_regular, write_bytes_atomically
from avlmaps.core.poses import apply, inverse, plain_point
from avlmaps.maps.store.manifest import MapInfo, RecordingInfo
from avlmaps.maps.store.tables import EDITING, TO_EDIT, explain_write_errors, lock_folder
from avlmaps.maps.types import Keyframes

EDITS = "edits.jsonl"
SCHEMA = 1
LONGEST_NAME = 80
Does = Literal["rename", "rename room", "merge", "split", "forbid", "pin", "undo"]
Vector = tuple[float, float, float]
Row = tuple[float, float, float, float]
_STILL = 1e-6  # a keyframe whose pose differs by less has not moved


class SeenFrom(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The keyframe that looked at a place when it was edited: its stamp, and its pose then, row by row."""

    stamp_s: float
    world_from_camera: tuple[Row, Row, Row, Row]


class EditedSpot(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """What an edit is about: a thing, a room, an area or a place; metres, the map's world."""

    middle: Vector  # of its box
    name: str = ""  # what it was called then; empty for a place
    size: Vector = (0.0, 0.0, 0.0)  # extent along the axes of the level frame
    corners: tuple[Vector, ...] = ()  # of a room or an area, on its floor
    seen_from: SeenFrom | None = None  # by which it follows corrected poses; None of a map without keyframes

    def now(self, keyframes: Keyframes) -> "EditedSpot":
        """Return it in the world as it is now: it moved with the keyframe that looked at it; itself if that did not."""
        if self.seen_from is None or not len(keyframes):
            return self
        stamps = np.asarray(keyframes.stamp_s, np.float64)
        row = int(np.argmin(np.abs(stamps - self.seen_from.stamp_s)))
        if abs(float(stamps[row]) - self.seen_from.stamp_s) > _STILL:
            return self
        then = np.array(self.seen_from.world_from_camera, np.float64)
        motion = np.asarray(keyframes.world_from_camera[row], np.float64) @ inverse(then)
        return self if np.abs(motion - np.eye(4)).max() < _STILL else self.moved(motion)

    def moved(self, motion: Float[np.ndarray, "4 4"]) -> "EditedSpot":
        """Return it after a rigid motion of the world."""
        corners = tuple(plain_point(apply(motion, np.array(corner))) for corner in self.corners)
        middle = plain_point(apply(motion, np.array(self.middle)))
        return msgspec.structs.replace(self, middle=middle, corners=corners)

    def anchored(self, keyframes: Keyframes) -> "EditedSpot":
        """Return it with the keyframe that looked nearest to it."""
        if not len(keyframes):
            return msgspec.structs.replace(self, seen_from=None)
        away = np.linalg.norm(np.asarray(keyframes.centre, np.float64).reshape(-1, 3) - np.array(self.middle), axis=1)
        row = int(np.argmin(away))
        pose = tuple(tuple(float(value) for value in line) for line in keyframes.world_from_camera[row])
        seen = SeenFrom(stamp_s=float(keyframes.stamp_s[row]), world_from_camera=pose)  # pyright: ignore[reportArgumentType]
        return msgspec.structs.replace(self, seen_from=seen)


class World(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The recording in whose world an edit's places are: its name and fingerprint."""

    name: str
    fingerprint: str

    @classmethod
    def of(cls, info: MapInfo) -> "World":
        """Return that of a map; of one of several days, the first day's."""
        first: RecordingInfo = info.visits[0].recording if info.visits else info.recording
        return cls(name=first.name, fingerprint=first.fingerprint)

    def is_that_of(self, other: "World") -> bool:
        """Return whether two are one: a recording that was written again has its name, a moved one its content."""
        return self.name == other.name or self.fingerprint == other.fingerprint


class Edit(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True):
    """One correction by a person."""

    schema: Literal[1]  # of the line
    id: str  # by which it is undone
    does: Does
    made: str  # when, ISO 8601, UTC
    at: tuple[EditedSpot, ...] = ()  # one thing or room, or the two and more that are merged
    name: str = ""  # the new name; of a forbidden area and of a pinned place, its own
    # of a thing that is split: two points of an upright plane, the four corners of a box from above, or none for its
    # connected pieces
    cut: tuple[Vector, ...] = ()
    of: str = ""  # the edit that is undone
    by: str = ""  # who made it; empty for a person who did not say
    world: World | None = None  # that its places are in

    @classmethod
    def new(
        cls,
        does: Does,
        at: Sequence[EditedSpot] = (),
        *,
        name: str = "",
        cut: Sequence[Vector] = (),
        of: str = "",
        by: str = "",
        world: World | None = None,
        made: str | None = None,
    ) -> "Edit":
        """Return an edit that is made now, or when ``made`` says."""
        stamp = datetime.now(UTC).isoformat(timespec="milliseconds") if made is None else made
        edit = cls(
            schema=1, id="", does=does, made=stamp, at=tuple(at), name=name, cut=tuple(cut), of=of, by=by, world=world
        )
        return msgspec.structs.replace(edit, id=hashlib.sha256(msgspec.json.encode(edit)).hexdigest()[:8])

    @property
    def day(self) -> str:
        """The day on which it was made, as ``2026-11-26``."""
        return self.made[:10]


def in_force(edits: Iterable[Edit]) -> tuple[Edit, ...]:
    """Return the edits that count, in their order: each once, without those that are undone and what undid them."""
    once = list({edit.id: edit for edit in edits}.values())
    undone: set[str] = set()
    kept: list[Edit] = []
    for edit in reversed(once):  # an undo may be undone by a later one
        if edit.id in undone:
            continue
        if edit.does == "undo":
            undone.add(edit.of)
        else:
            kept.append(edit)
    return tuple(reversed(kept))


def read_edits(folder: Path) -> tuple[Edit, ...]:
    """Return the edits of a map's folder, the oldest first; none where nobody edited it.

    Raises:
        MapError: a line is damaged, or of another schema.
    """
    path = folder / EDITS
    try:
        lines = read_regular(path, DESCRIPTION_BYTES).split(b"\n")
    except (FileNotFoundError, NotADirectoryError):
        return ()
    except OSError as fault:
        raise MapError(f"{path} cannot be read: {fault.strerror or fault}; check its permissions.") from fault
    return tuple(_edit(path, number, line) for number, line in enumerate(lines, 1) if line.strip())


def append_edit(folder: Path, edit: Edit) -> None:
    """Add an edit to a map's folder. A kill at any instant leaves the log without it, or whole with it."""
    with lock_folder(folder, EDITING):
        write_edits(folder, (*read_edits(folder), edit))


def write_edits(folder: Path, edits: Sequence[Edit]) -> None:
    """Make these the edits of a map's folder, in one step."""
    content = b"".join(msgspec.json.encode(edit) + b"\n" for edit in edits)
    with explain_write_errors(folder, TO_EDIT):
        write_bytes_atomically(folder / EDITS, content)


def carried_edits(
    edits: Sequence[Edit],
    keyframes: Keyframes,
    own: World,
    world: World,
    onto: Keyframes,
    map_from_own: Float[np.ndarray, "4 4"],
) -> tuple[Edit, ...]:
    """Return the edits of a map as those of another one that holds it; one that is of neither stays as it is.

    The edits are of a map with the world ``own`` and these keyframes; the other map has ``world`` and the keyframes
    ``onto``.
    """

    def carried(spot: EditedSpot) -> EditedSpot:
        return spot.now(keyframes).moved(map_from_own).anchored(onto)

    def point(place: Vector) -> Vector:
        return plain_point(apply(map_from_own, np.array(place)))

    return tuple(
        msgspec.structs.replace(
            edit, at=tuple(map(carried, edit.at)), cut=tuple(map(point, edit.cut)), world=edit.world and world
        )
        if edit.world is None or edit.world.is_that_of(own)
        else edit
        for edit in edits
    )


def _edit(path: Path, number: int, line: bytes) -> Edit:
    try:
        edit: Edit = decode_json(line, Edit)
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise MapError(
            f"Line {number} of {path} is no edit of schema {SCHEMA} ({fault}); restore the file from a copy, or take "
            "the line out."
        ) from fault
    numbers = [value for spot in edit.at for place in (spot.middle, spot.size, *spot.corners) for value in place]
    numbers += [value for place in edit.cut for value in place]
    if not np.isfinite(numbers).all() or np.abs(numbers).max(initial=0.0) > 1e6:
        raise MapError(f"Line {number} of {path} is damaged: a place is not in metres; take the line out.")
    return edit
