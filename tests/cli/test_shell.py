"""`avlmaps shell` from end to end: by a pipe, and at a prompt in a pseudo-terminal."""

import fcntl
import io
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import pytest

from avlmaps.core.extras import install_command
from avlmaps.language.intents import Turn
from avlmaps.language.learned.decision import Weighed
from helpers.raycast import render
from helpers.room import Room
from helpers.walked_room import CAMERA

from .test_go import scene_of


@pytest.fixture
def piped(run, monkeypatch: pytest.MonkeyPatch) -> Callable[..., tuple[int, str, str]]:
    """Run the shell over lines in this process."""

    def call(lines: str | bytes, *words: object) -> tuple[int, str, str]:
        content = lines.encode() if isinstance(lines, str) else lines
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(content), encoding="utf-8"))
        return run("shell", *words)

    return call


def objects(out: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in out.splitlines()]


def without_times(answer: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in answer.items() if key not in ("elapsed_ms", "elapsed_s")}


def test_each_verb_answers_as_on_the_command_line(piped, answer, built: Path, tmp_path: Path) -> None:
    photo = tmp_path / "a photo.jpg"
    view = render(Room().scene, CAMERA, Room().walk()[100])
    cv2.imwrite(str(photo), cv2.cvtColor(view.rgb, cv2.COLOR_RGB2BGR))
    alike = {
        "the red cabinet": ("query", built, "the red cabinet"),
        "query --object red --top 1": ("query", built, "--object", "red", "--top", "1"),
        "query the red cabinet": ("query", built, "the red cabinet"),
        "things --least 0.2": ("things", built, "--least", "0.2"),
        f"locate '{photo}'": ("locate", built, photo),
        "info": ("info", built),
        "go to a red thing, then turn left": ("go", built, "go to a red thing, then turn left", "--dry-run"),
    }
    status, out, err = piped("\n".join(alike), built, "--json")
    assert status == 0, err
    said = objects(out)
    assert len(said) == len(alike)
    for one, words in zip(said, alike.values(), strict=True):
        assert without_times(one) == without_times(answer(*words))


def test_an_error_is_one_sentence_and_the_next_line_is_answered(piped, built: Path) -> None:
    lines = ["the blorfle", 'query --object "red', "locate missing.jpg", "sounds --loud", "things --least two"]
    lines.append("the red thing")
    status, out, err = piped("\n".join(lines), built, "--json")
    assert status == 1
    said = objects(out)
    assert [one["error"]["kind"] for one in said[:-1]] == ["query", "usage", "query", "usage", "usage"]
    assert said[-1]["found"] is True
    sentences = [line for line in err.splitlines() if line.startswith("avlmaps: ")]
    assert sentences[-1] == "avlmaps: 5 of 6 lines failed."
    assert [f"avlmaps: {one['error']['message']}" for one in said[:-1]] == sentences[:-1]
    assert "Traceback" not in err


def test_a_line_that_begins_like_a_verb_may_be_a_question(piped, built: Path) -> None:
    status, out, _ = piped("locate the red cabinet\nwhere is the red thing\n", built, "--json")
    assert status == 0 and all(one["parts"][0]["modality"] == "object" for one in objects(out))


def test_plot_draws_the_map_and_then_the_last_answer(piped, built: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "map.png", tmp_path / "heat.png"
    status, out, _ = piped(f"plot {first}\nthe red cabinet\nplot {second}\nplot\n", built, "--json")
    assert status == 1
    said = objects(out)
    assert [said[0], said[2]] == [{"plot": str(first)}, {"plot": str(second)}]
    assert "plot takes the name" in said[3]["error"]["message"]
    assert first.read_bytes() != second.read_bytes()
    assert min(first.stat().st_size, second.stat().st_size) > 5000


def test_a_plan_is_driven_only_when_it_is_confirmed(piped, built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps_sim.scenes.open_scene", lambda spec: scene_of(Room()))
    lines = "go turn left\nn\ngo turn left\nthe red thing\ngo turn left\ny\ngo turn right\nyes\ngo blorfle\n"
    status, out, err = piped(lines, built, "--json", "--scene", "room", "--start", "4.4,3.2,90")
    assert status == 1
    said = objects(out)
    assert len(said) == 6 and said[0]["steps"] == said[1]["steps"] == []
    assert said[2]["found"] is True, "a line that is not an answer to the question is the next line"
    left, right = said[3]["steps"][0]["result"], said[4]["steps"][0]["result"]
    assert left["heading_rad"] == pytest.approx(3.14, abs=0.1)
    assert right["heading_rad"] == pytest.approx(1.57, abs=0.1), "the robot stays where it stopped"
    assert "error" in said[5] and err.count("Drive this plan?") == 4
    assert "I will turn left 90 degrees." in err


@pytest.mark.parametrize("answer", ["yes", "1"])
def test_yes_or_a_number_answers_a_question_back(
    piped, built: Path, monkeypatch: pytest.MonkeyPatch, answer: str
) -> None:
    readings = (Weighed((Turn(-90.0),), 0.4),)
    monkeypatch.setattr("avlmaps.language.commands.weighed_readings", lambda *_: readings)
    _, out, err = piped(f"go left or so\n2\n{answer}\n", built)
    assert "If so: 1." in err and "Choose a number, 1 to 1" in err
    assert "I will turn left 90 degrees." in out
    assert "cannot answer" in piped(f"go left or so\nthe red thing\n{answer}\n", built)[2]  # the question is over


def test_without_a_scene_nothing_is_driven(piped, built: Path) -> None:
    status, out, err = piped("go to the nearest red thing\ny\n", built)
    assert status == 1, "y is not a question"
    assert "robot.move_to_object" in out and "planned only" in out
    assert "Drive this plan" not in err


class Terminal:
    """A shell at a prompt in a pseudo-terminal."""

    def __init__(self, *words: object, state: Path, **environment: str) -> None:
        main, side = pty.openpty()
        here = {**os.environ, "TERM": "xterm", "PROMPT_TOOLKIT_NO_CPR": "1", "XDG_STATE_HOME": str(state)}
        code = environment.pop("code", "from avlmaps.cli import main; main()")
        self.process = subprocess.Popen(
            [sys.executable, "-c", code, "shell", *map(str, words)],
            stdin=side, stdout=side, stderr=side, env=here | environment, start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )  # fmt: skip
        os.close(side)
        self.main, self.said = main, ""

    def until(self, pattern: str, within_s: float = 60.0) -> str:
        """Read until a pattern comes; return what was said since the last call."""
        end = time.monotonic() + within_s
        while not (found := re.search(pattern, self.said)):
            ready, _, _ = select.select([self.main], [], [], max(0.0, end - time.monotonic()))
            try:
                content = os.read(self.main, 65536) if ready else b""
            except OSError:  # the other side is closed
                content = b""
            if not content:
                raise AssertionError(f"{pattern!r} did not come: {self.said[-2000:]!r}")
            self.said = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", self.said + content.decode(errors="replace"))
        said, self.said = self.said[: found.end()], self.said[found.end() :]
        return said

    def type(self, text: str) -> None:
        os.write(self.main, text.encode())

    def ended(self) -> int:
        status = self.process.wait(60.0)
        os.close(self.main)
        return status


@pytest.fixture
def terminals() -> Iterator[list[Terminal]]:
    opened: list[Terminal] = []
    yield opened
    for one in opened:
        if one.process.poll() is None:
            one.process.send_signal(signal.SIGKILL)
            one.process.wait()


def test_at_a_prompt_questions_completion_history_and_the_end(built: Path, tmp_path: Path, terminals) -> None:
    shell = Terminal(built, state=tmp_path)
    terminals.append(shell)
    shell.until("avlmaps>")
    shell.type("the blorfle\r")
    assert "Traceback" not in shell.until("avlmaps: .*\n")
    shell.until("avlmaps>")
    shell.type("the turquo")
    shell.until("turquoise")  # the menu
    shell.type("\t cabinet\r")
    shell.until("query: object 'turquoise cabinet'")
    shell.until("avlmaps>")
    shell.type("\x1b[A")  # up: the last question again
    shell.until("turquoise cabinet")
    shell.type("\r")
    shell.until("query: object 'turquoise cabinet'")
    shell.until("avlmaps>")
    shell.type("\x04")
    assert shell.ended() == 0
    history = tmp_path / "avlmaps" / "shell_history"
    assert history.read_text(encoding="utf-8").count("+the turquoise cabinet") == 1
    assert history.stat().st_mode & 0o077 == 0


@pytest.mark.nightly
def test_ctrl_c_stops_an_answer_and_not_the_shell(built: Path, tmp_path: Path, terminals) -> None:
    slow = (
        "import sys, time\nfrom avlmaps.cli.query import Query\nreal = Query.answer\n"
        "def ask(verb, avlmap):\n"
        "    if 'slow' in verb.sentence:\n        print('begun', flush=True); time.sleep(60)\n"
        "    return real(verb, avlmap)\n"
        "Query.answer = ask\nfrom avlmaps.cli import main\nmain()"
    )
    shell = Terminal(built, "--no-history", state=tmp_path, code=slow)
    terminals.append(shell)
    shell.until("avlmaps>")
    shell.type("a slow question\r")
    shell.until("begun")
    shell.type("\x03")
    shell.until("stopped")
    shell.type("the red thing\r")
    shell.until(r"\nfound")
    shell.type("quit\r")
    assert shell.ended() == 0 and not (tmp_path / "avlmaps").exists()


@pytest.mark.nightly
def test_without_prompt_toolkit_a_terminal_gets_one_sentence_and_a_pipe_works(
    piped, built: Path, tmp_path: Path, terminals
) -> None:
    without = "import sys\nsys.modules['prompt_toolkit'] = None\nfrom avlmaps.cli import main\nmain()"
    shell = Terminal(built, state=tmp_path, code=without)
    terminals.append(shell)
    shell.until(re.escape(install_command("shell")))
    assert shell.ended() == 1
    command = [sys.executable, "-c", without, "shell", str(built)]
    done = subprocess.run(command, input="the red cabinet\n", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "found" in done.stdout
