"""What a device said of where sounds came from: azimuths with stamps, as microphone arrays with a chip publish them.

Azimuths are on the plan, from where the depth camera looks, counter-clockwise (to the left); a device that counts from
elsewhere has an offset, which a build finds along the walk (``avlmaps.maps.sources.bearings``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isnan
from pathlib import Path
from typing import Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.columns import concat, take
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import TABLE_BYTES, read_regular, write_bytes_atomically
from avlmaps.recordings.faults import readable

DIRECTIONS = "directions.csv"
COLUMNS = ("stamp_s", "azimuth_rad", "elevation_rad", "confidence")
_OUTSIDE_S = 1.0  # devices start a moment before the sound, and stop after it
_TURN_RAD = 2.0 * np.pi + 1e-3
_SHOWN = 30


@dataclass(frozen=True, slots=True, eq=False)
class DirectionTrack:
    """Directions on the recording's clock.

    Attributes:
        stamp_s: (n,) strictly rising seconds.
        azimuth_rad: (n,) from where the depth camera looks, counter-clockwise, but for the device's offset.
        elevation_rad: (n,) over the horizon; NaN where it is not known.
        confidence: (n,) how much each counts, 0 to 1.
        known_rad: the device's offset and the standard deviation of that, as an earlier recording has shown them.
    """

    stamp_s: Float[np.ndarray, " n"]
    azimuth_rad: Float[np.ndarray, " n"]
    elevation_rad: Float[np.ndarray, " n"]
    confidence: Float[np.ndarray, " n"]
    known_rad: tuple[float, float] | None = None

    @classmethod
    def of(cls, stamp_s: Any, azimuth_rad: Any, elevation_rad: Any = None, confidence: Any = None) -> "DirectionTrack":
        """Return a track; what is not given is not known, or counts wholly."""
        stamps = np.asarray(stamp_s, np.float64)
        unknown, whole = np.full(len(stamps), np.nan), np.ones(len(stamps))
        return cls(
            stamps, np.asarray(azimuth_rad, np.float64), unknown if elevation_rad is None else elevation_rad,
            whole if confidence is None else confidence,
        )  # fmt: skip

    def __post_init__(self) -> None:
        if fault := self._fault():
            raise RecordingError(f"The directions cannot be used: {fault}.")

    def __len__(self) -> int:
        return len(self.stamp_s)

    def _fault(self) -> str:
        """Return what is wrong, beginning in small letters, with the row from 1; or nothing."""
        stamp, azimuth, elevation, sure = self.stamp_s, self.azimuth_rad, self.elevation_rad, self.confidence
        degrees = "more than any angle in radians, so they look like degrees; multiply them by pi/180"
        checks = (
            *(
                (name, value, np.isfinite(value), "which is NaN or infinite; leave such rows out")
                for name, value in (("stamp", stamp), ("azimuth", azimuth), ("confidence", sure))
            ),
            ("stamp", stamp, np.diff(stamp, prepend=-np.inf) > 0.0, "not after the one before; stamps must rise"),
            ("azimuth", azimuth, np.abs(azimuth) <= _TURN_RAD, degrees),
            ("elevation", elevation, np.abs(np.nan_to_num(elevation)) <= np.pi / 2 + 1e-3, degrees),
            ("confidence", sure, (sure >= 0.0) & (sure <= 1.0), "and it must be from 0 to 1"),
        )
        for name, value, fine, what in checks:
            if not fine.all():
                row = int(np.argmin(fine))
                return f"the {name} of row {row + 1} is {value[row]:g}, {what}"
        return ""

    @classmethod
    def joined(cls, parts: "Sequence[DirectionTrack]") -> "DirectionTrack":
        """Return parts that follow one another as one track, with what the first knows of the device.

        Raises:
            RecordingError: their stamps do not rise.
        """
        return concat(parts, known_rad=parts[0].known_rad)

    def between(self, onset_s: float, offset_s: float) -> "DirectionTrack":
        """Return the part of a stretch of time."""
        rows = slice(*np.searchsorted(self.stamp_s, [onset_s, offset_s]).tolist())
        return take(replace(self, known_rad=None), rows)

    def require_beside(self, start_s: float, end_s: float, where: str) -> None:
        """Refuse directions of another clock than the sound's.

        Raises:
            RecordingError: more than half of the stamps lie outside of the sound.
        """
        inside = (self.stamp_s >= start_s - _OUTSIDE_S) & (self.stamp_s <= end_s + _OUTSIDE_S)
        if len(self) and inside.mean() < 0.5:
            raise RecordingError(
                f"{where}: {int((~inside).sum())} of {len(self)} stamps, from {self.stamp_s[0]:.2f} to "
                f"{self.stamp_s[-1]:.2f} s, lie outside of the sound ({start_s:.2f} to {end_s:.2f} s); give them in "
                "seconds of the recording's clock."
            )


def given_directions(stamp_s: Any, azimuth_rad: Any, elevation_rad: Any, confidence: Any) -> DirectionTrack:
    """Return the directions that a program gave, of one moment or of some; None where something is not known.

    Raises:
        RecordingError: they are no numbers, of different length, or no directions.
    """
    column: dict[str, np.ndarray] = {}
    for name, given in zip(COLUMNS, (stamp_s, azimuth_rad, elevation_rad, confidence), strict=True):
        if given is None and name in COLUMNS[2:]:
            continue
        try:
            array = np.atleast_1d(np.asarray(given))
            column[name] = array.astype(np.float64)
            fits = array.dtype.kind in "fiu" and array.ndim == 1 and column[name].shape == column["stamp_s"].shape
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise RecordingError(
                f"Directions are a number, or as many numbers as there are stamps, for each of {', '.join(COLUMNS)} "
                f"(the last two may be left out); {name} is {repr(given)[:_SHOWN]}."
            )
    return DirectionTrack.of(*map(column.get, COLUMNS))


def read_directions(path: Path) -> DirectionTrack:
    """Read ``directions.csv``: a line of column names, then numbers.

    Raises:
        RecordingError: it cannot be read, or a line is not as it should be; the sentence names the file and the row.
    """
    try:
        with readable(path):
            lines = read_regular(path, TABLE_BYTES).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise RecordingError(f"{path} is not UTF-8 text; save the file as UTF-8.") from None
    rows = [line.strip().split(",") for line in lines if line.strip() and not line.startswith("#")]
    names = [name.strip() for name in rows[0]] if rows else []
    if not {*COLUMNS[:2]} <= set(names) <= set(COLUMNS) or len(set(names)) < len(names):
        raise RecordingError(
            f"{path} begins with {','.join(names)[:_SHOWN]!r}; its first line names the columns: stamp_s,azimuth_rad, "
            "and perhaps elevation_rad and confidence."
        )
    values = np.full((len(rows) - 1, len(names)), np.nan)
    for number, words in enumerate(rows[1:]):
        try:
            if len(words) != len(names):  # NumPy would repeat a single number
                raise ValueError
            values[number] = [float(word) if word.strip() else np.nan for word in words]
        except ValueError:
            row = f"{path}, row {number + 1}: {','.join(words)[:_SHOWN]!r}"
            raise RecordingError(f"{row} is not {len(names)} numbers ({', '.join(names)}); fix it.") from None
    try:
        return DirectionTrack.of(*map(dict(zip(names, values.T, strict=True)).get, COLUMNS))
    except RecordingError as error:
        raise RecordingError(f"{path}: {str(error).partition(': ')[2]}") from None


def write_directions(path: Path, track: DirectionTrack) -> None:
    """Write a track as ``read_directions`` reads it; all or nothing."""
    told = (True, True, np.isfinite(track.elevation_rad).any(), (track.confidence != 1.0).any())
    names = [name for name, is_told in zip(COLUMNS, told, strict=True) if is_told]
    columns = [getattr(track, name).tolist() for name in names]
    rows = [",".join("" if isnan(value) else repr(value) for value in row) for row in zip(*columns, strict=True)]
    write_bytes_atomically(path, ("\n".join([",".join(names), *rows]) + "\n").encode())
