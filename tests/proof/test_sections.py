"""The rig's sections against closed forms and against the engine's, which sums them up in another way."""

import numpy as np
import pytest

from prb3r.model.laws.section import Tube, bending
from prb3r.proof.rig.bending import tabulated_curvature
from prb3r.proof.rig.section import Material, notched_tube, rectangle, section_table


def test_a_plastic_rectangle_follows_its_closed_form():
    """M / M_y = 1.5 - 0.5 / x^2 of an ideally plastic one; 0.98 of that and 0.02 x with a plateau that rises."""
    for slope in (0.0, 0.02):
        moment, curvature, _ = section_table(rectangle(0.5), Material(1.0, 1.0, slope), 1).T / 2
        assert moment == pytest.approx((1 - slope) * (1.5 - 0.5 / curvature**2) + slope * curvature, rel=1e-12)


@pytest.mark.parametrize("tube", [None, Tube(0.74, 0.0), Tube(0.74, 0.85), Tube(0.85, 0.5)])
@pytest.mark.parametrize("compression", [1.0, 1.5])
def test_antiderivatives_and_quadrature_find_the_same_moments_to_either_side(tube, compression):
    outline = rectangle(0.5) if tube is None else notched_tube(1.0, tube.inner, tube.depth, 1)
    for side in (-1, 1):
        table = section_table(outline, Material(1.0, compression, 0.02), side)
        curvature, moment, _ = bending(tube, compression, 0.02, side)
        found = [tabulated_curvature(each, table)[0] for each in moment]
        assert found == pytest.approx(curvature, rel=2e-3)  # curvatures grow up to thirty times as fast as moments


def test_between_the_rows_of_a_table_its_derivative_is_that_of_its_curvature():
    table = section_table(rectangle(0.5), Material(1.0, 1.5, 0.02), 1)
    bare = np.geomspace(0.5, 1.3, 23) * table[100, 0]
    for each in bare:
        ahead, behind = (tabulated_curvature(each * (1 + step), table)[0] for step in (1e-6, -1e-6))
        slope = tabulated_curvature(each, table)[1]
        assert slope == pytest.approx((ahead - behind) / (2e-6 * each), rel=1e-6)
    assert tabulated_curvature(0.1, table) == (0.1, 1.0)
