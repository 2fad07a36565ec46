"""A recorded scene opens as any recording does, holds what the camera saw, and its truth is the scene's own."""

import csv
import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from avlmaps.core.errors import AvlmapsError, RecordingError
from avlmaps.recordings.audio import Sound
from avlmaps.recordings.formats.folder import open_folder
from avlmaps.recordings.layout import UNFINISHED
from avlmaps_sim.mesh import Material
from avlmaps_sim.recorder import RecordSettings, record_scene, sound_again
from avlmaps_sim.render import Renderer
from avlmaps_sim.scene import SceneBuilder
from avlmaps_sim.sensor import OdometryFaults
from avlmaps_sim.shapes import box
from avlmaps_sim.truth import read_truth
from avlmaps_sim.walk import WalkSettings
from helpers.hearing_scenes import flat

SMALL = RecordSettings(size=(64, 48), max_frames=12, workers=1, sources=2, walk=WalkSettings(look_around=0.0))


def changed(**words: object) -> RecordSettings:
    return replace(SMALL, **words)  # pyright: ignore[reportArgumentType]


def fingerprint(folder: Path) -> dict[str, str]:
    """Return the hash of every file."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clean recording of the flat with instances and two overlaid sounds."""
    out = tmp_path_factory.mktemp("recorded") / "rec"
    record_scene(flat(), out, changed(semantic=True), seed=3)
    return out


def test_it_opens_as_a_recording_that_knows_gravity_and_lasts_as_long_as_the_walk(recorded: Path) -> None:
    recording = open_folder(recorded)
    assert len(recording) == 12
    assert recording.up_in_world is not None
    assert recording.up_in_world.tolist() == [0.0, 0.0, 1.0]
    assert recording.audio is not None
    assert recording.stamps_s[0] == 0.0
    assert recording.duration_s < recording.audio.duration_s < recording.duration_s + 0.2
    assert not recording.notices


def test_pictures_are_what_the_renderer_sees_from_the_recorded_poses(recorded: Path) -> None:
    recording, renderer, scene = open_folder(recorded), Renderer(flat()), flat()
    for index in (0, 5, 11):
        frame = recording.frame(index)
        view = renderer.render(frame.rig.depth, frame.world_from_camera)
        differs = np.abs(frame.depth_m - view.depth_m) > 0.0006
        assert differs.mean() < 0.005, "written poses are rounded, so that single pixels at edges may differ"
        assert (frame.rgb != view.rgb).any(axis=-1).mean() < 0.02
        instance = cv2.imread(str(recorded / "semantic" / f"{frame.name}.png"), cv2.IMREAD_UNCHANGED).astype(int) - 1
        assert (instance != view.instance).mean() < 0.005
        assert set(np.unique(instance)) <= {-1, *range(len(scene.objects))}


def test_its_truth_is_the_scene(recorded: Path) -> None:
    scene, truth = flat(), read_truth(recorded)
    assert [thing.category for thing in truth.objects] == [thing.category for thing in scene.objects]
    for told, real in zip(truth.objects, scene.objects, strict=True):
        assert np.allclose(told.low, real.low, atol=1e-3)
        assert np.allclose(told.centre, real.centre, atol=1e-3)
        assert (told.name, told.area, told.heading_rad) == (real.name, real.area, real.heading_rad)
    for told, real in zip(truth.areas, scene.areas, strict=True):
        assert (told.kind, told.floor_m, told.ceiling_m) == (real.kind, real.floor_m, real.ceiling_m)
        assert np.allclose(told.polygon, real.polygon)
    assert truth.simulation["scene"] == "flat"
    assert truth.simulation["seed"] == 3


def test_its_events_say_what_sounds_where_and_the_track_is_loud_then(recorded: Path) -> None:
    truth, recording = read_truth(recorded), open_folder(recorded)
    assert len(truth.events) == 2
    assert recording.audio is not None
    quiet = recording.audio.read(truth.events[0].offset_s + 0.2, truth.events[1].onset_s - 0.2)
    for event in truth.events:
        loud = recording.audio.read(event.onset_s, event.offset_s)
        assert np.abs(loud.samples).max() > 5.0 * np.abs(quiet.samples).max()
        if event.instance >= 0:
            thing = truth.objects[event.instance]
            assert np.all(np.array(event.source) >= np.array(thing.low) - 1e-3)
        half = int(np.abs(recording.stamps_s - (event.onset_s + event.offset_s) / 2).argmin())
        assert np.linalg.norm(recording.world_from_camera[half, :3, 3] - event.robot) < 1.5
    with (recorded / "events.csv").open(newline="", encoding="utf-8") as stream:
        short = list(csv.DictReader(stream))
    assert [row["category"] for row in short] == [event.category for event in truth.events]


FAULTY = changed(sensor="kinect", drift=OdometryFaults(), semantic=True, max_frames=6)


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("one", "two"):
        record_scene(flat(), tmp_path / name, replace(FAULTY, hearing="acoustic"), seed=5)
    one, two = fingerprint(tmp_path / "one"), fingerprint(tmp_path / "two")
    assert one == two
    assert {"audio.flac", "events.csv", "objects.json", "areas.json", "simulation.json", "true_poses.csv"} <= set(one)


_UNGUARDED = """
import numpy as np
from pathlib import Path
from helpers.hearing_scenes import flat
from avlmaps_sim import recorder
from avlmaps_sim.recorder import RecordSettings
from avlmaps_sim.sensor import OdometryFaults
from avlmaps_sim.walk import WalkSettings
recorder._FEWEST_FOR_PROCESSES = 2
recorder.record_scene({scene}, Path("rec"), {settings!r}, seed=5)
"""
_OF_ITS_OWN = """
from avlmaps_sim.scene import Scene
class Own(Scene): pass
"""


def ran(script: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    (folder / "script.py").write_text(script)
    places = (str(Path(__file__).parents[4] / "tests"), os.environ.get("PYTHONPATH", ""))
    path = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, places))}
    command = [sys.executable, "script.py"]
    return subprocess.run(command, cwd=folder, env=path, timeout=240, capture_output=True, text=True, check=False)


@pytest.mark.nightly
def test_a_script_needs_no_guard_and_its_processes_write_the_same_bytes(tmp_path: Path) -> None:
    done = ran(_UNGUARDED.format(scene="flat()", settings=replace(FAULTY, workers=2)), tmp_path)
    assert done.returncode == 0, done.stderr
    record_scene(flat(), tmp_path / "one", FAULTY, seed=5)
    assert fingerprint(tmp_path / "one") == fingerprint(tmp_path / "rec")


@pytest.mark.nightly
def test_processes_that_die_are_told_and_never_waited_for(tmp_path: Path) -> None:
    own = "Own(**{name: getattr(flat(), name) for name in Scene.__dataclass_fields__})"
    silent = changed(hearing="none", max_frames=4, workers=2)
    done = ran(_OF_ITS_OWN + _UNGUARDED.format(scene=own, settings=silent), tmp_path)
    assert done.returncode == 1
    assert "keep the script's own work under if __name__ == '__main__'" in done.stderr


def test_other_sounds_play_along_a_walk_that_was_recorded(recorded: Path) -> None:
    walk, first = open_folder(recorded).walk, read_truth(recorded).events
    tracks = []
    for seed in (1, 1, 2):
        track, played = sound_again(flat(), walk, 8.0, SMALL, np.random.default_rng(seed))
        assert isinstance(track, Sound) and len(track.samples) == 8 * track.rate_hz and played
        tracks.append(track.samples)
        assert [one.source.clip for one in played] != [event.clip for event in first]
    assert np.array_equal(tracks[0], tracks[1]) and not np.array_equal(tracks[0], tracks[2])


def test_another_seed_drives_and_hears_otherwise(recorded: Path, tmp_path: Path) -> None:
    record_scene(flat(), tmp_path / "other", changed(max_frames=4, semantic=False), seed=4)
    one, other = fingerprint(recorded), fingerprint(tmp_path / "other")
    assert one["audio.flac"] != other["audio.flac"]
    assert one["rgb/000000.png"] != other["rgb/000000.png"]
    assert one["objects.json"] == other["objects.json"]


def test_drift_strays_from_the_true_poses_and_pictures_stay_true(tmp_path: Path) -> None:
    record_scene(flat(), tmp_path / "rec", changed(hearing="none", drift=OdometryFaults(along=0.05)), seed=1)
    recording = open_folder(tmp_path / "rec")
    true = np.loadtxt(tmp_path / "rec" / "true_poses.csv", delimiter=",", skiprows=1)
    away = np.linalg.norm(recording.world_from_camera[:, :3, 3] - true[:, 1:4], axis=1)
    assert away[0] < 1e-9
    assert 0.005 < away[-1] < 2.0
    assert recording.audio is None


def test_a_kinects_depth_has_its_faults_and_a_clean_one_none(recorded: Path, tmp_path: Path) -> None:
    record_scene(flat(), tmp_path / "rec", changed(sensor="kinect", hearing="none"), seed=3)
    clean, faulty = open_folder(recorded), open_folder(tmp_path / "rec")
    assert np.array_equal(clean.world_from_camera, faulty.world_from_camera)
    lost = [
        float((faulty.frame(i).depth_m == 0).mean() - (clean.frame(i).depth_m == 0).mean()) for i in range(0, 12, 3)
    ]
    assert np.mean(lost) > 0.005
    both = (faulty.frame(6).depth_m > 0) & (clean.frame(6).depth_m > 0)
    off_m = np.abs(faulty.frame(6).depth_m - clean.frame(6).depth_m)[both]
    assert 0.0005 < np.median(off_m) < 0.05


def test_a_folder_that_holds_something_is_left_alone_and_an_unfinished_one_is_begun_anew(tmp_path: Path) -> None:
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "thesis.tex").write_text("years of work")
    with pytest.raises(RecordingError, match=r"taken is not empty \(it holds thesis\.tex\)"):
        record_scene(flat(), taken, changed(hearing="none"))
    assert (taken / "thesis.tex").read_text() == "years of work"
    unfinished = tmp_path / "unfinished"
    (unfinished / "semantic").mkdir(parents=True)
    (unfinished / UNFINISHED).write_text("")
    (unfinished / "semantic" / "000000.png").write_bytes(b"half")
    (unfinished / "events.csv").write_text("old")
    record_scene(flat(), unfinished, changed(hearing="none", max_frames=3, semantic=True))
    assert len(open_folder(unfinished)) == 3
    with pytest.raises(RecordingError, match="holds a recording already"):
        record_scene(flat(), unfinished, changed(hearing="none"))
    assert not [path.name for path in tmp_path.iterdir() if path.name.startswith(".")], "no scratch folder is left"


def test_a_scene_of_no_size_of_a_building_is_refused(tmp_path: Path) -> None:
    builder = SceneBuilder("pole")
    builder.add("column", box((0.0, 0.0, 0.0), (0.1, 0.1, 3.0), Material()))
    with pytest.raises(RecordingError, match=r"^pole measures 0.1 x 0.1 x 3 m, which is not a size of a building"):
        record_scene(builder.build(), tmp_path / "rec", SMALL)
    assert not (tmp_path / "rec").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"size": (8, 8)}, "with pictures of 8x8; choose 16x16 to 4096x4096."),
        ({"fov_deg": 180.0}, "with a field of view of 180 degrees; choose 10 to 150."),
        ({"fps": 0.0}, "with 0 frames a second; choose 0.1 to 240."),
        ({"sources": -1}, "with -1 sounds; choose 0 or more."),
        ({"max_frames": 1}, "with 1 frames at most; choose 2 or more."),
        ({"workers": -2}, r"with -2 processes; choose 0 \(every core\) to 256."),
    ],
)
def test_settings_that_make_no_sense_are_told_in_one_sentence(words: dict, said: str) -> None:
    with pytest.raises(AvlmapsError, match=f"^A scene cannot be recorded {said}$"):
        changed(**words)
