"""Files that come with a request: decoded from their bytes, by the readers of recordings, sizes from headers first.

A photo never touches the disk. A clip is written into a private folder under a name of ours, since the readers of sound
take files; only containers that hold their own samples are let in, so that no upload can make a reader open another
file. Names that clients give their files are not used for anything.
"""

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.query.focal import focal_35mm_of
from avlmaps.query.modalities.sound import require_audible
from avlmaps.query.queryable import Attachment, Photo
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.containers import self_contained_suffix
from avlmaps.recordings.images import check_whole, decode_picture, encoded_size
from avlmaps.serve.errors import RequestError
from avlmaps.serve.requests import CLIP, PHOTO
from avlmaps.serve.settings import Limits

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
