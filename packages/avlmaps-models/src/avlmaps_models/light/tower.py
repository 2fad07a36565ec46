"""The tower of pictures: one run gives the features of all patches and that of the whole view, which is remembered."""

from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from jaxtyping import Float32, UInt8

from avlmaps.perception.networks import Remembered, key_of
from avlmaps_models.common.picture_sizes import working_size
from avlmaps_models.light.bundle import PICTURES, Bundle


class PictureTower:
    """The network of pictures, read when the first comes.

    Args:
        bundle: the files.
    """

    def __init__(self, bundle: Bundle) -> None:
        self._bundle, self._note = bundle, bundle.manifest.pictures
        self._views = Remembered()

    def patches(self, rgb: UInt8[np.ndarray, "h w 3"]) -> Float32[np.ndarray, "hf wf d"]:
        """Return a unit vector for each patch of the working size."""
        return self._run(rgb)[0]

    def view(self, rgb: UInt8[np.ndarray, "h w 3"]) -> Float32[np.ndarray, " d"]:
        """Return a unit vector of the whole picture."""
        known = self._views.get(key_of(rgb))
        return self._run(rgb)[1] if known is None else known

    def _run(self, rgb: UInt8[np.ndarray, "h w 3"]) -> tuple[np.ndarray, np.ndarray]:
        note = self._note
        height, width = working_size(rgb.shape[0], rgb.shape[1], note.short_side, note.patch)
        rows, columns = height // note.patch, width // note.patch
        given = {
            "pixels": resized(rgb, height, width).transpose(2, 0, 1)[None],
            "rows": interpolation(note.grid, rows),
            "columns": interpolation(note.grid, columns),
        }
        patches, view = self._network.run(["patches", "view"], given)
        self._views.put(key_of(rgb), view)
        return patches.reshape(rows, columns, -1), view

    @cached_property
    def _network(self) -> Any:
        return self._bundle.session(PICTURES)


@lru_cache(maxsize=2)
def tower_of(bundle: Bundle) -> PictureTower:
    """Return the tower of a folder, the same for the encoders of patches and of views."""
    return PictureTower(bundle)


def resized(rgb: UInt8[np.ndarray, "h w 3"], height: int, width: int) -> Float32[np.ndarray, "h2 w2 3"]:
    """Return a picture of another size in [0, 1], bicubic, without aliasing."""
    from PIL import Image

    if rgb.shape[:2] != (height, width):
        rgb = np.asarray(Image.fromarray(np.ascontiguousarray(rgb)).resize((width, height), Image.Resampling.BICUBIC))
    return rgb.astype(np.float32) / np.float32(255.0)


@lru_cache(maxsize=32)
def interpolation(given: int, wanted: int) -> Float32[np.ndarray, "wanted given"]:
    """Return the weights of a linear interpolation between cells, averaging where there are fewer than before.

    As torch's ``interpolate`` with ``antialias``: a triangle round the middle of each cell, at least two cells wide.
    """
    scale = given / wanted
    reach = max(scale, 1.0)
    middle = (np.arange(wanted)[:, None] + 0.5) * scale
    cell = np.arange(given)[None, :]
    first = np.maximum((middle - reach + 0.5).astype(np.int64), 0)
    last = np.minimum((middle + reach + 0.5).astype(np.int64), given)
    weight = np.maximum(1.0 - np.abs(cell - middle + 0.5) / reach, 0.0) * ((cell >= first) & (cell < last))
    return (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32)
