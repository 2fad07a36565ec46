"""Sources in homes: the normal walk with each array, its map, and each sound's source against the truth.

What sounds is drawn by each home's own number, so that homes differ in their kinds of sound, and twice for each walk.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from time import perf_counter
from zlib import crc32

import msgspec
import numpy as np
from jaxtyping import Float

from avlmaps.core.errors import MapError, RecordingError
from avlmaps.core.files import write_bytes_atomically
from avlmaps.core.progress import say
from avlmaps.core.timeline import Trajectory
from avlmaps.core.version import __version__
from avlmaps.maps import sources
from avlmaps.maps.audio.events import detect_events
from avlmaps.maps.build import build_map
from avlmaps.maps.sources.bearings import Device
from avlmaps.maps.sources.find import find_sources
from avlmaps.maps.types import HeardSounds
from avlmaps.query import sound_sources
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.contents import Thing
from avlmaps.query.sound_sources import Joined, SourceMap, things_that_may_be
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import ChannelSound, read_channels, with_microphones, write_channels
from avlmaps.recordings.open import open_recording
from avlmaps.recordings.types import Recording
from avlmaps_sim.bench.harness.evidence import room_distance_m
from avlmaps_sim.bench.sources.calibrated import Wrong, calibrated
from avlmaps_sim.hearing.acoustic import AcousticSettings
from avlmaps_sim.hearing.directions import said_directions
from avlmaps_sim.hearing.impulse import Acoustics
from avlmaps_sim.recorder import RecordSettings, record_scene, sound_again
from avlmaps_sim.scene import Area, Scene, SceneObject
from avlmaps_sim.truth import HeardEvent, Truth, read_truth

RECORDED = "square4"
ARRAYS: dict[str, tuple[int, ...]] = {"square4": (0, 1, 2, 3), "stereo": (0, 1), "mono": (0,)}
"""Channels of the square of four that each array has: its two front ones are 0.2 m apart."""


def track_of(track: AudioTrack, array: str, folder: Path) -> AudioTrack:
    """Return a track of the channels of one of ``ARRAYS``, written into a folder."""
    assert track.microphones is not None
    chosen = ARRAYS[array]
    whole = read_channels(track, track.start_s, track.end_s)
    path = folder / f"{array}.flac"
    write_channels(path, ChannelSound(whole.samples[list(chosen)], whole.rate_hz))
    return with_microphones(AudioTrack.open(path, track.start_s), track.microphones.take(chosen))


SNR_DB = 20.0
DEVICE, GIVEN, REFINED = "a device's directions", "square4, put wrong", "square4, put wrong, calibrated"
WAYS = (*ARRAYS, DEVICE)
"""What places sounds with and without the lexicon; the other two show what calibration is worth."""
_OUTLIERS = 0.03
_UNKNOWN = float("nan")
_SETS = 2  # of sounds on the walk of a home
_RECIPE = 3  # counts up when the measurement changes, so that what is stored is measured again
_FRAMES, _SIZE, _FPS = 300, (160, 120), 5.0
_OVERLAP_S = 0.2
_AT_M = 0.3


def code_of() -> str:
    """Return a checksum of the code that finds sources: what it has measured is measured again when it changes."""
    files = [*sorted(Path(sources.__file__).parent.glob("*.py")), Path(sound_sources.__file__)]
    return sha256(b"".join(file.read_bytes() for file in files)).hexdigest()


_CODE = code_of()  # of the code as it was loaded


@dataclass(frozen=True, slots=True)
class HomeJob:
    """One home to measure. Sounds are made by rule where there is no folder of clips."""

    spec: str
    work: Path
    seed: int = 0
    sounds: Path | None = None


@dataclass(frozen=True, slots=True)
class Placed:
    """One sound as one array placed it, or as a baseline did.

    Errors are on the plan. Regions of more than ``held_from`` hold the truth (None of a baseline); ``right`` is the
    probability within 0.5 m of it. ``thing`` says whether the right one is among the first three, None where no thing
    made it; ``same_room`` whether the robot was in the source's room.
    """

    array: str
    error_m: float
    room: bool | None
    held_from: float | None = None
    area_90_m2: float = _UNKNOWN
    thing: bool | None = None
    same_room: bool = True
    elapsed_s: float = _UNKNOWN
    voxels: int = 0
    right: float = _UNKNOWN
    seconds: float = _UNKNOWN

    def is_in(self, probability: float) -> bool:
        """Return whether the region of a probability holds the truth."""
        return self.held_from is not None and self.held_from < probability


@dataclass(frozen=True, slots=True)
class Mended:
    """What was found out of a device that says directions, and of an array that was put wrong.

    Places and delays are errors of the array's worst channel, as given and calibrated; NaN where none was put wrong, or
    where calibration was refused.
    """

    places_m: tuple[float, float] = (_UNKNOWN, _UNKNOWN)
    delays_s: tuple[float, float] = (_UNKNOWN, _UNKNOWN)
    device_off_deg: float = _UNKNOWN
    device_sd_deg: float = _UNKNOWN


@dataclass(frozen=True, slots=True)
class HomeOutcome:
    """What was measured in one home, of one set of sounds."""

    spec: str
    sounds: int
    heard: int
    placed: tuple[Placed, ...]
    mended: Mended | None = None


def measure_home(job: HomeJob, open_spec: Callable[[str], Scene]) -> tuple[HomeOutcome, ...]:
    """Record, map and measure one home, each set of sounds; what is there already is not made again."""
    scene = open_spec(job.spec)
    name = "".join(c if c.isalnum() else "-" for c in job.spec)
    folder = job.work / f"{name}-{job.seed}"
    recording_path = folder / "recording"
    folder.mkdir(parents=True, exist_ok=True)
    settings = RecordSettings(
        size=_SIZE, fps=_FPS, max_frames=_FRAMES, hearing="acoustic", microphones=RECORDED, snr_db=SNR_DB, sources=14,
        ambiguous=2, sounds=job.sounds, workers=1,
    )  # fmt: skip
    if not recording_path.exists():
        record_scene(scene, folder / "recording.unfinished", settings, job.seed)
        (folder / "recording.unfinished").rename(recording_path)
    avlmap = _map_of(recording_path, folder / "home.avlmap")
    home = _Home(job, scene, settings, recording_path, avlmap)
    outcomes: list[HomeOutcome] = []
    for number in range(_SETS):
        facts = (_RECIPE, __version__, avlmap.data.info.build_key, _CODE, number)
        done = folder / f"outcome-{sha256(repr(facts).encode()).hexdigest()[:12]}.msgpack"
        if not done.exists():
            write_bytes_atomically(done, msgspec.msgpack.encode(home.outcome(folder / f"sounds-{number}", number)))
        outcomes.append(msgspec.msgpack.decode(done.read_bytes(), type=HomeOutcome))
    return tuple(outcomes)


def _map_of(recorded: Path, path: Path) -> AVLMap:
    recording = open_recording(recorded)
    assert recording.audio is not None
    recording.audio = replace(recording.audio, microphones=None)
    try:  # a finished one is taken as it is
        return AVLMap(build_map(recording, path, progress=False))
    except MapError:  # by another release
        return AVLMap(build_map(recording, path, overwrite=True, progress=False))


@dataclass(frozen=True, slots=True, eq=False)
class _Played:
    events: tuple[HeardEvent, ...]
    audio: AudioTrack
    heard: HeardSounds


@dataclass(frozen=True, slots=True, eq=False)
class _Home:
    job: HomeJob
    scene: Scene
    settings: RecordSettings
    recorded: Path
    avlmap: AVLMap

    def outcome(self, folder: Path, number: int) -> HomeOutcome:
        folder.mkdir(exist_ok=True)
        recording, truth = open_recording(self.recorded), read_truth(self.recorded)
        rng = np.random.default_rng([self.job.seed, crc32(self.job.spec.encode()), number])
        played = self._played(recording, folder, rng)
        heard, things = played.heard, self.avlmap.things()
        spans = list(zip(heard.onset_s.tolist(), heard.offset_s.tolist(), strict=True))
        pairs = matched(played.events, spans)
        air = Acoustics(self.scene, 22_050)
        true = {index: air.sounds_from(np.array(played.events[index].source)) for index, _ in pairs}
        tracks = {array: track_of(played.audio, array, folder) for array in ARRAYS}
        offset_rad = float(rng.uniform(-np.pi, np.pi))
        sounds, walk = [(event.onset_s, event.offset_s, event.source) for event in played.events], recording.walk
        said = said_directions(self.scene, sounds, walk.stamps_s, walk.world_from_body, rng, offset_rad, _OUTLIERS)
        tracks[DEVICE] = replace(tracks["mono"], microphones=None, directions=said)
        mended = Mended()
        if not number:
            more, mended = self._wrong(played.audio, folder, rng)
            tracks |= more
        placed: list[Placed] = []
        for way, track in tracks.items():
            begin = perf_counter()
            evidence = find_sources(track, walk, spans, self.avlmap.points, self.avlmap.data.up_in_world)
            each_s = (perf_counter() - begin) / max(len(spans), 1)
            if evidence is None:
                continue
            if len(evidence.device):
                device = Device.of(evidence.device[0])
                off = np.angle(np.exp(1j * (device.offset_rad - offset_rad)))
                mended = replace(
                    mended, device_off_deg=float(abs(np.rad2deg(off))),
                    device_sd_deg=float(np.rad2deg(device.offset_sd_rad)),
                )  # fmt: skip
            known = SourceMap.of(self.avlmap, evidence)
            for index, row in pairs:
                event = played.events[index]
                for prior in (False, True) if way in WAYS else (False,):
                    name = f"{way}, lexicon" if prior else way
                    one = known.joined([row], event.category, prior)
                    placed.append(self._placed(name, known, one, event, true[index], truth, things, each_s))
        for index, row in pairs:
            robot = heard.track[heard.track_offsets[row] : heard.track_offsets[row + 1]]
            placed += baselines(played.events[index], true[index], truth.areas, things, robot)
        return HomeOutcome(self.job.spec, len(played.events), len(pairs), tuple(placed), mended)

    def _played(self, recording: Recording, folder: Path, rng: np.random.Generator) -> _Played:
        own = recording.audio
        assert own is not None and own.microphones is not None
        track, soundings = sound_again(self.scene, recording.walk, own.end_s - own.start_s, self.settings, rng)
        assert isinstance(track, ChannelSound)
        write_channels(folder / "track.flac", track)
        recording.audio = AudioTrack.open(folder / "track.flac", own.start_s)
        encoder, hearing = self.avlmap.encoders.sounds, self.avlmap.data.info.settings.hearing
        walked = Trajectory(recording.stamps_s, recording.world_from_camera)
        heard = detect_events(recording.audio, walked, encoder, hearing, folder / "clips")
        events = tuple(
            HeardEvent(one.onset_s, one.offset_s, one.source.category, one.source.clip, one.robot, one.source.position,
                       one.source.instance)
            for one in soundings
        )  # fmt: skip
        return _Played(events, with_microphones(recording.audio, own.microphones), heard)

    def _wrong(self, audio: AudioTrack, folder: Path, rng: np.random.Generator) -> tuple[dict[str, AudioTrack], Mended]:
        assert audio.microphones is not None
        wrong = Wrong.of(audio.microphones, rng)
        tracks = {GIVEN: wrong.track(read_channels(audio, audio.start_s, audio.end_s), folder / "wrong.flac")}
        room = AcousticSettings(snr_db=SNR_DB, rt60_s=float(rng.uniform(0.3, 0.8)))
        before_m, before_s = wrong.off(wrong.given)
        try:
            found = calibrated(wrong, room, rng, folder / "drive.wav").microphones
        except RecordingError as error:
            say(f"note: {self.job.spec}: the array was not calibrated: {error}")
            return tracks, Mended((before_m, _UNKNOWN), (before_s, _UNKNOWN))
        refined = replace(found, camera_from_robot=audio.microphones.camera_from_robot)
        tracks[REFINED] = replace(tracks[GIVEN], microphones=refined)
        after_m, after_s = wrong.off(refined)
        return tracks, Mended((before_m, after_m), (before_s, after_s))

    def _placed(
        self,
        name: str,
        known: SourceMap,
        one: Joined,
        event: HeardEvent,
        true: Float[np.ndarray, "3"],
        truth: Truth,
        things: Sequence[Thing],
        each_s: float,
    ) -> Placed:
        at, plan = known.position_of(one), one.density.plan
        cell = nearest_held(plan.is_held, plan.cell_of(true[None, :2])[0])
        likely = [number for number, _ in things_that_may_be(known, one, things)]
        return Placed(
            name,
            float(np.linalg.norm(at[:2] - true[:2])),
            in_room(truth.areas, true, at),
            one.density.likelier_than(cell),
            one.density.area_m2(0.9),
            right_thing(event, truth.objects, likely, things),
            same_room(truth.areas, event.source, event.robot),
            each_s,
            len(self.avlmap.space),
            one.density.spread.right,
            event.offset_s - event.onset_s,
        )


def matched(events: Sequence[HeardEvent], spans_s: Sequence[tuple[float, float]]) -> list[tuple[int, int]]:
    """Return pairs of true sounds and detected ones: for each true one the detected one that overlaps it most."""
    pairs: list[tuple[int, int]] = []
    for index, event in enumerate(events):
        shared = [min(event.offset_s, end) - max(event.onset_s, begin) for begin, end in spans_s]
        if shared and max(shared) > _OVERLAP_S:
            pairs.append((index, int(np.argmax(shared))))
    return pairs


def nearest_held(is_held: np.ndarray, cell: int) -> int:
    """Return a flat cell itself where a candidate lies in it, else the nearest one where one does."""
    if is_held.ravel()[cell]:
        return int(cell)
    held = np.argwhere(is_held)
    at = np.array(np.unravel_index(cell, is_held.shape))
    best = held[int(np.argmin(((held - at) ** 2).sum(axis=1)))]
    return int(np.ravel_multi_index(tuple(best), is_held.shape))


def area_of(areas: Sequence[Area], at: Sequence[float] | Float[np.ndarray, " k"]) -> int:
    """Return the room of a place: the one that holds it, else the nearest one within 0.6 m, else −1."""
    xy = np.asarray(at, np.float64)[:2]
    inside = [number for number, area in enumerate(areas) if bool(area.contains(xy))]
    if inside or not areas:
        return inside[0] if inside else -1
    away = [float(room_distance_m(area.polygon, xy[None])[0]) for area in areas]
    return int(np.argmin(away)) if min(away) < 0.6 else -1


def in_room(areas: Sequence[Area], true: np.ndarray, at: np.ndarray) -> bool | None:
    """Return whether a place lies in the room of the truth; None where the truth is in none."""
    own = area_of(areas, true)
    return None if own < 0 else area_of(areas, at) == own


def same_room(areas: Sequence[Area], one: Sequence[float], other: Sequence[float]) -> bool:
    """Return whether two places lie in one room."""
    return area_of(areas, one) == area_of(areas, other)


def right_thing(
    event: HeardEvent, objects: Sequence[SceneObject], listed: Sequence[int], things: Sequence[Thing]
) -> bool | None:
    """Return whether one of the listed things is the one that sounded; None where none did, or the map lacks it.

    ``listed`` are numbers of things of the map.
    """
    if event.instance < 0:
        return None
    low = np.array(objects[event.instance].low) - _AT_M
    high = np.array(objects[event.instance].high) + _AT_M

    def fits(thing: Thing) -> bool:
        return bool(((thing.points >= low) & (thing.points <= high)).all(axis=1).mean() > 0.5)

    if not any(fits(thing) for thing in things):
        return None
    return any(fits(things[number]) for number in listed)


def baselines(
    event: HeardEvent,
    true: np.ndarray,
    areas: Sequence[Area],
    things: Sequence[Thing],
    track: Float[np.ndarray, "k 3"],
) -> list[Placed]:
    """Return where the robot was (the paper), the thing nearest to it, and the middle of the room that it was in."""
    robot = np.asarray(track, np.float64).mean(axis=0)
    found = {"robot's place (the paper)": robot}
    if things:
        away = [float(np.linalg.norm(np.array(thing.position[:2]) - robot[:2])) for thing in things]
        found["nearest thing"] = np.array(things[int(np.argmin(away))].position)
    own = area_of(areas, robot)
    if own >= 0:
        found["room's middle"] = np.asarray(areas[own].polygon, np.float64).mean(axis=0)
    same = same_room(areas, event.source, event.robot)
    return [
        Placed(name, float(np.linalg.norm(at[:2] - true[:2])), in_room(areas, true, at), same_room=same)
        for name, at in found.items()
    ]
