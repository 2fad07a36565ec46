"""The check of the recording at the beginning of a build: what cannot be is refused, what is odd stays with the map."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.progress import say
from avlmaps.core.timeline import Trajectory
from avlmaps.core.wording import option
from avlmaps.maps.audio.events import WalkedTrack
from avlmaps.maps.audio.segmentation import segment
from avlmaps.maps.gravity.up import some_frames, tilted_parts, up_doubts
from avlmaps.maps.plan import strip_folder
from avlmaps.maps.sources.wiring import check_wiring
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.channels import useless_channels
from avlmaps.recordings.consistency.check import check_recording
from avlmaps.recordings.consistency.suspicions import examine_recording
from avlmaps.recordings.consistency.verdict import Finding, Grade, Reason, Verdict
from avlmaps.recordings.layout import DESCRIPTION
from avlmaps.recordings.plausible import pace_fault, plausible_walk
from avlmaps.recordings.types import Recording


def doubts_of(recording: Recording, allowed: Sequence[str]) -> tuple[str, ...]:
    """Return what is doubtful about a recording, one sentence each, and say it."""
    known = [reason.value for reason in Reason]
    for name in allowed:
        if name not in known:
            raise RecordingError(f"There is nothing called {name!r} to allow; known are: {', '.join(known)}.")
    try:
        useless = _useless(recording)
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

    Args:
        recording: to check.
        useless: what ``useless_channels`` says of its sound, where that was read before.
        closely: whether rare mistakes are looked for as well, and what would not show is said.
    """
    verdict = examine_recording(recording) if closely else check_recording(recording)
    if verdict.refused(()) is not None:  # with such poses nothing is level
        return verdict
    rng = np.random.default_rng(0)
    tilted = up_doubts(recording, some_frames(recording), rng)
    tilted = tilted or (tilted_parts(recording, rng) if closely else ())
    array = _array_of(recording)
    wired, unsure = ([], []) if array is None else _of_microphones(array, recording.walk, useless)
    findings = (*verdict.findings, *tilted, *wired)
    return replace(verdict, findings=findings, unchecked=(*verdict.unchecked, *unsure) if not findings else ())


def doubts_of_walk(walk: WalkedTrack, held: Recording) -> tuple[str, ...]:
    """Return what is odd about poses and stamps, and about some frames beside one another."""
    names = [f"{stamp_s:.2f} s" for stamp_s in walk.stamps_s.tolist()]
    found = plausible_walk(walk.stamps_s, walk.world_from_camera[:, :3, 3], names, strays_are="check the poses")
    odd = *found.notices, found.fault, pace_fault(walk.stamps_s, "frames"), *judge(held).sentences()
    return tuple(sentence for sentence in odd if sentence)


def doubts_of_channels(track: AudioTrack, walk: Trajectory, name: str) -> tuple[str, ...]:
    """Return what is doubtful about the channels of an array: their wiring, and those of no use."""
    useless = useless_channels(track, name)
    return (*map(str, _of_microphones(track, walk, useless)[0]), *useless)


def _array_of(recording: Recording) -> AudioTrack | None:
    track = recording.audio
    return track if track is not None and track.microphones is not None and len(track.microphones) > 1 else None


def _useless(recording: Recording) -> list[str]:
    array = _array_of(recording)
    return useless_channels(array) if array is not None else []


def _of_microphones(
    track: AudioTrack, walk: Trajectory, useless: Sequence[str] | None
) -> tuple[list[Finding], list[str]]:
    """Return what is wrong with the order of the channels, and what about it does not show."""
    try:
        if useless_channels(track) if useless is None else useless:
            return [], []
        spans_s = [(heard.onset_s, heard.offset_s) for heard in segment(track)]
        found = check_wiring(track, walk, spans_s)
    except AudioError:  # the track is validated and read elsewhere, with a sentence for that
        return [], []
    if found is None:
        return [], [
            "The order of the channels cannot be checked here: the track has fewer than three sounds during the drive."
        ]
    fits = (
        f"over {found.sounds} sounds along the drive they reach {found.fit:.2f} of the greatest correlation as "
        f"described, and {found.best_fit:.2f}"
    )
    if found.turned:
        named = " and ".join(str(channel + 1) for channel in found.turned)
        of_them = ("Channels", "are", "their signs") if len(found.turned) > 1 else ("Channel", "is", "its sign")
        sentence = (
            f"{of_them[0]} {named} of the microphones {of_them[1]} wired the other way round: {fits} with {of_them[2]} "
            "turned, as sources are found."
        )
        return [_doubtful(sentence, f"Exchange the two wires of each ({named}), or turn its sign.")], []
    if not found.is_right:
        moved = [str(channel + 1) for channel, microphone in enumerate(found.order) if channel != microphone]
        order = ", ".join(str(microphone + 1) for microphone in found.order)
        sentence = (
            f"Channels {' and '.join([', '.join(moved[:-1]), moved[-1]])} of the microphones look exchanged: their "
            f"delays do not fit the places; {fits} with the places in the order {order}."
        )
        turned = " (or that order turned or mirrored, which fits as well)" if found.unsure else ""
        remedy = f"Put the wires right, or write positions_m of {DESCRIPTION} in that order{turned}, and build again."
        return [_doubtful(sentence, remedy)], []
    if not found.unsure:
        return [], []
    others = " or ".join(" ".join(str(microphone + 1) for microphone in order) for order in found.unsure[:2])
    return [], [
        f"Channels in the order {others} would not show here, because the robot hardly turned or moved while it heard "
        "sounds; check the places of the microphones by hand, or drive in curves past something that sounds."
    ]


def _doubtful(sentence: str, remedy: str) -> Finding:
    return Finding(Reason.MICROPHONES, Grade.SUSPICIOUS, sentence, remedy)
