"""How far right recordings may differ from themselves, and what is beyond it; docs/recordings.md has the figures."""

import numpy as np

from avlmaps.recordings.consistency.agreement import FEWEST_POINTS, LEAST_CONTRAST, Agreement

# Share of points on the surface that the other frame sees.
LEAST_AGREEING = 0.94
IMPOSSIBLE_AGREEING = 0.70
# Where people walk by, fewer points agree, but those that do agree well: by a share of their depth.
LEAST_WITH_PEOPLE, MOST_OFF = 0.80, 0.01
# Of pairs that look one way from apart, which have the drift of a walk as well.
LEAST_AGREEING_APART = 0.75
# Share of pairs that do not agree at all, although the others do: jumps, exchanged frames.
BAD_PAIR = 0.6
BAD_OFF = 0.03
MOST_BAD_PAIRS = 0.08
# Of fewer points than are judged otherwise, hardly any may agree.
HARDLY_ANY = 0.2
# Correlation of the brightness of the same points, of all pairs and of a pair that is not one.
LEAST_LIKENESS = 0.75
BAD_LIKENESS = 0.4
IMPOSSIBLE_LIKENESS = 0.3
# Correlation of their red less blue, in pairs of which one has both exchanged; right pairs: 0.4 and more.
OPPOSITE, SURELY_OPPOSITE = -0.5, -0.8
# Nothing is said of a recording with fewer pairs or points.
FEWEST_PAIRS = 2
FEWEST_IN_ALL = 150


def can_be_judged(found: Agreement) -> bool:
    """Return whether enough pairs see the same place."""
    return found.pairs >= FEWEST_PAIRS and int(found.points.sum()) >= FEWEST_IN_ALL


def geometry_agrees(found: Agreement) -> bool:
    """Return whether nearly all points agree, or most of them do so well that the others are what moved meanwhile."""
    if bad_pairs(found) > MOST_BAD_PAIRS * found.pairs:
        return False
    known = found.off[np.isfinite(found.off)]
    moved = found.same_share >= LEAST_WITH_PEOPLE and float(np.median(known)) <= MOST_OFF
    return found.same_share >= LEAST_AGREEING or moved


def apart_agrees(found: Agreement) -> bool:
    """Return whether pairs that look one way from apart agree, as far as there are any."""
    return not can_be_judged(found) or found.same_share >= LEAST_AGREEING_APART


def bad_pairs(found: Agreement) -> int:
    """Return how many pairs hardly agree, not for somebody who stands before a part of the picture."""
    used = found.points >= FEWEST_POINTS
    return int(((found.same < BAD_PAIR * found.points) & (found.off > BAD_OFF))[used].sum())


def unlike(found: Agreement) -> bool:
    """Return whether the same points do not look alike, in all or in several pairs."""
    if not np.isfinite(found.likeness) or found.textured < FEWEST_IN_ALL or found.contrast < LEAST_CONTRAST:
        return False
    bad = int((found.alike < BAD_LIKENESS).sum())
    return found.likeness < LEAST_LIKENESS or (bad >= 2 and bad > MOST_BAD_PAIRS * np.isfinite(found.alike).sum())


def opposite_pairs(redness: Agreement) -> int:
    """Return in how many pairs red and blue are exchanged, of an agreement whose likeness is that of red less blue."""
    count = int((redness.alike < OPPOSITE).sum())
    return count if count > 1 or bool((redness.alike < SURELY_OPPOSITE).any()) else 0
