"""Where was this picture taken: the 6-DoF pose of a photo in the map, or an honest "not located".

Where nobody gave the focal length, or what was given does not fit, it is refined together with the pose, from the
camera that is assumed and, where its points agree badly, from others. The same equations say how well the points fix
both.
"""

import time
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import MapError
from avlmaps.core.numbers import unmasked
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.core.wording import option, place_text
from avlmaps.maps.types import Keyframes
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.pose import PoseSettings, agreement, estimate_pose, pose_deviation, refine_focal
from avlmaps.perception.protocols import LocalFeatures, Pose

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

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


_SAME_ASPECT = 0.01
# The score of a pose whose place the points do not fix.
_UNSURE = 0.49
_OF_ONE_SCALE = 0.85
# Another place fits as well where this share of the points agrees there, so far away; so many keyframes are looked at.
_AS_WELL, _ELSEWHERE_M, _MOST_ALIKE = 0.6, 2.0, 40
_SAME_SIDE = 0.25  # cosine: no descriptor bears a change of view by more than 75 degrees


@dataclass(frozen=True, slots=True)
class LocatableMap:
    """The parts of a map that ``locate`` needs.

    Attributes:
        keyframes: stored pictures.
        place_state: what the place encoder learned.
        encoders: that made the keyframes.
        rig: the recording's cameras.
    """

    keyframes: Keyframes
    place_state: dict[str, np.ndarray]
    encoders: Encoders
    rig: Rig

    @classmethod
    def of(cls, avlmap: "AVLMap") -> "LocatableMap":
        """Return those of a map."""
        return cls(avlmap.data.keyframes, avlmap.data.place_state, avlmap.encoders, avlmap.data.rig)


@dataclass(frozen=True, slots=True)
class LocateSettings:
    """How a picture is located, and when it counts as located.

    The measurements are of RootSIFT's thousand keypoints. Keypoints and matchers of other kinds are judged by the same
    numbers: they count points that agree with one pose, parts of matches and of the picture, never likeness.
    """

    references: int = 5
    """How many keyframes that look alike are matched where the most alike one alone does not match enough."""

    enough_inliers: int = 60
    """This many keypoints of one keyframe are enough. More keyframes would not help: the poses of a recording drift,
    so that keyframes farther off pull the answer away (measured: 0.79 cm with five, 0.63 cm with one)."""

    nearest_inliers: int = 40
    """The keyframe nearest to the answer is matched again, alone; the pose is accepted if this many keypoints agree."""

    min_inliers: int = 15
    """A pose needs this many keypoints that agree with it (each counted once). Pictures of another place reach 7."""

    min_inlier_ratio: float = 0.25
    """And so large a part of the matched keypoints. Mirrored pictures of the place itself, where single things match,
    reach 0.21 with up to 46 keypoints; pictures of the place stay above 0.28 unless the map is very sparse."""

    min_spread: float = 0.02
    """And they must cover so large a part of the picture: the product of the spreads (two standard deviations) along
    the two axes, as a part of width times height; a single poster or logo is not a place."""

    guess_references: int = 0
    """Where a picture is not located, match this many keyframes one by one and return the best of their poses."""

    guess_inliers: int = 6
    """Fewer agreeing keypoints guess no better than the place of the keyframe itself. Measured on 48 photos of five
    simulated homes that were not located: 78 % of such poses lie within 0.5 m, of the keyframes 8 %."""

    refine_focal: bool = True
    """Doubt the focal length of the camera: where another one lets the points agree clearly better, take that."""

    max_focal_change: float = 0.2
    """Of a camera that the caller gave, as a part of the focal length."""

    focal_gain: float = 1.03
    """Clearly better means this factor on their agreement, for a camera that the caller gave. Measured: with the right
    camera at most 1.01 comes by chance; a focal length that is off by 3 % gives 1.05, one that is off by 11 % 1.4."""

    max_place_error_m: float = 0.15
    """A pose whose focal length was found with it is given only if its place is this certain (three standard
    deviations). Measured on 42 photos of a kitchen: wrong ones have 0.4 m and more, right ones 0.08 m and less."""

    pose: PoseSettings = field(default_factory=PoseSettings)
    """Tolerances of the pose."""


# A larger error is not printed as a figure: noise and pictures of a few pixels have tens of metres, or infinity.
_PRINTED_M = 2.0


@dataclass(frozen=True, slots=True, repr=False)
class Located:
    """The answer.

    Attributes:
        world_from_camera: pose of the camera that took the picture, None for "not located".
        inliers: keypoints that agree with the best pose, also where they are too few.
        reference_stamp_s: when the keyframe was taken that most of them were seen in; None without any.
        score: the confidence, in [0, 1]; at least 0.5 exactly where a pose is given.
        elapsed_ms: how long it took.
        camera: the camera that the pose holds for; another than the given one where its focal length was refined.
        guess: where it was not located, the likeliest pose nevertheless, if requested: not to be relied on.
        guess_inliers: keypoints that agree with the guess; 0 where it is only the place of a keyframe.
        focal_from: where the focal length of ``camera`` is from.
        uncertainty: how well the pose is known, where the focal length was found with it.
        centred: whether the picture has another shape than the map's own, so that its middle is taken for the axis of
            its camera.
        elsewhere: a pose in another part of the map that fits as well, if there is one: either may be right.
    """

    world_from_camera: Float[np.ndarray, "4 4"] | None
    inliers: int
    reference_stamp_s: float | None
    score: float
    elapsed_ms: float
    camera: Pinhole
    guess: Float[np.ndarray, "4 4"] | None = None
    guess_inliers: int = 0
    focal_from: FocalSource = "map"
    uncertainty: Uncertainty | None = None
    centred: bool = False
    elsewhere: Float[np.ndarray, "4 4"] | None = None

    def __repr__(self) -> str:
        place = "nowhere"
        if self.world_from_camera is not None:
            place = "({:.2f}, {:.2f}, {:.2f}) m".format(*self.world_from_camera[:3, 3])
        return f"Located({place}, score {self.score:.2f}, {self.inliers} points agree)"

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of the pose: that another place fits as well, and how the focal length was found."""
        return (*self._of_place, *self._of_focal)

    @property
    def _of_place(self) -> tuple[str, ...]:
        if self.elsewhere is None:
            return ()
        place = place_text(self.elsewhere[:3, 3])
        return (f"Another place fits equally: {place}, which looks the same; the photo does not tell them apart.",)

    @property
    def _of_focal(self) -> tuple[str, ...]:
        if self.uncertainty is None:
            return ()
        focal = f"{self.camera.fx:.0f} ± {self.uncertainty.focal * self.camera.fx:.0f} pixels"
        where = f"{100 * self.uncertainty.place_m:.1f} cm and {np.rad2deg(self.uncertainty.angle_rad):.1f} degrees"
        if self.world_from_camera is None:
            fix = f"fix it only to {focal}, the place to {where}"
            if not self.uncertainty.place_m <= _PRINTED_M:  # NaN and infinity too
                fix = "do not fix it"
            return (
                f"The focal length of the photo's camera is not known, and its {self.inliers} points {fix}; give it "
                f"({option('intrinsics', 'fx,fy,cx,cy')}).",
            )
        known = f"The focal length was found with the pose: {focal}; by it the pose is known to {where}."
        if not self.centred:
            return (known,)
        return (
            known,
            "The picture has another shape than the map's own, and its middle is taken for the axis of its camera; of "
            f"a picture that was cut out elsewhere give the intrinsics ({option('intrinsics', 'fx,fy,cx,cy')}).",
        )


def locate(
    stored: LocatableMap,
    rgb: UInt8[np.ndarray, "h w 3"],
    camera: Pinhole | None,
    rng: np.random.Generator,
    settings: LocateSettings = LocateSettings(),
    focal_35mm: float | None = None,
) -> Located:
    """Find where a picture was taken.

    Args:
        stored: the map.
        rgb: the picture.
        camera: the camera that took it; None says that nobody knows: that of ``focal_35mm``, else the map's own colour
            camera is assumed, and another focal length is taken where it fits clearly better.
        rng: seeds the sampling of the pose.
        settings: effort and thresholds.
        focal_35mm: the focal length for 35 mm film in the picture's EXIF, mm.
    """
    start_s = time.perf_counter()
    camera, source = _camera_of(rgb, camera, stored.rig.rgb, focal_35mm)
    seen, scale = _as_large_as_in_the_map(rgb, camera, stored.rig.rgb)
    local = stored.encoders.local.encode(seen.copy())  # an encoder may write into what it is given
    place = unmasked(stored.encoders.place.encode(seen.copy(), local, stored.place_state))
    if scale != 1.0:
        local = replace(local, xy=(local.xy / scale).astype(np.float32), size=(camera.width, camera.height))
    found = locate_features(stored, local, place, camera, rng, settings, source)
    return replace(found, elapsed_ms=1e3 * (time.perf_counter() - start_s))


def locate_features(
    stored: LocatableMap,
    local: LocalFeatures,
    place: Float32[np.ndarray, " d"],
    camera: Pinhole,
    rng: np.random.Generator,
    settings: LocateSettings = LocateSettings(),
    source: FocalSource = "given",
) -> Located:
    """Find where a picture was taken that has been through the encoders already; ``elapsed_ms`` stays 0."""
    search = SEARCH.get(source, FocalSearch(1.0 + settings.max_focal_change, settings.focal_gain, starts=False))
    if local.size == (0, 0):
        local = replace(local, size=(camera.width, camera.height))
    references = alike(stored.keyframes, place, settings.references)
    fit = _fit(stored, local, references[:1], camera, rng, settings, search)
    if fit is None or fit.inliers < settings.enough_inliers:
        fit = _fit(stored, local, references, camera, rng, settings, search) or fit
    uncertainty = None if fit is None or source == "given" else fit.uncertainty
    unsure = uncertainty is not None and not uncertainty.place_m <= settings.max_place_error_m
    if fit is not None and fit.score >= 0.5 and not unsure:
        fit = _from_the_nearest(stored, local, fit, rng, settings)
        guess, guess_inliers = None, 0
    else:
        guess, guess_inliers = _guess(
            stored, local, alike(stored.keyframes, place, settings.guess_references), camera, rng, settings
        )
    other = None if fit is None or fit.score < 0.5 or unsure else _elsewhere(stored, local, place, fit, rng, settings)
    if fit is None:
        return Located(None, 0, None, 0.0, 0.0, camera, guess, guess_inliers, focal_from=source)
    score = min(fit.score, _UNSURE) if unsure else fit.score if other is None else 0.5
    return Located(
        world_from_camera=fit.world_from_camera if score >= 0.5 else None,
        inliers=fit.inliers,
        reference_stamp_s=float(stored.keyframes.stamp_s[fit.keyframe]),
        score=score,
        elapsed_ms=0.0,
        camera=fit.camera if score >= 0.5 or unsure else camera,
        guess=guess,
        guess_inliers=guess_inliers,
        focal_from=source if fit.uncertainty is None else "photo",
        uncertainty=uncertainty,
        centred=source == "assumed",
        elsewhere=other,
    )


def _elsewhere(
    stored: LocatableMap,
    local: LocalFeatures,
    place: Float32[np.ndarray, " d"],
    fit: "_Fit",
    rng: np.random.Generator,
    settings: LocateSettings,
) -> Float[np.ndarray, "4 4"] | None:
    likely = alike(stored.keyframes, place, _MOST_ALIKE)
    seen = np.asarray(stored.keyframes.centre, np.float64)
    far = likely[np.linalg.norm(seen[likely] - seen[fit.keyframe], axis=1) > _ELSEWHERE_M]
    for keyframe in far[: settings.references].tolist():
        again = _fit(stored, local, np.array([keyframe]), fit.camera, rng, settings)
        if again is not None and again.score >= 0.5 and again.inliers >= _AS_WELL * fit.inliers:
            moved_m = np.linalg.norm(again.world_from_camera[:3, 3] - fit.world_from_camera[:3, 3])
            if moved_m > _ELSEWHERE_M:
                return again.world_from_camera
    return None


def _guess(
    stored: LocatableMap,
    local: LocalFeatures,
    references: Int[np.ndarray, " k"],
    camera: Pinhole,
    rng: np.random.Generator,
    settings: LocateSettings,
) -> tuple[Float[np.ndarray, "4 4"] | None, int]:
    if not len(references):
        return None, 0
    fits = [_fit(stored, local, references[i : i + 1], camera, rng, settings) for i in range(len(references))]
    best = max((fit for fit in fits if fit is not None), key=lambda fit: fit.inliers, default=None)
    if best is not None and best.inliers >= settings.guess_inliers:
        return best.world_from_camera, best.inliers
    likeliest = references[0] if best is None else best.keyframe
    return np.asarray(stored.keyframes.world_from_camera[likeliest], np.float64), 0


def alike(keyframes: Keyframes, place: Float32[np.ndarray, " d"], count: int) -> Int[np.ndarray, " k"]:
    """Return the keyframes whose place descriptors are the most like the given one, best first."""
    if not len(keyframes) or not count:
        return np.zeros(0, np.int64)
    if (size := np.shape(place)) != keyframes.place.shape[1:]:
        raise MapError(
            f"The map's keyframes have place descriptors of {keyframes.place.shape[1]} numbers, and its place encoder "
            f"gave {size} for the picture; what that learned of the map is damaged: restore the map from a copy, or "
            "build it again."
        )
    likeness = keyframes.place @ place
    best = np.argpartition(-likeness, min(count, len(likeness)) - 1)[:count]
    return best[np.lexsort((best, -likeness[best]))]


def nearest(keyframes: Keyframes, world_from_camera: Float[np.ndarray, "4 4"]) -> int:
    """Return the keyframe that saw the most of the same: near in place (0.5 m count) as in angle (30 degrees do)."""
    poses = keyframes.world_from_camera
    moved_m = np.linalg.norm(poses[:, :3, 3] - world_from_camera[:3, 3], axis=1)
    turned_rad = rotation_angle_rad(poses, np.broadcast_to(world_from_camera, poses.shape))
    return int(np.argmin(moved_m / 0.5 + turned_rad / np.deg2rad(30.0)))


@dataclass(frozen=True, slots=True)
class _Fit:
    """A pose from some keyframes: ``keyframe`` gave most of the agreeing points; ``inliers`` are distinct keypoints."""

    world_from_camera: Float[np.ndarray, "4 4"]
    camera: Pinhole
    inliers: int
    keyframe: int
    references: Int[np.ndarray, " k"]
    score: float
    uncertainty: Uncertainty | None = None


def _fit(
    stored: LocatableMap,
    local: LocalFeatures,
    references: Int[np.ndarray, " k"],
    camera: Pinhole,
    rng: np.random.Generator,
    settings: LocateSettings,
    search: FocalSearch | None = None,
) -> _Fit | None:
    """Match keyframes, estimate the pose from all their points together, and judge it; ``search`` doubts the camera."""
    pairs = _matched_points(stored, local, references)
    xy = local.xy[pairs.keypoint]
    estimate = estimate_pose(xy, pairs.points_world, camera, rng, settings.pose)
    if estimate is None:
        return None
    given = camera
    if settings.refine_focal and search is not None:
        camera, estimate = better_focal(xy, pairs.points_world, camera, estimate, rng, search, settings.pose)
    pose, agrees = estimate
    agrees = agrees & _seen_from_the_same_side(stored.keyframes, pairs, pose.world_from_camera)
    if not agrees.any():
        return None
    keypoints = np.unique(pairs.keypoint[agrees])
    score = min(
        _confidence(len(keypoints), settings.min_inliers),
        _confidence(len(keypoints) / len(np.unique(pairs.keypoint)), settings.min_inlier_ratio),
        _confidence(_spread(local.xy[keypoints], camera), settings.min_spread),
    )
    most = int(np.bincount(pairs.keyframe[agrees]).argmax())
    found = pose.world_from_camera
    known = None if camera == given else uncertainty_of(xy[agrees], pairs.points_world[agrees], camera, found)
    return _Fit(found, camera, len(keypoints), most, references, score, known)


def _from_the_nearest(
    stored: LocatableMap, local: LocalFeatures, fit: _Fit, rng: np.random.Generator, settings: LocateSettings
) -> _Fit:
    closest = np.array([nearest(stored.keyframes, fit.world_from_camera)])
    if np.array_equal(closest, fit.references):
        return fit
    again = _fit(stored, local, closest, fit.camera, rng, settings)
    if again is None or again.score < 0.5 or again.inliers < settings.nearest_inliers:
        return fit
    return replace(again, uncertainty=fit.uncertainty)


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Keypoints of the picture and the map's 3D points that they match; a keypoint may match in several keyframes."""

    keypoint: Int[np.ndarray, " n"]
    keyframe: Int[np.ndarray, " n"]
    points_world: Float32[np.ndarray, "n 3"]


def _matched_points(stored: LocatableMap, local: LocalFeatures, references: Int[np.ndarray, " k"]) -> _Pairs:
    keyframes, matcher = stored.keyframes, stored.encoders.matcher
    keypoint, keyframe, points = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros((0, 3), np.float32)]
    for reference in references:
        rows = slice(keyframes.offsets[reference], keyframes.offsets[reference + 1])
        match = matcher.match(local, _kept_features(keyframes, rows, stored.rig.rgb))
        points_world = keyframes.points_world[rows][match[:, 1]]
        has_point = np.isfinite(points_world[:, 0])
        keypoint.append(match[has_point, 0])
        keyframe.append(np.full(int(has_point.sum()), reference))
        points.append(points_world[has_point])
    return _Pairs(np.concatenate(keypoint), np.concatenate(keyframe), np.concatenate(points))


def _kept_features(keyframes: Keyframes, rows: slice, camera: Pinhole) -> LocalFeatures:
    return LocalFeatures(
        xy=keyframes.xy[rows],
        descriptors=keyframes.descriptors[rows].astype(np.float32),
        score=keyframes.score[rows].astype(np.float32),
        size=(camera.width, camera.height),
    )


def _seen_from_the_same_side(
    keyframes: Keyframes, pairs: _Pairs, world_from_camera: Float[np.ndarray, "4 4"]
) -> Bool[np.ndarray, " n"]:
    """Return which points are seen from about where their keyframe saw them.

    Nothing looks the same from the other side; but a mirrored wall does fit a camera that stands behind the wall.
    """
    now = pairs.points_world - world_from_camera[:3, 3]
    then = pairs.points_world - keyframes.world_from_camera[pairs.keyframe, :3, 3]
    cosine = (now * then).sum(axis=1) / (np.linalg.norm(now, axis=1) * np.linalg.norm(then, axis=1) + 1e-12)
    return cosine > _SAME_SIDE


def _camera_of(
    rgb: UInt8[np.ndarray, "h w 3"], camera: Pinhole | None, own: Pinhole, focal_35mm: float | None
) -> tuple[Pinhole, FocalSource]:
    height, width = rgb.shape[:2]
    if camera is not None:
        if (camera.width, camera.height) != (width, height):
            raise ValueError(f"the camera is {camera.width}x{camera.height} and the picture {width}x{height}")
        return camera, "given"
    if focal_35mm is not None:
        return camera_of_35mm(focal_35mm, width, height), "exif"
    if abs(width * own.height - height * own.width) <= _SAME_ASPECT * width * own.height:
        return own.resized(width, height), "map"
    focal = 0.5 * (own.fx + own.fy) * float(np.hypot(width, height) / np.hypot(own.width, own.height))
    return Pinhole(focal, focal, 0.5 * width, 0.5 * height, width, height), "assumed"


def _as_large_as_in_the_map(
    rgb: UInt8[np.ndarray, "h w 3"], camera: Pinhole, own: Pinhole
) -> tuple[UInt8[np.ndarray, "hs ws 3"], float]:
    """Return a picture in which things have about as many pixels as in the map's, and its scale.

    Learned keypoints know a thing again at about the size at which they saw it. No picture is made larger.
    """
    scale = own.fx / camera.fx
    if scale > _OF_ONE_SCALE:
        return rgb, 1.0
    import cv2

    size = (max(1, round(camera.width * scale)), max(1, round(camera.height * scale)))
    return cv2.resize(rgb, size, interpolation=cv2.INTER_AREA).astype(np.uint8), scale


def _spread(xy: Float[np.ndarray, "n 2"], camera: Pinhole) -> float:
    if len(xy) < 2:
        return 0.0
    deviation = 2.0 * xy.std(axis=0)
    return float(deviation[0] * deviation[1] / (camera.width * camera.height))


def _confidence(value: float | int, threshold: float | int) -> float:
    return value / (value + threshold)
