"""Where the sounds are in a track: short-time energy against a background that is measured all along.

A frame's excess is the mean over the bands of its power divided by the background's, so that every band of a coloured
background counts alike. A sound is a run of frames above ``release_db`` that somewhere passes ``onset_db``; runs that a
short pause divides (barks of one dog) are one sound. The paper's own rule, a fixed threshold on the samples, is there
as ``method="silence"``.

An encoder with a feature every few hundredths of a second needs no loudness: the track is divided so that squared
distances of features from their stretch's mean, and a price for each stretch, add up to the least (Jackson et al. 2005,
optimal partitioning). Unit vectors that have nothing in common lie √2 apart, so that what lasts ``change_s`` and is
wholly unlike what is round it becomes a stretch of its own, and what is half unlike must last twice as long.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.errors import BackendError
from avlmaps.core.progress import progress
from avlmaps.maps.audio.background import band_powers, find_noise_floor, hop_samples
from avlmaps.maps.settings import SegmentationSettings, SoundChangeSettings
from avlmaps.perception.protocols import FrameSoundEncoder
from avlmaps.recordings.audio import AudioTrack

_BLOCK_S = 10.0
_AT_ONCE = 100_000  # frames
_USUAL = SegmentationSettings()


@dataclass(frozen=True, slots=True)
class Segment:
    """A stretch of the track in which something sounds, the recording's time."""

    onset_s: float
    offset_s: float

    @property
    def duration_s(self) -> float:
        """Length in seconds."""
        return self.offset_s - self.onset_s


_Run = tuple[int, int]  # the first frame (or sample) that is sound, and the one after the last


def segment(track: AudioTrack, settings: SegmentationSettings = _USUAL) -> list[Segment]:
    """Find the sounds in a track: disjoint segments in the order of time; none for a silent track."""
    if settings.method == "silence":
        return _padded(_loud_runs(track, settings), settings, 1.0 / track.rate_hz, track)
    powers, step_s = band_powers(track.blocks(_BLOCK_S)), hop_samples(track.rate_hz) / track.rate_hz
    floor = find_noise_floor(powers, track.rate_hz, settings.background_window_s, settings.range_db)
    if floor.loudest <= 0.0:
        return []
    parts = np.array_split(powers, range(_AT_ONCE, len(powers), _AT_ONCE))
    over = (part / floor.at(number * _AT_ONCE, len(part)) for number, part in enumerate(parts))
    excess = np.concatenate([part.mean(axis=1) for part in over])
    gap, longest = (limit_s / step_s + 1e-6 for limit_s in (settings.merge_gap_s, settings.max_length_s))
    runs = _merged(_runs(excess, settings, step_s), gap, longest)
    return _padded(runs, settings, step_s, track)


def _runs(excess: Float32[np.ndarray, " frames"], settings: SegmentationSettings, step_s: float) -> Iterator[_Run]:
    onset, release = (10.0 ** (level / 10.0) for level in (settings.onset_db, settings.release_db))
    longest, length = max(2, int(settings.max_length_s / step_s)), max(1, round(settings.smoothing_s / step_s))
    padded = np.pad(excess, ((length - 1) // 2, length // 2), constant_values=1.0)
    smooth = np.convolve(padded, np.full(length, 1.0 / length), mode="valid").astype(np.float32)
    edges = np.flatnonzero(np.diff(smooth > release, prepend=False, append=False))
    for begin, end in edges.reshape(-1, 2).tolist():
        cuts = [begin]
        while end - cuts[-1] >= longest:
            half = cuts[-1] + longest // 2
            cuts.append(half + int(np.argmin(smooth[half : cuts[-1] + longest])))
        for first, last in pairwise([*cuts, end]):
            if last > first and float(smooth[first:last].max()) > onset:
                run = excess[first:last]
                audible = max(release, float(run.max()) * 10.0 ** (-settings.tail_db / 10.0))
                loud = np.flatnonzero(run > audible)
                yield first + int(loud[0]), first + int(loud[-1]) + 1


def _merged(runs: Iterable[_Run], gap: float, longest: float) -> list[_Run]:
    merged: list[_Run] = []
    for begin, end in runs:
        if merged and begin - merged[-1][1] <= gap and end - merged[-1][0] <= longest:
            merged[-1] = merged[-1][0], end
        else:
            merged.append((begin, end))
    return merged


def _loud_runs(track: AudioTrack, settings: SegmentationSettings) -> Iterator[_Run]:
    gap, longest = round(settings.silence_s * track.rate_hz), int(settings.max_length_s * track.rate_hz)
    pieces: list[_Run] = []
    at = 0
    for block in track.blocks(_BLOCK_S):
        loud = at + np.flatnonzero(np.abs(block.samples) > settings.silence_threshold)
        at += len(block.samples)
        if len(loud):
            breaks = np.flatnonzero(np.diff(loud) >= gap)
            first, last = loud[np.append(0, breaks + 1)], loud[np.append(breaks, len(loud) - 1)] + 1
            pieces += zip(first.tolist(), last.tolist(), strict=True)
    for begin, end in _merged(pieces, gap - 1, np.inf):
        cuts = range(begin, end, longest)
        yield from zip(cuts, [*cuts[1:], end], strict=True)


def _padded(runs: Iterable[_Run], settings: SegmentationSettings, step_s: float, track: AudioTrack) -> list[Segment]:
    kept = [run for run in runs if (run[1] - run[0]) * step_s >= settings.min_length_s]
    segments: list[Segment] = []
    for i, (begin, end) in enumerate(kept):
        earliest = (kept[i - 1][1] + begin) / 2.0 * step_s if i else 0.0
        latest = (end + kept[i + 1][0]) / 2.0 * step_s if i + 1 < len(kept) else track.duration_s
        onset_s = max(begin * step_s - settings.padding_s, earliest)
        offset_s = min(end * step_s + settings.padding_s, latest, track.duration_s)
        segments.append(Segment(track.start_s + onset_s, track.start_s + offset_s))
    return segments


_ENCODED_S = 26.0
_CONTEXT_S = 2.0  # heard on either side of a block, so that its first and last frames know what is round them
_ENDS_AT_ONCE = 256
_USUAL_CHANGES = SoundChangeSettings()


def frames_of_track(track: AudioTrack, encoder: FrameSoundEncoder) -> Float32[np.ndarray, "frames d"]:
    """Return the feature of every step of a track, which is read a block at a time."""
    hop_s = encoder.hop_s
    count = int(np.ceil(round(track.duration_s / hop_s, 6)))
    core, context = max(1, round(_ENCODED_S / hop_s)), round(_CONTEXT_S / hop_s)
    features = np.zeros((count, encoder.card.dim), np.float32)
    begins = range(0, count, core)
    for at in progress(begins, "hearing", unit="block") if count else begins:
        begin, end = max(0, at - context), min(count, at + core + context)
        last_s = min(track.start_s + end * hop_s, track.end_s)
        rows = np.asarray(encoder.encode(track.read(track.start_s + begin * hop_s, last_s)), np.float32)
        _check(rows, end - begin, encoder, last_s - (track.start_s + begin * hop_s))
        here = min(count, at + core)
        features[at:here] = rows[at - begin : here - begin]
    return features


def _check(rows: Float32[np.ndarray, "..."], wanted: int, encoder: FrameSoundEncoder, seconds: float) -> None:
    shapes = ((wanted, encoder.card.dim), (wanted + 1, encoder.card.dim))  # one more where a rate was rounded up
    if rows.shape not in shapes or not np.isfinite(rows).all():
        raise BackendError(
            f"The sound model {encoder.card.id} returned features of {rows.shape} for {seconds:.2f} s; its card and "
            f"its step of {encoder.hop_s} s promise finite ones of {shapes[0]}."
        )


def split_at_changes(
    features: Float32[np.ndarray, "frames d"], hop_s: float, settings: SoundChangeSettings = _USUAL_CHANGES
) -> Int[np.ndarray, " edges"]:
    """Return where a sequence of unit vectors is divided: 0, the first frame of each further stretch, their number."""
    count = len(features)
    price = settings.change_s / hop_s
    shortest = max(1, round(price))
    longest = max(2 * shortest, int(settings.max_length_s / hop_s))
    if count <= shortest:
        return np.unique([0, count])
    best = np.full(count + 1, -np.inf)
    best[0] = 0.0
    before = np.zeros(count + 1, np.int64)
    for begin in range(1, count + 1, _ENDS_AT_ONCE):
        ends = np.arange(begin, min(begin + _ENDS_AT_ONCE, count + 1))
        gains = _gains(features, ends, longest)
        for end, gain in zip(ends.tolist(), gains, strict=True):
            if end < shortest:
                continue
            # starts of stretches that end here, the earliest first
            starts = np.arange(max(0, end - longest), end - shortest + 1)
            total = best[starts] + gain[longest - end + starts] - price
            choice = int(np.argmax(total))
            best[end], before[end] = total[choice], starts[choice]
    edges = [count]
    while edges[-1]:
        edges.append(int(before[edges[-1]]))
    return np.array(edges[::-1])


def _gains(
    features: Float32[np.ndarray, "frames d"], ends: Int[np.ndarray, " e"], longest: int
) -> Float[np.ndarray, "e longest"]:
    first = max(0, int(ends[0]) - longest)
    sums = np.zeros((int(ends[-1]) - first + 1, features.shape[1]))
    np.cumsum(features[first : ends[-1]], axis=0, out=sums[1:])
    square = np.einsum("nd,nd->n", sums, sums)
    own = ends - first
    products = sums[own] @ sums.T
    gains = np.zeros((len(ends), longest))
    for row, product in enumerate(products):
        end = int(own[row])
        starts = np.arange(max(0, end - longest), end)
        apart = square[end] + square[starts] - 2.0 * product[starts]
        gains[row, longest - end + starts] = apart / (end - starts)
    return gains
