"""Where a sound came from: laws of the evidence, and sources at known places in known rooms."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.maps.sources.candidates import CELL_M, CandidateGrid, Density, Spread, Walls, candidates_of, log_same_place
from avlmaps.maps.sources.correlation import SPEED_M_S, SourceSettings, correlate, levels_db, steer, unknown_offset
from avlmaps.maps.sources.find import carry_evidence
from avlmaps.maps.types import SourceEvidence

RATE_HZ = 16_000
SQUARE = np.array([[0.1, 0.1, 0.0], [0.1, -0.1, 0.0], [-0.1, -0.1, 0.0], [-0.1, 0.1, 0.0]])


def delayed(noise: np.ndarray, seconds: float) -> np.ndarray:
    """Return a signal later by any time, by its spectrum."""
    hz = np.fft.rfftfreq(len(noise), 1.0 / RATE_HZ)
    return np.fft.irfft(np.fft.rfft(noise) * np.exp(-2j * np.pi * hz * seconds), len(noise))


def room(x: float = 6.0, y: float = 5.0, step: float = 0.1) -> np.ndarray:
    """Return points on the floor and the walls of a box."""
    a, b = np.meshgrid(np.arange(0, x, step), np.arange(0, y, step), indexing="ij")
    floor = np.column_stack([a.ravel(), b.ravel(), np.zeros(a.size)])
    heights = np.arange(0.0, 2.4, step)
    walls = [np.array([(w, v, h) for v in np.arange(0, y, step) for h in heights]) for w in (0.0, x)] + [
        np.array([(u, w, h) for u in np.arange(0, x, step) for h in heights]) for w in (0.0, y)
    ]
    return np.concatenate([floor, *walls]) + 0.025


def uniform(share: np.ndarray) -> np.ndarray:
    return np.full(len(share), 1.0 / len(share))


# --- correlations and steering


@given(st.floats(0.8, 6.0), st.floats(0.0, 2 * np.pi), st.integers(0, 9))
def test_the_steered_sum_is_greatest_in_the_true_direction(far_m: float, angle: float, seed: int) -> None:
    noise = np.random.default_rng(seed).standard_normal(RATE_HZ)
    source = np.array([far_m * np.cos(angle), far_m * np.sin(angle), 0.0])
    away = np.linalg.norm(SQUARE - source, axis=1)
    samples = np.stack([delayed(noise, metres / SPEED_M_S) for metres in away]).astype(np.float32)
    found = correlate(samples, RATE_HZ, 0.0, 0.0, 0.29).smoothed(3.0)
    around = np.deg2rad(np.arange(0.0, 360.0, 2.0))
    places = far_m * np.column_stack([np.cos(around), np.sin(around), np.zeros(len(around))])
    total = steer(found, np.tile(SQUARE, (len(found.at_s), 1, 1)), places)
    apart = np.angle(np.exp(1j * (around[np.argmax(total)] - angle)))
    assert abs(np.rad2deg(apart)) < 4.0


def test_silence_and_what_only_lingers_say_nothing() -> None:
    quiet = correlate(np.zeros((4, RATE_HZ), np.float32), RATE_HZ, 0.0, 0.0, 0.29)
    assert not quiet.weight.any()
    rng = np.random.default_rng(0)
    tail = rng.standard_normal((4, RATE_HZ)) * 10.0 ** (-6.0 * np.arange(RATE_HZ) / RATE_HZ)  # falls as rooms do
    lingering = correlate(tail.astype(np.float32), RATE_HZ, 0.0, 0.0, 0.29)
    assert lingering.weight[3:].mean() < 0.5 * lingering.weight[0]


# --- one microphone


@given(st.floats(-60.0, 60.0))
def test_loudness_that_is_not_known_changes_nothing(offset_db: float) -> None:
    walk = np.column_stack([np.linspace(0, 3, 6), np.zeros(6)])
    places = np.array([[1.0, 1.0], [3.0, -2.0], [-1.0, 0.5]])
    away = np.linalg.norm(walk[:, None] - places[None], axis=2)
    measured = -20.0 * np.log10(away[:, 1])
    one, other = (unknown_offset(measured + plus, away, 2.0) for plus in (0.0, offset_db))
    assert np.allclose(one, other)
    assert int(np.argmax(one)) == 1 and one[1] == pytest.approx(0.0, abs=1e-9)


def test_levels_are_those_of_the_sound_and_not_of_the_noise() -> None:
    rng = np.random.default_rng(0)
    samples = 1e-3 * rng.standard_normal(3 * RATE_HZ)
    samples[RATE_HZ : 2 * RATE_HZ] += 0.1 * rng.standard_normal(RATE_HZ)
    at_s, level_db = levels_db(samples.astype(np.float32), RATE_HZ, 10.0, 1.0)
    assert len(at_s) and at_s.min() > 10.9 and at_s.max() < 12.1
    assert np.ptp(level_db[:-1]) < 3.0


# --- candidates and walls


def test_candidates_share_all_probability_and_lie_where_surface_or_air_is() -> None:
    ear = np.array([[3.0, 2.5, 1.3]])
    found = candidates_of(room(), ear)
    assert found.prior.sum() == pytest.approx(1.0)
    assert found.in_air.any() and not found.in_air.all()
    assert found.place_m[found.in_air, 2].min() > 0.2
    assert not len(candidates_of(np.zeros((0, 3)), ear))


def test_sound_from_behind_a_wall_comes_through_the_doorway() -> None:
    heights, along = np.arange(0.0, 2.4, 0.05), np.arange(0.0, 4.0, 0.05)
    wall = np.array([(4.0, y, h) for y in along for h in heights if not 3.0 < y < 3.9])
    both = np.concatenate([room(8.0, 4.0, 0.05), wall])
    walls = Walls.of(both, 1.3)
    ear, places = np.array([6.0, 1.0]), np.array([[7.0, 3.0], [2.0, 1.0]])
    assert walls.behind(ear, places).tolist() == [False, True]
    gate, rest_m = walls.seen_through(ear, places)
    assert np.allclose(gate[0], places[0]) and rest_m[0] == 0.0
    assert 2.9 < gate[1, 1] < 4.0 and abs(gate[1, 0] - 4.0) < 0.8
    assert rest_m[1] > 2.0


# --- probabilities


def densities(seed: int) -> tuple[CandidateGrid, np.ndarray, list[Density]]:
    rng = np.random.default_rng(seed)
    place = room(step=0.15)
    plan, prior = CandidateGrid.of(place), uniform(place)
    spots = place[rng.choice(len(place), 2)]
    out = [
        Density.of(plan, prior, -((place - at) ** 2).sum(axis=1) / 0.1, np.zeros(len(place)), SourceSettings())
        for at in spots
    ]
    return plan, prior, out


@given(st.integers(0, 20), st.floats(0.05, 0.6), st.floats(0.65, 0.98))
def test_regions_hold_what_they_say_and_lie_within_one_another(seed: int, low: float, high: float) -> None:
    _, _, (one, _) = densities(seed)
    assert one.share.sum() == pytest.approx(1.0) and (one.share >= 0.0).all()
    small, large = one.region(low), one.region(high)
    assert one.share[small].sum() >= low and one.share[large].sum() >= high
    assert not (small & ~large).any()
    assert one.within_m(low) <= one.within_m(high)
    assert one.share[small].min() >= one.share[~small].max()
    cell = int(np.random.default_rng(seed).integers(one.share.size))
    assert small.ravel()[cell] == (one.likelier_than(cell) < low)


@given(st.integers(0, 20))
def test_two_sounds_of_one_place_are_one_source_and_of_two_places_two(seed: int) -> None:
    plan, prior, (one, other) = densities(seed)
    apart_m = float(np.linalg.norm(one.position_m - other.position_m))
    assert log_same_place(one, one, prior) > 0.0
    assert log_same_place(one, other, prior) == pytest.approx(log_same_place(other, one, prior))
    if apart_m > 2.0:
        assert log_same_place(one, other, prior) < 0.0
    flat = Density(plan, plan.sums(prior))
    assert log_same_place(one, flat, prior) == pytest.approx(0.0, abs=1e-6), "what says nothing decides nothing"


def around(sigma_m: float, seed: int, numbers: SourceSettings) -> Density:
    """Return the density of evidence that falls off as a Gaussian round a place well inside the room."""
    place, rng = room(step=0.15), np.random.default_rng(seed)
    at = rng.uniform([1.5, 1.5, 0.0], [4.5, 3.5, 0.0])
    evidence = -((place - at)[:, :2] ** 2).sum(axis=1) / (2.0 * sigma_m**2)
    return Density.of(CandidateGrid.of(place), uniform(place), evidence, np.zeros(len(place)), numbers)


@given(st.floats(0.05, 1.5), st.floats(1.1, 4.0), st.integers(0, 9))
def test_what_is_known_less_well_is_never_likelier_right(sigma_m: float, wider: float, seed: int) -> None:
    one, other = (around(sigma, seed, SourceSettings()).spread for sigma in (sigma_m, sigma_m * wider))
    assert 0.0 <= other.right <= one.right + 0.01 <= 1.01
    assert other.within_50_m >= one.within_50_m - CELL_M and other.within_90_m >= one.within_90_m - CELL_M


@given(st.floats(0.11, 0.6), st.floats(1.2, 3.0), st.floats(0.0, 0.2), st.integers(0, 9))
def test_larger_errors_never_make_a_place_likelier(blur_m: float, wider: float, astray: float, seed: int) -> None:
    small, large = (SourceSettings(blur_m=(b, 0.6), astray=astray) for b in (blur_m, blur_m * wider))
    assert around(0.1, seed, large).spread.right <= around(0.1, seed, small).spread.right + 0.01


@given(st.integers(0, 200))
def test_a_source_that_lies_in_one_cell_is_right_with_certainty(seed: int) -> None:
    plan = CandidateGrid.of(room(step=0.15))
    share = np.zeros(plan.shape)
    share.ravel()[np.random.default_rng(seed).choice(np.flatnonzero(plan.is_held))] = 1.0
    assert Density(plan, share).spread == Spread(1.0, 0.0, 0.0)


# --- evidence of several maps


def evidence_of(seed: int, sounds: int = 2) -> SourceEvidence:
    """Return evidence of sounds in the room, each round a place."""
    rng = np.random.default_rng(seed)
    found = candidates_of(room(), np.array([[3.0, 2.5, 1.3]]))
    at = found.place_m[rng.choice(len(found), sounds)]
    heard = -((found.place_m[None] - at[:, None]) ** 2).sum(axis=2) / 0.5
    return SourceEvidence(
        place=found.place_m, prior=found.prior.astype(np.float32),
        heard=(heard - heard.max(axis=1, keepdims=True)).astype(np.float16),
        expected=np.full(heard.shape, -0.5, np.float16), moving=np.zeros(sounds, np.uint8),
        channels=np.array([4], np.int64),
    )  # fmt: skip


@given(st.integers(0, 9), st.floats(0.0, 6.0), st.floats(-3.0, 3.0))
def test_evidence_that_is_carried_names_the_moved_places(seed: int, angle: float, x: float) -> None:
    own, turn = evidence_of(seed), np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turn[:3, 3] = [x, 1.0, 0.0]
    moved, up = room() @ turn[:3, :3].T + turn[:3, 3], np.array([0.0, 0.0, 1.0])
    robot = (turn[:3, :3] @ [3.0, 2.5, 1.3] + turn[:3, 3])[None]
    found = carry_evidence([(own, turn)], moved, robot, up)
    assert found is not None and len(found) == len(own) and found.prior.sum() == pytest.approx(1.0, abs=1e-3)
    for number in range(len(own)):
        before = own.place[np.argmax(own.heard[number])] @ turn[:3, :3].T + turn[:3, 3]
        assert np.linalg.norm(found.place[np.argmax(found.heard[number])] - before) < 0.35


def test_evidence_on_the_same_surface_stays_as_it_was() -> None:
    own, robot = evidence_of(3), np.array([[3.0, 2.5, 1.3]])
    both = carry_evidence([(own, np.eye(4)), (own, np.eye(4))], room(), robot, np.array([0.0, 0.0, 1.0]))
    assert both is not None and len(both) == 2 * len(own)
    assert np.allclose(both.place, own.place) and np.allclose(both.prior, own.prior)
    assert np.allclose(both.heard, np.concatenate([own.heard, own.heard]), atol=0.02)
    assert np.allclose(both.expected, -0.5, atol=0.01)


def test_what_a_day_did_not_see_is_less_likely_by_its_distance() -> None:
    own, up = evidence_of(1, 1), np.array([0.0, 0.0, 1.0])
    wide = carry_evidence([(own, np.eye(4))], room(9.0), np.array([[3.0, 2.5, 1.3]]), up)
    assert wide is not None
    beyond = wide.place[:, 0] > 7.0
    assert wide.expected[0][beyond].max() < wide.expected[0][~beyond].max() - 0.2
    assert carry_evidence([(own, np.eye(4))], np.zeros((0, 3)), np.array([[3.0, 2.5, 1.3]]), up) is None


def test_shares_of_candidates_add_up_to_their_cells() -> None:
    place = room(step=0.15)
    plan, prior = CandidateGrid.of(place), uniform(place)
    evidence = -((place - place[100]) ** 2).sum(axis=1) / 0.1
    density = Density.of(plan, prior, evidence, np.zeros(len(place)), SourceSettings())
    share = density.of_candidates(prior, evidence)
    assert np.allclose(plan.sums(share), density.share, atol=1e-9)


@given(st.integers(0, 20))
def test_near_the_robot_every_place_in_the_air_has_a_candidate_beside_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ear = np.array([[*rng.uniform([1.5, 1.5], [4.5, 3.5]), 1.3]])
    found = candidates_of(room(), ear)
    assert found.prior.sum() == pytest.approx(1.0) and len(found.prior) == len(found.place_m)
    place = ear[0] + rng.uniform([-0.4, -0.4, -0.9], [0.4, 0.4, 0.3])
    assert np.linalg.norm(found.place_m - place, axis=1).min() < 0.15
    near = np.linalg.norm(found.place_m[:, :2] - ear[0, :2], axis=1) < 0.6
    columns = found.prior[near & found.in_air].sum() / (np.pi * 0.6**2)
    every = found.prior[found.in_air].sum() / 30.0  # of a room of 6 x 5 m: finer cells are no likelier places
    assert columns == pytest.approx(every, rel=0.3)
