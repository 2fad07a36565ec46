"""A map that is made while a robot drives: frames in, questions at any moment, saved all along.

Two threads work on one ``Mapper``. The caller's puts frames into a short queue. One fuses them. One works behind: it
makes snapshots (keyframes are described there, sounds found and located), and saves them. A question uses the snapshot
that there is; nothing that comes later changes it. One lock, the door, is held for moments by all that comes.
"""

import contextlib
import time
from collections import Counter, deque
from collections.abc import Callable, Generator
from dataclasses import replace
from math import isfinite
from pathlib import Path
from threading import Condition, Event, Lock, Thread
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from avlmaps.core.arrays import Float
from avlmaps.core.errors import AudioError, AvlmapsError, BackendError, MapError, RecordingError
from avlmaps.core.files import lasting_path
from avlmaps.core.machine import release_memory, share_heap
from avlmaps.core.numbers import as_number
from avlmaps.core.poses import apply, rotation_angle_rad
from avlmaps.core.progress import say
from avlmaps.core.wording import option
from avlmaps.live.pose_check import PoseCheck
from avlmaps.live.status import LiveSettings, LiveStatus, memory_mb
from avlmaps.maps.hearing import device_of
from avlmaps.maps.mapper import Mapper
from avlmaps.maps.plan import require_place
from avlmaps.maps.settings import BuildSettings, KeyframeSettings
from avlmaps.maps.store.folder import read, write
from avlmaps.maps.store.map_data import MapData
from avlmaps.maps.store.tables import lock_folder
from avlmaps.perception.encoders import Encoders, encoders_of
from avlmaps.query.avlmap import AVLMap, with_findings
from avlmaps.query.settings import QuerySettings
from avlmaps.query.voxel_map import IN_MEMORY, direction, require_kinds
from avlmaps.recordings.memory import given_frame, next_of
from avlmaps.recordings.microphones import Microphones, given_directions, given_microphones
from avlmaps.recordings.plausible import date_fault
from avlmaps.recordings.types import Frame

if TYPE_CHECKING:
    from avlmaps.query.answer import Answer

_ROWS, _COLUMNS = 30, 40  # points of a frame that are looked up


class Gates:
    """Says of each frame whether it is fused; depths beyond ``farthest_m`` do not count."""

    def __init__(self, settings: LiveSettings, farthest_m: float) -> None:
        self._settings, self._farthest_m = settings, farthest_m
        self._last: Float[np.ndarray, "4 4"] | None = None

    def reason_against(self, frame: Frame, mapper: Mapper) -> str | None:
        """Return why a frame brings nothing, ``still`` or ``known``; None where it is to be fused."""
        pose, last = np.asarray(frame.world_from_camera, np.float64), self._last
        if not len(mapper) or last is None or self._new_share(frame, mapper) > self._settings.new_share:
            self._last = pose
            return None
        moved_m = float(np.linalg.norm(pose[:3, 3] - last[:3, 3]))
        looks_there = rotation_angle_rad(pose, last) < np.radians(self._settings.still_deg)
        return "still" if looks_there and moved_m < self._settings.still_m else "known"

    def _new_share(self, frame: Frame, mapper: Mapper) -> float:
        world = _points(frame, self._farthest_m)
        if not len(world):
            return 0.0
        views = mapper.views_at(np.floor(world / mapper.settings.voxel_size_m).astype(np.int32))
        return float((views < self._settings.known_views).mean())


def _points(frame: Frame, farthest_m: float) -> Float[np.ndarray, "n 3"]:
    camera = frame.rig.depth
    row = ((np.arange(_ROWS) + 0.5) * camera.height / _ROWS).astype(np.int64)[:, None]
    column = ((np.arange(_COLUMNS) + 0.5) * camera.width / _COLUMNS).astype(np.int64)
    z = frame.depth_m[row, column].astype(np.float64)
    x, y = (column + 0.5 - camera.cx) / camera.fx * z, (row + 0.5 - camera.cy) / camera.fy * z
    points = np.stack([x, y, z], axis=-1)[(z > 0.0) & (z < farthest_m)]
    return apply(np.asarray(frame.world_from_camera, np.float64), points)


# A keyframe takes as long as three frames; with gates there are half as many as in a build.
SPARSE = BuildSettings(keyframes=KeyframeSettings(translation_m=0.2, rotation_deg=14.0))
_STEP_S = 0.1
_MOST_DOUBTS, _MOST_TIMES = 100, 5000
_LISTEN_S = 0.4  # from one look for sounds that ended to the next
_REST_S = 1.0  # between two snapshots, at most, where one takes longer than that


class LiveMap:
    """A map that is made while a robot drives.

    Example:
        with avlmaps.LiveMap("home.avlmap") as live:
            live.add_frame(rgb, depth_m, camera, world_from_camera, stamp_s)
            live.add_audio(avlmaps.Sound(samples, 16_000), stamp_s)  # of an array: microphones=..., ChannelSound
            live.ask("the chair near the sound of a dog").text

    The folder is a whole map at any moment from the first save on, also when the process is killed; another process
    may open it. What came after the last save is lost then, a few seconds (``status().unsaved_s``). At the end, it is
    the map that a build makes of the frames that were fused, where it encodes the same ones (``FrameSettings.look_m``).
    """

    def __init__(
        self,
        path: str | Path,
        encoders: "Encoders | str | None" = None,
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
            microphones: where those of the sound's channels are, as ``microphones`` of ``recording.json``, the name of
                an array or a JSON file: the map then knows where its sounds came from.
            same_device: map of an earlier drive with a device that says directions: its offset is known from there.

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
        known_rad = None if same_device is None else device_of(same_device)
        require_place(self.path, overwrite)
        self._held = contextlib.ExitStack()
        self._held.enter_context(lock_folder(self.path))
        chosen = settings or (SPARSE if self.settings.gates else BuildSettings())
        wait = self.settings.first_frames if self.settings.gates else None
        self._mapper = Mapper(
            chosen, used, direction(up_in_world), first_frames=wait, behind=True, begins_s=began_s
        )  # fmt: skip
        if array is not None:
            self._mapper.hearing.place_microphones(array)
        self._mapper.hearing.known_rad = known_rad
        self._gates = Gates(self.settings, chosen.fusion.max_depth_m)
        self._check = PoseCheck()
        self._counts, self._dropped = Counter[str](), Counter[str]()
        self._took_ms = deque[float](maxlen=_MOST_TIMES)
        # Under the door: sound, what came and waits, and whether that ends.
        self._door = Condition()
        self._queue: deque[tuple[Frame, float]] = deque()
        self._in_hand_s: float | None = None  # when the frame arrived that is being fused
        self._closing, self._fuser_ended = False, False
        self._is_pressed = False  # whether the frames come by the clock, and are late if we are slow
        self._last: Frame | None = None
        self._new_s: float | None = None  # when the oldest came that is in no snapshot,
        self._shown_s: float | None = None  # and that is in no save
        self._saved_s = float("nan")  # up to when the last save holds what came
        self._fault: BackendError | None = None
        self._broken: BaseException | None = None
        self._is_told = False  # a call raised what broke
        self._doubts: list[str] = []
        self._snapshot: tuple[AVLMap, float] | None = None
        self._generation, self._closed, self._final = 0, False, None
        self._ending, self._stop_behind = Lock(), Event()
        share_heap()
        self._fuser = Thread(target=self._in_thread, args=(self._fuse_all,), name="avlmaps-fuse", daemon=True)
        self._behind = Thread(target=self._in_thread, args=(self._publish_all,), name="avlmaps-behind", daemon=True)
        self._fuser.start()
        self._behind.start()

    def add_frame(
        self, rgb: Any, depth_m: Any, camera: Any, world_from_camera: Any, stamp_s: Any = None, *, wait: bool = False
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
                frame = given_frame(self._counts["came"], rgb, depth_m, camera, world_from_camera, stamp_s)
                if last is not None:
                    frame = next_of(frame, last.stamp_s, last.rig)
            except RecordingError:
                self._counts["refused"] += 1
                raise
            self._counts["came"] += 1
            self._last = frame
            if len(self._queue) >= self.settings.most_waiting:
                self._dropped["late"] += 1
                late = self._queue.popleft()[0]
                self._mapper.pass_by(late.stamp_s, late.world_from_camera)
            self._queue.append((frame, arrived_s))
            self._is_pressed = not wait
            self._door.notify_all()
            fault, self._fault = self._fault, None
        if fault is not None:
            raise fault

    @property
    def microphones(self) -> Microphones | None:
        """Where those of the sound's channels are; None where that is not known."""
        return self._mapper.hearing.microphones

    def place_microphones(self, microphones: Any) -> None:
        """Say where the microphones are, in a form of ``LiveMap``'s, where that was not known at the beginning.

        Raises:
            AudioError: sound came before.
            RecordingError: the microphones cannot be.
            MapError: the map is closed.
        """
        self._require_open()
        array = given_microphones(microphones)
        with self._door:
            self._mapper.hearing.place_microphones(array)

    def add_audio(self, chunk: Any, stamp_s: Any = None) -> None:
        """Add a piece of the microphone's sound (``Sound``, ``ChannelSound``); see ``VoxelMap.add_audio``.

        ``stamp_s`` is when its first sample sounds, on the clock of the frames; None where the one before ended.

        Raises:
            AudioError: it is no sound, has another rate, other channels or not those of the microphones, repeats what
                came, or is of another clock; what came stays as it was.
            MapError: the map is closed.
        """
        with self._hearing():
            self._mapper.add_sound(chunk, stamp_s)

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
            self._mapper.hearing.add_directions(given_directions(stamp_s, azimuth_rad, elevation_rad, confidence))

    @contextlib.contextmanager
    def _hearing(self) -> Generator[None]:
        with self._door:
            self._require_open()
            try:
                yield
            except (AudioError, RecordingError):
                self._counts["refused"] += 1
                raise

    def correct_poses(self, stamps_s: Any, poses: Any) -> tuple[float, float]:
        """Move the map to corrected poses of its frames; see ``VoxelMap.correct_poses``. Any thread may call it.

        It waits for the frames before it and for the snapshot that is being made; frames that come meanwhile may be
        late. Questions have the old map until the next snapshot.

        Raises:
            MapError: there are no submaps or no frames, the poses are not of its frames, or the map is closed.
            RecordingError: a pose is no rigid motion.
        """
        with self._ending:
            with self._door:
                self._require_open()
                self._door.wait_for(lambda: self._fuser_ended or not (self._queue or self._in_hand_s))
                self._require_open()
            self._check = PoseCheck()  # the next pose is of the corrected world, which is no jump
            moved = self._mapper.correct_poses(stamps_s, poses)
            self._came(time.perf_counter())
            return moved

    @property
    def map(self) -> AVLMap:
        """The last snapshot, to be queried in every way; it does not change.

        Raises:
            MapError: there is none yet.
        """
        snapshot = self._snapshot
        if snapshot is None:
            raise MapError(
                f"The live map has no surface yet ({self._counts['came']} frames came); ask again in a moment."
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
        return (*self._doubts, *self._mapper.doubts)

    def status(self) -> LiveStatus:
        """Return how the map fares."""
        snapshot, track, now_s = self._snapshot, self._mapper.hearing.came, time.perf_counter()
        counts = snapshot[0].data.info.counts if snapshot is not None else None
        p50_ms, p95_ms = np.percentile(list(self._took_ms) or [np.nan], [50, 95]).tolist()
        return LiveStatus(
            frames_in=self._counts["came"],
            fused=self._counts["fused"],
            encoded=self._counts["encoded"],
            dropped=dict(self._dropped),
            refused=self._counts["refused"],
            waiting=len(self._queue),
            frame_ms_p50=p50_ms,
            frame_ms_p95=p95_ms,
            voxels=counts.voxels if counts else 0,
            keyframes=counts.keyframes if counts else 0,
            sounds=counts.sounds if counts else 0,
            snapshot_age_s=now_s - snapshot[1] if snapshot is not None else float("nan"),
            saved_age_s=now_s - self._saved_s,
            unsaved_s=self._unsaved_s(now_s),
            memory_mb=memory_mb(),
            sound_gaps=0 if track is None else track.gaps,
            doubts=self.doubts,
        )

    def close(self) -> AVLMap:
        """Fuse what waits and end as a build does: find up, the floor, places and sounds, write the map and open it.

        Raises:
            MapError: no frame came, or the map cannot be finished: the last save is still there, and closing may be
                tried again. Or a thread broke, which no call reported yet: what was fused is written, and closing again
                returns that map.
            BackendError: an encoder is missing, or broke its protocol.
        """
        with self._door:
            self._closing = True
            self._door.notify_all()
        with self._ending:
            self._final = self._end() if self._final is None else self._final
            return self._final

    def _end(self) -> AVLMap:
        self._fuser.join()
        lost = len(self._queue) + (self._in_hand_s is not None)
        self._stop_behind.set()
        self._behind.join()
        if not self._closed:
            try:
                if len(self._mapper):
                    write(self.path, with_findings(self._mapper.finish(), self._mapper.encoders))
            except BaseException as fault:
                if not len(self._mapper) or not self.path.is_dir():
                    self._held.close()
                if isinstance(fault, AvlmapsError) or not isinstance(fault, Exception):
                    raise
                raise MapError(
                    f"The live map {self.path} could not be finished ({type(fault).__name__}: {fault}); what was saved "
                    "is still there. Close it again, or build it from a recording of the drive."
                ) from fault
            self._closed = True
            self._held.close()
            if late := self._dropped["late"]:
                say(
                    f"note: {late} of {self._counts['came']} frames came while others waited and are not in the map; "
                    f"of a recording, {option('as-fast-as-possible', argument='wait', python='True')} takes every one."
                )
        if not len(self._mapper):
            raise MapError(f"No frame came, so that there is no map in {self.path}; add frames before it is closed.")
        made = AVLMap(read(self.path), self._mapper.encoders, path=self.path, settings=self._query)
        self._snapshot = made, time.perf_counter()
        self._generation += 1
        if self._broken is not None and not self._is_told:
            self._is_told = True
            raise MapError(
                f"A thread of the live map broke ({type(self._broken).__name__}: {self._broken}); the map {self.path} "
                f"is whole, with {len(self._mapper)} frames, and {lost} that waited are left out. Closing it again "
                "returns it; please report this fault."
            ) from self._broken
        return self._snapshot[0]

    def __enter__(self) -> "LiveMap":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        except AvlmapsError:
            if error is None:
                raise
        finally:
            self._held.close()

    def __len__(self) -> int:
        """Return how many frames are in the map."""
        return self._counts["fused"]

    def __repr__(self) -> str:
        return f"LiveMap({self.path.name!r}: {self.status()})"

    # The caller's thread

    def _unsaved_s(self, now_s: float) -> float:
        if self._closed:
            return 0.0
        with self._door:
            since_s = [self._new_s, self._shown_s, self._in_hand_s, *(arrived_s for _, arrived_s in self._queue)]
        return now_s - min((one for one in since_s if one is not None), default=now_s)

    def _require_open(self) -> None:
        if self._closing:
            raise MapError(f"The live map {self.path} is closed; begin another.")
        if self._broken is not None:
            self._is_told = True
            raise self._broken

    def _in_thread(self, work: Callable[[], None]) -> None:
        try:
            work()
        except BaseException as fault:
            self._broken = fault
            raise

    # The thread that fuses

    def _fuse_all(self) -> None:
        try:
            while True:
                with self._door:
                    self._in_hand_s = None
                    self._door.notify_all()
                    self._door.wait_for(lambda: self._queue or self._closing)
                    if not self._queue:
                        return
                    frame, self._in_hand_s = self._queue.popleft()
                    self._door.notify_all()
                    arrived_s = self._in_hand_s
                self._fuse(frame, arrived_s)
        finally:
            with self._door:
                self._fuser_ended = True
                self._door.notify_all()

    def _fuse(self, frame: Frame, arrived_s: float) -> None:
        mapper, number = self._mapper, self._mapper.next_index
        track = mapper.hearing.came
        try:
            for doubt in self._check.add(frame, None if track is None else track.end_s):
                self._doubt(doubt)
                mapper.doubt(doubt)
            reason = self._gates.reason_against(frame, mapper) if self.settings.gates else None
            if reason is not None:
                mapper.pass_by(frame.stamp_s, frame.world_from_camera)
                self._dropped[reason] += 1
            else:  # the encoder takes most of the time: where another frame waits, this one adds its surface alone
                encode = not (self.settings.gates and self._is_pressed and self._queue)
                mapper.add(replace(frame, index=number, name=f"{number:06d}"), encode=encode)
                self._came(arrived_s)
                self._counts["fused"] += 1
                if encode:
                    self._counts["encoded"] += 1
        except BackendError as fault:
            self._dropped["wrong"] += 1
            self._fault = fault
            if mapper.next_index == number:  # else it waits, or was listed
                mapper.leave_out(number, str(fault))
                mapper.pass_by(frame.stamp_s, frame.world_from_camera)
        except AvlmapsError as fault:
            self._dropped["wrong"] += 1
            self._doubt(str(fault))
        self._took_ms.append(1e3 * (time.perf_counter() - arrived_s))

    def _came(self, arrived_s: float) -> None:
        with self._door:
            self._new_s = arrived_s if self._new_s is None else min(self._new_s, arrived_s)

    def _doubt(self, sentence: str) -> None:
        if len(self._doubts) < _MOST_DOUBTS and sentence not in self._doubts:
            self._doubts.append(sentence)

    # The thread behind

    def _publish_all(self) -> None:
        next_s = save_s = 0.0
        while not self._stop_behind.wait(_LISTEN_S):
            begin_s = time.perf_counter()
            if self._mapper.start is None or (self._closing and self._fuser_ended):
                continue
            try:
                absorb = self._new_s is not None and begin_s >= next_s
                self._publish(begin_s, absorb=absorb)
                end_s = time.perf_counter()
                if absorb:
                    next_s = max(begin_s + self.settings.snapshot_s, end_s + min(end_s - begin_s, _REST_S))
                if self._shown_s is not None and end_s >= save_s:
                    assert self._snapshot is not None
                    write(self.path, self._snapshot[0].data)
                    self._saved_s, self._shown_s = self._snapshot[1], None
                    save_s = max(end_s + self.settings.save_s, time.perf_counter() + _REST_S)
            except AvlmapsError as fault:
                self._doubt(str(fault))

    def _publish(self, now_s: float, *, absorb: bool) -> None:
        before = None if self._snapshot is None else self._snapshot[0].data
        if before is None and not absorb:
            return
        if absorb:
            with self._door:
                new_s, self._new_s = self._new_s, None
                self._shown_s = min(one for one in (self._shown_s, new_s, now_s) if one is not None)
        made = self._mapper.snapshot(absorb=absorb)
        if before is not None and all(
            getattr(made, name) is getattr(before, name) for name in ("voxels", "sounds", "sources")
        ):
            return
        with self._door:
            self._shown_s = now_s if self._shown_s is None else self._shown_s
        self._show(made, now_s if absorb or self._snapshot is None else self._snapshot[1])

    def _show(self, data: MapData, came_s: float) -> None:
        made = AVLMap(data, self._mapper.encoders, path=IN_MEMORY, settings=self._query)
        if is_first := not self._generation:  # it need not wait until what every question needs is loaded
            self._snapshot, self._generation = (made, came_s), 1
        with contextlib.suppress(AvlmapsError):  # a profile without names, or a map too small for rooms
            made.ask("the chair in the kitchen")
        if is_first:
            release_memory()
        else:
            self._snapshot = made, came_s
            self._generation += 1
