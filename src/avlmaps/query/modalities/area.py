"""Where a kind of area is: keyframes whose view is closer to its name than to those of other areas, and their rooms."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Part, Role
from avlmaps.maps.types import Keyframes
from avlmaps.perception.protocols import NamedViewEncoder, ScaledEncoder, ViewEncoder
from avlmaps.query.factors import NearAnchors, stretch_scores
from avlmaps.query.rooms import InRooms, RoomField, Rooms
from avlmaps.query.settings import FOUND_AT, AreaSettings, HeatSettings
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import encoded_words, unknown_note

# Names that compete with the queried area.
AREA_NAMES = (
    "kitchen", "living room", "bedroom", "bathroom", "dining room", "office", "corridor", "staircase", "entrance hall",
    "laundry room", "storage room", "garage", "balcony", "garden", "gym", "library", "meeting room", "workshop",
    "laboratory", "classroom", "waiting area", "shop", "lounge", "children's room",
)  # fmt: skip

# For an encoder that has no scale for its cosines.
_UNKNOWN_TEMPERATURE = 0.05


@dataclass(frozen=True, slots=True)
class ViewShares:
    """How a queried name competes with others over some views."""

    kinds: tuple[str, ...]  # names that compete, the queried one among them unless the encoder has names of its own
    share: Float[np.ndarray, "k n"]  # how likely each view shows each of them; rows add up to 1
    weights: Float[np.ndarray, " n"]  # how much the query means each of them
    raw: Float[np.ndarray, " k"]  # score of the query by itself: its probability, or its cosine


def area_scores(
    view: Float32[np.ndarray, "k d"], encoder: ViewEncoder, name: str, settings: AreaSettings
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return for each keyframe the posterior of the name among all area names, and its score in [0, 1].

    The scores are the posteriors, or stretched cosines where the settings ask for the paper's score.
    """
    shares = view_shares(view, encoder, name, settings)
    posterior = np.clip(shares.share @ shares.weights, 0.0, 1.0)
    if settings.score == "min-max":
        return posterior, stretch_scores(shares.raw)
    return posterior, posterior


def view_shares(
    view: Float32[np.ndarray, "k d"], encoder: ViewEncoder, name: str, settings: AreaSettings
) -> ViewShares:
    """Return how likely each view shows the queried area and each name that competes with it."""
    if isinstance(encoder, NamedViewEncoder):
        share = _named_shares(view, encoder)
        weights = np.asarray(encoder.name_weights(name), np.float64)
        return ViewShares(encoder.names, share, weights, np.clip(share @ weights, 0.0, 1.0))
    others = [area for area in AREA_NAMES if not same_place(area, name)]
    words = encoded_words(encoder, [name, *others]).astype(np.float64)
    apart = words - (words.mean(axis=0) if isinstance(encoder, ScaledEncoder) else 0.0)
    apart /= np.maximum(np.linalg.norm(apart, axis=1, keepdims=True), 1e-6)
    competes = np.r_[True, apart[1:] @ apart[0] < settings.same_word_cosine]
    cosine = _cosines(view, words[competes])
    kinds = tuple(kind for kind, does in zip([name, *others], competes, strict=True) if does)
    return ViewShares(kinds, _softmax(cosine, encoder, settings), np.eye(1, len(kinds))[0], cosine[:, 0])


def area_names(encoder: ViewEncoder) -> tuple[str, ...]:
    """Return the kinds of area that compete where none is queried: the encoder's own, or ``AREA_NAMES``."""
    return encoder.names if isinstance(encoder, NamedViewEncoder) else AREA_NAMES


def name_shares(
    view: Float32[np.ndarray, "k d"], encoder: ViewEncoder, settings: AreaSettings
) -> Float[np.ndarray, "k n"]:
    """Return how likely each view shows each of ``area_names``; rows add up to 1."""
    if isinstance(encoder, NamedViewEncoder):
        share = _named_shares(view, encoder)
        return share / np.maximum(share.sum(axis=1, keepdims=True), 1e-12)
    words = encoded_words(encoder, AREA_NAMES).astype(np.float64)
    return _softmax(_cosines(view, words), encoder, settings)


def same_place(area: str, asked: str) -> bool:
    """Return whether an area's name and a wanted phrase mean one kind of place, or the phrase one such place.

    A "large kitchen" is a kitchen: the bare name would beat the phrase wherever it is right. The lexicon says it, as
    features of two words of one sense lie as far apart as kitchen and dining room for some models.
    """
    words = " ".join(word for word in asked.casefold().split() if word not in ("a", "an", "the"))
    known, name = lexicon(), area.casefold()
    if name == words or words.endswith(f" {name}"):
        return True
    ours, theirs = known.senses(name, EntryKind.ROOM), known.senses(words, EntryKind.ROOM)
    if any(entry in theirs for entry in ours):
        return True
    return any(
        not wide.generic and wide in theirs for entry in ours for wide in known.wider(entry.name, EntryKind.ROOM)
    ) or any(wide in ours for entry in theirs for wide in known.wider(entry.name, EntryKind.ROOM))


def _named_shares(view: Float32[np.ndarray, "k d"], encoder: NamedViewEncoder) -> Float[np.ndarray, "k n"]:
    return np.square(np.asarray(view, np.float64).reshape(-1, encoder.codes.shape[1]) @ encoder.codes.T)


def _cosines(view: Float32[np.ndarray, "k d"], words: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "k n"]:
    return np.asarray(view, np.float64).reshape(-1, words.shape[1]) @ words.T


def _softmax(
    cosine: Float[np.ndarray, "k n"], encoder: ViewEncoder, settings: AreaSettings
) -> Float[np.ndarray, "k n"]:
    logits = cosine / _temperature(encoder, settings)
    weight = np.exp(logits - logits.max(axis=1, keepdims=True, initial=-np.inf))
    return weight / weight.sum(axis=1, keepdims=True)


def _temperature(encoder: ViewEncoder, settings: AreaSettings) -> float:
    if settings.temperature is not None:
        return settings.temperature
    return 1.0 / encoder.logit_scale if isinstance(encoder, ScaledEncoder) else _UNKNOWN_TEMPERATURE


def modes(points: Float[np.ndarray, "a 2"], score: Float[np.ndarray, " a"], link_m: float) -> Int[np.ndarray, " a"]:
    """Group anchors round the local maxima of their score: each follows its best neighbour uphill (quick shift).

    ``points``: horizontal, metres. ``link_m``: how far a neighbour may be. Groups are numbered, the best one first.
    """
    from scipy.spatial import KDTree

    order = np.argsort(-score, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    group = np.empty(len(order), np.int64)
    count = 0
    near: Sequence[Sequence[int]] = KDTree(points).query_ball_point(points, link_m).tolist() if len(points) else []
    for row in order:
        uphill = [other for other in near[int(row)] if rank[other] < rank[row]]
        if uphill:
            group[row] = group[min(uphill, key=lambda other: rank[other])]
        else:
            group[row] = count
            count += 1
    return group


def area_factor(
    space: Space,
    keyframes: Keyframes,
    encoder: ViewEncoder,
    part: Part,
    settings: AreaSettings,
    heat: HeatSettings,
    rooms: Rooms | None = None,
    settled: Callable[[RoomField], RoomField] = lambda field: field,
) -> NearAnchors:
    """Return the heat of an area: one anchor a keyframe.

    As context it is how likely each place is in such an area; where the area itself is sought it falls from the places
    that look most like it, and each room is one goal. Without rooms heat falls off round every keyframe. ``settled``
    puts in the rooms that people named, behind the kinds that the encoder knows; one without a name is the room that
    the query names by its number.
    """
    anchors = area_anchors(keyframes, settings)
    view = np.asarray(keyframes.view)
    kinds: RoomField | None = None
    if rooms is None or not settings.by_room or not len(keyframes):
        posterior, scores = area_scores(view, encoder, part.query, settings)
        weights = np.zeros(0)
    else:
        shares = view_shares(view, encoder, part.query, settings)
        kinds, weights = rooms.field(shares.kinds, shares.share), shares.weights
        kinds = settled(kinds)
        named = [1.0 if same_place(kind, part.query) else 0.0 for kind in kinds.kinds[len(weights) :]]
        weights = np.concatenate([weights, named])
        if not kinds.kinds[-1]:
            weights = np.eye(1, len(kinds.kinds), len(kinds.kinds) - 1)[0]
        posterior = scores = np.clip(kinds.at(anchors) @ weights, 0.0, 1.0).astype(np.float64)
    best = float(posterior.max(initial=0.0))
    missed = f"no view is like {part.query!r}; the best score is {best:.2f}, below {FOUND_AT:.2f}"
    note = "" if best >= FOUND_AT else missed
    if isinstance(encoder, NamedViewEncoder) and not (encoder.name_weights(part.query).any() or weights.any()):
        note = f"{unknown_note(part.query, EntryKind.ROOM)}; it knows: {', '.join(encoder.names)}"
    if not len(keyframes):
        note = "the map holds no keyframes"
    group = modes(space.level(anchors)[:, :2], scores, settings.link_m)
    if kinds is not None and kinds.rooms is not None:  # however far apart the views of a room look
        room = kinds.room_of(anchors)
        group = np.unique(np.where(room >= 0, room, 1 + room.max(initial=-1) + group), return_inverse=True)[1]
    falloff, found = heat.falloff_per_m(part.role), best >= FOUND_AT
    if kinds is None or part.role is Role.PRIMARY:
        return NearAnchors(space, part, falloff, anchors, scores, group, found, part.query, note)
    return InRooms(
        space, part, falloff, anchors, scores, group, found, part.query, note, kinds=kinds, weights=weights
    )  # fmt: skip


def area_anchors(keyframes: Keyframes, settings: AreaSettings) -> Float[np.ndarray, "k 3"]:
    """Return the place that each keyframe speaks for, metres, world: of the camera, or the middle of what it saw."""
    places = keyframes.world_from_camera[:, :3, 3] if settings.anchor == "camera" else keyframes.centre
    return np.asarray(places, np.float64).reshape(-1, 3)
