"""The network behind the embedded pixel and view encoders: what each pixel shows, and what kind of room it is.

It looks at geometry in the frame of gravity, and at colour, which joins later and may be finer. It runs in onnxruntime
at a small size (``Notes.width_px``), for every recording; ``training/pixels`` makes its weights. Two sets ship: one
that learnt from rendered worlds and real frames, and one that saw rendered worlds alone (the profile ``synthetic``).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from avlmaps.core.arrays import Float, Float32, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import BackendError
from avlmaps.perception.embedded.geometry import channels
from avlmaps.perception.models.networks import open_network
from avlmaps.recordings.images import depth_in_colour
from avlmaps.recordings.types import Frame

# Without ground a camera is taken to be upright and as high as people and robots mostly hold it.
_USUAL_HEIGHT_M = 1.3
# Names of the weights that ship.
DEFAULT_WEIGHTS: Final = "scene_encoder"
SYNTHETIC_WEIGHTS: Final = "scene_encoder_synthetic"


@dataclass(frozen=True, slots=True)
class Augmentation:
    """How a frame is changed before the network sees it (test-time augmentation).

    Attributes:
        scale: how wide the picture is, times ``Notes.width_px``.
        mirrored: left is right, as in a mirror.
    """

    scale: float = 1.0
    mirrored: bool = False


# As maps see each of their many frames.
PLAIN = Augmentation()
_ACROSS = 4  # the channel of geometry that changes its sign in a mirror: the normal along right


class InstanceNotes(msgspec.Struct, frozen=True):
    """How instances are distinguished from noise, fitted on maps of held-out homes (``training/pixels/instances.py``).

    The log-odds that they are a true instance are ``bias + slopes[0]·log-odds(p) + slopes[1]·log(area / usual area)``.

    Attributes:
        slopes: of the log-odds of their mean probability, and of the logarithm of their area beside the usual one.
        bias: of each category; of all others ``default_bias``.
        area_m2: the usual surface of a true instance of each category; of all others ``default_area_m2``.
        default_bias: see above.
        default_area_m2: see above.
    """

    slopes: tuple[float, float] = (1.0, 0.8)
    bias: dict[str, float] = {}
    area_m2: dict[str, float] = {}
    default_bias: float = 0.0
    default_area_m2: float = 0.3


class Notes(msgspec.Struct, frozen=True):
    """The description of the weights beside them.

    Attributes:
        id: the model's name and version.
        note: its limits, one sentence.
        categories: kinds of pixels, ``other`` among them.
        rooms: kinds of room.
        bias: added to the categories' scores: undoes the weights of training and calibrates.
        temperature: divides the categories' scores before the softmax.
        room_temperature: divides the rooms' scores.
        called: for a category other phrases for it.
        kinds: wider words and the categories that they take in.
        width_px: how wide the pictures are that the network looks at; their focal length is no longer than this
            either, since it was trained on none longer.
        instances: how instances are distinguished from noise.
        multiple: pictures are padded to a multiple of this.
        fineness: how many times as wide and high as geometry the colour is that the network takes.
        checksum: of the weights and of what else makes the features; see ``checksum_of``.
    """

    id: str
    note: str
    categories: tuple[str, ...]
    rooms: tuple[str, ...]
    bias: tuple[float, ...]
    temperature: float
    room_temperature: float
    called: dict[str, tuple[str, ...]]
    kinds: dict[str, tuple[str, ...]]
    width_px: int = 240
    instances: InstanceNotes = InstanceNotes()
    multiple: int = 16
    fineness: int = 1
    checksum: str = ""


@dataclass(frozen=True, slots=True)
class Seen:
    """The network's outputs for a frame.

    Attributes:
        category: probability of each category on a grid that covers the colour picture evenly.
        known: which cells have a depth.
        room: probability of each kind of room.
        floor_offset_m: estimated height of the true floor over the one that the frame's ground says; None where the
            weights do not estimate it.
    """

    category: Float32[np.ndarray, "h w c"]
    known: np.ndarray
    room: Float32[np.ndarray, " r"]
    floor_offset_m: float | None = None


class SceneNetwork:
    """The network. Its weights are read for the first frame: a query in words needs its notes alone.

    Args:
        read_weights: returns the content of the ONNX file.
        notes: their description.

    Attributes:
        notes: as given.
        checksum: of the notes.
    """

    def __init__(self, read_weights: Callable[[], bytes], notes: Notes) -> None:
        self._read_weights = read_weights
        self.notes = notes
        self.checksum = notes.checksum
        self._bias = np.array(notes.bias, np.float32)

    @cached_property
    def _session(self) -> Any:
        """The network, ready to run."""
        weights = self._read_weights()
        try:
            return open_network(weights, most_threads=4)
        except Exception as fault:  # onnxruntime raises types of its own
            import onnxruntime

            raise BackendError(
                f"The weights of {self.notes.id} cannot be run by onnxruntime {onnxruntime.__version__} "
                f"({type(fault).__name__}); update onnxruntime, or install or train the weights again."
            ) from fault

    def see(self, frame: Frame, augmentation: Augmentation = PLAIN) -> Seen:
        """Encode a frame; its ``ground`` gives the up direction, where it is known."""
        import cv2

        multiple, fineness = self.notes.multiple, self.notes.fineness
        camera, depth_m, rgb = at_working_size(frame, round(augmentation.scale * self.notes.width_px), fineness)
        up, height_m = _ground_of(frame)
        geometry = channels(depth_m, camera, up, height_m)
        colour = rgb.astype(np.float32).transpose(2, 0, 1) / 127.5 - 1.0
        if augmentation.mirrored:
            geometry, colour = geometry[:, :, ::-1].copy(), colour[:, :, ::-1]
            geometry[_ACROSS] *= -1.0
        geometry, colour = _padded(geometry, multiple), _padded(colour, fineness * multiple)
        score, room, *floor = (
            np.asarray(output)
            for output in self._session.run(None, {"geometry": geometry[None], "colour": colour[None]})
        )
        h, w = (depth_m.shape[0] + 1) // 2, (depth_m.shape[1] + 1) // 2
        category = score[0, :, :h, :w].transpose(1, 2, 0) + self._bias
        if augmentation.mirrored:
            category = category[:, ::-1]
        known = cv2.resize((depth_m > 0.0).astype(np.uint8), (w, h), interpolation=cv2.INTER_AREA) > 0
        return Seen(
            _softmax(category / self.notes.temperature),
            known,
            _softmax(room[0] / self.notes.room_temperature),
            float(floor[0].item()) if floor else None,
        )


@cache
def load_network(weights: str = DEFAULT_WEIGHTS) -> SceneNetwork:
    """Return a network that ships with the package.

    Args:
        weights: ``DEFAULT_WEIGHTS`` or ``SYNTHETIC_WEIGHTS``.

    Raises:
        BackendError: its files are missing or damaged.
    """
    folder = Path(__file__).with_name("weights")
    return read_network(folder, weights, "install the package again, or make them with 'python -m training.pixels'")


def read_network(folder: Path, weights: str, remedy: str) -> SceneNetwork:
    """Return the network of two files: ``WEIGHTS.onnx``, and its ``Notes``, ``WEIGHTS.json``.

    Args:
        folder: where they lie.
        weights: their name without an ending.
        remedy: what the user can do where they are missing or damaged, for the error.

    Raises:
        BackendError: the notes cannot be read. The weights are read for the first frame, and raise it there.
    """

    def unusable(fault: object) -> BackendError:
        return BackendError(f"The embedded pixel encoder's weights cannot be read ({fault}); {remedy}.")

    def read(end: str) -> bytes:
        try:
            return (folder / f"{weights}.{end}").read_bytes()
        except OSError as fault:
            raise unusable(fault) from fault

    def read_weights() -> bytes:
        content = read("onnx")
        if checksum_of(content, notes) != notes.checksum:
            raise unusable(f"{weights}.onnx and {weights}.json do not belong together")
        return content

    try:
        notes = msgspec.json.decode(read("json"), type=Notes)
    except (msgspec.MsgspecError, UnicodeDecodeError) as fault:
        raise unusable(fault) from fault
    return SceneNetwork(read_weights, notes)


def checksum_of(weights: bytes, notes: Notes) -> str:
    """Return the SHA-256 of all that makes the features, as hexadecimal digits.

    How features are read may change, and old maps stay usable: names, instances and the note do not count.
    """
    said = msgspec.structs.replace(notes, called={}, kinds={}, instances=InstanceNotes(), note="")
    makes = {name: value for name, value in msgspec.structs.asdict(said).items() if name != "checksum"}
    if notes.fineness == 1:  # weights made before there was a choice
        del makes["fineness"]
    return sha256(weights + msgspec.json.encode(makes)).hexdigest()


def at_working_size(
    frame: Frame, width_px: int, fineness: int = 1
) -> tuple[Pinhole, Float32[np.ndarray, "h w"], UInt8[np.ndarray, "hf wf 3"]]:
    """Return the colour camera, the depth as it sees it, and its picture, at the size that the network looks at.

    Args:
        frame: the frame.
        width_px: how wide the network's geometry is, and no longer its focal length.
        fineness: how many times as wide and high the picture is.
    """
    import cv2

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


def _softmax(score: Any) -> Float32[np.ndarray, "..."]:
    e = np.exp(score - score.max(axis=-1, keepdims=True))
    return (e / e.sum(axis=-1, keepdims=True)).astype(np.float32)
