"""The prose of the project avoids the words of the glossary's table, and the check finds them where they stand."""

import pytest

from helpers import vocabulary

WORDS = {"told": "reports", "so many": "up to N"}


def _found(text: str, file: str = "a.py") -> list[tuple[int, str]]:
    return [(hit.line, hit.word) for hit in vocabulary.hits_in(file, text, WORDS)]


def test_no_page_help_error_docstring_or_comment_has_a_word_to_avoid() -> None:
    found = vocabulary.hits(vocabulary.files())
    assert not found, "\n".join(map(str, found))


def test_every_word_of_the_table_has_a_better_one_and_is_found() -> None:
    words = vocabulary.words_to_avoid()
    assert len(words) > 20
    for word, better in words.items():
        assert better
        (hit,) = vocabulary.hits_in("page.md", f"First line.\nHere {word.upper()} stands.\n", words)
        assert (hit.line, hit.word, hit.better) == (2, word, better)


def test_every_exception_names_something_that_is_there() -> None:
    for name in (*vocabulary.NOT_YET, *vocabulary.EXEMPT):
        assert list(vocabulary.ROOT.glob(name)), f"{name} is gone: drop it from the list"


def test_the_files_cover_every_page_but_not_what_is_exempt() -> None:
    names = {path.relative_to(vocabulary.ROOT).as_posix() for path in vocabulary.files()}
    assert {"README.md", "docs/conventions.md", "docs/guides/add-a-verb.md"} <= names
    assert not names & {"CHANGELOG.md", "docs/glossary.md"}


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('"""Is told."""\n', [(1, "told")]),
        ('"""Is\n\n    told so\n    many.\n    """\n', [(3, "told"), (3, "so many")]),
        ("x = 1  # told\n", [(1, "told")]),
        ("# so\n# many\n", [(1, "so many")]),
        ("# so\nx = 1\n# many\n", []),
        ('raise E(\n    "The robot was "\n    f"{told} told that"\n    " it stopped."\n)\n', [(3, "told")]),
        ('f(help="Report what it was told.")\n', [(1, "told")]),
        ("told = untold(told)\n", []),
        ('KEYS = ["told", "was told"]\n', []),
        ('PATTERN = r"what I told you to do"\n', []),
        ('"""Reads `told` and ``so many``; "he told me so" is a command."""\n', []),
        ('"""F.\n\n    Args:\n        told: was told.\n    """\n', [(4, "told")]),
        ('f"The robot said {told} and {so_many} other words."\n', []),
    ],
)
def test_prose_in_code_is_checked_and_code_is_not(text: str, found: list[tuple[int, str]]) -> None:
    assert _found(text) == found


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("One.\n\nTwo told\nthree.\n", [(3, "told")]),
        ("```\ntold\n```\ntold\n", [(4, "told")]),
        ("    avlmaps told\n", []),
        ('See [this](told.md), `told` and "who told you".\n', []),
        ("<!-- told -->\n", []),
    ],
)
def test_prose_of_a_page_is_checked_and_its_code_is_not(text: str, found: list[tuple[int, str]]) -> None:
    assert _found(text, "page.md") == found


def test_a_page_without_the_table_is_an_error() -> None:
    with pytest.raises(ValueError, match="no table"):
        vocabulary.words_to_avoid("# Glossary\n")
