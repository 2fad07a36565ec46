"""Audio-Visual-Language Maps: what a robot saw and heard, as one 3D map that can be queried.

    m = avlmaps.build_map("REC", "home.avlmap")      # or avlmaps.open_map("home.avlmap")
    m.ask("where can I sit?").text                   # also .goals, .count, .alternatives, .to_dict()
    heat = 0.7 * m.object("chair") + 0.3 * m.sound("dog bark")
    heat.max(), heat.at(points), m.points, m.features

    live = avlmaps.VoxelMap(encoders=avlmaps.Encoders.named("embedded", pixels=MyEncoder()))
    for frame in avlmaps.open_recording("REC"):
        live.add(frame.rgb, frame.depth_m, frame.camera, frame.world_from_camera, frame.stamp_s)
    live.ask("the chair"), live.save("home.avlmap")

    with avlmaps.LiveMap("home.avlmap") as live:     # while a robot drives: add_frame, add_audio, ask, status
        live.add_frame(rgb, depth_m, camera, world_from_camera, stamp_s)

Importing the package loads nothing heavy; each public name is imported when it is first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from avlmaps.core.version import __version__

if TYPE_CHECKING:
    from avlmaps.api import build_map, open_map
    from avlmaps.core.camera import Pinhole, Rig
    from avlmaps.core.errors import (
        AudioError,
        AvlmapsError,
        BackendError,
        LanguageError,
        MapError,
        NavigationError,
        QueryError,
        RecordingError,
    )
    from avlmaps.core.question import Modality, Part, Question, Role
    from avlmaps.live.live_map import LiveMap
    from avlmaps.live.status import LiveSettings
    from avlmaps.maps.obstacles import BodyShape
    from avlmaps.maps.settings import BuildSettings, FrameSettings, FusionSettings
    from avlmaps.navigate.skills import Robot, RobotSettings
    from avlmaps.perception.encoders import Encoders, profile
    from avlmaps.query.answer import Answer
    from avlmaps.query.avlmap import AVLMap
    from avlmaps.query.contents import Room, SoundEvent, Thing
    from avlmaps.query.goals import Goal
    from avlmaps.query.heatmap import Heatmap
    from avlmaps.query.locate import Located
    from avlmaps.query.settings import AreaSettings, HeatSettings, ObjectSettings, QuerySettings, SoundSettings
    from avlmaps.query.voxel_map import VoxelMap
    from avlmaps.recordings.audio import Sound
    from avlmaps.recordings.channels import ChannelSound
    from avlmaps.recordings.microphones import Microphones
    from avlmaps.recordings.open import open_recording
    from avlmaps.recordings.types import Frame, Recording
    from avlmaps.recordings.writer import RecordingWriter

# Where each public name lives.
_HOMES = {
    name: f"avlmaps.{module}"
    for module, names in {
        "api": "build_map open_map",
        "core.camera": "Pinhole Rig",
        "core.errors": "AudioError AvlmapsError BackendError LanguageError MapError NavigationError QueryError "
        "RecordingError",
        "core.question": "Modality Part Question Role",
        "live.live_map": "LiveMap",
        "live.status": "LiveSettings",
        "maps.obstacles": "BodyShape",
        "maps.settings": "BuildSettings FrameSettings FusionSettings",
        "navigate.skills": "Robot RobotSettings",
        "perception.encoders": "Encoders profile",
        "query.answer": "Answer",
        "query.avlmap": "AVLMap",
        "query.contents": "Room SoundEvent Thing",
        "query.goals": "Goal",
        "query.heatmap": "Heatmap",
        "query.locate": "Located",
        "query.settings": "AreaSettings HeatSettings ObjectSettings QuerySettings SoundSettings",
        "query.voxel_map": "VoxelMap",
        "recordings.audio": "Sound",
        "recordings.channels": "ChannelSound",
        "recordings.microphones": "Microphones",
        "recordings.open": "open_recording",
        "recordings.types": "Frame Recording",
        "recordings.writer": "RecordingWriter",
    }.items()
    for name in names.split()
}

__all__ = [
    "AVLMap",
    "Answer",
    "AreaSettings",
    "AudioError",
    "AvlmapsError",
    "BackendError",
    "BodyShape",
    "BuildSettings",
    "ChannelSound",
    "Encoders",
    "Frame",
    "FrameSettings",
    "FusionSettings",
    "Goal",
    "HeatSettings",
    "Heatmap",
    "LanguageError",
    "LiveMap",
    "LiveSettings",
    "Located",
    "MapError",
    "Microphones",
    "Modality",
    "NavigationError",
    "ObjectSettings",
    "Part",
    "Pinhole",
    "QueryError",
    "QuerySettings",
    "Question",
    "Recording",
    "RecordingError",
    "RecordingWriter",
    "Rig",
    "Robot",
    "RobotSettings",
    "Role",
    "Room",
    "Sound",
    "SoundEvent",
    "SoundSettings",
    "Thing",
    "VoxelMap",
    "__version__",
    "build_map",
    "open_map",
    "open_recording",
    "profile",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'avlmaps' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return list(__all__)
