"""Parts of a map: sums over some frames, stored on disk, that add up to the whole in any order.

A stopped build continues from the parts that it had finished, and machines that share the work bring theirs:
``build_part`` on each of them, then ``build_map(..., parts=[...])`` on one.
"""

import dataclasses
from collections.abc import Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from time import perf_counter

import msgspec
import numpy as np

from avlmaps.core.errors import MapError, RecordingError
from avlmaps.core.progress import progress
from avlmaps.core.registry import Kind
from avlmaps.maps.encoding import EncodedFrame, encode_frames
from avlmaps.maps.fusion.accumulator import VoxelAccumulator, VoxelSums
from avlmaps.maps.fusion.free_space import FreeViewCollector, FreeViews, concat_views
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.fusion.sensor_choice import find_sensor
from avlmaps.maps.gravity.stage import attach_estimated_ground
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.keyframes.describe import keyframes_by_motion
from avlmaps.maps.settings import DEFAULTS, BuildSettings
from avlmaps.maps.store.checkpoints import Checkpoint, find_checkpoint, key_of, load_checkpoint, save_checkpoint
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.perception.cache.cached_encoders import cache_note, with_cache
from avlmaps.perception.cache.feature_store import DEFAULT_CACHE, CacheSettings
from avlmaps.perception.encoders import Encoders, encoders_of
from avlmaps.perception.profiles import Profile
from avlmaps.perception.protocols import PixelEncoder
from avlmaps.recordings.types import Recording

BUILD_VERSION = 4  # raise it when a stage comes to compute something else, so that no old checkpoint is taken for new

Span = tuple[int, int, int]


class PartInfo(msgspec.Struct, frozen=True, kw_only=True):
    """The description of a part beside its sums.

    Attributes:
        recording: the recording's name, for people.
        spans: the frames that it covers: (first, last + 1, step) of each stretch, rising.
        fused: how many frames were fused.
        bad_frames: those that could not be read.
        elapsed_s: seconds of work.
    """

    recording: str
    spans: tuple[Span, ...]
    fused: int
    bad_frames: tuple[BadFrame, ...]
    elapsed_s: float


@dataclass(frozen=True, slots=True)
class Part:
    """A finished part.

    Attributes:
        folder: where it lies.
        info: which frames it covers.
        key: hash of all that its sums depend on.
    """

    folder: Path
    info: PartInfo
    key: str

    def sums(self) -> VoxelSums:
        """Return the sums over its frames, memory-mapped again, so that memory is let go with them."""
        return VoxelSums(**self._arrays(VoxelSums))

    def views(self) -> FreeViews:
        """Return where its frames saw freely, memory-mapped likewise."""
        return FreeViews(**self._arrays(FreeViews))

    def _arrays(self, of: type[VoxelSums] | type[FreeViews]) -> dict[str, np.ndarray]:
        arrays = load_checkpoint(self.folder, PartInfo, self.key).arrays
        return {field.name: arrays[field.name] for field in dataclasses.fields(of)}


def pixel_encoder_of(used: Encoders) -> PixelEncoder | None:
    """Return the pixel encoder, None where there is none (the map is then one of surfaces and colours)."""
    return used.pixels if Kind.PIXELS in used else None


def fusion_key(recording: Recording, settings: BuildSettings, used: Encoders) -> str:
    """Return the hash of all that the sums of a frame depend on; parts are only ever added to parts of the same key."""
    encoder = pixel_encoder_of(used)
    card = None if encoder is None else encoder.card
    ground = (settings.gravity, settings.seed, recording.base_height) if encoder is not None else None
    basis = recording.fingerprint, settings.voxel_size_m, settings.fusion, card, ground
    chosen = (settings.keyframes, settings.frames.step) if used.keyframes_only else ()
    return key_of("fusion", BUILD_VERSION, *basis, *chosen)


def encoded_frames(recording: Recording, settings: BuildSettings, used: Encoders) -> frozenset[int] | None:
    """Return the numbers of the frames whose pixels are encoded, None for all.

    For a pixel encoder that is given keyframes alone they are those of every ``frames.step``-th frame of the whole
    recording, by motion: the same on every machine that fuses a part of it, and known before a picture is read.
    """
    if not used.keyframes_only:
        return None
    numbers = np.arange(0, len(recording), settings.frames.step)
    stamps, poses = recording.stamps_s[numbers], recording.world_from_camera[numbers]
    return frozenset(numbers[keyframes_by_motion(stamps, poses, settings.keyframes)].tolist())


def plan_spans(frames: int, settings: BuildSettings, covered: Sequence[Span] = ()) -> list[Span]:
    """Return the stretches to fuse one after the other, each of ``frames.per_part`` frames or fewer.

    Args:
        frames: of the recording.
        settings: step, and frames of a part.
        covered: stretches that are fused already.
    """
    wanted = np.zeros(frames, bool)
    wanted[:: settings.frames.step] = True
    for start, stop, step in covered:
        wanted[start:stop:step] = False
    spans: list[Span] = []
    stride = settings.frames.per_part * settings.frames.step
    for start in range(0, frames, stride):
        left = np.flatnonzero(wanted[start : start + stride])
        for run in np.split(left, np.flatnonzero(np.diff(left) > settings.frames.step) + 1):
            if len(run):
                first, last = start + int(run[0]), start + int(run[-1])
                spans.append((first, last + 1, settings.frames.step))
    return spans


def build_part(
    recording: Recording,
    start: int,
    stop: int,
    out: Path | str,
    profile: str | Profile | Encoders = "embedded",
    settings: BuildSettings = DEFAULTS,
    cache: CacheSettings = DEFAULT_CACHE,
) -> Part:
    """Fuse the frames ``start`` to ``stop - 1`` and keep their sums in a folder, as one machine's part of a map.

    Args:
        recording: what all machines read.
        start: first frame, from 0.
        stop: one past the last frame.
        out: the part's folder; a part that is there already, of the same frames and settings, is returned.
        profile: which models perceive.
        settings: the same on all machines.
        cache: whether features are stored for another build.

    Raises:
        MapError: there are no such frames, or too many of them cannot be read.
    """
    out, used = Path(out), with_cache(encoders_of(profile), cache)
    settings = settings.for_profile(used.weight_variance_m2)
    if not 0 <= start < stop <= len(recording):
        raise MapError(f"There are no frames {start} to {stop}; {recording.path} has frames 0 to {len(recording)}.")
    key, span = fusion_key(recording, settings, used), (start, stop, settings.frames.step)
    if out.exists() and any(out.iterdir()):
        part = load_part(out, key)
        if part.info.spans != (span,):
            raise MapError(f"{out} holds a part of other frames; give another folder, or remove it first.")
        return part
    known = attach_estimated_ground(recording, settings) if Kind.PIXELS in used else recording
    fuse_spans(known, [(span, out)], used, settings, find_sensor(recording, settings).model)
    return load_part(out, key)


def merge_parts(folders: Sequence[Path | str], out: Path | str) -> Part:
    """Add parts up to one part, in the order of their frames, for any order of the folders.

    Args:
        folders: of ``build_part`` or of this, all of one recording and the same settings.
        out: the folder of the sum.

    Raises:
        MapError: there is none, one is damaged or made otherwise than the first, or two cover the same frame.
    """
    if not folders:
        raise MapError(f"There are no parts to merge into {out}; name the folders that build_part wrote.")
    key = _key_in(Path(folders[0]))
    parts = sorted((load_part(Path(folder), key) for folder in folders), key=lambda part: part.info.spans)
    check_disjoint(parts)
    info = PartInfo(
        recording=parts[0].info.recording,
        spans=tuple(sorted(span for part in parts for span in part.info.spans)),
        fused=sum(part.info.fused for part in parts),
        bad_frames=tuple(bad for part in parts for bad in part.info.bad_frames),
        elapsed_s=sum(part.info.elapsed_s for part in parts),
    )
    # The grid only turns metres into voxels, and merging meets none.
    views = concat_views([part.views() for part in parts])
    save_checkpoint(Path(out), key, info, _arrays(sum_parts(parts, GridSpec()).sums(), views))
    return load_part(Path(out), key)


def sum_parts(parts: Sequence[Part], grid: GridSpec) -> VoxelAccumulator:
    """Add the sums of parts, in the order given; in memory is only the total."""
    total = VoxelAccumulator(grid, parts[0].sums().feature_sum.shape[1])
    for part in parts:
        total.merge(part.sums())
    return total


def load_part(folder: Path, key: str | None = None, *, verify: bool = True) -> Part:
    """Read a part back; see ``load_checkpoint`` for the arguments and errors."""
    return _part(load_checkpoint(folder, PartInfo, key, verify=verify))


def find_part(folder: Path, key: str, span: Span) -> Part | None:
    """Return the finished part of this stretch, None where there is none; what is left of a broken one is removed."""
    found = find_checkpoint(folder, PartInfo, key)
    return None if found is None or found.facts.spans != (span,) else _part(found)


def _part(found: Checkpoint[PartInfo]) -> Part:
    return Part(found.folder, found.facts, found.key)


def check_disjoint(parts: Sequence[Part]) -> None:
    """Raise ``MapError`` if two parts cover the same frame: it would count twice."""
    frames = max((span[1] for part in parts for span in part.info.spans), default=0)
    owner = np.full(frames, -1)
    for number, part in enumerate(parts):
        for start, stop, step in part.info.spans:
            taken = np.flatnonzero(owner[start:stop:step] >= 0)
            if len(taken):
                frame = start + step * int(taken[0])
                other = parts[int(owner[frame])]
                raise MapError(f"{other.folder} and {part.folder} both cover frame {frame}; leave one of them out.")
            owner[start:stop:step] = number


class Tolerance:
    """Counts the frames that cannot be read, and says when there are too many."""

    def __init__(self, recording: Recording, settings: BuildSettings, known: Sequence[BadFrame] = ()) -> None:
        """Begin with those that are known from finished parts."""
        self._total = len(range(0, len(recording), settings.frames.step))
        self._allowed = int(settings.frames.max_bad_share * self._total) if settings.frames.on_bad == "skip" else 0
        self._met = len(known)

    def meet(self, bad: BadFrame) -> None:
        """Take note of one more; raise ``RecordingError`` when there are more than allowed."""
        self._met += 1
        if self._met <= self._allowed:
            return
        if self._allowed == 0:
            raise RecordingError(bad.why)
        raise RecordingError(
            f"{self._met} of {self._total} frames cannot be read, more than the {self._allowed} that may be left out; "
            f"fix the recording or allow more (--max-bad-share). The last: {bad.why}"
        )


def fuse_spans(
    recording: Recording,
    jobs: Sequence[tuple[Span, Path]],
    used: Encoders,
    settings: BuildSettings,
    sensor: SensorModel,
    known_bad: Sequence[BadFrame] = (),
    done: int = 0,
) -> None:
    """Fuse stretches of frames, each into a part of its own; decoding and encoding run ahead of fusion.

    Args:
        recording: where the frames are.
        jobs: each stretch, and the folder of its part.
        used: the encoders, of which that of pixels perceives.
        settings: of the build.
        sensor: error of the depths.
        known_bad: frames of other parts that could not be read.
        done: frames of other parts, for the progress bar.

    Raises:
        RecordingError: too many frames cannot be read.
        MapError: a part cannot be written.
    """
    if not jobs:
        return
    key, encoder = fusion_key(recording, settings, used), pixel_encoder_of(used)
    tolerance = Tolerance(recording, settings, known_bad)
    stretches = [range(*span) for span, _ in jobs]
    total_frames = done + sum(map(len, stretches))
    chosen = encoded_frames(recording, settings, used)
    with closing(encode_frames(recording, stretches, encoder, chosen)) as ahead:
        seen = progress(ahead, "fusing", total=total_frames, done=done, note=lambda: cache_note(used, Kind.PIXELS))
        for span, folder in jobs:
            begin = perf_counter()
            dim = encoder.card.dim if encoder else 0
            total = VoxelAccumulator(GridSpec(settings.voxel_size_m), dim, settings.fusion, sensor)
            free = FreeViewCollector(recording.rig.depth, sensor)
            bad = _fuse(islice(seen, len(range(*span))), total, free, tolerance)
            info = PartInfo(
                recording=recording.path.name,
                spans=(span,),
                fused=len(range(*span)) - len(bad),
                bad_frames=tuple(bad),
                elapsed_s=perf_counter() - begin,
            )
            save_checkpoint(folder, key, info, _arrays(total.sums(), free.views()))
        for _ in seen:  # nothing is left; this completes the bar
            pass


def _fuse(
    seen: Iterable[EncodedFrame], total: VoxelAccumulator, free: FreeViewCollector, tolerance: Tolerance
) -> list[BadFrame]:
    """Add frames up; return those that could not be read."""
    bad: list[BadFrame] = []
    for frame, features in seen:
        if isinstance(frame, BadFrame):
            bad.append(frame)
            tolerance.meet(frame)
        else:
            total.add(frame, features)
            free.add(frame)
    return bad


def _arrays(sums: VoxelSums, views: FreeViews) -> dict[str, np.ndarray]:
    return {field.name: getattr(of, field.name) for of in (sums, views) for field in dataclasses.fields(of)}


def _key_in(folder: Path) -> str:
    return load_checkpoint(folder, PartInfo).key
