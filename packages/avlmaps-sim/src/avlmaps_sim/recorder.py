"""Recording a scene: a robot drives through it, its camera and its microphone run, and truth is written beside."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import asdict, dataclass, field, replace
from multiprocessing.reduction import ForkingPickler
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.core.errors import RecordingError
from avlmaps.core.files import user_path
from avlmaps.core.progress import progress, say
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.channels import ChannelSound
from avlmaps.recordings.layout import DESCRIPTION
from avlmaps.recordings.microphones import LEVEL_CAMERA_FROM_ROBOT, Microphones, microphones_named
from avlmaps.recordings.writer import RecordingWriter, write_picture
from avlmaps_sim.coverage import FloorCoverage, coverage_of_walk, require_floor
from avlmaps_sim.hearing.schedule import ScheduleRule, Sounding, candidates, schedule
from avlmaps_sim.hearing.sound_library import Recorded, Synthesised
from avlmaps_sim.processes import end_with_parent, fresh_processes
from avlmaps_sim.rearranged import Change, to_json
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import Scene
from avlmaps_sim.sensor import PRESETS, OdometryFaults, Sensor, SensorName, Shift, drifted
from avlmaps_sim.truth import SEMANTIC, clear_unfinished, write_true_poses, write_truth
from avlmaps_sim.walk import WalkSettings, walk_through

Hearing = Literal["overlay", "acoustic", "none"]
_SECONDS_A_SOUND = 12.0
_FEWEST_FOR_PROCESSES = 60  # starting a process takes as long as drawing some tens of frames
_DEPTH = "depth"
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True)
class RecordSettings:
    """How a scene is recorded.

    Attributes:
        size: columns and rows of the pictures.
        fov_deg: horizontal field of view.
        fps: frames a second.
        sensor: whose faults colour and depth have.
        hearing: ``overlay``: dry clips as the paper mixed them; ``acoustic``: loudness, walls and reverberation
            follow the geometry; ``none``: no track.
        microphones: of acoustic hearing: ``mono``, ``stereo``, ``square4``, or a JSON file with ``positions_m``.
        rt60_s: how long every room takes to fall by 60 dB (acoustic, several microphones); by its surfaces if None.
        directions: whether a device says where sounds come from, into directions.csv.
        directions_offset_deg: by how much its azimuths are too great.
        directions_outliers: share of its azimuths that are anything.
        sounds: folder of clips, as ``avlmaps add-sounds`` reads it; None makes them by rule.
        categories: only these kinds of sound; all that homes make if empty.
        sources: how many sounds; one for every twelve seconds of the walk if None.
        ambiguous: how many kinds of sound play in several places (``places``).
        rate_hz: samples a second of the track.
        snr_db: how far the room's noise lies below a sound at 1 m.
        overlap_s: how much two sounds may overlap.
        drift: how the poses stray, as odometry does; None gives true poses.
        max_frames: thins a longer walk evenly to this number of frames.
        semantic: whether instance images are written as well.
        colour: file type of the colour pictures.
        workers: processes that draw; 1 draws in this one, 0 takes as many as there are cores.
        walk: how the robot is driven; its rate is that of the frames.
    """

    size: tuple[int, int] = (320, 240)
    fov_deg: float = 63.0
    fps: float = 10.0
    sensor: SensorName = "clean"
    hearing: Hearing = "overlay"
    microphones: str = "mono"
    rt60_s: float | None = None
    directions: bool = False
    directions_offset_deg: float = 0.0
    directions_outliers: float = 0.1
    sounds: Path | None = None
    categories: tuple[str, ...] = ()
    sources: int | None = None
    ambiguous: int = 0
    places: int = 2
    rate_hz: int = 22_050
    snr_db: float = 30.0
    overlap_s: float = 0.0
    drift: OdometryFaults | None = None
    max_frames: int | None = None
    semantic: bool = False
    colour: Literal["png", "jpg"] = "png"
    workers: int = 0
    walk: WalkSettings = field(default_factory=WalkSettings)

    def __post_init__(self) -> None:
        width, height = self.size
        checks = (
            (16 <= width <= 4096 and 16 <= height <= 4096, f"pictures of {width}x{height}", "16x16 to 4096x4096"),
            (10.0 <= self.fov_deg <= 150.0, f"a field of view of {self.fov_deg:g} degrees", "10 to 150"),
            (0.1 <= self.fps <= 240.0, f"{self.fps:g} frames a second", "0.1 to 240"),
            (self.sources is None or self.sources >= 0, f"{self.sources} sounds", "0 or more"),
            (self.ambiguous >= 0, f"{self.ambiguous} kinds that sound in several places", "0 or more"),
            (self.places >= 2, f"{self.places} places of an ambiguous kind", "2 or more"),
            (0.0 <= self.overlap_s <= 5.0, f"sounds that overlap by {self.overlap_s:g} s", "0 to 5"),
            (8_000 <= self.rate_hz <= 96_000, f"a track of {self.rate_hz} Hz", "8000 to 96000"),
            (0.0 <= self.snr_db <= 90.0, f"a signal-to-noise ratio of {self.snr_db:g} dB", "0 to 90"),
            (0 <= self.workers <= 256, f"{self.workers} processes", "0 (every core) to 256"),
            (self.rt60_s is None or 0.1 <= self.rt60_s <= 3.0, f"rooms that ring for {self.rt60_s} s", "0.1 to 3"),
            (
                -360.0 <= self.directions_offset_deg <= 360.0,
                f"an offset of {self.directions_offset_deg:g} degrees",
                "-360 to 360",
            ),
            (0.0 <= self.directions_outliers <= 1.0, f"a share of outliers of {self.directions_outliers:g}", "0 to 1"),
            (self.max_frames is None or self.max_frames >= 2, f"{self.max_frames} frames at most", "2 or more"),
        )
        for right, value, choice in checks:
            if not right:
                raise RecordingError(f"A scene cannot be recorded with {value}; choose {choice}.")
        if self.directions_offset_deg and not self.directions:
            raise RecordingError(
                f"{option('directions-offset-deg')} is of the azimuths of {option('directions')}; give both or neither."
            )
        if self.directions and self.hearing == "none":
            raise RecordingError(
                f"Hearing none has no sound whose direction could be said; leave out {option('directions')}, or choose "
                f"{option('hearing', 'acoustic')}."
            )
        if self.microphones != "mono" and self.hearing != "acoustic":
            raise RecordingError(
                f"Hearing {self.hearing} has one microphone; several ({self.microphones}) need "
                f"{option('hearing', 'acoustic')}."
            )

    @property
    def camera(self) -> Pinhole:
        """The camera of colour and depth."""
        width, height = self.size
        focal = width / 2 / np.tan(np.deg2rad(self.fov_deg) / 2)
        return Pinhole(focal, focal, width / 2, height / 2, width, height)


@dataclass(frozen=True, slots=True)
class SceneRecording:
    """The content of a finished recording."""

    path: Path  # the folder
    frames: int  # how many
    duration_s: float  # length of the walk
    heard: tuple[Sounding, ...]  # the sounds in it
    floor: FloorCoverage  # how much of the building's floor was driven along and seen


@dataclass(frozen=True, slots=True, eq=False)
class _Trip:
    stamps_s: Float[np.ndarray, " n"]
    world_from_camera: Float[np.ndarray, "n 4 4"]
    duration_s: float


def record_scene(
    scene: Scene,
    out: Path | str,
    settings: RecordSettings | None = None,
    seed: int = 0,
    changes: Sequence[Change] = (),
) -> SceneRecording:
    """Drive through a scene and write a recording in our folder format, with its truth beside it.

    The same scene, settings and seed give the same bytes, on however many processes.

    Args:
        scene: the building.
        out: the folder to make; it must be empty.
        settings: the camera, its faults, and how sounds reach the microphone.
        seed: of the walk, the sounds and the faults.
        changes: what became of the scene since it was made, for its truth.

    Raises:
        RecordingError: the folder is not empty, or the scene has no floor to speak of, or is none in metres.
        AudioError: the folder of clips cannot be used.
    """
    settings, out = settings or RecordSettings(), user_path(out)
    if (out / DESCRIPTION).exists():  # reported before the work is done, not after
        raise RecordingError(f"{out} holds a recording already; choose another folder or remove it.")
    space = require_floor(scene, settings.walk)
    for_walk, for_sounds, for_track, for_frames = np.random.default_rng(seed).spawn(4)
    _microphones(settings)
    trip = _trip(scene, settings, for_walk)
    soundings = _soundings(scene, settings, trip, for_sounds)
    floor = coverage_of_walk(scene, space, trip.world_from_camera, settings.fov_deg, settings.walk)
    clear_unfinished(out)
    origin = f"avlmaps record of {scene.name}, seed {seed}"
    rig = Rig(settings.camera, settings.camera)
    with RecordingWriter(out, rig, up_in_world=_UP, colour=settings.colour, origin=origin) as writer:
        if (track := _track(scene, settings, trip, soundings, for_track)) is not None:
            writer.set_audio(track, microphones=_microphones(settings))
        if settings.directions:
            from avlmaps_sim.hearing.directions import said_directions

            offset_rad, chance = np.deg2rad(settings.directions_offset_deg), np.random.default_rng([seed, 1])
            sounds = [(one.onset_s, one.offset_s, one.source.position) for one in soundings]
            writer.set_directions(said_directions(
                scene, sounds, trip.stamps_s, trip.world_from_camera, chance, offset_rad, settings.directions_outliers
            ))  # fmt: skip
        _write_frames(scene, settings, trip, writer, for_frames)
        made_by = {"scene": scene.name, "seed": seed, "settings": _plain(settings)}
        write_truth(out, scene, soundings, {**made_by, "changes": to_json(changes)} if changes else made_by)
    return SceneRecording(out, len(trip.stamps_s), trip.duration_s, tuple(soundings), floor)


def sound_again(
    scene: Scene, walk: Trajectory, duration_s: float, settings: RecordSettings, rng: np.random.Generator
) -> tuple[Sound | ChannelSound | None, list[Sounding]]:
    """Return the track of other sounds along a walk that was recorded, and these; no track for hearing ``none``.

    ``AudioError``: the folder of clips cannot be used.
    """
    trip = _Trip(walk.stamps_s, walk.world_from_body, duration_s)
    soundings = _soundings(scene, settings, trip, rng)
    return _track(scene, settings, trip, soundings, rng), soundings


def _plain(settings: RecordSettings) -> dict[str, Any]:
    plain = asdict(replace(settings, sounds=None, workers=1))
    return {**plain, "sounds": None if settings.sounds is None else settings.sounds.name}


def _trip(scene: Scene, settings: RecordSettings, rng: np.random.Generator) -> _Trip:
    try:
        poses = walk_through(scene, rng, replace(settings.walk, rate_hz=settings.fps, max_frames=None))
    except ValueError as error:
        raise RecordingError(f"{scene.name} cannot be driven through: {error}.") from None
    if len(poses) < 2:
        raise RecordingError(f"{scene.name} cannot be driven through: the robot has no room to move.")
    stamps_s = np.arange(len(poses)) / settings.fps
    duration_s = len(poses) / settings.fps
    if settings.max_frames is not None and len(poses) > settings.max_frames:
        keep = np.linspace(0, len(poses) - 1, settings.max_frames).round().astype(int)
        return _Trip(stamps_s[keep], poses[keep], duration_s)
    return _Trip(stamps_s, poses, duration_s)


def _soundings(scene: Scene, settings: RecordSettings, trip: _Trip, rng: np.random.Generator) -> list[Sounding]:
    if settings.hearing == "none":
        return []
    bank = Synthesised() if settings.sounds is None else Recorded(settings.sounds, settings.rate_hz)
    count = max(1, round(trip.duration_s / _SECONDS_A_SOUND)) if settings.sources is None else settings.sources
    robot = trip.world_from_camera[:, :3, 3]
    doubtful = settings.ambiguous  # more kinds are drawn than play: not every place has its moment in the walk
    drawn = candidates(scene, rng, 2 * (count + doubtful), settings.categories, bank=bank, walk=robot)
    rule = ScheduleRule(pause_s=-settings.overlap_s if settings.overlap_s > 0.0 else ScheduleRule().pause_s)
    soundings = schedule(scene, drawn, trip.stamps_s, robot, rule, count, doubtful, settings.places)
    if len(soundings) < count and settings.sources is not None:
        say(f"note: {len(soundings)} of {count} sounds play: the walk has no room for more.")
    return soundings


def _track(
    scene: Scene, settings: RecordSettings, trip: _Trip, soundings: list[Sounding], rng: np.random.Generator
) -> Sound | ChannelSound | None:
    if settings.hearing == "none":
        return None
    if settings.hearing == "overlay":
        from avlmaps_sim.hearing.acoustic import overlay

        return overlay(soundings, trip.duration_s, rng, settings.rate_hz, snr_db=settings.snr_db)
    from avlmaps_sim.hearing.acoustic import AcousticSettings, acoustic

    wanted = AcousticSettings(rate_hz=settings.rate_hz, snr_db=settings.snr_db, rt60_s=settings.rt60_s)
    if (array := _microphones(settings)) is not None:
        from avlmaps_sim.hearing.array import heard_by_array

        poses = trip.world_from_camera
        return heard_by_array(scene, soundings, trip.stamps_s, poses, array, trip.duration_s, rng, wanted)
    robot = trip.world_from_camera[:, :3, 3]
    return acoustic(scene, soundings, trip.stamps_s, robot, trip.duration_s, rng, wanted)


def _microphones(settings: RecordSettings) -> Microphones | None:
    """Return the array on the robot, whose frame is level while the camera looks down; None for one microphone."""
    if settings.microphones == "mono":
        return None
    array = microphones_named(settings.microphones)
    if not np.array_equal(array.camera_from_robot, LEVEL_CAMERA_FROM_ROBOT):
        return array
    down = settings.walk.pitch_down_rad
    tilt = np.eye(4)
    tilt[1:3, 1:3] = [[np.cos(down), -np.sin(down)], [np.sin(down), np.cos(down)]]
    return Microphones(array.position_m, tilt @ array.camera_from_robot)


def _write_frames(
    scene: Scene, settings: RecordSettings, trip: _Trip, writer: RecordingWriter, rng: np.random.Generator
) -> None:
    seed = int(rng.integers(1 << 62))
    count = len(trip.stamps_s)
    names = [f"{index:06d}" for index in range(count)]
    odometry = trip.world_from_camera
    if settings.drift is not None:
        odometry = drifted(trip.world_from_camera, rng, settings.drift)
        write_true_poses(writer.path, trip.stamps_s, trip.world_from_camera)
    if settings.semantic:
        (writer.path / SEMANTIC).mkdir(exist_ok=True)
    with TemporaryDirectory(prefix=".recording-", dir=writer.path.parent) as scratch:
        for folder in (_DEPTH, SEMANTIC):
            (Path(scratch) / folder).mkdir()
        artist = _Artist(Renderer(scene), settings, Path(scratch), seed)
        shifts = artist.sensor.shifts(count, rng)
        jobs = [(index, names[index], trip.world_from_camera[index], shifts[index]) for index in range(count)]
        workers = settings.workers or os.cpu_count() or 1
        for index in progress(_drawn(artist, jobs, workers), "recording", total=count):
            files = artist.files(names[index])
            writer.add_files(names[index], float(trip.stamps_s[index]), odometry[index], files[0], files[1])
            for file in files[:2]:
                file.unlink()
            if settings.semantic:
                files[2].replace(writer.path / SEMANTIC / files[2].name)


_Job = tuple[int, str, Float[np.ndarray, "4 4"], Shift]


class _Artist:
    def __init__(self, renderer: Renderer, settings: RecordSettings, folder: Path, seed: int) -> None:
        self._renderer, self._settings, self._folder, self._seed = renderer, settings, folder, seed
        self.sensor = Sensor(PRESETS[settings.sensor])

    def files(self, name: str) -> tuple[Path, Path, Path]:
        colour = self._folder / f"{name}.{self._settings.colour}"
        return colour, self._folder / _DEPTH / f"{name}.png", self._folder / SEMANTIC / f"{name}.png"

    def draw(self, job: _Job) -> int:
        index, name, pose, shift = job
        camera = self._settings.camera
        view = self._renderer.render(camera, pose)
        rgb, depth_m = view.rgb, view.depth_m
        if self._settings.sensor != "clean":
            rgb, depth_m = self.sensor.spoil(view, camera, np.random.default_rng([self._seed, index]), shift)
        colour, depth, semantic = self.files(name)
        write_picture(colour, rgb[..., ::-1])
        write_picture(depth, _millimetres(depth_m))
        if self._settings.semantic:
            write_picture(semantic, (view.instance + 1).astype(np.uint16))
        return index


def _millimetres(depth_m: Float[np.ndarray, "h w"]) -> np.ndarray:
    raw = np.rint(depth_m.astype(np.float64) * 1000.0)
    return np.where((raw > 0) & (raw <= 65534), raw, 0).astype(np.uint16)


_artist: list[_Artist] = []


def _take_up(name: str, size: int) -> None:
    import cv2

    end_with_parent()
    cv2.setNumThreads(1)
    shared = SharedMemory(name)
    assert shared.buf is not None
    _artist[:] = [ForkingPickler.loads(bytes(shared.buf[:size]))]  # pyright: ignore[reportAttributeAccessIssue]
    shared.close()


def _draw(job: _Job) -> int:
    return _artist[0].draw(job)


def _drawn(artist: _Artist, jobs: list[_Job], workers: int) -> Iterator[int]:
    if workers < 2 or len(jobs) < _FEWEST_FOR_PROCESSES:
        yield from map(artist.draw, jobs)
        return
    # The building goes by shared memory: sent as an argument it would block for good when a process dies as it starts.
    packed = bytes(ForkingPickler.dumps(artist))
    shared = SharedMemory(create=True, size=len(packed))
    assert shared.buf is not None
    shared.buf[: len(packed)] = packed
    own = b"__main__" in packed  # a building of a class of the script's own
    try:
        with fresh_processes(workers, _take_up, shared.name, len(packed), import_script=own) as pool:
            yield from pool.map(_draw, jobs, chunksize=4)
    except BrokenProcessPool:
        guard = "keep the script's own work under if __name__ == '__main__', " if own else ""
        raise RecordingError(
            f"A process that was drawing has died; {guard}free some memory, or draw with one process (workers: 1)."
        ) from None
    finally:
        shared.close()
        shared.unlink()
