"""Where a picture was taken: heat around the camera that ``locate`` finds."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import QueryError
from avlmaps.core.question import Part
from avlmaps.query.factors import NearAnchors
from avlmaps.query.settings import FOUND_AT, HeatSettings
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.audio import Sound

if TYPE_CHECKING:
    from avlmaps.query.locate import Located


# A guess stays a guess, however few keypoints agree with it.
_LEAST_CERTAINTY, _MOST_OF_A_GUESS = 0.01, 0.49


@dataclass(frozen=True, slots=True, eq=False)
class Photo:
    """A picture that came without a file of its own."""

    rgb: UInt8[np.ndarray, "h w 3"]
    focal_35mm: float | None = None  # the focal length for 35 mm film in its EXIF, mm; None where it has none


Attachment = UInt8[np.ndarray, "h w 3"] | Photo | Sound
"""A picture or a sound that comes with a question, instead of a file."""


def read_picture(path: Path) -> UInt8[np.ndarray, "h w 3"]:
    """Read a picture as RGB. ``QueryError``: it is missing or no picture."""
    import cv2

    if not path.is_file():
        kind = "is a folder" if path.is_dir() else "is not there"
        raise QueryError(f"The picture {path} {kind}; check the name.")
    encoded = np.frombuffer(path.read_bytes(), np.uint8)
    # The pose is that of the picture as its pixels lie, so a camera's turn flag must not rotate it.
    picture = cv2.imdecode(encoded, cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION) if len(encoded) else None
    if picture is None:
        raise QueryError(f"The picture {path} cannot be read as an image; use a PNG or a JPEG.")
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)


def require_fitting(rgb: UInt8[np.ndarray, "h w 3"], intrinsics: Pinhole | None) -> None:
    """Raise ``QueryError`` where a picture is not RGB of whole bytes, or not of the size its intrinsics are for."""
    if rgb.ndim != 3 or rgb.shape[2] != 3 or rgb.dtype != np.uint8 or rgb.size == 0:
        raise QueryError(
            f"The picture is an array of {rgb.dtype} and shape {rgb.shape}; give RGB, uint8 of (height, width, 3)."
        )
    height, width = rgb.shape[:2]
    if intrinsics is not None and not isinstance(intrinsics, Pinhole):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise QueryError(
            "The intrinsics of a picture are an avlmaps.Pinhole(fx, fy, cx, cy, width, height), not "
            f"{type(intrinsics).__name__}."
        )
    if intrinsics is not None and (intrinsics.width, intrinsics.height) != (width, height):
        raise QueryError(
            f"The picture has {width}x{height} pixels, its intrinsics are for "
            f"{intrinsics.width}x{intrinsics.height}; give those of the picture as it is."
        )


def image_factor(space: Space, located: "Located", part: Part, heat: HeatSettings) -> NearAnchors:
    """Return the heat of a picture: one anchor of score 1 at the camera, else at the best guess, if there is one."""
    is_located = located.world_from_camera is not None
    pose = located.world_from_camera if is_located else located.guess
    confidence = 1.0 if is_located else max(min(located.score, _MOST_OF_A_GUESS), _LEAST_CERTAINTY)
    found = pose is not None and confidence >= FOUND_AT
    anchors = np.zeros((0, 3)) if pose is None else np.asarray(pose, np.float64)[None, :3, 3]
    note = "" if is_located else f"the picture could not be located ({located.inliers} points agree)"
    if not is_located and located.notes:
        note += f"; {located.notes[0][:1].lower()}{located.notes[0][1:].rstrip('.')}"
    if pose is not None and not is_located:
        note += "; the heat is that of the best guess"
    scores, instance = np.ones(len(anchors)), np.zeros(len(anchors), np.int64)
    return NearAnchors(
        space,
        part,
        heat.falloff_per_m(part.role),
        anchors,
        scores,
        instance,
        found,
        part.query,
        note,
        float(confidence),
    )
