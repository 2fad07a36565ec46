"""From a simulated recording with an array to the sources that a map answers with."""

from pathlib import Path

import numpy as np
import pytest

from avlmaps.cli.things import thing_lines
from avlmaps.core.errors import GoalNotFoundError, QueryError
from avlmaps.core.motion import GroundPose
from avlmaps.core.poses import rotation_to_level
from avlmaps.core.timeline import Trajectory
from avlmaps.language.translator import LearnedTranslator
from avlmaps.maps.build import build_map
from avlmaps.maps.sources.find import find_sources
from avlmaps.navigate.grounding import things_in
from avlmaps.navigate.instruct import given_by
from avlmaps.navigate.skills import Robot
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.heatmap import Heatmap
from avlmaps.query.schema import ListedThing
from avlmaps.query.settings import QuerySettings, SoundSettings, query_settings
from avlmaps.recordings.audio import AudioTrack, Sound
from avlmaps.recordings.channels import with_microphones, write_channels
from avlmaps.recordings.microphones import microphones_named
from avlmaps.recordings.open import open_recording
from avlmaps_sim.hearing.acoustic import AcousticSettings
from avlmaps_sim.hearing.array import heard_by_array
from avlmaps_sim.hearing.schedule import Sounding, Source
from avlmaps_sim.recorder import RecordSettings, record_scene
from avlmaps_sim.truth import read_truth
from helpers.heard_flat import heard_flat
from helpers.hearing_scenes import flat, shoebox
from helpers.kinematic import KinematicDriver

ROBOT = SoundSettings(at="robot")
pytestmark = pytest.mark.nightly  # the recording and the map are made by the first of the modules that need them

SOURCE = np.array([1.5, 4.2, 0.6])


def surface() -> np.ndarray:
    """Return points on the floor and walls of the shoebox, metres."""
    points = [(x, y, 0.0) for x in np.arange(0, 6, 0.1) for y in np.arange(0, 5, 0.1)]
    points += [(x, y, z) for x in (0.0, 6.0) for y in np.arange(0, 5, 0.1) for z in np.arange(0, 2.5, 0.1)]
    points += [(x, y, z) for y in (0.0, 5.0) for x in np.arange(0, 6, 0.1) for z in np.arange(0, 2.5, 0.1)]
    return np.array(points)


@pytest.fixture(scope="module")
def heard(tmp_path_factory: pytest.TempPathFactory) -> tuple[AudioTrack, Trajectory]:
    """Return what a robot with a square array heard that drove past a source in a room."""
    rng = np.random.default_rng(3)
    barks = rng.standard_normal(2 * 16_000) * (np.arange(2 * 16_000) % 8000 < 2500)
    clip = Sound((0.1 * barks).astype(np.float32), 16_000)
    sounding = Sounding(Source("dog bark", tuple(SOURCE.tolist()), -1, "bark", clip), 1.5, 3.5, (0.0, 0.0, 0.0))
    stamps_s = np.arange(50) / 10.0
    poses = np.tile(np.eye(4), (50, 1, 1))
    poses[:, :3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    poses[:, :3, 3] = np.column_stack([np.linspace(2.0, 4.0, 50), np.full(50, 2.2), np.full(50, 1.3)])
    array = microphones_named("square4")
    settings = AcousticSettings(16_000, snr_db=20.0)
    sound = heard_by_array(shoebox(), [sounding], stamps_s, poses, array, 5.0, rng, settings)
    path = tmp_path_factory.mktemp("heard") / "track.flac"
    write_channels(path, sound)
    return with_microphones(AudioTrack.open(path), array), Trajectory(stamps_s, poses)


def place(evidence) -> np.ndarray:
    total = evidence.heard[0].astype(float) + evidence.expected[0].astype(float) + np.log(evidence.prior)
    return evidence.place[int(np.argmax(total))].astype(float)


def test_a_source_in_a_room_is_found_from_the_walk(heard: tuple[AudioTrack, Trajectory]) -> None:
    up = np.array([0.0, 0.0, 1.0])
    found = find_sources(*heard, [(1.5, 3.6)], surface(), up)
    assert found is not None and found.prior.sum() == pytest.approx(1.0, abs=1e-3)
    assert np.linalg.norm(place(found)[:2] - SOURCE[:2]) < 0.5
    assert not found.moving[0]


def test_a_turned_world_has_its_sources_turned(heard: tuple[AudioTrack, Trajectory]) -> None:
    track, walk = heard
    up = np.array([0.6, 0.0, 0.8])
    turn = np.eye(4)
    turn[:3, :3] = rotation_to_level(up).T
    turned = Trajectory(walk.stamps_s, turn @ walk.world_from_body)
    plain = find_sources(track, walk, [(1.5, 3.6)], surface(), np.array([0.0, 0.0, 1.0]))
    other = find_sources(track, turned, [(1.5, 3.6)], surface() @ turn[:3, :3].T, up)
    assert plain is not None and other is not None
    assert np.linalg.norm(place(other) @ turn[:3, :3] - place(plain)) < 0.2


def test_exchanged_channels_lose_the_source(heard: tuple[AudioTrack, Trajectory]) -> None:
    track, walk = heard
    assert track.microphones is not None
    wrong = with_microphones(track, track.microphones.take([0, 2, 1, 3]))
    up = np.array([0.0, 0.0, 1.0])
    right, lost = (find_sources(one, walk, [(1.5, 3.6)], surface(), up) for one in (track, wrong))
    assert right is not None and lost is not None
    error = [np.linalg.norm(place(one)[:2] - SOURCE[:2]) for one in (right, lost)]
    assert error[0] < error[1]


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a recording of a flat with an array, and its map."""
    return heard_flat(tmp_path_factory)


def test_a_map_says_where_its_sounds_came_from(mapped: tuple[Path, Path]) -> None:
    recording, path = mapped
    avlmap, truth = AVLMap.open(path), read_truth(recording)
    sources = avlmap.sources()
    assert sources and {event for one in sources for event in one.events} == set(range(len(avlmap.data.sounds)))
    onsets = np.asarray(avlmap.data.sounds.onset_s)
    errors = []
    for event in truth.events:
        number = int(np.argmin(np.abs(onsets - event.onset_s)))
        one = next(source for source in sources if number in source.events)
        errors.append(float(np.linalg.norm(np.subtract(one.position[:2], event.source[:2]))))
        assert one.within_50_m <= one.within_90_m and one.area_50_m2 <= one.area_90_m2
    assert np.median(errors) < 0.6
    assert all(one.microphones == 4 for one in sources)


def test_heat_at_the_source_is_where_the_source_is(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    name = max(avlmap.sources(), key=lambda one: one.confidence).name
    heat = avlmap.sound(name, primary=True, at="source")
    (best, *_) = avlmap.sources([name])
    assert heat.min() >= 0.0 and heat.max() <= 1.0
    hottest = avlmap.points[int(np.argmax(np.asarray(heat)))]
    assert np.linalg.norm(hottest[:2] - np.array(best.position[:2])) < 0.8
    same = avlmap.sound(name, primary=True)
    assert np.array_equal(np.asarray(same), np.asarray(avlmap.sound(name, primary=True, at="robot")))


def test_an_answer_at_the_source_believes_no_more_than_its_region(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    best = max(avlmap.sources(), key=lambda one: one.probability)
    (same, *_) = [one for one in avlmap.sources([best.name]) if set(best.events) <= set(one.events)]
    answers = [avlmap.ask(sound=best.name, at="source"), avlmap.ask(f"the sound of {best.name}", at="source")]
    for answer in answers:
        near = min(answer.goals, key=lambda goal: float(np.linalg.norm(np.subtract(goal.position, same.position))))
        assert near.position == pytest.approx(same.position, abs=1e-3)
        assert near.probability == pytest.approx(same.probability, abs=2e-3) and near.probability < same.confidence
        assert near.spread is not None and "comes from" in answer.text
    assert avlmap.ask(sound=best.name).goals[0].spread is None
    heat = AVLMap.open(mapped[1], QuerySettings(found_at=1.0)).sound(best.name, primary=True, at="source")
    with pytest.raises(GoalNotFoundError, match="the source of"):
        things_in(heat)
    assert things_in(heat, guess=True)[0].spread is not None


def test_a_sentence_that_asks_where_a_sound_came_from_means_its_source(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    name = max(avlmap.sources(), key=lambda one: one.probability).name
    chosen = avlmap.ask(f"where does the sound of {name} come from?")
    assert chosen.goals[0].position == avlmap.ask(sound=name, at="source").goals[0].position
    assert chosen.goals[0].spread is not None and "comes from" in chosen.text
    for other in (avlmap.ask(f"where is the sound of {name}?"),
                  avlmap.ask(f"where does the sound of {name} come from?", at="robot")):  # fmt: skip
        assert other.goals[0].position == avlmap.ask(sound=name).goals[0].position


def test_commands_and_questions_choose_the_same_place(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    name = max(avlmap.sources(), key=lambda one: one.probability).name
    paper = AVLMap.open(mapped[1], query_settings("paper"))
    for known, at in ((avlmap, "source"), (paper, None), (AVLMap.open(mapped[1], QuerySettings(sounds=ROBOT)), None)):
        said = f"where the sound of {name} comes from"
        plan = LearnedTranslator(given_by(known)).program_for(f"go to {said}")
        assert ('at="source"' in plan.program) == (at == "source") and plan.notes == ()
        robot = Robot(known, KinematicDriver(GroundPose(0.0, 0.0)))
        heat = robot.get_major_map(sound=name, at="source")
        assert isinstance(heat, Heatmap) and heat.factors[0].part.at == at
        answer = known.ask(said)
        assert answer.parts[0].part.at == at and answer.goals[0].position == heat.goals(1)[0].position
    plain = Robot(avlmap, KinematicDriver(GroundPose(0.0, 0.0))).get_major_map(sound=name)
    assert isinstance(plain, Heatmap) and plain.factors[0].part.at is None


def test_a_noise_without_a_name_is_the_last_sound(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    sounds, sources = avlmap.sounds(), avlmap.source_map
    for sentence, number in (("where did the noise come from?", -1), ("what made the first noise?", 0)):
        answer = avlmap.ask(sentence)
        number = range(len(sounds))[number]
        wanted = sources.position_of(sources.joined([number], sounds[number].names[0]))
        assert answer.goals[0].position == pytest.approx(wanted.tolist(), abs=1e-4)
        assert f"{sounds[number].onset_s:.1f} s" in answer.text and answer.goals[0].spread is not None
    assert avlmap.ask("where was the last sound").goals[0].position == sounds[-1].position


def test_things_list_what_was_heard_from_them(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    listed = avlmap.contents().to_json("flat")["things"]
    heard = {(row["sound"], tuple(thing["position"])): row for thing in listed for row in thing.get("heard", [])}
    likely = {
        (source.name, place): source.confidence * share
        for source in avlmap.sources()
        for _, place, share in source.things
        if source.confidence * share >= 0.1
    }
    assert likely and {key: row["probability"] for key, row in heard.items()} == pytest.approx(likely, abs=1e-3)
    ends = np.asarray(avlmap.data.sounds.onset_s)
    assert all(np.abs(ends - row["onset_s"]).min() < 1e-6 and "when" not in row for row in heard.values())
    assert "heard from it" in thing_lines([ListedThing(**row) for row in listed])[0]
    assert "heard" not in avlmap.things()[0].to_json()


def test_a_thing_alone_in_a_list_is_no_likelier_the_source(mapped: tuple[Path, Path]) -> None:
    avlmap = AVLMap.open(mapped[1])
    whole = {thing.position: thing.heard for thing in avlmap.contents().things}
    names = sorted({thing.name for thing in avlmap.things()})
    for name in names[:3]:
        for thing in avlmap.contents(names=[name]).things:
            before = sum(row["probability"] for row in whole.get(thing.position, ()))
            assert thing.position not in whole or sum(row["probability"] for row in thing.heard) <= before + 0.15


def test_priors_of_the_lexicon_can_be_left_out(mapped: tuple[Path, Path]) -> None:
    known = AVLMap.open(mapped[1]).source_map
    plain, with_makers = (known.joined([0], "toilet flush", prior).share for prior in (False, True))
    assert plain.sum() == pytest.approx(1.0) and with_makers.sum() == pytest.approx(1.0)
    prior = known.prior_of("toilet flush")
    assert prior.sum() == pytest.approx(1.0, abs=1e-4)


def test_a_map_of_one_microphone_says_what_it_lacks(tmp_path: Path) -> None:
    settings = RecordSettings(size=(64, 48), fps=2.0, hearing="acoustic", sources=1, workers=1, max_frames=20)
    record_scene(flat(), tmp_path / "rec", settings, seed=1)
    build_map(open_recording(tmp_path / "rec"), tmp_path / "one.avlmap", "colours", progress=False)
    avlmap = AVLMap.open(tmp_path / "one.avlmap")
    assert avlmap.data.sources is None
    with pytest.raises(QueryError, match="where the microphones are"):
        avlmap.sources()
    if len(avlmap.data.sounds):
        answer = avlmap.ask("where did the noise come from?")
        assert answer.goals[0].position == avlmap.ask("the last sound").goals[0].position
        assert "where the robot was" in answer.notes[0] and "where the microphones are" in answer.notes[0]
