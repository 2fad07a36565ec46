"""Under --json every error is one JSON object on standard output; scripts need not read sentences."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from avlmaps.cli.build import Build
from avlmaps.cli.go import Go
from avlmaps.cli.verbs import installed, read_verb
from avlmaps.core.progress import NOTICE

ERRORS = (
    (("demo", "--out", "FILE/below"), 1, "system", ""),
    (("record", "--scene", "house:seven", "--out", "OUT"), 1, "scene", ""),
    (("record", "--scene", "house:7", "--out", "OUT", "--size", "x"), 2, "usage", ""),
    (("add-sounds", "REC", "--clips", "nowhere", "--out", "OUT"), 1, "audio", "nowhere"),
    (("calibrate", "REC", "--out", "OUT"), 1, "recording", ""),
    (("build", "nowhere", "--out", "OUT"), 1, "recording", "There is nothing at nowhere"),
    (("import-map", "nowhere", "--out", "OUT"), 1, "map", ""),
    (("info", "nowhere"), 1, "recording", "nowhere"),
    (("query", "nowhere.avlmap", "the chair"), 1, "map", "nowhere.avlmap"),
    (("query", "MAP", "near near"), 1, "query", "A map cannot answer this"),
    (("query", "MAP"), 2, "usage", "takes a sentence, or parts"),
    (("query", "MAP", "--object", "red", "--plot", "x.doc"), 1, "query", ""),
    (("locate", "MAP", "nothing.png"), 1, "query", "nothing.png"),
    (("live", "--out", "OUT"), 2, "usage", ""),
    (("live", "REC", "--out", "OUT", "--source", "ros2"), 2, "usage", ""),
    (("live", "REC", "--out", "OUT", "--topics", "rgb=/rgb"), 1, "recording", ""),
    (("merge", "nowhere.avlmap", "MAP", "--out", "OUT"), 1, "map", ""),
    (("changes", "nowhere.avlmap"), 1, "map", ""),
    (("edit", "nowhere.avlmap"), 1, "map", ""),
    (("edit", "MAP", "--rename", "unicorn", "--to", "horse"), 1, "query", ""),
    (("edit", "MAP", "--pin", "dock"), 2, "usage", ""),
    (("edit", "MAP", "--forbid", "x", "--box", "1,2,3"), 1, "query", ""),
    (("sources", "nowhere.avlmap"), 1, "map", ""),
    (("sources", "MAP"), 1, "query", ""),
    (("go", "nowhere.avlmap", "go to the chair", "--scene", "house:7"), 1, "map", ""),
    (("things", "nowhere.avlmap"), 1, "map", ""),
    (("rooms", "nowhere.avlmap"), 1, "map", ""),
    (("shell", "nowhere.avlmap"), 1, "map", ""),
    (("serve", "nowhere.avlmap"), 1, "map", ""),
    (("view", "nowhere.avlmap"), 1, "map", ""),
    (("view", "MAP", "--host", "no.such.host.invalid", "--no-browser"), 1, "serve", ""),
    (("view", "MAP", "--questions", "the chair"), 2, "usage", ""),
    (("view", "MAP", "--out", "OUT.txt"), 2, "usage", ""),
    (("view", "MAP", "--out", "OUT.html", "--questions", "near near"), 1, "query", ""),
    (("export", "nowhere.avlmap", "--out", "OUT.ply"), 1, "map", ""),
    (("teach-sound", "x"), 2, "usage", "takes clips to learn from, or --forget"),
    (("teach-sound", "x", "nothing.wav"), 1, "audio", ""),
    (("profiles", "--nonsense"), 2, "usage", ""),
    (("bench", "sounds"), 1, "bench", "name it with --sounds"),
    (("query", "MAP", "the chair", "--object", "red"), 2, "usage", "and not both"),
    (("query", "MAP", "--object", "red", "--top", "0"), 2, "usage", "--top takes a number from 1 on, not 0"),
    (("query", "MAP", "--object", "red", "--intrinsics", "1,2,3,4"), 2, "usage", "Intrinsics belong to a photo"),
    (("query", "MAP", "the chair", "--near", "here"), 2, "usage", "A place is x,y"),
    (("query", "MAP", "--object", "chair"), 1, "query", "understands nothing of 'chair'"),
    (("query", "MAP", "--area", "kitchen"), 1, "backend", "has no views backend"),
    (("query", "MAP", "--sound-clip", "nothing.wav"), 1, "query", "nothing.wav"),
    (("info", "REC", "--plot", "x.png"), 2, "usage", "--plot draws a map"),
    (("build", "REC", "--out", "OUT", "--voxel-size-m", "0"), 2, "usage", "takes a number from 0.001 to 10"),
    (("build", "REC", "--out", "OUT", "--rules", "paper", "--sensor", "kinect"), 2, "usage", "every depth as it is"),
    (("build", "REC", "--out", "OUT", "--format", "tum"), 1, "recording", "rgb.txt"),
    (("build", "REC", "--out", "OUT", "--audio", "nothing.wav"), 1, "audio", "nothing.wav"),
    (("bench", "indexing", "--out", "OUT", "--scenes", "house:1", "--sounds", "nowhere"), 1, "audio", "nowhere"),
)


@pytest.mark.parametrize(
    ("words", "status", "kind", "says"),
    ERRORS,
    ids=lambda value: " ".join(map(str, value))[:40] if isinstance(value, tuple) else "",
)
def test_an_error_is_one_json_object(words, status, kind, says, built: Path, walk: Path, run, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    places = {"MAP": built, "REC": walk, "OUT": tmp_path / "out", "FILE/below": tmp_path / "file" / "below"}
    places |= {"OUT.html": tmp_path / "page.html", "MAP/map.json": built / "map.json"}
    code, out, err = run(*[places.get(word, word) for word in words], "--json")
    assert code == status
    said = json.loads(out)
    assert out.count("\n") == 1
    assert said.keys() - {"ok", "choices"} == {"error"} and said["error"].keys() == {"kind", "message"}
    assert said["error"]["kind"] == kind
    message = said["error"]["message"]
    assert message and says in message and "\n" not in message and not message.startswith("avlmaps:")
    if status == 1:
        assert err.rstrip("\n").split("\n")[-1] == f"avlmaps: {message}", "people read the same sentence"


def test_every_verb_is_among_them() -> None:
    assert {words[0] for words, *_ in ERRORS} == set(installed()[0])


def test_a_command_line_that_cannot_be_read_says_what_is_wrong(run) -> None:
    for words, told in (
        (("query",), "Missing from avlmaps query: MAP"),
        (("edit", "MAP", "--undo"), "Missing value for argument '--undo'"),
        (("go", "MAP", "x", "--language", "x"), "invalid choice 'x' for argument '--language'. Expected one of"),
        (("build", "x", "--out", "y", "--voxel-size-m", "abc"), "--voxel-size-m"),
        ((), "a verb comes first: demo"),
    ):
        code, out, err = run(*words, "--json")
        assert code == 2
        message = json.loads(out)["error"]["message"]
        assert told in message and err.splitlines()[0] == f"avlmaps: {message}"
        assert err.splitlines()[1].startswith("For all of it: avlmaps ") and err.count("\n") == 2


def test_a_sentence_without_a_map_or_without_quotes_is_told_so(built: Path, run) -> None:
    for words, told in (
        (("query", "the sofa"), "the map comes first: avlmaps query MAP 'the sofa'"),
        (("query", built, "the", "red", "sofa"), f"put the sentence in quotes: avlmaps query {built} 'the red sofa'"),
        (
            ("query", built, "the", "sofa", "--top", "2"),
            f"put the sentence in quotes: avlmaps query {built} 'the sofa' --top 2",
        ),
        (("go", "the sofa"), "the map comes first, and there is none at 'the sofa'"),
    ):
        status, out, err = run(*words)
        assert (status, out) == (2, "") and told in err


def test_profiles_fit_a_terminal_of_80_columns(run) -> None:
    assert max(map(len, run("profiles")[1].splitlines())) <= 80


def test_help_and_what_stands_behind_two_dashes_are_no_errors(run) -> None:
    assert run("query", "--json", "--help")[0] == 0
    assert run("query", "MAP", "--", "--json")[1] == "", "words behind -- are no options"


def test_a_fault_of_ours_is_json_with_its_traceback_on_standard_error(
    built: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from avlmaps.cli import main

    monkeypatch.setattr("avlmaps.cli.info.describe_path", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["info", str(built), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert said["error"]["kind"] == "zero-division"
    assert "division by zero; this is a fault of avlmaps" in said["error"]["message"]


@pytest.mark.nightly
def test_a_cold_cache_is_announced_once_and_a_warm_one_not(tmp_path: Path) -> None:
    code = (
        "import numpy as np\n"
        "from avlmaps.core.progress import announce_compiling\n"
        "from avlmaps.maps.fusion.kernels import find_rows\n"
        "none = np.zeros((0, 3), np.int32)\n"
        "with announce_compiling():\n"
        "    for enter in (False, 1):\n"
        "        find_rows(none, none[:, 0], none, 0, enter, none[:, 0])\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    told = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment).stderr
        for _ in range(2)
    ]
    assert told == [f"{NOTICE}\n", ""]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("qurey", "MAP", "sofa"), "there is no verb 'qurey'; did you mean query?"),
        (("zzz",), "there is no verb 'zzz'. The verbs: demo"),
        (("query", "MAP", "sofa", "--tpo", "3"), "there is no option --tpo; did you mean --top?"),
        (("go", "MAP", "sofa", "--chat_modl", "x"), "did you mean --chat-model?"),
        (("build", "REC", "--out", "M", "--voxel-sise-m=0.1"), "did you mean --voxel-size-m?"),
        (("query", "MAP", "sofa", "--primary", "objct"), "invalid choice 'objct'"),
    ],
)
def test_a_misspelt_verb_option_or_value_is_answered_with_what_was_probably_meant(run, words, said: str) -> None:
    code, out, err = run(*words)
    assert code == 2 and out == ""
    assert err.startswith("avlmaps: ") and said in err and "--help" in err
    code, out, _ = run(*words, "--json")
    assert code == 2 and said in json.loads(out)["error"]["message"]


def test_a_misspelt_map_or_recording_is_answered_with_the_one_beside(built: Path, walk: Path, run) -> None:
    for words in (("query", built.with_name("rom.avlmap"), "red"), ("things", built.with_name("ROOM.avlmp"))):
        assert f"did you mean {built}?" in run(*words)[2]
    assert f"did you mean {walk}?" in run("build", walk.with_name("recc"), "--out", walk.parent / "o.avlmap")[2]
    code, _, err = run("query", "the red thing", built)
    assert code == 2 and f"avlmaps query {built} 'the red thing'" in err
    assert "avlmaps go" in run("go", "turn left", built, "--dry-run")[2]
    assert "Did you mean colours?" in run("build", walk, "--out", walk.parent / "o.avlmap", "--profile", "colors")[2]


def test_the_tilde_of_every_path_is_the_users_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    go = read_verb(Go, ["~/m.avlmap", "~ is no path", "--plot=~/way.png", "--chat-replay=~/said.jsonl"], "go")
    assert (go.map, go.plot, go.chat.chat_replay) == tuple(tmp_path / n for n in ("m.avlmap", "way.png", "said.jsonl"))
    assert go.sentence == "~ is no path"
    made = read_verb(Build, ["~/a", "~/b", "--out=~/m.avlmap"], "build")
    assert (made.recording, made.more) == (tmp_path / "a", (tmp_path / "b",)) and made.out == tmp_path / "m.avlmap"
