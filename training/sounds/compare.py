"""Editions of the sound encoder on clips of one fold that none of them learnt from, in one run.

``python -m training.sounds.compare --weights OLD NEW`` compares weights that were fitted without the fold. The clips
are those of household kinds; editions before the fifth heard some of ESC-10.
"""

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy.signal import oaconvolve
from scipy.stats import binomtest
from training.sounds.clips import ROOM_S, TESTED, Clip, read_index
from training.sounds.in_maps import ROOT, as_a_map_cuts, write_json
from training.sounds.kinds import CALLED, ESC10, RECORDED

from avlmaps.core.progress import say
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps_sim.bench.sound_clips import room_response

FIRST, OWN, OTHER = f"first among {len(RECORDED)}", "own name says yes", "some other name says yes"


def clips_for(clips: Sequence[Clip], fold: int, encoders: Sequence[EmbeddedSounds]) -> list[Clip]:
    """Return the household clips of a fold cut from recordings that none of the encoders learnt from."""
    heard = frozenset[int]().union(*(encoder.sources for encoder in encoders))
    household = range(len(ESC10), len(RECORDED))
    return [clip for clip in clips if clip.fold == fold and clip.kind in household and clip.source not in heard]


def measured(encoder: EmbeddedSounds, sounds: Sequence[Sound], kinds: np.ndarray) -> dict[str, Any]:
    """Return what an encoder makes of sounds, queried by the names of all recorded kinds.

    Args:
        encoder: one edition.
        sounds: clips.
        kinds: index of each one's kind among the recorded ones.
    """
    start = process_time()
    features = [encoder.encode(sound) for sound in sounds]
    took_s = process_time() - start
    scores = encoder.score_words(features, CALLED)
    fifty = scores[:, : len(RECORDED)]
    yes, own = fifty >= 0.5, kinds[:, None] == np.arange(len(RECORDED))
    each = {FIRST: fifty.argmax(axis=1) == kinds, OWN: yes[own], OTHER: (yes & ~own).any(axis=1)}
    highest_other = np.where(own, -1.0, fifty).max(axis=1)
    likely = np.clip(np.where(own, fifty, 1.0 - fifty), 1e-6, None)
    limits = np.quantile(highest_other, (0.9, 0.8, 0.7))  # from which some other name says yes for 10, 20, 30 %
    return {
        "clips": len(sounds),
        **{what: int(right.sum()) for what, right in each.items()},
        f"first among {len(CALLED)}": int((scores.argmax(axis=1) == kinds).sum()),
        "own name, where another says yes for 10, 20, 30 %": [round(float((fifty[own] > x).mean()), 3) for x in limits],
        f"log loss of {len(RECORDED)} questions": round(float(-np.log(likely).sum(axis=1).mean()), 2),
        "said and true": [
            [int(within.sum()), round(float(fifty[within].mean()), 3), round(float(own[within].mean()), 3)]
            for within in ((fifty >= low) & (fifty < low + 0.2) for low in (0.0, 0.2, 0.4, 0.6, 0.8))
            if within.any()
        ],
        "each": {what: right.tolist() for what, right in each.items()},
        "ms of one core a second of sound": round(1e3 * took_s / sum(sound.duration_s for sound in sounds), 2),
    }


def paired(first: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, str]:
    """Return how many clips each edition alone has right (or says yes to), with McNemar's exact p."""
    told = {}
    for what, before in first["each"].items():
        old, after = np.array(before), np.array(new["each"][what])
        won, lost = int((after & ~old).sum()), int((old & ~after).sum())
        told[what] = f"+{won} -{lost}, p = {binomtest(won, max(won + lost, 1)).pvalue:.2g}"
    return told


def main() -> None:
    """Print the figures of every edition, dry and in a room, and write them to a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=ROOT.parent / "shared" / "data" / "sounds")
    parser.add_argument("--fold", type=int, default=TESTED)
    parser.add_argument("--weights", type=Path, nargs="+", required=True, help="the others are held against the first")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "sounds" / "compared.json")
    arguments = parser.parse_args()
    nobody = ROOT / "build" / "sounds" / "nobody"  # a profile folder without taught sounds
    editions = {str(weights): EmbeddedSounds(folder=nobody, weights=weights) for weights in arguments.weights}
    clips = clips_for(read_index(arguments.sounds), arguments.fold, list(editions.values()))
    kinds = np.array([clip.kind for clip in clips])
    dry = [AudioTrack.open(arguments.sounds / clip.path).read() for clip in clips]
    echoes = {rate_hz: room_response(ROOM_S, rate_hz) for rate_hz in {sound.rate_hz for sound in dry}}
    wet = [Sound(oaconvolve(s.samples, echoes[s.rate_hz]).astype(np.float32), s.rate_hz) for s in dry]
    half = [(wet if number % 4 else dry)[number] for number in range(0, len(dry), 2)]
    pieces, which = as_a_map_cuts(half, arguments.out.parent)
    heard = {
        "dry": (dry, kinds), f"RT60 {ROOM_S} s, 4 m": (wet, kinds), "pieces": (pieces, kinds[2 * which]),
    }  # fmt: skip
    figures: dict[str, dict[str, Any]] = {}
    for label, encoder in editions.items():
        figures[label] = {where: measured(encoder, *given) for where, given in heard.items()}
        for where, found in figures[label].items():
            found["against the first"] = paired(figures[str(arguments.weights[0])][where], found)
            shown = {what: value for what, value in found.items() if what != "each"}
            say(f"{label}, {where}: {shown}")
    write_json(arguments.out, figures)


if __name__ == "__main__":
    main()
