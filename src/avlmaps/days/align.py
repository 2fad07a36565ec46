"""Where another map lies in this one, found without a guess: its keyframes are located here, and must agree.

Each located keyframe i votes for one rigid transform T_i = (its pose here)(its pose there)⁻¹. The transform that most
votes support wins: vote j supports i where both place keyframe j within ``agree_m`` and ``agree_rad`` of each other.
Votes are counted at keyframes that stand apart, since one thing that was carried along makes all who see it agree.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import MapError
from avlmaps.core.poses import from_rotation, inverse, mean_rotation, rotation_angle_rad
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.days.settings import AlignSettings
from avlmaps.maps.store.reader import StoredMap
from avlmaps.perception.protocols import LocalFeatures
from avlmaps.query.locate import LocateSettings, locate_features

_NEEDED = (Kind.LOCAL, Kind.PLACE, Kind.MATCHER)


class NotTheSamePlaceError(MapError):
    """Another map does not lie in this one, as far as its pictures and its surfaces say."""


@dataclass(frozen=True, slots=True)
class Votes:
    """What the keyframes of another map say of where it lies in this one.

    Attributes:
        map_from_other: (v, 4, 4) the transform of each located keyframe.
        camera: (v, 4, 4) pose of each, in the other map's world.
        tried: how many keyframes were located or not.
    """

    map_from_other: Float[np.ndarray, "v 4 4"]
    camera: Float[np.ndarray, "v 4 4"]
    tried: int

    def __len__(self) -> int:
        return len(self.map_from_other)


def require_alike(stored: StoredMap, other: StoredMap) -> None:
    """Raise ``MapError`` where two maps cannot be one: other voxels or models, or nothing to find the place by."""
    for one in (stored, other):
        if not len(one.keyframes):
            raise MapError(f"{one.path} has no keyframes, by which the place is found; build it from a recording.")
        if len(one.keyframes.clear_mm) != len(one.keyframes):
            raise MapError(
                f"{one.path} does not know where its {len(one.keyframes)} keyframes saw freely (an older avlmaps built "
                "it, or with every depth as it is), so that nobody would know what is gone; build it again."
            )
    if not np.isclose(stored.grid.voxel_size_m, other.grid.voxel_size_m, rtol=1e-9):
        raise MapError(
            f"{stored.path} has voxels of {stored.grid.voxel_size_m:g} m and {other.path} of "
            f"{other.grid.voxel_size_m:g} m; build one of them again with the other's."
        )
    for kind in Kind:
        one, two = (each.info.models.get(kind.value) for each in (stored, other))
        said = [
            ("none" if model is None else f"{model.id} ({model.checksum[:8] or 'unknown'})") for model in (one, two)
        ]
        if said[0] != said[1] and not (kind is Kind.SOUNDS and None in (one, two)):
            raise MapError(
                f"{stored.path} was built with {said[0]} for {kind.value} and {other.path} with {said[1]}; build one "
                "of them again with the other's profile."
            )
    if missing := [kind.value for kind in _NEEDED if kind.value not in stored.info.models]:
        raise MapError(f"{stored.path} was built without a model for {missing[0]}, by which the place is found; "
                       "build both maps with a profile that has one.")  # fmt: skip


def spread_out(count: int, most: int) -> Int[np.ndarray, " n"]:
    """Return numbers below ``count``, at most ``most``: any first few of them are spread over all."""
    chosen = np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
    turn = (np.arange(len(chosen)) * 0.6180339887498949) % 1.0  # the golden ratio: any prefix is even
    return chosen[np.argsort(turn)]


def gather_votes(stored: StoredMap, other: StoredMap, settings: AlignSettings, rng: np.random.Generator) -> Votes:
    """Locate keyframes of another map in this one, until enough agree."""
    for kind in _NEEDED:
        stored.require_model(kind)
    votes: list[np.ndarray] = []
    cameras: list[np.ndarray] = []
    tried = 0
    rows = spread_out(len(other.keyframes), settings.tried)
    for row in progress(rows.tolist(), "locating", total=len(rows), unit="keyframe"):
        tried += 1
        local, rgb = local_features(other, row), thumbnail(other, row)
        place = stored.encoders.place.encode(rgb, local, stored.place_state)
        found = locate_features(stored, local, place, other.rig.rgb, rng, LocateSettings(refine_focal=False))
        if found.world_from_camera is None:
            continue
        there = np.asarray(other.keyframes.world_from_camera[row], np.float64) @ inverse(other.rig.rgb_from_depth)
        votes.append(found.world_from_camera @ inverse(there))
        cameras.append(there)
        if len(votes) >= settings.enough:
            agree = supporters(np.stack(votes), np.stack(cameras), settings)
            if agree.sum() >= settings.enough and spread_m(np.stack(cameras)[agree]) >= settings.least_spread_m:
                break
    none = np.zeros((0, 4, 4))
    return Votes(np.stack(votes) if votes else none, np.stack(cameras) if cameras else none, tried)


def local_features(stored: StoredMap, row: int) -> LocalFeatures:
    """Return the keypoints of a keyframe as they were found."""
    keyframes, camera = stored.keyframes, stored.rig.rgb
    rows = slice(keyframes.offsets[row], keyframes.offsets[row + 1])
    return LocalFeatures(
        xy=np.asarray(keyframes.xy[rows]),
        descriptors=np.asarray(keyframes.descriptors[rows]).astype(np.float32),
        score=np.asarray(keyframes.score[rows]).astype(np.float32),
        size=(camera.width, camera.height),
    )


def thumbnail(stored: StoredMap, row: int) -> np.ndarray:
    """Return the picture of a keyframe, (h, w, 3) RGB, as small as the map stores it."""
    import cv2

    code = stored.keyframes.jpeg(row)
    if not len(code):
        return np.zeros((1, 1, 3), np.uint8)
    picture = cv2.imdecode(code, cv2.IMREAD_COLOR)
    return np.zeros((1, 1, 3), np.uint8) if picture is None else np.ascontiguousarray(picture[..., ::-1])


def supporters(
    votes: Float[np.ndarray, "v 4 4"], camera: Float[np.ndarray, "v 4 4"], settings: AlignSettings
) -> Bool[np.ndarray, " v"]:
    """Return which votes support the transform that most of them do; none of none."""
    if not len(votes):
        return np.zeros(0, bool)
    own = votes @ camera  # where each vote places its own camera
    best = np.zeros(len(votes), bool)
    for vote in votes:
        placed = vote @ camera
        apart_m = np.linalg.norm(placed[:, :3, 3] - own[:, :3, 3], axis=1)
        agree = (apart_m <= settings.agree_m) & (rotation_angle_rad(placed, own) <= settings.agree_rad)
        if agree.sum() > best.sum():
            best = agree
    return best


def spread_m(camera: Float[np.ndarray, "v 4 4"]) -> float:
    """Return how far apart the two farthest of some cameras stand, metres."""
    at = camera[:, :3, 3]
    return float(max((np.linalg.norm(at - one, axis=1).max() for one in at), default=0.0))


def consensus(votes: Votes, settings: AlignSettings, names: Sequence[object]) -> tuple[np.ndarray, dict[str, float]]:
    """Return map_from_other (4x4) as the agreeing votes say, and the numbers behind it.

    Raises:
        NotTheSamePlaceError: too few agree, or they stand too close together.
    """
    agree = supporters(votes.map_from_other, votes.camera, settings)
    count, apart_m = int(agree.sum()), spread_m(votes.camera[agree])
    said = f"of {votes.tried} keyframes of {names[1]} {len(votes)} were located in {names[0]}"
    enough = count >= settings.least and count >= settings.least_share * len(votes)
    if not enough:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: {said}, and {count} of them agree on where it lies; "
            f"{max(settings.least, int(np.ceil(settings.least_share * len(votes))))} must. Merge maps of one building "
            "that saw some of the same rooms."
        )
    if apart_m < settings.least_spread_m:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: {said}, and the {count} that agree stand within {apart_m:.2f} m, "
            f"where a single thing may have been recognised; {settings.least_spread_m:g} m are needed. Merge maps that "
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
    map_from_other: Float[np.ndarray, "4 4"],
    up: Float[np.ndarray, "3"],
    other_up: Float[np.ndarray, "3"],
    settings: AlignSettings,
) -> None:
    """Raise an error where a transform tips the other map over."""
    tilt_rad = float(np.arccos(np.clip(up @ (map_from_other[:3, :3] @ other_up), -1.0, 1.0)))
    if tilt_rad > settings.tilt_rad:
        raise NotTheSamePlaceError(
            f"This is not seen to be the same place: the keyframes put the other map into this one tipped by "
            f"{np.rad2deg(tilt_rad):.1f} degrees, and {np.rad2deg(settings.tilt_rad):.0f} are the most; check the up "
            "direction of both maps."
        )
