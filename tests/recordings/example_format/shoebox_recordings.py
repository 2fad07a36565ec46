"""A format of its own: a folder of shots, each an NPZ of ``rgb``, ``depth_m``, ``world_from_camera``, ``stamp_s`` and
``k``."""

import zipfile
from pathlib import Path

import numpy as np

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.recordings.open import Format, some_name
from avlmaps.recordings.types import Frame, Recording


class Shoebox(Recording):
    """See the module's docstring."""

    format = "shoebox"

    def __init__(self, path: Path) -> None:
        self.path, self.audio, self.notices = path, None, ()
        self.files = sorted(path.glob("shot_*.npz"))
        shots = [self._read(file, "stamp_s", "world_from_camera", "k", "rgb") for file in self.files]
        fx, fy, cx, cy = map(float, shots[0][2])
        camera = Pinhole(fx, fy, cx, cy, shots[0][3].shape[1], shots[0][3].shape[0])
        self.rig = Rig(camera, camera)
        self.stamps_s = np.array([float(shot[0]) for shot in shots])
        self.world_from_camera = np.stack([shot[1] for shot in shots])
        self.up_in_world = np.array([0.0, 0.0, 1.0])

    def _read(self, file: Path, *names: str) -> list[np.ndarray]:
        try:
            with np.load(file) as content:
                return [content[name] for name in names]
        except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
            raise RecordingError(f"{file} is no whole shot ({error}); copy it again.") from None

    def frame(self, index: int) -> Frame:
        rgb, depth_m = self._read(self.files[index], "rgb", "depth_m")
        pose = self.world_from_camera[index]
        return Frame(index, self.name(index), float(self.stamps_s[index]), rgb, depth_m, pose, self.rig)


FORMAT = Format("shoebox", "shot_*.npz", lambda path: some_name(path, "shot_*.npz"), "shoebox_recordings:Shoebox")
