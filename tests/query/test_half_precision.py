"""Float16 features are widened exactly, on processors with an instruction for it and on others."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

_CODE = """
import numpy as np
from avlmaps.query.kernels import half_dot, widen

bits = np.arange(1 << 16, dtype=np.uint16).reshape(256, 256)
wide = np.zeros(bits.shape, np.float32)
widen(bits, wide)
np.testing.assert_array_equal(wide, bits.view(np.float16).astype(np.float32))
rows = np.random.default_rng(0).standard_normal((7, 40)).astype(np.float16)
word, out = np.linspace(-1.0, 1.0, 40, dtype=np.float32), np.zeros(7, np.float32)
half_dot(rows.view(np.uint16), word, out, 0, 7)
np.testing.assert_allclose(out, rows.astype(np.float64) @ word, atol=1e-4)
"""


@pytest.mark.parametrize("processor", ["", "generic"])
def test_every_half_is_widened_exactly_with_and_without_the_processors_instruction(
    processor: str, tmp_path: Path
) -> None:
    """A generic x86 has no such instruction; code that assumed one ended in a segmentation fault."""
    target = {"NUMBA_CPU_NAME": processor, "NUMBA_CACHE_DIR": str(tmp_path)} if processor else {}
    done = subprocess.run(
        [sys.executable, "-c", _CODE], capture_output=True, text=True, check=False, env={**os.environ, **target}
    )
    assert done.returncode == 0, done.stderr
