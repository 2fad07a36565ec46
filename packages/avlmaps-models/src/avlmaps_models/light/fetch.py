"""Fetching the files of the profile ``light`` from a page or a folder: whole or not at all.

Nothing is published yet, so there is no default place: a person who has made the files (``python -m training.light``)
says where they are. Each file is held to the manifest's SHA-256, and the folder gets its name when all are right.
"""

import hashlib
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from http.client import HTTPException
from pathlib import Path
from urllib.parse import quote, urlsplit
from urllib.request import HTTPRedirectHandler, build_opener

from avlmaps.core.errors import BackendError
from avlmaps.core.files import sync_folder, user_path
from avlmaps.core.machine import is_loopback
from avlmaps.core.progress import progress
from avlmaps.core.wording import option
from avlmaps.perception.models import fetched_folder, model_settings
from avlmaps_models.common.checksums import remembered_sha256
from avlmaps_models.light.bundle import MANIFEST, MODEL, Manifest, parse_manifest

PLACE_VARIABLE = "AVLMAPS_LIGHT_FROM"
_TIMEOUT_S = 30.0


@dataclass(frozen=True, slots=True)
class Fetched:
    """Where the files lie, what they are, and how many bytes came now; 0 where all was here."""

    folder: Path
    manifest: Manifest
    received_bytes: int


def fetch_light(place: str = "") -> Fetched:
    """Bring the files into the folder of models (the user's own where the settings name none).

    Args:
        place: a URL or a folder that holds ``manifest.json``; by default what AVLMAPS_LIGHT_FROM says.

    Raises:
        BackendError: no place is given, it cannot be read, a file is not the manifest's, or it cannot be written.
    """
    place = place or os.environ.get(PLACE_VARIABLE, "")
    if not place:
        raise BackendError(
            "No files of the profile light are published yet; make them with python -m training.light (docs/guides/"
            f"light.md), then fetch them with {option('from', 'URL|DIR')} or {PLACE_VARIABLE}."
        )
    read = _reader(place)
    content = read(MANIFEST)
    manifest = parse_manifest(content, f"{place}/{MANIFEST}")
    target = (model_settings().folder or fetched_folder()) / MODEL
    partial, received = target.with_name(f".{target.name}.partial"), 0
    try:
        if (target / MANIFEST).is_file() and (target / MANIFEST).read_bytes() == content and _whole(target, manifest):
            return Fetched(target, manifest, 0)
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        for name, note in progress(manifest.files.items(), "fetching", unit="file"):
            came = read(name)
            if len(came) != note.bytes or hashlib.sha256(came).hexdigest() != note.sha256:
                raise BackendError(
                    f"{place}/{name} is not the file that the manifest describes ({len(came):,} bytes for "
                    f"{note.bytes:,}, or another checksum); fetch it again, or ask who published it."
                )
            (partial / name).write_bytes(came)
            received += len(came)
        (partial / MANIFEST).write_bytes(content)
        shutil.rmtree(target, ignore_errors=True)
        partial.rename(target)
        sync_folder(target.parent)
    except OSError as fault:
        raise BackendError(
            f"The files cannot be written to {target} ({fault.strerror or fault}); make room or choose another folder "
            f"({option('models', 'DIR')})."
        ) from fault
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return Fetched(target, manifest, received)


def _whole(folder: Path, manifest: Manifest) -> bool:
    return all(
        (folder / name).is_file() and remembered_sha256(folder / name) == note.sha256
        for name, note in manifest.files.items()
    )


class _SafeRedirects(HTTPRedirectHandler):
    """Follows no redirection to a page that is not encrypted, or to a file."""

    def redirect_request(self, req, fp, code, msg, headers, newurl):
        _require_safe(newurl)
        return super().redirect_request(req, fp, code, msg, headers, newurl)


def _reader(place: str) -> Callable[[str], bytes]:
    """Return what reads a file of a page or a folder by its name."""
    opener = build_opener(_SafeRedirects)
    if "://" in place:
        _require_safe(place)

    def read(name: str) -> bytes:
        try:
            if "://" not in place:
                return (user_path(place) / name).read_bytes()
            with opener.open(f"{place.rstrip('/')}/{quote(name)}", timeout=_TIMEOUT_S) as answer:
                return answer.read()
        except (OSError, HTTPException, ValueError) as fault:  # the errors of a page are of OSError's family
            raise BackendError(
                f"{place}/{name} cannot be read ({fault}); look at the address, or bring the folder from a machine "
                f"with a network and name it with {option('from', 'DIR')}."
            ) from fault

    return read


def _require_safe(url: str) -> None:
    parts = urlsplit(url)
    if parts.scheme != "https" and not (parts.scheme == "http" and is_loopback(parts.hostname or "")):
        raise BackendError(
            f"{url} is not fetched: only https is, or http on this machine; give another {option('from', 'URL')}."
        )
