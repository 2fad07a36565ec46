"""Networks that ship as teachers of a new one: what they say together of each cell (Hinton et al., 2015).

A student that sees each picture as its teachers see it learns the function of several networks, on mixed and
recoloured pictures too (Beyer et al., "Knowledge distillation: a good teacher is patient and consistent", CVPR 2022).
"""

from pathlib import Path

import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn
from training.pixels.export import completed, notes_of
from training.pixels.labels import ROOMS
from training.pixels.network import RoomNetwork, has_bfloat16
from training.pixels.unfold import unfolded

from avlmaps.perception.embedded.scene_network import DEFAULT_WEIGHTS, NO_SAY, SAME_SAY, SYNTHETIC_WEIGHTS, Notes


class Teachers(nn.Module):
    """The files of a folder: the mean of the first's networks, mixed with the second's where the two agree."""

    def __init__(self, folder: Path, device: torch.device) -> None:
        super().__init__()
        self.notes = [notes_of(folder / f"{name}.onnx") for name in (DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS)]
        first, second = (folder / f"{name}.onnx" for name in (DEFAULT_WEIGHTS, SYNTHETIC_WEIGHTS))
        self.temperatures = temperatures_of(first)
        networks = [unfolded(first, len(ROOMS), [], number) for number in range(len(self.temperatures))]
        networks.append(unfolded(second, len(ROOMS), []))
        self.networks = nn.ModuleList(networks)
        self.to(device, memory_format=torch.channels_last).requires_grad_(requires_grad=False).eval()

    @torch.no_grad()
    def forward(self, geometry: Tensor, colour: Tensor) -> Tensor:
        """Return (n, h/2, w/2, kinds) calibrated probabilities."""
        *first, second = (self._scores(network, geometry, colour) for network in self.networks)
        kinds = [(s / t).softmax(dim=-1) for s, t in zip(first, self.temperatures, strict=True)]
        mean = torch.stack(completed(kinds, dim=-1)).mean(dim=0)
        p, q = (self._calibrated(s, n) for s, n in zip(((mean + 1e-9).log(), second), self.notes, strict=True))
        there = geometry[:, 6, ::2, ::2]
        agreement = ((p * q).sqrt().sum(dim=-1) * there).sum(dim=(1, 2)) / there.sum(dim=(1, 2)).clamp_min(1.0)
        share = 0.5 * ((agreement - NO_SAY) / (SAME_SAY - NO_SAY)).clamp(0.0, 1.0)[:, None, None, None]
        return (1.0 - share) * p + share * q

    def train(self, mode: bool = True) -> "Teachers":
        """Stay as they are."""
        return super().train(mode=False)

    @staticmethod
    def _scores(network: nn.Module, geometry: Tensor, colour: Tensor) -> Tensor:
        assert isinstance(network, RoomNetwork)
        with torch.autocast(geometry.device.type, torch.bfloat16, enabled=has_bfloat16(geometry.device)):
            return network(geometry, colour)[0].float().permute(0, 2, 3, 1)

    @staticmethod
    def _calibrated(score: Tensor, notes: Notes) -> Tensor:
        return ((score + score.new_tensor(notes.bias)) / notes.temperature).softmax(dim=-1)


def temperatures_of(path: Path) -> list[float]:
    """Return what divides the scores of each network of a file."""
    graph = onnx.load(path).graph
    constants = {n.output[0]: n.attribute[0].t for n in graph.node if n.op_type == "Constant"}
    constants |= {array.name: array for array in graph.initializer}
    divided = [n for n in graph.node if n.op_type == "Div" and n.input[0].startswith("/networks.")]
    return [float(numpy_helper.to_array(constants[n.input[1]])) for n in divided] or [1.0]
