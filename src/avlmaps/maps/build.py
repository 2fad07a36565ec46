"""From a recording to a map: a ``Mapper`` takes its frames, and what each stretch of them brings is stored."""

from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from itertools import islice
from pathlib import Path
from time import perf_counter

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import user_path
from avlmaps.core.machine import run_ahead
from avlmaps.core.progress import progress, silence_progress
from avlmaps.core.registry import Kind
from avlmaps.core.wording import option
from avlmaps.maps.estimate import Start, doubts_of
from avlmaps.maps.frame_sums import bad_frames, load_state, save_state
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.perceived import encode_pixels
from avlmaps.maps.plan import BuildPlan, Span, claim, make_plan, require_unchanged, strip_folder
from avlmaps.maps.settings import DEFAULTS, BuildSettings
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.maps.store.map_data import Finds, MapData, find_nothing
from avlmaps.maps.store.tables import lock_folder
from avlmaps.perception.cache import DEFAULT_CACHE, CacheSettings, cache_note, with_cache
from avlmaps.perception.encoders import Encoders, encoders_of
from avlmaps.perception.protocols import BatchPixelEncoder, PixelEncoder
from avlmaps.recordings.types import Frame, Ground, Recording

_MOST_HELD = 4  # frames in memory for each that is encoded
EncodedFrame = tuple[Frame | BadFrame, Float32[np.ndarray, "hf wf d"] | None]


Workers = Callable[[BuildPlan, Start, dict[Path, Span]], Iterator[Path]]
"""Stores what each stretch of frames brings in its file (``map_span``), and yields each that is done: a cluster."""


def build_map(
    recording: Recording,
    path: Path | str,
    profile: str | Encoders = "embedded",
    settings: BuildSettings = DEFAULTS,
    *,
    cache: CacheSettings = DEFAULT_CACHE,
    workers: Workers | None = None,
    allow: Sequence[str] = (),
    resume: bool = True,
    overwrite: bool = False,
    progress: bool = True,
    finds: Finds = find_nothing,
) -> MapData:
    """Build a map of a recording, or finish one that was begun; ``api.build_map`` says what the arguments are.

    A build that is killed at any instant continues from its last finished stretch of frames when it is started again,
    and ends with the same map. A finished map in the folder stays whole and readable until the new one replaces it.
    ``workers`` map the stretches, this process if None; a ``cache`` stores features, so that another build of the same
    frames encodes nothing again; what ``finds`` finds by the encoders (``query.avlmap.with_findings``) is stored with
    the map.
    """
    began_s, stamp = perf_counter(), recording.change_stamp()
    plan = make_plan(recording, user_path(path), with_cache(encoders_of(profile), cache), settings)
    with silence_progress(not progress), lock_folder(plan.path):
        if claim(plan, resume, overwrite) is None:
            doubts = doubts_of(recording, allow)
            start = Start.of(recording, plan.settings)
            _map_frames(plan, start, workers)
            mapper = Mapper.of_recording(
                recording, plan.settings, plan.encoders, start, plan.keyframes, plan.key, doubts
            )
            mapper.began_s = began_s
            for file in plan.spans():
                mapper.add_state(load_state(file))
            made = finds(mapper.finish(), plan.encoders)
            require_unchanged(plan, stamp)
            write(plan.path, made)
    return read(plan.path)


def map_span(plan: BuildPlan, start: Start, frames: Iterable[EncodedFrame], file: Path) -> None:
    """Map a stretch of frames and store what it brings."""
    mapper = Mapper.of_recording(plan.recording, plan.settings, plan.encoders, start, plan.keyframes)
    for frame, features in frames:
        if isinstance(frame, BadFrame):
            mapper.leave_out(frame.index, frame.why)
        else:
            mapper.add(frame, features, encode=False)
    save_state(file, plan.key, mapper.state())


def spans_of_frames(plan: BuildPlan, start: Start, spans: Sequence[Span]) -> Generator[EncodedFrame]:
    """Yield the frames of stretches with their features, decoded and encoded ahead, each in a thread of its own."""
    encoder = plan.encoders.pixels if Kind.PIXELS in plan.encoders else None
    return encode_frames(plan.recording, [range(*span) for span in spans], encoder, plan.looks, start.ground)


def _map_frames(plan: BuildPlan, start: Start, workers: Workers | None) -> None:
    spans, step = plan.spans(), plan.settings.frames.step
    known = {file: bad_frames(file, plan.key) for file in spans}
    jobs = {file: span for file, span in spans.items() if known[file] is None}
    meet = _tolerance(plan, sum(len(bad or ()) for bad in known.values()))
    total = len(range(0, len(plan.recording), step))
    done = total - sum(len(range(*span)) for span in jobs.values())
    if not jobs:
        return
    if workers is not None:
        ended = workers(plan, start, jobs)
        for file in progress(ended, "fusing", total=total, done=done, size=lambda at: len(range(*jobs[at]))):
            for one in bad_frames(file, plan.key) or ():
                meet(one)
        return
    with closing(spans_of_frames(plan, start, list(jobs.values()))) as ahead:
        note = lambda: cache_note(plan.encoders, Kind.PIXELS)  # noqa: E731
        seen = _watched(progress(ahead, "fusing", total=total, done=done, note=note), meet)
        for file, span in jobs.items():
            try:
                map_span(plan, start, islice(seen, len(range(*span))), file)
            except KeyboardInterrupt:
                raise KeyboardInterrupt(f"stopped; the same build continues from frame {span[0]}") from None
        for _ in seen:  # nothing is left; this completes the bar
            pass


def _watched(frames: Iterable[EncodedFrame], meet: Callable[[BadFrame], None]) -> Iterator[EncodedFrame]:
    for frame, features in frames:
        if isinstance(frame, BadFrame):
            meet(frame)
        yield frame, features


def _tolerance(plan: BuildPlan, met: int) -> Callable[[BadFrame], None]:
    """Return what counts the frames that cannot be read, and raises ``RecordingError`` when there are too many."""
    frames = plan.settings.frames
    total = len(range(0, len(plan.recording), frames.step))
    allowed = int(frames.max_bad_share * total) if frames.on_bad == "skip" else 0

    def meet(bad: BadFrame) -> None:
        nonlocal met
        met += 1
        if met > allowed:
            raise RecordingError(
                f"{met} of {total} frames cannot be read, more than the {allowed} that may be left out; fix the "
                f"recording or allow more ({option('max-bad-share')}). The last: {bad.why}"
                if allowed
                else bad.why
            )

    return meet


def encode_frames(
    recording: Recording,
    stretches: Sequence[Sequence[int]],
    encoder: PixelEncoder | None,
    chosen: Collection[int] | None = None,
    ground: Ground | None = None,
) -> Generator[EncodedFrame]:
    """Yield the frames with their features, in order; one that cannot be read yields its fault in its place.

    No batch reaches from one of the ``stretches`` into the next, so that a build that continues from a stretch encodes
    the same batches as one that was never stopped. Without an encoder frames come alone, as do those that are not
    ``chosen``. An encoder that wants to know up and the floor has them from ``ground``.
    """
    size = max(1, encoder.batch) if isinstance(encoder, BatchPixelEncoder) else 1

    def read() -> Generator[list[Frame | BadFrame]]:
        for stretch in stretches:
            for group in _groups(stretch, size, chosen):
                yield [_frame(recording, index, ground) for index in group]

    def encoded() -> Generator[EncodedFrame]:
        with closing(run_ahead(read())) as groups:
            for group in groups:
                frames = [one for one in group if isinstance(one, Frame) and (chosen is None or one.index in chosen)]
                found = [] if encoder is None else encode_pixels(encoder, frames)
                features = dict(zip((frame.index for frame in frames), found, strict=False))
                for one in group:
                    yield one, features.pop(one.index, None)

    with closing(run_ahead(encoded())) as frames:
        yield from frames


def _frame(recording: Recording, index: int, ground: Ground | None) -> Frame | BadFrame:
    try:
        frame = recording.frame(index)
        return frame if ground is None else replace(frame, ground=ground)
    except RecordingError as fault:
        return BadFrame(index=index, why=strip_folder(str(fault), recording))


def _groups(stretch: Sequence[int], size: int, chosen: Collection[int] | None) -> Iterator[list[int]]:
    group: list[int] = []
    wanted = 0
    for index in stretch:
        group.append(index)
        wanted += chosen is None or index in chosen
        if wanted == size or len(group) >= _MOST_HELD * size:
            yield group
            group, wanted = [], 0
    if group:
        yield group
