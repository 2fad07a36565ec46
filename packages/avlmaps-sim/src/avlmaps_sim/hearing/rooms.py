"""Reverberation of a floor: how much its rooms absorb, how they are joined, and how sound decays in all of them.

The statistical model of coupled rooms (Kuttruff, Room Acoustics): in each room the reverberant sound is evenly spread,
loses energy to absorption and to its neighbours through doorways and (a thousandth or so) through walls:

    V_i dE_i/dt = -c/4 (A_i + sum_j S_ij) E_i + c/4 sum_j S_ij E_j

In a single room this is Sabine's decay, 0.161 V/A seconds for 60 dB.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps_sim.hearing.sound_paths import Air
from avlmaps_sim.scene import Area, Scene, SceneObject

SPEED_M_S = 343.0
BANDS_HZ = np.array([125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0])
# Share of the energy that a surface takes, by octave: textbook values, rounded, and then raised a little for the small
# things and gaps that no scene has, so that furnished rooms come to the 0.4 to 0.5 s that surveys of dwellings report.
_PLASTER = np.array([0.24, 0.16, 0.10, 0.08, 0.08, 0.08, 0.08])
_BOARDS = np.array([0.16, 0.13, 0.11, 0.09, 0.08, 0.08, 0.08])
_TILES = np.array([0.01, 0.01, 0.015, 0.02, 0.02, 0.03, 0.03])
_WOODEN = np.array([0.18, 0.15, 0.12, 0.10, 0.10, 0.10, 0.10])
_SOFT = np.array([0.20, 0.35, 0.50, 0.60, 0.60, 0.55, 0.50])
_RUG = np.array([0.04, 0.08, 0.20, 0.35, 0.50, 0.60, 0.60])
_AIR_PER_M = np.array([0.0001, 0.0003, 0.0006, 0.001, 0.002, 0.007, 0.025])  # energy, at 20 degrees and 50 %
# What a light inner wall holds back, dB.
WALL_DB = np.array([20.0, 29.0, 36.0, 41.0, 43.0, 44.0, 46.0])

_STRUCTURE = frozenset({"wall", "floor", "ceiling", "column", "stairs", "railing", "window", "door", "folding door"})
_DOOR_M = 2.0
_WIDE_M = 1.6  # an opening wider than this has no lintel


@dataclass(frozen=True, slots=True, eq=False)
class Rooms:
    """The rooms of a floor as vessels of sound, by octave band."""

    areas: tuple[Area, ...]  # the rooms
    volume_m3: Float[np.ndarray, " r"]  # (r,) their volumes
    surface_m2: Float[np.ndarray, " r"]  # (r,) their walls, floors and ceilings
    absorbing_m2: Float[np.ndarray, "b r"]  # (b, r) their equivalent absorption areas, air included
    # (b, r, r) area through which two rooms pass sound to one another; a wall counts with what it lets by.
    joint_m2: Float[np.ndarray, "b r r"]

    @classmethod
    def of(cls, scene: Scene, air: Air) -> "Rooms":
        """Take the measures of a floor's rooms."""
        areas = air.areas
        size = np.array([_plan(area) for area in areas]).reshape(-1, 2)
        height = np.array([area.ceiling_m - area.floor_m for area in areas])
        volume, surface = size[:, 0] * height, 2 * size[:, 0] + size[:, 1] * height
        absorbing = np.zeros((len(BANDS_HZ), len(areas)))
        for index, area in enumerate(areas):
            entry = lexicon().find(area.kind, EntryKind.ROOM)
            floor = _TILES if entry is not None and entry.tiled else _BOARDS
            absorbing[:, index] = size[index, 0] * (floor + _PLASTER) + size[index, 1] * height[index] * _PLASTER
            absorbing[:, index] += 4.0 * _AIR_PER_M * volume[index]
            absorbing[:, index] += sum((_taken_by(thing) for thing in _things(scene, area)), np.zeros(len(BANDS_HZ)))
        return cls(areas, volume, surface, absorbing, _joints(air, height))

    def energy(self, source: int, times_s: Float[np.ndarray, " t"]) -> Float[np.ndarray, "b r t"]:
        """Return the reverberant energy a second in each room after an impulse in one of them, by band.

        In units of what an impulse's direct sound has at 1 m.
        """
        out = np.zeros((len(BANDS_HZ), len(self.areas), len(times_s)))
        root = np.sqrt(self.volume_m3)
        for band in range(len(BANDS_HZ)):
            joint = self.joint_m2[band]
            loss = np.diag(self.absorbing_m2[band] + joint.sum(axis=1)) - joint
            rate, mode = np.linalg.eigh(SPEED_M_S / 4.0 * loss / np.outer(root, root))
            decay = np.exp(-np.outer(rate, times_s))
            spread = mode @ (decay * mode[source][:, None]) / root[:, None] / root[source]
            out[band] = 16.0 * np.pi * SPEED_M_S / 4.0 * np.maximum(spread, 0.0)
        return out

    def rt60_s(self, room: int) -> float:
        """Return how long sound of 500 Hz and 1 kHz takes to fall by 60 dB in a room, its doorways counted as lost."""
        lost = (self.absorbing_m2[2:4, room] + self.joint_m2[2:4, room].sum(axis=1)).mean()
        return float(24.0 * np.log(10.0) * self.volume_m3[room] / (SPEED_M_S * lost))

    def reverberating(self, rt60_s: float) -> "Rooms":
        """Return the rooms with the absorption that makes each fall by 60 dB in a given time, at 500 Hz and 1 kHz.

        A room that loses more through its doorways alone falls faster; it then absorbs next to nothing.
        """
        lost = 24.0 * np.log(10.0) * self.volume_m3 / (SPEED_M_S * rt60_s)
        through = self.joint_m2[2:4].sum(axis=2).mean(axis=0)
        own = np.maximum(lost - through, 0.01 * self.surface_m2)
        return replace(self, absorbing_m2=self.absorbing_m2 * own / self.absorbing_m2[2:4].mean(axis=0))

    def mean_absorption(self, room: int) -> float:
        """Return the share of the energy that a room absorbs at each bounce around 1 kHz, over all its surfaces."""
        lost = (self.absorbing_m2[2:5, room] + self.joint_m2[2:5, room].sum(axis=1)).mean()
        return float(np.clip(lost / self.surface_m2[room], 0.01, 0.95))


def _plan(area: Area) -> tuple[float, float]:
    here, there = area.polygon, np.roll(area.polygon, -1, axis=0)
    signed = (here[:, 0] * there[:, 1] - there[:, 0] * here[:, 1]).sum() / 2
    return abs(float(signed)), float(np.linalg.norm(there - here, axis=1).sum())


def _things(scene: Scene, area: Area) -> list[SceneObject]:
    middle = np.array([thing.centre for thing in scene.objects]).reshape(-1, 3)
    inside = area.contains(middle[:, :2]) & (middle[:, 2] > area.floor_m - 0.1) & (middle[:, 2] < area.ceiling_m)
    return [thing for thing, here in zip(scene.objects, inside, strict=True) if here]


def _taken_by(thing: SceneObject) -> Float[np.ndarray, " b"]:
    x, y, z = thing.size
    if thing.category in _STRUCTURE:
        return np.zeros(len(BANDS_HZ))
    entry = lexicon().find(thing.category, EntryKind.THING)
    if entry is not None and entry.name == "carpet":
        return x * y * _RUG
    return (x * y + (x + y) * z) * (_SOFT if entry is not None and entry.soft else _WOODEN)


def _joints(air: Air, height_m: Float[np.ndarray, " r"]) -> Float[np.ndarray, "b r r"]:
    open_m, walled_m = air.joints_m()
    low = np.minimum.outer(height_m, height_m)
    open_m2 = open_m * np.where(open_m > _WIDE_M, low, np.minimum(low, _DOOR_M))
    let_by = 10.0 ** (-WALL_DB / 10.0)
    return open_m2[None] + let_by[:, None, None] * (walled_m * low)[None]
