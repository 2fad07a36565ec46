"""What clients may ask: one type for each request, the source of its checks, its documentation and its tool schema."""

import math
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np
from jaxtyping import UInt8
from msgspec import Meta, Struct

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.question import MOST_CHARACTERS, HeardAt
from avlmaps.maps.store.edits import LONGEST_NAME
from avlmaps.query.locate import focal_35mm_of
from avlmaps.query.modalities.sound import require_audible
from avlmaps.query.queryable import Attachment, Photo
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.containers import self_contained_suffix
from avlmaps.recordings.images import check_whole, decode_picture, encoded_size
from avlmaps.serve.lanes import RequestError
from avlmaps.serve.settings import Limits

T = TypeVar("T", bound=Struct)
Words = Annotated[str, Meta(max_length=MOST_CHARACTERS)]
# What has no letter says nothing; it is refused with a sentence of its own.
Sentence = Annotated[str, Meta(max_length=MOST_CHARACTERS, extra_json_schema={"pattern": r"^\s*$|[A-Za-z]"})]
Name = Annotated[str, Meta(max_length=MOST_CHARACTERS, extra_json_schema={"pattern": r"\S"})]
Short = Annotated[str, Meta(max_length=200)]
EditName = Annotated[str, Meta(max_length=LONGEST_NAME, extra_json_schema={"pattern": r"\S"})]
PHOTO, CLIP = "photo", "clip"
_COORDINATE = Meta(ge=-1e6, le=1e6)
# Forms for the OpenAPI document; what does not have them is refused with a sentence of its own.
_NUMBER = r"-?\d{1,6}(\.\d{1,9})?"
_PLACE = {"pattern": rf"^{_NUMBER}(,{_NUMBER}){{1,2}}$"}
_FOCAL, _OFFSET = r"[1-9]\d{0,4}(\.\d{1,9})?", r"\d{1,5}(\.\d{1,9})?"
_INTRINSICS = {"pattern": f"^{_FOCAL},{_FOCAL},{_OFFSET},{_OFFSET}$"}
_DAY = "a day: a date such as 2026-11-24, or the number of a visit from 1"
Place = Annotated[str, Meta(max_length=100, extra_json_schema=_PLACE)]
Intrinsics = Annotated[Short, Meta(extra_json_schema=_INTRINSICS)]


class NoQuery(Struct, forbid_unknown_fields=True):
    """No values."""


class ThingsQuery(Struct, forbid_unknown_fields=True):
    """Which things are listed."""

    least: Annotated[float, Meta(ge=0.0, le=1.0, description="List things with at least this confidence.")] = 0.5
    name: Annotated[list[Name], Meta(max_length=64, description="List these things only.")] = []
    structure: Annotated[bool, Meta(description="List walls, floors and ceilings as well.")] = False


class ListedThingsQuery(ThingsQuery, forbid_unknown_fields=True):
    """Which things are listed, in which order, and how many at once."""

    room: Annotated[Name | None, Meta(description="List the things of this room, or of all rooms of a kind.")] = None
    near: Annotated[
        Name | None, Meta(description="x,y,z, level x,y, or the name of a thing: the nearest to it come first.")
    ] = None
    top: Annotated[
        Annotated[int, Meta(ge=1, le=10_000)] | None, Meta(description="Most things of a page. Default: all.")
    ] = None
    page: Annotated[int, Meta(ge=1, le=10_000, description="Which page, counted from 1.")] = 1
    at: Annotated[Short | None, Meta(description=f"Of a map of several days: those that were there on {_DAY}.")] = None


class SourcesQuery(Struct, forbid_unknown_fields=True):
    """Which sources of sounds are listed."""

    sound: Annotated[
        list[Name], Meta(max_length=64, description="List the sources of these sounds only. Default: of every sound.")
    ] = []
    prior: Annotated[
        Literal["lexicon", "none"],
        Meta(description="lexicon: what usually makes such a sound is likelier; none: by the microphones alone."),
    ] = "lexicon"
    least: Annotated[float, Meta(ge=0.0, le=1.0, description="Of sounds with at least this confidence.")] = 0.0


class ChangesQuery(Struct, forbid_unknown_fields=True):
    """Which changes are listed."""

    since: Annotated[Short, Meta(description=f"List what changed after {_DAY}. Default: the first.")] = "1"
    first_seen: Annotated[bool, Meta(description="List also what was first seen, where nobody had looked.")] = False


class RoomsQuery(Struct, forbid_unknown_fields=True):
    """Which rooms are listed."""

    least: Annotated[float, Meta(ge=0.0, le=1.0, description="List rooms with at least this confidence.")] = 0.0


class AskQuery(Struct, forbid_unknown_fields=True):
    """A query: a sentence, or its parts. A photo and a clip come as files of a form."""

    sentence: Annotated[
        Sentence | None,
        Meta(
            description="The query in words, such as 'the chair near the sound of glass breaking' or 'how many chairs'."
        ),
    ] = None
    object: Annotated[Name | None, Meta(description="Instead of a sentence: the object.")] = None
    sound: Annotated[Name | None, Meta(description="Instead of a sentence: the sound, in words.")] = None
    area: Annotated[Name | None, Meta(description="Instead of a sentence: the area, such as a room.")] = None
    primary: Annotated[
        Literal["object", "sound", "image", "area"] | None,
        Meta(description="Which part is sought; the others say where it is. Default: object, image, sound, area."),
    ] = None
    top: Annotated[int, Meta(ge=1, le=100, description="Most goals.")] = 3
    at: Annotated[
        HeardAt | None,
        Meta(description="Place of a sound: robot, where it was heard, or source. Default: as the words say."),
    ] = None
    near: Annotated[
        Place | None,
        Meta(description="x,y,z, or level x,y: the goals nearest to it come first, of those that are found."),
    ] = None
    intrinsics: Annotated[
        Intrinsics | None,
        Meta(description="fx,fy,cx,cy of the photo's camera in pixels. Default: the map's own camera."),
    ] = None


class PictureQuery(AskQuery, forbid_unknown_fields=True):
    """A query whose answer is drawn; without a sentence and parts the map is drawn."""

    size: Annotated[
        Literal["small", "full"],
        Meta(description="small: one top-down view, quick; full: one panel for each part, with axes and a scale."),
    ] = "full"


class LocateQuery(Struct, forbid_unknown_fields=True):
    """A photo to locate; it comes as the file 'photo' of a form, or as the body itself."""

    intrinsics: Annotated[
        Intrinsics | None,
        Meta(description="fx,fy,cx,cy of the photo's camera in pixels. Default: the map's own camera."),
    ] = None


class PlaceQuery(Struct, forbid_unknown_fields=True):
    """A place: x, y, z in the recording frame; without z a column of the level frame."""

    x: Annotated[float, _COORDINATE]
    y: Annotated[float, _COORDINATE]
    z: Annotated[
        Annotated[float, _COORDINATE] | None,
        Meta(description="Without it, x and y are in the level frame: a place of the floor plan."),
    ] = None
    radius_m: Annotated[float, Meta(gt=0.0, le=5.0, description="Voxels within this distance count.")] = 0.15


class PathQuery(Struct, forbid_unknown_fields=True, rename={"start": "from", "goal": "to"}):
    """Two places; each is x,y,z in the recording frame, or x,y in the level frame."""

    start: Annotated[Place, Meta(description="Where the body starts, such as 1.5,2.0 or 1.5,2.0,0.3.")]
    goal: Annotated[Place, Meta(description="Where it goes; it stops beside what it cannot stand in.")]
    stairs: Annotated[
        bool, Meta(description="For a body that takes stairs, such as a person; a robot on wheels not.")
    ] = False


class EditQuery(Struct, forbid_unknown_fields=True):
    """A correction of the map, as `avlmaps edit` makes it; /maps/{map}/edits lists all."""

    does: Annotated[
        Literal["rename", "rename-room", "merge", "split", "forbid", "pin", "undo"], Meta(description="What it does.")
    ]
    name: Annotated[
        EditName | None,
        Meta(description="The thing or room that is meant; of forbid and pin, the name of the area or place."),
    ] = None
    to: Annotated[EditName | None, Meta(description="The new name, of rename, rename-room and merge.")] = None
    at: Annotated[Place | None, Meta(description="Where the thing or place is, such as 1.5,2.0 or 1.5,2.0,0.3.")] = None
    places: Annotated[
        list[Place], Meta(max_length=16, description="Of the things that are merged; two on the plane of a split.")
    ] = []
    room: Annotated[EditName | None, Meta(description="The room that is forbidden.")] = None
    box: Annotated[
        list[Annotated[float, _COORDINATE]],
        Meta(max_length=4, description="x0, y0, x1, y1 of what is forbidden or cut, level frame, metres."),
    ] = []
    edit: Annotated[Short | None, Meta(description="The edit that is undone. Default: the last.")] = None
    by: Annotated[EditName | None, Meta(description="Who makes it.")] = None


class ViewQuery(Struct, forbid_unknown_fields=True):
    """What the page shows beside the map."""

    other: Annotated[
        Annotated[str, Meta(max_length=MOST_CHARACTERS, pattern=r"\S")] | None,
        Meta(description="A second map of the same place, to compare."),
    ] = None


class RehearseQuery(Struct, forbid_unknown_fields=True):
    """A command that is planned on the map. A photo and a clip that it speaks of come as files of a form."""

    command: Annotated[str, Meta(max_length=1000, description="The command, such as 'go to the sofa'.")]
    start: Annotated[
        Annotated[str, Meta(pattern=rf"^{_NUMBER},{_NUMBER},{_NUMBER}$")] | None,
        Meta(
            description="x,y,heading where it begins, metres and radians, level frame. Default: near the walk's start."
        ),
    ] = None


class TilesQuery(Struct, forbid_unknown_fields=True):
    """How tiles are coloured."""

    heat: Annotated[
        Annotated[str, Meta(max_length=MOST_CHARACTERS, extra_json_schema={"pattern": "[A-Za-z]"})] | None,
        Meta(description="A query in words; each voxel then has its heat as a seventh byte, 0 to 255."),
    ] = None


def checked(values: Mapping[str, Any], kind: type[T], *, strict: bool = True) -> T:
    """Return a request of a kind from JSON values; without ``strict`` a number may come as text.

    Raises:
        RequestError: a value is missing, unknown, of the wrong type or out of range; the sentence names it.
    """
    plain = {name: _whole(value) for name, value in values.items()}
    try:
        request = msgspec.convert(plain, kind, strict=strict)
    except msgspec.ValidationError as fault:
        raise _unfit(fault) from None
    return _finite(request)


def _whole(value: Any) -> Any:
    return int(value) if isinstance(value, float) and value.is_integer() and abs(value) < 2**53 else value


def checked_texts(pairs: Iterable[tuple[str, str]], kind: type[T]) -> T:
    """Return a request of a kind from the texts of an address or a form.

    Raises:
        RequestError: as of ``checked``, or a value is given twice that can be given once.
    """
    lists = {field.encode_name for field in msgspec.structs.fields(kind) if _is_list(field.type)}
    values: dict[str, Any] = {}
    for name, text in pairs:
        if name in lists:
            values.setdefault(name, []).append(text)
        elif name in values:
            raise RequestError(f"{name[:80]!r} is given twice; give it once.")
        else:
            values[name] = text
    try:
        request = msgspec.convert(values, kind, strict=False)
    except msgspec.ValidationError as fault:
        raise _unfit(fault) from None
    read = msgspec.structs.asdict(request)
    for field in msgspec.structs.fields(kind):  # a text "null" is no number
        if field.encode_name in values and read[field.name] is None:
            raise RequestError(f"{field.encode_name!r} has no value; give one, or leave it out.")
    return _finite(request)


def _unfit(fault: msgspec.ValidationError) -> RequestError:
    return RequestError(f"The request does not fit: {str(fault)[:300]}; /openapi.json describes it.")


def _is_list(kind: Any) -> bool:
    return "list[" in str(kind)


def _finite(request: T) -> T:
    for name in request.__struct_fields__:
        value = getattr(request, name)
        if isinstance(value, float) and not math.isfinite(value):
            raise RequestError(f"{name} is not a finite number; give one.")
    return request


_HIGHEST_RATE_HZ = 96_000


@dataclass(frozen=True, slots=True)
class Uploads:
    """The files of a request, not decoded yet.

    Attributes:
        photo: bytes of a PNG or JPEG.
        clip: bytes of a sound.
    """

    photo: bytes | None = None
    clip: bytes | None = None

    def attachments(self, limits: Limits) -> Mapping[str, Attachment]:
        """Decode the files.

        Raises:
            RequestError: one is of another kind, damaged, or too large.
        """
        found: dict[str, Attachment] = {}
        if self.photo is not None:
            found[PHOTO] = Photo(decode_photo(self.photo, limits), focal_35mm_of(self.photo))
        if self.clip is not None:
            found[CLIP] = decode_clip(self.clip, limits)
        return found

    def written(self, folder: Path) -> tuple[str | None, str | None]:
        """Write the files, which are whole, into a folder; return their names, None for one that is not there."""
        names: list[str | None] = []
        for kind, content in ((PHOTO, self.photo), (CLIP, self.clip)):
            suffix = ".png" if kind == PHOTO else self_contained_suffix(content or b"") or ""
            names.append(None if content is None else f"{kind}{suffix}")
            if content is not None:
                (folder / f"{kind}{suffix}").write_bytes(content)
        return names[0], names[1]


def decode_photo(content: bytes, limits: Limits) -> UInt8[np.ndarray, "h w 3"]:
    """Decode a PNG or JPEG as RGB.

    Raises:
        RequestError: it is another kind of file, damaged, or has too many pixels.
    """
    import cv2

    size = encoded_size(content)
    if size is None:
        raise RequestError("The photo is no PNG or JPEG, or is cut off; send another one.", 415, "photo")
    if size[0] < 1 or size[1] < 1 or size[0] * size[1] > limits.picture_pixels:
        raise RequestError(
            f"The photo has {size[0]}x{size[1]} pixels; photos have 1 to {limits.picture_pixels:,}; send "
            "a smaller one.",
            413,
            "photo",
        )
    try:
        check_whole(Path("The photo"), content)
    except RecordingError:
        raise RequestError("The photo is cut off or damaged; send it again.", 415, "photo") from None
    # The pose is that of the picture as its pixels lie, so a camera's turn flag must not rotate it.
    bgr = decode_picture(content, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr is None or bgr.shape[:2] != (size[1], size[0]):
        raise RequestError("The photo cannot be decoded; send another one.", 415, "photo")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB)


def decode_clip(content: bytes, limits: Limits) -> Sound:
    """Decode a sound.

    Raises:
        RequestError: it is another kind of file, damaged, silent, or too long.
    """
    suffix = self_contained_suffix(content)
    if suffix is None:
        raise RequestError("The clip is no wav, flac, ogg, mp3, m4a or mkv sound; send another one.", 415, "clip")
    with tempfile.TemporaryDirectory(prefix="avlmaps-serve-") as folder:
        path = Path(folder) / f"clip{suffix}"
        path.write_bytes(content)
        try:
            track = AudioTrack.open(path)
            if track.duration_s > limits.clip_s:
                raise RequestError(
                    f"The clip lasts {track.duration_s:.0f} s; clips last up to {limits.clip_s:g} s, so cut it.",
                    413,
                    "clip",
                )
            if track.rate_hz > _HIGHEST_RATE_HZ:
                raise RequestError(
                    f"The clip has {track.rate_hz:,} samples a second; convert it to 48,000.", 413, "clip"
                )
            sound = track.read()
        except AudioError as error:
            sentence = str(error).replace(str(path), "the clip")
            if folder in sentence:
                sentence = "the clip cannot be read as sound; send another one."
            raise RequestError(sentence[:1].upper() + sentence[1:], 415, "clip") from None
    return require_audible(sound, "of the request")


def camera_of(intrinsics: str | None, photo: UInt8[np.ndarray, "h w 3"] | None) -> Pinhole | None:
    """Return the camera of a photo from ``fx,fy,cx,cy``; None for the map's own.

    Raises:
        RequestError: the numbers are not four, no camera has them, or there is no photo.
    """
    if intrinsics is None:
        return None
    if photo is None:
        raise RequestError("Intrinsics belong to a photo; there is none.")
    return Pinhole(*numbers_of(intrinsics), width=photo.shape[1], height=photo.shape[0])


def numbers_of(intrinsics: str) -> tuple[float, float, float, float]:
    """Return ``fx,fy,cx,cy``.

    Raises:
        RequestError: the numbers are not four, or no camera has them.
    """
    try:
        fx, fy, cx, cy = (float(word) for word in intrinsics.split(","))
        Pinhole(fx, fy, cx, cy, width=1, height=1)  # no camera has a focal length of 0, or NaN
    except ValueError:
        raise RequestError(
            f"Intrinsics are fx,fy,cx,cy in pixels, such as 525,525,320,240; not {intrinsics[:80]!r}."
        ) from None
    return fx, fy, cx, cy
