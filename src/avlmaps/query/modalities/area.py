"""Where a kind of area is: keyframes whose view is closer to its name than to those of other areas."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Float32, Int

from avlmaps.core.lexicon import Kind, lexicon
from avlmaps.core.question import Part
from avlmaps.maps.types import Keyframes
from avlmaps.perception.protocols import NamedViewEncoder, ScaledEncoder, ViewEncoder
from avlmaps.query.factors import FOUND_AT, HeatSettings, NearAnchors, stretch_scores
from avlmaps.query.unknown_names import unknown_note
from avlmaps.query.voxel_space import Space

# Names that compete with the queried area.
AREA_NAMES = (
    "kitchen", "living room", "bedroom", "bathroom", "dining room", "office", "corridor", "staircase", "entrance hall",
    "laundry room", "storage room", "garage", "balcony", "garden", "gym", "library", "meeting room", "workshop",
    "laboratory", "classroom", "waiting area", "shop", "lounge", "children's room",
)  # fmt: skip

# For an encoder that has no scale for its cosines.
_UNKNOWN_TEMPERATURE = 0.05


@dataclass(frozen=True, slots=True)
class AreaSettings:
    """From views to heat."""

    anchor: Literal["camera", "centre"] = "centre"
    """Where a keyframe's heat falls from: the camera (the paper), or the middle of what the camera saw (things are
    found in the right place for 45 % of 191 tasks, with the camera's place for 35 %; docs/experiments.md)."""
    score: Literal["posterior", "min-max"] = "posterior"
    """``posterior`` asks how likely the name is among all area names; ``min-max`` stretches the cosines (the paper)."""
    temperature: float | None = None
    """Of the posterior: a cosine higher by this makes a name e times as likely. By default what the encoder learnt
    (1 / ``logit_scale``), and 0.05 for one without such a scale."""
    same_word_cosine: float = 0.95
    """Another name at least this close to the queried one names the same and does not compete with it. For an encoder
    with a scale it is measured from the middle of all names: its phrases lie in a cone, kitchen beside garage."""
    pool_m: float = 0.8
    """Views whose anchors are within this distance vote together (``pool_posteriors``): an odd one is outvoted. 0 takes
    each by itself, as the paper does."""
    link_m: float = 1.0
    """Keyframes closer than this to a better one belong to its area."""


def area_scores(
    view: Float32[np.ndarray, "k d"],
    encoder: ViewEncoder,
    name: str,
    settings: AreaSettings,
    places: Float[np.ndarray, "k 3"] | None = None,
) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """Return for each keyframe the posterior of the name among all area names, and its score in [0, 1].

    An encoder that distinguishes named kinds of room gives their probabilities. For one of an open vocabulary they
    are the softmax over the names that it was trained with; names that mean the queried area as well do not compete.

    The scores are the posteriors, pooled over what looked at about the same place; they are stretched and each view
    speaks for itself where the settings ask for the paper's score.

    Args:
        view: features.
        encoder: that made them.
        name: of the area.
        settings: how.
        places: what each looked at, metres; None leaves every view for itself.
    """
    if isinstance(encoder, NamedViewEncoder):
        share = np.square(np.asarray(view, np.float64).reshape(-1, encoder.codes.shape[1]) @ encoder.codes.T)
        name_weights = np.asarray(encoder.name_weights(name), np.float64)
        raw = np.clip(share @ name_weights, 0.0, 1.0)
    else:
        others = [area for area in AREA_NAMES if not same_place(area, name)]
        words = np.asarray(encoder.encode_words([name, *others]), np.float64)
        apart = words - words.mean(axis=0) if isinstance(encoder, ScaledEncoder) else words
        competes = np.r_[True, _cosine(apart[1:], apart[0]) < settings.same_word_cosine]
        cosine = np.asarray(view, np.float64).reshape(-1, words.shape[1]) @ words[competes].T
        logits = cosine / _temperature(encoder, settings)
        weight = np.exp(logits - logits.max(axis=1, keepdims=True, initial=-np.inf))
        share, name_weights, raw = (
            weight / weight.sum(axis=1, keepdims=True),
            np.eye(1, weight.shape[1])[0],
            cosine[:, 0],
        )
    posterior = np.clip(share @ name_weights, 0.0, 1.0)
    if settings.score == "min-max":
        return posterior, stretch_scores(raw)
    if places is None or not settings.pool_m > 0.0 or not len(share):
        return posterior, posterior
    return posterior, np.clip(pool_posteriors(share, places, settings.pool_m) @ name_weights, 0.0, 1.0)


def area_distribution(
    view: Float32[np.ndarray, "k d"],
    encoder: ViewEncoder,
    names: Sequence[str],
    settings: AreaSettings,
    places: Float[np.ndarray, "k 3"],
) -> Float[np.ndarray, "k n"]:
    """Return for each keyframe how likely each kind of area is; rows add up to 1.

    Args:
        view: features.
        encoder: that made them.
        names: kinds of area; those of the encoder, where it has names of its own.
        settings: temperature and pooling.
        places: middle of what each keyframe saw, metres.
    """
    view = np.asarray(view, np.float64)
    if isinstance(encoder, NamedViewEncoder):
        share = np.square(view.reshape(-1, encoder.codes.shape[1]) @ encoder.codes.T)
    else:
        words = np.asarray(encoder.encode_words(list(names)), np.float64)
        logits = view.reshape(-1, words.shape[1]) @ words.T / _temperature(encoder, settings)
        share = np.exp(logits - logits.max(axis=1, keepdims=True, initial=-np.inf))
    share = share / np.maximum(share.sum(axis=1, keepdims=True), 1e-12)
    return pool_posteriors(share, places, settings.pool_m) if settings.pool_m > 0.0 and len(share) else share


def pool_posteriors(
    share: Float[np.ndarray, "k n"], places: Float[np.ndarray, "k 3"], pool_m: float
) -> Float[np.ndarray, "k n"]:
    """Return the scores of views pooled with those that looked at about the same place.

    That is their mean, weighted by exp(−d² / 2·pool_m²), d the 3D distance: one odd view is outvoted. An average is
    less confident than views that agree should be; so, where the weights add up to two views or more, it is squared and
    rescaled, the product of two independent views that say the same. A lone view stays as it is.

    Args:
        share: distributions over names.
        places: what each view looked at, metres.
        pool_m: over 0.
    """
    from scipy.sparse import csr_array
    from scipy.spatial import KDTree

    tree = KDTree(places)
    near = tree.sparse_distance_matrix(tree, 3.0 * pool_m, output_type="coo_matrix")
    weight = np.exp(-np.square(near.data) / (2.0 * pool_m**2))
    total = csr_array((weight, (near.row, near.col)), shape=near.shape) @ np.c_[share, np.ones(len(share))]
    mean, views = total[:, :-1] / total[:, -1:], total[:, -1:]
    sharp = mean ** np.clip(views, 1.0, 2.0)
    return sharp * (mean.sum(axis=1, keepdims=True) / np.maximum(sharp.sum(axis=1, keepdims=True), 1e-12))


def same_place(area: str, asked: str) -> bool:
    """Return whether an area's name and a wanted phrase mean the same kind of place, or the phrase one such place.

    A "large kitchen" is a kitchen: the bare name would beat the phrase wherever it is right. The lexicon says which
    names mean the same: the features of two words of one sense lie as far apart as kitchen and dining room for some
    models.
    """
    words = " ".join(word for word in asked.casefold().split() if word not in ("a", "an", "the"))
    known, name = lexicon(), area.casefold()
    if name == words or words.endswith(f" {name}"):
        return True
    ours, theirs = known.senses(name, Kind.ROOM), known.senses(words, Kind.ROOM)
    if any(entry in theirs for entry in ours):
        return True
    return any(
        not wide.generic and wide in theirs for entry in ours for wide in known.wider(entry.name, Kind.ROOM)
    ) or any(wide in ours for entry in theirs for wide in known.wider(entry.name, Kind.ROOM))


def _cosine(rows: Float[np.ndarray, "n d"], row: Float[np.ndarray, " d"]) -> Float[np.ndarray, " n"]:
    """Return the cosine of each row with one; 0 where either is zero."""
    return rows @ row / np.maximum(np.linalg.norm(rows, axis=1) * np.linalg.norm(row), 1e-12)


def _temperature(encoder: ViewEncoder, settings: AreaSettings) -> float:
    if settings.temperature is not None:
        return settings.temperature
    return 1.0 / encoder.logit_scale if isinstance(encoder, ScaledEncoder) else _UNKNOWN_TEMPERATURE


def modes(points: Float[np.ndarray, "a 2"], score: Float[np.ndarray, " a"], link_m: float) -> Int[np.ndarray, " a"]:
    """Group anchors round the local maxima of their score: each follows its best neighbour uphill (quick shift).

    Args:
        points: horizontal, metres.
        score: one for each.
        link_m: how far a neighbour may be.

    Returns:
        The number of the group of each anchor, the best group first.
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
    space: Space, keyframes: Keyframes, encoder: ViewEncoder, part: Part, settings: AreaSettings, heat: HeatSettings
) -> NearAnchors:
    """Return the heat of an area: one anchor a keyframe."""
    places = keyframes.world_from_camera[:, :3, 3] if settings.anchor == "camera" else keyframes.centre
    anchors = np.asarray(places, np.float64).reshape(-1, 3)
    posterior, scores = area_scores(np.asarray(keyframes.view), encoder, part.query, settings, anchors)
    best = float(posterior.max(initial=0.0))
    missed = f"no view is like {part.query!r}; the best score is {best:.2f}, below {FOUND_AT:.2f}"
    note = "" if best >= FOUND_AT else missed
    if isinstance(encoder, NamedViewEncoder) and not encoder.name_weights(part.query).any():
        note = f"{unknown_note(part.query, Kind.ROOM)}; it knows: {', '.join(encoder.names)}"
    if not len(keyframes):
        note = "the map holds no keyframes"
    group = modes(space.level(anchors)[:, :2], scores, settings.link_m)
    falloff = heat.falloff_per_m(part.role)
    return NearAnchors(space, part, falloff, anchors, scores, group, best >= FOUND_AT, part.query, note)
