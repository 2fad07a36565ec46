"""Changing the rate of a sound, with libsoxr."""

import numpy as np

from avlmaps.recordings.audio import Sound

# librosa's default (``soxr_hq``), with which the published models were made: flat up to 0.91 of the lower Nyquist
# rate, and above it nothing that 20 bits could show.
_QUALITY = "HQ"


def resample(sound: Sound, rate_hz: int) -> Sound:
    """Return the sound at another rate, low-passed so that nothing folds; the same sound where the rate is right.

    Gives what ``librosa.resample`` gives by default: no delay, and a length rounded up to a whole sample. It works
    through a long sound in pieces, so that it needs no more memory than the sound and its answer.

    Args:
        sound: any sound.
        rate_hz: wanted samples a second.
    """
    if sound.rate_hz == rate_hz:
        return sound
    length = -(-len(sound.samples) * rate_hz // sound.rate_hz)
    if length == 0:
        return Sound(np.zeros(0, np.float32), rate_hz)
    import soxr

    found = soxr.resample(np.ascontiguousarray(sound.samples, np.float32), sound.rate_hz, rate_hz, _QUALITY)[:length]
    # soxr rounds the length to the nearest sample
    samples = found if len(found) == length else np.pad(found, (0, length - len(found)))
    return Sound(samples, rate_hz)
