"""The stage of the sounds: the events in the recording's track, where there is one and a model for it."""

import shutil
from dataclasses import dataclass
from time import perf_counter

import msgspec

from avlmaps.core.registry import Kind
from avlmaps.maps.pipeline.plan import BUILD_VERSION, BuildPlan, audio_key
from avlmaps.maps.store.checkpoints import Computed, key_of, load_or_compute
from avlmaps.maps.store.tables import as_kind, fields_of
from avlmaps.maps.types import HeardSounds


class _Facts(msgspec.Struct):
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class SoundResult:
    """Outcome of the sound stage: what was heard, and the seconds it took."""

    sounds: HeardSounds
    elapsed_s: float


def detect_sounds(plan: BuildPlan) -> SoundResult:
    """Find the sounds in the track; none where there is no track, or no model for them."""
    if plan.recording.audio is None or Kind.SOUNDS not in plan.encoders:
        return SoundResult(silence(plan), 0.0)
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
        clips = {f"clips/{clip.name}": clip for clip in heard.clips}
        return Computed(_Facts(perf_counter() - begin), fields_of(heard), clips)

    found = load_or_compute(folder, key, _Facts, compute)
    shutil.rmtree(scratch, ignore_errors=True)
    sounds = as_kind(HeardSounds, found.arrays, found.folder, clips=tuple(found.files.values()))
    return SoundResult(sounds, found.facts.elapsed_s)


def silence(plan: BuildPlan) -> HeardSounds:
    """Return no sounds, with features as long as the model's."""
    from avlmaps.maps.audio.events import collect

    model = plan.models.get(Kind.SOUNDS.value)
    return collect([], model.dim if model else 0)
