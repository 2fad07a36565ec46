"""How the shipped sound encoder names the clips of any folder, and which of its kinds a category is.

A category that is not a key here is looked up among the kinds' own names; else it is unknown to the encoder.

The folder holds clips and an ``index.csv`` (path, category ...). Clips cut from a recording that the weights were
fitted to say nothing about them: they are left out and counted. Each group of clips, those of the ten kinds of ESC-10
and those of all others, is queried by name: ESC-10 by its ten names, the others by the names of all kinds in the
folder and those ten.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from avlmaps.core.errors import AudioError
from avlmaps.perception.embedded.sounds import EmbeddedSounds
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps_sim.bench.harness.figures import wilson
from avlmaps_sim.mixing.clips import index_rows

# The categories of ESC-50 (Piczak 2015) that our kinds name otherwise.
_OTHERWISE = {
    "cat": "cat meowing", "chirping birds": "birds chirping", "clock alarm": "alarm clock", "cow": "cow mooing",
    "crow": "crow cawing", "door wood creaks": "creaking door", "door wood knock": "door knock",
    "drinking sipping": "drinking or sipping", "engine": "car engine", "frog": "frog croaking", "hen": "hen clucking",
    "insects": "buzzing insects", "pig": "pig grunting", "sheep": "sheep bleating", "thunderstorm": "thunder",
}  # fmt: skip
# With those that are named alike they are the forty that are not in ESC-10.
ESC50 = _OTHERWISE | {name: name for name in (
    "airplane", "breathing", "brushing teeth", "can opening", "car horn", "church bells", "clapping", "coughing",
    "crickets", "fireworks", "footsteps", "glass breaking", "hand saw", "keyboard typing", "laughing", "mouse click",
    "pouring water", "siren", "snoring", "toilet flush", "train", "vacuum cleaner", "washing machine", "water drops",
    "wind",
)}  # fmt: skip
# The categories of other collections.
CATEGORIES = ESC50 | {
    "applause": "clapping", "car engine": "car engine", "crowd cheering": "crowd cheering",
    "door open close": "door opening or closing", "footsteps gravel": "footsteps", "footsteps hard": "footsteps",
    "footsteps metal": "footsteps", "footsteps wood": "footsteps", "piano": "piano", "running water": "running water",
    "thunder": "thunder", "wood chop": "chopping wood",
}  # fmt: skip
ESC10 = (
    "chainsaw", "clock tick", "crackling fire", "crying baby", "dog bark", "helicopter", "rain", "rooster", "sea waves",
    "sneezing",
)  # fmt: skip


Table = dict[str, list[Any]]
Features = Float32[np.ndarray, "windows d"]

_SOURCE = re.compile(r"\d-(\d+)-[A-Z]")
_YES = 0.5
ROOM_M = (6.0, 5.0, 2.7)
SPEAKER_M, MICROPHONE_M = (1.0, 1.2, 1.3), (4.6, 2.9, 1.1)  # 4.0 m apart
RT60_S = (0.2, 0.4, 0.6, 0.9, 1.2)
_HIGHEST_ORDER = 60


@dataclass(frozen=True, slots=True)
class NamedClip:
    """A row of the index.

    ``kind`` is "" where the encoder knows none; ``heard``: the weights were fitted to the recording that it was cut
    from.
    """

    path: Path
    category: str
    kind: str
    heard: bool


def kind_names(encoder: EmbeddedSounds) -> dict[str, str]:
    """Return the kind of every name: the kinds' own, what they are called, and the categories of collections."""
    names = {called: kind.name for kind in encoder.kinds for called in (*kind.called, kind.name)}
    return names | {category: kind for category, kind in CATEGORIES.items() if kind in names}


def read_clips(folder: Path, encoder: EmbeddedSounds) -> list[NamedClip]:
    """Read the index of a folder, or that of ESC-50 as it is downloaded.

    ``AudioError``: there is no index, it lacks a column, or names no clip.
    """
    rows = index_rows(folder)
    if not rows:
        raise AudioError(f"{folder} has no index.csv that names a clip, and is not ESC-50; add one.")
    kinds = kind_names(encoder)
    clips = []
    for row in rows:
        category = row["category"].replace("_", " ").strip().lower()
        source = _SOURCE.search(Path(row["path"]).name)
        heard = source is not None and int(source[1]) in encoder.sources
        clips.append(NamedClip(folder / row["path"], category, kinds.get(category, ""), heard))
    return clips


def run(folder: Path) -> dict[str, Table]:
    """Return the tables of a folder of clips.

    ``AudioError``: there is no index, no clip that the weights were not fitted to, or a file cannot be read.
    """
    encoder = EmbeddedSounds()
    clips = read_clips(folder, encoder)
    heard = sum(clip.heard for clip in clips)
    clips = [clip for clip in clips if not clip.heard]
    if not clips:
        raise AudioError(f"The weights were fitted to all {heard} clips of {folder}; give clips of other recordings.")
    sounds = [AudioTrack.open(clip.path).read() for clip in clips]
    features = [encoder.encode(sound) for sound in sounds]
    counts = Counter("of a known kind" if clip.kind else "of no known kind" for clip in clips)
    rows = [[what, counts[what]] for what in ("of a known kind", "of no known kind")]
    tables = {"clips": _table(["clips", "count"], [*rows, ["left out: the weights were fitted to them", heard]])}
    known = [i for i, clip in enumerate(clips) if clip.kind]
    if known:
        kinds = [clips[i].kind for i in known]
        tables["by name"] = by_name(encoder, [features[i] for i in known], kinds)
        tables["by name, each kind"] = each_kind(encoder, [features[i] for i in known], kinds)
        tables["in rooms, 4 m away"] = in_rooms(
            encoder, [sounds[i] for i in known], [features[i] for i in known], kinds
        )
    unknown = [i for i, clip in enumerate(clips) if not clip.kind]
    if unknown:
        tables["sounds of no known kind"] = _refusals(
            encoder, [features[i] for i in unknown], [clips[i].category for i in unknown]
        )
    return tables


def by_name(encoder: EmbeddedSounds, features: Sequence[Features], kinds: Sequence[str]) -> Table:
    """Return how often the right name ranks first and says yes, and how often another says yes."""
    called = {kind.name: kind.called[0] for kind in encoder.kinds}
    rows = []
    for group, chosen in _groups(kinds).items():
        mine, right = [features[i] for i in chosen], [kinds[i] for i in chosen]
        queries = _query_names(right, group)
        scores = encoder.score_words(mine, [called[name] for name in queries])
        truth = np.array([queries.index(kind) for kind in right])
        yes, is_right = scores >= _YES, truth[:, None] == np.arange(len(queries))
        every = encoder.score_words(mine, list(called.values()))
        first = every.argmax(axis=1) == [list(called).index(kind) for kind in right]
        rows += [
            [group, f"right name first among {len(queries)} names", *_share(scores.argmax(axis=1) == truth)],
            [group, f"right name first among all {len(called)} kinds", *_share(first)],
            [group, "right kind says yes", *_share(yes[is_right])],
            [group, "another kind says yes", *_share(yes[~is_right])],
            [group, "some other kind says yes, of clips", *_share((yes & ~is_right).any(axis=1))],
        ]
        rows += [[group, *row] for row in _paraphrased(encoder, mine, right)]
    return _table(["kinds", "question", "hits", "of", "%", "95 %"], rows)


def each_kind(encoder: EmbeddedSounds, features: Sequence[Features], kinds: Sequence[str]) -> Table:
    """Return the same for every kind, with what it was learnt from and what it is taken for."""
    about = {kind.name: kind for kind in encoder.kinds}
    rows = []
    for group, chosen in _groups(kinds).items():
        queries = _query_names([kinds[i] for i in chosen], group)
        scores = encoder.score_words([features[i] for i in chosen], [about[name].called[0] for name in queries])
        for kind in sorted({kinds[i] for i in chosen}):
            mine = scores[[kinds[i] == kind for i in chosen]]
            k = queries.index(kind)
            order = np.argsort(-mine, axis=1)
            wrong = Counter(queries[o] for o in order[:, 0] if o != k)
            rows.append([
                kind, f"{about[kind].origin} ({about[kind].clips})", len(mine), int((order[:, 0] == k).sum()),
                int((order[:, :5] == k).any(axis=1).sum()), int((mine[:, k] >= _YES).sum()),
                ", ".join(f"{name} {count}" for name, count in wrong.most_common()) or "-",
            ])  # fmt: skip
    return _table(["kind", "learnt from", "clips", "first", "among five", "yes", "taken for"], rows)


def in_rooms(encoder: EmbeddedSounds, sounds: Sequence[Sound], dry: Sequence[Features], kinds: Sequence[str]) -> Table:
    """Return how names and scores hold when the same clips sound 4 m away in rooms of growing reverberation."""
    from scipy.signal import oaconvolve

    called = {kind.name: kind.called[0] for kind in encoder.kinds}
    rows = []
    for rt60_s in (0.0, *RT60_S):
        wet = list(dry)
        if rt60_s:
            echoes = {rate_hz: room_response(rt60_s, rate_hz) for rate_hz in {sound.rate_hz for sound in sounds}}
            wet = [
                encoder.encode(Sound(oaconvolve(s.samples, echoes[s.rate_hz]).astype(np.float32), s.rate_hz))
                for s in sounds
            ]
        for group, chosen in _groups(kinds).items():
            queries = _query_names([kinds[i] for i in chosen], group)
            scores = encoder.score_words([wet[i] for i in chosen], [called[name] for name in queries])
            truth = np.array([queries.index(kinds[i]) for i in chosen])
            own = scores[np.arange(len(truth)), truth]
            where = f"RT60 {rt60_s} s" if rt60_s else "dry"
            first = _share(scores.argmax(axis=1) == truth)
            rows.append([group, where, *first, round(float(np.median(own)), 2), round(float(own.mean()), 2)])
    return _table(["kinds", "room", "first", "of", "%", "95 %", "median score of the right kind", "mean"], rows)


def room_response(rt60_s: float, rate_hz: int) -> Float[np.ndarray, " t"]:
    """Return the impulse response of a shoebox room from 4 m away, by image sources (pyroomacoustics)."""
    import pyroomacoustics as pra

    absorption, order = pra.inverse_sabine(rt60_s, ROOM_M)
    room = pra.ShoeBox(ROOM_M, fs=rate_hz, materials=pra.Material(absorption), max_order=min(order, _HIGHEST_ORDER))
    room.add_source(list(SPEAKER_M))
    room.add_microphone(list(MICROPHONE_M))
    room.compute_rir()
    return np.asarray(room.rir[0][0], np.float64)  # pyright: ignore[reportOptionalSubscript]


def paraphrases() -> list[dict[str, str]]:
    """Return lists of phrases, one for each kind of ESC-10; none was used in training."""
    text = (files("avlmaps_sim.bench") / "data" / "sounds_paraphrases.csv").read_text(encoding="utf-8")
    of_kind: dict[str, list[str]] = {}
    for row in csv.DictReader(text.splitlines()):
        of_kind.setdefault(row["kind"], []).append(row["phrase"])
    return [dict(zip(of_kind, phrases, strict=True)) for phrases in zip(*of_kind.values(), strict=True)]


def _paraphrased(encoder: EmbeddedSounds, features: Sequence[Features], kinds: Sequence[str]) -> list[list[Any]]:
    rows = []
    for at, phrases in enumerate(paraphrases()):
        if not set(kinds) <= set(phrases):
            return []
        scores = encoder.score_words(features, list(phrases.values()))
        right = scores.argmax(axis=1) == [list(phrases).index(kind) for kind in kinds]
        rows.append([f"right phrase first, paraphrases {at + 1}", *_share(right)])
    return rows


def _refusals(encoder: EmbeddedSounds, features: Sequence[Features], categories: Sequence[str]) -> Table:
    names = [kind.called[0] for kind in encoder.kinds]
    scores = encoder.score_words(features, names)
    rows = []
    for category in (*sorted(set(categories)), "in all"):
        mine = scores[[c == category or category == "in all" for c in categories]]
        refused = mine.max(axis=1) < _YES
        claims = Counter(names[k] for k in mine[~refused].argmax(axis=1))
        taken = ", ".join(f"{name} {count}" for name, count in claims.most_common()) or "-"
        rows.append([category, *_share(refused), taken])
    return _table(["category", "refused", "of", "%", "95 %", "claimed by"], rows)


def _groups(kinds: Sequence[str]) -> dict[str, list[int]]:
    groups = {
        "ESC-10": [i for i, kind in enumerate(kinds) if kind in ESC10],
        "others": [i for i, kind in enumerate(kinds) if kind not in ESC10],
    }
    return {name: chosen for name, chosen in groups.items() if chosen}


def _query_names(kinds: Sequence[str], group: str) -> list[str]:
    return list(ESC10) if group == "ESC-10" else [*ESC10, *sorted(set(kinds) - set(ESC10))]


def _share(hits: np.ndarray) -> list[Any]:
    count, found = int(hits.size), int(hits.sum())
    low, high = wilson(found, count)
    return [found, count, round(100.0 * found / max(count, 1), 1), f"{100 * low:.1f}-{100 * high:.1f}"]


def _table(columns: list[str], rows: list[list[Any]]) -> Table:
    return {"columns": columns, "rows": rows}
