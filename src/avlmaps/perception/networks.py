"""Networks that onnxruntime runs, and what they said of pictures, remembered by its content."""

import contextlib
import hashlib
import threading
from collections import OrderedDict
from functools import cache
from typing import Any

import numpy as np

from avlmaps.core.machine import release_memory, usable_cores
from avlmaps.recordings.types import Frame


def open_network(graph: bytes | str, most_threads: int = 1) -> Any:
    """Return a network, or that of a file, ready to run on at most some threads; raises onnxruntime's own types."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = min(most_threads, usable_cores())
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    # Threads that wait for the next frame leave the cores to decoding and fusion: a build takes 0.6 of the time.
    options.add_session_config_entry("session.intra_op.allow_spinning", "0")
    with _SHARING:
        _share_arena()
    options.add_session_config_entry("session.use_env_allocators", "1")
    network = onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])
    release_memory()  # the file and its nodes before they were joined: 77 MB of a network of 16 MB
    return network


_SHARING = threading.Lock()  # `cache` has none


@cache
def _share_arena() -> None:
    # One for all networks, which grows by what is needed: else each has its own, which grows in powers of two.
    import onnxruntime as ort

    processor = ort.OrtMemoryInfo("Cpu", ort.OrtAllocatorType.ORT_ARENA_ALLOCATOR, 0, ort.OrtMemType.DEFAULT)
    with contextlib.suppress(RuntimeError):  # a program registered one before
        ort.create_and_register_allocator(processor, ort.OrtArenaCfg({"arena_extend_strategy": 1}))


_MOST = 4096


class Remembered:
    """Vectors by the content of what they are of, the latest ``_MOST``; for several threads."""

    def __init__(self) -> None:
        self._found: OrderedDict[str, np.ndarray] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, key: str) -> np.ndarray | None:
        """Return a vector, None where it is not known."""
        with self._lock:
            return self._found.get(key)

    def put(self, key: str, vector: np.ndarray) -> None:
        """Remember a vector; the oldest is forgotten where there are too many."""
        with self._lock:
            self._found[key] = vector
            while len(self._found) > _MOST:
                self._found.popitem(last=False)


def key_of(*content: Any) -> str:
    """Return the hex SHA-256 of arrays, by their types, shapes and bytes, and of other values as they are written."""
    digest = hashlib.sha256()
    for each in content:
        is_array = isinstance(each, np.ndarray)
        digest.update(repr((each.shape, each.dtype.str) if is_array else each).encode() + b"\0")
        if is_array:
            digest.update(np.ascontiguousarray(each).data)
    return digest.hexdigest()


def seen_in(frame: Frame) -> list[Any]:
    """Return all of a frame that an encoder may look at: everything but its number, name and time."""
    rig, ground = frame.rig, frame.ground
    stands = (None,) if ground is None else (ground.up_in_world, ground.camera_m, ground.floor_m)
    return [frame.rgb, frame.depth_m, frame.world_from_camera, rig.rgb, rig.depth, rig.rgb_from_depth, *stands]
