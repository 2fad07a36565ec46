"""The libraries of models can be imported whatever torchvision stands beside torch."""

import subprocess
import sys


def test_torchvision_can_be_imported_after_ours_in_a_fresh_process() -> None:
    code = "import avlmaps_models.common.device, torchvision.transforms, transformers.image_utils"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_declaring_twice_does_no_harm() -> None:
    from avlmaps_models.common.operators import declare_missing_operators

    assert declare_missing_operators() == declare_missing_operators()
