"""The rules of the AVLMaps paper: every choice between recording and answer that differs from ours, in one place.

``build_settings("paper")`` and ``query_settings("paper")`` are all that there is to it; the encoders are another choice
(the profile). docs/paper-models.md lists the rules one by one, and what of the paper they leave out.
"""

from dataclasses import replace
from typing import Literal

from avlmaps.maps.audio.settings import HearingSettings, SegmentationSettings
from avlmaps.maps.fusion.sensor import PAPERS_VARIANCE_M2
from avlmaps.maps.settings import DEFAULTS, BuildSettings
from avlmaps.query.avlmap import QuerySettings
from avlmaps.query.modalities.area import AreaSettings
from avlmaps.query.modalities.sound import SoundSettings
from avlmaps.query.object_settings import ObjectSettings

Rules = Literal["ours", "paper"]

# A sample beyond a fixed threshold is sound, a pause of a second divides two sounds, nothing is widened or cleaned.
# The published code's threshold is 0: its tracks are silent between the clips. No microphone's track is, nor ours, and
# with 0 such a track is one sound. The noise of our rooms peaks at 0.018 of full scale.
PAPER_HEARING = HearingSettings(
    segmentation=SegmentationSettings(
        method="silence", silence_threshold=0.02, silence_s=1.0, min_length_s=0.0, max_length_s=86_400.0, padding_s=0.0
    ),
    noise_reduction_db=0.0,
    cut="energy",
)
# Heat falls from the camera's place, through walls; cosines are stretched over the keyframes; each view speaks for
# itself, and things do not.
PAPER_AREAS = AreaSettings(anchor="camera", extent="cones", score="min-max", pool_m=0.0)
# Scores are stretched over the sounds of the map; no words change that each is where the robot was.
PAPER_SOUNDS = SoundSettings(normalise="min-max", at="robot")
# A voxel is the object where its word is the closest of all; no instance is left out for its confidence; its room
# and its size have no say.
PAPER_OBJECTS = ObjectSettings(
    least_confidence=0.0, least_in_company=0.0, score_in_company=1.0, guess_below=0.0, room_weight=0.0, too_long=0.0
)


def build_settings(rules: Rules, settings: BuildSettings = DEFAULTS) -> BuildSettings:
    """Return the settings of a build with the parts replaced that the rules decide."""
    if rules == "ours":
        return settings
    fusion = replace(settings.fusion, weight_variance_m2=PAPERS_VARIANCE_M2, sensor="none")
    return replace(settings, fusion=fusion, hearing=PAPER_HEARING)


def query_settings(rules: Rules, settings: QuerySettings | None = None) -> QuerySettings:
    """Return the settings of a query with the parts replaced that the rules decide."""
    settings = settings or QuerySettings()
    if rules == "ours":
        return settings
    return replace(settings, objects=PAPER_OBJECTS, sounds=PAPER_SOUNDS, areas=PAPER_AREAS)


def rules_of(built_with: BuildSettings) -> Rules:
    """Return the rules that a map was built by, from the settings in its manifest."""
    return "paper" if build_settings("paper", built_with) == built_with else "ours"
