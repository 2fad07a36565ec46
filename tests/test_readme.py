"""The Python of the README and of the tutorial runs as it stands, and the README's commands are known verbs."""

import json
import re
import shlex
from pathlib import Path
from unittest.mock import create_autospec

import numpy as np
import pytest

import avlmaps_sim
from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from helpers.raycast import render
from helpers.room import Room
from helpers.walked_room import RATE_HZ, beeps

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with a walk through a small room as REC."""
    camera, room = Pinhole(80.0, 80.0, 60.0, 45.0, 120, 90), Room()
    rig = Rig(camera, camera)
    with RecordingWriter(tmp_path / "REC", rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index, pose in enumerate(room.walk()[100:180:16]):
            view = render(room.scene, camera, pose)
            writer.add(Frame(index, f"{index:06d}", index / 4.0, view.rgb, view.depth_m, pose, rig))
        writer.set_audio(Sound(beeps(), RATE_HZ))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_readmes_python_runs(folder: Path) -> None:
    (block,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(block, "README.md", "exec"), {})
    assert (folder / "heat.png").stat().st_size > 1000


def test_the_tutorial_runs_from_top_to_bottom(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As a newcomer pastes it; its walk through a home is not made, the one through a small room is there."""
    record = create_autospec(avlmaps_sim.record_scene)
    monkeypatch.setattr(avlmaps_sim, "record_scene", record)
    page = (ROOT / "docs/tutorials/first-map.md").read_text(encoding="utf-8")
    exec(compile("\n".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL)), "first-map.md", "exec"), {})
    assert record.call_args.args[1] == "REC"
    said = capsys.readouterr().out
    assert not re.search(r"\.\d{5,}[,)]", said), f"positions are plain: {said}"
    assert (folder / "heat.png").stat().st_size > 1000
    assert (folder / "home.ply").stat().st_size > 1000


def test_the_readmes_commands_are_verbs() -> None:
    from avlmaps.cli.verbs import installed

    used = set(re.findall(r"^\s+avlmaps ([a-z-]+)", README, re.MULTILINE))
    assert used and used <= installed()[0].keys()


def test_clone_install_and_the_command_stand_before_its_first_use() -> None:
    steps = ("git clone", "make demo", "source .venv/bin/activate", "\n    avlmaps ")
    places = [README.index(step) for step in steps]
    assert places == sorted(places)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert "source $(VENV)/bin/activate" in makefile.split("\ndemo:")[1].split("\n\n")[0], "make demo says it as well"


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_the_first_steps_of_the_readme_run_as_written_and_find_what_they_query(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Fewer frames of the same walk, in smaller pictures, are all that this test changes."""
    from avlmaps.cli import main

    section = README.split("## First steps")[1].split("\n## ")[0]
    commands = re.findall(r"^    avlmaps (.*?)(?:\s{2,}#.*)?$", section, re.MULTILINE)
    assert [command.split()[0] for command in commands] == ["record", "build", "info", "query", "go"]
    monkeypatch.chdir(tmp_path)
    said = {}
    for command in commands:
        words = shlex.split(command)
        smaller = ["--max-frames", "30", "--size", "200x150"] if words[0] == "record" else []
        with pytest.raises(SystemExit) as stop:
            main([*words, *smaller, "--json"])
        told = capsys.readouterr()
        assert stop.value.code == 0, f"avlmaps {command}: {told.err.splitlines()[-1]}"
        said[words[0]] = json.loads(told.out)
        if "--plot" in words:
            assert (tmp_path / said[words[0]]["plot"]).stat().st_size > 1000
    assert all(sound["names"] for sound in said["info"]["sounds"])
    assert said["query"]["found"] is True
    assert said["go"]["ok"] is True


def test_every_picture_of_the_readme_is_there() -> None:
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", README):
        assert (ROOT / picture).is_file(), picture


def test_every_page_that_the_documents_link_to_is_there() -> None:
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
