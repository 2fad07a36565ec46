"""Options repeat defaults and choices of the settings behind them, so that --help loads nothing; none may differ."""

import dataclasses
import inspect
import types
from collections.abc import Callable, Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest

from avlmaps.api import build_map
from avlmaps.cli.build import Build
from avlmaps.cli.go import Chat
from avlmaps.cli.verb import ModelVerb, Reading, Verb
from avlmaps.cli.verbs import VERBS
from avlmaps.language.chat.settings import ChatSettings
from avlmaps.live.replay import follow, replay
from avlmaps.maps.fusion.sensor import FusionSettings, SensorName
from avlmaps.maps.settings import BuildSettings, FrameSettings, GravitySettings
from avlmaps.navigate.bodies import BodyShape
from avlmaps.navigate.skills import RobotSettings
from avlmaps.perception.cache.feature_store import CacheSettings
from avlmaps.perception.models.settings import ModelSettings, Precision
from avlmaps.query.asking import Asked
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.selection import Wanted
from avlmaps.query.settings import QuerySettings, Rules, SoundSettings
from avlmaps.recordings.consistency.verdict import Reason
from avlmaps.recordings.open import open_recording
from avlmaps.serve.drive.robots import RobotFile
from avlmaps.serve.settings import ServeSettings
from avlmaps_models.import_reference.convert import ImportSettings
from avlmaps_sim.bench.indexing import IndexingSettings
from avlmaps_sim.bench.live.suite import LiveBench
from avlmaps_sim.bench.navigation import NavigationSettings
from avlmaps_sim.bench.sources.suite import SourcesBench
from avlmaps_sim.demo.run import run_demo
from avlmaps_sim.mixing.add_sounds import add_sounds
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.verbs.bench import Indexing, Navigation

EVERYWHERE = ("json", "models", "device", "precision")  # checked once, by test_the_models_options
GROUPS = {
    "bench.indexing": Indexing, "bench.navigation": Navigation, "go.chat": Chat,
    "build.reading": Reading, "live.reading": Reading, "info.reading": Reading, "add-sounds.reading": Reading,
    "calibrate.reading": Reading,
}  # fmt: skip
OPTIONS: dict[str, type] = {**VERBS, **GROUPS}


def of(settings: type | Callable[..., Any], name: str) -> Callable[[], Any]:
    """Return a function that returns the default of a settings' field, or of a function's argument."""

    def default() -> Any:
        if dataclasses.is_dataclass(settings):
            return defaults(settings)[name]
        return inspect.signature(settings).parameters[name].default

    return default


def defaults(options: Any) -> dict[str, Any]:
    """Return the default of each field of a dataclass that has one."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(options):
        if field.default is not dataclasses.MISSING:
            found[field.name] = field.default
        elif field.default_factory is not dataclasses.MISSING:
            found[field.name] = field.default_factory()
    return found


def size_as_words() -> str:
    return "x".join(map(str, RecordSettings().size))


SAME: dict[str, Callable[[], Any]] = {
    "build.profile": of(build_map, "profile"),
    "build.voxel_size_m": of(BuildSettings, "voxel_size_m"),
    "build.seed": of(BuildSettings, "seed"),
    "build.frame_step": of(FrameSettings, "step"),
    "build.max_bad_share": of(FrameSettings, "max_bad_share"),
    "build.max_depth_m": of(FusionSettings, "max_depth_m"),
    "build.sensor": of(FusionSettings, "sensor"),
    "build.camera_height_m": of(GravitySettings, "camera_height_m"),
    "build.feature_cache": of(CacheSettings, "place"),
    "build.feature_cache_gb": of(CacheSettings, "limit_gb"),
    "build.format": of(open_recording, "format"),
    "build.audio": of(open_recording, "audio"),
    "live.profile": of(build_map, "profile"),
    "live.voxel_size_m": of(BuildSettings, "voxel_size_m"),
    "live.format": of(open_recording, "format"),
    "live.rate": of(replay, "rate"),
    "live.port": of(ServeSettings, "port"),
    "live.give_up_s": of(follow, "give_up_s"),
    "info.format": of(open_recording, "format"),
    "add-sounds.format": of(open_recording, "format"),
    "calibrate.format": of(open_recording, "format"),
    "add-sounds.seed": of(add_sounds, "seed"),
    "add-sounds.interval_s": of(add_sounds, "interval_s"),
    "add-sounds.min_distance_m": of(add_sounds, "min_distance_m"),
    "add-sounds.loudness_db": of(add_sounds, "loudness_db"),
    "add-sounds.background": of(add_sounds, "background"),
    "add-sounds.snr_db": of(add_sounds, "snr_db"),
    "record.seed": of(record_scene, "seed"),
    "record.sounds": of(RecordSettings, "sounds"),
    "record.category": of(RecordSettings, "categories"),
    "record.sources": of(RecordSettings, "sources"),
    "record.ambiguous": of(RecordSettings, "ambiguous"),
    "record.directions_offset_deg": of(RecordSettings, "directions_offset_deg"),
    "record.directions_outliers": of(RecordSettings, "directions_outliers"),
    "record.hearing": of(RecordSettings, "hearing"),
    "record.microphones": of(RecordSettings, "microphones"),
    "record.sensor": of(RecordSettings, "sensor"),
    "record.size": size_as_words,
    "record.fov_deg": of(RecordSettings, "fov_deg"),
    "record.fps": of(RecordSettings, "fps"),
    "record.max_frames": of(RecordSettings, "max_frames"),
    "record.semantic": of(RecordSettings, "semantic"),
    "record.colour": of(RecordSettings, "colour"),
    "record.workers": of(RecordSettings, "workers"),
    "demo.seed": of(run_demo, "seed"),
    "import-map.cell_size_m": of(ImportSettings, "cell_size_m"),
    "import-map.max_bad_share": of(ImportSettings, "max_bad_share"),
    "import-map.sounds": of(ImportSettings, "track"),
    "import-map.hear_with": of(ImportSettings, "hear_with"),
    "query.top": of(AVLMap.ask, "top"),
    "query.found_at": of(QuerySettings, "found_at"),
    "go.found_at": of(QuerySettings, "found_at"),
    "view.found_at": of(QuerySettings, "found_at"),
    "serve.found_at": of(ServeSettings, "found_at"),
    "serve.at": of(ServeSettings, "at"),
    "things.least": of(AVLMap.contents, "least_confidence"),
    "things.page": of(Wanted, "page"),
    "rooms.least": of(AVLMap.rooms, "least_confidence"),
    "sources.least": of(AVLMap.sources, "least"),
    "sources.prior": of(SoundSettings, "prior"),
    "query.at": of(SoundSettings, "at"),
    "go.at": of(SoundSettings, "at"),
    "view.at": of(SoundSettings, "at"),
    "export.least": of(AVLMap.things, "least_confidence"),
    "export.radius_m": of(BodyShape, "radius_m"),
    "export.height_m": of(BodyShape, "height_m"),
    "view.host": of(ServeSettings, "host"),
    "serve.host": of(ServeSettings, "host"),
    "serve.port": of(ServeSettings, "port"),
    "serve.allow_host": of(ServeSettings, "allowed_hosts"),
    "serve.tls_cert": of(ServeSettings, "tls_certificate"),
    "serve.tls_key": of(ServeSettings, "tls_key"),
    "go.guess": of(RobotSettings, "guess"),
    "go.body": of(RobotFile, "body"),
    "shell.body": of(RobotFile, "body"),
    "go.ros": of(RobotFile, "ros"),
    "shell.guess": of(RobotSettings, "guess"),
    "bench.profile": of(NavigationSettings, "profile"),
    "bench.seed": of(NavigationSettings, "seed"),
    "bench.sounds": of(NavigationSettings, "sounds"),
    "bench.indexing.hearing": of(IndexingSettings, "hearing"),
    "bench.indexing.sensor": of(IndexingSettings, "sensor"),
    "bench.indexing.rules": of(IndexingSettings, "rules"),
    "bench.indexing.sound_clips": of(IndexingSettings, "clips"),
    "bench.indexing.frames": of(IndexingSettings, "frames"),
    "bench.indexing.tasks_a_scene": of(IndexingSettings, "tasks_a_scene"),
    "bench.indexing.jobs": of(IndexingSettings, "jobs"),
    "bench.indexing.tasks": of(IndexingSettings, "load"),
    "bench.indexing.save_tasks": of(IndexingSettings, "save"),
    "bench.navigation.sequences": of(NavigationSettings, "sequences"),
    "bench.navigation.language": of(NavigationSettings, "language"),
    "bench.navigation.guess": of(NavigationSettings, "guess"),
    "bench.laps": of(LiveBench, "laps"),
    "bench.trials": of(SourcesBench, "trials"),
    "bench.rate": of(LiveBench, "rate"),
    "bench.kills": of(LiveBench, "kills"),
    "bench.ends": of(LiveBench, "ends"),
}
# What a person meets first: nothing behind them has such a default.
OWN = {
    "build.rules", "query.rules", "query.sentence", "demo.out", "bench.out", "bench.indexing.size",
    "go.language", "go.robot", "query.frame", "things.frame", "rooms.frame", "sources.frame", "locate.frame",
    "view.port", "live.source",
}  # fmt: skip


def options() -> Iterator[tuple[str, Any]]:
    """Go through the options of every verb but those that all verbs have: name and default."""
    for verb, kind in OPTIONS.items():
        for name, value in defaults(kind).items():
            if name not in EVERYWHERE and f"{verb}.{name}" not in GROUPS:
                yield f"{verb}.{name}", value


@pytest.mark.parametrize("name", SAME)
def test_a_default_is_the_settings_own(name: str) -> None:
    assert dict(options())[name] == SAME[name]()


def test_every_default_is_checked_or_is_nobodys_but_the_command_lines() -> None:
    """An option without a value (no, none, an empty list) leaves the choice to what is behind it."""
    valued = {name for name, value in options() if value is not None and value is not False and value != ()}
    assert valued - set(SAME) - OWN == set()
    assert not OWN & set(SAME)
    assert valued >= OWN and set(SAME) <= {name for name, _ in options()}


def choices(kind: type, field: str) -> set[Any]:
    """Return the words that a field takes; nothing where it takes any."""
    return words(get_type_hints(kind, include_extras=True)[field])


def words(hint: Any) -> set[Any]:
    if get_origin(hint) is Literal:
        return set(get_args(hint))
    if get_origin(hint) in (Annotated, Union, types.UnionType):
        return set().union(*(words(part) for part in get_args(hint)[: 1 if get_origin(hint) is Annotated else None]))
    return set()


@pytest.mark.parametrize(
    ("verb", "field", "known"),
    [
        ("build", "rules", words(Rules)),
        ("query", "rules", words(Rules)),
        ("build", "sensor", words(SensorName)),
        ("record", "hearing", choices(RecordSettings, "hearing")),
        ("record", "sensor", choices(RecordSettings, "sensor")),
        ("record", "colour", choices(RecordSettings, "colour")),
        ("bench.indexing", "hearing", choices(IndexingSettings, "hearing")),
        ("bench.indexing", "sensor", choices(IndexingSettings, "sensor")),
        ("bench.indexing", "rules", choices(IndexingSettings, "rules")),
        ("bench.indexing", "sound_clips", choices(IndexingSettings, "clips")),
        ("query", "at", choices(SoundSettings, "at")),
        ("go", "at", choices(SoundSettings, "at")),
        ("sources", "prior", choices(SoundSettings, "prior")),
        ("go", "robot", choices(RobotFile, "robot")),
        ("go", "body", choices(RobotFile, "body")),
        ("shell", "body", choices(RobotFile, "body")),
        ("bench.navigation", "language", choices(NavigationSettings, "language")),
    ],
)
def test_the_choices_are_the_settings_own(verb: str, field: str, known: set[str]) -> None:
    assert known and choices(OPTIONS[verb], field) == known


def test_the_models_options() -> None:
    assert choices(ModelVerb, "precision") == words(Precision) == choices(ModelSettings, "precision")
    assert defaults(Verb) == {"json": False}
    assert set(defaults(ModelVerb)) == set(EVERYWHERE)
    assert all(value is None for name, value in defaults(ModelVerb).items() if name != "json")


def test_chat_options_leave_it_to_the_settings() -> None:
    assert set(defaults(Chat).values()) == {None}
    assert {name.removeprefix("chat_") for name in defaults(Chat)} == {"model", "url", "replay"}
    assert {"model", "base_url", "replay"} <= set(defaults(ChatSettings))


def test_every_reason_can_be_allowed() -> None:
    kinds = get_args(get_type_hints(Build)["allow"])
    assert words(kinds[0]) == {reason.value for reason in Reason}


def test_options_of_reading_leave_it_to_the_recording() -> None:
    assert set(defaults(Reading).values()) == {None, ()}
    assert not Reading().corrections()


def test_a_sentence_and_its_parts_give_as_many_goals() -> None:
    assert Asked(sentence="bed").top == of(AVLMap.ask, "top")()
