"""The instances of all names of a large map's encoder, of which lists of things are made, stored beside it."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.maps.store.derived import Derivation
from avlmaps.query.instances import Instances, Segmentation
from avlmaps.query.stored_place import place_of
from avlmaps.query.words import Vocabulary

if TYPE_CHECKING:
    from avlmaps.maps.store.reader import StoredMap

Search = tuple[str, bool]
"""A name, and whether it stands for itself alone, without narrower ones."""
_TYPES = {
    "voxels": np.int64, "instances": np.int64, "won": np.int64, "best": np.float64,  # of each search
    "rows": np.int32, "instance": np.int32, "margin": np.float32, "score": np.float32,  # of each voxel
    "confidence": np.float32,  # of each instance
}  # fmt: skip
_OF_VOXELS = ("rows", "instance", "margin", "score")


def read_instances(place: Derivation, searches: Sequence[Search], voxels: int) -> dict[Search, Segmentation] | None:
    """Return what each search found, where that is stored."""
    arrays = place.read()
    known = None if arrays is None else _from_arrays(arrays, len(searches), voxels)
    return None if known is None else dict(zip(searches, known, strict=True))


def write_instances(
    place: Derivation, searches: Sequence[Search], find: Callable[[str, bool], Segmentation],
    watch: Callable[[str, int, int], object],
) -> dict[Search, Segmentation]:  # fmt: skip
    """Make all searches, store what they found where the folder can be written, and return it.

    ``watch`` is as of ``contents.find_things``.
    """
    known: list[Segmentation] = []
    for number, search in enumerate(searches):
        watch("things", number, len(searches))
        known.append(find(*search))
    place.write(_to_arrays(known))
    return dict(zip(searches, known, strict=True))


def place_of_instances(
    stored: "StoredMap", vocabulary: Vocabulary, searches: Sequence[Search], settings: Sequence[Any]
) -> Derivation | None:
    """Return where they are stored; None for a map in memory, or one too small to need it."""
    return place_of(stored, "instances", settings, [vocabulary.digest, list(searches)])


def _to_arrays(known: Sequence[Segmentation]) -> dict[str, np.ndarray]:
    found = [one.instances for one in known]
    columns: dict[str, Sequence[Any]] = {
        "voxels": [len(one.rows) for one in found],
        "instances": [len(one) for one in found],
        "won": [one.won for one in known],
        "best": [one.best for one in known],
    }
    arrays = {name: np.array(column, _TYPES[name]) for name, column in columns.items()}
    for name in (*_OF_VOXELS, "confidence"):
        parts = [np.asarray(getattr(one, name)) for one in found]
        arrays[name] = np.concatenate([np.zeros(0, _TYPES[name]), *parts]).astype(_TYPES[name])
    return arrays


def _from_arrays(arrays: Mapping[str, np.ndarray], searches: int, voxels: int) -> list[Segmentation] | None:
    """Return what is stored; None where the arrays are not those of this number of searches and voxels."""
    if {name: array.dtype for name, array in arrays.items()} != {name: np.dtype(kind) for name, kind in _TYPES.items()}:
        return None
    if any(array.ndim != 1 for array in arrays.values()):
        return None
    sizes, counts = arrays["voxels"], arrays["instances"]
    if not len(sizes) == len(counts) == len(arrays["won"]) == len(arrays["best"]) == searches:
        return None
    if min(sizes.min(initial=0), counts.min(initial=0)) < 0 or int(counts.sum()) != len(arrays["confidence"]):
        return None
    rows = arrays["rows"]
    if any(len(arrays[name]) != int(sizes.sum()) for name in _OF_VOXELS):
        return None
    # The numbers of voxels are taken as they are; a file that somebody made must not lead astray.
    if len(rows) and not 0 <= int(rows.min()) <= int(rows.max()) < voxels:
        return None
    known: list[Segmentation] = []
    starts, firsts = np.append(0, np.cumsum(sizes)).tolist(), np.append(0, np.cumsum(counts)).tolist()
    for number in range(searches):
        own, these = slice(starts[number], starts[number + 1]), slice(firsts[number], firsts[number + 1])
        instance, confidence = arrays["instance"][own], arrays["confidence"][these]
        held = np.bincount(instance, minlength=len(confidence)) if instance.min(initial=0) >= 0 else np.zeros(0)
        if len(held) != len(confidence) or not held.all() or not ((confidence >= 0.0) & (confidence <= 1.0)).all():
            return None
        found = Instances(rows[own], instance, arrays["margin"][own], arrays["score"][own], confidence)
        known.append(Segmentation(found, int(arrays["won"][number]), float(arrays["best"][number])))
    return known
