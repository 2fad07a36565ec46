"""A chat server is asked as it should be, and each way in which it can fail has one sentence that says what to do.

Everything runs against a real HTTP server on this machine, garbage and hostility included.
"""

import json
import logging
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from chat_server import ChatServer, chat_server, endless, failed, half, hung_up, sent, silent, trickle
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat import endpoint
from avlmaps.language.chat.endpoint import HOSTED_URL, ChatSettings, Endpoint, ModelReply, Replay, quoted

KEY = "sk-test-8c1f0e77a2"


@pytest.fixture
def server() -> Iterator[ChatServer]:
    with chat_server() as running:
        yield running


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """A proxy that leads nowhere, and what the hosted service's client reads, which no other server is to get."""
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "http_proxy", "https_proxy", "all_proxy"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")
    for name in ("NO_PROXY", "no_proxy", "OPENAI_BASE_URL"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OPENAI_API_KEY", "sk-of-another-service")
    monkeypatch.setenv("OPENAI_ORG_ID", "org-of-another-service")
    monkeypatch.setenv("OPENAI_PROJECT_ID", "proj-of-another-service")


def _settings(server: ChatServer, **changes: Any) -> ChatSettings:
    return ChatSettings(**{"base_url": server.url, "timeout_s": 60.0, **changes})


MESSAGES = ({"role": "system", "content": "You write programs."}, {"role": "user", "content": "Command: “go”"})


def _answered(server: ChatServer, **changes: Any) -> ModelReply:
    return Endpoint(_settings(server, **changes)).complete("test-model", MESSAGES)


def _sentence(server: ChatServer, **changes: Any) -> str:
    """Return the sentence of the fault that the server's answer is."""
    with pytest.raises(LanguageError) as told:
        _answered(server, **changes)
    sentence = str(told.value)
    assert "\n" not in sentence and sentence.endswith(".") and len(sentence) < 500
    assert KEY not in sentence
    return sentence


def test_an_answer_comes_back_with_its_counts(server: ChatServer) -> None:
    server.answer("robot.turn(90)")
    answer = _answered(server)
    assert (answer.content, answer.finish, answer.refusal) == ("robot.turn(90)", "stop", None)
    assert (answer.model, answer.tokens) == ("test-model-0101", (1200, 20))


def test_exactly_the_request_is_sent_and_nothing_of_the_environment(server: ChatServer) -> None:
    server.answer("robot.turn(90)")
    _answered(server, seed=7, max_tokens=99, api_key=KEY)
    (asked,) = server.asked
    assert asked.path == "/v1/chat/completions"
    assert asked.body == {
        "model": "test-model",
        "messages": list(MESSAGES),
        "temperature": 0,
        "seed": 7,
        "max_tokens": 99,
    }
    assert asked.headers["authorization"] == f"Bearer {KEY}"
    assert "another-service" not in str(asked)


def test_text_in_parts_and_missing_counts_are_read_all_the_same(server: ChatServer) -> None:
    choice = {"message": {"content": [{"type": "text", "text": "robot."}, {"type": "text", "text": "turn(90)"}]}}
    server.answer(sent(json.dumps({"choices": [choice], "usage": None}).encode()))
    answer = _answered(server)
    assert (answer.content, answer.tokens, answer.finish) == ("robot.turn(90)", (0, 0), None)


@pytest.mark.parametrize(
    "message", [{"content": None, "refusal": "No."}, {"content": [{"type": "refusal", "refusal": "No."}]}]
)
def test_refusals_are_told_apart_from_text(server: ChatServer, message: dict[str, Any]) -> None:
    server.answer(sent(json.dumps({"choices": [{"message": message}]}).encode()))
    answer = _answered(server)
    assert (answer.content, answer.refusal) == ("", "No.")


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"\x00\xff\xfe\x80",
        b"[]",
        b'{"choices": 3}',
        b'{"choices": [{"message": "robot.turn(90)"}]}',
        b"[" * 100_000,
        b'{"choices": [{"message": {"content": "\\ud800"}}]}',
        '{"choices": [{"message": {"content": "Küche"}}]}'.encode("latin-1"),
        b'data: {"choices": []}\n\ndata: [DONE]\n\n',
    ],
)
def test_garbage_is_named_and_never_becomes_a_program(server: ChatServer, raw: bytes) -> None:
    server.answer(sent(raw))
    assert f"{server.url} does not speak the chat protocol" in _sentence(server)
    assert len(server.asked) == 1


def test_an_error_in_the_clothes_of_a_success_is_told(server: ChatServer) -> None:
    server.answer(sent(b'{"error": {"message": "provider is gone"}}'))
    assert "“provider is gone”" in _sentence(server)


@pytest.mark.parametrize("status", [200, 400, 500])
def test_an_answer_without_end_is_not_read_to_its_end(server: ChatServer, status: int) -> None:
    server.answer(endless(status))
    sentence = _sentence(server, retries=0)
    assert ("more than 1024 KiB" if status == 200 else f"HTTP {status}") in sentence


@pytest.mark.parametrize("reply", [silent, trickle(200), trickle(500)])
def test_the_deadline_holds_however_slow_the_answer_is(server: ChatServer, reply: Any) -> None:
    server.answer(reply)
    sentence = _sentence(server, timeout_s=0.4, retries=5)
    assert "no answer within 0.4 s: raise AVLMAPS_CHAT_TIMEOUT_S" in sentence or "HTTP 500" in sentence


@pytest.mark.parametrize("reply", [half(b'{"choices": [{"message": {"content": "robot.tu', 400), hung_up])
def test_a_broken_connection_is_tried_again_and_then_told(server: ChatServer, reply: Any) -> None:
    server.answer(reply)
    assert "broke off in the middle" in _sentence(server, retries=1)
    assert len(server.asked) == 2


@pytest.mark.parametrize("status", [429, 500, 502, 503])
def test_a_busy_server_is_asked_again(server: ChatServer, status: int) -> None:
    server.answer(failed(status, "loading model", Retry_After="0"), "robot.turn(90)")
    assert _answered(server).content == "robot.turn(90)"
    assert len(server.asked) == 2


def test_as_long_as_the_server_says_and_no_longer_is_waited(
    server: ChatServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited: list[float] = []
    monkeypatch.setattr(endpoint, "sleep", waited.append)
    server.answer(failed(429, Retry_After="0.3"), "robot.turn(90)")
    _answered(server)
    assert waited == [0.3]


def test_a_wait_beyond_the_deadline_is_told_instead(server: ChatServer) -> None:
    server.answer(failed(429, "slow down", Retry_After="3600"))
    assert "too many requests (HTTP 429: “slow down”): try again in 3600 s" in _sentence(server)
    assert len(server.asked) == 1


@pytest.mark.parametrize(
    ("reply", "sentence"),
    [
        (failed(401, f"Incorrect key: {KEY}"), "key of its own (HTTP 401: “Incorrect key: …”): set AVL"),
        (failed(403), "key of its own (HTTP 403): set AVLMAPS_CHAT_API_KEY to one that may use 'test-model'"),
        (failed(404, "no such model"), "no model 'test-model' (HTTP 404: “no such model”): set AVLMAPS_CHAT_MODEL to"),
        (failed(500, "boom"), "(HTTP 500: “boom”): look into the server's log"),
        (failed(400, "too long"), "does not answer the request (HTTP 400: “too long”)"),
        (sent(b'{"object": "error", "message": "gone", "code": 418}', 418), "(HTTP 418: “gone”)"),
        (sent(b'{"detail": "gone"}', 418), "(HTTP 418: “gone”)"),
        (sent(b"gone", 418), "(HTTP 418: “gone”)"),
        (sent(b"<html>gone</html>", 418), "(HTTP 418)"),
        (sent(b"\xff\x00\x1b[31mred", 418), "(HTTP 418: “"),
        (sent(b"", 302, Location="http://192.0.2.1/v1"), "(HTTP 302: “http://192.0.2.1/v1”)"),
    ],
)  # fmt: skip
def test_each_status_has_its_sentence(server: ChatServer, reply: Any, sentence: str) -> None:
    server.answer(reply)
    assert sentence in _sentence(server, api_key=KEY, retries=0)
    assert len(server.asked) == 1


def test_a_missing_model_names_those_that_are_there(server: ChatServer) -> None:
    server.answer(failed(404, "no such model"))
    server.models[:] = [f"model-{n}" for n in range(11)]
    assert "to one of model-0, model-1, " in (sentence := _sentence(server))
    assert "model-7 and 3 more." in sentence


@pytest.mark.parametrize(
    ("told", "sent_then", "left_out"),
    [
        ({"message": "'temperature' is not supported here"}, {"seed", "max_tokens"}, ["temperature"]),
        ({"param": "seed", "message": "unknown"}, {"temperature", "max_tokens"}, ["seed"]),
        ({"param": "max_tokens", "message": "unsupported"}, {"temperature", "seed", "max_completion_tokens"}, []),
    ],
)
def test_what_a_server_does_not_take_is_left_out_from_then_on(
    server: ChatServer, told: dict[str, str], sent_then: set[str], left_out: list[str]
) -> None:
    server.answer(sent(json.dumps({"error": told}).encode(), 400), "robot.turn(90)")
    endpoint = Endpoint(_settings(server))
    for _ in range(2):
        assert endpoint.complete("test-model", MESSAGES).content == "robot.turn(90)"
    assert [set(asked.body) - {"model", "messages"} for asked in server.asked[1:]] == [sent_then] * 2
    assert endpoint.left_out == left_out


def test_a_server_that_takes_nothing_is_not_asked_for_ever(server: ChatServer) -> None:
    server.answer(sent(b'{"error": {"message": "temperature, seed, max_tokens: all wrong"}}', 400))
    assert "does not answer the request" in _sentence(server)
    assert len(server.asked) <= 4


def test_where_nothing_listens_the_sentence_says_so() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{taken.getsockname()[1]}/v1"
        with pytest.raises(LanguageError, match=r"cannot be reached \(.*refused.*\): start the server there"):
            Endpoint(ChatSettings(base_url=url, timeout_s=5.0)).complete("test-model", MESSAGES)


def test_the_only_model_of_a_server_needs_no_name(server: ChatServer) -> None:
    assert Endpoint(_settings(server)).model() == "test-model"
    server.models[:] = ["a", "b"]
    with pytest.raises(LanguageError, match="set AVLMAPS_CHAT_MODEL to one of a, b"):
        Endpoint(_settings(server)).model()


def test_the_hosted_service_is_not_asked_without_a_key_nor_without_a_model(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        LanguageError, match=r"no key for https://api\.openai\.com/v1: set OPENAI_API_KEY, or name a server"
    ):
        Endpoint(ChatSettings(model="m"))
    with pytest.raises(LanguageError, match="No chat model is named"):
        Endpoint(ChatSettings(api_key=KEY)).model()


def test_the_key_is_neither_logged_nor_shown(server: ChatServer, caplog: pytest.LogCaptureFixture) -> None:
    settings = _settings(server, api_key=KEY)
    assert KEY not in repr(settings)
    server.answer(f"robot.turn(90)  # {KEY}", failed(401, f"bad key {KEY}"))
    with caplog.at_level(logging.DEBUG):
        endpoint = Endpoint(settings)
        assert endpoint.complete("test-model", MESSAGES).content == "robot.turn(90)  # …"
        with pytest.raises(LanguageError, match="bad key …"):
            endpoint.complete("test-model", MESSAGES)
    assert all(KEY not in f"{record.getMessage()} {record.args}" for record in caplog.records)
    assert server.asked[0].headers["authorization"] == f"Bearer {KEY}"


# ---- settings


def test_the_defaults_are_the_hosted_service_and_choices_that_repeat() -> None:
    settings = ChatSettings.from_environment({})
    assert settings == ChatSettings()
    assert (settings.base_url, settings.temperature, settings.seed, settings.api_key) == (HOSTED_URL, 0.0, 0, None)
    assert settings.hosted and not settings.on_this_machine


def test_every_setting_can_come_from_the_environment() -> None:
    url, texts = "http://localhost:11434/v1", {"timeout_s": "7.5", "retries": "1", "rounds": "0", "max_tokens": "64"}
    texts |= {"model": " qwen ", "base_url": url, "api_key": "key", "temperature": "None", "seed": "none"}
    environment = {f"AVLMAPS_CHAT_{name.upper()}": text for name, text in (texts | {"replay": "chat.jsonl"}).items()}
    assert ChatSettings.from_environment(environment) == ChatSettings(
        model="qwen", base_url=url, api_key="key", timeout_s=7.5, retries=1, rounds=0, temperature=None, max_tokens=64,
        seed=None, replay=Path("chat.jsonl"),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("environment", "given", "key"),
    [
        ({"OPENAI_API_KEY": "k"}, {}, "k"),
        ({"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "http://lab:8000/v1/"}, {}, "k"),
        ({"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "http://lab:8000/v1/"}, {"base_url": "http://lab:8000/v1"}, "k"),
        ({"OPENAI_API_KEY": "k"}, {"base_url": "http://lab:8000/v1"}, None),
        ({"OPENAI_API_KEY": "k", "OPENAI_BASE_URL": "http://lab:8000/v1"}, {"base_url": HOSTED_URL}, None),
        ({"OPENAI_API_KEY": "k", "AVLMAPS_CHAT_BASE_URL": "http://lab:8000/v1"}, {}, None),
        ({"OPENAI_API_KEY": "k", "AVLMAPS_CHAT_API_KEY": "c"}, {"base_url": "http://lab:8000/v1"}, "c"),
        ({"OPENAI_API_KEY": "k", "AVLMAPS_CHAT_API_KEY": "c"}, {}, "c"),
        ({"OPENAI_API_KEY": "  "}, {}, None),
    ],
)
def test_a_key_goes_to_its_own_address_and_to_no_other(
    environment: dict[str, str], given: dict[str, str], key: str | None
) -> None:
    assert ChatSettings.from_environment(environment, **given).api_key == key


@pytest.mark.parametrize(
    ("url", "is_here"),
    [
        ("http://localhost:11434/v1", True),
        ("http://127.8.9.1:1/v1", True),
        ("http://[::1]:8000/v1", True),
        ("http://ollama.localhost/v1", True),
        ("http://192.168.0.2/v1", False),
        ("http://localhost.example.org/v1", False),
        ("https://127.0.0.1.example.org/v1", False),
    ],
)
def test_which_addresses_are_of_this_machine(url: str, is_here: bool) -> None:
    assert ChatSettings(base_url=url).on_this_machine == is_here


def test_a_password_in_an_address_is_not_shown() -> None:
    settings = ChatSettings(base_url="https://me:secret@lab.example:8443/v1/?token=secret")
    assert settings.shown_url == "https://lab.example:8443/v1"
    assert ChatSettings(base_url="http://[::1]:8/v1").shown_url == "http://[::1]:8/v1"


@pytest.mark.parametrize(
    "url", ["", "localhost:11434", "ftp://x/v1", "http://", "http://x:port/v1", "http://[::1/v1", "http://a b/", "h\n"]
)
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(LanguageError, match="no address of a chat server; give one like"):
        ChatSettings(base_url=url)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"base_url": "http://api.openai.com/v1"}, "sent the key in clear; give https://api.openai.com/v1"),
        ({"base_url": "http://API.openai.com:443"}, "sent the key in clear"),
        ({"api_key": "sk-\nx"}, "key for the chat model holds characters"),
        ({"retries": 99}, "chat setting retries is out of bounds"),
        ({"api_key": "schlüssel"}, "key for the chat model holds characters"),
    ],
)
def test_what_no_setting_can_be_is_refused(given: dict[str, Any], why: str) -> None:
    with pytest.raises(LanguageError, match=why) as told:
        ChatSettings(**given)
    assert "schlüssel" not in str(told.value)


@pytest.mark.parametrize(
    ("name", "text"),
    [("TIMEOUT_S", "soon"), ("TIMEOUT_S", "0"), ("SEED", "1.5"), ("ROUNDS", "11"), ("TEMPERATURE", "2.5")],
)
def test_a_variable_that_holds_something_else_is_named(name: str, text: str) -> None:
    with pytest.raises(LanguageError, match=f"The variable AVLMAPS_CHAT_{name} is {text!r}"):
        ChatSettings.from_environment({f"AVLMAPS_CHAT_{name}": text})


# ---- a file of exchanges


def test_a_file_answers_what_was_asked_in_its_order_and_nothing_else(tmp_path: Path) -> None:
    path, other = tmp_path / "chat.jsonl", ({"role": "user", "content": "Küche\n"},)
    recording = Replay(path)
    for messages, said in ((MESSAGES, "a"), (other, "b"), (MESSAGES, "c")):
        recording.add(messages, ModelReply(said))
    path.write_bytes(path.read_bytes() + b'{"torn')
    replay = Replay(path)
    assert recording.recording and not replay.recording
    assert [replay.answer(each).content for each in (other, MESSAGES, MESSAGES, MESSAGES, other)] == list("baccb")
    with pytest.raises(LanguageError, match="holds no answer to “go”; delete the file"):
        replay.answer(({"role": "user", "content": "go"},))


@pytest.mark.parametrize("line", [b"{}", b"robot.turn(90)", b"\xff\xfe", b"[" * 100_000])
def test_a_file_of_anything_else_is_refused(tmp_path: Path, line: bytes) -> None:
    path = tmp_path / "chat.jsonl"
    path.write_bytes(line + b"\n")
    with pytest.raises(LanguageError, match=r"The replay file .* cannot be read"):
        Replay(path)
    with pytest.raises(LanguageError, match=r"The replay file .* cannot be written"):
        Replay(tmp_path / "missing" / "chat.jsonl")


@given(st.text(max_size=300))
def test_a_text_of_somebody_elses_is_one_short_line_without_control_characters(text: str) -> None:
    assert quoted(text, 50).isprintable() and len(quoted(text, 50)) <= 52
