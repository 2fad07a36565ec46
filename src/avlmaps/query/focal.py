"""The focal length of a photo's camera, where nobody gave it or what was given does not fit: found with the pose.

A pose is refined together with the focal length, from the camera that is assumed and, where its points agree badly,
from others. How well the points fix both is known from the same equations, and is said with the answer.
"""

from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from avlmaps.core.camera import Pinhole
from avlmaps.perception.pose import PoseSettings, agreement, estimate_pose, pose_deviation, refine_focal
from avlmaps.perception.protocols import Pose

FocalSource = Literal["map", "given", "exif", "assumed", "photo"]
"""Where a focal length is from: the map's camera, the caller, EXIF, a guess, or the photo itself with its pose."""
Estimate = tuple[Pose, Bool[np.ndarray, " n"]]

_EXIF_IFD, _FOCAL_35MM = 0x8769, 0xA405
_DIAGONAL_35MM = float(np.hypot(36.0, 24.0))
_FOCALS_35MM = (4.0, 400.0)
_STARTS = (0.7, 1.4, 2.0)
_SETTLED = 0.003
_ROUNDS = 4
# Another start is tried where so small a part of the matches agrees, or the focal length moved by more than this share.
_POOR, _FAR = 0.5, 0.15


@dataclass(frozen=True, slots=True)
class FocalSearch:
    """How far a focal length is doubted.

    Attributes:
        most: largest factor between it and what replaces it.
        gain: the agreement must grow by this factor; 0 takes the best in any case.
        starts: whether others are tried as well, where points agree badly.
    """

    most: float
    gain: float
    starts: bool


SEARCH: dict[FocalSource, FocalSearch] = {
    # With the right camera at most 1.004 comes by chance (42 photos of a kitchen); 6 % of zoom gives 1.03 and more.
    "map": FocalSearch(3.0, 1.015, starts=True),
    "exif": FocalSearch(2.0, 0.0, starts=True),
    "assumed": FocalSearch(4.0, 0.0, starts=True),
}


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """How well a pose is known whose focal length was found with it: three standard deviations.

    Attributes:
        focal: of the focal length, as a part of it.
        place_m: of the camera's place, metres.
        angle_rad: of its direction, radians.
    """

    focal: float
    place_m: float
    angle_rad: float


def focal_35mm_of(photo: Path | bytes) -> float | None:
    """Return the focal length for 35 mm film that a photo's EXIF notes, mm; None where it has none that can be."""
    from PIL import Image

    try:
        with Image.open(BytesIO(photo) if isinstance(photo, bytes) else photo) as picture:
            noted = float(picture.getexif().get_ifd(_EXIF_IFD).get(_FOCAL_35MM, 0))
    except (OSError, ValueError, TypeError, SyntaxError, ZeroDivisionError):
        return None
    return noted if _FOCALS_35MM[0] <= noted <= _FOCALS_35MM[1] else None


def camera_of_35mm(focal_mm: float, width: int, height: int) -> Pinhole:
    """Return the camera of a picture that is not cropped, by its focal length for film of 36 mm x 24 mm.

    The equivalence goes by the diagonal of the picture (CIPA DCG-001).
    """
    focal = focal_mm / _DIAGONAL_35MM * float(np.hypot(width, height))
    return Pinhole(focal, focal, 0.5 * width, 0.5 * height, width, height)


def better_focal(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    estimate: Estimate,
    rng: np.random.Generator,
    search: FocalSearch,
    settings: PoseSettings,
) -> tuple[Pinhole, Estimate]:
    """Return the camera with a better focal length, and its estimate, where points agree clearly better.

    Args:
        xy: image coordinates, pixels.
        points_world: what they show, metres.
        camera: as it is assumed.
        estimate: with it.
        rng: seeds the sampling.
        search: how far it is doubted.
        settings: tolerances of poses.
    """
    tolerance_px = settings.max_error_rad * camera.fx

    def score(other: Pinhole, found: Estimate) -> float:
        return agreement(xy, points_world, other, found[0].world_from_camera, tolerance_px)

    found = [_settled(xy, points_world, camera, estimate, rng, settings)]
    own = found[0]
    agrees = float(own[1][1].mean())
    if search.starts and (agrees < _POOR or abs(np.log(own[0].fx / camera.fx)) > _FAR):
        for factor in _STARTS:
            other = _scaled(camera, factor)
            begun = estimate_pose(xy, points_world, other, rng, settings)
            if begun is not None:
                found.append(_settled(xy, points_world, other, begun, rng, settings))
    within = [one for one in found if 1.0 / search.most <= one[0].fx / camera.fx <= search.most]
    best = max(within, key=lambda one: score(*one), default=(camera, estimate))
    return best if score(*best) > search.gain * score(camera, estimate) else (camera, estimate)


def uncertainty_of(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    world_from_camera: Float[np.ndarray, "4 4"],
) -> Uncertainty:
    """Return how well points that agree fix a pose and its focal length together."""
    focal, place_m, angle_rad = pose_deviation(xy, points_world, camera, world_from_camera)
    return Uncertainty(3.0 * focal, 3.0 * place_m, 3.0 * angle_rad)


def _scaled(camera: Pinhole, factor: float) -> Pinhole:
    return replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)


def _settled(
    xy: Float[np.ndarray, "n 2"],
    points_world: Float[np.ndarray, "n 3"],
    camera: Pinhole,
    estimate: Estimate,
    rng: np.random.Generator,
    settings: PoseSettings,
) -> tuple[Pinhole, Estimate]:
    for _ in range(_ROUNDS):
        refined = refine_focal(xy, points_world, camera, estimate[0].world_from_camera, settings)
        again = estimate_pose(xy, points_world, refined, rng, settings)
        if again is None:
            break
        moved = abs(float(np.log(refined.fx / camera.fx)))
        camera, estimate = refined, again
        if moved < _SETTLED:
            break
    return camera, estimate
