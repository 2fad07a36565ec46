"""A question typed into a page: words, a photo, a sound clip, or words that speak of the photo and the clip."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Question
from avlmaps.language.commands import Given
from avlmaps.language.intents import Ask
from avlmaps.language.questions import read_question

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.question import Answer

TOP = 5
_MOST_COUNTED, _AS_LIKELY = 200, 0.5  # of "how many": instances count that score at least half of the best one


@dataclass(frozen=True, slots=True)
class Upload:
    """A file that a person gave to the page.

    Attributes:
        path: where it is kept here; no answer names it.
        name: what its owner calls it.
    """

    path: Path
    name: str


@dataclass(frozen=True, slots=True)
class Asked:
    """The answer to a typed question.

    Attributes:
        answer: goals, parts and heat.
        notes: how words were taken.
        count: how many there are, where that was the question.
    """

    answer: "Answer"
    notes: tuple[str, ...] = ()
    count: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it with the keys of ``avlmaps query --json``."""
        told = self.answer.to_json()
        if self.count is not None:
            told = {**told, "goals": told["goals"][:TOP], "count": self.count}
        return {**told, "notes": list(self.notes)} if self.notes else told


def ask(asked: "AVLMap", sentence: str, photo: Upload | None = None, clip: Upload | None = None) -> Asked:
    """Ask a map as ``avlmaps query`` does.

    Args:
        asked: the map.
        sentence: words; may be empty where a file is given, which is then asked for by itself.
        photo: what "this photo" in the sentence means.
        clip: what "this recording" in the sentence means.

    Raises:
        QueryError: nothing is asked, the words are not understood, or they do not speak of the file.
    """
    files = {Modality.IMAGE: photo, Modality.SOUND: clip}
    given = {modality: upload for modality, upload in files.items() if upload is not None}
    if not sentence.strip():
        if not given:
            raise QueryError("The question is empty; type what is sought, such as the chair near the sofa.")
        parts = [Part(modality, str(upload.path), is_file=True) for modality, upload in given.items()]
        return Asked(asked.ask(Question.of(parts), top=TOP))
    names = {modality: str(upload.path) for modality, upload in given.items()}
    read = read_question(
        sentence, Given(names.get(Modality.IMAGE), names.get(Modality.SOUND), knows=lambda _: True)
    )  # fmt: skip
    counted = read.inquiry.ask is Ask.HOW_MANY
    used = {part.query for question in read.questions for part in question.parts}
    if not used.issuperset(names.values()):
        raise QueryError(
            "The words do not speak of the file; say 'near where this photo was taken' or 'near the sound of this "
            "recording', or take the words or the file away."
        )
    answers = [asked.ask(question, top=_MOST_COUNTED if counted else TOP) for question in read.questions]
    answer = max(answers, key=lambda one: (one.found, one.goals[0].score if one.goals else 0.0))
    if not counted:
        return Asked(answer, read.notes)
    likely = [goal for goal in answer.goals if goal.score >= _AS_LIKELY * answer.goals[0].score]
    return Asked(answer, read.notes, len(likely) if answer.found else 0)


def without_paths(text: str, *uploads: Upload | None) -> str:
    """Return a text in which uploaded files have the names that their owners gave them."""
    for upload in uploads:
        if upload is not None:
            text = text.replace(str(upload.path), upload.name)
    return text
