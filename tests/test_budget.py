"""The budget counts what a reader has to hold, refuses what rises, and falls with what is taken out."""

import tomllib

from helpers import budget

MODULE = '"""Doc."""\n\nimport os\n\n# why\n@njit(cache=True)\ndef f():\n    """Do."""\n    return """a\n    b"""\n'


def test_code_is_what_is_no_blank_comment_docstring_or_import() -> None:
    assert budget.code_counts([MODULE, "x = 1\n"]) == {
        "code": 5,
        "non_blank": 9,
        "files": 2,
        "longest": 8,
        "kernels": 1,
    }


def test_what_rises_and_what_has_no_budget_is_refused() -> None:
    allowed = {"a": {"code": 10, "files": 1}}
    assert not budget.above({"a": {"code": 10, "files": 1}}, allowed)
    over = budget.above({"a": {"code": 11, "files": 1}, "new": {"code": 3}}, allowed)
    assert [line.split()[0] for line in over] == ["a.code", "new.code"]


def test_the_budget_falls_to_todays_counts_and_never_rises() -> None:
    text = '# why\n[a]\ncode = 10\n"b.c" = 5\n[d]\ncode = 7\n'
    lower = budget.lowered(text, {"a": {"code": 8, "b.c": 6}})
    assert tomllib.loads(lower) == {"a": {"code": 8, "b.c": 5}, "d": {"code": 7}}
    assert lower.startswith("# why\n")


def test_every_distribution_has_a_budget() -> None:
    packages = {folder.name for folder in (budget.ROOT / "packages").iterdir() if (folder / "src").is_dir()}
    budgets = tomllib.loads(budget.BUDGET.read_text(encoding="utf-8"))
    assert {"avlmaps", "tests", "words", *packages} <= budgets.keys()
