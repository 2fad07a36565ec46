"""`avlmaps query`: ask a map for places."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.locate import camera_of
from avlmaps.cli.output import UsageError, emit, place, table_lines
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
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.rules import query_settings

    parts = _parts(verb)
    only_files = all(part.is_file for part in parts)
    if (not verb.sentence.strip() and not parts) or (verb.sentence.strip() and not only_files):
        raise UsageError(
            "query takes a sentence, or parts (--object, --sound, --sound-clip, --area, --image), and not both: "
            'avlmaps query MAP "the red cabinet near the sound of a dog"'
        )
    if verb.top < 1:
        raise UsageError(f"--top is {verb.top}; it must be 1 or more.")
    settings = query_settings(verb.rules)
    avlmap = AVLMap.open(verb.map, settings) if opened is None else _by_rules(opened, settings)
    thing = _thing_alone(verb, avlmap, parts)
    if thing is not None and opened is None and verb.plot is None and len(avlmap.stored.voxels) <= _SMALL_MAP:
        from avlmaps.query.loops import plain_loops

        with plain_loops():  # loading the compiled loops would take longer than the question
            return {**avlmap.ask(thing, top=verb.top).to_json()}
    from avlmaps.core.compiling import announce_compiling

    with announce_compiling():
        return _answer(verb, avlmap, parts, thing)


def _thing_alone(verb: "Query", avlmap: "AVLMap", parts: "list[Part]") -> "Question | None":
    """Return the question for one thing and nothing else: no sentence need be read for a name that is known."""
    from avlmaps.core.lexicon import Kind, lexicon
    from avlmaps.core.question import Modality, Part, Question
    from avlmaps.perception.protocols import NamedPixelEncoder

    if verb.intrinsics is not None or verb.primary not in (None, "object"):
        return None
    if not verb.sentence:
        return Question.of(parts) if [part.modality for part in parts] == [Modality.OBJECT] else None
    if parts or "pixels" not in avlmap.stored.info.models:
        return None
    encoder = avlmap.stored.profile.pixel_encoder()
    is_name = isinstance(encoder, NamedPixelEncoder) and verb.sentence in encoder.vocabulary
    # Stairs are a thing and an area; which is meant is for the reader to say.
    is_name = is_name and {entry.kind for entry in lexicon().senses(verb.sentence)} == {Kind.THING}
    return Question.of([Part(Modality.OBJECT, verb.sentence)]) if is_name else None


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


_SMALL_MAP = 400_000  # voxels; plain NumPy takes 0.1 s for them


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


def query_lines(answer: dict[str, Any]) -> list[str]:
    """Lay out the answer of `query`."""
    parts = ", ".join(f"{part['modality']} {part['query']!r} ({part['role']})" for part in answer["parts"])
    lines = [f"query: {parts}"]
    lines += [f"note: {part['note']}" for part in answer["parts"] if part.get("note")]
    rows = [
        (i, place(goal["position"]), f"{goal['score']:.2f}", " x ".join(f"{side:.2f}" for side in goal["size"]))
        for i, goal in enumerate(answer["goals"], start=1)
    ]
    lines += [f"note: {note}" for note in answer.get("notes", [])]
    lines += [f"count: {answer['count']}"] if "count" in answer else []
    lines.append("found" if answer["found"] else "not found here" + (": the best guesses are" if rows else ""))
    lines += table_lines(("", f"place ({answer['frame']} frame)", "score", "size in m"), rows) if rows else []
    return [*lines, f"wrote {answer['plot']}"] if "plot" in answer else lines
