"""What is known of the models before one is loaded: backends, profiles, and where each model is published."""

from functools import partial
from typing import Any

from avlmaps.core.extras import MODELS
from avlmaps.core.registry import Backend, Kind
from avlmaps.perception.encoders import Encoders
from avlmaps.perception.models import Published


def _keypoints(repository: str, file: str, size_mb: float, *cached: str) -> Published:
    return Published((file, *cached), repository, get=f"hf download {repository} {file}", size_mb=size_mb)


_AUDIOCLIP = "https://github.com/AndreyGuzhov/AudioCLIP/releases/download/v0.1"
_NETVLAD = "https://cvg-data.inf.ethz.ch/hloc/netvlad"
_BYTE_PAIRS = "bpe_simple_vocab_16e6.txt.gz"
_WORDS = "openai/clip-vit-base-patch32"
_REGIONS = "facebook/sam2.1-hiera-tiny"
_LIGHTGLUE = "kornia/lightglue"

PUBLISHED: dict[str, Published] = {
    "avlmaps/light-1": Published(
        fetched="manifest.json", get="avlmaps profiles --fetch light --from URL|DIR", size_mb=250
    ),
    "google/tipsv2-b14": Published(size_mb=750),
    "google/siglip2-base-patch16-224": Published(size_mb=1500),
    "openai/clip-vit-base-patch16": Published(size_mb=600),
    "openai/clip-vit-large-patch14": Published(size_mb=1710),
    _WORDS: Published(size_mb=605),
    "laion/larger_clap_general": Published(size_mb=780),
    "facebook/pe-a-frame-base": Published(size_mb=2240),
    _REGIONS: Published(size_mb=156),
    "gberton/MegaLoc": Published(size_mb=915),
    "magic-leap-community/superpoint": Published(size_mb=5),
    "magic-leap-community/superglue_indoor": Published(size_mb=48),
    "disk-depth": _keypoints("kornia/disk", "depth-save.pth", 0),
    "aliked-n16": _keypoints("kornia/aliked", "aliked-n16.pth", 3),
    "disk": _keypoints(_LIGHTGLUE, "disk_lightglue.pth", 48, "disk_lightglue_v0-1_arxiv.pth"),
    "aliked": _keypoints(_LIGHTGLUE, "aliked_lightglue.pth", 48, "aliked_lightglue_v0-1_arxiv.pth"),
    "demo_e200.ckpt": Published(
        ("demo_e200.ckpt",), get="gdown 1ayk6NXURI_vIPlym16f_RG3ffxBWHxvb -O demo_e200.ckpt", size_mb=2000
    ),
    "AudioCLIP-Partial-Training.pt": Published(
        ("AudioCLIP-Partial-Training.pt",),
        get=f"curl -LO {_AUDIOCLIP}/AudioCLIP-Partial-Training.pt",
        size_mb=537,
    ),
    _BYTE_PAIRS: Published(
        (_BYTE_PAIRS, f"{_WORDS}/merges.txt", f"{_WORDS.replace('/', '--')}/merges.txt"),
        repository=_WORDS,
        package="open_clip",
        get=f"curl -LO {_AUDIOCLIP}/{_BYTE_PAIRS}",
        size_mb=1.4,
    ),
    "VGG16-NetVLAD-Pitts30K.mat": Published(
        ("VGG16-NetVLAD-Pitts30K.mat", "VGG16-NetVLAD-Pitts30K.safetensors"),
        get=f"curl -L -o VGG16-NetVLAD-Pitts30K.mat {_NETVLAD}/Pitts30K_struct.mat",
        size_mb=530,
    ),
}


def _with_torch(
    package: str, kind: Kind, name: str, target: str, model: str, licence: str, *needs: str, **more: Any
) -> Backend:
    """Return the entry of a backend that needs the extra called like its package."""
    place = f"avlmaps_models.{package}.{target}"
    needed = {"needs": ("torch", *needs), "extra": package, "distribution": MODELS.name}
    return Backend(kind, name, place, model=model, licence=licence, **needed, **more)


_foundation, _paper = partial(_with_torch, "foundation"), partial(_with_torch, "paper")


def _light(kind: Kind, target: str) -> Backend:
    """Return the entry of a backend that runs small copies of published models in onnxruntime."""
    place = f"avlmaps_models.light.{target}"
    frames = {"keyframes_only": kind is Kind.PIXELS, "distribution": MODELS.name}
    return Backend(kind, "light", place, model="avlmaps/light-1", licence="Apache-2.0", slow=True, **frames)


BACKENDS = (
    _light(Kind.PIXELS, "pixels:LightPixels"),
    _light(Kind.VIEWS, "views:LightViews"),
    _light(Kind.SOUNDS, "sounds:LightSounds"),
    Backend(
        Kind.SOUNDS,
        "efficientat",
        "avlmaps_models.light.efficientat:EfficientATSounds",
        model="efficientat/mn04_as.onnx",
        licence="MIT",
        distribution=MODELS.name,
    ),
    _foundation(Kind.PIXELS, "tipsv2", "tipsv2:TipsPixels", "google/tipsv2-b14", "Apache-2.0", "transformers"),
    _foundation(
        Kind.PIXELS, "clip-patches", "clip_patches:ClipPatches", "openai/clip-vit-base-patch16", "MIT", "transformers"
    ),
    _foundation(
        Kind.PIXELS,
        "regions",
        "regions:RegionPixels",
        "openai/clip-vit-base-patch16",
        "MIT (CLIP) and Apache-2.0 (SAM 2)",
        "transformers",
        also=(_REGIONS,),
    ),
    _foundation(
        Kind.VIEWS, "siglip2", "siglip2:SiglipViews", "google/siglip2-base-patch16-224", "Apache-2.0", "transformers"
    ),
    _foundation(Kind.VIEWS, "clip", "clip:ClipViews", "openai/clip-vit-large-patch14", "MIT", "transformers"),
    _foundation(Kind.SOUNDS, "clap", "clap:ClapSounds", "laion/larger_clap_general", "Apache-2.0", "transformers"),
    _foundation(
        Kind.SOUNDS, "pe-a-frame", "pe_a_frame:FrameSounds", "facebook/pe-a-frame-base", "Apache-2.0", "transformers"
    ),
    _foundation(
        Kind.LOCAL, "disk", "disk:DiskKeypoints", "disk-depth", "Apache-2.0", "kornia", matcher="lightglue-disk"
    ),
    _foundation(
        Kind.LOCAL,
        "aliked",
        "aliked:AlikedKeypoints",
        "aliked-n16",
        "BSD-3-Clause",
        "kornia",
        matcher="lightglue-aliked",
    ),
    _foundation(Kind.PLACE, "megaloc", "megaloc:MegaLoc", "gberton/MegaLoc", "MIT", "transformers"),
    _foundation(Kind.MATCHER, "lightglue-disk", "lightglue:LightGlue", "disk", "Apache-2.0", "kornia"),
    _foundation(Kind.MATCHER, "lightglue-aliked", "lightglue:LightGlue", "aliked", "Apache-2.0", "kornia"),
    _paper(Kind.PIXELS, "lseg", "lseg:LSegPixels", "demo_e200.ckpt", "MIT", "transformers", also=(_BYTE_PAIRS,)),
    _paper(
        Kind.VIEWS, "clip-paper", "clip_views:PaperClipViews", "openai/clip-vit-large-patch14", "MIT", "transformers"
    ),
    _paper(
        Kind.SOUNDS,
        "audioclip",
        "audioclip:AudioClipSounds",
        "AudioCLIP-Partial-Training.pt",
        "MIT",
        "tokenizers",
        also=(_BYTE_PAIRS,),
    ),
    _paper(
        Kind.LOCAL,
        "superpoint",
        "superpoint:SuperPointKeypoints",
        "magic-leap-community/superpoint",
        "Magic Leap, non-commercial",
        "transformers",
        matcher="superglue",
    ),
    _paper(Kind.PLACE, "netvlad", "netvlad:NetVlad", "VGG16-NetVLAD-Pitts30K.mat", "research only"),
    _paper(
        Kind.MATCHER,
        "superglue",
        "superglue:SuperGlue",
        "magic-leap-community/superglue_indoor",
        "Magic Leap, non-commercial",
        "transformers",
    ),
)

LIGHT = Encoders(
    "light",
    pixels="light",
    views="light",
    sounds="light",
    local="xfeat",
    place="xfeat",
    matcher="xfeat",
    about="any word for things, rooms and sounds on a CPU without torch; files of 250 MB, fetched once",
    weight_variance_m2=50.0,
)
FOUNDATION = Encoders(
    "foundation",
    pixels="tipsv2",
    views="siglip2",
    sounds="clap",
    local="disk",
    place="megaloc",
    matcher="lightglue-disk",
    about="today's open models under permissive licences; recommended where there is a network and better a GPU",
    weight_variance_m2=50.0,
)
PAPER = Encoders(
    "paper",
    pixels="lseg",
    views="clip-paper",
    sounds="audioclip",
    local="superpoint",
    place="netvlad",
    matcher="superglue",
    about="the models of the AVLMaps paper, to compare with; some of their weights are for research alone",
)
