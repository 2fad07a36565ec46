"""The README's Python runs as it stands, and its commands are words that the command line knows."""

import re
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
    from avlmaps.cli.main import VERBS

    used = set(re.findall(r"^\s+avlmaps ([a-z-]+)", README, re.MULTILINE))
    assert used and used <= VERBS.keys()


def test_every_picture_of_the_readme_is_there() -> None:
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", README):
        assert (ROOT / picture).is_file(), picture


def test_every_page_that_the_documents_link_to_is_there() -> None:
    for page in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
