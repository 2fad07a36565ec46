"""`avlmaps profiles --fetch light`: whole or not at all, from a page on this machine or a folder; no network."""

import json
import threading
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, find, forget_loaded, load
from avlmaps.perception.conformance import example_frame
from avlmaps.perception.models import ModelSettings, availability, using_models
from avlmaps_models.light import bundle as files
from avlmaps_models.light import fetch
from avlmaps_models.light.fetch import fetch_light
from helpers.light_files import write_light


class Page:
    """A server of a folder; a test may have it answer something else."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.asked = folder, list[str]()
        self.moved = ""
        page = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                page.answer(self)

            def log_message(self, *words: Any) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/files"

    def answer(self, handler: BaseHTTPRequestHandler) -> None:
        name = handler.path.rpartition("/")[2]
        self.asked.append(name)
        path = self.folder / name
        if self.moved:
            handler.send_response(302)
            handler.send_header("Location", self.moved + name)
            handler.end_headers()
        elif not path.is_file():
            handler.send_error(404)
        else:
            handler.send_response(200)
            handler.end_headers()
            handler.wfile.write(path.read_bytes())

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Page]:
    monkeypatch.setenv("AVLMAPS_HOME", str(tmp_path / "home"))
    for name in ("AVLMAPS_MODELS", fetch.PLACE_VARIABLE, "http_proxy", "HTTP_PROXY"):
        monkeypatch.delenv(name, raising=False)
    served = Page(write_light(tmp_path / "published"))
    yield served
    served.close()
    forget_loaded()


@pytest.fixture
def models(tmp_path: Path) -> Iterator[Path]:
    folder = tmp_path / "models"
    folder.mkdir()
    with using_models(ModelSettings(folder=folder)):
        yield folder


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def refused(place: str) -> str:
    with pytest.raises(BackendError) as stop:
        fetch_light(place)
    said = str(stop.value)
    assert "\n" not in said
    return said


def test_a_page_is_fetched_once_and_then_used(page: Page, models: Path) -> None:
    found = fetch_light(page.url)
    assert found.folder == models / files.MODEL
    assert contents(found.folder) == contents(page.folder)
    assert found.received_bytes == sum(note.bytes for note in found.manifest.files.values())
    assert [path.name for path in found.folder.parent.iterdir()] == [found.folder.name], "nothing else is left"
    assert availability(find(Kind.PIXELS, "light")).state == "ready"
    assert load(Kind.PIXELS, "light").encode(example_frame()).shape[2] == 8
    page.asked.clear()
    assert fetch_light(page.url).received_bytes == 0
    assert page.asked == [files.MANIFEST]


def test_files_that_were_damaged_since_are_fetched_again(page: Page, models: Path) -> None:
    folder = fetch_light(page.url).folder
    content = bytearray((folder / files.SOUNDS).read_bytes())
    content[50] ^= 4
    (folder / files.SOUNDS).write_bytes(content)
    assert fetch_light(page.url).received_bytes > 0
    assert contents(folder) == contents(page.folder)


def test_a_folder_will_do_and_no_folder_of_models_is_the_users_own(page: Page, tmp_path: Path) -> None:
    found = fetch_light(str(page.folder))
    assert found.folder == tmp_path / "home" / "models" / files.MODEL
    assert load(Kind.VIEWS, "light").card.dim == 8
    assert availability(find(Kind.SOUNDS, "light")).state == "ready"


def test_another_content_is_refused_and_removed_and_the_old_files_stay(page: Page, models: Path) -> None:
    before = contents(fetch_light(page.url).folder)
    said = json.loads((page.folder / files.MANIFEST).read_text())
    said["measured"] = {"another": 1.0}
    (page.folder / files.MANIFEST).write_text(json.dumps(said))
    content = bytearray((page.folder / files.SOUNDS).read_bytes())
    content[50] ^= 4
    (page.folder / files.SOUNDS).write_bytes(content)
    assert "is not the file that the manifest describes" in refused(page.url)
    assert contents(models / files.MODEL) == before
    content[50] ^= 4
    (page.folder / files.SOUNDS).write_bytes(content)
    assert fetch_light(page.url).manifest.measured == {"another": 1.0}
    assert contents(models / files.MODEL) == contents(page.folder)


@pytest.mark.parametrize("change", [b"more", None])
def test_a_file_of_another_length_is_refused(page: Page, models: Path, change: bytes | None) -> None:
    path = page.folder / files.KNOWN_WORDS
    path.write_bytes(path.read_bytes() + change if change else path.read_bytes()[:-7])
    assert "is not the file that the manifest describes" in refused(page.url)
    assert not (models / files.MODEL).exists()


def no_file(page: Page) -> str:
    (page.folder / files.SOUND_WORDS).unlink()
    return page.url


def no_manifest(page: Page) -> str:
    (page.folder / files.MANIFEST).unlink()
    return page.url


def no_server(page: Page) -> str:
    page.close()
    return page.url


def no_manifest_of_ours(page: Page) -> str:
    (page.folder / files.MANIFEST).write_bytes(b"<html>")
    return page.url


def a_path_in_a_name(page: Page) -> str:
    said = json.loads((page.folder / files.MANIFEST).read_text())
    said["files"]["../../evil"] = said["files"].pop(files.SOUNDS)
    (page.folder / files.MANIFEST).write_text(json.dumps(said))
    return page.url


def a_redirection_to_a_plain_page(page: Page) -> str:
    page.moved = "http://example.org/"
    return page.url


FAULTS: dict[Callable[[Page], str], str] = {
    no_file: "404",
    no_manifest: "404",
    no_server: "cannot be read",
    no_manifest_of_ours: "is no manifest of the profile light",
    a_path_in_a_name: "names the files ../../evil",
    a_redirection_to_a_plain_page: "only https is",
    lambda page: "http://example.org/light": "only https is",
    lambda page: "ftp://example.org/light": "only https is",
    lambda page: "": "No files of the profile light are published yet",
    lambda page: str(page.folder / "nowhere"): "cannot be read",
}


@pytest.mark.parametrize("fault", FAULTS, ids=lambda f: f.__name__)
def test_each_fault_is_one_sentence(page: Page, models: Path, fault: Callable[[Page], str]) -> None:
    assert FAULTS[fault] in refused(fault(page))
    assert not (models / files.MODEL).exists()


def test_a_folder_that_cannot_be_written_is_one_sentence(page: Page, models: Path) -> None:
    (models / "avlmaps").write_text("a file where a folder belongs")
    assert "cannot be written" in refused(page.url)
