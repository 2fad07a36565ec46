"""The suites behind `avlmaps bench`: run one, write its tables as JSON, Markdown and a picture."""

import csv
import io
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.core.files import write_bytes_atomically

if TYPE_CHECKING:
    from avlmaps.bench.indexing import IndexingSettings
    from avlmaps.bench.navigation import NavigationSettings

Table = Mapping[str, Any]  # {"columns": [...], "rows": [[...]]}


class BenchError(AvlmapsError):
    """A suite cannot be run: what it measures on was not given."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What a suite measures on.

    Attributes:
        sounds: folder of clips with an index.csv, for the suites of sound.
        clips: the same, for ``sounds``: clips that are asked for by name, dry and in rooms.
        scenes: recordings with poses, for ``locate``.
        nyuv2: folder of labelled frames, for ``frames``.
        profile: which models are measured.
        seed: of what is drawn at random.
        indexing: what the suites ``indexing`` and ``objects`` are run on; its own defaults if None.
        navigation: what the suite ``navigation`` is run on; its own defaults if None.
    """

    sounds: Path | None = None
    clips: Path | None = None
    scenes: tuple[Path, ...] = ()
    nyuv2: Path | None = None
    profile: str = "embedded"
    seed: int = 0
    indexing: "IndexingSettings | None" = None
    navigation: "NavigationSettings | None" = None


def run_suite(suite: str, asked: Asked, out: Path) -> dict[str, Any]:
    """Run a suite and write SUITE.json, SUITE.md, SUITE.png and a SUITE-TABLE.csv for each table into ``out``.

    Args:
        suite: ``words``, ``language``, ``sounds``, ``segmentation``, ``locate``, ``frames``,
            ``objects``, ``indexing`` or ``navigation``.
        asked: what it measures on.
        out: folder to write into.

    Raises:
        BenchError: the folder or recording that the suite needs was not given, or the profile cannot be measured.
    """
    if suite == "indexing":
        from avlmaps.bench.indexing.suite import run_indexing

        return run_indexing(asked.indexing, out)
    if suite == "navigation":
        from avlmaps.bench.navigation.suite import run_navigation

        return run_navigation(asked.navigation, out)
    given = (asked.sounds, asked.clips, asked.nyuv2, *asked.scenes)
    scenes = [source.resolve().name for source in given if source is not None]
    if suite == "objects":
        from avlmaps.bench.indexing import DEFAULT_SCENES
        from avlmaps.bench.objects import run_objects

        tables = run_objects(asked.indexing, out)
        scenes = list(asked.indexing.scenes if asked.indexing else DEFAULT_SCENES)
    else:
        tables = _SUITES[suite](asked)
    answer = {
        "suite": suite,
        "scenes": scenes,
        "profile": asked.profile,
        "seed": asked.seed,
        "tables": {name: dict(table) for name, table in tables.items()},
    }
    out.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(out / f"{suite}.json", (json.dumps(answer, indent=1) + "\n").encode())
    write_bytes_atomically(out / f"{suite}.md", markdown(tables).encode())
    for name, table in tables.items():
        slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
        write_bytes_atomically(out / f"{suite}-{slug}.csv", as_csv(table).encode())
    draw(tables, out / f"{suite}.png")
    return answer


def _words(asked: Asked) -> Mapping[str, Table]:
    from avlmaps.bench import words

    _embedded_only(asked, "words")
    return {"phrases kept out of training": words.run()}


def _sounds(asked: Asked) -> Mapping[str, Table]:
    from avlmaps.bench import sound_clips, sounds

    _embedded_only(asked, "sounds")
    if asked.clips is not None:
        return sound_clips.run(asked.clips)
    return sounds.run(_clips(asked))


def _segmentation(asked: Asked) -> Mapping[str, Table]:
    from avlmaps.bench import segmentation

    return {"sounds found in a track": segmentation.run(_clips(asked), asked.seed)}


def _locate(asked: Asked) -> Mapping[str, Table]:
    from avlmaps.bench import locate
    from avlmaps.recordings.open import open_recording

    if not asked.scenes:
        raise BenchError("This suite measures on recordings with poses; name one or more with --scenes.")
    tables: dict[str, Table] = {}
    for path in asked.scenes:
        recording = open_recording(path)
        if len(recording) < 20:
            raise RecordingError(f"{path} has {len(recording)} frames; half as map and half as photos takes 20.")
        tables[f"photos located in {path.resolve().name}"] = locate.run(
            recording, asked.seed, profile_name=asked.profile
        )
    return tables


def _frames(asked: Asked) -> Mapping[str, Table]:
    from avlmaps.bench.frames import run_frames
    from avlmaps.perception.embedded.pixels import EmbeddedPixels
    from avlmaps.perception.profiles import profile

    if asked.nyuv2 is None:
        raise BenchError("This suite measures on labelled frames in the layout of NYU Depth V2; name their folder with "
                         "--nyuv2.")  # fmt: skip
    encoder = profile(asked.profile).pixel_encoder()
    if not isinstance(encoder, EmbeddedPixels):
        raise BenchError(
            f"The suite frames sums probabilities of kinds, which the pixel encoder of the profile {asked.profile!r} "
            "does not give. Choose embedded or synthetic."
        )
    return run_frames(encoder, asked.nyuv2)


def _language(_: Asked) -> Mapping[str, Table]:
    from avlmaps.bench import language

    return language.run()


_SUITES: dict[str, Callable[[Asked], Mapping[str, Table]]] = {
    "words": _words,
    "language": _language,
    "sounds": _sounds,
    "segmentation": _segmentation,
    "locate": _locate,
    "frames": _frames,
}


def _clips(asked: Asked) -> Path:
    if asked.sounds is None:
        raise BenchError("This suite measures on a folder of clips with an index.csv; name it with --sounds.")
    return asked.sounds


def _embedded_only(asked: Asked, suite: str) -> None:
    if asked.profile != "embedded":
        raise BenchError(f"The suite {suite} measures the embedded encoder; it has no figures for {asked.profile!r}.")


def markdown(tables: Mapping[str, Table]) -> str:
    """Write tables as Markdown."""
    blocks: list[str] = []
    for name, table in tables.items():
        lines = [_row(table["columns"]), _row(["---"] * len(table["columns"])), *[_row(row) for row in table["rows"]]]
        blocks.append(f"### {name}\n\n" + "\n".join(lines) + "\n")
    return "\n".join(blocks)


def as_csv(table: Table) -> str:
    """Write one table as CSV."""
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([table["columns"], *table["rows"]])
    return stream.getvalue()


def _row(cells: Sequence[object]) -> str:
    return "| " + " | ".join(str(cell).replace("|", "\\|") for cell in cells) + " |"


def draw(tables: Mapping[str, Table], path: Path) -> None:
    """Draw tables as a picture, to be pasted where Markdown is not shown."""
    from matplotlib.figure import Figure

    heights = [0.35 * (len(table["rows"]) + 1) + 0.6 for table in tables.values()]
    figure = Figure(figsize=(12, sum(heights)))
    panes = figure.subplots(len(tables), 1, height_ratios=heights, squeeze=False)[:, 0]
    for axes, (name, table) in zip(panes, tables.items(), strict=True):
        axes.axis("off")
        axes.set_title(name, loc="left", fontsize=11, fontweight="bold")
        if not table["rows"]:
            continue
        cells = [[str(cell) for cell in row] for row in table["rows"]]
        columns = [str(column) for column in table["columns"]]
        drawn = axes.table(cells, colLabels=columns, loc="upper left", cellLoc="left")
        drawn.auto_set_font_size(False)
        drawn.set_fontsize(9)
        drawn.auto_set_column_width(list(range(len(columns))))
        for (row, _), cell in drawn.get_celld().items():
            cell.set_edgecolor("#dddddd")
            if row == 0:
                cell.set_text_props(fontweight="bold")
    figure.savefig(path, dpi=110, bbox_inches="tight")
