"""A chat server is asked as it should be, and each way in which it can fail has one sentence that says what to do.

Everything runs against a real HTTP server on this machine, garbage and hostility included.
"""

import json
import logging
import socket
from collections.abc import Iterator
from typing import Any

import pytest
from chat_server import (
    ChatServer,
    chat_server,
    endless,
    failed,
    half,
    hung_up,
    sent,
    silent,
    trickle,
)

from avlmaps.core.errors import LanguageError
from avlmaps.language.chat import endpoint
from avlmaps.language.chat.endpoint import Endpoint
from avlmaps.language.chat.replay import ChatRequest, Message
from avlmaps.language.chat.settings import ChatSettings

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


def _request(model: str = "test-model", **changes: Any) -> ChatRequest:
    messages = (Message("system", "You write programs."), Message("user", "Command: “go”"))
    return ChatRequest(
        **{"model": model, "messages": messages, "temperature": 0.0, "seed": 7, "max_tokens": 99, **changes}
    )


def _sentence(server: ChatServer, **changes: Any) -> str:
    """Return the sentence of the fault that the server's answer is."""
    with pytest.raises(LanguageError) as told:
        Endpoint(_settings(server, **changes)).complete(_request())
    sentence = str(told.value)
    assert "\n" not in sentence and sentence.endswith(".") and len(sentence) < 500
    assert KEY not in sentence
    return sentence


def test_an_answer_comes_back_with_its_counts(server: ChatServer) -> None:
    server.answer("robot.turn(90)")
    answer = Endpoint(_settings(server)).complete(_request())
    assert (answer.content, answer.finish, answer.refusal) == ("robot.turn(90)", "stop", None)
    assert (answer.model, answer.tokens) == ("test-model-0101", (1200, 20))


def test_exactly_the_request_is_sent_and_nothing_of_the_environment(server: ChatServer) -> None:
    server.answer("robot.turn(90)")
    Endpoint(_settings(server, api_key=KEY)).complete(_request())
    (asked,) = server.asked
    assert asked.path == "/v1/chat/completions"
    assert asked.body == {
        "model": "test-model",
        "messages": [
            {"role": "system", "content": "You write programs."},
            {"role": "user", "content": "Command: “go”"},
        ],
        "temperature": 0,
        "seed": 7,
        "max_tokens": 99,
    }
    assert asked.headers["authorization"] == f"Bearer {KEY}"
    assert "another-service" not in str(asked)


def test_text_in_parts_and_missing_counts_are_read_all_the_same(server: ChatServer) -> None:
    choice = {"message": {"content": [{"type": "text", "text": "robot."}, {"type": "text", "text": "turn(90)"}]}}
    server.answer(sent(json.dumps({"choices": [choice], "usage": None}).encode()))
    answer = Endpoint(_settings(server)).complete(_request())
    assert (answer.content, answer.tokens, answer.finish) == ("robot.turn(90)", (0, 0), None)


@pytest.mark.parametrize(
    ("message", "refusal", "tools"),
    [
        ({"content": None, "refusal": "No."}, "No.", 0),
        ({"content": [{"type": "refusal", "refusal": "No."}]}, "No.", 0),
        ({"content": None, "tool_calls": [{"id": "1", "type": "function", "function": {"name": "go"}}]}, None, 1),
    ],
)
def test_refusals_and_tool_calls_are_told_apart_from_text(
    server: ChatServer, message: dict[str, Any], refusal: str | None, tools: int
) -> None:
    server.answer(sent(json.dumps({"choices": [{"message": message}]}).encode()))
    answer = Endpoint(_settings(server)).complete(_request())
    assert (answer.content, answer.refusal, answer.tool_calls) == ("", refusal, tools)


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"\x00\xff\xfe\x80",
        b"null",
        b"[]",
        b'"robot.turn(90)"',
        b'{"choices": 3}',
        b'{"choices": [{}]}',
        b'{"choices": [{"message": "robot.turn(90)"}]}',
        b'{"choices": [{"message": {"content": 90}}]}',
        b'{"choices": [{"message": {"content": "robot.turn(90)"}}]',
        b"[" * 100_000,
        b'{"choices": [{"message": {"content": "\\ud800"}}]}',
        '{"choices": [{"message": {"content": "Küche"}}]}'.encode("latin-1"),
        '{"choices": [{"message": {"content": "Küche"}}]}'.encode("utf-16"),
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


@pytest.mark.parametrize(
    "reply",
    [
        silent,
        trickle(200),
        trickle(500),
    ],
)
def test_the_deadline_holds_however_slow_the_answer_is(server: ChatServer, reply: Any) -> None:
    server.answer(reply)
    sentence = _sentence(server, timeout_s=0.4, retries=5)
    assert "no answer within 0.4 s: raise AVLMAPS_CHAT_TIMEOUT_S" in sentence or "HTTP 500" in sentence


@pytest.mark.parametrize("reply", [half(b'{"choices": [{"message": {"content": "robot.tu', 400), hung_up])
def test_a_broken_connection_is_tried_again_and_then_told(server: ChatServer, reply: Any) -> None:
    server.answer(reply)
    assert "broke off in the middle 2 times" in _sentence(server, retries=1)
    assert len(server.asked) == 2


@pytest.mark.parametrize("status", [429, 500, 502, 503])
def test_a_busy_server_is_asked_again(server: ChatServer, status: int) -> None:
    server.answer(failed(status, "loading model", Retry_After="0"), "robot.turn(90)")
    assert Endpoint(_settings(server)).complete(_request()).content == "robot.turn(90)"
    assert len(server.asked) == 2


def test_as_long_as_the_server_says_and_no_longer_is_waited(
    server: ChatServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    waited: list[float] = []
    monkeypatch.setattr(endpoint, "sleep", waited.append)
    server.answer(failed(429, Retry_After="0.3"), "robot.turn(90)")
    Endpoint(_settings(server)).complete(_request())
    assert waited == [0.3]


def test_a_wait_beyond_the_deadline_is_told_instead(server: ChatServer) -> None:
    server.answer(failed(429, "slow down", Retry_After="3600"))
    assert "too many requests (HTTP 429: “slow down”): try again in 3600 s" in _sentence(server)
    assert len(server.asked) == 1


@pytest.mark.parametrize(
    ("reply", "sentence"),
    [
        (failed(401, f"Incorrect key: {KEY}"), "does not accept the key (HTTP 401: “Incorrect key: …”): set AVL"),
        (failed(403), "does not accept the key (HTTP 403): set AVLMAPS_CHAT_API_KEY to one that may use 'test-model'"),
        (failed(404, "no such model"), "no model 'test-model' (HTTP 404: “no such model”): set AVLMAPS_CHAT_MODEL to"),
        (failed(500, "boom"), "failed once (HTTP 500: “boom”): try again later"),
        (failed(400, "too long"), "does not take the request (HTTP 400: “too long”)"),
        (sent(b'{"object": "error", "message": "gone", "code": 418}', 418), "(HTTP 418: “gone”)"),
        (sent(b'{"error": "gone"}', 418), "(HTTP 418: “gone”)"),
        (sent(b'{"detail": "gone"}', 418), "(HTTP 418: “gone”)"),
        (sent(b"gone", 418), "(HTTP 418: “gone”)"),
        (sent(b"<html>gone</html>", 418), "(HTTP 418)"),
        (sent(b"\xff\x00\x1b[31mred", 418), "(HTTP 418: “"),
        (sent(b"x" * 100_000, 418), "(HTTP 418)"),
        (failed(429, "nothing left"), "too many requests"),
        (sent(b'{"error": {"message": "pay", "code": "insufficient_quota"}}', 429), "no credit left (HTTP 429: “pay”)"),
        (sent(b"", 302, Location="http://192.0.2.1/v1"), "sends on to another address (HTTP 302: “http://192.0.2.1/v1”)"),
    ],
)  # fmt: skip
def test_each_status_has_its_sentence(server: ChatServer, reply: Any, sentence: str) -> None:
    server.answer(reply)
    assert sentence in _sentence(server, api_key=KEY, retries=0)
    assert len(server.asked) == 1


def test_without_a_key_a_server_that_wants_one_asks_for_it(server: ChatServer) -> None:
    server.answer(failed(401, "who are you"))
    assert "asks for a key (HTTP 401: “who are you”): set AVLMAPS_CHAT_API_KEY" in _sentence(server)


def test_a_missing_model_names_those_that_are_there(server: ChatServer) -> None:
    server.answer(failed(404, "no such model"))
    server.models[:] = [f"model-{n}" for n in range(11)]
    assert "to one of model-0, model-1, " in (sentence := _sentence(server))
    assert "model-7 and 3 more." in sentence


@pytest.mark.parametrize(
    ("told", "sent_then", "left_out"),
    [
        ({"param": "temperature", "message": "does not support 0"}, {"seed", "max_tokens"}, ["temperature"]),
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
        assert endpoint.complete(_request()).content == "robot.turn(90)"
    assert [set(asked.body) - {"model", "messages"} for asked in server.asked[1:]] == [sent_then] * 2
    assert endpoint.left_out == left_out


def test_a_server_that_takes_nothing_is_not_asked_for_ever(server: ChatServer) -> None:
    server.answer(sent(b'{"error": {"message": "temperature, seed, max_tokens: all wrong"}}', 400))
    assert "does not take the request" in _sentence(server)
    assert len(server.asked) <= 4


def test_where_nothing_listens_the_sentence_says_so() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{taken.getsockname()[1]}/v1"
        with pytest.raises(LanguageError, match=r"cannot be reached \(.*refused.*\): start the server there"):
            Endpoint(ChatSettings(base_url=url, timeout_s=5.0)).complete(_request())


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
        assert endpoint.complete(_request()).content == "robot.turn(90)  # …"
        with pytest.raises(LanguageError, match="bad key …"):
            endpoint.complete(_request())
    assert all(KEY not in f"{record.getMessage()} {record.args}" for record in caplog.records)
    assert server.asked[0].headers["authorization"] == f"Bearer {KEY}"
