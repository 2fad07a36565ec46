"""Ray as a pool of workers: a cluster that runs already, or one of this machine's cores for the time of a build.

Ray moves jobs and their results by its own serialisation, which trusts everybody in the cluster; nothing of avlmaps
unpickles anything. A cluster of this machine alone listens on the loopback interface and has no dashboard.
"""

import importlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from typing import Any, Self, TypeVar

from avlmaps.core.errors import BackendError, MapError
from avlmaps.core.extras import install_command
from avlmaps.core.machine import is_loopback, usable_cores
from avlmaps.core.wording import flag

J = TypeVar("J")
A = TypeVar("A")
WAIT_S = 10.0
MOST_DEATHS = 20
"""How often the workers of one job may die before the build stops; what is finished stays."""
_HEALTH = 3.0  # times as long as a connection, Ray may take to say that it is well: it loads slowly
_STORE_BYTES = 100_000_000  # jobs are small values: Ray's store of objects stays all but empty


class RayPool:
    """A pool for ``Spread``; to be used as a context."""

    def __init__(self, address: str = "", *, cores: int = 0, wait_s: float = WAIT_S) -> None:
        """Name a cluster; it is met when the context begins.

        Args:
            address: ``HOST:PORT`` of a cluster to which this machine belongs; ``""`` makes one of this machine alone.
            cores: of the cluster that is made; 0 for all that this process may use.
            wait_s: how long the address may take to answer.
        """
        self._address, self._cores, self._wait_s = address, cores or usable_cores(), wait_s
        self.folder, self._began = "", False
        self._ray: Any = None

    def __enter__(self) -> Self:
        """Connect.

        Raises:
            BackendError: Ray is not installed.
            MapError: the address is none, does not answer, or is of another Ray.
        """
        place = _host_and_port(self._address)
        for name, value in _environment(place).items():
            os.environ.setdefault(name, value)
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
            self._start() if place is None else self._join(*place)
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

        Raises:
            MapError: the workers of one job died too often, or cannot import this avlmaps.
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
            missing = _last_line(fault.cause)  # of a job that could not be read it is Ray's own error that says it
            if not isinstance(fault.cause, ImportError | faults.RaySystemError):
                raise
            raise MapError(
                f"A worker cannot take the job, as it cannot import what is here ({missing}); install the same avlmaps "
                "on all machines of the cluster."
            ) from None
        except (faults.RayError, MemoryError) as fault:
            raise MapError(
                f"A job of the build was given up, after its worker died {MOST_DEATHS + 1} times "
                f"({_first_line(fault)}); give the machines more memory, then run the same build again: the finished "
                "parts are stored."
            ) from None

    def _start(self) -> None:
        self.folder = tempfile.mkdtemp(prefix="avlmaps-ray-")
        self._init(
            num_cpus=self._cores, object_store_memory=_STORE_BYTES, _node_ip_address="127.0.0.1", _temp_dir=self.folder
        )

    def _join(self, host: str, port: int) -> None:
        """Join the cluster of an address; Ray itself would try for a quarter of an hour where something else answers.

        Raises:
            MapError: nothing answers in time, or something else than Ray.
        """
        try:
            socket.create_connection((host, port), self._wait_s).close()
        except OSError as fault:
            raise MapError(
                f"No Ray cluster answers at {self._address} within {self._wait_s:g} s ({fault.strerror or fault}); "
                "start one there, or check the address."
            ) from None
        check = [sys.executable, "-m", "ray.scripts.scripts", "health-check", flag("address"), f"{host}:{port}"]
        try:
            healthy = subprocess.run(check, capture_output=True, timeout=_HEALTH * self._wait_s, check=False).returncode
        except subprocess.TimeoutExpired:
            healthy = 1
        if healthy != 0:
            raise MapError(
                f"What answers at {self._address} is no Ray cluster that lets this machine in within "
                f"{_HEALTH * self._wait_s:g} s; check the address, and where the cluster asks for a token, set "
                "RAY_AUTH_MODE=token here."
            )
        self._init(address=self._address)

    def _init(self, **how: Any) -> None:
        try:
            self._ray.init(include_dashboard=None if "address" in how else False, log_to_driver=False,
                           logging_level="ERROR", **how)  # fmt: skip
        except Exception as fault:  # noqa: BLE001 - Ray raises plain ones, among many others, where it cannot begin
            where = f"the Ray cluster at {self._address}" if "address" in how else "a Ray cluster on this machine"
            remedy = (
                "This machine must be part of the cluster, with the same Ray and Python as the others."
                if "address" in how
                else "Try again when the machine is less busy, or build without a cluster."
            )
            raise MapError(f"Could not use {where}: {_first_line(fault).rstrip('.')}. {remedy}") from None


def _environment(place: tuple[str, int] | None) -> dict[str, str]:
    quiet = {"RAY_USAGE_STATS_ENABLED": "0"}
    if place is not None and not is_loopback(place[0]):
        return quiet
    # Whether Ray may listen on other interfaces than loopback; Ray named it for the systems that needed it first.
    return {**quiet, "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"}


def _host_and_port(address: str) -> tuple[str, int] | None:
    if not address:
        return None
    host, _, port = address.rpartition(":")
    if not host or "/" in host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise MapError(f"{address!r} is no address of a Ray cluster; give HOST:PORT, as `ray start` prints it.")
    return host.strip("[]"), int(port)


def _first_line(fault: BaseException) -> str:
    return next((line.strip() for line in str(fault).splitlines() if line.strip()), type(fault).__name__)


def _last_line(fault: BaseException) -> str:
    return next((line.strip() for line in reversed(str(fault).splitlines()) if line.strip()), type(fault).__name__)
