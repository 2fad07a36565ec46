"""Make weights and figures of the embedded sound encoder: ``python -m training.sounds --help``."""

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from training.sounds import calibrate
from training.sounds.clips import TESTED, Clip, Corpus, read_corpus
from training.sounds.crossvalidate import Answers, example_bank, hear_held_out, network_of
from training.sounds.export import write_onnx
from training.sounds.figures import all_tables
from training.sounds.fit import EncodeWords
from training.sounds.in_maps import ROOT, write_json
from training.sounds.kinds import KINDS, NAMES, TEMPLATES
from training.sounds.mixtures import MADE_EACH
from training.sounds.noises import add_noises

from avlmaps.core.progress import say
from avlmaps.perception.embedded.sounds import evidence_for
from avlmaps.perception.embedded.words import EmbeddedWords

WEIGHTS = Path("src/avlmaps/perception/embedded/weights")
FIGURES = Path("packages/avlmaps-sim/src/avlmaps_sim/bench/data/sounds_crossvalidation.json")
NOTE = (
    "A small closed-set encoder: ten kinds learnt from about 32 recordings each, forty from about 26, the others from "
    "synthetic sounds alone, which carry less well; other sounds can be taught."
)


def main() -> None:
    """Test and calibrate the networks of the work folder, and write both editions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=ROOT.parent / "shared" / "data" / "sounds")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "sounds", help="folder of the fitted networks")
    parser.add_argument("--out", type=Path, default=ROOT, help="the checkout to write weights and figures into")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    corpus = read_corpus(arguments.sounds, arguments.work)
    words = EmbeddedWords()
    answers = hear_held_out(corpus, arguments.work, calibrate.prototypes(words.encode))
    constants = fitted_constants(answers, words.encode)
    learnt = Counter(NAMES[clip.kind] for clip in corpus.clips if clip.may_ship and clip.fold != TESTED)
    tables = all_tables(answers, learnt, words.encode, constants)
    say(json.dumps(tables, indent=1))
    write_edition(arguments.work / f"without-{TESTED}", corpus, arguments.work, TESTED, words, constants)
    (arguments.out / FIGURES).parent.mkdir(parents=True, exist_ok=True)
    write_json(arguments.out / FIGURES, {"about": {"words": words.card.checksum}, "tables": tables})
    write_edition(arguments.out / WEIGHTS, corpus, arguments.work, 0, words, constants)


def fitted_constants(answers: Answers, encode: EncodeWords) -> calibrate.SoundCalibration:
    """Fit every constant in turn, on clips as they are, the same clips in a room, and pieces in rooms and noise."""
    heard, kinds = answers.held.every, answers.held.every_kind
    evidence = evidence_for(heard.cosines, heard.typical)
    c = replace(calibrate.START, temperature=calibrate.fit_temperature(evidence, kinds))
    c = calibrate.fit_phrases(encode, c)
    unknown = answers.strangers.every
    c = calibrate.fit_known(answers.peers.every, unknown, c)  # of the same network
    c = calibrate.fit_taught(answers.lessons(3), c)
    left = [k for k in range(calibrate.RECORDED_COUNT) if k not in answers.without]
    c = calibrate.flattened(calibrate.fit_word(heard, kinds, [(unknown, left)], encode, c))
    return calibrate.fit_pairs(heard, kinds, answers.held.every_room, c)


def write_edition(
    folder: Path, corpus: Corpus, work: Path, fold: int, words: EmbeddedWords, c: calibrate.SoundCalibration
) -> None:
    """Write what ``EmbeddedSounds`` reads: a network that learnt nothing from a fold (0 for none), examples, notes."""
    folder.mkdir(parents=True, exist_ok=True)
    net = network_of(work, fold)
    bank, kinds = example_bank(net, corpus.examples(fold))
    write_onnx(net, folder / "sounds.onnx")
    np.save(folder / "sounds.npy", bank.astype(np.float16))
    learnt = [clip for clip in corpus.clips if clip.may_ship and clip.fold != fold]
    examples = np.bincount(kinds, minlength=len(NAMES)).tolist()
    write_json(folder / "sounds.json", notes(learnt, words, c, examples))
    add_noises(folder)


def notes(
    learnt: Sequence[Clip], words: EmbeddedWords, c: calibrate.SoundCalibration, examples: Sequence[int]
) -> dict[str, Any]:
    """Return the notes that ship beside a network.

    Args:
        learnt: the clips that it learnt from.
        words: the word encoder.
        c: the constants.
        examples: how many of each kind ship.
    """
    counts = Counter(NAMES[clip.kind] for clip in learnt)
    kinds = [
        {
            "name": name,
            "called": list(called),
            "origin": "recorded" if counts[name] else "synthesised",
            "clips": counts[name] or MADE_EACH,
            "examples": examples[k],
        }
        for k, (name, called) in enumerate(KINDS.items())
    ]
    return {
        "id": "avlmaps/sounds-6",
        "dim": words.card.dim,
        "words": words.card.checksum,
        "templates": list(TEMPLATES),
        "note": NOTE,
        "calibration": asdict(c),
        "sources": sorted({clip.source for clip in learnt}),
        "kinds": kinds,
    }


if __name__ == "__main__":
    main()
