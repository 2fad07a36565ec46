"""Heat that comes from truth or from no stored map, for ceilings; and the paper's baselines on a map shared with us."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, UInt8

from avlmaps.core.question import Modality, Part, Role
from avlmaps.perception.embedded import logmel
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.factors import Factor, NearAnchors, NearThings
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities import sound_factor
from avlmaps.query.settings import SoundSettings
from avlmaps.query.voxel_space import Space
from avlmaps.recordings.audio import AudioTrack, Sound, resample
from avlmaps_sim.bench.harness.evidence import room_distance_m
from avlmaps_sim.hearing.sound_library import Synthesised
from avlmaps_sim.scene import Area

_STOREY_M = 0.5  # an area reaches this far below its floor and above its ceiling
_WALL_M = 0.1  # and this far into its walls: a voxel of a thing at a wall may lie in it


@dataclass(frozen=True, eq=False)
class VoxelHeat(Factor):
    """Heat given voxel by voxel; only ever context, since it has no instances of its own."""

    space: Space
    part: Part
    voxel: Float32[np.ndarray, " n"]  # heat of every voxel, in [0, 1]
    found: bool = True
    falloff_per_m: float = 0.0
    understood: str = ""
    note: str = ""
    flat: bool = field(default=False, init=False)
    regional: bool = False  # whether it says in which region a voxel lies

    anchors = np.zeros((0, 3))
    instance = np.zeros(0, np.int64)
    confidence = np.zeros(0)

    def heat_and_anchors(
        self, among: Bool[np.ndarray, " n"] | None = None
    ) -> tuple[Float32[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return the heat; heat by voxel has no anchors."""
        heat = self.voxel if among is None else np.where(among, self.voxel, np.float32(0.0))
        return heat, np.full(len(heat), -1, np.int64)

    def at(self, points_world: Float[np.ndarray, "m 3"]) -> Float[np.ndarray, " m"]:
        """Return the heat of the nearest voxel to each point."""
        from scipy.spatial import KDTree

        if not len(self.space):
            return np.zeros(len(points_world))
        return self.voxel[KDTree(self.space.centres).query(points_world)[1]].astype(np.float64)

    def anchor_of(self, voxels: Int[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
        """Return nothing: heat by voxel has no anchors."""
        raise ValueError("heat given voxel by voxel has no anchors")


def true_things(space: Space, part: Part, falloff_per_m: float, label: Int[np.ndarray, " n"], own: Sequence[int]):
    """Return the heat of things whose voxels are truly known.

    ``label`` is the thing that each voxel is, ``own`` are those that match the query.
    """
    mask: Bool[np.ndarray, " n"] = np.isin(label, np.array(own, np.int64))
    instance = np.unique(label[mask], return_inverse=True)[1].reshape(-1)
    count = int(instance.max(initial=-1)) + 1
    return NearThings(space, part, falloff_per_m, mask, instance, np.ones(count, np.float32), count > 0)


def true_places(space: Space, part: Part, falloff_per_m: float, places: Sequence[Float[np.ndarray, "k 3"]]):
    """Return the heat around places that are truly known, each with score 1.

    For each thing that was heard or seen ``places`` are those along its track.
    """
    anchors = np.concatenate([np.zeros((0, 3)), *places])
    which = np.repeat(np.arange(len(places)), [len(track) for track in places])
    return NearAnchors(space, part, falloff_per_m, anchors, np.ones(len(anchors)), which, len(anchors) > 0)


def true_regions(space: Space, part: Part, areas: Sequence[Area]) -> VoxelHeat:
    """Return 1 in the rooms of the queried kind and 0 outside, the map of rooms being truly known."""
    inside = np.zeros(len(space), bool)
    for area in areas:
        if area.kind != part.query:
            continue
        z = space.centres[:, 2]
        within = (z > area.floor_m - _STOREY_M) & (z < area.ceiling_m + _STOREY_M)
        inside |= within & (room_distance_m(area.polygon, space.centres[:, :2]) <= _WALL_M)
    return VoxelHeat(space, part, inside.astype(np.float32), bool(inside.any()), regional=True)


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
