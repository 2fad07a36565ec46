"""A map for other programs: point clouds and meshes, occupancy grids and tables, which name their frame, metres."""

import csv
import io
from collections.abc import Generator, Iterable, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float32, Int, UInt8
from avlmaps.core.errors import QueryError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.poses import FrameName
from avlmaps.core.progress import say
from avlmaps.perception.embedded.colours import COLOURS, example_of

if TYPE_CHECKING:
    from avlmaps.maps.obstacles import Obstacles
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Thing
    from avlmaps.query.schema import ListedThing, SoundAnswer
    from avlmaps.query.voxel_space import Space

# Gray values of Nav2's map_server for mode "trinary".
_OCCUPIED, _FREE, _UNKNOWN = 0, 254, 205
# Columns of a table of things and sounds that hold numbers of millimetres, and those that only some maps have.
_NUMBERS = ("confidence", "x_m", "y_m", "z_m", "size_x_m", "size_y_m", "size_z_m")
_ENDS = ("storey", "room", "distance_m")
# The six faces of a voxel: the neighbour behind each, and its corners counter-clockwise from outside.
_FACES = (
    ((1, 0, 0), ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1))),
    ((-1, 0, 0), ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0))),
    ((0, 1, 0), ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0))),
    ((0, -1, 0), ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1))),
    ((0, 0, 1), ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))),
    ((0, 0, -1), ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0))),
)


def thing_colors(count: int, things: "Sequence[Thing]") -> UInt8[np.ndarray, "n 3"]:
    """Return a colour for each voxel: one for each name, gray where no thing is."""
    colors = np.full((count, 3), 170, np.uint8)
    names = sorted({thing.name for thing in things})
    shades = shades_of(names)
    for thing in reversed(things):  # the most confident is drawn last
        colors[thing.rows] = shades[names.index(thing.name)]
    return colors


def heat_colors(values: Float32[np.ndarray, " n"]) -> UInt8[np.ndarray, "n 3"]:
    """Return the colour of each voxel's heat, on the scale of the plots; gray where there is none."""
    from matplotlib import colormaps

    heat = np.clip(np.asarray(values, np.float64), 0.0, 1.0)
    colors = (255 * colormaps["inferno"](0.15 + 0.8 * heat)[:, :3]).round().astype(np.uint8)
    colors[heat <= 0.0] = 170
    return colors


def shades_of(names: "Sequence[str]") -> UInt8[np.ndarray, "k 3"]:
    """Return a colour for each name, as of ``palette``; that of a colour is itself."""
    shades = palette(len(names))
    for row, name in enumerate(names):
        if name in COLOURS:
            shades[row] = example_of(name)
    return shades


def palette(count: int) -> UInt8[np.ndarray, "k 3"]:
    """Return colours far apart to the eye, and from gray; the first of them are the same for any count."""
    # Each is the one of some hundred colours that lies farthest from those before it, in CIELAB.
    import cv2
    from matplotlib.colors import hsv_to_rgb

    hue, saturation, value = np.meshgrid(np.arange(36) / 36, (0.45, 0.65, 0.8), (0.6, 0.8, 0.95), indexing="ij")
    rgb = hsv_to_rgb(np.stack([hue, saturation, value], axis=-1).reshape(-1, 3)).astype(np.float32)
    lab = cv2.cvtColor(rgb[None], cv2.COLOR_RGB2LAB)[0]
    gray = cv2.cvtColor(np.full((1, 1, 3), 0.63, np.float32), cv2.COLOR_RGB2LAB)[0, 0]
    away = np.linalg.norm(lab - gray, axis=1)
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(lab - lab[chosen[-1]], axis=1))
    return (255 * rgb[chosen]).round().astype(np.uint8).reshape(-1, 3)


def write_ply(
    path: Path, space: "Space", colors: UInt8[np.ndarray, "n 3"], columns: dict[str, np.ndarray] | None = None,
    frame: FrameName = FrameName.RECORDING,
) -> Path:  # fmt: skip
    """Write the voxels as a binary PLY point cloud, with ``columns`` as float32; its head names the frame."""
    points = space.level_centres() if frame is FrameName.LEVEL else space.centres
    fields = {name: ("<f4", "float", column) for name, column in zip("xyz", points.T, strict=True)}
    fields |= {name: ("u1", "uchar", column) for name, column in zip(("red", "green", "blue"), colors.T, strict=True)}
    fields |= {name: ("<f4", "float", column) for name, column in (columns or {}).items()}
    rows = np.zeros(len(space), np.dtype([(name, kind) for name, (kind, _, _) in fields.items()]))
    for name, (_, _, column) in fields.items():
        rows[name] = column
    matrix = " ".join(f"{value:.9g}" for value in space.level_from_recording.ravel())
    described = [f"property {kind} {name}" for name, (_, kind, _) in fields.items()]
    header = ["ply", "format binary_little_endian 1.0", f"comment metres, {frame} frame",
              f"comment level_from_recording {matrix}", f"element vertex {len(rows)}", *described, "end_header",
              ""]  # fmt: skip
    return _write(path, "\n".join(header).encode("ascii") + rows.tobytes())


def voxel_mesh(
    space: "Space", colors: UInt8[np.ndarray, "n 3"]
) -> tuple[Float32[np.ndarray, "v 3"], Int[np.ndarray, "t 3"], UInt8[np.ndarray, "v 3"]]:
    """Return the outer faces of voxels as vertices, triangles and vertex colours, without those between two voxels."""
    index = np.asarray(space.index, np.int64)
    vertices: list[Float32[np.ndarray, "v 3"]] = []
    shades: list[UInt8[np.ndarray, "v 3"]] = []
    for step, corners in _FACES:
        outer = space.rows_of(index + np.array(step)) < 0
        quads = (index[outer][:, None, :] + np.array(corners)) * space.grid.voxel_size_m
        vertices.append(quads.reshape(-1, 3).astype(np.float32))
        shades.append(np.repeat(colors[outer], 4, axis=0))
    every = np.concatenate(vertices) if vertices else np.zeros((0, 3), np.float32)
    first = 4 * np.arange(len(every) // 4)[:, None]
    triangles = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return every, triangles, np.concatenate(shades)


def write_glb(
    path: Path, space: "Space", colors: UInt8[np.ndarray, "n 3"], frame: FrameName = FrameName.RECORDING
) -> Path:
    """Write the voxels as blocks into a GLB file (level: its y up, as viewers expect); ``extras`` name the frame."""
    import trimesh
    from trimesh.exchange.gltf import export_glb  # pyright: ignore[reportUnknownVariableType]

    if not len(space):
        raise QueryError("The map holds no voxels, so that there is no mesh to export.")
    vertices, triangles, shades = voxel_mesh(space, colors)
    if frame is FrameName.LEVEL:
        level = space.level(np.asarray(vertices, np.float64))
        vertices = np.stack([level[:, 0], level[:, 2], -level[:, 1]], axis=1).astype(np.float32)
    mesh = trimesh.Trimesh(vertices, triangles, vertex_colors=shades, process=False)
    scene = trimesh.Scene({"map": mesh})
    scene.metadata["frame"] = "level, y up" if frame is FrameName.LEVEL else str(frame)
    scene.metadata["level_from_recording"] = space.level_from_recording.round(9).tolist()
    return _write(path, bytes(export_glb(scene)))


def write_occupancy(path: Path, obstacles: "Obstacles") -> tuple[Path, Path]:
    """Write a PGM picture (level frame, first row at the largest y) and the YAML file of Nav2's ``map_server``."""
    from avlmaps.maps.obstacles import CellState

    gray = np.full(obstacles.states.shape, _UNKNOWN, np.uint8)
    gray[obstacles.states == CellState.FREE] = _FREE
    gray[obstacles.states == CellState.OCCUPIED] = _OCCUPIED
    picture = np.ascontiguousarray(gray.T[::-1])
    x, y = (float(value) for value in obstacles.origin_m)
    rotation = [[round(float(value), 9) for value in row] for row in obstacles.level_from_world]
    text = (
        f"image: {path.name}\nmode: trinary\nresolution: {obstacles.cell_size_m:g}\norigin: [{x:.6f}, {y:.6f}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        f"# Level frame, z up; the floor lies at z = {obstacles.floor_m:.3f} m. level_from_recording: {rotation}\n"
    )
    if obstacles.storeys is not None:
        text += f"# Storey {obstacles.storey} of {len(obstacles.storeys)}, counted from 0, the lowest.\n"
    described = path.with_suffix(".yaml")
    _write(path, f"P5\n{picture.shape[1]} {picture.shape[0]}\n255\n".encode("ascii") + picture.tobytes())
    return path, _write(described, text.encode("utf-8"))


def write_table(
    path: Path, things: "Iterable[ListedThing]", sounds: "Iterable[SoundAnswer]", frame: str = FrameName.RECORDING
) -> Path:
    """Write things and sounds as CSV, one row each, metres; storey, room and distance are columns at the end."""
    rows: list[dict[str, object]] = []
    for thing in things:
        numbers = (thing["confidence"], *thing["position"], *thing["size"])
        held = dict(zip(_NUMBERS, map(_millis, numbers), strict=True)) | {k: v for k, v in thing.items() if k in _ENDS}
        rows.append({"kind": "thing", "name": thing["name"], **held, "size_frame": str(FrameName.LEVEL)})
    for sound in sounds:
        named = {"name": sound["names"][0], "confidence": _millis(sound["confidences"][0])} if sound["names"] else {}
        place = dict(zip(_NUMBERS[1:4], map(_millis, sound["position"]), strict=True))
        times = {"onset_s": _millis(sound["onset_s"]), "offset_s": _millis(sound["offset_s"])}
        rows.append({"kind": "sound", **named, **place, **times, **{k: v for k, v in sound.items() if k in _ENDS}})
    ends = [key for key in _ENDS if any(key in row for row in rows)]
    text = io.StringIO()
    columns = ["kind", "name", *_NUMBERS, "onset_s", "offset_s", "frame", "size_frame", *ends]
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows({"frame": str(frame), **row} for row in rows)
    return _write(path, text.getvalue().encode("utf-8"))


def _millis(value: float) -> str:
    return f"{value:.3f}"


@contextmanager
def explain_write_errors(path: Path) -> Generator[None]:
    """Make the folder of a file that is written then, and say so; ``QueryError``: the file cannot be written.

    Only the last folder of its path is made, for a longer one that is missing is likely misspelt.
    """
    folder, is_new = path.parent, not path.parent.exists()
    try:
        folder.mkdir(exist_ok=True)
        yield
    except OSError as fault:
        if is_new:
            with suppress(OSError):  # it is empty
                folder.rmdir()
        raise QueryError(f"{path} cannot be written ({fault.strerror or fault}); choose another place.") from fault
    if is_new:
        say(f"made the folder {folder}")


def _write(path: Path, content: bytes) -> Path:
    with explain_write_errors(path):
        write_bytes_atomically(path, content)
    return path


FILES = ("embeddings.npy", "index.npy", "point_cloud.pcd")


def write_openlex3d(folder: Path, opened: "AVLMap") -> tuple[Path, ...]:
    """Write the three files, without voxels that have no feature. ``QueryError``: none has any, or of the disk."""
    voxels = opened.data.voxels
    rows = np.flatnonzero(np.asarray(voxels.weight) > 0.0)
    if not len(rows):
        raise QueryError("No voxel of the map has a feature, so that there is nothing to evaluate.")
    contents = (
        _npy(np.asarray(voxels.feature[rows], np.float32)),
        _npy(np.arange(len(rows), dtype=np.int64)),
        pcd_bytes(opened.points[rows].astype(np.float32), opened.colors[rows]),
    )
    return tuple(_write(folder / name, content) for name, content in zip(FILES, contents, strict=True))


def pcd_bytes(points: Float32[np.ndarray, "n 3"], colors: UInt8[np.ndarray, "n 3"]) -> bytes:
    """Return a binary PCD file (version 0.7 of its public description) of points with colours, metres."""
    # A colour is four bytes blue, green, red, 0 that are declared as a float.
    rows = np.zeros(len(points), np.dtype([("xyz", "<f4", 3), ("bgr0", "u1", 4)]))
    rows["xyz"] = points
    rows["bgr0"][:, :3] = colors[:, ::-1]
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\n"
        f"COUNT 1 1 1 1\nWIDTH {len(rows)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(rows)}\nDATA binary\n"
    )
    return header.encode("ascii") + rows.tobytes()


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=False)
    return stream.getvalue()
