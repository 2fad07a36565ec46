"""A chat server of the tests' own, on this machine and a free port, that answers what a test tells it to."""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread
from typing import Any


@dataclass
class Asked:
    """One request as it arrived."""

    path: str
    headers: dict[str, str]
    body: dict[str, Any]

    @property
    def messages(self) -> list[dict[str, str]]:
        return self.body["messages"]


Reply = Callable[[BaseHTTPRequestHandler, Event], None]


@dataclass
class ChatServer:
    """What a test sees of the server: its address, what to answer next (the last answer stays), what was asked."""

    url: str
    replies: list[Reply] = field(default_factory=list)
    asked: list[Asked] = field(default_factory=list)
    models: list[str] = field(default_factory=lambda: ["test-model"])

    def answer(self, *replies: "str | Reply") -> None:
        self.replies[:] = [said(reply) if isinstance(reply, str) else reply for reply in replies]


def said(content: Any, finish: str | None = "stop", **message: Any) -> Reply:
    """An ordinary completion."""
    body = {
        "id": "1",
        "object": "chat.completion",
        "created": 0,
        "model": "test-model-0101",
        "choices": [
            {"index": 0, "finish_reason": finish, "message": {"role": "assistant", "content": content, **message}}
        ],
        "usage": {"prompt_tokens": 1200, "completion_tokens": 20, "total_tokens": 1220},
    }
    return sent(json.dumps(body).encode())


def sent(raw: bytes, status: int = 200, kind: str = "application/json", **headers: str) -> Reply:
    """Any bytes with any status."""

    def reply(handler: BaseHTTPRequestHandler, _: Event) -> None:
        handler.send_response(status)
        handler.send_header("Content-Type", kind)
        handler.send_header("Content-Length", str(len(raw)))
        for name, value in headers.items():
            handler.send_header(name.replace("_", "-"), value)
        handler.end_headers()
        handler.wfile.write(raw)

    return reply


def failed(status: int, message: str = "", **headers: str) -> Reply:
    """An HTTP error in the shape of the hosted service."""
    return sent(json.dumps({"error": {"message": message, "code": None}}).encode(), status, **headers)


def half(raw: bytes, promised: int) -> Reply:
    """Less bytes than were promised, then the end of the connection."""

    def reply(handler: BaseHTTPRequestHandler, _: Event) -> None:
        handler.send_response(200)
        handler.send_header("Content-Type", "application/json")
        handler.send_header("Content-Length", str(promised))
        handler.end_headers()
        handler.wfile.write(raw)
        handler.close_connection = True

    return reply


def hung_up(handler: BaseHTTPRequestHandler, _: Event) -> None:
    """No answer at all: the connection ends."""
    handler.close_connection = True


def silent(handler: BaseHTTPRequestHandler, over: Event) -> None:
    """No answer until the test is over."""
    over.wait(90)
    handler.close_connection = True


def trickle(status: int) -> Reply:
    """An answer that never ends, a byte at a time."""

    def reply(handler: BaseHTTPRequestHandler, over: Event) -> None:
        handler.send_response(status)
        handler.send_header("Content-Type", "application/json")
        handler.end_headers()
        while not over.wait(0.02):
            handler.wfile.write(b" ")

    return reply


def endless(status: int) -> Reply:
    """An answer that never ends, as fast as it goes."""

    def reply(handler: BaseHTTPRequestHandler, over: Event) -> None:
        handler.send_response(status)
        handler.send_header("Content-Type", "application/json")
        handler.end_headers()
        while not over.is_set():
            handler.wfile.write(b" " * 65536)

    return reply


@contextmanager
def chat_server() -> Iterator[ChatServer]:
    """A server for one test; it is gone afterwards, with all that it still had to say."""
    over = Event()

    class Handler(BaseHTTPRequestHandler):
        def log_message(self, *_: Any) -> None: ...

        def do_POST(self) -> None:
            body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            server.asked.append(Asked(self.path, {k.lower(): v for k, v in self.headers.items()}, body))
            reply = server.replies.pop(0) if len(server.replies) > 1 else server.replies[0]
            try:
                reply(self, over)
            except OSError:
                self.close_connection = True  # whoever asked has heard enough

        def do_GET(self) -> None:
            assert self.path == "/v1/models"
            sent(json.dumps({"object": "list", "data": [{"id": name} for name in server.models]}).encode())(self, over)

    http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    http.daemon_threads = True
    server = ChatServer(f"http://127.0.0.1:{http.server_port}/v1")
    thread = Thread(target=http.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        over.set()
        http.shutdown()
        http.server_close()
        thread.join()
