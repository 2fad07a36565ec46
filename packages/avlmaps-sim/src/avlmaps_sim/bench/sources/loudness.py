"""What the loudness of a sound would be worth to one microphone, were it known: a bound, by the truth.

In a room the level falls little beyond the distance at which as much sound comes back from the walls as comes straight,
so that a loudness that is known leaves the distance nearly as unsure as one that is not. Hence no option takes one.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.event import BEFORE_S
from avlmaps.maps.sources.find import LEAST
from avlmaps.maps.sources.level import against_1_m_db, levels_db
from avlmaps.maps.sources.settings import SourceSettings
from avlmaps.maps.types import SourceEvidence
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels

KNOWN_DB = 2.0
"""Standard deviation of what is known of the loudness."""


def loudness_known(
    track: AudioTrack,
    walk: Trajectory,
    span_s: tuple[float, float],
    true: Float[np.ndarray, "3"],
    evidence: SourceEvidence,
    number: int,
    rng: np.random.Generator,
) -> SourceEvidence:
    """Return the evidence of one microphone, with that of the loudness of one sound.

    ``true`` is where it sounded, by which its loudness at 1 m is known to ``KNOWN_DB``; ``rng`` draws by how much it is
    missed.
    """
    assert track.microphones is not None
    begin_s = max(span_s[0] - BEFORE_S, track.start_s)
    sound = read_channels(track, begin_s, min(span_s[1], track.end_s))
    at_s, level_db = levels_db(sound.samples[0], sound.rate_hz, begin_s, span_s[0] - begin_s)
    if not len(at_s):
        return evidence
    inside = np.clip(at_s, walk.stamps_s[0], walk.stamps_s[-1])
    ear = track.microphones.in_world_m(walk.at(inside))
    place = np.concatenate([np.asarray(evidence.place, np.float64), true[None]])
    away = np.linalg.norm(ear - place, axis=2)
    at_1_m_db = (level_db[:, None] - against_1_m_db(away, SourceSettings.of(1).reverberant_m)).mean(axis=0)
    off = at_1_m_db[:-1] - at_1_m_db[-1] - KNOWN_DB * rng.standard_normal()
    heard = np.array(evidence.heard)
    total = heard[number].astype(np.float64) - 0.5 * (off / KNOWN_DB) ** 2
    heard[number] = np.maximum(total - total.max(), LEAST)
    return replace(evidence, heard=heard)
