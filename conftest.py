"""Fixtures that every room's tests share."""

import gc
import json
import os
import sys
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest

from helpers.kernels_once import compile_each_kernel_once
from helpers.plain_numbers import assert_plain

# Small matrices run up to twenty times slower on several BLAS threads when the machine is shared.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(variable, "1")
# Tests start some hundred processes; without cached bytecode each compiles the package again, half a second each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
# Collecting makes 700,000 objects that stay; no collection of garbage has to look at them meanwhile.
gc.disable()

from hypothesis import settings  # noqa: E402

pytest_plugins = ["helpers.processor_seconds"]

settings.register_profile("change", deadline=None, max_examples=10, derandomize=True)
settings.register_profile("nightly", deadline=None, max_examples=40, derandomize=True)
settings.load_profile(os.environ.get("AVLMAPS_TESTS", "change"))


def pytest_configure(config: pytest.Config) -> None:
    """Share what workers compile; write no file through to the disk, since no test cuts the power."""
    if hasattr(config, "workerinput"):
        compile_each_kernel_once()
    elif getattr(config.option, "dist", "no") != "no":
        gc.enable()  # it collects no test itself
    os.fsync = _left_to_the_system  # a build of 14 frames waits for the disk 246 times


def _left_to_the_system(descriptor: int) -> None:
    """Stand for ``os.fsync``: refuse what is no open file, as it does."""
    os.fstat(descriptor)


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(
    collector: pytest.Collector,
) -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """Let each worker begin elsewhere: it finds ready what the others have compiled, and they what it has."""
    report = yield
    worker = getattr(collector.config, "workerinput", None)
    if worker is not None and isinstance(collector, pytest.Session | pytest.Directory):
        first = len(report.result) * int(worker["workerid"][2:]) // worker["workercount"]
        report.result = report.result[first:] + report.result[:first]
    return report


def pytest_collection_finish() -> None:
    """Leave what collecting made out of every later collection of garbage as well: .4 s each time."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave all but a few cases of a test to the night, and begin with the files that hold a slow test.

    A long test that begins last leaves the other cores idle.
    """
    cases: dict[tuple[object, int], list[pytest.Item]] = {}
    for item in items:
        few = item.get_closest_marker("few")
        if few is not None:
            cases.setdefault((getattr(item, "function", None), few.args[0]), []).append(item)
    for (_, count), every in cases.items():
        kept = {round(number * (len(every) - 1) / max(count - 1, 1)) for number in range(count)}
        for number, item in enumerate(every):
            if number not in kept:
                item.add_marker("nightly")
    slow = {item.path for item in items if item.get_closest_marker("slow") is not None}
    items.sort(key=lambda item: (item.path not in slow, item.path))


@pytest.fixture(scope="session", autouse=True)
def _every_message_has_plain_numbers() -> Iterator[None]:
    """Hold every error that any test provokes, and every line of progress or of an answer, to ``assert_plain``."""
    from avlmaps.core import errors, progress

    def checked(self: Exception, *words: object) -> None:
        Exception.__init__(self, *words)
        assert_plain(str(self))

    def say(message: str) -> None:
        assert_plain(message)
        original(message)

    original, places = progress.say, [progress, *_importers("say", progress.say)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(errors.AvlmapsError, "__init__", checked)
        for place in places:
            patch.setattr(place, "say", say)
        yield


def _importers(name: str, value: object) -> list[object]:
    """Return the modules of the package that are loaded already and hold this value under this name."""
    ours = [module for key, module in sys.modules.items() if key.startswith(("avlmaps.", "avlmaps_"))]
    return [module for module in ours if vars(module).get(name) is value and module.__name__ != "avlmaps.core.progress"]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real data beside the checkout; tests that need it are skipped where it is absent."""
    folder = Path(__file__).resolve().parents[1] / "shared"
    if not (folder / "data").is_dir():
        pytest.skip("needs the real recordings in ../shared/data, which are not part of this repository")
    return folder


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Run a command line in this process; return its exit status, standard output and standard error."""

    from avlmaps.cli import main

    def call(*words: object) -> tuple[int, str, str]:
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            main([str(word) for word in words])
        said = capsys.readouterr()
        assert_plain(said.out + said.err)
        return int(stop.value.code or 0), said.out, said.err

    return call


@pytest.fixture
def answer(run: Callable[..., tuple[int, str, str]]) -> Callable[..., dict[str, Any]]:
    """Run a command line with --json and return its one object."""

    def call(*words: object) -> dict[str, Any]:
        status, out, err = run(*words, "--json")
        assert status == 0, err
        assert out.count("\n") == 1, "one JSON object on standard output, and nothing else"
        return json.loads(out)

    return call
