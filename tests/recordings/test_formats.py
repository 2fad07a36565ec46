"""Every reader is held to one truth, written in its format; and to a plain sentence for each damaged file."""

from pathlib import Path

import pytest

from avlmaps.recordings.conformance import check, check_damage
from avlmaps.recordings.corrections import Corrections, corrected
from avlmaps.recordings.formats.tables import on_clock_of
from avlmaps.recordings.open import FORMATS, find_format, open_recording
from avlmaps.recordings.types import Subset
from helpers.format_writers import START_S, WRITTEN


@pytest.mark.parametrize("name", WRITTEN)
def test_a_reader_gives_back_the_truth_that_was_written(tmp_path: Path, name: str) -> None:
    written, truth = WRITTEN[name], WRITTEN[name].truth()
    path = written.write(tmp_path / "walk", truth)
    assert find_format(path).name == written.format
    recording = check(lambda: open_recording(path), truth, **(written.options or {}))
    assert recording.format == written.format
    assert (recording.up_in_world is not None) == written.knows_up


@pytest.mark.parametrize("name", ["tum", "rtabmap"])
def test_the_date_of_the_first_frame_is_kept_and_poses_of_a_file_may_have_it(tmp_path: Path, name: str) -> None:
    truth = WRITTEN[name].truth()
    whole = open_recording(WRITTEN[name].write(tmp_path / "walk", truth))
    corrections = Corrections(up_in_world=(0.0, 0.0, 1.0))
    for recording in (whole, Subset(whole, [0, 1]), corrected(whole, corrections)):
        assert recording.begins_s == pytest.approx(START_S + truth.stamps_s[0], abs=1.0)
        for stamps_s in (recording.stamps_s, recording.stamps_s + recording.begins_s):
            assert on_clock_of(stamps_s, recording) == pytest.approx(recording.stamps_s, abs=1e-6)
    assert open_recording(WRITTEN["folder"].write(tmp_path / "folder", truth)).begins_s == 0.0


@pytest.mark.few(5)
@pytest.mark.slow
@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.nightly
def test_a_damaged_file_is_a_sentence_or_fewer_frames(tmp_path: Path, name: str) -> None:
    written = WRITTEN[name]
    path = written.write(tmp_path / "walk", written.truth())
    check_damage(path, lambda copy: open_recording(copy, format=written.format), tmp_path / "damaged")


def test_every_format_has_a_writer_of_the_truth() -> None:
    assert {written.format for written in WRITTEN.values()} | {"rosbag"} == {known.name for known in FORMATS}


def test_the_table_of_the_docs_names_every_format_and_what_is_read_assumed_and_checked() -> None:
    page = (Path(__file__).parents[2] / "docs/recordings.md").read_text()
    table = page[page.index("| format | found by |") :].split("\n\n", 1)[0].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table[2:]]
    assert [row[0].strip("`") for row in rows] == [known.name for known in FORMATS]
    assert all(len(row) == 6 and all(row) for row in rows)
