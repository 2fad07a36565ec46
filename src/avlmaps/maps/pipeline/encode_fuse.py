"""Encoding and fusing: from the numbers of frames to parts of a map.

Decoding and encoding run ahead of fusion, each in a thread of its own, so that the slowest of the three sets the pace.
"""

from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from itertools import islice
from pathlib import Path
from time import perf_counter

import numpy as np
from jaxtyping import Float32

from avlmaps.core.ahead import run_ahead
from avlmaps.core.errors import RecordingError
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.core.wording import option
from avlmaps.maps.fusion.accumulator import VoxelAccumulator
from avlmaps.maps.fusion.free_space import FreeViewCollector
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.perceived import encode_pixels
from avlmaps.maps.pipeline.parts import MapPart, PartInfo, SubmapFrames, check_disjoint, find_part, load_part, save_part
from avlmaps.maps.pipeline.plan import (
    BuildPlan,
    Span,
    encoded_frames,
    fusion_key,
    pixel_encoder_of,
    plan_spans,
    strip_folder,
)
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.manifest import BadFrame, SensorInfo
from avlmaps.perception.cache.cached_encoders import cache_note
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.protocols import BatchPixelEncoder, PixelEncoder
from avlmaps.recordings.types import Frame, Recording

_MOST_HELD = 4  # frames in memory for each that is encoded
EncodedFrame = tuple[Frame | BadFrame, Float32[np.ndarray, "hf wf d"] | None]
Fuse = Callable[[BuildPlan, Sequence[tuple[Span, Path]], SensorModel, Sequence[BadFrame], int], None]


def encode_and_fuse(plan: BuildPlan, given: Sequence[Path | str], sensor: SensorInfo, fuse: Fuse) -> list[MapPart]:
    """Encode and fuse all frames that no part covers yet; return the parts that make up the map, in a fixed order."""
    brought = [load_part(Path(folder), plan.fusion_key) for folder in given]
    covered = [span for part in brought for span in part.info.spans]
    home = plan.folder("fusion", plan.fusion_key)
    spans = {
        home / f"{span[0]:08d}-{span[1]:08d}": span for span in plan_spans(len(plan.recording), plan.settings, covered)
    }
    finished = {folder: find_part(folder, plan.fusion_key, span) for folder, span in spans.items()}
    jobs = [(spans[folder], folder) for folder, part in finished.items() if part is None]
    had = [*brought, *(part for part in finished.values() if part is not None)]
    bad = [frame for part in had for frame in part.info.bad_frames]
    done = sum(part.info.fused + len(part.info.bad_frames) for part in had)
    fuse(plan, jobs, sensor.model, bad, done)
    own = [part or load_part(folder, plan.fusion_key) for folder, part in finished.items()]
    parts = sorted([*brought, *own], key=lambda part: part.info.spans)
    check_disjoint(parts)
    return parts


def fuse_spans(
    recording: Recording,
    jobs: Sequence[tuple[Span, Path]],
    encoders: Encoders,
    settings: BuildSettings,
    sensor: SensorModel,
    known_bad: Sequence[BadFrame] = (),
    done: int = 0,
) -> None:
    """Fuse stretches of frames, each into a part of its own; decoding and encoding run ahead of fusion.

    Frames of other parts are ``known_bad``, those that could not be read, and ``done``, for the progress bar.

    Raises:
        RecordingError: too many frames cannot be read.
        MapError: a part cannot be written.
    """
    if not jobs:
        return
    key, encoder = fusion_key(recording, settings, encoders), pixel_encoder_of(encoders)
    tolerance = Tolerance(recording, settings, known_bad)
    stretches = [range(*span) for span, _ in jobs]
    total_frames = done + sum(map(len, stretches))
    chosen = encoded_frames(recording, settings, encoders)
    with closing(encode_frames(recording, stretches, encoder, chosen)) as ahead:
        seen = progress(ahead, "fusing", total=total_frames, done=done, note=lambda: cache_note(encoders, Kind.PIXELS))
        for span, folder in jobs:
            begin = perf_counter()
            dim = encoder.card.dim if encoder else 0
            as_submap = settings.frames.per_submap > 0
            grid = GridSpec(settings.voxel_size_m)
            total = VoxelAccumulator(grid, dim, settings.fusion, sensor, with_spread=as_submap)
            free = FreeViewCollector(recording.rig.depth, sensor)
            bad = _fuse(islice(seen, len(range(*span))), total, free, tolerance)
            info = PartInfo(
                recording=recording.path.name,
                spans=(span,),
                fused=len(range(*span)) - len(bad),
                bad_frames=tuple(bad),
                elapsed_s=perf_counter() - begin,
            )
            frames = np.setdiff1d(np.arange(*span), [frame.index for frame in bad])
            submap = SubmapFrames.of(total, recording, frames) if as_submap else None
            save_part(folder, key, info, total.sums(), free.views(), submap)
        for _ in seen:  # nothing is left; this completes the bar
            pass


class Tolerance:
    """Counts the frames that cannot be read, and says when there are too many."""

    def __init__(self, recording: Recording, settings: BuildSettings, known: Sequence[BadFrame] = ()) -> None:
        """Begin with those that are known from finished parts."""
        self._total = len(range(0, len(recording), settings.frames.step))
        self._allowed = int(settings.frames.max_bad_share * self._total) if settings.frames.on_bad == "skip" else 0
        self._met = len(known)

    def meet(self, bad: BadFrame) -> None:
        """Take note of one more; raise ``RecordingError`` when there are more than allowed."""
        self._met += 1
        if self._met <= self._allowed:
            return
        if self._allowed == 0:
            raise RecordingError(bad.why)
        raise RecordingError(
            f"{self._met} of {self._total} frames cannot be read, more than the {self._allowed} that may be left out; "
            f"fix the recording or allow more ({option('max-bad-share')}). The last: {bad.why}"
        )


def _fuse(
    seen: Iterable[EncodedFrame], total: VoxelAccumulator, free: FreeViewCollector, tolerance: Tolerance
) -> list[BadFrame]:
    """Add frames up; return those that could not be read."""
    bad: list[BadFrame] = []
    for frame, features in seen:
        if isinstance(frame, BadFrame):
            bad.append(frame)
            tolerance.meet(frame)
        else:
            total.add(frame, features)
            free.add(frame)
    return bad


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
