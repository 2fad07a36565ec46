"""Reading the small text files of recordings: numbers in lines, poses, lists; every fault with its line."""

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from avlmaps.core.errors import RecordingError
from avlmaps.core.files import DESCRIPTION_BYTES, TABLE_BYTES, open_regular, read_regular
from avlmaps.recordings.faults import Fault, Report, readable
from avlmaps.recordings.formats.columns import is_header_in_comment, named_order, split_header

# A line holds 16 numbers or a name; without a limit a file of zeros would be one line of gigabytes.
_LINE_BYTES = 1 << 14
_QUOTED = 100


@dataclass(frozen=True, slots=True)
class Table:
    """Numbers of a text file.

    Attributes:
        values: one row a line.
        lines: each row's line in the file, from 1.
    """

    values: Float[np.ndarray, "n c"]
    lines: Int[np.ndarray, " n"]


def text_lines(path: Path, report: Report) -> Iterator[tuple[int, str]]:
    """Yield (number, text) of each line that is neither empty nor a comment (``#``).

    Lines that are not UTF-8 are reported and passed over.
    """
    return ((number, text) for number, text in _lines(path, report) if not text.startswith("#"))


def _lines(path: Path, report: Report) -> Iterator[tuple[int, str]]:
    try:
        stream = open_regular(path, TABLE_BYTES)
    except FileNotFoundError:
        report(Fault(f"{path} is missing; the recording needs it.", path))
        return
    except OSError as error:
        report(Fault(f"{path} cannot be read ({error.strerror or error}); check the file.", path))
        return
    with stream:
        for number, raw in enumerate(iter(lambda: stream.readline(_LINE_BYTES), b""), start=1):
            if len(raw) >= _LINE_BYTES:
                report(Fault(f"{path}, line {number}: it has {_LINE_BYTES} bytes or more; fix it.", path, number))
                return
            try:
                text = raw.decode("utf-8-sig" if number == 1 else "utf-8").strip()
            except UnicodeDecodeError:
                report(Fault(f"{path}, line {number}: this is not UTF-8 text; save the file as UTF-8.", path, number))
                continue
            if text:
                yield number, text


def read_table(
    path: Path, columns: tuple[int, ...], report: Report, header: bool = False, names: Sequence[str] = ()
) -> Table:
    """Read lines of numbers, split at commas, semicolons (with decimal commas, too) or white space.

    Args:
        path: the file.
        columns: how many numbers a line may have; the first line decides which of them.
        report: called with every line that is not as it should be.
        header: whether the first line may name the columns instead.
        names: the columns that are wanted. Where the first line, or the comment above it, names columns, they are
            returned in this order and in seconds and metres; a name that is not known is a fault.
    """
    values, lines, width = array("d"), array("q"), 0
    heading: tuple[int, str] | None = None
    first = True
    for number, text in _lines(path, report):
        if text.startswith("#"):
            if names and first and is_header_in_comment(split_header(text), names):
                heading = number, text
            continue
        fields = _fields(text)
        try:
            row = [_number(field) for field in fields]
        except ValueError:
            if (header or names) and first and not _any_number(fields):
                heading, first = (number, text) if names else None, False
                continue
            first = False
            report(Fault(f"{path}, line {number}: {text[:40]!r} is not all numbers; fix the line.", path, number))
            continue
        first = False
        if len(row) not in columns or (width and len(row) != width):
            wanted = width or " or ".join(map(str, columns))
            sentence = f"{path}, line {number}: there are {len(row)} numbers where {wanted} belong; fix the line."
            report(Fault(sentence, path, number))
            continue
        width = len(row)
        values.extend(row)
        lines.append(number)
    table = np.frombuffer(values, np.float64) if len(values) else np.zeros(0)
    table = table.reshape(-1, width or columns[0])
    return Table(_in_order(path, heading, table, names, report), np.array(lines, np.int64))


def _in_order(
    path: Path, heading: tuple[int, str] | None, table: Float[np.ndarray, "n c"], names: Sequence[str], report: Report
) -> Float[np.ndarray, "n c"]:
    """Return a table's columns as its heading names them."""
    if heading is None or (len(table) and table.shape[1] != len(names)):
        return table
    number, text = heading
    try:
        return named_order(split_header(text), names).applied(table)
    except ValueError as error:
        sentence = f"{path}, line {number}: {error}; write the header as {','.join(names)}, or leave it out."
        report(Fault(sentence, path, number))
        return table


def _fields(text: str) -> list[str]:
    if ";" not in text:
        return text.replace(",", " ").split()
    # Where semicolons part the numbers, a comma is the decimal point of many languages.
    text = text.replace(",", " ") if "." in text else text.replace(",", ".")
    return text.replace(";", " ").split()


def _number(field: str) -> float:
    """Parse a number; what Windows printed for NaN and infinity (``-1.#IND``) is NaN."""
    return float("nan") if ".#" in field else float(field)


def _any_number(fields: list[str]) -> bool:
    for field in fields:
        try:
            _number(field)
        except ValueError:
            continue
        return True
    return False


def read_matrix(path: Path, rows: int, columns: int) -> Float[np.ndarray, "rows columns"]:
    """Read one matrix written row by row; line breaks may stand anywhere.

    Raises:
        RecordingError: the file is missing, is not text, or holds another count of numbers.
    """
    with readable(path, "the recording needs it"):
        content = read_regular(path, DESCRIPTION_BYTES)
    try:
        fields = content.decode("utf-8-sig").replace(",", " ").split()
        numbers = [_number(field) for field in fields]
    except UnicodeDecodeError:
        raise RecordingError(f"{path} is not UTF-8 text; save the file as UTF-8.") from None
    except ValueError as error:
        reason = str(error) if len(str(error)) < _QUOTED else f"{str(error)[:_QUOTED]}..."
        raise RecordingError(f"{path} does not hold numbers only ({reason}); fix the file.") from None
    if len(numbers) != rows * columns:
        raise RecordingError(f"{path} holds {len(numbers)} numbers where {rows}x{columns} belong; fix the file.")
    return np.array(numbers).reshape(rows, columns)


def read_pose_files(files: Sequence[Path], report: Report) -> Float[np.ndarray, "n 4 4"]:
    """Read one 4x4 pose from each file; a damaged file is reported, and its pose is NaN."""
    poses = np.full((len(files), 4, 4), np.nan)
    for i, file in enumerate(files):
        try:
            poses[i] = read_matrix(file, 4, 4)
        except RecordingError as error:
            report(Fault(str(error), file))
    return poses
