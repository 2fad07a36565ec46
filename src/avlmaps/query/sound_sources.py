"""Where sounds came from: the evidence of a map's microphones as regions with probabilities, rooms and things.

Sounds of one kind are joined to one source while that is likelier than two places (the birth rule). What usually makes
a kind of sound (the lexicon's makers) is a prior apart, which can be left out.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.poses import plain_point
from avlmaps.core.registry import Kind
from avlmaps.core.wording import option
from avlmaps.maps.sources.candidates import CandidateGrid, Density, Spread, log_same_place
from avlmaps.maps.sources.correlation import SourceSettings
from avlmaps.maps.types import SourceEvidence
from avlmaps.query.contents import Thing
from avlmaps.query.schema import SourceAnswer, row_of
from avlmaps.query.voxel_space import Space

if TYPE_CHECKING:
    from avlmaps.maps.store.manifest import Visit
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.schema import HeardFromAnswer

_MAKERS_SHARE = 0.5  # probability that a sound comes from a thing that usually makes it, where there is one
_AT_THING_M = 0.4
_MOST_NAMED, _LEAST_NAMED = 3, 0.05
_MOST_HEARD, _LEAST_HEARD = 3, 0.1  # sounds of one thing
_BELOW_THE_BEST = 0.999


def unknown_sources(avlmap: "AVLMap") -> str:
    """Return why a map does not know where sounds came from, and what to do."""
    what = f"{avlmap.path.name} does not know where sounds came from, only where the robot was"
    if avlmap.data.sources_wait:
        return f"Where the sounds came from is not found yet, {avlmap.data.sources_wait} wait; ask again in a moment."
    if avlmap.data.info.visits:
        return (
            f"{what}: it is of several days, and not all of them say where the microphones are, or they have other "
            f"microphones. Build each day's map with their places ({option('microphones', 'FILE')}) and merge them "
            "again."
        )
    return (
        f"{what}: its recording does not say where the microphones are, or it was made without its recording. Give "
        f"their places when you build the map ({option('microphones', 'FILE')})."
    )


def no_sources(avlmap: "AVLMap") -> str:
    """Return why the robot's place stands for the source of a sound; "" where the map knows sources, or no sound."""
    if avlmap.data.sources is not None or not len(avlmap.data.sounds):
        return ""
    return f"The place is where the robot was when it heard it: {unknown_sources(avlmap)}"


@dataclass(frozen=True, slots=True)
class SoundSource:
    """A place that sounds came from."""

    name: str  # what it sounds like
    confidence: float  # that a sound of it is one, in [0, 1]
    # That this is so and the source lies within ``RIGHT_M`` of the position: that a goal there is right.
    probability: float
    position: tuple[float, float, float]  # likeliest place: the middle of its heights there, metres, recording frame
    within_50_m: float  # radius on the plan that holds it with a probability of 0.5
    within_90_m: float  # of 0.9
    area_50_m2: float  # area of the smallest region of the plan that holds it with a probability of 0.5
    area_90_m2: float  # of 0.9
    rooms: tuple[tuple[str, float], ...]  # names of rooms and the probability that it is in each, likeliest first
    # Names, places and probabilities of things that it may be, likeliest first.
    things: tuple[tuple[str, tuple[float, float, float], float], ...]
    events: tuple[int, ...]  # numbers of its sounds in the map
    moving: bool  # whether it moved while it sounded
    microphones: int  # how many listened
    spread: Spread  # the radii, with the probability that it lies within ``RIGHT_M``

    def to_json(self) -> "SourceAnswer":
        """Return the source as ``avlmaps sources --json`` prints it."""
        things = [{"name": name, "position": list(place), "probability": share} for name, place, share in self.things]
        rooms = [{"name": name, "probability": share} for name, share in self.rooms]
        return row_of(self, SourceAnswer, rooms=rooms, things=things, sounds=list(self.events))


@dataclass(frozen=True, eq=False)
class Joined:
    """Sounds of one source: their evidence together."""

    events: tuple[int, ...]  # numbers of the sounds
    density: Density  # on the plan
    share: Float[np.ndarray, " c"]  # (c,) probability of each candidate


@dataclass(eq=False)
class SourceMap:
    """The evidence of a map, ready for queries."""

    evidence: SourceEvidence  # as the map stores it
    space: Space  # the map's voxels
    things: "Callable[[Sequence[str]], Sequence[Thing]]"  # finds the things of names in the map
    _priors: dict[tuple[str, ...], Float[np.ndarray, " c"]] = field(default_factory=dict, init=False)

    @classmethod
    def of(cls, avlmap: "AVLMap", evidence: SourceEvidence | None = None) -> "SourceMap":
        """Return the evidence of a map. ``QueryError``: the map has none."""
        evidence = avlmap.data.sources if evidence is None else evidence
        if evidence is None:
            raise QueryError(unknown_sources(avlmap))

        def things(names: Sequence[str]) -> "Sequence[Thing]":
            if not avlmap.has(Kind.PIXELS):
                return ()
            known = [name for name in names if avlmap.knows(name)]
            return avlmap.things(known, 0.3) if known else ()

        return cls(evidence, avlmap.space, things)

    @cached_property
    def place(self) -> Float[np.ndarray, "c 3"]:
        """The candidates, metres, recording frame."""
        return np.asarray(self.evidence.place, np.float64)

    @cached_property
    def settings(self) -> SourceSettings:
        """The numbers for the microphones that listened."""
        return SourceSettings.of(int(self.evidence.channels[0]))

    @cached_property
    def plan(self) -> CandidateGrid:
        """The cells of the plan."""
        return CandidateGrid.of(self.space.level(self.place))

    def prior_of(self, kind: str) -> Float[np.ndarray, " c"]:
        """Return the prior of a kind of sound: half of it at things of the map that usually make it."""
        entry = lexicon().find(kind, EntryKind.SOUND) if kind else None
        makers = () if entry is None else tuple(entry.makers)
        if makers not in self._priors:
            self._priors[makers] = self._with_makers(makers)
        return self._priors[makers]

    def _with_makers(self, makers: tuple[str, ...]) -> Float[np.ndarray, " c"]:
        from scipy.spatial import KDTree

        prior = np.asarray(self.evidence.prior, np.float64)
        found = self.things(makers) if makers else ()
        near = np.zeros(len(prior))
        for thing in found:
            away = KDTree(thing.points).query(self.place, distance_upper_bound=_AT_THING_M)[0]
            own = prior * (away < _AT_THING_M)
            near += thing.confidence * own / max(float(own.sum()), 1e-12)
        if not near.any():
            return prior
        return (1.0 - _MAKERS_SHARE) * prior + _MAKERS_SHARE * near / near.sum()

    def is_located(self, event: int) -> bool:
        """Return whether anything is known of where a sound came from; in a map that grows, it may wait."""
        return bool(self.evidence.heard[event].any() or self.evidence.expected[event].any())

    def joined(self, events: Sequence[int], kind: str, prior: bool = True) -> Joined:
        """Return what several sounds say together, as if they were of one source."""
        chosen = self.prior_of(kind) if prior else np.asarray(self.evidence.prior, np.float64)
        rows = np.array(events)
        heard = np.asarray(self.evidence.heard[rows], np.float64).sum(axis=0)
        expected = np.asarray(self.evidence.expected[rows], np.float64).sum(axis=0)
        density = Density.of(self.plan, chosen, heard + expected, expected, self.settings)
        return Joined(tuple(events), density, density.of_candidates(chosen, heard + expected))

    def sources(self, events: Sequence[int], kind: str, prior: bool = True) -> list[Joined]:
        """Return the sources of sounds of one kind, the clearest first: each joins one that it fits, or begins one."""
        base = np.asarray(self.evidence.prior, np.float64)
        found: list[Joined] = []
        for event in filter(self.is_located, events):
            alone = self.joined([event], kind, prior)
            fits = [log_same_place(one.density, alone.density, base) for one in found]
            best = int(np.argmax(fits)) if fits else -1
            if fits and fits[best] > 0.0:
                found[best] = self.joined([*found[best].events, event], kind, prior)
            else:
                found.append(alone)
        return found

    def position_of(self, joined: Joined) -> Float[np.ndarray, "3"]:
        """Return the likeliest place of a source, metres, recording frame."""
        xy = joined.density.position_m
        level = self.space.level(self.place)
        near = np.linalg.norm(level[:, :2] - xy, axis=1) < 0.3
        share = joined.share[near]
        height = float((level[near, 2] * share).sum() / share.sum()) if share.sum() > 0 else float(level[:, 2].mean())
        return self.space.world(np.array([*xy, height]))

    def anchors(self, joined: Joined) -> tuple[Float[np.ndarray, "a 3"], Float[np.ndarray, " a"]]:
        """Return places of a source, with values in (0, 1]: its likeliest place, and the cells of its region of 0.9."""
        # A cell has how likely it is against the likeliest cell, and a little less than the place, which is a mean.
        inside = np.flatnonzero(joined.density.region(0.9).ravel())
        share = joined.density.share.ravel()[inside]
        place = self.position_of(joined)
        xy, height = self.plan.middle_m(inside), float(self.space.level(place)[2])
        cells = self.space.world(np.column_stack([xy, np.full(len(xy), height)]))
        return np.concatenate([place[None], cells]), np.append(1.0, _BELOW_THE_BEST * share / share.max())


def list_sources(
    avlmap: "AVLMap", names: Sequence[str] = (), prior: bool = True, *, least: float = 0.0
) -> list[SoundSource]:
    """Return the sources of a map's sounds, or of some kinds, most confident first; ``prior``: of usual makers."""
    places = _Places(avlmap)
    listed = list_joined(avlmap, names, prior, least=least)
    found = [places.described(avlmap.source_map, one, kind, confidence) for kind, confidence, one in listed]
    return sorted(found, key=lambda one: -one.confidence)


def source_of(avlmap: "AVLMap", number: int) -> SoundSource:
    """Return the source of one sound by its likeliest name."""
    event, known = avlmap.sounds()[number], avlmap.source_map
    name, confidence = (event.names[0], event.confidences[0]) if event.names else ("", 0.0)
    return _Places(avlmap).described(known, known.joined([number], name), name, float(confidence))


def list_joined(
    avlmap: "AVLMap", names: Sequence[str] = (), prior: bool = True, *, least: float = 0.0,
    counts: Callable[[int], bool] = lambda event: True,
) -> Iterator[tuple[str, float, Joined]]:  # fmt: skip
    """Yield the sources of a map's sounds, each with its name and the confidence of it; see ``list_sources``."""
    known = avlmap.source_map
    for kind, scores in _by_kind(avlmap, names).items():
        ranked = sorted(scores.items(), key=lambda one: -one[1])
        events = [event for event, score in ranked if score >= least and counts(event)]
        for one in known.sources(events, kind, prior):
            yield kind, max(scores[event] for event in one.events), one


def _by_kind(avlmap: "AVLMap", names: Sequence[str]) -> dict[str, dict[int, float]]:
    kinds: dict[str, dict[int, float]] = {}
    if not names:
        for number, event in enumerate(avlmap.sounds()):
            name, score = (event.names[0], event.confidences[0]) if event.names else ("", 0.0)
            kinds.setdefault(name, {})[number] = score
        return kinds
    for name in names:
        scores = avlmap.sound_scores(name)
        likely = np.flatnonzero(scores >= 0.5)
        chosen = likely.tolist() or ([int(np.argmax(scores))] if len(scores) else [])
        kinds[name] = {number: float(scores[number]) for number in chosen}
    return kinds


class _Places:
    # Names the rooms and things of places in a map.

    def __init__(self, avlmap: "AVLMap") -> None:
        self._map, self._rooms = avlmap, avlmap.where

    @cached_property
    def _things(self) -> "list[Thing]":
        return self._map.things() if self._map.has(Kind.PIXELS) else []

    def described(self, known: SourceMap, joined: Joined, kind: str, confidence: float) -> SoundSource:
        spread = joined.density.spread
        return SoundSource(
            name=kind, confidence=round(confidence, 3), probability=round(confidence * spread.right, 3),
            position=plain_point(known.position_of(joined)), within_50_m=round(spread.within_50_m, 2),
            within_90_m=round(spread.within_90_m, 2), area_50_m2=round(joined.density.area_m2(0.5), 2),
            area_90_m2=round(joined.density.area_m2(0.9), 2), rooms=self._rooms_of(known, joined),
            things=self._things_of(known, joined), events=joined.events,
            moving=any(bool(known.evidence.moving[event]) for event in joined.events),
            microphones=int(known.evidence.channels[0]), spread=spread,
        )  # fmt: skip

    def _rooms_of(self, known: SourceMap, joined: Joined) -> tuple[tuple[str, float], ...]:
        likely = joined.share > 1e-5
        number, parts = self._rooms.parts_at(known.place[likely]), self._rooms.parts
        share = np.bincount(np.maximum(number, 0), joined.share[likely] * (number >= 0), len(parts))
        order: list[int] = np.argsort(-share, kind="stable")[:_MOST_NAMED].tolist()
        return tuple((parts[i].name, round(float(share[i]), 3)) for i in order if share[i] >= _LEAST_NAMED)

    def _things_of(self, known: SourceMap, joined: Joined) -> tuple[tuple[str, tuple[float, float, float], float], ...]:
        likely = [(self._things[number], share) for number, share in things_that_may_be(known, joined, self._things)]
        return tuple((thing.name, thing.position, round(share, 3)) for thing, share in likely)


def things_that_may_be(known: SourceMap, joined: Joined, things: "Sequence[Thing]") -> list[tuple[int, float]]:
    """Return the numbers of the things that a source may be, and the probability of each, likeliest first."""
    from scipy.spatial import KDTree

    likely = np.flatnonzero(joined.share > 1e-5)
    if not len(things) or not len(likely):
        return []
    points = np.concatenate([thing.points for thing in things])
    number = np.repeat(np.arange(len(things)), [len(thing.points) for thing in things])
    away, row = KDTree(points).query(known.place[likely])
    near = np.asarray(away) < _AT_THING_M
    share = np.bincount(number[row[near]], joined.share[likely][near], len(things))
    order: list[int] = np.argsort(-share, kind="stable")[:_MOST_NAMED].tolist()
    return [(one, float(share[one])) for one in order if share[one] >= _LEAST_NAMED]


def with_heard(
    avlmap: "AVLMap", things: Sequence[Thing], *, are_all: bool = True, visit: int | None = None,
    every: Sequence[Thing] | None = None,
) -> list[Thing]:  # fmt: skip
    """Return things with what may have come from them, not from others of ``every``, by default the map's list."""
    if not things or avlmap.data.sources is None:
        return list(things)
    rivals = [] if are_all else _others(avlmap.things() if every is None else every, things)
    every = [*things, *rivals]
    heard: list[list[HeardFromAnswer]] = [[] for _ in every]
    sounds, visits = avlmap.sounds(), avlmap.data.info.visits

    def counts(event: int) -> bool:
        return visit is None or _visit_of(visits, sounds[event].onset_s) == visit

    for kind, confidence, one in list_joined(avlmap, counts=counts):
        onset_s = max(sounds[event].onset_s for event in one.events)
        for number, share in things_that_may_be(avlmap.source_map, one, every):
            if kind and confidence * share >= _LEAST_HEARD:
                likely = round(confidence * share, 3)
                row: HeardFromAnswer = {"sound": kind, "probability": likely, "onset_s": onset_s}
                if visits:
                    number_of_day = _visit_of(visits, onset_s)
                    row["when"] = {"visit": number_of_day + 1, "day": visits[number_of_day].day or None}
                heard[number].append(row)
    ordered = [sorted(rows, key=lambda row: -row["probability"])[:_MOST_HEARD] for rows in heard[: len(things)]]
    return [replace(thing, heard=tuple(rows)) for thing, rows in zip(things, ordered, strict=True)]


def _others(every: Sequence[Thing], listed: Sequence[Thing]) -> list[Thing]:
    named = {(thing.name, thing.position) for thing in listed}
    taken = np.concatenate([thing.rows for thing in listed])
    others = [thing for thing in every if (thing.name, thing.position) not in named]
    return [thing for thing in others if not len(thing.rows) or np.isin(thing.rows, taken).mean() < 0.5]


def _visit_of(visits: "Sequence[Visit]", onset_s: float) -> int:
    return max((n for n, visit in enumerate(visits) if visit.begin_s <= onset_s + 1e-6), default=0)
