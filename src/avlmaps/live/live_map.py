"""A map that grows while a robot drives: frames in, questions at any moment, saved all along.

Four threads work. The caller's puts frames into a short queue. One fuses them, and nobody else touches the growing
map; on request it freezes what came, which takes no longer than a frame. One works behind: it makes a map of
what was frozen (keyframes, places and sounds are described there), and puts it in the place of the last snapshot. One
writes these maps into the folder. A question uses the snapshot that there is; nothing that comes later changes it.
"""

import contextlib
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
from math import isfinite
from pathlib import Path
from threading import Condition, Event, Lock, Thread
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.errors import AudioError, AvlmapsError, BackendError, MapError, RecordingError
from avlmaps.core.files import lasting_path
from avlmaps.core.numbers import as_number
from avlmaps.core.progress import progress
from avlmaps.live.gates import LATER_SHARE, EncodingGate, Gates
from avlmaps.live.kept_back import KeptBack
from avlmaps.live.pose_check import PoseCheck
from avlmaps.live.saver import Saver, Unsaved
from avlmaps.live.settings import LiveSettings
from avlmaps.live.status import LiveStatus, Tally, memory_mb
from avlmaps.maps.growing import FrozenSums, GrowingMap, require_place
from avlmaps.maps.keyframes.describe import KeyframeSettings
from avlmaps.maps.pipeline.sources import device_of
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.lock import lock_folder
from avlmaps.maps.store.reader import StoredMap, open_stored
from avlmaps.perception.encoders import Encoders, encoders_of
from avlmaps.perception.profiles import Profile
from avlmaps.query.avlmap import AVLMap, QuerySettings
from avlmaps.query.voxel_map import direction, require_kinds
from avlmaps.recordings.directions import given_directions
from avlmaps.recordings.given_frame import given_frame
from avlmaps.recordings.memory import next_of
from avlmaps.recordings.microphones import Microphones, given_microphones
from avlmaps.recordings.plausible import date_fault
from avlmaps.recordings.types import Frame

if TYPE_CHECKING:
    from avlmaps.query.answer import Answer

# A keyframe takes as long as three frames; with gates there are half as many as in a build.
SPARSE = BuildSettings(keyframes=KeyframeSettings(translation_m=0.2, rotation_deg=14.0))
_STEP_S = 0.1
_IDLE_S = 0.05
_LOOK_S = 0.1  # at how far the end is
_MOST_DOUBTS = 100
_CHANGES = "fused", "corrected", "encoded later"  # what is counted where the map has become another
_STILL = 1e-3  # times what it is worth: a frame in which the camera stood makes room for every other
_CALM_S = 0.5  # without a frame, before frames on the disk are looked at
_LOOKS_S = 0.3  # for keyframes, in each snapshot
_MOST_LATE = 24  # late frames in memory, until the thread that fuses writes them to the disk
_LISTEN_S = 0.25  # from one look for sounds that ended to the next
_REST_S = 1.0  # between two snapshots, at most, where one takes longer than that


_Came = tuple[FrozenSums, float]  # what was frozen, and when
_Correction = tuple[Any, Any, "Future[tuple[float, float]]"]  # stamps, poses, and what it did


class LiveMap:
    """A map that is made while a robot drives.

    Example:
        with avlmaps.LiveMap("home.avlmap") as live:
            live.add_frame(rgb, depth_m, camera, world_from_camera, stamp_s)
            live.add_audio(avlmaps.Sound(samples, 16_000), stamp_s)  # of an array: microphones=..., ChannelSound
            live.ask("the chair near the sound of a dog").text

    The folder is a whole map at any moment from the first save on, also when the process is killed; another process
    may open it. What came after the last save is lost then, a few seconds (``status().unsaved_s``). At the end, it is
    the map that a build makes of the frames that were fused.
    """

    def __init__(
        self,
        path: str | Path,
        encoders: "Encoders | Profile | str | None" = None,
        *,
        up_in_world: Any = None,
        settings: BuildSettings | None = None,
        live: LiveSettings | None = None,
        query: QuerySettings | None = None,
        overwrite: bool = False,
        begins_s: Any = 0.0,
        microphones: Microphones | str | Path | None = None,
        same_device: str | Path | None = None,
    ) -> None:
        """Begin an empty map, and hold its folder.

        Args:
            path: folder of the map, by custom ``NAME.avlmap``.
            encoders: the models that perceive; those of the profile ``embedded`` if None.
            up_in_world: the direction that is up in the world of the poses; None finds it in the frames.
            settings: of the build; by default those of a build, with gates half as many keyframes.
            live: which frames are fused, and how often it is saved.
            query: how to query.
            overwrite: replace a map that is there.
            begins_s: what the clock said at stamp 0, seconds since 1970, so that the day is known when days are merged;
                0 where the stamps are dates already, or no clock is known.
            microphones: where those of the sound's channels are, as ``microphones`` of ``recording.json``; the name of
                an array or a JSON file will do. With them the map knows where its sounds came from.
            same_device: map of an earlier drive with the same device that says directions: its offset is known from
                there.

        Raises:
            MapError: settings are of another kind, ``begins_s`` is no time, the folder is something else or a map,
                another process writes it, or ``same_device`` is no map or knows of none.
            RecordingError: the microphones cannot be.
            BackendError: there is no such profile.
        """
        require_kinds(
            ("settings", settings, BuildSettings), ("live", live, LiveSettings), ("query", query, QuerySettings)
        )
        self.path, self.settings, self._query = lasting_path(path), live or LiveSettings(), query
        began_s = as_number(begins_s)
        if began_s is None or not isfinite(began_s):
            raise MapError(f"begins_s is {begins_s!r}, which is no time; give seconds since 1970, or leave it out.")
        if fault := date_fault(np.array([began_s]), "begins_s"):
            raise MapError(fault)
        used = encoders_of("embedded" if encoders is None else encoders)
        array = None if microphones is None else given_microphones(microphones)
        known_rad = None if same_device is None else device_of(open_stored(same_device))
        require_place(self.path, overwrite)
        self._held = contextlib.ExitStack()
        self._held.enter_context(lock_folder(self.path))
        chosen = settings or (SPARSE if self.settings.gates else BuildSettings())
        wait = self.settings.first_frames if self.settings.gates else None
        self._growing = GrowingMap(chosen, used, direction(up_in_world), wait=wait, looks_later=True, begins_s=began_s)
        if array is not None:
            self._growing.place_microphones(array)
        if known_rad is not None:
            self._growing.know_device(known_rad)
        self._gates = Gates(self.settings, chosen.fusion.max_depth_m)
        self._encoding = EncodingGate(self.settings, self._growing.settings.fusion)
        keeps = self.settings.gates and not chosen.frames.per_submap  # corrected poses would not reach them
        self._kept = KeptBack(self.settings.kept_frames if keeps else 0)
        self._check, self._tally = PoseCheck(), Tally()
        self._queue: deque[tuple[Frame, float]] = deque()
        self._late: deque[Frame] = deque()  # older than those in the queue, to be stored
        self._in_hand_s: float | None = None  # when the frame arrived that is being fused
        self._unsaved, self._unsaved_sounds = Unsaved(), Unsaved()
        self._is_known = False  # the last frame brought nothing new, and there are frames to look at again
        self._is_pressed = False  # whether the frames come by the clock, and are late if we are slow
        self._door, self._ears = Condition(), Lock()
        self._last: Frame | None = None
        self._fault: BackendError | None = None
        self._broken: BaseException | None = None
        self._is_told = False  # a call raised what broke
        self._doubts: list[str] = []
        self._asked: Future[_Came | None] | None = None  # what the thread behind waits for; under the door
        self._fuser_ended = False  # under the door
        self._to_correct: deque[_Correction] = deque()  # under the door
        self._snapshot: tuple[AVLMap, float] | None = None
        self._generation, self._listened_s = 0, 0.0
        self._closing, self._closed, self._leaves_kept = False, False, False
        self._ending = Lock()
        self._final: AVLMap | None = None  # what ``close`` returned
        self._saver = Saver(self.path, self.settings.save_s, self._doubt, self._break)
        self._fuser = Thread(target=self._fuse_and_answer, name="avlmaps-fuse", daemon=True)
        self._stop_behind = Event()
        self._behind = Thread(target=self._work_behind, name="avlmaps-behind", daemon=True)
        self._fuser.start()
        self._behind.start()

    def add_frame(
        self,
        rgb: Any,
        depth_m: Any,
        camera: Any,
        world_from_camera: Any,
        stamp_s: Any = None,
        *,
        wait: bool = False,
    ) -> None:
        """Add a frame; see ``VoxelMap.add``. It returns at once, unless it is to wait.

        Args:
            rgb: colour picture, (h, w, 3) uint8.
            depth_m: z-depth in metres, (hd, wd) floats; 0, NaN or infinity where there is none.
            camera: a ``Pinhole`` of the colour picture, whose view the depth shares; or a ``Rig`` of both cameras.
            world_from_camera: 4x4 pose of the depth camera (OpenCV axes), metres.
            stamp_s: seconds, rising from frame to frame; by default 0.1 s after the one before.
            wait: until there is room in the queue; else the frame that waits the longest is late, and makes room.

        Raises:
            RecordingError: it is no frame, comes out of order or again, or is of another camera; the map is as it was.
            BackendError: an encoder failed on frames before; they are left out, and this one is added.
            MapError: the map is closed.
        """
        arrived_s = time.perf_counter()
        with self._door:
            self._require_open()
            if wait:
                self._door.wait_for(lambda: len(self._queue) < self.settings.most_waiting or self._fuser_ended)
                self._require_open()
            if stamp_s is None:
                stamp_s = 0.0 if self._last is None else self._last.stamp_s + _STEP_S
            try:
                last = self._last
                frame = given_frame(self._tally.of("came"), rgb, depth_m, camera, world_from_camera, stamp_s)
                if last is not None:
                    frame = next_of(frame, last.stamp_s, last.rig)
            except RecordingError:
                self._tally.note("refused")
                raise
            self._tally.note("came")
            self._last = frame
            if len(self._queue) >= self.settings.most_waiting:
                self._tally.drop("late")
                self._late.append(self._queue.popleft()[0])
                if len(self._late) > (_MOST_LATE if self._kept.most else 0):
                    self._late.popleft()
            self._queue.append((frame, arrived_s))
            self._is_pressed = not wait
            self._door.notify_all()
            self._raise_fault()

    @property
    def microphones(self) -> Microphones | None:
        """Where those of the sound's channels are; None where that is not known."""
        return self._growing.microphones

    def place_microphones(self, microphones: Any) -> None:
        """Say where the microphones are, where that was not known at the beginning.

        Args:
            microphones: as those of ``LiveMap``.

        Raises:
            AudioError: sound came before.
            RecordingError: the microphones cannot be.
            MapError: the map is closed.
        """
        self._require_open()
        array = given_microphones(microphones)
        with self._ears:
            self._growing.place_microphones(array)

    def add_audio(self, chunk: Any, stamp_s: Any = None) -> None:
        """Add a piece of the microphone's sound; see ``VoxelMap.add_audio``.

        Args:
            chunk: a ``Sound`` of one channel, or a ``ChannelSound`` of several: (m, n) float32 samples and their rate.
            stamp_s: when its first sample sounds, on the clock of the frames; None where the one before ended.

        Raises:
            AudioError: it is no sound, has another rate, other channels or not those of the microphones, repeats what
                came, or is of another clock; what came stays as it was.
            MapError: the map is closed.
        """
        with self._hearing():
            self._growing.add_audio(chunk, stamp_s)

    def add_directions(self, stamp_s: Any, azimuth_rad: Any, elevation_rad: Any = None, confidence: Any = None) -> None:
        """Add what a device said of where sounds come from: one direction, or some.

        The device's constant offset is found along the drive, and its outliers count little, as in a build.

        Args:
            stamp_s: when, on the clock of the frames; rising, also from call to call.
            azimuth_rad: from where the depth camera looks, counter-clockwise, but for the device's offset.
            elevation_rad: over the horizon; NaN or None where it is not known.
            confidence: how much each counts, 0 to 1; None for 1.

        Raises:
            RecordingError: they are no angles in radians, or out of the order of time; what came stays as it was.
            MapError: the map is closed.
        """
        with self._hearing():
            self._growing.add_directions(given_directions(stamp_s, azimuth_rad, elevation_rad, confidence))

    @contextlib.contextmanager
    def _hearing(self) -> Generator[None]:
        """Let one thread give sounds, and count what is refused."""
        self._require_open()
        with self._ears:
            try:
                yield
            except (AudioError, RecordingError):
                self._tally.note("refused")
                raise

    def correct_poses(self, stamps_s: Any, poses: Any) -> tuple[float, float]:
        """Move the map to corrected poses of its frames; see ``VoxelMap.correct_poses``. Any thread may call it.

        It waits for the frames before it and for the snapshot that is being made, and then takes its turn among the
        frames; those that come meanwhile may be late. Questions have the old map until the next snapshot.

        Raises:
            MapError: there are no submaps or no frames, the poses are not of its frames, or the map is closed.
            RecordingError: a pose is no rigid motion.
        """
        answer: Future[tuple[float, float]] = Future()
        with self._door:
            self._require_open()
            if self._fuser_ended:
                raise MapError(f"The live map {self.path} is closed; begin another.")
            self._to_correct.append((stamps_s, poses, answer))
            self._door.notify_all()
        return answer.result()

    def count_late(self, frames: int) -> None:
        """Count frames that were dropped as late before they came here: by a source that could not read them in time.

        Args:
            frames: how many.
        """
        for _ in range(frames):
            self._tally.note("came")
            self._tally.drop("late")

    @property
    def map(self) -> AVLMap:
        """The last snapshot, to be queried in every way; it does not change.

        Raises:
            MapError: there is none yet.
        """
        snapshot = self._snapshot
        if snapshot is None:
            raise MapError(
                f"The live map has no surface yet ({self._tally.of('came')} frames came); ask again in a moment."
            )
        return snapshot[0]

    @property
    def generation(self) -> int:
        """How many snapshots there were; it rises when ``map`` becomes another."""
        return self._generation

    def ask(self, question: Any = "", *args: Any, **parts: Any) -> "Answer":
        """Answer a query on the last snapshot, from any thread; see ``AVLMap.ask``."""
        return self.map.ask(question, *args, **parts)

    @property
    def doubts(self) -> tuple[str, ...]:
        """One sentence for each thing that is not as it should be: poses that do not fit, saves that failed."""
        return (*self._doubts, *self._growing.doubts)

    def status(self) -> LiveStatus:
        """Return how the map fares."""
        snapshot, track, now_s = self._snapshot, self._growing.sound_track, time.perf_counter()
        counts = snapshot[0].stored.info.counts if snapshot is not None else None
        p50_ms, p95_ms = self._tally.quantiles_ms()
        return LiveStatus(
            frames_in=self._tally.of("came"),
            fused=self._tally.of("fused"),
            encoded=self._tally.of("encoded"),
            encoded_later=self._tally.of("encoded later"),
            kept=len(self._kept),
            dropped=self._tally.dropped(),
            late_kept=self._tally.of("late kept"),
            refused=self._tally.of("refused"),
            waiting=len(self._queue),
            frame_ms_p50=p50_ms,
            frame_ms_p95=p95_ms,
            voxels=counts.voxels if counts else 0,
            keyframes=counts.keyframes if counts else 0,
            sounds=counts.sounds if counts else 0,
            snapshot_age_s=now_s - snapshot[1] if snapshot is not None else float("nan"),
            saved_age_s=now_s - self._saver.saved_s,
            unsaved_s=self._unsaved_s(now_s),
            memory_mb=memory_mb(),
            sound_gaps=0 if track is None else track.gaps,
            doubts=self.doubts,
        )

    def close(self, *, kept: bool = True) -> AVLMap:
        """Fuse what waits and end as a build does: find up, the floor, places and sounds, write the map and open it.

        Args:
            kept: encode the frames first that wait on the disk (``status().kept``), a sixth of a second each. False
                leaves them out: what they alone have seen, and their part of the features. So it ends a ``close`` that
                another thread is in, or that was interrupted.

        Raises:
            MapError: no frame came, or the map cannot be finished: the last save is still there, and closing may be
                tried again. Or a thread broke, which no call reported yet: what was fused is written, and closing again
                returns that map.
            BackendError: an encoder is missing, or broke its protocol.
        """
        with self._door:
            self._closing, self._leaves_kept = True, self._leaves_kept or not kept
            self._door.notify_all()
        with self._ending:
            self._final = self._end() if self._final is None else self._final
            return self._final

    def _end(self) -> AVLMap:
        if waiting := self._to_look_at():
            for _ in progress(self._looks_until_the_end(), "encoding what waited", total=waiting):
                pass
        self._fuser.join()
        lost = len(self._queue) + (self._in_hand_s is not None) + self._to_look_at()
        self._kept.close()
        self._stop_behind.set()
        self._behind.join()
        self._saver.close()
        if not self._closed:
            try:
                if len(self._growing):
                    self._saver.write(self._growing.stored(final=True), self._growing.submaps())
            except BaseException as fault:
                if not len(self._growing) or not self.path.is_dir():
                    self._held.close()
                if isinstance(fault, AvlmapsError) or not isinstance(fault, Exception):
                    raise
                raise MapError(
                    f"The live map {self.path} could not be finished ({type(fault).__name__}: {fault}); what was saved "
                    "is still there. Close it again, or build it from a recording of the drive."
                ) from fault
            self._closed = True
            self._held.close()
        if not len(self._growing):
            raise MapError(f"No frame came, so that there is no map in {self.path}; add frames before it is closed.")
        stored = replace(open_stored(self.path), encoders=self._growing.encoders)
        self._snapshot = AVLMap(stored, self._query), time.perf_counter()
        self._generation += 1
        if self._broken is not None and not self._is_told:
            self._is_told = True
            raise MapError(
                f"A thread of the live map broke ({type(self._broken).__name__}: {self._broken}); the map {self.path} "
                f"is whole, with {len(self._growing)} frames, and {lost} that waited are left out. Closing it again "
                "returns it; please report this fault."
            ) from self._broken
        return self._snapshot[0]

    def _looks_until_the_end(self) -> Iterator[None]:
        """Yield once for each frame on the disk that was looked at, until the thread that fuses has ended."""
        before = self._to_look_at()
        while self._fuser.is_alive():
            self._fuser.join(_LOOK_S)
            left = self._to_look_at()
            yield from [None] * (before - left)
            before = left

    def __enter__(self) -> "LiveMap":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close(kept=not isinstance(error, KeyboardInterrupt))
        except AvlmapsError:
            if error is None:
                raise
        finally:
            self._held.close()

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        return self._tally.of("fused")

    def __repr__(self) -> str:
        return f"LiveMap({self.path.name!r}: {self.status()})"

    # The caller's thread

    def _unsaved_s(self, now_s: float) -> float:
        """Return how old the oldest thing is that came and is in no save."""
        if self._closed:
            return 0.0
        with self._door:
            since_s = [self._in_hand_s, *(arrived_s for _, arrived_s in self._queue)]
        since_s += [
            self._unsaved.since_s(self._saver.saved_s), self._unsaved_sounds.since_s(self._saver.heard_s),
        ]  # fmt: skip
        return now_s - min((one for one in since_s if one is not None), default=now_s)

    def _require_open(self) -> None:
        if self._closing:
            raise MapError(f"The live map {self.path} is closed; begin another.")
        if self._broken is not None:
            self._is_told = True
            raise self._broken

    def _raise_fault(self) -> None:
        """Raise what an encoder failed with since the last time."""
        fault, self._fault = self._fault, None
        if fault is not None:
            raise fault

    # The thread that fuses

    def _fuse_and_answer(self) -> None:
        """Fuse until the map is closed; however that ends, who asks gets an answer."""
        try:
            self._fuse_all()
        except BaseException as fault:
            self._break(fault)
            raise
        finally:
            with self._door:
                self._fuser_ended = True
                self._answer(None)
                for _, _, answer in self._to_correct:
                    answer.set_exception(MapError(f"The live map {self.path} was closed before; begin another."))
                self._to_correct.clear()
                self._door.notify_all()

    def _fuse_all(self) -> None:
        is_calm = False  # no frame came for a while
        while True:
            with self._door:
                while not (self._queue or self._closing or self._to_correct or self._asked):
                    if self._to_look_at() and self._growing.sums and (is_calm or self._is_known):
                        break
                    is_calm = not self._door.wait(_CALM_S if len(self._kept) else None) or is_calm
                frame, arrived_s = self._queue.popleft() if self._queue else (None, 0.0)
                self._in_hand_s = None if frame is None else arrived_s
                late, self._late = self._late, deque()
                self._door.notify_all()
            if frame is not None:
                is_calm = False
                self._fuse_after(late, frame, arrived_s)
            elif self._to_correct:
                self._correct()
            elif is_calm or self._is_known or self._closing:
                self._look_again()
            if self._asked is not None:  # set by the thread behind alone, which waits for the answer
                self._freeze()
            if frame is None and self._closing and not (self._queue or self._to_correct or self._to_look_at()):
                return

    def _fuse_after(self, late: Iterable[Frame], frame: Frame, arrived_s: float) -> None:
        """Fuse a frame, and store those before it that came late."""
        for one in late:
            self._growing.pass_by(one.stamp_s, one.world_from_camera)
        self._fuse(frame, arrived_s)
        for one in late:
            if self._keep(one, is_fused=False, times=_STILL if self._gates.is_still(one) else 1.0):
                self._tally.note("late kept")

    def _fuse(self, frame: Frame, arrived_s: float) -> None:
        growing, number = self._growing, self._growing.next_index
        try:
            track = growing.sound_track
            heard = (None, 0.0) if track is None else (track.end_s, track.gap_s)
            for doubt in self._check.add(frame, *heard, arrived_s if self._is_pressed else None):
                self._doubt(doubt)
                growing.doubt(doubt)
            reason = self._gates.reason_against(frame, growing.sums) if self.settings.gates else None
            self._is_known = reason is not None and len(self._kept) > 0
            if reason is not None:
                growing.pass_by(frame.stamp_s, frame.world_from_camera)
                self._tally.drop(reason)
                self._keep(frame, is_fused=False, times=1.0 if reason == "known" else _STILL)
            else:
                encode = not self.settings.gates or (
                    self._has_time(arrived_s)
                    and self._encoding.opens(frame, len(self._queue) if self._is_pressed else 0)
                )
                named = replace(frame, index=number, name=f"{number:06d}")
                growing.add(named, encode=encode)
                self._unsaved.note(arrived_s)
                self._tally.note("fused")
                if encode:
                    self._tally.note("encoded")
                else:
                    self._keep(named, is_fused=True)
        except BackendError as fault:
            self._tally.drop("wrong")
            self._fault = fault
            if growing.next_index == number:  # else it waits, or was listed
                growing.leave_out(str(fault))
                growing.pass_by(frame.stamp_s, frame.world_from_camera)
        except AvlmapsError as fault:
            self._tally.drop("wrong")
            self._doubt(str(fault))
        self._in_hand_s = None
        self._tally.took(time.perf_counter() - arrived_s)

    def _has_time(self, arrived_s: float) -> bool:
        """Return whether a frame may be encoded at once."""
        return not self._is_pressed or time.perf_counter() - arrived_s <= self.settings.fresh_s

    def _keep(self, frame: Frame, *, is_fused: bool, times: float = 1.0) -> bool:
        """Keep a frame until there is time, where looking at it will bring something; return whether it is stored."""
        if not self._kept.most or not self._growing.looks_again:
            return False
        worth = self._encoding.worth_later(frame)
        try:
            return self._kept.keep(frame, times * worth if worth > LATER_SHARE else 0.0, is_fused=is_fused)
        except MapError as fault:
            self._doubt(str(fault))
            return False

    def _to_look_at(self) -> int:
        """Return how many frames on the disk are to be looked at before the end."""
        return 0 if self._leaves_kept else len(self._kept)

    def _look_again(self) -> None:
        """Encode the frame that is worth most of those on the disk, unless it brings nothing any more."""
        self._is_known = False
        if not (self._growing.sums or self._closing):  # they add to the first frames, which wait for one another
            return
        came_s, taken = time.perf_counter(), None
        try:
            if not self._growing.sums:  # the drive is over before all of these came
                self._growing.settle()
            taken = self._kept.take() if self._growing.sums else None
            if taken is not None and self._encoding.opens_again(taken[0]):
                self._growing.look_again(taken[0], is_fused=taken[1])
                self._unsaved.note(came_s)
                self._tally.note("encoded later")
        except AvlmapsError as fault:
            self._doubt(str(fault))
            if taken is not None and not taken[1]:
                self._growing.leave_out(str(fault))
        if not self._growing.sums:  # no first frame was right
            self._kept.close()

    def _correct(self) -> None:
        with self._door:
            stamps_s, poses, answer = self._to_correct.popleft()
        try:
            moved = self._growing.correct_poses(stamps_s, poses)
        except BaseException as fault:
            answer.set_exception(fault)
            if not isinstance(fault, AvlmapsError):
                raise
            return
        self._unsaved.note(time.perf_counter())
        self._tally.note("corrected")
        self._check = PoseCheck()  # the next pose is of the corrected world, which is no jump
        answer.set_result(moved)

    def _freeze(self) -> None:
        try:
            came = self._growing.freeze(), time.perf_counter()
            self._unsaved.freeze(came[1])
        except MapError:  # up and the floor are not found yet
            came = None
        with self._door:
            self._answer(came)

    def _answer(self, came: "_Came | None") -> None:
        """Give the thread behind what it waits for, if it does; under the door."""
        if self._asked is not None:
            self._asked.set_result(came)
            self._asked = None

    def _break(self, fault: BaseException) -> None:
        """Note what broke a thread; it is raised at every frame to come."""
        self._broken = fault

    def _doubt(self, sentence: str) -> None:
        if len(self._doubts) < _MOST_DOUBTS and sentence not in self._doubts:
            self._doubts.append(sentence)

    # The thread behind

    def _work_behind(self) -> None:
        """Make snapshots and saves until the map is closed; what breaks this is raised at every frame to come."""
        try:
            self._publish_all()
        except BaseException as fault:
            self._break(fault)
            raise

    def _publish_all(self) -> None:
        from_s, known = 0.0, (0,) * len(_CHANGES)
        while not self._stop_behind.wait(_IDLE_S):
            begin_s, state = time.perf_counter(), tuple(map(self._tally.of, _CHANGES))
            if state == known or begin_s < from_s:
                self._try(self._publish_sounds)
            elif (came := self._what_came()) is not None and not (self._closing and not self._to_look_at()):
                known = state
                self._try(partial(self._publish, *came))
                end_s = time.perf_counter()
                from_s = max(begin_s + self.settings.snapshot_s, end_s + min(end_s - begin_s, _REST_S))

    def _try(self, work: Callable[[], None]) -> None:
        try:
            work()
        except AvlmapsError as fault:
            self._doubt(str(fault))

    def _what_came(self) -> "_Came | None":
        """Let the thread that fuses freeze what came; None where there is nothing, or it has ended."""
        with self._door:
            if self._fuser_ended:
                return None
            self._asked = answer = Future()
            self._door.notify_all()
        return answer.result()

    def _publish(self, came: FrozenSums, came_s: float) -> None:
        heard_s = time.perf_counter()
        with self._growing.finishing:
            if not self._growing.is_current(came):  # poses were corrected since: the next one has them
                return
            stored = self._growing.finish(came, looks_s=_LOOKS_S)
        self._saver.offer(stored, came_s, heard_s)
        self._show(stored, came_s)

    def _publish_sounds(self) -> None:
        """Put sounds that ended since the last snapshot into it: a person asks for them at once."""
        now_s, snapshot = time.perf_counter(), self._snapshot
        if snapshot is None or now_s < self._listened_s + _LISTEN_S:
            return
        self._listened_s = now_s
        stored, heard = snapshot[0].stored, self._growing.heard()
        if heard is None:
            return
        if not np.array_equal(heard.offset_s, stored.sounds.offset_s):
            newer = self._growing.with_sounds(stored, heard)  # a name need not wait for its source
        elif stored.data.sources_wait:
            newer = self._growing.with_sources(stored)
        else:
            return
        if newer is not stored:
            self._unsaved_sounds.note(now_s)
            self._unsaved_sounds.freeze(now_s)
            self._saver.offer(newer, snapshot[1], now_s)
            self._show(newer, snapshot[1])

    def _show(self, stored: StoredMap, came_s: float) -> None:
        made = AVLMap(stored, self._query)
        if self._generation:
            _warm(made)
        else:  # it loads and compiles what every question needs, which takes longer than the next snapshot may wait
            # No daemon: a process that ends while one is in compiled code is aborted.
            Thread(target=_warm, args=(made,), name="avlmaps-warm", daemon=False).start()
        self._snapshot = made, came_s
        self._generation += 1


def _warm(made: AVLMap) -> None:
    """Compute what most questions need, so that the first one does not wait for it: the closest words, the rooms."""
    with contextlib.suppress(AvlmapsError):  # a profile without names, or a map too small for rooms
        made.ask("the chair in the kitchen")
