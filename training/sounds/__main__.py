"""Make the weights and the figures of the embedded sound encoder: ``python -m training.sounds --help``."""

import argparse
import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from training.sounds import calibrate, figures
from training.sounds.clips import read_samples
from training.sounds.crossvalidate import CONDITIONS, FOLDS, Corpus, Networks, condition_mels, ensemble, read_corpus
from training.sounds.export import write_onnx
from training.sounds.fit import Settings, recorded_index
from training.sounds.kinds import KINDS, NAMES, RECORDED, TEMPLATES

from avlmaps.core.progress import say
from avlmaps.perception.embedded import logmel
from avlmaps.perception.embedded.words import EmbeddedWords

ROOT = Path(__file__).resolve().parents[2]
WEIGHTS = ROOT / "src" / "avlmaps" / "perception" / "embedded" / "weights"
FIGURES = ROOT / "src" / "avlmaps" / "bench" / "data" / "sounds_crossvalidation.json"
LEFT_OUT = tuple(zip(list(RECORDED)[:5], list(RECORDED)[5:], strict=True))
LEFT_OUT_FOLD = 5
NOTE = (
    "A small closed-set encoder: ten kinds learnt from recordings, the others from synthetic sounds, which carry less "
    "well; other sounds can be taught."
)


def main() -> None:
    """Run the stages in order; networks that are in the work folder are not fitted again."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sounds", type=Path, default=ROOT.parent / "shared" / "data" / "sounds")
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "sounds", help="where networks are kept")
    parser.add_argument("--members", type=int, default=1, help="networks in the ensemble")
    parser.add_argument("--steps", type=int, default=Settings().steps)
    parser.add_argument("--each", type=int, default=24, help="synthetic sounds of a kind")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    corpus = read_corpus(arguments.sounds, arguments.work, arguments.each)
    words = EmbeddedWords()
    settings = replace(Settings(), steps=arguments.steps)
    networks = Networks(corpus, words.encode, settings, arguments.members, arguments.work)

    held_out = {condition: np.zeros((len(corpus.clips), words.card.dim), np.float32) for condition in CONDITIONS}
    folds = np.array([clip.fold for clip in corpus.clips])
    others = []
    for fold in FOLDS:
        nets = networks.of_fold(fold)
        rows = np.flatnonzero(folds == fold)
        for condition in CONDITIONS:
            held_out[condition][rows] = ensemble(nets, condition_mels(corpus, rows, condition))
        others.append(other_features(corpus, nets))
    strangers = left_out_features(corpus, networks)
    kinds = np.array([recorded_index(clip.kind) for clip in corpus.clips])
    constants = fitted_constants(held_out["clean"], kinds, folds, strangers, words.encode)
    tables = all_tables(held_out, kinds, folds, corpus, others, strangers, words.encode, constants)
    final = networks.of_all()
    write_onnx(final, WEIGHTS / "sounds.onnx")
    write_json(WEIGHTS / "sounds.json", notes(corpus, words, constants, arguments.each))
    about = {"settings": asdict(settings), "members": arguments.members, "words": words.card.checksum}
    write_json(FIGURES, {"about": about, "tables": tables})
    say(json.dumps(tables, indent=1))


def other_features(corpus: Corpus, nets: list[Any]) -> list[np.ndarray]:
    """Return the features (windows, dim) of every clip without a fold."""
    found = []
    for clip in corpus.others:
        mels = logmel.normalised(logmel.mel_power(read_samples(corpus.folder / clip.path)))
        found.append(ensemble(nets, logmel.windows(mels)))
    return found


def left_out_features(corpus: Corpus, networks: Any) -> list[dict[str, Any]]:
    """Return features of one fold by networks that never heard it, nor two of the ten kinds at all."""
    rows = np.array([i for i, clip in enumerate(corpus.clips) if clip.fold == LEFT_OUT_FOLD])
    kinds = np.array([recorded_index(corpus.clips[i].kind) for i in rows])
    found = []
    for pair in LEFT_OUT:
        nets = networks.of_fold(LEFT_OUT_FOLD, pair)
        without = [recorded_index(kind) for kind in pair]
        found.append({"features": ensemble(nets, corpus.mels[rows]), "kinds": kinds, "without": without})
    return found


def fitted_constants(
    features: np.ndarray, kinds: np.ndarray, folds: np.ndarray, strangers: list[dict[str, Any]], encode: Any
) -> calibrate.Calibration:
    """Fit every constant in turn."""
    aims = calibrate.prototypes(encode)
    cosines = features @ aims.T
    c = replace(calibrate.START, temperature=calibrate.fit_temperature(cosines, kinds))
    c = calibrate.fit_phrases(encode, c)
    unknown = []
    for one in strangers:
        mine = np.isin(one["kinds"], one["without"])
        rest = [k for k in range(len(NAMES)) if k not in one["without"]]
        unknown.append((one["features"][mine] @ aims.T)[:, rest])
    most = max(len(u[0]) for u in unknown)
    padded = [np.pad(u, ((0, 0), (0, most - u.shape[1])), constant_values=-1.0) for u in unknown]
    c = calibrate.fit_known(cosines, np.concatenate(padded), c)
    c = calibrate.fit_word(features, kinds, encode, c)
    return calibrate.fit_pairs(features, kinds, folds, aims, c)


def all_tables(
    held_out: dict[str, np.ndarray],
    kinds: np.ndarray,
    folds: np.ndarray,
    corpus: Corpus,
    others: list[list[np.ndarray]],
    strangers: list[dict[str, Any]],
    encode: Any,
    c: calibrate.Calibration,
) -> dict[str, Any]:
    """Return every table of figures."""
    overall, by_kind = figures.words_table(held_out, kinds, encode, c)
    return {
        "asked by words": overall,
        "asked by words, each kind": by_kind,
        "asked by a clip": figures.clips_table(held_out["clean"], kinds, folds, encode, c),
        "refusing the unknown": figures.refusal_table(
            held_out["clean"], kinds, [clip.kind for clip in corpus.others], others, strangers, encode, c
        ),
        "yes and no at 0.5": figures.yes_table(held_out, kinds, encode, c),
    }


def notes(corpus: Corpus, words: EmbeddedWords, c: calibrate.Calibration, each: int) -> dict[str, Any]:
    """Return what is shipped beside the network."""
    shipped = [clip.kind for clip in corpus.clips if clip.may_ship]
    kinds = [
        {
            "name": name,
            "called": list(called),
            "origin": "recorded" if name in RECORDED else "synthesised",
            "clips": shipped.count(name) if name in RECORDED else each,
        }
        for name, called in KINDS.items()
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
