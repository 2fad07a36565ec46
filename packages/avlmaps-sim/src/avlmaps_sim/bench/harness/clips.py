"""The clips of a folder that the shipped sound encoder was not trained on.

A clip of an ``index.csv`` is unheard where it has no ``fold`` (every clip with one may have trained the weights) and
where it was cut from none of the recordings that the weights' notes name: freesound's numbers, ``sources``, which the
clips of ESC-50 carry in their file names.
"""

import csv
import io
import json
import re
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

from avlmaps.core.errors import AudioError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.wording import option

INDEX = "index.csv"
_SOURCE = re.compile(r"\d-(\d+)-[A-Z]")


@cache
def trained_sources() -> frozenset[int]:
    """Return freesound's numbers of the recordings that trained the shipped weights, where their notes name them."""
    notes = files("avlmaps.perception.embedded") / "weights" / "sounds.json"
    return frozenset(json.loads(notes.read_text(encoding="utf-8")).get("sources", ()))


def unheard_rows(folder: Path) -> list[dict[str, str]]:
    """Return the rows of ``index.csv`` that the shipped weights were not trained on.

    Raises:
        AudioError: there is no index, or no such row.
    """
    index = folder / INDEX
    if not index.is_file():
        raise AudioError(
            f"There is no {index}, so it is not known which clips the sound encoder was trained on; add an index.csv "
            "with the columns path, category and fold (empty for a clip of no training), or choose "
            f"{option('sound-clips', 'all')}."
        )
    with index.open(newline="", encoding="utf-8-sig") as stream:
        rows = [row for row in csv.DictReader(stream) if row.get("path") and not _trained(row)]
    if not rows:
        raise AudioError(f"{index} names no clip that the sound encoder was not trained on; add some without a fold.")
    return rows


def _trained(row: dict[str, str]) -> bool:
    source = _SOURCE.search(Path(row["path"]).name)
    return bool(row.get("fold")) or (source is not None and int(source[1]) in trained_sources())


def unheard_folder(folder: Path, work: Path) -> Path:
    """Return a folder whose index lists the unheard clips of another one, which stay where they are.

    Raises:
        AudioError: see ``unheard_rows``.
    """
    rows = unheard_rows(folder)
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("path", "category"))
    table.writerows((str((folder / row["path"]).resolve()), row["category"]) for row in rows)
    content = text.getvalue().encode()
    made = work / f"clips-{sha256(content).hexdigest()[:12]}"
    made.mkdir(parents=True, exist_ok=True)
    write_bytes_atomically(made / INDEX, content)
    return made
