"""What a device said of where sounds came from: azimuths with stamps, as microphone arrays with a chip publish them.

Azimuths are on the plan, from where the depth camera looks, counter-clockwise (to the left); a device that counts from
elsewhere has an offset, which a build finds along the walk (``avlmaps.maps.sources.bearings``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
    def of(
        cls,
        stamp_s: Sequence[float] | Float[np.ndarray, " n"],
        azimuth_rad: Sequence[float] | Float[np.ndarray, " n"],
        elevation_rad: Float[np.ndarray, " n"] | None = None,
        confidence: Float[np.ndarray, " n"] | None = None,
    ) -> "DirectionTrack":
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
        for name, value in (("stamp", self.stamp_s), ("azimuth", self.azimuth_rad), ("confidence", self.confidence)):
            bad = np.flatnonzero(~np.isfinite(value))
            if len(bad):
                return f"the {name} of row {bad[0] + 1} is NaN or infinite; leave such rows out"
        back = np.flatnonzero(np.diff(self.stamp_s) <= 0.0)
        if len(back):
            before, after = self.stamp_s[back[0]], self.stamp_s[back[0] + 1]
            return f"row {back[0] + 2} has the stamp {after:g} s after {before:g} s; stamps must rise"
        for name, value, most in (
            ("azimuth", self.azimuth_rad, _TURN_RAD),
            ("elevation", np.nan_to_num(self.elevation_rad), np.pi / 2 + 1e-3),
        ):
            far = np.flatnonzero(np.abs(value) > most)
            if len(far):
                return (
                    f"the {name} of row {far[0] + 1} is {value[far[0]]:g}, more than any angle in radians, so they "
                    "look like degrees; multiply them by pi/180"
                )
        unsure = np.flatnonzero((self.confidence < 0.0) | (self.confidence > 1.0))
        if len(unsure):
            return f"the confidence of row {unsure[0] + 1} is {self.confidence[unsure[0]]:g}; it must be from 0 to 1"
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
    names = ("stamp_s", "azimuth_rad", "elevation_rad", "confidence")
    column: dict[str, np.ndarray] = {}
    for name, given in zip(names, (stamp_s, azimuth_rad, elevation_rad, confidence), strict=True):
        if given is None and name in names[2:]:
            continue
        try:
            array = np.atleast_1d(np.asarray(given))
            column[name] = array.astype(np.float64)
            fits = array.dtype.kind in "fiu" and array.ndim == 1 and column[name].shape == column["stamp_s"].shape
        except (TypeError, ValueError):
            fits = False
        if not fits:
            raise RecordingError(
                f"Directions are a number, or as many numbers as there are stamps, for each of {', '.join(names)} "
                f"(the last two may be left out); {name} is {repr(given)[:_SHOWN]}."
            )
    return DirectionTrack.of(
        column["stamp_s"], column["azimuth_rad"], column.get("elevation_rad"), column.get("confidence")
    )


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
    rows = [line.strip() for line in lines if line.strip() and not line.startswith("#")]
    names = [name.strip() for name in rows[0].split(",")] if rows else []
    unknown = [name for name in names if name not in COLUMNS]
    if unknown or len(set(names)) < len(names) or not {"stamp_s", "azimuth_rad"} <= set(names):
        raise RecordingError(
            f"{path} begins with {','.join(names)[:_SHOWN]!r}; its first line names the columns: stamp_s,azimuth_rad, "
            "and perhaps elevation_rad and confidence."
        )
    values = np.full((len(rows) - 1, len(names)), np.nan)
    for number, row in enumerate(rows[1:]):
        words = row.split(",")
        try:
            if len(words) != len(names):  # NumPy would repeat a single number
                raise ValueError
            values[number] = [float(word) if word.strip() else np.nan for word in words]
        except ValueError:
            raise RecordingError(
                f"{path}, row {number + 1}: {row[:_SHOWN]!r} is not {len(names)} numbers ({', '.join(names)}); fix it."
            ) from None
    column = dict(zip(names, values.T, strict=True))
    try:
        return DirectionTrack.of(
            column["stamp_s"], column["azimuth_rad"], column.get("elevation_rad"), column.get("confidence")
        )
    except RecordingError as error:
        raise RecordingError(f"{path}: {str(error).partition(': ')[2]}") from None


def write_directions(path: Path, track: DirectionTrack) -> None:
    """Write a track as ``read_directions`` reads it; all or nothing."""
    columns = [track.stamp_s, track.azimuth_rad]
    names: list[str] = ["stamp_s", "azimuth_rad"]
    if np.isfinite(track.elevation_rad).any():
        columns.append(track.elevation_rad)
        names.append("elevation_rad")
    if (track.confidence != 1.0).any():
        columns.append(track.confidence)
        names.append("confidence")
    rows = [
        ",".join("" if np.isnan(value) else repr(float(value)) for value in row) for row in zip(*columns, strict=True)
    ]
    write_bytes_atomically(path, ("\n".join([",".join(names), *rows]) + "\n").encode())
