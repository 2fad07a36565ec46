"""The page over HTTP: what it answers, what it refuses, and that it forgets what it no longer needs."""

import http.client
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
import soundfile

from avlmaps.core.errors import QueryError
from avlmaps.core.network import is_loopback
from avlmaps.query.avlmap import AVLMap
from avlmaps.view import session as sessions
from avlmaps.view.layout import RECORD
from avlmaps.view.server import ViewServer
from avlmaps.view.session import ViewSession
from helpers.viewing import serving

Call = Callable[..., tuple[int, dict[str, str], bytes]]


def caller(server: ViewServer) -> Call:
    port = server.server_address[1]

    def call(path: str, body: bytes | None = None, **headers: str) -> tuple[int, dict[str, str], bytes]:
        line = http.client.HTTPConnection("127.0.0.1", port, timeout=280)
        named = {name.replace("_", "-"): value for name, value in headers.items()}
        line.request("GET" if body is None else "POST", path, body, named)
        answer = line.getresponse()
        content = answer.read()
        line.close()
        return answer.status, {name.lower(): value for name, value in answer.getheaders()}, content

    return call


@pytest.fixture
def call(served: ViewServer) -> Call:
    return caller(served)


@pytest.fixture
def posted(call: Call) -> Callable[..., tuple[int, Any]]:
    def post(path: str, **words: object) -> tuple[int, Any]:
        status, headers, content = call(path, json.dumps(words).encode(), Content_Type="application/json")
        return status, json.loads(content) if headers["content-type"] == "application/json" else content

    return post


def parted(content: bytes) -> tuple[dict[str, Any], bytes]:
    size = int.from_bytes(content[:4], "little")
    return json.loads(content[4 : 4 + size]), content[4 + size :]


def test_the_page_and_the_map_are_served(call: Call, room: AVLMap) -> None:
    status, headers, page = call("/")
    assert status == 200 and b"<canvas" in page and headers["cache-control"] == "no-store"
    told = json.loads(call("/api/maps")[2])
    assert told["maps"][0]["voxels"] == len(room.points)
    assert len(call("/api/maps/0/voxels")[2]) == len(room.points) * RECORD.itemsize
    assert len(call("/api/maps/0/labels")[2]) == len(room.points) * 4
    contents = json.loads(call("/api/maps/0/contents")[2])
    assert {"things", "sounds", "rooms", "palettes"} <= set(contents)
    assert call("/api/maps/0/keyframes/0")[2][:2] == b"\xff\xd8"
    assert call("/api/maps/0/clips/0")[2][:4] == b"fLaC"
    voxel = json.loads(call("/api/maps/0/voxels/5")[2])
    assert len(voxel["names"]) <= 5 and voxel["pixels"] > 0 and voxel["views"] >= len(voxel["seen_by"])


def test_a_question_has_the_answer_of_query_and_its_heat(posted, room: AVLMap) -> None:
    status, content = posted("/api/ask", sentence="the red thing")
    assert status == 200
    told, heat = parted(content)
    wanted = room.ask("the red thing", top=5).to_dict()
    got = told["answers"][0]
    assert {key: got[key] for key in got if key != "elapsed_ms"} == {
        key: value for key, value in wanted.items() if key != "elapsed_ms"
    }
    assert len(heat) == len(room.points) and max(heat) > 100


def test_a_photo_and_a_clip_are_asked_with_and_no_answer_names_a_file_of_the_server(
    call: Call, posted, room: AVLMap, walk: Path, tmp_path: Path, served: ViewServer
) -> None:
    jpeg = call("/api/maps/0/keyframes/3")[2]
    octets = {"Content_Type": "application/octet-stream"}
    status, _, content = call("/api/uploads/photo", jpeg, X_Name="..%2F..%2Fetc%2Fmy%20room.jpg", **octets)
    assert status == 200
    photo = json.loads(content)["upload"]
    told, _ = parted(posted("/api/ask", sentence="", photo=photo)[1])
    assert told["answers"][0]["parts"][0]["query"] == "my room.jpg"
    told, _ = parted(posted("/api/ask", sentence="the red thing near where this photo was taken", photo=photo)[1])
    assert [part["modality"] for part in told["answers"][0]["parts"]] == ["object", "image"]
    clip = call("/api/maps/0/clips/0")[2]
    number = json.loads(call("/api/uploads/clip", clip, X_Name="beep.flac", **octets)[2])["upload"]
    told, _ = parted(posted("/api/ask", sentence="", clip=number)[1])
    assert told["answers"][0]["parts"][0]["query"] == "beep.flac"
    assert str(served.session._folder) not in json.dumps(told)
    status, error = posted("/api/ask", sentence="the red thing", clip=number)
    assert status == 400 and "does not speak of the file" in error["error"]["message"]


@pytest.mark.parametrize(
    ("kind", "content", "sentence"),
    [
        ("photo", b"no picture at all", "cannot be read as an image"),
        ("clip", b"RIFF....no sound", "cannot be read as sound"),
        ("clip", b"#EXTM3U\n#EXTINF:1,\n/etc/hostname\n", "give a wav, flac, ogg"),
        ("clip", b"ffconcat version 1.0\nfile 1.flac\n", "give a wav, flac, ogg"),
        ("photo", b"", "0 bytes"),
        ("program", b"x", "a photo or a clip"),
    ],
)
def test_a_bad_upload_is_one_sentence_with_its_owners_name(call: Call, kind, content, sentence) -> None:
    status, _, said = call(
        f"/api/uploads/{kind}", content, Content_Type="application/octet-stream", X_Name="holiday.xyz"
    )
    message = json.loads(said)["error"]["message"]
    assert status == 400 and sentence in message and "avlmaps-view-" not in message


def test_silence_is_refused(call: Call, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "quiet.wav", np.zeros(8000), 8000)
    content = (tmp_path / "quiet.wav").read_bytes()
    status, _, said = call("/api/uploads/clip", content, Content_Type="application/octet-stream")
    assert status == 400 and "silent" in json.loads(said)["error"]["message"]


@pytest.mark.parametrize("sentence", ["", "near near", "x" * 600, "why is the sky blue?"])
def test_a_question_that_is_none_is_one_sentence(posted, sentence: str) -> None:
    status, said = posted("/api/ask", sentence=sentence)
    assert status == 400 and said["error"]["message"].endswith((".", "?"))


def test_a_forgotten_upload_is_told(posted) -> None:
    status, said = posted("/api/ask", sentence="", photo="12345")
    assert status == 400 and "choose it again" in said["error"]["message"]


@pytest.mark.parametrize(
    "path",
    [
        "/nothing", "/api", "/api/maps/1/voxels", "/api/maps/x/voxels", "/api/maps/-1/voxels", "/../../etc/passwd",
        "/api/maps/0/keyframes/99999", "/api/maps/0/clips/7", "/api/maps/0/clips/..%2f..%2fmap.json",
        "/api/maps/0/voxels/9" + 30 * "9",
    ],
)  # fmt: skip
def test_what_is_not_there_is_not_found(call: Call, path: str) -> None:
    status, _, said = call(path)
    assert status == 404 and set(json.loads(said)) == {"error"}


def test_a_voxel_that_is_not_there_is_told(call: Call) -> None:
    status, _, said = call("/api/maps/0/voxels/99999999")
    assert status == 400 and "There is no voxel" in json.loads(said)["error"]["message"]


def test_another_site_and_another_name_of_this_host_are_refused(call: Call, served: ViewServer) -> None:
    good = f"127.0.0.1:{served.server_address[1]}"
    assert call("/api/maps", Host="evil.example")[0] == 403
    assert call("/api/maps", Host="127.0.0.1.evil.example")[0] == 403
    assert call("/api/maps", Host=f"localhost:{served.server_address[1]}")[0] == 200
    words = json.dumps({"sentence": "the red thing"}).encode()
    assert call("/api/ask", words, Content_Type="application/json", Origin="http://evil.example")[0] == 403
    assert call("/api/ask", words, Content_Type="application/json", Origin=f"http://{good}")[0] == 200
    assert call("/api/ask", words, Content_Type="text/plain")[0] == 415, "what a form of another site may send"


def test_bodies_have_a_length_and_a_limit(call: Call, served: ViewServer) -> None:
    assert call("/api/ask", b"{" + 200_000 * b" ", Content_Type="application/json")[0] == 413
    assert call("/api/ask", b"no json", Content_Type="application/json")[0] == 400
    assert call("/api/ask", b"[" * 90_000, Content_Type="application/json")[0] == 400
    assert call("/api/ask", b"[]", Content_Type="application/json")[0] == 400
    line = http.client.HTTPConnection("127.0.0.1", served.server_address[1], timeout=280)
    line.putrequest("POST", "/api/uploads/photo")
    line.putheader("Content-Type", "application/octet-stream")
    line.putheader("Content-Length", str(sessions.MOST_UPLOAD_BYTES + 1))
    line.endheaders()
    assert line.getresponse().status == 413
    line.close()


@pytest.mark.parametrize(
    ("host", "near"),
    [("127.0.0.1", True), ("127.5.0.1", True), ("::1", True), ("[::1]", True), ("localhost", True), ("0.0.0.0", False),
     ("::", False), ("192.168.1.5", False), ("localhost.example", False), ("", False)],
)  # fmt: skip
def test_what_is_loopback(host: str, near: bool) -> None:
    assert is_loopback(host) is near


def test_another_host_needs_the_token_of_the_address(room: AVLMap) -> None:
    for server in serving(ViewSession([room]), "0.0.0.0"):
        call = caller(server)
        assert server.token is not None and len(server.token) >= 32
        query = urlsplit(server.url).query
        assert call("/")[0] == call("/api/maps")[0] == call("/?token=wrong")[0] == call("/?token=%ff")[0] == 403
        assert call("/api/maps", Cookie="avlmaps_view=wrong")[0] == 403
        status, headers, _ = call(f"/?{query}")
        assert status == 303 and headers["location"] == "/", "the token leaves the address"
        cookie = headers["set-cookie"]
        assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
        assert call("/", Cookie=cookie.partition(";")[0])[0] == 200


def test_a_port_that_is_taken_is_one_sentence(served: ViewServer, room: AVLMap) -> None:
    port = served.server_address[1]
    with pytest.raises(QueryError, match=rf"cannot listen on 127\.0\.0\.1, port {port}: .*Choose another --port"):
        ViewServer(ViewSession([room]), "127.0.0.1", port)
    with pytest.raises(QueryError, match=r"cannot listen on no\.such.host.invalid"):
        ViewServer(ViewSession([room]), "no.such.host.invalid", 0)


def test_old_uploads_are_forgotten_and_the_folder_goes_with_the_session(room: AVLMap, call: Call) -> None:
    session = ViewSession([room])
    jpeg = call("/api/maps/0/keyframes/0")[2]
    numbers = [session.upload("photo", f"{k}.jpg", jpeg) for k in range(15)]
    folder = session._folder
    assert folder is not None and len(list(folder.iterdir())) == 12
    with pytest.raises(QueryError, match="choose it again"):
        session.ask("", photo=numbers[0])
    session.close()
    assert not folder.exists()


def test_two_maps_are_asked_together(room: AVLMap) -> None:
    session = ViewSession([room, AVLMap(room.stored)])
    told, heat = session.ask("the red thing")
    first, second = ([goal["position"] for goal in answer["goals"]] for answer in told["answers"])
    assert first == second and len(heat) == 2 * len(room.points)


def test_memory_stays_flat_over_many_questions(room: AVLMap) -> None:
    import gc
    import tracemalloc

    session = ViewSession([room])
    words = ["the red thing", "the blue thing near the red thing", "the sound of rain", "how many red things are there"]
    for sentence in words:
        session.ask(sentence)
    tracemalloc.start()
    sizes = []
    for _ in range(5):
        for k in range(12):
            session.ask(words[k % 4])
        gc.collect()
        sizes.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    # What leaks grows in every round; what other threads of the tests hold comes and goes.
    assert np.diff(sizes).min() < 50_000, sizes


@pytest.fixture
def planned(posted) -> Iterator[dict[str, Any]]:
    status, told = posted("/api/go", command="go to the red thing, then wait 30 seconds and turn left", again="yes")
    assert status == 200, told
    yield told


def test_a_command_is_read_and_planned_and_nothing_drives_without_a_scene(planned: dict[str, Any]) -> None:
    assert planned["driven"] is None and planned["planned"]["ok"] is True
    assert "move_to" in planned["program"] and planned["plan"] and planned["readings"]
    places = np.array(planned["planned"]["places"])
    steps_m = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert steps_m.max() <= 0.1 + 1e-3, "it goes in the steps of the robot"
    assert planned["planned"]["path_m"] == pytest.approx(float(steps_m.sum()), abs=0.01)


def test_a_plan_lets_no_time_pass(posted, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps.navigate.skills.sleep", lambda seconds: pytest.fail(f"it sleeps {seconds} s"))
    status, told = posted("/api/go", command="wait 500 seconds")
    assert status == 200 and "wait" in told["program"] and told["planned"]["error"] is None


def test_a_command_begins_where_the_last_one_ended(posted, planned: dict[str, Any]) -> None:
    _, told = posted("/api/go", command="turn left")
    np.testing.assert_allclose(told["planned"]["places"][0], planned["planned"]["places"][-1], atol=1e-3)


def test_a_command_that_is_refused_says_why(posted) -> None:
    status, said = posted("/api/go", command="gabble gabble the")
    assert status == 400 and said["error"]["message"]


def test_a_program_reads_no_file_of_the_server(posted, tmp_path: Path) -> None:
    status, said = posted("/api/go", command='go to where the photo "/etc/hostname.png" was taken')
    told = said["error"]["message"] if status == 400 else said["planned"]["error"]
    assert told
