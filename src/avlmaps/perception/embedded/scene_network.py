"""The network behind the embedded pixel and view encoders: what each pixel shows, and what kind of room it is.

It looks at geometry in the frame of gravity, and at colour, which joins later and may be finer. It runs in onnxruntime
at a small size (``Notes.width_px``), for every recording; ``training/pixels`` makes its weights. Two sets ship: one
that learnt from rendered worlds and real frames, and one that saw no NYU Depth V2 (the profile ``synthetic``).

``PairedNetworks`` looks with two networks: where they agree on what a frame shows, it is like the worlds that both
know, and the mean of the two is right more often than either. Where they do not, it is a real frame, of which the
second knows little: then the first decides. Agreement is the Bhattacharyya coefficient of their probabilities, the mean
over the frame's cells. Ensembles of networks: Hansen and Salamon, "Neural Network Ensembles", IEEE TPAMI 1990.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property
from hashlib import sha256
from itertools import product, starmap
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from avlmaps.core.arrays import Bool, Float, Float32, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError
from avlmaps.perception.networks import open_network
from avlmaps.recordings.types import Frame

CHANNELS = 8
# Normals are taken over this many pixels to each side; over one where an edge is nearer.
_REACH_PX = 3
_LARGEST_STEP = 0.06  # of the depth: a greater step between neighbours is an edge, not a surface


def channels(
    depth_m: Float32[np.ndarray, "h w"], camera: Pinhole, up_in_camera: Float[np.ndarray, "3"], camera_height_m: float
) -> Float32[np.ndarray, "8 h w"]:
    """Return the geometry of a depth picture (z, 0 where there is none): zero there, but for the last channel.

    The channels: logarithm of a pixel's size on the surface in centimetres; a quarter of the depth; height over the
    floor in metres, within −1 and 4; the surface normal along up, to the camera's right and along its heading (both
    level); 1 where there is a depth; the rise of the pixel's ray, −1 straight down to 1 straight up.
    """
    rows, columns = np.ogrid[: depth_m.shape[0], : depth_m.shape[1]]
    x, y = ((columns + 0.5 - camera.cx) / camera.fx).astype("f4"), ((rows + 0.5 - camera.cy) / camera.fy).astype("f4")
    up = np.asarray(up_in_camera, np.float32)
    known = depth_m > 0.0
    z = np.where(known, depth_m, np.float32(0.0))
    rise = up[0] * x + up[1] * y + up[2]
    out = np.zeros((CHANNELS, *depth_m.shape), np.float32)
    np.log(z * np.float32(math.exp(4.6) / (0.5 * (camera.fx + camera.fy))), out=out[0], where=known)
    np.multiply(z, np.float32(0.25), out=out[1])
    np.clip(z * rise + np.float32(camera_height_m), -1.0, 4.0, out=out[2], where=known)
    # The normal, towards the camera; zero where the neighbours are of other surfaces.
    (left, far_left), (right, far_right) = (_neighbour(z, 1, sign) for sign in (-1, 1))
    (above, far_above), (below, far_below) = (_neighbour(z, 0, sign) for sign in (-1, 1))
    across, down = right - left, below - above
    ax = x * across + (far_right * right + far_left * left) / np.float32(camera.fx)
    by = y * down + (far_below * below + far_above * above) / np.float32(camera.fy)
    ay, bx = y * across, x * down
    nx, ny, nz = by * across - down * ay, down * ax - bx * across, bx * ay - by * ax
    squared = nx * nx + ny * ny + nz * nz
    seen = known & (far_left + far_right > 0) & (far_above + far_below > 0) & (squared > 0.0)
    scale = np.zeros_like(z)
    np.divide(np.where(nx * x + ny * y + nz > 0.0, -1.0, 1.0), np.sqrt(squared), out=scale, where=seen)
    normal = nx * scale, ny * scale, nz * scale
    for channel, along in zip((3, 4, 5), (up, *level_axes(up)), strict=True):
        out[channel] = sum(part * np.float32(share) for part, share in zip(normal, along, strict=True))
    out[6] = known
    out[7] = rise / np.sqrt(x * x + y * y + 1.0)
    return out


def _neighbour(
    z: Float32[np.ndarray, "h w"], axis: int, sign: int
) -> tuple[Float32[np.ndarray, "h w"], Float32[np.ndarray, "h w"]]:
    # The depth of each pixel's farthest neighbour on one side that is of its surface, and how many pixels away that is.
    depth, reach = z.copy(), np.zeros_like(z)
    largest = np.float32(_LARGEST_STEP) * z
    for pixels in (1, _REACH_PX):  # the farther one counts
        beside = [slice(None)] * 2, [slice(None)] * 2
        beside[0][axis], beside[1][axis] = slice(pixels, None), slice(None, -pixels)
        here, there = (tuple(one) for one in (beside if sign < 0 else beside[::-1]))
        other = z[there]
        same = (other > 0.0) & (np.abs(other - z[here]) < largest[here])
        np.copyto(depth[here], other, where=same)
        np.copyto(reach[here], np.float32(pixels), where=same)
    return depth, reach


def level_axes(up_in_camera: Float[np.ndarray, "3"]) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Return the level directions to the right of the camera and ahead of it, in its own frame.

    Looking straight up or down it has no heading; then the picture's own upper edge is taken for it.
    """
    ahead = np.array([0.0, 0.0, 1.0]) if abs(up_in_camera[2]) < 0.99 else np.array([0.0, -1.0, 0.0])
    forward = ahead - up_in_camera * (up_in_camera @ ahead)
    forward /= np.linalg.norm(forward)
    return np.cross(forward, up_in_camera), forward


# Without ground a camera is taken to be upright and as high as people and robots mostly hold it.
_USUAL_HEIGHT_M = 1.3
DEFAULT_WEIGHTS: Final = "scene_encoder"
SYNTHETIC_WEIGHTS: Final = "scene_encoder_synthetic"


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How a frame is changed before the network sees it (test-time augmentation): wider, or as in a mirror."""

    scale: float = 1.0
    mirrored: bool = False


PLAIN = Augmentation()
_ACROSS = 4  # the channel of geometry that changes its sign in a mirror: the normal along right


class InstanceNotes(msgspec.Struct, frozen=True):
    """How instances are distinguished from noise, fitted on maps of held-out homes (``training/pixels/instances.py``).

    The log-odds that they are a true instance are ``bias + slopes[0]·log-odds(p) + slopes[1]·log(area / usual area)``,
    p their mean probability. ``bias`` and ``area_m2``, the usual surface of a true instance, are by category.
    """

    slopes: tuple[float, float] = (1.0, 0.8)
    bias: dict[str, float] = {}
    area_m2: dict[str, float] = {}
    default_bias: float = 0.0
    default_area_m2: float = 0.3


class Notes(msgspec.Struct, frozen=True):
    """The description of the weights beside them."""

    id: str  # the model's name and version
    note: str  # its limits, one sentence
    categories: tuple[str, ...]  # kinds of pixels, ``other`` among them
    rooms: tuple[str, ...]  # kinds of room
    bias: tuple[float, ...]  # added to the categories' scores: undoes the weights of training and calibrates
    temperature: float  # divides the categories' scores before the softmax
    room_temperature: float  # divides the rooms' scores
    called: dict[str, tuple[str, ...]]  # for a category other phrases for it
    kinds: dict[str, tuple[str, ...]]  # wider words and the categories that they take in
    width_px: int = 240  # of the pictures that it looks at; they have no longer focal length either, as in training
    instances: InstanceNotes = InstanceNotes()
    multiple: int = 16  # pictures are padded to a multiple of this
    fineness: int = 1  # how many times as wide and high as geometry the colour is
    checksum: str = ""  # of the weights and of what else makes the features; see ``checksum_of``


@dataclass(frozen=True, slots=True)
class Seen:
    """The probabilities of categories on a grid that covers the colour picture evenly, and of kinds of room.

    ``known`` says which cells have a depth.
    """

    category: Float32[np.ndarray, "h w c"]
    known: np.ndarray
    room: Float32[np.ndarray, " r"]


Inputs = tuple[dict[str, np.ndarray], Bool[np.ndarray, "h w"]]


def inputs_of(frame: Frame, augmentation: Augmentation, notes: Notes) -> Inputs:
    """Return what a network of these notes is fed, and which cells of its answer have a depth."""
    import cv2

    camera, depth_m, rgb = at_working_size(frame, round(augmentation.scale * notes.width_px), notes.fineness)
    geometry = channels(depth_m, camera, *_ground_of(frame))
    colour = rgb.astype(np.float32).transpose(2, 0, 1) / 127.5 - 1.0
    if augmentation.mirrored:
        geometry, colour = geometry[:, :, ::-1].copy(), colour[:, :, ::-1]
        geometry[_ACROSS] *= -1.0
    h, w = (depth_m.shape[0] + 1) // 2, (depth_m.shape[1] + 1) // 2
    known = cv2.resize((depth_m > 0.0).astype(np.uint8), (w, h), interpolation=cv2.INTER_AREA) > 0
    fed = {"geometry": _padded(geometry, notes.multiple), "colour": _padded(colour, notes.fineness * notes.multiple)}
    return {name: picture[None] for name, picture in fed.items()}, known


class SceneNetwork:
    """The network. Its weights are read for the first frame: a query in words needs its notes alone."""

    def __init__(self, read_weights: Callable[[], bytes], notes: Notes) -> None:
        self._read_weights = read_weights
        self.notes = notes
        self.checksum = notes.checksum
        self._bias = np.array(notes.bias, np.float32)

    @cached_property
    def _session(self) -> Any:
        weights = self._read_weights()
        try:
            return open_network(weights, most_threads=4)
        except Exception as fault:  # onnxruntime raises types of its own
            import onnxruntime

            raise BackendError(
                f"The weights of {self.notes.id} cannot be run by onnxruntime {onnxruntime.__version__} "
                f"({type(fault).__name__}); update onnxruntime, or install or train the weights again."
            ) from fault

    def see(self, frame: Frame, augmentation: Augmentation = PLAIN, inputs: Inputs | None = None) -> Seen:
        """Encode a frame, of which ``inputs`` were made before; its ``ground`` gives the up direction, if known."""
        fed, known = inputs or inputs_of(frame, augmentation, self.notes)
        score, room = (np.asarray(output) for output in self._session.run(["category", "room"], fed))
        h, w = known.shape
        category = score[0, :, :h, :w].transpose(1, 2, 0) + self._bias
        if augmentation.mirrored:
            category = category[:, ::-1]
        return Seen(_softmax(category / self.notes.temperature), known, _softmax(room[0] / self.notes.room_temperature))


@cache
def load_network(weights: str = DEFAULT_WEIGHTS) -> SceneNetwork:
    """Return a network that ships, ``DEFAULT_WEIGHTS`` or ``SYNTHETIC_WEIGHTS``; raises ``BackendError``."""
    folder = Path(__file__).with_name("weights")
    return read_network(folder, weights, "install the package again, or make them with 'python -m training.pixels'")


def read_network(folder: Path, weights: str, remedy: str) -> SceneNetwork:
    """Return the network of two files in a folder: ``WEIGHTS.onnx``, and its ``Notes``, ``WEIGHTS.json``.

    ``BackendError``, with the remedy, where the notes cannot be read; the weights are read for the first frame, and
    raise it there.
    """

    def unusable(fault: object) -> BackendError:
        return BackendError(f"The embedded pixel encoder's weights cannot be read ({fault}); {remedy}.")

    def read_weights() -> bytes:
        try:
            content = (folder / f"{weights}.onnx").read_bytes()
        except OSError as fault:
            raise unusable(fault) from fault
        if checksum_of(content, notes) != notes.checksum:
            raise unusable(f"{weights}.onnx and {weights}.json do not belong together")
        return content

    try:
        notes = msgspec.json.decode((folder / f"{weights}.json").read_bytes(), type=Notes)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as fault:
        raise unusable(fault) from fault
    return SceneNetwork(read_weights, notes)


def checksum_of(weights: bytes, notes: Notes) -> str:
    """Return the SHA-256 of all that makes the features, as hexadecimal digits.

    How features are read may change, and old maps stay usable: names, instances and the note do not count.
    """
    said = msgspec.structs.replace(notes, called={}, kinds={}, instances=InstanceNotes(), note="")
    idle = ("checksum", *(["fineness"] if notes.fineness == 1 else []))  # weights of before it was
    makes = {name: value for name, value in msgspec.structs.asdict(said).items() if name not in idle}
    return sha256(weights + msgspec.json.encode(makes)).hexdigest()


def at_working_size(
    frame: Frame, width_px: int, fineness: int = 1
) -> tuple[Pinhole, Float32[np.ndarray, "h w"], UInt8[np.ndarray, "hf wf 3"]]:
    """Return the colour camera, the depth as it sees it, and its picture, at the size that the network looks at.

    The geometry is ``width_px`` wide, and its focal length no longer; the picture is ``fineness`` times as wide and
    high.
    """
    import cv2

    from avlmaps.recordings.images import depth_in_colour  # a question to a map needs no picture

    camera, depth_m = depth_in_colour(frame.depth_m, frame.rig)
    width = min(width_px, round(width_px / camera.fx * camera.width))
    height = max(1, round(width * camera.height / camera.width))
    small = camera.resized(width, height)
    rgb = cv2.resize(frame.rgb, (fineness * width, fineness * height), interpolation=cv2.INTER_AREA)
    return small, subsampled(depth_m, width, height), np.asarray(rgb, np.uint8)


def subsampled(depth_m: Float32[np.ndarray, "h w"], width: int, height: int) -> Float32[np.ndarray, "hs ws"]:
    """Return the nearest depths: a mean over an edge would be a place where nothing is."""
    row = ((np.arange(height) + 0.5) * depth_m.shape[0] / height).astype(int)
    column = ((np.arange(width) + 0.5) * depth_m.shape[1] / width).astype(int)
    return np.ascontiguousarray(depth_m[row[:, None], column], np.float32)


def _ground_of(frame: Frame) -> tuple[Float[np.ndarray, "3"], float]:
    if frame.ground is None:
        return np.array([0.0, -1.0, 0.0]), _USUAL_HEIGHT_M
    rotation = frame.world_from_camera[:3, :3] @ frame.rig.rgb_from_depth[:3, :3].T
    return rotation.T @ frame.ground.up_in_world, frame.ground.camera_height_m(frame.world_from_camera)


def _padded(picture: Float32[np.ndarray, "c h w"], multiple: int) -> Float32[np.ndarray, "c hp wp"]:
    h, w = picture.shape[1:]
    return np.pad(picture, ((0, 0), (0, -h % multiple), (0, -w % multiple)))


def _softmax(score: Float32[np.ndarray, "..."]) -> Float32[np.ndarray, "..."]:  # in its place
    e = np.exp(np.subtract(score, score.max(axis=-1, keepdims=True), out=score), out=score)
    return np.divide(e, e.sum(axis=-1, keepdims=True), out=e)


# Agreement at which the second network begins to count, and from which on both count the same; in between its share
# grows evenly (training/pixels/README.md).
NO_SAY, SAME_SAY = 0.75, 0.95


class PairedNetworks:
    """A network and a second one that has a say where the two agree; their notes are the first's.

    Raises:
        ValueError: the second network has categories that the first lacks, or other kinds of room.
    """

    def __init__(self, first: SceneNetwork, second: SceneNetwork) -> None:
        self._first, self._second = first, second
        self.notes: Notes = first.notes
        if more := sorted(set(second.notes.categories) - set(first.notes.categories)):
            raise ValueError(f"The second network knows {len(more)} kinds that the first lacks, such as {more[0]}.")
        if second.notes.rooms != first.notes.rooms:
            raise ValueError("The two networks know different kinds of room; train them with one list.")
        self._column = np.array([first.notes.categories.index(name) for name in second.notes.categories])
        sizes = {(notes.width_px, notes.multiple, notes.fineness) for notes in (first.notes, second.notes)}
        self._alike = len(sizes) == 1
        both = f"{first.checksum} {second.checksum} {NO_SAY} {SAME_SAY}"
        self.checksum = sha256(both.encode()).hexdigest()

    def see(self, frame: Frame, augmentation: Augmentation = PLAIN) -> Seen:
        """Encode a frame with both networks."""
        inputs = inputs_of(frame, augmentation, self._first.notes)
        seen = self._first.see(frame, augmentation, inputs)
        second = self._second.see(frame, augmentation, inputs if self._alike else None)
        other = np.zeros_like(seen.category)
        other[..., self._column] = second.category
        share = share_of_second(seen.category, other, seen.known)
        return replace(seen, category=mixed(seen.category, other, share), room=mixed(seen.room, second.room, share))


def share_of_second(
    first: Float32[np.ndarray, "h w c"], second: Float32[np.ndarray, "h w c"], known: Bool[np.ndarray, "h w"]
) -> float:
    """Return the say that a second network has in a frame, 0 to a half, by the cells that have a depth."""
    agreement = np.sqrt(first * second).sum(axis=-1)
    mean = float(agreement[known].mean()) if known.any() else 0.0
    return 0.5 * float(np.clip((mean - NO_SAY) / (SAME_SAY - NO_SAY), 0.0, 1.0))


def mixed(
    first: Float32[np.ndarray, "*n c"], second: Float32[np.ndarray, "*n c"], share: float
) -> Float32[np.ndarray, "*n c"]:
    """Return the mean of two networks' probabilities, the second's with a weight of ``share``."""
    return (1.0 - share) * first + share * second if share else first


@cache
def load_pair() -> PairedNetworks:
    """Return the two networks that ship with the package; ``BackendError`` where files are missing or damaged."""
    return PairedNetworks(load_network(), load_network(SYNTHETIC_WEIGHTS))


# Of one frame by itself, of which the first is as maps look and gives the grid: a network errs on other pixels of each,
# so that the mean is right more often than any (multi-scale testing; Chen et al., "DeepLab", IEEE TPAMI 2018). Larger
# pictures are worse by themselves. A map does it with its many views of each voxel (training/pixels/README.md).
AUGMENTATIONS = tuple(starmap(Augmentation, product((PLAIN.scale, 1.2, 1.4), (PLAIN.mirrored, True))))


def see_multi_scale(network: SceneNetwork | PairedNetworks, frame: Frame) -> Seen:
    """Encode a frame in every augmentation, and return the mean, on the grid of the plain one."""
    import cv2

    first, *others = (network.see(frame, one) for one in AUGMENTATIONS)
    rows, columns = first.known.shape
    halves = ([cv2.resize(half, (columns, rows)) for half in np.array_split(s.category, 2, axis=2)] for s in others)
    category = np.stack([first.category, *map(np.dstack, halves)]).mean(axis=0)  # OpenCV 5 takes 128 channels at most
    camera, depth_m, rgb = at_working_size(frame, network.notes.width_px)
    cells = np.asarray(cv2.resize(rgb, (columns, rows), interpolation=cv2.INTER_AREA), np.uint8)
    return replace(
        first,
        category=smoothed(category, subsampled(depth_m, columns, rows), cells, camera.resized(columns, rows)),
        room=np.mean([seen.room for seen in (first, *others)], axis=0),
    )


# Chosen on the real development frames of the training (training/pixels/README.md).
REACH_CELLS = 3
NEAR_M = 0.1
ALIKE_LAB = 8.0


def smoothed(
    values: Float32[np.ndarray, "h w c"],
    depth_m: Float32[np.ndarray, "h w"],
    rgb: UInt8[np.ndarray, "h w 3"],
    camera: Pinhole,
) -> Float32[np.ndarray, "h w c"]:
    """Return the mean of each cell and its neighbours, weighted by how near they are in space and in colour.

    A cell without a depth (0) stays as it is and counts for no other. The camera is that of this grid.
    """
    import cv2

    h, w = depth_m.shape
    x, y = np.meshgrid(np.arange(w) + 0.5 - camera.cx, np.arange(h) + 0.5 - camera.cy)
    place_m = depth_m[..., None] * np.stack([x / camera.fx, y / camera.fy, np.ones((h, w))], axis=2)
    lab = cv2.cvtColor(rgb.astype(np.float32) / np.float32(255.0), cv2.COLOR_RGB2LAB)
    guide = np.concatenate([place_m / NEAR_M, np.asarray(lab) / ALIKE_LAB], axis=2).astype(np.float32)
    known = depth_m > 0.0
    total, weights = values.astype(np.float32), np.ones((h, w), np.float32)
    steps = range(-REACH_CELLS, REACH_CELLS + 1)
    for down, right in ((down, right) for down in steps for right in steps if down or right):
        here, there = _overlap(h, down), _overlap(h, -down)
        own, other = (here, _overlap(w, right)), (there, _overlap(w, -right))
        weight = np.exp(-0.5 * np.square(guide[own] - guide[other]).sum(axis=2)) * (known[own] & known[other])
        total[own] += weight[..., None] * values[other]
        weights[own] += weight
    return total / weights[..., None]


def _overlap(size: int, shift: int) -> slice:
    return slice(max(0, -shift), max(0, min(size, size - shift)))
