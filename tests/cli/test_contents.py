"""`avlmaps things` and `avlmaps export`, end to end on a small map."""

from pathlib import Path

import pytest


def test_things_lists_what_the_map_holds(built: Path, answer, tmp_path: Path) -> None:
    listed = answer("things", built, "--least", "0.2", "--csv", tmp_path / "t.csv")
    assert listed["frame"] == "recording"
    assert listed["things"], "the room has colours of some size"
    assert set(listed["things"][0]) == {"name", "confidence", "position", "size", "color", "voxels"}
    assert len(listed["sounds"]) == 1
    assert (tmp_path / "t.csv").read_text().count("\n") == 1 + len(listed["things"]) + 1


def test_things_are_selected_and_paged(built: Path, answer, run, tmp_path: Path) -> None:
    every = answer("things", built, "--least", "0.2")["things"]
    out = run("things", built, "--least", "0.2")[1]
    assert out.startswith("thing ") and "position of the robot" in out
    named = run("things", built, "--least", "0.2", "--name", every[0]["name"])[1]
    assert named.startswith("thing ") and "position of the robot" not in named
    words = ("things", built, "--least", "0.2", "--top", "1")
    first = answer(*words, "--csv", tmp_path / "t.csv")
    assert first["total"] == len(every) == first["pages"] and first["things"] == every[:1]
    assert (tmp_path / "t.csv").read_text().count("\n") == 2
    place = ",".join(map(str, every[0]["position"]))
    nearest = answer(*words, "--near", place)["things"][0]
    assert nearest["position"] == every[0]["position"] and nearest["distance_m"] == 0.0
    level = answer(*words, "--frame", "level")["things"][0]["position"]
    again = answer(*words, "--frame", "level", "--near", ",".join(map(str, level)))["things"][0]
    assert again["distance_m"] == pytest.approx(0.0, abs=1e-3) and again["position"] == pytest.approx(level)
    for wrong, status, says in ((("--page", "9999"), 1, "no page 9999"), (("--top", "0"), 2, "from 1 on")):
        code, _, err = run("things", built, "--least", "0.2", "--top", "1", *wrong)
        assert code == status and says in err, err


def test_rooms_lists_and_draws_rooms(built: Path, answer, run, tmp_path: Path) -> None:
    listed = answer("rooms", built, "--plot", tmp_path / "r.png")
    assert listed["rooms"] == answer("things", built)["rooms"] and Path(listed["plot"]).stat().st_size > 0
    assert answer("rooms", built, "--least", "1")["rooms"] == [
        room for room in listed["rooms"] if room["confidence"] >= 1
    ]
    assert run("rooms", built, "--least", "2")[0] == 2


@pytest.mark.parametrize("name", ["a.ply", "a.glb", "a.csv", "a.pgm", "a.openlex3d"])
def test_export_writes_each_format(built: Path, answer, tmp_path: Path, name: str) -> None:
    written = answer("export", built, "--out", tmp_path / name)
    assert all(Path(file).stat().st_size > 0 for file in written["files"])
    assert written["frame"] == ("level" if name in ("a.pgm", "a.glb") else "recording")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--out", "a.obj"), ".ply, .glb, .pgm, .csv"),
        (("--out", "a.csv", "--things"), "has no colours"),
        (("--out", "a.ply", "--things", "--heat", "red"), "both choose colours"),
        (("--out", "a.mcap", "--things"), "leave --things out"),
        (("--out", "a.openlex3d", "--frame", "level"), "leave --frame out"),
        (("--out", "a.openlex3d", "--heat", "red"), "has no colours"),
    ],
)
def test_export_refuses_what_does_not_fit(built: Path, run, words: tuple[str, ...], says: str) -> None:
    status, _, err = run("export", built, *words)
    assert status == 2 and says in err


def test_export_replaces_nothing_unasked(built: Path, run, tmp_path: Path) -> None:
    assert run("export", built, "--out", tmp_path / "a.csv")[0] == 0
    status, _, err = run("export", built, "--out", tmp_path / "a.csv")
    assert status == 2 and "--overwrite" in err
    assert run("export", built, "--out", tmp_path / "a.csv", "--overwrite")[0] == 0
