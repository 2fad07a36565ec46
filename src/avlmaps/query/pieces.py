"""Which voxels that a word won belong together, and how likely each of these things is what was queried."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Bool, Float, Float16, Float32, Int
from avlmaps.perception.protocols import NamedPixelEncoder, PixelEncoder, ScaledEncoder
from avlmaps.query import loops, oversize
from avlmaps.query.instance_merging import merge_instances, without_specks
from avlmaps.query.object_settings import ObjectSettings
from avlmaps.query.synonyms import is_open
from avlmaps.query.things_in_rooms import ThingsInRooms, with_rooms
from avlmaps.query.voxel_space import Space
from avlmaps.query.words import EncodedWord, Scored, Vocabulary, scored_once


@dataclass(frozen=True, slots=True)
class Pieces:
    """The voxels that a queried word won, and the things that they make up.

    Attributes:
        rows: numbers of these voxels in the map, ascending.
        instance: which thing each of them belongs to.
        mean_probability: of each thing: the mean of its voxels' squared scores (for an encoder of names: p).
        confidence: the probability that each matches the query.
        won: how many voxels the word won before specks were left out.
        best: highest confidence before that.
    """

    rows: Int[np.ndarray, " a"]
    instance: Int[np.ndarray, " a"]
    mean_probability: Float32[np.ndarray, " i"]
    confidence: Float32[np.ndarray, " i"]
    won: int
    best: float

    def beside(self, others: "Pieces") -> "Pieces":
        """Return these things and others, which have none of their voxels."""
        rows = np.concatenate([self.rows, others.rows])
        instance = np.concatenate([self.instance + len(others.confidence), others.instance])
        order = np.argsort(rows)
        mean = np.concatenate([others.mean_probability, self.mean_probability])
        confidence = np.concatenate([others.confidence, self.confidence])
        won, best = max(self.won, others.won), max(self.best, others.best)
        return Pieces(rows[order], instance[order], mean, confidence, won, best)


def object_pieces(
    space: Space,
    feature: Float16[np.ndarray, "n d"],
    encoder: PixelEncoder,
    rivals: Vocabulary,
    encoded: EncodedWord,
    settings: ObjectSettings,
    rooms: Callable[[], ThingsInRooms | None] = lambda: None,
) -> Pieces:
    """Return the things that a word names: connected voxels that it wins, specks left out, thin parts joined."""
    scored = scored_once(feature, encoder, rivals, encoded, settings)(1.0)
    return pieces_of(space, encoder, encoded, scored, settings, rooms)


def pieces_of(
    space: Space,
    encoder: PixelEncoder,
    encoded: EncodedWord,
    scored: Scored,
    settings: ObjectSettings,
    rooms: Callable[[], ThingsInRooms | None] = lambda: None,
    beside: Pieces | None = None,
) -> Pieces:
    """Return the things that voxels with these margins and scores make up.

    With ``beside``, those stay as they are, and uncertain ones of the other voxels come after them: weak voxels round a
    confident thing make it neither larger nor less likely.
    """
    rows, margin, score = scored.rows, scored.margin, scored.score
    index = np.asarray(space.index)[rows]  # all below is of these voxels alone, however large the map
    least = settings.least_confidence if beside is None else settings.least_in_company
    longest = _longest_m(encoder, encoded, settings)

    def lengths_of(mask: Bool[np.ndarray, " m"], instance: Int[np.ndarray, " a"]) -> Float[np.ndarray, " i"]:
        return oversize.lengths_m(_points(space, index[mask]), instance, int(instance.max(initial=-1)) + 1)

    def confidence_of(
        mask: Bool[np.ndarray, " m"], instance: Int[np.ndarray, " a"], length_m: Float[np.ndarray, " i"] | None = None
    ) -> Float32[np.ndarray, " i"]:
        if isinstance(encoder, NamedPixelEncoder):
            by_looks = named_confidence(encoder, encoded, score[mask], instance, space.grid.voxel_size_m)
            if math.isfinite(longest):
                length_m = lengths_of(mask, instance) if length_m is None else length_m
                by_looks = oversize.less_likely(by_looks, length_m, longest)
            return _in_rooms(by_looks, rooms, encoded.meant(encoder), settings, rows[mask], instance)
        return instance_confidence(margin[mask], instance, space.grid.voxel_size_m, fitting(settings, encoder))

    mask = margin > 0.0
    won = int(mask.sum())
    if beside is not None:
        if isinstance(encoder, NamedPixelEncoder):
            mask |= score > np.maximum(settings.score_in_company * (score - margin), settings.least_score_in_company)
        mask &= ~np.isin(rows, beside.rows, assume_unique=True)
    instance = instances_of(space, rows[mask], settings.link_m)
    confidence = confidence_of(mask, instance)
    best = float(confidence.max(initial=0.0))
    mask, instance, confidence = without_specks(mask, instance, confidence, least)
    joined = merge_instances(_points(space, index[mask]), instance, settings.link_m, settings.join_m)
    if len(confidence) > joined.max(initial=-1) + 1:
        instance = joined[instance]
        confidence = confidence_of(mask, instance)
    if math.isfinite(longest) and len(instance):
        points, reach = _points(space, index[mask]), _reach(space, settings.link_m)
        pieces, piece_of = oversize.cut(index[mask], points, score[mask], instance, longest, reach)
        if not np.array_equal(pieces, instance):
            length_m, mask = lengths_of(mask, instance)[piece_of], mask.copy()
            mask[np.flatnonzero(mask)[pieces < 0]] = False
            instance = pieces[pieces >= 0]
            confidence = confidence_of(mask, instance, length_m)
            mask, instance, confidence = without_specks(mask, instance, confidence, least)
    mean = np.bincount(instance, weights=np.square(score[mask]), minlength=len(confidence)).astype(np.float64)
    mean /= np.maximum(np.bincount(instance, minlength=len(confidence)), 1)
    best = max(best, float(confidence.max(initial=0.0)))
    pieces = Pieces(rows[mask], instance, mean.astype(np.float32), confidence, won, best)
    return pieces if beside is None else pieces.beside(beside)


def _points(space: Space, index: Int[np.ndarray, "a 3"]) -> Float[np.ndarray, "a 3"]:
    """Return the middles of some voxels, metres, level frame."""
    return space.level(space.grid.centre_of(index))


def instances_of(
    space: Space, voxels: Bool[np.ndarray, " n"] | Int[np.ndarray, " a"], link_m: float
) -> Int[np.ndarray, " a"]:
    """Return for each of some voxels, a mask or ascending numbers, the number of the instance that it belongs to."""
    return loops.linked(np.asarray(space.index)[voxels], _reach(space, link_m))


def _reach(space: Space, link_m: float) -> int:
    """Return how many voxels apart, along each axis, two of one instance may be."""
    return max(1, round(link_m / space.grid.voxel_size_m))


def instance_confidence(
    margin: Float[np.ndarray, " a"], instance: Int[np.ndarray, " a"], voxel_size_m: float, settings: ObjectSettings
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of each instance, in [0, 1]: m / (m + m_yes) · (1 − exp(−area / area_yes)).

    m is the mean margin of its voxels, the area is a voxel's face for each of them.
    """
    count = np.bincount(instance)
    mean_margin = np.bincount(instance, weights=margin) / np.maximum(count, 1)
    clear = mean_margin / (mean_margin + settings.margin_yes)
    large = 1.0 - np.exp(-count * voxel_size_m**2 / settings.area_yes_m2)
    return (clear * large).astype(np.float32)


def named_confidence(
    encoder: NamedPixelEncoder,
    encoded: EncodedWord,
    score: Float[np.ndarray, " a"],
    instance: Int[np.ndarray, " a"],
    voxel_size_m: float,
) -> Float32[np.ndarray, " i"]:
    """Return the confidence that each instance matches the query, as the encoder was calibrated.

    A phrase that means several names has the confidence that the most meant name would have with all their probability.

    Args:
        encoder: of names.
        encoded: the word, encoded.
        score: of each voxel, √p.
        instance: which each belongs to.
        voxel_size_m: edge of a voxel.
    """
    count = np.bincount(instance)
    mean = np.bincount(instance, weights=np.square(score)) / np.maximum(count, 1)
    names = encoded.meant(encoder)
    sure = [encoder.instance_probability(name, mean, count * voxel_size_m**2) for name in names]
    nothing = np.zeros(len(count))  # of a word that names none of the encoder's names
    return np.max([nothing, *sure], axis=0).astype(np.float32)


def _longest_m(encoder: PixelEncoder, encoded: EncodedWord, settings: ObjectSettings) -> float:
    """Return the length from which an instance is too long for what is most meant, metres."""
    if not isinstance(encoder, NamedPixelEncoder) or settings.too_long <= 0.0 or not encoded.name_weights.any():
        return math.inf
    most = encoded.name_weights >= 0.99 * encoded.name_weights.max()
    return settings.too_long * oversize.longest_m([encoder.names[index] for index in np.flatnonzero(most)])


def _in_rooms(
    confidence: Float32[np.ndarray, " i"],
    rooms: Callable[[], ThingsInRooms | None],
    names: tuple[str, ...],
    settings: ObjectSettings,
    rows: Int[np.ndarray, " a"],
    instance: Int[np.ndarray, " a"],
) -> Float32[np.ndarray, " i"]:
    """Return the confidence of each instance after what its room says about things of these names."""
    evidence = rooms() if settings.room_weight > 0.0 and len(confidence) else None
    nats = None if evidence is None else evidence.nats(names, rows, instance, len(confidence))
    if nats is None:
        return confidence
    return with_rooms(confidence, settings.room_weight * nats, settings.room_cost).astype(np.float32)


def fitting(settings: ObjectSettings, encoder: PixelEncoder) -> ObjectSettings:
    """Return the settings with the margin at which an encoder is confident, in its own cosines."""
    if isinstance(encoder, ScaledEncoder) and is_open(encoder):
        return replace(settings, margin_yes=settings.margin_yes_logits / encoder.logit_scale)
    return settings
