"""The suite of sources: its measures by hand, and what it says of bad input."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avlmaps.core.errors import AvlmapsError
from avlmaps.maps.sources.correlation import SPEED_M_S
from avlmaps.recordings.channels import ChannelSound, read_channels
from avlmaps.recordings.microphones import microphones_named
from avlmaps_sim.bench.sources.calibrated import USUAL, Wrong, _trial, calibrated, surfaces
from avlmaps_sim.bench.sources.homes import (
    HomeOutcome,
    Mended,
    Placed,
    area_of,
    code_of,
    in_room,
    matched,
    nearest_held,
)
from avlmaps_sim.bench.sources.suite import (
    SOURCE_M,
    MeasuredRoom,
    arrays_of_four,
    direct_to_reverberant_db,
    measured_room,
    table_of_homes,
    table_of_mended,
    table_of_regions,
    walks_of_ratios,
)
from avlmaps_sim.hearing.acoustic import AcousticSettings
from avlmaps_sim.truth import HeardEvent
from helpers.hearing_scenes import area


def event(onset_s: float, offset_s: float) -> HeardEvent:
    return HeardEvent(onset_s, offset_s, "dog bark", "clip", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), -1)


def test_a_sound_is_matched_with_the_detected_one_that_overlaps_it_most() -> None:
    spans = [(0.0, 1.0), (1.1, 5.0), (9.0, 9.1)]
    assert matched([event(0.5, 3.0), event(6.0, 7.0), event(9.0, 9.1)], spans) == [(0, 1)]


def test_places_in_walls_belong_to_the_nearest_room() -> None:
    rooms = [area("kitchen", (0, 0), (4, 4)), area("bath", (4.1, 0), (8, 4))]
    assert [area_of(rooms, at) for at in ((1.0, 1.0), (5.0, 1.0), (4.08, 1.0), (20.0, 20.0))] == [0, 1, 1, -1]
    assert in_room(rooms, np.array([1.0, 1.0, 0.0]), np.array([2.0, 2.0, 0.0]))
    assert in_room(rooms, np.array([20.0, 20.0, 0.0]), np.array([2.0, 2.0, 0.0])) is None


def test_a_truth_off_the_map_counts_at_the_nearest_cell() -> None:
    held = np.zeros((4, 5), bool)
    held[1, 1] = True
    assert nearest_held(held, 19) == 6 and nearest_held(held, 6) == 6


def test_the_table_counts_what_was_placed() -> None:
    placed = [
        Placed("square4", 0.1, True, 0.3, 1.0, True, True, 0.5, 9, 0.9),
        Placed("square4", 0.7, False, 0.6, 2.0, None, True, 0.5, 9, 0.2),
        Placed("room's middle", 1.0, True),
    ]
    made = table_of_homes([HomeOutcome("house:1", 3, 2, tuple(placed))])
    first, last = (dict(zip(made["columns"], row, strict=True)) for row in made["rows"])
    assert (first["sounds"], first["within 0.5 m %"], first["right room %"]) == (2, 50.0, 50.0)
    assert first["said %"] == 55.0 and last["said %"] == ""
    assert (first["in 90 % region %"], first["right thing of 3 %"], first["of"]) == (100.0, 100.0, 1)
    assert last["by"] == "room's middle" and last["in 90 % region %"] == ""


def test_the_regions_are_counted_by_what_they_promise() -> None:
    placed = [Placed("mono", 0.1, True, begin) for begin in (0.0, 0.45, 0.5, 0.93)]
    made = table_of_regions([HomeOutcome("house:1", 4, 4, (*placed, Placed("nearest thing", 1.0, True)))])
    (row,) = made["rows"]
    held = dict(zip(made["columns"], row, strict=True))
    assert (held["by"], held["sounds"], held["in 10 % region %"]) == ("mono", 4, 25.0)
    assert [held[f"in {share} % region %"] for share in (40, 50, 90, 95)] == [25.0, 50.0, 75.0, 100.0]


def test_what_was_mended_is_told_and_refusals_are_counted() -> None:
    known = Mended((0.04, 0.002), (1e-4, 5e-6), 6.0, 4.0), Mended((0.02, float("nan")), (5e-5, float("nan")))
    made = table_of_mended([HomeOutcome("house:1", 0, 0, (), one) for one in known])
    rows = {row[0]: row[1:] for row in made["rows"]}
    assert rows["an array's worst place as given, cm"] == [2, 3.0, 4.0]
    assert rows["calibrated past a ticking thing, cm"] == [1, 0.2, 0.2]
    assert rows["a device's offset, missed by degrees"] == [1, 6.0, 6.0]
    assert made["note"].startswith("1 of 2")


@pytest.mark.nightly
def test_an_array_that_was_put_wrong_is_calibrated_and_its_track_is_late(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    wrong = Wrong.of(microphones_named("square4"), rng)
    found = calibrated(wrong, AcousticSettings(snr_db=20.0, rt60_s=0.4), rng, tmp_path / "drive.wav", 20.0)
    before, after = wrong.off(wrong.given), wrong.off(found.microphones)
    assert before[0] > 0.01 and before[1] > 1e-5
    assert after[0] < 0.3 * before[0] and after[1] < 0.5 * before[1]


def test_late_channels_are_late_by_what_was_drawn(tmp_path: Path) -> None:
    wrong = replace(Wrong.of(microphones_named("stereo"), np.random.default_rng(1)), late_s=np.array([5e-4, -5e-4]))
    samples = np.zeros((2, 16_000), np.float32)
    samples[:, 8000] = 0.9
    track = wrong.track(ChannelSound(samples, 16_000), tmp_path / "late.wav")
    heard = read_channels(track, 0.0, 1.0).samples
    assert np.abs(heard).argmax(axis=1).tolist() == [8008, 7992]


def test_the_code_that_finds_sources_has_a_checksum() -> None:
    assert code_of() == code_of() and len(code_of()) == 64


def test_the_ratio_of_direct_sound_falls_as_the_reverberation_grows() -> None:
    rng = np.random.default_rng(0)
    tail = rng.standard_normal(8000) * np.exp(-np.arange(8000) / 2000.0)
    ratios = []
    for level in (0.01, 0.02, 0.04):
        response = level * tail
        response[:200] = 0.0
        response[100] = 1.0
        ratios.append(direct_to_reverberant_db(response.astype(np.float32), 16_000))
    assert np.allclose(np.diff(ratios), -6.02, atol=0.3)


@pytest.mark.few(1)
@pytest.mark.parametrize("front_db", [0.0, 5.0])
def test_ratios_find_the_source_whichever_way_it_faces(front_db: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avlmaps_sim.bench.sources.suite._WALKS", 25)
    rows, columns = np.divmod(np.arange(25), 5)
    place = np.column_stack([3.68 - 0.5 * columns, 3.0 + 0.5 * rows, np.full(25, 1.2)])
    away = place - np.array([3.36, 2.0, 1.5])
    facing = np.cos(np.arctan2(away[:, 1], away[:, 0]) - 1.0)
    tail = 0.01 * np.random.default_rng(1).standard_normal(3000)
    response = np.tile(tail, (25, 1))
    response[:, 100] = 10.0 ** (front_db * facing / 20.0) / np.linalg.norm(away, axis=1)
    room = MeasuredRoom(place, response.astype(np.float32), 16_000)
    errors = walks_of_ratios(room, np.random.default_rng(0))
    assert np.median(errors) < 0.3
    assert np.median(walks_of_ratios(room, np.random.default_rng(0), 16)) < np.median(errors)


@pytest.mark.nightly
def test_an_array_of_receivers_is_found_though_signs_are_turned() -> None:
    rows, columns = np.divmod(np.arange(25), 5)
    place = np.column_stack([3.68 - 0.5 * columns, 3.0 + 0.5 * rows, np.full(25, 1.2)])
    late = np.linalg.norm(place - SOURCE_M, axis=1) / SPEED_M_S * 48_000
    response = 0.02 * np.random.default_rng(2).standard_normal((25, 4000)) * np.exp(-np.arange(4000) / 1000.0)
    response[np.arange(25), np.rint(late).astype(int) + 20] = np.where(np.arange(25) % 3, 1.0, -1.0)
    errors = arrays_of_four(MeasuredRoom(place, response.astype(np.float32), 48_000), np.random.default_rng(0), 4)
    assert np.median(errors) < 0.25


def test_a_room_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(AvlmapsError, match="S1R01"):
        measured_room(tmp_path, 0)


@pytest.mark.nightly
def test_a_usual_trial_finds_its_source() -> None:
    errors = [_trial(USUAL, np.random.default_rng([0, number]))[0] for number in (1, 2)]
    assert max(errors) < 1.0
    low, high = surfaces().min(axis=0), surfaces().max(axis=0)
    assert np.allclose(low, 0.0) and np.allclose(high, [6.0, 5.0, 2.3], atol=0.11)
