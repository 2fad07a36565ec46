"""The text of docs/benchmarks.md and the README's table, made from docs/benchmarks.json alone."""

import json
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from avlmaps_sim.bench.harness.figures import outdated

ROOT = Path(__file__).resolve().parents[1]
FIGURES, PAGE, README = ROOT / "docs" / "benchmarks.json", ROOT / "docs" / "benchmarks.md", ROOT / "README.md"
BEGIN, END = "<!-- figures: begin (python benchmarks/report.py --page) -->", "<!-- figures: end -->"
NOT_YET = "not measured yet"
EYES, EARS, PHOTOS = ("words", "pixels", "views"), ("words", "sounds"), ("local", "place", "matcher")


@dataclass(frozen=True, slots=True)
class Figure:
    """One result: cells of a table, or a match in a text.

    Attributes:
        label: what is measured.
        table: start of the table's name; ``""`` for a text.
        row: start of the row's cells, joined by " | "; for a text a regular expression with groups.
        form: shows cells by ``{column}``, the cell right of one by ``{+column}``, one of another row by
            ``{start of the row|column}``; for a text ``{1}`` and so on.
        of: the modules whose weights it depends on; a text is of none.
    """

    label: str
    table: str
    row: str
    form: str
    of: tuple[str, ...] = EYES


@dataclass(frozen=True, slots=True)
class Entry:
    """One command, and what the page shows of its result.

    Attributes:
        name: in docs/benchmarks.json, and of ``--only``.
        command: words; SOUNDS, RECORDING, NYUV2, HOUSE and ROOMS stand for folders of data, OUT for that of all
            results, HOMES for held-out homes. Of the entry ``outside`` there is none.
        figures: the rows of the page.
        whole: words more of the paper's size, with all of the homes.
    """

    name: str
    command: str
    figures: tuple[Figure, ...]
    whole: str = ""

    @property
    def is_suite(self) -> bool:
        """Whether it is a suite of ``avlmaps bench``, with tables; other commands print text."""
        return self.command.startswith("avlmaps bench")


def _paper(table: str, ours: str, label: str, beside: str = "") -> Figure:
    form = "**{R@1 < 0.5 m %} %** of {tasks} within 0.5 m ({+R@1 < 0.5 m %})"
    if beside:
        form += f"; {beside} {{{beside} | *|R@1 < 0.5 m %}}, chance {{chance|R@1 < 0.5 m %}}"
    return Figure(label, table, ours, form, (*EYES, *{"Table IV": EARS, "Table V": PHOTOS}.get(table, ())))


def _ours(table: str, ours: str, label: str, beside: str) -> Figure:
    whole = _paper(table, f"{ours} (ours)", label, beside)
    return replace(whole, form=f"{whole.form}; to its centre {{{ours} (ours), by the centre|R@1 < 0.5 m %}}")


def _tables(suffix: str) -> tuple[Figure, ...]:
    return (
        _ours("Table III", "+ sparse view map", f"Table III, an object in an area{suffix}", "object only"),
        _ours("Table IV", "object + sound", f"Table IV, a sound near an object{suffix}", "sound only"),
        _ours("Table V", "object + image", f"Table V, an object near a photo{suffix}", "object only"),
    )


def _driven(table: str, label: str, in_a_row: int) -> Figure:
    column = f"{in_a_row} in a row %"
    form = f"all {in_a_row} reached in {{{column}}} % of {{sequences}} ({{+{column}}})"
    return Figure(label, table, "ours", form, (*EYES, *EARS, *PHOTOS))


HOMES = tuple(f"house:{1_000_000 + number}:held-out" for number in range(12))
FEW = 2  # of them, in the standing size
# Figures by hands that had read neither the code nor its lists, on data that nothing learnt from: lines of their text.
OTHER_HANDS = (
    "NYUv2, 654 test frames, by pixels-9",
    "ESC-50 fold 1, 400 clips, 50 names, by sounds-5",
    "85 more clips, by sounds-5",
    "the thirteenth, at first use",
    "the sixteenth, reader before",
    "the seventeenth",
    "the fifteenth, reader before",
    "six more, 1,097 commands, at first use",
    "an eleventh writer, commands",
    "the same, questions",
    "the first writer, reader of 0.2",
)
ENTRIES = (
    Entry("fusion", "python benchmarks/fusion.py", (
        Figure("fusion alone, 640x480 depth, 512-d features, one core", "",
               r"every 100th pixel +(\S+)[^\n]+\n[^\n]+to colour +(\S+)",
               "{2} processor ms a frame; a loop in Python over one pixel in a hundred {1}"),)),
    Entry("geometry", "python benchmarks/geometry.py --scenes house:4 house:5 HOUSE", (
        Figure("voxels within 5 cm of the true surface, Kinect, house:5", "",
               r"house:5 kinect before +\S+ +(\S+)[^\n]+\n +house:5 kinect after \(kinect\) +\S+ +(\S+)",
               "{1} % as measured, {2} % with the sensor's model"),)),
    Entry("corrected", "python benchmarks/corrected.py --scenes house:7", (
        Figure("corrected poses, submaps of 32 frames: voxels of a full rebuild that are there", "",
               r"graph +32 .*? (\S+%) +\S+% +(\S+%) +(\S+%)", "{1}; double walls {2} before, {3} after"),)),
    Entry("queries", "python benchmarks/queries.py", (
        Figure("a word queried over 1,000,000 x 512 features", "",
               r"one word over 1,000,000 x 512 float16 +(\S+) +(\S+)",
               "{1} processor ms; numpy's product of float16 in the same run {2}"),)),
    Entry("cold-start", "python benchmarks/cold_start.py", (
        Figure("`avlmaps query MAP bed` from the shell", "", r"query MAP bed +(\S+)", "{1} s of the processor"),)),
    Entry("scale", "python benchmarks/scale.py --folder OUT --voxels 1000000 5000000 10000000 --against decabd78", (
        Figure("a thing in a map of 10,000,000 voxels, opening included", "",
               r"10,000,000 voxels\n[^\n]+\n[^\n]+\n  object +\S+ +\S+ +\S+ +(\S+) +(\S+)",
               "{1} s of the processor, {2} MB"),)),
    Entry("locating", "python benchmarks/locate.py RECORDING --elsewhere PHOTOS --photos 30", (
        Figure("photos of a real kitchen in a tenth of the light, located", "",
               r"dim and noisy +(\d+) +(\d+) +(\S+ to \S+) +\d+ +(\S+) +(\S+)",
               "{2} of {1} within 25 cm and 10° ({3} %), median {4} cm, {5} s of one thread each"),)),
    Entry("source-speed", "python benchmarks/sources.py", (
        Figure("where a sound of 5 s came from, 320,000 voxels", "", r"ours +(\S+)", "{1} s of one thread"),)),
    Entry("store", "python benchmarks/store.py", (
        Figure("opening a map of 1,000,000 voxels by 512", "", r"open, in the file cache +(\S+)", "{1} s"),)),
    Entry("words", "avlmaps bench words --out OUT", (
        Figure("held-out phrases by their right entry", "phrases kept out", "all | avlmaps", "{first}"),)),
    Entry("language", "avlmaps bench language --out OUT", (
        Figure("commands, sealed rounds, as recorded at first use", "blind, at first use", "pooled",
               "{right}; {misread}; {dangers driven}"),
        Figure("commands, all lists, now (development)", "the same lists now", "all, commands",
               "right {right}; misread {misread}"),
        Figure("questions, all lists, now (development)", "the same lists now", "all, questions",
               "right {right}; misread {misread}"))),
    Entry("frames", "avlmaps bench frames --nyuv2 NYUV2 --frames 100 --out OUT", (
        Figure("pixels of real frames that trained the weights (no test)", "labelled frames", "*",
               "{pixel accuracy} of {frames} frames ({mean over frames, 95 %})"),), "--frames 795"),
    Entry("sounds", "avlmaps bench sounds --sounds SOUNDS --out OUT", (
        Figure("sounds by words, held out: ten kinds of ESC-10", "cross-validation: asked by words",
               "ESC-10 | dry | right name first among 50 names", "{hits} of {of}, {%} % ({95 %})", EARS),
        Figure("the same, forty household kinds", "cross-validation: asked by words",
               "household | dry | right name first among 50 names", "{hits} of {of}, {%} % ({95 %})", EARS),
        Figure("unknown kinds of sound that are refused", "cross-validation: refusing", "dry",
               "{no to strangers %} % of {strangers}", EARS))),
    Entry("segmentation", "avlmaps bench segmentation --sounds SOUNDS --out OUT", (
        Figure("sounds cut out of a track, pink noise, 20 dB", "sounds found", "folds 4 and 5 | pink | 20",
               "{found %} % of {sounds} found ({95 %})"),)),
    Entry("recordings", "avlmaps bench recordings --scenes RECORDING --out OUT", (
        Figure("mistakes in recordings that nothing is said of", "mistakes by source", "all",
               "{silent wrong} of {mistakes} ({silent wrong %: 95 %} %)"),)),
    Entry("house", "avlmaps bench objects --scenes HOUSE --out OUT", (
        Figure("things of an artist's house by name", "objects found", "*", "{first goal within 0.5 m}"),)),
    Entry("objects", "avlmaps bench objects --out OUT", (
        Figure("things of twelve held-out homes: first goal within 0.5 m", "objects found", "all 12",
               "{first goal within 0.5 m}"),
        Figure("the same: true things that are listed", "objects found", "all 12", "{true things found}"))),
    Entry("objects-lived-in", "avlmaps bench objects --scenes HOMES:lived-in --out OUT", (
        Figure("things among people, clothes and mirrors", "objects found", "all ", "{first goal within 0.5 m}"),)),
    Entry("rooms", "avlmaps bench rooms --out OUT", (
        Figure("rooms of twelve held-out homes with an IoU over 0.5", "rooms", "walls and doorways",
               "{IoU over 0.5 %} % of {true rooms} ({+IoU over 0.5 %})"),
        Figure("the same: named rightly", "rooms", "walls and doorways",
               "{named rightly %} % ({+named rightly %})"))),
    Entry("change", "avlmaps bench change --scenes HOMES --days 3 --frames 120 --out OUT", (
        Figure("changes from day to day, any name: moved", "changes", "ours, any name | moved",
               "precision {precision (95 %)}, recall {recall (95 %)}"),), "--days 5"),
    Entry("live", "avlmaps bench live --scenes RECORDING --laps 0 --kills 10 --out OUT", (
        Figure("live maps killed at random moments that are left whole", "kills", "*",
               "{whole maps left} of {kills}"),), "--kills 40"),
    Entry("sources", "avlmaps bench sources --scenes HOMES --rooms ROOMS --trials 0 --out OUT", (
        Figure("where sounds came from, four microphones (simulated)", "homes", "square4",
               "median {median error m} m ({+median error m})", ()),
        Figure("the same, one microphone", "homes", "mono", "median {median error m} m ({+median error m})", ()),
        Figure("the same, a measured room", "a measured room", "4 of 25",
               "median {median error m} m ({+median error m})", ())), "--trials 12"),
    Entry("indexing", "avlmaps bench indexing --scenes HOMES --out OUT", _tables("")),
    Entry("indexing-clips", "avlmaps bench indexing --scenes HOMES --sounds SOUNDS --out OUT",
          _tables("; recorded sounds")[1:2]),  # the others ask for no sound
    Entry("indexing-paper", "avlmaps bench indexing --scenes HOMES --rules paper --out OUT", (
        _paper("Table III", "+ sparse view map by the paper", "Table III by the paper's rules"),
        _paper("Table IV", "object + sound", "Table IV by the paper's rules"),
        _paper("Table V", "object + image", "Table V by the paper's rules"))),
    Entry("found", "avlmaps bench found --scenes HOMES --out OUT", (
        Figure("Is found true? Brier score", "found", "all", "{Brier score} of {queries} queries",
               (*EYES, *EARS, *PHOTOS)),
        Figure("found, where no such thing is", "found", "all", "{none there: found}",
               (*EYES, *EARS, *PHOTOS)))),
    Entry("navigation",
          "avlmaps bench navigation --scenes HOMES --sequences 12 --series sounds-3 images pairs --out OUT", (
        _driven("Table I: four sounds, range 3", "Table I, four sounds, range 3", 4),
        _driven("Table II", "Table II, a photo, then two things", 3),
        _driven("Table VI", "Table VI, an ambiguous sound, then an ambiguous thing", 2)),
          "--sequences 200 --series sounds-1 sounds-2 sounds-3 images pairs commands spatial"),
    Entry("outside", "not of this repository", tuple(
        Figure(f"another hand: {label}", "", rf"(?m)^{re.escape(label)}: (.+)$", "{1}") for label in OTHER_HANDS)),
)  # fmt: skip
# What the README shows: entries and the labels of their figures. Tables I to VI stand together on the page alone.
README_ROWS = {"sounds": 2, "objects": 2, "rooms": 2, "language": 1, "outside": 6}

INTRODUCTION = """# Benchmarks

`make bench` measures what has a command anew in an afternoon, and writes this page and the README's table from
[benchmarks.json](benchmarks.json), all that each command printed. Speed is of one core of a shared machine with two.
Intervals are 95 %: few homes or missions make them wide. *Another hand* has no command: its rows name older readers.

*Weights* says whether a row was measured with the weights that ship; *older* is not to be relied on.

    python benchmarks/report.py --only words sounds   # some; --stale: what older weights measured; --page: the page
    python benchmarks/report.py --whole               # all twelve homes, the paper's numbers of tasks (two nights)

HOMES are the first two of twelve held-out homes, with `--whole` all; SOUNDS is a folder of clips with an `index.csv`,
or ESC-50; RECORDING the red kitchen of 7-Scenes; NYUV2 labelled frames; HOUSE the house of
aws-robomaker-small-house-world; ROOMS a measured room.

| what | result | weights, date | command |
|---|---|---|---|"""
AFTER = """
## Beside the paper

[How the suites measure](guides/reproduce-the-paper.md#how-the-suites-measure). Our encoders are supervised on these
names in this renderer; the paper's are zero-shot on Matterport3D, so the rows are not comparable. Compare ours with
chance and one modality, which each row names; distances are to the nearest face, or to the centre where it says so.
"""


def page(measured: Mapping[str, Any], shipped: Mapping[str, str]) -> str:
    """Return docs/benchmarks.md.

    Args:
        measured: what docs/benchmarks.json holds.
        shipped: checksums of the weights that ship, by module.
    """
    lines = [INTRODUCTION]
    for entry in (one for one in ENTRIES if one.name in measured):
        found = measured[entry.name]
        for number, figure in enumerate(entry.figures):
            when = f"{weights_of(found, shipped, figure.of)}, {found['date']}{_homes(found)}"
            command = "" if number else f"`{found['command'].removesuffix(' --out OUT')}`"
            lines.append(f"| {figure.label} | {shown(figure, found)} | {when} | {command} |")
    missing = [entry.name for entry in ENTRIES if entry.name not in measured]
    told = [f"\nNot measured with these weights, so without a row: {', '.join(missing)}."] if missing else []
    return "\n".join([*lines, *told, AFTER])


def _homes(found: Mapping[str, Any]) -> str:
    homes = [one for one in found.get("answer", {}).get("scenes", ()) if str(one).startswith("house:")]
    return f", {len(homes)} home{'s' if len(homes) > 1 else ''}" if homes else ""


def weights_of(found: Mapping[str, Any], shipped: Mapping[str, str], of: Collection[str]) -> str:
    """Say whether an entry was measured with the weights that ship, of some modules."""
    answer = found.get("answer")
    if answer is None or answer.get("weights") == {} or not of:
        return "none" if answer is not None or found["command"].startswith("python") else "-"
    if answer.get("weights") is None:
        return "not recorded"
    return "older" if set(outdated(answer["weights"], shipped)).intersection(of) else "shipped"


def stale(entry: Entry, found: Mapping[str, Any] | None, shipped: Mapping[str, str]) -> bool:
    """Return whether an entry was never measured, or with other weights than those that ship."""
    of = {module for figure in entry.figures for module in figure.of}
    return found is None or weights_of(found, shipped, of) in ("older", "not recorded")


def readme_table(measured: Mapping[str, Any]) -> str:
    """Return the README's table of figures."""
    rows = [
        f"| {figure.label} | {shown(figure, measured.get(entry.name))} |"
        for entry in ENTRIES
        for figure in entry.figures[: README_ROWS.get(entry.name, 0)]
    ]
    return "\n".join(["| what | measured |", "|---|---|", *rows])


def shown(figure: Figure, found: Mapping[str, Any] | None) -> str:
    """Return a result as the page shows it."""
    if found is None:
        return NOT_YET
    if not figure.table:
        match = re.search(figure.row, found["text"])
        return NOT_YET if match is None else figure.form.format("", *match.groups())
    for name, table in found["answer"]["tables"].items():
        if name.startswith(figure.table):
            if figure.row == "pooled":
                return _filled(figure.form, table, pooled(table))
            for row in table["rows"]:
                if _is_row(row, figure.row):
                    return _filled(figure.form, table, row)
    return NOT_YET


def is_there(figure: Figure, found: Mapping[str, Any]) -> bool:
    """Return whether a result is in what a command printed: of any size, and of a table in some row."""
    if shown(figure, found) != NOT_YET:
        return True
    if not figure.table:
        return re.search(re.sub(r"\d[\d,]*", r"[\\d,]+", figure.row), found["text"]) is not None
    tables = found["answer"]["tables"]
    wanted = {word.rpartition("|")[2].removeprefix("+") for word in re.findall(r"\{([^}]+)\}", figure.form)}
    return any(name.startswith(figure.table) and wanted <= set(one["columns"]) for name, one in tables.items())


def pooled(table: Mapping[str, Any]) -> list[Any]:
    """Add up the commands of all sealed rounds, each of which met another reader, and of those after the fourth."""
    lists = [row for row in table["rows"] if str(row[0]).endswith(", commands")]
    rows = lists[next(number for number, row in enumerate(lists) if str(row[0]).startswith("first four")) :]

    def share(column: int, name: str) -> str:
        parts: list[str] = []
        for own in (rows, rows[4:]):
            count, total = (sum(int(str(row[at]).split()[0]) for row in own) for at in (column, 1))
            parts.append(f"{count} of {total} ({100 * count / total:.1f} %)")
        return f"{name} {parts[0]}, after round 4 {parts[1]}"

    driven = [str(row[6]).split(" of ") for row in rows if " of " in str(row[6])]
    dangers = f"dangers driven {sum(int(one) for one, _ in driven)} of {sum(int(of) for _, of in driven)}"
    return ["pooled", "", share(2, "right"), "", "", share(5, "misread"), dangers]


def _is_row(row: list[Any], wanted: str) -> bool:
    cells = wanted.split(" | ")
    texts = [str(cell).removesuffix(".0") for cell in row]
    exact = all(want in ("*", text) for want, text in zip(cells, texts, strict=False))
    return exact or (len(cells) == 1 and wanted != "*" and texts[0].startswith(wanted)) or _begins(texts, cells)


def _begins(texts: list[str], cells: list[str]) -> bool:
    *first, last = cells
    return texts[: len(first)] == first and len(texts) > len(first) and texts[len(first)].startswith(last)


def _filled(form: str, table: Mapping[str, Any], row: list[Any]) -> str:
    """Replace ``{column}`` by its cell, ``{+column}`` by the one right of it, its interval; see ``Figure.form``."""

    def cell(match: re.Match[str]) -> str:
        start, _, column = match.group(1).rpartition("|")
        of = next(one for one in table["rows"] if _is_row(one, start)) if start else row
        return str(of[table["columns"].index(column.removeprefix("+")) + column.startswith("+")])

    return re.sub(r"\{([^}]+)\}", cell, form)


def read_figures() -> dict[str, Any]:
    """Return the measurements, by the name of the entry."""
    return json.loads(FIGURES.read_text(encoding="utf-8"))


def with_figures(readme: str, table: str) -> str:
    """Return the README with the table between its markers.

    Raises:
        ValueError: the markers are not there.
    """
    before, begin, rest = readme.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"The page lacks {BEGIN} ... {END}")
    return f"{before}{BEGIN}\n{table}\n{END}{after}"
