"""The suites behind `avlmaps bench`: run one, write its tables as JSON, Markdown and CSV."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from avlmaps.core.errors import RecordingError
from avlmaps.core.registry import Kind
from avlmaps.core.wording import option
from avlmaps.perception.encoders import Encoders
from avlmaps_sim.bench.harness.figures import BenchError, Table, in_words, markdown, write_answer
from avlmaps_sim.bench.harness.settings import checksums, models_of, shipped_checksums

if TYPE_CHECKING:
    from avlmaps_sim.bench.harness.settings import SceneSettings
    from avlmaps_sim.bench.indexing.runs import IndexingSettings
    from avlmaps_sim.bench.live.suite import LiveBench
    from avlmaps_sim.bench.navigation.missions import NavigationSettings
    from avlmaps_sim.bench.sources.suite import SourcesBench


@dataclass(frozen=True, slots=True)
class SuiteInputs:
    """The inputs of a suite."""

    sounds: Path | None = None  # folder of clips with an index.csv, for the suites of sound
    clips: Path | None = None  # the same, for ``sounds``: clips that are queried by name, dry and in rooms
    scenes: tuple[Path, ...] = ()  # recordings with poses, for ``locate``, ``recordings`` and ``live``
    nyuv2: Path | None = None  # folder of labelled frames, for ``frames``
    profile: str = "embedded"  # the models that are measured
    models: tuple[str, ...] = ()  # other backends than the profile's, ``module=backend[@model]``
    seed: int = 0  # of what is drawn at random
    # What the suites on scenes other than ``navigation`` are run on; its own defaults if None.
    indexing: "IndexingSettings | None" = None
    navigation: "NavigationSettings | None" = None  # what the suite ``navigation`` is run on; its own defaults if None
    # What the suite ``change`` is run on, and over how many days; its own defaults if None.
    change: "tuple[SceneSettings, int] | None" = None
    live: "LiveBench | None" = None  # laps and kills of the suite ``live``; its own defaults if None
    sources: "SourcesBench | None" = None  # what the suite ``sources`` is run on; its own defaults if None
    frames: int | None = None  # limit of labelled frames


def run_suite(suite: str, inputs: SuiteInputs, out: Path) -> dict[str, Any]:
    """Run a suite and write SUITE.json, SUITE.md and a CSV file for each table into ``out``.

    Args:
        suite: ``words``, ``language``, ``sounds``, ``segmentation``, ``locate``, ``frames``, ``recordings``,
            ``objects``, ``indexing``, ``found``, ``rooms``, ``change``, ``live``, ``sources`` or ``navigation``.
        inputs: what it measures on.
        out: folder to write into.

    Raises:
        BenchError: the folder or recording that the suite needs was not given, or the profile cannot be measured.
    """
    if suite in _ON_SCENES:
        module, _, function = _ON_SCENES[suite].partition(":")
        return getattr(import_module(module), function)(inputs.indexing, out)
    if suite == "change":
        from avlmaps_sim.bench.change.suite import DEFAULTS, run_change

        return run_change(*(inputs.change or DEFAULTS), out)
    if suite == "navigation":
        from avlmaps_sim.bench.navigation.suite import run_navigation

        return run_navigation(inputs.navigation, out)
    used = models_of(inputs.profile, inputs.models)
    weights = _weights(suite, used)
    if suite == "recordings":
        from avlmaps_sim.bench.recordings.suite import run

        tables = run(inputs.scenes, out, inputs.seed)
    elif suite == "live":
        from avlmaps_sim.bench.live.suite import LiveBench, run_live

        tables = run_live(inputs.scenes, used, inputs.profile, inputs.live or LiveBench(), inputs.seed, out)
    elif suite == "sources":
        from avlmaps_sim.bench.sources.suite import SourcesBench, run_sources

        _embedded_only(inputs, "sources")
        chosen = inputs.sources or SourcesBench()
        tables = run_sources(chosen, out, inputs.seed)
        return _written(suite, inputs, tables, [*chosen.homes], weights, out)
    else:
        tables = _SUITES[suite](inputs)
    sources = (inputs.sounds, inputs.clips, inputs.nyuv2, *inputs.scenes)
    scenes = [source.resolve().name for source in sources if source is not None]
    return _written(suite, inputs, tables, scenes, weights, out)


def _written(
    suite: str, inputs: SuiteInputs, tables: Mapping[str, Table], scenes: list[str], weights: dict[str, str], out: Path
) -> dict[str, Any]:
    """Write tables with where they come from, and return all of it."""
    answer = {
        "suite": suite,
        "scenes": scenes,
        "profile": inputs.profile,
        "models": list(inputs.models),
        "seed": inputs.seed,
        "weights": weights,
        "tables": tables,
    }
    return write_answer(answer, out, f"{in_words(answer)}\n\n{markdown(tables)}")


_ON_SCENES = {
    "indexing": "avlmaps_sim.bench.indexing.suite:run_indexing",
    "found": "avlmaps_sim.bench.found.suite:run_found",
    "rooms": "avlmaps_sim.bench.rooms.suite:run_rooms",
    "objects": "avlmaps_sim.bench.objects:run_objects",
}
# The modules that each suite measures; a model that is missing is named before anything else happens.
_MEASURED = {
    "sounds": (Kind.SOUNDS,),
    "locate": (Kind.LOCAL, Kind.PLACE, Kind.MATCHER),
    "frames": (Kind.PIXELS,),
    "live": (Kind.PIXELS,),
    "sources": (Kind.PIXELS, Kind.SOUNDS, Kind.VIEWS),
}


def _weights(suite: str, used: Encoders) -> dict[str, str]:
    if suite == "words":
        return {"words": shipped_checksums()["words"]}
    known = checksums(used)
    return {kind.value: known[kind.value] for kind in _MEASURED.get(suite, ()) if kind.value in known}


def _words(inputs: SuiteInputs) -> Mapping[str, Table]:
    from avlmaps_sim.bench import words

    _embedded_only(inputs, "words")
    return {"phrases kept out of training": words.run()}


def _sounds(inputs: SuiteInputs) -> Mapping[str, Table]:
    from avlmaps_sim.bench import sound_clips, sounds

    _embedded_only(inputs, "sounds")
    if inputs.clips is not None:
        return sound_clips.run(inputs.clips)
    return sounds.run(_clips(inputs))


def _segmentation(inputs: SuiteInputs) -> Mapping[str, Table]:
    from avlmaps_sim.bench import segmentation

    return {"sounds found in a track": segmentation.run(_clips(inputs), inputs.seed)}


def _locate(inputs: SuiteInputs) -> Mapping[str, Table]:
    from avlmaps.recordings.open import open_recording
    from avlmaps_sim.bench import locate

    if not inputs.scenes:
        raise BenchError(f"This suite measures on recordings with poses; name one or more with {option('scenes')}.")
    tables: dict[str, Table] = {}
    for path in inputs.scenes:
        recording = open_recording(path)
        if len(recording) < 20:
            raise RecordingError(f"{path} has {len(recording)} frames; half as map and half as photos takes 20.")
        tables[f"photos located in {path.resolve().name}"] = locate.run(
            recording, inputs.seed, used=models_of(inputs.profile, inputs.models)
        )
    return tables


def _frames(inputs: SuiteInputs) -> Mapping[str, Table]:
    from avlmaps.perception.embedded.pixels import EmbeddedPixels
    from avlmaps_sim.bench.frames import run_frames

    if inputs.nyuv2 is None:
        raise BenchError("This suite measures on labelled frames (docs/guides/train-eyes.md); name their folder with "
                         f"{option('nyuv2')}.")  # fmt: skip
    used = models_of(inputs.profile, inputs.models)
    encoder = used.pixels
    if not isinstance(encoder, EmbeddedPixels):
        raise BenchError(
            f"The suite frames sums probabilities of kinds, which the pixel encoder {used.name_of(Kind.PIXELS)!r} does "
            "not give. "
            "Choose the profile embedded, synthetic or trained."
        )
    return run_frames(encoder, inputs.nyuv2, inputs.frames)


def _language(_: SuiteInputs) -> Mapping[str, Table]:
    from avlmaps_sim.bench import language

    return language.run()


_SUITES: dict[str, Callable[[SuiteInputs], Mapping[str, Table]]] = {
    "words": _words,
    "language": _language,
    "sounds": _sounds,
    "segmentation": _segmentation,
    "locate": _locate,
    "frames": _frames,
}


def _clips(inputs: SuiteInputs) -> Path:
    if inputs.sounds is None:
        raise BenchError(
            f"This suite measures on a folder of clips with an index.csv; name it with {option('sounds')}."
        )
    return inputs.sounds


def _embedded_only(inputs: SuiteInputs, suite: str) -> None:
    if inputs.profile != "embedded":
        raise BenchError(f"The suite {suite} measures the embedded encoder; it has no figures for {inputs.profile!r}.")
    if inputs.models:
        raise BenchError(
            f"The suite {suite} measures the embedded encoder; leave out {option('model')} {' '.join(inputs.models)}."
        )
