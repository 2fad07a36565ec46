"""The README's Python runs as it stands, and its commands are words that the command line knows."""

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole, Rig
from avlmaps.recordings.types import Frame
from avlmaps.recordings.writer import RecordingWriter
from helpers.raycast import render
from helpers.room import Room

ROOT = Path(__file__).resolve().parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_readmes_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    camera, room = Pinhole(80.0, 80.0, 60.0, 45.0, 120, 90), Room()
    rig = Rig(camera, camera)
    with RecordingWriter(tmp_path / "REC", rig, up_in_world=np.array([0.0, 0.0, 1.0])) as writer:
        for index, pose in enumerate(room.walk()[100:180:16]):
            view = render(room.scene, camera, pose)
            writer.add(Frame(index, f"{index:06d}", index / 4.0, view.rgb, view.depth_m, pose, rig))
    monkeypatch.chdir(tmp_path)
    (block,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(block, "README.md", "exec"), {})
    assert (tmp_path / "heat.png").stat().st_size > 1000


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
    """Fewer frames of the same walk, and nothing else, are what this test changes."""
    from avlmaps.cli import main

    section = README.split("## First steps")[1].split("\n## ")[0]
    commands = re.findall(r"^    avlmaps (.*?)(?:\s{2,}#.*)?$", section, re.MULTILINE)
    assert [command.split()[0] for command in commands] == ["record", "build", "info", "query", "go"]
    monkeypatch.chdir(tmp_path)
    said = {}
    for command in commands:
        words = shlex.split(command)
        smaller = ["--max-frames", "36"] if words[0] == "record" else []
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
