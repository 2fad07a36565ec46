"""The plan of a build, and where it stores what it has finished."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Generic

import numpy as np

from avlmaps.core.errors import MapError
from avlmaps.core.files import sampled_digest
from avlmaps.core.progress import say
from avlmaps.maps.partial_maps import BUILD_VERSION, fusion_key
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.checkpoints import Checkpoint, F, find_checkpoint, key_of, load_checkpoint, save_checkpoint
from avlmaps.maps.store.manifest import MapInfo, ModelInfo
from avlmaps.maps.store.manifest_file import MANIFEST, parse_manifest, read_manifest
from avlmaps.maps.store.own_files import remove_stages
from avlmaps.maps.store.reader import PARTS
from avlmaps.maps.store.writer import is_map_or_free, sweep
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.content import LARGEST_BUDGET_BYTES
from avlmaps.recordings.types import Recording


@dataclass(frozen=True, slots=True)
class Plan:
    """A build's ingredients.

    Attributes:
        recording: what to map.
        path: the map's folder.
        used: which models perceive.
        settings: all that can be chosen.
        models: the models' cards, by module.
        key: hash of all ingredients; two builds with one key make one map.
        fusion_key: hash of those that the sums over frames depend on.
        doubts: what is odd about the recording, one sentence each.
    """

    recording: Recording
    path: Path
    used: Encoders
    settings: BuildSettings
    models: dict[str, ModelInfo]
    key: str
    fusion_key: str
    doubts: tuple[str, ...] = ()

    def folder(self, stage: str, key: str) -> Path:
        """Return where a stage stores what it finished, one folder for each key."""
        return self.path / PARTS / f"{stage}-{key[:12]}"

    def rng(self, stage: int) -> np.random.Generator:
        """Return a stage's own source of randomness, the same in every run, independent of the other stages."""
        return np.random.default_rng([self.settings.seed, stage])


@dataclass(frozen=True, slots=True)
class Computed(Generic[F]):
    """What a stage computed and its checkpoint stores.

    Attributes:
        facts: all that is not an array.
        arrays: by name.
        files: other files by name; they are copied.
    """

    facts: F
    arrays: Mapping[str, np.ndarray] = field(default_factory=dict[str, np.ndarray])
    files: Mapping[str, Path] = field(default_factory=dict[str, Path])


def stage(
    plan: Plan,
    name: str,
    key: str,
    facts: type[F],
    compute: Callable[[Path], Computed[F]],
    *,
    within: str = "",
    usable: Callable[[F], bool] = lambda _: True,
) -> Checkpoint[F]:
    """Return the checkpoint of a stage; compute and store it where there is none.

    A stage is read back even when it was computed a moment ago, so that a resumed build sees the same.

    Args:
        plan: of the build.
        name: of the stage, for its folder.
        key: hash of all that it depends on (``key_of``).
        facts: type of its facts.
        compute: is given the folder of the checkpoint; what it puts beside that folder it removes itself.
        within: a folder within the stage's, where it has several checkpoints.
        usable: whether a checkpoint may stand; else it is computed again.
    """
    folder = plan.folder(name, key) / within
    found = find_checkpoint(folder, facts, key)
    if found is None or not usable(found.facts):
        done = compute(folder)
        save_checkpoint(folder, key, done.facts, done.arrays, done.files)
        found = load_checkpoint(folder, facts, key)
    return found


def make_plan(recording: Recording, path: Path, used: Encoders, settings: BuildSettings) -> Plan:
    """Gather the ingredients and refuse what cannot be built.

    Raises:
        MapError: the recording has no frames, or the path is not a place for a map.
        BackendError: a model is missing.
    """
    if len(recording) == 0:
        raise MapError(f"{recording.path} has no frames with a pose; there is nothing to build a map from.")
    if not is_map_or_free(path):
        raise MapError(f"{path} is there already and is not a map; give another --out, nothing in it was touched.")
    settings = settings.for_profile(used.weight_variance_m2)
    models = {kind.value: ModelInfo.of(used.sources[kind].chosen, card) for kind, card in used.cards().items()}
    key = key_of("map", BUILD_VERSION, recording.fingerprint, audio_key(recording), used.name, models, settings)
    return Plan(recording, path, used, settings, models, key, fusion_key(recording, settings, used))


def audio_key(recording: Recording) -> list[str | float] | None:
    """Return the values that identify a sound track: a recording can be given another one."""
    track = recording.audio
    if track is None:
        return None
    content = sampled_digest(track.path, LARGEST_BUDGET_BYTES).hex()
    return [track.path.name, content, track.rate_hz, track.duration_s, track.start_s]


def claim(plan: Plan, resume: bool, overwrite: bool) -> MapInfo | None:
    """Check that the folder may be built into; return the map that is there if it is this very one.

    Args:
        plan: of the build.
        resume: keep what a stopped build had finished.
        overwrite: whether a finished map may be replaced.

    Raises:
        MapError: there is a finished map from something else, or a damaged one, and ``overwrite`` is not set.
    """
    manifest = plan.path / MANIFEST
    if manifest.is_file() and not overwrite:
        there = parse_manifest(read_manifest(manifest), manifest)
        if there.build_key != plan.key:
            raise MapError(
                f"{plan.path} is a finished map already, of {there.recording.name} {_difference(plan, there)}; give "
                "another --out, or replace it with --overwrite."
            )
        say(f"{plan.path} is finished already, from the same recording with the same settings; nothing to do.")
        sweep(plan.path, there)
        return there
    if not resume:
        remove_stages(plan.path / PARTS)
    return None


def require_unchanged(plan: Plan, stamp: str) -> None:
    """Refuse to continue with a recording whose files were written since the build began.

    What was made of it is removed, since nobody knows which frames are old and which are new.

    Args:
        plan: of the build.
        stamp: the recording's ``change_stamp`` before the first frame was read.

    Raises:
        MapError: the recording has changed.
    """
    if plan.recording.change_stamp() == stamp:
        return
    remove_stages(plan.path / PARTS)
    raise MapError(
        f"Files of {plan.recording.path} were written while it was mapped, so that the map would be of two recordings; "
        "run the same build again when it is complete."
    )


def _difference(plan: Plan, there: MapInfo) -> str:
    """Return in words how the finished map's ingredients differ from this build's."""
    if there.recording.fingerprint != plan.recording.fingerprint:
        return "(another recording, or it has changed)"
    if there.profile != plan.used.name:
        return f"with the profile {there.profile}"
    if there.settings != plan.settings:
        return "with other settings"
    if there.models != plan.models:
        return "with other models"
    return "with another sound track or an older avlmaps"
