"""What several microphones on a robot hear: every channel with its own delays.

The model is that of ``impulse`` (direct sound, doorways and walls, image sources of the source's own room, a late field
that decays as the coupled rooms do), with what a direction shows in added:
- the direct sound and each reflection reach each microphone when its own distance says so, by windowed sinc delays;
  what comes round a corner comes from the last corner;
- the late field is a sum of plane waves from all around that carry independent noise, so that it is diffuse: between
  two microphones it has the coherence sin(kd)/kd, and it changes as the robot moves;
- each microphone has noise of its own.
Not modelled besides what ``impulse`` leaves out: the robot's body, microphones that differ.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from avlmaps.recordings.channels import ChannelSound
from avlmaps.recordings.microphones import Microphones
from avlmaps_sim.hearing.acoustic import AcousticSettings, dry_clip, room_noise, unclipped
from avlmaps_sim.hearing.impulse import LATE_BY_S, LATE_FROM_S, NEAREST_M, Acoustics, arrivals, shaped_impulse
from avlmaps_sim.hearing.rooms import SPEED_M_S, Rooms
from avlmaps_sim.hearing.schedule import Sounding
from avlmaps_sim.hearing.sound_paths import Air, Way
from avlmaps_sim.scene import Scene

_STEP_S = 0.05  # the early part counts again after this; a robot moves 2 cm meanwhile
_LATE_EVERY = 4  # the late field counts again after this many of these steps
_WAVES = 64
_SINC_HALF = 16
_INAUDIBLE = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class _Heard:
    air: Air
    rooms: Rooms
    own: int
    source: Float[np.ndarray, "3"]


def heard_by_array(
    scene: Scene,
    soundings: Sequence[Sounding],
    stamps_s: Float[np.ndarray, " n"],
    world_from_camera: Float[np.ndarray, "n 4 4"],
    microphones: Microphones,
    duration_s: float,
    rng: np.random.Generator,
    settings: AcousticSettings | None = None,
) -> ChannelSound:
    """Return the recording of several microphones on a robot that drives through a building.

    A track whose peaks would be cut off is made quieter as a whole.
    """
    settings = settings or AcousticSettings()
    building = Acoustics(scene, settings.rate_hz, settings.rt60_s)
    samples = np.zeros((len(microphones), round(duration_s * settings.rate_hz)), np.float32)
    walk = stamps_s, microphones.in_world_m(world_from_camera)
    for sounding in soundings:
        heard = _moving(building, sounding, dry_clip(sounding, settings), walk, rng, settings.rate_hz)
        begin = round(sounding.onset_s * settings.rate_hz)
        length = min(heard.shape[1], samples.shape[1] - begin)
        samples[:, begin : begin + length] += heard[:, :length].astype(np.float32)
    level_db = settings.loudness_db - settings.snr_db
    for channel in samples:
        channel += room_noise(duration_s, level_db, settings.rate_hz, rng)
    return ChannelSound(unclipped(samples), settings.rate_hz)


def _moving(
    building: Acoustics,
    sounding: Sounding,
    dry: Float[np.ndarray, " n"],
    walk: tuple[Float[np.ndarray, " f"], Float[np.ndarray, "f m 3"]],
    rng: np.random.Generator,
    rate_hz: int,
) -> Float[np.ndarray, "m t"]:
    hop = round(_STEP_S * rate_hz)
    knots = np.arange(0, len(dry) + hop, hop)
    at_s = sounding.onset_s + knots / rate_hz
    flat = walk[1].reshape(len(walk[0]), -1)
    ears = np.stack([np.interp(at_s, walk[0], axis) for axis in flat.T], axis=1).reshape(len(knots), -1, 3)
    early, late = responses(building, np.asarray(sounding.source.position), ears, rng)
    out = _windowed(dry, early, hop)
    if late is None:
        return out
    more = _windowed(dry, late, hop * _LATE_EVERY)
    whole = np.zeros((out.shape[0], max(out.shape[1], more.shape[1])))
    whole[:, : out.shape[1]] += out
    whole[:, : more.shape[1]] += more
    return whole


def _windowed(dry: Float[np.ndarray, " n"], response: Float[np.ndarray, "k m t"], hop: int) -> np.ndarray:
    from scipy.signal import oaconvolve

    count, channels, taps = response.shape
    window = 1.0 - np.abs(np.arange(-hop, hop)) / hop
    padded = np.pad(dry, (hop, (count + 1) * hop))
    out = np.zeros((channels, (count + 1) * hop + taps))
    for number in range(count):
        begin = number * hop  # in `padded`, which is `hop` behind
        piece = oaconvolve((padded[begin : begin + 2 * hop] * window)[None], response[number], axes=1)
        out[:, begin : begin + piece.shape[1]] += piece
    return out[:, hop : hop + len(dry) + taps]


def responses(
    building: Acoustics, source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "k m 3"], rng: np.random.Generator
) -> tuple[Float[np.ndarray, "k m t"], Float[np.ndarray, "l m u"] | None]:
    """Return the early responses from a source to each microphone, and the late ones at every fourth place.

    A source in a wall is moved out of it; ``ears`` are the places of the microphones, time after time.

    Returns:
        In units of the direct sound at 1 m; the late field is None where the source is in no room.
    """
    middle = ears.mean(axis=1)
    air, rooms = building.floor_at(float(middle[:, 2].mean()))
    if building.floor_at(float(source[2]))[0] is not air:
        return _through_slab(building, source, ears), None
    own = air.room_at(source[:2])
    heard = _Heard(air, rooms, own, building.sounds_from(source))
    coarse = slice(0, None, _LATE_EVERY)
    ways = air.ways(heard.source, middle)
    reflections = building.image_sources(rooms, own, heard.source, middle[coarse])
    early = _early(building, heard, ears, ways, reflections)
    late = _late(building, heard, ears[coarse], ways[coarse], [one is not None for one in reflections], rng)
    return early, late


def _through_slab(building: Acoustics, source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "k m 3"]) -> np.ndarray:
    flat = [building.through_slab(source, ear) for ear in ears.reshape(-1, 3)]
    return np.stack(flat).reshape(*ears.shape[:2], -1)


def _early(
    building: Acoustics,
    heard: _Heard,
    ears: Float[np.ndarray, "k m 3"],
    ways: Sequence[Way],
    reflections: Sequence[tuple[Float[np.ndarray, "i 3"], Float[np.ndarray, " i"]] | None],
) -> Float[np.ndarray, "k m t"]:
    rate_hz = building.rate_hz
    first_s = np.array([min(delay_s for delay_s, _ in arrivals(way)) for way in ways])
    # From LATE_BY_S after the direct sound on the late field stands for the reflections; without it nothing does.
    span_s = LATE_BY_S + 0.01 if heard.own >= 0 else 0.03
    slowest_s = max(max(delay_s for delay_s, _ in arrivals(way)) for way in ways)
    length = round((max(slowest_s, first_s.max() + span_s) + 0.01) * rate_hz) + 160
    out = np.zeros((*ears.shape[:2], length))
    for number, way in enumerate(ways):
        for corner, gain in _gains(way):
            distance_m = _distances(heard.source, ears[number], way, corner)
            shape = shaped_impulse(gain, rate_hz) if np.ptp(gain) > 0 else gain[:1]
            scale = 1.0 if corner else np.linalg.norm(ears[number].mean(axis=0) - heard.source) / distance_m
            amplitude = np.broadcast_to(scale, distance_m.shape)
            for channel, (far_m, loud) in enumerate(zip(distance_m, amplitude, strict=True)):
                piece = np.convolve(_pulses(np.array([far_m / SPEED_M_S * rate_hz]), np.array([loud]), length),
                                    shape)[:length]  # fmt: skip
                out[number, channel] += piece
        seen = reflections[number // _LATE_EVERY]
        if seen is None:
            continue
        images, gains = seen
        distance_m = np.maximum(np.linalg.norm(images[None] - ears[number][:, None], axis=2), NEAREST_M)
        after_s = distance_m / SPEED_M_S - first_s[number]
        left = np.sqrt(1.0 - np.clip((after_s - LATE_FROM_S) / (LATE_BY_S - LATE_FROM_S), 0.0, 1.0))
        amplitude = left * gains / distance_m
        for channel in range(ears.shape[1]):
            loud = np.abs(amplitude[channel]) > _INAUDIBLE * np.abs(amplitude[channel]).max(initial=1e-9)
            at = distance_m[channel, loud] / SPEED_M_S * rate_hz
            out[number, channel] += _pulses(at, amplitude[channel, loud], length)
    return out


def _gains(way: Way) -> list[tuple[bool, Float[np.ndarray, " b"]]]:
    return [(number > 0, gain) for number, (_, gain) in enumerate(arrivals(way))]


def _distances(
    source: Float[np.ndarray, "3"], ears: Float[np.ndarray, "m 3"], way: Way, round_corner: bool
) -> Float[np.ndarray, " m"]:
    if not round_corner or way.corner is None:
        return np.maximum(np.linalg.norm(ears - source, axis=1), NEAREST_M)
    middle = ears.mean(axis=0)
    flat_m = np.sqrt(max(way.round_m**2 - (middle[2] - source[2]) ** 2, 0.0))
    before_m = flat_m - float(np.linalg.norm(middle[:2] - way.corner))
    around_m = before_m + np.linalg.norm(ears[:, :2] - way.corner, axis=1)
    return np.maximum(np.hypot(around_m, ears[:, 2] - source[2]), NEAREST_M)


def _pulses(at: Float[np.ndarray, " p"], amplitude: Float[np.ndarray, " p"], length: int) -> Float[np.ndarray, " t"]:
    out = np.zeros(length)
    whole = np.floor(at).astype(int)
    offset = np.arange(-_SINC_HALF + 1, _SINC_HALF + 1)
    away = offset[None] - (at - whole)[:, None]
    shape = np.sinc(away) * np.cos(np.pi * away / (2 * _SINC_HALF + 1)) ** 2
    index = whole[:, None] + offset[None]
    inside = (index >= 0) & (index < length)
    np.add.at(out, index[inside], (amplitude[:, None] * shape)[inside])
    return out


def _late(
    building: Acoustics,
    heard: _Heard,
    ears: Float[np.ndarray, "l m 3"],
    ways: Sequence[Way],
    reflects: Sequence[bool],
    rng: np.random.Generator,
) -> Float[np.ndarray, "l m t"] | None:
    envelope = building.late_envelope(heard.rooms, heard.own)
    if envelope is None:
        return None
    rate_hz, count = building.rate_hz, envelope.shape[2]
    size = 1 << int(np.ceil(np.log2(count + 0.1 * rate_hz)))
    noise = rng.standard_normal((_WAVES, count)) / np.sqrt(_WAVES)
    direction = _all_around(_WAVES)
    room = [heard.air.room_at(place[:2]) for place in ears.mean(axis=1)]
    rooms = sorted({one for one in room if one >= 0})
    coloured = building.coloured(noise, envelope[:, rooms])
    spectra: dict[int, Complex[np.ndarray, "w f"]] = {
        one: np.fft.rfft(field, size, axis=1).astype(np.complex64) for one, field in zip(rooms, coloured, strict=True)
    }
    out = np.zeros((*ears.shape[:2], count), np.float32)
    centre = ears.mean(axis=(0, 1))
    for number, place in enumerate(ears):
        if room[number] < 0:
            continue
        delay_s = (place - centre) @ direction.T / SPEED_M_S  # (m, w)
        turned = _turned(delay_s * rate_hz, size)
        summed = np.stack([(spectra[room[number]] * one).sum(axis=0) for one in turned])
        field = np.fft.irfft(summed, size, axis=1)[:, :count]
        first_s = min(delay for delay, _ in arrivals(ways[number]))
        begin_s, end_s = (LATE_FROM_S, LATE_BY_S) if reflects[number] else (0.0, 0.002)
        fade = np.clip((np.arange(count) / rate_hz - first_s - begin_s) / (end_s - begin_s), 0.0, 1.0)
        out[number] = np.sqrt(fade) * field
    return out


def _turned(delay: Float[np.ndarray, "m w"], size: int) -> Complex[np.ndarray, "m w f"]:
    fine, bins = 256, size // 2 + 1
    per_bin = -2j * np.pi * delay[..., None] / size
    low = np.exp(per_bin * np.arange(fine)).astype(np.complex64)
    high = np.exp(per_bin * fine * np.arange(-(-bins // fine))).astype(np.complex64)
    return (high[..., None] * low[:, :, None]).reshape(*delay.shape, -1)[..., :bins]


def _all_around(count: int) -> Float[np.ndarray, "w 3"]:
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * index
    flat = np.sqrt(1.0 - z**2)
    return np.column_stack([flat * np.cos(angle), flat * np.sin(angle), z])
