"""The contents of rooms of each kind, as a table: as they are furnished, or as an encoder names what it sees there."""

import csv
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from avlmaps.core.arrays import Float64

TABLE = "room_contents.csv"
FURNISHED = Path(__file__).parent


@dataclass(frozen=True, slots=True, eq=False)
class RoomContents:
    """The mean surface of each thing in a room of each kind.

    Attributes:
        things: names of the lexicon.
        kinds: kinds of room, names of the lexicon.
        surface_m2: of a thing (row) in a room of a kind (column).
    """

    things: tuple[str, ...]
    kinds: tuple[str, ...]
    surface_m2: Float64[np.ndarray, "t r"]


@cache
def read_room_contents(folder: Path = FURNISHED) -> RoomContents:
    """Return the table that a folder holds: a row for each thing, a column for each kind of room.

    Args:
        folder: by default that of rooms as they are furnished, else that of an encoder.
    """
    text = (folder / TABLE).read_text(encoding="utf-8")
    head, *rows = csv.reader(text.splitlines())
    surface = np.array([[float(value) for value in row[1:]] for row in rows], np.float64)
    return RoomContents(tuple(row[0] for row in rows), tuple(head[1:]), surface)
