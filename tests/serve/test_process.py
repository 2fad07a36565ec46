"""The server as a process of its own: it starts, answers programs and agents, and ends as it should."""

import json
import os
import signal
import socket
import ssl
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Any

import anyio
import httpx
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from avlmaps.cli import main
from avlmaps.serve.operations import OPERATIONS

TOOLS = sum(bool(one.tool) for one in OPERATIONS)
Start = Callable[..., tuple[subprocess.Popen[str], dict[str, Any]]]


@pytest.fixture
def start(room: Path) -> Iterator[Start]:
    """Start servers; return the process and what it printed when it was ready."""
    running: list[subprocess.Popen[str]] = []

    def go(*words: object) -> tuple[subprocess.Popen[str], dict[str, Any]]:
        command = [sys.executable, "-m", "avlmaps", "serve", str(room), "--json", *map(str, words)]
        as_a_user = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
        process = subprocess.Popen(command, env=as_a_user, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        running.append(process)
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line, process.stderr.read() if process.stderr else ""
        return process, json.loads(line)

    yield go
    for process in running:
        if process.poll() is None:
            process.kill()
        process.communicate()


def test_a_process_answers_programs_and_agents_and_finishes_what_runs(start: Start) -> None:
    process, ready = start("--port", "0")
    assert ready["maps"] == ["room"] and ready["token"] is False
    url = ready["url"]
    assert url.startswith("http://127.0.0.1:")
    answer = httpx.get(f"{url}/maps/room/ask", params={"sentence": "the red thing"}).json()
    assert answer["goals"] and "server" not in httpx.get(f"{url}/maps").headers

    from mcp.client.client import Client  # here, since its models take 1.4 s of each worker that collects this file

    async def agent(mode: str) -> Any:
        async with Client(f"{url}/mcp", mode=mode) as client:
            assert len((await client.list_tools()).tools) == TOOLS
            return told(await client.call_tool("ask", {"sentence": "the red thing"}))

    for mode in ("auto", "legacy"):
        near = [pytest.approx(goal["position"], abs=0.006) for goal in answer["goals"]]
        assert [goal["position"] for goal in anyio.run(agent, mode)["goals"]] == near

    got: list[httpx.Response] = []
    client = httpx.Client(timeout=60)
    asking = threading.Thread(target=lambda: got.append(client.get(f"{url}/maps/room/picture?sentence=the+red+thing")))
    with client.stream("GET", f"{url}/maps/room/contents?least=0.07", headers={"accept": "text/event-stream"}) as work:
        events = work.iter_lines()
        assert next(events) == "event: progress"
        asking.start()
        threading.Event().wait(0.2)
        process.send_signal(signal.SIGTERM)
        lines = list(events)
    assert any(line.startswith("event: answer") for line in lines), "what was running was finished"
    asking.join(60)
    assert [one.status_code for one in got] == [200] and process.wait(30) == 0
    assert process.stderr is not None and "Traceback" not in process.stderr.read()


def own_certificate(folder: Path) -> tuple[Path, Path]:
    """Write a certificate for 127.0.0.1 that signs itself, and its key."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "avlmaps test")])
    now = datetime.now(UTC)
    built = x509.CertificateBuilder(name, name, key.public_key(), 1, now - timedelta(days=1), now + timedelta(days=1))
    address = x509.SubjectAlternativeName([x509.IPAddress(ip_address("127.0.0.1"))])
    certificate = built.add_extension(address, critical=False).sign(key, hashes.SHA256())
    files = folder / "own.pem", folder / "own.key"
    files[0].write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    plain = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    files[1].write_bytes(key.private_bytes(serialization.Encoding.PEM, *plain))
    return files


@pytest.mark.nightly
def test_with_tls_files_it_speaks_https_and_nothing_else(start: Start, tmp_path: Path) -> None:
    certificate, key = own_certificate(tmp_path)
    process, ready = start("--port", "0", "--tls-cert", certificate, "--tls-key", key)
    assert ready["url"].startswith("https://127.0.0.1:")
    trusts = ssl.create_default_context(cafile=str(certificate))
    with httpx.Client(verify=trusts) as client:
        assert client.get(f"{ready['url']}/health").json()["status"] == "ok"
        assert client.get(f"{ready['url']}/maps/room/ask", params={"sentence": "the red thing"}).json()["goals"]
    with pytest.raises(httpx.ConnectError, match="CERTIFICATE_VERIFY_FAILED"):
        httpx.get(f"{ready['url']}/health")
    with pytest.raises(httpx.HTTPError):
        httpx.get(f"http{ready['url'].removeprefix('https')}/health")
    process.send_signal(signal.SIGTERM)
    assert process.wait(30) == 0


@pytest.mark.nightly
def test_an_agent_is_served_by_standard_input_and_output(room: Path) -> None:
    from mcp.client.client import Client
    from mcp.client.stdio import StdioServerParameters, stdio_client

    async def conversation() -> Any:
        words = ["-m", "avlmaps", "serve", str(room), "--stdio"]
        parameters = StdioServerParameters(command=sys.executable, args=words, env=dict(os.environ))
        async with Client(stdio_client(parameters)) as client:
            assert len((await client.list_tools()).tools) == TOOLS
            return told(await client.call_tool("ask", {"sentence": "the red thing"}))

    assert anyio.run(conversation)["goals"]


@pytest.mark.nightly
def test_a_client_whose_input_ends_has_its_last_answer_and_may_name_a_photo(room: Path, walk: Path) -> None:
    photo = sorted((walk / "rgb").iterdir())[5]
    asked: list[dict[str, Any]] = [
        {"id": 1, "method": "initialize", "params": {
            "protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": {"name": "test", "version": "1"}}},
        {"method": "notifications/initialized"},
        {"id": 2, "method": "tools/call", "params": {"name": "locate_photo", "arguments": {"photo": str(photo)}}},
    ]  # fmt: skip
    lines = "\ufeff" + "".join(json.dumps({"jsonrpc": "2.0", **one}) + "\n" for one in asked)
    words = [sys.executable, "-m", "avlmaps", "serve", str(room), "--stdio"]
    done = subprocess.run(words, input=lines.encode(), capture_output=True, check=True, timeout=120)
    answers = {one["id"]: one["result"] for one in map(json.loads, done.stdout.splitlines())}
    assert answers.keys() == {1, 2} and json.loads(answers[2]["content"][0]["text"])["inliers"] > 0


def told(result: Any) -> Any:
    assert not result.is_error, result.content
    return json.loads(result.content[0].text)


def failed(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str]:
    with pytest.raises(SystemExit) as stop:
        main(["serve", *map(str, words)])
    return int(stop.value.code or 0), capsys.readouterr().err


def test_faults_of_starting_are_one_sentence(
    room: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("AVLMAPS_TOKEN", raising=False)
    (tmp_path / "empty").write_text("")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        cases: list[tuple[tuple[object, ...], int, str]] = [
            ((room, "--port", port), 1, f"port {port} of 127.0.0.1: the port is taken"),
            ((room, room), 1, "Two maps are called 'room'"),
            ((tmp_path / "none.avlmap", "--port", 0), 1, "none.avlmap is not there"),
            ((room, "--host", "0.0.0.0", "--port", 0), 1, "needs a token"),
            ((room, "--token-file", tmp_path / "empty"), 1, "is empty"),
            ((room, "--token-file", tmp_path / "absent"), 1, "cannot be read"),
            ((room, "--tls-cert", "a.pem"), 1, "both --tls-cert and --tls-key"),
            ((room, "--host", "256.0.0.1.invalid", "--token-file", tmp_path / "absent"), 1, "cannot"),
            ((room, "--stdio", "--json"), 2, "--json cannot be used"),
            ((), 2, ""),
        ]
        for words, status, says in cases:
            code, said = failed(capsys, *words)
            assert code == status, said
            assert says in said and "Traceback" not in said
