"""A look at a file of sound or video before a decoder opens it."""

from pathlib import Path

from avlmaps.core.files import SOUND_BYTES, RefusedFileError, checked_size

_MOST_ZEROS_BYTES = 64 << 20
_BLOCK_BYTES = 1 << 20
# Formats that say where their samples lie: (offset, bytes there). Zeros at their end are silence, or are never read.
_INDEXED = (
    (8, b"WAVE"), (0, b"FORM"), (0, b"caff"), (0, b"riff"), (4, b"ftyp"), (4, b"moov"), (4, b"mdat"), (4, b"wide"),
)  # fmt: skip


def checked_media(path: Path) -> int:
    """Return the size of a file of sound or video that a decoder may open.

    The decoders of the other formats (Ogg, MP3, Matroska, WebM, AVI) look for the next packet in all that follows:
    20 GB of zeros, as a full disk or a broken copy leaves them, keep a processor busy for minutes.

    Raises:
        FileNotFoundError: there is no such file.
        OSError: it is no regular file, is too large, or ends in 64 MB of zeros and its format has no index;
            ``strerror`` is the reason in words.
    """
    size = checked_size(path, SOUND_BYTES)
    if size >= _MOST_ZEROS_BYTES and not _is_indexed(path) and _ends_in_zeros(path, size):
        raise RefusedFileError(
            path, f"the last {_MOST_ZEROS_BYTES:,} of its {size:,} bytes are zeros, as after a copy that broke off"
        )
    return size


def _is_indexed(path: Path) -> bool:
    with path.open("rb") as stream:
        head = stream.read(16)
    return any(head[at : at + len(magic)] == magic for at, magic in _INDEXED)


def _ends_in_zeros(path: Path, size: int) -> bool:
    zeros = bytes(_BLOCK_BYTES)
    with path.open("rb") as stream:
        for back in range(_BLOCK_BYTES, _MOST_ZEROS_BYTES + 1, _BLOCK_BYTES):
            stream.seek(size - back)
            if stream.read(_BLOCK_BYTES) != zeros:
                return False
    return True
