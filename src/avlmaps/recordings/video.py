"""Frames out of an mp4, mkv or other video, by number, without decoding it from the start each time."""

import threading
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64, UInt8

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.containers import checked_media
from avlmaps.recordings.images import MOST_PIXELS, DisplayTurn


class VideoFrames:
    """The pictures of a video's first video stream. Opening reads the stamps (demuxing only), no picture.

    Attributes:
        path: the file.
        width: columns.
        height: rows.
        stamps_s: (n,) seconds from the first frame, in the order they are shown.
        start_s: when the first frame is shown on the file's clock, on which its sound begins at 0 or later, seconds.
        turn: how players turn the pictures; they come turned if ``shown`` is set, else as stored.
        shown: whether they come as players show them.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._container = self._open()
        stream = self._stream()
        self.width, self.height = stream.codec_context.width, stream.codec_context.height
        if self.width < 1 or self.height < 1 or self.width * self.height > MOST_PIXELS:
            raise RecordingError(f"{self.path} says that it is {self.width}x{self.height}, which no camera's video is.")
        self._pts = self._read_stamps()
        base = float(stream.time_base or 0)
        if base <= 0.0:
            raise RecordingError(f"{self.path} does not say how fast its clock runs; convert it again.")
        self.stamps_s: Float64[np.ndarray, " n"] = (self._pts - self._pts[0]) * base
        self.start_s = float(self._pts[0]) * base - (self._container.start_time or 0) / 1e6
        self.turn, self.shown = self._find_turn(), False
        self._next = -1  # the frame that the decoder gives next; -1 after a seek
        self._decoder: Any = None

    def show(self) -> None:
        """Let the pictures come as players show them, not as they are stored."""
        if self.turn and not self.shown:
            self.shown = True
            self.width, self.height = self.turn.size(self.width, self.height)

    def __len__(self) -> int:
        return len(self.stamps_s)

    def picture(self, index: int) -> UInt8[np.ndarray, "h w 3"]:
        """Decode one frame; continuing in order is fast, a jump costs a seek to the key frame before it."""
        from av.error import FFmpegError

        with self._lock:
            try:
                if index != self._next:
                    self._seek(index)
                for frame in self._decoder:
                    if frame.pts is not None and frame.pts >= self._pts[index]:
                        self._next = index + 1
                        picture = frame.to_ndarray(format="rgb24")
                        return self._checked(self.turn.applied(picture) if self.shown else picture, index)
            except (FFmpegError, ValueError, MemoryError) as error:
                raise RecordingError(
                    f"Frame {index} of {self.path} cannot be decoded ({error}); is it damaged?"
                ) from error
        raise RecordingError(f"{self.path} ends before frame {index} of {len(self)}; the file is cut short.")

    def _checked(self, picture: UInt8[np.ndarray, "h w 3"], index: int) -> UInt8[np.ndarray, "h w 3"]:
        if picture.shape[:2] != (self.height, self.width):
            raise RecordingError(
                f"Frame {index} of {self.path} is {picture.shape[1]}x{picture.shape[0]}, the video {self.width}x"
                f"{self.height}; every frame must have one size."
            )
        return picture

    def _open(self) -> Any:
        import av
        from av.error import FFmpegError

        try:
            checked_media(self.path)
        except FileNotFoundError:
            raise RecordingError(f"There is no video {self.path}.") from None
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be read ({error.strerror or error}); check the file.") from None
        try:
            container = av.open(str(self.path))
        except FFmpegError as error:
            raise RecordingError(f"{self.path} cannot be read as a video ({error}); is it cut short?") from error
        if not container.streams.video:
            raise RecordingError(f"{self.path} has no video stream.")
        return container

    def _stream(self) -> Any:
        return self._container.streams.video[0]

    def _read_stamps(self) -> np.ndarray:
        from av.error import FFmpegError

        try:
            return self._stamps_of_packets()
        except FFmpegError as error:
            raise RecordingError(f"{self.path} cannot be read as a video ({error}); is it cut short?") from error

    def _stamps_of_packets(self) -> np.ndarray:
        stamps = [packet.pts for packet in self._container.demux(self._stream()) if packet.pts is not None]
        if not stamps:
            raise RecordingError(f"{self.path} has a video stream without a single frame.")
        return np.unique(np.array(stamps, np.int64))

    def _find_turn(self) -> DisplayTurn:
        from av.error import FFmpegError

        try:
            self._seek(0)
            matrices = [data for data in next(self._decoder).side_data if data.type.name == "DISPLAYMATRIX"]
            return DisplayTurn.of_display_matrix(bytes(matrices[0])) if matrices else DisplayTurn()
        except (FFmpegError, StopIteration, ValueError):  # the picture itself will be an error when it is read
            return DisplayTurn()

    def _seek(self, index: int) -> None:
        self._container.seek(int(self._pts[index]), stream=self._stream(), backward=True)
        self._decoder = self._container.decode(self._stream())
