"""The stand-ins of array types hold the declarations that jaxtyping's types hold."""

import json
import subprocess
import sys

import jaxtyping
import numpy as np

from avlmaps.core import arrays

# Prints each field of the map's types as it is declared without jaxtyping.
DECLARED = """
import dataclasses, json, sys
from avlmaps.maps import types
out = {}
for kind in (types.Voxels, types.Keyframes, types.HeardSounds):
    for field in dataclasses.fields(kind):
        if hasattr(field.type, "dim_str"):
            out[f"{kind.__name__}.{field.name}"] = [list(field.type.dtypes), field.type.dim_str]
assert "jaxtyping" not in sys.modules
print(json.dumps(out))
"""


def test_without_jaxtyping_a_map_is_held_against_the_same_declarations() -> None:
    done = subprocess.run([sys.executable, "-c", DECLARED], capture_output=True, text=True, check=True)
    with_jaxtyping = subprocess.run(
        [sys.executable, "-c", "import jaxtyping\n" + DECLARED.replace('assert "jaxtyping" not', 'assert "jaxtyping"')],
        capture_output=True,
        text=True,
        check=True,
    )
    plain, checked = json.loads(done.stdout), json.loads(with_jaxtyping.stdout)
    assert len(plain) > 15
    assert plain == checked


def test_tests_have_the_types_of_jaxtyping_itself() -> None:
    names = [name for name in vars(arrays) if hasattr(jaxtyping, name) and name[0].isupper() and name != "Any"]
    assert len(names) > 8
    assert all(getattr(arrays, name) is getattr(jaxtyping, name) for name in names)
    assert isinstance(np.zeros((2, 3), np.float32), arrays.Float32[np.ndarray, "n 3"])  # pyright: ignore[reportArgumentType]
