"""`--rules paper`: built, described and queried from the command line."""

from pathlib import Path

import pytest


@pytest.mark.nightly
def test_a_map_built_by_the_papers_rules_says_so_and_is_queried(answer, walk: Path, built: Path, tmp_path: Path):
    path = tmp_path / "paper.avlmap"
    made = answer("build", walk, "--out", path, "--profile", "colours", "--rules", "paper")
    assert made["rules"] == "paper"
    assert answer("info", path)["rules"] == "paper"
    assert answer("info", built)["rules"] == "ours"
    told = answer("query", path, "--object", "red", "--rules", "paper")
    assert told["goals"]
