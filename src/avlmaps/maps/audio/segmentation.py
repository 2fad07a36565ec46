"""Where the sounds are in a track: short-time energy against a background that is measured all along.

The track is gone through twice, in blocks: once for its background, once for the sounds. A frame's excess is the
mean over the bands of its power divided by the background's, so that every band of a coloured background counts
alike. A sound is a run of frames above ``release_db`` that somewhere passes ``onset_db``; runs that a short pause
divides (barks of one dog) are one sound. The paper's own rule, a fixed threshold on the samples, is there as
``method="silence"``.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Float32
from avlmaps.maps.audio.filterbank import NoiseFloor, band_powers, find_noise_floor, hop_samples
from avlmaps.maps.audio.settings import SegmentationSettings
from avlmaps.recordings.audio import AudioTrack

_BLOCK_S = 10.0
_USUAL = SegmentationSettings()


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch of the track in which something sounds.

    Attributes:
        onset_s: where it begins, the recording's time.
        offset_s: where it ends.
    """

    onset_s: float
    offset_s: float

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.offset_s - self.onset_s


@dataclass(frozen=True, slots=True)
class _Run:
    """Frames (or samples) ``begin`` to ``end`` that are sound."""

    begin: int
    end: int


def segment(track: AudioTrack, settings: SegmentationSettings = _USUAL) -> list[Segment]:
    """Find the sounds in a track, in constant memory.

    Returns:
        Segments in the order of time, disjoint and within the track; none for a silent track.

    Raises:
        AudioError: the track cannot be read.
    """
    if settings.method == "silence":
        return _padded(list(_loud_runs(track, settings)), settings, 1.0 / track.rate_hz, track)
    return segment_powers(lambda: band_powers(track.blocks(_BLOCK_S)), track, settings)


def segment_powers(
    powers: Callable[[], Iterable[Float32[np.ndarray, "frames bands"]]],
    track: AudioTrack,
    settings: SegmentationSettings,
    loudest: float = 0.0,
) -> list[Segment]:
    """Find the sounds in a track whose band powers are known.

    Args:
        powers: gives the band powers of the whole track, block by block; called twice.
        track: says when it begins and ends.
        settings: how; the method is ``adaptive``.
        loudest: mean power over the bands of the loudest frame of a longer track that this one is the end of.
    """
    step_s = hop_samples(track.rate_hz) / track.rate_hz
    floor = find_noise_floor(powers(), track.rate_hz, settings.background_window_s, settings.range_db, loudest)
    if floor.loudest <= 0.0:
        return []
    runs = _merged(_runs(_excess(powers(), floor), settings, step_s), settings, step_s)
    return _padded(list(runs), settings, step_s, track)


def _excess(
    powers: Iterable[Float32[np.ndarray, "frames bands"]], floor: NoiseFloor
) -> Iterator[Float32[np.ndarray, " frames"]]:
    begin = 0
    for power in powers:
        yield (power / floor.at(begin, len(power))).mean(axis=1)
        begin += len(power)


def _runs(
    excess: Iterable[Float32[np.ndarray, " frames"]], settings: SegmentationSettings, step_s: float
) -> Iterator[_Run]:
    onset, release = (10.0 ** (level / 10.0) for level in (settings.onset_db, settings.release_db))
    longest = max(2, int(settings.max_length_s / step_s))
    begin, open_run = 0, np.zeros((0, 2), np.float32)  # columns: the excess, and smoothed
    at = 0
    for both in _smoothed(excess, max(1, round(settings.smoothing_s / step_s))):
        edges = np.flatnonzero(np.diff(both[:, 1] > release, prepend=False, append=False))
        starts, ends = edges[::2].tolist(), edges[1::2].tolist()
        for start, end in zip(starts, ends, strict=True):
            if start > 0 or not len(open_run):
                yield from _closed(open_run, begin, onset, release, settings)
                begin, open_run = at + start, both[:0]
            open_run = np.concatenate([open_run, both[start:end]])
            while len(open_run) >= longest:
                cut = longest // 2 + int(np.argmin(open_run[longest // 2 : longest, 1]))
                yield from _closed(open_run[:cut], begin, onset, release, settings)
                begin, open_run = begin + cut, open_run[cut:]
        at += len(both)
        if not len(ends) or ends[-1] < len(both):
            yield from _closed(open_run, begin, onset, release, settings)
            open_run = both[:0]
    yield from _closed(open_run, begin, onset, release, settings)


def _closed(
    run: Float32[np.ndarray, "frames 2"], begin: int, onset: float, release: float, settings: SegmentationSettings
) -> Iterator[_Run]:
    if len(run) and float(run[:, 1].max()) > onset:
        audible = max(release, float(run[:, 0].max()) * 10.0 ** (-settings.tail_db / 10.0))
        loud = np.flatnonzero(run[:, 0] > audible)
        yield _Run(begin + int(loud[0]), begin + int(loud[-1]) + 1)


def _smoothed(excess: Iterable[Float32[np.ndarray, " frames"]], length: int) -> Iterator[Float32[np.ndarray, "_ 2"]]:
    before, after = (length - 1) // 2, length // 2
    waiting = np.ones(before, np.float32)
    kernel = np.full(length, 1.0 / length)
    for block in excess:
        waiting = np.concatenate([waiting, block])
        if len(waiting) >= length:
            mean = np.convolve(waiting, kernel, mode="valid").astype(np.float32)
            yield np.stack([waiting[before : before + len(mean)], mean], axis=1)
            waiting = waiting[len(mean) :]
    left = len(waiting) - before
    if left > 0:
        padded = np.concatenate([waiting, np.ones(after, np.float32)])
        mean = np.convolve(padded, kernel, mode="valid").astype(np.float32)[:left]
        yield np.stack([waiting[before:], mean], axis=1)


def _merged(runs: Iterable[_Run], settings: SegmentationSettings, step_s: float) -> Iterator[_Run]:
    last: _Run | None = None
    for run in runs:
        near = last is not None and (run.begin - last.end) * step_s <= settings.merge_gap_s
        if last is not None and near and (run.end - last.begin) * step_s <= settings.max_length_s:
            last = replace(last, end=run.end)
        else:
            if last is not None:
                yield last
            last = run
    if last is not None:
        yield last


def _loud_runs(track: AudioTrack, settings: SegmentationSettings) -> Iterator[_Run]:
    gap, longest = round(settings.silence_s * track.rate_hz), int(settings.max_length_s * track.rate_hz)
    begin = end = at = 0
    for block in track.blocks(_BLOCK_S):
        loud = at + np.flatnonzero(np.abs(block.samples) > settings.silence_threshold)
        at += len(block.samples)
        if not len(loud):
            continue
        breaks = np.flatnonzero(np.diff(loud) >= gap)
        for first, last in zip(loud[np.append(0, breaks + 1)], loud[np.append(breaks, len(loud) - 1)], strict=True):
            if end > begin and first - end >= gap:
                yield _Run(begin, end)
                begin = end = 0
            begin, end = (begin if end > begin else int(first)), int(last) + 1
            while end - begin > longest:
                yield _Run(begin, begin + longest)
                begin += longest
    if end > begin:
        yield _Run(begin, end)


def _padded(runs: list[_Run], settings: SegmentationSettings, step_s: float, track: AudioTrack) -> list[Segment]:
    runs = [run for run in runs if (run.end - run.begin) * step_s >= settings.min_length_s]
    segments: list[Segment] = []
    for i, run in enumerate(runs):
        earliest = (runs[i - 1].end + run.begin) / 2.0 * step_s if i else 0.0
        latest = (run.end + runs[i + 1].begin) / 2.0 * step_s if i + 1 < len(runs) else track.duration_s
        onset_s = max(run.begin * step_s - settings.padding_s, earliest)
        offset_s = min(run.end * step_s + settings.padding_s, latest, track.duration_s)
        segments.append(Segment(track.start_s + onset_s, track.start_s + offset_s))
    return segments
