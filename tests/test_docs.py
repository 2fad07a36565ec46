"""The documentation: tutorials run as they stand, the menu names every page, the reference names what is public."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import avlmaps

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))


@pytest.mark.slow
def test_the_tutorial_runs_from_top_to_bottom(tmp_path: Path) -> None:
    """Pasted into a file, as a newcomer does."""
    page = (DOCS / "tutorials/first-map.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (tmp_path / "first_map.py").write_text("\n".join(blocks), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "first_map.py"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=280
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert not re.search(r"\.\d{5,}[,)]", done.stdout), f"positions are plain: {done.stdout}"
    assert (tmp_path / "heat.png").stat().st_size > 1000
    assert (tmp_path / "home.ply").stat().st_size > 1000


@pytest.mark.parametrize("page", PAGES)
def test_every_page_is_in_the_menu(page: str) -> None:
    assert f": {page}\n" in (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


def test_the_menu_names_no_page_that_is_missing() -> None:
    named = re.findall(r": ([\w/-]+\.md)\n", (ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    assert sorted(named) == PAGES


def test_the_reference_page_names_what_is_public() -> None:
    described = set(
        re.findall(r"^::: avlmaps\.[\w.]*?(\w+)$", (DOCS / "reference/python.md").read_text(), re.MULTILINE)
    )
    public = {name for name in avlmaps.__all__ if not name.endswith(("Error", "Settings")) and name != "__version__"}
    assert public <= described


def test_the_architecture_page_names_files_that_are_there() -> None:
    page = (DOCS / "architecture.md").read_text(encoding="utf-8")
    table = page.partition("## Where is")[2].partition("## Walls")[0]
    files = re.findall(r"`([\w/]+(?:\.py|/))`", table)
    assert len(files) > 8
    for file in files:
        rooms = (ROOT / "src/avlmaps", *ROOT.glob("packages/*/src"))
        assert any((room / file).exists() for room in rooms), file


def test_the_makefile_names_tests_that_are_there() -> None:
    """Pytest runs nothing where one of its files is missing."""
    named = re.findall(r"(?<![\w/])tests/[\w/]+(?:\.py)?", (ROOT / "Makefile").read_text(encoding="utf-8"))
    assert len(named) > 20
    for one in named:
        assert (ROOT / one).exists(), one
