"""``map.json`` on the disk: written with its own checksum, and read with suspicion."""

from pathlib import Path

import msgspec

from avlmaps.core.errors import MapError
from avlmaps.core.files import MANIFEST_BYTES, decode_json, read_regular, write_bytes_atomically
from avlmaps.maps.store.array_files import explain_write_errors
from avlmaps.maps.store.consistency import checksum_of, manifest_fault
from avlmaps.maps.store.manifest import SCHEMA_VERSION, MapInfo

MANIFEST = "map.json"
RESTORE = "restore it from a copy, or build the map again in its place"


class _Ident(msgspec.Struct):
    format: str = ""
    schema_version: int = 0


def write_manifest(folder: Path, info: MapInfo) -> None:
    """Write ``map.json``; with it the folder becomes this map, and not before."""
    signed = msgspec.structs.replace(info, checksum=checksum_of(msgspec.json.encode(info)))
    content = msgspec.json.format(msgspec.json.encode(signed), indent=2)
    with explain_write_errors(folder):
        write_bytes_atomically(folder / MANIFEST, content + b"\n")


def read_manifest(path: Path) -> bytes:
    """Return the content of ``map.json``.

    Raises:
        FileNotFoundError, NotADirectoryError: there is none.
        MapError: it cannot be read, or is not a regular file of a possible size.
    """
    try:
        return read_regular(path, MANIFEST_BYTES)
    except (FileNotFoundError, NotADirectoryError):
        raise
    except OSError as fault:
        raise MapError(f"{path} cannot be read ({fault.strerror or fault}); check the file.") from fault


def parse_manifest(content: bytes, path: Path) -> MapInfo:
    """Return the content of ``map.json``.

    Args:
        content: of the file.
        path: the file, for the errors.

    Raises:
        MapError: it is not JSON, not UTF-8, of no map, of another schema version, lacks something, contradicts itself,
            or is not what was written.
    """
    try:
        ident = decode_json(content, _Ident)
    except (msgspec.DecodeError, UnicodeDecodeError) as fault:
        raise MapError(f"{path} is damaged: it is not JSON in UTF-8 ({fault}); restore it from a copy.") from fault
    if ident.format != "avlmap":
        raise MapError(f"{path} belongs to no map of avlmaps; give the folder that `avlmaps build` wrote.")
    if ident.schema_version != SCHEMA_VERSION:
        how = "upgrade avlmaps" if ident.schema_version > SCHEMA_VERSION else "build the map again in its place"
        raise MapError(
            f"{path} has schema version {ident.schema_version}, this avlmaps reads version {SCHEMA_VERSION}; {how}."
        )
    try:
        info = decode_json(content, MapInfo)
    except (msgspec.DecodeError, ValueError, MapError) as fault:
        raise MapError(f"{path} is damaged: {str(fault).rstrip('.')}; restore it from a copy.") from fault
    fault = manifest_fault(info)
    if not fault and info.checksum and info.checksum != checksum_of(content):
        fault = "it was changed after it was written (its checksum is another)"
    if fault:
        raise MapError(f"{path} is damaged: {fault}; {RESTORE}.")
    return info
