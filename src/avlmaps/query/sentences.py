"""Answering a sentence: its questions are alternatives, the best answer counts, and 'how many' counts."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Question
from avlmaps.language.intents import Ask
from avlmaps.language.questions import AskedSentence, read_question
from avlmaps.language.sentence import Given
from avlmaps.query.answer import Answer

if TYPE_CHECKING:
    from avlmaps.core.camera import Pinhole
    from avlmaps.query.avlmap import Attachment, AVLMap
    from avlmaps.query.schema import QueryAnswer

# For a count, up to this many instances are taken; those count that score at least this part of the best one.
_MOST_COUNTED, _AS_LIKELY = 200, 0.5


class UnusedFileError(QueryError):
    """A photo or a clip came with a sentence that does not speak of it."""


@dataclass(frozen=True, slots=True)
class SentenceAnswer:
    """The answer to a sentence.

    Attributes:
        answer: of the likeliest question in it.
        top: most goals in the JSON.
        notes: how words were read.
        count: number of likely things, where the sentence asks for one.
    """

    answer: Answer
    top: int
    notes: tuple[str, ...] = ()
    count: int | None = None

    def to_json(self) -> "QueryAnswer":
        """Return the answer with the keys of the contract."""
        answer = self.answer.to_json()
        if self.count is not None:
            answer["goals"] = answer["goals"][: self.top]
            answer["count"] = self.count
        if self.notes:
            answer["notes"] = list(self.notes)
        return answer


def ask_sentence(
    avlmap: "AVLMap",
    sentence: str,
    *,
    top: int = 3,
    primary: Modality | None = None,
    image: str | None = None,
    clip: str | None = None,
    attachments: "Mapping[str, Attachment] | None" = None,
    camera_of: "Callable[[Question], Pinhole | None]" = lambda _: None,
) -> SentenceAnswer:
    """Answer a sentence.

    Args:
        avlmap: the map.
        sentence: such as "how many chairs are in the kitchen".
        top: most goals.
        primary: the modality that is sought, where the sentence's own reading is not meant.
        image: the file, or the name of the attachment, that "this photo" means.
        clip: the same for "this recording".
        attachments: pictures and sounds by name; see ``AVLMap.ask``.
        camera_of: returns the camera of a question's pictures; None for the map's own.

    Raises:
        UnusedFileError: the sentence does not speak of a file that was given.
        QueryError: the sentence is not understood, or a part of it cannot be used.
    """
    read = _read(sentence, image, clip)
    counted = read.inquiry.ask is Ask.HOW_MANY
    answers: list[Answer] = []
    for question in read.questions:
        if primary is not None:
            question = Question.of(question.parts, primary)
        used = {part.query for part in question.parts if part.is_file}
        if any(name is not None and name not in used for name in (image, clip)):
            raise UnusedFileError(
                "The sentence does not speak of the file; say 'this photo' or 'this recording' in it."
            )
        most = _MOST_COUNTED if counted else top
        answers.append(avlmap.ask(question, most, camera_of(question), attachments))
    answer = max(answers, key=lambda one: (one.found, one.goals[0].score if one.goals else 0.0))
    if not counted:
        return SentenceAnswer(answer, top, read.notes)
    likely = [goal for goal in answer.goals if goal.score >= _AS_LIKELY * answer.goals[0].score]
    return SentenceAnswer(answer, top, read.notes, len(likely) if answer.found else 0)


@lru_cache(maxsize=512)
def _read(sentence: str, image: str | None, clip: str | None) -> AskedSentence:
    """Return the reading of a sentence; it depends on nothing but the words, and agents repeat theirs."""
    return read_question(sentence, Given(image, clip, knows=lambda _: True))
