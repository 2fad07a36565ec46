"""The files of the profile ``light``, exported from random checkpoints in the published layouts, against torch."""

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

if find_spec("onnx") is None:
    pytest.skip("the export needs onnx (requirements/foundation.txt)", allow_module_level=True)

import torch
from hypothesis import given
from hypothesis import strategies as st
from tiny.light import SHORT_SIDE, export_light, write_light_sources
from tiny.tipsv2 import write_tips_tokens
from training.light.export import phrases_of, revision_of
from training.light.parity import parity, rank_correlation
from training.light.quantise import Bits, in_blocks, quantise
from training.light.tokenizers import UnknownTokenizerError, list_of, write_tokens

from avlmaps.core.lexicon import EntryKind, lexicon
from avlmaps.core.registry import Kind, forget_loaded, load
from avlmaps.perception.conformance import check, example_frame, example_sound
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps.query.rooms import AREA_NAMES
from avlmaps_models.common.prompts import AREA_PROMPTS, THINGS, TIPS_PROMPTS, clean
from avlmaps_models.common.sound_scores import OTHERS
from avlmaps_models.foundation.clap import ClapSounds
from avlmaps_models.foundation.tipsv2 import TipsPixels
from avlmaps_models.light import bundle as files
from avlmaps_models.light.pixels import LightPixels
from avlmaps_models.light.sounds import LightSounds, log_mel
from avlmaps_models.light.tower import interpolation
from avlmaps_models.light.views import LightViews

CLAP = "laion/clap-htsat-unfused"
KEPT = 0.95  # of float's ranking, see training/light/parity.py


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of models with the sources and the files made from them."""
    folder = tmp_path_factory.mktemp("light")
    torch.manual_seed(0)
    torch.set_num_threads(1)
    write_light_sources(folder)
    assert export_light(folder, folder) == 0
    return folder


@pytest.fixture
def light(made: Path):
    with using_models(ModelSettings(folder=made, device="cpu", precision="float32", offline=True)):
        yield made / files.MODEL
    forget_loaded()


def unit(rows: np.ndarray) -> np.ndarray:
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


@pytest.mark.parametrize("kind", [Kind.PIXELS, Kind.VIEWS, Kind.SOUNDS])
def test_each_backend_conforms(light: Path, kind: Kind) -> None:
    check(kind, load(kind, "light"))


def test_bytes_keep_the_ranking_of_floats_patches(light: Path) -> None:
    exact, small = TipsPixels(short_side=SHORT_SIDE), LightPixels()
    words = list(small._words._store.rows)[:30]
    of_words = exact.encode_words(words)
    frames = [example_frame(seed, 200, 150) for seed in range(4)]
    both = [np.concatenate([e.encode(f).reshape(-1, e.card.dim) for f in frames]) for e in (exact, small)]
    found = parity(*both, of_words, small.encode_words(words))
    assert found.kept > KEPT and found.cosine > 0.99
    assert not small.text.loaded


def test_bytes_keep_the_ranking_of_floats_sounds(light: Path) -> None:
    exact, small = ClapSounds(CLAP), LightSounds()
    words = list(small._words._store.rows)[:30]
    rng = np.random.default_rng(0)
    sounds = [example_sound(seed, float(rng.uniform(0.3, 9.0)), 48_000) for seed in range(10)]
    both = [np.concatenate([e.encode(sound) for sound in sounds]) for e in (exact, small)]
    found = parity(*both, exact.encode_words(words), small.encode_words(words))
    assert found.kept > KEPT and found.cosine > 0.99


def test_the_vectors_that_come_with_the_files_are_the_text_towers(light: Path) -> None:
    pixels, views, sounds = LightPixels(), LightViews(), LightSounds()
    exact = TipsPixels(short_side=SHORT_SIDE)
    for encoder, reference in ((pixels, exact), (sounds, ClapSounds(CLAP))):
        words = list(encoder._words._store.rows)
        assert len(words) == 40
        both = encoder.encode_words(words) * reference.encode_words(words)
        assert (both.sum(axis=1) > 0.9999).all()
        assert not encoder.text.loaded
    assert pixels.card.prompts == TIPS_PROMPTS
    assert views.card.prompts == AREA_PROMPTS


def test_new_words_are_near_what_float_makes_of_them(light: Path) -> None:
    words = ["a word that nobody shipped", "zebra"]
    found, exact = LightPixels().encode_words(words), TipsPixels(short_side=SHORT_SIDE).encode_words(words)
    assert ((found * exact).sum(axis=1) > 0.95).all()


def test_the_view_is_the_published_class_token(light: Path, made: Path) -> None:
    from transformers import AutoModel

    frame = example_frame(3, SHORT_SIDE, SHORT_SIDE)
    pixels = torch.from_numpy(frame.rgb).permute(2, 0, 1)[None].float() / 255.0
    model = AutoModel.from_pretrained(made / "google/tipsv2-b14").eval()
    with torch.no_grad():
        expected = unit(model.get_image_features(pixels).pooler_output.numpy())
    assert float(LightViews().encode([frame])[0] @ expected[0]) > 0.99


@pytest.mark.parametrize("cells", [(5, 3), (5, 9), (32, 24), (4, 4)])
def test_positions_are_interpolated_as_torch_does(cells: tuple[int, int]) -> None:
    given_cells, wanted = cells
    table = torch.randn(1, 3, given_cells, given_cells)
    expected = torch.nn.functional.interpolate(
        table, size=(wanted, given_cells + 1), mode="bilinear", align_corners=False, antialias=True
    )
    rows, columns = interpolation(given_cells, wanted), interpolation(given_cells, given_cells + 1)
    np.testing.assert_allclose(rows @ table[0].numpy() @ columns.T, expected[0].numpy(), atol=1e-5)


@pytest.mark.parametrize("seconds", [0.05, 3.3, 10.0])
def test_the_spectrogram_is_the_published_one(light: Path, made: Path, seconds: float) -> None:
    from transformers import ClapFeatureExtractor

    heard = ClapFeatureExtractor.from_pretrained(made / CLAP)
    samples = (0.1 * np.random.default_rng(0).standard_normal(round(seconds * 48_000))).astype(np.float32)
    expected = heard(samples, sampling_rate=48_000, truncation="rand_trunc", return_tensors="np")["input_features"]
    note = files.open_bundle().manifest.sounds.mel
    np.testing.assert_allclose(log_mel(samples, note), expected[0, 0], atol=2e-3)


TEXTS = st.text(st.sampled_from("abcXYZ .,'-_1²½é漢\n\tﬁ🙂"), max_size=30) | st.text(max_size=20)


@given(TEXTS)
def test_sentencepiece_is_read_as_published(tips_tokenizer, text: str) -> None:
    tokenizer, ours = tips_tokenizer
    assert ours.encode(text) == tokenizer(text, truncation=True, max_length=64)["input_ids"]


@given(TEXTS)
def test_bytes_are_read_as_published(roberta_tokenizer, text: str) -> None:
    tokenizer, ours = roberta_tokenizer
    if any(name in text for name in tokenizer.all_special_tokens):
        return
    assert ours.encode(text) == tokenizer(text, truncation=True, max_length=20)["input_ids"]


@pytest.fixture(scope="module")
def tips_tokenizer(tmp_path_factory: pytest.TempPathFactory):
    from transformers import Tipsv2Tokenizer

    folder = tmp_path_factory.mktemp("tips")
    write_tips_tokens(folder)
    tokenizer = Tipsv2Tokenizer.from_pretrained(folder)
    return tokenizer, write_tokens(tokenizer, folder / "tokens.json", 64, ["a chair"])


@pytest.fixture(scope="module")
def roberta_tokenizer(tmp_path_factory: pytest.TempPathFactory):
    """With merges, which the tests' other RoBERTa has none of."""
    from tokenizers.pre_tokenizers import ByteLevel
    from transformers import RobertaTokenizer

    letters = sorted(ByteLevel.alphabet())
    merges = [("Ġ", "a"), ("a", "b"), ("b", "c"), ("ab", "c"), ("Ġ", "."), ("Ã", "©"), ("c", "c")]
    names = ["<s>", "<pad>", "</s>", "<unk>", *letters, *("".join(pair) for pair in merges), "<mask>"]
    tokenizer = RobertaTokenizer(vocab={name: i for i, name in enumerate(names)}, merges=merges, model_max_length=512)
    return tokenizer, write_tokens(tokenizer, tmp_path_factory.mktemp("r") / "t.json", 20, ["abc cab."])


def test_a_tokenizer_of_another_kind_is_refused() -> None:
    with pytest.raises(UnknownTokenizerError, match="WordPiece"):
        list_of({"model": {"type": "WordPiece"}})


def test_every_word_that_a_query_compares_with_comes_with_the_files() -> None:
    wanted = {EntryKind.THING: (*THINGS, "other"), EntryKind.ROOM: AREA_NAMES, EntryKind.SOUND: OTHERS}
    for kind, words in wanted.items():
        phrases = phrases_of(kind)
        assert set(map(clean, words)) <= set(phrases)
        assert {clean(entry.name) for entry in lexicon().entries(kind)} <= set(phrases)
        assert len(set(phrases)) == len(phrases)


def test_the_revision_is_that_of_the_hubs_cache() -> None:
    assert revision_of(Path("/cache/models--a--b/snapshots/0123abc")) == "0123abc"
    assert revision_of(Path("/models/a/b")) == ""


def test_without_the_checkpoints_the_export_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    assert export_light(tmp_path, tmp_path) == 1
    said = capsys.readouterr().err
    assert "refused: The model google/tipsv2-b14 is not here" in said and "hf download google/tipsv2-b14" in said


def test_a_fused_clap_is_refused(tmp_path: Path) -> None:
    from tiny.clap import write_clap
    from training.light.export import export_sounds

    write_clap(tmp_path, "laion/clap-htsat-fused", fused=True)
    with (
        using_models(ModelSettings(folder=tmp_path, device="cpu", offline=True)),
        pytest.raises(ValueError, match="CLAP with fusion"),
    ):
        export_sounds("laion/clap-htsat-fused", tmp_path, 4, [])


def test_what_is_too_large_or_too_coarse_is_no_model(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export_light(made, tmp_path, "--most-mb", "0.1", "--least-kept", "1.0") == 1
    said = capsys.readouterr().err
    assert "refused: patches, sounds: less than 1.0 of float's ranking" in said
    assert "refused: more than 0.1 MB" in said
    assert not (tmp_path / files.MODEL / files.MANIFEST).exists()


def small_and_exact(network: torch.nn.Module, given: torch.Tensor, tmp_path: Path, bits: Bits) -> list[np.ndarray]:
    """Return what a network makes of an input with small weights, and with float ones."""
    import onnxruntime

    whole, small = tmp_path / "whole.onnx", tmp_path / "small.onnx"
    with torch.no_grad():
        torch.onnx.export(
            network, (given[:1],), str(whole), input_names=["x"], dynamic_axes={"x": {0: "n"}}, opset_version=17,
            dynamo=False,
        )  # fmt: skip
        quantise(whole, small, bits)
        exact = network(given).numpy()
    session = onnxruntime.InferenceSession(str(small), providers=["CPUExecutionProvider"])
    return [session.run(None, {"x": given.numpy()})[0], exact]


def test_a_token_of_huge_values_costs_the_others_nothing(tmp_path: Path) -> None:
    tokens = torch.randn(1, 20, 64)
    tokens[0, 7] *= 3000.0
    tokens[0, 9] = 0.0
    small, exact = small_and_exact(torch.nn.Linear(64, 96), tokens, tmp_path, 8)
    lost = np.linalg.norm(small - exact, axis=-1) / np.linalg.norm(exact, axis=-1)
    assert lost.max() < 0.03 and lost[0, 9] < 1e-6


def test_a_channel_of_huge_weights_costs_the_others_nothing(tmp_path: Path) -> None:
    layer = torch.nn.Linear(64, 96)
    with torch.no_grad():
        layer.weight[5] *= 3000.0
    small, exact = small_and_exact(layer, torch.randn(2, 20, 64), tmp_path, 8)
    lost = np.abs(small - exact).max(axis=(0, 1)) / np.abs(exact).max(axis=(0, 1))
    assert lost.max() < 0.05


@pytest.mark.parametrize(("bits", "most"), [(8, 0.01), (4, 0.12)])
def test_a_table_is_small_and_near(tmp_path: Path, bits: Bits, most: float) -> None:
    table = torch.nn.Embedding(200, 64)
    with torch.no_grad():
        table.weight[3] *= 100.0
    small, exact = small_and_exact(table, torch.tensor([[3, 0, 199, 7]]), tmp_path, bits)
    assert small.shape == exact.shape
    assert (np.linalg.norm(small - exact, axis=-1) / np.linalg.norm(exact, axis=-1)).max() < most
    sizes = [path.stat().st_size for path in (tmp_path / "small.onnx", tmp_path / "whole.onnx")]
    assert sizes[0] < 0.5 * sizes[1]


@pytest.mark.parametrize("block", [16, 32, 128])
def test_four_bits_lose_less_than_a_tenth(block: int) -> None:
    rows = np.random.default_rng(0).standard_normal((7, 200)).astype(np.float32)
    rows[3] = 0.0
    steps, scale = in_blocks(rows, block)
    assert steps.min() >= -8 and steps.max() <= 7
    restored = (steps * scale[..., None]).reshape(len(rows), -1)
    assert not restored[:, rows.shape[1] :].any(), "what fills the last block stays nothing"
    restored = restored[:, : rows.shape[1]]
    assert not restored[3].any()
    lost = np.linalg.norm(restored - rows) / np.linalg.norm(rows)
    assert lost < 0.125


def test_rank_correlation_is_scipys() -> None:
    from scipy.stats import spearmanr

    rng = np.random.default_rng(0)
    one, other = rng.integers(0, 9, (2, 5, 30)).astype(float)
    expected = [spearmanr(a, b).statistic for a, b in zip(one, other, strict=True)]
    np.testing.assert_allclose(rank_correlation(one, other), expected, atol=1e-9)


def test_parity_finds_a_loss() -> None:
    rng = np.random.default_rng(0)
    items, words = (unit(rng.standard_normal((count, 16))) for count in (60, 30))
    assert parity(items, items, words).kept == pytest.approx(1.0)
    assert parity(items, unit(items + 0.3 * rng.standard_normal(items.shape)), words).kept < 0.9
    assert parity(items, items[::-1], words).kept < 0.5
