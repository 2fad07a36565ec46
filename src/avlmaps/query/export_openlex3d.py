"""A map as the files that the evaluator of OpenLex3D reads, dense: a point and a feature for each voxel.

``embeddings.npy`` (n, d), ``index.npy`` (n,) with the feature of each point, and ``point_cloud.pcd``. The evaluator
compares features with those of its own text model, so that the map's must be of that model (a CLIP of a profile on
torch); it also wants the positions of its dataset, so that the frame is the recording's.
"""

import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float32, UInt8
from avlmaps.core.errors import QueryError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.query.export import explain_write_errors

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

FILES = ("embeddings.npy", "index.npy", "point_cloud.pcd")


def write_openlex3d(folder: Path, opened: "AVLMap") -> tuple[Path, ...]:
    """Write the three files; voxels without a feature are left out.

    Raises:
        QueryError: no voxel has a feature, or a file cannot be written.
    """
    voxels = opened.stored.voxels
    rows = np.flatnonzero(np.asarray(voxels.weight) > 0.0)
    if not len(rows):
        raise QueryError("No voxel of the map has a feature, so that there is nothing to evaluate.")
    contents = (
        _npy(np.asarray(voxels.feature[rows], np.float32)),
        _npy(np.arange(len(rows), dtype=np.int64)),
        pcd_bytes(opened.points[rows].astype(np.float32), opened.colors[rows]),
    )
    for name, content in zip(FILES, contents, strict=True):
        with explain_write_errors(folder / name):
            write_bytes_atomically(folder / name, content)
    return tuple(folder / name for name in FILES)


def pcd_bytes(points: Float32[np.ndarray, "n 3"], colors: UInt8[np.ndarray, "n 3"]) -> bytes:
    """Return a binary PCD file (version 0.7 of its public description) of points with colours, metres.

    A colour is four bytes blue, green, red, 0 that are declared as a float.
    """
    rows = np.zeros(len(points), np.dtype([("xyz", "<f4", 3), ("bgr0", "u1", 4)]))
    rows["xyz"] = points
    rows["bgr0"][:, :3] = colors[:, ::-1]
    header = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS x y z rgb",
        "SIZE 4 4 4 4",
        "TYPE F F F F",
        "COUNT 1 1 1 1",
        f"WIDTH {len(rows)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(rows)}",
        "DATA binary",
        "",
    ]
    return "\n".join(header).encode("ascii") + rows.tobytes()


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()
