"""Video frames by number are the frames that were written, in whatever order they are asked."""

from pathlib import Path

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import RecordingError
from avlmaps.recordings.images import VideoFrames

COUNT = 60


@pytest.fixture(scope="module", params=["mp4", "mkv"])
def video(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> VideoFrames:
    path = tmp_path_factory.mktemp("video") / f"walk.{request.param}"
    write_video(path)
    return VideoFrames(path)


def write_video(path: Path) -> None:
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25, options={"crf": "5", "g": "12"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for i in range(COUNT):
            picture = np.full((48, 64, 3), 4 * i, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


@given(order=st.lists(st.integers(0, COUNT - 1), min_size=1, max_size=6))
def test_any_order_gives_the_frames_that_were_written(video: VideoFrames, order: list[int]) -> None:
    for index in order:
        assert abs(float(video.picture(index).mean()) - 4 * index) < 3.0


def test_a_file_that_is_no_video_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(RecordingError, match=r"x\.mp4 cannot be read as a video"):
        VideoFrames(path)


def test_a_video_cut_short_is_refused(tmp_path: Path) -> None:
    whole, part = tmp_path / "whole.mp4", tmp_path / "part.mp4"
    write_video(whole)
    part.write_bytes(whole.read_bytes()[:-600])
    with pytest.raises(RecordingError):
        VideoFrames(part)
