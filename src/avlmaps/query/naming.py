"""What a voxel is taken for: the likeliest names, and which keyframes saw it."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.registry import Kind
from avlmaps.perception.protocols import NamedPixelEncoder, ScaledEncoder
from avlmaps.query.words import encoded_words

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.voxel_space import Space
    from avlmaps.query.words import ClosestWords

_CHUNK = 1 << 14
_NEAR_M, _FAR_M = 0.1, 8.0  # from how far a keyframe counts as having seen a voxel
_OWN_VOXELS = 1.5  # a ray ends this far before the voxel itself, in voxels


class VoxelNamer:
    """Names voxels by the pixel encoder's vocabulary.

    Attributes:
        names: what it distinguishes.
        calibrated: whether confidences are probabilities; else they are cosines.
    """

    def __init__(self, stored: "AVLMap", vocabulary: Sequence[str] | None = None) -> None:
        """Take the encoder's names, or a vocabulary for one that has none of its own.

        ``BackendError``: the map's profile has no pixel encoder. ``MapError``: the map was built with another encoder
        than is installed.
        """
        self._voxels = stored.data.voxels
        encoder = stored.encoders.pixels
        stored.require_model(Kind.PIXELS)
        self._named = isinstance(encoder, NamedPixelEncoder)
        self._scale = float(encoder.logit_scale) if isinstance(encoder, ScaledEncoder) and not self._named else None
        if isinstance(encoder, NamedPixelEncoder):
            names, features = encoder.names, np.asarray(encoder.codes, np.float32)
        else:
            names = tuple(encoder.vocabulary if vocabulary is None else vocabulary)
            features = encoded_words(encoder, names) if names else np.zeros((0, 0), np.float32)
        known = np.any(features != 0.0, axis=1) if len(names) else np.zeros(0, bool)
        self.names = tuple(name for name, is_known in zip(names, known, strict=True) if is_known)
        self._columns = np.ascontiguousarray(features[known].T)
        self.calibrated = self._named or self._scale is not None

    def confidences(self, rows: Int[np.ndarray, " m"]) -> Float32[np.ndarray, "m k"]:
        """Return how likely each voxel is each name; all zero where the map has no feature."""
        feature = np.asarray(self._voxels.feature[rows], np.float32)
        score = feature @ self._columns if len(self.names) else np.zeros((len(rows), 0), np.float32)
        if self._named:
            return np.square(np.clip(score, 0.0, 1.0))
        if self._scale is None or not len(self.names):
            return np.clip(score, 0.0, 1.0)
        raised = np.exp(self._scale * (score - score.max(axis=1, keepdims=True)))
        share = raised / raised.sum(axis=1, keepdims=True)
        share[~feature.any(axis=1)] = 0.0
        return share.astype(np.float32)

    def likeliest(self, row: int, most: int = 5) -> list[tuple[str, float]]:
        """Return the likeliest names of one voxel, best first, each with its confidence."""
        confidence = self.confidences(np.array([row]))[0]
        best = np.argsort(-confidence, kind="stable")[:most]
        return [(self.names[k], float(confidence[k])) for k in best if confidence[k] > 0.0]

    def best(
        self, rows: Int[np.ndarray, " m"] | None = None, rivals: "ClosestWords | None" = None
    ) -> tuple[Int[np.ndarray, " m"], Float32[np.ndarray, " m"]]:
        """Return for each of some voxels the number of its likeliest name (-1 for none) and its confidence.

        ``rows``: numbers of the voxels in the map; by default all.
        """
        rows = np.arange(len(self._voxels)) if rows is None else rows
        if self._named and rivals is not None and set(rivals.words) == set(self.names):
            number_of = np.array([*(self.names.index(word) for word in rivals.words), -1], np.int64)
            confidence = np.square(np.clip(rivals.best[rows], 0.0, 1.0))
            return np.where(confidence > 0.0, number_of[rivals.best_word[rows]], -1), confidence
        number, confidence = np.full(len(rows), -1, np.int64), np.zeros(len(rows), np.float32)
        for start in range(0, len(rows) if self.names else 0, _CHUNK):
            some = slice(start, start + _CHUNK)
            share = self.confidences(rows[some])
            number[some] = share.argmax(axis=1)
            confidence[some] = np.take_along_axis(share, number[some, None], axis=1)[:, 0]
        number[confidence <= 0.0] = -1
        return number, confidence


def keyframes_that_saw(stored: "AVLMap", space: "Space", row: int) -> Int[np.ndarray, " k"]:
    """Return the keyframes that had a voxel in view with nothing of the map in between, the nearest first."""
    poses = np.asarray(stored.data.keyframes.world_from_camera, np.float64)
    if not len(poses):
        return np.zeros(0, np.int64)
    point = space.centres[row]
    away = point - poses[:, :3, 3]
    at = np.einsum("kji,kj->ki", poses[:, :3, :3], away)
    distance_m = np.linalg.norm(away, axis=1)
    camera = stored.data.rig.depth
    with np.errstate(divide="ignore", invalid="ignore"):
        pixel = camera.project(at)
    inside = (at[:, 2] > _NEAR_M) & (distance_m < _FAR_M)
    inside &= np.all((pixel >= 0) & (pixel <= [camera.width, camera.height]), axis=1)
    candidates = np.flatnonzero(inside)
    seen = [k for k in candidates if _is_free(space, poses[k, :3, 3], point)]
    return np.array(sorted(seen, key=lambda k: float(distance_m[k])), np.int64)


def _is_free(space: "Space", start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]) -> bool:
    voxel_m = space.grid.voxel_size_m
    whole_m = float(np.linalg.norm(end - start))
    if whole_m <= _OWN_VOXELS * voxel_m:
        return True
    along = np.arange(0.5 * voxel_m, whole_m - _OWN_VOXELS * voxel_m, 0.5 * voxel_m)[:, None] / whole_m
    return not space.holds(np.floor((start + along * (end - start)) / voxel_m).astype(np.int64)).any()
