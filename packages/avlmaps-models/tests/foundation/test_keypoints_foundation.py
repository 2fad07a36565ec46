"""DISK and ALIKED by kornia: strict loading, conventions, and the same computation as kornia's own pipeline."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import torch
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tiny.aliked import write_aliked
from tiny.disk import write_disk

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind, load
from avlmaps.perception.conformance import check
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps_models.common.pictures import local_features, shrunk
from avlmaps_models.foundation import aliked, disk
from helpers.picture_room import painting

WRITERS = {"disk": write_disk, "aliked": write_aliked}


def picture(width: int = 160, height: int = 120, seed: int = 0) -> np.ndarray:
    return painting(np.random.default_rng(seed), height, width, shapes=120)


def as_tensor(rgb: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(rgb.transpose(2, 0, 1).astype(np.float32))[None] / 255.0


@pytest.fixture(params=["disk", "aliked"])
def name(request: pytest.FixtureRequest, models: Path) -> str:
    WRITERS[request.param](models)
    return request.param


def test_it_conforms(name: str) -> None:
    check(Kind.LOCAL, load(Kind.LOCAL, name))


def test_keypoints_have_scores_and_know_the_size_of_their_picture(name: str) -> None:
    found = load(Kind.LOCAL, name).encode(picture())
    assert len(found.xy) > 10
    assert found.size == (160, 120)
    assert found.score.shape == (len(found.xy),) and (found.score > 0).all() and (found.score < 1).all()


def test_disk_tells_what_kornia_finds_with_pixel_centres_at_one_half(models: Path) -> None:
    write_disk(models)
    rgb = picture(150, 100)
    found = load(Kind.LOCAL, "disk").encode(rgb)
    network = disk.DISK().eval()
    network.load_state_dict(torch.load(models / "depth-save.pth", weights_only=True)["extractor"])
    with torch.no_grad():
        heat, dense = network.heatmap_and_dense_descriptors(
            torch.nn.functional.pad(as_tensor(rgb), (0, 160 - 150, 0, 112 - 100))
        )
    heat, dense = heat[0, 0, :100, :150].numpy(), dense[0, :, :100, :150].numpy()
    expected = {
        (x, y): dense[:, y, x]
        for y in range(2, 98)
        for x in range(2, 148)
        if heat[y, x] > 0 and (heat[y - 2 : y + 3, x - 2 : x + 3] >= heat[y, x]).sum() == 1
    }
    assert {(x - 0.5, y - 0.5) for x, y in found.xy.tolist()} == set(expected)
    for (x, y), descriptor, score in zip(found.xy - 0.5, found.descriptors, found.score, strict=True):
        own = expected[int(x), int(y)]
        np.testing.assert_allclose(descriptor, own / np.linalg.norm(own), atol=1e-4)
        assert score == pytest.approx(1 / (1 + np.exp(-heat[int(y), int(x)])), abs=1e-4)


def test_aliked_tells_all_that_kornia_finds_and_stays_sub_pixel(models: Path) -> None:
    write_aliked(models)
    rgb = picture(150, 100)
    found = load(Kind.LOCAL, "aliked").encode(rgb)
    network = aliked.ALIKED("aliked-n16", max_num_keypoints=aliked.MAX_KEYPOINTS).eval()
    network.load_state_dict(torch.load(models / "aliked-n16.pth", weights_only=True), strict=False)
    with torch.no_grad():
        expected = network(as_tensor(rgb))[0]
    # Kornia takes strict maxima alone; the published suppression leaves others besides.
    apart = np.linalg.norm(expected.keypoints.numpy()[:, None] - (found.xy - 0.5), axis=2)
    same = apart.argmin(axis=1)
    assert len(found.xy) > len(same) > 100 and len(set(same.tolist())) == len(same)
    np.testing.assert_allclose(found.xy[same] - 0.5, expected.keypoints.numpy(), atol=1e-3)
    np.testing.assert_allclose(found.descriptors[same], expected.descriptors.numpy(), atol=1e-4)
    np.testing.assert_allclose(found.score[same], expected.keypoint_scores.numpy(), atol=1e-5)
    assert (np.abs(found.xy - 0.5 - np.round(found.xy - 0.5)) > 1e-3).mean() > 0.5


@pytest.mark.parametrize("name", ["aliked-t16", "aliked-n16rot", "aliked-n32"])
def test_another_aliked_can_be_chosen(models: Path, name: str) -> None:
    write_aliked(models, name)
    encoder = load(Kind.LOCAL, f"aliked@{name}")
    found = encoder.encode(picture())
    assert found.descriptors.shape[1] == encoder.card.dim == (64 if name == "aliked-t16" else 128)
    assert encoder.card.id == f"aliked/{name}.pth"


def test_a_path_to_a_checkpoint_can_be_chosen(models: Path) -> None:
    write_disk(models)
    moved = models.parent / "mine.pth"
    (models / "depth-save.pth").rename(moved)
    assert load(Kind.LOCAL, f"disk@{moved}").card.id == "disk/mine.pth"


def test_a_large_picture_is_seen_smaller_and_told_in_its_own_pixels(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module: Any = {"disk": disk, "aliked": aliked}[name]
    monkeypatch.setattr(module, "MAX_SIDE_PX", 128)
    large = cv2.resize(picture(128, 96), (256, 192), interpolation=cv2.INTER_NEAREST)
    small = shrunk(large, 128)
    encoder = load(Kind.LOCAL, name)
    whole, part = encoder.encode(large), encoder.encode(small)
    np.testing.assert_allclose(whole.xy, 2.0 * part.xy, atol=1e-3)
    np.testing.assert_allclose(whole.descriptors, part.descriptors, atol=1e-4)
    assert whole.size == (256, 192) and part.size == (128, 96)


def test_the_strongest_are_kept_where_there_are_too_many(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    module: Any = {"disk": disk, "aliked": aliked}[name]
    every = load(Kind.LOCAL, name).encode(picture())
    monkeypatch.setattr(module, "MAX_KEYPOINTS", 12)
    few = getattr(module, {"disk": "DiskKeypoints", "aliked": "AlikedKeypoints"}[name])().encode(picture())
    assert len(few.xy) == 12
    # ALIKED ranks by the maximum and tells the score at the refined place, a little beside it
    assert few.score.min() >= np.sort(every.score)[-16]


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(width=st.integers(1, 90), height=st.integers(1, 90), seed=st.integers(0, 99))
def test_pictures_of_any_size_have_keypoints_inside_or_none(name: str, width: int, height: int, seed: int) -> None:
    rgb = np.random.default_rng(seed).integers(0, 256, (height, width, 3)).astype(np.uint8)
    encoder = load(Kind.LOCAL, name)
    found = encoder.encode(rgb)
    assert found.descriptors.shape == (len(found.xy), encoder.card.dim)
    assert found.size == (width, height)
    assert ((found.xy > 0) & (found.xy < (width, height))).all()


def test_a_strip_has_no_keypoints_or_some_inside(name: str) -> None:
    rgb = np.random.default_rng(0).integers(0, 256, (40, 6000, 3)).astype(np.uint8)
    found = load(Kind.LOCAL, name).encode(rgb)
    assert ((found.xy > 0) & (found.xy < (6000, 40))).all()


def test_the_same_picture_gives_the_same_keypoints(name: str) -> None:
    first, second = (load(Kind.LOCAL, name).encode(picture(seed=3)) for _ in range(2))
    for part in ("xy", "descriptors", "score"):
        np.testing.assert_allclose(getattr(first, part), getattr(second, part), atol=1e-4)


def test_nothing_is_fetched_and_the_command_is_told(models: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TORCH_HOME", str(models.parent / "torch"))
    for backend, file in (("disk", "depth-save.pth"), ("aliked", "aliked-n16.pth")):
        with pytest.raises(BackendError) as fault:
            load(Kind.LOCAL, backend)
        assert str(fault.value) == (
            f"The checkpoint {file} is not here (looked in {models}); get it with: hf download kornia/{backend} {file}"
        )


@pytest.mark.parametrize("place", ["torch/hub/checkpoints", "models/kornia/{}"])
def test_the_cache_of_torch_and_a_folder_of_the_repositorys_name_are_looked_through(
    name: str, place: str, models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TORCH_HOME", str(models.parent / "torch"))
    file = {"disk": "depth-save.pth", "aliked": "aliked-n16.pth"}[name]
    held = models.parent / place.format(name)
    held.mkdir(parents=True)
    (models / file).rename(held / file)
    assert load(Kind.LOCAL, name).card.id == f"{name}/{file}"


def test_the_card_hangs_on_the_weights(models: Path) -> None:
    write_disk(models)
    before = load(Kind.LOCAL, "disk").card
    held = torch.load(models / "depth-save.pth", weights_only=True)
    held["extractor"]["unet.path_down.0.1.3.bias"] += 1.0
    torch.save(held, models / "depth-save.pth")
    with using_models(ModelSettings(folder=models, device="cpu")):
        assert load(Kind.LOCAL, "disk").card.checksum != before.checksum


def test_a_file_of_another_network_is_one_sentence(models: Path) -> None:
    write_aliked(models)
    (models / "aliked-n16.pth").rename(models / "depth-save.pth")
    with pytest.raises(BackendError) as fault:
        load(Kind.LOCAL, "disk")
    assert str(fault.value) == (
        f"{models}/depth-save.pth is not the checkpoint of DISK: it lacks unet.path_down.0.1.3.weight, "
        "unet.path_down.0.1.3.bias and 24 more; nothing takes block1.conv1.weight, block1.bn1.weight and "
        f"{len(torch.load(models / 'depth-save.pth')) - 2} more. Get the published one with: hf download kornia/disk "
        "depth-save.pth"
    )


def test_a_weight_of_another_size_a_missing_and_a_left_over_one_are_told(models: Path) -> None:
    write_aliked(models)
    state = torch.load(models / "aliked-n16.pth", weights_only=True)
    state["conv1.weight"] = torch.zeros(3)
    state["more"] = state.pop("conv2.weight")
    torch.save(state, models / "aliked-n16.pth")
    with pytest.raises(BackendError, match=r"it lacks conv2\.weight; nothing takes more; of another size is conv1"):
        load(Kind.LOCAL, "aliked")


class Mischief:
    def __reduce__(self) -> tuple:
        return (print, ("run",))


@pytest.mark.parametrize("content", ["rubbish", "pickle", "list"])
def test_a_damaged_or_dangerous_file_is_one_sentence(models: Path, content: str, capsys: Any) -> None:
    path = models / "depth-save.pth"
    if content == "rubbish":
        path.write_bytes(b"\x00not weights")
    else:
        torch.save({"extractor": Mischief()} if content == "pickle" else [torch.zeros(1)], path)
    with pytest.raises(BackendError, match=r"depth-save\.pth (cannot be read|holds list)"):
        load(Kind.LOCAL, "disk")
    assert "run" not in capsys.readouterr().out


def test_an_unknown_model_is_one_sentence(models: Path) -> None:
    with pytest.raises(BackendError, match="There is no DISK called 'disk-sea'; choose disk-depth, disk-epipolar"):
        load(Kind.LOCAL, "disk@disk-sea")
    with pytest.raises(BackendError, match="There is no ALIKED called 'n16'; choose aliked-n16, "):
        load(Kind.LOCAL, "aliked@n16")


@given(
    size=st.tuples(st.integers(32, 4000), st.integers(32, 4000)),
    factor=st.integers(1, 4),
    place=st.tuples(st.floats(0, 1), st.floats(0, 1)),
)
def test_the_middle_of_a_pixel_is_told_in_the_middle_of_what_it_covers(
    size: tuple[int, int], factor: int, place: tuple[float, float]
) -> None:
    """A network's pixel i covers i to i + 1 of its picture, factor times that of the picture that was given."""
    width, height = size
    index = np.floor(np.array([place]) * np.array([width - 1, height - 1]))
    seen, rgb = (
        np.broadcast_to(np.uint8(0), (height, width, 3)),
        np.broadcast_to(np.uint8(0), (height * factor, width * factor, 3)),
    )
    one = np.ones((1, 4), np.float32)
    told = local_features(index, one, np.ones(1, np.float32), seen, rgb).xy
    covered = np.stack([index[0], index[0] + 1]) * factor
    np.testing.assert_allclose(told[0], covered.mean(axis=0), rtol=1e-6)
