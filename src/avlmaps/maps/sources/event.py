"""The evidence of one sound: what its microphones say of every candidate."""

from dataclasses import dataclass

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.candidates import Candidates
from avlmaps.maps.sources.correlation import Correlations, correlate
from avlmaps.maps.sources.level import levels_db, unknown_offset
from avlmaps.maps.sources.settings import SourceSettings
from avlmaps.maps.sources.steered import loudest_frames, steer
from avlmaps.maps.sources.walls import Walls
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels
from avlmaps.recordings.microphones import Microphones

BEFORE_S, AFTER_S = 1.0, 0.2
_LONGEST_S = 10.0
_LEG_M = 0.5  # what is hidden is looked up again after this path
_LOWEST_M, _HIGHEST_M = -1.1, 0.6  # of the air in a doorway, from the ear


@dataclass(frozen=True, slots=True, eq=False)
class EventEvidence:
    """What was heard of one sound.

    Attributes:
        heard: (c,) log-likelihood of each candidate by what the microphones say, the greatest 0.
        halves: (2, c) those of its first and of its second half, where there are frames in both.
        expected: (c,) log-likelihood without it: near the robot, in sight.
    """

    heard: Float[np.ndarray, " c"]
    halves: Float[np.ndarray, "2 c"] | None
    expected: Float[np.ndarray, " c"]


def evidence_of(
    track: AudioTrack,
    microphones: Microphones,
    walk: Trajectory,
    span_s: tuple[float, float],
    candidates: Candidates,
    walls: Walls,
    settings: SourceSettings,
    signs: Float[np.ndarray, " m"],
) -> EventEvidence:
    """Return the evidence of a sound.

    The walk's poses are of the level frame, the span is onset and offset; ``signs`` has -1 for a channel that is wired
    the other way round.

    Raises:
        AudioError: the track cannot be read.
    """
    onset_s, offset_s = span_s[0], min(span_s[1], span_s[0] + _LONGEST_S)
    begin_s = max(onset_s - BEFORE_S, track.start_s)
    sound = read_channels(track, begin_s, min(offset_s + AFTER_S, track.end_s))
    place = candidates.place_m.astype(np.float64)
    if len(microphones) == 1:
        at_s, level_db = levels_db(sound.samples[0], sound.rate_hz, begin_s, onset_s - begin_s)
        ear = _ears(walk, microphones, at_s if len(at_s) else np.array([onset_s, offset_s]))
        legs = Legs.of(ear[:, 0], walls, place)
        heard = np.zeros(len(place))
        if len(level_db) > 1:
            away = np.linalg.norm(ear - place, axis=2)
            heard = unknown_offset(level_db, away, settings.level_noise_db, settings.reverberant_m)
        return EventEvidence(heard - heard.max(initial=-np.inf), None, legs.expected(settings))
    found = correlate(
        sound.samples, sound.rate_hz, begin_s, onset_s - begin_s, microphones.longest_m, delay_s=microphones.delay_s
    )
    found = found.take(loudest_frames(found)).turned(signs).smoothed(settings.smoothing)
    if not len(found.at_s):
        ear = _ears(walk, microphones, np.array([onset_s, offset_s]))
        return EventEvidence(np.zeros(len(place)), None, Legs.of(ear.mean(axis=1), walls, place).expected(settings))
    ear = _ears(walk, microphones, found.at_s)
    legs = Legs.of(ear.mean(axis=1), walls, place)
    middle = len(found.at_s) // 2
    first, second = legs.steered(found, ear, place, middle)
    total = _weighed(first + second, found, settings)
    if not middle:
        return EventEvidence(total, None, legs.expected(settings))
    early, late = (found.take(rows) for rows in np.array_split(np.arange(len(found.at_s)), [middle]))
    halves = np.stack([_weighed(first, early, settings), _weighed(second, late, settings)])
    return EventEvidence(total, halves, legs.expected(settings))


def _weighed(steered: Float[np.ndarray, " c"], found: Correlations, settings: SourceSettings) -> np.ndarray:
    value = settings.weighed(steered, found)
    return value - value.max(initial=-np.inf)


def _ears(walk: Trajectory, microphones: Microphones, at_s: Float[np.ndarray, " k"]) -> Float[np.ndarray, "k m 3"]:
    inside = np.clip(at_s, walk.stamps_s[0], walk.stamps_s[-1])
    return microphones.in_world_m(walk.at(inside))


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """The robot's path in pieces, with what it saw from each.

    Attributes:
        rows: the frames of each piece.
        gate: of each piece, where the path to each candidate is last in sight.
        rest_m: (l, c) length of the path from there; 0 of what is in sight.
        away_m: (l, c) length of the whole path.
    """

    rows: list[np.ndarray]
    gate: list[Float[np.ndarray, "c 2"]]
    rest_m: Float[np.ndarray, "l c"]
    away_m: Float[np.ndarray, "l c"]

    @classmethod
    def of(cls, ear: Float[np.ndarray, "k 3"], walls: Walls, place: Float[np.ndarray, "c 3"]) -> "Legs":
        """Cut a path into pieces and look round from each."""
        gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(ear, axis=0), axis=1))])
        piece = (gone / _LEG_M).astype(int)
        rows = [np.flatnonzero(piece == number) for number in np.unique(piece)]
        middles = [ear[own].mean(axis=0) for own in rows]
        gates, rests = zip(*(walls.seen_through(m[:2], place[:, :2]) for m in middles), strict=True)
        known = [np.where(np.isfinite(gate), gate, place[:, :2]) for gate in gates]
        rest_m = np.stack([np.where(np.isfinite(g[:, 0]), r, 5.0) for g, r in zip(gates, rests, strict=True)])
        away = [np.linalg.norm(gate - m[:2], axis=1) for gate, m in zip(known, middles, strict=True)]
        return cls(rows, known, rest_m, np.stack(away) + rest_m)

    def expected(self, settings: SourceSettings) -> Float[np.ndarray, " c"]:
        """Return the log-likelihood of each candidate by where the robot was."""
        count = np.array([len(own) for own in self.rows], np.float64)
        hidden = (count[:, None] * (self.rest_m > 0.0)).sum(axis=0) / count.sum()
        return -settings.hidden * hidden - self.away_m.min(axis=0) / settings.reach_m

    def steered(
        self, found: Correlations, ear: Float[np.ndarray, "f m 3"], place: Float[np.ndarray, "c 3"], middle: int
    ) -> tuple[Float[np.ndarray, " c"], Float[np.ndarray, " c"]]:
        """Return the steered sums of the frames before the middle one, and of the others."""
        halves = [np.zeros(len(place)), np.zeros(len(place))]
        for own, gate, rest_m in zip(self.rows, self.gate, self.rest_m, strict=True):
            height = ear[own, :, 2].mean()
            seems = place.copy()
            seems[:, :2] = gate
            hidden = rest_m > 0.0
            seems[hidden, 2] = np.clip(seems[hidden, 2], height + _LOWEST_M, height + _HIGHEST_M)
            for half, rows in enumerate((own[own < middle], own[own >= middle])):
                if len(rows):
                    halves[half] += steer(found.take(rows), ear[rows], seems)
        return halves[0], halves[1]
