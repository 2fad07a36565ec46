"""CLIP's text tower and tokens, shared by the paper's models, against transformers and against slow ways."""

import gzip
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from avlmaps.core.errors import BackendError
from avlmaps_models.paper import clip_tokens as module
from avlmaps_models.paper.clip_text import ClipTextSizes, ClipTextTower, padded
from avlmaps_models.paper.clip_tokens import BYTE_PAIRS, ClipTokens, clip_tokens

MERGES = ("d o", "do g</w>", "b a", "r k</w>", "ba rk</w>", "a n", "an d</w>", "Ã ©</w>")


def tower(sizes: ClipTextSizes, seed: int = 0) -> ClipTextTower:
    generator = torch.Generator().manual_seed(seed)
    made = ClipTextTower(sizes)
    with torch.no_grad():
        for values in made.parameters():
            values.copy_(0.3 * torch.randn(values.shape, generator=generator))
    return made.eval()


def of_transformers(made: ClipTextTower) -> torch.nn.Module:
    """Return transformers' text tower with the same weights."""
    from transformers import CLIPTextConfig, CLIPTextModelWithProjection

    sizes = made.sizes
    config = CLIPTextConfig(
        vocab_size=sizes.tokens, hidden_size=sizes.width, intermediate_size=4 * sizes.width, projection_dim=sizes.dim,
        num_hidden_layers=sizes.layers, num_attention_heads=sizes.heads, max_position_embeddings=sizes.context,
        hidden_act="quick_gelu", eos_token_id=sizes.tokens - 1, bos_token_id=sizes.tokens - 2, layer_norm_eps=1e-5,
    )  # fmt: skip
    state = {
        "text_model.embeddings.token_embedding.weight": made.token_embedding.weight,
        "text_model.embeddings.position_embedding.weight": made.positional_embedding,
        "text_model.final_layer_norm.weight": made.ln_final.weight,
        "text_model.final_layer_norm.bias": made.ln_final.bias,
        "text_projection.weight": made.text_projection.T.contiguous(),
    }
    names = {"mlp.c_fc": "mlp.fc1", "mlp.c_proj": "mlp.fc2", "ln_1": "layer_norm1", "ln_2": "layer_norm2"}
    own = made.state_dict()
    for i in range(sizes.layers):
        ours, theirs = f"transformer.resblocks.{i}", f"text_model.encoder.layers.{i}"
        for end in ("weight", "bias"):
            for part, values in zip("qkv", own[f"{ours}.attn.in_proj_{end}"].chunk(3), strict=True):
                state[f"{theirs}.self_attn.{part}_proj.{end}"] = values
            state[f"{theirs}.self_attn.out_proj.{end}"] = own[f"{ours}.attn.out_proj.{end}"]
            for here, there in names.items():
                state[f"{theirs}.{there}.{end}"] = own[f"{ours}.{here}.{end}"]
    found = CLIPTextModelWithProjection(config).eval()
    found.load_state_dict(state, strict=True)
    return found


@pytest.mark.parametrize("width", [48, 128])
def test_the_tower_is_transformers_own(width):
    made = tower(ClipTextSizes(tokens=90, context=12, width=width, layers=3, dim=20))
    texts = [[88, 3, 5, 7, 89], [88, 89], [88, *range(10), 89]]
    with torch.no_grad():
        found = made(padded(texts)).numpy()
        for row, text in zip(found, texts, strict=True):
            wanted = of_transformers(made)(input_ids=torch.tensor([text])).text_embeds[0].numpy()
            assert np.abs(row - wanted).max() < 1e-4 * np.abs(wanted).max()


def test_what_follows_the_end_does_not_matter():
    made = tower(ClipTextSizes(tokens=90, context=12, width=32, layers=2, dim=8))
    text = torch.tensor([[88, 4, 89, 0, 0, 0]])
    other = torch.tensor([[88, 4, 89, 7, 3, 1]])
    with torch.no_grad():
        assert torch.allclose(made(text), made(other), atol=1e-6)
        assert torch.allclose(made(text), made(text[:, :3]), atol=1e-6)


def test_sizes_are_read_off_a_checkpoint_whatever_lies_around_it():
    sizes = ClipTextSizes(tokens=90, context=12, width=128, layers=2, dim=8)
    state = {f"net.clip.{key}": value for key, value in ClipTextTower(sizes).state_dict().items()}
    assert ClipTextSizes.of({**state, "net.other": torch.zeros(3)}, "net.clip.") == sizes
    assert sizes.heads == 2


def merged_by_hand(word: str, merges: list[tuple[str, str]]) -> list[str]:
    """Return a word's pieces: again and again the pair that comes first in the list is merged wherever it stands."""
    pieces = [*word[:-1], word[-1] + "</w>"]
    while True:
        ranks = [merges.index(pair) for pair in pairwise(pieces) if pair in merges]
        if not ranks:
            return pieces
        first, second = merges[min(ranks)]
        found, i = [], 0
        while i < len(pieces):
            both = tuple(pieces[i : i + 2]) == (first, second)
            found.append(first + second if both else pieces[i])
            i += 2 if both else 1
        pieces = found


@given(words=st.lists(st.text("dogbarkn", min_size=1, max_size=9), min_size=1, max_size=4))
def test_words_fall_into_the_pieces_that_the_list_merges(words):
    tokens = ClipTokens(MERGES)
    merges = [tuple(line.split()) for line in MERGES]
    letters = [*map(chr, range(33, 127)), *map(chr, range(161, 173)), *map(chr, range(174, 256))]
    letters += [chr(256 + i) for i in range(68)]
    names = [*letters, *(letter + "</w>" for letter in letters), *("".join(pair) for pair in merges)]
    wanted = [names.index(piece) for word in words for piece in merged_by_hand(word, merges)]
    assert tokens.encode([" ".join(words)]) == [[tokens.start, *wanted, tokens.end]]
    assert len(tokens) == len(names) + 2 == 512 + len(MERGES) + 2


def test_case_white_space_and_entities_do_not_matter():
    tokens = ClipTokens(MERGES)
    plain, *others = tokens.encode(["dog &", "  DOG\t\n &", "Dog &amp;", "dog &amp;amp; "])
    assert all(other == plain for other in others)


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("the kettle\u2019s \u201cwhistle\u201d", 'the kettle\'s "whistle"'),
        ("&rsquo;s &amp;amp;", "'s &"),
        ("\ufb01re, o\ufb03ce, \u0149", "fire, office, 'n"),
        ("\uff44\uff4f\uff47\u3000\uff11", "dog 1"),
        ("cafe\u0301", "caf\u00e9"),
        ("\ufeffdog\x00s\x1f", "dogs"),
        ("a\u00a0b\u2028c\u3000d", "a b c d"),
        ("\u03a3\u0391\u03a3", "\u03c3\u03b1\u03c2"),  # a sigma at a word's end
        ("\ud83d\ude00", "\U0001f600"),
        ("a\udcff", "a\ufffd"),  # a byte of the command line that is not a text
    ],
)
def test_letters_in_another_form_are_those_that_are_meant(typed, meant):
    """As ftfy makes them in the published code; a phone types curly quotes where training saw straight ones."""
    tokens = ClipTokens(MERGES)
    found, wanted = tokens.encode([typed, meant])
    assert found == wanted


INTERESTING = (
    "dog bark's\"\u2018\u2019\u201a\u201c\u201d\u201f\u02bc\ufb00\ufb02\uff01\uff21\uff76\u3000\x07\ufeff\u2014\u2026"
)


@given(text=st.text(INTERESTING, max_size=12))
def test_phrases_are_prepared_as_the_published_library_does_it(text):
    ftfy = pytest.importorskip("ftfy")
    tokens = ClipTokens(MERGES)
    found, wanted = tokens.encode([text, ftfy.fix_text(text)])
    assert found == wanted
    assert module._plain(text) == " ".join(ftfy.fix_text(text).split()).lower()


def test_marks_and_digits_are_apart_and_letters_beyond_ascii_are_bytes():
    tokens = ClipTokens(MERGES)
    digits, marks, accent = tokens.encode(["12", "dog!!", "é"])
    assert len(digits) == 4
    assert len(marks) == 5  # dog, ! and !</w>
    assert len(accent) == 3  # two bytes, which the list merges


def test_a_long_text_is_cut_off_before_its_end():
    tokens = ClipTokens(MERGES)
    (found,) = tokens.encode(["dog " * 200])
    assert len(found) == 77
    assert (found[0], found[-1]) == (tokens.start, tokens.end)


def test_the_real_list_gives_the_published_numbers(models):
    tokens = clip_tokens()
    assert len(tokens) == 49408
    assert tokens.encode(["a photo of a dog", ""]) == [[49406, 320, 1125, 539, 320, 1929, 49407], [49406, 49407]]


def test_the_list_of_the_folder_of_models_goes_first(models):
    lines = [f"{a} {b}" for a, b in zip("abcdefgh" * 6112, "ijklmnop" * 6112, strict=True)][: module.MERGES]
    with gzip.open(models / BYTE_PAIRS, "wb") as file:
        file.write("\n".join(["#version", *lines, "more left over"]).encode())
    assert module._merges_file() == models / BYTE_PAIRS


def test_merges_of_a_clip_on_the_hub_do_as_well(models, monkeypatch):
    published = module._merges_file()
    folder = models / "openai/clip-vit-base-patch32"
    folder.mkdir(parents=True)
    lines = gzip.decompress(published.read_bytes()).decode().split("\n")
    (folder / "merges.txt").write_text("\n".join(["#version: 0.2", *lines[1 : 1 + module.MERGES], ""]))
    phrases = ["dog barking", "Glass breaking!", "a kettle's whistle, 3 times"]
    wanted = clip_tokens().encode(phrases)
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    assert module._merges_file() == folder / "merges.txt"
    assert clip_tokens().encode(phrases) == wanted


@pytest.mark.parametrize("content", [b"no zip", gzip.compress(b"#version\na b\n")], ids=["no zip", "too short"])
def test_another_list_is_refused(models, content):
    (models / BYTE_PAIRS).write_bytes(content)
    with pytest.raises(BackendError, match="curl -LO"):
        clip_tokens()


@pytest.mark.parametrize("clip_without_merges", [False, True])
def test_no_list_at_all_says_how_to_get_one(models, monkeypatch, clip_without_merges):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    if clip_without_merges:
        (models / "openai/clip-vit-base-patch32").mkdir(parents=True)
    monkeypatch.chdir(Path(models).parent)
    with pytest.raises(BackendError, match=f"{BYTE_PAIRS} is not here .* curl -LO"):
        clip_tokens()
