"""Pieces of sound out of the messages of a running robot."""

from collections.abc import Callable
from math import radians
from typing import Any

import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.core.motion import wrap_angle
from avlmaps.core.wording import option
from avlmaps.live.growing_folder import Once
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.channels import ChannelSound
from avlmaps.recordings.formats.ros_messages import stamp_of
from avlmaps.recordings.formats.ros_sound import BEYOND_A_TURN_RAD, Pcm, angle_of, sampled_pieces
from avlmaps.recordings.microphones import Microphones

HELD = 100  # floats that wait until one is no angle in radians; if all are, they are taken as radians


class RosDirections:
    """Reads the azimuths on one topic, in radians, as a bag's are read, and says when each was.

    Whole numbers are degrees. Floats are radians unless one is beyond a turn, so that the first ones are held back.
    ``unread`` counts messages before the first picture, whose clock is that of the map.
    """

    def __init__(self, topic: str, tell: Callable[[str], None]) -> None:
        self.unread = 0
        self._topic, self._once = topic, Once(tell)
        self._held: list[tuple[float, float]] | None = []
        self._in_degrees = False

    def take(self, message: Any, ahead_s: float | None, now_s: float) -> list[tuple[float, float]]:
        """Return the directions that are known now: when, and the azimuth in radians.

        The pictures' stamps are ahead of this machine's clock by ``ahead_s``; None before the first.
        """
        angle, is_whole = angle_of(message)
        if hasattr(message, "pose"):
            return [(stamp_of(message), angle)]
        if ahead_s is None:
            self.unread += 1
            return []
        if (is_whole or abs(angle) > BEYOND_A_TURN_RAD) and not self._in_degrees:
            self._in_degrees = True
            late = "" if self._held is not None else " from now on; those before were taken as radians"
            self._once(f"The directions of {self._topic} are taken as degrees{late}.")
        one = now_s + ahead_s, angle
        if self._held is None:
            return [self._in_radians(one)]
        self._held.append(one)
        return self.rest() if self._in_degrees or len(self._held) >= HELD else []

    def rest(self) -> list[tuple[float, float]]:
        """Return those that are held back; from now on none is."""
        held, self._held = self._held or [], None
        return [self._in_radians(one) for one in held]

    def _in_radians(self, one: tuple[float, float]) -> tuple[float, float]:
        stamp_s, angle = one
        return stamp_s, wrap_angle(radians(angle) if self._in_degrees else angle)


DRIFT_S = 0.1  # sound without stamps is given a place again where it is off by more than this, seconds
INFO_WITHIN_S = 2.0
"""An AudioInfo that has not come within this time of its sound is said to be missing; it may come later still."""


class RosSound:
    """Reads the messages of one topic, and says when each sounds; ``unheard`` counts those that could not be used.

    AudioStamped has stamps and says how it is coded. AudioData is bytes of 16-bit samples, whose rate ``pcm`` or an
    AudioInfo says, which may come later than the sound; without a stamp it ends when it came.
    """

    def __init__(
        self, topic: str, tell: Callable[[str], None], pcm: Pcm | None = None, microphones: Microphones | None = None
    ) -> None:
        """Without ``pcm`` an AudioInfo says it; without microphones all channels are mixed."""
        self.unheard, self._microphones = 0, microphones
        self._topic, self._pcm, self._rest, self._end_s = topic, pcm, b"", float("-inf")
        self._tell, self._once = tell, Once(tell)
        self._is_given, self._first_s = pcm is not None, float("inf")
        self._why = (
            f"Nothing says how the sound on {topic} is coded, so that it is left out until something does; publish its "
            "AudioInfo, say how many samples a second and in how many channels "
            f"({option('topics', 'audio_pcm=16000,1')}), or leave it out ({option('topics', 'audio=none')})."
        )

    def inform(self, info: Any) -> None:
        """Take an AudioInfo, which says how AudioData is coded; what the caller says counts, as in a bag."""
        if self._is_given:
            return
        try:
            pcm = self._coding(info)
        except RecordingError as fault:
            self._pcm, self._rest, self._why = None, b"", str(fault)
            self._once(self._why)
            return
        if pcm != self._pcm:
            self._pcm, self._rest = pcm, b""
            before = f"; {self.unheard} messages before could not be used" if self.unheard else ""
            self._tell(
                f"note: The sound on {self._topic} is used from now on: {pcm.rate_hz} samples a second, "
                f"{pcm.channels} channel(s){before}."
            )

    def _coding(self, info: Any) -> Pcm:
        coding, samples = (str(getattr(info, of, "") or "")[:20] for of in ("coding_format", "sample_format"))
        if coding.lower() not in ("wave", "wav", "pcm") or (samples or "S16LE").upper() != "S16LE":
            raise RecordingError(
                f"The sound on {self._topic} is coded as {coding!r} {samples!r}; a live map takes "
                f"16-bit samples (S16LE): record them so, or leave the sound out ({option('topics', 'audio=none')})."
            )
        return Pcm.check_rate(int(info.sample_rate), int(info.channels), f"The AudioInfo of {self._topic}")

    def take(self, message: Any, ahead_s: float | None, now_s: float) -> tuple[Sound | ChannelSound, float] | None:
        """Return a message's sound, and when it begins; None where it cannot be used. See `RosDirections.take`."""
        found, is_stamped = self._samples(message, now_s), getattr(message, "header", None) is not None
        if found is None or not (is_stamped or ahead_s is not None):
            self.unheard += 1
            return None
        pcm, samples = found
        if not len(samples):
            return None
        length_s = len(samples) / pcm.rate_hz
        if is_stamped:
            begin_s = stamp_of(message)
        else:
            assert ahead_s is not None
            begin_s = now_s + ahead_s - length_s
            if abs(begin_s - self._end_s) < DRIFT_S:
                begin_s = self._end_s
        self._end_s = begin_s + length_s
        if (placed := self._microphones) is not None:
            if placed.channels and max(placed.channels) < samples.shape[1]:
                samples = samples[:, list(placed.channels)]
            if samples.shape[1] == len(placed):
                return ChannelSound(samples.T.astype(np.float32), pcm.rate_hz), begin_s
            self._once(
                f"The sound on {self._topic} has {samples.shape[1]} channel(s), but {len(placed)} microphone(s) are "
                "described, so that they are mixed into one and where sounds came from is not known; give one position "
                f"for each channel ({option('microphones', 'FILE')})."
            )
        return Sound(samples.mean(axis=1).astype(np.float32), pcm.rate_hz), begin_s

    def _samples(self, message: Any, now_s: float) -> tuple[Pcm, np.ndarray] | None:
        """Return the samples of a message, (n, channels); None where nothing says how to read them."""
        if hasattr(getattr(message, "audio", None), "audio_data"):
            try:
                return next(iter(sampled_pieces([message], self._topic)))
            except RecordingError as fault:
                self._once(str(fault))
                return None
        if self._pcm is None:
            self._first_s = min(self._first_s, now_s)
            if now_s - self._first_s > INFO_WITHIN_S:
                self._once(self._why)
            return None
        content = np.asarray(getattr(message, "audio", message).data, np.uint8).tobytes()
        content = self._rest + content  # a message may end within a sample
        size = 2 * self._pcm.channels
        whole = len(content) // size * size
        self._rest = content[whole:]
        return self._pcm, np.frombuffer(content[:whole], "<i2").reshape(-1, self._pcm.channels) / 2.0**15
