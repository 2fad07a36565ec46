"""The documentation: the menu names every page, the reference names what is public."""

import ast
import importlib
import re
import textwrap
from pathlib import Path

import pytest

import avlmaps

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
OURS = ("avlmaps", "avlmaps_sim", "avlmaps_models")
PAGES = sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))


def _python_of(page: Path) -> list[str]:
    """Return the blocks of Python of a page: fenced ones, and indented ones that begin with an import."""
    text = page.read_text(encoding="utf-8")
    indented = re.findall(r"(?:^    (?:from|import) .*\n)(?:^(?:    (?!```).*)?\n)*", text, re.MULTILINE)
    return [*re.findall(r"^```python\n(.*?)```", text, re.DOTALL | re.MULTILINE), *map(textwrap.dedent, indented)]


@pytest.mark.filterwarnings("error::DeprecationWarning")
@pytest.mark.parametrize("page", ["../README.md", *(page for page in PAGES if _python_of(DOCS / page))])
def test_the_python_of_the_documents_can_be_read_and_imports_what_is_there_and_all_that_it_uses(page: str) -> None:
    known: set[str] = set()
    for tree in map(ast.parse, _python_of(DOCS / page)):
        found = list(ast.walk(tree))
        for line in found:
            if isinstance(line, ast.ImportFrom) and (line.module or "").partition(".")[0] in OURS:
                there = importlib.import_module(line.module or "")
                for name in line.names:
                    assert hasattr(there, name.name), f"{page}: {line.module} has no {name.name}"
            elif isinstance(line, ast.Attribute) and isinstance(line.value, ast.Name) and line.value.id == "avlmaps":
                assert hasattr(avlmaps, line.attr), f"{page}: avlmaps.{line.attr}"
        imports = (name for one in found if isinstance(one, ast.Import | ast.ImportFrom) for name in one.names)
        known |= {name.asname or name.name.partition(".")[0] for name in imports}
        used = {one.id for one in found if isinstance(one, ast.Name)}
        assert used & {*OURS, "np", "Path"} <= known, f"{page}:\n{ast.unparse(tree)}"


def test_the_menu_names_every_page_and_none_that_is_missing() -> None:
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
    table = page.partition("## Where is")[2].partition("## A map on disk")[0]
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


def test_the_forges_workflow_calls_what_is_there() -> None:
    """Nobody runs it before a push: its targets, files, marks and Pythons are those of the project."""
    flow = (ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8")
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    steps = re.findall(r"run: (.+)", flow)
    called = re.findall(r"\bmake (?:--\S+ )*([\w-]+)", "\n".join([*steps, (ROOT / ".ci/run").read_text("utf-8")]))
    targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert len(called) > 5 and set(called) <= set(targets)
    files = re.findall(r" -[re] (\S+)|^(\.\S+)", "\n".join(steps), re.MULTILINE)
    assert len(files) > 3 and all((ROOT / (one or other)).exists() for one, other in files)
    (chosen,) = re.findall(r'-m "(not .+)"', flow)
    assert all(f'"{mark}: ' in project for mark in re.findall(r"not (\w+)", chosen))
    pythons = re.findall(r"Python :: (3\.\d+)", project)
    assert re.findall(r"python: \[(.+)\]", flow) == [", ".join(f'"{one}"' for one in pythons)] * 2
