"""No module imports itself by way of others: neither at run time nor for types."""

import ast
from collections import Counter
from collections.abc import Iterator
from enum import StrEnum
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = (ROOT / "src", *sorted(ROOT.glob("packages/*/src")))


class When(StrEnum):
    """When an import is carried out."""

    LOADED = "when the module is loaded"
    CALLED = "when a function is called"
    TYPED = "for the type checker"


def modules(*sources: Path) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for src in sources:
        for path in sorted(src.rglob("*.py")):
            parts = path.relative_to(src).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(tree: ast.AST, package: str, when: When = When.LOADED) -> Iterator[tuple[When, str, str]]:
    """Yield when each import is carried out, the module that it names, and the name that it takes from there."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from ((when, alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) + 1 - node.level] if node.level else []
            yield from ((when, ".".join([*above, node.module or ""]).strip("."), alias.name) for alias in node.names)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield from imports(ast.Module(node.body, []), package, When.TYPED)
            yield from imports(ast.Module(node.orelse, []), package, when)
        else:
            inside = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
            yield from imports(node, package, When.CALLED if inside and when is When.LOADED else when)


def import_graph(*sources: Path) -> dict[str, set[tuple[When, str]]]:
    """Return for each module which others of the package it imports, and when."""
    every = modules(*sources)
    graph: dict[str, set[tuple[When, str]]] = {}
    for name, path in every.items():
        package = name if path.name == "__init__.py" else name.rpartition(".")[0]
        graph[name] = set()
        for when, base, taken in imports(ast.parse(path.read_text(encoding="utf-8")), package):
            target = f"{base}.{taken}" if f"{base}.{taken}" in every else base
            if target in every and target != name:
                graph[name].add((when, target))
    return graph


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the groups of modules that reach one another (Tarjan's strongly connected components)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(name: str) -> None:
        order[name] = low[name] = len(order)
        stack.append(name)
        for other in sorted(graph[name]):
            if other not in order:
                visit(other)
                low[name] = min(low[name], low[other])
            elif other in stack:
                low[name] = min(low[name], order[other])
        if low[name] == order[name]:
            group = stack[stack.index(name) :]
            del stack[stack.index(name) :]
            if len(group) > 1:
                found.append(sorted(group))

    for name in graph:
        if name not in order:
            visit(name)
    return sorted(found)


@cache
def own_graph() -> dict[str, set[tuple[When, str]]]:
    return import_graph(*SOURCES)


@pytest.mark.parametrize(
    "counted",
    [{When.LOADED}, {When.LOADED, When.CALLED}, {When.LOADED, When.TYPED}, set(When)],
    ids=["loaded", "and-called", "and-typed", "all"],
)
def test_there_is_no_circle_of_imports(counted: set[When]) -> None:
    graph = {name: {other for when, other in others if when in counted} for name, others in own_graph().items()}
    assert circles(graph) == []


def test_a_circle_is_found_whenever_its_imports_are_carried_out(tmp_path: Path) -> None:
    package = tmp_path / "house"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "attic.py").write_text("from house import cellar\n")
    (package / "cellar.py").write_text("def stairs():\n    from house.hall import door\n")
    (package / "hall.py").write_text(
        "import typing\nif typing.TYPE_CHECKING:\n    from .attic import roof\nelse:\n    import house.attic\n"
    )
    graph = import_graph(tmp_path)
    assert graph["house.attic"] == {(When.LOADED, "house.cellar")}
    assert graph["house.cellar"] == {(When.CALLED, "house.hall")}
    assert graph["house.hall"] == {(When.TYPED, "house.attic"), (When.LOADED, "house.attic")}
    everything = {name: {other for _, other in others} for name, others in graph.items()}
    assert circles(everything) == [["house.attic", "house.cellar", "house.hall"]]
    loaded = {name: {other for when, other in others if when is When.LOADED} for name, others in graph.items()}
    assert circles(loaded) == []


def test_all_distributions_are_read() -> None:
    graph = own_graph()
    assert len(graph) > 300
    assert {name.partition(".")[0] for name in graph} == {"avlmaps", "avlmaps_sim", "avlmaps_models", "avlmaps_ros"}
    assert (When.LOADED, "avlmaps.query.goals") in graph["avlmaps.query.heatmap"]


def test_no_two_files_of_tests_have_one_name_where_their_folders_are_no_packages() -> None:
    """pytest imports such a file by its bare name, and leaves out the second one with an error."""
    tests = (ROOT / "tests", *ROOT.glob("packages/*/tests"))
    files = [file for folder in tests for file in folder.rglob("test_*.py")]
    bare = [file for file in files if not (file.parent / "__init__.py").is_file()]
    foundation = ROOT / "packages" / "avlmaps-models"  # has a run of its own
    names = Counter(file.name for file in bare if foundation not in file.parents)
    assert [name for name, times in names.items() if times > 1] == []
