"""Files of other hands, each with its right value: what people who do this job really have."""

import json
import tarfile
from pathlib import Path
from tempfile import gettempdir

import numpy as np
import pytest

import avlmaps
from avlmaps.core.errors import RecordingError
from avlmaps.maps.audio.segmentation import segment
from avlmaps.recordings.consistency.check import Grade
from avlmaps.recordings.consistency.suspicions import examine_recording
from avlmaps.recordings.open import open_recording

ROUND4 = Path(__file__).resolve().parents[3] / "shared/field/round4"
pytestmark = [
    pytest.mark.shared,
    pytest.mark.skipif(not ROUND4.is_dir(), reason="files of other hands are not beside the repository"),
]


def test_six_channels_are_not_believed_to_be_one() -> None:
    bag = ROUND4 / "respeaker_6ch.bag"
    for topics in ({}, {"audio_pcm": "16000,1"}):
        with pytest.raises(RecordingError, match=r"audio_pcm=16000,6"):
            open_recording(bag, topics=topics)
    recording = open_recording(bag, topics={"audio_pcm": "16000,6"})
    track = recording.audio
    assert track is not None
    assert track.every_channel(0, 1).shape == (1, 6)
    assert track.duration_s == pytest.approx(12.0, abs=0.2)
    power = [float(np.square(track.read(at_s, at_s + 0.2).samples).mean()) for at_s in np.arange(0.0, 11.0, 0.2)]
    assert 0.2 * int(np.argmax(power)) == pytest.approx(8.2, abs=0.61)


def test_the_bark_stays_where_microphones_are_described(tmp_path: Path) -> None:
    """The first of the six channels is the device's own processing, the last its playback: both are all but silent."""
    places = [[0.03, 0.03, 0], [0.03, -0.03, 0], [-0.03, -0.03, 0], [-0.03, 0.03, 0]]
    for described in (
        {"positions_m": places, "channels": [2, 3, 4, 5]},
        {"positions_m": [[0, 0, 0], *places, [0, 0, 0.1]]},
    ):
        array = tmp_path / "array.json"
        array.write_text(json.dumps(described))
        recording = open_recording(ROUND4 / "respeaker_6ch.bag", topics={"audio_pcm": "16000,6"}, microphones=array)
        assert recording.audio is not None
        (bark,) = segment(recording.audio)
        assert bark.onset_s == pytest.approx(8.2, abs=0.3)
    with pytest.raises(RecordingError, match=r"^/audio has 6 channel") as refused:
        open_recording(ROUND4 / "respeaker_6ch.bag", topics={"audio_pcm": "16000,6"}, microphones="square4")
    assert gettempdir() not in str(refused.value)


def test_the_sound_of_an_archive_is_its_sound() -> None:
    recording = open_recording(ROUND4 / "with_sound.r3d")
    assert recording.audio is not None
    assert recording.audio.start_s == recording.stamps_s[0]
    assert recording.audio.duration_s == pytest.approx(recording.duration_s, abs=0.5)
    assert float(np.abs(recording.audio.read().samples).max()) > 0.01


def test_corrected_cameras_without_a_size_have_that_of_their_pictures(tmp_path: Path) -> None:
    with tarfile.open(ROUND4 / "polycam_no_width.tgz") as packed:
        packed.extractall(tmp_path, filter="data")
    recording = open_recording(tmp_path / "polywh")
    assert (recording.rig.rgb.width, recording.rig.rgb.height) == (128, 96)
    assert recording.rig.rgb.fx == 92.0
    assert examine_recording(recording).grade is Grade.FINE


@pytest.mark.nightly
def test_a_photo_of_one_of_two_rooms_that_look_alike_says_that_the_other_fits_as_well(tmp_path: Path) -> None:
    with tarfile.open(ROUND4 / "two_identical_rooms.tgz") as packed:
        packed.extractall(tmp_path, filter="data")
    avlmap = avlmaps.build_map(tmp_path / "two", tmp_path / "two.avlmap")
    for number in range(4):
        found = avlmap.locate(tmp_path / f"two{number}.png")
        assert found.elsewhere is not None
        apart_m = found.elsewhere[:3, 3] - found.world_from_camera[:3, 3]
        assert np.abs(apart_m) == pytest.approx([8.0, 0.0, 0.0], abs=0.3)
        asked = avlmap.ask(image=tmp_path / f"two{number}.png")
        assert asked.alike == 2 and asked.goals[0].probability == asked.goals[1].probability == found.score
