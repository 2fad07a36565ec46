"""Answers from the lists of a map: rooms by size, sounds by time, what is in a room, beside a thing or on a storey."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt, Question
from avlmaps.core.registry import Kind
from avlmaps.core.wording import place_text, the_room
from avlmaps.core.words import stem_of
from avlmaps.language.list_questions import Listed, ListQuestion
from avlmaps.language.names import sounding_forms
from avlmaps.language.said_places import SaidStorey
from avlmaps.maps.storeys import Storeys, said_storeys
from avlmaps.query import changes
from avlmaps.query.answer import Alternative, Answer, in_words, placed, sentence_of
from avlmaps.query.changes import ChangeKind, Days
from avlmaps.query.contents import NOWHERE, Whereabouts
from avlmaps.query.edits import means
from avlmaps.query.goals import MOST_GOALS, Goal
from avlmaps.query.places import lies_between

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Stay
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import SoundEvent, Thing

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


@dataclass(frozen=True, slots=True)
class _Lists:
    # What a question of lists needs.
    avlmap: "AVLMap"
    question: ListQuestion
    top: int
    ask: Callable[[str], Answer]
    at: HeardAt | None

    def days(self) -> Days:
        return Days.of(self.avlmap)

    def things(self) -> "list[Thing]":
        return self.avlmap.things() if self.avlmap.has(Kind.PIXELS) else []

    def answer(
        self, goals: Sequence[Goal], text: str, subject: Answer | None = None, count: int | None = None
    ) -> Answer:
        goals = goals[: self.top]
        probability = goals[0].probability if goals else 0.0
        found = bool(goals) and probability >= self.avlmap.settings.found_at
        parts, heat = ((), None) if subject is None else (subject.parts, subject.heat)
        return Answer(tuple(goals), found, parts, heat=heat, probability=probability, count=count, text=text)


def answer_list(
    avlmap: "AVLMap", question: ListQuestion, top: int, ask: Callable[[str], Answer], at: HeardAt | None = None
) -> Answer:
    """Answer a question from the lists of a map. ``QueryError``: the map has no such list."""
    whole = ANSWERS[question.of](_Lists(avlmap, question, top, ask, at))
    return replace(whole, when=whole.when[:top], usual=whole.usual[:top])


def _goal(position: Sequence[float], likely: float, name: str, size: Sequence[float] = (0.0, 0.0, 0.0)) -> Goal:
    x, y, z = position
    return Goal((x, y, z), likely, (size[0], size[1], size[2]), {}, likely, name)


def _room_goal(where: Whereabouts, number: int) -> Goal:
    return _goal(where.rooms[number].position, where.rooms[number].confidence, where.names[number])


def _sound_goal(sound: "SoundEvent") -> Goal:
    score = float(sound.confidences[0]) if sound.confidences else 0.0
    return _goal(sound.position, score, sound.names[0] if sound.names else "sound")


def _thing_goal(thing: "Thing") -> Goal:
    return _goal(thing.position, float(thing.confidence), thing.name, thing.size)


def _rooms_by_size(lists: _Lists) -> Answer:
    where, first = lists.avlmap.where, lists.question.first
    areas = np.array([room.area_m2 for room in where.rooms], np.float64)
    if not len(areas):
        raise QueryError("The map does not know the sizes of rooms: it has no floor plan, or no model of views.")
    order = np.argsort(areas if first else -areas, kind="stable")
    order = order[areas[order] >= _LEAST_M2]
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
    avlmap, first, sounds = lists.avlmap, lists.question.first, lists.avlmap.sounds()
    if not sounds:
        return lists.answer([], "The map holds no sounds.")
    which = "first" if first else "last"
    numbers = sorted(range(len(sounds)), key=lambda number: sounds[number].onset_s * (1.0 if first else -1.0))
    goals = [_sound_goal(sounds[number]) for number in numbers]
    onset_s = sounds[numbers[0]].onset_s
    named = f"is {'' if goals[0].probability >= avlmap.settings.found_at else 'perhaps '}the {goals[0].name}"
    text = placed(f"the {which} sound {named} at {onset_s:.1f} s, heard", goals[0])
    if lists.at != "source":
        return lists.answer(goals, text)
    if not avlmap.source_map.is_located(numbers[0]):
        return lists.answer(goals, f"{text} Where it came from is not found yet; ask again in a moment.")
    from avlmaps.query.sound_sources import source_of

    located = [number for number in numbers if avlmap.source_map.is_located(number)]
    found = [source_of(avlmap, number) for number in located[:_MOST_SOURCES]]
    goals = [
        replace(
            _goal(one.position, one.confidence, one.name or "sound"), probability=one.probability, spread=one.spread
        )
        for one in found
    ]
    things = ", ".join(f"the {name} ({share:.2f})" for name, _, share in found[0].things)
    told = placed(f"the {which} sound {named} at {onset_s:.1f} s; it comes from a place", goals[0])
    return lists.answer(goals, f"{told} It may be {things}." if things else told)


def _heard(lists: _Lists) -> Answer:
    # When and how often a sound was heard, which came first, or what was heard in a room or near a thing.
    question, sounds = lists.question, sorted(lists.avlmap.sounds(), key=lambda sound: sound.onset_s)
    name, how, other = question.name, question.how, question.other
    found = [sound for sound in sounds if not name or _is_called(sound, name)]
    if name and not found:
        names = counted([_sound_goal(sound).name for sound in sounds]) if sounds else "none"
        return lists.answer([], f"No {name} was heard; the map's sounds: {names}.", count=0)
    where, goals = "", list(map(_sound_goal, found))
    if how in ("in", "near"):
        subject, fits = lists.ask(other) if how == "near" and goals else None, list[int]()
        if subject is not None and not subject.found:
            return replace(subject, goals=())
        if subject is not None:
            fits = sorted(number for _, number in _near(lists, subject.goals[0], goals, _HEARD_M))
        elif goals:
            fits = np.flatnonzero(lists.avlmap.where.inside(other, [goal.position for goal in goals])).tolist()
        found, goals, where = [found[n] for n in fits], [goals[n] for n in fits], f" {how} {the_room(other)}"
        if not found:
            return lists.answer([], f"No {name or 'sound'} was heard{where}.", count=0)
    if not name:
        told = ", ".join(f"{goal.name} at {sound.onset_s:.1f} s" for goal, sound in zip(goals, found, strict=True))
        return lists.answer(goals, f"{where[1:].capitalize()} were heard: {told}.", count=len(found))
    if how in ("before", "after"):
        others = [sound for sound in sounds if _is_called(sound, other)]
        if not others:
            return lists.answer([], f"No {other} was heard.")
        one, second = found[0].onset_s, others[0].onset_s
        is_so = one < second if how == "before" else one > second
        return lists.answer(goals, f"{'Yes' if is_so else 'No'}: {name} at {one:.1f} s, {other} at {second:.1f} s.")
    rooms = [f" in the {room}" if (room := lists.avlmap.where.name_of(sound.position)) else "" for sound in found]
    times = [f"at {sound.onset_s:.1f} s{room}" for sound, room in zip(found, rooms, strict=True)]
    often = "once" if len(found) == 1 else f"{len(found)} times"
    text = f"{goals[0].name.capitalize()} was heard{where} {often}: {', '.join(times)}."
    return lists.answer(goals, text, count=len(found))


def _is_called(sound: "SoundEvent", words: str) -> bool:
    # One of the likely names of a sound is meant by words: "the phone ring" is "telephone ringing".
    wanted, meant = _stems(words), lexicon().find(words, EntryKind.SOUND)
    for name, confidence in zip(sound.names, sound.confidences, strict=False):
        if confidence < _LIKELY and name != sound.names[0]:
            continue
        own = _stems(name)
        is_same = meant is not None and lexicon().find(name, EntryKind.SOUND) == meant
        if is_same or (wanted and (wanted <= own or own <= wanted)):
            return True
    return False


def _stems(words: str) -> frozenset[str]:
    forms = sounding_forms()  # "rang" is "ringing"
    plain = (word for word in words.lower().replace("telephone", "phone").split() if word not in _ROUND_SOUNDS)
    return frozenset(stem_of(forms.get(word, word)) for word in plain)


def _names(lists: _Lists) -> Answer:
    kind, where = lists.question.name, lists.avlmap.where if lists.question.name == "rooms" else None
    if where is not None:
        goals = [_room_goal(where, number) for number in range(len(where.rooms))]
    elif kind == "sounds":
        goals = [_sound_goal(sound) for sound in sorted(lists.avlmap.sounds(), key=lambda sound: sound.onset_s)]
    else:
        goals = list(map(_thing_goal, lists.things()))
    named = [goal.name for goal in goals] if where is None else [room.name for room in where.rooms]
    many = f"is 1 {kind[:-1]}" if len(named) == 1 else f"are {len(named) or 'no'} {kind}"
    text = f"There {many}{f': {counted(named)}' if named else ''}."
    return lists.answer(goals, text, count=len(named))


def _changes(lists: _Lists) -> Answer:
    # What is new, gone or moved, in a room or anywhere, and when it was noticed.
    question, days = lists.question, lists.days()
    since = days.visit_of(question.since) if question.since else 0
    answer = changes.changes_answer(days, lists.avlmap.path.name, since, lists.avlmap.where.name_of)
    every: tuple[ChangeKind, ...] = ("new", "moved", "gone")
    kinds: list[ChangeKind] = [kind for kind in every if question.change in ("", kind)]
    listed = [one for one in answer["changes"] if one["kind"] in kinds]
    if question.name:
        inside = lists.avlmap.where.inside(question.name, [one["position"] for one in listed])
        listed = [one for one, is_in in zip(listed, inside, strict=True) if is_in]
        if not lists.avlmap.where.has(question.name):
            return lists.answer([], _no_room(question.name), count=0)
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
    answer = changes.last_seen(lists.days(), name, means(entry.name), lists.avlmap.where.name_of)
    goals = [_goal(one["position"], one["confidence"], one["name"]) for one in answer["seen"]]
    whole = lists.answer(goals, changes.last_seen_text(answer))
    return replace(whole, when=tuple(one["last_seen"] for one in answer["seen"]))


def _usual(lists: _Lists) -> Answer:
    # What is usually somewhere, or where a thing usually is, by the days that looked.
    avlmap, name, how = lists.avlmap, lists.question.name, lists.question.how
    days = Days.of(avlmap, "nobody knows what is usual there")
    if not how:
        meant = means(name)
        found = changes.usual(days, lambda stay: meant(changes.name_of(stay)))
        text = changes.usual_place_text(days, name, found, avlmap.where.name_of)
    elif how == "in":
        if not lists.avlmap.where.has(name):
            return lists.answer([], _no_room(name))
        inside = lists.avlmap.where.inside(name, [stay.position for stay in days.life.stays])
        within = {id(stay) for stay, is_in in zip(days.life.stays, inside, strict=True) if is_in}
        found = changes.usual(days, lambda stay: id(stay) in within)
        text = changes.usual_text(found, f"in {the_room(name)}")
    else:
        subject = lists.ask(name)
        if not subject.found:
            return replace(subject, goals=())
        marks = [goal for goal in subject.goals if goal.probability >= avlmap.settings.found_at]
        found = changes.usual(days, lambda stay: any(lies(avlmap, how, stay, mark) for mark in marks))
        text = changes.usual_text(found, f"{how} the {name}")
    whole = lists.answer([_goal(one.stay.position, one.share, one.name, one.stay.size) for one in found], text)
    is_known = bool(found) and found[0].is_usual
    return replace(whole, found=is_known, usual=tuple(one.to_json() for one in found))


def lies(avlmap: "AVLMap", how: str, stay: "Stay", mark: Goal) -> bool:
    """Return whether a thing lies on or near another."""
    own, place = _Box(avlmap, stay), _Box(avlmap, mark)
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


class _Box:
    # The upright box of a thing, level frame, metres.

    def __init__(self, avlmap: "AVLMap", thing: "Stay | Goal | Thing") -> None:
        self.middle: Float[np.ndarray, 3] = avlmap.space.level(np.array([thing.position]))[0]
        self.size: Float[np.ndarray, 3] = np.array(thing.size)

    def gap_m(self, other: "_Box") -> float:
        # Top-down.
        apart = np.abs(self.middle - other.middle)[:2] - (self.size + other.size)[:2] / 2.0
        return float(np.linalg.norm(np.maximum(apart, 0.0)))

    def overlaps(self, other: "_Box") -> bool:
        # Each holds the middle of the other: they are one thing.
        return bool((np.abs(self.middle - other.middle) <= np.minimum(self.size, other.size) / 2.0).all())


def _at_least(lists: _Lists) -> Answer:
    number, what = lists.question.number, lists.question.name
    answer = lists.ask(f"how many {what} are there")
    count = answer.count or 0
    said = f"{count} of the {number} {what} are found" if count < number else f"{count} {what} are found"
    goals = answer.goals[: max(number, 1)]
    return replace(answer, goals=goals, found=count >= number, text=f"{sentence_of(said)} {answer.text}")


def _rooms_with(lists: _Lists) -> Answer:
    question, where = lists.question, lists.avlmap.where
    subject = lists.ask(f"how many {question.name} are there")
    sure = [goal for goal in subject.goals if goal.probability >= lists.avlmap.settings.found_at]
    inside = where.rooms_of(np.array([goal.position for goal in sure], np.float64).reshape(-1, 3)).tolist()
    often = Counter(number for number in inside if number != NOWHERE).most_common()
    least = question.number or max((count for _, count in often), default=1)
    rooms = [(number, count) for number, count in often if count >= least]
    goals = [_room_goal(where, number) for number, _ in rooms]
    told = ", ".join(f"{the_room(goal.name)} ({count})" for goal, (_, count) in zip(goals, rooms, strict=True))
    which = f"with {least} or more" if question.number else "with the most"
    text = f"Rooms {which} {question.name}: {told or 'none is known'}."
    return lists.answer(goals, text, count=len(rooms))


def _room_of(lists: _Lists) -> Answer:
    subject = lists.ask(lists.question.name)
    if not subject.found:
        return replace(subject, goals=())
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
    subject = lists.ask(name)
    if not subject.found:
        return replace(subject, goals=())
    where, things = lists.avlmap.where, lists.things()
    inside = where.inside(name, [thing.position for thing in things])
    goals = [_thing_goal(thing) for thing, is_in in zip(things, inside, strict=True) if is_in]
    number = f"{len(goals)} thing{'s' * (len(goals) > 1)}: " if lists.question.counts and goals else ""
    text = f"In {the_room(name)}: {number}{counted([goal.name for goal in goals])}."
    text = text if where.has(name) else _no_room(name)
    return lists.answer(goals, text, subject, count=len(goals))


def _beside(lists: _Lists) -> Answer:
    subject = lists.ask(lists.question.name)
    if not subject.found:
        return replace(subject, goals=())
    if lists.question.other:
        return _between(lists, subject)
    goals = list(map(_thing_goal, lists.things()))
    near = _near(lists, subject.goals[0], goals, BESIDE_M)
    words = in_words([one.part for one in subject.parts])
    what = ", ".join(f"{goals[number].name} ({gap:.1f} m)" for gap, number in near[:_MOST_NAMED])
    text = f"Next to {words}: {what or 'no thing that the map is certain of'}."
    return lists.answer([goals[number] for _, number in near], text, subject)


def _near(lists: _Lists, mark: Goal, goals: Sequence[Goal], most_m: float) -> list[tuple[float, int]]:
    # The gap to each goal near a thing and its number, the nearest first. A wall between two
    # rooms parts things; an open plan, however many rooms it is, parts none.
    votes, (own, *boxes) = lists.avlmap.room_votes, [_Box(lists.avlmap, one) for one in (mark, *goals)]
    room, *rooms = lists.avlmap.where.rooms_of(np.array([one.position for one in (mark, *goals)])).tolist()
    near = [(gap, n) for n, box in enumerate(boxes) if (gap := own.gap_m(box)) <= most_m and not own.overlaps(box)]
    apart = {n for _, n in near if votes and rooms[n] != room and votes.plan.parts(mark.position, goals[n].position)}
    return sorted(one for one in near if one[1] not in apart)


def _between(lists: _Lists, one: Answer) -> Answer:
    question, avlmap = lists.question, lists.avlmap
    other = lists.ask(question.other)
    if not other.found:
        return replace(other, goals=())
    if question.how:
        goals = [_room_goal(avlmap.where, number) for number in range(len(avlmap.where.rooms))]
    else:
        goals = list(map(_thing_goal, lists.things()))
    ends = [avlmap.space.level(np.array(end.goals[0].position))[:2] for end in (one, other)]
    places = avlmap.space.level(np.array([goal.position for goal in goals]).reshape(-1, 3))[:, :2]
    fits, sure = lies_between(places, *ends), min(one.probability, other.probability)
    for name in (question.name, question.other):  # what is in a room is not beside it
        if avlmap.where.has(name):
            fits &= ~avlmap.where.inside(name, [goal.position for goal in goals])
    boxes = [_Box(avlmap, end.goals[0]) for end in (one, other)]
    inside = [
        replace(goal, probability=min(goal.probability, sure))
        for goal, is_in in zip(goals, fits.tolist(), strict=True)
        if is_in and not any(box.overlaps(_Box(avlmap, goal)) for box in boxes)
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


def _no_room(name: str) -> str:
    return f"The map shows no room that is a {name} as a whole."


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
    if word.lists:
        things = avlmap.things() if avlmap.has(Kind.PIXELS) else []
        goals = [goal for goal in map(_thing_goal, things) if storeys is None or _storey(storeys, goal) in numbers]
        likely, text = goals[0].probability if goals else 0.0, _list(word, goals)
        goals, found = tuple(goals), bool(goals)
        return Answer(goals[:top], found, (), probability=likely, count=len(goals), notes=notes, text=text)
    return _restricted(avlmap, ask(word.rest, MOST_GOALS), word, numbers, notes, top)


def _no_such(storeys: Storeys | None, word: SaidStorey, notes: tuple[str, ...], whole: Answer | None) -> Answer:
    whole = whole or Answer((), False, ())
    holds = said_storeys(storeys).replace("it", "the map", 1)
    guess = f"; without that the best guess is at {place_text(whole.goals[0].position)}" if whole.goals else ""
    text = sentence_of(f"{holds}, so that nothing is known to be {at_storey(word)}{guess}")
    count = None if whole.count is None else 0
    return replace(whole, found=False, probability=0.0, count=count, notes=(*notes, *whole.notes), text=text)


def _list(word: SaidStorey, goals: Sequence[Goal]) -> str:
    return sentence_of(f"{at_storey(word)}: {counted([goal.name for goal in goals])}")


def _restricted(
    avlmap: "AVLMap", whole: Answer, word: SaidStorey, numbers: Sequence[int], notes: tuple[str, ...], top: int
) -> Answer:
    # The goals of an answer that lie on some storeys; found where the first of them is likely enough.
    storeys, found_at = avlmap.storeys, avlmap.settings.found_at
    here = [goal for goal in whole.goals if storeys is None or _storey(storeys, goal) in numbers]
    likely = here[0].probability if here else 0.0
    found, others = bool(here) and likely >= found_at, whole.alternatives
    count = None if whole.count is None else sum(goal.probability >= found_at for goal in here)
    asked = [one.part for one in whole.parts]
    if not asked:  # a list
        text = _list(word, here)
    elif found:
        text = placed(f"{in_words(asked)} {at_storey(word)} is most likely", here[0])
    else:
        text = _absent(whole, word, here, storeys)
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
        name = storeys[_storey(storeys, whole.goals[0])].name
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


def _storey(storeys: Storeys, goal: Goal) -> int:
    return int(storeys.of_places(np.array([goal.position]))[0])


def at_storey(word: SaidStorey) -> str:
    """Return the words for being on a storey: "upstairs", "on the first floor", "not on the first floor"."""
    at = word.said if word.above is not None and "stairs" in word.said else f"on the {word.said}"
    return f"not {at}" if word.isnt else at
