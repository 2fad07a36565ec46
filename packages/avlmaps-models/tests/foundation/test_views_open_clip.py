"""Models of open_clip for areas: the published computation on tiny random checkpoints in the published layout."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from tiny.open_clip_views import PERCEPTION, PLAIN, SCALE, random_model, write_open_clip_views

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.models.prompts import AREA_PROMPTS
from avlmaps.perception.protocols import ScaledEncoder
from avlmaps_models.foundation.open_clip_views import OpenClipViews

PE, VIT = "timm/PE-Core-B-16", "laion/CLIP-ViT-B-16-DataComp.XL-s13B-b90K"


def _squashed(rgb: np.ndarray, size: int) -> torch.Tensor:
    from PIL import Image

    small = np.asarray(Image.fromarray(rgb).resize((size, size), Image.Resampling.BILINEAR), np.float32)
    return torch.from_numpy((small / 255.0 - 0.5) / 0.5).permute(2, 0, 1)[None]


def test_a_perception_encoder_conforms_and_computes_what_open_clip_does(models: Path) -> None:
    write_open_clip_views(models)
    views = OpenClipViews(PE)
    check(Kind.VIEWS, views)
    assert views.card.id == PE and views.card.licence == "Apache-2.0" and views.card.note == ""
    frame, network = example_frame(3, width=130, height=90), random_model(PERCEPTION)
    with torch.no_grad():
        expected = network.encode_image(_squashed(frame.rgb, 384), normalize=True)[0].numpy()
    np.testing.assert_allclose(views.encode([frame])[0], expected, atol=1e-5)


def test_a_plain_clip_conforms_and_computes_what_open_clip_does(models: Path) -> None:
    import open_clip

    write_open_clip_views(models, VIT, plain=True)
    views = OpenClipViews(VIT)
    check(Kind.VIEWS, views)
    assert isinstance(views, ScaledEncoder) and views.logit_scale == pytest.approx(SCALE, rel=1e-5)
    assert views.card.licence == "MIT"
    frame, network = example_frame(3, width=130, height=90), random_model(PLAIN)
    tokens = open_clip.SimpleTokenizer(context_length=77)([prompt.format("kitchen") for prompt in AREA_PROMPTS])
    with torch.no_grad():
        view = network.encode_image(_squashed(frame.rgb, 48), normalize=True)[0]
        text = network.encode_text(tokens, normalize=True).mean(dim=0)
    np.testing.assert_allclose(views.encode([frame])[0], view.numpy(), atol=1e-5)
    expected = torch.nn.functional.normalize(text, dim=0).numpy()
    np.testing.assert_allclose(views.encode_words(["kitchen"])[0], expected, atol=1e-5)


def test_the_preparation_is_that_of_the_folder(models: Path) -> None:
    write_open_clip_views(models, VIT, plain=True)
    frame = example_frame(3)
    before = OpenClipViews(VIT)
    path = models / VIT / "open_clip_config.json"
    whole = json.loads(path.read_text(encoding="utf-8"))
    whole["preprocess_cfg"]["mean"] = [0.0] * 3
    path.write_text(json.dumps(whole), encoding="utf-8")
    after = OpenClipViews(VIT)
    assert not np.allclose(before.encode([frame]), after.encode([frame]), atol=1e-3)
    assert before.card.checksum != after.card.checksum


def test_apples_own_folders_hold_a_single_file_and_no_configuration(
    models: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The architecture is told by the name; pictures are only scaled to [0, 1], as open_clip knows of these weights."""
    import open_clip.factory
    from PIL import Image

    place = models / "apple" / "MobileCLIP2-S0"
    place.mkdir(parents=True)
    torch.save(random_model(PLAIN).state_dict(), place / "mobileclip2_s0.pt")
    monkeypatch.setitem(open_clip.factory._MODEL_CONFIGS, "MobileCLIP2-S0", PLAIN)  # the real one has 75 M weights
    views = OpenClipViews("apple/MobileCLIP2-S0")
    assert views.card.licence == "LicenseRef-apple-amlr" and views.card.note.startswith("Research only")
    frame = example_frame(3, width=60, height=60)
    small = np.asarray(Image.fromarray(frame.rgb).resize((48, 48), Image.Resampling.BILINEAR), np.float32) / 255.0
    with torch.no_grad():
        expected = random_model(PLAIN).encode_image(torch.from_numpy(small).permute(2, 0, 1)[None], normalize=True)
    np.testing.assert_allclose(views.encode([frame])[0], expected[0].numpy(), atol=1e-5)
    (place / "mobileclip2_s0.pt").rename(models / "apple" / "other.pt")
    with pytest.raises(BackendError, match=r"has no file of weights .* hf download apple/MobileCLIP2-S0$"):
        OpenClipViews("apple/MobileCLIP2-S0")


def test_a_folder_that_does_not_say_what_it_is_is_refused(models: Path) -> None:
    write_open_clip_views(models, "me/mine", plain=True)
    (models / "me/mine/open_clip_config.json").unlink()
    with pytest.raises(BackendError, match=r"has no open_clip_config\.json and is not called like a model that"):
        OpenClipViews("me/mine")


def test_weights_must_be_those_of_the_configuration(models: Path) -> None:
    from safetensors.torch import load_file, save_file

    write_open_clip_views(models, VIT, plain=True)
    path = models / VIT / "open_clip_model.safetensors"
    weights = load_file(path)
    gone = {name: row for name, row in weights.items() if name != "text_projection"}
    for wrong in (gone, weights | {"visual.more": torch.zeros(1)}):
        save_file(wrong, path, metadata={"format": "pt"})
        with pytest.raises(BackendError, match=r"cannot be loaded by open_clip .* hf download laion/CLIP"):
            OpenClipViews(VIT)
