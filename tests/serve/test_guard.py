"""The guard before every request: who is let through, and what the others are answered."""

import asyncio
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.testclient import TestClient

from avlmaps.core.machine import is_loopback
from avlmaps.core.wording import Spelling, option, options_as
from avlmaps.serve.guard import AccessGuard
from avlmaps.serve.lanes import without_folders
from avlmaps.serve.settings import Limits, ServeError, ServeSettings

TOKEN = "a-token-of-some-length"


async def behind(scope: Any, receive: Any, send: Any) -> None:
    """An application that returns the length of the body."""
    body = await Request(scope, receive).body()
    await PlainTextResponse(str(len(body)))(scope, receive, send)


def guarded(**settings: Any) -> TestClient:
    return TestClient(AccessGuard(behind, ServeSettings(**settings)), base_url="http://127.0.0.1:8750")


def refused(response: Response | Any, status: int, kind: str) -> str:
    assert response.status_code == status and response.json()["error"]["kind"] == kind
    return response.json()["error"]["message"]


@pytest.mark.parametrize(
    ("host", "near"),
    [("127.0.0.1", True), ("127.5.0.1", True), ("::1", True), ("[::1]", True), ("localhost", True), ("0.0.0.0", False),
     ("::", False), ("192.168.1.5", False), ("localhost.example", False), ("", False)],
)  # fmt: skip
def test_what_is_loopback(host: str, near: bool) -> None:
    assert is_loopback(host) is near


@pytest.mark.parametrize("host", ["127.0.0.1:8750", "localhost", "LOCALHOST:1", "[::1]:8750", "localhost."])
def test_names_of_this_machine_are_answered(host: str) -> None:
    assert guarded().get("/", headers={"host": host}).status_code == 200


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "10.0.0.7", "localhost@evil.example"])
def test_other_names_are_refused_against_dns_rebinding(host: str) -> None:
    refused(guarded().get("/", headers={"host": host}), 421, "host")


def test_a_server_for_other_machines_takes_addresses_and_named_hosts() -> None:
    client = guarded(host="0.0.0.0", token=TOKEN, allowed_hosts=("maps.example",))
    bearer = {"authorization": f"Bearer {TOKEN}"}
    for host in ("10.0.0.7:8750", "[fe80::1]:8750", "maps.example"):
        assert client.get("/", headers={"host": host, **bearer}).status_code == 200
    refused(client.get("/", headers={"host": "evil.example", **bearer}), 421, "host")


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "http://127.0.0.1:9999", "https://127.0.0.1.evil"])
def test_pages_of_other_sites_are_refused(origin: str) -> None:
    refused(guarded().post("/", headers={"origin": origin}), 403, "origin")
    answer = guarded().options("/", headers={"origin": origin, "access-control-request-method": "POST"})
    assert not [name for name in answer.headers if name.startswith("access-control")]


@pytest.mark.parametrize(
    "header", ["", "Bearer", "Bearer x", f"Basic {TOKEN}", f"Bearer {TOKEN} x", f"bearer {TOKEN[:-1]}", "Bearer ü"]
)
def test_a_wrong_token_is_refused(header: str) -> None:
    answer = guarded(token=TOKEN).get("/", headers={"authorization": header.encode("latin-1")})
    refused(answer, 401, "token")
    assert answer.headers["www-authenticate"].startswith("Bearer") and TOKEN not in answer.text


def test_the_token_opens_and_health_needs_none() -> None:
    client = guarded(token=TOKEN)
    assert client.get("/", headers={"authorization": f"Bearer {TOKEN}"}).text == "0"
    assert client.get("/", headers={"authorization": f"bearer {TOKEN}"}).text == "0"
    assert client.get("/health").status_code == 200


@given(st.text(max_size=40))
def test_no_other_text_opens(text: str) -> None:
    if text.strip() == TOKEN:
        return
    from avlmaps.serve.lanes import RequestError

    with pytest.raises(RequestError) as fault:
        given = {b"authorization": f"Bearer {text}", b"cookie": f"avlmaps_token={text}"}
        headers = [(name, value.encode()) for name, value in given.items()]
        AccessGuard(behind, ServeSettings(token=TOKEN))._check_token(Request({"type": "http", "headers": headers}))
    assert fault.value.status == 401


def test_a_browser_brings_the_token_once_and_keeps_it() -> None:
    odd = 'a token; of=some%20"length"'
    client = guarded(token=odd)
    for query in ({}, {"token": ""}, {"token": odd[:-1]}, {"token": "\xff"}):
        refused(client.get("/maps/a/view", params=query), 401, "token")
    refused(client.get("/", headers={"cookie": "avlmaps_token=wrong"}), 401, "token")
    refused(client.post("/", params={"token": odd}), 401, "token")
    entered = client.get("//evil.example/view", params={"token": odd, "other": "b"}, follow_redirects=False)
    assert entered.status_code == 303 and entered.headers["location"] == "?other=b", "the token leaves the address"
    cookie = entered.headers["set-cookie"]
    assert "HttpOnly" in cookie and "SameSite=strict" in cookie and "Secure" not in cookie
    assert client.get("/", headers={"cookie": cookie.partition(";")[0]}).text == "0"


def test_a_large_body_is_refused_by_its_length_and_by_its_bytes() -> None:
    client = guarded(limits=Limits(body_bytes=100))
    assert client.post("/", content=b"x" * 100).text == "100"
    refused(client.post("/", content=b"x" * 101), 413, "size")

    def pieces():
        for _ in range(50):
            yield b"x" * 10

    refused(client.post("/", content=pieces()), 413, "size")
    refused(client.post("/", headers={"content-length": "9" * 30}), 413, "size")


def test_a_body_that_does_not_come_is_given_up() -> None:
    sent: list[dict[str, Any]] = []

    async def run() -> None:
        async def never() -> dict[str, Any]:
            await asyncio.sleep(60)
            return {}

        async def send(message: Any) -> None:
            sent.append(dict(message))

        scope = {"type": "http", "method": "POST", "path": "/", "headers": [(b"host", b"localhost")]}
        await AccessGuard(behind, ServeSettings(limits=Limits(body_s=0.05)))(scope, never, send)

    asyncio.run(run())
    assert sent[0]["status"] == 408


def test_every_answer_forbids_guessing_framing_and_storing() -> None:
    for answer in (guarded().get("/"), guarded().get("/", headers={"host": "evil.example"})):
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["x-frame-options"] == "DENY"
        assert answer.headers["cache-control"] == "no-store"


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"host": "0.0.0.0"}, "ServeSettings.token"),
        ({"host": "192.168.1.7"}, "ServeSettings.token"),
        ({"token": "short"}, "5 characters"),
        ({"tls_key": "a.pem"}, "both"),
    ],
)
def test_unsafe_settings_are_refused(settings: dict[str, Any], says: str) -> None:
    with pytest.raises(ServeError, match=says):
        ServeSettings(**settings)


@pytest.mark.parametrize(
    ("sentence", "public"),
    [
        ("it lies in /usr/lib/python3/x.py.", "it lies in x.py."),
        (r"it lies in C:\Users\me\x.py.", "it lies in x.py."),
        ("Answer 3/4 of http://localhost:8750/maps.", "Answer 3/4 of http://localhost:8750/maps."),
    ],
)
def test_paths_of_the_machine_leave_sentences(sentence: str, public: str) -> None:
    assert without_folders(sentence) == public


def test_a_request_is_answered_in_fields_while_the_process_speaks_in_flags() -> None:
    async def says(scope: Any, receive: Any, send: Any) -> None:
        await PlainTextResponse(option("camera-height-m"))(scope, receive, send)

    with options_as(Spelling.FLAG):
        client = TestClient(AccessGuard(says, ServeSettings()), base_url="http://127.0.0.1:8750")
        assert client.get("/").text == "camera_height_m"
        assert option("camera-height-m") == "--camera-height-m"


def test_its_own_page_and_a_click_on_a_link_are_let_through_and_embedding_is_not() -> None:
    assert guarded().get("/", headers={"origin": "http://127.0.0.1:8750"}).status_code == 200
    linked = {"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}
    assert guarded().get("/", headers=linked).status_code == 200
    refused(guarded().get("/", headers={**linked, "sec-fetch-mode": "no-cors"}), 403, "origin")


def test_settings_do_not_show_their_token() -> None:
    assert TOKEN not in repr(ServeSettings(token=TOKEN))
