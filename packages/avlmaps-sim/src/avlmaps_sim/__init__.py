"""A world to record in, the suites that measure the system in it, and the demonstration.

    scene = avlmaps_sim.open_scene("house:7")
    avlmaps_sim.record_scene(scene, "REC", avlmaps_sim.RecordSettings(max_frames=60), seed=1)

The world reaches a map only through a recording. Each public name is imported when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from avlmaps_sim.recorder import RecordSettings, record_scene
    from avlmaps_sim.scenes import open_scene

_HOMES = {"RecordSettings": "recorder", "record_scene": "recorder", "open_scene": "scenes"}
__all__ = ["RecordSettings", "open_scene", "record_scene"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'avlmaps_sim' has no attribute {name!r}")
    return getattr(importlib.import_module(f"avlmaps_sim.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return list(__all__)
