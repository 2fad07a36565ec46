"""A map in memory that takes one frame after the other and can be queried at any time."""

from dataclasses import replace
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Float, Float16, Int32, UInt8
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import MapError
from avlmaps.core.files import lasting_path
from avlmaps.core.numbers import as_number
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.perceived import given_features
from avlmaps.maps.plan import require_place
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.tables import lock_folder
from avlmaps.perception.encoders import Encoders, encoders_of
from avlmaps.query.avlmap import AVLMap, with_findings
from avlmaps.query.settings import QuerySettings
from avlmaps.recordings.memory import given_frame

if TYPE_CHECKING:
    from avlmaps.query.answer import Answer
    from avlmaps.query.contents import Thing
    from avlmaps.query.heatmap import Heatmap
    from avlmaps.query.locate import Located

_STEP_S = 0.1
IN_MEMORY = Path("the frames")  # as sentences name a map that has no folder


class VoxelMap:
    """A map in memory: ``add`` frames, ``ask``, ``save``. It is the map that ``build_map`` makes if it encodes all.

    Up, the floor and the depth camera's error are found in the first 60 frames, or with the first question; up and the
    floor again with a question after the walk has doubled, and in ``save``, so that the map of a longer walk can differ
    a little from a build's. Threads may add and ask.
    """

    def __init__(
        self,
        voxel_size_m: Any = 0.05,
        encoders: "Encoders | str | None" = None,
        *,
        up_in_world: Any = None,
        settings: BuildSettings | None = None,
        query: QuerySettings | None = None,
    ) -> None:
        """Begin an empty map.

        ``encoders``: the models that perceive; those of the profile ``embedded`` if None; ``Encoders()`` has none.
        ``up_in_world``: the direction that is up in the world of the poses; None finds it in the frames. ``settings``:
        everything else about the map, as of ``build_map``; its voxel size does not count. ``MapError``: the voxel size
        or up is none. ``BackendError``: there is no such profile.
        """
        edge_m = as_number(voxel_size_m)
        if edge_m is None:
            raise MapError(f"voxel_size_m must be a number of metres, not {voxel_size_m!r}.")
        require_kinds(("settings", settings, BuildSettings), ("query", query, QuerySettings))
        chosen = replace(settings or BuildSettings(), voxel_size_m=edge_m)
        used = encoders_of("embedded" if encoders is None else encoders)
        self._mapper = Mapper(chosen, used, direction(up_in_world))
        self._query = query
        self._map: AVLMap | None = None
        self._lock = RLock()

    def add(
        self, rgb: Any, depth_m: Any, camera: Any, world_from_camera: Any, stamp_s: Any = None, *, features: Any = None
    ) -> None:
        """Add a frame. What is refused leaves the map as it was.

        ``rgb``: (h, w, 3) uint8. ``depth_m``: z-depth in metres, (hd, wd) floats; 0, NaN or infinity where there is
        none. ``camera``: a ``Pinhole`` of the colour picture, whose view the depth shares, or a ``Rig`` of both
        cameras. ``world_from_camera``: 4x4 pose of the depth camera (OpenCV axes), metres. ``stamp_s``: seconds, rising
        from frame to frame; by default 0.1 s after the one before. ``features``: of the pixels, instead of the
        encoder's: (hf, wf, d), covering the picture evenly at any resolution, each of unit length or zero.

        ``RecordingError``: an array, the camera, the pose or the stamp is not what it must be. ``BackendError``: so are
        the features, or what the encoder gave.
        """
        with self._lock:
            index, last_s = self._mapper.next_index, self._mapper.last_stamp_s
            if stamp_s is None:
                stamp_s = 0.0 if last_s is None else last_s + _STEP_S
            frame = given_frame(index, rgb, depth_m, camera, world_from_camera, stamp_s)
            self._map = None
            self._mapper.add(frame, None if features is None else given_features(features, self._mapper.dim, frame))

    def add_audio(self, chunk: Any, stamp_s: Any = None) -> None:
        """Add a piece of the microphone's sound. What is refused leaves the map as it was.

        A question knows the sounds that have been over for a quarter of a second. ``chunk``: float32 mono samples in
        [-1, 1] and their rate, which all pieces share. ``stamp_s``: when its first sample sounds, on the clock of the
        frames; None where the piece before ended, at first 0. A gap of 0.1 s and more is filled with silence, and an
        overlap of that is left out. ``AudioError``: it is no sound, is of another rate, repeats what came, or is of
        another clock.
        """
        with self._lock:
            self._mapper.add_sound(chunk, stamp_s)
            self._map = None

    def correct_poses(self, stamps_s: Any, poses: Any) -> tuple[float, float]:
        """Move the map to corrected poses of its frames, as a loop closure gives them; return median and most, metres.

        It takes a map that was begun with submaps: ``settings=BuildSettings(frames=FrameSettings(per_submap=32))``.
        Frames to come have poses of the corrected world. ``stamps_s``: (k,), rising: each of a frame, or within half a
        second of one. ``poses``: (k, 4, 4) world_from_camera of the depth camera then; frames between them follow
        smoothly. ``MapError``: there are no submaps or no frames, or the poses are not of its frames; the map is as it
        was. ``RecordingError``: a pose is no rigid motion.
        """
        with self._lock:
            moved = self._mapper.correct_poses(stamps_s, poses)
            self._map = None
            return moved

    @property
    def map(self) -> AVLMap:
        """The map of the frames up to now. ``MapError``: there is no frame, or none has a depth within the limits."""
        with self._lock:
            if self._map is None:
                self._map = AVLMap(self._mapper.snapshot(), self._mapper.encoders, path=IN_MEMORY, settings=self._query)
            return self._map

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the map may be wrong, one sentence each: frames that contradict one another. Answers repeat them."""
        return self.map.data.info.doubts

    def ask(self, question: Any = "", *args: Any, **parts: Any) -> "Answer":
        """Answer a query; see ``AVLMap.ask``."""
        return self.map.ask(question, *args, **parts)

    def object(self, word: str, primary: bool = False) -> "Heatmap":
        """Return the heat of an object; see ``AVLMap.object``."""
        return self.map.object(word, primary)

    def area(self, word: str, primary: bool = False) -> "Heatmap":
        """Return the heat of an area; see ``AVLMap.area``."""
        return self.map.area(word, primary)

    def things(self) -> "list[Thing]":
        """Return the things of the map, most confident first; see ``AVLMap.things``."""
        return self.map.things()

    def locate(
        self, picture: "str | Path | UInt8[np.ndarray, 'h w 3']", intrinsics: Pinhole | None = None
    ) -> "Located":
        """Return where a picture was taken; see ``AVLMap.locate``."""
        return self.map.locate(picture, intrinsics)

    @property
    def points(self) -> Float[np.ndarray, "n 3"]:
        """The middles of the voxels, metres, the world of the poses; read-only."""
        return self.map.points

    @property
    def colors(self) -> UInt8[np.ndarray, "n 3"]:
        """RGB of the voxels; read-only."""
        return self.map.colors

    @property
    def features(self) -> Float16[np.ndarray, "n d"]:
        """The features of the voxels; read-only."""
        return self.map.features

    @property
    def voxel_index(self) -> Int32[np.ndarray, "n 3"]:
        """Which voxels; read-only."""
        return self.map.voxel_index

    def save(self, path: str | Path, *, overwrite: bool = False) -> AVLMap:
        """Write the map into a folder and open it; frames can be added on.

        ``MapError``: it cannot be written, or the folder is something else, or a map and ``overwrite`` is not set.
        """
        with self._lock:
            place = lasting_path(path)
            require_place(place, overwrite)
            encoders = self._mapper.encoders
            made = with_findings(self._mapper.finish(), encoders)
            with lock_folder(place):
                write(place, made)
            return AVLMap(read(place), encoders, path=place, settings=self._query)

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        return len(self._mapper)

    def __repr__(self) -> str:
        encoders = self._mapper.encoders
        return f"VoxelMap({len(self)} frames, voxels of {self._mapper.settings.voxel_size_m:g} m, {encoders!r})"


def require_kinds(*given: tuple[str, object, type]) -> None:
    """Raise ``MapError`` where an argument is neither None nor of its kind; each is a name, a value and the kind."""
    for name, value, kind in given:
        if value is not None and not isinstance(value, kind):
            raise MapError(f"{name} must be an avlmaps.{kind.__name__}, not {type(value).__name__}.")


def direction(up_in_world: Any) -> Float[np.ndarray, "3"] | None:
    """Return the unit vector of a direction that a program gave; None for None. ``MapError``: it is no direction."""
    if up_in_world is None:
        return None
    up = np.asarray(up_in_world)
    if up.shape != (3,) or up.dtype.kind not in "fiu" or not np.isfinite(up).all() or not np.linalg.norm(up) > 0.0:
        raise MapError(f"up_in_world must be a direction x, y, z, such as (0, 0, 1); not {up_in_world!r}.")
    return up / np.linalg.norm(up)
