"""`avlmaps calibrate`: refine an array's geometry in place."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import OmitArgPrefixes, Positional, arg

from avlmaps.cli.output import emit, table_lines
from avlmaps.cli.verb import Reading, Verb
from avlmaps.core.wording import place_text


@dataclass(frozen=True, kw_only=True)
class Calibrate(Verb):
    """Refine where the microphones of a robot are and how late each channel is, from a drive past one still source.

    Let something tick or click at one place, and drive past it in curves, 1 to 3 m away, for half a minute. The
    geometry that is given must be right within a few centimetres. The recording stays as it is.

    Example: avlmaps calibrate REC --out array.json && avlmaps build REC --microphones array.json --out home.avlmap
    """

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording with an array, or with several channels and --microphones."""
    out: Annotated[Path, arg(metavar="FILE")]
    """File to write: the refined microphones, as --microphones and `microphones` of recording.json take them."""
    microphones: Annotated[Path | None, arg(metavar="FILE")] = None
    """Geometry to begin with, instead of the recording's own."""
    between: Annotated[tuple[float, float] | None, arg(metavar="BEGIN END")] = None
    """Time when the one source sounds, seconds of the recording. Default: all of it."""
    overwrite: bool = False
    """Replace --out where it is there already."""
    format: Annotated[str, arg(metavar="FORMAT")] = "auto"
    """Format of the recording, if its files do not show it."""
    reading: Annotated[Reading, OmitArgPrefixes] = field(default_factory=Reading)
    """What you know better than the recording's files."""

    def run(self) -> None:
        """Calibrate."""
        answer = calibrate_array(self)
        rows = [
            (str(number + 1), place_text(one["position_m"]), f"{100 * one['moved_m']:.1f} cm",
             f"{100 * one['sd_m']:.2f} cm", f"{1e6 * one['delay_s']:.0f} µs")
            for number, one in enumerate(answer["microphones"])
        ]  # fmt: skip
        heights = " Heights stay as given: this drive does not show them." if answer["held_heights"] else ""
        lines = [
            *table_lines(("channel", "place (robot's frame)", "moved", "known to", "late by"), rows),
            f"source at {place_text(answer['source'])} ({answer['frame']} frame), {answer['measured_frames']} frames",
            f"residual: {1e6 * answer['residual_before_s']:.0f} µs before, {1e6 * answer['residual_after_s']:.0f} µs "
            f"after.{heights}",
            *(f"channel {number} is wired the other way round; this is taken back" for number in answer["turned"]),
            f"wrote {answer['out']}",
        ]
        emit(answer, lines, self.json)


def calibrate_array(verb: "Calibrate") -> dict[str, Any]:
    """Refine an array, write it, and describe it.

    Raises:
        RecordingError: the file is there already, or the array cannot be refined.
    """
    from avlmaps.core.errors import RecordingError
    from avlmaps.core.poses import FRAME
    from avlmaps.core.wording import option
    from avlmaps.maps.sources.calibrate import calibrate
    from avlmaps.recordings.microphones import write_microphones
    from avlmaps.recordings.open import open_recording

    if verb.out.exists() and not verb.overwrite:
        raise RecordingError(
            f"{verb.out} is there already; give another {option('out')}, or replace it with {option('overwrite')}."
        )
    recording = open_recording(
        verb.recording, format=verb.format, microphones=verb.microphones, corrections=verb.reading.corrections()
    )
    if recording.audio is None:
        raise RecordingError(f"{verb.recording} has no sound track, so that there is no array to calibrate.")
    found = calibrate(recording.audio, recording.walk, verb.between)
    write_microphones(verb.out, found.microphones)
    array = found.microphones
    late_s = [0.0] * len(array) if array.delay_s is None else array.delay_s.tolist()
    return {
        "recording": str(verb.recording),
        "out": str(verb.out),
        "microphones": [
            {"position_m": at, "moved_m": moved, "sd_m": sd, "delay_s": late, "delay_sd_s": late_sd}
            for at, moved, sd, late, late_sd in zip(
                array.position_m.tolist(), found.moved_m.tolist(), found.place_sd_m.tolist(), late_s,
                found.delay_sd_s.tolist(), strict=True,
            )
        ],
        "held_heights": found.held_heights,
        "turned": [channel + 1 for channel in found.turned],
        "frame": FRAME,
        "source": found.source_m.tolist(),
        "measured_frames": found.frames,
        "residual_before_s": found.before_s,
        "residual_after_s": found.after_s,
    }  # fmt: skip
