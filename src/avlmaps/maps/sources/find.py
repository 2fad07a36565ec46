"""Where each sound of a drive began, over the surfaces of its map: of a whole drive, or while it goes on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from avlmaps.core.arrays import Float, Float16, Int
from avlmaps.core.poses import apply, from_rotation, rotation_to_level
from avlmaps.core.progress import progress, say
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.bearings import Bearings, evidence_of_bearings, expected_alone
from avlmaps.maps.sources.candidates import (
    CandidateGrid,
    Candidates,
    Density,
    Legs,
    Walls,
    candidates_of,
    log_same_place,
)
from avlmaps.maps.sources.correlation import (
    MOST_FRAMES,
    Correlations,
    SourceSettings,
    levels_db,
    loudest_of_sound,
    signs_along,
    unknown_offset,
)
from avlmaps.maps.types import SourceEvidence
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import read_channels
from avlmaps.recordings.microphones import Microphones

BEFORE_S, AFTER_S = 1.0, 0.2
_LONGEST_S = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class EventEvidence:
    """What was heard of one sound."""

    heard: Float[np.ndarray, " c"]  # log-likelihood of each candidate by what the microphones say, the greatest 0
    halves: Float[np.ndarray, "2 c"] | None  # of its first and of its second half, where there are frames in both
    expected: Float[np.ndarray, " c"]  # log-likelihood without it: near the robot, in sight


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
    """
    onset_s, offset_s = span_s[0], min(span_s[1], span_s[0] + _LONGEST_S)
    place = candidates.place_m.astype(np.float64)
    if len(microphones) == 1:
        begin_s = max(onset_s - BEFORE_S, track.start_s)
        sound = read_channels(track, begin_s, min(offset_s + AFTER_S, track.end_s))
        at_s, level_db = levels_db(sound.samples[0], sound.rate_hz, begin_s, onset_s - begin_s)
        ear = _ears(walk, microphones, at_s if len(at_s) else np.array([onset_s, offset_s]))
        legs = Legs.of(ear[:, 0], walls, place)
        heard = np.zeros(len(place))
        if len(level_db) > 1:
            away = np.linalg.norm(ear - place, axis=2)
            heard = unknown_offset(level_db, away, settings.level_noise_db, settings.reverberant_m)
        return EventEvidence(heard - heard.max(initial=-np.inf), None, legs.expected(settings))
    found = loudest_of_sound(
        track, microphones, walk, span_s, longest_s=_LONGEST_S, most=MOST_FRAMES, smoothing=settings.smoothing
    ).turned(signs)
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


_NEIGHBOURS = 4
_KNOWN_M = 0.3  # from the nearest candidate of its own map a place counts as known up to this distance
_TINY_M2 = 1e-8


def carry_evidence(
    parts: Sequence[tuple[SourceEvidence, Float[np.ndarray, "4 4"]]],
    voxel_m: Float[np.ndarray, "n 3"],
    robot_m: Float[np.ndarray, "k 3"],
    up_in_world: Float[np.ndarray, "3"],
) -> SourceEvidence | None:
    """Return the evidence of all sounds of some maps over the surfaces of one; None where it has no candidates.

    A candidate has the mean of the nearest ones of the sound's own map, nearer ones counting more. Where its own map
    had none the sound is as likely as there, and the place less so with the distance. The maps, each with
    world_from_its_world, are in the order of the sounds, and of one number of microphones.
    """
    level = rotation_to_level(up_in_world)
    candidates = candidates_of(voxel_m @ level.T, robot_m @ level.T)
    if not len(candidates) or not parts:
        return None
    place = candidates.place_m.astype(np.float64) @ level
    rows = [laid(evidence, moved, place) for evidence, moved in parts]
    return SourceEvidence(
        place=place.astype(np.float32),
        prior=candidates.prior.astype(np.float32),
        heard=np.concatenate([heard for heard, _ in rows]).astype(np.float16),
        expected=np.concatenate([expected for _, expected in rows]).astype(np.float16),
        moving=np.concatenate([evidence.moving for evidence, _ in parts]),
        channels=parts[0][0].channels,
        device=np.concatenate([evidence.device for evidence, _ in parts]),
    )


def laid(
    evidence: SourceEvidence, moved: Float[np.ndarray, "4 4"], place: Float[np.ndarray, "c 3"]
) -> tuple[Float[np.ndarray, "n c"], Float[np.ndarray, "n c"]]:
    """Return the log-likelihoods of other candidates by sounds: with what was heard, and without.

    ``moved`` is from the evidence's world to that of the candidates' places.
    """
    from scipy.spatial import KDTree

    own = apply(moved, np.asarray(evidence.place, np.float64))
    count = min(_NEIGHBOURS, len(own))
    near = KDTree(own).query(place, k=count)
    away_m = np.asarray(near[0], np.float64).reshape(len(place), count)
    row = np.asarray(near[1], np.int64).reshape(len(place), count)
    weight = 1.0 / (away_m**2 + _TINY_M2)
    weight /= weight.sum(axis=1, keepdims=True)
    heard = _means(evidence.heard, row, weight)
    expected = _means(evidence.expected, row, weight)
    reach_m = SourceSettings.of(int(evidence.channels[0])).reach_m
    expected -= np.maximum(away_m[:, 0] - _KNOWN_M, 0.0) / reach_m
    return heard - heard.max(axis=1, keepdims=True), expected


def _means(
    values: Float16[np.ndarray, "n own"], row: Int[np.ndarray, "c k"], weight: Float[np.ndarray, "c k"]
) -> Float[np.ndarray, "n c"]:
    # One sound at a time: an hour's drive has hundreds, each over tens of thousands of candidates.
    means = [(own.astype(np.float64)[row] * weight).sum(axis=1) for own in np.asarray(values)]
    return np.reshape(means, (len(values), len(row)))


_HEIGHT_STEP_M = 0.25
_MOVING = -1.5  # logarithm of the odds below which the two halves of a sound are of two places
LEAST = -60.0  # of a log-likelihood: no difference below matters


def find_sources(
    track: AudioTrack,
    walk: Trajectory,
    spans_s: Sequence[tuple[float, float]],
    voxel_m: Float[np.ndarray, "n 3"],
    up_in_world: Float[np.ndarray, "3"],
    signs_by_s: Sequence[tuple[float, float]] | None = None,
) -> SourceEvidence | None:
    """Return the evidence of every sound over the candidates of a map; None where nothing can be said.

    The track has its microphones, what a device said of directions, or both. Spans are onset and offset of each sound;
    by those of ``signs_by_s``, or all, the signs of the channels are found. Poses, voxels and up are in the world.
    """
    microphones, directions = track.microphones, track.directions
    if (microphones is None and directions is None) or not len(spans_s) or not len(voxel_m):
        return None
    level = rotation_to_level(up_in_world)
    walked = Trajectory(walk.stamps_s, from_rotation(level) @ walk.world_from_body)
    surface = voxel_m @ level.T
    ear = walked.world_from_body[:, :3, 3]
    if microphones is not None:
        ear = microphones.in_world_m(walked.world_from_body).mean(axis=1)
    candidates = candidates_of(surface, ear)
    if not len(candidates):
        return None
    channels = 0 if microphones is None else len(microphones)
    settings, plan = SourceSettings.of(channels), CandidateGrid.of(candidates.place_m)
    walls: dict[int, Walls] = {}
    signs = np.ones(max(channels, 1))
    if microphones is not None:
        signs = signs_along(track, microphones, walked, signs_by_s or spans_s, candidates.place_m, settings)
    layers: list[Walls] = []
    heard: list[EventEvidence] = []
    for begin_s, end_s in progress(spans_s, "sources", unit="sound"):
        span = float(begin_s), float(end_s)
        middle_s = min(max(sum(span) / 2, float(walk.stamps_s[0])), float(walk.stamps_s[-1]))
        height_m = float(ear[int(np.argmin(np.abs(walk.stamps_s - middle_s))), 2])
        layer = round(height_m / _HEIGHT_STEP_M)
        if layer not in walls:
            walls[layer] = Walls.of(surface, height_m)
        layers.append(walls[layer])
        if microphones is not None:
            heard.append(evidence_of(track, microphones, walked, span, candidates, walls[layer], settings, signs))
        else:
            alone = expected_alone(walked, span, candidates, walls[layer], settings)
            heard.append(EventEvidence(np.zeros(len(candidates)), None, alone))
    device = None
    if directions is not None:
        bearings = [Bearings.of(directions, walked, (float(begin_s), float(end_s))) for begin_s, end_s in spans_s]
        expected = [one.expected for one in heard]
        said, device = evidence_of_bearings(bearings, layers, candidates, expected, directions.known_rad)
        if device is not None:
            say(f"note: {device.sentence}")
        both = [one.heard + other for one, other in zip(heard, said, strict=True)]
        heard = [replace(one, heard=total - total.max()) for one, total in zip(heard, both, strict=True)]
    return SourceEvidence(
        place=(candidates.place_m.astype(np.float64) @ level).astype(np.float32),
        prior=candidates.prior.astype(np.float32),
        heard=np.maximum(np.stack([one.heard for one in heard]), LEAST).astype(np.float16),
        expected=np.maximum(np.stack([one.expected for one in heard]), LEAST).astype(np.float16),
        moving=np.array([moves(one, plan, candidates.prior, settings) for one in heard], np.uint8),
        channels=np.array([channels], np.int64),
        device=np.zeros((0, 4)) if device is None else device.row[None],
    )


def moves(one: EventEvidence, plan: CandidateGrid, prior: Float[np.ndarray, " c"], settings: SourceSettings) -> bool:
    """Return whether the two halves of a sound come from two places."""
    if one.halves is None:
        return False
    first, second = (Density.of(plan, prior, half + one.expected, one.expected, settings) for half in one.halves)
    return log_same_place(first, second, prior) < _MOVING


_SIGNS_BY = 6  # sounds, the last ones, by which the signs of the channels are found until the end
_RECENT = 8  # sounds whose directions are looked at again, now that the device is known better

Spans = Sequence[tuple[float, float]]


class SourceFinder:
    """Finds sources while a drive goes on: of each sound when it is over, on the surfaces that there are then.

    What was found before is laid on the candidates of now. Surfaces, signs of channels and a device's offset are known
    better at the end, when ``find_sources`` finds all once more.

    Attributes:
        waiting: how many sounds are not located yet.
    """

    def __init__(self, at_once: int | None = None) -> None:
        """Begin without sounds; ``at_once`` are located in one call at most, the newest first (None for all)."""
        self.waiting, self._at_once = 0, at_once
        self.forget()

    def forget(self) -> None:
        """Locate every sound again: the poses have changed."""
        self._found: SourceEvidence | None = None
        self._rows: dict[tuple[float, float], int] = {}  # of the sounds that are located
        self._known: tuple[Spans, SourceEvidence | None] = (), None

    def known(self, spans_s: Spans) -> SourceEvidence | None:
        """Return the evidence of the sounds that are over, as far as they are located. One that waits has all zeros.

        The same object as before where nothing changed.
        """
        row = np.array([self._rows.get(_rounded(span), -1) for span in spans_s], np.int64)
        self.waiting = int((row < 0).sum())
        if self._found is None or not len(row):
            return None
        if self._known[1] is None or list(self._known[0]) != list(spans_s):
            self._known = spans_s, _taken(self._found, row)
        return self._known[1]

    def find_next(
        self,
        track: AudioTrack,
        walk: Trajectory,
        spans_s: Spans,
        voxel_m: Float[np.ndarray, "n 3"],
        up_in_world: Float[np.ndarray, "3"],
    ) -> SourceEvidence | None:
        """Locate the next sounds that wait, and return what is ``known`` then; see ``find_sources``."""
        fresh = [span for span in spans_s if _rounded(span) not in self._rows]
        if not fresh:
            return self.known(spans_s)
        now = fresh if self._at_once is None else fresh[-self._at_once :]
        if track.microphones is None:
            now = [*(span for span in spans_s[max(0, len(spans_s) - _RECENT) :] if span not in now), *now]
        found = find_sources(track, walk, now, voxel_m, up_in_world, spans_s[-_SIGNS_BY:])
        if found is None:
            return None
        rows = {_rounded(span): row for row, span in enumerate(now)}
        old = {span: row for span, row in self._rows.items() if span not in rows}
        if self._found is not None and old:
            found = _joined(found, _taken(self._found, np.array(list(old.values()))))
            rows |= {span: len(now) + row for row, span in enumerate(old)}
        self._found, self._rows, self._known = found, rows, ((), None)
        return self.known(spans_s)


def _rounded(span_s: tuple[float, float]) -> tuple[float, float]:
    return round(span_s[0], 1), round(span_s[1], 1)  # limits change a little, with the background better known


def _taken(evidence: SourceEvidence, row: Int[np.ndarray, " n"]) -> SourceEvidence:
    known = row >= 0
    return replace(
        evidence, heard=evidence.heard[row] * known[:, None], expected=evidence.expected[row] * known[:, None],
        moving=evidence.moving[row] * known,
    )  # fmt: skip


def _joined(new: SourceEvidence, before: SourceEvidence) -> SourceEvidence:
    carried = laid(before, np.eye(4), new.place.astype(np.float64))
    heard, expected = (np.maximum(values, LEAST).astype(np.float16) for values in carried)
    return replace(
        new, heard=np.concatenate([new.heard, heard]), expected=np.concatenate([new.expected, expected]),
        moving=np.concatenate([new.moving, before.moving]),
    )  # fmt: skip
