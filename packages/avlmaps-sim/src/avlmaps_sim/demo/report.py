"""The demonstration's report: one HTML file that holds its pictures; it opens from disk and needs no network."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.query.schema import QueryAnswer
from avlmaps_sim.demo.drive import Drive, drive_card
from avlmaps_sim.demo.questions import CLIP, MAP, PAGE, PHOTO, REACH_M, Ask
from avlmaps_sim.demo.svg import (
    Sheet,
    Strip,
    TopView,
    embedded,
    envelope,
    from_above,
    heat_from_above,
    map_from_above,
    strip_of,
    wave,
)  # fmt: skip

if TYPE_CHECKING:
    from avlmaps.query.answer import Answer
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.recordings.types import Recording
    from avlmaps_sim.demo.evidence import Evidence
    from avlmaps_sim.demo.questions import PhotoView
    from avlmaps_sim.scene import Scene


@dataclass(frozen=True, slots=True)
class Step:
    """One question of the demonstration and what became of it. ``answer`` is what `avlmaps query --json` prints."""

    ask: Ask
    answer: QueryAnswer
    picture: str

    @property
    def off_m(self) -> float | None:
        """Horizontal distance from the first goal to the nearest true place; None where there is none."""
        if not self.ask.truth or not self.answer["goals"]:
            return None
        goal = self.answer["goals"][0]["position"]
        return min(box.distance_m(goal) for box in self.ask.truth)

    @property
    def right(self) -> bool:
        """Whether the answer is right: the place, or that there is none."""
        if not self.ask.truth:
            return not self.answer["found"]
        return bool(self.answer["found"]) and self._near

    @property
    def _near(self) -> bool:
        return self.off_m is not None and self.off_m <= REACH_M

    @property
    def verdict(self) -> str:
        """``right``, ``WRONG``, or ``unsure``: not found, and yet the best guess is right."""
        if self.right:
            return "right"
        return "unsure" if self._near and not self.answer["found"] else "WRONG"

    @property
    def said(self) -> str:
        """The answer in words, and how far off it is."""
        if not self.answer["found"]:
            guess = "" if self.off_m is None else f"; its best guess is {self.off_m:.2f} m from the true one"
            return f"not here, it thinks{guess}"
        place = ", ".join(f"{value:.2f}" for value in self.answer["goals"][0]["position"])
        return f"({place})" + ("" if self.off_m is None else f", {self.off_m:.2f} m from the true one")


@dataclass(frozen=True, slots=True)
class DemoReport:
    """The products of the demonstration.

    ``built`` is what `avlmaps build --json` prints; ``located`` is the photo's pose error in cm and degrees, None where
    it was not located.
    """

    out: Path
    scene: str
    steps: tuple[Step, ...]
    built: dict[str, Any]
    located: tuple[float, float] | None
    seconds: dict[str, float] = field(default_factory=dict)
    drive: Drive | None = None

    def to_json(self) -> dict[str, Any]:
        """Return it as `avlmaps demo --json` prints it."""
        return {
            "out": str(self.out),
            "report": str(self.out / "report.html"),
            "recording": str(self.out / "recording"),
            "map": str(self.out / MAP),
            "voxels": self.built["voxels"],
            "sounds": len(self.built["sounds"]),
            "photo_error": None if self.located is None else {"cm": self.located[0], "deg": self.located[1]},
            "questions": [
                {"question": s.ask.title, "found": s.answer["found"], "right": s.right, "off_m": s.off_m}
                for s in self.steps
            ],
            "drive": None if self.drive is None else self.drive.to_json(),
            "seconds": self.seconds,
        }

    def lines(self) -> list[str]:
        """Return it as a person reads it."""
        lines = [f"{step.verdict:6} {step.ask.title}  ->  {step.said}" for step in self.steps]
        if self.located is not None:
            lines.append(f"photo located within {self.located[0]:.1f} cm and {self.located[1]:.2f} degrees")
        lines += [] if self.drive is None else self.drive.lines()
        return [*lines, f"look at {self.out / 'report.html'}"]


_BINS = 700
_MOMENT_WIDTH = 256
_LEGEND = 14
_FIRST = 0.4  # of the walk: the moment that is shown before the slider is touched
_STAGES = (
    ("home", "home", "#7c6f9b"), ("record", "drive and record", "#1f6fbf"), ("build", "map", "#0b7a75"),
    ("choose", "choose questions", "#8a6d3b"), ("ask", "ask", "#b4531a"), ("drive", "go", "#d6336c"),
)  # fmt: skip


def write_report(
    report: "DemoReport",
    scene: "Scene",
    recording: "Recording",
    avlmap: "AVLMap",
    evidence: "Evidence",
    photo: "PhotoView | None",
    answers: "Sequence[Answer]",
    moments: int,
) -> Path:
    """Write report.html into the demonstration's folder."""
    home, ground = from_above(scene), map_from_above(avlmap.space)
    sheet = Sheet.round(home.extent, ground.extent)
    strip = _strip(recording, avlmap, moments)
    shown = [
        _question(number, step, answer, sheet, photo if step.ask.kind == "photo" else None)
        for number, (step, answer) in enumerate(zip(report.steps, answers, strict=True), 1)
    ]
    body = [
        _opening(report, evidence),
        _home(sheet, home, evidence),
        _film(recording, evidence, strip, sheet),
        _track(recording, evidence, report),
        _facts(report),
        f'<svg width="0" height="0" aria-hidden="true"><defs>{sheet.picture(ground, "ground")}</defs></svg>',
        _verdict(report),
        *shown,
        "" if report.drive is None else drive_card(report.drive, sheet, report.scene),
        _honest(report, recording),
    ]
    own = files("avlmaps_sim.demo")
    style, script = ((own / name).read_text(encoding="utf-8") for name in ("page.css", "page.js"))
    page = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>avlmaps: a home as one map</title><style>{style}</style></head>\n"
        f"<body><main>\n{chr(10).join(body)}\n</main><script>{script}</script></body></html>\n"
    )
    path = report.out / "report.html"
    path.write_text(page, encoding="utf-8")
    return path


def _opening(report: "DemoReport", evidence: "Evidence") -> str:
    minutes = report.built["duration_s"] / 60
    return (
        "<h1>A home as one map</h1>"
        f'<p class="lead">A robot drove through {_count(len(evidence.areas), "room")} in {minutes:.1f} minutes, with a '
        "depth camera and a microphone. Its recording became one map; the map was then queried by word, by "
        "sound, by photo and by room. The map had no access to the truth, which serves only to measure "
        "how far each answer is off.</p>"
    )


def _home(sheet: Sheet, home: TopView, evidence: "Evidence") -> str:
    sounds = [(event.source, event.category) for event in evidence.events]
    drawing = sheet.drawing(
        [
            sheet.picture(home), sheet.walk(evidence.walk), sheet.rooms(evidence.areas), sheet.heard(sounds),
            sheet.dot(evidence.walk[0], "robot", "robot"),
        ],
        "top-down view of the home: its rooms, the robot's path and the sounds",
    )  # fmt: skip
    return (
        f'<div class="card">{drawing}<p class="note">The true home without ceilings. Blue: the '
        "robot's path; yellow: the robot; numbers: the sources of the sounds.</p></div>"
    )


def _strip(recording: "Recording", avlmap: "AVLMap", moments: int) -> Strip:
    from avlmaps.core.progress import progress
    from avlmaps.maps.estimate import Start
    from avlmaps.maps.settings import DEFAULTS
    from avlmaps.perception.embedded.pixels import EmbeddedPixels

    encoder = EmbeddedPixels()
    ground = Start.of(recording, DEFAULTS).ground
    index = np.unique(np.linspace(0, len(recording) - 1, moments).round().astype(int))
    frames = []
    for number in progress(index, "looking again"):
        frame = replace(recording.frame(int(number)), ground=ground)
        feature = encoder.encode(frame)
        category = np.where(feature.any(axis=-1), (feature @ encoder.codes.T).argmax(axis=-1), -1)
        frames.append((int(number), frame.rgb, frame.depth_m, category))
    camera = recording.rig.rgb
    return strip_of(frames, encoder.names, (_MOMENT_WIDTH, round(_MOMENT_WIDTH * camera.height / camera.width)))


def _film(recording: "Recording", evidence: "Evidence", strip: Strip, sheet: Sheet) -> str:
    camera = recording.rig.rgb
    shown = ((strip.colour, "colour picture"), (strip.depth, "depth"),
             (strip.seen, "names by the pixel encoder"))  # fmt: skip
    figures = "".join(
        f'<figure><div class="frame" role="img" aria-label="{name}" style="aspect-ratio:{camera.width}/{camera.height};'
        f'background-image:url({embedded(picture, quality=72)})"></div><figcaption>{name}</figcaption></figure>'
        for picture, name in shown
    )
    legend = "".join(
        f'<li><i style="background:rgb{colour}"></i>{escape(name)}</li>' for name, colour, _ in strip.legend[:_LEGEND]
    )
    places = [sheet.at(x, y) for x, y in evidence.walk[:, :2]]
    data = {
        "duration": round(_duration_s(recording), 2),
        "moments": [round(float(recording.stamps_s[i]), 2) for i in strip.index],
        "stamps": [round(float(stamp), 2) for stamp in recording.stamps_s],
        "x": [x for x, _ in places],
        "y": [y for _, y in places],
    }
    sound = (
        ""
        if recording.audio is None
        else '<audio id="track" controls preload="metadata" '
        f'src="recording/{escape(recording.audio.path.name)}"></audio>'
    )
    return (
        f'<h2>Recorded frames</h2><div class="card"><div class="film">{figures}</div><div class="scrub">'
        f'<input id="moment" type="range" min="0" max="{data["duration"]}" step="0.5" '
        f'value="{_FIRST * data["duration"]:.1f}" aria-label="moment">'
        f'<output id="clock">0 s</output>{sound}</div><ul class="legend">{legend}</ul></div>'
        f'<script type="application/json" id="walk">{json.dumps(data, separators=(",", ":"))}</script>'
    )


def _track(recording: "Recording", evidence: "Evidence", report: "DemoReport") -> str:
    duration_s = _duration_s(recording)
    loudness = np.zeros(2) if recording.audio is None else envelope(recording.audio.read().samples, _BINS)
    true = [(event.onset_s, event.offset_s, event.category) for event in evidence.events]
    mapped = [(sound["onset_s"], sound["offset_s"]) for sound in report.built["sounds"]]
    events = "".join(
        f'<li><button type="button" data-at="{event.onset_s:.1f}"><b>{number}</b> {escape(event.category)}, '
        f"{event.onset_s:.0f} s</button></li>"
        for number, event in enumerate(evidence.events, 1)
    )
    return (
        "<h2>Recorded sounds</h2>"
        f'<div class="card">{wave(loudness, duration_s, true, mapped)}<ul class="events">{events}'
        f'</ul><p class="note">Shaded: the true sounds ({len(true)}). Below: the sounds that the map detected '
        f"({len(mapped)}). Press one to listen.</p></div>"
    )


def _facts(report: "DemoReport") -> str:
    built, seconds = report.built, report.seconds
    located = "–" if report.located is None else f"{report.located[0]:.1f} cm"
    facts = (
        (f"{built['frames']}", "frames"), (f"{built['voxels']:,}", f"voxels of {100 * built['voxel_size_m']:.0f} cm"),
        (f"{built['keyframes']}", "keyframes"), (f"{len(built['sounds'])}", "sounds detected"),
        (f"{built['bytes'] / 1e6:.0f} MB", "on the disk"), (located, "error of the photo's place"),
    )  # fmt: skip
    items = "".join(f"<li><b>{escape(value)}</b>{escape(name)}</li>" for value, name in facts)
    total = sum(seconds.get(name, 0.0) for name, _, _ in _STAGES)
    stages = "".join(
        f'<span style="flex:{max(seconds.get(name, 0.0), 0.1):.1f} 1 0;background:{colour}" '
        f'title="{label}: {seconds.get(name, 0.0):.0f} s">{label} {seconds.get(name, 0.0):.0f} s</span>'
        for name, label, colour in _STAGES
    )
    return (
        f'<h2>The map</h2><ul class="facts">{items}</ul><div class="stages">{stages}</div>'
        f'<p class="note">{total:.0f} seconds on this computer, without a graphics card and without the network.</p>'
    )


def _verdict(report: "DemoReport") -> str:
    right = sum(step.right for step in report.steps)
    return (
        f"<h2>Answers: {right} of {len(report.steps)} right</h2><p>The questions were chosen by rule from "
        "the things in the home, before the map was queried. An answer is right when its first goal lies within 1 m of "
        "a true place, horizontally, or when the map correctly reports that there is none. It is unsure when the map "
        "reports that there is none, but its best guess is right.</p>"
        '<p class="key"><span><svg viewBox="0 0 40 40"><g class="goal"><circle cx="20" cy="20" r="17"/></g></svg>'
        'goals, best first</span><span><svg viewBox="0 0 40 40"><circle class="truth" cx="20" cy="20" r="15"/></svg>'
        'the truth</span><span><svg viewBox="0 0 40 40"><circle class="other" cx="20" cy="20" '
        'r="15"/></svg>others of the kind'
        "</span></p>"
    )


def _question(number: int, step: "Step", answer: "Answer", sheet: Sheet, photo: "PhotoView | None") -> str:
    verdict = f'<span class="verdict {step.verdict.lower()}">{step.verdict}</span>'
    return (
        f'<article class="card question"><div class="head"><h3>{number}. “{escape(step.ask.title)}”</h3>{verdict}</div>'
        f"<p>{escape(step.ask.why)}</p>{_panels(step, answer, sheet, photo)}"
        f'<p>{_said(step)} <span class="note">{answer.elapsed_ms:.0f} ms.</span></p>'
        f"<p><code>{escape(step.ask.command)} --plot {escape(step.picture)}</code> "
        f'<a href="{escape(step.picture)}">its plot</a></p></article>'
    )


def _panels(step: "Step", answer: "Answer", sheet: Sheet, photo: "PhotoView | None") -> str:
    heat, ask = answer.heat, step.ask
    if heat is None:
        return ""
    ground = '<use href="#ground"/>'
    seen = sheet.camera(photo.world_from_camera) if photo else ""
    truth = sheet.band(ask.truth[1:]) if ask.kind == "clip" else sheet.rings(ask.truth, "truth")
    is_goal = answer.found or ask.truth  # where there is nothing, a guess is not a goal
    goals = sheet.goals([goal.position for goal in answer.goals]) if is_goal else ""
    layers = [ground, _layer(sheet, heat_from_above(heat.space, heat.shown)), sheet.rings(ask.others, "other")]
    large = _figure(
        sheet, [*layers, truth, seen, goals], "all together" if len(heat.factors) > 1 else _label(answer, 0)
    )
    small = [
        _figure(sheet, [ground, _layer(sheet, heat_from_above(heat.space, factor.shown)), seen], _label(answer, i))
        for i, factor in enumerate(heat.factors)
        if len(heat.factors) > 1
    ]
    if photo:
        picture = embedded(_read(step, PHOTO), quality=85)
        small.insert(0, f'<figure><img src="{picture}" alt="the photo"><figcaption>the photo</figcaption></figure>')
    if ask.kind == "clip":
        small.append(
            f'<figure><audio controls preload="none" src="{CLIP}"></audio><figcaption>the clip</figcaption></figure>'
        )
    return f'<div class="panels{"" if small else " one"}">{large}<div class="small">{"".join(small)}</div></div>'


def _layer(sheet: Sheet, plan: TopView) -> str:
    return sheet.picture(plan)


def _figure(sheet: Sheet, content: Sequence[str], label: str) -> str:
    return f"<figure>{sheet.drawing(content, label, 'panel')}<figcaption>{escape(label)}</figcaption></figure>"


def _label(answer: "Answer", part: int) -> str:
    one = answer.parts[part]
    understood = f", understood as {one.understood}" if one.understood not in ("", one.part.query) else ""
    return (
        f"{one.part.modality}: {one.part.shown}"
        + ("" if one.part.is_file else understood)
        + ("" if one.found else " (not found)")
    )


def _read(step: "Step", name: str) -> np.ndarray:
    from avlmaps.query.modalities import read_picture

    path = next(Path(part.query) for part in step.ask.question.parts if part.query.endswith(name))
    return read_picture(path)


def _said(step: "Step") -> str:
    if not step.answer["found"]:
        notes = "; ".join(_without_folder(part["note"], step) for part in step.answer["parts"] if part["note"])
        finding = "The map says that there is none here" + (f" ({escape(notes)})" if notes else "")
        guess = "" if step.off_m is None else f" Its best guess is {step.off_m:.2f} m from the true one."
        return f"{finding}, and so it is." if not step.ask.truth else f"{finding}, but there is.{guess}"
    goal = step.answer["goals"][0]
    place = ", ".join(f"{value:.1f}" for value in goal["position"])
    finding = f"First goal at ({place}) m, probability {step.answer['probability']:.2f}"
    if step.off_m is None:
        return f"{finding}; but there is none here."
    if step.ask.kind == "clip":
        return f"{finding}: {step.off_m:.2f} m from the robot's position during the sound."
    return f"{finding}: {step.off_m:.2f} m from the true one." if step.off_m > 0.0 else f"{finding}: on the true one."


def _without_folder(note: str, step: "Step") -> str:
    for part in step.ask.question.parts:
        if part.is_file:
            note = note.replace(part.query, part.shown)
    return note


def _honest(report: "DemoReport", recording: "Recording") -> str:
    spec = escape(report.scene)
    return (
        "<h2>What this is, and what it is not</h2>"
        "<p>The home, the drive, the pictures and the sounds are simulated. The furniture is of shape families that "
        "the networks never saw in training, and so is this home; the camera has the faults of a Kinect (noise that "
        "grows with distance, holes at edges, blur), its poses are true, and sounds reach the microphone "
        "through the rooms, "
        "with echo. The map is made by the very code that maps real recordings, with the small networks that ship with "
        "the package, which know the things, rooms and sounds of homes and offices alone. Six questions are a look, "
        "not a measurement: <code>avlmaps bench</code> measures, over many homes and with intervals.</p>"
        "<h2>Continue from here</h2>"
        f'<p><a href="{PAGE}">Walk through the map in three dimensions</a>: one page with its things, its sounds and '
        "the heat of these questions, without a network.</p>"
        f"<p>The map is <code>{MAP}</code> beside this page. In its folder:</p>"
        f"<pre><code>avlmaps view {MAP} --scene {spec}</code></pre>"
        f"<pre><code>{to_go_on(report.steps, spec)}"
        f"avlmaps things {MAP}\n"
        f"avlmaps locate {MAP} {PHOTO}\n"
        f"avlmaps record --scene {spec} --out another_walk --seed 1\n"
        f"avlmaps build another_walk --out another.avlmap\n"
        f"avlmaps demo --seed 1</code></pre>"
    )


def to_go_on(steps: Sequence[Step], spec: str) -> str:
    """Return commands to try next, a line each; they speak of what the map has just answered rightly."""
    title = next((step.ask.title for step in steps if step.ask.kind == "words" and step.right), None)
    if title is None:
        return ""
    nearest = title.replace("the ", "the nearest ", 1)
    return (
        f'avlmaps query {MAP} "which room is {title} in?" --json\n'
        f'avlmaps go {MAP} "go to {nearest}, then turn left" --scene {spec} --plot way.png\n'
    )


def _duration_s(recording: "Recording") -> float:
    last_s = float(recording.stamps_s[-1])
    return last_s if recording.audio is None else max(last_s, recording.audio.duration_s)


def _count(number: int, thing: str) -> str:
    return f"{number} {thing}{'' if number == 1 else 's'}"
