"""The sounds of a scene: which things sound, when, and how it reaches the microphone."""

from avlmaps.sim.hearing.acoustic import AcousticSettings, acoustic
from avlmaps.sim.hearing.kinds import KINDS, SoundKind, kind_of
from avlmaps.sim.hearing.overlay import overlay
from avlmaps.sim.hearing.schedule import ScheduleRule, Sounding, schedule
from avlmaps.sim.hearing.sound_library import Bank, Recorded, Synthesised
from avlmaps.sim.hearing.sources import Source, candidates, place_sources

__all__ = [
    "KINDS",
    "AcousticSettings",
    "Bank",
    "Recorded",
    "ScheduleRule",
    "SoundKind",
    "Sounding",
    "Source",
    "Synthesised",
    "acoustic",
    "candidates",
    "kind_of",
    "overlay",
    "place_sources",
    "schedule",
]
