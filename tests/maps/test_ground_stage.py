"""What a build keeps and reports of the floor: the manifest, the notices, the hint of a user and of a robot."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from build_fakes import SETTINGS, Walk, register_fakes

from avlmaps.cli.output import ground_lines
from avlmaps.core.errors import MapError
from avlmaps.maps.build import build_map
from avlmaps.maps.estimate import estimate_ground, ground_notices
from avlmaps.maps.settings import DEFAULTS, BuildSettings, GravitySettings
from avlmaps.maps.store.folder import read
from avlmaps.maps.store.manifest import GroundInfo, UpInfo
from avlmaps.maps.store.map_data import MapData, describe
from avlmaps.maps.types import FloorGuess, FloorInfo
from avlmaps.recordings.types import BaseHeight, Frame, Recording
from helpers.filmed_rooms import RIG, UP, film, office

PROFILE = register_fakes()
UP_INFO = UpInfo.of(UP, "recording", 1.0)


class Filmed(Recording):
    """Frames in memory."""

    fingerprint = "filmed"  # pyright: ignore[reportAssignmentType]

    def __init__(self, frames: list[Frame], base_height: BaseHeight | None = None) -> None:
        self.path, self.format, self.rig = Path("filmed"), "fake", RIG
        self.stamps_s = np.array([frame.stamp_s for frame in frames])
        self.world_from_camera = np.stack([frame.world_from_camera for frame in frames])
        self.up_in_world, self.audio, self.notices, self.frames_ = UP, None, (), frames
        self.base_height = base_height

    def frame(self, index: int) -> Frame:
        return self.frames_[index]


def desk_only(base_height: BaseHeight | None = None) -> Filmed:
    """A film of desks 0.41 m under the camera; the floor, 1.15 m under it, is out of view."""
    looks = [(3.6 + 0.02 * i, 2.6, 1.15, 40.0 * i, 88.0) for i in range(12)]
    return Filmed(film(office(), looks), base_height)


def given(camera_height_m: float) -> BuildSettings:
    return replace(DEFAULTS, gravity=GravitySettings(camera_height_m=camera_height_m))


def guess(camera_height_m: float, confidence: float, in_view: bool = True, below: float = 0.0) -> FloorGuess:
    return FloorGuess(
        height_m=-camera_height_m,
        camera_height_m=camera_height_m,
        confidence=confidence,
        in_view=in_view,
        level_m2=3.0,
        below=below,
    )


def ground_of(best: FloorGuess, second: FloorGuess | None, cameras: float = 1.0) -> GroundInfo:
    return GroundInfo(known_from="surfaces", floors=(FloorInfo(best=best, runner_up=second, cameras=cameras),))


def test_a_film_without_floor_gets_a_notice_that_says_what_to_do() -> None:
    ground, info = estimate_ground(desk_only(), DEFAULTS, UP_INFO)
    assert info.main().best.confidence < 0.7 and info.known_from == "surfaces"
    (notice,) = ground_notices(info)
    assert "GravitySettings.camera_height_m" in notice
    assert len(ground.camera_m) == 12


def test_the_height_that_a_user_gives_is_taken_without_a_notice() -> None:
    ground, info = estimate_ground(desk_only(), given(1.15), UP_INFO)
    assert ground.camera_height_m(desk_only().world_from_camera[0]) == pytest.approx(1.15, abs=0.05)
    assert info.known_from == "user" and info.main().best.confidence > 0.9
    assert list(ground_notices(info)) == []


def test_a_given_height_that_most_surfaces_lie_below_gets_a_notice() -> None:
    looks = [(1.0 + 0.1 * i, 1.0, 1.35, 60.0 + 5 * i, 25.0) for i in range(12)]
    _, info = estimate_ground(Filmed(film(office(), looks)), given(0.61), UP_INFO)
    assert [notice for notice in ground_notices(info) if "below the floor that was given" in notice]


def test_the_base_of_a_robot_is_a_hint() -> None:
    ground, info = estimate_ground(desk_only(BaseHeight(1.15, on_floor=True)), DEFAULTS, UP_INFO)
    assert ground.camera_height_m(desk_only().world_from_camera[0]) == pytest.approx(1.15, abs=0.05)
    assert info.known_from == "recording"
    above, _ = estimate_ground(desk_only(BaseHeight(1.0, on_floor=False)), DEFAULTS, UP_INFO)
    assert above.camera_height_m(desk_only().world_from_camera[0]) > 1.0


def test_two_floors_that_explain_the_data_get_a_notice_with_both() -> None:
    (notice,) = ground_notices(ground_of(guess(1.4, 0.5), guess(0.7, 0.4)))
    assert notice.startswith("Two floors explain") and "1.40 m" in notice and "0.70 m" in notice
    assert list(ground_notices(ground_of(guess(1.4, 0.95), guess(0.7, 0.04)))) == []
    assert list(ground_notices(ground_of(guess(1.4, 0.5), guess(0.7, 0.4), cameras=0.05))) == []
    (unseen,) = ground_notices(ground_of(guess(1.3, 0.5, in_view=False), None))
    assert unseen.startswith("No floor is in view")


@pytest.mark.parametrize("height_m", [0.0, -1.0, 141.0, float("nan")])
def test_a_height_that_no_camera_has_is_refused(height_m: float) -> None:
    with pytest.raises(MapError, match=r"between 0\.02 and 10, in metres"):
        GravitySettings(camera_height_m=height_m)


def built(path: Path) -> MapData:
    return build_map(Walk(6), path, PROFILE, SETTINGS, progress=False)


def test_a_map_keeps_the_floor_and_describes_it(tmp_path: Path) -> None:
    stored = built(tmp_path / "a.avlmap")
    info = stored.info.ground
    assert info is not None and stored.info.timings.stages_s["frames"] > 0.0
    said = json.loads(json.dumps(describe(tmp_path, stored)))["ground"]
    assert said["camera_height_m"] == info.main().best.camera_height_m
    assert 0.0 <= said["confidence"] <= 1.0 and said["known_from"] == "surfaces"
    assert f"floor: {said['camera_height_m']:.2f} m under the camera" in ground_lines(said)[0]


def test_a_map_of_an_older_release_opens_without_a_floor(tmp_path: Path) -> None:
    built(tmp_path / "a.avlmap")
    manifest = tmp_path / "a.avlmap" / "map.json"
    content = json.loads(manifest.read_text())
    del content["ground"], content["settings"]["gravity"]["camera_height_m"]
    manifest.write_text(json.dumps(content))
    stored = read(tmp_path / "a.avlmap")
    assert stored.info.ground is None and describe(tmp_path, stored)["ground"] is None
