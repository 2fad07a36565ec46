"""`avlmaps build` and `calibrate`: a map from a recording, and where the microphones of its robot are."""

from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal

from msgspec import Meta
from tyro.conf import Positional, arg

from avlmaps.cli.info import describe_map, info_lines
from avlmaps.cli.output import Column, UsageError, emit, table
from avlmaps.cli.verb import COUNT, SHARE, SIZE, Building, OfRecording, Verb
from avlmaps.core.files import user_path
from avlmaps.core.progress import say
from avlmaps.core.wording import place_text

if TYPE_CHECKING:
    from collections.abc import Callable, Generator

    from avlmaps.maps.cluster import RayPool
    from avlmaps.recordings.types import Recording


_OF_ONE_RECORDING = (
    "audio", "microphones", "same_device", "topics", "submaps", "corrected_poses", "close_loops", "fresh",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Build(Building):
    """Build a map from a recording. A build that was stopped resumes, and the map is the same.

    Example: avlmaps build REC --out kitchen.avlmap

    Example: avlmaps build REC --out kitchen.avlmap --profile foundation --model pixels=clip-patches views=clip
    """

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording: our folder, a bag (or a folder of its parts), a phone's scan, a data set; docs/recordings.md lists
    all."""
    more: Annotated[Positional[tuple[Path, ...]], arg(metavar="[BAG ...]")] = ()
    """Further files of a bag that was split; with --ray, further recordings of the same place, in the order of their
    days, which are found in the first by their pictures (as `merge` does)."""
    rules: Literal["ours", "paper"] = "ours"
    """Rules of mapping: ours, or the paper's with any models (docs/paper-models.md)."""
    batch: Annotated[int | None, COUNT, arg(metavar="N")] = None
    """Frames that go through a large model at once. Default: AVLMAPS_BATCH, or the model's own size (1 on a CPU)."""
    feature_cache: Annotated[str, arg(metavar="auto|off|DIR")] = "auto"
    """Store features, so that another build of the same frames encodes nothing again: auto (large models, in the user's
    cache folder), off, or a folder (all models)."""
    feature_cache_gb: Annotated[float, SIZE, arg(metavar="GB")] = 20.0
    """Size of the feature cache, GB; the features unused for the longest time go first."""
    submaps: bool = False
    """Store the sums of every 32 frames as well, so that the map can follow corrected poses later; it takes three to
    four times the room."""
    corrected_poses: Annotated[Path | None, arg(metavar="FILE")] = None
    """Move the map, which was built with --submaps, to corrected poses of its frames: a table of stamp tx ty tz qx qy
    qz qw of the depth camera, on the recording's clock. A map that is not there yet is built first."""
    close_loops: bool = False
    """Find by the map's own pictures where the drive came back, and move it to the poses that this gives; implies
    --submaps. The map stays as it is where that is not clear."""
    frame_step: Annotated[int, COUNT, arg(metavar="N")] = 1
    """Fuse every n-th frame."""
    max_bad_share: Annotated[float, SHARE, arg(metavar="SHARE")] = 0.05
    """Stop when more than this share of the frames cannot be read; fewer are left out and reported."""
    max_depth_m: Annotated[float, SIZE, arg(metavar="METRES")] = 10.0
    """Ignore depth beyond this, metres."""
    camera_height_m: Annotated[float | None, arg(metavar="METRES")] = None
    """Height of the depth camera over the floor in the first frame, metres. Default: found from the frames; give it
    where `build` reports the floor with a low confidence."""
    allow: Annotated[
        tuple[Literal["geometry", "colour", "depth", "intrinsics", "motion", "up", "microphones", "sound"], ...],
        arg(metavar="REASON ..."),
    ] = ()
    """Build a map although the recording contradicts itself, for these reasons; the error names its reason."""
    sensor: Literal["auto", "kinect", "realsense", "perfect", "none"] = "auto"
    """Depth camera; its error decides which depths are used. auto measures it; none uses all, as the paper does."""
    ray: Annotated[tuple[str, ...] | None, arg(metavar="[HOST:PORT]")] = None
    """Let the workers of a Ray cluster encode, fuse and describe, by jobs of 200 frames: the cluster at HOST:PORT, to
    which this machine belongs, or without an address one of this machine's cores. The recording and MAP must lie on
    storage that all machines share; the map is the same (docs/guides/map-your-own-bag.md)."""
    resume: bool = False
    """Resume a stopped build. This is the default; the flag lets scripts say so."""
    fresh: bool = False
    """Start again; ignore the stages that a stopped build finished."""
    verbose: bool = False
    """Print every detail of the map."""
    seed: Annotated[int, Meta(ge=0), arg(metavar="N")] = 0
    """Seed of all random choices (visual words, RANSAC)."""

    def run(self) -> None:
        answer = build(self)
        lines = list(info_lines(answer, verbose=self.verbose))
        if (done := answer.get("corrected")) is not None:
            if (found := done.get("loops")) is not None:
                lines.append(
                    f"loops: {found['closures']} of {found['tried']} keyframes were located in earlier ones, "
                    f"{found['apart_before_m']:.2f} m from where the poses put them (median); {found['agreeing']} "
                    f"agree now, within {found['apart_m']:.3f} m"
                )
            lines.append(
                f"corrected: frames moved by {done['median_m']:.2f} m (median), {done['most_m']:.2f} m at most; "
                f"{done['voxels_before']} voxels before, {done['voxels']} now, in {done['elapsed_s']:.1f} s"
            )
        emit(answer, lines, self.json)


def build(verb: "Build") -> dict[str, Any]:
    """Build a map and describe it."""
    from avlmaps.maps.build import build_map
    from avlmaps.maps.cluster import cluster_workers
    from avlmaps.maps.settings import SUBMAP_FRAMES, BuildSettings, FrameSettings, FusionSettings, GravitySettings
    from avlmaps.perception.cache import CacheSettings
    from avlmaps.query.avlmap import AVLMap, with_findings
    from avlmaps.query.settings import build_settings

    begin = perf_counter()
    if verb.resume and verb.fresh:
        raise UsageError("--resume continues with a stopped build and --fresh begins again; choose one of them.")
    if verb.corrected_poses is not None and verb.close_loops:
        raise UsageError("--corrected-poses and --close-loops both move the map; choose one of them.")
    if verb.rules == "paper" and verb.sensor not in ("auto", "none"):
        raise UsageError(
            f"The paper's rules use every depth as it is; leave out --sensor {verb.sensor} or --rules paper."
        )
    used = verb.encoders()
    place = verb.feature_cache
    cache = CacheSettings(place if place in ("auto", "off") else user_path(place), verb.feature_cache_gb)
    openings = _openings(verb)
    recording = openings[0]()
    for notice in recording.notices:
        say(f"note: {notice}")
    per_submap = SUBMAP_FRAMES if verb.submaps or verb.corrected_poses or verb.close_loops else 0
    settings = BuildSettings(
        voxel_size_m=verb.voxel_size_m,
        frames=FrameSettings(step=verb.frame_step, max_bad_share=verb.max_bad_share, per_submap=per_submap),
        fusion=FusionSettings(max_depth_m=verb.max_depth_m, sensor=verb.sensor),
        gravity=GravitySettings(camera_height_m=verb.camera_height_m),
        seed=verb.seed,
    )
    poses = None
    if verb.corrected_poses is not None:
        from avlmaps.recordings.formats.tables import on_clock_of, read_pose_file

        stamps_s, world_from_camera = read_pose_file(verb.corrected_poses)
        poses = on_clock_of(stamps_s, recording), world_from_camera
    resolved = build_settings(verb.rules, settings)
    with _pool(verb) as pool:
        if pool is not None and verb.more:
            from avlmaps.days.merge import build_together

            avlmap = build_together(
                openings, verb.out, used, pool, resolved, cache=cache, allow=verb.allow, overwrite=verb.overwrite
            )
        else:
            workers = None if pool is None else cluster_workers(pool, openings[0], cache)
            data = build_map(
                recording, verb.out, used, resolved, cache=cache, workers=workers, allow=verb.allow,
                resume=not verb.fresh, overwrite=verb.overwrite, finds=with_findings,
            )  # fmt: skip
            avlmap = AVLMap(data, path=user_path(verb.out))
    answer: dict[str, Any] = {}
    if poses is not None:
        from avlmaps.maps.corrected import correct_map

        answer["corrected"] = asdict(correct_map(avlmap.path, *poses, recording, with_findings))
        avlmap = AVLMap.open(avlmap.path)
    if verb.close_loops:
        from avlmaps.days.loops import close_loops

        done, found = close_loops(avlmap, recording=recording)
        answer["corrected"] = {**asdict(done), "loops": found.report()}
        avlmap = AVLMap.open(avlmap.path)
    return {**describe_map(avlmap), **answer, "elapsed_s": round(perf_counter() - begin, 3)}


def _openings(verb: "Build") -> "list[Callable[[], Recording]]":
    """Return what opens each recording, here and on any machine that sees it at the same place."""
    from avlmaps.recordings.open import open_recording

    files, given = [verb.recording, *verb.more], verb.opening()
    groups = [files]
    if verb.ray is not None:  # a path that is relative means another place on another machine
        groups = [[path.absolute()] for path in files]
        for where, name in ((given, "audio"), (given, "microphones"), (given["topics"], "pose")):
            if where.get(name) and Path(where[name]).is_file():
                where[name] = str(Path(where[name]).absolute())
    if len(groups) > 1 and (idle := [name for name in _OF_ONE_RECORDING if getattr(verb, name)]):
        raise UsageError(
            f"--{idle[0].replace('_', '-')} is of one recording; build a map of each, then `avlmaps merge` them."
        )
    open_one = partial(open_recording, **given)
    openings: list[Callable[[], Recording]] = [partial(open_one, group) for group in groups]
    if verb.same_device is None:
        return openings
    from avlmaps.maps.hearing import open_with_device

    return [partial(open_with_device, one, verb.same_device.absolute()) for one in openings]


@contextmanager
def _pool(verb: "Build") -> "Generator[RayPool | None]":
    if verb.ray is None:
        yield None
        return
    if len(verb.ray) > 1:
        raise UsageError(f"--ray takes one address and got {' '.join(verb.ray)}; give recordings before it.")
    from avlmaps.maps.cluster import RayPool

    with RayPool(*verb.ray) as pool:
        say(f"note: the cluster has {pool.cores} cores (machines: {pool.machines}).")
        yield pool


@dataclass(frozen=True, kw_only=True)
class Calibrate(OfRecording, Verb):
    """Refine where the microphones of a robot are and how late each channel is, from a drive past one still source.

    Let something tick or click at one place, and drive past it in curves, 1 to 3 m away, for half a minute. The
    geometry that is given must be right within a few centimetres. The recording stays as it is.

    Example: avlmaps calibrate REC --out array.json && avlmaps build REC --microphones array.json --out home.avlmap
    """

    recording: Annotated[Positional[Path], arg(metavar="REC")]
    """Recording with an array, or with several channels and --microphones."""
    out: Annotated[Path, arg(metavar="FILE")]
    """File to write: the refined microphones, as --microphones and `microphones` of recording.json take them."""
    between: Annotated[tuple[float, float] | None, arg(metavar="BEGIN END")] = None
    """Time when the one source sounds, seconds of the recording. Default: all of it."""
    overwrite: bool = False
    """Replace --out where it is there already."""

    def run(self) -> None:
        answer = calibrate_array(self)
        columns: dict[str, Column] = {
            "channel": "number",
            "place (robot's frame)": "position_m",
            "moved": lambda one: f"{100 * one['moved_m']:.1f} cm",
            "known to": lambda one: f"{100 * one['sd_m']:.2f} cm",
            "late by": lambda one: f"{1e6 * one['delay_s']:.0f} µs",
        }
        rows = [{"number": number, **one} for number, one in enumerate(answer["microphones"], 1)]
        heights = " Heights stay as given: this drive does not show them." if answer["held_heights"] else ""
        lines = [
            *table(columns, rows),
            f"source at {place_text(answer['source'])} ({answer['frame']} frame), {answer['measured_frames']} frames",
            f"residual: {1e6 * answer['residual_before_s']:.0f} µs before, {1e6 * answer['residual_after_s']:.0f} µs "
            f"after.{heights}",
            *(f"channel {number} is wired the other way round; this is taken back" for number in answer["turned"]),
            f"wrote {answer['out']}",
        ]
        emit(answer, lines, self.json)


def calibrate_array(verb: "Calibrate") -> dict[str, Any]:
    """Refine an array, write it, and describe it."""
    import numpy as np

    from avlmaps.core.errors import RecordingError
    from avlmaps.core.poses import FRAME
    from avlmaps.core.wording import option
    from avlmaps.maps.sources.calibrate import calibrate
    from avlmaps.recordings.microphones import write_microphones
    from avlmaps.recordings.open import open_recording

    if verb.out.exists() and not verb.overwrite:
        raise RecordingError(
            f"{verb.out} is there already; give another {option('out')}, or replace it with {option('overwrite')}."
        )
    recording = open_recording(verb.recording, **verb.opening())
    if recording.audio is None:
        raise RecordingError(f"{verb.recording} has no sound track, so that there is no array to calibrate.")
    found = calibrate(recording.audio, recording.walk, verb.between)
    write_microphones(verb.out, found.microphones)
    array = found.microphones
    late_s = np.zeros(len(array)) if array.delay_s is None else array.delay_s
    columns = {
        "position_m": array.position_m, "moved_m": found.moved_m, "sd_m": found.place_sd_m, "delay_s": late_s,
        "delay_sd_s": found.delay_sd_s,
    }  # fmt: skip
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return {
        "recording": str(verb.recording),
        "out": str(verb.out),
        "microphones": [dict(zip(columns, row, strict=True)) for row in rows],
        "held_heights": found.held_heights,
        "turned": [channel + 1 for channel in found.turned],
        "frame": FRAME,
        "source": found.source_m.tolist(),
        "measured_frames": found.frames,
        "residual_before_s": found.before_s,
        "residual_after_s": found.after_s,
    }  # fmt: skip
