"""Sounds are placed where homes have them, and are heard as the robot comes by, far enough apart."""

import numpy as np
import pytest

from avlmaps.core.errors import AudioError
from avlmaps.recordings.audio import Sound
from avlmaps_sim.furniture.catalogue import categories
from avlmaps_sim.hearing.schedule import ScheduleRule, Source, candidates, schedule
from avlmaps_sim.hearing.sound_library import KINDS, Recorded, Synthesised, kind_of
from avlmaps_sim.synthesis import MAKERS
from helpers.hearing_scenes import flat

RATE_HZ = 16_000


def beep(seconds: float = 4.0) -> Sound:
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return Sound((0.5 * np.sin(2 * np.pi * 1000.0 * t)).astype(np.float32), RATE_HZ)


class Beeps:
    """A bank that has every kind, and the same beep for all."""

    categories = tuple(sorted(MAKERS))

    def draw(self, category: str, rng: np.random.Generator) -> tuple[str, Sound]:
        return f"{category}.wav", beep()


def test_a_rule_makes_another_clip_at_each_draw_and_the_same_for_the_same_seed() -> None:
    (name, one), (other_name, other), (_, again) = (
        Synthesised().draw("microwave beep", np.random.default_rng(seed)) for seed in (1, 2, 1)
    )
    assert name != other_name
    assert np.array_equal(one.samples, again.samples)
    assert len(one.samples) != len(other.samples) or not np.array_equal(one.samples, other.samples)
    assert one.duration_s <= 5.0


def test_every_kind_is_named_once_and_made_by_things_that_exist() -> None:
    names = [name for kind in KINDS for name in kind.names]
    assert len(names) == len(set(names))
    known = set(categories())
    for kind in KINDS:
        assert set(kind.objects) <= known, kind.names[0]
        assert kind.objects or kind.floor, f"{kind.names[0]} is heard nowhere"
    assert not kind_of("helicopter").indoors


def test_household_sounds_made_by_rule_have_a_place() -> None:
    outdoors = [name for name in MAKERS if not kind_of(name).indoors]
    assert set(outdoors) <= {
        "cow mooing", "sheep bleating", "pig grunting", "hen clucking", "crow cawing", "frog croaking",
        "birds chirping", "crickets", "owl or pigeon", "thunder", "wind", "siren", "car horn", "car engine", "train",
        "airplane", "church bells", "fireworks", "chopping wood", "crowd cheering",
    }  # fmt: skip


def test_sources_stand_at_the_things_that_make_them() -> None:
    scene = flat()
    wanted = ("running water", "toilet flush", "washing machine", "microwave beep", "snoring")
    found = candidates(scene, np.random.default_rng(1), 5, wanted, bank=Beeps())
    assert {source.category for source in found} == set(wanted)
    for source in found:
        thing = scene.objects[source.instance]
        assert thing.category in kind_of(source.category).objects
        assert np.all(np.array(source.position) >= np.array(thing.low) - 1e-6)
        assert np.all(np.array(source.position) <= np.array(thing.high) + 0.11)


def test_a_kind_that_is_not_there_is_named() -> None:
    with pytest.raises(AudioError, match="There are no sounds of silence; there are airplane"):
        candidates(flat(), np.random.default_rng(0), 1, ["silence"])


def test_clips_come_from_a_folder_as_well(tmp_path) -> None:
    import soundfile

    for name in ("running_water", "clock_tick"):
        (tmp_path / name).mkdir()
        soundfile.write(tmp_path / name / "a.wav", beep(6.0).samples, RATE_HZ)
    bank = Recorded(tmp_path, RATE_HZ)
    found = candidates(flat(), np.random.default_rng(0), 2, bank=bank)
    assert {source.category for source in found} == {"running water", "clock tick"}
    assert {source.clip for source in found} == {"running_water/a.wav", "clock_tick/a.wav"}
    assert all(source.sound.duration_s == pytest.approx(5.0) for source in found)


@pytest.fixture(scope="module")
def stroll() -> tuple[np.ndarray, np.ndarray]:
    """A round through the flat's bedroom and kitchen at half a metre a second."""
    corners = np.array([[1.0, 7], [8, 5], [3, 5], [1.4, 4.05], [1.2, 1.2], [4.5, 1.2], [4.3, 3.4], [1.4, 3.4]])
    reach = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    along = np.arange(0.0, reach[-1], 0.05)
    xy = np.column_stack([np.interp(along, reach, axis) for axis in corners.T])
    return np.arange(len(xy)) / 10.0, np.column_stack([xy, np.full(len(xy), 1.3)])


@pytest.mark.parametrize("seed", range(4))
def test_scheduled_sounds_keep_the_papers_distance_and_never_overlap(stroll, seed: int) -> None:
    stamps_s, robot = stroll
    scene, rule = flat(), ScheduleRule()
    sources = candidates(scene, np.random.default_rng(seed), 16, walk=robot, bank=Beeps())
    found = schedule(scene, sources, stamps_s, robot, rule)
    assert len(found) >= 3
    heard = [robot[(stamps_s >= s.onset_s - 0.05) & (stamps_s <= s.offset_s + 0.05)] for s in found]
    for i, one in enumerate(found):
        assert stamps_s[0] <= one.onset_s < one.offset_s <= stamps_s[-1] + 0.11
        away = np.linalg.norm(heard[i] - np.array(one.source.position), axis=1)
        assert away.mean() < rule.reach_m
        for j in range(i):
            assert one.onset_s >= found[j].offset_s + rule.pause_s - 0.11
            assert np.linalg.norm(heard[i][:, None] - heard[j][None], axis=2).min() >= rule.distance_m - 0.11


def test_ambiguous_kinds_are_heard_in_all_their_places_or_in_one(stroll) -> None:
    stamps_s, robot = stroll
    scene = flat()
    places = ((2.3, 0.3), (7.0, 7.0), (2.3, 0.5), (8.0, 3.0))
    taps = [Source("running water", (x, y, 1.0), -1, "", beep()) for x, y in places]
    found = schedule(scene, taps[:3], stamps_s, robot, ambiguous=1)
    assert [s.source.position[0] for s in found] == [7.0, 2.3]
    assert len(schedule(scene, taps, stamps_s, robot)) == 1
    assert len(schedule(scene, taps[:3:2], stamps_s, robot, ambiguous=1)) == 1, "taps side by side are one place"
    three = [np.array(s.source.position) for s in schedule(scene, taps, stamps_s, robot, ambiguous=1, places=3)]
    assert len(three) in (1, 3)
    assert all(np.linalg.norm(a - b) >= 4.0 for i, a in enumerate(three) for b in three[:i])
