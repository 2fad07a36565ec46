"""What clients may ask: one type for each request, of which checks, the document and the tools' schemas are made.

What does not fit raises ``RequestError``, whose sentence says what does.
"""

import base64
import binascii
import re
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar
from urllib.parse import unquote

import msgspec
import numpy as np
from jaxtyping import UInt8
from msgspec import Meta, Struct

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.files import read_regular, user_path
from avlmaps.core.question import MOST_CHARACTERS, HeardAt
from avlmaps.core.words import did_you_mean
from avlmaps.maps.store.edits import LONGEST_NAME
from avlmaps.query.locate import focal_35mm_of
from avlmaps.query.modalities import Attachment, Photo, require_audible
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.containers import self_contained_suffix
from avlmaps.recordings.images import check_whole, decode_picture, encoded_size
from avlmaps.serve.lanes import RequestError
from avlmaps.serve.settings import Limits

R = TypeVar("R", bound=Struct)
PHOTO, CLIP = "photo", "clip"
_NUMBER = r"-?\d{1,6}(\.\d{1,9})?"
_LONGEST_PATH = 1000
_FOCAL, _OFFSET = r"[1-9]\d{0,4}(\.\d{1,9})?", r"\d{1,5}(\.\d{1,9})?"


# A pattern for the document alone: what does not have it is refused with a sentence of its own.
def _shown(pattern: str) -> dict[str, str]:
    return {"pattern": pattern}


# What has no letter says nothing.
Sentence = Annotated[str, Meta(max_length=MOST_CHARACTERS, extra_json_schema=_shown(r"^\s*$|[A-Za-z]"))]
Name = Annotated[str, Meta(max_length=MOST_CHARACTERS, extra_json_schema=_shown(r"\S"))]
EditName = Annotated[str, Meta(max_length=LONGEST_NAME, extra_json_schema=_shown(r"\S"))]
Short = Annotated[str, Meta(max_length=200)]
Place = Annotated[str, Meta(max_length=100, extra_json_schema=_shown(rf"^{_NUMBER}(,{_NUMBER}){{1,2}}$"))]
_CAMERA = f"^{_FOCAL},{_FOCAL},{_OFFSET},{_OFFSET}$"
Intrinsics = Annotated[
    Annotated[str, Meta(max_length=200, extra_json_schema=_shown(_CAMERA))] | None,
    Meta(description="fx,fy,cx,cy of another camera than the map's"),
]
Coordinate = Annotated[float, Meta(ge=-1e6, le=1e6)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Names = Annotated[list[Name], Meta(max_length=64)]
Top = Annotated[int, Meta(ge=1, le=50)]
Page = Annotated[int, Meta(ge=1, le=10_000)]
_DAY = "a date such as 2026-11-24, or the number of a visit from 1"


class Request(Struct, forbid_unknown_fields=True):
    """What a client may say."""


class NoQuery(Request):
    """No values."""


class ThingsQuery(Request):
    """Which things are listed."""

    least: Annotated[Share, Meta(description="least confidence")] = 0.5
    name: Annotated[Names, Meta(description="these things only")] = []
    structure: Annotated[bool, Meta(description="walls and floors too")] = False


class PlacedThingsQuery(ThingsQuery):
    """Which things are listed, and where."""

    room: Annotated[Name | None, Meta(description="one, or all of a kind")] = None
    near: Annotated[Name | None, Meta(description="x,y,z, level x,y, or a thing's name: nearest first")] = None


class ThingsToolQuery(PlacedThingsQuery):
    """Which things an agent reads."""

    top: Top = 10
    page: Page = 1


class ListedThingsQuery(PlacedThingsQuery):
    """Which things are listed, in which order, and how many at once."""

    top: Annotated[Page | None, Meta(description="most things of a page; all by default")] = None
    page: Page = 1
    at: Annotated[Short | None, Meta(description=f"of a map of several days: {_DAY}")] = None


class RoomsQuery(Request):
    """Which rooms are listed."""

    least: Annotated[Share, Meta(description="least confidence")] = 0.0


class RoomsToolQuery(RoomsQuery):
    """Which rooms an agent reads."""

    floor: Annotated[int | None, Meta(description="0 is the lowest")] = None
    name: Names = []
    top: Top = 10
    page: Page = 1


class SoundsToolQuery(Request):
    """Which sounds an agent reads."""

    name: Names = []
    top: Top = 10
    page: Page = 1


class SourcesQuery(Request):
    """Which sources of sounds are listed."""

    sound: Annotated[Names, Meta(description="sources of these sounds only; of every sound by default")] = []
    prior: Annotated[
        Literal["lexicon", "none"],
        Meta(description="lexicon: what usually makes such a sound is likelier; none: by the microphones alone"),
    ] = "lexicon"
    least: Annotated[Share, Meta(description="least confidence of the sound")] = 0.0


class ChangesQuery(Request):
    """Which changes are listed."""

    since: Annotated[Short, Meta(description=f"what changed after this day: {_DAY}")] = "1"
    first_seen: Annotated[bool, Meta(description="also what was first seen, where nobody had looked")] = False


class AskQuery(Request):
    """A query: a sentence, or its parts, and not both."""

    sentence: Annotated[Sentence | None, Meta(description="such as 'a chair near a dog barking', 'how many cups'")] = (
        None
    )
    object: Name | None = None
    sound: Name | None = None
    area: Name | None = None
    primary: Annotated[
        Literal["object", "sound", "image", "area"] | None, Meta(description="the part that is sought")
    ] = None
    top: Annotated[int, Meta(ge=1, le=100)] = 3
    at: Annotated[HeardAt | None, Meta(description="source: where a sound came from, not where it was heard")] = None
    near: Annotated[Place | None, Meta(description="x,y: nearest first")] = None
    intrinsics: Intrinsics = None


class PictureQuery(AskQuery):
    """A query whose answer is drawn; without a sentence and parts the map is drawn."""

    size: Annotated[
        Literal["small", "full"],
        Meta(description="small: one view from above, quick; full: a panel for each part, with axes and a scale"),
    ] = "full"


class LocateQuery(Request):
    """A photo to locate, which comes as a file."""

    intrinsics: Intrinsics = None


class PlaceQuery(Request):
    """A place: x, y, z in the recording frame, metres."""

    x: Coordinate
    y: Coordinate
    z: Annotated[Coordinate | None, Meta(description="without it x, y are in the level frame")] = None
    radius_m: Annotated[float, Meta(gt=0.0, le=5.0)] = 0.15


class PathQuery(Request, rename={"start": "from", "goal": "to"}):
    """Two places; each is x,y,z in the recording frame, or x,y in the level frame."""

    start: Annotated[Place, Meta(description="such as 1.5,2.0 or 1.5,2.0,0.3")]
    goal: Annotated[Place, Meta(description="it stops beside what it cannot stand in")]
    stairs: Annotated[bool, Meta(description="for a body that takes stairs, such as a person")] = False


class LastSeenQuery(Request):
    """A thing by its name."""

    thing: Annotated[Name, Meta(description="such as 'red mug'")]
    top: Annotated[int, Meta(ge=1, le=20)] = 3


class GoalNearQuery(Request):
    """A query, and a place to be near to."""

    sentence: Annotated[Name, Meta(description="such as 'a chair'")]
    near: Annotated[Place, Meta(description="x,y,z")]
    top: Annotated[int, Meta(ge=1, le=20)] = 3


class EditQuery(Request):
    """A correction of the map, as `avlmaps edit` makes it; /maps/{map}/edits lists all."""

    does: Literal["rename", "rename-room", "merge", "split", "forbid", "pin", "undo"]
    name: Annotated[
        EditName | None, Meta(description="the thing or room that is meant; the name of what is forbidden or pinned")
    ] = None
    to: Annotated[EditName | None, Meta(description="the new name, of rename, rename-room and merge")] = None
    at: Annotated[Place | None, Meta(description="where the thing or place is, such as 1.5,2.0 or 1.5,2.0,0.3")] = None
    places: Annotated[
        list[Place], Meta(max_length=16, description="of the things that are merged; two on the plane of a split")
    ] = []
    room: Annotated[EditName | None, Meta(description="the room that is forbidden")] = None
    box: Annotated[
        list[Coordinate], Meta(max_length=4, description="x0, y0, x1, y1 of what is forbidden or cut, level frame")
    ] = []
    edit: Annotated[Short | None, Meta(description="the edit that is undone; the last by default")] = None
    by: Annotated[EditName | None, Meta(description="who makes it")] = None


class ViewQuery(Request):
    """What the page shows beside the map."""

    other: Annotated[Name | None, Meta(description="a second map of the same place, to compare")] = None


class RehearseQuery(Request):
    """A command that is planned on the map."""

    command: Annotated[str, Meta(max_length=1000, description="such as 'go to the sofa'")]
    start: Annotated[
        Annotated[str, Meta(pattern=rf"^{_NUMBER},{_NUMBER},{_NUMBER}$")] | None,
        Meta(description="x,y,heading where it begins: metres, radians, level frame; near the walk's start by default"),
    ] = None


class SoundQuery(Request):
    """A sound, by its number from 0."""

    sound: int


class KeyframeQuery(Request):
    """A keyframe, by its number from 0."""

    keyframe: int


class VoxelQuery(Request):
    """A voxel that is drawn, by its number from 0."""

    voxel: int


class TilesQuery(Request):
    """A tile, and how it is coloured."""

    level: int
    i: int
    j: int
    k: int
    heat: Annotated[
        Annotated[str, Meta(max_length=MOST_CHARACTERS, extra_json_schema=_shown("[A-Za-z]"))] | None,
        Meta(description="a query in words; each voxel then has its heat as a seventh byte, 0 to 255"),
    ] = None


def read(values: Mapping[str, Any], kind: type[R], files: Sequence[str] = ()) -> R:
    """Return a request of a kind, out of an address, a form, JSON or an agent's call: the one place that normalises.

    A number may be a text, and a place a list of numbers; one value stands for a list of it; a list may be written as
    text; what is null or blank was left out. ``files`` were taken out of the values before, and are told of.
    """
    lists = lists_of(kind)
    given = {name: _normal(value, name in lists) for name, value in values.items() if not _is_blank(value)}
    try:
        return msgspec.convert(given, kind, strict=False)
    except msgspec.ValidationError as fault:
        known = {name: {"type": "file"} for name in files} | schema_of(kind)["properties"]
        unknown = next((name for name in given if name not in known), None)
        said = f"The request does not fit: {str(fault)[:300]}."
        if unknown is not None:
            said = f"There is no argument {unknown[:60]!r}{did_you_mean(unknown, known)}"
        takes = ", ".join(f"{name} ({_words_of(schema)})" for name, schema in known.items())
        raise RequestError(f"{said} It takes: {takes}." if takes else f"{said} It takes no values.") from None


def lists_of(kind: type[Struct]) -> frozenset[str]:
    """Return the values of a request that may be given several times."""
    fields = msgspec.structs.fields(kind)
    return frozenset(one.encode_name for one in fields if re.search(r"(list|tuple)\[", str(one.type)))


def _is_blank(value: Any) -> bool:
    return value is None or (isinstance(value, str) and value.strip().lower() in ("", "null"))


def _normal(value: Any, is_list: bool) -> Any:
    if isinstance(value, str) and re.fullmatch(r"\s*[\[(].*[\])]\s*", value, re.DOTALL):
        with suppress(msgspec.DecodeError, RecursionError):  # words in brackets stay words
            value = msgspec.json.decode("[" + value.strip()[1:-1] + "]")
    if is_list:
        return [_normal(one, False) for one in value] if isinstance(value, list) else [value]
    if isinstance(value, dict) and value.keys() <= set("xyz"):
        value = [value[axis] for axis in "xyz" if axis in value]
    if isinstance(value, list) and all(isinstance(x, float) or re.fullmatch(_NUMBER, str(x).strip()) for x in value):
        return ",".join(str(one).strip() for one in value)
    return value


def schema_of(kind: type[Struct]) -> dict[str, Any]:
    """Return the JSON schema of a request without titles and null, since what is left out is not null."""
    (schema,), components = msgspec.json.schema_components([kind])
    whole = components[schema["$ref"].rpartition("/")[2]]
    properties = {name: _without_null(one) for name, one in whole["properties"].items()}
    required = {"required": whole["required"]} if whole["required"] else {}
    return {"type": "object", "properties": properties, "additionalProperties": False, **required}


def _without_null(schema: dict[str, Any]) -> dict[str, Any]:
    plain = {key: value for key, value in schema.items() if key not in ("anyOf", "default", "title")}
    if schema.get("default") not in (None, [], (), False):
        plain["default"] = schema["default"]
    if "enum" in plain:
        plain["enum"] = [value for value in plain["enum"] if value is not None]
    kinds = [one for one in schema.get("anyOf", []) if one.get("type") != "null"]
    return kinds[0] | plain if kinds else plain


def _words_of(schema: dict[str, Any]) -> str:
    if "enum" in schema:
        return " or ".join(str(value) for value in schema["enum"])
    low, high = schema.get("minimum"), schema.get("maximum")
    kind = schema.get("type", "value")
    return f"{kind} {low:g} to {high:g}" if low is not None and high is not None else kind


Files = Mapping[str, bytes]
"""The files of a request, photo and clip, by these names; not decoded yet."""


def attachments(files: Files, limits: Limits) -> dict[str, Attachment]:
    """Decode the files."""
    found: dict[str, Attachment] = {}
    if (photo := files.get(PHOTO)) is not None:
        found[PHOTO] = Photo(decode_photo(photo, limits), focal_35mm_of(photo))
    if (clip := files.get(CLIP)) is not None:
        found[CLIP] = decode_clip(clip, limits)
    return found


def written(files: Files, folder: Path) -> dict[str, str]:
    """Write the files, which are whole, into a folder, and return their names there."""
    names: dict[str, str] = {}
    for kind, content in files.items():
        names[kind] = f"{kind}{'.png' if kind == PHOTO else self_contained_suffix(content) or ''}"
        (folder / names[kind]).write_bytes(content)
    return names


def files_in(values: dict[str, Any], names: Sequence[str], most_bytes: int, reads_files: bool = False) -> Files:
    """Take the files out of the values of a request; an empty one is none."""
    given = {name: values.pop(name, None) for name in names}
    return {name: file_of(str(text), name, most_bytes, reads_files) for name, text in given.items() if text}


def file_of(text: str, what: str, most_bytes: int, reads_files: bool = False) -> bytes:
    """Return the bytes of a file: of base64 of any alphabet, perhaps as a data URI, or of a path or its URL."""
    path = unquote(re.sub(r"^file://(localhost)?", "", text.strip())) if text.lstrip().startswith("file:") else text
    if reads_files and len(text) < _LONGEST_PATH and user_path(path).is_file():
        try:
            return read_regular(user_path(path), most_bytes)
        except OSError as fault:
            raise RequestError(f"The {what} {text} cannot be read ({fault.strerror or fault}).", 415, what) from None
    plain = re.sub(r"\s+", "", text.partition(",")[2] if text.lstrip().startswith("data:") else text)
    plain = plain.replace("-", "+").replace("_", "/")
    if len(plain) > _LONGEST_PATH:  # many leave the signs at its end out
        plain += "=" * (-len(plain) % 4)
    try:
        return base64.b64decode(plain, validate=True)
    except (binascii.Error, ValueError):
        also = ", or give the path of a file here" if reads_files else ""
        no_path = "no file that is here, and " if reads_files else ""
        raise RequestError(f"The {what} is {no_path}no base64; send the file's bytes in base64{also}.") from None


def decode_photo(content: bytes, limits: Limits) -> UInt8[np.ndarray, "h w 3"]:
    """Decode a PNG or JPEG as RGB."""
    import cv2

    size = encoded_size(content)
    if size is not None and not 0 < size[0] * size[1] <= limits.picture_pixels:
        most = f"{limits.picture_pixels:,}"
        raise RequestError(f"The photo has {size[0]}x{size[1]} pixels; send one of 1 to {most}.", 413, "photo")
    # The pose is that of the picture as its pixels lie, so a camera's turn flag must not rotate it.
    bgr = None
    with suppress(RecordingError):
        check_whole(Path("The photo"), content)
        bgr = decode_picture(content, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if size is None or bgr is None or bgr.shape[:2] != (size[1], size[0]):
        raise RequestError("The photo is no whole PNG or JPEG, or is damaged; send it again.", 415, "photo")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


_HIGHEST_RATE_HZ = 96_000


def decode_clip(content: bytes, limits: Limits) -> Sound:
    """Decode a sound."""
    suffix = self_contained_suffix(content)
    if suffix is None:
        raise RequestError("The clip is no wav, flac, ogg, mp3, m4a or mkv sound; send another one.", 415, "clip")
    with tempfile.TemporaryDirectory(prefix="avlmaps-serve-") as folder:
        path = Path(folder) / f"clip{suffix}"
        path.write_bytes(content)
        try:
            track = AudioTrack.open(path)
            if track.duration_s > limits.clip_s or track.rate_hz > _HIGHEST_RATE_HZ:
                raise RequestError(
                    f"The clip lasts {track.duration_s:.0f} s at {track.rate_hz:,} samples a second; clips last up to "
                    f"{limits.clip_s:g} s at {_HIGHEST_RATE_HZ:,}; cut or convert it.",
                    413, "clip",
                )  # fmt: skip
            sound = track.read()
        except AudioError as error:
            said = str(error).replace(str(path), "The clip")
            said = "The clip cannot be read as sound; send another one." if folder in said else said
            raise RequestError(said, 415, "clip") from None
    return require_audible(sound, "of the request")
