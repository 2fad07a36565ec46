"""The demonstration does the whole job, chooses its questions by rule, and leaves other folders alone."""

import json
import re
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import MapError
from avlmaps.core.motion import GroundPose
from avlmaps.core.question import Modality
from avlmaps.language.translator import command_to_program
from avlmaps.navigate.instruct import Outcome
from avlmaps.navigate.skills import LoggedMove
from avlmaps.perception.embedded.scene_network import load_network
from avlmaps_sim import furniture
from avlmaps_sim.demo import run_demo
from avlmaps_sim.demo.drive import Drive, command_for
from avlmaps_sim.demo.evidence import Box, Evidence
from avlmaps_sim.demo.questions import FURNITURE, RARE, REACH_M, SMALL, SPOKEN, PhotoView, choose_questions
from avlmaps_sim.demo.report import DemoReport, Step, to_go_on
from avlmaps_sim.demo.run import FIRST_SEED, DemoSettings, choose_home, fits, record_settings
from avlmaps_sim.demo.svg import Sheet, colour_of, envelope, from_above
from avlmaps_sim.materials import material
from avlmaps_sim.scene import Area, Scene, SceneBuilder, SceneObject
from avlmaps_sim.shapes import slab
from avlmaps_sim.truth import HeardEvent

KITCHEN = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
BEDROOM = np.array([[4.0, 0.0], [8.0, 0.0], [8.0, 3.0], [4.0, 3.0]])


def thing(category: str, x: float, y: float, area: int) -> SceneObject:
    return SceneObject(category, (x - 0.2, y - 0.2, 0.0), (x + 0.2, y + 0.2, 0.8), area=area)


def two_rooms(*, shown: bool = True) -> Evidence:
    objects = (
        thing("chair", 1.0, 1.0, 0), thing("chair", 7.0, 1.0, 1), thing("sofa", 7.0, 2.5, 1),
        thing("desk", 0.5, 2.5, 0), thing("desk", 7.6, 0.4, 1),
        thing("wall", 4.0, 0.0, -1), thing("wall", 0.0, 0.0, -1),
    )  # fmt: skip
    heard = HeardEvent(2.0, 4.0, "keyboard typing", "c", (1.5, 1.5, 1.3), (1.0, 1.2, 0.8), 0)
    stamps = np.arange(10.0)
    walk = np.column_stack([np.linspace(0.5, 7.5, 10), np.full(10, 1.5), np.full(10, 1.3)])
    areas = (Area("kitchen", KITCHEN), Area("bedroom", BEDROOM))
    return Evidence(objects, np.full(len(objects), shown), areas, (heard,), stamps, walk)


def looking_at(x: float, y: float, instance: int) -> PhotoView:
    pose = np.eye(4)
    pose[:3, 3] = x, y, 1.3
    share = np.zeros(7)
    share[instance] = 0.2
    return PhotoView(pose, share, 0.7)


def small_flat() -> Scene:
    """Return two rooms with a wide doorway, and a little furniture."""
    rng = np.random.default_rng(1)
    wall, floor = material("painted", rng), material("wood", rng)
    builder = SceneBuilder("small flat", [Area("kitchen", KITCHEN), Area("bedroom", BEDROOM)])
    builder.add("floor", slab(4.0, 1.5, -0.1, 8.0, 3.0, 0.1, floor))
    for x, y, width, depth in ((4, -0.05, 8, 0.1), (4, 3.05, 8, 0.1), (-0.05, 1.5, 0.1, 3), (8.05, 1.5, 0.1, 3)):
        builder.add("wall", slab(x, y, 0.0, width, depth, 2.5, wall))
    builder.add("wall", slab(4.0, 0.8, 0.0, 0.1, 1.6, 2.5, wall))
    placed = (("chair", 0.6, 0.6, 0), ("refrigerator", 0.5, 2.5, 0), ("chair", 7.3, 0.6, 1), ("bed", 6.6, 2.2, 1))
    for category, x, y, area in placed:
        piece = furniture.make(category, rng)
        builder.add(category, piece.mesh.moved(x, y, 0.0), area=area)
    return builder.build()


class Page(HTMLParser):
    """Collects what a page loads, its ids, and which tags are left open."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.names: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.loads += [value for key in ("src", "href", "poster") if (value := found.get(key))]
        self.loads += re.findall(r"url\(([^)]*)\)", found.get("style") or "")
        self.names += [name for name in [found.get("id")] if name]
        if tag not in ("meta", "input", "img", "link", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if self.open and self.open[-1] == tag:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> ends nothing"
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> DemoReport:
    out = tmp_path_factory.mktemp("small") / "demo"
    settings = DemoSettings(frames=24, size=(160, 120), sounds=2, workers=1, moments=3)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("avlmaps.query.plots._DPI", 40)  # a tenth of the pixels
        return run_demo(out, seed=0, scene=small_flat(), settings=settings)


@pytest.mark.nightly
def test_the_whole_demonstration_runs_on_a_small_flat(small: DemoReport) -> None:
    told = small.to_json()
    assert list(told) == [
        "out", "report", "recording", "map", "voxels", "sounds", "photo_error", "questions", "drive", "seconds",
    ]  # fmt: skip
    assert told["voxels"] > 500
    assert Path(told["map"]).is_dir()
    assert {"words", "area", "absent"} <= {step.ask.kind for step in small.steps}
    assert set(told["questions"][0]) == {"question", "found", "right", "off_m"}
    assert len(small.lines()) >= len(small.steps) + 1
    assert told["drive"]["command"].startswith("first go to the ")
    assert len(told["drive"]["legs"]) == 2
    assert json.loads(json.dumps(told)) == told


@pytest.mark.nightly
def test_the_report_is_whole_and_loads_nothing_from_the_network(small: DemoReport) -> None:
    text = (small.out / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    assert len(page.names) == len(set(page.names))
    for source in page.loads:
        assert "://" not in source
        if source.startswith("#"):
            assert source[1:] in page.names
        elif not source.startswith("data:image/"):
            assert (small.out / source).is_file(), source
    assert "http" not in text
    assert "The drive: " in text
    for step in small.steps:
        assert (small.out / step.picture).is_file()
    assert len(text) < 6_000_000


def test_a_command_is_made_of_questions_that_have_a_place(tmp_path: Path) -> None:
    asks, _ = choose_questions(two_rooms(), [], tmp_path, np.random.default_rng(0))
    chosen = command_for(asks)
    assert chosen is not None
    command, legs = chosen
    area = next(ask.title for ask in asks if ask.kind == "area")
    assert command == f"first go to the chair near the sound of keyboard typing, then go to {area}"
    assert [ask.kind for ask in legs] == ["sound", "area"]
    assert command_to_program(command).count("robot.move_to(") == 2
    assert command_for([ask for ask in asks if ask.kind in ("absent", "clip")]) is None


@pytest.mark.parametrize(("away_m", "right"), [(0.9, True), (1.1, False)])
def test_a_stop_is_right_within_a_metre_of_what_was_meant(tmp_path: Path, away_m: float, right: bool) -> None:
    asks, _ = choose_questions(two_rooms(), [], tmp_path, np.random.default_rng(0))
    chair = asks[1].truth[0]
    stop = (chair.high[0] + away_m, chair.high[1], 0.0)
    move = LoggedMove("move_to", "'chair'", (0.0, 0.0, 0.0), stop, away_m, 0.0, True, (), np.zeros((1, 2)))
    outcome = Outcome("go", ("",), (), (), (move,), "Line 2: no.", "NavigationError", 1.0)
    drive = Drive("go", (asks[1], asks[3]), GroundPose(0.0, 0.0), outcome, outcome.error)
    assert drive.right == (right, False)
    assert drive.off_m == (pytest.approx(away_m), None)
    assert drive.to_json()["legs"][1] == {"to": asks[3].title, "right": False, "off_m": None}
    assert "never stopped for it" in drive.lines()[2]


def test_a_folder_that_holds_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(MapError, match="holds something else than a demonstration"):
        run_demo(tmp_path)
    assert (tmp_path / "thesis.tex").read_text() == "years of work"


def test_each_question_has_one_meaning_and_the_truth_beside_it(tmp_path: Path) -> None:
    photo = looking_at(7.0, 0.9, 4)
    asks, chosen = choose_questions(two_rooms(), [photo], tmp_path, np.random.default_rng(0))
    assert [ask.kind for ask in asks] == ["words", "sound", "clip", "area", "photo", "absent"]
    by_kind = {ask.kind: ask for ask in asks}
    assert by_kind["words"].title == "the couch"
    assert by_kind["sound"].title == "the chair near the sound of keyboard typing"
    assert by_kind["sound"].truth == (Box.of(two_rooms().objects[0]),)
    assert by_kind["sound"].others == (Box.of(two_rooms().objects[1]),)
    assert by_kind["area"].question.parts[1].modality is Modality.AREA
    assert by_kind["photo"].question.parts[1].modality is Modality.IMAGE
    assert chosen is photo
    assert by_kind["absent"].truth == ()


def test_nothing_is_asked_that_the_walk_did_not_show(tmp_path: Path) -> None:
    asks, photo = choose_questions(two_rooms(shown=False), [], tmp_path, np.random.default_rng(0))
    assert [ask.kind for ask in asks] == ["clip", "absent"]
    assert photo is None


def test_what_is_asked_in_vain_is_truly_missing(tmp_path: Path) -> None:
    for seed in range(5):
        asks, _ = choose_questions(two_rooms(), [], tmp_path, np.random.default_rng(seed))
        assert asks[-1].about in RARE
        assert asks[-1].about not in {one.category for one in two_rooms().objects}


def test_words_of_speech_were_never_labels_and_all_else_is_a_label() -> None:
    labels = set(load_network().notes.categories)
    assert not labels & set(SPOKEN.values())
    assert set(SPOKEN) | set(FURNITURE) | set(SMALL) | set(RARE) <= labels


def test_a_goal_inside_a_box_is_on_it_and_height_does_not_count() -> None:
    one = Box((0.0, 0.0, 0.0), (1.0, 2.0, 1.0))
    assert one.distance_m((0.5, 1.0, 9.0)) == 0.0
    assert one.distance_m((4.0, 6.0, 0.0)) == pytest.approx(5.0)
    assert one.apart_m(Box((2.0, 0.0, 5.0), (3.0, 1.0, 6.0))) == pytest.approx(1.0)


@pytest.mark.parametrize(("away_m", "found", "right"), [(0.9, True, True), (1.1, True, False), (0.0, False, False)])
def test_an_answer_is_right_when_it_is_found_within_reach(
    tmp_path: Path, away_m: float, found: bool, right: bool
) -> None:
    asks, _ = choose_questions(two_rooms(), [], tmp_path, np.random.default_rng(0))
    couch = asks[0].truth[0]
    goal = [couch.high[0] + away_m, couch.high[1], 0.4]
    step = Step(asks[0], {"found": found, "goals": [{"position": goal, "score": 0.5}]}, "p.png")
    assert step.off_m == pytest.approx(away_m)
    assert step.right is right
    assert step.verdict == ("right" if right else "WRONG" if found else "unsure")
    assert REACH_M == 1.0


def test_saying_that_there_is_none_is_right_only_where_there_is_none(tmp_path: Path) -> None:
    asks, _ = choose_questions(two_rooms(), [], tmp_path, np.random.default_rng(0))
    nothing = {"found": False, "goals": []}
    assert Step(asks[-1], nothing, "p.png").right
    assert not Step(asks[0], nothing, "p.png").right
    assert Step(asks[0], nothing, "p.png").verdict == "WRONG"
    assert not Step(asks[-1], {"found": True, "goals": [{"position": [0, 0, 0], "score": 1.0}]}, "p.png").right


def test_the_report_goes_on_with_what_was_answered(tmp_path: Path) -> None:
    asks, _ = choose_questions(two_rooms(), [], tmp_path, np.random.default_rng(0))
    right = {"found": True, "goals": [{"position": [*asks[0].truth[0].high[:2], 0.4], "score": 0.5}]}
    told = to_go_on([Step(asks[0], right, "p.png")], "house:1")
    assert asks[0].title in told and "get_nearest_pos" in command_to_program(re.findall('"(.*?)"', told)[1])
    assert to_go_on([Step(asks[0], {"found": False, "goals": []}, "p.png")], "house:1") == ""


@pytest.mark.nightly
def test_the_chosen_home_is_one_that_no_training_has_seen_and_can_be_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    assert FIRST_SEED == 3_000_000
    monkeypatch.setattr("avlmaps_sim.demo.run.FIRST_SEED", FIRST_SEED + 3)  # those before do not fit, nor does it
    scene = choose_home(0)
    assert fits(scene)
    assert scene.name == "house:3000004:held-out"
    assert 5 <= len(scene.areas) <= 9
    assert not fits(small_flat())
    assert len(record_settings(scene, DemoSettings()).categories) >= 6


def test_a_home_from_above_shows_every_room_and_nothing_outside() -> None:
    plan = from_above(small_flat())
    left, right, bottom, top = plan.extent
    assert left <= 0.0 and right >= 8.0 and bottom <= 0.0 and top >= 3.0
    height, width = plan.rgba.shape[:2]
    at = [(int((x - left) / (right - left) * width), int((top - 1.0) / (top - bottom) * height)) for x in (2.0, 6.0)]
    assert all(plan.rgba[row, column, 3] == 255 for column, row in at)
    assert plan.rgba[0, 0, 3] == 0


def test_places_are_drawn_with_y_up() -> None:
    sheet = Sheet.round((0.0, 2.0, 0.0, 1.0), (-1.0, 1.0, 0.0, 3.0))
    assert sheet.size == (300.0, 300.0)
    assert sheet.at(-1.0, 3.0) == (0.0, 0.0)
    assert sheet.at(2.0, 0.0) == (300.0, 300.0)


def test_an_envelope_reaches_one_and_keeps_silence_silent() -> None:
    samples = np.concatenate([np.zeros(500), np.full(500, -0.25)])
    assert envelope(samples, 4).tolist() == [0.0, 0.0, 1.0, 1.0]
    assert envelope(np.zeros(100), 4).max() == 0.0


def test_neighbouring_categories_differ_in_colour() -> None:
    colours = [np.array(colour_of("thing", number), int) for number in range(100)]
    assert min(np.abs(a - b).max() for a, b in pairwise(colours)) > 60
