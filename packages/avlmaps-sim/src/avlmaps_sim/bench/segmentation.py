"""How well sounds are found in a track: recorded clips put into silence and into noise, and looked for.

The clips are those of ESC-10's folds 4 and 5 (the settings were chosen on folds 2 and 3 alone) and of other
collections, named in an ``index.csv``. Truth is the audible part of a clip, cut as ``add_sounds`` cuts it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from jaxtyping import Float32

from avlmaps.core.progress import progress
from avlmaps.maps.audio.segmentation import Segment, segment
from avlmaps.maps.settings import SegmentationSettings
from avlmaps.recordings.audio import AudioTrack, Sound, write_flac
from avlmaps_sim.bench.harness.figures import in_percent, poisson, wilson
from avlmaps_sim.mixing.background import background
from avlmaps_sim.mixing.clips import Clip, amplify, audible_part, find_clips, gain_for, index_rows

COLUMNS = (
    "clips", "background", "SNR dB", "sounds", "found %", "95 %", "false alarms a minute", "95 %", "pieces a sound",
    "onset error ms: median", "95th percentile", "offset error ms: median", "95th percentile", "both within 100 ms %",
    "minutes",
)  # fmt: skip
_RATE_HZ = 44_100
_LOUDNESS_DB = -40.0  # so low that no clip has a peak that would have to be cut
_PAUSES_S = (1.5, 5.0)
_CLIPS_A_TRACK = 20
_TEST_FOLDS = ("4", "5")
_CONDITIONS: tuple[tuple[str, float | None], ...] = (
    ("none", None),
    *((kind, snr_db) for snr_db in (20.0, 10.0, 5.0) for kind in ("white", "pink", "room")),
)


@dataclass(slots=True)
class Tally:
    """The sounds that were found and missed, over many tracks.

    A found sound has a segment of its own; ``pieces`` overlap a sound, false alarms none. Onsets and offsets are by how
    much later than true ones they were said to be, of found sounds.
    """

    sounds: int = 0
    found: int = 0
    pieces: int = 0
    false_alarms: int = 0
    seconds: float = 0.0
    onset_s: list[float] = field(default_factory=list)
    offset_s: list[float] = field(default_factory=list)

    def add(self, truth: Sequence[Segment], said: Sequence[Segment], seconds: float) -> None:
        """Compare one track's segments with its truth; a segment over several sounds finds only one of them."""
        self.sounds += len(truth)
        self.seconds += seconds
        used: set[int] = set()
        for sound in truth:
            over = [i for i, s in enumerate(said) if s.onset_s < sound.offset_s and s.offset_s > sound.onset_s]
            if over and over[0] not in used:
                self.found += 1
                self.pieces += len(over)
                self.onset_s.append(said[over[0]].onset_s - sound.onset_s)
                self.offset_s.append(said[over[-1]].offset_s - sound.offset_s)
            used.update(over)
        self.false_alarms += len(said) - len(used)

    def row(self, clips: str, kind: str, snr_db: float | None) -> list[Any]:
        """Return the row of the table."""
        minutes = self.seconds / 60.0
        errors_ms = 1000.0 * np.abs([self.onset_s, self.offset_s])
        near = int((errors_ms <= 100.0).all(axis=0).sum())
        percentiles = [round(float(p), 1) for e in errors_ms for p in (np.percentile(e, (50, 95)) if e.size else ())]
        return [
            clips,
            kind,
            "clean" if snr_db is None else snr_db,
            self.sounds,
            round(100.0 * self.found / max(self.sounds, 1), 1),
            in_percent(wilson(self.found, self.sounds)),
            round(self.false_alarms / minutes, 2),
            "{:.2f} to {:.2f}".format(*(bound / minutes for bound in poisson(self.false_alarms))),
            round(self.pieces / max(self.found, 1), 2),
            *(percentiles or [0.0] * 4),
            round(100.0 * near / max(self.found, 1), 1),
            round(minutes, 1),
        ]


def run(sounds_folder: Path, seed: int = 0, settings: SegmentationSettings | None = None) -> dict[str, Any]:
    """Measure the segmentation of the clips of an ``index.csv`` (path, category and, for ESC-10, fold).

    Returns:
        ``columns`` and ``rows``, one row for each set of clips, background and signal-to-noise ratio. Intervals are
        Wilson's for shares and exact Poisson ones for rates.
    """
    rows: list[list[Any]] = []
    for name, clips in clips_to_test(sounds_folder).items():
        for kind, snr_db in progress(_CONDITIONS, f"finding {name}", unit="track"):
            tally = measure(clips, kind, snr_db, np.random.default_rng(seed), settings or SegmentationSettings())
            rows.append(tally.row(name, kind, snr_db))
    return {"columns": list(COLUMNS), "rows": rows}


def clips_to_test(sounds_folder: Path) -> dict[str, list[Clip]]:
    """Return the clips to test with: those of the folds, and those of no fold."""
    fold_of = {row["path"]: row.get("fold", "") for row in index_rows(sounds_folder) or ()}
    clips = find_clips(sounds_folder)
    sets = {
        f"folds {' and '.join(_TEST_FOLDS)}": [clip for clip in clips if fold_of.get(clip.name) in _TEST_FOLDS],
        "other": [clip for clip in clips if not fold_of.get(clip.name)],
    }
    return {name: chosen for name, chosen in sets.items() if chosen}


def measure(
    clips: Sequence[Clip], kind: str, snr_db: float | None, rng: np.random.Generator, settings: SegmentationSettings
) -> Tally:
    """Put every clip into a track once, segment the tracks, and count."""
    tally = Tally()
    order = rng.permutation(len(clips))
    with TemporaryDirectory() as scratch:
        for begin in range(0, len(order), _CLIPS_A_TRACK):
            sounds = [_prepared(clips[i]) for i in order[begin : begin + _CLIPS_A_TRACK]]
            samples, truth = _track(sounds, rng)
            if snr_db is not None:
                samples += _noise(kind, _LOUDNESS_DB - snr_db, len(samples), rng)
            path = Path(scratch) / "track.flac"
            write_flac(path, Sound(samples, _RATE_HZ))
            track = AudioTrack.open(path)
            tally.add(truth, segment(track, settings), track.duration_s)
    return tally


def _prepared(clip: Clip) -> Sound:
    sound = audible_part(clip, _RATE_HZ)
    return amplify(sound, gain_for(sound, _LOUDNESS_DB))


def _track(sounds: Sequence[Sound], rng: np.random.Generator) -> tuple[Float32[np.ndarray, " n"], list[Segment]]:
    pieces: list[np.ndarray] = []
    truth: list[Segment] = []
    at = 0
    for sound in sounds:
        pause = round(rng.uniform(*_PAUSES_S) * _RATE_HZ)
        pieces += [np.zeros(pause, np.float32), sound.samples]
        truth.append(Segment((at + pause) / _RATE_HZ, (at + pause + len(sound.samples)) / _RATE_HZ))
        at += pause + len(sound.samples)
    pieces.append(np.zeros(round(_PAUSES_S[1] * _RATE_HZ), np.float32))
    return np.concatenate(pieces), truth


def _noise(kind: str, level_db: float, count: int, rng: np.random.Generator) -> Float32[np.ndarray, " n"]:
    seconds: Iterator[np.ndarray] = background(kind, level_db, _RATE_HZ, rng)
    return np.concatenate(list(islice(seconds, -(-count // _RATE_HZ))))[:count]
