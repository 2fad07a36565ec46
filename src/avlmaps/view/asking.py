"""A query typed into a page: words, a photo, a sound clip, or words that speak of the photo and the clip."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from avlmaps.core.errors import QueryError
from avlmaps.core.question import Modality, Part, Question
from avlmaps.query.sentences import SentenceAnswer, UnusedFileError, ask_sentence

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap

TOP = 5


@dataclass(frozen=True, slots=True)
class Upload:
    """A file that a person gave to the page.

    Attributes:
        path: where it lies on this machine; no answer names it.
        name: what its owner calls it.
    """

    path: Path
    name: str


def ask(
    avlmap: "AVLMap",
    sentence: str,
    photo: Upload | None = None,
    clip: Upload | None = None,
    *,
    question: Question | None = None,
) -> SentenceAnswer:
    """Query a map as ``avlmaps query`` does.

    Args:
        avlmap: the map.
        sentence: words; may be empty where there is a file, which is then a query by itself.
        photo: what "this photo" in the sentence means.
        clip: what "this recording" in the sentence means.
        question: the query itself, where the sentence is only its title.

    Raises:
        QueryError: the query is empty, the words are not understood, or they do not speak of the file.
    """
    if question is not None:
        return SentenceAnswer(avlmap.ask(question, top=TOP), TOP)
    if sentence.strip():
        image, sound = (None if upload is None else str(upload.path) for upload in (photo, clip))
        try:
            return ask_sentence(avlmap, sentence, top=TOP, image=image, clip=sound)
        except UnusedFileError:
            raise QueryError(
                "The words do not speak of the file; say 'near where this photo was taken' or 'near the sound of this "
                "recording', or take the words or the file away."
            ) from None
    files = ((Modality.IMAGE, photo), (Modality.SOUND, clip))
    parts = [Part(modality, str(upload.path), is_file=True) for modality, upload in files if upload is not None]
    if not parts:
        raise QueryError("The query is empty; type what is sought, such as the chair near the sofa.")
    return SentenceAnswer(avlmap.ask(Question.of(parts), top=TOP), TOP)


def without_paths(text: str, *uploads: Upload | None) -> str:
    """Return a text in which uploaded files have the names that their owners gave them."""
    for upload in uploads:
        if upload is not None:
            text = text.replace(str(upload.path), upload.name)
    return text
