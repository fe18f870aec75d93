"""Sections with a stress plateau: closed forms, limits, and which side is which."""

import numpy as np
import pytest
from model.one_segment import PLATE, manipulator
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize_scalar

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.laws.section import Tube, bending

FIBRE, RIGIDITY = 4e-4, 0.24
TUBE = {"tube_outer_m": 1.16e-3, "tube_inner_m": 0.86e-3, "notch_depth_m": 0.986e-3}


def superelastic(**parameters):
    return {"kind": "superelastic_plate", "plateau_strain": 0.0075} | parameters


def bent(moment, *effects, **changes):
    """Curvature of an arc under one moment (N m): a circle."""
    segment = [PLATE | {"outer_fibre_m": FIBRE} | changes]
    chain = manipulator(*effects, segment=segment, model="elastica").chain()
    found = solve_chain(chain, loads(chain, [[0.0, 0.0]], moment=moment))
    return np.diff(found.angle[0])[0] / chain.arc[0]


def test_an_ideally_plastic_rectangle_carries_up_to_one_and_a_half_yield_moments():
    """Beyond the yield curvature M / M_y = 1.5 - 0.5 / x^2, x = k / k_y (Timoshenko, Strength of Materials II)."""
    curvature, elastic, _ = bending(None, 1.0, 0.0, 1)
    x, m = curvature / 2, elastic / 2  # of a rectangle of height 1 that yields at the strain 1
    expected = np.where(x < 1, x, 1.5 - 0.5 / np.maximum(x, 1) ** 2)
    assert m == pytest.approx(expected, rel=1e-9)


def test_the_limit_moment_of_unequal_plateaus_is_that_of_two_blocks_of_stress():
    """The plastic axis parts the height as c : 1, so that M = c / (1 + c) / 2 times its square and the stress."""
    curvature, elastic, _ = bending(None, 1.5, 0.0, -1)
    limit = 1.5 / 2.5 / 2 * 12
    assert elastic[-1] < limit
    assert elastic[-1] == pytest.approx(limit, rel=0.02)
    core = curvature[-1] ** -2 * (1 + 1.5**3) / 3  # what the elastic core lacks to these blocks, axis held
    assert elastic[-1] == pytest.approx(limit, rel=12 * core)


def test_energy_finds_the_same_moment_of_a_notched_tube():
    """The neutral axis is where bending takes least energy, dU/dk its moment: by quadrature, without any balance."""
    tube, k, step = Tube(0.74, 0.85), 30.0, 1e-3

    def density(strain):
        strain, knee = abs(strain), 1.0 if strain > 0 else 1.5
        beyond = max(strain - knee, 0.0)
        return strain**2 / 2 - 0.98 * beyond**2 / 2

    def width(y):
        return 2 * np.sqrt(0.25 - y**2) - 2 * np.sqrt(max(0.1369 - y**2, 0.0))

    def energy(curvature, side):
        def at(axis):
            kinks = [axis + side * strain / curvature for strain in (1.5, -1.0)] + [-0.37, axis]
            inside = [y for y in kinks if -0.5 < y < -0.35]
            f = lambda y: density(-side * curvature * (y - axis)) * width(y)  # noqa: E731
            return quad(f, -0.5, -0.35, points=inside, epsabs=1e-12, epsrel=1e-10)[0]

        return minimize_scalar(at, bounds=(-0.5, -0.35), method="bounded", options={"xatol": 1e-9}).fun

    area = quad(width, -0.5, -0.35, points=[-0.37])[0]
    centre = quad(lambda y: y * width(y), -0.5, -0.35, points=[-0.37])[0] / area
    inertia = quad(lambda y: (y - centre) ** 2 * width(y), -0.5, -0.35, points=[-0.37])[0]
    for side in (-1, 1):
        moment = (energy(k + step, side) - energy(k - step, side)) / (2 * step)
        curvatures, elastic, slope = bending(tube, 1.5, 0.02, side)
        law = CubicHermiteSpline(curvatures, elastic, slope)
        assert law(k) == pytest.approx(moment / inertia, rel=3e-4)


@pytest.mark.parametrize("tube", [None, Tube(0.74, 0.0), Tube(0.74, 0.85), Tube(0.85, 0.5)])
def test_sides_differ_where_both_the_section_and_its_stresses_are_lopsided(tube):
    limits = [[bending(tube, compression, 0.02, side)[1][-1] for side in (-1, 1)] for compression in (1.0, 1.5)]
    assert limits[0][0] == pytest.approx(limits[0][1])
    lopsided = tube is not None and tube.depth > 0
    assert (abs(limits[1][0] / limits[1][1] - 1) > 0.02) == lopsided


@pytest.mark.parametrize("tube", [None, Tube(0.74, 0.0), Tube(0.74, 0.85), Tube(0.85, 0.5), Tube(0.0, 0.3)])
@pytest.mark.parametrize("material", [(1.0, 0.0), (1.5, 0.02), (2.0, 0.1)])
def test_slopes_are_those_of_the_moments(tube, material):
    for side in (-1, 1):
        curvature, moment, slope = bending(tube, *material, side)
        middle = (slope[1:] + slope[:-1]) / 2
        jumps = np.abs(np.diff(moment) / np.diff(curvature) - middle)
        assert np.sort(jumps)[-3] < 0.01, "but where the material reaches a plateau"
        assert jumps.max() < 0.06


def test_far_below_its_plateau_and_at_the_slope_of_the_elastic_part_a_plate_is_elastic():
    assert bent(0.3, superelastic(plateau_strain=0.05)) == pytest.approx(0.3 / RIGIDITY, rel=1e-3)
    half = bent(20.0, superelastic(plateau_slope=0.5))
    assert 20.0 / RIGIDITY < half < 2 * 20.0 / RIGIDITY


def test_a_stress_and_its_strain_say_the_same_of_plates_of_every_thickness():
    """Half as thick, twice the curvature under the same part of their stiffness."""
    stress = bent(8.0, {"kind": "superelastic_plate", "plateau_stress_pa": 0.0075 * 2e11})
    assert stress == pytest.approx(bent(8.0, superelastic()), rel=1e-12)
    assert bent(8.0, superelastic(), outer_fibre_m=FIBRE / 2) < stress
    thin = bent(16.0, superelastic(), outer_fibre_m=FIBRE / 2)
    assert thin == pytest.approx(2 * stress, rel=1e-9)


def test_a_plate_passes_its_plateau_where_the_section_says():
    """Elastic strain of 3 % at the outermost fibre: the moment on the plate by the closed form of its blocks."""
    moment = RIGIDITY * 0.03 / FIBRE

    def carried(k):  # axis 0 < a < h from the stretched edge, elastic between a - s and a + 1.5 s, s the core's arm
        height, core = 2 * FIBRE, 0.0075 / k

        def force(a):
            blocks = [(a - core) * 1.0, core / 2, -1.5 * core * 1.5 / 2, -(height - a - 1.5 * core) * 1.5]
            return sum(blocks)

        a = brentq(force, core, height - 1.5 * core)
        stretched = (a - core) * (a + core) / 2 + core**2 / 3
        pressed = 1.5 * ((height - a) ** 2 - (1.5 * core) ** 2) / 2 + 1.5 * (1.5 * core) ** 2 / 3
        return 0.0075 * (stretched + pressed) * RIGIDITY / (height**3 / 12)

    found = bent(0.43 * moment, superelastic(plateau_slope=0.0))
    assert carried(found) == pytest.approx(0.43 * moment, rel=2e-4)
    assert bent(-0.43 * moment, superelastic(plateau_slope=0.0)) == pytest.approx(-found)


def test_a_notch_is_cut_from_the_side_that_is_named():
    """Bending toward it closes it; the other cut is its mirror image."""
    changes = {"bending_stiffness_n_m2": 6e-6, "outer_fibre_m": 1.1e-4}
    toward, away = (bent(side * 9e-4, superelastic(**TUBE), **changes) for side in (1, -1))
    other = [bent(side * 9e-4, superelastic(notch_side="negative", **TUBE), **changes) for side in (1, -1)]
    assert other == pytest.approx([-away, -toward])
    sides = bending(Tube(0.86 / 1.16, 0.85), 1.5, 0.02, 1), bending(Tube(0.86 / 1.16, 0.85), 1.5, 0.02, -1)
    scale = 0.0075 / 1.16e-3
    expected = [np.interp(9e-4 / 6e-6 / scale, moment, curvature) * scale for curvature, moment, _ in sides]
    assert [toward, -away] == pytest.approx(expected, rel=1e-3)
    assert abs(toward / away + 1) > 0.03


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"plateau_stress_pa": 4e8}, "either plateau_stress_pa or plateau_strain"),
        ({"plateau_strain": None}, "either plateau_stress_pa or plateau_strain"),
        ({"plateau_strain": None, "plateau_stress_pa": 450.0}, "begins at a strain of 2.25e-09 by youngs_modulus_pa"),
        ({"tube_outer_m": 1e-3}, "together"),
        ({"notch_side": "negative"}, "together"),
        (TUBE | {"notch_depth_m": 1.2e-3}, "less than tube_outer_m"),
        ({"compression_ratio": 0.5}, "greater than or equal to 1"),
    ],
)
def test_a_section_that_says_too_little_too_much_or_what_cannot_be_is_refused(wrong, says):
    given = {name: value for name, value in superelastic(**wrong).items() if value is not None}
    with pytest.raises(ValueError, match=says):
        manipulator(given, segment=[PLATE | {"outer_fibre_m": FIBRE}])


def test_a_section_needs_its_height_and_stands_in_the_place_of_another_law():
    with pytest.raises(ValueError, match="needs outer_fibre_m"):
        manipulator(superelastic())
    assert manipulator(superelastic(**TUBE)).effect[0].tube == Tube(pytest.approx(0.86 / 1.16), pytest.approx(0.85))
    knee = {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": 0.01}
    with pytest.raises(ValueError, match="in the place of nonlinear_plate"):
        manipulator(superelastic(**TUBE), knee)
    flat = {"plates": 4, "length_m": 0.03, "width_m": 0.03, "thickness_m": 8e-4}
    with pytest.raises(ValueError, match="not with width_m and thickness_m"):
        manipulator(superelastic(**TUBE), segment=[flat])
