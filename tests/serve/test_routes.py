"""Each address of the server, without a network: its answer is that of the package and fits the OpenAPI document."""

import base64
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import soundfile
from jsonschema import Draft202012Validator
from PIL import Image
from starlette.testclient import TestClient

from avlmaps.cli.info import describe_path
from avlmaps.core.printable import shortened
from avlmaps.core.version import __version__
from avlmaps.query.avlmap import AVLMap
from avlmaps.serve.drawn import HEADER
from avlmaps.serve.operations import OPERATIONS
from avlmaps.serve.service import Service
from avlmaps.serve.settings import Limits, ServeSettings
from helpers.walked_room import RATE_HZ, beeps


@pytest.fixture(scope="module")
def document(client: TestClient) -> dict[str, Any]:
    return client.get("/openapi.json").json()


@pytest.fixture(scope="module")
def opened(room: Path) -> AVLMap:
    return AVLMap.open(room)


@pytest.fixture(scope="module")
def photo(walk: Path) -> bytes:
    return sorted((walk / "rgb").iterdir())[5].read_bytes()


@pytest.fixture(scope="module")
def clip() -> bytes:
    stream = io.BytesIO()
    soundfile.write(stream, beeps(1.5, 2050.0), RATE_HZ, format="WAV")
    return stream.getvalue()


def plain(answer: dict[str, Any]) -> dict[str, Any]:
    """Return an answer without its time, as JSON gives it back."""
    return json.loads(json.dumps(shortened({key: value for key, value in answer.items() if key != "elapsed_ms"})))


def conforms(document: dict[str, Any], path: str, answer: Any, status: str = "200", method: str = "get") -> None:
    """Hold an answer to the document's schema of it."""
    described = document["paths"][path][method]["responses"][status]
    schema = described["content"]["application/json"]["schema"]
    Draft202012Validator({**schema, "components": document["components"]}).validate(answer)


def error_of(response: Any, status: int) -> dict[str, str]:
    assert response.status_code == status, response.text
    assert set(response.json()) == {"error"}
    return response.json()["error"]


def test_the_document_is_openapi_3_1_and_describes_every_route(document: dict[str, Any], client: TestClient) -> None:
    assert document["openapi"] == "3.1.0"
    described = {(path, method) for path, item in document["paths"].items() for method in item}
    paths = [(one.path, one.methods) for one in OPERATIONS if one.path is not None]
    wanted = {(f"/maps/{{map}}{path}", method.lower()) for path, methods in paths for method in methods}
    assert described == wanted | {("/maps", "get"), ("/health", "get")}
    names = [item[method]["operationId"] for item in document["paths"].values() for method in item]
    assert len(names) == len(set(names))
    for schema in document["components"]["schemas"].values():
        Draft202012Validator.check_schema(schema)
    text = json.dumps(document)
    for reference in {part.split('"')[0] for part in text.split('"$ref": "#/components/schemas/')[1:]}:
        assert reference in document["components"]["schemas"]
    assert client.get("/health").json()["status"] == "ok"


def test_the_page_lists_every_operation_and_loads_nothing_from_elsewhere(client: TestClient) -> None:
    page = client.get("/")
    assert page.status_code == 200
    for one in (one for one in OPERATIONS if one.path is not None):
        assert one.about.replace("'", "&#x27;") in page.text
    assert f"curl -G {str(client.base_url).rstrip('/')}/maps/NAME/ask" in page.text, "its own address, to paste"
    assert "<script" not in page.text
    assert not [word for word in page.text.split('"') if word.startswith(("http:", "https:", "//"))]
    assert page.headers["content-security-policy"].startswith("default-src 'none'")


def test_maps_are_listed_and_described_as_info_does(
    client: TestClient, document: dict[str, Any], opened: AVLMap, room: Path
) -> None:
    answer = client.get("/maps").json()
    conforms(document, "/maps", answer)
    (entry,) = answer["maps"]
    assert (entry["name"], entry["voxels"], entry["stale"]) == ("room", len(opened.space), False)
    assert client.get("/maps/room").json() == plain({**describe_path(room), "path": "room"})


def test_contents_are_those_of_things(client: TestClient, document: dict[str, Any], opened: AVLMap) -> None:
    answer = client.get("/maps/room/contents", params={"least": 0.2}).json()
    conforms(document, "/maps/{map}/contents", answer)
    assert answer == plain(opened.contents(0.2).to_json("room"))
    for part in ("things", "sounds", "rooms"):
        alone = client.get(f"/maps/room/{part}", params={"least": 0.2} if part == "things" else {}).json()
        conforms(document, f"/maps/{{map}}/{part}", alone)
        assert alone == {"map": "room", "frame": "recording", part: answer[part]}
    assert answer["things"] and len(answer["sounds"]) == 1


QUERIES = (
    {"object": "red thing", "top": 5},
    {"sentence": "the red thing near the sound of beeping", "top": 2},
    {"sentence": "how many red things are there"},
    {"object": "red thing", "sound": "beeping", "primary": "sound"},
)


@pytest.mark.parametrize("query", QUERIES)
def test_a_query_has_one_answer_by_every_method(
    client: TestClient, document: dict[str, Any], query: dict[str, Any]
) -> None:
    answers = [
        client.get("/maps/room/ask", params=query),
        client.post("/maps/room/ask", json=query),
        client.post("/maps/room/ask", data={name: str(value) for name, value in query.items()}),
        client.post("/maps/room/ask", params=query),
    ]
    assert [answer.status_code for answer in answers] == [200] * 4, [answer.text for answer in answers]
    for answer in answers:
        conforms(document, "/maps/{map}/ask", answer.json())
        assert plain(answer.json()) == plain(answers[0].json())


def test_a_photo_and_a_clip_are_taken_from_the_form(client: TestClient, photo: bytes, clip: bytes) -> None:
    answer = client.post(
        "/maps/room/ask",
        data={"sentence": "the red thing near this image and near this recording", "top": "1"},
        files={"photo": ("../../etc/passwd", photo), "clip": ("/etc/shadow", clip)},
    )
    assert answer.status_code == 200, answer.text
    parts = answer.json()["parts"]
    assert [part["modality"] for part in parts] == ["object", "image", "sound"]
    assert [part["query"] for part in parts[1:]] == ["photo", "clip"] and parts[1]["found"]
    assert "/etc" not in answer.text


def test_a_photo_is_located_by_form_and_by_body(
    client: TestClient, document: dict[str, Any], opened: AVLMap, photo: bytes
) -> None:
    bgr = cv2.imdecode(np.frombuffer(photo, np.uint8), cv2.IMREAD_COLOR)
    expected = opened.locate(bgr[..., ::-1].copy()).world_from_camera
    assert expected is not None
    for answer in (
        client.post("/maps/room/locate", files={"photo": photo}),
        client.post("/maps/room/locate", json={"photo": base64.b64encode(photo).decode()}),
        client.post("/maps/room/locate", content=photo, headers={"content-type": "image/png"}),
        client.post("/maps/room/locate", files={"photo": photo}, data={"intrinsics": "160,160,120,90"}),
    ):
        assert answer.status_code == 200, answer.text
        conforms(document, "/maps/{map}/locate", answer.json(), method="post")
        np.testing.assert_allclose(answer.json()["world_from_camera"], expected, atol=0.02)


def test_a_place_is_described(client: TestClient, document: dict[str, Any], opened: AVLMap) -> None:
    thing = opened.things(least_confidence=0.1)[0]
    x, y, z = thing.position
    answer = client.get("/maps/room/place", params={"x": x, "y": y, "z": z}).json()
    conforms(document, "/maps/{map}/place", answer)
    assert answer["known"] and answer["distance_m"] == pytest.approx(0.0, abs=1e-6)
    assert thing.name in [one["name"] for one in answer["names"]] and answer["last_seen_s"] is not None
    above = client.get("/maps/room/place", params={"x": x, "y": y}).json()
    assert above["known"]
    far = client.get("/maps/room/place", params={"x": 900, "y": 900, "z": 0}).json()
    assert (far["known"], far["voxels"], far["names"], far["last_seen_s"]) == (False, 0, [], None)


def test_a_path_leads_over_the_floor_from_one_place_to_the_other(
    client: TestClient, document: dict[str, Any], opened: AVLMap
) -> None:
    cameras = np.asarray(opened.data.keyframes.world_from_camera)[:, :3, 3]
    ends = [",".join(f"{value:.3f}" for value in cameras[k]) for k in (0, -1)]
    answer = client.get("/maps/room/path", params={"from": ends[0], "to": ends[1]}).json()
    conforms(document, "/maps/{map}/path", answer)
    assert answer["found"]
    points = np.array(answer["points"])
    assert np.linalg.norm(points[0, :2] - cameras[0, :2]) < 1.1
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert answer["length_m"] == pytest.approx(length, abs=1e-6)
    off = client.get("/maps/room/path", params={"from": ends[0], "to": "500,500"}).json()
    conforms(document, "/maps/{map}/path", off)
    assert (off["found"], off["points"]) == (False, []) and "outside" in off["note"]


@pytest.mark.parametrize("size", ["small", "full"])
def test_pictures_are_png(client: TestClient, size: str) -> None:
    drawn = [
        client.get("/maps/room/picture", params={"size": size}),
        client.get("/maps/room/picture", params={"size": size, "sentence": "the red thing"}),
    ]
    pictures = [cv2.imdecode(np.frombuffer(one.content, np.uint8), cv2.IMREAD_COLOR) for one in drawn]
    assert [one.headers["content-type"] for one in drawn] == ["image/png"] * 2
    assert all(one is not None and min(one.shape[:2]) > 40 for one in pictures)
    assert drawn[0].content != drawn[1].content


def test_tiles_hold_every_voxel(client: TestClient, document: dict[str, Any], opened: AVLMap) -> None:
    listed = client.get("/maps/room/tiles").json()
    conforms(document, "/maps/{map}/tiles", listed)
    level, total = listed["levels"][0], 0
    for i, j, k, count in level["tiles"]:
        tile = client.get(f"/maps/room/tiles/0/{i}/{j}/{k}")
        assert HEADER.unpack_from(tile.content)[-1] == count
        total += count
    assert total == len(opened.space)
    tag = tile.headers["etag"]
    assert __version__ in tag, "another release may answer another way"
    assert client.get(f"/maps/room/tiles/0/{i}/{j}/{k}", headers={"if-none-match": tag}).status_code == 304
    hot = client.get(f"/maps/room/tiles/0/{i}/{j}/{k}", params={"heat": "the red thing"})
    assert HEADER.unpack_from(hot.content)[3] == 7


def test_progress_comes_as_events_and_the_answer_last(client: TestClient) -> None:
    params = {"least": 0.123}
    with client.stream("GET", "/maps/room/things", params=params, headers={"accept": "text/event-stream"}) as got:
        blocks = [block for block in got.read().decode().split("\n\n") if block and not block.startswith(":")]
    events = [dict(line.split(": ", 1) for line in block.split("\n")) for block in blocks]
    assert [event["event"] for event in events[:2]] == ["progress", "progress"]
    assert events[-1]["event"] == "answer"
    assert json.loads(events[-1]["data"]) == client.get("/maps/room/things", params=params).json()
    steps = [json.loads(event["data"]) for event in events[:-1]]
    done = [step["done"] for step in steps if step["stage"] == "things"]
    assert done == sorted(done) and len(done) > 2


ERRORS: tuple[tuple[str, Callable[[TestClient], Any], int, str, str], ...] = (
    ("no map", lambda c: c.get("/maps/nope/ask?sentence=chair"), 404, "map-name", "room"),
    ("no address", lambda c: c.get("/nothing"), 404, "usage", "/ lists"),
    ("a method", lambda c: c.delete("/maps/room/ask"), 405, "usage", "method"),
    ("twice", lambda c: c.get("/maps/room/ask?sentence=a&sentence=b"), 400, "usage", "twice"),
    ("a wrong name", lambda c: c.get("/maps/room/ask?sentenc=a"), 400, "usage", "sentenc"),
    ("a wrong type", lambda c: c.get("/maps/room/ask?sentence=a+chair&top=many"), 400, "usage", "top"),
    ("out of range", lambda c: c.get("/maps/room/ask?sentence=a+chair&top=0"), 400, "usage", "top"),
    ("no number", lambda c: c.get("/maps/room/things?least=nan"), 400, "usage", "least"),
    ("not understood", lambda c: c.get("/maps/room/ask?sentence=why"), 422, "query", "chair"),
    ("empty part", lambda c: c.get("/maps/room/ask?object="), 400, "usage", "sentence"),
    ("a long sentence", lambda c: c.post("/maps/room/ask", json={"sentence": "x" * 501}), 400, "usage", "500"),
    ("no JSON", lambda c: c.post("/maps/room/ask", content=b"{", headers={"content-type": "application/json"}), 400,
     "usage", "JSON"),
    ("a list", lambda c: c.post("/maps/room/ask", json=["chair"]), 400, "usage", "object"),
    ("another body", lambda c: c.post("/maps/room/ask", content=b"x", headers={"content-type": "text/csv"}), 415,
     "usage", "text/csv"),
    ("values at two places", lambda c: c.post("/maps/room/ask?top=1", json={"object": "red"}), 400, "usage", "both"),
    ("another file", lambda c: c.post("/maps/room/ask", files={"map": b"x"}), 400, "usage",
     "photo and clip"),
    ("no photo in the file", lambda c: c.post("/maps/room/locate", files={"photo": b"hello"}), 415, "photo", "PNG"),
    ("no photo at all", lambda c: c.post("/maps/room/locate", data={"intrinsics": "1,1,1,1"}), 400, "usage", "photo"),
    ("no clip in the file", lambda c: c.post("/maps/room/ask", files={"clip": b"#EXTM3U\n/etc/passwd"}), 415, "clip",
     "wav"),
    ("a list of files as a clip", lambda c: c.post("/maps/room/ask", files={"clip": b"ffconcat version 1.0\n"}), 415,
     "clip", "wav"),
    ("a cut clip", lambda c: c.post("/maps/room/ask", files={"clip": b"RIFF\x00\x00\x00\x00WAVE"}), 415,
     "clip", "clip"),
    ("a photo that the words lack", lambda c: c.get("/maps/room/ask?sentence=where+was+this+photo+taken"), 422, "query",
     "Attach it"),
    ("a photo that the words do not mean", lambda c: c.post("/maps/room/ask", data={"sentence": "the red photo"},
     files={"photo": b"x"}), 415, "photo", "PNG"),
    ("a place without y", lambda c: c.get("/maps/room/place?x=1"), 400, "usage", "y"),
    ("a far place", lambda c: c.get("/maps/room/place?x=1e300&y=1"), 400, "usage", "x"),
    ("no place", lambda c: c.get("/maps/room/path?from=here&to=1,2"), 400, "usage", "here"),
    ("no tile", lambda c: c.get("/maps/room/tiles/0/999/0/0"), 404, "tile", "tiles"),
    ("no number of a tile", lambda c: c.get("/maps/room/tiles/a/0/0/0"), 400, "usage", "level"),
    ("no sound", lambda c: c.get("/maps/room/sounds/7/clip"), 404, "usage", "1 sounds"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("call", "status", "kind", "says"), [row[1:] for row in ERRORS], ids=[row[0] for row in ERRORS]
)
def test_each_error_is_json_with_one_sentence(
    client: TestClient, room: Path, call: Callable[[TestClient], Any], status: int, kind: str, says: str
) -> None:
    response = call(client)
    error = error_of(response, status)
    assert error["kind"] == kind and says in error["message"]
    assert str(room.parent) not in response.text and "Traceback" not in response.text


def test_a_picture_that_unfolds_to_gigabytes_is_refused_by_its_header(client: TestClient) -> None:
    done, tiny = cv2.imencode(".png", np.zeros((1, 1, 3), np.uint8))
    assert done
    import struct
    import zlib

    header = b"IHDR" + struct.pack(">II", 60000, 60000) + b"\x08\x02\x00\x00\x00"
    bomb = b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + struct.pack(">I", zlib.crc32(header))
    error = error_of(client.post("/maps/room/locate", files={"photo": bomb + tiny.tobytes()[33:]}), 413)
    assert "60000x60000" in error["message"]


def test_a_full_queue_and_a_slow_query_are_answered_so(service: Service, serving: Callable[..., TestClient]) -> None:
    from dataclasses import replace

    from avlmaps.serve.lanes import Lane

    slow = replace(service, slow=Lane("t", 1, 0, 1e-4))
    assert error_of(serving(slow).get("/maps/room/contents?least=0.31"), 504)["kind"] == "timeout"
    full = replace(service, quick=Lane("t", 1, -1, 1.0))
    refused = serving(full).get("/maps/room/ask?sentence=the+red+thing")
    assert error_of(refused, 503)["kind"] == "busy" and refused.headers["retry-after"] == "1"


def test_a_fault_of_ours_shows_nothing_of_itself(
    service: Service, serving: Callable[..., TestClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("/secret/path and a token")

    monkeypatch.setattr("avlmaps.query.avlmap.AVLMap.ask", broken)
    response = serving(service).get("/maps/room/ask?sentence=the+red+thing")
    assert error_of(response, 500)["kind"] == "internal" and "secret" not in response.text


@pytest.mark.parametrize("method", ["GET", "DELETE", "PUT"])
def test_agents_are_served_by_post_alone(client: TestClient, method: str) -> None:
    refused = client.request(method, "/mcp", headers={"accept": "text/event-stream"})
    assert (refused.status_code, refused.headers["allow"]) == (405, "POST")


def test_a_further_application_stands_behind_the_same_guard(
    service: Service, serving: Callable[..., TestClient]
) -> None:
    from starlette.applications import Starlette
    from starlette.responses import PlainTextResponse
    from starlette.routing import Route

    app = Starlette(routes=[Route("/state", lambda _: PlainTextResponse("driving"))])
    settings = ServeSettings(token="a-token-of-some-length", limits=Limits())
    client = serving(service, settings, mounts={"/drive": app}, agents=False)
    assert client.get("/drive/state").status_code == 401
    assert client.get("/drive/state", headers={"authorization": "Bearer a-token-of-some-length"}).text == "driving"
    assert client.get("/mcp", headers={"authorization": "Bearer a-token-of-some-length"}).status_code == 404


def test_the_focal_length_of_an_uploaded_photo_is_that_of_its_exif(client: TestClient, photo: bytes) -> None:
    exif, stream = Image.Exif(), io.BytesIO()
    exif.get_ifd(0x8769)[0xA405] = 36
    Image.open(io.BytesIO(photo)).save(stream, "JPEG", exif=exif, quality=98)
    noted = client.post("/maps/room/locate", files={"photo": stream.getvalue()}).json()
    given = {"intrinsics": "160,160,120,90"}
    sure = client.post("/maps/room/locate", files={"photo": stream.getvalue()}, data=given).json()
    assert noted["focal_from"] in ("exif", "photo") and sure["focal_from"] == "given"
