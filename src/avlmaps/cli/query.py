"""`avlmaps query`: ask a map for places."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.address_space import require_address_space
from avlmaps.cli.locate import numbers_of
from avlmaps.cli.output import UsageError, emit, query_lines
from avlmaps.cli.verb import MapVerb, OptionalPath, OptionalText, idle
from avlmaps.core.frames import FrameName

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap


@dataclass(frozen=True, kw_only=True)
class Query(MapVerb):
    """Query a map with a sentence, or part by part; the product of the parts' heatmaps gives the goals.

    Examples:
    avlmaps query MAP "the red cabinet near the sound of a dog barking"
    avlmaps query MAP --object "red cabinet" --sound-clip bark.ogg --plot heat.png
    """

    compiles: ClassVar[bool] = False  # `ask` announces loops where the question runs some

    sentence: Annotated[Positional[str], arg(metavar="[SENTENCE]")] = ""
    """Query in words; leave it out to name the parts with options."""
    object: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Object, by name."""
    sound: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Sound, by name."""
    sound_clip: Annotated[OptionalPath, arg(metavar="FILE")] = None
    """Sound, by a sound file of one like it."""
    at: Annotated[Literal["robot", "source"] | None, arg(metavar="robot|source")] = None
    """Place of a sound: where the robot was when it heard it, or its source. Default: as the words say, else robot."""
    area: Annotated[OptionalText, arg(metavar="NAME")] = None
    """Area, by name: a room or a part of the building."""
    image: Annotated[OptionalPath, arg(metavar="PHOTO")] = None
    """Photo taken at the place."""
    intrinsics: Annotated[OptionalText, arg(metavar="FX,FY,CX,CY")] = None
    """Intrinsics of the photo's camera, fx,fy,cx,cy in pixels. Default: the map's own colour camera."""
    near: Annotated[OptionalText, arg(metavar="X,Y[,Z]")] = None
    """Goals nearest to this place first, of those that are found: level x,y, or x,y,z of the recording, metres."""
    primary: Annotated[Literal["object", "sound", "image", "area"] | None, arg(metavar="object|sound|image|area")] = (
        None
    )
    """Part that is the goal; the others say where it is. Default: the first of object, image, sound, area."""
    found_at: Annotated[float, arg(metavar="PROBABILITY")] = 0.5
    """Call the query found from this probability of its first goal on, 0 to 1."""
    rules: Literal["ours", "paper"] = "ours"
    """Rules of scores and heat: ours, or the paper's with any models (docs/paper-models.md)."""
    top: Annotated[int, arg(metavar="N")] = 3
    """Number of goals to print."""
    frame: Annotated[Literal["recording", "level"], arg(metavar="recording|level")] = "recording"
    """Frame of the places: the recording's own, or the level one (z up)."""
    plot: Annotated[OptionalPath, arg(metavar="FILE")] = None
    """Draw the heat of each part and of the product, with numbered goals, into this picture."""

    def run(self) -> None:
        """Answer the query."""
        require_address_space()
        answer = ask(self)
        emit(answer, query_lines(answer), self.json)


def ask(verb: "Query", opened: "AVLMap | None" = None) -> dict[str, Any]:
    """Query a map with a sentence or with parts.

    Raises:
        UsageError: what is given does not fit together.
    """
    from avlmaps.core.compiling import announce_compiling
    from avlmaps.core.question import Modality
    from avlmaps.query.asking import Asked, AskError, Files, thing_alone
    from avlmaps.query.asking import ask as ask_map
    from avlmaps.query.avlmap import AVLMap, QuerySettings

    files = Files(None if verb.intrinsics is None else numbers_of(verb.intrinsics))
    settings = QuerySettings(found_at=verb.found_at)
    if verb.rules != "ours":
        from avlmaps.query.rules import query_settings

        settings = query_settings(verb.rules, settings)
    if verb.at is not None:
        settings = replace(settings, sounds=replace(settings.sounds, at=verb.at))
    if opened is not None and opened.settings != settings:
        opened = AVLMap(opened.stored, settings)
    if verb.top < 1:
        raise UsageError(f"--top is {verb.top}; it must be 1 or more.")
    photo, clip = (None if file is None else str(file) for file in (verb.image, verb.sound_clip))
    primary = None if verb.primary is None else Modality(verb.primary)
    try:
        asked = Asked(
            sentence=verb.sentence, object=verb.object, sound=verb.sound, area=verb.area, image=photo, clip=clip,
            primary=primary, top=verb.top, near=verb.near,
        )  # fmt: skip
        opened = opened or AVLMap.open(verb.map, settings)
        # A question about one thing runs no loops that are compiled, and loads nothing to announce them.
        quick = verb.plot is None and thing_alone(asked, opened) is not None
        with nullcontext() if quick else announce_compiling():
            answer = ask_map(opened, asked, files)
            drawn = {}
            if verb.plot is not None and answer.heat is not None:
                drawn = {"plot": str(answer.heat.plot(verb.plot, top=verb.top))}
    except AskError as error:
        raise UsageError(str(error)) from None
    told: dict[str, Any] = {**answer.to_dict(), **drawn}
    if verb.frame != FrameName.RECORDING:
        from avlmaps.query.frames import answer_in

        told = answer_in(told, FrameName(verb.frame), opened.space.level_from_recording)
    notes: list[str] = []
    if not any(part["modality"] == Modality.SOUND for part in told["parts"]):
        notes += idle(verb, ["at"], "no sound is named")
    if "plot" not in told:
        notes += idle(verb, ["plot"], "the answer has no heat to draw")
    return {**told, "notes": [*told.get("notes", ()), *notes]} if notes else told
