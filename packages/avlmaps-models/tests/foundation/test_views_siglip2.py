"""SigLIP 2 for areas: the published computation on a tiny random checkpoint in the published layout."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import torch
from tiny.clip import write_clip
from tiny.siglip2 import BIAS, IMAGE, PLACES, SCALE, write_siglip2

from avlmaps.core.errors import BackendError
from avlmaps.core.registry import Kind
from avlmaps.perception.conformance import check, example_frame
from avlmaps.perception.protocols import NamedViewEncoder, ScaledEncoder
from avlmaps_models.common.prompts import AREA_PROMPTS
from avlmaps_models.foundation.siglip2 import SiglipTokens, SiglipViews

MODEL, NAFLEX = "google/siglip2-base-patch16-224", "google/siglip2-base-patch16-naflex"


@pytest.mark.parametrize("naflex", [False, True])
def test_it_conforms(models: Path, naflex: bool) -> None:
    write_siglip2(models, NAFLEX if naflex else MODEL, naflex)
    views = SiglipViews(NAFLEX if naflex else MODEL)
    check(Kind.VIEWS, views)
    assert views.card.licence == "Apache-2.0"
    assert views.card.prompts == AREA_PROMPTS
    assert isinstance(views, ScaledEncoder) and not isinstance(views, NamedViewEncoder)
    assert views.logit_scale == pytest.approx(SCALE, rel=1e-5) and views.logit_bias == pytest.approx(BIAS)
    assert views.encode([]).shape == (0, views.card.dim)


def test_pictures_are_squashed_and_seen_as_the_published_code_does(models: Path) -> None:
    from PIL import Image
    from transformers import SiglipModel

    write_siglip2(models)
    frame = example_frame(3, width=130, height=90)
    squashed = Image.fromarray(frame.rgb).resize((IMAGE, IMAGE), Image.Resampling.BILINEAR)
    pixels = torch.from_numpy((np.asarray(squashed, np.float32) / 255.0 - 0.5) / 0.5).permute(2, 0, 1)[None]
    network = SiglipModel.from_pretrained(models / MODEL).eval()
    ids = torch.zeros((1, PLACES), dtype=torch.long)
    with torch.no_grad():
        expected = network(input_ids=ids, pixel_values=pixels).image_embeds[0].numpy()
    np.testing.assert_allclose(SiglipViews(MODEL).encode([frame])[0], expected, atol=1e-5)


def test_naflex_keeps_the_shape_of_a_picture(models: Path) -> None:
    """Its own forward with patches made by hand gives the same."""
    from PIL import Image
    from transformers import Siglip2Model

    write_siglip2(models, NAFLEX, naflex=True)
    frame = example_frame(3, width=128, height=32)
    views, network = SiglipViews(NAFLEX), Siglip2Model.from_pretrained(models / NAFLEX).eval()
    # 16 patches of 16 pixels at most: 4:1 gives 8 x 2 of them, so that the picture stays as it is.
    assert Image.fromarray(frame.rgb).size == (8 * 16, 2 * 16)
    values = (frame.rgb.astype(np.float32) / 255.0 - 0.5) / 0.5
    patches = values.reshape(2, 16, 8, 16, 3).transpose(0, 2, 1, 3, 4).reshape(1, 16, -1)
    with torch.no_grad():
        expected = network.get_image_features(
            pixel_values=torch.from_numpy(patches.copy()),
            pixel_attention_mask=torch.ones((1, 16), dtype=torch.int32),
            spatial_shapes=torch.tensor([[2, 8]]),
        ).pooler_output[0]
    expected = torch.nn.functional.normalize(expected, dim=0).numpy()
    np.testing.assert_allclose(views.encode([frame])[0], expected, atol=1e-5)


def test_texts_are_small_letters_with_an_end_padded_to_64(models: Path) -> None:
    write_siglip2(models)
    tokens = SiglipTokens(models / MODEL, PLACES, "")
    rows = tokens.encode(["A Photo of a kit", "a photo of a kit", "a" * 200])
    assert rows.shape == (3, PLACES)
    assert np.array_equal(rows[0], rows[1])
    end = int(np.flatnonzero(rows[0] == 1)[0])
    assert (rows[0, :end] > 4).all() and (rows[0, end + 1 :] == 0).all()
    assert rows[2, -1] == 1 and (rows[2, :-1] > 4).all(), "a text that is too long is cut and still ends"


def test_texts_of_the_first_siglip_lose_their_punctuation_and_are_padded_with_their_end(tmp_path: Path) -> None:
    """Its tokenizer is of another kind (unigrams), ``</s>`` being both end and padding, and the file adds no end."""
    from tokenizers import Tokenizer, models, pre_tokenizers

    pieces = [("<pad>", 0.0), ("</s>", 0.0), ("<unk>", 0.0), ("▁a", -1.0), ("▁kit", -1.0), ("▁", -2.0), (".", -3.0)]
    tokenizer = Tokenizer(models.Unigram(pieces, unk_id=2))
    tokenizer.pre_tokenizer = pre_tokenizers.Metaspace()
    tokenizer.enable_truncation(3)
    tokenizer.save(str(tmp_path / "tokenizer.json"))
    config = {"eos_token": {"content": "</s>"}, "pad_token": "</s>", "do_lower_case": True}
    (tmp_path / "tokenizer_config.json").write_text(json.dumps(config), encoding="utf-8")
    rows = SiglipTokens(tmp_path, 6, "").encode(["A, Kit.", "a a a a a a a a"])
    assert rows.tolist() == [[3, 4, 1, 1, 1, 1], [3, 3, 3, 3, 3, 1]]
    config["pad_token"] = "<none>"
    (tmp_path / "tokenizer_config.json").write_text(json.dumps(config), encoding="utf-8")
    with pytest.raises(BackendError, match=r"has no token '<none>'; it is not the tokenizer of this model"):
        SiglipTokens(tmp_path, 6, "")


def test_words_are_the_mean_of_their_sentences_by_the_models_own_forward(models: Path) -> None:
    from transformers import AutoTokenizer, SiglipModel

    write_siglip2(models)
    network = SiglipModel.from_pretrained(models / MODEL).eval()
    tokenizer = AutoTokenizer.from_pretrained(models / MODEL)
    texts = [prompt.format("Kitchen").lower() for prompt in AREA_PROMPTS]
    read = tokenizer(texts, padding="max_length", max_length=PLACES, padding_side="right", return_tensors="pt")
    pixels = torch.zeros((1, 3, IMAGE, IMAGE))
    with torch.no_grad():
        rows = network(input_ids=read["input_ids"], pixel_values=pixels).text_embeds.mean(dim=0)
    expected = torch.nn.functional.normalize(rows, dim=0).numpy()
    np.testing.assert_allclose(SiglipViews(MODEL).encode_words(["Kitchen"])[0], expected, atol=1e-5)


def test_the_sigmoid_of_the_model_can_be_had_from_scale_and_bias(models: Path) -> None:
    """The published logit of a sentence and a picture is scale · cosine + bias."""
    from transformers import SiglipModel

    write_siglip2(models)
    views, network = SiglipViews(MODEL), SiglipModel.from_pretrained(models / MODEL).eval()
    ids, pixels = torch.full((1, PLACES), 7), torch.rand((1, 3, IMAGE, IMAGE))
    with torch.no_grad():
        told = network(input_ids=ids, pixel_values=pixels)
    cosine = float(told.image_embeds[0] @ told.text_embeds[0])
    assert float(told.logits_per_image[0, 0]) == pytest.approx(views.logit_scale * cosine + views.logit_bias, abs=1e-3)


def test_other_weights_prompts_or_tokens_have_another_checksum(models: Path) -> None:
    write_siglip2(models)
    first = SiglipViews(MODEL).card.checksum
    assert SiglipViews(str(models / MODEL)).card.checksum == first
    path = models / MODEL / "preprocessor_config.json"
    path.write_text(path.read_text(encoding="utf-8").replace("0.5", "0.4"), encoding="utf-8")
    assert SiglipViews(MODEL).card.checksum != first


@pytest.mark.parametrize("lacking", ["tokenizer.json", "tokenizer_config.json", "preprocessor_config.json"])
def test_a_missing_file_is_told_in_a_sentence(models: Path, lacking: str) -> None:
    write_siglip2(models)
    (models / MODEL / lacking).unlink()
    with pytest.raises(BackendError, match=r"get .* with: hf download google/siglip2-base-patch16-224"):
        SiglipViews(MODEL)


def test_a_checkpoint_of_another_model_is_refused(models: Path) -> None:
    write_clip(models)
    with pytest.raises(BackendError, match=r"holds a model of the type 'clip', expected is 'siglip' or 'siglip2'"):
        SiglipViews("openai/clip-vit-large-patch14")


def test_a_checkpoint_that_lacks_weights_is_refused(models: Path) -> None:
    from safetensors.torch import load_file, save_file

    write_siglip2(models)
    path = models / MODEL / "model.safetensors"
    weights = load_file(path)
    save_file({name: row for name, row in weights.items() if name != "logit_bias"}, path, metadata={"format": "pt"})
    with pytest.raises(BackendError, match=r"it lacks logit_bias"):
        SiglipViews(MODEL)
    shutil.rmtree(models / MODEL)
    with pytest.raises(BackendError, match=r"hf download google/siglip2-base-patch16-224$"):
        SiglipViews(MODEL)
