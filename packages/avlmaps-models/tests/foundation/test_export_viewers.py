"""Files for Rerun and Foxglove are opened again by their own libraries."""

import subprocess
import sys
from collections import Counter
from pathlib import Path

import cv2
import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.core.errors import QueryError
from avlmaps.core.poses import FrameName
from avlmaps.query.export_viewers import CAMERA_FRAME, ExportedBox, ExportedSound, Layers, write_foxglove, write_rerun


def some_layers() -> Layers:
    """Return two keyframes, three voxels, a chair and a bark."""
    picture = cv2.imencode(".jpg", np.full((24, 32, 3), 90, np.uint8))[1].tobytes()
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, 0, 3] = [1.0, 2.0]
    return Layers(
        frame=FrameName.LEVEL,
        points=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32),
        colors=np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255]], np.uint8),
        voxel_size_m=0.05,
        things=(ExportedBox("chair", 0.8, (1.0, 2.0, 0.5), (0.5, 0.5, 1.0), (0.0, 0.0, 0.0, 1.0), (10, 20, 30)),),
        sounds=(ExportedSound("dog bark", 0.7, (2.0, 0.0, 1.0), 101.5, 103.0),),
        heat=("the chair", np.array([0.0, 0.5, 1.0], np.float32)),
        stamp_s=np.array([100.0, 102.0]),
        frame_from_camera=poses,
        camera=Pinhole(30.0, 30.0, 16.0, 12.0, 32, 24),
        pictures=(picture, picture),
    )


def test_rerun_verifies_its_file_and_finds_every_layer(tmp_path: Path) -> None:
    written = write_rerun(tmp_path / "new" / "a.rrd", some_layers())
    for verb in ("verify", "print"):
        done = subprocess.run(
            [sys.executable, "-m", "rerun", "rrd", verb, str(written)], capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stderr
    for entity in ("points", "heat", "things", "path", "camera", "camera/picture", "sounds"):
        assert f"/map/{entity}" in done.stdout
    assert [path.name for path in written.parent.iterdir()] == ["a.rrd"], "nothing is left beside it"


def test_mcap_holds_every_layer_at_its_time(tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    layers = some_layers()
    with write_foxglove(tmp_path / "a.mcap", layers).open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        read = [
            (schema.name if schema else "", channel.topic, message.log_time / 1e9, decoded)
            for schema, channel, message, decoded in reader.iter_decoded_messages()
        ]
    count = Counter(topic for _, topic, _, _ in read)
    often = {"/tf": 2, "/camera": 2, "/camera_info": 2}
    assert count == {"/map": 1, "/heat": 1, "/things": 1, "/path": 1, "/sounds": 1, **often}
    assert all(schema.startswith("foxglove.") for schema, *_ in read)
    one = {topic: (at_s, message) for _, topic, at_s, message in reversed(read)}
    assert one["/sounds"][0] == pytest.approx(101.5)
    assert [at_s for _, topic, at_s, _ in read if topic == "/camera"] == pytest.approx([100.0, 102.0])
    cloud = one["/heat"][1]
    rows = np.frombuffer(cloud.data, np.dtype([("xyz", "<f4", 3), ("heat", "<f4"), ("rgba", "u1", 4)]))
    assert cloud.point_stride == rows.dtype.itemsize
    assert [field.name for field in cloud.fields] == ["x", "y", "z", "heat", "red", "green", "blue", "alpha"]
    np.testing.assert_allclose(rows["xyz"], layers.points)
    np.testing.assert_allclose(rows["heat"], [0.0, 0.5, 1.0])
    box = one["/things"][1].entities[0]
    assert (box.cubes[0].size.z, box.frame_id, box.metadata[0].value) == (1.0, "level", "chair")
    transform = one["/tf"][1]
    assert (transform.parent_frame_id, transform.child_frame_id) == ("level", CAMERA_FRAME)
    assert transform.translation.x == pytest.approx(1.0)


@pytest.mark.parametrize("write", [write_rerun, write_foxglove])
def test_a_place_that_cannot_be_written_is_named(write: object, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert callable(write)
    with pytest.raises(QueryError, match="cannot be written"):
        write(tmp_path / "file" / "a.rrd", some_layers())
