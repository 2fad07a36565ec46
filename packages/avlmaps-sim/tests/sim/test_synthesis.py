"""Every rule makes a sound that can be heard, another one each time, and the same one for the same seed."""

import numpy as np
import pytest

from avlmaps_sim.synthesis import MAKERS, RATE_HZ, synthesise


@pytest.mark.few(12)
@pytest.mark.parametrize("category", MAKERS)
def test_each_kind_can_be_heard_and_varies(category: str) -> None:
    one, same, other = (synthesise(category, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert one.dtype == np.float32
    assert 1.0 < len(one) / RATE_HZ < 10.0
    assert np.isfinite(one).all()
    assert np.abs(one).max() == pytest.approx(0.5, rel=1e-3)
    assert np.array_equal(one, same)
    assert len(one) != len(other) or not np.allclose(one, other, atol=1e-3)


def test_a_kind_without_a_rule_is_named() -> None:
    with pytest.raises(ValueError, match="there is no rule for the sound of 'silence'"):
        synthesise("silence", np.random.default_rng(0))
