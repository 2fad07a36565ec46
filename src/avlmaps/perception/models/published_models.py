"""Where the models of the profiles are published and how large they are: for people, not for loading."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Published:
    """How a model is got.

    Attributes:
        files: names that its single file goes by, below a folder of models; none for a hub's folder under its id.
        repository: the hub's id of the repository that holds such a file.
        package: an installed package in whose folder such a file may lie.
        get: the command that brings it; ``hf download ID`` where it is ``""``.
        fetched: the file that a folder of its name holds once avlmaps has fetched it; ``""`` for all others.
        size_mb: about how much that is; 0 where it is not known.
    """

    files: tuple[str, ...] = ()
    repository: str = ""
    package: str = ""
    get: str = ""
    fetched: str = ""
    size_mb: float = 0.0


def _keypoints(repository: str, file: str, size_mb: float, *cached: str) -> Published:
    return Published((file, *cached), repository, get=f"hf download {repository} {file}", size_mb=size_mb)


_AUDIOCLIP = "https://github.com/AndreyGuzhov/AudioCLIP/releases/download/v0.1"
_EIGENPLACES = "https://github.com/gmberton/EigenPlaces/releases/download/v1.0"
_WAV2CLIP = "https://github.com/descriptinc/lyrebird-wav2clip/releases/download/v0.1.0-alpha"
_NETVLAD = "https://cvg-data.inf.ethz.ch/hloc/netvlad"
_BYTE_PAIRS = "bpe_simple_vocab_16e6.txt.gz"
_WORDS = "openai/clip-vit-base-patch32"
_REGIONS = "facebook/sam2.1-hiera-tiny"
_LIGHTGLUE = "kornia/lightglue"

# By the name that a profile or the registry gives them. A model that is not here is looked for by its name.
PUBLISHED: dict[str, Published] = {
    "avlmaps/light-1": Published(
        fetched="manifest.json", get="avlmaps profiles --fetch light --from URL|DIR", size_mb=250
    ),
    "eyes": Published(get="python -m training.pixels --out MODELS/eyes (docs/guides/train-eyes.md)"),
    "google/tipsv2-b14": Published(size_mb=750),
    "timm/PE-Core-B-16": Published(size_mb=1800),
    "google/siglip2-base-patch16-224": Published(size_mb=1500),
    "openai/clip-vit-base-patch16": Published(size_mb=600),
    "openai/clip-vit-large-patch14": Published(size_mb=1710),
    _WORDS: Published(size_mb=605),
    "laion/larger_clap_general": Published(size_mb=780),
    "facebook/pe-a-frame-base": Published(size_mb=2240),
    _REGIONS: Published(size_mb=156),
    "gberton/MegaLoc": Published(size_mb=915),
    "facebook/dinov2-small": Published(size_mb=88),
    "magic-leap-community/superpoint": Published(size_mb=5),
    "magic-leap-community/superglue_indoor": Published(size_mb=48),
    "disk-depth": _keypoints("kornia/disk", "depth-save.pth", 0),
    "aliked-n16": _keypoints("kornia/aliked", "aliked-n16.pth", 3),
    "disk": _keypoints(_LIGHTGLUE, "disk_lightglue.pth", 48, "disk_lightglue_v0-1_arxiv.pth"),
    "aliked": _keypoints(_LIGHTGLUE, "aliked_lightglue.pth", 48, "aliked_lightglue_v0-1_arxiv.pth"),
    "ResNet50_2048_eigenplaces.pth": Published(
        ("ResNet50_2048_eigenplaces.pth",), get=f"curl -LO {_EIGENPLACES}/ResNet50_2048_eigenplaces.pth", size_mb=110
    ),
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
    "Wav2CLIP.pt": Published(("Wav2CLIP.pt",), get=f"curl -LO {_WAV2CLIP}/Wav2CLIP.pt", size_mb=47),
    "VGG16-NetVLAD-Pitts30K.mat": Published(
        ("VGG16-NetVLAD-Pitts30K.mat", "VGG16-NetVLAD-Pitts30K.safetensors"),
        get=f"curl -L -o VGG16-NetVLAD-Pitts30K.mat {_NETVLAD}/Pitts30K_struct.mat",
        size_mb=530,
    ),
}

# Models that a backend needs beside its own.
ALSO: dict[str, tuple[str, ...]] = {
    "pixels:regions": (_REGIONS,),
    "pixels:lseg": (_BYTE_PAIRS,),
    "sounds:audioclip": (_BYTE_PAIRS,),
    "sounds:wav2clip": (_WORDS,),
}
