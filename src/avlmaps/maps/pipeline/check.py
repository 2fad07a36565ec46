"""The check of the recording at the beginning of a build: what cannot be is refused, what is odd stays with the map."""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from avlmaps.core.errors import RecordingError
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.maps.gravity.up import some_frames, up_doubts
from avlmaps.maps.pipeline.plan import BUILD_VERSION, BuildPlan
from avlmaps.maps.store.checkpoints import Computed, key_of, load_or_compute
from avlmaps.recordings.consistency.check import check_recording
from avlmaps.recordings.consistency.verdict import Reason, Verdict
from avlmaps.recordings.types import Recording


class _Doubts(msgspec.Struct):
    sentences: tuple[str, ...]
    whole: bool


def checked(plan: BuildPlan, allowed: Sequence[str]) -> BuildPlan:
    """Return the plan with what is doubtful about its recording, each of which is said.

    Args:
        plan: of the build.
        allowed: reasons that forbid no map.

    Raises:
        RecordingError: the recording cannot be right, or a reason has no such name.
    """
    known = [reason.value for reason in Reason]
    for name in allowed:
        if name not in known:
            raise RecordingError(f"There is nothing called {name!r} to allow; known are: {', '.join(known)}.")
    key = key_of("doubts", BUILD_VERSION, plan.recording.fingerprint, sorted(allowed))

    def compute() -> Computed[_Doubts]:
        return Computed(_doubts(plan.recording, allowed))

    # A frame that could not be read then may be readable now.
    found = load_or_compute(plan.folder("doubts", key), key, _Doubts, compute, usable=lambda facts: facts.whole)
    doubts = found.facts.sentences
    for doubt in doubts:
        say(f"note: {doubt}")
    return replace(plan, doubts=doubts)


def _doubts(recording: Recording, allowed: Sequence[str]) -> _Doubts:
    try:
        verdict = judge(recording)
    except RecordingError:  # no frame of the sample can be read; how many may be lost is decided later
        return _Doubts((), whole=False)
    refused = verdict.refused(tuple(allowed))
    if refused is not None:
        raise RecordingError(
            f"{recording.path} cannot be right. {refused} To build it as it is: "
            f"{option('allow', refused.reason.value)}."
        )
    return _Doubts(verdict.sentences(), whole=not verdict.unread)


def judge(recording: Recording) -> Verdict:
    """Check a recording against itself, and the up direction that was given against what it shows.

    Raises:
        RecordingError: it has no frame that can be read.
    """
    verdict = check_recording(recording)
    if verdict.refused(()) is not None:  # with such poses nothing is level
        return verdict
    tilted = up_doubts(recording, some_frames(recording), np.random.default_rng(0))
    return replace(verdict, findings=(*verdict.findings, *tilted))
