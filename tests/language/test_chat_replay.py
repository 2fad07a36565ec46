"""A recorded run is repeated from its file, without a model, a key or the client; a change is named."""

import json
from pathlib import Path
from typing import Any

import pytest

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat.answer import ModelReply
from avlmaps.language.chat.replay import ChatRequest, Message, Replay

TURN = ModelReply("robot.turn(90)", tokens=(3, 4), model="served")


def _request(asked: str = "Command: “turn”", prompt: str = "You write.", **changes: Any) -> ChatRequest:
    messages = (Message("system", prompt), Message("user", asked))
    return ChatRequest(
        **{"model": "m", "messages": messages, "temperature": 0.0, "seed": 0, "max_tokens": 9, **changes}
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "chat.jsonl"


def _recorded(path: Path, *exchanges: tuple[ChatRequest, ModelReply]) -> Replay:
    recording = Replay(path)
    assert recording.recording
    for request, answer in exchanges:
        recording.add(request, answer)
    replay = Replay(path)
    assert not replay.recording
    return replay


def test_what_was_recorded_is_answered(path: Path) -> None:
    other = ModelReply("", refusal="No.\n\x1b", finish=None, tool_calls=2)
    replay = _recorded(path, (_request(), TURN), (_request("other"), other))
    assert replay.answer(_request("other")) == other
    assert replay.answer(_request()) == TURN
    assert replay.answer(_request()) == TURN
    assert replay.model == "m"


def test_what_was_asked_twice_is_answered_in_order(path: Path) -> None:
    replay = _recorded(path, (_request(), TURN), (_request(), ModelReply("second")))
    assert [replay.answer(_request()).content for _ in range(3)] == [TURN.content, "second", "second"]


@pytest.mark.parametrize(
    ("request_", "why"),
    [
        (_request("Command: “go”"), "nothing like “Command: “go”” was requested when it was recorded"),
        (_request(model="n"), "it was recorded with the model 'm', not 'n'"),
        (_request(prompt="You draw."), "the prompt, the conversation,"),
        (_request(temperature=0.5), "the seed or the most tokens have changed"),
        (_request(seed=None), "the seed or the most tokens have changed"),
        (_request(max_tokens=10), "the seed or the most tokens have changed"),
    ],
)
def test_what_was_not_recorded_is_refused_and_the_difference_named(path: Path, request_: ChatRequest, why: str) -> None:
    replay = _recorded(path, (_request(), TURN))
    with pytest.raises(LanguageError) as told:
        replay.answer(request_)
    assert why in str(told.value)
    assert "delete the file to record it again" in str(told.value)


def test_an_earlier_turn_of_the_conversation_counts(path: Path) -> None:
    replay = _recorded(path, (_request(), TURN))
    longer = (Message("system", "You write."), Message("assistant", "x"), Message("user", "Command: “turn”"))
    with pytest.raises(LanguageError, match="the conversation, the temperature"):
        replay.answer(_request(messages=longer))


def test_a_torn_last_line_is_left_out(path: Path) -> None:
    _recorded(path, (_request(), TURN), (_request("other"), TURN))
    whole = path.read_bytes()
    second = whole.index(b"\n") + 1
    for length in (second, second + 1, len(whole) - 1):
        path.write_bytes(whole[:length])
        replay = Replay(path)
        assert replay.answer(_request()) == TURN
        with pytest.raises(LanguageError, match="nothing like “other”"):
            replay.answer(_request("other"))


def test_an_empty_file_is_no_recording(path: Path) -> None:
    path.write_bytes(b"")
    with pytest.raises(LanguageError, match="the file is empty; delete the file"):
        Replay(path).answer(_request())


@pytest.mark.parametrize("line", [b"{}", b"[]", b"robot.turn(90)", b"\xff\xfe", b"[" * 100_000, b'{"version": 1}'])
def test_a_file_of_anything_else_is_named_by_its_line(path: Path, line: bytes) -> None:
    _recorded(path, (_request(), TURN))
    path.write_bytes(path.read_bytes() + line + b"\n")
    with pytest.raises(LanguageError, match=r"Line 2 of the replay file .*chat\.jsonl is not a recorded exchange"):
        Replay(path)


def test_a_file_that_cannot_be_made_or_read_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "missing" / "chat.jsonl", tmp_path):
        with pytest.raises(LanguageError, match=r"The replay file .* cannot be opened \(.*\); give another"):
            Replay(path)


def test_a_file_that_cannot_be_written_is_named(path: Path) -> None:
    recording = Replay(path)
    path.mkdir()
    with pytest.raises(LanguageError, match=r"cannot be written"):
        recording.add(_request(), TURN)


def test_a_line_can_be_read_by_a_person_and_is_whole(path: Path) -> None:
    _recorded(path, (_request("Küche\n\u2028"), TURN))
    assert path.read_bytes().count(b"\n") == 1
    line = json.loads(path.read_text(encoding="utf-8"))
    assert line["asked"] == "Küche\n\u2028"
    assert line["answer"]["content"] == "robot.turn(90)"
