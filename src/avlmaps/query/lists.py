"""Answers from the lists of a map: rooms by size, sounds by time, counts, what is in a room or beside a thing."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress, product
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt, Question
from avlmaps.core.registry import Kind
from avlmaps.core.wording import place_text, the_room
from avlmaps.core.words import singulars_of, stem_of
from avlmaps.language.intents import Target, TargetKind
from avlmaps.language.list_questions import Listed, ListQuestion, in_query
from avlmaps.language.names import sounding_forms
from avlmaps.language.said_places import SaidStorey
from avlmaps.language.verbalise import phrase
from avlmaps.maps.storeys import Storeys, said_storeys
from avlmaps.query import changes
from avlmaps.query.answer import Alternative, Answer, Keeps, in_words, placed, sentence_of
from avlmaps.query.changes import ChangeKind, Days
from avlmaps.query.contents import NOWHERE, Whereabouts
from avlmaps.query.edits import means
from avlmaps.query.goals import MOST_GOALS, Goal
from avlmaps.query.places import Box, lies_between

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Stay
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import SoundEvent

BESIDE_M = 1.0  # from box to box, horizontally
_HEARD_M = 2.5  # from the robot to the box of what it was near
_ON_M = 0.3  # how far over a thing's box another that lies on it may be
_HANGS = ("wall", "ceiling", "built in")  # such lies on nothing, even over a table
_MOST_NAMED = 12
# The standard deviation of a room's area, as a share: the median error is 7.1 % on twelve held-out homes
# (docs/benchmarks.md).
_AREA_ERROR = 0.105
_LEAST_M2 = 1.0  # of a room; less is a corner that views disagree about
_LIKELY = 0.3  # of a sound's second name
_ROUND_SOUNDS = frozenset({"the", "a", "an", "of", "sound", "noise", "someone", "somebody", "my", "your", "go", "off"})
_MOST_SOURCES = 5  # of sounds by time; each costs a density
_EVERY = ListQuestion(Listed.NAMES, "things")
_Event = tuple[float, Goal]  # the onset of a sound, seconds, and where it was heard


@dataclass(frozen=True, slots=True)
class _Lists:
    # What a question of lists needs.
    avlmap: "AVLMap"
    question: ListQuestion
    top: int
    ask: Callable[[str], Answer]
    at: HeardAt | None
    keeps: Keeps

    def goals(self, kind: str) -> list[Goal]:
        """Return all rooms, sounds or things."""
        if kind == "rooms":
            goals = [_room_goal(self.avlmap.where, number) for number in range(len(self.avlmap.where.rooms))]
        elif kind == "sounds":
            return [goal for _, goal in _events(self, Target(TargetKind.SOUND))]
        else:
            things = self.avlmap.things() if self.avlmap.has(Kind.PIXELS) else []
            goals = [_goal(one.position, float(one.confidence), one.name, one.size) for one in things]
        return [goal for goal in goals if self.keeps(goal.position)]

    def found(self, words: str) -> Answer:
        """Return the answer of what a question names. ``_AbsentError``: it is not found."""
        subject = self.ask(words)
        goals = tuple(replace(goal, name=words) for goal in subject.goals if self.keeps(goal.position))
        if not (subject.found and self.likely(goals)):
            text = f"No {words} is found." if subject.found else subject.text
            raise _AbsentError(replace(subject, goals=(), found=False, text=text))
        return replace(subject, goals=goals)

    def likely(self, goals: Iterable[Goal]) -> list[Goal]:
        """Return the goals that count as found."""
        return [goal for goal in goals if goal.probability >= self.avlmap.settings.found_at]

    def judged(self, goals: Sequence[Goal], is_so: bool, is_sure: bool, text: str, count: int | None = None) -> Answer:
        """Return the answer to whether something is so."""
        said = "No" if not is_so else "Yes" if is_sure else "Perhaps"
        return replace(self.answer(goals, f"{said}: {text}.", count=count), found=is_so and is_sure)

    def answer(
        self, goals: Sequence[Goal], text: str, subject: Answer | None = None, count: int | None = None
    ) -> Answer:
        goals = goals[: self.top]
        probability = goals[0].probability if goals else 0.0
        found = bool(goals) and probability >= self.avlmap.settings.found_at
        parts, heat = ((), None) if subject is None else (subject.parts, subject.heat)
        return Answer(tuple(goals), found, parts, heat=heat, probability=probability, count=count, text=text)


class _AbsentError(Exception):
    # What a question names is not found.
    def __init__(self, answer: Answer) -> None:
        self.answer = answer


def answer_list(
    avlmap: "AVLMap", question: ListQuestion, top: int, ask: Callable[[str], Answer], at: HeardAt | None = None,
    keeps: Keeps = lambda position: True,
) -> Answer:  # fmt: skip
    """Answer a question from the lists of a map, by what lies where ``keeps`` says. ``QueryError``: none is such."""
    try:
        whole = ANSWERS[question.of](_Lists(avlmap, question, top, ask, at, keeps))
    except _AbsentError as absent:
        whole = absent.answer
    again = partial(answer_list, avlmap, question, top, ask, at)
    return replace(whole, when=whole.when[:top], usual=whole.usual[:top], again=again)


def _goal(position: Sequence[float], likely: float, name: str, size: Sequence[float] = (0.0, 0.0, 0.0)) -> Goal:
    x, y, z = position
    return Goal((x, y, z), likely, (size[0], size[1], size[2]), {}, likely, name)


def _room_goal(where: Whereabouts, number: int) -> Goal:
    return _goal(where.rooms[number].position, where.rooms[number].confidence, where.names[number])


def _sound_goal(sound: "SoundEvent", name: str = "") -> Goal:
    score = _called(sound, name) if name else float(sound.confidences[0]) if sound.confidences else 0.0
    return _goal(sound.position, score, name or (sound.names[0] if sound.names else "sound"))


def _rooms_by_size(lists: _Lists) -> Answer:
    where, first = lists.avlmap.where, lists.question.first
    areas = np.array([room.area_m2 for room in where.rooms], np.float64)
    kept = np.array([lists.keeps(room.position) for room in where.rooms], bool)
    if not len(areas):
        raise QueryError("The map does not know the sizes of rooms: it has no floor plan, or no model of views.")
    order = np.argsort(areas if first else -areas, kind="stable")
    order = order[kept[order] & (areas[order] >= _LEAST_M2)]
    if not len(order):
        return lists.answer([], f"The map shows no room of {_LEAST_M2:g} m² or more.")
    likely = extreme_shares(areas[order], smallest=first)
    goals = [_room_goal(where, int(number)) for number in order]
    sure = (likely * [goal.probability for goal in goals]).round(3).tolist()
    goals = [replace(goal, probability=one) for goal, one in zip(goals, sure, strict=True)]
    which = "smallest" if first else "largest"
    text = placed(f"the {which} room is {the_room(goals[0].name)}, {areas[order[0]]:.0f} m²", goals[0])
    rivals = [f"{the_room(goals[n].name)} ({areas[order[n]]:.1f} m²)" for n in np.flatnonzero(likely > 0.1).tolist()]
    if len(rivals) > 1:
        text = f"{text} The map does not tell these sizes apart: {', '.join(rivals)}."
    return lists.answer(goals, text)


def extreme_shares(areas_m2: Float[np.ndarray, " r"], *, smallest: bool) -> Float[np.ndarray, " r"]:
    """Return how likely each room is the smallest, or the largest, as well as areas are known; they add up to 1."""
    sigma, sign = _AREA_ERROR * areas_m2, 1.0 if smallest else -1.0
    low, high = float((sign * areas_m2 - 5.0 * sigma).min()), float((sign * areas_m2 + 5.0 * sigma).max())
    score = (np.linspace(low, high, 2001)[:, None] - sign * areas_m2) / sigma
    larger = np.maximum(0.5 * np.vectorize(math.erfc)(score / math.sqrt(2.0)), 1e-300)
    density = np.exp(-0.5 * np.square(score)) / sigma * larger.prod(axis=1, keepdims=True) / larger
    return density.sum(axis=0) / density.sum()


def _sounds_by_time(lists: _Lists) -> Answer:
    avlmap, which, sounds = lists.avlmap, "first" if lists.question.first else "last", lists.avlmap.sounds()
    numbers = [number for number, sound in enumerate(sounds) if lists.keeps(sound.position)]
    numbers.sort(key=lambda number: sounds[number].onset_s, reverse=not lists.question.first)
    if not numbers:
        return lists.answer([], "No sound was heard.")
    goals = [_sound_goal(sounds[number]) for number in numbers]
    named = f"is {'' if lists.likely(goals[:1]) else 'perhaps '}the {goals[0].name}"
    named = f"the {which} sound {named} at {sounds[numbers[0]].onset_s:.1f} s"
    text = placed(f"{named}, heard", goals[0])
    if lists.at != "source":
        return lists.answer(goals, text)
    if not avlmap.source_map.is_located(numbers[0]):
        return lists.answer(goals, f"{text} Where it came from is not found yet; ask again in a moment.")
    from avlmaps.query.sound_sources import source_of

    located = [number for number in numbers if avlmap.source_map.is_located(number)]
    found = [source_of(avlmap, number) for number in located[:_MOST_SOURCES]]
    goals = [_goal(one.position, one.confidence, one.name or "sound") for one in found]
    spread = zip(goals, found, strict=True)
    goals = [replace(goal, probability=one.probability, spread=one.spread) for goal, one in spread]
    things = ", ".join(f"the {name} ({share:.2f})" for name, _, share in found[0].things)
    told = placed(f"{named}; it comes from a place", goals[0])
    return lists.answer(goals, f"{told} It may be {things}." if things else told)


def _heard(lists: _Lists) -> Answer:
    # When, how often and where a sound was heard, which sounds were, or whether one came before another.
    every = list(map(_sound_goal, lists.avlmap.sounds()))
    if not every:
        return lists.answer([], "The map holds no sounds.")
    heard = [_events(lists, one) for one in lists.question.sounds]
    for one, events in zip(lists.question.sounds, heard, strict=True):
        if not events:
            others = "" if one.near else f"; the map's sounds: {counted([goal.name for goal in every])}"
            return lists.answer([], f"No {one.name or 'sound'} was heard{_places(one)}{others}.", count=0)
    if lists.question.how:
        return _compared(lists, *heard)
    (one,), (events,) = lists.question.sounds, heard
    goals, told = [goal for _, goal in events], [_told(lists, event) for event in events]
    if not one.name:
        told = [f"{goal.name} {at}" for goal, at in zip(goals, told, strict=True)]
    elif " in " not in _places(one):
        rooms = [lists.avlmap.where.name_of(goal.position) for goal in goals]
        told = [f"{at} in {the_room(room)}" if room else at for at, room in zip(told, rooms, strict=True)]
    if one.name and len(told) > 1:
        told[0], told[-1] = f"first {told[0]}", f"last {told[-1]}"
    often = "once" if len(told) == 1 else f"{len(told)} times"
    begins = f"{one.name}: heard {often}{_places(one)}, " if one.name else f"heard{_places(one)}: "
    text = sentence_of(begins + ", ".join(told))
    return replace(lists.answer(goals, text, count=len(goals)), found=bool(lists.likely(goals)))


def _compared(lists: _Lists, ones: Sequence[_Event], others: Sequence[_Event]) -> Answer:
    # The surest pair of events that shows the order; where none does, the pair that comes nearest to it.
    if both := {(at, goal.position) for at, goal in ones} & {(at, goal.position) for at, goal in others}:
        names = f"{ones[0][1].name!r} and {others[0][1].name!r}"
        raise QueryError(f"The sound at {min(both)[0]:.1f} s is meant by both names, {names}; name two that differ.")
    sign, nearest = (1, (ones[0], others[-1])) if lists.question.how == "before" else (-1, (ones[-1], others[0]))
    shown = [pair for pair in product(ones, others) if sign * (pair[1][0] - pair[0][0]) > 0.0]
    pair = max(shown, key=lambda pair: min(goal.probability for _, goal in pair), default=nearest)
    goals, text = [goal for _, goal in pair], ", ".join(f"{event[1].name} {_told(lists, event)}" for event in pair)
    return lists.judged(goals, bool(shown), len(lists.likely(goals)) == len(goals), text)


def _events(lists: _Lists, sound: Target) -> list[_Event]:
    # The events of a name ("" for any) in and near all places that are named, by their onsets.
    every = ((one.onset_s, _sound_goal(one, sound.name)) for one in lists.avlmap.sounds())
    events = [one for one in every if (one[1].probability or not sound.name) and lists.keeps(one[1].position)]
    for place in sound.near:
        goals = [goal for _, goal in events]
        if place.kind is TargetKind.AREA:
            lists.avlmap.where.require(place.name)
            fits = np.flatnonzero(lists.avlmap.where.inside(place.name, [goal.position for goal in goals])).tolist()
        else:
            marks = lists.likely(lists.found(in_query(place)).goals)
            fits = {number for mark in marks for _, number in _near(lists, mark, goals, _HEARD_M)}
        events = [events[number] for number in fits]
    return sorted(events, key=lambda event: event[0])


def _told(lists: _Lists, event: _Event) -> str:
    return f"{'' if lists.likely(event[1:]) else 'perhaps '}at {event[0]:.1f} s"


def _places(sound: Target) -> str:
    return "".join(
        f" in {the_room(one.name)}" if one.kind is TargetKind.AREA else f" near {phrase(one)}" for one in sound.near
    )


def _called(sound: "SoundEvent", words: str) -> float:
    # How likely a sound is what words mean, by its likely names: "the phone ring" is "telephone ringing".
    wanted, meant = _stems(words), lexicon().find(words, EntryKind.SOUND)
    for name, confidence in zip(sound.names, sound.confidences, strict=False):
        own, is_likely = _stems(name), confidence >= _LIKELY or name == sound.names[0]
        is_same = meant is not None and lexicon().find(name, EntryKind.SOUND) == meant
        if is_likely and (is_same or (wanted and own and (wanted <= own or own <= wanted))):
            return float(confidence)
    return 0.0


def _stems(words: str) -> frozenset[str]:
    forms = sounding_forms()  # "rang" is "ringing"
    plain = (word for word in words.lower().replace("telephone", "phone").split() if word not in _ROUND_SOUNDS)
    return frozenset(stem_of(forms.get(word, word)) for word in plain)


def _names(lists: _Lists) -> Answer:
    kind, goals = lists.question.name, lists.goals(lists.question.name)
    many = f"is 1 {kind[:-1]}" if len(goals) == 1 else f"are {len(goals) or 'no'} {kind}"
    named = f": {counted([goal.name for goal in goals])}" if goals else ""
    return lists.answer(goals, f"There {many}{named}.", count=len(goals))


def _changes(lists: _Lists) -> Answer:
    # What is new, gone or moved, in a room or anywhere, and when it was noticed.
    question, days = lists.question, Days.of(lists.avlmap)
    since = days.visit_of(question.since) if question.since else 0
    answer = changes.changes_answer(days, lists.avlmap.path.name, since, lists.avlmap.where.name_of)
    every: tuple[ChangeKind, ...] = ("new", "moved", "gone")
    kinds: list[ChangeKind] = [kind for kind in every if question.change in ("", kind)]
    listed = [one for one in answer["changes"] if one["kind"] in kinds and lists.keeps(one["position"])]
    if question.name:
        lists.avlmap.where.require(question.name)
        listed = list(compress(listed, lists.avlmap.where.inside(question.name, [one["position"] for one in listed])))
    answer["changes"] = listed
    goals = [_goal(one["position"], one["confidence"], one["name"], one["size"]) for one in listed]
    whole = lists.answer(goals, changes.text_of(answer, kinds, question.name), count=len(listed))
    # A change is known by depth, however uncertain the name is.
    return replace(whole, found=bool(whole.goals), when=tuple(one["noticed"] for one in listed))


def _last_seen(lists: _Lists) -> Answer:
    name = lists.question.name
    entry = lexicon().head(name, EntryKind.THING)
    if entry is None:
        raise QueryError(f"{name!r} is no thing that is known; name a thing, such as: where was the bag last seen?")
    answer = changes.last_seen(Days.of(lists.avlmap), name, means(entry.name), lists.avlmap.where.name_of)
    answer["seen"] = [one for one in answer["seen"] if lists.keeps(one["position"])]
    goals = [_goal(one["position"], one["confidence"], one["name"]) for one in answer["seen"]]
    whole = lists.answer(goals, changes.last_seen_text(answer))
    return replace(whole, when=tuple(one["last_seen"] for one in answer["seen"]))


def _usual(lists: _Lists) -> Answer:
    # What is usually somewhere, or where a thing usually is, by the days that looked.
    avlmap, name, how = lists.avlmap, lists.question.name, lists.question.how
    days = Days.of(avlmap, "nobody knows what is usual there")
    stays = days.life.stays
    if how == "in":
        avlmap.where.require(name)
        fits = avlmap.where.inside(name, [stay.position for stay in stays]).tolist()
    elif how:
        marks = lists.likely(lists.found(name).goals)
        fits = [any(lies(avlmap, how, stay, mark) for mark in marks) for stay in stays]
    else:
        meant = means(name)
        fits = [meant(changes.name_of(stay)) for stay in stays]
    within = {id(stay) for stay, is_so in zip(stays, fits, strict=True) if is_so and lists.keeps(stay.position)}
    found = changes.usual(days, lambda stay: id(stay) in within)
    place = f"in {the_room(name)}" if how == "in" else f"{how} the {name}"
    at_home = changes.usual_place_text(days, name, found, avlmap.where.name_of)
    text = changes.usual_text(found, place) if how else at_home
    whole = lists.answer([_goal(one.stay.position, one.share, one.name, one.stay.size) for one in found], text)
    return replace(whole, found=bool(found) and found[0].is_usual, usual=tuple(one.to_json() for one in found))


def lies(avlmap: "AVLMap", how: str, stay: "Stay", mark: Goal) -> bool:
    """Return whether a thing lies on or near another."""
    own, place = Box(avlmap.space, stay.position, stay.size), Box(avlmap.space, mark.position, mark.size)
    if own.overlaps(place):
        return False
    if how == "near":
        return own.gap_m(place) <= BESIDE_M
    entry = lexicon().find(stay.name, EntryKind.THING)
    if entry is not None and entry.mount in _HANGS:
        return False
    over = bool((np.abs(own.middle - place.middle)[:2] <= place.size[:2] / 2.0).all())
    rises_m = (own.middle[2] - own.size[2] / 2.0) - place.middle[2]
    return over and 0.0 <= rises_m <= place.size[2] / 2.0 + _ON_M


def _counted(lists: _Lists) -> tuple[list[Goal], str]:
    # What is counted, the events of a sound or the things that are found, and its name.
    for sound in lists.question.sounds:
        return [goal for _, goal in _events(lists, sound)], f"events of {sound.name}{_places(sound)}"
    name = lists.question.name
    subject = lists.ask(f"how many {name} are there")
    if subject.count is None:
        raise QueryError(f"A map cannot count {name!r}; ask it like: how many chairs are in the kitchen?")
    return [goal for goal in lists.likely(subject.goals) if lists.keeps(goal.position)], name


def _at_least(lists: _Lists) -> Answer:
    number, (goals, name) = lists.question.number, _counted(lists)
    one = f"1 {next(iter(singulars_of(name)), name)} is found"
    told = one if len(goals) == 1 else f"{len(goals) or 'no'} {name} are found"
    return lists.judged(goals, len(goals) >= number, len(lists.likely(goals)) >= number, told, len(goals))


def _rooms_with(lists: _Lists) -> Answer:
    sounds = lists.question.sounds
    if sounds and lists.at == "source":  # where it came from, not where it was heard
        return _room_of(replace(lists, question=replace(lists.question, name=in_query(sounds[0]))))
    where, (counts, name) = lists.avlmap.where, _counted(lists)
    if not where.rooms:
        raise QueryError("The map has no rooms: it was built without a model of views.")
    inside = where.rooms_of(np.array([goal.position for goal in counts], np.float64).reshape(-1, 3)).tolist()
    often = Counter(room for room in inside if room != NOWHERE).most_common()
    least = lists.question.number or max((count for _, count in often), default=1)
    rooms, goals = [(room, count) for room, count in often if count >= least], list[Goal]()
    for room, _ in rooms:
        sure = sorted(one.probability for one, at in zip(counts, inside, strict=True) if at == room)[-least]
        goal = _room_goal(where, room)
        goals.append(replace(goal, probability=min(goal.probability, sure)))
    told = ", ".join(f"{the_room(goal.name)} ({count})" for goal, (_, count) in zip(goals, rooms, strict=True))
    which = f"{least} or more" if lists.question.number else "the most"
    heard = f"{sounds[0].name} was heard in {told}" if sounds and goals and least == 1 else ""
    text = heard or f"{told or 'no room is known that'} {'have' if len(goals) > 1 else 'has'} {which} {name}"
    return lists.answer(goals, sentence_of(text), count=len(goals))


def _room_of(lists: _Lists) -> Answer:
    subject = lists.found(lists.question.name)
    where, goal = lists.avlmap.where, subject.goals[0]
    number = int(where.parts_at(np.array([goal.position]))[0])
    if number == NOWHERE:
        raise QueryError("The map has no rooms: it was built without a model of views.")
    room = where.parts[number]
    inside = _goal(goal.position, min(goal.probability, room.probability), room.name, goal.size)
    words = in_words([one.part for one in subject.parts])
    return lists.answer([inside], placed(f"{words} is in {the_room(room.name)}", inside), subject)


def _contents(lists: _Lists) -> Answer:
    name = lists.question.name
    subject = lists.found(name)
    where, things = lists.avlmap.where, lists.goals("things")
    goals = list(compress(things, where.inside(name, [thing.position for thing in things])))
    number = f"{len(goals)} thing{'s' * (len(goals) > 1)}: " if lists.question.counts and goals else ""
    text = f"In {the_room(name)}: {number}{counted([goal.name for goal in goals])}."
    text = text if where.has(name) else f"The map shows no room that is a {name} as a whole."
    return lists.answer(goals, text, subject, count=len(goals))


def _beside(lists: _Lists) -> Answer:
    subject = lists.found(lists.question.name)
    if lists.question.other:
        return _between(lists, subject)
    goals, parts, where = lists.goals("things"), [one.part for one in subject.parts], lists.avlmap.where
    for room in (part.query for part in parts[1:] if where.has(part.query)):
        goals = list(compress(goals, where.inside(room, [goal.position for goal in goals])))
    near, words = _near(lists, subject.goals[0], goals, BESIDE_M), in_words(parts)
    what = ", ".join(f"{goals[number].name} ({gap:.1f} m)" for gap, number in near[:_MOST_NAMED])
    return lists.answer([goals[number] for _, number in near], f"Next to {words}: {what or counted([])}.", subject)


def _near(lists: _Lists, mark: Goal, goals: Sequence[Goal], most_m: float) -> list[tuple[float, int]]:
    # The gap to each goal near a thing and its number, the nearest first: in an open plan, or on one side of a wall.
    votes, every = lists.avlmap.room_votes, (*goals, mark)
    *boxes, own = [Box(lists.avlmap.space, one.position, one.size) for one in every]
    *rooms, room = lists.avlmap.where.rooms_of(np.array([one.position for one in every])).tolist()
    mounts = [getattr(lexicon().head(one.name, EntryKind.THING), "mount", "") for one in every]
    *ends, end = [(one.position, mount == "built in") for one, mount in zip(every, mounts, strict=True)]
    near = [(gap, n) for n, box in enumerate(boxes) if (gap := own.gap_m(box)) <= most_m and not own.overlaps(box)]
    return sorted(one for one in near if not (votes and rooms[n := one[1]] != room and votes.plan.parts(end, ends[n])))


def _between(lists: _Lists, one: Answer) -> Answer:
    question, avlmap = lists.question, lists.avlmap
    other = lists.found(question.other)
    goals = lists.goals(question.how or "things")
    ends = [avlmap.space.level(np.array(end.goals[0].position))[:2] for end in (one, other)]
    places = avlmap.space.level(np.array([goal.position for goal in goals]).reshape(-1, 3))[:, :2]
    fits, sure = lies_between(places, *ends), min(one.probability, other.probability)
    for name in (question.name, question.other):  # what is in a room is not beside it
        if avlmap.where.has(name):
            fits &= ~avlmap.where.inside(name, [goal.position for goal in goals])
    boxes = [Box(avlmap.space, end.goals[0].position, end.goals[0].size) for end in (one, other)]
    inside = [
        replace(goal, probability=min(goal.probability, sure))
        for goal, is_in in zip(goals, fits.tolist(), strict=True)
        if is_in and not any(box.overlaps(Box(avlmap.space, goal.position, goal.size)) for box in boxes)
    ]
    words = " and ".join(in_words([part.part for part in end.parts]) for end in (one, other))
    what = counted([goal.name for goal in inside]) if inside or not question.how else "no room"
    return lists.answer(inside, f"Between {words}: {what}.", one)


ANSWERS: Mapping[Listed, Callable[[_Lists], Answer]] = {
    Listed.ROOM_BY_SIZE: _rooms_by_size,
    Listed.SOUND_BY_TIME: _sounds_by_time,
    Listed.CONTENTS: _contents,
    Listed.BESIDE: _beside,
    Listed.ROOM_OF: _room_of,
    Listed.NAMES: _names,
    Listed.CHANGES: _changes,
    Listed.LAST_SEEN: _last_seen,
    Listed.HEARD: _heard,
    Listed.AT_LEAST: _at_least,
    Listed.ROOMS_WITH: _rooms_with,
    Listed.USUAL: _usual,
}
"""What answers each kind of list."""


def counted(names: Sequence[str]) -> str:
    """Return names, the most frequent first, each with how often it occurs: ``chair (4), sofa``."""
    if not names:
        return "no thing that the map is certain of"
    often = Counter(names).most_common()
    shown = ", ".join(name if count == 1 else f"{name} ({count})" for name, count in often[:_MOST_NAMED])
    return shown + (f" and {len(often) - _MOST_NAMED} kinds more" if len(often) > _MOST_NAMED else "")


def how_many(avlmap: "AVLMap") -> Answer:
    """Return how many storeys a map has."""
    storeys = avlmap.storeys
    count, text = 1 if storeys is None else len(storeys), said_storeys(storeys).removeprefix("it ")
    return Answer((), True, (), probability=1.0, count=count, text=f"The map {text}.")


def answer_on_storey(
    avlmap: "AVLMap", said: Sequence[SaidStorey], top: int, ask: Callable[[str, int], Answer]
) -> Answer:
    """Answer a question that names a storey. ``QueryError``: it names several, or cannot be answered."""
    if len({(one.number, one.above, one.isnt) for one in said}) > 1:
        raise QueryError(f"The question names several storeys ({', '.join(one.said for one in said)}); ask for one.")
    storeys, word = avlmap.storeys, said[0]
    if not word.said:  # "which floor is it on?"
        whole = ask(word.rest, top)
        return whole if storeys is not None else replace(whole, text=f"{whole.text} The map holds one storey.")
    numbers, note = storeys_meant(word, 1 if storeys is None else len(storeys))
    notes = (note,) if note else ()
    if not numbers:
        return _no_such(storeys, word, notes, None if word.lists else ask(word.rest, top))

    def is_here(position: Sequence[float]) -> bool:
        return storeys is None or int(storeys.of_places(np.array([position]))[0]) in numbers

    every = answer_list(avlmap, _EVERY, top, lambda words: ask(words, top)) if word.lists else None
    whole = every or ask(word.rest, MOST_GOALS)
    if whole.again is None:
        return _restricted(whole, word, avlmap, [goal for goal in whole.goals if is_here(goal.position)], notes, top)
    kept = whole.again(is_here)
    text = f"{sentence_of(at_storey(word))[:-1]}: {kept.text}"
    return replace(kept, goals=kept.goals[:top], notes=(*notes, *kept.notes), text=text)


def _no_such(storeys: Storeys | None, word: SaidStorey, notes: tuple[str, ...], whole: Answer | None) -> Answer:
    whole = whole or Answer((), False, ())
    holds = said_storeys(storeys).replace("it", "the map", 1)
    guess = f"; without that the best guess is at {place_text(whole.goals[0].position)}" if whole.goals else ""
    text = sentence_of(f"{holds}, so that nothing is known to be {at_storey(word)}{guess}")
    count = None if whole.count is None else 0
    return replace(whole, found=False, probability=0.0, count=count, notes=(*notes, *whole.notes), text=text)


def _restricted(
    whole: Answer, word: SaidStorey, avlmap: "AVLMap", here: Sequence[Goal], notes: tuple[str, ...], top: int
) -> Answer:
    # The goals of an answer that lie on some storeys; found where the first of them is likely enough.
    found_at, others = avlmap.settings.found_at, whole.alternatives
    likely = here[0].probability if here else 0.0
    found, asked = bool(here) and likely >= found_at, [one.part for one in whole.parts]
    count = None if whole.count is None else sum(goal.probability >= found_at for goal in here)
    if found:
        text = placed(f"{in_words(asked)} {at_storey(word)} is most likely", here[0])
    else:
        text = _absent(whole, word, here, avlmap.storeys)
        if whole.found:
            others = (Alternative(Question.of(asked), whole.probability, True, whole.goals[:1]), *others)
    text = text if count is None else f"Counted {at_storey(word)}: {count}. {text}"
    return replace(
        whole, goals=tuple(here[:top]), found=found, probability=likely, count=count, text=text,
        notes=(*notes, *whole.notes), alternatives=others,
    )  # fmt: skip


def _absent(whole: Answer, word: SaidStorey, here: Sequence[Goal], storeys: Storeys | None) -> str:
    what = in_words([one.part for one in whole.parts]).removeprefix("the ")
    text = f"No {what} is found {at_storey(word)}"
    if here:
        text += f"; the best guess there is at {place_text(here[0].position)}, probability {here[0].probability:.2f}"
    if whole.found and storeys is not None:
        name = storeys[int(storeys.of_places(np.array(whole.goals[0].position))[0])].name
        at = place_text(whole.goals[0].position)
        text += f"; one is found on the {name} at {at}, probability {whole.probability:.2f}"
    return f"{text}."


def storeys_meant(word: SaidStorey, count: int) -> tuple[list[int], str]:
    """Return the numbers of the storeys that words mean in a map with this number of them, and how they were taken."""
    every = list(range(count))
    if word.above is not None:
        chosen = every[1:] if word.above else every[:-1]
    elif word.number is None:
        chosen = every
    else:
        chosen = every[word.number :] if word.number < 0 else every[word.number : word.number + 1]
    note = ""
    if word.number is not None and word.number > 0:
        if chosen and count > 1:
            note = (
                f"'{word.said}' is counted as in Britain, the ground floor being the lowest of the map; in America it "
                f"would be {'the ground floor' if word.number == 1 else 'the one below'}."
            )
        elif not chosen and word.number == count:
            chosen = [count - 1]
            note = (
                f"'{word.said}' is counted as in America, the first floor being the lowest: the map has no storey "
                f"{word.number} over the ground floor."
            )
    return ([number for number in every if number not in chosen] if word.isnt and chosen else chosen), note


def at_storey(word: SaidStorey) -> str:
    """Return the words for being on a storey: "upstairs", "on the first floor", "not on the first floor"."""
    at = word.said if word.above is not None and "stairs" in word.said else f"on the {word.said}"
    return f"not {at}" if word.isnt else at
