"""Where was this picture taken: the 6-DoF pose of a photo in the map, or an honest "not located".

Where nobody gave the focal length, or it does not fit, it is refined together with the pose, from the camera that is
assumed and, where its points agree badly, from others.
"""

import time
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import MapError
from avlmaps.core.poses import rotation_angle_rad
from avlmaps.core.wording import option, place_text
from avlmaps.maps.keyframes import local_features
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
_SETTLED, _ROUNDS = 0.003, 4
# Another start is tried where so small a part of the matches agrees, or the focal length moved by more than this share.
_POOR, _FAR = 0.5, 0.15
_SAME_ASPECT = 0.01
_UNSURE = 0.49  # the score of a pose whose place the points do not fix
_OF_ONE_SCALE = 0.85
# Another place fits as well where this share of the points agrees there, so far away; so many keyframes are looked at.
_AS_WELL, _ELSEWHERE_M, _MOST_ALIKE = 0.6, 2.0, 40
_SAME_SIDE = 0.25  # cosine: no descriptor bears a change of view by more than 75 degrees
# So many keypoints of one keyframe are enough: the poses of a recording drift, so that keyframes farther off pull the
# answer away (measured: 0.79 cm with five, 0.63 cm with one).
_ENOUGH_INLIERS = 60
_REFERENCES = 5  # keyframes that look alike are matched where the most alike one alone does not match enough
# The keyframe nearest to the answer is matched again, alone; the pose is accepted if this many keypoints agree.
_NEAREST_INLIERS = 40
# A pose needs so large a part of the matched keypoints. Mirrored pictures of the place itself, where single things
# match, reach 0.21 with up to 46 keypoints; pictures of the place stay above 0.28 unless the map is very sparse.
_INLIER_RATIO = 0.25
# And they must cover so large a part of the picture: the product of the spreads (two standard deviations) along the two
# axes, as a part of width times height; a single poster or logo is not a place.
_SPREAD = 0.02
# Fewer agreeing keypoints guess no better than the place of the keyframe itself. Measured on 48 photos of five
# simulated homes that were not located: 78 % of such poses lie within 0.5 m, of the keyframes 8 %.
_GUESS_INLIERS = 6
_PRINTED_M = 2.0  # a larger error is not printed: noise and pictures of a few pixels have tens of metres, or infinity


@dataclass(frozen=True, slots=True)
class LocatableMap:
    """The parts of a map that ``locate`` needs."""

    keyframes: Keyframes
    place_state: dict[str, np.ndarray]  # what the place encoder learned
    encoders: Encoders  # that made the keyframes
    rig: Rig

    @classmethod
    def of(cls, avlmap: "AVLMap") -> "LocatableMap":
        """Return the parts of a map."""
        return cls(avlmap.data.keyframes, avlmap.data.place_state, avlmap.encoders, avlmap.data.rig)


@dataclass(frozen=True, slots=True)
class _FocalSearch:
    # How far a focal length is doubted.
    most: float  # largest factor between it and what replaces it
    gain: float  # the agreement must grow by this factor; 0 takes the best in any case
    starts: bool  # whether others are tried as well, where points agree badly


_SEARCH: dict[FocalSource, _FocalSearch] = {
    # With the right camera at most 1.004 comes by chance (42 photos of a kitchen); 6 % of zoom gives 1.03 and more.
    "map": _FocalSearch(3.0, 1.015, starts=True),
    "exif": _FocalSearch(2.0, 0.0, starts=True),
    "assumed": _FocalSearch(4.0, 0.0, starts=True),
    # With the right camera at most 1.01 comes by chance; off by 3 % it gives 1.05, by 11 % 1.4.
    "given": _FocalSearch(1.2, 1.03, starts=False),
}


@dataclass(frozen=True, slots=True)
class LocateSettings:
    """How a picture is located, and when it counts as located: by points that agree, never by likeness."""

    min_inliers: int = 15
    """A pose needs this many keypoints that agree with it (each counted once). Pictures of another place reach 7."""
    guess_references: int = 0
    """Where a picture is not located, match this many keyframes one by one and return the best of their poses."""
    refine_focal: bool = True
    """Doubt the focal length of the camera: where another one lets the points agree clearly better, take that."""
    max_place_error_m: float = 0.15
    """A pose whose focal length was found with it is given only if its place is this certain (three standard
    deviations). Measured on 42 photos of a kitchen: wrong ones have 0.4 m and more, right ones 0.08 m and less."""


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """How well a pose is known whose focal length was found with it: three standard deviations."""

    focal: float  # of the focal length, as a part of it
    place_m: float  # of the camera's place, metres
    angle_rad: float  # of its direction, radians


@dataclass(frozen=True, slots=True, repr=False)
class Located:
    """The answer."""

    world_from_camera: Float[np.ndarray, "4 4"] | None  # pose of the camera that took the picture; None: not located
    inliers: int  # keypoints that agree with the best pose, also where they are too few
    reference_stamp_s: float | None  # of the keyframe that most of them were seen in; None without any
    score: float  # the confidence, in [0, 1]; at least 0.5 exactly where a pose is given
    elapsed_ms: float
    camera: Pinhole  # that the pose holds for; another than the given one where its focal length was refined
    guess: Float[np.ndarray, "4 4"] | None = None  # of what was not located, the likeliest pose, if requested
    guess_inliers: int = 0  # keypoints that agree with the guess; 0 where it is only the place of a keyframe
    focal_from: FocalSource = "map"
    uncertainty: Uncertainty | None = None  # of a pose whose focal length was found with it
    centred: bool = False  # the picture has another shape than the map's own: its middle is taken for the camera's axis
    elsewhere: Float[np.ndarray, "4 4"] | None = None  # a pose far away that fits as well: either may be right

    def __repr__(self) -> str:
        pose = self.world_from_camera
        place = "nowhere" if pose is None else "({:.2f}, {:.2f}, {:.2f}) m".format(*pose[:3, 3])
        return f"Located({place}, score {self.score:.2f}, {self.inliers} points agree)"

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know of the pose: that another place fits as well, and how the focal length was found."""
        notes: list[str] = []
        if self.elsewhere is not None:
            place = place_text(self.elsewhere[:3, 3])
            notes.append(
                f"Another place fits equally: {place}, which looks the same; the photo does not tell them apart."
            )
        if self.uncertainty is None:
            return tuple(notes)
        give = f"({option('intrinsics', 'fx,fy,cx,cy', python='Pinhole(...)')})"
        focal = f"{self.camera.fx:.0f} ± {self.uncertainty.focal * self.camera.fx:.0f} pixels"
        where = f"{100 * self.uncertainty.place_m:.1f} cm and {np.rad2deg(self.uncertainty.angle_rad):.1f} degrees"
        if self.world_from_camera is None:
            fix = f"fix it only to {focal}, the place to {where}"
            if not self.uncertainty.place_m <= _PRINTED_M:  # NaN and infinity too
                fix = "do not fix it"
            notes.append(
                f"The focal length of the photo's camera is not known, and its {self.inliers} points {fix}; give it "
                f"{give}."
            )
            return tuple(notes)
        notes.append(f"The focal length was found with the pose: {focal}; by it the pose is known to {where}.")
        if self.centred:
            notes.append(
                "The picture has another shape than the map's own, and its middle is taken for the axis of its camera; "
                f"of a picture that was cut out elsewhere give the intrinsics {give}."
            )
        return tuple(notes)


def locate(
    stored: LocatableMap, rgb: UInt8[np.ndarray, "h w 3"], camera: Pinhole | None, rng: np.random.Generator,
    settings: LocateSettings = LocateSettings(), focal_35mm: float | None = None,
) -> Located:  # fmt: skip
    """Find where a picture was taken.

    ``camera``: that took it; None where nobody knows: that of ``focal_35mm`` (mm for 35 mm film, from the picture's
    EXIF), else the map's own colour camera is assumed, and another focal length is taken where it fits clearly better.
    """
    start_s = time.perf_counter()
    camera, source = _camera_of(rgb, camera, stored.rig.rgb, focal_35mm)
    seen, scale = _as_large_as_in_the_map(rgb, camera, stored.rig.rgb)
    local = stored.encoders.local.encode(seen.copy())  # an encoder may write into what it is given
    place = stored.encoders.place.encode(seen.copy(), local, stored.place_state)
    if scale != 1.0:
        local = replace(local, xy=(local.xy / scale).astype(np.float32), size=(camera.width, camera.height))
    found = locate_features(stored, local, place, camera, rng, settings, source)
    return replace(found, elapsed_ms=1e3 * (time.perf_counter() - start_s))


def locate_features(
    stored: LocatableMap, local: LocalFeatures, place: Float32[np.ndarray, " d"], camera: Pinhole,
    rng: np.random.Generator, settings: LocateSettings = LocateSettings(), source: FocalSource = "given",
) -> Located:  # fmt: skip
    """Find where a picture was taken that has been through the encoders already; ``elapsed_ms`` stays 0."""
    if local.size == (0, 0):
        local = replace(local, size=(camera.width, camera.height))
    return _Search(stored, local, rng, settings).located(place, camera, source)


@dataclass(frozen=True, slots=True)
class _Fit:
    # A pose from some keyframes.
    world_from_camera: Float[np.ndarray, "4 4"]
    camera: Pinhole
    inliers: int  # distinct keypoints
    keyframe: int  # gave most of the agreeing points
    references: Int[np.ndarray, " k"]
    score: float
    uncertainty: Uncertainty | None = None


@dataclass(frozen=True, slots=True)
class _Search:
    # The search for the pose of a picture, by its keypoints.
    stored: LocatableMap
    local: LocalFeatures
    rng: np.random.Generator
    settings: LocateSettings

    def located(self, place: Float32[np.ndarray, " d"], camera: Pinhole, source: FocalSource) -> Located:
        keyframes, settings, search = self.stored.keyframes, self.settings, _SEARCH[source]
        references = alike(keyframes, place, _REFERENCES)
        fit = self.fit(references[:1], camera, search)
        if fit is None or fit.inliers < _ENOUGH_INLIERS:
            fit = self.fit(references, camera, search) or fit
        uncertainty = None if fit is None or source == "given" else fit.uncertainty
        unsure = uncertainty is not None and not uncertainty.place_m <= settings.max_place_error_m
        guess, guess_inliers, other = None, 0, None
        if fit is not None and fit.score >= 0.5 and not unsure:
            fit = self.from_the_nearest(fit)
            other = self.elsewhere(place, fit)
        else:
            guess, guess_inliers = self.guess(alike(keyframes, place, settings.guess_references), camera)
        if fit is None:
            return Located(None, 0, None, 0.0, 0.0, camera, guess, guess_inliers, focal_from=source)
        score = min(fit.score, _UNSURE) if unsure else fit.score if other is None else 0.5
        return Located(
            fit.world_from_camera if score >= 0.5 else None, fit.inliers, float(keyframes.stamp_s[fit.keyframe]), score,
            elapsed_ms=0.0, camera=fit.camera if score >= 0.5 or unsure else camera, guess=guess,
            guess_inliers=guess_inliers, focal_from=source if fit.uncertainty is None else "photo",
            uncertainty=uncertainty, centred=source == "assumed", elsewhere=other,
        )  # fmt: skip

    def elsewhere(self, place: Float32[np.ndarray, " d"], fit: _Fit) -> Float[np.ndarray, "4 4"] | None:
        likely = alike(self.stored.keyframes, place, _MOST_ALIKE)
        seen = np.asarray(self.stored.keyframes.centre, np.float64)
        far = likely[np.linalg.norm(seen[likely] - seen[fit.keyframe], axis=1) > _ELSEWHERE_M]
        for keyframe in far[:_REFERENCES].tolist():
            again = self.fit(np.array([keyframe]), fit.camera)
            if again is not None and again.score >= 0.5 and again.inliers >= _AS_WELL * fit.inliers:
                moved_m = np.linalg.norm(again.world_from_camera[:3, 3] - fit.world_from_camera[:3, 3])
                if moved_m > _ELSEWHERE_M:
                    return again.world_from_camera
        return None

    def guess(self, references: Int[np.ndarray, " k"], camera: Pinhole) -> tuple[Float[np.ndarray, "4 4"] | None, int]:
        if not len(references):
            return None, 0
        fits = [self.fit(references[i : i + 1], camera) for i in range(len(references))]
        best = max((fit for fit in fits if fit is not None), key=lambda fit: fit.inliers, default=None)
        if best is not None and best.inliers >= _GUESS_INLIERS:
            return best.world_from_camera, best.inliers
        likeliest = references[0] if best is None else best.keyframe
        return np.asarray(self.stored.keyframes.world_from_camera[likeliest], np.float64), 0

    def from_the_nearest(self, fit: _Fit) -> _Fit:
        closest = np.array([nearest(self.stored.keyframes, fit.world_from_camera)])
        if np.array_equal(closest, fit.references):
            return fit
        again = self.fit(closest, fit.camera)
        if again is None or again.score < 0.5 or again.inliers < _NEAREST_INLIERS:
            return fit
        return replace(again, uncertainty=fit.uncertainty)

    def fit(
        self, references: Int[np.ndarray, " k"], camera: Pinhole, search: _FocalSearch | None = None
    ) -> _Fit | None:
        # Matches keyframes, estimates the pose from all their points, and judges it; ``search`` doubts the camera.
        keypoint, keyframe, points_world = self.matched(references)
        points = _Points(self.local.xy[keypoint], points_world, self.rng)
        estimate = points.pose(camera)
        if estimate is None:
            return None
        given = camera
        if self.settings.refine_focal and search is not None:
            camera, estimate = points.better_focal(camera, estimate, search)
        found = estimate[0].world_from_camera
        # Nothing looks the same from the other side; but a mirrored wall does fit a camera that stands behind the wall.
        now = points_world - found[:3, 3]
        then = points_world - self.stored.keyframes.world_from_camera[keyframe, :3, 3]
        cosine = (now * then).sum(axis=1) / (np.linalg.norm(now, axis=1) * np.linalg.norm(then, axis=1) + 1e-12)
        agrees = estimate[1] & (cosine > _SAME_SIDE)
        if not agrees.any():
            return None
        keypoints = np.unique(keypoint[agrees])
        score = min(
            _confidence(len(keypoints), self.settings.min_inliers),
            _confidence(len(keypoints) / len(np.unique(keypoint)), _INLIER_RATIO),
            _confidence(_spread(self.local.xy[keypoints], camera), _SPREAD),
        )
        most = int(np.bincount(keyframe[agrees]).argmax())
        known = None if camera == given else points.only(agrees).uncertainty(camera, found)
        return _Fit(found, camera, len(keypoints), most, references, score, known)

    def matched(
        self, references: Int[np.ndarray, " k"]
    ) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Float32[np.ndarray, "n 3"]]:
        # Returns keypoints of the picture, the keyframes that they match in, maybe several, and the points there.
        keyframes, size = self.stored.keyframes, (self.stored.rig.rgb.width, self.stored.rig.rgb.height)
        keypoint, keyframe, points = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)], [np.zeros((0, 3), np.float32)]
        for reference in references:
            match = self.stored.encoders.matcher.match(self.local, local_features(keyframes, int(reference), size))
            points_world = keyframes.points_world[keyframes.offsets[reference] + match[:, 1]]
            has_point = np.isfinite(points_world[:, 0])
            keypoint.append(match[has_point, 0])
            keyframe.append(np.full(int(has_point.sum()), reference))
            points.append(points_world[has_point])
        return np.concatenate(keypoint), np.concatenate(keyframe), np.concatenate(points)


@dataclass(frozen=True, slots=True)
class _Points:
    # Image points and what they show; from them a pose, and the focal length with it.
    xy: Float[np.ndarray, "n 2"]  # pixels
    points_world: Float[np.ndarray, "n 3"]  # metres
    rng: np.random.Generator

    def only(self, which: Bool[np.ndarray, " n"]) -> "_Points":
        return _Points(self.xy[which], self.points_world[which], self.rng)

    def pose(self, camera: Pinhole) -> Estimate | None:
        return estimate_pose(self.xy, self.points_world, camera, self.rng)

    def uncertainty(self, camera: Pinhole, world_from_camera: Float[np.ndarray, "4 4"]) -> Uncertainty:
        focal, place_m, angle_rad = pose_deviation(self.xy, self.points_world, camera, world_from_camera)
        return Uncertainty(3.0 * focal, 3.0 * place_m, 3.0 * angle_rad)

    def better_focal(self, camera: Pinhole, estimate: Estimate, search: _FocalSearch) -> tuple[Pinhole, Estimate]:
        # Returns the camera with a better focal length, and its estimate, where points agree clearly better.
        tolerance_px = PoseSettings().max_error_rad * camera.fx

        def score(other: Pinhole, found: Estimate) -> float:
            return agreement(self.xy, self.points_world, other, found[0].world_from_camera, tolerance_px)

        own = self.settled(camera, estimate)
        found, agrees = [own], float(own[1][1].mean())
        if search.starts and (agrees < _POOR or abs(np.log(own[0].fx / camera.fx)) > _FAR):
            for factor in _STARTS:
                other = replace(camera, fx=camera.fx * factor, fy=camera.fy * factor)
                begun = self.pose(other)
                if begun is not None:
                    found.append(self.settled(other, begun))
        within = [one for one in found if 1.0 / search.most <= one[0].fx / camera.fx <= search.most]
        best = max(within, key=lambda one: score(*one), default=(camera, estimate))
        return best if score(*best) > search.gain * score(camera, estimate) else (camera, estimate)

    def settled(self, camera: Pinhole, estimate: Estimate) -> tuple[Pinhole, Estimate]:
        for _ in range(_ROUNDS):
            pose = estimate[0].world_from_camera
            refined = refine_focal(self.xy, self.points_world, camera, pose, PoseSettings())
            again = self.pose(refined)
            if again is None:
                break
            moved = abs(float(np.log(refined.fx / camera.fx)))
            camera, estimate = refined, again
            if moved < _SETTLED:
                break
        return camera, estimate


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
    """Return the camera of a picture that is not cropped, by its focal length for 35 mm film (CIPA DCG-001)."""
    # The equivalence goes by the diagonal of the picture.
    focal = focal_mm / _DIAGONAL_35MM * float(np.hypot(width, height))
    return Pinhole(focal, focal, 0.5 * width, 0.5 * height, width, height)


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
    # A picture in which things have about as many pixels as in the map's, and its scale: learned keypoints know a thing
    # again at about the size at which they saw it. No picture is made larger.
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
