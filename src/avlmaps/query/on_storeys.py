"""Questions about storeys: the goals of an answer that lie upstairs, or on the first floor; what there is at all."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Question
from avlmaps.language.storey_words import SaidStorey
from avlmaps.maps.storeys import Storeys, said_storeys
from avlmaps.query.answer import Alternative, Answer
from avlmaps.query.goals import Goal
from avlmaps.query.lists import contents_of, counted
from avlmaps.query.wording import in_words, place_of, placed

if TYPE_CHECKING:
    from avlmaps.query.queryable import Queryable

_MOST_GOALS = 200


def how_many(avlmap: "Queryable") -> Answer:
    """Return how many storeys a map has."""
    storeys = avlmap.storeys
    count, text = 1 if storeys is None else len(storeys), said_storeys(storeys).removeprefix("it ")
    return Answer((), True, (), 0.0, probability=1.0, count=count, text=f"The map {text}.")


def answer_on_storey(
    avlmap: "Queryable", said: Sequence[SaidStorey], top: int, ask: Callable[[str, int], Answer]
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
    avlmap: "Queryable", whole: Answer, word: SaidStorey, numbers: Sequence[int], notes: tuple[str, ...], top: int
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
