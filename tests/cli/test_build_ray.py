"""`avlmaps build --ray`: what is wrong is said before a cluster is met."""

from pathlib import Path

import pytest


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--ray", "10.0.0.5:6379", "tuesday"), "--ray takes one address and got 10.0.0.5:6379 tuesday"),
        (("--ray", "10.0.0.5"), "'10.0.0.5' is no address of a Ray cluster; give HOST:PORT"),
    ],
)
def test_an_address_is_one_host_and_port(walk: Path, run, tmp_path: Path, words: tuple[str, ...], said: str) -> None:
    status, out, err = run("build", walk, "--out", tmp_path / "map", *words)
    assert status != 0 and out == "" and said in err
    assert not (tmp_path / "map").exists()


@pytest.mark.parametrize("option", [("--close-loops",), ("--submaps",), ("--audio", "x.wav"), ("--topics", "rgb=/a")])
def test_what_is_of_one_recording_is_refused_for_several(
    walk: Path, run, tmp_path: Path, option: tuple[str, ...]
) -> None:
    status, out, err = run("build", walk, walk, "--out", tmp_path / "map", "--ray", *option)
    assert status != 0 and out == ""
    assert f"{option[0]} is of one recording; build a map of each, then `avlmaps merge` them." in err
