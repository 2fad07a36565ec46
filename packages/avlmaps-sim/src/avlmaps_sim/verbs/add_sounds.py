"""`avlmaps add-sounds`: put recorded sounds into a track."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from tyro.conf import OmitArgPrefixes, Positional, arg

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verb import Reading, Verb
from avlmaps.core.wording import place_text


@dataclass(frozen=True, kw_only=True)
class AddSounds(Verb):
    """Put recorded sounds into the track of a recording; events.csv lists where and when.

    By default the track gets as many sounds as fit, no two of them within 2 m of one another, as in the paper. If a
    place is too small for three sounds by that rule, the 2 m count along the walk. If whole clips leave room for fewer
    than four sounds, they are cut short, to 2 s at least. Notes on standard error report both. The same seed gives the
    same track.

    Example: avlmaps add-sounds REC --clips sounds/ --category "dog bark" sneezing --out REC2
    """

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording in any format that `avlmaps build` reads."""
    clips: Annotated[Path, arg(metavar="DIR")]
    """Folder of sound files: one subfolder a category, or an index.csv with the columns path and category."""
    out: Annotated[Path, arg(metavar="REC")]
    """Recording folder to write (our format)."""
    category: Annotated[tuple[str, ...], arg(metavar="NAME ...")] = ()
    """Use clips of these categories only. Default: all."""
    seed: Annotated[int, arg(metavar="N")] = 0
    """Seed of the choice of clips and places."""
    interval_s: Annotated[float, arg(name="interval", metavar="SECONDS")] = 2.0
    """Least silence between two sounds, seconds."""
    min_distance_m: Annotated[float, arg(metavar="METRES")] = 2.0
    """Least distance between the places where two sounds play, metres; 0 allows any."""
    loudness_db: Annotated[float, arg(metavar="DB")] = -20.0
    """Loudness of each sound, dB relative to full scale (less for a clip whose peaks would be cut off)."""
    background: Annotated[str | None, arg(metavar="NOISE")] = None
    """Background noise: white, pink, room, or a sound file."""
    snr_db: Annotated[float | None, arg(metavar="DB")] = None
    """Signal-to-noise ratio of each sound, dB. Default: 20 with --background. Alone it adds white noise."""
    format: Annotated[str, arg(metavar="FORMAT")] = "auto"
    """Format of the recording."""
    reading: Annotated[Reading, OmitArgPrefixes] = field(default_factory=Reading)
    """What you know better than the recording's files."""

    def run(self) -> None:
        """Write the new recording."""
        from avlmaps.recordings.open import open_recording
        from avlmaps_sim.mixing.add_sounds import add_sounds

        events = add_sounds(
            open_recording(self.recording, format=self.format, corrections=self.reading.corrections()),
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
        rows = [(f"{e.onset_s:.2f}", f"{e.offset_s:.2f}", e.category, place_text(e.position)) for e in events]
        answer = {"recording": str(self.out), "sounds": len(events), "events": [e.to_json() for e in events]}
        emit(
            answer,
            [*table_lines(("onset_s", "offset_s", "category", "robot at"), rows), f"wrote {self.out}"],
            self.json,
        )
