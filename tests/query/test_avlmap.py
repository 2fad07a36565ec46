from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from query_fakes import asked, fake_encoders, fake_map, furnished_map, keyframes_at, sounds_of, voxels_of

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import AudioError, BackendError, QueryError
from avlmaps.core.question import Modality, Part, Question, Role
from avlmaps.query import locate as locate_module
from avlmaps.query.avlmap import AVLMap
from avlmaps.query.settings import AreaSettings, QuerySettings
from avlmaps.recordings.audio import AudioTrack, Sound

CHAIR = Part(Modality.OBJECT, "chair")
DOG = Part(Modality.SOUND, "dog")
HERE = np.array([[1.0, 1.0, 1.2]])


@pytest.fixture
def heard() -> AVLMap:
    return furnished_map(sounds=sounds_of([HERE], [0.8]))


def locating(
    monkeypatch: pytest.MonkeyPatch, pose: np.ndarray | None, inliers: int = 200, guess: np.ndarray | None = None
) -> None:
    camera = Pinhole(50.0, 50.0, 32.0, 24.0, 64, 48)
    located = locate_module.Located(pose, inliers, None, 0.0 if pose is None else 1.0, 0.0, camera, guess)
    monkeypatch.setattr(locate_module, "locate", lambda *given: located)


def test_the_answer_has_the_keys_of_the_contract(heard: AVLMap) -> None:
    answer = heard.ask(Question.of([CHAIR, DOG]), top=1).to_dict()
    keys = "goals found probability text parts elapsed_ms frame level_from_recording"
    assert list(answer) == keys.split()
    (goal,) = answer["goals"]
    assert list(goal) == ["position", "score", "size", "parts", "probability"]
    assert set(goal["parts"]) == {"object", "sound"}
    assert [part["role"] for part in answer["parts"]] == ["primary", "context"]
    assert [part["modality"] for part in answer["parts"]] == ["object", "sound"]
    assert [part["query"] for part in answer["parts"]] == ["chair", "dog"]
    assert [round(part["peak"], 3) for part in answer["parts"]] == [1.0, pytest.approx(0.8, abs=0.01)]
    assert answer["found"] is True
    assert answer["elapsed_ms"] > 0.0


def test_asking_gives_what_multiplying_gives(heard: AVLMap) -> None:
    answer = heard.ask(Question.of([CHAIR, DOG]))
    product = heard.object("chair", primary=True) * heard.sound("dog")
    assert answer.heat is not None
    np.testing.assert_array_equal(answer.heat.values, product.values)
    assert list(answer.goals) == product.goals()


def test_any_part_can_be_the_primary_one() -> None:
    roles = [part.role for part in Question.of([CHAIR, DOG], Modality.SOUND).parts]
    assert roles == [Role.CONTEXT, Role.PRIMARY]
    with pytest.raises(QueryError, match=r"^The query has no image to be its primary part; add one"):
        Question.of([CHAIR, DOG], Modality.IMAGE)


def test_a_question_without_parts_is_refused() -> None:
    with pytest.raises(QueryError, match=r"^The question is empty; name an object, a sound, an area or a picture\.$"):
        Question.of([])


@pytest.mark.parametrize("way", ["object", "sound", "area"])
def test_an_empty_phrase_is_refused(heard: AVLMap, way: str) -> None:
    with pytest.raises(QueryError, match=rf"^The {way} in the query is empty; name one: '"):
        getattr(heard, way)("  ")


def test_an_empty_map_answers_honestly(monkeypatch: pytest.MonkeyPatch) -> None:
    full = furnished_map()
    empty = asked(fake_map(voxels_of(np.zeros((0, 3)), np.zeros((0, 4))), encoders=full.encoders))
    locating(monkeypatch, None, inliers=0)
    picture = np.zeros((48, 64, 3), np.uint8)
    for heat in (empty.object("chair"), empty.sound("dog"), empty.image(picture)):
        assert (heat.peak, heat.found, heat.goals(), len(heat)) == (0.0, False, [], 0)
        assert heat.factors[0].note
    answer = empty.ask(Question.of([CHAIR, DOG])).to_dict()
    assert (answer["goals"], answer["found"]) == ([], False)
    assert [part["note"] for part in answer["parts"]] == ["the map holds no voxels", "the map holds no sounds"]


def test_a_profile_without_view_encoder_says_so(heard: AVLMap) -> None:
    expected = r"^The profile 'fake' has no views backend; choose another profile \(avlmaps profiles\)\.$"
    with pytest.raises(BackendError, match=expected):
        heard.area("kitchen")


def test_a_sound_that_was_not_heard_is_absent(heard: AVLMap) -> None:
    heat = heard.sound("helicopter")
    assert (heat.peak, heat.found) == (0.0, False)
    expected = "none of the 1 detected sounds is like 'helicopter'; the best score is 0.00, below 0.50"
    assert heat.factors[0].note == expected


def test_a_clip_asks_as_words_do(heard: AVLMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clip = Sound(np.full(1600, 0.1, np.float32), 16000)
    (tmp_path / "bark.wav").write_bytes(b"RIFF")
    monkeypatch.setattr(AudioTrack, "open", lambda path: SimpleNamespace(read=lambda: clip))
    by_file = heard.ask(Question.of([Part(Modality.SOUND, str(tmp_path / "bark.wav"), is_file=True)]))
    assert by_file.found
    np.testing.assert_array_equal(by_file.heat.values, heard.sound_clip(clip, primary=True).values)  # pyright: ignore


def test_clips_that_cannot_be_asked_with_are_refused(
    heard: AVLMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = tmp_path / "none.wav"
    with pytest.raises(QueryError, match=f"^The clip {missing} is not there; check the name\\.$"):
        heard.sound_clip(missing)
    (tmp_path / "photo.png").write_bytes(b"")
    with pytest.raises(QueryError, match=r"photo\.png is a picture, no clip; give it as image"):
        heard.sound_clip(tmp_path / "photo.png")
    for length, value, said in (
        (1600, 0.0, r"is silent \(its loudest sample is 0\)"), (0, 0.0, "no samples"), (10, np.nan, "NaN or infinity")
    ):  # fmt: skip
        with pytest.raises(QueryError, match=f"^The clip that was given .*{said}"):
            heard.sound_clip(Sound(np.full(length, value, np.float32), 16000))

    def unreadable(path: Path) -> None:
        raise AudioError("it is text.")

    text = tmp_path / "text.wav"
    text.write_text("no sound")
    monkeypatch.setattr(AudioTrack, "open", unreadable)
    with pytest.raises(QueryError, match=f"^The clip {text} cannot be read as sound: it is text\\.$"):
        heard.sound_clip(text)


def test_a_picture_heats_the_place_of_its_camera(
    heard: AVLMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pose = np.eye(4)
    pose[:3, 3] = [3.0, 2.0, 1.5]
    locating(monkeypatch, pose)
    photo = tmp_path / "photo.png"
    cv2.imwrite(str(photo), np.zeros((48, 64, 3), np.uint8))
    heat = heard.image(photo, primary=True)
    flat = np.linalg.norm(heard.space.centres[:, :2] - [3.0, 2.0], axis=1)
    np.testing.assert_allclose(heat.values, np.maximum(1.0 - 2.0 * flat, 0.0), atol=1e-6)
    (goal,) = heat.goals()
    assert goal.position == (3.0, 2.0, 1.5)
    assert (heat.found, goal.score, goal.size) == (True, 1.0, (0.0, 0.0, 0.0))


def test_a_picture_that_is_not_located_is_not_found(heard: AVLMap, monkeypatch: pytest.MonkeyPatch) -> None:
    locating(monkeypatch, None, inliers=7)
    heat = heard.image(np.zeros((48, 64, 3), np.uint8))
    assert (heat.peak, heat.found, heat.goals()) == (0.0, False, [])
    assert heat.factors[0].note == "the picture could not be located (7 points agree)"


def test_a_guess_heats_its_place_and_is_not_found(heard: AVLMap, monkeypatch: pytest.MonkeyPatch) -> None:
    guess = np.eye(4)
    guess[:3, 3] = [3.0, 2.0, 1.5]
    locating(monkeypatch, None, inliers=7, guess=guess)
    heat = heard.image(np.zeros((48, 64, 3), np.uint8), primary=True)
    assert (heat.found, heat.goals()[0].position) == (False, (3.0, 2.0, 1.5))
    told = "the picture could not be located (7 points agree); the heat is that of the best guess"
    assert heat.factors[0].note == told


def test_pictures_that_cannot_be_asked_with_are_refused(heard: AVLMap, tmp_path: Path) -> None:
    missing, text = tmp_path / "none.png", tmp_path / "text.png"
    text.write_text("no picture")
    with pytest.raises(QueryError, match=f"^The picture {missing} is not there; check the name\\.$"):
        heard.image(missing)
    with pytest.raises(QueryError, match=f"^The picture {text} cannot be read as an image; use a PNG or a JPEG\\.$"):
        heard.image(text)
    with pytest.raises(QueryError, match=r"^The picture has 64x48 pixels, its intrinsics are for 10x10; give those"):
        heard.image(np.zeros((48, 64, 3), np.uint8), Pinhole(10.0, 10.0, 5.0, 5.0, 10, 10))


def test_an_area_is_told_from_other_areas() -> None:
    from query_fakes import FakeViews

    places = np.array([[1.0, 1.0, 1.4], [5.0, 3.0, 1.4]])
    view = np.array([[1.0, 0.0], [0.0, 1.0]], np.float32)
    stored = furnished_map(keyframes=keyframes_at(places, view), views=FakeViews())
    m = asked(stored)
    assert m.area("kitchen").found
    placed = m.ask("the chair in the kitchen")
    assert {m.ask(said).text for said in ("kitchen chair", "the kitchen chair")} == {placed.text}
    assert m.ask(object="kitchen chair").goals == placed.goals != m.ask("the chair").goals
    assert m.object("kitchen chair", primary=True).probability == placed.probability > 0.0
    assert m.area("kitchen", primary=True).goals()[0].position == pytest.approx(tuple(stored.data.keyframes.centre[0]))
    from_camera = asked(stored, settings=QuerySettings(areas=AreaSettings(anchor="camera")))
    assert from_camera.area("kitchen", primary=True).goals()[0].position == pytest.approx((1.0, 1.0, 1.4))
    nowhere = furnished_map(keyframes=keyframes_at(places[1:], view[1:]), views=FakeViews()).area("kitchen")
    assert not nowhere.found
    assert nowhere.factors[0].note.startswith("no view is like 'kitchen'; the best score is 0.0")


def test_a_models_mismatch_is_told_before_anything_is_compared() -> None:
    stored = furnished_map(sounds=sounds_of([HERE], [0.8]))

    def refuse(kind: object) -> None:
        raise BackendError(f"another model for {kind}")

    stored.require_model = refuse
    with pytest.raises(BackendError, match="another model for pixels"):
        stored.object("chair")
    with pytest.raises(BackendError, match="another model for sounds"):
        stored.sound("dog")
    assert fake_encoders().name == "fake"


def test_a_phrase_that_is_a_whole_text_is_refused() -> None:
    with pytest.raises(
        QueryError, match=r"^The sound in the query has 10000 characters, more than 500; name it in a few"
    ):
        Part(Modality.SOUND, "x" * 10000)
    assert Part(Modality.IMAGE, "x" * 600 + ".png", is_file=True).is_file


def test_the_peak_of_a_picture_taken_far_from_any_voxel_is_that_of_its_place(
    heard: AVLMap, monkeypatch: pytest.MonkeyPatch
) -> None:
    pose = np.eye(4)
    pose[:3, 3] = [30.0, 20.0, 1.5]
    locating(monkeypatch, pose)
    monkeypatch.setattr("avlmaps.query.modalities.read_picture", lambda path: np.zeros((48, 64, 3), np.uint8))
    answer = heard.ask(Question.of([Part(Modality.IMAGE, "photo.png", is_file=True)]))
    assert (answer.goals[0].score, answer.parts[0].peak) == (1.0, 1.0)


@pytest.mark.parametrize("picture", [np.zeros((48, 64, 4), np.uint8), np.zeros((48, 64, 3), np.float32)])
def test_an_array_that_is_no_rgb_picture_is_refused(heard: AVLMap, picture: np.ndarray) -> None:
    with pytest.raises(QueryError, match=r"^The picture is an array of .* and shape \(.*; give RGB, uint8 of"):
        heard.image(picture)


def test_heat_times_a_number_in_place_is_another_heat(heard: AVLMap) -> None:
    heat = before = heard.object("chair")
    heat *= 2.0
    assert type(heat) is type(2.0 * before)
    np.testing.assert_allclose(np.asarray(heat), np.asarray(2.0 * before))
    with pytest.raises(TypeError):
        np.multiply(before, 2.0, **{"out": before})  # pyright: ignore[reportCallIssue, reportArgumentType]
