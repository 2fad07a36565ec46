"""The build's keyframe stage: some keyframes at a time; each lot is stored when it is done."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from time import perf_counter

import msgspec
import numpy as np
from jaxtyping import Float32, Int

from avlmaps.core.ahead import run_ahead
from avlmaps.core.columns import concat
from avlmaps.core.numbers import unmasked
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.maps.keyframes.describe import describe_keyframe, learn_places, select_keyframes, stack_keyframes
from avlmaps.maps.pipeline.parts import MapPart
from avlmaps.maps.pipeline.plan import BUILD_VERSION, BuildPlan
from avlmaps.maps.store import checkpoints
from avlmaps.maps.store.tables import as_kind, fields_of
from avlmaps.maps.types import Keyframes
from avlmaps.perception.cache.cached_encoders import cache_note
from avlmaps.perception.protocols import LocalFeatures, ViewEncoder
from avlmaps.recordings.subset import Subset
from avlmaps.recordings.types import Frame, Recording

RANDOMNESS = 2  # number of the stage as a source of randomness (gravity has 1)
_VIEWS_ON_TORCH = 16  # number of views that go through a large model at once
_Viewed = tuple[int, Frame, Float32[np.ndarray, " dv"]]


class _Facts(msgspec.Struct):
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class KeyframeResult:
    """Outcome of the stage: the pictures, what the place encoder learned, and the seconds it took."""

    keyframes: Keyframes
    place_state: dict[str, np.ndarray]
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class KeyframeLots:
    """Keyframes that are to be described, some at a time.

    Attributes:
        frames: the recording's frames among which they are.
        lots: numbers of keyframes in ``frames``, by the folder that they are to be stored in.
        total: how many keyframes the map has, for the progress bar.
        places: the folder of what the place encoder learned.
        local: keypoints that are known already, by number in ``frames``.
        key: of the stage.
    """

    frames: Subset
    lots: dict[Path, Int[np.ndarray, " k"]]
    total: int
    places: Path
    local: dict[int, LocalFeatures]
    key: str


def describe_keyframes(
    plan: BuildPlan, parts: Sequence[MapPart], describe: Callable[[BuildPlan, KeyframeLots], None]
) -> KeyframeResult:
    """Choose keyframes among the fused frames, and let them be described: keypoints, place and view."""
    fused = fused_frames(parts)
    good = Subset(plan.recording, fused)
    chosen = select_keyframes(good, plan.settings.keyframes)
    cards = [plan.models.get(kind.value) for kind in (Kind.LOCAL, Kind.PLACE, Kind.VIEWS)]
    seed, settings = plan.settings.seed, plan.settings.keyframes
    key = checkpoints.key_of(
        "keyframes", BUILD_VERSION, plan.recording.fingerprint, settings, seed, cards, fused[chosen].tolist()
    )
    home = plan.folder("keyframes", key)
    place_state, local, learning_s = _learn(plan, good, chosen, key)
    size = max(1, plan.settings.frames.per_part // 4)  # describing takes longer than fusing
    lots = {home / f"{start:08d}": chosen[start : start + size] for start in range(0, len(chosen), size)}
    missing = {folder: lot for folder, lot in lots.items() if checkpoints.find_checkpoint(folder, _Facts, key) is None}
    describe(plan, KeyframeLots(good, missing, len(chosen), _places(plan, key), local, key))
    kept = [checkpoints.load_checkpoint(folder, _Facts, key) for folder in lots]
    pieces = [as_kind(Keyframes, lot.arrays, lot.folder) for lot in kept]
    return KeyframeResult(concat_keyframes(pieces), place_state, learning_s + sum(lot.facts.elapsed_s for lot in kept))


def _learn(
    plan: BuildPlan, good: Recording, chosen: Int[np.ndarray, " k"], key: str
) -> tuple[dict[str, np.ndarray], dict[int, LocalFeatures], float]:
    """Return the state of the place encoder, the keypoints that it learned from (if it did now), and the seconds."""
    local: dict[int, LocalFeatures] = {}

    def compute() -> checkpoints.Computed[_Facts]:
        begin = perf_counter()
        state, keypoints = learn_places(good, chosen, plan.encoders, plan.rng(RANDOMNESS))
        local.update(keypoints)
        return checkpoints.Computed(_Facts(perf_counter() - begin), state)

    found = checkpoints.load_or_compute(_places(plan, key), key, _Facts, compute)
    return found.arrays, local, found.facts.elapsed_s


def _places(plan: BuildPlan, key: str) -> Path:
    """Return the folder of what the place encoder learned."""
    return plan.folder("keyframes", key) / "places"


def describe_lots(plan: BuildPlan, work: KeyframeLots) -> None:
    """Encode lots of keyframes and store each lot in its folder."""
    left = sum(map(len, work.lots.values()))
    place_state = checkpoints.load_checkpoint(work.places, _Facts, work.key).arrays
    blind = plan.encoders.without(Kind.VIEWS)  # the views are encoded ahead, in batches
    with closing(_viewed(plan, work.frames, list(work.lots.values()))) as viewed:
        ahead = progress(
            viewed, "seeing", total=work.total, done=work.total - left, unit="keyframe", note=lambda: _from_store(plan)
        )
        for folder, lot in work.lots.items():
            begin = perf_counter()
            seen = [
                replace(
                    describe_keyframe(frame, blind, place_state, plan.settings.keyframes, work.local.get(index)),
                    view=view,
                )
                for index, frame, view in islice(ahead, len(lot))
            ]
            pieces = stack_keyframes(seen)
            arrays = fields_of(pieces)
            checkpoints.save_checkpoint(folder, work.key, _Facts(perf_counter() - begin), arrays)
        for _ in ahead:  # nothing is left; this completes the bar
            pass


def _viewed(plan: BuildPlan, good: Recording, lots: Sequence[Int[np.ndarray, " k"]]) -> Generator[_Viewed]:
    """Yield keyframes with their view features; decoding and encoding each run ahead in a thread."""
    encoder = plan.encoders.views if Kind.VIEWS in plan.encoders else None
    size = _VIEWS_ON_TORCH if encoder and plan.encoders.sources[Kind.VIEWS].on_torch else 1
    frames = ((int(index), good.frame(int(index))) for lot in lots for index in lot)
    with closing(run_ahead(frames, max(2, size))) as decoded:
        yield from run_ahead(_encoded(decoded, list(map(len, lots)), encoder, size), max(2, size))


def _encoded(
    decoded: Iterator[tuple[int, Frame]], lengths: Sequence[int], encoder: ViewEncoder | None, size: int
) -> Generator[_Viewed]:
    """Encode views, at most ``size`` at once; no batch reaches from one lot into the next."""
    for length in lengths:
        lot = islice(decoded, length)
        while group := list(islice(lot, size)):
            given = [frame.copy() for _, frame in group]
            views = unmasked(encoder.encode(given)) if encoder else np.zeros((len(group), 0), np.float32)
            yield from ((index, frame, view) for (index, frame), view in zip(group, views, strict=True))


def _from_store(plan: BuildPlan) -> str:
    """Return how many keyframes the store holds whole: the lowest count of their kinds of features."""
    kinds = (Kind.VIEWS, Kind.LOCAL, Kind.PLACE)
    notes = [cache_note(plan.encoders, kind) for kind in kinds]
    return min((words for words in notes if words), key=lambda words: int(words.split()[0]), default="")


def fused_frames(parts: Sequence[MapPart]) -> Int[np.ndarray, " n"]:
    """Return the numbers of the frames that are in the parts, rising."""
    covered = [np.arange(*span) for part in parts for span in part.info.spans]
    bad = [frame.index for part in parts for frame in part.info.bad_frames]
    return np.setdiff1d(np.concatenate(covered), np.array(bad, np.int64))


def concat_keyframes(pieces: Sequence[Keyframes]) -> Keyframes:
    """Put keyframes one after the other; none without pieces."""
    return concat(pieces) if pieces else stack_keyframes([])
