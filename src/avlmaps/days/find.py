"""Where a map of another day lies in this one: found by its pictures, held against the surfaces; and a map's days.

The other map's keyframes are located here. Each located keyframe i votes for one rigid transform T_i = (its pose
here)(its pose there)⁻¹. The transform that most votes support wins: vote j supports i where both place keyframe j
within ``AGREE_M`` and ``AGREE_RAD`` of each other. The agreeing keyframes must stand apart, since one thing that was
carried along makes all who see it agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import MapError
from avlmaps.core.poses import apply, from_rotation, inverse, mean_rotation, rotation_angle_rad
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.core.timeline import is_in_future
from avlmaps.days.evidence import THROUGH_VIEWS, DayViews
from avlmaps.days.surfaces import Occupied, refine
from avlmaps.maps.keyframes import local_features
from avlmaps.maps.store.manifest import RecordingInfo, Visit
from avlmaps.perception.protocols import LocalFeatures
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.locate import LocatableMap, LocateSettings, locate_features
from avlmaps.recordings.types import Recording

MOST_TRIED = 60  # keyframes of the other map that are located, spread over its walk
ENOUGH = 16  # this number that agree is enough
LEAST_AGREEING = 5  # one thing that stands in two homes can place some keyframes beside each other
LEAST_SPREAD_M = 1.5  # the agreeing keyframes stand this far apart, so that no single thing made them agree
LEAST_SHARE = 0.4  # this part of the located keyframes must agree
AGREE_M, AGREE_RAD = 0.3, float(np.deg2rad(4.0))
# Surfaces refine the transform where the agreeing keyframes scatter by more than this part of a voxel. A voxel knows no
# better where in it its surface lies: measured, votes that scatter less are right within 3 mm, and laying surface on
# surface would cost 1.5 cm.
REFINE_FROM = 0.5
MOST_TILT_RAD = float(np.deg2rad(5.0))  # between the up directions of both maps
# Of the surface of the other map that the first one looked at, this part lies on its surface and not where it saw
# through. Changed things cost some percent; a wrong place leaves less than half.
LEAST_AGREEMENT = 0.75
LEAST_LOOKED = 1000  # voxels of the other map that the first one looked at: fewer prove nothing

NEEDED = (Kind.LOCAL, Kind.PLACE, Kind.MATCHER)


class NotTheSamePlaceError(MapError):
    """Another map does not lie in this one, as far as its pictures and its surfaces say."""


@dataclass(frozen=True, slots=True)
class Votes:
    """What the located keyframes of another map say of where it lies here; ``camera`` is each one's pose there."""

    map_from_other: Float[np.ndarray, "v 4 4"]
    camera: Float[np.ndarray, "v 4 4"]
    tried: int

    def __len__(self) -> int:
        return len(self.map_from_other)


def require_alike(avlmap: AVLMap, other: AVLMap) -> None:
    """Raise ``MapError`` where two maps cannot be one: other voxels or models, or nothing to find the place by."""
    for one in (avlmap, other):
        if not len(one.data.keyframes):
            raise MapError(f"{one.path} has no keyframes, by which the place is found; build it from a recording.")
        if len(one.data.keyframes.clear_mm) != len(one.data.keyframes):
            raise MapError(
                f"{one.path} does not know where its {len(one.data.keyframes)} keyframes saw freely (an older avlmaps "
                "built it, or with every depth as it is), so that nobody would know what is gone; build it again."
            )
    if not np.isclose(avlmap.data.grid.voxel_size_m, other.data.grid.voxel_size_m, rtol=1e-9):
        raise MapError(
            f"{avlmap.path} has voxels of {avlmap.data.grid.voxel_size_m:g} m and {other.path} of "
            f"{other.data.grid.voxel_size_m:g} m; build one of them again with the other's."
        )
    for kind in Kind:
        one, two = (each.data.info.models.get(kind.value) for each in (avlmap, other))
        said = [
            ("none" if model is None else f"{model.id} ({model.checksum[:8] or 'unknown'})") for model in (one, two)
        ]
        if said[0] != said[1] and not (kind is Kind.SOUNDS and None in (one, two)):
            raise MapError(
                f"{avlmap.path} was built with {said[0]} for {kind.value} and {other.path} with {said[1]}; build one "
                "of them again with the other's profile."
            )
    if missing := [kind.value for kind in NEEDED if kind.value not in avlmap.data.info.models]:
        raise MapError(f"{avlmap.path} was built without a model for {missing[0]}, by which the place is found; "
                       "build both maps with a profile that has one.")  # fmt: skip


def spread_out(count: int, most: int) -> Int[np.ndarray, " n"]:
    """Return numbers below ``count``, at most ``most``: any first few of them are spread over all."""
    chosen = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
    turn = (np.arange(len(chosen)) * 0.6180339887498949) % 1.0  # the golden ratio: any prefix is even
    return chosen[np.argsort(turn)]


def gather_votes(avlmap: AVLMap, other: AVLMap, rng: np.random.Generator) -> Votes:
    """Locate keyframes of another map in this one, until enough agree."""
    for kind in NEEDED:
        avlmap.require_model(kind)
    here, chosen = LocatableMap.of(avlmap), LocateSettings(refine_focal=False)
    votes: list[np.ndarray] = []
    cameras: list[np.ndarray] = []
    tried = 0
    rows = spread_out(len(other.data.keyframes), MOST_TRIED)
    for row in progress(rows.tolist(), "locating", total=len(rows), unit="keyframe"):
        tried += 1
        local, rgb = features_of(other, row), thumbnail(other, row)
        place = avlmap.encoders.place.encode(rgb, local, avlmap.data.place_state)
        found = locate_features(here, local, place, other.data.rig.rgb, rng, chosen)
        if found.world_from_camera is None:
            continue
        depth = np.asarray(other.data.keyframes.world_from_camera[row], np.float64)
        there = depth @ inverse(other.data.rig.rgb_from_depth)
        votes.append(found.world_from_camera @ inverse(there))
        cameras.append(there)
        if len(votes) >= ENOUGH:
            agree = supporters(np.array(votes), np.array(cameras))
            if agree.sum() >= ENOUGH and spread_m(np.array(cameras)[agree]) >= LEAST_SPREAD_M:
                break
    return Votes(np.array(votes).reshape(-1, 4, 4), np.array(cameras).reshape(-1, 4, 4), tried)


def features_of(avlmap: AVLMap, row: int) -> LocalFeatures:
    """Return the keypoints of a keyframe as they were found."""
    camera = avlmap.data.rig.rgb
    return local_features(avlmap.data.keyframes, row, (camera.width, camera.height))


def thumbnail(avlmap: AVLMap, row: int) -> np.ndarray:
    """Return the picture of a keyframe, (h, w, 3) RGB, as small as the map stores it."""
    import cv2

    code = avlmap.data.keyframes.jpeg(row)
    if not len(code):
        return np.zeros((1, 1, 3), np.uint8)
    picture = cv2.imdecode(code, cv2.IMREAD_COLOR)
    return np.zeros((1, 1, 3), np.uint8) if picture is None else np.ascontiguousarray(picture[..., ::-1])


def supporters(votes: Float[np.ndarray, "v 4 4"], camera: Float[np.ndarray, "v 4 4"]) -> Bool[np.ndarray, " v"]:
    """Return which votes support the transform that most of them do; none of none."""
    if not len(votes):
        return np.zeros(0, bool)
    own = votes @ camera  # where each vote places its own camera
    best = np.zeros(len(votes), bool)
    for vote in votes:
        placed = vote @ camera
        apart_m = np.linalg.norm(placed[:, :3, 3] - own[:, :3, 3], axis=1)
        agree = (apart_m <= AGREE_M) & (rotation_angle_rad(placed, own) <= AGREE_RAD)
        if agree.sum() > best.sum():
            best = agree
    return best


def spread_m(camera: Float[np.ndarray, "v 4 4"]) -> float:
    """Return how far apart the two farthest of some cameras stand, metres."""
    at = camera[:, :3, 3]
    return float(max((np.linalg.norm(at - one, axis=1).max() for one in at), default=0.0))


def consensus(votes: Votes, names: Sequence[object]) -> tuple[np.ndarray, dict[str, float]]:
    """Return map_from_other (4x4) as the agreeing votes say, and the numbers behind it.

    ``NotTheSamePlaceError``: too few agree, or they stand too close together.
    """
    agree = supporters(votes.map_from_other, votes.camera)
    count, apart_m = int(agree.sum()), spread_m(votes.camera[agree])
    said = f"of {votes.tried} keyframes of {names[1]} {len(votes)} were located in {names[0]}"
    enough = count >= LEAST_AGREEING and count >= LEAST_SHARE * len(votes)
    if not enough:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: {said}, and {count} of them agree on where it lies; "
            f"{max(LEAST_AGREEING, int(np.ceil(LEAST_SHARE * len(votes))))} must. Merge maps of one building "
            "that saw some of the same rooms."
        )
    if apart_m < LEAST_SPREAD_M:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: {said}, and the {count} that agree stand within {apart_m:.2f} m, "
            f"where a single thing may have been recognised; {LEAST_SPREAD_M:g} m are needed. Merge maps that "
            "saw more of the same rooms."
        )
    found = mean_transform(votes.map_from_other[agree], votes.camera[agree])
    placed = (votes.map_from_other[agree] @ votes.camera[agree])[:, :3, 3]
    off_m = float(np.median(np.linalg.norm((found @ votes.camera[agree])[:, :3, 3] - placed, axis=1)))
    return found, {
        "votes_off_m": round(off_m, 4),
        "keyframes_tried": votes.tried,
        "located": len(votes),
        "agreeing": count,
        "spread_m": round(apart_m, 2),
    }


def mean_transform(votes: Float[np.ndarray, "v 4 4"], camera: Float[np.ndarray, "v 4 4"]) -> Float[np.ndarray, "4 4"]:
    """Return the transform that lies between some: the mean of the rotations, and of where it places the cameras."""
    rotation = mean_rotation(votes)
    at = camera[:, :3, 3]
    placed = np.einsum("vij,vj->vi", votes[:, :3, :3], at) + votes[:, :3, 3]
    return from_rotation(rotation, np.median(placed - at @ rotation.T, axis=0))


def require_upright(
    map_from_other: Float[np.ndarray, "4 4"], up: Float[np.ndarray, "3"], other_up: Float[np.ndarray, "3"]
) -> None:
    """Raise an error where a transform tips the other map over."""
    tilt_rad = float(np.arccos(np.clip(up @ (map_from_other[:3, :3] @ other_up), -1.0, 1.0)))
    if tilt_rad > MOST_TILT_RAD:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: the keyframes put the other map into this one tipped by "
            f"{np.rad2deg(tilt_rad):.1f} degrees, and {np.rad2deg(MOST_TILT_RAD):.0f} are the most; check the up "
            "direction of both maps."
        )


_CLOCK_S = 1e8  # later stamps count from 1970: they are a clock's
_LEAST_COMMON = 3
_IDENTITY = tuple(tuple(float(value) for value in row) for row in np.eye(4))


def find_other(
    avlmap: AVLMap, other: AVLMap, known: Occupied | None = None
) -> tuple[Float[np.ndarray, "4 4"], dict[str, float]]:
    """Return where another map lies in this one, without a guess; ``known`` are this one's voxels, where they are had.

    Raises:
        MapError: the maps have other voxels or models, or no keyframes.
        NotTheSamePlaceError: the pictures do not agree, or the surfaces contradict each other.
    """
    require_alike(avlmap, other)
    rng = np.random.default_rng(0)
    votes = gather_votes(avlmap, other, rng)
    first, checks = consensus(votes, (avlmap.path, other.path))
    require_upright(first, avlmap.data.up_in_world, other.data.up_in_world)
    grid = avlmap.data.grid
    points, others = (grid.centre_of(np.asarray(one.data.voxels.index)) for one in (avlmap, other))
    fine = first
    if checks["votes_off_m"] > REFINE_FROM * grid.voxel_size_m:
        fine, off_m = refine(points, others, first, rng)
        checks["surface_off_m"] = round(off_m, 4)
    known = known or Occupied.of(np.asarray(avlmap.data.voxels.index), grid)
    # How much of the other map's surface lies on this one's, of what this one looked at.
    others = apply(fine, others)
    on_surface, index = known.near(others), grid.index_of(others)
    free = np.sum([views.through(index, grid) for views in views_of(avlmap)], axis=0)
    through = (free >= THROUGH_VIEWS) & ~on_surface
    looked = int(on_surface.sum() + through.sum())
    share = float(on_surface.sum() / max(looked, 1))
    if looked < LEAST_LOOKED or share < LEAST_AGREEMENT:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: of {looked} voxels of {other.path} where {avlmap.path} looked, "
            f"{share:.0%} lie on its surface and the others where it saw through; {LEAST_AGREEMENT:.0%} of at "
            f"least {LEAST_LOOKED} must. Merge maps of one building that saw some of the same rooms."
        )
    return fine, {**checks, "looked": looked, "agreement": round(share, 4)}


def visits_of(avlmap: AVLMap) -> tuple[Visit, ...]:
    """Return the days of a map: the one of its recording, where it was not merged."""
    info = avlmap.data.info
    if info.visits:
        return info.visits
    stamps = np.asarray(avlmap.data.keyframes.stamp_s)
    begin = float(stamps.min(initial=np.inf)) if len(stamps) else 0.0
    seen = np.asarray(avlmap.data.voxels.last_seen_s)
    begin = min(begin, float(seen.min(initial=begin)))
    end = max(float(stamps.max(initial=begin)), float(seen.max(initial=begin)))
    at_s = clock_s(info.recording, begin)
    day = "" if at_s is None else datetime.fromtimestamp(at_s, UTC).date().isoformat()
    return (
        Visit(
            day=day, recording=info.recording, begin_s=begin, end_s=end, shift_s=0.0, map_from_recording=_IDENTITY,  # pyright: ignore[reportArgumentType]
            rig=info.rig, frames=info.counts.frames,
        ),
    )  # fmt: skip


def clock_s(recording: RecordingInfo | Recording, stamp_s: float) -> float | None:
    """Return when a stamp of a recording was, seconds since 1970; None where no right clock said it."""
    at_s = recording.begins_s + stamp_s
    return at_s if at_s > _CLOCK_S and not is_in_future(at_s) else None


def require_another_drive(avlmap: AVLMap, other: AVLMap, visits: Sequence[Visit]) -> None:
    """Raise ``MapError`` where the other map is of a drive that is one of the visits.

    Its recording says so, or, where it was read in another way or while it was driven, its keyframes: no two drives
    have the same pictures at the same stamps.
    """
    keyframes, others = avlmap.data.keyframes, other.data.keyframes
    number = visit_of_stamps(visits, np.asarray(keyframes.stamp_s))
    for count, visit in enumerate(visits):
        rows = np.flatnonzero(number == count)
        stamps = np.round(np.asarray(keyframes.stamp_s)[rows] - visit.shift_s, 4)
        _, here, there = np.intersect1d(stamps, np.round(np.asarray(others.stamp_s), 4), return_indices=True)
        same = len(here) >= _LEAST_COMMON and all(
            np.array_equal(keyframes.jpeg(int(rows[a])), others.jpeg(int(b))) for a, b in zip(here, there, strict=True)
        )
        if same or visit.recording.fingerprint == other.data.info.recording.fingerprint:
            raise MapError(
                f"{other.path} is of the same drive as visit {count + 1} of {avlmap.path} "
                f"({visit.recording.name}{', ' + visit.day if visit.day else ''}), and one drive counts once; "
                "merge the map of another drive."
            )


def views_of(avlmap: AVLMap) -> list[DayViews]:
    """Return what the keyframes of each visit saw freely, in the map's world."""
    keyframes, visits, out = avlmap.data.keyframes, visits_of(avlmap), list[DayViews]()
    number = visit_of_stamps(visits, np.asarray(keyframes.stamp_s))
    for visit, one in enumerate(visits):
        own = np.flatnonzero(number == visit)
        pose = np.asarray(keyframes.world_from_camera, np.float64)[own]
        out.append(DayViews(np.asarray(keyframes.clear_mm)[own], pose, one.rig.depth))
    return out


def visit_of_stamps(visits: Sequence[Visit], stamps_s: Float[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
    """Return the number of the visit that each stamp lies in."""
    begins = np.array([visit.begin_s for visit in visits])
    return np.clip(np.searchsorted(begins, stamps_s + 1e-6, side="right") - 1, 0, len(visits) - 1)
