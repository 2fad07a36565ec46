"""Which camera of a bag is chosen, and which of its matrices holds for its images."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_rosbag import HEIGHT, START_S, WIDTH, BagMaker, world_from_body

from avlmaps.recordings.formats.ros_messages import camera_of, is_rectified, pair_images
from avlmaps.recordings.formats.rosbag import open_rosbag


def info(p_focal: float = 40.0) -> SimpleNamespace:
    k = np.array([60.0, 0, 20, 0, 60.0, 10, 0, 0, 1])
    p = np.array([p_focal, 0, 15.5, 0, 0, p_focal, 11.5, 0, 0, 0, 1, 0])
    return SimpleNamespace(k=k, d=np.array([-0.3, 0.1, 0, 0, 0]), p=p, width=WIDTH, height=HEIGHT)


def test_rectified_images_have_the_matrix_p_and_no_distortion() -> None:
    camera, distorted = camera_of(info(), "/camera_info", rectified=True)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (40.0, 40.0, 16.0, 12.0) and not distorted
    camera, distorted = camera_of(info(), "/camera_info")
    assert (camera.fx, camera.cx) == (60.0, 20.5) and distorted


def test_an_empty_matrix_p_leaves_k() -> None:
    camera, distorted = camera_of(info(p_focal=0.0), "/camera_info", rectified=True)
    assert camera.fx == 60.0 and distorted


@pytest.mark.parametrize(
    ("topic", "rectified"),
    [
        ("/camera/rgb/image_rect_color", True),
        ("/camera/depth/image_rect_raw", True),
        ("/camera/depth_registered/image_rect", True),
        ("/camera/color/image_rect/compressed", True),
        ("/zed/zed_node/rgb/image_rect_color", True),
        ("/camera/rectified/image", True),
        ("/camera/color/image_raw", False),
        ("/direction/image", False),
        ("/rectory/image_raw", False),
    ],
)
def test_what_is_rectified_shows_in_its_name(topic: str, rectified: bool) -> None:
    assert is_rectified(topic) == rectified


PAIRS = [
    (["/front/color/image_raw", "/rear/color/image_raw"],
     ["/front/depth/image_rect_raw", "/rear/aligned_depth_to_color/image_raw"],
     ("/rear/color/image_raw", "/rear/aligned_depth_to_color/image_raw")),
    (["/a/left/image", "/b/rgb/image_raw"], ["/a/depth/image"], ("/a/left/image", "/a/depth/image")),
    (["/r/front/rgb/image", "/r/rear/rgb/image"], ["/r/rear/depth/image"],
     ("/r/rear/rgb/image", "/r/rear/depth/image")),
    (["/camera/infra1/image", "/camera/color/image"], ["/camera/depth/image"],
     ("/camera/color/image", "/camera/depth/image")),
    (["/color"], ["/depth"], ("/color", "/depth")),
    ([], ["/depth"], ("", "/depth")),
]  # fmt: skip


@pytest.mark.parametrize(("colours", "depths", "chosen"), PAIRS)
def test_colour_and_depth_are_of_one_camera(colours: list[str], depths: list[str], chosen: tuple[str, str]) -> None:
    assert pair_images(colours, depths) == chosen
    assert pair_images(colours[::-1], depths[::-1]) == chosen


@given(st.integers(2, 5), st.data())
def test_cameras_of_several_namespaces_are_never_mixed(count: int, data: st.DataObject) -> None:
    names = [f"/robot/cam{i}" for i in range(count)]
    colours = data.draw(st.permutations([f"{name}/color/image_raw" for name in names]))
    depths = data.draw(st.permutations([f"{name}/{data.draw(st.sampled_from(['depth', 'aligned_depth']))}/image"
                                        for name in names]))  # fmt: skip
    rgb, depth = pair_images(colours, depths)
    assert rgb.split("/")[2] == depth.split("/")[2]


def test_a_bag_of_two_cameras_says_which_is_used(tmp_path: Path) -> None:
    maker = BagMaker("mcap", tmp_path)
    with maker.writer:
        for side in ("front", "rear"):
            maker.tf("/tf_static", START_S, "base_link", f"{side}_optical", np.eye(4))
        for i in range(6):
            stamp_s = START_S + i * 0.1
            maker.tf("/tf", stamp_s, "map", "base_link", world_from_body(stamp_s))
            for side, grey, depth in (("front", 10, "depth/image_rect_raw"), ("rear", 200, "aligned_depth/image_raw")):
                black = np.full((HEIGHT, WIDTH, 3), grey, np.uint8)
                flat = np.full((HEIGHT, WIDTH), 900, np.uint16)
                maker.camera_info(f"/{side}/color/camera_info", stamp_s)
                maker.camera_info(f"/{side}/{depth.split('/')[0]}/camera_info", stamp_s)
                maker.image(f"/{side}/color/image_raw", stamp_s, black, "rgb8", f"{side}_optical")
                maker.image(f"/{side}/{depth}", stamp_s, flat, "16UC1", f"{side}_optical")
    recording = open_rosbag(maker.path)
    assert (recording.topics["rgb"], recording.topics["depth"]) == (
        "/rear/color/image_raw", "/rear/aligned_depth/image_raw",
    )  # fmt: skip
    assert recording.frame(0).rgb.mean() == 200
    assert "depth=/front/depth/image_rect_raw" in recording.notices[0]
    front = open_rosbag(maker.path, {"depth": "/front/depth/image_rect_raw"})
    assert front.topics["rgb"] == "/front/color/image_raw" and not any("several cameras" in n for n in front.notices)
