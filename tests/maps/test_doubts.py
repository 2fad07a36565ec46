"""A recording that contradicts itself is refused, or let through by the reason's name; doubts stay with the map."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from build_fakes import SETTINGS, register_fakes

from avlmaps.core import poses
from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import RecordingError
from avlmaps.core.timeline import Trajectory
from avlmaps.live.live_map import LiveMap
from avlmaps.live.replay import end_drive, replay
from avlmaps.live.status import LiveSettings
from avlmaps.maps.build import build_map
from avlmaps.maps.estimate import doubts_of_channels, judge
from avlmaps.maps.finish import carving_doubts
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.manifest import Removed
from avlmaps.query.contents import Contents
from avlmaps.recordings import channels
from avlmaps.recordings.channels import ChannelSound, write_channels
from avlmaps.recordings.consistency.check import Grade, Reason
from avlmaps.recordings.layout import DESCRIPTION
from avlmaps.recordings.microphones import microphones_named
from avlmaps.recordings.open import open_recording
from avlmaps_sim.bench.recordings.drafts import Draft, RoomWalk
from helpers.heard_in_the_open import heard_in_the_open

PROFILE = register_fakes()


@pytest.fixture(scope="module")
def right() -> Draft:
    return RoomWalk("room", seed=61, frames=12).draft(Pinhole(45.0, 45.0, 32.0, 24.0, 64, 48))


@pytest.mark.slow
def test_it_is_refused_with_the_cause_and_the_name_that_lets_it_through(right: Draft, tmp_path: Path) -> None:
    walk = replace(right, poses=poses.inverse(right.poses)).write(tmp_path / "walk")
    said = r"walk cannot be right\. .*Corrections\.poses=camera-from-world.*allow=geometry\."
    with pytest.raises(RecordingError, match=said):
        build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False)
    with pytest.raises(RecordingError, match="nothing called 'geometri' to allow"):
        build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False, allow=["geometri"])
    stored = build_map(open_recording(walk), tmp_path / "map", PROFILE, SETTINGS, progress=False, allow=["geometry"])
    assert any("camera_from_world" in doubt for doubt in stored.info.doubts)
    assert set(stored.info.doubts) <= set(stored.info.notices)
    answer = Contents([], [], [], stored.info.doubts).to_json("map")
    assert answer.get("notes") == list(stored.info.doubts)


def test_a_right_one_has_no_doubts(right: Draft, tmp_path: Path) -> None:
    stored = build_map(
        open_recording(right.write(tmp_path / "walk")), tmp_path / "map", PROFILE, SETTINGS, progress=False
    )
    assert stored.info.doubts == ()
    assert "notes" not in Contents([], [], [], stored.info.doubts).to_json("map")


@pytest.fixture(scope="module")
def heard(right: Draft) -> ChannelSound:
    """What an array of four hears on that walk, slowly, of five sounds one after the other."""
    walk, middle = Trajectory(12.0 * right.stamps_s, right.poses), right.poses[:, :3, 3].mean(axis=0)
    sounds = [(middle + 2.0 * np.array([np.cos(k), np.sin(k), 0.1]), 5.0 * k + 1.0, 5.0 * k + 4.0) for k in range(5)]
    return heard_in_the_open(microphones_named("square4"), walk, sounds, np.random.default_rng(4))


def with_array(
    draft: Draft, heard: ChannelSound, folder: Path, order: tuple[int, ...] = (0, 1, 2, 3), dead: int | None = None
) -> Path:
    """Write a slow walk that an array listened on, its channels in an order, one of them perhaps dead."""
    stamps_s = 12.0 * draft.stamps_s
    path = replace(draft, stamps_s=stamps_s, pose_stamps_s=stamps_s).write(folder)
    array, sound = microphones_named("square4"), heard
    samples = sound.samples[list(order)]
    samples[[] if dead is None else [dead]] = 0.0
    write_channels(path / "audio.flac", ChannelSound(samples, sound.rate_hz))
    described = json.loads((path / DESCRIPTION).read_text())
    described["microphones"] = {"positions_m": array.position_m.tolist()}
    (path / DESCRIPTION).write_text(json.dumps(described))
    return path


def of_channels(doubts: tuple[str, ...]) -> tuple[str, ...]:
    """Return those but of the fake ears, to which all sounds are one."""
    return tuple(doubt for doubt in doubts if "features of sounds by fake/ears" not in doubt)


@pytest.mark.slow
def test_exchanged_channels_are_a_finding_with_the_order_that_fits(
    right: Draft, heard: ChannelSound, tmp_path: Path
) -> None:
    whole = judge(open_recording(with_array(right, heard, tmp_path / "whole")))
    assert not whole.findings
    found = judge(open_recording(with_array(right, heard, tmp_path / "wrong", order=(0, 2, 1, 3)))).findings
    assert [one.reason for one in found] == [Reason.MICROPHONES] and found[0].grade is Grade.SUSPICIOUS
    assert "Channels 2 and 3" in found[0].sentence and "in the order 1, 3, 2, 4" in found[0].sentence
    assert "positions_m" in found[0].remedy


@pytest.mark.nightly
def test_a_dead_channel_stays_with_the_map_and_the_sound_is_read_for_it_once(
    right: Draft, heard: ChannelSound, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = with_array(right, heard, tmp_path / "dead", dead=1)
    read, look = [], channels._looked_at
    monkeypatch.setattr(channels, "_looked_at", lambda track: read.append(track) or look(track))
    stored = build_map(open_recording(path), tmp_path / "map", PROFILE, SETTINGS, progress=False)
    (doubt,) = of_channels(stored.info.doubts)
    assert "Channel 2 of dead/audio.flac" in doubt and "not connected" in doubt
    assert len(read) == 1


@pytest.mark.nightly
@pytest.mark.parametrize("wrong", [{"order": (0, 2, 1, 3)}, {"dead": 1}], ids=["exchanged", "dead"])
def test_a_live_map_ends_with_the_doubts_about_channels_that_a_build_has(
    right: Draft, heard: ChannelSound, tmp_path: Path, wrong: dict[str, Any]
) -> None:
    recording = open_recording(with_array(right, heard, tmp_path / "rec", **wrong))
    assert recording.audio is not None
    live = LiveMap(
        tmp_path / "map", PROFILE, up_in_world=recording.up_in_world, settings=SETTINGS, live=LiveSettings(gates=False),
        microphones=recording.audio.microphones,
    )  # fmt: skip
    replay(recording, live, rate=None)
    assert not live.doubts
    said: list[str] = []
    end_drive(live, said.append)
    wanted = doubts_of_channels(recording.audio, recording.walk, "the sound")
    assert len(wanted) == 1 and of_channels(live.doubts) == wanted
    assert live.doubts == read(live.path).info.doubts
    assert said == [f"note: {doubt}" for doubt in live.doubts]


def test_much_that_is_seen_through_is_doubtful() -> None:
    assert not list(carving_doubts(Removed(seen_through=80), 920))
    assert "25%" in next(carving_doubts(Removed(seen_through=250), 750))
