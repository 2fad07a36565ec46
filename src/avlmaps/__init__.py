"""Audio-Visual-Language Maps: what a robot saw and heard, as one 3D map that can be asked.

Importing the package loads nothing heavy; each public name is imported when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from avlmaps.core.version import __version__

if TYPE_CHECKING:
    from avlmaps.core.errors import AvlmapsError
    from avlmaps.maps.build import build_map
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.heatmap import Heatmap
    from avlmaps.recordings.open import open_recording
    from avlmaps.recordings.types import Frame, Recording

_HOMES = {
    "AVLMap": "avlmaps.query.avlmap",
    "AvlmapsError": "avlmaps.core.errors",
    "Frame": "avlmaps.recordings.types",
    "Heatmap": "avlmaps.query.heatmap",
    "Recording": "avlmaps.recordings.types",
    "build_map": "avlmaps.maps.build",
    "open_recording": "avlmaps.recordings.open",
}

__all__ = ["AVLMap", "AvlmapsError", "Frame", "Heatmap", "Recording", "__version__", "build_map", "open_recording"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'avlmaps' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return list(__all__)
