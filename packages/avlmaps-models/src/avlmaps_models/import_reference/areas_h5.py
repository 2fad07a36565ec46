"""``clip_sparse_map.h5df``: one CLIP ViT-L/14 feature for each frame, and the base pose that it was taken from."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64

from avlmaps.core import poses
from avlmaps.core.errors import MapError, RecordingError
from avlmaps_models.import_reference.hdf5 import open_hdf5

DIM = 768  # CLIP ViT-L/14's


@dataclass(frozen=True, slots=True)
class ReferenceAreas:
    """The areas as the file has them.

    Attributes:
        view: unit length; a row of zeros stays zero.
        habitat_from_body: pose of each frame, as in ``poses.txt``.
    """

    view: Float32[np.ndarray, "f 768"]
    habitat_from_body: Float64[np.ndarray, "f 4 4"]


def read_areas(path: Path) -> ReferenceAreas:
    """Read ``clip_sparse_map.h5df``.

    Raises:
        BackendError: h5py is not installed.
        MapError: the file is damaged, of another kind, or holds an invalid feature or pose.
    """
    with open_hdf5(path) as file:
        pose = file.numbers("robot_pose_list", (None, 4, 4), kinds="f").whole(np.float64)
        view = file.numbers("clip_sparse_map", (len(pose), DIM), kinds="f").whole(np.float64)
    bad = ~np.isfinite(view).all(axis=1)
    if bad.any():
        raise MapError(
            f"{path}: {int(bad.sum())} of {len(view)} features in clip_sparse_map hold NaN or infinity (the first is "
            f"{int(bad.argmax())}); let the reference code write the file again."
        )
    try:
        pose = poses.orthonormalize_all(pose, [f"{path}, robot_pose_list {row}" for row in range(len(pose))])
    except RecordingError as fault:
        raise MapError(str(fault)) from None
    norm = np.linalg.norm(view, axis=1, keepdims=True)
    unit = np.divide(view, norm, out=np.zeros_like(view), where=norm > 0.0)
    return ReferenceAreas(unit.astype(np.float32), pose)
