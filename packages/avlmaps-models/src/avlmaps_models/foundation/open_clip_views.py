"""Areas by any model of open_clip: the Perception Encoder, MobileCLIP 2, and the many CLIPs trained on open data.

- Perception Encoder, core (Bolya et al., 2025; Apache-2.0): ``timm/PE-Core-T-16-384`` and ``-S-16-384`` (512 numbers a
  feature), ``-B-16`` and ``-L-14-336`` (1024), ``-bigG-14-448`` (1280); pictures squashed to the square, mean and
  deviation 0.5, texts of 32 tokens.
- MobileCLIP 2 (Faghri et al., 2025), ``timm/MobileCLIP2-{S0,S2,B,S3,S4,L-14}-OpenCLIP``: small and quick, but the
  weights are under Apple's own licence for research models (apple-amlr): research only. Apple's own folders
  (``apple/MobileCLIP2-S0``, a single ``.pt``) are read as well.
- ``laion/CLIP-ViT-*``, ``timm/ViT-*-SigLIP2-*`` and any other model that has ``open_clip_config.json`` beside
  ``open_clip_model.safetensors``.

Sizes, preparation of pictures and tokens are open_clip's, from that file; weights are loaded strictly.
"""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8

from avlmaps.core.errors import BackendError
from avlmaps.perception.models.checksums import weights_in
from avlmaps_models.common.device import select_device
from avlmaps_models.common.files import model_folder
from avlmaps_models.foundation.open_views import OpenViews, views_card

_CONFIG = "open_clip_config.json"
_WANTED = (_CONFIG, "*.json", "*.txt", "*.model", "open_clip_model.safetensors", "*.pt")
# As open_clip itself chooses among several.
_PREFERRED = (
    "open_clip_model.safetensors",
    "open_clip_pytorch_model.safetensors",
    "open_clip_pytorch_model.bin",
    "open_clip_pytorch_model.pth",
)


class OpenClipViews(OpenViews):
    """Encodes views with a model of open_clip.

    Args:
        model: the hub's id, or a folder.

    Raises:
        BackendError: it is not here, damaged, or another model.
    """

    def __init__(self, model: str = "timm/PE-Core-B-16") -> None:
        device = select_device()
        folder = model_folder(model, _WANTED)
        if not weights_in(folder):  # older repositories have no safetensors
            folder = model_folder(model, (*_WANTED, "open_clip_pytorch_model.bin"))
        network, self._prepare, self._tokens, weights = _loaded(folder, model)
        self._network: Any = network.to(device).eval().requires_grad_(False)
        with torch.inference_mode():
            dim = int(network.encode_text(self._tokens(["a room"]).to(device)).shape[-1])
        super().__init__(views_card(model, dim, [weights], folder), float(network.logit_scale.exp()))

    def _see(self, pictures: list[UInt8[np.ndarray, "h w 3"]]) -> torch.Tensor:
        from PIL import Image

        pixels = torch.stack([self._prepare(Image.fromarray(picture)) for picture in pictures])
        return self._network.encode_image(pixels.to(self._device))

    def _read(self, texts: list[str]) -> torch.Tensor:
        return self._network.encode_text(self._tokens(texts).to(self._device))


def _loaded(folder: Path, model: str) -> tuple[Any, Any, Any, Path]:
    """Return a model on the CPU, what prepares its pictures, what makes its tokens, and its file of weights.

    Raises:
        BackendError: the folder does not hold one, or a damaged one.
    """
    import open_clip

    get = f"hf download {model}"
    path = _weights(folder, get)
    settings: dict[str, Any] = {}
    if (folder / _CONFIG).is_file():
        name = f"local-dir:{folder}"
    else:
        name, settings = _architecture(folder, model), {"pretrained": str(path)}
        settings |= _preparation(name)
    try:
        made: Any = open_clip.create_model_from_pretrained(
            name, device="cpu", precision="fp32", weights_only=True, **settings
        )
        return *made, open_clip.get_tokenizer(name), path
    except Exception as fault:  # open_clip, timm, torch and safetensors raise a dozen kinds for a damaged folder
        said = " ".join(str(fault).split())
        raise BackendError(
            f"{path} cannot be loaded by open_clip as {name.removeprefix('local-dir:')} ({type(fault).__name__}: "
            f"{said[:200]}); get the whole folder again with: {get}"
        ) from fault


def _weights(folder: Path, get: str) -> Path:
    for name in _PREFERRED:
        if (folder / name).is_file():
            return folder / name
    if found := weights_in(folder):
        return found[0]
    raise BackendError(f"{folder} has no file of weights (open_clip_model.safetensors); get it again with: {get}")


def _architecture(folder: Path, model: str) -> str:
    """Return open_clip's name of the model in a folder that does not say itself what it is."""
    import open_clip

    known = {name.lower(): name for name in open_clip.list_models()}
    for called in (Path(model).name, folder.name):
        if called.lower() in known:
            return known[called.lower()]
    raise BackendError(
        f"{folder} has no {_CONFIG} and is not called like a model that open_clip knows (MobileCLIP2-S0, ViT-B-16); "
        "get a folder that has one, such as: hf download timm/PE-Core-B-16"
    )


def _preparation(name: str) -> dict[str, Any]:
    """Return how pictures were prepared for the published weights of a model that open_clip knows."""
    import open_clip

    for tag in open_clip.list_pretrained_tags_by_model(name):
        published = open_clip.get_pretrained_cfg(name, tag)
        words = {"mean": "image_mean", "std": "image_std", "interpolation": "image_interpolation"}
        words["resize_mode"] = "image_resize_mode"
        return {ours: published[theirs] for theirs, ours in words.items() if theirs in published}
    return {}
