"""Where the sounds of a drive that is not over came from, as its map shows it until now.

Each sound is located when it is over, on the surfaces that there are then. What came before is carried over to the
candidates of now. Three things are known better later: surfaces, the signs of the channels, and the offset of a device
that says directions. So the end is that of a build: every sound is located once more, on the finished map.
"""

from collections.abc import Sequence
from dataclasses import replace
from threading import Lock

import numpy as np

from avlmaps.core.arrays import Bool, Float, Int
from avlmaps.core.errors import AudioError, RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.maps.sources.carried import laid
from avlmaps.maps.sources.find import LEAST, FoundSources, find_among, find_sources
from avlmaps.maps.types import SourceEvidence
from avlmaps.recordings.audio import AudioTrack
from avlmaps.recordings.directions import DirectionTrack
from avlmaps.recordings.microphones import Microphones

AT_ONCE = 1
"""Sounds that a live map locates before it looks for new ones again, the newest first."""
_SAME_S = 0.1  # limits of a sound that are found again, with the background better known
_SIGNS_BY = 6  # sounds, by which the signs of the channels are settled until the end
_RECENT = 8  # sounds whose directions are looked at again, now that the device is known better

Spans = Sequence[tuple[float, float]]


class GrowingSources:
    """Takes the microphones and what a device says; gives the evidence of sounds.

    Attributes:
        microphones: one for each channel; None where they are not known.
        known_rad: of the device that says directions, as ``DirectionTrack.known_rad``.
        waiting: how many sounds are not located yet.
        doubt: why what a device said is left out; empty where it is not.
    """

    def __init__(self, at_once: int | None = None) -> None:
        """Begin without sounds.

        Args:
            at_once: how many are located in one call at most; None for all.
        """
        self.microphones: Microphones | None = None
        self.known_rad: tuple[float, float] | None = None
        self.waiting, self.doubt = 0, ""
        self._at_once, self._lock = at_once, Lock()
        self._said: list[DirectionTrack] = []
        self.forget()

    def add_directions(self, said: DirectionTrack) -> None:
        """Take directions that are later than those before. Another thread may do it.

        Raises:
            RecordingError: they are not.
        """
        if not len(said):
            return
        with self._lock:
            last_s = float(self._said[-1].stamp_s[-1]) if self._said else -np.inf
            if said.stamp_s[0] <= last_s:
                raise RecordingError(
                    f"A direction has the stamp {said.stamp_s[0]:.3f} s, and one of {last_s:.3f} s came before: it is "
                    "repeated or out of order, and was left out."
                )
            self._said.append(said)

    def track(self, heard: AudioTrack, channels: int) -> AudioTrack | None:
        """Return a track with what is known of its sources; None where that is nothing."""
        with self._lock:
            self._said = [DirectionTrack.joined(self._said)] if self._said else []
            said = self._said[0] if self._said else None
        try:
            if said is not None:
                said.require_beside(heard.start_s, heard.end_s, "What the device said")
                said = replace(said, known_rad=self.known_rad)
            self.doubt = ""
        except RecordingError as fault:
            said, self.doubt = None, self.doubt or str(fault)  # its numbers change with every piece
        placed = self.microphones if self.microphones is not None and len(self.microphones) == channels else None
        return None if placed is None and said is None else replace(heard, microphones=placed, directions=said)

    def forget(self) -> None:
        """Locate every sound again: the poses have changed."""
        self._evidence: SourceEvidence | None = None
        self._spans_s = np.zeros((0, 2))
        self._located: Bool[np.ndarray, " n"] = np.zeros(0, bool)
        self._of_device: Float[np.ndarray, "n g o"] = np.zeros((0, 1, 1))
        self._signs: Float[np.ndarray, " m"] | None = None

    def known(self, spans_s: Spans) -> SourceEvidence | None:
        """Return the evidence of the sounds that are over, as far as they are located. One that waits has all zeros.

        The same object as before where nothing changed.
        """
        row = self._rows(spans_s)
        self.waiting = int((row < 0).sum())
        return self._chosen(row)

    def until_now(
        self,
        track: AudioTrack,
        walk: Trajectory,
        spans_s: Spans,
        voxel_m: Float[np.ndarray, "n 3"],
        up_in_world: Float[np.ndarray, "3"],
    ) -> SourceEvidence | None:
        """Locate the next sounds that wait, and return what is ``known`` then; see ``find_sources``."""
        row = self._rows(spans_s)
        fresh = np.flatnonzero(row < 0)
        if not len(fresh):
            return self.known(spans_s)
        now = fresh if self._at_once is None else fresh[-self._at_once :]
        if track.microphones is None:
            now = np.union1d(now, np.arange(max(0, len(row) - _RECENT), len(row)))
        old = np.setdiff1d(np.flatnonzero(row >= 0), now)
        told = track.directions is not None and self._of_device.shape[1] > 1  # else the device said nothing before
        others = self._of_device[row[old]] if told and len(old) else None
        signs = self._signs if len(old) >= _SIGNS_BY else None
        wanted = [spans_s[number] for number in now.tolist()]
        # By all sounds, also those that wait: else signs change with the order, and what was located waits again.
        found = find_among(track, walk, wanted, voxel_m, up_in_world, signs_by_s=spans_s, signs=signs, others=others)
        if found is None:
            return None
        if self._signs is not None and not np.array_equal(self._signs, found.signs):
            old = old[:0]  # they were located with other signs
        self._keep(found, spans_s, row, old, now)
        return self._evidence

    def at_the_end(
        self,
        track: AudioTrack,
        walk: Trajectory,
        spans_s: Spans,
        voxel_m: Float[np.ndarray, "n 3"],
        up_in_world: Float[np.ndarray, "3"],
    ) -> SourceEvidence | None:
        """Return the evidence of all sounds as a build finds it."""
        self.waiting = 0
        return find_sources(track, walk, spans_s, voxel_m, up_in_world)

    def _rows(self, spans_s: Spans) -> Int[np.ndarray, " n"]:
        row = np.full(len(spans_s), -1)
        for number, span in enumerate(spans_s if len(self._spans_s) else ()):
            off_s = np.abs(self._spans_s - span).max(axis=1)
            nearest = int(np.argmin(off_s))
            if off_s[nearest] < _SAME_S and self._located[nearest]:
                row[number] = nearest
        return row

    def _chosen(self, row: Int[np.ndarray, " n"]) -> SourceEvidence | None:
        evidence = self._evidence
        if evidence is None or not len(row) or np.array_equal(row, np.arange(len(evidence))):
            return evidence if len(row) else None
        known = row >= 0
        return replace(
            evidence, heard=evidence.heard[row] * known[:, None], expected=evidence.expected[row] * known[:, None],
            moving=evidence.moving[row] * known,
        )  # fmt: skip

    def _keep(
        self,
        found: FoundSources,
        spans_s: Spans,
        row: Int[np.ndarray, " n"],
        old: Int[np.ndarray, " k"],
        now: Int[np.ndarray, " s"],
    ) -> None:
        new, before, count = found.evidence, self._evidence, len(spans_s)
        heard, expected = (np.zeros((count, len(new.place)), np.float16) for _ in range(2))
        moving = np.zeros(count, np.uint8)
        of_device = np.zeros((count, *found.of_device.shape[1:]))
        heard[now], expected[now], moving[now] = new.heard, new.expected, new.moving
        of_device[now if len(found.of_device) else now[:0]] = found.of_device
        if before is not None and len(old):
            own = replace(
                before, heard=before.heard[row[old]], expected=before.expected[row[old]],
                moving=before.moving[row[old]],
            )  # fmt: skip
            carried = laid(own, np.eye(4), new.place.astype(np.float64))
            heard[old], expected[old] = (np.maximum(values, LEAST) for values in carried)
            moving[old] = own.moving
            of_device[old] = self._of_device[row[old]] if len(found.of_device) else 0.0
        self._evidence = replace(new, heard=heard, expected=expected, moving=moving)
        self._spans_s, self._of_device, self._signs = np.array(spans_s), of_device, found.signs
        self._located = np.isin(np.arange(count), np.concatenate([old, now]))
        self.waiting = int((~self._located).sum())


def require_fit(microphones: Microphones | None, channels: int) -> None:
    """Refuse a piece of sound whose channels are not those of the microphones.

    Raises:
        AudioError: there are more or fewer.
    """
    if microphones is not None and channels != len(microphones):
        raise AudioError(
            f"A piece of sound has {channels} channel(s), but {len(microphones)} microphone(s) are described; give one "
            "position for each channel."
        )
