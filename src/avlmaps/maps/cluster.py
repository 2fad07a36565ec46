"""A build on a Ray cluster: a task of a ``Mapper`` for each stretch of frames, whose states add up.

A worker opens the recording and makes the build's plan itself, of what it sees, its own code and its own weights, and
refuses to work where that plan is another one. A state is written in one step on storage that all share: a worker that
dies leaves nothing that counts, and two that do the same leave one result. Ray moves tasks by its own serialisation,
which trusts everybody in the cluster; a cluster of this machine alone listens on the loopback interface.
"""

import hashlib
import importlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, Protocol, Self, TypeVar

from avlmaps.core.errors import AvlmapsError, BackendError, MapError
from avlmaps.core.extras import install_command
from avlmaps.core.machine import is_loopback, usable_cores
from avlmaps.core.progress import silence_progress
from avlmaps.core.version import __version__
from avlmaps.core.wording import flag
from avlmaps.maps.build import Workers, map_span, spans_of_frames
from avlmaps.maps.estimate import Start
from avlmaps.maps.plan import BuildPlan, Span, make_plan
from avlmaps.maps.settings import BuildSettings
from avlmaps.perception.cache import DEFAULT_CACHE, CacheSettings, with_cache
from avlmaps.perception.encoders import GIVEN, Encoders
from avlmaps.perception.models import ModelSettings, model_settings, use_models
from avlmaps.recordings.types import Recording

J = TypeVar("J")
A = TypeVar("A")
WAIT_S = 10.0
MOST_DEATHS = 20
"""How often the workers of one job may die before the build stops; what is finished stays."""
_HEALTH = 3.0  # times as long as a connection, Ray may take to say that it is well: it loads slowly
_STORE_BYTES = 100_000_000  # jobs are small values: Ray's store of objects stays all but empty


class RayPool:
    """A Ray cluster, while the context lasts: one that runs already, or one of this machine's cores."""

    def __init__(self, address: str = "", *, cores: int = 0, wait_s: float = WAIT_S) -> None:
        """Name a cluster, which is met when the context begins; ``""`` makes one of this machine alone.

        That one has ``cores``, 0 for all that this process may use. One at ``HOST:PORT`` must include this machine, and
        answer within ``wait_s``.
        """
        self._address, self._cores, self._wait_s = address, cores or usable_cores(), wait_s
        self.folder, self._began = "", False
        self._ray: Any = None

    def __enter__(self) -> Self:
        """Connect; ``MapError`` where no cluster answers at the address, ``BackendError`` without Ray."""
        place = _host_and_port(self._address)
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        if place is None or is_loopback(place[0]):  # Ray named it for the systems that needed loopback alone first
            os.environ.setdefault("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "0")
        try:
            self._ray = importlib.import_module("ray")
        except ImportError:
            raise BackendError(
                f"A build on a cluster needs Ray, which is not installed; get it with: {install_command('cluster')}"
            ) from None
        if self._ray.is_initialized():  # within a worker, or in a program that has a cluster
            return self
        self._began = True
        try:
            self._begin() if place is None else self._join(*place)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """Disconnect; a cluster that was made ends."""
        if self._began:
            self._ray.shutdown()
            shutil.rmtree(self.folder, ignore_errors=True) if self.folder else None

    @property
    def cores(self) -> int:
        """How many jobs the cluster does at once."""
        return max(1, int(self._ray.cluster_resources().get("CPU", 1)))

    @property
    def machines(self) -> int:
        """How many machines are in the cluster."""
        return sum(bool(node["Alive"]) for node in self._ray.nodes())

    def run(self, function: Callable[[J], A], jobs: Sequence[J]) -> Generator[tuple[int, A]]:
        """Do each job on one core of the cluster, again where its worker died; yield results as they come.

        ``MapError``: the workers of one job died too often, or cannot import this avlmaps.
        """
        ray = self._ray
        remote = ray.remote(function).options(num_cpus=1, max_retries=MOST_DEATHS)
        waiting: dict[Any, int] = {remote.remote(job): number for number, job in enumerate(jobs)}
        try:
            while waiting:
                (done, *_), _ = ray.wait(list(waiting), num_returns=1)
                yield waiting.pop(done), self._result(done)
        finally:
            for left in waiting:
                with suppress(ray.exceptions.RayError, ValueError):
                    ray.cancel(left, force=True)

    def _result(self, done: Any) -> Any:
        faults = self._ray.exceptions
        try:
            return self._ray.get(done)
        except faults.RayTaskError as fault:
            if isinstance(fault.cause, AvlmapsError):
                raise fault.cause from None
            if not isinstance(fault.cause, ImportError | faults.RaySystemError):  # Ray's own says what it cannot read
                raise
            raise MapError(
                f"A worker cannot take the job, as it cannot import what is here ({_lines(fault.cause)[-1]}); install "
                "the same avlmaps on all machines of the cluster."
            ) from None
        except (faults.RayError, MemoryError) as fault:
            raise MapError(
                f"A job of the build was given up, after its worker died {MOST_DEATHS + 1} times "
                f"({_lines(fault)[0]}); give the machines more memory, then run the same build again: the finished "
                "parts are stored."
            ) from None

    def _join(self, host: str, port: int) -> None:
        check = [sys.executable, "-m", "ray.scripts.scripts", "health-check", flag("address"), f"{host}:{port}"]
        try:
            socket.create_connection((host, port), self._wait_s).close()
            healthy = subprocess.run(check, capture_output=True, timeout=_HEALTH * self._wait_s, check=False)
            fault = "" if healthy.returncode == 0 else "what answers is no Ray cluster that lets this machine in"
        except (OSError, subprocess.TimeoutExpired) as stopped:
            fault = str(stopped) if isinstance(stopped, OSError) else "what answers is no Ray cluster"
        if fault:
            raise MapError(
                f"No Ray cluster answers at {self._address} within {self._wait_s:g} s ({fault}); start one there, or "
                "check the address. Where the cluster asks for a token, set RAY_AUTH_MODE=token here."
            )
        remedy = "This machine must be part of the cluster, with the same Ray and Python as the others."
        self._init(f"the Ray cluster at {self._address}", remedy, address=self._address)

    def _begin(self) -> None:
        self.folder = tempfile.mkdtemp(prefix="avlmaps-ray-")
        where = "a Ray cluster on this machine", "Try again when the machine is less busy, or build without a cluster."
        self._init(
            *where, include_dashboard=False, num_cpus=self._cores, object_store_memory=_STORE_BYTES,
            _node_ip_address="127.0.0.1", _temp_dir=self.folder,
        )  # fmt: skip

    def _init(self, where: str, remedy: str, **how: Any) -> None:
        try:
            self._ray.init(log_to_driver=False, logging_level="ERROR", **how)
        except Exception as fault:  # noqa: BLE001 - Ray raises plain ones, among many others, where it cannot begin
            raise MapError(f"Could not use {where}: {_lines(fault)[0].rstrip('.')}. {remedy}") from None


def _host_and_port(address: str) -> tuple[str, int] | None:
    if not address:
        return None
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise MapError(f"{address!r} is no address of a Ray cluster; give HOST:PORT, as `ray start` prints it.")
    return host.strip("[]"), int(port)


def _lines(fault: BaseException) -> list[str]:
    return [line.strip() for line in str(fault).splitlines() if line.strip()] or [type(fault).__name__]


Reopen = Callable[[], Recording]
"""Opens the recording on a machine: ``functools.partial(open_recording, "/shared/REC")``."""
_COMPUTING = ("numpy", "numba", "onnxruntime", "opencv-python-headless", "scipy", "torch", "transformers")


class Pool(Protocol):
    """Processes that do jobs: Ray's, or any others that can be given a function and a value."""

    @property
    def cores(self) -> int:
        """How many jobs it does at once."""
        ...

    def run(self, function: Callable[[J], A], jobs: Sequence[J]) -> Generator[tuple[int, A]]:
        """Do each job once, or again where its worker died; yield number and result of each as it is done."""
        ...


@dataclass(frozen=True, slots=True)
class Models:
    """The models that perceive, by their names, which mean the same on every machine."""

    profile: str
    names: dict[str, str]
    weight_variance_m2: float
    cache: CacheSettings
    settings: ModelSettings

    @classmethod
    def of(cls, encoders: Encoders, cache: CacheSettings) -> "Models":
        """Return the names of encoders; raise ``BackendError`` for one that is an object, which has none."""
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
        return Encoders(self.profile, sources=sources, weight_variance_m2=self.weight_variance_m2)


@dataclass(frozen=True, slots=True)
class SpanJob:
    """A stretch of frames whose state is to be stored in a file, and by what a worker knows that it sees the same."""

    reopen: Reopen
    path: Path
    models: Models
    settings: BuildSettings
    start: Start
    span: Span
    file: Path
    key: str
    software: str


def cluster_workers(pool: Pool, reopen: Reopen, cache: CacheSettings = DEFAULT_CACHE) -> Workers:
    """Return who gives a build's stretches of frames to a pool; ``reopen`` opens the recording there as it was here.

    ``MapError``: a worker sees another recording or map, runs another avlmaps, or dies again and again.
    ``BackendError``: it has other weights, or lacks a model.
    """

    def map_spans(plan: BuildPlan, start: Start, jobs: dict[Path, Span]) -> Iterator[Path]:
        models, path, known = Models.of(plan.encoders, cache), plan.path.absolute(), software()
        orders = [
            SpanJob(reopen, path, models, plan.settings, start, span, file.absolute(), plan.key, known)
            for file, span in jobs.items()
        ]
        with closing(pool.run(span_job, orders)) as done:
            for number, _ in done:
                if not orders[number].file.is_file():
                    raise MapError(
                        f"A worker does not see {path} as this machine does; the map must lie on storage that all "
                        "machines of the cluster share, at the same path."
                    )
                yield list(jobs)[number]

    return map_spans


def span_job(job: SpanJob) -> None:
    """Map a stretch of frames on a worker."""
    with silence_progress():
        plan = _plan_of(job, socket.gethostname())
        with closing(spans_of_frames(plan, job.start, [job.span])) as frames:
            map_span(plan, job.start, frames, job.file)


_known: dict[str, BuildPlan] = {}  # of this worker: that of the build that it works for


def _plan_of(job: SpanJob, host: str) -> BuildPlan:
    if job.key not in _known:
        if software() != job.software:
            raise MapError(
                f"The worker on {host} runs {software()}, and this machine {job.software}; install the same on all "
                "machines of the cluster."
            )
        recording, encoders = reopened(job.reopen, host), with_cache(job.models.encoders(), job.models.cache)
        plan = make_plan(recording, job.path, encoders, job.settings)
        if plan.key != job.key:
            raise MapError(
                f"The worker on {host} would build another map: it sees another recording or other weights than this "
                "machine; the same files and the same models must be on all."
            )
        _known.clear()
        _known[job.key] = plan
    return _known[job.key]


def reopened(reopen: Reopen, host: str) -> Recording:
    """Return the recording as a worker opens it; raises ``MapError`` where it cannot."""
    try:
        return reopen()
    except AvlmapsError as fault:
        raise MapError(
            f"The worker on {host} cannot open the recording: {str(fault).rstrip('.')}. A recording must lie on "
            "storage that all machines of the cluster see at the same path."
        ) from fault


@cache
def software() -> str:
    """Return what computes here: a hash of this avlmaps' code, and the versions of what it computes by."""
    package, code = Path(__file__).parents[1], hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        code.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes())
    found = [f"avlmaps {__version__} ({code.hexdigest()[:12]})"]
    for name in _COMPUTING:
        with suppress(metadata.PackageNotFoundError):  # without models on torch nothing of it is there
            found.append(f"{name} {metadata.version(name)}")
    return ", ".join(found)
