"""No module imports itself by way of others, whenever the import is carried out; types alone are no import."""

import re
from collections import Counter
from pathlib import Path

import grimp
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).parents[1]
SOURCES = (ROOT / "src", *ROOT.glob("packages/*/src"))


def test_imports_are_absolute() -> None:
    files = [file for source in SOURCES for file in source.rglob("*.py")]
    assert len(files) > 400
    assert not [file for file in files if re.search(r"^\s*from \.", file.read_text(encoding="utf-8"), re.MULTILINE)]


def test_there_is_no_circle_of_imports() -> None:
    packages = [folder.parent.name for source in SOURCES for folder in source.glob("*/__init__.py")]
    graph = grimp.build_graph(*packages, exclude_type_checking_imports=True, cache_dir=None)
    every = sorted(graph.modules)
    number = {name: at for at, name in enumerate(every)}
    edges = [(number[name], number[other]) for name in every for other in graph.find_modules_directly_imported_by(name)]
    assert len(edges) > 1000
    row, column = np.array(edges).T
    matrix = csr_array((np.ones(len(edges)), (row, column)), (len(every), len(every)))
    _, group = connected_components(matrix, directed=True, connection="strong")
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
