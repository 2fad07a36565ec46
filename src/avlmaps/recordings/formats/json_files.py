"""JSON that describes others' recordings: what a reader needs of it, and the keys that nothing reads."""

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from avlmaps.core.errors import RecordingError
from avlmaps.core.files import MANIFEST_BYTES, decode_json, read_regular
from avlmaps.recordings.faults import readable

T = TypeVar("T")
# A key with such a word in it is about where a pixel lies in space; it is never passed over.
_ABOUT_GEOMETRY = re.compile(
    r"(^|_)(f|c|fl|focal|fov|k\d|p\d|w|h)(_?[xy])?($|_)|scale|depth|unit|dist|intrinsic|extrinsic|crop|resize"
    r"|width|height|size|rotat|orient|transform|axes|convention|offset|delay|principal|center|centre|matrix|pose|model"
)


def read_json(file: Path, kind: type[T], limit_bytes: int = MANIFEST_BYTES) -> tuple[T, dict[str, Any]]:
    """Return a JSON file as a type, and as it is (for its other keys).

    Raises:
        RecordingError: it is missing, damaged, or lacks what the type needs.
    """
    with readable(file, "the recording needs it"):
        return parse_json(file, read_regular(file, limit_bytes), kind)


def parse_json(file: Path, content: bytes, kind: type[T]) -> tuple[T, dict[str, Any]]:
    """Return the content of a JSON file as a type, and as it is; errors as of ``read_json``."""
    try:
        plain = decode_json(content)
        return msgspec.convert(plain, kind), plain
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError) as error:
        raise RecordingError(f"{file} is not as it should be ({error}); fix the file.") from None


def unread_notice(
    file: Path, present: Mapping[str, Any], known: Collection[str], strict: bool = True
) -> tuple[str, ...]:
    """Return a notice that names the keys of a file that nothing reads, or nothing.

    Args:
        file: the file, for the sentence.
        present: its keys.
        known: those that are read, or say nothing.
        strict: whether a key about the camera is refused; not where an app writes the file, whose later versions may
            add some.

    Raises:
        RecordingError: one of them is about the camera, the depth or the poses: without it the map may be wrong.
    """
    unread = sorted(present.keys() - set(known))
    telling = [key for key in unread if _ABOUT_GEOMETRY.search(key.lower())]
    if telling and strict:
        raise RecordingError(
            f"{file} has the key {telling[0]!r}, which is not read here and may change the map; known are "
            f"{', '.join(sorted(known))}. Write it as one of them, or remove it."
        )
    if telling:
        return (f"{file.name} has keys that are not read and may change the map: {', '.join(telling[:8])}.",)
    return (f"{file.name} has keys that are not read: {', '.join(unread[:8])}.",) if unread else ()
