"""A build's jobs on a pool of workers: processes or machines that see the recording and the map at the same places."""

import dataclasses
import secrets
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from itertools import pairwise
from pathlib import Path
from typing import Protocol, TypeVar

import numpy as np

from avlmaps.core.progress import progress
from avlmaps.maps.fusion.accumulator import VoxelAccumulator, VoxelSums
from avlmaps.maps.fusion.sensor import SensorModel
from avlmaps.maps.gravity.floor import GroundedRecording
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.pipeline.cluster_jobs import (
    AddJob,
    BuildRequest,
    DescribeJob,
    FuseJob,
    Models,
    NoFacts,
    Reopen,
    add_job,
    describe_job,
    fuse_job,
    show_token,
    software,
    token_file,
)
from avlmaps.maps.pipeline.encode_fuse import Tolerance
from avlmaps.maps.pipeline.keyframes import KeyframeLots
from avlmaps.maps.pipeline.parts import MapPart, load_part, sum_parts
from avlmaps.maps.pipeline.plan import BuildPlan, Span
from avlmaps.maps.pipeline.workers import Workers
from avlmaps.maps.store.checkpoints import find_checkpoint, key_of, load_checkpoint
from avlmaps.maps.store.manifest import BadFrame
from avlmaps.perception.cache.feature_store import DEFAULT_CACHE, CacheSettings

J = TypeVar("J")
A = TypeVar("A")
# Sums of parts are added up by the workers in slabs of about this size, and by one process where there is less.
SLAB_BYTES = 1 << 28


class Pool(Protocol):
    """Processes that do jobs: Ray's, or any others that can be given a function and a value."""

    @property
    def cores(self) -> int:
        """How many jobs it does at once."""
        ...

    def run(self, function: Callable[[J], A], jobs: Sequence[J]) -> Generator[tuple[int, A]]:
        """Do each job once, or again where its worker died; yield number and result of each as it is done."""
        ...


class ClusterWorkers(Workers):
    """Gives a build's jobs to a pool of workers."""

    def __init__(
        self, pool: Pool, reopen: Reopen, cache: CacheSettings = DEFAULT_CACHE, slab_bytes: int = SLAB_BYTES
    ) -> None:
        """Use a pool.

        ``reopen`` opens the recording on a worker, as it was opened here.
        """
        self._pool, self._reopen, self._cache, self._slab_bytes = pool, reopen, cache, slab_bytes
        self._tokens: dict[str, str] = {}  # by the plan's key: a worker checks what it sees once for a token

    def fuse(
        self,
        plan: BuildPlan,
        jobs: Sequence[tuple[Span, Path]],
        sensor: SensorModel,
        known_bad: Sequence[BadFrame],
        done: int,
    ) -> None:
        """Let each part be fused by a worker.

        Raises:
            RecordingError: too many frames cannot be read.
            MapError: a worker sees another recording or map, runs another avlmaps, or dies again and again.
            BackendError: it has other weights, or lacks a model.
        """
        if not jobs:
            return
        request, tolerance = self._request(plan), Tolerance(plan.recording, plan.settings, known_bad)
        orders = [FuseJob(request, span, folder, sensor) for span, folder in jobs]
        counts = [len(range(*span)) for span, _ in jobs]
        with closing(self._pool.run(fuse_job, orders)) as results:
            total = done + sum(counts)
            for number, result in progress(results, "fusing", total=total, done=done, size=lambda one: counts[one[0]]):
                result.require()
                for bad in load_part(orders[number].folder, plan.fusion_key).info.bad_frames:
                    tolerance.meet(bad)

    def describe(self, plan: BuildPlan, work: KeyframeLots) -> None:
        """Let each lot of keyframes be described by a worker; raises as ``fuse``."""
        if not work.lots:
            return
        request, counts = self._request(plan), [len(lot) for lot in work.lots.values()]
        orders = [
            DescribeJob(request, work.frames.indices[lot], folder, work.places, work.key)
            for folder, lot in work.lots.items()
        ]
        known = work.total - sum(counts)
        with closing(self._pool.run(describe_job, orders)) as results:
            for _, result in progress(
                results, "seeing", total=work.total, done=known, unit="keyframe", size=lambda one: counts[one[0]]
            ):
                result.require()

    def add_up(self, plan: BuildPlan, parts: Sequence[MapPart]) -> VoxelAccumulator:
        """Let workers add the parts up, each a slab of the building, and put the slabs together.

        The sums are floating-point numbers, whose last bits depend on the order in which they are added: the parts of
        a voxel are therefore added in the order of their frames, on each worker, and what is cut is the building.
        """
        grid, sums = GridSpec(plan.settings.voxel_size_m), [part.sums() for part in parts]
        size = sum(getattr(one, field.name).nbytes for one in sums for field in dataclasses.fields(one))
        slabs = min(self._pool.cores, size // self._slab_bytes)
        if slabs < 2:
            return sum_parts(parts, grid)
        request, folders = self._request(plan), tuple(part.folder for part in parts)
        orders: list[AddJob] = []
        for low, high in _slabs(sums, int(slabs)):
            key = key_of("slab", plan.fusion_key, [part.info.spans for part in parts], low, high)
            orders.append(AddJob(request, folders, low, high, plan.folder("slab", key), key))
        missing = [order for order in orders if find_checkpoint(order.folder, NoFacts, order.key) is None]
        with closing(self._pool.run(add_job, missing)) as results:
            for _, result in results:
                result.require()
        total = VoxelAccumulator(grid, sums[0].feature_sum.shape[1])
        for order in orders:
            total.merge(VoxelSums(**load_checkpoint(order.folder, NoFacts, order.key).arrays))
        return total

    def _request(self, plan: BuildPlan) -> BuildRequest:
        models, recording = Models.of(plan.encoders, self._cache), plan.recording
        # A path that is relative means another place on another machine.
        path, token = plan.path.absolute(), self._tokens.setdefault(plan.key, secrets.token_hex(8))
        show_token(token_file(path, plan.key, token))
        return BuildRequest(
            reopen=self._reopen,
            path=path,
            models=models,
            settings=plan.settings,
            ground=recording.ground if isinstance(recording, GroundedRecording) else None,
            key=plan.key,
            fingerprint=recording.fingerprint,
            checksums={module: card.checksum for module, card in plan.models.items()},
            software=software(),
            token=token,
        )


def _slabs(parts: Sequence[VoxelSums], count: int) -> list[tuple[int, int]]:
    """Return ranges of x that cover all voxels, each with about as many rows of the parts."""
    some = np.sort(np.concatenate([np.asarray(one.index[:: max(1, len(one) // 1000), 0]) for one in parts if len(one)]))
    inner = np.unique(some[np.linspace(0, len(some), count, endpoint=False, dtype=np.int64)[1:]])
    edges = [-(1 << 31), *(int(edge) for edge in inner), 1 << 31]
    return list(pairwise(edges))
