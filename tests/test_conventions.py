"""Every number of docs/conventions.md is the code's own."""

import re
from math import exp
from pathlib import Path

import msgspec
import numpy as np

from avlmaps.core.camera import Pinhole
from avlmaps.core.poses import MAX_ROTATION_FAULT
from avlmaps.maps.fusion.measure_kernels import GREATEST_EXPONENT
from avlmaps.maps.fusion.sensor import PAPERS_VARIANCE_M2
from avlmaps.perception.embedded.meanings import Meanings
from avlmaps.perception.profiles import profile
from avlmaps.query.factors import FOUND_AT, ROUNDING, HeatSettings
from avlmaps.query.locate import LocateSettings
from avlmaps.query.object_settings import ObjectSettings
from avlmaps.recordings.layout import Description

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "conventions.md").read_text(encoding="utf-8")
# Digits that are part of a name or of a formula's form.
NAMES = ("(u + 0.5, v + 0.5)", "4x4", "float64", "float32", "16-bit", "exp(−d²/(2·v))", "i+1", "[0, 1]", "[-1, 1]")
ZERO = "0 where there is none"


def _claims() -> list[str]:
    heat, things = HeatSettings(), ObjectSettings()
    reach = {name: 1.0 / getattr(heat, f"{name}_falloff_per_m") for name in ("primary", "context")}
    embedded = profile("embedded").weight_variance_m2
    return [
        f"primary falls off by {heat.primary_falloff_per_m} per metre (reaches {reach['primary']:g} m)",
        f"context by {heat.context_falloff_per_m} per metre (reaches {reach['context']:g} m)",
        f"the paper's {PAPERS_VARIANCE_M2} unless the profile knows better (`embedded`: {embedded:g}, nearly even)",
        f"never below {exp(-GREATEST_EXPONENT):.0e}",
        f"off by more than {MAX_ROTATION_FAULT}",
        "(7-Scenes is off by 2e-4)",  # measured; tests/recordings/test_seven_scenes.py reads such poses
        f"where this probability is {FOUND_AT} or more",
        f"instances of confidence {things.least_confidence} or more",
        f"instances of confidence {things.least_in_company} or more count as well",
        f"counts from {things.least_confidence} as before",
        f"a part is found by itself from {FOUND_AT}",
        f"({Meanings.narrower_share} of their probability counts)",
        f"narrowest name that has a confidence of {FOUND_AT}",
        f"a place that is known to less than {LocateSettings().max_place_error_m} m is not given",
        f"differ by less than {ROUNDING:.0e} are equal",
    ]


def _plain(text: str) -> str:
    return re.sub(r"\s+", " ", re.sub(r"(\de)([+-])0*(\d)", r"\1\2\3", text))


def test_every_number_of_the_page_is_the_codes_own() -> None:
    page = _plain(PAGE)
    for claim in map(_plain, _claims()):
        assert claim in page, claim
        page = page.replace(claim, "")
    for name in (*NAMES, ZERO):
        page = page.replace(name, "")
    left = re.findall(r".{0,60}\d.{0,20}", page)
    assert not left, "a number that no claim of this test holds against the code"


def test_the_centre_of_a_pixel_and_the_unit_of_depth_are_as_the_page_says() -> None:
    point = Pinhole(1.0, 1.0, 2.5, 1.5, 4, 3).backproject(np.ones((3, 4)))[1, 2]
    np.testing.assert_allclose(point, [0.0, 0.0, 1.0], atol=1e-12)
    assert default_depth_units_per_m() == 1000.0, "16-bit millimetres"


def default_depth_units_per_m() -> float:
    (value,) = [field.default for field in msgspec.structs.fields(Description) if field.name == "depth_units_per_m"]
    return value
