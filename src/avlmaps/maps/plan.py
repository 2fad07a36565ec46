"""The plan of a build: what it is made of, which frames it fuses, and where it stores what it has finished."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from avlmaps.core.errors import MapError
from avlmaps.core.files import sampled_digest
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.maps.keyframes import select_keyframes
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.folder import MANIFEST, PARTS, is_map_or_free, read_info, remove_parts, sweep
from avlmaps.maps.store.manifest import MapInfo, ModelInfo
from avlmaps.maps.store.tables import SUFFIX, key_of
from avlmaps.perception.encoders import Encoders
from avlmaps.recordings.types import LARGEST_BUDGET_BYTES, Recording

BUILD_VERSION = 9  # raise it when a stage comes to compute something else, so that no old checkpoint is taken for new

Span = tuple[int, int, int]  # (first, last + 1, step) of frames


@dataclass(frozen=True, slots=True)
class BuildPlan:
    """A build's ingredients; two builds with one key make one map."""

    recording: Recording
    path: Path
    encoders: Encoders
    settings: BuildSettings
    models: dict[str, ModelInfo]  # by module
    key: str  # hash of all ingredients
    keyframes: frozenset[int]  # numbers of frames
    looks: frozenset[int]  # those that are given to the pixel encoder; the others add their surfaces and colours

    def spans(self) -> dict[Path, Span]:
        """Return the stretches of frames that are fused one after the other, by the files of what they bring."""
        count, step = len(self.recording), self.settings.frames.step
        stride = self.settings.frames.summed * step
        home = self.path / PARTS / f"frames-{key_of('frames', self.key, self.recording.base_height)[:12]}"
        return {home / f"{at:08d}{SUFFIX}": (at, min(at + stride, count), step) for at in range(0, count, stride)}


def make_plan(recording: Recording, path: Path, encoders: Encoders, settings: BuildSettings) -> BuildPlan:
    """Gather the ingredients and refuse what cannot be built."""
    if len(recording) == 0:
        raise MapError(f"{recording.path} has no frames with a pose; there is nothing to build a map from.")
    require_place(path, overwrite=True)
    settings = settings.for_profile(encoders.weight_variance_m2)
    models = models_of(encoders)
    key = key_of("map", BUILD_VERSION, recording.fingerprint, audio_key(recording), encoders.name, models, settings)
    frames = settings.frames
    keyframes = looks = frozenset(select_keyframes(recording, settings.keyframes, frames.step).tolist())
    if not encoders.keyframes_only and 0.0 in (frames.look_m, frames.look_deg):
        looks = frozenset(range(0, len(recording), frames.step))
    elif not encoders.keyframes_only:
        limits = replace(settings.keyframes, translation_m=frames.look_m, rotation_deg=frames.look_deg)
        looks |= frozenset(select_keyframes(recording, limits, frames.step).tolist())
    return BuildPlan(recording, path, encoders, settings, models, key, keyframes, looks)


def require_place(path: Path, overwrite: bool) -> None:
    """Raise ``MapError`` where no map can go: on something else, or on a map that is not to be replaced."""
    if not is_map_or_free(path):
        raise MapError(f"{path} is there already and is not a map; give another path, nothing in it was touched.")
    if (path / MANIFEST).is_file() and not overwrite:
        raise MapError(
            f"{path} is a finished map already; give another path, or replace it with {option('overwrite')}."
        )


def models_of(encoders: Encoders) -> dict[str, ModelInfo]:
    """Return the cards of encoders, by module."""
    return {kind.value: ModelInfo.of(encoders.sources[kind].chosen, card) for kind, card in encoders.cards().items()}


def audio_key(recording: Recording) -> list[Any] | None:
    """Return the values that identify a sound track: a recording can be given another one."""
    track = recording.audio
    if track is None:
        return None
    said, array = track.directions, track.microphones
    files = (track.path, *(() if array is None else track.files[1:]))
    known: list[Any] = [track.path.name, track.rate_hz, track.duration_s, track.start_s]
    known += [sampled_digest(path, LARGEST_BUDGET_BYTES).hex() for path in files]
    if said is not None:
        values = said.stamp_s, said.azimuth_rad, said.elevation_rad, said.confidence
        known += [[value.tolist() for value in values], said.known_rad]
    if array is not None:
        late_s = None if array.delay_s is None else array.delay_s.tolist()
        known += [array.position_m.tolist(), array.camera_from_robot.tolist(), array.channels, late_s]
    return known


def claim(plan: BuildPlan, resume: bool, overwrite: bool) -> MapInfo | None:
    """Check that the folder may be built into; return the map that is there if it is this very one."""
    there = None if overwrite else read_info(plan.path)
    if there is not None:
        if there.build_key != plan.key:
            raise MapError(
                f"{plan.path} is a finished map already, of {there.recording.name} with {_difference(plan, there)}; "
                f"give another {option('out')}, or replace it with {option('overwrite')}."
            )
        say(f"{plan.path} is finished already, from the same recording with the same settings; nothing to do.")
        sweep(plan.path, there)
        return there
    if not resume:
        remove_parts(plan.path)
    return None


def require_unchanged(plan: BuildPlan, stamp: str) -> None:
    """Refuse to continue with a recording whose files were written since the build began.

    What was made of it is removed, since nobody knows which frames are old and which are new.
    """
    if plan.recording.change_stamp() == stamp:
        return
    remove_parts(plan.path)
    raise MapError(
        f"Files of {plan.recording.path} were written while it was mapped, so that the map would be of two recordings; "
        "run the same build again when it is complete."
    )


def _difference(plan: BuildPlan, there: MapInfo) -> str:
    rows = (
        ("another recording, or one that has changed", there.recording.fingerprint, plan.recording.fingerprint),
        (f"the profile {there.profile}", there.profile, plan.encoders.name),
        ("other settings", there.settings, plan.settings),
        ("other models", there.models, plan.models),
    )
    return next((what for what, one, other in rows if one != other), "another sound track or an older avlmaps")


def strip_folder(sentence: str, recording: Recording) -> str:
    """Return a sentence about a recording without the folders that it and its sound lie in: a map may travel."""
    track = recording.audio
    for path in (recording.path, *(() if track is None else (track.path, *track.files))):
        sentence = sentence.replace(str(path), path.name)
    return sentence
