"""Walk a room, hear it, map it, ask it; how far each answer is off, the truth tells afterwards."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.progress import say
from avlmaps.demo.report import write_report
from avlmaps.recordings.audio import Sound

if TYPE_CHECKING:
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.question import Answer
    from avlmaps.sim.record import Heard
    from avlmaps.sim.room import Room

MARKER = ".avlmaps-demo"
# A first goal within this distance of a true place, horizontally, is right (the paper's success radius).
REACH_M = 1.0
Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Step:
    """One question of the demonstration and what became of it.

    Attributes:
        title: the question as a person would put it.
        command: the command that asks it.
        answer: what the map said, as `avlmaps query --json` prints it.
        picture: file name of its plot, in the demonstration's folder.
        truth: places that would be right, metres; empty where the right answer is that there is none.
    """

    title: str
    command: str
    answer: dict[str, Any]
    picture: str
    truth: tuple[Point, ...]

    @property
    def off_m(self) -> float | None:
        """Horizontal distance from the first goal to the nearest true place; None where there is none."""
        if not self.truth or not self.answer["goals"]:
            return None
        goal = np.array(self.answer["goals"][0]["position"][:2])
        return float(np.linalg.norm(np.array(self.truth)[:, :2] - goal, axis=1).min())

    @property
    def right(self) -> bool:
        """Whether the answer is right: the place, or that there is none."""
        if not self.truth:
            return not self.answer["found"]
        return bool(self.answer["found"]) and self.off_m is not None and self.off_m <= REACH_M

    @property
    def said(self) -> str:
        """The answer in words, and how far off it is."""
        if not self.answer["found"]:
            return "not here"
        place = ", ".join(f"{value:.2f}" for value in self.answer["goals"][0]["position"])
        return f"({place})" + ("" if self.off_m is None else f", {self.off_m:.2f} m from the true one")


@dataclass(frozen=True, slots=True)
class DemoReport:
    """What the demonstration made.

    Attributes:
        out: its folder.
        steps: the questions.
        built: what `avlmaps build --json` prints.
        located: the photo's pose error in cm and degrees, or None where it was not located.
        seconds: how long each stage took.
    """

    out: Path
    steps: tuple[Step, ...]
    built: dict[str, Any]
    located: tuple[float, float] | None
    seconds: dict[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return it as `avlmaps demo --json` prints it."""
        return {
            "out": str(self.out),
            "report": str(self.out / "report.html"),
            "recording": str(self.out / "recording"),
            "map": str(self.out / "room.avlmap"),
            "voxels": self.built["voxels"],
            "sounds": len(self.built["sounds"]),
            "photo_error": None if self.located is None else {"cm": self.located[0], "deg": self.located[1]},
            "questions": [
                {"question": s.title, "found": s.answer["found"], "right": s.right, "off_m": s.off_m}
                for s in self.steps
            ],
            "seconds": self.seconds,
        }

    def lines(self) -> list[str]:
        """Return it as a person reads it."""
        lines = [f"{'right' if step.right else 'WRONG'}  {step.title}  ->  {step.said}" for step in self.steps]
        if self.located is not None:
            lines.append(f"photo located within {self.located[0]:.1f} cm and {self.located[1]:.2f} degrees")
        return [*lines, f"look at {self.out / 'report.html'}"]


def run_demo(out: Path, seed: int = 0) -> DemoReport:
    """Run the whole demonstration into a folder; an earlier one there is replaced, anything else is left alone.

    Raises:
        MapError: the folder holds something that is no demonstration.
    """
    from avlmaps.maps.build import build_map, describe
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.open import open_recording
    from avlmaps.sim.record import record_room
    from avlmaps.sim.room import Room

    _make_room(out)
    seconds: dict[str, float] = {}
    rng = np.random.default_rng(seed)
    room = Room()
    begin = perf_counter()
    say("A robot walks through a furnished room with an RGB-D camera and a microphone.")
    heard = record_room(room, out / "recording", _sources(room, rng), rng)
    seconds["record"], begin = round(perf_counter() - begin, 1), perf_counter()
    say("What it saw and heard becomes a map.")
    stored = build_map(open_recording(out / "recording"), out / "room.avlmap")
    seconds["build"], begin = round(perf_counter() - begin, 1), perf_counter()
    say("The map is asked.")
    asked = AVLMap(stored)
    photo, located = _take_photo(room, asked, out)
    steps = _ask_all(asked, room, heard, photo, out, rng)
    seconds["ask"] = round(perf_counter() - begin, 1)
    report = DemoReport(out, tuple(steps), describe(stored), located, seconds)
    write_report(report, heard)
    return report


def _make_room(out: Path) -> None:
    if out.exists() and any(out.iterdir()) and not (out / MARKER).exists():
        raise MapError(f"{out} holds something else than a demonstration; choose another folder with --out.")
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / MARKER).touch()


def _synthesised(category: str, rng: np.random.Generator) -> Sound:
    from avlmaps.sim.synthesis import RATE_HZ, synthesise

    return Sound(synthesise(category, rng), RATE_HZ)


def _thing(room: "Room", category: str, colour: str, nearest_to: tuple[float, float]) -> Point:
    """Return the centre of the thing of that category and colour that is nearest to a place."""
    candidates = [t.centre for t in room.things if t.category == category and t.colour == colour]
    return min(candidates, key=lambda c: (c[0] - nearest_to[0]) ** 2 + (c[1] - nearest_to[1]) ** 2)


def _sources(room: "Room", rng: np.random.Generator) -> list[Any]:
    """Place a source at five things; two of the yellow chairs and two red cabinets are told apart by sound only."""
    from avlmaps.sim.record import Source

    placed = (
        ("glass breaking", _thing(room, "table", "brown", (0, 0))),
        ("microwave beep", _thing(room, "fridge", "white", (0, 0))),
        ("keyboard typing", _thing(room, "chair", "yellow", (9, 2))),
        ("snoring", _thing(room, "sofa", "blue", (6, 6))),
        ("doorbell", _thing(room, "bookcase", "brown", (0, 5))),
    )
    return [Source(category, _synthesised(category, rng), place) for category, place in placed]


def _take_photo(room: "Room", asked: "AVLMap", out: Path) -> tuple[Path, tuple[float, float] | None]:
    """Take a photo from a place where the robot never stood, and measure how well the map locates it."""
    import cv2

    from avlmaps.core.poses import rotation_angle_rad
    from avlmaps.sim.raycast import render
    from avlmaps.sim.record import CAMERA

    truth = room.pose(7.0, 3.1, np.deg2rad(-70.0), np.deg2rad(8.0))
    view = render(room.scene, CAMERA, truth)
    photo = out / "photo.png"
    cv2.imwrite(str(photo), view.rgb[..., ::-1])
    pose = asked.locate(view.rgb).world_from_camera
    if pose is None:
        return photo, None
    error_cm = 100.0 * float(np.linalg.norm(pose[:3, 3] - truth[:3, 3]))
    return photo, (error_cm, float(np.rad2deg(rotation_angle_rad(pose, truth))))


def _ask_all(
    asked: "AVLMap", room: "Room", heard: "Sequence[Heard]", photo: Path, out: Path, rng: np.random.Generator
) -> list[Step]:
    import soundfile

    from avlmaps.language.sentence import parse_sentence
    from avlmaps.query.question import Modality, Part, Question

    clip = out / "another_microwave.wav"
    sound = _synthesised("microwave beep", rng)
    soundfile.write(clip, sound.samples, sound.rate_hz)
    at = {event.category: event.track for event in heard}
    red = tuple(t.centre for t in room.things if t.colour == "red")
    east_chair, west_chair = _thing(room, "chair", "yellow", (9, 2)), _thing(room, "chair", "yellow", (1, 2))

    def step(title: str, question: Question, command: str, truth: Sequence[Point]) -> Step:
        number = len(steps) + 1
        answer: Answer = asked.ask(question)
        picture = f"question_{number}.png"
        if answer.heat is not None:
            answer.heat.plot(out / picture)
        return Step(title, command, answer.to_json(), picture, tuple(truth))

    def sentence(text: str, truth: Sequence[Point]) -> Step:
        return step(text, parse_sentence(text), f'avlmaps query room.avlmap "{text}"', truth)

    def parts(title: str, options: str, truth: Sequence[Point], *named: Part) -> Step:
        return step(title, Question.of(named), f"avlmaps query room.avlmap {options}", truth)

    steps: list[Step] = []
    steps.append(sentence("the red cabinet", red))
    steps.append(sentence("the yellow chair near the sound of typing on a keyboard", [east_chair]))
    steps.append(sentence("the yellow chair near the sound of breaking glass", [west_chair]))
    clip_part = Part(Modality.SOUND, str(clip), is_file=True)
    title = "where a sound like this clip was heard (another microwave)"
    steps.append(parts(title, f"--sound-clip {clip.name}", at["microwave beep"], clip_part))
    chair, picture = Part(Modality.OBJECT, "yellow chair"), Part(Modality.IMAGE, str(photo), is_file=True)
    options = f'--object "yellow chair" --image {photo.name}'
    steps.append(parts("the yellow chair near this photo", options, [east_chair], chair, picture))
    steps.append(sentence("where the chainsaw was heard", []))
    return steps
