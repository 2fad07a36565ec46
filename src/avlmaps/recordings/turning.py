"""Pictures that are stored in another orientation than they are shown: EXIF tags and the display matrices of videos."""

import struct
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import numpy as np

_ORIENTATION = 0x0112
_ONE = 1 << 16  # in the fixed-point numbers of a display matrix


@dataclass(frozen=True, slots=True)
class DisplayTurn:
    """How a stored picture is turned to be shown: columns and rows change places first, then they are reversed.

    Attributes:
        transpose: columns and rows change places.
        flip_x: columns are reversed.
        flip_y: rows are reversed.
    """

    transpose: bool = False
    flip_x: bool = False
    flip_y: bool = False

    def __bool__(self) -> bool:
        return self.transpose or self.flip_x or self.flip_y

    def applied(self, picture: np.ndarray) -> np.ndarray:
        """Return a picture (rows, columns, ...) as it is shown."""
        shown = np.swapaxes(picture, 0, 1) if self.transpose else picture
        return np.ascontiguousarray(shown[:: -1 if self.flip_y else 1, :: -1 if self.flip_x else 1])

    def size(self, width: int, height: int) -> tuple[int, int]:
        """Return (width, height) of a stored picture as it is shown."""
        return (height, width) if self.transpose else (width, height)

    @property
    def words(self) -> str:
        """The turn in words."""
        if self.transpose ^ self.flip_x ^ self.flip_y:
            return "mirrored"
        if self.transpose:
            return f"turned by 90° {'clockwise' if self.flip_x else 'counter-clockwise'}"
        return "turned by 180°" if self.flip_x else "as stored"

    @classmethod
    def of_exif(cls, orientation: int) -> "DisplayTurn":
        """Return the turn that an EXIF orientation (1 to 8) requests; none for any other number."""
        numbered = {
            2: cls(flip_x=True), 3: cls(flip_x=True, flip_y=True), 4: cls(flip_y=True), 5: cls(transpose=True),
            6: cls(True, flip_x=True), 7: cls(True, True, True), 8: cls(True, flip_y=True),
        }  # fmt: skip
        return numbered.get(orientation, cls())

    @classmethod
    def of_display_matrix(cls, content: bytes) -> "DisplayTurn":
        """Return the turn of a display matrix, nine whole numbers row by row; none where it is no quarter turn."""
        a, b, _, c, d = struct.unpack_from("=5i", content)  # x shown = a x + c y, y shown = b x + d y
        if abs(a) == abs(d) == _ONE and b == c == 0:
            return cls(False, a < 0, d < 0)
        if abs(b) == abs(c) == _ONE and a == d == 0:
            return cls(True, c < 0, b < 0)
        return cls()


def exif_turn(content: bytes) -> DisplayTurn:
    """Return the turn that a JPEG's or PNG's EXIF requests; none where it has no EXIF."""
    if b"Exif" not in content[: 1 << 16] and b"eXIf" not in content[: 1 << 16]:
        return DisplayTurn()
    from PIL import Image

    try:
        with Image.open(BytesIO(content)) as picture:
            return DisplayTurn.of_exif(int(picture.getexif().get(_ORIENTATION, 1)))
    except (OSError, ValueError, TypeError, SyntaxError):  # it is a tag that cannot be read; the picture may be whole
        return DisplayTurn()


def display_turn(frame: Any) -> DisplayTurn:
    """Return the turn that a decoded frame of a video (PyAV) requests."""
    for data in frame.side_data:
        if data.type.name == "DISPLAYMATRIX":
            return DisplayTurn.of_display_matrix(bytes(data))
    return DisplayTurn()
