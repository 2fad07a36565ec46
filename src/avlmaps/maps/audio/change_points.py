"""Cutting a track where what sounds changes, for encoders that give a feature every few hundredths of a second.

No loudness decides what is a sound: the whole track is encoded, and it is divided so that the features of each stretch
are as alike as they can be. Exactly: the division is found whose squared distances from the stretches' means, and a
price for each stretch, add up to the least (Jackson et al. 2005, optimal partitioning). The price is ``change_s`` in
frames. Unit vectors that have nothing in common lie √2 apart, so that cutting an event of n such frames out of its
surroundings saves 2·n and costs two prices: what lasts ``change_s`` and is wholly unlike what is round it becomes a
stretch of its own, and what is half unlike must last twice as long. There is nothing that depends on the track's level
or on its noise. Fixed windows would be simpler, but would cut every event that lies across two of them, and put its
place half a window away.
"""

import numpy as np

from avlmaps.core.arrays import Float, Float32, Int
from avlmaps.core.errors import BackendError
from avlmaps.core.progress import progress
from avlmaps.maps.audio.settings import SoundChangeSettings
from avlmaps.perception.protocols import FrameSoundEncoder
from avlmaps.recordings.audio import AudioTrack

_ENCODED_S = 26.0
_CONTEXT_S = 2.0  # heard on either side of a block, so that its first and last frames know what is round them
_AT_ONCE = 256
_USUAL_CHANGES = SoundChangeSettings()


def frames_of_track(track: AudioTrack, encoder: FrameSoundEncoder) -> Float32[np.ndarray, "frames d"]:
    """Return the feature of every step of a track, which is read a block at a time.

    Raises:
        AudioError: the track cannot be read.
        BackendError: the encoder gives another number of features than its step promises, or none that are finite.
    """
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
    """Return where a sequence of unit vectors is divided: 0, the first frame of each further stretch, their number.

    Args:
        features: in the order of time; none gives the single edge 0.
        hop_s: seconds from one to the next.
        settings: how.
    """
    count = len(features)
    price = settings.change_s / hop_s
    shortest = max(1, round(price))
    longest = max(2 * shortest, int(settings.max_length_s / hop_s))
    if count <= shortest:
        return np.unique([0, count])
    best = np.full(count + 1, -np.inf)
    best[0] = 0.0
    before = np.zeros(count + 1, np.int64)
    for begin in range(1, count + 1, _AT_ONCE):
        ends = np.arange(begin, min(begin + _AT_ONCE, count + 1))
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
    """Return the gain of a stretch from each start to each end: n·|mean|²; the last column starts one frame before.

    Sums of squares are the same however a sequence is divided, so that what is saved is all that counts.
    """
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
