"""Whoever does a build's jobs, and however often and in whichever order, the map holds the same bits."""

import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from build_fakes import SETTINGS, Pixels, Walk, content_of, open_walk, register_fakes, write_beeps

from avlmaps.core.errors import AvlmapsError, BackendError, MapError, RecordingError
from avlmaps.maps.build import build_map
from avlmaps.maps.pipeline import cluster_jobs
from avlmaps.maps.pipeline.cluster import ClusterWorkers, Pool
from avlmaps.maps.pipeline.cluster_jobs import FuseJob, JobResult, fuse_job, software
from avlmaps.perception.encoders import Encoders
from helpers.pool_here import Here

PROFILE = register_fakes()


@dataclass
class Processes:
    """The standard library's processes as a pool."""

    executor: ProcessPoolExecutor
    cores: int = 2

    def run(self, function: Callable[[Any], Any], jobs: Sequence[Any]) -> Generator[tuple[int, Any]]:
        numbers = {self.executor.submit(function, job): number for number, job in enumerate(jobs)}
        for done in as_completed(numbers):
            yield numbers[done], done.result()


@pytest.fixture
def tmp_path() -> Iterator[Path]:
    """A folder in memory where there is one: each build syncs some hundred small files."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as folder:
        yield Path(folder)


@pytest.fixture(scope="module")
def audio(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_beeps(tmp_path_factory.mktemp("sound") / "beeps.flac")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory, audio: Path) -> dict[str, bytes]:
    path = tmp_path_factory.mktemp("alone") / "map"
    build_map(open_walk(audio), path, PROFILE, SETTINGS, progress=False)
    return content_of(path)


@pytest.fixture(scope="module")
def processes() -> Iterator[Processes]:
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        yield Processes(executor)


def build(path: Path, pool: Pool, audio: Path | None = None, slab_bytes: int = 1, **how: Any) -> dict[str, bytes]:
    workers = ClusterWorkers(pool, partial(open_walk, audio), slab_bytes=slab_bytes)
    build_map(open_walk(audio), path, PROFILE, SETTINGS, workers=workers, progress=False, **how)
    return content_of(path)


@pytest.mark.slow
def test_processes_make_the_map_of_one(
    tmp_path: Path, audio: Path, alone: dict[str, bytes], processes: Processes
) -> None:
    assert build(tmp_path / "map", processes, audio) == alone


@pytest.mark.parametrize("seed", range(3))
def test_the_order_of_jobs_and_the_number_of_slabs_change_no_bit(
    tmp_path: Path, audio: Path, alone: dict[str, bytes], seed: int
) -> None:
    pool = Here(cores=1 + 2 * seed, seed=seed)
    assert build(tmp_path / "map", pool, audio) == alone


def test_a_job_that_is_done_twice_leaves_one_result(tmp_path: Path, audio: Path, alone: dict[str, bytes]) -> None:
    assert build(tmp_path / "map", Here(times=2), audio) == alone


@pytest.mark.parametrize("at", [0, 4, 7])
def test_a_build_whose_head_dies_resumes_to_the_same_map(
    tmp_path: Path, audio: Path, alone: dict[str, bytes], at: int
) -> None:
    """Some jobs are done, the build stops, and it goes on alone or spread, as it likes."""
    done = []

    class StoppedError(Exception):
        pass

    def dying(job: Any) -> Any:
        if len(done) == at:
            raise StoppedError
        done.append(job)
        return job

    with suppress(StoppedError):
        build(tmp_path / "map", Here(change=dying, seed=at), audio)
    assert build(tmp_path / "map", Here(seed=at + 1), audio) == alone
    if at == 4:
        with suppress(StoppedError):
            done.clear()
            build(tmp_path / "other", Here(change=dying, seed=at), audio)
        build_map(open_walk(audio), tmp_path / "other", PROFILE, SETTINGS, progress=False)
        assert content_of(tmp_path / "other") == alone


def test_a_worker_that_dies_in_a_job_leaves_nothing_that_counts(
    tmp_path: Path, audio: Path, alone: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    real, left = cluster_jobs.fuse_spans, []

    class Killed(BaseException):
        """Passes through everything but what runs at the end; that is switched off as well."""

    def dies(recording: Any, jobs: Any, *others: Any) -> None:
        real(recording, jobs, *others)
        left.append(jobs[0][1])
        raise Killed

    def first_dies(job: Any) -> Any:
        if isinstance(job, FuseJob):
            with monkeypatch.context() as patch:
                patch.setattr(cluster_jobs, "fuse_spans", dies)
                patch.setattr(cluster_jobs.shutil, "rmtree", lambda *_, **__: None)
                with suppress(Killed):
                    fuse_job(job)
            assert left[-1].is_dir() and not job.folder.exists()
        return job

    assert build(tmp_path / "map", Here(change=first_dies), audio) == alone
    assert len(left) == 6, "one for each part"


def test_too_many_frames_that_cannot_be_read_stop_a_spread_build_as_they_stop_one_alone(tmp_path: Path) -> None:
    bad = (3, 4, 9, 13, 17, 18)
    said = []
    for workers in (None, ClusterWorkers(Here(), partial(open_walk, bad=bad))):
        with pytest.raises(RecordingError) as fault:
            build_map(
                open_walk(bad=bad),
                tmp_path / f"{len(said)}",
                PROFILE,
                SETTINGS,
                progress=False,
                **({"workers": workers} if workers else {}),
            )
        said.append(str(fault.value))
    assert all(" of 22 frames cannot be read, more than the 4 that may be left out" in one for one in said)


def refused(path: Path, change: Callable[[Any], Any], of: type[AvlmapsError] = MapError) -> str:
    """Build with requests that a worker finds changed; return what the build says."""

    def changed(job: Any) -> Any:
        return replace(job, request=change(job.request))

    with pytest.raises(of) as fault:
        build(path, Here(change=changed))
    return str(fault.value)


def test_a_worker_with_other_software_is_refused_by_what_differs(tmp_path: Path) -> None:
    said = refused(tmp_path / "a", lambda r: replace(r, software={**r.software, "avlmaps": "0.2.0 (123456789abc)"}))
    assert "runs avlmaps" in said and "and this machine 0.2.0 (123456789abc); install the same" in said
    said = refused(tmp_path / "b", lambda r: replace(r, software={**r.software, "numpy": "1.0"}))
    assert f"runs numpy {software()['numpy']} and this machine 1.0" in said


def test_torch_is_compared_where_it_is_and_not_missed_where_it_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {name: "1.0" for name in software()} | {"torch": "2.9.1"}

    def version(name: str) -> str:
        if name not in versions:
            raise cluster_jobs.metadata.PackageNotFoundError(name)
        return versions[name]

    monkeypatch.setattr(cluster_jobs.metadata, "version", version)
    with_torch = software.__wrapped__()
    assert with_torch["torch"] == "2.9.1"
    del versions["torch"]
    assert "torch" not in software.__wrapped__()
    with pytest.raises(MapError, match=r"runs torch none and this machine 2\.9\.1; install the same"):
        cluster_jobs.require_same_software(with_torch | software(), "here")


def test_a_worker_checks_what_it_sees_once_for_a_build(
    tmp_path: Path, alone: dict[str, bytes], audio: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    checked: list[str] = []
    reopened = cluster_jobs.reopened
    monkeypatch.setattr(cluster_jobs, "reopened", lambda *given: checked.append("") or reopened(*given))
    assert build(tmp_path / "map", Here(), audio) == alone
    assert len(checked) == 1, "fusing, describing and adding up are one build"
    build(tmp_path / "other", Here(), audio)
    assert len(checked) == 2


def test_a_worker_with_other_weights_is_refused_by_their_checksum(tmp_path: Path) -> None:
    change = partial(replace, checksums={"pixels": "0123456789abcdef"})
    said = refused(tmp_path / "a", lambda r: change(r), BackendError)
    own = Pixels.card.checksum[:12]
    assert f"has other weights for pixels ({own}) than this machine (0123456789ab)" in said


def test_a_worker_that_lacks_a_model_says_so(tmp_path: Path) -> None:
    def other(request: Any) -> Any:
        return replace(request, models=replace(request.models, names={**request.models.names, "pixels": "unheard-of"}))

    said = refused(tmp_path / "a", other, BackendError)
    assert "There is no pixels backend called 'unheard-of'" in said


def nothing_there() -> Walk:
    raise RecordingError("There is nothing at /data/walk; give the folder or file of a recording.")


def test_a_worker_that_does_not_see_the_recording_or_the_map_is_refused(tmp_path: Path) -> None:
    said = refused(tmp_path / "a", lambda r: replace(r, reopen=nothing_there))
    assert "cannot open the recording: There is nothing at /data/walk" in said
    assert "on storage that all machines of the cluster see at the same path" in said
    said = refused(tmp_path / "b", lambda r: replace(r, reopen=partial(open_walk, seed=1), token=r.token))
    assert "sees another recording at /nowhere/of/mine/walk" in said
    said = refused(tmp_path / "c", lambda r: replace(r, path=tmp_path / "elsewhere", token="0" * 16))
    assert f"does not see {tmp_path}/elsewhere as this machine does" in said


def test_an_encoder_that_is_an_object_cannot_travel(tmp_path: Path) -> None:
    class Mine(Pixels):
        def encode_words(self, words: Sequence[str]) -> np.ndarray:
            return np.zeros((len(words), 4), np.float32)

    encoders = Encoders.named(PROFILE, pixels=Mine())
    with pytest.raises(BackendError, match="register it as a backend that they can import"):
        build_map(
            open_walk(), tmp_path / "map", encoders, SETTINGS, workers=ClusterWorkers(Here(), open_walk), progress=False
        )


def test_what_went_wrong_with_a_job_keeps_its_class() -> None:
    with pytest.raises(RecordingError, match="dark"):
        JobResult("here", 0.0, "RecordingError", "It is dark.").require()
    with pytest.raises(MapError, match="loud"):
        JobResult("here", 0.0, "AudioError", "It is loud.").require()
    JobResult("here", 0.0).require()
