"""Fitting the weights: the likelihood of a product of logistic functions."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize
from training.found.rows import Row, balanced

from avlmaps.query.goals import FACTORS, factors_of, probability_of

COLUMNS = tuple(name for factor in FACTORS for name in (f"{factor}_bias", factor))
# The ridge draws a number's weight towards 1, and a bias towards 2: most of what is likely passes.
_RIDGE = 1.0
_START = np.array([2.0 if name.endswith("_bias") else 1.0 for name in COLUMNS])
_BOUNDS = [(-6.0, 6.0) if name.endswith("_bias") else (0.0, 6.0) for name in COLUMNS]
Weights = dict[str, float]


def fitted(rows: Sequence[Row]) -> Weights:
    """Return the weights of the largest likelihood, less the ridge; rows of one part say nothing about them."""
    rows = [row for row in rows if row.evidence.context]
    right, weight = np.array([row.right for row in rows], float), balanced(rows)
    designs = [_design(rows, factor) for factor in FACTORS]
    used = [np.array([factor in factors_of(row.evidence) for row in rows], float) for factor in FACTORS]
    log_most = np.log([max(row.evidence.alone, 1e-6) for row in rows])

    def loss(beta: np.ndarray) -> tuple[float, np.ndarray]:
        odds = [design @ beta for design in designs]
        log_p = -sum(on * np.logaddexp(0.0, -z) for on, z in zip(used, odds, strict=True))
        free = log_p < log_most  # the weights move no other row
        log_p = np.minimum(np.minimum(log_p, log_most), -1e-9)
        p = np.exp(log_p)
        lost = -(weight * (right * log_p + (1.0 - right) * np.log1p(-p))).sum()
        slope = -weight * free * (right - p) / (1.0 - p)
        gradient = sum(
            design.T @ (slope * on / (1.0 + np.exp(z))) for design, on, z in zip(designs, used, odds, strict=True)
        )
        apart = beta - _START
        return float(lost + 0.5 * _RIDGE * apart @ apart), gradient + _RIDGE * apart

    best = minimize(loss, _START, jac=True, method="L-BFGS-B", bounds=_BOUNDS).x
    return {column: round(float(value), 3) for column, value in zip(COLUMNS, best, strict=True)}


def _design(rows: Sequence[Row], factor: str) -> np.ndarray:
    """Return the number of a factor in its column, and 0 elsewhere."""
    design = np.zeros((len(rows), len(COLUMNS)))
    design[:, COLUMNS.index(f"{factor}_bias")] = 1.0
    design[:, COLUMNS.index(factor)] = [getattr(row.evidence, factor) for row in rows]
    return design


def probabilities(rows: Sequence[Row], weights: Weights) -> np.ndarray:
    """Return the probability of each row under some weights."""
    return np.array([probability_of(row.evidence, weights) for row in rows])


def held_out(rows: Sequence[Row]) -> np.ndarray:
    """Return the probability of each row under the weights that the other scenes give."""
    scenes = np.array([row.scene for row in rows])
    out = np.zeros(len(rows))
    for scene in sorted(set(scenes.tolist())):
        others = [row for row in rows if row.scene != scene]
        own = [row for row in rows if row.scene == scene]
        out[scenes == scene] = probabilities(own, fitted(others))
    return out
