"""What is said of a photo whose focal length its points do not fix."""

import numpy as np
import pytest

from avlmaps.core.camera import Pinhole
from avlmaps.query.locate import Located, Uncertainty

CAMERA = Pinhole(300.0, 300.0, 160.0, 120.0, 320, 240)


@pytest.mark.parametrize(("place_m", "says"), [
    (0.4, "the place to 40.0 cm"), (28.08, "do not fix it; give it"), (np.inf, "do not fix it; give it"),
    (np.nan, "do not fix it; give it"),
])  # fmt: skip
def test_an_error_of_no_meaning_is_not_told_as_a_figure(place_m: float, says: str) -> None:
    (note,) = Located(
        None, 3, None, 0.1, 5.0, CAMERA, uncertainty=Uncertainty(focal=0.3, place_m=place_m, angle_rad=place_m)
    ).notes
    assert says in note and "inf" not in note and "nan" not in note
