"""The stage of the sounds: the events in the recording's track, where there is one and a model for it."""

import shutil
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import msgspec

from avlmaps.core.registry import Kind
from avlmaps.maps.pipeline.plan import BUILD_VERSION, BuildPlan, audio_key
from avlmaps.maps.store.array_validation import array_fields, validate_arrays
from avlmaps.maps.store.checkpoints import Computed, key_of, load_or_compute
from avlmaps.maps.types import HeardSounds


class _Facts(msgspec.Struct):
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class SoundResult:
    """Outcome of the sound stage: what was heard, where the clips lie, and the seconds it took."""

    sounds: HeardSounds
    clips_folder: Path
    elapsed_s: float


def detect_sounds(plan: BuildPlan) -> SoundResult:
    """Find the sounds in the track; none where there is no track, or no model for them."""
    if plan.recording.audio is None or Kind.SOUNDS not in plan.encoders:
        return SoundResult(silence(plan), plan.path, 0.0)
    settings, model = plan.settings.hearing, plan.models[Kind.SOUNDS.value]
    key = key_of("sounds", BUILD_VERSION, plan.recording.fingerprint, audio_key(plan.recording), settings, model)

    folder = plan.folder("sounds", key)
    scratch = folder.with_name("clips.unfinished")

    def compute() -> Computed[_Facts]:
        from avlmaps.maps.audio.events import detect_events

        begin = perf_counter()
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir(parents=True)
        heard = detect_events(plan.recording, plan.encoders.sounds, settings, scratch)
        arrays = {name: getattr(heard, name) for name in array_fields(HeardSounds)}
        clips = {f"clips/{number:06d}": scratch / Path(clip).name for number, clip in enumerate(heard.clips)}
        return Computed(_Facts(perf_counter() - begin), arrays, clips)

    found = load_or_compute(folder, key, _Facts, compute)
    shutil.rmtree(scratch, ignore_errors=True)
    names = tuple(path.name for path in found.files.values())
    sounds = validate_arrays(HeardSounds, {**found.arrays, "clips": names}, str(found.folder))
    return SoundResult(sounds, found.folder / "clips", found.facts.elapsed_s)


def silence(plan: BuildPlan) -> HeardSounds:
    """Return no sounds, with features as long as the model's."""
    from avlmaps.maps.audio.events import collect

    model = plan.models.get(Kind.SOUNDS.value)
    return collect([], model.dim if model else 0)
