"""What some frames show before all are fused: what is doubtful, up, the floor, and the depth camera's error."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.progress import say
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.maps.audio.segmentation import segment
from avlmaps.maps.fusion.sensor import FRAMES, MODELS, SensorModel, measure_noise, nearest_model
from avlmaps.maps.gravity import Expected, find_ground, find_up, spread_frames, up_doubts
from avlmaps.maps.plan import strip_folder
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.sources.wiring import check_wiring
from avlmaps.maps.store.manifest import GroundInfo, SensorInfo, UpInfo
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import level_faults
from avlmaps.recordings.consistency.check import Finding, Grade, Reason, Verdict, check_recording
from avlmaps.recordings.consistency.suspicions import examine_recording
from avlmaps.recordings.layout import DESCRIPTION
from avlmaps.recordings.plausible import pace_fault, plausible_walk
from avlmaps.recordings.types import Ground, Recording


def doubts_of(recording: Recording, allowed: Sequence[str]) -> tuple[str, ...]:
    """Return what is doubtful about a recording, one sentence each, and say it."""
    known = [reason.value for reason in Reason]
    for name in allowed:
        if name not in known:
            raise RecordingError(f"There is nothing called {name!r} to allow; known are: {', '.join(known)}.")
    try:
        array = _array_of(recording)
        useless = level_faults(array)[0] if array is not None else []
        verdict = judge(recording, useless)
    except RecordingError:  # no frame of the sample can be read; how many may be lost is decided later
        return ()
    refused = verdict.refused(tuple(allowed))
    if refused is not None:
        raise RecordingError(
            f"{recording.path} cannot be right. {refused} To build it as it is: "
            f"{option('allow', refused.reason.value)}."
        )
    doubts = tuple(strip_folder(one, recording) for one in (*verdict.sentences(), *useless))
    for doubt in doubts:
        say(f"note: {doubt}")
    return doubts


def judge(recording: Recording, useless: Sequence[str] | None = None, *, closely: bool = False) -> Verdict:
    """Check a recording against itself, the up direction that was given against what it shows, and its microphones.

    ``useless`` is what ``level_faults`` says of its sound, where that was read before. ``closely`` looks for rare
    mistakes as well, and says what would not show.
    """
    verdict = examine_recording(recording) if closely else check_recording(recording)
    if verdict.refused(()) is not None:  # with such poses nothing is level
        return verdict
    array = _array_of(recording)
    wired = [] if array is None else _of_microphones(array, recording.walk, useless)
    findings = (*verdict.findings, *up_doubts(recording), *wired)
    return replace(verdict, findings=findings, unchecked=verdict.unchecked if not findings else ())


def doubts_of_walk(walk: Trajectory, held: Recording) -> tuple[str, ...]:
    """Return what is odd about poses and stamps, and about some frames beside one another."""
    names = [f"{stamp_s:.2f} s" for stamp_s in walk.stamps_s.tolist()]
    found = plausible_walk(walk.stamps_s, walk.world_from_body[:, :3, 3], names, strays_are="check the poses")
    odd = *found.notices, found.fault, pace_fault(walk.stamps_s, "frames"), *judge(held).sentences()
    return tuple(sentence for sentence in odd if sentence)


def doubts_of_channels(track: AudioTrack, walk: Trajectory, name: str) -> tuple[str, ...]:
    """Return what is doubtful about the channels of an array: their wiring, and those of no use."""
    useless = level_faults(track, name)[0]
    return (*map(str, _of_microphones(track, walk, useless)), *useless)


def _array_of(recording: Recording) -> AudioTrack | None:
    track = recording.audio
    return track if track is not None and track.microphones is not None and len(track.microphones) > 1 else None


def _of_microphones(track: AudioTrack, walk: Trajectory, useless: Sequence[str] | None) -> list[Finding]:
    try:
        if level_faults(track)[0] if useless is None else useless:
            return []
        spans_s = [(heard.onset_s, heard.offset_s) for heard in segment(track)]
        found = check_wiring(track, walk, spans_s)
    except AudioError:  # the track is validated and read elsewhere, with a sentence for that
        return []
    if found is None or found.is_right:
        return []
    fits = (
        f"over {found.sounds} sounds along the drive they reach {found.fit:.2f} of the greatest correlation as "
        f"described, and {found.best_fit:.2f}"
    )
    if found.turned:
        named = " and ".join(str(channel + 1) for channel in found.turned)
        sentence = (
            f"Microphones of these channels are wired the other way round: {named}; {fits} with the sign turned, as "
            "sources are found."
        )
        remedy = f"Exchange the two wires of each ({named}), or turn its sign."
    else:
        moved = [str(channel + 1) for channel, microphone in enumerate(found.order) if channel != microphone]
        order = ", ".join(str(microphone + 1) for microphone in found.order)
        sentence = (
            f"Channels {' and '.join([', '.join(moved[:-1]), moved[-1]])} of the microphones look exchanged: their "
            f"delays do not fit the places; {fits} with the places in the order {order}."
        )
        remedy = (
            f"Put the wires right, or write positions_m of {DESCRIPTION} in that order (of a ring, the order turned or "
            "mirrored may fit as well), and build again."
        )
    return [Finding(Reason.MICROPHONES, Grade.SUSPICIOUS, sentence, remedy)]


_LEAVES_OPEN = 0.7  # a floor of a lower confidence gets a notice,
_FEW_CAMERAS = 0.1  # if more than this share of the cameras stood over it
_MUCH_BELOW = 0.1  # a floor that the user gave gets one when more surface than this share lies below it
_RANDOMNESS = 1  # number of the stage as a source of randomness (keyframes have 2)


@dataclass(frozen=True, slots=True)
class Start:
    """What is found in some frames before any is fused."""

    up: UpInfo
    floors: GroundInfo  # for the manifest
    ground: Ground  # up and the floor under each camera height, for encoders
    sensor: SensorInfo

    @classmethod
    def of(cls, recording: Recording, settings: BuildSettings) -> "Start":
        """Return what the frames of a recording show."""
        up = estimate_up(recording, settings)
        ground, floors = estimate_ground(recording, settings, up)
        return cls(up, floors, ground, estimate_sensor(recording, settings))


def estimate_up(recording: Recording, settings: BuildSettings) -> UpInfo:
    """Return the up direction: as the recording says, else as the planes in view do, else as the camera was held."""
    if recording.up_in_world is not None:
        return UpInfo.of(recording.up_in_world, "recording", 1.0)
    rng = np.random.default_rng([settings.seed, _RANDOMNESS])
    try:
        up = find_up(spread_frames(recording, settings.gravity.frames), rng)
    except RecordingError:  # too little smooth surface: people and robots hold cameras upright, more or less
        held = -recording.world_from_camera[:, :3, 1].mean(axis=0)
        return UpInfo.of(held if np.linalg.norm(held) > 0.01 else np.array([0.0, 0.0, 1.0]), "camera", 0.0)
    return UpInfo.of(up.direction, "planes", float(up.support))


def estimate_ground(recording: Recording, settings: BuildSettings, up: UpInfo) -> tuple[Ground, GroundInfo]:
    """Return the floor under each camera height, and what is known of it for the manifest."""
    expected, known_from = _expected(recording, settings, up)
    found = find_ground(spread_frames(recording, settings.gravity.frames), up.vector(), expected)
    return found.ground, GroundInfo(known_from=known_from, floors=found.floors)


def _expected(
    recording: Recording, settings: BuildSettings, up: UpInfo
) -> tuple[Expected | None, Literal["surfaces", "user", "recording"]]:
    start_m = float(recording.world_from_camera[0, :3, 3] @ up.vector()) if len(recording) else 0.0
    given_m, base = settings.gravity.camera_height_m, recording.base_height
    if given_m is not None:
        return Expected(start_m - given_m, given_m), "user"
    if base is not None:
        expected = Expected(start_m - base.below_camera_m, base.below_camera_m, base.on_floor)
        return expected, "recording" if base.on_floor else "surfaces"
    return None, "surfaces"


def ground_notices(ground: GroundInfo) -> Iterator[str]:
    """Yield a sentence for each floor that most of its evidence leaves open."""
    remedy = f"give the camera's height over the floor with {option('camera-height-m')} if that is wrong"
    for floor in ground.floors if ground.known_from == "surfaces" else ():
        best, second = floor.best, floor.runner_up
        if floor.cameras < _FEW_CAMERAS or (best.confidence >= _LEAVES_OPEN and best.in_view):
            continue
        if not best.in_view:
            yield (
                f"No floor is in view: it is taken to be {best.camera_height_m:.2f} m under the camera (confidence "
                f"{best.confidence:.2f}); {remedy}."
            )
        elif second is not None and second.in_view and second.confidence > best.confidence / 3:
            yield (
                f"Two floors explain what is in view about equally well: {best.camera_height_m:.2f} m under the camera "
                f"(taken, confidence {best.confidence:.2f}) or {second.camera_height_m:.2f} m "
                f"({second.confidence:.2f}); {remedy}."
            )
        else:
            yield (
                f"The floor may not be in view: the lowest level surface lies {best.camera_height_m:.2f} m under the "
                f"camera (confidence {best.confidence:.2f}); {remedy}."
            )
    if ground.known_from == "user" and (main := ground.main().best).below > _MUCH_BELOW:
        yield (
            f"{main.below:.0%} of what is in view lies below the floor that was given ({main.camera_height_m:.2f} m "
            f"under the camera); check {option('camera-height-m')}."
        )


def estimate_sensor(recording: Recording, settings: BuildSettings) -> SensorInfo:
    """Return the depth camera that the settings name, or the one whose error is nearest to what the frames show.

    The choice is one of a few models and hence the same on every machine, though the measured number may differ in its
    last digits.
    """
    chosen = settings.fusion.sensor
    if isinstance(chosen, SensorModel):
        return SensorInfo(name="custom", known_from="settings", noise_per_m=None, model=chosen)
    if chosen != "auto":
        return SensorInfo(name=chosen, known_from="settings", noise_per_m=None, model=MODELS[chosen])
    noise = measure_noise(spread_frames(recording, FRAMES))
    noise = None if noise is None else float(f"{noise:.2g}")  # as far as it is known, and alike on every machine
    name = nearest_model(noise)
    return SensorInfo(name=name, known_from="frames", noise_per_m=noise, model=MODELS[name])
