"""CLIP for areas: the published computation on a tiny random checkpoint in the published layout."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from tiny.clip import DIM, IMAGE, SCALE, write_clip
from tiny.siglip2 import write_siglip2

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.perception.protocols import ScaledEncoder
from avlmaps_models.common.prompts import AREA_PROMPTS
from avlmaps_models.foundation.clip import ClipViews
from avlmaps_models.foundation.open_views import UNKNOWN_LICENCE, licence_of, note_of

MODEL = "openai/clip-vit-large-patch14"
MEAN, DEVIATION = (0.48145466, 0.4578275, 0.40821073), (0.26862954, 0.26130258, 0.27577711)


def test_it_conforms(models: Path) -> None:
    write_clip(models)
    views = ClipViews(MODEL)
    check(Kind.VIEWS, views)
    assert views.card.id == MODEL and views.card.dim == DIM and views.card.licence == "MIT"
    assert isinstance(views, ScaledEncoder) and views.logit_scale == pytest.approx(SCALE, rel=1e-5)
    assert ClipViews(str(models / MODEL)).card.id == "clip-vit-large-patch14", "no path of this machine in a map"


def test_pictures_are_resized_cut_and_seen_as_the_published_code_does(models: Path) -> None:
    from PIL import Image
    from transformers import CLIPModel

    write_clip(models)
    frame = example_frame(3, width=130, height=90)
    height, width = IMAGE, int(IMAGE * 130 / 90)
    small = np.asarray(Image.fromarray(frame.rgb).resize((width, height), Image.Resampling.BICUBIC), np.float32)
    left = (width - IMAGE) // 2
    cut = (small[:, left : left + IMAGE] / 255.0 - MEAN) / DEVIATION
    network = CLIPModel.from_pretrained(models / MODEL).eval()
    pixels = torch.from_numpy(cut.astype(np.float32)).permute(2, 0, 1)[None]
    with torch.no_grad():
        expected = network(input_ids=torch.zeros((1, 3), dtype=torch.long), pixel_values=pixels).image_embeds[0].numpy()
    np.testing.assert_allclose(ClipViews(MODEL).encode([frame])[0], expected, atol=1e-5)


def test_words_are_the_mean_of_their_sentences_by_the_models_own_forward(models: Path) -> None:
    from transformers import AutoTokenizer, CLIPModel

    write_clip(models)
    network, tokenizer = CLIPModel.from_pretrained(models / MODEL).eval(), AutoTokenizer.from_pretrained(models / MODEL)
    rows = []
    for prompt in AREA_PROMPTS:
        read = tokenizer(prompt.format("kitchen"), return_tensors="pt")
        with torch.no_grad():
            told = network(**read, pixel_values=torch.zeros((1, 3, IMAGE, IMAGE)))
        rows.append(told.text_embeds[0])
    expected = torch.nn.functional.normalize(torch.stack(rows).mean(dim=0), dim=0).numpy()
    views = ClipViews(MODEL)
    np.testing.assert_allclose(views.encode_words(["kitchen"])[0], expected, atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(views.encode_words(["kitchen", "a" * 400]), axis=1), 1.0, atol=1e-6)


def test_a_frames_feature_does_not_depend_on_the_frames_beside_it(models: Path) -> None:
    write_clip(models)
    frames = [example_frame(seed) for seed in range(3)]
    views = ClipViews(MODEL)
    alone = np.concatenate([views.encode([frame]) for frame in frames])
    np.testing.assert_allclose(views.encode(frames), alone, atol=1e-5)
    with using_models(ModelSettings(folder=models, device="cpu", batch=3, offline=True)):
        np.testing.assert_allclose(views.encode(frames), ClipViews(MODEL).encode(frames), atol=1e-5)


def test_metaclip_2_has_the_same_interface(models: Path) -> None:
    """Its text tower has other numbers for the ends; it is read by its own class."""
    from transformers import MetaClip2Config, MetaClip2Model

    name = "facebook/metaclip-2-worldwide-s16"
    write_clip(models, name)
    config = json.loads((models / name / "config.json").read_text(encoding="utf-8"))
    text, vision = config["text_config"], config["vision_config"]
    for part in (text, vision):
        part.pop("model_type", None)
    end = text["vocab_size"] - 1
    text |= {"eos_token_id": end, "bos_token_id": end - 1, "pad_token_id": 1}
    made = MetaClip2Model(MetaClip2Config(text_config=text, vision_config=vision, projection_dim=DIM))
    made.save_pretrained(models / name)
    views = ClipViews(name)
    check(Kind.VIEWS, views)
    assert views.card.licence == "CC-BY-NC-4.0" and views.card.note.startswith("Research only")


def test_a_checkpoint_of_another_model_is_refused(models: Path) -> None:
    write_siglip2(models)
    with pytest.raises(BackendError, match=r"holds a model of the type 'siglip', expected is 'clip' or 'metaclip_2'"):
        ClipViews("google/siglip2-base-patch16-224")


def test_weights_that_nothing_takes_are_refused_but_old_counters_are_not(models: Path) -> None:
    from safetensors.torch import load_file, save_file

    write_clip(models)
    path = models / MODEL / "model.safetensors"
    weights = load_file(path)
    counters = {"text_model.embeddings.position_ids": torch.arange(77)[None]}  # as the published file has them
    save_file(weights | counters, path, metadata={"format": "pt"})
    assert ClipViews(MODEL).card.dim == DIM
    save_file(weights | {"text_model.other": torch.zeros(1)}, path, metadata={"format": "pt"})
    with pytest.raises(BackendError, match=r"nothing takes text_model\.other"):
        ClipViews(MODEL)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(BackendError, match=r"get it again with: hf download openai/clip-vit-large-patch14"):
        ClipViews(MODEL)


@pytest.mark.parametrize(
    ("model", "licence"),
    [
        ("openai/clip-vit-base-patch32", "MIT"),
        ("/data/models/openai--clip-vit-base-patch32", "MIT"),
        ("/data/clip-vit-base-patch32/", "MIT"),
        ("facebook/metaclip-2-worldwide-b16", "CC-BY-NC-4.0"),
        ("timm/PE-Core-B-16", "Apache-2.0"),
        ("timm/MobileCLIP2-S0-OpenCLIP", "LicenseRef-apple-amlr"),
        ("apple/MobileCLIP2-S0", "LicenseRef-apple-amlr"),
        ("google/siglip2-base-patch16-224", "Apache-2.0"),
        ("someone/clip-of-mine", UNKNOWN_LICENCE),
    ],
)
def test_licences_are_told_by_the_hubs_id(model: str, licence: str) -> None:
    assert licence_of(model) == licence
    research = licence not in ("MIT", "Apache-2.0", UNKNOWN_LICENCE)
    assert note_of(licence).startswith("Research only") == research
