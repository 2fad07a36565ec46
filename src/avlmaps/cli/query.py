"""`avlmaps query` and `locate`: ask a map for places, and for the place of a photo."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from tyro.conf import Positional, arg

from avlmaps.cli.output import UsageError, query_lines
from avlmaps.cli.verb import COUNT, Asking, InFrame, MapVerb, OptionalPath, OptionalText, idle, shown_in
from avlmaps.core.progress import say
from avlmaps.core.wording import option, place_text, the_room

if TYPE_CHECKING:
    from avlmaps.query.asking import Asked
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.settings import QuerySettings


@dataclass(frozen=True, kw_only=True)
class Query(Asking, InFrame, MapVerb):
    """Query a map with a sentence, or part by part; the product of the parts' heatmaps gives the goals.

    Example: avlmaps query MAP "the red cabinet near the sound of a dog barking"

    Example: avlmaps query MAP --object "red cabinet" --sound-clip bark.ogg --plot heat.png
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
    rules: Literal["ours", "paper"] = "ours"
    """Rules of scores and heat: ours, or the paper's with any models (docs/paper-models.md)."""
    top: Annotated[int, COUNT, arg(metavar="N")] = 3
    """Number of goals to print."""
    plot: Annotated[OptionalPath, arg(metavar="FILE")] = None
    """Draw the heat of each part and of the product, with numbered goals, into this picture."""

    def run(self) -> None:
        if not self.map.exists() and not self.sentence:
            words = shlex.join(["MAP", str(self.map)])
            raise UsageError(f"there is no map at {str(self.map)[:80]!r}; the map comes first: avlmaps query {words}")
        self._asked()  # what does not fit together is said before a map is opened
        super().run()

    def settings(self) -> "QuerySettings":
        from avlmaps.query.settings import query_settings

        settings = query_settings(self.rules, self.query_settings())
        return settings if self.at is None else replace(settings, sounds=replace(settings.sounds, at=self.at))

    def _asked(self) -> "Asked":
        from avlmaps.core.camera import intrinsics_of
        from avlmaps.core.question import Modality
        from avlmaps.query.asking import Asked
        from avlmaps.query.places import place_of

        if self.near is not None:
            place_of(self.near)
        photo, clip = (None if file is None else str(file) for file in (self.image, self.sound_clip))
        return Asked(
            sentence=self.sentence, object=self.object, sound=self.sound, area=self.area, image=photo, clip=clip,
            primary=None if self.primary is None else Modality(self.primary), top=self.top, near=self.near,
            camera=None if self.intrinsics is None else intrinsics_of(self.intrinsics),
        )  # fmt: skip

    def answer(self, avlmap: "AVLMap") -> dict[str, Any]:
        from avlmaps.core.progress import announce_compiling
        from avlmaps.core.question import Modality
        from avlmaps.query.asking import ask
        from avlmaps.query.goals import MOST_GOALS

        asked = self._asked()
        if avlmap.settings != (settings := self.settings()):
            avlmap = type(avlmap)(avlmap.data, avlmap.encoders, path=avlmap.path, settings=settings)
        with announce_compiling(now=False):
            found = ask(avlmap, replace(asked, top=MOST_GOALS))
            told: dict[str, Any] = {**found.to_dict()}
            if self.plot is not None and found.heat is not None:
                told["plot"] = str(found.heat.plot(self.plot, top=self.top))
        more = sum(goal["probability"] >= self.found_at for goal in told["goals"][self.top :])
        told["goals"] = told["goals"][: self.top]
        if self.frame != "recording":
            told = shown_in(told, self.frame, avlmap)
        notes = [f"{more} more found; {option('top', str(self.top + more))} lists them too."] if more else []
        if not any(part["modality"] == Modality.SOUND for part in told["parts"]):
            notes += idle(self, ["at"], "no place is sought by a sound")
        if "plot" not in told:
            notes += idle(self, ["plot"], "the answer has no heat to draw")
        return {**told, "notes": [*told.get("notes", ()), *notes]} if notes else told

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        return query_lines(answer)


@dataclass(frozen=True, kw_only=True)
class Locate(InFrame, MapVerb):
    """Find the 6-DoF pose of a photo's camera in the map, or report that the photo cannot be located.

    A photo that is not located is an answer as well, with exit status 0; its `world_from_camera` is null.

    Example: avlmaps locate home.avlmap photo.jpg
    """

    image: Annotated[Positional[Path], arg(metavar="PHOTO")]
    """Photo to locate."""
    intrinsics: Annotated[str | None, arg(metavar="FX,FY,CX,CY")] = None
    """Intrinsics of the photo's camera, fx,fy,cx,cy in pixels. Default: by its EXIF, else the map's own colour camera,
    with another focal length where that fits clearly better."""

    def answer(self, avlmap: "AVLMap") -> dict[str, Any]:
        from avlmaps.core.camera import Pinhole, intrinsics_of
        from avlmaps.query.locate import focal_35mm_of
        from avlmaps.query.modalities import read_picture
        from avlmaps.query.schema import locate_answer

        rgb = read_picture(self.image)
        size = {"width": rgb.shape[1], "height": rgb.shape[0]}
        given = None if self.intrinsics is None else Pinhole(*intrinsics_of(self.intrinsics), **size)
        found = avlmap.locate(rgb, given, None if given is not None else focal_35mm_of(self.image))
        if found.world_from_camera is not None and given is not None and found.camera != given:
            say(f"note: the focal length {given.fx:g} does not fit the photo; {found.camera.fx:.1f} was used.")
        return shown_in(locate_answer(found, avlmap), self.frame, avlmap)

    def lines(self, answer: Mapping[str, Any]) -> list[str]:
        pose, notes = answer["world_from_camera"], [f"note: {note}" for note in answer.get("notes", [])]
        if pose is None:
            few = f"not located: {answer['inliers']} points agree, too few to fix a place"
            return [*notes, few]
        room = f" in {the_room(answer['room'])}" if answer["room"] else ""
        rows = ["  " + " ".join(f"{value:9.4f}" for value in row) for row in pose]
        return [
            *notes,
            f"located at {place_text(row[3] for row in pose[:3])}{room}, heading {answer['heading_deg']:.0f}°",
            f"{answer['inliers']} points agree; world_from_camera (frame: {answer['frame']}):",
            *rows,
        ]
