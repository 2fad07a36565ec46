"""Where a picture was taken, by its colours: the picture is compared with what the coloured voxels would look like.

Keypoints fail where there is little texture (a bare wall, a plain sofa), though anybody would know the room by its
colours. From places all over the map a panorama is drawn; the picture is laid on each at every heading and pitch, and
the best of these poses are moved until the drawn view is most alike (direct image alignment, as by Lucas and Kanade
1981, without derivatives). The measure is a correlation, so that exposure does not matter.

The result is a guess: rooms may look alike. It answers where keypoints do not. How likely it is right follows from how
alike the view is, from the keypoints that agree, and above all from its lead over the best pose elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Int32, UInt8

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import from_rotation
from avlmaps.maps.types import Keyframes
from avlmaps.query.photometric_kernels import compare_panoramas, compare_view, draw_panoramas
from avlmaps.query.threads import share
from avlmaps.query.voxel_space import Space

_BIN_RAD = np.deg2rad(3.0)
_COLUMNS, _ROWS = 120, 50
_LOWEST_RAD = np.deg2rad(-80.0)
_STEPS = (  # sides of the picture in pixels, steps in metres and radians
    (40, ((0.2, np.deg2rad(5.0)), (0.1, np.deg2rad(2.5)))),
    (80, ((0.05, np.deg2rad(1.5)), (0.02, np.deg2rad(0.6)))),
)
_MOST_ROUNDS = 4  # of moves at one step
_FIRST_SIDE = 20  # of the picture in pixels when it is laid on panoramas
_TURN = 2  # columns of a panorama from one heading that is tried to the next


class _Ranked(NamedTuple):
    """A pose, the likeness of the view from there, and the keypoints that agree with it, up to a limit."""

    level_from_camera: Float[np.ndarray, "4 4"]
    alike: float
    inliers: int


@dataclass(frozen=True, slots=True)
class PhotometricSettings:
    """How a picture is sought by its colours. Chosen on homes 1000000 to 1000004 of the indexing benchmark."""

    spacing_m: float = 0.5
    """From one place to look from to the next; wider where there would be more than ``most_eyes``."""
    most_eyes: int = 4000
    """Number of panoramas at most; each takes 24 kB."""
    reach_m: float = 1.2
    """A picture was taken so near to where the robot has been."""
    heights_m: tuple[float, ...] = (-0.65, -0.15, 0.3)
    """From the height of the camera of the nearest keyframe."""
    far_m: float = 8.0
    """Limit of the distance of drawn voxels from an eye."""
    pitches_rad: tuple[float, ...] = tuple(np.deg2rad(np.arange(-32.0, 17.0, 8.0)))
    """Above the horizon, of the pictures that are looked for first."""
    candidates: int = 40
    """Number of poses that are moved to fit better."""
    finalists: int = 6
    """Number of these that are moved to fit best."""
    least_seen: float = 0.5
    """The map must show this part of the picture."""
    colour_weight: float = 2.0
    """Of the two channels of colour, against brightness."""
    inlier_worth: float = 0.015
    """A keypoint that agrees with a given pose adds this to its likeness..."""
    most_inliers: int = 12
    """...up to this many of them."""
    elsewhere_m: float = 1.0
    """A pose at least this far away is another place, over which the best has its lead."""
    odds: tuple[float, float, float, float] = (-15.3, 16.6, 0.5, 4.0)
    """Log-odds that the place is right within 0.75 m: a constant, and the worth of likeness, of each keypoint, of the
    lead. Fitted to 176 photos that keypoints do not locate, two thirds of them of other homes."""


@dataclass(frozen=True, slots=True)
class Start:
    """A pose that something else proposes, with the keypoints that agree with it."""

    world_from_camera: Float[np.ndarray, "4 4"]
    inliers: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class ByColour:
    """The pose from which a map looks most like a picture.

    Attributes:
        world_from_camera: the pose.
        likeness: correlation of the picture with the view drawn from there, at most 1.
        inliers: keypoints that agree with the pose, counted up to ``most_inliers``; 0 for one found by colours alone.
        lead: by how much it is ahead, in likeness and keypoints, of the best pose at another place; all of it where no
            other place was among the finalists.
        confidence: the probability that the place is right.
    """

    world_from_camera: Float[np.ndarray, "4 4"]
    likeness: float
    inliers: int
    lead: float
    confidence: float


class Panoramas:
    """A map's colours as seen from all over it, and the search for a picture among them.

    Attributes:
        settings: how it is sought.
        eyes_level: (e, 3) where was looked from, level frame, metres.
    """

    def __init__(
        self,
        space: Space,
        rgb: UInt8[np.ndarray, "n 3"],
        keyframes: Keyframes,
        settings: PhotometricSettings = PhotometricSettings(),
    ) -> None:
        self.settings = settings
        self._level_from_world = space.level_from_world
        side_m, colours = space.grid.voxel_size_m, np.asarray(rgb)
        points = space.level(space.centres).astype(np.float32)
        coarse = _halved(np.asarray(space.index), points, colours)
        self._surfaces = (_Surface(*coarse, 2 * side_m), _Surface(points, colours, side_m))
        cameras = space.level(keyframes.world_from_camera[:, :3, 3])
        self.eyes_level = _eyes(cameras, settings)
        self._drawn = np.zeros((len(self.eyes_level), _ROWS, _COLUMNS, 4), np.uint8)

        def draw(start: int, stop: int) -> None:
            depth = np.zeros((_ROWS, _COLUMNS), np.float32)
            draw_panoramas(
                *coarse, 2 * side_m, self.eyes_level[start:stop], settings.far_m, _LOWEST_RAD, _BIN_RAD,
                self._drawn[start:stop], depth,
            )  # fmt: skip

        share(draw, len(self.eyes_level))

    def likeliest(
        self, rgb: UInt8[np.ndarray, "h w 3"], camera: Pinhole, starts: Sequence[Start] = ()
    ) -> ByColour | None:
        """Return the pose from which the map looks most like a picture; None where it is like no place."""
        most, starting = self.settings.most_inliers, from_rotation(self._level_from_world)
        found = [_Ranked(pose, 0.0, 0) for pose in self._candidates(rgb, camera)]
        found += [_Ranked(starting @ start.world_from_camera, 0.0, min(start.inliers, most)) for start in starts]
        for rank, (side, steps) in enumerate(_STEPS):
            picture = _Shrunk.of(rgb, camera, side, self.settings.colour_weight)
            found = self._all_moved(found, picture, self._surfaces[rank], steps)[: self.settings.finalists]
        if not found:
            return None
        best = found[0]
        lead = self._worth(best) - max(
            (self._worth(other) for other in found if self._is_elsewhere(other, best)), default=0.0
        )
        constant, alike, keypoint, ahead = self.settings.odds
        odds = constant + alike * best.alike + keypoint * best.inliers + ahead * lead
        confidence = 1.0 / (1.0 + float(np.exp(-odds)))
        return ByColour(starting.T @ best.level_from_camera, best.alike, best.inliers, lead, confidence)

    def _worth(self, one: "_Ranked") -> float:
        return one.alike + self.settings.inlier_worth * one.inliers

    def _is_elsewhere(self, one: "_Ranked", other: "_Ranked") -> bool:
        apart = one.level_from_camera[:3, 3] - other.level_from_camera[:3, 3]
        return float(np.linalg.norm(apart)) > self.settings.elsewhere_m

    def _all_moved(
        self, found: list["_Ranked"], picture: "_Shrunk", surface: "_Surface", steps: Sequence[tuple[float, float]]
    ) -> list["_Ranked"]:
        """Return poses moved to where the map looks most like a picture, the best first; none that is like nothing."""
        moved = list(found)

        def move(start: int, stop: int) -> None:
            for i in range(start, stop):
                pose, alike = self._moved(found[i].level_from_camera, picture, surface, steps)
                moved[i] = _Ranked(pose, alike, found[i].inliers)

        share(move, len(found))
        return sorted((one for one in moved if one.alike > 0.0), key=lambda one: -self._worth(one))

    def _candidates(self, rgb: UInt8[np.ndarray, "h w 3"], camera: Pinhole) -> list[Float[np.ndarray, "4 4"]]:
        """Return the best poses on the grid of places, headings and pitches, no two of them alike; level frame."""
        settings = self.settings
        picture = _Shrunk.of(rgb, camera, _FIRST_SIDE, settings.colour_weight)
        ray = picture.camera.rays()
        directions = [ray @ _level_from_camera(0.0, pitch).T for pitch in settings.pitches_rad]
        azimuth = np.array([np.arctan2(one[..., 1], one[..., 0]).ravel() for one in directions])
        elevation = np.array(
            [np.arctan2(one[..., 2], np.hypot(one[..., 0], one[..., 1])).ravel() for one in directions]
        )
        row = np.floor((elevation - _LOWEST_RAD) / _BIN_RAD).astype(np.int32)
        column = np.floor(azimuth / _BIN_RAD).astype(np.int32) % _COLUMNS
        score = np.full((len(self._drawn), len(directions), _COLUMNS // _TURN), -1.0, np.float32)
        flat = picture.channels.reshape(-1, 3)

        def compare(start: int, stop: int) -> None:
            compare_panoramas(
                self._drawn[start:stop], flat, row, column, _TURN, settings.least_seen, settings.colour_weight,
                score[start:stop],
            )  # fmt: skip

        share(compare, len(score))
        return self._apart(score)

    def _apart(self, score: Float32[np.ndarray, "e p h"]) -> list[Float[np.ndarray, "4 4"]]:
        """Return the poses of the best scores, no two of them from about the same place in about the same direction."""
        settings, heading_of = self.settings, _TURN * _BIN_RAD
        chosen: list[tuple[int, int, int]] = []
        places = np.zeros((0, 3))
        headings = np.zeros(0)
        ranked = score.ravel()
        order = np.argsort(-ranked, kind="stable")
        for flat_index in order[ranked[order] > 0.0]:
            eye, pitch, heading = (int(i) for i in np.unravel_index(int(flat_index), score.shape))
            near = np.linalg.norm(places - self.eyes_level[eye], axis=1) < 0.9 * settings.spacing_m
            apart = np.abs((headings - heading * heading_of + np.pi) % (2 * np.pi) - np.pi)
            if (near & (apart < np.deg2rad(25.0))).any():
                continue
            chosen.append((eye, pitch, heading))
            places = np.concatenate([places, self.eyes_level[eye][None]])
            headings = np.append(headings, heading * heading_of)
            if len(chosen) >= settings.candidates:
                break
        return [self._pose(eye, heading * heading_of, settings.pitches_rad[pitch]) for eye, pitch, heading in chosen]

    def _pose(self, eye: int, heading_rad: float, pitch_rad: float) -> Float[np.ndarray, "4 4"]:
        return from_rotation(_level_from_camera(heading_rad, pitch_rad), self.eyes_level[eye])

    def _moved(
        self,
        pose: Float[np.ndarray, "4 4"],
        picture: "_Shrunk",
        surface: "_Surface",
        steps: Sequence[tuple[float, float]],
    ) -> tuple[Float[np.ndarray, "4 4"], float]:
        """Move a pose, level frame, until no step along or about an axis of the camera makes the view more alike."""
        small = picture.camera
        sight = self._in_sight(pose, small, surface.points)
        points, channels = surface.points[sight], _channels(surface.rgb[sight], self.settings.colour_weight)
        numbers = np.array([small.fx, small.fy, small.cx, small.cy])
        size = picture.channels.shape[:2]
        depth, drawn = np.zeros(size, np.float32), np.zeros(size, np.int64)

        def likeness(tried: Float[np.ndarray, "4 4"]) -> float:
            return compare_view(
                points,
                channels,
                surface.side_m,
                numbers,
                tried,
                picture.channels,
                self.settings.least_seen,
                depth,
                drawn,
            )

        best, most = pose, likeness(pose)
        for step_m, step_rad in steps:
            motions = _motions(step_m, step_rad)
            for _ in range(_MOST_ROUNDS):
                before = most
                for motion in motions:
                    tried = best @ motion
                    alike = likeness(tried)
                    if alike > most + 1e-4:
                        best, most = tried, alike
                if most == before:
                    break
        return best, most

    def _in_sight(
        self, pose: Float[np.ndarray, "4 4"], camera: Pinhole, points: Float32[np.ndarray, "n 3"]
    ) -> Bool[np.ndarray, " n"]:
        """Return the voxels that the camera can come to see while it is moved."""
        away = points - pose[:3, 3].astype(np.float32)
        distance = np.linalg.norm(away, axis=1)
        corner = np.linalg.norm(camera.rays()[[0, 0, -1, -1], [0, -1, 0, -1]], axis=1).max()
        cosine = np.cos(min(np.arccos(1.0 / corner) + np.deg2rad(12.0), np.pi))
        ahead = away @ pose[:3, 2].astype(np.float32)
        return (distance < self.settings.far_m) & (ahead > cosine * distance - 0.5)


@dataclass(frozen=True, slots=True, eq=False)
class _Surface:
    """Coloured voxels of one size: their middles, level frame, their colours, their side."""

    points: Float32[np.ndarray, "n 3"]
    rgb: UInt8[np.ndarray, "n 3"]
    side_m: float


def _channels(rgb: UInt8[np.ndarray, "*n 3"], colour_weight: float) -> Float32[np.ndarray, "*n 3"]:
    """Return brightness, red against green, and both against blue, the latter two weighted."""
    r, g, b = np.moveaxis(rgb.astype(np.float32), -1, 0)
    channels = [(r + g + b) / 3, colour_weight * (r - g), colour_weight * ((r + g) / 2 - b)]
    return np.stack(channels, axis=-1).astype(np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class _Shrunk:
    """A picture made small, as channels, and its camera."""

    channels: Float32[np.ndarray, "h w 3"]
    camera: Pinhole

    @classmethod
    def of(cls, rgb: UInt8[np.ndarray, "h w 3"], camera: Pinhole, side: int, colour_weight: float) -> "_Shrunk":
        """Scale the longer side to ``side`` pixels."""
        factor = side / max(camera.width, camera.height)
        size = max(1, round(camera.width * factor)), max(1, round(camera.height * factor))
        small = cv2.resize(np.ascontiguousarray(rgb), size, interpolation=cv2.INTER_AREA)
        return cls(_channels(small, colour_weight), camera.resized(*size))


def _level_from_camera(heading_rad: float, pitch_rad: float) -> Float[np.ndarray, "3 3"]:
    """Return the rotation of an upright camera: z ahead, x to the right, y down."""
    c, s, cp, sp = np.cos(heading_rad), np.sin(heading_rad), np.cos(pitch_rad), np.sin(pitch_rad)
    ahead, right = np.array([c * cp, s * cp, sp]), np.array([s, -c, 0.0])
    return np.stack([right, np.cross(ahead, right), ahead], axis=1)


@cache
def _motions(step_m: float, step_rad: float) -> list[Float[np.ndarray, "4 4"]]:
    """Return small motions of a camera, each way along and about each of its axes."""
    motions: list[Float[np.ndarray, "4 4"]] = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            along = sign * np.eye(3)[axis]
            turn = np.asarray(cv2.Rodrigues(step_rad * along)[0], np.float64)
            motions += [from_rotation(np.eye(3), step_m * along), from_rotation(turn)]
    return motions


def _eyes(cameras: Float[np.ndarray, "k 3"], settings: PhotometricSettings) -> Float32[np.ndarray, "e 3"]:
    """Return places on a grid near to where the camera has been, at several heights; level frame."""
    from scipy.spatial import KDTree

    if not len(cameras):
        return np.zeros((0, 3), np.float32)
    low, high = cameras[:, :2].min(axis=0) - settings.reach_m, cameras[:, :2].max(axis=0) + settings.reach_m
    most = settings.most_eyes / len(settings.heights_m)
    spacing_m = settings.spacing_m
    tree = KDTree(cameras[:, :2])
    while True:
        axes = [np.arange(a, b, spacing_m) for a, b in zip(low, high, strict=True)]
        xy = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        away_m, nearest = tree.query(xy)
        near = away_m < settings.reach_m
        if near.sum() <= most:
            break
        spacing_m *= 1.25
    floor = cameras[nearest[near], 2]
    eyes = [np.column_stack([xy[near], floor + height_m]) for height_m in settings.heights_m]
    return np.concatenate(eyes).astype(np.float32)


def _halved(
    index: Int32[np.ndarray, "n 3"], points: Float32[np.ndarray, "n 3"], rgb: UInt8[np.ndarray, "n 3"]
) -> tuple[Float32[np.ndarray, "m 3"], UInt8[np.ndarray, "m 3"]]:
    """Return voxels of twice the side: where the smaller ones lie on average, and their mean colours."""
    _, voxel, count = np.unique(np.floor_divide(index, 2), axis=0, return_inverse=True, return_counts=True)
    voxel = voxel.reshape(-1)
    columns = [np.bincount(voxel, column, len(count)) / count for column in (*points.T, *rgb.T)]
    return np.stack(columns[:3], axis=1).astype(np.float32), np.stack(columns[3:], axis=1).round().astype(np.uint8)
