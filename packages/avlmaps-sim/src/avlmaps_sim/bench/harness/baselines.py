"""The paper's baselines on a map that they share with us: a weaker sound encoder, and retrieval without a pose."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Float32, UInt8

from avlmaps.core.question import Modality, Part, Role
from avlmaps.perception.embedded import logmel
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities.sound import sound_factor
from avlmaps.query.settings import SoundSettings
from avlmaps.recordings.audio import AudioTrack, Sound, resample
from avlmaps_sim.bench.harness.factors import true_places
from avlmaps_sim.hearing import Synthesised

_EXAMPLES = 4
_SOFTNESS = 6.0  # of the posterior over kinds, in mean squared standard deviations


@dataclass(frozen=True, slots=True, eq=False)
class WeakSounds:
    """Kinds of sound by the mean and the spread of their log-mel spectra; four synthesised examples of each."""

    names: tuple[str, ...]
    mean: Float[np.ndarray, "k d"]
    scale: Float[np.ndarray, " d"]

    @classmethod
    def learnt(cls, rng: np.random.Generator, names: Sequence[str] | None = None) -> "WeakSounds":
        """Learn the kinds that there is a rule for, or only some of them."""
        bank = Synthesised()
        names = tuple(bank.categories if names is None else names)
        examples = [[_feature(bank.draw(name, rng)[1]) for _ in range(_EXAMPLES)] for name in names]
        features = np.array(examples)
        mean = features.mean(axis=1)
        return cls(names, mean, np.maximum((features - mean[:, None]).std(axis=(0, 1)), 1e-3))

    def scores(self, sounds: Sequence[Sound], name: str) -> Float[np.ndarray, " sounds"]:
        """Return how likely each sound is of a kind; zero for a kind that is not known by that very name."""
        if name not in self.names or not sounds:
            return np.zeros(len(sounds))
        features = np.array([_feature(sound) for sound in sounds])
        off = (((features[:, None] - self.mean) / self.scale) ** 2).mean(axis=2)
        weight = np.exp(-(off - off.min(axis=1, keepdims=True)) / _SOFTNESS)
        return (weight / weight.sum(axis=1, keepdims=True))[:, self.names.index(name)]


@lru_cache(maxsize=1)
def weak_ear(seed: int) -> WeakSounds:
    """Return the ear of a seed; synthesising its examples takes longer than a scene's questions, so it learns once."""
    return WeakSounds.learnt(np.random.default_rng([seed, 1]))


def _feature(sound: Sound) -> Float32[np.ndarray, " d"]:
    mels = logmel.normalised(logmel.mel_power(resample(sound, logmel.RATE_HZ).samples))
    log = np.log10(mels)
    return np.concatenate([log.mean(axis=0), log.std(axis=0)])


class WeakHearing:
    """The sounds of a map, as a weaker sound encoder scores them."""

    def __init__(self, avlmap: AVLMap, seed: int) -> None:
        self._avlmap, self._seed = avlmap, seed

    def heat(self, name: str, role: Role) -> Heatmap:
        """Return the heat of a kind of sound."""
        avlmap = self._avlmap
        scores = weak_ear(self._seed).scores(self._clips, name)
        part = Part(Modality.SOUND, name, role)
        factor = sound_factor(
            avlmap.space, avlmap.data.sounds, scores, part, SoundSettings(), avlmap.settings.heat
        )  # fmt: skip
        return Heatmap.of(factor)

    @cached_property
    def _clips(self) -> list[Sound]:
        return [AudioTrack.open(clip).read() for clip in self._avlmap.data.sounds.clips]


def alike_keyframe(avlmap: AVLMap, rgb: UInt8[np.ndarray, "h w 3"], name: str, role: Role) -> Heatmap:
    """Return the heat around the place where the keyframe most like a picture was taken."""
    keyframes, used = avlmap.data.keyframes, avlmap.encoders
    place = used.place.encode(rgb, used.local.encode(rgb), avlmap.data.place_state)
    best = int(np.argmax(np.asarray(keyframes.place, np.float32) @ place))
    pose = np.asarray(keyframes.world_from_camera[best], np.float64)
    part = Part(Modality.IMAGE, name, role, is_file=True)
    return Heatmap.of(true_places(avlmap.space, part, avlmap.settings.heat.falloff_per_m(role), [pose[None, :3, 3]]))
