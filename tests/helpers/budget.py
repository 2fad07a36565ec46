"""Hold what there is to own against .ci/budget.toml.

python tests/helpers/budget.py          count lines, files, kernels and words; refuse what is above its budget
python tests/helpers/budget.py --lower  write today's counts where they are below the budget
python tests/helpers/budget.py seconds  refuse a last run of tests that cost more processor seconds than the budget
"""

import ast
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BUDGET = ROOT / ".ci/budget.toml"
COMPILERS = ("jit", "kernel", "compiled")
PAGES = ("CHANGELOG.md", "NOTICE", "README.md")

Counts = dict[str, dict[str, int]]


def counts(root: Path = ROOT) -> Counts:
    """Count what git tracks below ``root``: each distribution's code, the tests' lines, the words of the pages."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=root, capture_output=True, text=True, check=True).stdout
    files = [name for name in listed.split("\0") if name and (root / name).is_file()]
    python = [name for name in files if name.endswith(".py")]
    sources = {"avlmaps": "src/avlmaps/"}
    for name in sorted({name.split("/")[1] for name in python if name.startswith("packages/")}):
        sources[name] = f"packages/{name}/src/"
    found = {
        name: code_counts((root / file).read_text(encoding="utf-8") for file in python if file.startswith(folder))
        for name, folder in sources.items()
    }
    tests = [file for file in python if file.startswith("tests/") or "/tests/" in file]
    found["tests"] = {"non_blank": sum(len(_non_blank((root / file).read_text(encoding="utf-8"))) for file in tests)}
    docs = [file for file in files if file.startswith("docs/") and file.endswith(".md")]
    pages = {page: [page] for page in PAGES if page in files}
    found["words"] = {
        name: sum(len((root / file).read_text(encoding="utf-8").split()) for file in of)
        for name, of in {"docs": docs, **pages}.items()
    }
    return found


def code_counts(sources: Iterable[str]) -> dict[str, int]:
    """Count modules: lines of code (no blanks, comments, docstrings, imports), lines, files, longest file, kernels."""
    each = [_counted(text) for text in sources]
    code, lines, kernels = (sum(column) for column in zip(*each, strict=True)) if each else (0, 0, 0)
    longest = max((one[1] for one in each), default=0)
    return {"code": code, "non_blank": lines, "files": len(each), "longest": longest, "kernels": kernels}


def above(found: Counts, budget: Counts) -> list[str]:
    """Return a line for each count that is above its budget or has none."""
    return [
        f"{part}.{what} is {value:,}; the budget is {limit:,}"
        for part, values in found.items()
        for what, value in values.items()
        if value > (limit := budget.get(part, {}).get(what, 0))
    ]


def lowered(text: str, found: Counts) -> str:
    """Return the budget's text with every number above today's count lowered to it."""
    part, lines = "", []
    for line in text.splitlines():
        if heading := re.fullmatch(r"\[([\w.-]+)\]", line):
            part = heading[1]
        elif number := re.match(r'"?([\w.-]+)"? = (\d+)', line):
            today = found.get(part, {}).get(number[1])
            if today is not None and today < int(number[2]):
                line = line.replace(number[2], str(today), 1)
        lines.append(line)
    return "\n".join(lines) + "\n"


def _non_blank(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.strip()]


def _counted(text: str) -> tuple[int, int, int]:
    """Return lines of code, lines that are not blank, and kernels of a module."""
    passed: set[int] = set()
    kernels = 0
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom) or (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        ):
            passed |= set(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        elif isinstance(node, ast.FunctionDef):
            kernels += any(word in ast.dump(one) for one in node.decorator_list for word in COMPILERS)
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), start=1) if line.strip()]
    return sum(line[0] != "#" and number not in passed for number, line in lines), len(lines), kernels


def _seconds(limit_s: float) -> int:
    """Print what the last run of the tests cost; return 1 where that is more than ``limit_s``."""
    spent_s = json.loads((ROOT / "build/test_seconds.json").read_text(encoding="utf-8"))["processor_s"]
    print(f"The tests cost {spent_s:.0f} processor seconds; .ci/budget.toml allows {limit_s:.0f} with its margin.")
    return int(spent_s > limit_s)


def main(words: list[str]) -> int:
    text = BUDGET.read_text(encoding="utf-8")
    budget = tomllib.loads(text)
    if words == ["seconds"]:
        return _seconds(budget["tests"]["processor_seconds"] * (1 + budget["tests"]["margin_percent"] / 100))
    found = counts()
    for part, values in found.items():
        print(f"{part:16}" + "  ".join(f"{what} {value:,}" for what, value in values.items()))
    if words == ["--lower"]:
        BUDGET.write_text(lowered(text, found), encoding="utf-8")
        return 0
    over = above(found, budget)
    if over:
        print("\nmore to own than .ci/budget.toml allows:", *over, sep="\n  ")
        print("Take something out, or raise the number in a commit of its own that says why.")
    return int(bool(over))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
