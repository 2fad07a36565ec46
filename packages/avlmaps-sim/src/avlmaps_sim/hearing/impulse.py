"""The impulse response from a source to a microphone in a building.

What is modelled, in units of the direct sound at 1 m:
- the direct sound, 1/r, where no wall lies between; else what bends round through the doorways (1/length of the
  shortest path, held back as a thin screen would by Kurze and Anderson's formula, at most 24 dB) and what comes through
  the walls (1/r, each wall by a light partition's loss);
- early reflections in the source's own room, where the microphone is in it too: image sources of the room's polygon, by
  pyroomacoustics, with the room's mean absorption;
- the late field in every room: noise that decays as the coupled rooms do (``rooms``), band by band.
Doors that stand closed stop sound as walls do. Not modelled: furniture between source and microphone, reflections
that reach the next room, scattering, moving doors, Doppler shift, stairwells (another floor is audible through its slab
alone), the directivity of sources and microphone.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float

from avlmaps_sim.hearing.rooms import BANDS_HZ, SPEED_M_S, WALL_DB, Rooms
from avlmaps_sim.hearing.sound_paths import Air, Way
from avlmaps_sim.homes.plan import area_m2
from avlmaps_sim.scene import Area, Scene

TAPS = 128


def split(samples: Float[np.ndarray, " n"], rate_hz: int) -> Float[np.ndarray, "b n"]:
    """Return octave bands of a signal that sum up to it."""
    spectrum = np.fft.rfft(samples)
    octave = np.log2(np.maximum(np.fft.rfftfreq(len(samples), 1.0 / rate_hz), 1.0) / BANDS_HZ[0])
    share = np.clip(1.0 - np.abs(octave[None] - np.arange(len(BANDS_HZ))[:, None]), 0.0, 1.0)
    share[0, octave < 0] = 1.0
    share[-1, octave > len(BANDS_HZ) - 1] = 1.0
    return np.fft.irfft(spectrum[None] * share, len(samples), axis=1)


def shaped_impulse(gain: Float[np.ndarray, " b"], rate_hz: int) -> Float[np.ndarray, " taps"]:
    """Return a short impulse response with the given gains (amplitudes) at the bands, that begins at once.

    Minimum phase, by the folded cepstrum.
    """
    size = 8 * TAPS
    octave = np.log2(np.maximum(np.fft.rfftfreq(size, 1.0 / rate_hz), 1.0) / BANDS_HZ[0])
    log_gain = np.interp(octave, np.arange(len(BANDS_HZ)), np.log(np.maximum(gain, 1e-6)))
    cepstrum = np.fft.irfft(log_gain, size)
    cepstrum[1 : size // 2] *= 2.0
    cepstrum[size // 2 + 1 :] = 0.0
    return np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), size)[:TAPS]


_SLAB_DB = WALL_DB + 12.0
NEAREST_M = 0.3
_MOST_WALLS = 4
_MOST_DIFFRACTION_DB = 24.0
_LONGEST_S = 1.6
LATE_FROM_S, LATE_BY_S = 0.010, 0.030  # after the direct sound the late field fades in
_ORDER_OF_FEW_WALLS, _ORDER = 4, 3
_STEP_S = 0.002


@dataclass(eq=False)
class Acoustics:
    """A building prepared for impulse responses."""

    scene: Scene  # the building
    rate_hz: int  # samples a second
    # How long every room takes to fall by 60 dB at middling frequencies; as its surfaces say if None.
    rt60_s: float | None = None
    _floors: dict[float, tuple[Air, Rooms]] = field(default_factory=dict, init=False)

    def floor_at(self, height_m: float) -> tuple[Air, Rooms]:
        """Return the plan and the rooms of the floor that lies below a height."""
        areas = _areas(self.scene)
        levels = sorted({round(area.floor_m, 2) for area in areas}) or [float(self.scene.mesh.low[2])]
        floor_m = max((level for level in levels if level <= height_m + 0.3), default=levels[0])
        if floor_m not in self._floors:
            here = tuple(area for area in areas if abs(area.floor_m - floor_m) < 0.8)
            air = Air.of(self.scene, here, floor_m)
            rooms = Rooms.of(self.scene, air)
            self._floors[floor_m] = (air, rooms if self.rt60_s is None else rooms.reverberating(self.rt60_s))
        return self._floors[floor_m]

    def sounds_from(self, source: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """Return the place in the air that a source is taken to sound from: what lies in a wall is moved out of it."""
        air, _ = self.floor_at(float(source[2]))
        return np.array([*air.out_of_walls(source[:2], air.room_at(source[:2])), source[2]])

    def responses(
        self, source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "n 3"], rng: np.random.Generator
    ) -> list[Float[np.ndarray, " t"]]:
        """Return the impulse response from a source to each of several places, in the same units.

        A source in a wall is moved out of it. The noise of the late field is the same for all places.
        """
        air, rooms = self.floor_at(float(ears[:, 2].mean()))
        if self.floor_at(float(source[2]))[0] is not air:
            return [self.through_slab(source, ear) for ear in ears]
        own = air.room_at(source[:2])
        source = self.sounds_from(source)
        late = self._late(rooms, own, rng)
        early = self._images(rooms, own, source, ears)
        found = []
        for ear, images, way in zip(ears, early, air.ways(source, ears), strict=True):
            room = air.room_at(ear[:2])
            found.append(self._response(way, images, late[room] if late is not None and room >= 0 else None))
        return found

    def _response(
        self, way: Way, images: Float[np.ndarray, "i 2"] | None, late: Float[np.ndarray, " t"] | None
    ) -> Float[np.ndarray, " t"]:
        rate_hz = self.rate_hz
        length = round(_LONGEST_S * rate_hz) if late is None else len(late)
        out = np.zeros(length)
        arriving = arrivals(way)
        for delay_s, gain in arriving:
            _add(out, delay_s * rate_hz, shaped_impulse(gain, rate_hz) if np.ptp(gain) > 0 else gain[:1])
        first_s = min(delay_s for delay_s, _ in arriving)
        fade = np.clip((np.arange(length) / rate_hz - first_s - LATE_FROM_S) / (LATE_BY_S - LATE_FROM_S), 0.0, 1.0)
        if images is None:
            fade = np.clip((np.arange(length) / rate_hz - first_s) / 0.002, 0.0, 1.0)
        else:
            for distance_m, gain in images:
                at = distance_m / SPEED_M_S * rate_hz
                left = 1.0 - fade[min(int(at), length - 1)] if late is not None else 1.0
                _add(out, at, np.array([np.sqrt(left) * gain / distance_m]))
        return out if late is None else out + np.sqrt(fade) * late

    def _late(self, rooms: Rooms, own: int, rng: np.random.Generator) -> Float[np.ndarray, "r t"] | None:
        envelope = self.late_envelope(rooms, own)
        if envelope is None:
            return None
        noise = split(rng.standard_normal(envelope.shape[2]), self.rate_hz)
        out = np.zeros(envelope.shape[1:])
        for band in range(len(BANDS_HZ)):
            for room in range(len(rooms.areas)):
                out[room] += envelope[band, room] * noise[band]
        return out

    def late_envelope(self, rooms: Rooms, own: int) -> Float[np.ndarray, "b r t"] | None:
        """Return by band the amplitude of the late field in every room of a source in one; None outdoors."""
        if own < 0:
            return None
        longest_s = min(_LONGEST_S, 1.1 * max(rooms.rt60_s(room) for room in range(len(rooms.areas))) + 0.1)
        coarse = np.arange(0.0, longest_s + _STEP_S, _STEP_S)
        energy = rooms.energy(own, coarse)
        times_s = np.arange(round(longest_s * self.rate_hz)) / self.rate_hz
        out = np.zeros((*energy.shape[:2], len(times_s)))
        for band in range(len(BANDS_HZ)):
            for room in range(len(rooms.areas)):
                out[band, room] = np.sqrt(np.interp(times_s, coarse, energy[band, room]) / self.rate_hz)
        return out

    def coloured(
        self, noise: Float[np.ndarray, "w t"], envelope: Float[np.ndarray, "b r t"]
    ) -> Float[np.ndarray, "r w t"]:
        """Return each of several noises with the envelope of each band, for each room."""
        return np.stack([(split(one, self.rate_hz)[:, None] * envelope).sum(axis=0) for one in noise], axis=1)

    def _images(
        self, rooms: Rooms, own: int, source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "n 3"]
    ) -> list[Float[np.ndarray, "i 2"] | None]:
        """Return distance and gain of the reflections at each place in the source's own room, elsewhere None.

        The direct sound is not among them.
        """
        out: list[Float[np.ndarray, "i 2"] | None] = []
        for ear, found in zip(ears, self.image_sources(rooms, own, source, ears), strict=True):
            if found is None:
                out.append(None)
                continue
            distance_m = np.linalg.norm(found[0] - ear, axis=1)
            out.append(np.column_stack([np.maximum(distance_m, NEAREST_M), found[1]]))
        return out

    def image_sources(
        self, rooms: Rooms, own: int, source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "n 3"]
    ) -> list[tuple[Float[np.ndarray, "i 3"], Float[np.ndarray, " i"]] | None]:
        """Return place and gain of the image sources that each place sees in the source's own room, elsewhere None.

        The source itself is not among them.
        """
        seen_from: list[tuple[Float[np.ndarray, "i 3"], Float[np.ndarray, " i"]] | None] = [None] * len(ears)
        if own < 0:
            return seen_from
        area = rooms.areas[own]
        inside = _inside(area, ears)
        if not inside.any() or not _inside(area, source[None]).all():
            return seen_from
        import pyroomacoustics as pra

        absorbing = pra.Material(rooms.mean_absorption(own))
        order = _ORDER_OF_FEW_WALLS if len(area.polygon) <= 8 else _ORDER
        corners = np.asarray(area.polygon if area_m2(area.polygon) > 0 else area.polygon[::-1], np.float64)
        box = pra.Room.from_corners(corners.T, fs=self.rate_hz, max_order=order, materials=absorbing)
        box.extrude(area.ceiling_m - area.floor_m, materials=absorbing)
        down = np.array([0.0, 0.0, area.floor_m])
        box.add_source(source - down)
        box.add_microphone_array((ears[inside] - down).T)
        box.image_source_model()
        made = box.sources[0]
        places, gains, orders = made.images.T + down, made.damping[0], made.orders
        visible = box.visibility or []
        for index, seen in zip(np.flatnonzero(inside), visible[0], strict=True):
            kept = np.asarray(seen, bool) & (orders > 0)
            seen_from[index] = places[kept], gains[kept]
        return seen_from

    def through_slab(self, source: Float[np.ndarray, "3"], ear: Float[np.ndarray, "3"]) -> Float[np.ndarray, " t"]:
        """Return the sound on another floor: only what comes straight through the slab between."""
        distance_m = max(float(np.linalg.norm(ear - source)), NEAREST_M)
        out = np.zeros(round(_LONGEST_S * self.rate_hz))
        gain = 10.0 ** (-_SLAB_DB / 20.0) / distance_m
        _add(out, distance_m / SPEED_M_S * self.rate_hz, shaped_impulse(gain, self.rate_hz))
        return out


def arrivals(way: Way) -> list[tuple[float, Float[np.ndarray, " b"]]]:
    """Return delay and gain by band of what arrives first: straight, or round corners and through walls."""
    straight_m = max(way.straight_m, NEAREST_M)
    if way.clear:
        return [(straight_m / SPEED_M_S, np.full(len(BANDS_HZ), 1.0 / straight_m))]
    through = 10.0 ** (-min(way.walls, _MOST_WALLS) * WALL_DB / 20.0) / straight_m
    found = [(straight_m / SPEED_M_S, through)]
    if np.isfinite(way.round_m):
        fresnel = 2.0 * (way.round_m - way.straight_m) * BANDS_HZ / SPEED_M_S
        root = np.sqrt(2.0 * np.pi * np.maximum(fresnel, 1e-6))
        loss_db = np.minimum(5.0 + 20.0 * np.log10(root / np.tanh(root)), _MOST_DIFFRACTION_DB)
        round_m = max(way.round_m, NEAREST_M)
        found.append((round_m / SPEED_M_S, 10.0 ** (-loss_db / 20.0) / round_m))
    return found


def _add(out: Float[np.ndarray, " t"], at: float, piece: Float[np.ndarray, " k"]) -> None:
    whole = int(np.floor(at))
    for begin, share in ((whole, 1.0 - (at - whole)), (whole + 1, at - whole)):
        count = min(len(piece), len(out) - begin)
        if count > 0:
            out[begin : begin + count] += share * piece[:count]


def _areas(scene: Scene) -> tuple[Area, ...]:
    if scene.areas:
        return scene.areas
    if not any(thing.category == "wall" for thing in scene.objects):
        return ()
    (ax, ay, az), (bx, by, bz) = scene.mesh.low.tolist(), scene.mesh.high.tolist()
    return (Area("room", np.array([[ax, ay], [bx, ay], [bx, by], [ax, by]]), az, max(bz, az + 2.0), "all"),)


def _inside(area: Area, places: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    return area.contains(places[:, :2]) & (places[:, 2] > area.floor_m) & (places[:, 2] < area.ceiling_m)
