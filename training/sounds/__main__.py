"""Make the weights and the figures of the embedded sound encoder: ``python -m training.sounds --help``."""

import argparse
import json
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from training.sounds import calibrate
from training.sounds.augmentation import Augmentation
from training.sounds.clips import Corpus, read_corpus
from training.sounds.crossvalidate import Answers, Networks, example_bank, hear_held_out
from training.sounds.export import write_onnx
from training.sounds.figures import all_tables
from training.sounds.fit import EncodeWords, Settings
from training.sounds.kinds import KINDS, NAMES, TEMPLATES

from avlmaps.core.progress import say
from avlmaps.perception.embedded.sound_calibration import evidence_for
from avlmaps.perception.embedded.words import EmbeddedWords

ROOT = Path(__file__).resolve().parents[2]
WEIGHTS = Path("src/avlmaps/perception/embedded/weights")
FIGURES = Path("src/avlmaps/bench/data/sounds_crossvalidation.json")
_ROUND = Settings(recorded=44, synthetic=20, rate=2e-3, averaging=0.99, evenness=0.75)
ONWARDS = (
    replace(_ROUND, steps=1400, augmentation=Augmentation(segmented=0.0)),
    replace(_ROUND, steps=1200, falling=0.9, seed=1),
)
SCRATCH = (
    Settings(steps=600, averaging=0.99, seed=5, augmentation=Augmentation(segmented=0.0)),
    Settings(steps=500, rate=2e-3, averaging=0.99, falling=0.9, seed=6),
)
NOTE = (
    "A small closed-set encoder: ten kinds learnt from about 32 recordings each, forty from one to eight, the others "
    "from synthetic sounds alone, which carry less well; other sounds can be taught."
)


def main() -> None:
    """Run the stages in order; networks that are in the work folder are not fitted again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=ROOT.parent / "shared" / "data" / "sounds")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "sounds", help="folder of the networks")
    parser.add_argument("--out", type=Path, default=ROOT, help="the checkout to write weights and figures into")
    parser.add_argument("--start", type=Path, default=ROOT / WEIGHTS / "sounds.onnx", help="weights to continue from")
    parser.add_argument("--steps", type=int, help="of each round, instead of its own")
    parser.add_argument("--each", type=int, default=16, help="synthetic sounds of a kind")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    corpus = read_corpus(arguments.sounds, arguments.work, arguments.each)
    words = EmbeddedWords()
    onwards = tuple(replace(each, steps=arguments.steps or each.steps) for each in ONWARDS)
    networks = Networks(corpus, words.encode, onwards, SCRATCH, arguments.start, arguments.work)

    answers = hear_held_out(corpus, networks, calibrate.prototypes(words.encode))
    constants = fitted_constants(answers, words.encode)
    learnt = Counter(NAMES[clip.kind] for clip in corpus.clips if clip.may_ship)
    tables = all_tables(answers, learnt, words.encode, constants)
    final = networks.of_fold(0)
    bank, kinds = example_bank(final, corpus.examples())
    weights = arguments.out / WEIGHTS
    weights.mkdir(parents=True, exist_ok=True)
    (arguments.out / FIGURES).parent.mkdir(parents=True, exist_ok=True)
    write_onnx([final], weights / "sounds.onnx")
    np.save(weights / "sounds.npy", bank.astype(np.float16))
    per_kind = np.bincount(kinds, minlength=len(NAMES)).tolist()
    write_json(weights / "sounds.json", notes(corpus, words, constants, arguments.each, per_kind))
    settings = {"onwards": [asdict(each) for each in onwards], "scratch": [asdict(each) for each in SCRATCH]}
    about = {**settings, "words": words.card.checksum}
    write_json(arguments.out / FIGURES, {"about": about, "tables": tables})
    say(json.dumps(tables, indent=1))


def fitted_constants(answers: Answers, encode: EncodeWords) -> calibrate.Calibration:
    """Fit every constant in turn, on clips as they are and the same clips in a room."""
    known, strangers = answers.known, answers.strangers
    heard = calibrate.joined([known.dry, known.wet])
    kinds, nets = np.tile(known.kinds, 2), np.concatenate([known.nets, known.nets + 10])
    evidence = evidence_for(heard.cosines, heard.typical)
    c = replace(calibrate.START, temperature=calibrate.fit_temperature(evidence, kinds))
    c = calibrate.fit_phrases(encode, c)
    unknown = calibrate.joined([strangers.dry, strangers.wet])
    peers = calibrate.joined([answers.peers.dry, answers.peers.wet])  # of the same network
    c = calibrate.fit_known(peers, unknown, c)
    c = calibrate.fit_taught(answers.lessons(3), c)
    left = [k for k in range(calibrate.RECORDED_COUNT) if k not in answers.without]
    c = calibrate.fit_word(heard, kinds, [(unknown, left)], encode, c)
    return calibrate.fit_pairs(heard, kinds, nets, c)


def notes(
    corpus: Corpus, words: EmbeddedWords, c: calibrate.Calibration, each: int, examples: list[int]
) -> dict[str, Any]:
    """Return the notes that ship beside the network."""
    shipped = [clip for clip in corpus.clips if clip.may_ship]
    counts = Counter(NAMES[clip.kind] for clip in shipped)
    kinds = [
        {
            "name": name,
            "called": list(called),
            "origin": "recorded" if counts[name] else "synthesised",
            "clips": counts[name] or each,
            "examples": examples[k],
        }
        for k, (name, called) in enumerate(KINDS.items())
    ]
    return {
        "id": "avlmaps/sounds-3",
        "dim": words.card.dim,
        "words": words.card.checksum,
        "templates": list(TEMPLATES),
        "note": NOTE,
        "calibration": asdict(c),
        "sources": sorted({clip.source for clip in shipped}),
        "kinds": kinds,
    }


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON that a person can read."""
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
