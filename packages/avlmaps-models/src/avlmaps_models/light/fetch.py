"""Fetching the files of the profile ``light``: from a page or a folder, once, whole or not at all.

Nothing is published yet, so there is no default place: a person who has made the files (``python -m training.light``)
says where they are. A download that broke off resumes where it stopped. Each file is held to the manifest's SHA-256,
and the folder gets its name only when all of them are right; until then no model is there.
"""

import hashlib
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from http.client import HTTPException, HTTPResponse
from pathlib import Path
from typing import BinaryIO, cast
from urllib.error import HTTPError, URLError
from urllib.parse import quote, urlsplit
from urllib.request import HTTPRedirectHandler, Request, build_opener

from avlmaps.core.errors import BackendError
from avlmaps.core.files import DESCRIPTION_BYTES, sync_folder, user_path
from avlmaps.core.network import is_loopback
from avlmaps.core.progress import progress
from avlmaps.core.version import __version__
from avlmaps.core.wording import option
from avlmaps.perception.models.files import fetched_folder
from avlmaps.perception.models.settings import model_settings
from avlmaps_models.common.checksums import remembered_sha256
from avlmaps_models.light.bundle import MANIFEST, MODEL, FileNote, Manifest, parse_manifest

PLACE_VARIABLE = "AVLMAPS_LIGHT_FROM"
_BLOCK = 1 << 20
_TIMEOUT_S = 30.0
_SPARE_BYTES = 50_000_000
_PARTIAL_CONTENT = 206
_TRIES = 3


@dataclass(frozen=True, slots=True)
class Fetched:
    """What was fetched.

    Attributes:
        folder: where the files lie.
        manifest: what they are.
        received_bytes: how much came now; 0 where all was here.
    """

    folder: Path
    manifest: Manifest
    received_bytes: int


def fetch_light(place: str = "") -> Fetched:
    """Bring the files into the folder of models (the user's own where the settings name none).

    Args:
        place: a URL or a folder that holds ``manifest.json``; by default what AVLMAPS_LIGHT_FROM says.

    Raises:
        BackendError: no place is given, it cannot be reached, a file is missing or not the manifest's, or there is too
            little room.
    """
    place = place or os.environ.get(PLACE_VARIABLE, "")
    if not place:
        raise BackendError(
            "No files of the profile light are published yet; make them with python -m training.light (docs/guides/"
            f"light.md), then fetch them with {option('from', 'URL|DIR')} or {PLACE_VARIABLE}."
        )
    source = _page(place) if "://" in place else _Folder(user_path(place))
    content = source.small(MANIFEST)
    manifest = parse_manifest(content, source.said(MANIFEST))
    target = (model_settings().folder or fetched_folder()) / MODEL
    if _same(target, content, manifest):
        return Fetched(target, manifest, 0)
    partial = target.with_name(f".{target.name}.partial")
    try:
        if partial.is_symlink():
            partial.unlink()
        partial.mkdir(parents=True, exist_ok=True)
        _require_room(partial, manifest)
        received = _bring_all(source, manifest, partial)
        (partial / MANIFEST).write_bytes(content)
        for path in partial.iterdir():  # what an earlier manifest left
            if path.name not in {*manifest.files, MANIFEST}:
                path.unlink()
        _put(partial, target)
    except OSError as fault:
        raise BackendError(
            f"The files cannot be written to {target} ({fault.strerror or fault}); make room or choose another folder "
            f"({option('models', 'DIR')})."
        ) from fault
    return Fetched(target, manifest, received)


class _Folder:
    """Files of a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def said(self, name: str) -> str:
        return str(self._folder / name)

    def small(self, name: str) -> bytes:
        """Return a small file."""
        with self._open(name) as stream:
            return stream.read(DESCRIPTION_BYTES)

    def blocks(self, name: str, start: int) -> Iterator[bytes]:
        """Yield a file from a byte on."""
        with self._open(name) as stream:
            stream.seek(start)
            while block := stream.read(_BLOCK):
                yield block

    def _open(self, name: str) -> BinaryIO:
        try:
            return (self._folder / name).open("rb")
        except OSError as fault:
            raise BackendError(
                f"{self._folder / name} cannot be read ({fault.strerror or fault}); name the folder that python -m "
                f"training.light wrote ({option('from', 'DIR')})."
            ) from fault


class _Page:
    """Files below a URL."""

    def __init__(self, url: str) -> None:
        self._url = url.rstrip("/") + "/"
        self._opener = build_opener(_SameScheme)

    def said(self, name: str) -> str:
        return self._url + name

    def small(self, name: str) -> bytes:
        """Return a small file."""
        with closing(self._open(name, 0)) as answer:
            return answer.read(DESCRIPTION_BYTES)

    def blocks(self, name: str, start: int) -> Iterator[bytes]:
        """Yield a file from a byte on; a connection that breaks off is taken up again."""
        for attempt in range(_TRIES):
            try:
                with closing(self._open(name, start)) as answer:
                    left = start if start and answer.status != _PARTIAL_CONTENT else 0  # it begins at the beginning
                    due = int(answer.headers.get("Content-Length") or 0)
                    while block := answer.read(_BLOCK):
                        due -= len(block)
                        new, left = block[min(left, len(block)) :], max(left - len(block), 0)
                        start += len(new)
                        if new:
                            yield new
                    if due <= 0:
                        return
                    raise ConnectionResetError(f"{due:,} bytes were due")
            except (OSError, HTTPException) as fault:
                if attempt == _TRIES - 1:
                    raise BackendError(
                        f"{self.said(name)} broke off after {start:,} bytes ({fault}); run the same command again, it "
                        "resumes there."
                    ) from fault
                time.sleep(attempt + 1.0)

    def _open(self, name: str, start: int) -> HTTPResponse:
        headers = {"User-Agent": f"avlmaps/{__version__}", "Accept-Encoding": "identity"}
        if start:
            headers["Range"] = f"bytes={start}-"
        request = Request(self._url + quote(name), headers=headers)
        try:
            return cast(HTTPResponse, self._opener.open(request, timeout=_TIMEOUT_S))
        except HTTPError as fault:
            raise BackendError(
                f"{self.said(name)} cannot be fetched: the server answers {fault.code} {fault.reason}; look at the "
                f"address ({option('from', 'URL')})."
            ) from fault
        except (URLError, OSError, HTTPException, ValueError) as fault:
            why = getattr(fault, "reason", fault)
            raise BackendError(
                f"{self.said(name)} cannot be reached ({why}): no network, or no such host; bring the folder from a "
                f"machine with a network and name it with {option('from', 'DIR')}."
            ) from fault


class _SameScheme(HTTPRedirectHandler):
    """Follows no redirection to a page that is not encrypted, or to a file."""

    def redirect_request(self, req, fp, code, msg, headers, newurl):
        _require_safe(newurl)
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _page(url: str) -> _Page:
    _require_safe(url)
    return _Page(url)


def _require_safe(url: str) -> None:
    parts = urlsplit(url)
    if parts.scheme == "https" or (parts.scheme == "http" and is_loopback(parts.hostname or "")):
        return
    raise BackendError(
        f"{url} is not fetched: only https is, or http on this machine; give another {option('from', 'URL')}."
    )


def _same(target: Path, content: bytes, manifest: Manifest) -> bool:
    """Return whether these very files are there already, whole."""
    try:
        if (target / MANIFEST).read_bytes() != content:
            return False
        return all(remembered_sha256(target / name) == note.sha256 for name, note in manifest.files.items())
    except OSError:
        return False


def _require_room(partial: Path, manifest: Manifest) -> None:
    here = sum(path.stat().st_size for path in partial.iterdir() if path.is_file())
    needed = sum(note.bytes for note in manifest.files.values()) - here + _SPARE_BYTES
    free = shutil.disk_usage(partial).free
    if needed > free:
        raise BackendError(
            f"The files need {needed / 1e6:.0f} MB in {partial.parent}, and {free / 1e6:.0f} MB are free; make room, "
            f"or choose another folder ({option('models', 'DIR')})."
        )


def _bring_all(source: "_Folder | _Page", manifest: Manifest, partial: Path) -> int:
    """Bring what is not here yet under one bar; return how many bytes came."""
    name, received = "", 0

    def arriving() -> Iterator[int]:
        nonlocal name
        for name, note in manifest.files.items():
            yield from _bring(source, name, note, partial)

    total = sum(-(-note.bytes // _BLOCK) for note in manifest.files.values())
    for came in progress(arriving(), "fetching", total=total, unit="MB", note=lambda: name):
        received += came
    return received


def _bring(source: "_Folder | _Page", name: str, note: FileNote, partial: Path) -> Iterator[int]:
    """Bring one file; yield for each block how many bytes came, 0 where it was here already."""
    path = partial / name
    digest, size = hashlib.sha256(), 0
    if path.is_file() and path.stat().st_size <= note.bytes:
        with path.open("rb") as stream:
            while block := stream.read(_BLOCK):
                digest.update(block)
                size += len(block)
                yield 0
    else:
        path.unlink(missing_ok=True)
    if size < note.bytes:
        with path.open("ab") as stream:
            for block in source.blocks(name, size):
                size += len(block)
                if size > note.bytes:
                    break
                stream.write(block)
                digest.update(block)
                yield len(block)
            stream.flush()
            os.fsync(stream.fileno())
    if size != note.bytes or digest.hexdigest() != note.sha256:
        path.unlink(missing_ok=True)
        raise BackendError(
            f"{source.said(name)} is not the file that the manifest describes ({size:,} bytes for {note.bytes:,}, or "
            "another checksum); it was removed, fetch it again or ask who published it."
        )


def _put(partial: Path, target: Path) -> None:
    """Give the folder its name; an older one steps aside first and is removed then."""
    old = target.with_name(f".{target.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if target.exists():
        target.rename(old)
    partial.rename(target)
    sync_folder(target.parent)
    shutil.rmtree(old, ignore_errors=True)
