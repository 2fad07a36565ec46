"""A small random EigenPlaces in the layout of ResNet50_2048_eigenplaces.pth: one block a stage, 5 million weights."""

from pathlib import Path

import torch

DIM = 48


def write_eigenplaces(folder: Path, name: str = "ResNet50_2048_eigenplaces.pth", tiny: bool = True) -> None:
    """Write the checkpoint where ``model_file`` finds it; of the published sizes unless ``tiny``."""
    state = random_weights() if tiny else random_weights("Bottleneck", (3, 4, 6, 3), 2048)
    torch.save(state, folder / name)


def random_weights(
    kind: str = "BasicBlock", blocks: tuple[int, int, int, int] = (1, 1, 1, 1), dim: int = DIM
) -> dict[str, torch.Tensor]:
    """Return weights of a ResNet under the published names: its children numbered, then the aggregation."""
    from torchvision.models import resnet

    torch.manual_seed(13)
    made = resnet.ResNet(getattr(resnet, kind), list(blocks))
    channels = made.fc.in_features
    numbered = torch.nn.Sequential(*list(made.children())[:-2])
    return with_aggregation(numbered, channels, dim)


def with_aggregation(backbone: torch.nn.Module, channels: int, dim: int = DIM) -> dict[str, torch.Tensor]:
    """Return a backbone's weights and random ones behind it; its statistics are not those of an untrained one."""
    generator = torch.Generator().manual_seed(13)
    state = {f"backbone.{name}": values for name, values in backbone.state_dict().items()}
    for name, values in state.items():
        if name.endswith("running_mean"):
            state[name] = 0.1 * torch.randn(values.shape, generator=generator)
        elif name.endswith("running_var"):
            state[name] = 0.5 + torch.rand(values.shape, generator=generator)
    return state | {
        "aggregation.1.p": torch.tensor([2.7]),
        "aggregation.3.weight": torch.randn((dim, channels), generator=generator),
        "aggregation.3.bias": 0.1 * torch.randn(dim, generator=generator),
    }
