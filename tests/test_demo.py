"""The demonstration does the whole job, twice into the same folder, and leaves other folders alone."""

import json
from pathlib import Path

import pytest

from avlmaps.cli import main
from avlmaps.core.errors import MapError
from avlmaps.demo import run_demo


@pytest.mark.slow
def test_the_demonstration_answers_all_of_its_questions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "demo").mkdir()
    with pytest.raises(SystemExit) as stop:
        main(["demo", "--out", str(tmp_path / "demo"), "--json"])
    assert stop.value.code == 0
    told = json.loads(capsys.readouterr().out)
    assert [question["right"] for question in told["questions"]] == [True] * 6, told["questions"]
    assert told["photo_error"]["cm"] < 5.0
    page = (tmp_path / "demo" / "report.html").read_text(encoding="utf-8")
    assert "http" not in page.replace("https://www.w3.org", "")
    for number in range(1, 7):
        assert f"question_{number}.png" in page
        assert (tmp_path / "demo" / f"question_{number}.png").is_file()


def test_a_folder_that_holds_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(MapError, match="holds something else than a demonstration"):
        run_demo(tmp_path)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"
