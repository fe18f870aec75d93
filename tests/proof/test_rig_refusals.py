"""Effects and loads that the rig refuses."""

import pytest
from rigs import effect, prototype

from prb3r.errors import SpecError
from prb3r.proof.rig.simulate import simulate


@pytest.mark.parametrize(
    ("bad", "says"),
    [
        (effect("pulley_friction", efficiency=1.2), "efficiency"),
        (effect("pulley_friction", efficiency=0.0), "efficiency"),
        (effect("pulley_friction", efficiency=0.9, cables="1"), "list"),
        (effect("worn_hole", disk=14, coefficient=0.3), "disk"),
        (effect("dead_cable", cable="5"), "cable"),
        (effect("dead_cable", cable=1), "cable"),
        (effect("weakened_plate", plate=0, factor=0.8), "plate"),
        (effect("weakened_plate", plate=3), "factor is missing"),
        (effect("weakened_plate", plate=3, factor=float("nan")), "factor"),
        (effect("slip_history", presliding_m=0.0), "presliding_m"),
        (effect("nonlinear_plate", law="cubic"), "cubic_m2"),
        (effect("nonlinear_plate", law="bilinear", knee_per_m=1.0), "ratio"),
        (effect("nonlinear_plate", law="bilinear", knee_per_m=1.0, ratio=0.0), "ratio"),
        (effect("nonlinear_plate", law="bilinear", knee_per_m=1.0, knee_strain=1e-3, ratio=0.5), "or knee_strain"),
        (effect("nonlinear_plate", law="smooth", knee_per_m=1.0, ratio=0.5), "sharpness"),
        (effect("hysteretic_plate", slipping_share=0.5), "yield_per_m or yield_strain"),
        (effect("hysteretic_plate", slipping_share=1.0, yield_per_m=1.0), "slipping_share"),
        (effect("hysteretic_plate", slipping_share=0.5, yield_per_m=1.0, elements=1.5), "elements"),
        (effect("superelastic_plate", plateau_strain=0.01, plateau_stress_pa=4e8), "either plateau_stress_pa or"),
        (effect("superelastic_plate", plateau_strain=0.01, tube_outer_m=1e-3), "together"),
        (effect("notch_closing", factor=1.0, stiffness_n_m_per_rad=1.0, side="up"), "side"),
        (effect("hole_clearence", clearance_m=0.1), "hole_clearance"),
        (effect("gravity", x_m_s2=0.0, y_m_s2=1.0, z_m_s2=2.0), "z_m_s2"),
    ],
)
def test_bad_effects_are_refused(bad, says):
    with pytest.raises(SpecError, match=says):
        simulate(prototype(bad), [])


def test_all_problems_are_said_at_once():
    with pytest.raises(SpecError) as refused:
        simulate(
            prototype(effect("moon"), effect("dead_cable", cable="5"), effect("edge_wrap"), effect("edge_wrap")), []
        )
    assert len(refused.value.problems) == 3
    without_mass = prototype(effect("gravity", x_m_s2=0.0, y_m_s2=1.0)) | {"disk": {"thickness_m": 0.004}}
    with pytest.raises(SpecError, match="mass_kg"):
        simulate(without_mass, [])
    with pytest.raises(SpecError, match="cable_9_n") as refused:
        simulate(prototype(), [{"cable_9_n": 1.0}, {"cable_1_n": -1.0}])
    assert len(refused.value.problems) == 2
