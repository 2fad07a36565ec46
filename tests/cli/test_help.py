"""What `--help` says is kept as snapshots: a change of the command line is seen, and meant.

After a change that is meant: AVLMAPS_UPDATE_SNAPSHOTS=1 make test
"""

import os
from pathlib import Path

import pytest

from avlmaps.cli.verbs import installed

SNAPSHOTS = Path(__file__).parent / "snapshots"


@pytest.mark.parametrize("verb", ["", *installed()[0]])
def test_help_is_as_it_was(verb: str, run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "100")
    status, out, _ = run(*([verb] if verb else []), "--help")
    assert status == 0
    said = "\n".join(line.rstrip() for line in out.strip().splitlines()) + "\n"
    kept = SNAPSHOTS / f"{verb or 'avlmaps'}.txt"
    if os.environ.get("AVLMAPS_UPDATE_SNAPSHOTS"):
        kept.write_text(said, encoding="utf-8")
    assert said == kept.read_text(encoding="utf-8")
    assert not verb or ("--json" in out and ("(required)" in out or verb in ("demo", "profiles")))


def test_each_example_has_a_line_of_its_own_and_no_quotes_of_the_source_show() -> None:
    for page in SNAPSHOTS.glob("*.txt"):
        said = page.read_text(encoding="utf-8")
        assert not [line for line in said.splitlines() if line.count("Example: ") > 1 or '" "' in line], page.name
