"""docs/benchmarks.md and the README's table follow from docs/benchmarks.json, and say what is outdated."""

import json
import re
import shlex
import sys
from pathlib import Path

import pytest

from avlmaps_sim.bench.harness.models import shipped_checksums

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "benchmarks"))

from page import (  # noqa: E402 - benchmarks is not a package
    BEGIN,
    END,
    ENTRIES,
    LANGUAGE,
    NOT_YET,
    PAGE,
    README,
    README_FIGURES,
    RECORDINGS,
    language_tables,
    page,
    read_figures,
    readme_table,
    recordings_tables,
    stale,
    with_figures,
)

MEASURED = read_figures()
COMMANDS = {entry.name: entry for entry in ENTRIES}


def test_the_page_is_what_the_figures_make():
    assert PAGE.read_text(encoding="utf-8") == page(MEASURED, shipped_checksums()), "python benchmarks/report.py --page"


def test_the_readme_shows_the_figures_that_were_measured():
    readme = README.read_text(encoding="utf-8")
    assert readme == with_figures(readme, readme_table(MEASURED)), "python benchmarks/report.py --page"
    assert len(README_FIGURES) <= 10


def test_the_page_of_recordings_shows_the_figures_that_were_measured():
    shown = RECORDINGS.read_text(encoding="utf-8")
    assert shown == with_figures(shown, recordings_tables(MEASURED)), "python benchmarks/report.py --page"
    assert ("silent wrong" in recordings_tables(MEASURED)) == ("recordings" in MEASURED)


def test_the_page_of_language_shows_each_round_and_all_lists_now() -> None:
    shown = LANGUAGE.read_text(encoding="utf-8")
    assert shown == with_figures(shown, language_tables(MEASURED)), "python benchmarks/report.py --page"
    assert ("all, commands" in language_tables(MEASURED)) == ("language" in MEASURED)


def test_a_figure_typed_into_the_readme_by_hand_is_noticed():
    readme = README.read_text(encoding="utf-8")
    begin = readme.index(BEGIN) + len(BEGIN)
    forged = readme[:begin] + readme[begin:].replace("measured", "guessed", 1)
    assert forged != with_figures(forged, readme_table(MEASURED))


def test_a_readme_without_markers_is_refused():
    with pytest.raises(ValueError, match="lacks"):
        with_figures("# readme", "| a |")
    assert with_figures(f"a\n{BEGIN}\nold\n{END}\nb", "new") == f"a\n{BEGIN}\nnew\n{END}\nb"


def test_every_row_of_the_readme_that_was_measured_has_its_figure():
    for figure, line in zip(README_FIGURES, readme_table(MEASURED).splitlines()[2:], strict=True):
        assert figure.entry in COMMANDS
        assert (NOT_YET in line) == (figure.entry not in MEASURED), line


def test_what_was_measured_is_known_by_an_entry_and_by_its_own_command():
    for name, found in MEASURED.items():
        assert found["command"] == COMMANDS[name].command
        assert ("answer" in found) == COMMANDS[name].is_suite


def indexing(weights: dict[str, str] | None) -> dict[str, object]:
    columns = ["configuration", "tasks", "R@1 < 0.5 m %", "95 %"]
    rows = [["object only", 100, 20.0, "13 to 29"], ["+ sparse view map (ours)", 100, 45.0, "35.6 to 54.8"]]
    table = {"columns": columns, "rows": rows, "chosen on": "the weight by distance."}
    answer = {
        "suite": "indexing",
        "profile": "embedded",
        "seed": 3,
        "scenes": ["house:1"],
        "tables": {"Table III: x": table},
    }
    if weights is not None:
        answer["weights"] = weights
    return {
        "command": "avlmaps bench indexing",
        "date": "2026-11-22",
        "avlmaps": "0.2.0",
        "machine": "2 cores",
        "answer": answer,
    }


SHIPPED = {"pixels": "a" * 64, "views": "b" * 64}


def test_a_table_of_other_weights_says_so_and_is_run_again():
    entry = COMMANDS["indexing"]
    for weights, told in (({**SHIPPED, "views": "c" * 64}, "(other weights: views)"), (None, "were not recorded")):
        found = indexing(weights)
        assert told in page({"indexing": found}, SHIPPED)
        assert stale(entry, found, SHIPPED)
    found = indexing(SHIPPED)
    shown = page({"indexing": found}, SHIPPED)
    assert "other weights:" not in shown
    assert "not recorded" not in shown
    assert not stale(entry, found, SHIPPED)
    assert stale(entry, None, SHIPPED)


def test_a_table_states_command_scenes_seed_weights_and_what_was_chosen_on_it():
    shown = page({"indexing": indexing(SHIPPED)}, SHIPPED)
    for told in (
        COMMANDS["indexing"].command, "1 scene (house:1)", "seed 3", "pixels aaaaaaaaaaaa", "| 45.0 | 35.6 to 54.8 |",
        "Chosen on the same data: the weight by distance.",
    ):  # fmt: skip
        assert told in shown


def test_the_readme_takes_the_row_the_count_and_the_interval():
    assert "| **45.0 %** of 100 within 0.5 m (35.6 to 54.8) |" in readme_table({"indexing": indexing(SHIPPED)})


@pytest.mark.parametrize("entry", [entry for entry in ENTRIES if entry.is_suite], ids=lambda entry: entry.name)
def test_every_command_of_the_page_is_one_that_the_command_line_reads(entry):
    import tyro

    from avlmaps.cli.usage import CONFIG
    from avlmaps_sim.verbs.bench import Bench

    bench = tyro.cli(Bench, args=shlex.split(entry.command)[2:], config=CONFIG)
    if bench.suite == "indexing":
        assert bench.indexing_settings().sizes is not None
    if bench.suite == "navigation":
        assert bench.navigation_settings().sequences == 200


def test_no_figure_names_a_place_of_a_machine():
    content = (ROOT / "docs" / "benchmarks.json").read_text(encoding="utf-8")
    assert not re.search(r'"(?:/|[A-Z]:\\\\|~/)', content)


def test_the_figures_are_plain_json_of_one_spelling():
    path = ROOT / "docs" / "benchmarks.json"
    assert path.read_text(encoding="utf-8") == json.dumps(MEASURED, indent=1, ensure_ascii=False) + "\n"
