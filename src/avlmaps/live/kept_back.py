"""Frames that came late or were not given to the encoder, on the disk, until there is time to look at them."""

import tempfile
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.recordings.types import Frame


@dataclass(frozen=True, slots=True)
class _Place:
    """A frame in the file: what it is worth, all of it but its pictures, and whether its surface is in the map."""

    worth: float
    frame: Frame
    is_fused: bool


class KeptBack:
    """Holds as many frames as it may, those that are worth most, in a file without a name that goes with the process.

    All frames have the cameras of the first. Pictures are stored as they are: 2.2 MB of 640x480 pixels.

    Attributes:
        most: frames; 0 where none is stored, as from when the disk is full.
    """

    def __init__(self, most: int) -> None:
        """Begin empty.

        Args:
            most: frames; what is worth least makes room for another.
        """
        self.most = most
        self._free, self._places = list(range(most))[::-1], dict[int, _Place]()
        self._file: BinaryIO | None = None

    def __len__(self) -> int:
        return len(self._places)

    def keep(self, frame: Frame, worth: float, *, is_fused: bool) -> bool:
        """Store a frame, if it is worth more than one that is stored, or there is room; return whether it is stored.

        Args:
            frame: the frame.
            worth: the more, the sooner it is taken; one that is worth nothing is not stored.
            is_fused: whether its surface is in the map.

        Raises:
            MapError: the disk is full; from then on nothing is stored, and what was is still there.
        """
        if not self.most or not worth:
            return False
        if not self._free:
            least = min(self._places, key=lambda at: self._places[at].worth, default=None)
            if least is None or self._places[least].worth >= worth:
                return False
            del self._places[least]
            self._free.append(least)
        at = self._free[-1]
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(prefix="avlmaps-frames-")  # noqa: SIM115 - see close
            self._file.seek(at * (frame.rgb.nbytes + frame.depth_m.nbytes))
            for picture in (frame.rgb, frame.depth_m):
                self._file.write(np.ascontiguousarray(picture).data)
            self._file.flush()
        except OSError as fault:
            self.most = 0
            raise MapError(
                f"Frames that are to be encoded later cannot be stored in {tempfile.gettempdir()} "
                f"({fault.strerror or fault}), and are left out; make room there, or name another folder in "
                "TMPDIR."
            ) from fault
        self._free.pop()
        rgb = np.broadcast_to(np.uint8(0), frame.rgb.shape)  # of no memory
        depth_m = np.broadcast_to(np.float32(0.0), frame.depth_m.shape)
        self._places[at] = _Place(worth, replace(frame, rgb=rgb, depth_m=depth_m), is_fused)
        return True

    def take(self) -> tuple[Frame, bool] | None:
        """Return the frame that is worth most, and whether its surface is in the map; None where there is none."""
        if not self._places or self._file is None:
            return None
        at = max(self._places, key=lambda at: self._places[at].worth)
        place = self._places.pop(at)
        frame = place.frame
        self._file.seek(at * (frame.rgb.nbytes + frame.depth_m.nbytes))
        rgb, depth_m = (
            np.frombuffer(self._file.read(picture.nbytes), picture.dtype).reshape(picture.shape)
            for picture in (frame.rgb, frame.depth_m)
        )
        self._free.append(at)
        return replace(frame, rgb=rgb, depth_m=depth_m), place.is_fused

    def close(self) -> None:
        """Give the disk back; what is stored is gone, and nothing more is stored."""
        self.most = 0
        self._places.clear()
        if self._file is not None:
            self._file.close()
            self._file = None
