"""Tests of published weights: what must be imported before torchvision is, see common/operators.py."""

from importlib.util import find_spec

if find_spec("torch") is not None:
    import avlmaps_models.common.device  # noqa: F401
