"""Pieces of sound out of the messages of a running robot."""

from typing import Any

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.core.wording import option
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.formats.ros_audio import Pcm, sampled_pieces

DRIFT_S = 0.1
"""Sound without stamps is given a place again where it is off by more than this, seconds."""


class RosSound:
    """Reads the messages of one topic, and says when each sounds.

    AudioStamped has stamps and says how it is coded. AudioData is bytes of 16-bit samples, whose rate ``pcm`` or an
    AudioInfo says; without a stamp it ends when it came.
    """

    def __init__(self, topic: str, pcm: Pcm | None = None) -> None:
        """Begin without sound.

        Args:
            topic: name, for sentences.
            pcm: of plain samples; None waits for an AudioInfo.
        """
        self._topic, self._pcm, self._rest, self._end_s = topic, pcm, b"", float("-inf")
        self._is_given = pcm is not None

    def inform(self, info: Any) -> None:
        """Take an AudioInfo, which says how AudioData is coded; what the caller says counts, as in a bag.

        Raises:
            RecordingError: as what cannot be read live.
        """
        if self._is_given:
            return
        coding = (getattr(info, "coding_format", "") or "").lower()
        if coding not in ("wave", "wav", "pcm") or (info.sample_format or "S16LE").upper() != "S16LE":
            raise RecordingError(
                f"The sound on {self._topic} is coded as {coding[:20]!r} {info.sample_format[:20]!r}; a live map takes "
                f"16-bit samples (S16LE): record them so, or leave the sound out ({option('topics', 'audio=none')})."
            )
        self._pcm = Pcm.check_rate(int(info.sample_rate), int(info.channels), f"The AudioInfo of {self._topic}")

    def take(self, message: Any, ahead_s: float | None, now_s: float) -> tuple[Sound, float] | None:
        """Return a message's sound, of one channel, and when it begins; None where it holds none.

        Args:
            message: AudioStamped, AudioDataStamped or AudioData.
            ahead_s: by how much the pictures' stamps are ahead of this machine's clock; None before the first.
            now_s: by this machine's clock.

        Raises:
            RecordingError: nothing says how it is coded.
        """
        if hasattr(getattr(message, "audio", None), "audio_data"):
            pcm, samples = next(iter(sampled_pieces([message], self._topic)))
        else:
            pcm, samples = self._plain(getattr(message, "audio", message))
        length_s = len(samples) / pcm.rate_hz
        if not len(samples):
            return None
        if (header := getattr(message, "header", None)) is not None:
            begin_s = header.stamp.sec + 1e-9 * header.stamp.nanosec
        elif ahead_s is None:
            return None
        else:
            begin_s = now_s + ahead_s - length_s
            if abs(begin_s - self._end_s) < DRIFT_S:
                begin_s = self._end_s
        self._end_s = begin_s + length_s
        return Sound(samples.mean(axis=1).astype(np.float32), pcm.rate_hz), begin_s

    def _plain(self, message: Any) -> tuple[Pcm, np.ndarray]:
        if self._pcm is None:
            raise RecordingError(
                f"Nothing says how the sound on {self._topic} is coded; publish its AudioInfo, say how many samples a "
                f"second and in how many channels ({option('topics', 'audio_pcm=16000,1')}), or leave it out "
                f"({option('topics', 'audio=none')})."
            )
        content = self._rest + np.asarray(message.data, np.uint8).tobytes()  # a message may end within a sample
        size = 2 * self._pcm.channels
        whole = len(content) // size * size
        self._rest = content[whole:]
        return self._pcm, np.frombuffer(content[:whole], "<i2").reshape(-1, self._pcm.channels) / 2.0**15
