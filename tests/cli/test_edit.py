"""`avlmaps edit` from end to end: the edits hold in every front, and in another build of the map."""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from avlmaps.maps.store.edits import EDITS, Edit, EditedSpot, append_edit, read_edits
from avlmaps.query.avlmap import AVLMap
from avlmaps.view.labels import MapOnPage


@pytest.fixture
def home(built: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(built, tmp_path / "home.avlmap"))


def test_a_name_holds_in_every_front_until_it_is_undone(home: Path, run, tmp_path: Path) -> None:
    assert run("edit", home)[1] == "nobody has edited this map\n"
    things = json.loads(run("things", home, "--json", "--least", "0.2")[1])["things"]
    first = things[0]
    at = ",".join(str(value) for value in first["position"])
    status, out, _ = run("edit", home, "--rename", first["name"], "--at", at, "--to", "zorb", "--by", "Anna")
    assert status == 0 and out.startswith(f"The {first['name']} at (")
    assert " m is called zorb from now on (named by Anna on " in out
    assert run("edit", home, "--pin", "my pad", "--at", "0.5,0.5,0.1")[0] == 0
    answer = json.loads(run("query", home, "where is the zorb?", "--json")[1])
    assert answer["found"] and any(note.startswith("The zorb was named by Anna on ") for note in answer["notes"])
    listed = json.loads(run("things", home, "--json")[1])["things"]
    assert {"zorb", "my pad"} <= {one["name"] for one in listed}
    assert run("things", home, "--name", "zorb", "--csv", tmp_path / "things.csv")[0] == 0
    assert "zorb" in (tmp_path / "things.csv").read_text()
    page = MapOnPage(AVLMap.open(home))
    assert {"zorb", "my pad"} <= {one["name"] for one in page.describe_contents()["things"]}
    assert run("export", home, "--out", tmp_path / "floor.pgm")[0] == 0
    rows = json.loads(run("edit", home, "--list", "--json")[1])["edits"]
    assert [(row["does"], row["name"], row["state"]) for row in rows] == [
        ("rename", "zorb", "applied"), ("pin", "my pad", "applied"),
    ]  # fmt: skip
    assert run("edit", home, "--undo", rows[0]["id"])[0] == 0 and run("edit", home, "--undo", "last")[0] == 0
    assert json.loads(run("things", home, "--json", "--least", "0.2")[1])["things"] == things


@pytest.mark.nightly
def test_edits_are_there_in_another_build_of_the_map(home: Path, walk: Path, run) -> None:
    assert run("edit", home, "--pin", "my pad", "--at", "0.5,0.5,0.1")[0] == 0
    log = (home / EDITS).read_bytes()
    words = ("build", walk, "--out", home, "--voxel-size-m", "0.2", "--profile", "colours", "--overwrite")
    assert run(*words)[0] == 0 and (home / EDITS).read_bytes() == log
    (row,) = json.loads(run("edit", home, "--list", "--json")[1])["edits"]
    assert row["state"] == "applied" and json.loads(run("query", home, "my pad", "--json")[1])["found"]
    nowhere = EditedSpot(name="sofa", middle=(90.0, 0.0, 0.0), size=(1.0, 1.0, 1.0))
    append_edit(home, Edit.new("rename", [nowhere], name="couch", world=read_edits(home)[0].world))
    told = json.loads(run("info", home, "--json")[1])
    assert told["edits"] == 2
    assert "(rename sofa to couch) finds nothing to apply to: nothing like the sofa is at" in told["notices"][-1]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--rename", "red", "--pin", "x"), "--rename and --pin do not go together"),
        (("--rename", "red"), "rename needs --to"),
        (("--pin", "x", "--at", "1,2", "--to", "y"), "--to says nothing to --pin"),
        (("--at", "1,2"), "--at says nothing to a list of edits"),
        (("--forbid", "x", "--box", "a,b"), "--box takes x0,y0,x1,y1"),
    ],
)
def test_options_that_do_not_fit_are_a_wrong_command_line(home: Path, run, words: tuple[str, ...], why: str) -> None:
    status, _, err = run("edit", home, *words)
    assert status == 2 and why in err
    assert not (home / EDITS).exists()


def test_people_who_edit_at_once_lose_nothing(tmp_path: Path) -> None:
    edits = [Edit.new("pin", [EditedSpot(middle=(float(k), 0.0, 0.0))], name=f"place {k}") for k in range(12)]
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda edit: append_edit(tmp_path, edit), edits))
    assert sorted(edit.name for edit in read_edits(tmp_path)) == sorted(edit.name for edit in edits)
    assert not list(tmp_path.glob("*.part*"))
