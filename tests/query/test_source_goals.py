"""The probability of a goal at the source of a sound: the name's, times that of its place."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from query_fakes import FakeMap, furnished_map, sounds_of

from avlmaps.core.question import HeardAt, Modality, Part, Role
from avlmaps.maps.grid import GridSpec
from avlmaps.maps.sources.candidates import Spread
from avlmaps.maps.types import SourceEvidence
from avlmaps.query.answer import PartAnswer, absent_text, found_text
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.modalities import SourceAnchors, source_factor
from avlmaps.query.settings import HeatSettings, SoundSettings
from avlmaps.query.sound_sources import SourceMap
from avlmaps.query.voxel_space import Space

SPACE = Space(GridSpec(0.1), np.array([[x, y, 0] for x in range(40) for y in range(40)], np.int32), (0.0, 0.0, 1.0))
UNIT = st.floats(0.0, 1.0)
AT: tuple[HeardAt, HeardAt] = ("robot", "source")


def heat_of(scores: list[float], spreads: list[Spread], role: Role = Role.PRIMARY, found_at: float = 0.5) -> Heatmap:
    """Return the heat of sources two metres apart."""
    anchors = np.array([[0.5 + 2.0 * number, 2.0, 0.4] for number in range(len(scores))])
    factor = SourceAnchors(
        space=SPACE, part=Part(Modality.SOUND, "smoke alarm", role, at="source"), falloff_per_m=2.0, anchors=anchors,
        scores=np.array(scores), instance=np.arange(len(scores)), understood="smoke alarm", spreads=tuple(spreads),
    )  # fmt: skip
    return Heatmap.of(factor, found_at)


@given(UNIT, UNIT, UNIT)
def test_a_goal_is_as_likely_as_its_name_and_its_place(score: float, right: float, other: float) -> None:
    one = heat_of([score], [Spread(right, 0.3, 0.9)])
    assert one.probability == pytest.approx(score * right, abs=2e-3) and one.probability <= score + 1e-3
    assert heat_of([score], [Spread(1.0, 0.0, 0.0)]).probability == pytest.approx(score, abs=1e-3)
    low, high = sorted((right, other))
    wide, narrow = (heat_of([score], [Spread(share, 0.3, 0.9)]) for share in (low, high))
    assert wide.probability <= narrow.probability


@given(st.lists(st.tuples(UNIT, UNIT), min_size=2, max_size=2))
def test_of_two_sources_the_likelier_goal_leads(two: list[tuple[float, float]]) -> None:
    heat = heat_of([score for score, _ in two], [Spread(right, 0.3, 0.9) for _, right in two])
    probabilities = [goal.probability for goal in heat.goals()]
    assert probabilities == sorted(probabilities, reverse=True)
    assert heat.probability == pytest.approx(max(score * right for score, right in two), abs=1e-3)


def test_as_context_a_sound_counts_by_its_name_alone() -> None:
    heat = heat_of([0.9], [Spread(0.2, 0.8, 2.0)], Role.CONTEXT)
    assert heat.lead.confidence.tolist() == [1.0] and heat.lead.found


def test_a_wide_region_is_not_found_and_said() -> None:
    heat = heat_of([0.93], [Spread(0.4, 0.66, 2.1)])
    (goal,) = heat.goals()
    assert not heat.found and not heat.lead.found and "0.66 m" in heat.lead.note
    part = PartAnswer(heat.lead.part, 0.93, False, "smoke alarm", heat.lead.note)
    said = absent_text([part], [goal], None)
    assert said.startswith("Where the sound of smoke alarm comes from is not found")
    assert "within 0.66 m" in said and "within 2.10 m" in said
    assert goal.to_json()["within_50_m"] == 0.66 and goal.to_json()["within_90_m"] == 2.1  # pyright: ignore
    assert part.to_dict()["at"] == "source"  # pyright: ignore[reportTypedDictNotRequiredAccess]


def test_a_goal_at_a_source_says_where_the_sound_comes_from() -> None:
    heat = heat_of([0.9], [Spread(0.9, 0.2, 0.5)])
    said = found_text([PartAnswer(heat.lead.part, 0.9, True)], heat.goals()[0])
    assert said.startswith("Where the sound of smoke alarm comes from is most likely at (0.50, 2.00, 0.40) m")
    assert "probability 0.81" in said and "within 0.20 m" in said
    both = Part(Modality.OBJECT, "chair", Role.PRIMARY), Part(Modality.SOUND, "barking", at="source")
    said = found_text([PartAnswer(part, 0.9, True) for part in both], heat.goals()[0])
    assert "near where the sound of barking comes from" in said


def test_a_sound_that_is_not_located_yet_is_not_called_unheard() -> None:
    place = np.array([[x, y, 0.05] for x in np.arange(0.05, 3, 0.3) for y in np.arange(0.05, 3, 0.3)], np.float32)
    waiting = np.zeros((1, len(place)), np.float16)
    located = -np.linalg.norm(place - place[20], axis=1).astype(np.float16)[None]
    evidence = SourceEvidence(
        place=place, prior=np.full(len(place), 1.0 / len(place), np.float32),
        heard=np.concatenate([waiting, located]), expected=np.concatenate([waiting, 0.1 * located]),
        moving=np.zeros(2, np.uint8), channels=np.array([4], np.int64),
    )  # fmt: skip
    sources = SourceMap(evidence, SPACE, lambda names: [])
    part, heat = Part(Modality.SOUND, "barking", Role.PRIMARY), HeatSettings()
    asked = ([0.9, 0.2], "where it came from is not known"), ([0.2, 0.3], "no detected sound is like 'barking'")
    for scores, said in asked:
        factor = source_factor(SPACE, sources, np.array(scores), part, SoundSettings(), heat)
        assert not factor.found and said in factor.note


class Asked(FakeMap):
    """A map that notes what it is asked for, and answers where it was heard."""

    def heat(self, part: Part, intrinsics: Any = None, attachments: Any = None) -> Heatmap:
        self.__dict__.setdefault("parts", []).append(part)
        return super().heat(replace(part, at="robot"), intrinsics, attachments)


@pytest.mark.parametrize(
    ("words", "places"),
    [
        ("the chair between where the barking comes from and where you heard the phone", ["source", None]),
        ("the chair between the source of the barking and the source of the beeping", ["source", "source"]),
        ("the chair near where the barking comes from", ["source"]),
        ("the chair near the sound of barking", [None]),
        ("where does the barking near the sound of water come from?", ["source", "source"]),
    ],
)
def test_each_sound_that_says_where_a_thing_is_has_its_own_place(
    words: str, places: list[HeardAt | None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avlmaps.query.sound_sources.no_sources", lambda stored: "")
    home = furnished_map(sounds=sounds_of([np.ones((3, 3))], [1.0]))
    asked = Asked(home.data, home.encoders)
    asked.ask(words)
    assert [part.at for part in asked.__dict__["parts"] if part.modality is Modality.SOUND] == places
    for chosen in AT:
        asked.__dict__["parts"].clear()
        asked.ask(words, at=chosen)
        assert {part.at for part in asked.__dict__["parts"] if part.modality is Modality.SOUND} == {chosen}
