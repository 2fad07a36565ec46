"""Make the weights and the figures of the embedded sound encoder: ``python -m training.sounds --help``."""

import argparse
import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from training.sounds import calibrate, figures
from training.sounds.clips import Corpus, read_corpus
from training.sounds.crossvalidate import Answers, Networks, example_bank, hear_held_out
from training.sounds.export import write_onnx
from training.sounds.fit import EncodeWords, Settings
from training.sounds.kinds import KINDS, NAMES, RECORDED, TEMPLATES

from avlmaps.core.progress import say
from avlmaps.perception.embedded.words import EmbeddedWords

ROOT = Path(__file__).resolve().parents[2]
WEIGHTS = Path("src/avlmaps/perception/embedded/weights")
FIGURES = Path("src/avlmaps/bench/data/sounds_crossvalidation.json")
NOTE = (
    "A small closed-set encoder: ten kinds learnt from recordings, the others from synthetic sounds, which carry less "
    "well; other sounds can be taught."
)


def main() -> None:
    """Run the stages in order; networks that are in the work folder are not fitted again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=ROOT.parent / "shared" / "data" / "sounds")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "sounds", help="where networks are kept")
    parser.add_argument("--out", type=Path, default=ROOT, help="the checkout to write weights and figures into")
    parser.add_argument("--members", type=int, default=1, help="networks in the ensemble")
    parser.add_argument("--steps", type=int, default=Settings().steps)
    parser.add_argument("--each", type=int, default=24, help="synthetic sounds of a kind")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    corpus = read_corpus(arguments.sounds, arguments.work, arguments.each)
    words = EmbeddedWords()
    settings = replace(Settings(), steps=arguments.steps)
    networks = Networks(corpus, words.encode, settings, arguments.members, arguments.work)

    answers = hear_held_out(corpus, networks, calibrate.prototypes(words.encode))
    constants = fitted_constants(answers, words.encode)
    tables = all_tables(answers, [clip.kind for clip in corpus.others], words.encode, constants)
    final = networks.of_all()
    bank, counts = example_bank(final, corpus.examples(np.ones(len(corpus.clips), bool)))
    weights = arguments.out / WEIGHTS
    weights.mkdir(parents=True, exist_ok=True)
    (arguments.out / FIGURES).parent.mkdir(parents=True, exist_ok=True)
    write_onnx(final, weights / "sounds.onnx")
    np.save(weights / "sounds.npy", bank.astype(np.float16))
    per_kind = np.bincount(counts, minlength=len(NAMES)).tolist()
    write_json(weights / "sounds.json", notes(corpus, words, constants, arguments.each, per_kind))
    about = {"settings": asdict(settings), "members": arguments.members, "words": words.card.checksum}
    write_json(arguments.out / FIGURES, {"about": about, "tables": tables})
    say(json.dumps(tables, indent=1))


def fitted_constants(answers: Answers, encode: EncodeWords) -> calibrate.Calibration:
    """Fit every constant in turn."""
    heard = answers.held_out["clean"]
    evidence = (heard.cosines + heard.near) / 2.0
    c = replace(calibrate.START, temperature=calibrate.fit_temperature(evidence, answers.kinds))
    c = calibrate.fit_phrases(encode, c)
    c = calibrate.fit_known(heard, calibrate.joined([s.heard.at(s.unknown) for s in answers.strangers]), c)
    c = calibrate.fit_taught([lesson for s in answers.strangers for lesson in s.lessons(3)], c)
    unknown = [
        (s.heard.at(s.unknown), [k for k in range(len(RECORDED)) if k not in s.without]) for s in answers.strangers
    ]
    c = calibrate.fit_word(heard, answers.kinds, unknown, encode, c)
    return calibrate.fit_pairs(heard, answers.kinds, answers.folds, c)


def all_tables(
    answers: Answers, other_categories: list[str], encode: EncodeWords, c: calibrate.Calibration
) -> dict[str, Any]:
    """Return every table of figures."""
    heard = answers.held_out["clean"]
    overall, by_kind = figures.words_table(answers.held_out, answers.kinds, encode, c)
    return {
        "asked by words": overall,
        "asked by words, each kind": by_kind,
        "asked by a clip": figures.clips_table(heard, answers.kinds, answers.folds, c),
        "refusing the unknown": figures.refusal_table(heard, other_categories, answers.others, answers.strangers, c),
        "taught kinds": figures.taught_table(answers.strangers, c),
        "yes and no at 0.5": figures.yes_table(answers.held_out, answers.kinds, encode, c),
    }


def notes(
    corpus: Corpus, words: EmbeddedWords, c: calibrate.Calibration, each: int, examples: list[int]
) -> dict[str, Any]:
    """Return what is shipped beside the network."""
    shipped = [clip.kind for clip in corpus.clips if clip.may_ship]
    kinds = [
        {
            "name": name,
            "called": list(called),
            "origin": "recorded" if name in RECORDED else "synthesised",
            "clips": shipped.count(name) if name in RECORDED else each,
            "examples": examples[k],
        }
        for k, (name, called) in enumerate(KINDS.items())
    ]
    return {
        "id": "avlmaps/sounds-1",
        "dim": words.card.dim,
        "words": words.card.checksum,
        "templates": list(TEMPLATES),
        "note": NOTE,
        "calibration": asdict(c),
        "kinds": kinds,
    }


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write JSON that a person can read."""
    path.write_text(json.dumps(content, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
