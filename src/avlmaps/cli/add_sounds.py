"""`avlmaps add-sounds`: put recorded sounds into a track."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from avlmaps.cli.output import emit, place, table_lines
from avlmaps.cli.verb import Verb

if TYPE_CHECKING:
    pass


@dataclass(frozen=True, kw_only=True)
class AddSounds(Verb):
    """Put recorded sounds into the track of a recording; events.csv tells where and when.

    Without options: as many sounds as the walk has room for, no two of them heard within 2 m of one another, as
    the paper did. In a place too small for three sounds by that rule the 2 m are counted along the walk, and where
    whole clips leave room for fewer than four, they are cut short (to 2 s at least); notes on standard error tell.
    The same seed gives the same track. Example:

    avlmaps add-sounds REC --clips sounds/ --category "dog bark" sneezing --out REC2
    """

    recording: Positional[Path]
    """A recording in any format that `avlmaps build` reads."""
    clips: Path
    """Folder of sound files: one subfolder a category, or an index.csv with the columns path and category."""
    out: Path
    """Where the new recording goes (our folder format)."""
    category: tuple[str, ...] = ()
    """Only clips of these categories. Default: all of them."""
    seed: int = 0
    """Which clips go where."""
    interval_s: Annotated[float, arg(name="interval", metavar="S")] = 2.0
    """Least silence between two sounds, seconds."""
    min_distance_m: float = 2.0
    """Least distance between the places where two sounds are heard, metres; 0 allows any."""
    loudness_db: float = -20.0
    """Loudness of each sound, dB relative to full scale (less for a clip whose peaks would be cut off)."""
    background: str | None = None
    """Background noise: white, pink, room, or a sound file."""
    snr_db: float | None = None
    """How much louder every sound is than the background, dB (20 if there is a background; white noise if only this
    is given)."""
    format: str = "auto"
    """Format of the recording."""

    def run(self) -> None:
        """Write the new recording."""
        from avlmaps.recordings.add_sounds import add_sounds
        from avlmaps.recordings.open import open_recording

        events = add_sounds(
            open_recording(self.recording, format=self.format),
            self.clips,
            self.out,
            categories=self.category or None,
            seed=self.seed,
            interval_s=self.interval_s,
            min_distance_m=self.min_distance_m,
            loudness_db=self.loudness_db,
            background=self.background,
            snr_db=self.snr_db,
        )
        rows = [(f"{e.onset_s:.2f}", f"{e.offset_s:.2f}", e.category, place(e.position)) for e in events]
        answer = {"recording": str(self.out), "sounds": len(events), "events": [e.to_json() for e in events]}
        emit(
            answer,
            [*table_lines(("onset_s", "offset_s", "category", "heard at"), rows), f"wrote {self.out}"],
            self.json,
        )
