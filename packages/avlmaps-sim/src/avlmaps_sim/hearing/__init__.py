"""The sounds of a scene: which things sound, when, and how it reaches the microphone."""

from avlmaps_sim.hearing.acoustic import AcousticSettings, acoustic
from avlmaps_sim.hearing.kinds import KINDS, SoundKind, kind_of
from avlmaps_sim.hearing.overlay import overlay
from avlmaps_sim.hearing.schedule import ScheduleRule, Sounding, schedule
from avlmaps_sim.hearing.sound_library import Bank, Recorded, Synthesised
from avlmaps_sim.hearing.sources import Source, candidates

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
    "schedule",
]
