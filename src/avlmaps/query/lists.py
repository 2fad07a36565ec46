"""Answers from the lists of a map: rooms by size, sounds by time, what is in a room, beside a thing or on a storey."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Bool, Float
from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt, Question
from avlmaps.core.wording import the_room
from avlmaps.core.words import stem_of
from avlmaps.language.list_questions import Listed, ListQuestion
from avlmaps.language.names import sounding_forms
from avlmaps.language.storey_words import SaidStorey
from avlmaps.maps.storeys import Storeys, said_storeys
from avlmaps.query.answer import Alternative, Answer, in_words, place_of, placed
from avlmaps.query.changes import (
    ChangeKind,
    Days,
    changes_answer,
    days_of,
    is_meant,
    last_seen,
    last_seen_text,
    room_namer,
    text_of,
    usual,
    usual_place_text,
    usual_text,
)
from avlmaps.query.edits import means
from avlmaps.query.goals import Goal
from avlmaps.query.whereabouts import NOWHERE, Whereabouts

if TYPE_CHECKING:
    from avlmaps.maps.store.life import Stay
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import SoundEvent, Thing

BESIDE_M = 1.0  # from box to box, horizontally
_ON_M = 0.3  # how far over a thing's box another that lies on it may be
_HANGS = ("wall", "ceiling", "built in")  # such lies on nothing, even over a table
_MOST_NAMED = 12
_LEAST_M2 = 1.0  # of a room; less is a corner that views disagree about
_NO_SIZE = (0.0, 0.0, 0.0)
_LIKELY = 0.3  # of a sound's second name
_ROUND_SOUNDS = frozenset({"the", "a", "an", "of", "sound", "noise", "someone", "somebody", "my", "your", "go", "off"})
_MOST_SOURCES = 5  # of sounds by time; each costs a density


def answer_list(
    avlmap: "AVLMap", question: ListQuestion, top: int, ask: Callable[[str], Answer], at: HeardAt | None = None
) -> Answer:
    """Answer a question from the lists of a map.

    Raises:
        QueryError: the map has no such list.
    """
    match question.of:
        case Listed.ROOM_BY_SIZE:
            goals, text = _rooms_by_size(avlmap, question.first)
        case Listed.SOUND_BY_TIME:
            goals, text = (_sources_by_time if at == "source" else _sounds_by_time)(avlmap, question.first)
        case Listed.NAMES:
            return _names(avlmap, question, top)
        case Listed.CHANGES:
            return _changes(avlmap, question, top)
        case Listed.LAST_SEEN:
            return _last_seen(avlmap, question.name, top)
        case Listed.HEARD:
            return _heard(avlmap, question, top)
        case Listed.USUAL:
            return _usual(avlmap, question, top, ask)
        case Listed.CONTENTS | Listed.BESIDE | Listed.ROOM_OF:
            return _about(avlmap, question, top, ask)
    return _answer(avlmap, goals[:top], text)


def _answer(
    avlmap: "AVLMap", goals: Sequence[Goal], text: str, subject: Answer | None = None, count: int | None = None
) -> Answer:
    probability = goals[0].probability if goals else 0.0
    found = bool(goals) and probability >= avlmap.settings.found_at
    parts, heat = ((), None) if subject is None else (subject.parts, subject.heat)
    said = avlmap.edited.said_of([goal.position for goal in goals], areas={goal.name for goal in goals})
    return Answer(tuple(goals), found, parts, 0.0, heat, probability, count, text=text, notes=said)


def _rooms_by_size(avlmap: "AVLMap", first: bool) -> tuple[list[Goal], str]:
    where = Whereabouts.of(avlmap)
    areas = where.areas_m2()
    if not len(areas):
        raise QueryError("The map does not know the sizes of rooms: it has no floor plan, or no model of views.")
    order = np.argsort(areas if first else -areas, kind="stable")
    order = [int(number) for number in order if areas[number] >= _LEAST_M2]
    goals = [_room_goal(where, number) for number in order]
    if not goals:
        return [], f"The map shows no room of {_LEAST_M2:g} m² or more."
    text = f"the {'smallest' if first else 'largest'} room is the {goals[0].name}, {areas[order[0]]:.0f} m²"
    return goals, placed(text, goals[0])


def _room_goal(where: Whereabouts, number: int) -> Goal:
    room = where.rooms[number]
    return Goal(room.position, room.confidence, _NO_SIZE, {}, room.confidence, where.names[number])


def _sounds_by_time(avlmap: "AVLMap", first: bool) -> tuple[list[Goal], str]:
    sounds = sorted(avlmap.sounds(), key=lambda sound: sound.onset_s if first else -sound.onset_s)
    if not sounds:
        return [], "The map holds no sounds."
    goals = list(map(_sound_goal, sounds))
    which = "first" if first else "last"
    return goals, placed(f"the {which} sound is the {goals[0].name} at {sounds[0].onset_s:.1f} s, heard", goals[0])


def _sound_goal(sound: "SoundEvent") -> Goal:
    score = float(sound.confidences[0]) if sound.confidences else 0.0
    return Goal(sound.position, score, _NO_SIZE, {}, score, sound.names[0] if sound.names else "sound")


def _heard(avlmap: "AVLMap", question: ListQuestion, top: int) -> Answer:
    """Return when, where and how often a sound was heard, which came first, or what was heard in a room."""
    sounds = sorted(avlmap.sounds(), key=lambda sound: sound.onset_s)
    room_of = room_namer(avlmap)
    if question.how == "in":
        places = np.array([sound.position for sound in sounds]).reshape(-1, 3)
        inside = _inside(Whereabouts.of(avlmap), question.name, places) if sounds else np.zeros(0, bool)
        sounds = [sound for sound, is_in in zip(sounds, inside, strict=True) if is_in]
        told = ", ".join(f"{_sound_goal(sound).name} at {sound.onset_s:.1f} s" for sound in sounds)
        text = f"In the {question.name} were heard: {told}." if sounds else f"No sound was in the {question.name}."
        return _answer(avlmap, [_sound_goal(sound) for sound in sounds][:top], text, count=len(sounds))
    found = [sound for sound in sounds if _is_called(sound, question.name)]
    goals = [_sound_goal(sound) for sound in found][:top]
    if not found:
        names = counted([_sound_goal(sound).name for sound in sounds]) if sounds else "none"
        return _answer(avlmap, [], f"No {question.name} was heard; the map's sounds: {names}.", count=0)
    if question.how:
        others = [sound for sound in sounds if _is_called(sound, question.other)]
        if not others:
            return _answer(avlmap, [], f"No {question.other} was heard.")
        one, other = found[0].onset_s, others[0].onset_s
        is_so = one < other if question.how == "before" else one > other
        text = f"{'Yes' if is_so else 'No'}: {question.name} at {one:.1f} s, {question.other} at {other:.1f} s."
        return _answer(avlmap, goals, text)
    rooms = [room_of(sound.position) for sound in found]
    times = [
        f"at {sound.onset_s:.1f} s{f' in the {room}' if room else ''}" for sound, room in zip(found, rooms, strict=True)
    ]
    often = "once" if len(found) == 1 else f"{len(found)} times"
    text = f"{goals[0].name.capitalize()} was heard {often}: {', '.join(times)}."
    return _answer(avlmap, goals, text, count=len(found))


def _is_called(sound: "SoundEvent", words: str) -> bool:
    """Return whether one of the likely names of a sound is meant by words: "the phone ring" is "telephone ringing"."""
    wanted, meant = _stems(words), lexicon().find(words, EntryKind.SOUND)
    for name, confidence in zip(sound.names, sound.confidences, strict=False):
        if confidence < _LIKELY and name != sound.names[0]:
            continue
        if meant is not None and lexicon().find(name, EntryKind.SOUND) == meant:
            return True
        own = _stems(name)
        if wanted and (wanted <= own or own <= wanted):
            return True
    return False


def _stems(words: str) -> frozenset[str]:
    forms = sounding_forms()  # "rang" is "ringing"
    plain = (word for word in words.lower().replace("telephone", "phone").split() if word not in _ROUND_SOUNDS)
    return frozenset(stem_of(forms.get(word, word)) for word in plain)


def _sources_by_time(avlmap: "AVLMap", first: bool) -> tuple[list[Goal], str]:
    """Return the sounds by their onset at the places that they came from, and what the first one may be.

    Raises:
        QueryError: the map does not know where sounds came from.
    """
    heard, _ = _sounds_by_time(avlmap, first)
    if not heard:
        return _sounds_by_time(avlmap, first)
    from avlmaps.query.sound_sources import source_of

    sounds = avlmap.sounds()
    numbers = sorted(range(len(sounds)), key=lambda number: sounds[number].onset_s * (1.0 if first else -1.0))
    listening = avlmap
    if not listening.source_map.is_located(numbers[0]):
        goals, text = _sounds_by_time(avlmap, first)
        return goals, f"{text} Where it came from is not found yet; ask again in a moment."
    located = [number for number in numbers if listening.source_map.is_located(number)]
    found = [source_of(listening, number) for number in located[:_MOST_SOURCES]]
    goals = [
        Goal(one.position, one.confidence, _NO_SIZE, {}, one.probability, one.name or "sound", one.spread)
        for one in found
    ]
    text = f"the {'first' if first else 'last'} sound is the {goals[0].name} at {sounds[numbers[0]].onset_s:.1f} s; "
    things = ", ".join(f"the {name} ({share:.2f})" for name, _, share in found[0].things)
    told = placed(f"{text}it comes from a place", goals[0])
    return goals, f"{told} It may be {things}." if things else told


def _names(avlmap: "AVLMap", question: ListQuestion, top: int) -> Answer:
    if question.name == "rooms":
        where = Whereabouts.of(avlmap)
        goals = [_room_goal(where, number) for number in range(len(where.rooms))]
        named = [room.name for room in where.rooms]
    elif question.name == "sounds":
        goals, _ = _sounds_by_time(avlmap, True)
        named = [goal.name for goal in goals]
    else:
        goals = contents_of(avlmap)
        named = [goal.name for goal in goals]
    text = f"There are {len(named)} {question.name}: {counted(named)}." if named else f"There are no {question.name}."
    return _answer(avlmap, goals[:top], text, count=len(named))


def _changes(avlmap: "AVLMap", question: ListQuestion, top: int) -> Answer:
    """Return what is new, gone or moved, in a room or anywhere, and when it was noticed."""
    days = Days.of(avlmap, avlmap.edited.life)
    since = days.visit_of(question.since) if question.since else 0
    answer = changes_answer(days, avlmap.path.name, since, room_namer(avlmap))
    every: tuple[ChangeKind, ...] = ("new", "moved", "gone")
    kinds: list[ChangeKind] = [kind for kind in every if question.change in ("", kind)]
    listed = [one for one in answer["changes"] if one["kind"] in kinds]
    if question.name:
        places = np.array([one["position"] for one in listed]).reshape(-1, 3)
        inside = _inside(Whereabouts.of(avlmap), question.name, places)
        listed = [one for one, is_in in zip(listed, inside, strict=True) if is_in]
    answer["changes"] = listed
    if question.name and not _has_room(avlmap, question.name):
        return _answer(avlmap, [], _no_room(question.name), count=0)
    goals = [
        Goal(
            tuple(one["position"]), one["confidence"], tuple(one["size"]), {}, one["confidence"], one["name"],  # pyright: ignore[reportArgumentType]
        )
        for one in listed
    ]  # fmt: skip
    whole = _answer(avlmap, goals[:top], text_of(answer, kinds, question.name), count=len(listed))
    # A change is known by depth, however uncertain the name is.
    return replace(whole, found=bool(whole.goals), when=tuple(one["noticed"] for one in listed[:top]))


def _last_seen(avlmap: "AVLMap", name: str, top: int) -> Answer:
    entry = lexicon().head(name, EntryKind.THING)
    if entry is None:
        raise QueryError(f"{name!r} is no thing that is known; name a thing, such as: where was the bag last seen?")
    answer = last_seen(Days.of(avlmap, avlmap.edited.life), name, is_meant(entry.name), room_namer(avlmap))
    goals = [
        Goal(tuple(one["position"]), one["confidence"], _NO_SIZE, {}, one["confidence"], one["name"])  # pyright: ignore[reportArgumentType]
        for one in answer["seen"]
    ]
    whole = _answer(avlmap, goals[:top], last_seen_text(answer))
    return replace(whole, when=tuple(one["last_seen"] for one in answer["seen"][:top]))


def _usual(avlmap: "AVLMap", question: ListQuestion, top: int, ask: Callable[[str], Answer]) -> Answer:
    """Return what is usually somewhere, or where a thing usually is, by the days that looked."""
    days = days_of(avlmap, avlmap.edited.life)
    name = question.name
    if not question.how:
        meant = means(name)
        found = usual(days, lambda stay: meant(stay.name))
        text = usual_place_text(days, name, found, room_namer(avlmap))
    elif question.how == "in":
        if not _has_room(avlmap, name):
            return _answer(avlmap, [], _no_room(name))
        places = np.array([stay.position for stay in days.life.stays]).reshape(-1, 3)
        inside = _inside(Whereabouts.of(avlmap), name, places)
        within = {id(stay) for stay, is_in in zip(days.life.stays, inside, strict=True) if is_in}
        found = usual(days, lambda stay: id(stay) in within)
        text = usual_text(found, f"in {the_room(name)}")
    else:
        subject = ask(name)
        if not subject.found:
            return replace(subject, goals=())
        marks = [goal for goal in subject.goals if goal.probability >= avlmap.settings.found_at]
        found = usual(days, lambda stay: any(lies(avlmap, question.how, stay, mark) for mark in marks))
        text = usual_text(found, f"{question.how} the {name}")
    goals = [Goal(one.stay.position, one.share, one.stay.size, {}, one.share, one.stay.name) for one in found]
    whole = _answer(avlmap, goals[:top], text)
    is_known = bool(found) and found[0].is_usual
    return replace(whole, found=is_known, usual=tuple(one.to_json() for one in found[:top]))


def lies(avlmap: "AVLMap", how: str, stay: "Stay", mark: Goal) -> bool:
    """Return whether a thing lies on or near another."""
    level = avlmap.space.level
    own, place = level(np.array([stay.position]))[0], level(np.array([mark.position]))[0]
    size, mark_size = np.array(stay.size), np.array(mark.size)
    if _overlap(own, size, place, mark_size):
        return False
    if how == "near":
        return _gap_m(own, size, place, mark_size) <= BESIDE_M
    entry = lexicon().find(stay.name, EntryKind.THING)
    if entry is not None and entry.mount in _HANGS:
        return False
    over = bool((np.abs(own - place)[:2] <= mark_size[:2] / 2.0).all())
    rises_m = (own[2] - size[2] / 2.0) - place[2]
    return over and 0.0 <= rises_m <= mark_size[2] / 2.0 + _ON_M


def _about(avlmap: "AVLMap", question: ListQuestion, top: int, ask: Callable[[str], Answer]) -> Answer:
    subject = ask(question.name)
    if not subject.found:
        return replace(subject, goals=())
    if question.of is Listed.ROOM_OF:
        goals, text = _room_of(avlmap, subject)
    elif question.of is Listed.CONTENTS:
        goals, text = _contents(avlmap, question.name)
    else:
        goals, text = _things_beside(avlmap, subject)
    return _answer(avlmap, goals[:top], text, subject)


def _room_of(avlmap: "AVLMap", subject: Answer) -> tuple[list[Goal], str]:
    where, goal = Whereabouts.of(avlmap), subject.goals[0]
    number = int(where.rooms_of(np.array([goal.position]))[0])
    if number == NOWHERE:
        raise QueryError("The map has no rooms: it was built without a model of views.")
    room = where.rooms[number]
    likely = min(goal.probability, room.confidence)
    inside = Goal(goal.position, likely, goal.size, {}, likely, where.names[number])
    words = in_words([one.part for one in subject.parts])
    return [inside], placed(f"{words} is in {the_room(where.names[number])}", inside)


def _contents(avlmap: "AVLMap", name: str) -> tuple[list[Goal], str]:
    where, things = Whereabouts.of(avlmap), _things(avlmap)
    places = np.array([thing.position for thing in things]).reshape(-1, 3)
    inside = _inside(where, name, places)
    goals = [_thing_goal(thing) for thing, is_in in zip(things, inside, strict=True) if is_in]
    if not _has_room(avlmap, name):
        return goals, _no_room(name)
    return goals, f"In {the_room(name)}: {counted([goal.name for goal in goals])}."


def _has_room(avlmap: "AVLMap", name: str) -> bool:
    where = Whereabouts.of(avlmap)
    return where.one_named(name) is not None or any(
        room.may_be(lambda kind: _same_room(kind, name)) for room in where.rooms
    )


def _inside(where: Whereabouts, name: str, points: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
    number = where.one_named(name)
    if number is not None and where.names[number] != where.rooms[number].name:
        return where.rooms_of(points) == number
    return where.parts_of(lambda kind: _same_room(kind, name), points)


def _no_room(name: str) -> str:
    return f"The map shows no room that is a {name} as a whole."


def _things_beside(avlmap: "AVLMap", subject: Answer) -> tuple[list[Goal], str]:
    level, things = avlmap.space.level, _things(avlmap)
    own, size = level(np.array([subject.goals[0].position]))[0], np.array(subject.goals[0].size)
    near: list[tuple[float, Thing]] = []
    for thing in things:
        gap = _gap_m(own, size, level(np.array([thing.position]))[0], np.array(thing.size))
        same = gap == 0.0 and _overlap(own, size, level(np.array([thing.position]))[0], np.array(thing.size))
        if gap <= BESIDE_M and not same:
            near.append((gap, thing))
    near.sort(key=lambda one: one[0])
    goals = [_thing_goal(thing) for _, thing in near]
    words = in_words([one.part for one in subject.parts])
    what = ", ".join(f"{thing.name} ({gap:.1f} m)" for gap, thing in near[:_MOST_NAMED])
    return goals, f"Next to {words}: {what or 'no thing that the map is certain of'}."


def _gap_m(
    a: Float[np.ndarray, "3"], size_a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], size_b: Float[np.ndarray, "3"]
) -> float:
    apart = np.abs(a - b)[:2] - (size_a + size_b)[:2] / 2.0
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


def _overlap(
    a: Float[np.ndarray, "3"], size_a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"], size_b: Float[np.ndarray, "3"]
) -> bool:
    apart = np.abs(a - b)
    return bool((apart <= size_a / 2.0).all() and (apart <= size_b / 2.0).all())


def contents_of(avlmap: "AVLMap") -> list[Goal]:
    """Return all things of a map as goals, the most confident first."""
    return [_thing_goal(thing) for thing in _things(avlmap)]


def _things(avlmap: "AVLMap") -> "list[Thing]":
    return avlmap.things() if "pixels" in avlmap.data.info.models else []


def _thing_goal(thing: "Thing") -> Goal:
    confidence = float(thing.confidence)
    return Goal(thing.position, confidence, thing.size, {}, confidence, thing.name)


def _same_room(kind: str, name: str) -> bool:
    return kind == name or lexicon().is_a(kind, name, EntryKind.ROOM)


def counted(names: Sequence[str]) -> str:
    """Return names, the most frequent first, each with how often it occurs: ``chair (4), sofa``."""
    if not names:
        return "no thing that the map is certain of"
    often = Counter(names).most_common()
    shown = ", ".join(name if count == 1 else f"{name} ({count})" for name, count in often[:_MOST_NAMED])
    return shown + (f" and {len(often) - _MOST_NAMED} kinds more" if len(often) > _MOST_NAMED else "")


_MOST_GOALS = 200


def how_many(avlmap: "AVLMap") -> Answer:
    """Return how many storeys a map has."""
    storeys = avlmap.storeys
    count, text = 1 if storeys is None else len(storeys), said_storeys(storeys).removeprefix("it ")
    return Answer((), True, (), 0.0, probability=1.0, count=count, text=f"The map {text}.")


def answer_on_storey(
    avlmap: "AVLMap", said: Sequence[SaidStorey], top: int, ask: Callable[[str, int], Answer]
) -> Answer:
    """Answer a question that names a storey.

    Raises:
        QueryError: the question names several storeys, or cannot be answered.
    """
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
        goals = [goal for goal in contents_of(avlmap) if storeys is None or _storey(storeys, goal) in numbers]
        likely = goals[0].probability if goals else 0.0
        return Answer(
            tuple(goals[:top]), bool(goals), (), 0.0, None, likely, len(goals), notes, text=_list(word, goals)
        )
    return _restricted(avlmap, ask(word.rest, _MOST_GOALS), word, numbers, notes, top)


def _no_such(storeys: Storeys | None, word: SaidStorey, notes: tuple[str, ...], whole: Answer | None) -> Answer:
    whole = whole or Answer((), False, (), 0.0)
    holds = _sentence(said_storeys(storeys).replace("it", "the map", 1))
    guess = f"; without that the best guess is at {place_of(whole.goals[0])}" if whole.goals else ""
    text = f"{holds}, so that nothing is known to be {at_storey(word)}{guess}."
    count = None if whole.count is None else 0
    return replace(whole, found=False, probability=0.0, count=count, notes=(*notes, *whole.notes), text=text)


def _list(word: SaidStorey, goals: Sequence[Goal]) -> str:
    return f"{_sentence(at_storey(word))}: {counted([goal.name for goal in goals])}."


def _restricted(
    avlmap: "AVLMap", whole: Answer, word: SaidStorey, numbers: Sequence[int], notes: tuple[str, ...], top: int
) -> Answer:
    """Return the goals of an answer that lie on some storeys; found where the first of them is likely enough."""
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
    notes = (*notes, *whole.notes)
    goals = tuple(here[:top])
    return replace(
        whole, goals=goals, found=found, probability=likely, count=count, text=text, notes=notes, alternatives=others
    )


def _absent(whole: Answer, word: SaidStorey, here: Sequence[Goal], storeys: Storeys | None) -> str:
    what = in_words([one.part for one in whole.parts]).removeprefix("the ")
    text = f"No {what} is found {at_storey(word)}"
    if here:
        text += f"; the best guess there is at {place_of(here[0])}, probability {here[0].probability:.2f}"
    if whole.found and storeys is not None:
        name = storeys[_storey(storeys, whole.goals[0])].name
        text += f"; one is found on the {name} at {place_of(whole.goals[0])}, probability {whole.probability:.2f}"
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


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
