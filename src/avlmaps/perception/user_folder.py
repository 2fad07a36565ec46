"""The user's folder: the sounds that the user taught, and caches that can be computed again."""

import os
import sys
from pathlib import Path

from avlmaps.core.files import user_path


def user_folder() -> Path:
    """Return the folder of this person's own profile; it need not exist yet.

    ``AVLMAPS_HOME`` where it is set; else ``%APPDATA%`` on Windows, ``~/Library/Application Support`` on macOS and
    ``$XDG_DATA_HOME`` (``~/.local/share``) elsewhere, and ``avlmaps`` in it.
    """
    own = os.environ.get("AVLMAPS_HOME")
    if own:
        return user_path(own)
    if sys.platform == "win32":
        base = Path(os.environ.get("APPDATA") or Path.home() / "AppData" / "Roaming")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Application Support"
    else:
        base = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    return base / "avlmaps"


def cache_folder() -> Path:
    """Return the folder for what can be computed again and may be deleted at any time; it need not exist yet.

    ``cache`` in ``AVLMAPS_HOME`` where that is set; else ``%LOCALAPPDATA%`` on Windows, ``~/Library/Caches`` on macOS
    and ``$XDG_CACHE_HOME`` (``~/.cache``) elsewhere, and ``avlmaps`` in it.
    """
    own = os.environ.get("AVLMAPS_HOME")
    if own:
        return user_path(own) / "cache"
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "avlmaps"
