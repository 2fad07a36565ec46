"""Two editions of the sound encoder on clips of one fold that neither of them learnt from, in one run.

``python -m training.sounds.compare`` compares weights that were fitted without the fold with those that ship. The clips
are those of household kinds; every edition heard some of ESC-10.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from scipy.signal import oaconvolve
from training.sounds.__main__ import ROOT, write_json
from training.sounds.clips import Clip, read_index
from training.sounds.crossvalidate import ROOM_S, TESTED
from training.sounds.kinds import CALLED, ESC10, RECORDED

from avlmaps.bench.sound_clips import room_response
from avlmaps.core.progress import say
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.recordings.audio import AudioTrack, Sound


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
    return {
        "clips": len(sounds),
        f"first among {len(RECORDED)}": int((fifty.argmax(axis=1) == kinds).sum()),
        f"first among {len(CALLED)}": int((scores.argmax(axis=1) == kinds).sum()),
        "own name says yes": int(yes[own].sum()),
        "some other name says yes": int((yes & ~own).any(axis=1).sum()),
        "ms of one core a second of sound": round(1e3 * took_s / sum(sound.duration_s for sound in sounds), 2),
    }


def main() -> None:
    """Print the figures of both editions, dry and in a room, and write them to a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=ROOT.parent / "shared" / "data" / "sounds")
    parser.add_argument("--fold", type=int, default=TESTED)
    parser.add_argument("--weights", type=Path, default=ROOT / "build" / "sounds" / f"without-{TESTED}")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "sounds" / "compared.json")
    arguments = parser.parse_args()
    nobody = ROOT / "build" / "sounds" / "nobody"  # a profile folder without taught sounds
    editions = {
        "ships": EmbeddedSounds(folder=nobody),
        str(arguments.weights): EmbeddedSounds(folder=nobody, weights=arguments.weights),
    }
    clips = clips_for(read_index(arguments.sounds), arguments.fold, list(editions.values()))
    kinds = np.array([clip.kind for clip in clips])
    dry = [AudioTrack.open(arguments.sounds / clip.path).read() for clip in clips]
    echoes = {rate_hz: room_response(ROOM_S, rate_hz) for rate_hz in {sound.rate_hz for sound in dry}}
    wet = [Sound(oaconvolve(s.samples, echoes[s.rate_hz]).astype(np.float32), s.rate_hz) for s in dry]
    figures = {
        label: {
            "id": encoder.card.id,
            "dry": measured(encoder, dry, kinds),
            f"RT60 {ROOM_S} s, 4 m": measured(encoder, wet, kinds),
        }
        for label, encoder in editions.items()
    }
    write_json(arguments.out, figures)
    say(str(figures))


if __name__ == "__main__":
    main()
