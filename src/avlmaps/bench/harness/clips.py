"""The clips of a folder that the shipped sound encoder was not trained on.

An ``index.csv`` has a column ``fold``. The shipped weights were trained on every clip with a fold, and on no other
(``training/sounds``): a clip without one is unheard.
"""

import csv
import io
from hashlib import sha256
from pathlib import Path

from avlmaps.core.errors import AudioError
from avlmaps.core.files import write_bytes_atomically

INDEX = "index.csv"


def unheard_rows(folder: Path) -> list[dict[str, str]]:
    """Return the rows of ``index.csv`` without a fold.

    Raises:
        AudioError: there is no index, or no such row.
    """
    index = folder / INDEX
    if not index.is_file():
        raise AudioError(
            f"There is no {index}, so it is not known which clips the sound encoder was trained on; add an index.csv "
            "with the columns path, category and fold (empty for a clip of no training), or choose --sound-clips all."
        )
    with index.open(newline="", encoding="utf-8-sig") as stream:
        rows = [row for row in csv.DictReader(stream) if row.get("path") and not row.get("fold")]
    if not rows:
        raise AudioError(f"{index} names no clip without a fold; those with a fold trained the sound encoder.")
    return rows


def unheard_folder(folder: Path, work: Path) -> Path:
    """Return a folder whose index lists the unheard clips of another one, which stay where they are.

    Args:
        folder: of clips, with an ``index.csv``.
        work: where the new folder is written.

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
