"""The demonstration's questions, chosen by rule from what is truly in a home and was shown, never from answers.

Each needs more than a word: the same kind of thing stands in several places, and a sound, a photo or a room says
which one is meant; or the word was never a label; or there is no such thing.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import Modality, Part, Question
from avlmaps.language.questions import parse_sentence
from avlmaps_sim.demo.evidence import Box, Evidence

# Spoken names of labels of training; none of these words was ever a label. The largest come first.
SPOKEN = {
    name: lexicon().named(name, EntryKind.THING).spoken
    for name in ("sofa", "refrigerator", "wardrobe", "bookshelf", "stove", "tv", "chest of drawers", "sink",
                 "nightstand", "trash can", "computer", "carpet")
}  # fmt: skip
# Things that one sends a robot to; doors, curtains and pots are no goals.
FURNITURE = (
    "chair", "armchair", "office chair", "stool", "sofa", "bench", "dining table", "coffee table", "desk", "side table",
    "bed", "nightstand", "wardrobe", "chest of drawers", "bookshelf", "cabinet", "tv", "sink", "plant", "lamp",
)  # fmt: skip
# And what one asks for where there is nothing better.
SMALL = ("trash can", "radiator", "mirror", "monitor", "loudspeaker", "basket", "picture")
# Things that many homes lack; the query for an absent thing uses the first that this one lacks too.
RARE = ("piano", "pool table", "aquarium", "fireplace", "bicycle", "rocking horse", "guitar", "bathtub", "bunk bed")
ROOMS = ("kitchen", "bedroom", "living room", "bathroom", "office", "dining room", "children's room", "hallway", "gym")
# The right thing is at most this far from the place that is named, and every other at least this much farther.
NEAR_M, MARGIN_M = 2.5, 1.5
# Which things are queried, how near and how far the others: the first rule that something in the home satisfies.
_RULES = ((FURNITURE, NEAR_M, MARGIN_M), (FURNITURE, 3.5, 0.8), (SMALL, NEAR_M, MARGIN_M), (SMALL, 3.5, 0.8))
APART_M = 1.0
LEAST_PHOTO_SHARE = 0.02
CLIP, PHOTO, MAP, PAGE = "another_recording.wav", "photo.png", "home.avlmap", "map.html"
# A first goal within this distance of a true place, horizontally, is right (the paper's success radius).
REACH_M = 1.0


@dataclass(frozen=True, slots=True)
class Ask:
    """One question and its truth."""

    kind: str  # what it shows: ``words``, ``sound``, ``clip``, ``area``, ``photo`` or ``absent``
    title: str  # as a person would say it
    why: str  # why it is not easy, one sentence
    command: str  # what to type in the demonstration's folder
    question: Question  # the query
    truth: tuple[Box, ...]  # places that would be right; empty where the right answer is that there is none
    others: tuple[Box, ...] = ()  # things of the same kind that would be wrong
    about: str = ""  # the category, or the sound, that it is about


@dataclass(frozen=True, slots=True, eq=False)
class PhotoView:
    """A picture that the robot did not take.

    ``share`` is for each thing the part of the pixels that shows it; ``away_m`` is the distance from the walk,
    horizontally.
    """

    world_from_camera: Float[np.ndarray, "4 4"]
    share: Float[np.ndarray, " objects"]
    away_m: float


def spoken(categories: Iterable[str]) -> list[str]:
    """Return those of some categories that speech has another word for, the largest first."""
    there = set(categories)
    return [category for category in SPOKEN if category in there]


def by_words(evidence: Evidence) -> Ask | None:
    """Query the largest shown thing by a word that was never a label."""
    for category in spoken(thing.category for thing in evidence.objects):
        own = evidence.of_category(category)
        if evidence.shown[own].any():
            text = f"the {SPOKEN[category]}"
            why = f"“{SPOKEN[category]}” was never a label in training; there the word was “{category}”."
            return _sentence("words", text, why, [Box.of(evidence.objects[i]) for i in own], (), category)
    return None


def near_a_sound(evidence: Evidence, rng: np.random.Generator, used: Sequence[str] = ()) -> Ask | None:
    """Query a thing of which there are several, by a sound that played in one place."""
    names = [event.category for event in evidence.events]
    once = [evidence.events[i] for i in rng.permutation(len(names)) if names.count(evidence.events[i].category) == 1]
    for wanted, near_m, margin_m in _RULES:
        for (category, own), event in product(_several(evidence, wanted, used), once):
            chosen = alone_near(evidence, own, event.source, near_m, margin_m)
            if chosen is None or chosen != alone_near(evidence, own, event.robot, near_m, margin_m):
                continue
            text = f"the {category} near the sound of {event.category}"
            why = f"There are {len(own)} things of that kind here; the sound played near one of them."
            right = [Box.of(evidence.objects[chosen])]
            return _sentence("sound", text, why, right, _others(evidence, own, chosen), category)
    return None


def like_a_clip(evidence: Evidence, folder: Path, rng: np.random.Generator, used: Sequence[str] = ()) -> Ask | None:
    """Query the place of a sound of the same kind as another recording; the caller writes that recording."""
    if not evidence.events:
        return None
    order = [evidence.events[i] for i in rng.permutation(len(evidence.events))]
    event = next((event for event in order if event.category not in used), order[0])
    truth = [box for e in evidence.events if e.category == event.category for box in evidence.heard_from(e)]
    part = Part(Modality.SOUND, str(folder / CLIP), is_file=True)
    title = f"where was a sound like this one recorded? (another recording: {event.category})"
    why = "No word is given, only a clip that is not in the recording."
    command = f"avlmaps query {MAP} --sound-clip {CLIP}"
    return Ask("clip", title, why, command, Question.of([part]), tuple(truth), (), event.category)


def in_a_room(evidence: Evidence, rng: np.random.Generator, used: Sequence[str] = ()) -> Ask | None:
    """Query a thing that stands in rooms of several kinds, in one of these."""
    rooms = sorted(ROOMS, key=lambda kind: (ROOMS.index(kind) > 4, rng.random()))
    for wanted in (FURNITURE, SMALL):
        for (category, own), kind in product(_several(evidence, wanted, used), rooms):
            right = [i for i in own if evidence.kind_of_area(i) == kind]
            wrong = [i for i in own if i not in right]
            if not evidence.shown[right].any() or not evidence.shown[wrong].any():
                continue
            boxes, others = ([Box.of(evidence.objects[i]) for i in some] for some in (right, wrong))
            if min(a.apart_m(b) for a in boxes for b in others) < APART_M:
                continue
            places = len({evidence.objects[i].area for i in own})
            why = f"Things of that kind stand in {places} rooms; only pictures say which room is which."
            return _sentence("area", f"the {category} in the {kind}", why, boxes, others, category)
    return None


def near_a_photo(
    evidence: Evidence, photos: Sequence[PhotoView], folder: Path, used: Sequence[str] = ()
) -> tuple[Ask, PhotoView] | None:
    """Query a thing of which there are several, by a photo that shows one; the caller writes that photo."""
    for wanted, near_m, margin_m in _RULES:
        for (category, own), photo in product(_several(evidence, wanted, used), photos):
            place = photo.world_from_camera[:3, 3].tolist()
            chosen = alone_near(evidence, own, place, near_m, margin_m)
            if chosen is None or photo.share[chosen] < LEAST_PHOTO_SHARE:
                continue
            parts = [Part(Modality.OBJECT, category), Part(Modality.IMAGE, str(folder / PHOTO), is_file=True)]
            why = f"There are {len(own)} things of that kind; the photo was taken {photo.away_m:.1f} m off the walk."
            command = f'avlmaps query {MAP} --object "{category}" --image {PHOTO}'
            right, others = (Box.of(evidence.objects[chosen]),), tuple(_others(evidence, own, chosen))
            title = f"the {category} near where this photo was taken"
            return Ask("photo", title, why, command, Question.of(parts), right, others, category), photo
    return None


def not_there(evidence: Evidence, rng: np.random.Generator) -> Ask | None:
    """Query a thing that the home lacks."""
    there = {thing.category for thing in evidence.objects}
    lacking = [name for name in RARE if name not in there]
    if not lacking:
        return None
    name = lacking[int(rng.integers(min(3, len(lacking))))]
    return _sentence("absent", f"the {name}", "This home has none, and the map should report so.", (), (), name)


def choose_questions(
    evidence: Evidence, photos: Sequence[PhotoView], folder: Path, rng: np.random.Generator
) -> tuple[list[Ask], PhotoView | None]:
    """Return at most six questions, one of each kind that the home allows, and the photo that one of them needs."""
    asks: list[Ask] = []

    def take(ask: Ask | None) -> None:
        asks.extend([ask] if ask is not None else [])

    def used() -> list[str]:
        return [ask.about for ask in asks]

    take(by_words(evidence))
    take(near_a_sound(evidence, rng, used()))
    heard = [ask.title.rpartition("sound of ")[2] for ask in asks]
    take(like_a_clip(evidence, folder, rng, heard))
    take(in_a_room(evidence, rng, used()))
    pictured = near_a_photo(evidence, photos, folder, used())
    take(pictured[0] if pictured else None)
    take(not_there(evidence, rng))
    return asks, pictured[1] if pictured else None


def alone_near(
    evidence: Evidence, own: Sequence[int], place: Sequence[float], near_m: float = NEAR_M, margin_m: float = MARGIN_M
) -> int | None:
    """Return the one shown thing that is near a place while all others of its kind are clearly farther, or None."""
    away = sorted((Box.of(evidence.objects[i]).distance_m(place), i) for i in own)
    if not away or away[0][0] > near_m or not evidence.shown[away[0][1]]:
        return None
    return away[0][1] if len(away) == 1 or away[1][0] - away[0][0] >= margin_m else None


def _several(evidence: Evidence, wanted: Sequence[str], used: Sequence[str]) -> list[tuple[str, list[int]]]:
    ambiguous = evidence.ambiguous()
    names = sorted((name for name in wanted if name in ambiguous), key=lambda name: name in used)
    return [(name, ambiguous[name]) for name in names]


def _others(evidence: Evidence, own: Sequence[int], right: int) -> list[Box]:
    return [Box.of(evidence.objects[i]) for i in own if i != right]


def _sentence(kind: str, text: str, why: str, truth: Sequence[Box], others: Sequence[Box], about: str) -> Ask:
    return Ask(
        kind, text, why, f'avlmaps query {MAP} "{text}"', parse_sentence(text), tuple(truth), tuple(others), about
    )  # fmt: skip
