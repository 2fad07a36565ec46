"""From a sentence to a question for the map: where something is, how many there are, whether there is one."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import dropwhile

from avlmaps.core.errors import QueryError
from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.question import MOST_CHARACTERS, Modality, Part, Question
from avlmaps.language.claims import claimed, unmet_by
from avlmaps.language.intents import Ask, Inquiry, Pick, Target, TargetKind
from avlmaps.language.learned.decision import NameResolver, is_doubtful, kind_of
from avlmaps.language.learned.reader import Read, ReadingLimits, learned_reader
from avlmaps.language.list_questions import least_said
from avlmaps.language.names import is_entry, is_known, sounding_forms, sounds_like, third_forms
from avlmaps.language.sentence import ASK, Attachments, Sentence, language_of, stand_ins
from avlmaps.language.verbalise import lacks_file, phrase
from avlmaps.language.word_classes import listed, load_word_classes, pattern, word_list

_EXAMPLE = "the chair near the sound of glass breaking"
_NO_USE = f"What serves that purpose is not known; name the thing, like: {_EXAMPLE}."
_MODALITIES = {kind: Modality(kind.replace("clip", "sound")) for kind in TargetKind if kind is not TargetKind.HERE}
_OWN: Mapping[str, str] = dict.fromkeys(("his", "her", "their", "our", "your", "its"), "my")
_TABLE = "list_questions"
_listed = partial(word_list, _TABLE)


@dataclass(frozen=True, slots=True)
class AskedSentence:
    """The query of a sentence, and a note (one sentence) for each word that was taken for another."""

    inquiry: Inquiry
    notes: tuple[str, ...] = ()

    @property
    def questions(self) -> tuple[Question, ...]:
        """One question for each target; any of them answers. None where the lists of a map do."""
        every = ([target, *target.near] for target in self.inquiry.of)
        parts = ([Part(_MODALITIES[x.kind], x.name, is_file=x.is_file, at=x.at) for x in of] for of in every)
        return tuple(map(Question.of, parts))


def parse_sentence(sentence: str) -> Question:
    """Return the question that a sentence asks, see `read_question`.

    Its first part is sought, the others say where it is.
    """
    return read_question(sentence, Attachments(knows=lambda _: True)).questions[0]


def read_question(text: str, given: Attachments | None = None) -> AskedSentence:
    """Return the query of a sentence.

    Raises a QueryError where it is empty, too long, or not understood, or where a name or a file is not known.
    """
    if not any(mark.isalnum() for mark in text):
        raise QueryError(f"The sentence has no words; say what is sought, such as: {_EXAMPLE}.")
    if len(text) > MOST_CHARACTERS:
        raise QueryError(
            f"The sentence has {len(text)} characters, more than {MOST_CHARACTERS}; say it shorter, like: {_EXAMPLE}."
        )
    given = given or Attachments()
    stand = stand_ins(text, given.own, pictures=given.image is None)
    if stand.own:
        try:
            read = read_question(stand.text, replace(given, own=()))
        except QueryError as refused:
            raise QueryError(stand.back(str(refused))) from None
        of = tuple(map(stand.target, read.inquiry.of))
        return AskedSentence(replace(read.inquiry, of=of), tuple(map(stand.back, read.notes)))
    if language := language_of(text):
        raise QueryError(ASK.format(language=language))
    sentence = Sentence(_where_it_sounds(text), given)
    if named := by_name(sentence):
        return named
    reader = learned_reader()
    return asked(sentence, reader.question(sentence.tokens), reader.limits)


def _where_it_sounds(text: str) -> str:
    found = pattern(_TABLE, "what_sounds").match(text.lower())
    ing = sounding_forms().get(found["verb"]) if found else None
    if not found or not ing or found["verb"] in listed("silent"):
        return text
    return f"where is what is {ing}{found['rest']}" if found["is"] or found["verb"] in third_forms() else text


def by_name(sentence: Sentence) -> AskedSentence | None:
    """Return the query of a sentence that is one name and nothing else, which needs no reading; None for others."""
    said = [token for token in sentence.tokens if token.kind != "punct"]
    words = [token.text for token in said if token.text not in _listed("plain_articles")]
    name, plain = " ".join(words), all(token.kind == "word" for token in said)
    if not (plain and words and is_entry(name)) or any(sounds_like(word) for word in words):
        return None
    return AskedSentence(Inquiry(Ask.WHERE, (Target(kind_of(name, TargetKind.OBJECT), name),)), sentence.notes)


def asked(sentence: Sentence, reads: Sequence[Read], limits: ReadingLimits) -> AskedSentence:
    """Return the query of a sentence that was read; raises a QueryError as `read_question` does."""
    use = use_in(sentence.text)
    if pattern(_TABLE, "described").search(sentence.text.lower()):
        if use is None:
            raise QueryError(_NO_USE)
        return _resolved(_for_use(sentence, use, limits), sentence)
    if not reads or (reads[0].meaning is None and not reads[0].is_purpose):
        if file := lacks_file(sentence.tokens):
            raise QueryError(file.question)
        answers = "It answers where things, sounds or rooms are, and how many; ask it"
        raise _refused(sentence, f"A map cannot answer this. {answers}")
    named = reads[0].meaning.of if isinstance(reads[0].meaning, Inquiry) else ()
    as_thing = any(one.name.endswith(use or "?") and not is_known(one.name) for one in named)  # "somewhere to sleep"
    if use is not None and (reads[0].is_purpose or as_thing):
        return _resolved(_for_use(sentence, use, limits), sentence)
    plain = [read for read in reads if isinstance(read.meaning, Inquiry)]
    if reads[0].is_purpose:  # no purpose is said, so that this was none of the readings
        plain = [replace(read, probability=read.probability / (1.0 - reads[0].probability + 1e-6)) for read in plain]
    if not plain:
        raise QueryError(_NO_USE)
    return _resolved(_likely(plain, sentence, limits), sentence)


def _refused(sentence: Sentence, otherwise: str) -> QueryError:
    found = claimed("unanswered", sentence.tokens)
    return QueryError(getattr(found, "question", f"{otherwise} like: {_EXAMPLE}."))


def _likely(reads: Sequence[Read], sentence: Sentence, limits: ReadingLimits) -> Inquiry:
    best = reads[0].meaning
    assert isinstance(best, Inquiry)
    others = [(one.meaning, one.probability) for one in reads if isinstance(one.meaning, Inquiry)]
    alike = sum(likely for one, likely in others if one.of == best.of and (best.of or one.ask is best.ask))
    if alike < (limits.question_doubtful if is_doubtful(sentence.tokens, reads[0].used) else limits.question):
        raise _refused(sentence, f"{sentence.text.strip()[:80]!r} is not understood; say it")
    if back := unmet_by(sentence.tokens, best, reads[0].used):
        raise QueryError(back)
    return best


def use_in(text: str) -> str | None:
    """Return the longest purpose that a sentence speaks of and that things are known to serve: "wash my hands"."""
    said = _words(text)
    return max((use for use in load_word_classes().lists["uses"] if f" {use} " in said), key=len, default=None)


def _words(text: str) -> str:
    words = re.findall(r"\w(?:[\w./-]*\w)?", text.lower())
    return f" {' '.join(_OWN.get(word, word) for word in words)} "


def _for_use(sentence: Sentence, use: str, limits: ReadingLimits) -> Inquiry:
    names = [name.strip() for name in load_word_classes().lists["uses"][use].split(",")]
    rooms = [token.text for token in sentence.tokens if lexicon().find(token.text, EntryKind.ROOM) is not None]
    near = tuple(Target(TargetKind.AREA, room) for room in rooms if room not in use)
    behind = _words(sentence.text).partition(f" {use} ")[2].split()
    place = list(dropwhile(lambda word: word not in _listed("placing"), behind))
    if len(place) > 1 and _listed("here").isdisjoint(place):
        near = _near(names[0], " ".join(place), sentence, limits)
    return Inquiry(Ask.WHERE, tuple(Target(TargetKind.OBJECT, name, near) for name in names))


def _near(name: str, place: str, sentence: Sentence, limits: ReadingLimits) -> tuple[Target, ...]:
    whole = Sentence(f"the {name} {place}", sentence.given)
    for read in learned_reader().question(whole.tokens)[:1]:
        if isinstance(read.meaning, Inquiry) and len(read.meaning.of) == 1 and read.probability >= limits.question:
            (target,) = read.meaning.of
            if target.name == name and target.near and unmet_by(whole.tokens, read.meaning, read.used) is None:
                return target.near
    raise QueryError(f"{place!r} is not understood; say it like: {_EXAMPLE}.")


def _resolved(inquiry: Inquiry, sentence: Sentence) -> AskedSentence:
    resolver = NameResolver(sentence)
    targets = tuple(resolver.resolve(target) for target in inquiry.of)
    if resolver.problem is not None:
        raise QueryError(resolver.problem.question)
    for one in targets:
        if one.pick not in (Pick.ANY, Pick.NEAREST) or one.number > 1:
            raise QueryError(f"A map cannot choose {phrase(replace(one, near=()))!r}; say what it is near.")
    sides = sentence.side_notes((*inquiry.of, *targets), beside=inquiry.ask in (Ask.BESIDE, Ask.CONTENTS))
    notes = (*sentence.notes, *resolver.notes, *sides, *_from_nowhere(sentence, targets))
    number = (least_said(sentence.text) if inquiry.ask.is_numbered else 0) or inquiry.number
    return AskedSentence(replace(inquiry, of=targets, number=number), tuple(dict.fromkeys(notes)))


FROM_NOWHERE = "No position is known to count"
"""Begins the note on "the nearest window", which no place is named for."""


def _from_nowhere(sentence: Sentence, targets: Sequence[Target]) -> tuple[str, ...]:
    if any(near.kind is not TargetKind.AREA for target in targets for near in target.near):
        return ()
    said = {token.text: None for token in sentence.tokens if token.text in ("nearest", "closest")}
    remedy = "the likeliest comes first. Say what it is near, or give a place to count from (near)."
    return tuple(f"{FROM_NOWHERE} '{word}' from: {remedy}" for word in said)
