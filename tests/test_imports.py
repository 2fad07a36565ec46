"""No module imports itself by way of others, whenever the import is carried out; types alone are no import."""

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]


def modules() -> dict[str, Path]:
    found: dict[str, Path] = {}
    for source in (ROOT / "src", *ROOT.glob("packages/*/src")):
        for path in source.rglob("*.py"):
            parts = path.relative_to(source).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports(path: Path) -> Iterator[str]:
    """Yield what a file imports when it runs: a module, or a name of one."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tree.body = [
        node for node in tree.body if not (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test))
    ]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports here are absolute"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_there_is_no_circle_of_imports() -> None:
    every = modules()
    number = {name: at for at, name in enumerate(every)}
    pairs = [
        (name, target if target in every else target.rpartition(".")[0])
        for name, path in every.items()
        for target in imports(path)
    ]
    edges = [(number[name], number[other]) for name, other in pairs if other in every and other != name]
    assert len(edges) > 1000
    row, column = np.array(edges).T
    graph = csr_array((np.ones(len(edges)), (row, column)), (len(every), len(every)))
    _, group = connected_components(graph, directed=True, connection="strong")
    circles = {label for label, size in Counter(group.tolist()).items() if size > 1}
    assert [name for name, label in zip(every, group.tolist(), strict=True) if label in circles] == []


def test_no_two_files_of_tests_have_one_name_where_their_folders_are_no_packages() -> None:
    """pytest imports such a file by its bare name, and leaves out the second one with an error."""
    tests = (ROOT / "tests", *ROOT.glob("packages/*/tests"))
    files = [file for folder in tests for file in folder.rglob("test_*.py")]
    bare = [file for file in files if not (file.parent / "__init__.py").is_file()]
    foundation = ROOT / "packages" / "avlmaps-models"  # has a run of its own
    names = Counter(file.name for file in bare if foundation not in file.parents)
    assert [name for name, times in names.items() if times > 1] == []
