"""The text of docs/benchmarks.md and the README's table, made from docs/benchmarks.json alone."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from avlmaps_sim.bench.harness.provenance import in_words, outdated
from avlmaps_sim.bench.output import table_markdown

ROOT = Path(__file__).resolve().parents[1]
FIGURES, PAGE, README = ROOT / "docs" / "benchmarks.json", ROOT / "docs" / "benchmarks.md", ROOT / "README.md"
RECORDINGS, LANGUAGE = ROOT / "docs" / "recordings.md", ROOT / "docs" / "language.md"
BEGIN, END = "<!-- figures: begin (python benchmarks/report.py --page) -->", "<!-- figures: end -->"
NOT_YET = "not measured yet"


@dataclass(frozen=True, slots=True)
class Entry:
    """One section of the page: one command.

    Attributes:
        name: in docs/benchmarks.json, and of ``--only``.
        title: of the section.
        command: words; SOUNDS, RECORDING, NYUV2, HOUSE and ROOMS stand for folders of data, OUT for that of all
            results.
        hours: on two quiet cores without a GPU, estimated; 0 for minutes.
        about: a sentence below the title.
        picture: the picture of the suite that is shown, ``found.png``; ``""`` for none.
    """

    name: str
    title: str
    command: str
    hours: float = 0.0
    about: str = ""
    picture: str = ""

    @property
    def is_suite(self) -> bool:
        """Whether it is a suite of ``avlmaps bench``, with tables; other commands print text."""
        return self.command.startswith("avlmaps bench")


_INDEXING = "[How tasks are made](indexing.md)."
_NAVIGATION = "[How missions are made and judged](navigation-benchmark.md)."
_HOMES = tuple(f"house:{1_000_000 + number}:held-out" for number in range(12))
ENTRIES = (
    Entry("fusion", "Fusion", "python benchmarks/fusion.py"),
    Entry("memory", "Memory of fusion", "python benchmarks/fusion_memory.py"),
    Entry(
        "geometry", "Geometry with a sensor's faults", "python benchmarks/geometry.py --scenes house:4 house:5 HOUSE",
        0.1, "The limits of the sensor models were chosen on `house:4`.",
    ),
    Entry(
        "corrected", "Corrected poses", "python benchmarks/corrected.py --scenes house:7",
        about="[How a map follows corrected poses](guides/correct-poses.md). The drive goes there and back.",
    ),
    Entry(
        "cluster", "A build on a cluster", "python benchmarks/cluster.py --recording RECORDING",
        about="[How a cluster builds a map](guides/cluster.md). The plan multiplies what was measured on one core; no "
        "cluster of several machines was tried.",
    ),
    Entry("queries", "Queries", "python benchmarks/queries.py"),
    Entry("cold-start", "A query from the shell", "python benchmarks/cold_start.py"),
    Entry(
        "scale", "Large maps",
        "python benchmarks/scale.py --folder OUT --voxels 1000000 5000000 10000000 --against decabd78", 0.5,
        "The home `house:7` again and again, side by side. \"first\": nothing is stored beside the map yet, as of an "
        "older or copied one; \"CPU s\": as a build leaves it. \"before\" is avlmaps at the commit that the command "
        "names. One core.",
    ),
    Entry("locating", "Time to locate a photo", "python benchmarks/locate.py"),
    Entry(
        "source-speed", "Time to find where a sound came from", "python benchmarks/sources.py",
        about="[How](concepts/sound-sources.md). The goal is two seconds on 300,000 voxels.",
    ),
    Entry("store", "Writing and opening a map", "python benchmarks/store.py"),
    Entry("render", "Rendering views", "python benchmarks/render.py"),
    Entry("encoders", "The embedded encoders", "python benchmarks/embedded.py"),
    Entry("words", "Words", "avlmaps bench words --out OUT"),
    Entry("language", "Commands and questions", "avlmaps bench language --out OUT"),
    Entry(
        "frames", "Labelled frames of real rooms", "avlmaps bench frames --nyuv2 NYUV2 --out OUT", 0.2,
        "All of these 795 frames trained the weights that ship, so this is no test of them. What a twin that never saw "
        "147 of them makes of those is in `training/pixels/README.md`.",
    ),
    Entry(
        "sounds", "Sounds", "avlmaps bench sounds --sounds SOUNDS --out OUT", 0.0,
        "Tables called cross-validation were written with the weights, by networks that were not trained on the fold.",
    ),
    Entry("segmentation", "Sounds in a track", "avlmaps bench segmentation --sounds SOUNDS --out OUT", 0.3),
    Entry(
        "recordings", "Recordings that cannot be right", "avlmaps bench recordings --scenes RECORDING --out OUT", 0.2,
        "[What is compared](recordings.md#a-recording-against-itself).",
    ),
    Entry("locate", "Position of a photo", "avlmaps bench locate --scenes RECORDING --out OUT", 0.2),
    Entry("house", "Objects of an artist's house", "avlmaps bench objects --scenes HOUSE --out OUT", 0.3),
    Entry("objects", "Objects of twelve held-out homes", "avlmaps bench objects --out OUT", 1.0),
    Entry(
        "objects-lived-in", "Objects of six of these homes with people in them",
        f"avlmaps bench objects --scenes {' '.join(f'house:{1_000_000 + n}:held-out:lived-in' for n in range(6))} "
        "--out OUT", 0.5,
        "The first six of the twelve: the same walls and furniture, with people, clothes, papers and mirrors that "
        "reflect. The rendered worlds that the weights learnt from had none of these.",
    ),
    Entry(
        "rooms", "Rooms of twelve held-out homes", "avlmaps bench rooms --out OUT", 1.0,
        "[What a room is](concepts/rooms.md). Its limits were chosen on `house:1200000:held-out` to "
        "`house:1200005:held-out`.",
    ),
    Entry(
        "change", "What changed over five days",
        "avlmaps bench change --days 5 --frames 120 --jobs 2 --out OUT", 0.6,
        "[When a thing counts as gone, new or moved](guides/remember-days.md). Ten held-out homes. The thresholds "
        "were chosen on `house:21` to `house:23`, and first while looking at three of the ten (0, 4 and 5).",
    ),
    Entry(
        "live", "A map while the robot drives", "avlmaps bench live --scenes RECORDING --kills 40 --out OUT", 0.5,
        "[What a live map does](guides/map-while-you-drive.md). Wall time depends on what else the machine does: its "
        "load is printed (two cores are busy at 2), and processor time beside it.",
    ),
    Entry(
        "live-hour", "An hour of driving over the same surface",
        "avlmaps bench live --scenes RECORDING --laps 108 --rate 4 --kills 0 --no-ends --out OUT", 0.3,
        "An hour of laps in a quarter of one, so that more frames are late than above. Memory is that of the whole "
        "process, with the recording's reader and a person who asks twice a second.",
    ),
    Entry(
        "sources", "Where sounds came from",
        "avlmaps bench sources --rooms ROOMS --trials 4 --jobs 2 --out OUT", 0.5,
        "[How](concepts/sound-sources.md). Ten held-out homes, acoustic hearing at 20 dB, maps of pictures of 160x120. "
        "All arrays are channels of one recording. The device says an azimuth ten times a second, 8 degrees off (one "
        "standard deviation), 3 % of them anything, mounted at an angle that nobody knows. Put wrong: each place by "
        "2.5 cm, each channel by 80 µs (standard deviations); calibrated: by a drive past a ticking thing in another "
        "room. \"lexicon\" counts things that usually make such a sound, whose "
        "kind is taken as known: the simulator puts sounds at things by the same lexicon, so they flatter. Errors are "
        "on the plan. Published, in other rooms, of other sounds: two arrays, bearings 30 degrees apart, below 0.3 m; "
        "one cube array with reflections 0.8 m; one microphone on a moving robot, a known chirp: 0.24 to 0.29 m.",
    ),
    Entry("indexing", "The paper's Tables III to V", "avlmaps bench indexing --out OUT", 1.5, _INDEXING),
    Entry(
        "indexing-clips", "The same with recorded sounds", "avlmaps bench indexing --sounds SOUNDS --out OUT", 2.5,
        "The sounds above come from the generator that also made training sounds of the embedded encoder. These are "
        "recordings that it was not trained on.",
    ),
    Entry(
        "indexing-paper", "The same by the paper's rules", "avlmaps bench indexing --rules paper --out OUT", 1.5,
        "The paper's pipeline whole, with our encoders ([the rules](paper-models.md#the-papers-rules)).",
    ),
    Entry(
        "found", "Is found true?",
        f"avlmaps bench found --scenes {' '.join(_HOMES)} HOUSE --out OUT",
        1.5, "The twelve homes of the tables above, and an artist's house. No weight of the probability was fitted on "
        "them ([how](experiments.md#found-as-a-probability), and what the weights of 26 November change).", "found.png",
    ),
    Entry("navigation", "The paper's Tables I, II and VI", "avlmaps bench navigation --out OUT", 5.0, _NAVIGATION),
    Entry(
        "navigation-clips", "The same with recorded sounds",
        "avlmaps bench navigation --sounds SOUNDS --series sounds-1 sounds-2 sounds-3 pairs --out OUT", 4.0,
    ),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Figure:
    """One row of the README's table: cells of a table, or a match in a text.

    Attributes:
        label: what is measured.
        entry: name of the entry.
        table: start of the table's name; ``""`` for a text.
        row: start of the row's cells, joined by " | "; for a text a regular expression with groups.
        form: shows cells by ``{column}``, intervals by ``{+column}``; for a text ``{1}`` and so on.
    """

    label: str
    entry: str
    table: str
    row: str
    form: str


_RECALL = "**{R@1 < 0.5 m %} %** of {tasks} within 0.5 m ({+R@1 < 0.5 m %})"
README_FIGURES = (
    Figure(
        "fusion, 640x480 depth, 512-d features, one core", "fusion", "",
        r"every pixel, depth registered to colour +\S+ +(\S+) +\S+ +(\S+)",
        "{1} frames/s, {2} times the per-point loop",
    ),
    Figure(
        "a word queried over 1,000,000 x 512 features", "queries", "",
        r"one word over 1,000,000 x 512 float16 +(\S+)", "{1} ms",
    ),
    Figure(
        "photos located, half of a real kitchen as the map", "locate", "photos located",
        "every other frame | * | * | yes",
        "{within 5 cm and 5° %} % of {photos} within 5 cm and 5°, median {median error cm} cm",
    ),
    Figure(
        "sounds by words, held out: ten kinds of ESC-10", "sounds", "cross-validation: asked by words",
        "ESC-10 | dry | right name first among 50 names", "{hits} of {of}, {%} % ({95 %})",
    ),
    Figure(
        "the same, forty household kinds", "sounds", "cross-validation: asked by words",
        "household | dry | right name first among 50 names", "{hits} of {of}, {%} % ({95 %})",
    ),
    Figure(
        "commands that strangers wrote, read at first use", "language", "blind, at first use", "fourth four, commands",
        "right {right}; misread {misread}",
    ),
    Figure("Table III, an object in an area", "indexing", "Table III", "+ sparse view map (ours)", _RECALL),
    Figure("Table IV, a sound near an object", "indexing", "Table IV", "object + sound (ours)", _RECALL),
    Figure(
        "the same with recorded sounds that nothing was trained on", "indexing-clips", "Table IV",
        "object + sound (ours)", _RECALL,
    ),
    Figure("Table V, an object near a photo", "indexing", "Table V", "object + image (ours)", _RECALL),
)  # fmt: skip


def read_figures() -> dict[str, Any]:
    """Return the measurements, by the name of the entry."""
    return json.loads(FIGURES.read_text(encoding="utf-8"))


INTRODUCTION = """# Benchmarks

`make bench` writes this page from [benchmarks.json](benchmarks.json), which holds what each command below printed.
Nothing here is typed by hand; [a page of its own](experiments.md) holds what else was tried.

Speed is a ratio against another way in the same run, since machines differ and are busy. Accuracy comes with counts and
95 % intervals. Below a table stand the choices that were made on the same data. Each section names its command and the
checksums of the weights; where those are not the weights that ship, it says so.

    python benchmarks/report.py --sounds SOUNDS --recording RECORDING --house HOUSE    # all of it: two nights
    python benchmarks/report.py --only words sounds ...                 # some of it
    python benchmarks/report.py --stale ...                                        # what other weights measured
    python benchmarks/report.py --page                                   # this page again, measures nothing

SOUNDS is a folder of clips with an `index.csv`, RECORDING a recording with poses (the red kitchen of 7-Scenes here),
NYUV2 labelled frames in the layout of NYU Depth V2,
HOUSE a scene file (the house of aws-robomaker-small-house-world here). A run that was stopped resumes where it stopped.
"""


def page(measured: Mapping[str, Any], shipped: Mapping[str, str]) -> str:
    """Return docs/benchmarks.md.

    Args:
        measured: what docs/benchmarks.json holds.
        shipped: checksums of the weights that ship, by module.
    """
    return "\n".join([INTRODUCTION, *(_section(entry, measured.get(entry.name), shipped) for entry in ENTRIES)])


def _section(entry: Entry, found: Mapping[str, Any] | None, shipped: Mapping[str, str]) -> str:
    lines = [f"## {entry.title}", "", *([entry.about, ""] if entry.about else []), f"    {entry.command}", ""]
    if found is None:
        unit = "hour" if entry.hours <= 1 else "hours"
        hours = f" It takes about {entry.hours:g} {unit} on two quiet cores." if entry.hours else ""
        return "\n".join([*lines, f"Not measured yet.{hours}", ""])
    measured_on = f"Measured on {found['date']} with avlmaps {found['avlmaps']} on {found['machine']}."
    if not entry.is_suite:
        return "\n".join([*lines, measured_on, "", "```", found["text"].rstrip(), "```", ""])
    answer = found["answer"]
    lines += [measured_on + " " + in_words(answer), "", *_warning(answer, shipped)]
    lines += [answer["note"], ""] if answer.get("note") else []
    lines += [f"Paper: {answer['paper']}", ""] if answer.get("paper") else []
    lines += [f"![{entry.title}](pictures/{entry.picture})", ""] if entry.picture else []
    for name, table in answer["tables"].items():
        lines += [f"### {name}", "", table_markdown(table)]
    return "\n".join(lines)


def _warning(answer: Mapping[str, Any], shipped: Mapping[str, str]) -> list[str]:
    """Return one paragraph where a table was not measured with the weights that ship, else nothing."""
    weights = answer.get("weights")
    if answer.get("profile") != "embedded" or answer.get("models"):
        return []
    if weights is None:
        return ["**The weights of this measurement were not recorded.** Run the command again.", ""]
    others = outdated(weights, shipped)
    if not others:
        return []
    return [f"**Not measured with the weights that ship** (other weights: {', '.join(others)}). Run it again.", ""]


def stale(entry: Entry, found: Mapping[str, Any] | None, shipped: Mapping[str, str]) -> bool:
    """Return whether an entry was never measured, or with other weights than those that ship."""
    return found is None or (entry.is_suite and bool(_warning(found["answer"], shipped)))


def readme_table(measured: Mapping[str, Any]) -> str:
    """Return the README's table of figures."""
    rows = [f"| {one.label} | {_shown(one, measured.get(one.entry))} |" for one in README_FIGURES]
    return "\n".join(["| what | measured |", "|---|---|", *rows])


def _shown(figure: Figure, found: Mapping[str, Any] | None) -> str:
    if found is None:
        return NOT_YET
    if not figure.table:
        match = re.search(figure.row, found["text"])
        return NOT_YET if match is None else figure.form.format("", *match.groups())
    for name, table in found["answer"]["tables"].items():
        if name.startswith(figure.table):
            for row in table["rows"]:
                if _is_row(row, figure.row):
                    return _filled(figure.form, table["columns"], row)
    return NOT_YET


def _is_row(row: list[Any], wanted: str) -> bool:
    cells = wanted.split(" | ")
    return all(want in ("*", str(cell), str(cell).removesuffix(".0")) for want, cell in zip(cells, row, strict=False))


def _filled(form: str, columns: list[str], row: list[Any]) -> str:
    """Replace each ``{column}`` by its cell, and ``{+column}`` by the cell right of it: its interval."""

    def cell(match: re.Match[str]) -> str:
        right = match.group(1).startswith("+")
        return str(row[columns.index(match.group(1).removeprefix("+")) + right])

    return re.sub(r"\{([^}]+)\}", cell, form)


def recordings_tables(measured: Mapping[str, Any]) -> str:
    """Return what docs/recordings.md shows of the suite `recordings`: counts by source and format, and the cost."""
    found = measured.get("recordings")
    if found is None:
        return NOT_YET
    tables = found["answer"]["tables"]
    shown = [table_markdown(tables[name]) for name in ("mistakes by source", "mistakes by format")]
    right, cost = tables["right recordings"], tables["cost"]
    outcome = right["columns"].index("outcome")
    silent = sum(row[outcome] == "right" for row in right["rows"])
    fields = dict(zip(cost["columns"], cost["rows"][0], strict=True))
    last = (
        f"Of {len(right['rows'])} right recordings {silent} got no word. The check takes {fields['share %']} % of the "
        f"processor time of a build ({fields['check, processor s']} of {fields['whole build, processor s']} s, "
        f"{fields['frames']} frames). [Every recording, and what nothing was said of](benchmarks.md"
        f"#recordings-that-cannot-be-right); measured on {found['date']}.\n"
    )
    return "\n".join([*shown, last]).rstrip()


def language_tables(measured: Mapping[str, Any]) -> str:
    """Return what docs/language.md shows of the suite `language`: each round at first use, and all lists now."""
    found = measured.get("language")
    if found is None:
        return NOT_YET
    first, now = found["answer"]["tables"].values()
    lists = {row[0] for row in now["rows"]}
    columns = ["question back" if name == "asked back" else name for name in first["columns"][1:]]
    rounds = {"columns": ["round", *columns], "rows": [row for row in first["rows"] if row[0] not in lists]}
    whole = [row for row in now["rows"] if str(row[0]).startswith("all, ")]
    every = {"columns": ["lists", *columns], "rows": whole}
    last = f"[Each list by itself](benchmarks.md#commands-and-questions); measured on {found['date']}."
    return "\n".join(["At first use:", "", table_markdown(rounds), "Now:", "", table_markdown(every), last])


def with_figures(readme: str, table: str) -> str:
    """Return a page, such as the README, with the table between its markers.

    Raises:
        ValueError: the markers are not there.
    """
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"The page lacks {BEGIN} ... {END}")
    return f"{before}{BEGIN}\n{table}\n{END}{after}"
