"""One function answers every query: a sentence or parts, from Python, the command line, the server and the viewer.

``KINDS`` are the kinds of question, tried in turn; of what a sentence may mean, the likeliest answer counts.
"""

import itertools
import re
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AskError, QueryError
from avlmaps.core.files import user_path
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import HeardAt, Modality, Part, Question, Role
from avlmaps.core.registry import Kind
from avlmaps.core.wording import coordinates, option
from avlmaps.perception.protocols import NamedPixelEncoder
from avlmaps.query.answer import WHICH, Alternative, Answer, PartAnswer, absent_text, found_text, placed
from avlmaps.query.contents import NOWHERE, in_room, own_names
from avlmaps.query.factors import UNDERSTOOD_ONLY, Factor, NearAnchors, NearThings
from avlmaps.query.goals import MOST_GOALS, Goal, alike
from avlmaps.query.heatmap import Heatmap, product
from avlmaps.query.modalities import Attachment, Photo, read_picture
from avlmaps.query.places import distance_m, lies_between, place_given

if TYPE_CHECKING:
    from avlmaps.language.questions import AskedSentence
    from avlmaps.language.sentence import OwnName
    from avlmaps.maps.storeys import Storeys
    from avlmaps.query.avlmap import AVLMap

_MOST_ALIKE = 10  # goals that are looked at for others that fit as well
# Each way to name a storey has one of these: floor, storey, story, stories, level, upstairs.
_STOREY_STEMS = ("floor", "stor", "level", "stair")
_READ_AS = re.compile("is read as '(?:near|in)': ")  # in notes
_BETWEEN = re.compile(r"\bbetween\b", re.IGNORECASE)
_NEAR = r"\b(?:near|next to|beside|by|close to)(?: the)?"
_DENIES = re.compile(r"\b(?:no|not|none|without)\b|n't\b", re.IGNORECASE)
_WHETHER = re.compile(r"\b(?:there|have|has|had|got|any|see|seen|find|found)\b", re.IGNORECASE)  # not "is it a or b?"
_ANY = re.compile(r"\bany(?:where)?\b", re.IGNORECASE)
_AND = " and "
# A name that ends so is that of a file.
_FILE = re.compile(r"\.(?:wav|flac|ogg|mp3|m4a|aac|opus|aiff?|png|jpe?g|webp|heic|heif|avif|tiff?|bmp)$", re.IGNORECASE)
_NO_SIDES = "a map finds what is near or in something, not on which side; ask whether it is near, or where each is."
_EXAMPLE = "the red cabinet near the sound of a dog barking"
ENDS = ("between", "and")
"""The relations to the two parts between which goals lie."""
_OF_A_LIST = "The question has an order of its own, so that no place to count from (near) changes it."


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A query as it is given: a sentence, parts, or a question made of parts; a file may come with a sentence."""

    sentence: str = ""
    question: Question | None = None
    object: str | None = None
    sound: str | None = None
    area: str | None = None
    image: str | None = None  # a photo: the path of a file, or the name of an attachment
    clip: str | None = None  # a sound clip, likewise
    primary: Modality | None = None  # the part that is sought; None: the sentence says it, or the first part
    top: int = 3
    at: HeardAt | None = None  # the place of its sounds; None: as the map's settings say, else as the words do
    near: str | Sequence[float] | None = None  # the goals nearest to this place come first
    at_by_words: bool = False  # its words chose ``at``: of several sounds, each may have a place of its own
    camera: Pinhole | Sequence[float] | None = None  # of its photo, or fx, fy, cx, cy in pixels; None: the map's own
    attachments: Mapping[str, Attachment] | None = None  # by name; None where the names are those of files

    def __post_init__(self) -> None:
        if not isinstance(self.sentence, str):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise AskError(f"A query is a sentence, such as: {_EXAMPLE}; not {type(self.sentence).__name__}.")
        if self.top < 1:
            raise AskError(f"At most {self.top} goals are wanted; the number must be 1 or more.")
        named = any(part is not None for part in (self.object, self.sound, self.area))
        if self.question is not None:
            if named or self.files or self.primary is not None:
                raise AskError("A question holds its parts already; give a sentence or parts instead.")
            return
        for kind, name in (("object", self.object), ("sound", self.sound), ("area", self.area)):
            if name is not None and _FILE.search(name.strip()):
                raise AskError(_no_name(kind, name, self.attachments is None))
        words = bool(self.sentence.strip())
        if words == named and (words or not self.files):
            raise AskError(
                "A query takes a sentence, or parts (object, sound, area, photo, clip), "
                f"and {'not both' if words else 'nothing is given'}; for example: {_EXAMPLE}."
            )

    @property
    def files(self) -> tuple[str, ...]:
        """The photo and the clip that are given."""
        return tuple(file for file in (self.image, self.clip) if file is not None)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts, where no sentence is given."""
        named = (
            (Modality.OBJECT, self.object, False),
            (Modality.IMAGE, self.image, True),
            (Modality.SOUND, self.sound, False),
            (Modality.SOUND, self.clip, True),
            (Modality.AREA, self.area, False),
        )
        return tuple(Part(modality, query, is_file=is_file) for modality, query, is_file in named if query is not None)

    def camera_of(self, question: Question) -> Pinhole | None:
        """Return the camera of a question's picture. ``AskError``: there is no picture, or no such camera."""
        if self.camera is None or isinstance(self.camera, Pinhole):
            return self.camera
        picture = next((part.query for part in question.parts if part.modality is Modality.IMAGE), "")
        attached = None if self.attachments is None else self.attachments.get(picture)
        rgb = attached.rgb if isinstance(attached, Photo) else attached
        if picture and self.attachments is None:
            rgb = read_picture(user_path(picture))
        if not isinstance(rgb, np.ndarray):
            raise AskError("Intrinsics belong to a photo; there is none.")
        try:
            fx, fy, cx, cy = self.camera
            return Pinhole(fx, fy, cx, cy, width=rgb.shape[1], height=rgb.shape[0])
        except ValueError:
            raise AskError(
                f"Intrinsics are fx,fy,cx,cy in pixels, such as 525,525,320,240; not {tuple(self.camera)}."
            ) from None


def _no_name(kind: str, name: str, may_look: bool) -> str:
    given = option("image", "FILE") if kind == "object" else option("sound-clip", "FILE", argument="clip")
    if may_look and not user_path(name).is_file():
        return f"There is no file {name[:200]!r}; check the name. A file is given as a photo or a clip ({given})."
    return f"{name[:200]!r} is a file, and no {kind}'s name; give it as a photo or a clip ({given})."


@dataclass(frozen=True, slots=True)
class _Asking:
    avlmap: "AVLMap"
    asked: Asked

    def but(self, **changes: object) -> "_Asking":
        return _Asking(self.avlmap, replace(self.asked, **changes))  # pyright: ignore[reportArgumentType]

    def answer(self, after: "_Kind | None" = None) -> Answer:
        """Return the answer of the first kind of question that it is, of those after one."""
        kinds = KINDS if after is None else KINDS[KINDS.index(after) + 1 :]
        return next(found for kind in kinds if (found := kind(self)) is not None)


_Kind = Callable[[_Asking], Answer | None]


def ask(avlmap: "AVLMap", asked: Asked) -> Answer:
    """Answer a sentence or parts. ``QueryError`` and ``AskError``: it is not understood, or does not fit together."""
    begin, place = time.perf_counter(), None if asked.near is None else place_given(asked.near)
    answer = _Asking(avlmap, asked if place is None else replace(asked, top=MOST_GOALS)).answer()
    if place is not None:
        answer = _nearest_first(avlmap, answer, place, asked.top)
    answer = on_storey(_with_corrections(avlmap, answer), avlmap.storeys)
    return replace(answer, elapsed_ms=1e3 * (time.perf_counter() - begin))


def _nearest_first(avlmap: "AVLMap", answer: Answer, place: Float[np.ndarray, " n"], top: int) -> Answer:
    # Of what counts as found, one that is less than half as likely as the best is left behind, as when a robot goes to
    # the nearest. Of what is not found, the likeliest guess stays first.
    from avlmaps.language.questions import FROM_NOWHERE

    if any(goal.name for goal in answer.goals):
        when, usual = answer.when[:top], answer.usual[:top]
        return replace(answer, goals=answer.goals[:top], when=when, usual=usual, notes=(*answer.notes, _OF_A_LIST))
    if not answer.found or not answer.goals:
        return replace(answer, goals=answer.goals[:top])
    least = max(avlmap.settings.found_at, answer.goals[0].probability / 2.0)

    def away_m(goal: Goal) -> float:
        return distance_m(avlmap.space.level, goal.position, place)

    found = sorted((goal for goal in answer.goals if goal.probability >= least), key=away_m)
    goals = (*found, *(goal for goal in answer.goals if goal.probability < least))[:top]
    notes = tuple(note for note in answer.notes if not note.startswith(FROM_NOWHERE))
    text = answer.text
    if len(found) > 1 and answer.count is None:
        away = f"{away_m(goals[0]):.1f} m away"
        text = placed(f"from ({coordinates(place)}) the nearest of {len(found)} that are found, {away}, is", goals[0])
    return replace(answer, goals=goals, text=text, notes=notes)


def _with_corrections(avlmap: "AVLMap", answer: Answer) -> Answer:
    # Says who corrected what the answer is about: its goals, or those that are likely where it is not found as a whole
    # ("are there three chairs" where there is one, "a and b" where b is missing).
    listed = [goal.name for goal in answer.goals if goal.name]
    least = 0.0 if answer.found or listed else max(avlmap.settings.found_at, 1e-3)
    places = [goal.position for goal in answer.goals if goal.probability >= least]
    named = {kind: [one.part.query for one in answer.parts if one.part.modality is kind] for kind in Modality}
    said = avlmap.edited.said_of(places, named[Modality.OBJECT], [*named[Modality.AREA], *listed])
    return replace(answer, notes=(*answer.notes, *said))


def on_storey(answer: Answer, storeys: "Storeys | None") -> Answer:
    """Return an answer of a map of several storeys with each goal's storey, and that of the first in its text."""
    if storeys is None:
        return answer
    text = answer.text
    if answer.found and answer.goals and answer.parts and answer.count is None:
        name = storeys[int(storeys.of_places(np.array(answer.goals[0].position))[0])].name
        text = text if name in text else f"{text} It is on the {name}."
    return replace(answer, storeys=storeys, text=text)


def _of_storeys(asking: _Asking) -> Answer | None:
    sentence = asking.asked.sentence
    if not any(stem in sentence.lower() for stem in _STOREY_STEMS):  # a query of one word loads nothing of the language
        return None
    from avlmaps.language.said_places import asks_how_many_storeys, said_storeys
    from avlmaps.query.lists import answer_on_storey, how_many

    if asks_how_many_storeys(sentence):
        return how_many(asking.avlmap)
    if not (said := said_storeys(sentence)):
        return None
    return answer_on_storey(
        asking.avlmap, said, asking.asked.top, lambda rest, top: asking.but(sentence=rest, top=top).answer(_of_storeys)
    )


def _of_both(asking: _Asking) -> Answer | None:
    if _AND not in asking.asked.sentence.lower():
        return None
    from avlmaps.language.list_questions import said_each

    said = said_each(asking.asked.sentence)
    return _together([asking.but(sentence=one).answer(_of_both) for one in said], asking.asked.top) if said else None


def _together(answers: Sequence[Answer], top: int) -> Answer:
    # The best goal of each comes first; found where all are.
    lasting = sorted(((rank, number) for number, one in enumerate(answers) for rank in range(len(one.goals))))[:top]
    several = ("parts", "notes", "alternatives")
    parts, notes, others = ([value for one in answers for value in getattr(one, name)] for name in several)
    counts = [one.count for one in answers if one.count is not None]
    return replace(
        answers[0], goals=tuple(answers[number].goals[rank] for rank, number in lasting),
        found=all(one.found for one in answers), probability=min(one.probability for one in answers),
        count=sum(counts) if len(counts) == len(answers) else None, parts=tuple(parts),
        notes=tuple(dict.fromkeys(notes)), alternatives=tuple(others), text=" ".join(one.text for one in answers),
        alike=0, when=(), usual=(), again=None,
    )  # fmt: skip


def _of_parts(asking: _Asking) -> Answer | None:
    asked = asking.asked
    question = asked.question or thing_alone(asked, asking.avlmap)
    if question is None and asked.parts and not asked.sentence.strip():
        question = Question.of(asked.parts, asked.primary)
    return None if question is None else _answered(asking.avlmap, question.heard_at(asked.at), asked)


def _of_sources(asking: _Asking) -> Answer | None:
    from avlmaps.language.said_places import asks_for_source
    from avlmaps.query.sound_sources import no_sources

    if (asking.asked.at or asking.avlmap.settings.sounds.at) is not None or not asks_for_source(asking.asked.sentence):
        return None
    why = no_sources(asking.avlmap)
    answer = (asking if why else asking.but(at="source", at_by_words=True)).answer(_of_sources)
    silent = answer.parts and not any(one.part.modality is Modality.SOUND for one in answer.parts)
    return answer if silent or not why else replace(answer, notes=(why, *answer.notes))


def _of_lists(asking: _Asking) -> Answer | None:
    from avlmaps.language.list_questions import list_question, read_list
    from avlmaps.query.lists import answer_list

    asked, own = asking.asked, own_names(asking.avlmap, asking.asked.sentence)
    listed, notes = read_list(asked.sentence, own), ()
    if listed is None and asked.sentence.strip():
        try:
            read = _reading(asked, asked.sentence, own)
        except QueryError:  # `_read` says why a sentence is not understood
            return None
        listed, notes = list_question(read.inquiry), read.notes
    answer = listed and answer_list(asking.avlmap, listed, asked.top, partial(_about, asking), asked.at)
    return answer and _noted(answer, notes, whether=answer.text.startswith("Yes"))


def _noted(answer: Answer, notes: Collection[str], *, whether: bool) -> Answer:
    # Says how words were read. A yes or no does not rest on a distance where a side is asked.
    sides = [note for note in notes if _READ_AS.search(note)]
    if whether and sides and all(part.found for part in answer.parts):
        raise QueryError(f"{sides[0].split(' is read')[0]}: {_NO_SIDES}")
    every = tuple(dict.fromkeys((*notes, *answer.notes)))
    return replace(answer, notes=every, text=" ".join(dict.fromkeys((answer.text, *sides))))


def _about(asking: _Asking, words: str) -> Answer:
    return _read(asking.but(sentence=words, primary=None, top=MOST_GOALS))


def _read(asking: _Asking) -> Answer:
    asked, avlmap = asking.asked, asking.avlmap
    from avlmaps.language.intents import Ask
    from avlmaps.language.list_questions import said_alternatives

    own = own_names(avlmap, asked.sentence)
    read = [_reading(asked, words, own) for words in said_alternatives(asked.sentence) or (asked.sentence,)]
    questions = dict.fromkeys(question for one in read for question in one.questions)
    notes, kind = dict.fromkeys(note for one in read for note in one.notes), read[0].inquiry.ask
    counted = kind is Ask.HOW_MANY
    if not questions and (listed := _of_lists(asking)):  # "the largest room" in another question
        return listed
    answers: list[tuple[Question, Answer]] = []
    for question in (_placed(one, asked.at) for one in questions):
        if asked.primary is not None:
            question = Question.of(question.parts, asked.primary)
        used = {part.query for part in question.parts if part.is_file}
        if not used.issuperset(asked.files):
            raise AskError(
                "The sentence does not speak of the file; say 'near where this photo was taken' or 'near the sound of "
                "this recording' in it, or take the sentence or the file away."
            )
        wanted = replace(asked, top=MOST_GOALS) if counted else asked
        answers.append((question, _answered(avlmap, question, wanted, counted=counted)))
    words = asked.sentence.lower()
    is_all = kind is Ask.WHERE and _AND in words and " or " not in words and len(answers) > 1
    if is_all and all(question.lead.query.lower() in words for question, _ in answers):  # none is what serves a purpose
        return _together([replace(one, notes=(*notes, *one.notes)) for _, one in answers], asked.top)
    answers.sort(key=lambda one: (one[1].found, one[1].probability), reverse=True)
    best, others = answers[0][1], answers[1:]
    alternatives = tuple(Alternative(question, one.probability, one.found, one.goals[:1]) for question, one in others)
    if counted and any(one.part.role is Role.PRIMARY and one.part.modality is Modality.AREA for one in best.parts):
        best = replace(best, goals=_one_a_room(avlmap, best.goals))
    count = sum(goal.probability >= avlmap.settings.found_at for goal in best.goals) if counted else None
    text = found_text(best.parts, best.goals[0], count) if best.found and counted else best.text
    if kind is Ask.EXISTS or _ANY.search(asked.sentence):  # any will do
        text = text.removesuffix(f" {WHICH}")
    if kind is Ask.EXISTS and others and not _WHETHER.search(asked.sentence):
        text = " ".join([text, *(one.text for _, one in others if one.found == best.found)])
    # A bare yes to "is there no chair" says nothing, and what was not found may be there.
    elif kind is Ask.EXISTS and not _DENIES.search(asked.sentence):
        text = f"Yes. {text}" if best.found else text if text.startswith("No ") else f"No. {text}"
    told = replace(
        best, goals=best.goals[: asked.top], count=count, alternatives=(*best.alternatives, *alternatives), text=text
    )
    return _noted(told, notes, whether=kind is Ask.EXISTS)


KINDS: tuple[_Kind, ...] = (_of_storeys, _of_both, _of_parts, _of_sources, _of_lists, _read)
"""The kinds of question, in the order in which they are tried."""


def thing_alone(asked: Asked, avlmap: "AVLMap") -> Question | None:
    """Return the question where a query is the name of one thing alone; stairs, also an area, need the grammar."""
    if asked.files or asked.primary not in (None, Modality.OBJECT):
        return None
    if not asked.sentence.strip():
        return Question.of(asked.parts) if len(asked.parts) == 1 and asked.object is not None else None
    kinds = {entry.kind for entry in lexicon().senses(asked.sentence)}
    if kinds != {EntryKind.THING} or not avlmap.has(Kind.PIXELS):
        return None
    encoder = avlmap.encoders.pixels
    is_name = isinstance(encoder, NamedPixelEncoder) and asked.sentence in encoder.vocabulary
    return Question.of([Part(Modality.OBJECT, asked.sentence)]) if is_name else None


def _reading(asked: Asked, words: str, own: "tuple[OwnName, ...]") -> "AskedSentence":
    return _read_words(words, asked.image, asked.clip, own, None if asked.at_by_words else "robot")


@lru_cache(maxsize=512)
def _read_words(
    sentence: str, image: str | None, clip: str | None, own: "tuple[OwnName, ...]", at: HeardAt | None
) -> "AskedSentence":
    from avlmaps.language.questions import read_question
    from avlmaps.language.sentence import Attachments

    return read_question(sentence, Attachments(image, clip, knows=lambda _: True, at=at, own=own))


def _placed(question: Question, at: HeardAt | None) -> Question:
    # Several sounds that say where a thing is have each the place of its own words, if those of one do. Where a sound
    # is sought, the words round it stand at both ends: "where does the barking near the sound of water come from?".
    places = [part.at for part in question.parts if part.modality is Modality.SOUND]
    each = len(places) > 1 and any(places) and question.parts[0].modality is not Modality.SOUND
    return question if each else question.heard_at(at)


def _related(sentence: str, question: Question) -> Question:
    # The goals lie between the two parts of context that are named behind "between", whatever they are. No room lies in
    # another one.
    said = _BETWEEN.search(sentence)
    context = [part for part in question.parts if part.role is Role.CONTEXT]
    ends = context if said else []
    if said and len(ends) > 2:
        ends = [part for part in ends if part.query.casefold() in sentence[said.end() :].casefold()]
    if said and len(ends) != len(ENDS):
        raise QueryError("Between what does it lie? Name two things, like: the chair between the sofa and the table.")
    named = dict(zip(map(id, ends), ENDS, strict=False))
    rooms = "near" if question.lead.modality is Modality.AREA else ""
    others = "|".join(re.escape(part.query) for part in question.parts)  # "near the kitchen window" is in the kitchen
    said_near = {part: rf"{_NEAR} {re.escape(part.query)}\b(?! (?:{others})\b)" for part in context}
    near = {id(part): "near" for part, says in said_near.items() if re.search(says, sentence, re.I)}
    return Question(tuple(replace(part, relation=(near | named).get(id(part), rooms)) for part in question.parts))


def _answered(avlmap: "AVLMap", question: Question, asked: Asked, *, counted: bool = False) -> Answer:
    if all(part.modality is not Modality.AREA for part in question.parts):
        question = Question(tuple(dict.fromkeys(one for part in question.parts for one in in_room(avlmap, part))))
    camera, question = asked.camera_of(question), _related(asked.sentence, question)
    heats = [avlmap.heat(replace(part, relation=""), camera, asked.attachments) for part in question.parts]
    # Of what is counted in an area, the things that lists have in it count.
    heat, factors = _fused(avlmap, question, heats, counted=counted)
    several, found = tuple(heat.goals(max(asked.top, _MOST_ALIKE))), heat.found
    if several and found and several[-1].probability >= heat.found_at:  # there may be more
        several = tuple(heat.goals(MOST_GOALS))
    goals, equal = several[: asked.top], alike(several, heat.found_at, is_half=UNDERSTOOD_ONLY in heat.lead.note)
    count = sum(goal.probability >= heat.found_at for goal in several)
    said = (replace(part, at=factor.part.at) for part, factor in zip(question.parts, factors, strict=True))
    question = Question(tuple(said))
    parts = tuple(_part_answer(*both, heat) for both in zip(question.parts, factors, strict=True))
    alone = () if found or len(heats) == 1 else (_alone(question, heats),)
    if found:
        text = found_text(parts, goals[0], alike=equal, of=count)
    else:
        text = absent_text(parts, goals, next(iter(alone), None))
    return Answer(
        goals, found, parts, heat=heat, probability=heat.probability, text=text, alternatives=alone,
        notes=avlmap.data.info.doubts, alike=len(equal) if found else 0,
    )  # fmt: skip


def _fused(
    avlmap: "AVLMap", question: Question, heats: Sequence[Heatmap], *, counted: bool
) -> tuple[Heatmap, list[Factor]]:
    # The product of the parts, and the factor of each. Areas that goals lie between, or that things are counted in,
    # bound the goals instead: what is counted in one is no likelier than that there is any.
    areas = [part.role is Role.CONTEXT and part.modality is Modality.AREA for part in question.parts]
    ends = [part.relation in ENDS for part in question.parts]
    counts_things = counted and question.lead.modality is Modality.OBJECT
    bounds = [is_area and (is_end or counts_things) for is_area, is_end in zip(areas, ends, strict=True)]
    beside = question.lead.modality is Modality.AREA  # no room is in another one
    fused = [
        Heatmap.of(one.factors[0].cones(), one.found_at) if is_area and beside else one
        for one, is_area, is_bound in zip(heats, areas, bounds, strict=True)
        if not is_bound
    ]
    heat = product(fused)
    of_fused = iter(heat.factors)
    factors = [one.factors[0] if is_bound else next(of_fused) for one, is_bound in zip(heats, bounds, strict=True)]
    if any(ends):
        heat = heat.only(_between(*(one.factors[0] for one, is_end in zip(heats, ends, strict=True) if is_end)))
    for part, is_end, is_bound in zip(question.parts, ends, bounds, strict=True):
        if is_bound and not is_end:
            most, inside = product(heats).probability, partial(avlmap.where.inside, part.query)
            heat = heat.only(lambda places, most=most, inside=inside: most * inside(places))
    return heat, factors


def _part_answer(part: Part, factor: Factor, whole: Heatmap) -> PartAnswer:
    best, peak = float(np.max(factor.confidence, initial=0.0)), 0.0
    if isinstance(factor, NearAnchors):
        best = float((factor.scores * factor.confidence[factor.instance]).max(initial=0.0))
        peak = float(factor.scores.max(initial=0.0))
    elif isinstance(factor, NearThings):
        peak = float(factor.mask.any())
    is_found = factor.found or (whole.found and part.role is Role.PRIMARY)
    return PartAnswer(part, peak, is_found, factor.understood, factor.note, best if factor.is_named else 0.0)


def _alone(question: Question, heats: Sequence[Heatmap]) -> Alternative:
    part, heat = next(both for both in zip(question.parts, heats, strict=True) if both[0].role is Role.PRIMARY)
    return Alternative(Question.of([part]), heat.probability, heat.found, tuple(heat.goals(1)))


def _between(one: Factor, other: Factor) -> "Callable[[Float[np.ndarray, 'n 3']], Float[np.ndarray, ' n']]":
    # How likely each place lies between an instance of one factor and one of the other: as likely as both are.
    level = one.space.level

    def between(places: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, " n"]:
        at, most = level(places)[:, :2], np.zeros(len(places))
        for (a, sure), (b, also) in itertools.product(_instances(one), _instances(other)):
            most = np.maximum(most, np.where(lies_between(at, a, b), min(sure, also), 0.0))
        return most

    return between


def _instances(factor: Factor) -> list[tuple[Float[np.ndarray, "2"], float]]:
    # The middle of each instance, level x and y, and how likely it is what is meant.
    level, found = factor.space.level(factor.anchors)[:, :2], list[tuple[Float[np.ndarray, "2"], float]]()
    for number, sure in enumerate(factor.confidence.tolist()):
        own = factor.instance == number
        itself = float(factor.scores[own].max(initial=0.0)) if isinstance(factor, NearAnchors) else 1.0
        found.append((level[own].mean(axis=0), sure * itself))
    return found


def _one_a_room(avlmap: "AVLMap", goals: Sequence[Goal]) -> tuple[Goal, ...]:
    rooms: list[int] = avlmap.where.rooms_of(np.array([goal.position for goal in goals])).tolist()
    first = {room: at for at, room in reversed(list(enumerate(rooms)))}
    return tuple(goal for at, goal in enumerate(goals) if rooms[at] == NOWHERE or first[rooms[at]] == at)
