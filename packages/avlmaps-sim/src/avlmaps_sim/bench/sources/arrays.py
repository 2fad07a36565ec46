"""The arrays that the suite compares: channels of one recording, so that all hear the same walk."""

from pathlib import Path

from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import ChannelSound, read_channels, with_microphones, write_channels

RECORDED = "square4"
ARRAYS: dict[str, tuple[int, ...]] = {"square4": (0, 1, 2, 3), "stereo": (0, 1), "mono": (0,)}
"""Channels of the square of four that each array has: its two front ones are 0.2 m apart."""


def track_of(track: AudioTrack, array: str, folder: Path) -> AudioTrack:
    """Return a track of the channels of one of ``ARRAYS``, written into a folder."""
    assert track.microphones is not None
    chosen = ARRAYS[array]
    whole = read_channels(track, track.start_s, track.end_s)
    path = folder / f"{array}.flac"
    write_channels(path, ChannelSound(whole.samples[list(chosen)], whole.rate_hz))
    return with_microphones(AudioTrack.open(path, track.start_s), track.microphones.take(chosen))
