"""The clips of a folder that the shipped sound encoder was not trained on.

A clip of a folder's index is unheard where it has no ``fold`` (every clip with one may have trained the weights) and
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
from avlmaps_sim.mixing.clips import INDEX, index_rows

_SOURCE = re.compile(r"\d-(\d+)-[A-Z]")


@cache
def trained_sources() -> frozenset[int]:
    """Return freesound's numbers of the recordings that trained the shipped weights, where their notes name them."""
    notes = files("avlmaps.perception.embedded") / "weights" / "sounds.json"
    return frozenset(json.loads(notes.read_text(encoding="utf-8")).get("sources", ()))


def unheard_rows(folder: Path) -> list[dict[str, str]]:
    """Return the rows of a folder's index that the shipped weights were not trained on.

    Raises:
        AudioError: there is no index, or no such row.
    """
    rows = index_rows(folder)
    if rows is None:
        raise AudioError(
            f"{folder} has no {INDEX} and is not ESC-50, so it is not known which clips the sound encoder was trained "
            f"on; add an {INDEX} with the columns path, category and fold (empty for a clip of no training), or choose "
            f"{option('sound-clips', 'all')}."
        )
    unheard = [row for row in rows if not _trained(row)]
    if not unheard:
        raise AudioError(
            f"The sound encoder was trained on all {len(rows)} clips that the index of {folder} names; add some "
            "without a fold."
        )
    return unheard


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
