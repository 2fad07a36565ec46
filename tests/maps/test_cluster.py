"""Whoever maps a build's stretches of frames, and however often and in whichever order, the map is the same."""

import pickle
from collections.abc import Callable, Generator, Sequence
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
from avlmaps.maps import cluster
from avlmaps.maps.build import build_map
from avlmaps.maps.cluster import Pool, cluster_workers
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


@pytest.fixture(scope="module")
def audio(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_beeps(tmp_path_factory.mktemp("sound") / "beeps.flac")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory, audio: Path) -> dict[str, bytes]:
    path = tmp_path_factory.mktemp("alone") / "map"
    build_map(open_walk(audio), path, PROFILE, SETTINGS, progress=False)
    return content_of(path)


def build(path: Path, pool: Pool, audio: Path | None = None) -> dict[str, bytes]:
    workers = cluster_workers(pool, partial(open_walk, audio))
    build_map(open_walk(audio), path, PROFILE, SETTINGS, workers=workers, progress=False)
    return content_of(path)


class Pickled(Here):
    """Hears of its work, and tells what comes of it, in bytes, as another process does."""

    def run(self, function: Callable[[Any], Any], jobs: Sequence[Any]) -> Generator[tuple[int, Any]]:
        for number, done in super().run(*pickle.loads(pickle.dumps((function, list(jobs))))):
            yield number, pickle.loads(pickle.dumps(done))


@pytest.mark.nightly  # by day work travels as it does, and is done here
def test_two_processes_make_the_map_of_one(tmp_path: Path, audio: Path, alone: dict[str, bytes]) -> None:
    with ProcessPoolExecutor(2, get_context("spawn")) as executor:
        assert build(tmp_path / "map", Processes(executor), audio) == alone


def test_the_order_of_jobs_and_jobs_that_are_done_twice_change_nothing(
    tmp_path: Path, audio: Path, alone: dict[str, bytes]
) -> None:
    assert build(tmp_path / "map", Pickled(times=2, seed=3), audio) == alone


def test_a_build_whose_head_dies_resumes_to_the_same_map(tmp_path: Path, audio: Path, alone: dict[str, bytes]) -> None:
    done = []

    class StoppedError(Exception):
        pass

    def dying(job: Any) -> Any:
        if len(done) == 3:
            raise StoppedError
        done.append(job)
        return job

    with suppress(StoppedError):
        build(tmp_path / "map", Here(change=dying, seed=4), audio)
    build_map(open_walk(audio), tmp_path / "map", PROFILE, SETTINGS, progress=False)
    assert content_of(tmp_path / "map") == alone


def test_too_many_frames_that_cannot_be_read_stop_a_spread_build_as_they_stop_one_alone(tmp_path: Path) -> None:
    bad = (3, 4, 9, 13, 17, 18)
    for number, workers in enumerate((None, cluster_workers(Here(), partial(open_walk, bad=bad)))):
        with pytest.raises(RecordingError, match=" of 22 frames cannot be read, more than the 4"):
            build_map(
                open_walk(bad=bad), tmp_path / f"{number}", PROFILE, SETTINGS, workers=workers, progress=False
            )  # fmt: skip


def nothing_there() -> Walk:
    raise RecordingError("There is nothing at /data/walk; give the folder or file of a recording.")


REFUSED = [
    (lambda job: replace(job, software=job.software.replace("numpy ", "numpy 0.")), MapError, "and this machine avl"),
    (lambda job: replace(job, reopen=nothing_there), MapError, "cannot open the recording"),
    (lambda job: replace(job, reopen=partial(open_walk, seed=1)), MapError, "would build another map"),
    (lambda job: replace(job, models=replace(job.models, names={"pixels": "unheard-of"})), BackendError, "unheard-of"),
    (lambda job: replace(job, file=job.file.with_name("elsewhere")), MapError, "does not see"),
]


@pytest.mark.parametrize(("change", "of", "named"), REFUSED, ids=[named for *_, named in REFUSED])
def test_a_worker_that_sees_or_runs_something_else_is_refused(
    tmp_path: Path, change: Callable[[Any], Any], of: type[AvlmapsError], named: str
) -> None:
    cluster._known.clear()
    with pytest.raises(of, match=named):
        build(tmp_path / "map", Here(change=change))


def test_an_encoder_that_is_an_object_cannot_travel(tmp_path: Path) -> None:
    class Mine(Pixels):
        def encode_words(self, words: Sequence[str]) -> np.ndarray:
            return np.zeros((len(words), 4), np.float32)

    workers = cluster_workers(Here(), open_walk)
    with pytest.raises(BackendError, match="register it as a backend that they can import"):
        build_map(
            open_walk(), tmp_path / "map", Encoders.named(PROFILE, pixels=Mine()), SETTINGS, workers=workers,
            progress=False,
        )  # fmt: skip
