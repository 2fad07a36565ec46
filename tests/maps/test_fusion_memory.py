import json
import subprocess
import sys
from pathlib import Path

import pytest

BUILD = Path(__file__).with_name("fusion_memory.py")


def measured(rounds: int) -> dict[str, float]:
    """Build a map of 150,000 voxels by 512 in a process of its own; return what it measured."""
    ran = subprocess.run(
        [sys.executable, str(BUILD), "150000", str(rounds)], capture_output=True, text=True, check=True
    )
    return json.loads(ran.stdout)


@pytest.mark.nightly
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="measures the resident set as Linux counts it")
def test_peak_memory_follows_the_voxels_and_not_the_frames():
    once, often = measured(1), measured(5)
    assert often["voxels"] == once["voxels"]
    assert often["frames"] == 5 * once["frames"]
    # Sums in float32, an eighth of room to grow, and the means in float16; blocks and one frame's scratch beside.
    expected_mb = 1.625 * once["sums_mb"] + 120.0
    assert once["peak_finished_mb"] - once["before_mb"] < expected_mb
    assert often["peak_finished_mb"] - often["before_mb"] < expected_mb
