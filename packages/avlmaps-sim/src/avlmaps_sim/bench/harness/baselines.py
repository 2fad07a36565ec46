"""The paper's baselines on a map that they share with us: a weaker sound encoder, and retrieval without a pose."""

from functools import cached_property

import numpy as np
from jaxtyping import UInt8

from avlmaps.core.question import Modality, Part, Role
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities.sound import SoundSettings, sound_factor
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps_sim.bench.harness.factors import true_places
from avlmaps_sim.bench.harness.weak_sounds import weak_ear


class WeakHearing:
    """The sounds of a map, as a weaker sound encoder scores them.

    Args:
        avlmap: the map.
        seed: of the ear's examples.
    """

    def __init__(self, avlmap: AVLMap, seed: int) -> None:
        self._avlmap, self._seed = avlmap, seed

    def heat(self, name: str, role: Role) -> Heatmap:
        """Return the heat of a kind of sound."""
        avlmap = self._avlmap
        scores = weak_ear(self._seed).scores(self._clips, name)
        part = Part(Modality.SOUND, name, role)
        factor = sound_factor(
            avlmap.space, avlmap.stored.sounds, scores, part, SoundSettings(), avlmap.settings.heat
        )  # fmt: skip
        return Heatmap.of(factor)

    @cached_property
    def _clips(self) -> list[Sound]:
        stored = self._avlmap.stored
        return [AudioTrack.open(stored.clip_path(i)).read() for i in range(len(stored.sounds))]


def alike_keyframe(avlmap: AVLMap, rgb: UInt8[np.ndarray, "h w 3"], name: str, role: Role) -> Heatmap:
    """Return the heat around the place where the keyframe most like a picture was taken."""
    stored = avlmap.stored
    local = stored.encoders.local.encode(rgb)
    place = stored.encoders.place.encode(rgb, local, stored.place_state)
    best = int(np.argmax(np.asarray(stored.keyframes.place, np.float32) @ place))
    pose = np.asarray(stored.keyframes.world_from_camera[best], np.float64)
    part = Part(Modality.IMAGE, name, role, is_file=True)
    return Heatmap.of(true_places(avlmap.space, part, avlmap.settings.heat.falloff_per_m(role), [pose[None, :3, 3]]))
