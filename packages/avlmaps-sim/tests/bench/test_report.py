"""docs/benchmarks.md and the README's table follow from docs/benchmarks.json, and say what is outdated."""

import json
import re
import shlex
import sys
from pathlib import Path

import pytest

from avlmaps_sim.bench.harness.settings import shipped_checksums

ROOT = Path(__file__).resolve().parents[4]
sys.path.insert(0, str(ROOT / "benchmarks"))

from page import (  # noqa: E402 - benchmarks is not a package
    BEGIN,
    END,
    ENTRIES,
    NOT_YET,
    PAGE,
    README,
    README_ROWS,
    Entry,
    page,
    pooled,
    read_figures,
    readme_table,
    shown,
    stale,
    with_figures,
)

MEASURED = read_figures()
COMMANDS = {entry.name: entry for entry in ENTRIES}


def test_the_page_is_what_the_figures_make():
    assert PAGE.read_text(encoding="utf-8") == page(MEASURED, shipped_checksums()), "python benchmarks/report.py --page"


def test_the_readme_shows_the_figures_that_were_measured_with_the_weights_that_ship():
    readme = README.read_text(encoding="utf-8")
    assert readme == with_figures(readme, readme_table(MEASURED)), "python benchmarks/report.py --page"
    assert not [name for name in README_ROWS if stale(COMMANDS[name], MEASURED.get(name), shipped_checksums())]


def sizes_of(entry: Entry) -> set[str]:
    return {entry.command, f"{entry.command} {entry.whole}"} if entry.whole else {entry.command}


def test_a_figure_typed_into_the_readme_by_hand_is_noticed():
    readme = README.read_text(encoding="utf-8")
    begin = readme.index(BEGIN) + len(BEGIN)
    forged = readme[:begin] + readme[begin:].replace("measured", "guessed", 1)
    assert forged != with_figures(forged, readme_table(MEASURED))


def test_a_readme_without_markers_is_refused():
    with pytest.raises(ValueError, match="lacks"):
        with_figures("# readme", "| a |")
    assert with_figures(f"a\n{BEGIN}\nold\n{END}\nb", "new") == f"a\n{BEGIN}\nnew\n{END}\nb"


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_every_row_of_what_was_measured_has_its_figure(entry):
    for figure in entry.figures:
        assert (shown(figure, MEASURED.get(entry.name)) == NOT_YET) == (entry.name not in MEASURED), figure.label


def test_sealed_rounds_are_added_up_whole_and_after_the_fourth():
    columns = ["list", "sentences", "right", "harmless", "asked back", "misread", "dangers driven"]
    early = [[f"{name} four, commands", 5, "1 (x)", "", "", "0 (x)", "-"] for name in ("first", "2", "3", "fourth")]
    late = [
        ["fifth, commands", 10, "8 (x)", "", "", "2 (x)", "1 of 3"],
        ["fifth, questions", 10, "0 (x)", "", "", "9 (x)", "-"],
        ["sixth, commands", 10, "9 (x)", "", "", "0 (x)", "0 of 4"],
    ]
    told = pooled({"columns": columns, "rows": [["child, commands", 9, "9 (x)", "", "", "0 (x)", "-"], *early, *late]})
    assert told[2] == "right 21 of 40 (52.5 %), after round 4 17 of 20 (85.0 %)"
    assert (told[5].split(",")[0], told[6]) == ("misread 2 of 40 (5.0 %)", "dangers driven 1 of 7")


def test_what_was_measured_is_known_by_an_entry_and_by_its_own_command():
    for name, found in MEASURED.items():
        assert found["command"] in sizes_of(COMMANDS[name])
        assert ("answer" in found) == COMMANDS[name].is_suite


def indexing(weights: dict[str, str] | None) -> dict[str, object]:
    columns, ours = ["configuration", "tasks", "R@1 < 0.5 m %", "95 %"], "+ sparse view map (ours)"
    rows = [["chance: one of them", 100, 30.0, ""], ["object only", 100, 20.0, "13 to 29"]]
    rows += [[ours, 100, 45.0, "35.6 to 54.8"], [f"{ours}, by the centre", 100, 40.0, "31 to 50"]]
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


def test_a_row_of_other_weights_says_so_and_is_run_again():
    entry = COMMANDS["indexing"]
    for weights, told in (({**SHIPPED, "views": "c" * 64}, "| older, 2"), (None, "| not recorded, 2")):
        found = indexing(weights)
        assert told in page({"indexing": found}, SHIPPED)
        assert stale(entry, found, SHIPPED)
    found = indexing(SHIPPED)
    row = "| **45.0 %** of 100 within 0.5 m (35.6 to 54.8); object only 20.0, chance 30.0; "
    row += "to its centre 40.0 | shipped, 2026-11-22, 1 home | `avlmaps bench indexing` |"
    assert row in page({"indexing": found}, SHIPPED)
    assert not stale(entry, found, SHIPPED)
    assert stale(entry, None, SHIPPED)


@pytest.mark.parametrize("entry", [entry for entry in ENTRIES if entry.is_suite], ids=lambda entry: entry.name)
def test_every_command_of_the_page_is_one_that_the_command_line_reads(entry):
    import tyro

    from avlmaps.cli.verbs import CONFIG
    from avlmaps_sim.verbs.bench import Bench

    read = [tyro.cli(Bench, args=shlex.split(words)[2:], config=CONFIG) for words in sizes_of(entry)]
    assert {bench.suite for bench in read} == {entry.command.split()[2]}
    if entry.name == "navigation":
        assert max(bench.navigation_settings().sequences for bench in read) == 200


def test_no_figure_names_a_place_of_a_machine():
    content = (ROOT / "docs" / "benchmarks.json").read_text(encoding="utf-8")
    assert not re.search(r'"(?:/|[A-Z]:\\\\|~/)', content)


def test_the_figures_are_plain_json_of_one_spelling():
    path = ROOT / "docs" / "benchmarks.json"
    assert path.read_text(encoding="utf-8") == json.dumps(MEASURED, indent=1, ensure_ascii=False) + "\n"
