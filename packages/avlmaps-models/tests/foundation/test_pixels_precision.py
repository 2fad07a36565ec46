"""Half precision changes the pixel encoders' features by rounding alone."""

from pathlib import Path

import numpy as np
import pytest
from tiny.clip_patches import IMAGE
from tiny.regions import write_regions
from tiny.tipsv2 import write_tipsv2

from avlmaps.perception.conformance import example_frame
from avlmaps.perception.models import ModelSettings, using_models
from avlmaps_models.foundation.clip_patches import ClipPatches
from avlmaps_models.foundation.regions import RegionPixels
from avlmaps_models.foundation.tipsv2 import TipsPixels

CLIP, TIPS = "openai/clip-vit-base-patch16", "google/tipsv2-b14"
MAKE = {
    "tipsv2": lambda: TipsPixels(short_side=56),
    "tipsv2#last": lambda: TipsPixels(f"{TIPS}#last", short_side=56),
    "clip#value": lambda: ClipPatches(short_side=IMAGE),
    "clip#maskclip": lambda: ClipPatches(f"{CLIP}#maskclip", short_side=IMAGE),
    "clip#neighbours": lambda: ClipPatches(f"{CLIP}#neighbours", short_side=IMAGE),
    "regions": lambda: RegionPixels(short_side=8),
}


@pytest.mark.parametrize("precision", ["bfloat16", "float16"])
@pytest.mark.parametrize("name", MAKE)
def test_half_precision_is_rounding(models: Path, name: str, precision: str) -> None:
    write_regions(models)
    write_tipsv2(models)
    frame, found = example_frame(), []
    for each in ("float32", precision):
        with using_models(ModelSettings(folder=models, device="cpu", precision=each, offline=True)):  # pyright: ignore
            encoder = MAKE[name]()
            found.append((encoder.encode(frame), encoder.encode_words(["chair"])))
    (whole, words), (half, half_words) = found
    assert half.dtype == half_words.dtype == np.float32
    seen = whole.any(axis=-1)
    np.testing.assert_array_equal(seen, half.any(axis=-1))
    assert (whole * half).sum(axis=-1)[seen].min() > 0.999
    assert (words * half_words).sum() > 0.999
