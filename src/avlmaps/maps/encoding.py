"""From numbers of frames to frames with features: decoding and encoding each in a thread of its own.

Both run ahead of the code that takes the frames, so that the slowest of decoding, encoding and fusion sets the pace.
"""

from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from itertools import islice

import numpy as np
from jaxtyping import Float32

from avlmaps.core.errors import RecordingError
from avlmaps.maps.perceived import encode_pixels
from avlmaps.maps.prefetch import run_ahead
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.perception.protocols import BatchPixelEncoder, PixelEncoder
from avlmaps.recordings.types import Frame, Recording

_MOST_HELD = 4  # frames in memory for each that is encoded
EncodedFrame = tuple[Frame | BadFrame, Float32[np.ndarray, "hf wf d"] | None]


def encode_frames(
    recording: Recording,
    stretches: Sequence[Sequence[int]],
    encoder: PixelEncoder | None,
    chosen: Collection[int] | None = None,
) -> Generator[EncodedFrame]:
    """Yield the frames with their features, in order; one that cannot be read yields its fault in its place.

    Args:
        recording: where the frames are.
        stretches: numbers of frames; no batch reaches from one stretch into the next, so that a build that continues
            from a stretch encodes the same batches as one that was never stopped.
        encoder: None yields frames alone.
        chosen: numbers of the frames to encode, the others coming alone; None encodes all.
    """
    every = [index for stretch in stretches for index in stretch]
    size = 1 if encoder is None else batch_of(encoder)
    with closing(run_ahead(decode_frames(recording, every), max(2, size))) as frames:
        if encoder is None:
            yield from ((frame, None) for frame in frames)
            return
        lengths = [len(stretch) for stretch in stretches]
        with closing(run_ahead(encode_batches(frames, lengths, encoder, size, chosen))) as seen:
            yield from seen


def decode_frames(recording: Recording, indices: Iterable[int]) -> Generator[Frame | BadFrame]:
    """Read frames; for one that cannot be read, yield the sentence that says why."""
    for index in indices:
        try:
            yield recording.frame(index)
        except RecordingError as fault:
            yield BadFrame(index=index, why=strip_folder(str(fault), recording))


def encode_batches(
    frames: Iterator[Frame | BadFrame],
    lengths: Sequence[int],
    encoder: PixelEncoder,
    size: int,
    chosen: Collection[int] | None = None,
) -> Generator[EncodedFrame]:
    """Add features to frames, or to the chosen ones, at most ``size`` of them at once, stretch by stretch."""

    def counts(frame: Frame | BadFrame) -> bool:
        return isinstance(frame, Frame) and (chosen is None or frame.index in chosen)

    for length in lengths:
        stretch = islice(frames, length)
        while group := _next_group(stretch, size, counts):
            wanted = [frame for frame in group if isinstance(frame, Frame) and counts(frame)]
            features = iter(encode_pixels(encoder, wanted))
            for frame in group:
                yield frame, (next(features) if counts(frame) else None)


def _next_group(
    frames: Iterator[Frame | BadFrame], size: int, counts: Callable[[Frame | BadFrame], bool]
) -> list[Frame | BadFrame]:
    """Take ``size`` frames that count, and the others among them; where none waits, one that does not goes alone."""
    group: list[Frame | BadFrame] = []
    good = 0
    for frame in frames:
        group.append(frame)
        good += counts(frame)
        if good == size or not good or len(group) >= _MOST_HELD * size:
            break
    return group


def batch_of(encoder: PixelEncoder) -> int:
    """Return how many frames an encoder is to be given at once."""
    return max(1, encoder.batch) if isinstance(encoder, BatchPixelEncoder) else 1


def strip_folder(sentence: str, recording: Recording) -> str:
    """Return a sentence about a recording without the folders that it lies in: a map may travel."""
    return sentence.replace(str(recording.path), recording.path.name)
