"""What a worker of a cluster does: one job of a build, described by a small value, done into a folder of the map.

Pictures and sums stay on the storage that all machines share. A worker makes the build's plan itself, of the recording
that it sees, its own code and its own weights, and refuses to work where that plan is another one. What it makes is a
checkpoint of the build, written beside and renamed when it is whole: a worker that dies leaves nothing that counts, and
two that do the same job leave one result.
"""

import dataclasses
import hashlib
import secrets
import shutil
import socket
import sys
from bisect import bisect_left
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata
from pathlib import Path
from time import process_time

import msgspec
import numpy as np

from avlmaps.core.arrays import Int64
from avlmaps.core.errors import AvlmapsError, BackendError, MapError, RecordingError
from avlmaps.core.progress import silence_progress
from avlmaps.core.version import __version__
from avlmaps.maps.fusion.accumulator import VoxelAccumulator, VoxelSums
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.gravity.floor import GroundedRecording
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.encode_fuse import fuse_spans
from avlmaps.maps.pipeline.keyframes import KeyframeLots, describe_lots
from avlmaps.maps.pipeline.parts import load_part
from avlmaps.maps.pipeline.plan import BuildPlan, Span, make_plan
from avlmaps.maps.settings import BuildSettings
from avlmaps.maps.store.checkpoints import DONE, save_checkpoint
from avlmaps.maps.store.folder import PARTS
from avlmaps.maps.store.tables import explain_write_errors
from avlmaps.perception.cache.cached_encoders import with_cache
from avlmaps.perception.cache.feature_store import CacheSettings
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models.settings import ModelSettings, model_settings, use_models
from avlmaps.perception.profiles import GIVEN
from avlmaps.recordings.subset import Subset
from avlmaps.recordings.types import Ground, Recording

Reopen = Callable[[], Recording]
"""Opens the recording on a machine: ``functools.partial(open_recording, "/shared/REC")``."""
_COMPUTING = (
    "numpy",
    "numba",
    "onnxruntime",
    "opencv-python-headless",
    "scipy",
    "torch",
    "torchvision",
    "transformers",
)


@dataclass(frozen=True, slots=True)
class Models:
    """The models that perceive, by their names, which mean the same on every machine.

    Attributes:
        profile: name of the profile.
        names: of each module's encoder.
        weight_variance_m2: of the profile.
        cache: of features.
        settings: where models are and how they run.
    """

    profile: str
    names: dict[str, str]
    weight_variance_m2: float
    cache: CacheSettings
    settings: ModelSettings

    @classmethod
    def of(cls, encoders: Encoders, cache: CacheSettings) -> "Models":
        """Return the names of encoders.

        Raises:
            BackendError: one of them is an object, which has none.
        """
        names = {kind.value: encoders.name_of(kind) for kind in encoders}
        own = [module for module, name in names.items() if name.startswith(GIVEN)]
        if own:
            raise BackendError(
                f"The encoder of {own[0]} is an object of this process, and other machines have none; register it as a "
                "backend that they can import, and give its name."
            )
        return cls(encoders.name, names, encoders.weight_variance_m2, cache, model_settings())

    def encoders(self) -> Encoders:
        """Return the encoders on a worker; it loads models as the build does from then on."""
        if self.settings != model_settings():
            use_models(self.settings)
        sources = Encoders.remembered(self.profile, self.names).sources
        return Encoders.of(self.profile, sources, self.weight_variance_m2)


@dataclass(frozen=True, slots=True)
class BuildRequest:
    """From what a worker makes the plan of a build, and by what it knows that it is the same.

    Attributes:
        reopen: opens the recording.
        path: the map's folder.
        models: that perceive.
        settings: of the build.
        ground: that was found in the recording.
        key: of the build's plan.
        fingerprint: of the recording.
        checksums: of each module's weights.
        software: see ``software``.
        token: name of a file in the map's folder, new in each build.
    """

    reopen: Reopen
    path: Path
    models: Models
    settings: BuildSettings
    ground: Ground | None
    key: str
    fingerprint: str
    checksums: dict[str, str]
    software: dict[str, str]
    token: str


@dataclass(frozen=True, slots=True)
class FuseJob:
    """A stretch of frames that is to become the part in a folder."""

    request: BuildRequest
    span: Span
    folder: Path
    sensor: SensorModel


@dataclass(frozen=True, slots=True)
class DescribeJob:
    """A lot of keyframes, numbers of the recording's frames, that is to be stored in a folder."""

    request: BuildRequest
    frames: Int64[np.ndarray, " k"]
    folder: Path
    places: Path
    key: str


@dataclass(frozen=True, slots=True)
class AddJob:
    """A slab of voxels, those with ``low`` <= x < ``high``, whose sums over parts are to be stored in a folder."""

    request: BuildRequest
    parts: tuple[Path, ...]
    low: int
    high: int
    folder: Path
    key: str


@dataclass(frozen=True, slots=True)
class JobResult:
    """What became of a job.

    Attributes:
        host: of the worker.
        cpu_s: seconds of processor time.
        error: the class of the error that a user can fix, ``""`` for none.
        why: its sentence.
    """

    host: str
    cpu_s: float
    error: str = ""
    why: str = ""

    def require(self) -> None:
        """Raise the error again on this side."""
        if self.error:
            raise _ERRORS.get(self.error, MapError)(self.why)


_ERRORS: dict[str, type[AvlmapsError]] = {
    of.__name__: of for of in (BackendError, MapError, RecordingError)
}  # the others are errors of a map to those who build one


class NoFacts(msgspec.Struct):
    """A slab's arrays are all of it."""


def fuse_job(job: FuseJob) -> JobResult:
    """Fuse a stretch of frames on a worker."""

    def work(plan: BuildPlan, folder: Path) -> None:
        fuse_spans(plan.recording, [(job.span, folder)], plan.encoders, plan.settings, job.sensor)

    return _do(job.request, job.folder, work)


def describe_job(job: DescribeJob) -> JobResult:
    """Describe a lot of keyframes on a worker."""

    def work(plan: BuildPlan, folder: Path) -> None:
        count = len(job.frames)
        lots = {folder: np.arange(count)}
        describe_lots(plan, KeyframeLots(Subset(plan.recording, job.frames), lots, count, job.places, {}, job.key))

    return _do(job.request, job.folder, work)


def add_job(job: AddJob) -> JobResult:
    """Add the parts of a slab up on a worker."""

    def work(plan: BuildPlan, folder: Path) -> None:
        total: VoxelAccumulator | None = None
        for part in job.parts:
            sums = _within(load_part(part, plan.fusion_key).sums(), job.low, job.high)
            total = total or VoxelAccumulator(GridSpec(plan.settings.voxel_size_m), sums.feature_sum.shape[1])
            total.merge(sums)
        if total is not None:
            added = total.sums()
            arrays = {field.name: getattr(added, field.name) for field in dataclasses.fields(added)}
            save_checkpoint(folder, job.key, NoFacts(), arrays)

    return _do(job.request, job.folder, work)


@cache
def software() -> dict[str, str]:
    """Return what computes here: the Python, a hash of this avlmaps' code, and the versions of what it computes by."""
    package, code = Path(__file__).parents[2], hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        code.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    found = {"Python": f"{sys.version_info[0]}.{sys.version_info[1]}"}
    found["avlmaps"] = f"{__version__} ({code.hexdigest()[:12]})"
    for name in _COMPUTING:
        with suppress(metadata.PackageNotFoundError):  # without models on torch nothing of it is there
            found[name] = metadata.version(name)
    return found


def done_by(work: Callable[[str], None]) -> JobResult:
    """Do a job, of the worker's name, and return what became of it; errors of users become values."""
    host, begin = socket.gethostname(), process_time()
    try:
        with silence_progress():
            work(host)
    except AvlmapsError as fault:
        return JobResult(host, process_time() - begin, type(fault).__name__, str(fault))
    return JobResult(host, process_time() - begin)


def _do(request: BuildRequest, folder: Path, work: Callable[[BuildPlan, Path], None]) -> JobResult:
    """Do a job into a folder that takes its name when it is whole."""

    def into_folder(host: str) -> None:
        with _whole(folder) as attempt:
            work(_plan(request, host), attempt)

    return done_by(into_folder)


@contextmanager
def _whole(folder: Path) -> Generator[Path]:
    """Give a folder beside a job's to write into; it takes its name when the block is done."""
    attempt = folder.with_name(f"{folder.name}.{secrets.token_hex(4)}")
    try:
        yield attempt
        with explain_write_errors(folder):
            try:
                attempt.rename(folder)
            except OSError:
                if not (folder / DONE).is_file():  # else another worker was taken for dead, and has done it
                    raise
    finally:
        shutil.rmtree(attempt, ignore_errors=True)


_known: list[tuple[str, BuildPlan]] = []  # the last plan that this worker made, by its token


def _plan(request: BuildRequest, host: str) -> BuildPlan:
    """Return the plan of the build, with the ground that was found meanwhile; what a worker sees is checked once."""
    if not _known or _known[0][0] != request.token:
        _known[:] = [(request.token, _checked_plan(request, host))]
    plan = _known[0][1]
    return (
        plan if request.ground is None else replace(plan, recording=GroundedRecording(plan.recording, request.ground))
    )


def _checked_plan(request: BuildRequest, host: str) -> BuildPlan:
    """Return the plan of the build, made from what this worker sees.

    Raises:
        MapError: it sees another map or recording, or computes by other software.
        BackendError: it lacks a model, or has other weights.
    """
    require_same_software(request.software, host)
    require_seen(token_file(request.path, request.key, request.token), host)
    recording = reopened(request.reopen, host)
    if recording.fingerprint != request.fingerprint:
        raise MapError(
            f"The worker on {host} sees another recording at {recording.path}; a recording must lie on storage that "
            "all machines of the cluster share."
        )
    encoders = with_cache(request.models.encoders(), request.models.cache)
    plan = make_plan(recording, request.path, encoders, request.settings)
    for module, checksum in request.checksums.items():
        own = plan.models[module].checksum if module in plan.models else "none"
        if own != checksum:
            raise BackendError(
                f"The worker on {host} has other weights for {module} ({own[:12]}) than this machine "
                f"({checksum[:12]}); bring the same models to all machines."
            )
    if plan.key != request.key:
        raise MapError(
            f"The worker on {host} would build another map, for a reason that it cannot name; check that its sound "
            "track and its settings are those of this machine."
        )
    return plan


def reopened(reopen: Reopen, host: str) -> Recording:
    """Return the recording as a worker opens it; raises ``MapError`` where it cannot."""
    try:
        return reopen()
    except AvlmapsError as fault:
        raise MapError(
            f"The worker on {host} cannot open the recording: {str(fault).rstrip('.')}. A recording must lie on "
            "storage that all machines of the cluster see at the same path."
        ) from fault


def require_same_software(wanted: dict[str, str], host: str) -> None:
    """Raise ``MapError`` where this worker computes by other software than the machine that gave the job."""
    own = software()
    for name, version in wanted.items():
        if own.get(name) != version:
            raise MapError(
                f"The worker on {host} runs {name} {own.get(name, 'none')} and this machine {version}; install the "
                "same on all machines of the cluster."
            )


def require_seen(token: Path, host: str) -> None:
    """Raise ``MapError`` where this worker does not see a file that the machine that gave the job has made."""
    if not token.is_file():
        folder = token.parents[2] if token.parents[1].name == PARTS else token.parent
        raise MapError(
            f"The worker on {host} does not see {folder} as this machine does; the map must lie on storage that all "
            "machines of the cluster share, at the same path."
        )


def show_token(token: Path) -> None:
    """Make a file by which workers know that they see its folder itself."""
    with explain_write_errors(token.parent):
        token.parent.mkdir(parents=True, exist_ok=True)
        token.touch()


def token_file(path: Path, key: str, token: str) -> Path:
    """Return the file by which a worker knows that it sees the map's folder itself, not another at the same path."""
    return path / PARTS / f"cluster-{key[:12]}" / token


def _within(sums: VoxelSums, low: int, high: int) -> VoxelSums:
    """Return the rows of sorted sums with low <= x < high, memory-mapped still."""
    first, last = (bisect_left(range(len(sums)), edge, key=lambda row: int(sums.index[row, 0])) for edge in (low, high))
    return VoxelSums(**{field.name: getattr(sums, field.name)[first:last] for field in dataclasses.fields(sums)})
