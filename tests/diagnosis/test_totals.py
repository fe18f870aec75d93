"""Where effects bear on the same thing, the sentence on the one of fewer parts tells what they make together."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import manipulator, recorded

from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.suspect import Estimate, Occurrence
from prb3r.diagnosis.library.totals import pulley_of_cables, total_with_others
from prb3r.diagnosis.result.statements import sentence
from prb3r.effects import PulleyFriction
from prb3r.model.manipulator import Manipulator


def said(calibrated, suspects, *names):
    """The sentences on effects that are fitted together, and the first number of each effect."""
    by_name = {hypothesis.name: hypothesis for hypothesis in suspects}
    chosen = [by_name[name] for name in names]
    start = np.full(sum(len(hypothesis.free) for hypothesis in chosen), -0.05)
    fitted = fit(calibrated.model.adding(*chosen), np.append(calibrated.p, start))
    sizes = [getattr(effect, each.free[0].name) for effect, each in zip(fitted.effects, chosen, strict=True)]
    estimates = [{each.free[0].name: Estimate(size)} for each, size in zip(chosen, sizes, strict=True)]
    return [sentence(fitted, k, estimates[k]) for k in range(len(names))], sizes


@pytest.mark.parametrize(
    ("whole", "part", "together", "unit"),
    [
        ("segment_stiffness (segment 2)", "weakened_plate (plate 4)", np.multiply, ""),
        ("precurvature", "precurvature (plates 4+5+6)", np.add, " 1/m"),
        ("tension_offset", "tension_offset (cables 2)", np.add, " N"),
    ],
)
def test_the_sentence_on_a_part_tells_what_comes_of_it_with_what_is_said_of_the_whole(
    calibrated, suspects, whole, part, together, unit
):
    (of_whole, of_part), sizes = said(calibrated, suspects, whole, part)
    assert f", which makes {together(*sizes):.3g}{unit} with all else that acts there" in of_part
    assert "which makes" not in of_whole  # it is one number here and another there
    (alone,), _ = said(calibrated, suspects, part)
    assert "which makes" not in alone


def test_a_plate_in_a_tapering_arm_is_told_in_all(calibrated, suspects):
    """Along six plates whose stiffness changes by a factor f in all, the fourth has f^(1/10) of the mean."""
    (_, of_plate), (taper, factor) = said(calibrated, suspects, "stiffness_gradient", "weakened_plate (plate 4)")
    assert f"of nominal, which makes {factor * taper**0.1:.3g} with all else that acts there: look for" in of_plate


def test_effects_that_bear_on_other_parts_are_not_added(calibrated, suspects):
    names = "segment_stiffness (segment 1)", "weakened_plate (plate 4)", "precurvature (plates 1+2+3)"
    assert not any("which makes" in text for text in said(calibrated, suspects, *names)[0])


def test_what_the_file_of_the_rig_has_already_is_in_the_total(suspects):
    bent = Manipulator.model_validate(manipulator() | {"effect": [{"kind": "precurvature", "curvature_per_m": 0.4}]})
    calibrated = fit_constants(predictor(replace(recorded(), manipulator=bent)))
    (of_all,), (size,) = said(calibrated, suspects, "precurvature")
    assert f"1/m, which makes {size + 0.4:.3g} 1/m with all else that acts there" in of_all


def test_two_pulleys_in_line_take_what_both_take():
    """A tenth and then a twentieth of the rest are 14.5 %."""
    rig = Manipulator.model_validate(manipulator())
    first, second = PulleyFriction(kind="pulley_friction", efficiency=0.9), 0.95
    own = PulleyFriction(kind="pulley_friction", efficiency=second, cables=["1"])
    total = total_with_others(pulley_of_cables, own, [first], rig.plain_chain(), rig)
    told = Occurrence({"cables": ("1",)}, {"efficiency": Estimate(second)}, total=total)
    assert SUSPECTS["pulley_friction"].sentence(told) == (
        "The pulley (or sheath) of cable 1 takes 5 % of the tension before it reaches the base, "
        "which makes 14.5 % with all else that acts there."
    )


def test_what_a_segment_makes_with_others_is_beside_the_refitted_modulus_not_the_nominal_one():
    told = Occurrence({"segment": 2}, {"factor": Estimate(0.9)}, total=0.72)
    assert SUSPECTS["segment_stiffness"].sentence(told) == (
        "The plates of segment 2 are 0.9 times as stiff as their sections and the fitted modulus give, "
        "which makes 0.72 with all else that acts there."
    )
