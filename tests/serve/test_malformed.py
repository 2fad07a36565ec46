"""Whatever bytes a client sends, the answer is JSON with a status that blames the client, and the server goes on."""

import json
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from avlmaps.serve.lanes import RequestError
from avlmaps.serve.requests import AskQuery, PathQuery, PlaceQuery, ThingsQuery, attachments, read
from avlmaps.serve.settings import Limits

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=12,
)
TYPES = st.sampled_from(
    ["application/json", "multipart/form-data", "multipart/form-data; boundary=x", "image/png", "text/plain", "", ";"]
)
slow = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def is_refused(response: Any) -> None:
    assert 400 <= response.status_code < 500, response.text
    assert set(response.json()["error"]) == {"kind", "message"} and "Traceback" not in response.text


@slow
@given(st.binary(max_size=200), TYPES)
def test_bytes_that_mean_nothing_are_refused(client: TestClient, body: bytes, kind: str) -> None:
    for path in ("locate", "ask"):
        is_refused(client.post(f"/maps/room/{path}", content=body, headers={"content-type": kind}))


@slow
@given(st.binary(max_size=120), st.binary(max_size=60))
def test_damaged_forms_are_refused(client: TestClient, inside: bytes, after: bytes) -> None:
    body = b'--x\r\nContent-Disposition: form-data; name="photo"; filename="a"\r\n\r\n' + inside + b"\r\n--x--" + after
    headers = {"content-type": "multipart/form-data; boundary=x"}
    is_refused(client.post("/maps/room/locate", content=body, headers=headers))


@given(JSON)
def test_json_is_a_request_or_an_error_of_the_client(value: Any) -> None:
    values = value if isinstance(value, dict) else {"sentence": value}
    for kind in (AskQuery, ThingsQuery, PlaceQuery, PathQuery):
        try:
            request = read(values, kind)
        except RequestError as error:
            assert error.status == 400
        else:
            assert isinstance(request, kind)


@given(
    st.binary(max_size=400),
    st.sampled_from([b"", b"RIFF", b"fLaC", b"OggS", b"ID3", b"\x1a\x45\xdf\xa3", b"\x89PNG\r\n\x1a\n"]),
)
def test_files_that_are_no_files_are_refused(content: bytes, magic: bytes) -> None:
    for files in ({"photo": magic + content}, {"clip": magic + content}):
        try:
            attachments(files, Limits())
        except RequestError as error:
            assert error.status in (413, 415) and "/tmp" not in json.dumps(str(error))
        else:
            raise AssertionError("random bytes were taken for a file")
