"""`avlmaps query`: ask a map for places."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.locate import camera_of
from avlmaps.cli.one_thing import answer_thing, is_small, named_thing
from avlmaps.cli.output import UsageError, emit, query_lines
from avlmaps.cli.verb import ModelVerb

if TYPE_CHECKING:
    from avlmaps.core.camera import Pinhole
    from avlmaps.core.question import Part, Question
    from avlmaps.query.answer import Answer
    from avlmaps.query.avlmap import AVLMap, QuerySettings


@dataclass(frozen=True, kw_only=True)
class Query(ModelVerb):
    """Query a map with a sentence, or part by part; the product of the parts' heatmaps gives the goals.

    Examples:
    avlmaps query MAP "the red cabinet near the sound of a dog barking"
    avlmaps query MAP --object "red cabinet" --sound-clip bark.ogg --plot heat.png
    """

    map: Annotated[Positional[Path], arg(metavar="MAP")]
    """Map folder (NAME.avlmap)."""
    sentence: Annotated[Positional[str], arg(metavar="[SENTENCE]")] = ""
    """Query in words; leave it out to name the parts with options."""
    object: Annotated[str | None, arg(metavar="NAME")] = None
    """Object, by name."""
    sound: Annotated[str | None, arg(metavar="NAME")] = None
    """Sound, by name."""
    sound_clip: Annotated[Path | None, arg(metavar="FILE")] = None
    """Sound, by a sound file of one like it."""
    area: Annotated[str | None, arg(metavar="NAME")] = None
    """Area, by name: a room or a part of the building."""
    image: Annotated[Path | None, arg(metavar="PHOTO")] = None
    """Photo taken at the place."""
    intrinsics: Annotated[str | None, arg(metavar="FX,FY,CX,CY")] = None
    """Intrinsics of the photo's camera, fx,fy,cx,cy in pixels. Default: the map's own colour camera."""
    primary: Annotated[Literal["object", "sound", "image", "area"] | None, arg(metavar="object|sound|image|area")] = (
        None
    )
    """Part that is the goal; the others say where it is. Default: the first of object, image, sound, area."""
    rules: Literal["ours", "paper"] = "ours"
    """Rules of scores and heat: ours, or the paper's with any models (docs/paper-models.md)."""
    top: Annotated[int, arg(metavar="N")] = 3
    """Number of goals to print."""
    plot: Annotated[Path | None, arg(metavar="FILE")] = None
    """Draw the heat of each part and of the product, with numbered goals, into this picture."""

    def run(self) -> None:
        """Answer the query."""
        answer = ask(self)
        emit(answer, query_lines(answer), self.json)


def ask(verb: "Query", opened: "AVLMap | None" = None) -> dict[str, Any]:
    """Query a map with a sentence or with parts.

    Args:
        verb: the query.
        opened: the map, where it is open already.
    """
    from avlmaps.query.avlmap import AVLMap, QuerySettings

    parts = _parts(verb)
    only_files = all(part.is_file for part in parts)
    if (not verb.sentence.strip() and not parts) or (verb.sentence.strip() and not only_files):
        raise UsageError(
            "query takes a sentence, or parts (--object, --sound, --sound-clip, --area, --image), and not both: "
            'avlmaps query MAP "the red cabinet near the sound of a dog"'
        )
    if verb.top < 1:
        raise UsageError(f"--top is {verb.top}; it must be 1 or more.")
    settings = QuerySettings()
    if verb.rules != "ours":
        from avlmaps.query.rules import query_settings

        settings = query_settings(verb.rules)
    avlmap = AVLMap.open(verb.map, settings) if opened is None else _by_rules(opened, settings)
    thing = _thing_alone(verb, avlmap, parts)
    if thing is not None and opened is None and verb.plot is None and is_small(avlmap):
        return answer_thing(thing, avlmap, verb.top)
    from avlmaps.core.compiling import announce_compiling

    with announce_compiling():
        return _answer(verb, avlmap, parts, thing)


def _thing_alone(verb: "Query", avlmap: "AVLMap", parts: "list[Part]") -> "Question | None":
    """Return the question for one thing and nothing else: no sentence need be read for a name that is known."""
    from avlmaps.core.question import Modality, Question

    if verb.intrinsics is not None or verb.primary not in (None, "object"):
        return None
    if not verb.sentence:
        return Question.of(parts) if [part.modality for part in parts] == [Modality.OBJECT] else None
    return None if parts else named_thing(verb.sentence, avlmap)


def _answer(verb: "Query", avlmap: "AVLMap", parts: "list[Part]", thing: "Question | None") -> dict[str, Any]:
    from avlmaps.core.question import Modality, Question

    if thing is None and verb.sentence.strip():
        return _asked_in_words(verb, avlmap)
    question = thing or Question.of(parts, Modality(verb.primary) if verb.primary else None)
    camera = _camera_for(verb.image or _first_image(question.parts), verb.intrinsics)
    answer = avlmap.ask(question, top=verb.top, intrinsics=camera)
    return {**answer.to_json(), **_plotted(verb, answer)}


def _by_rules(opened: "AVLMap", settings: "QuerySettings") -> "AVLMap":
    """Return an opened map under other settings; the map itself where they are the same."""
    from avlmaps.query.avlmap import AVLMap

    return opened if opened.settings == settings else AVLMap(opened.stored, settings)


def _asked_in_words(verb: "Query", avlmap: "AVLMap") -> dict[str, Any]:
    """Answer a sentence."""
    from avlmaps.core.question import Modality
    from avlmaps.query.sentences import UnusedFileError, ask_sentence

    image, clip = (None if path is None else str(path) for path in (verb.image, verb.sound_clip))
    try:
        reply = ask_sentence(
            avlmap,
            verb.sentence,
            top=verb.top,
            primary=Modality(verb.primary) if verb.primary else None,
            image=image,
            clip=clip,
            camera_of=lambda question: _camera_for(verb.image or _first_image(question.parts), verb.intrinsics),
        )
    except UnusedFileError as error:
        raise UsageError(str(error)) from None
    return {**reply.to_json(), **_plotted(verb, reply.answer)}


def _plotted(verb: "Query", answer: "Answer") -> dict[str, Any]:
    if verb.plot is None or answer.heat is None:
        return {}
    return {"plot": str(answer.heat.plot(verb.plot, top=verb.top))}


def _parts(verb: "Query") -> list["Part"]:
    from avlmaps.core.question import Modality, Part

    named = (
        (Modality.OBJECT, verb.object, False),
        (Modality.IMAGE, verb.image, True),
        (Modality.SOUND, verb.sound, False),
        (Modality.SOUND, verb.sound_clip, True),
        (Modality.AREA, verb.area, False),
    )
    return [Part(modality, str(query), is_file=is_file) for modality, query, is_file in named if query is not None]


def _first_image(parts: "tuple[Part, ...]") -> Path | None:
    from avlmaps.core.question import Modality

    return next((Path(part.query) for part in parts if part.modality is Modality.IMAGE), None)


def _camera_for(picture: Path | None, intrinsics: str | None) -> "Pinhole | None":
    """Read ``fx,fy,cx,cy`` for a picture; None stays None."""
    if intrinsics is None:
        return None
    if picture is None:
        raise UsageError("--intrinsics belongs to a photo (--image); there is none.")
    from avlmaps.query.modalities.image import read_picture

    height, width = read_picture(picture).shape[:2]
    return camera_of(intrinsics, width, height)
