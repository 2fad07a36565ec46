"""The navigation benchmark: the paper's Tables I, II and VI and its list of commands, driven in homes made by rule."""

from avlmaps_sim.bench.navigation.episodes import Episode, Leg
from avlmaps_sim.bench.navigation.missions import (
    DEFAULT_SCENES,
    Goal,
    GoalKind,
    Mission,
    MissionSet,
    NavigationSettings,
    Series,
    load_missions,
    save_missions,
)
from avlmaps_sim.bench.navigation.runs import Outcome, run

__all__ = [
    "DEFAULT_SCENES",
    "Episode",
    "Goal",
    "GoalKind",
    "Leg",
    "Mission",
    "MissionSet",
    "NavigationSettings",
    "Outcome",
    "Series",
    "load_missions",
    "run",
    "save_missions",
]
