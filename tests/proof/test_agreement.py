"""Engine and rig share no code; with the same physics they agree, over random manipulators, effects and load paths."""

import numpy as np
import pandas as pd
import pytest
from proof.agreement import disagreement, disagreements, random_manipulator, random_steps

from prb3r.errors import SpecError
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import solve
from prb3r.model.steps import loads_of
from prb3r.proof.rig.simulate import simulate, steps_passed


@pytest.mark.parametrize(("seed", "rigs", "effects"), [(1, 20, 0), (2, 20, 2), (3, 10, 4)])
def test_engine_and_rig_agree_without_history_to_a_hundredth_of_a_percent(seed, rigs, effects):
    away = disagreements(seed, rigs, effects, history=False)
    assert len(away) > rigs
    assert away.max() < 1e-4
    assert np.median(away) < 1e-6


@pytest.mark.parametrize(("seed", "rigs", "effects"), [(4, 6, 0), pytest.param(5, 8, 2, marks=pytest.mark.long)])
def test_engine_and_rig_agree_with_history_to_a_twentieth_of_a_percent(seed, rigs, effects):
    away = disagreements(seed, rigs, effects, history=True)
    assert len(away) > rigs
    assert away.max() < 5e-4
    assert np.median(away) < 1e-5


def laws_of_plates(rng):
    """Two that act together, of those that differ by plate and by side."""
    u, side = rng.uniform, str(rng.choice(["negative", "positive"]))
    knee = {"kind": "nonlinear_plate", "knee_strain": u(5e-4, 2e-3), "ratio": u(0.4, 2.5)}
    law = {"law": "smooth", "sharpness": u(1, 5)} if rng.random() < 0.7 else {"law": "bilinear"}
    notch = {"kind": "notch_closing", "factor": u(0.05, 0.2), "stiffness_n_m_per_rad": u(5, 30)}
    return [knee | law | ({"side": side} if rng.random() < 0.5 else {}), notch | ({"side": side} if u() < 0.5 else {})]


def test_engine_and_rig_agree_on_laws_that_differ_by_plate_and_side():
    rng, away = np.random.default_rng(7), []
    for _ in range(12):
        data = random_manipulator(rng, 0, False)
        data["effect"] = laws_of_plates(rng)
        away += disagreement(data, random_steps(rng, data, False))
    assert len(away) > 12
    assert max(away) < 1e-4


def test_engine_and_rig_agree_on_sections_of_one_shape():
    rng, away = np.random.default_rng(11), []
    for _ in range(6):
        data = random_manipulator(rng, 0, False)
        knee = {"knee_per_m": rng.uniform(1, 3), "ratio": rng.uniform(0.4, 1.5), "sections": "similar"}
        weak = {"kind": "weakened_plate", "plate": 1, "factor": 0.5}  # changes no section
        data["effect"] = [weak, {"kind": "nonlinear_plate", "law": "smooth", "sharpness": 3.0} | knee]
        away += disagreement(data, random_steps(rng, data, False))
    assert len(away) > 6
    assert max(away) < 1e-4


def superelastic_sections(rng):
    """A rectangle by its fibre, or a notched tube, of the arc that it is cut from."""
    u = rng.uniform
    plateau = {"plateau_strain": u(1e-3, 2e-3), "compression_ratio": u(1, 2), "plateau_slope": u(0.1, 0.3)}
    side = str(rng.choice(["negative", "positive"]))
    tube = {"tube_outer_m": 1e-3, "tube_inner_m": u(0, 8e-4), "notch_depth_m": u(0, 8e-4), "notch_side": side}
    return {"kind": "superelastic_plate"} | plateau, tube


@pytest.mark.long
def test_engine_and_rig_agree_on_sections_that_pass_a_plateau():
    """A table of moments over curvatures on one side, of curvatures over moments on the other; up to where the first
    ends."""
    rng, away, passed = np.random.default_rng(9), [], 0
    for k in range(12):
        data = random_manipulator(rng, 0, False)
        law, tube = superelastic_sections(rng)
        if k % 2:
            rigidity = data["youngs_modulus_pa"] * 0.03 * 8e-4**3 / 12
            data["segment"] = [
                {key: value for key, value in segment.items() if key not in ("width_m", "thickness_m")}
                | {"bending_stiffness_n_m2": rigidity}
                for segment in data["segment"]
            ]
        data["effect"] = [law | tube if k % 2 else law]
        steps = random_steps(rng, data, False)
        manipulator = Manipulator.model_validate(data)
        chain = manipulator.chain()
        bend = np.diff(solve_chain(chain, loads_of(manipulator, chain, pd.DataFrame(steps))).angle, axis=1)
        within = (np.abs(bend) < 0.8 * chain.law.knee[:, 0] * chain.arc).all(1)
        away += [far for far, inside in zip(disagreement(data, steps), within, strict=False) if inside]
        passed += (np.abs(bend) > 0.2 * chain.law.knee[:, 0] * chain.arc).any(1)[: len(within)][within].sum()
    assert len(away) > 12
    assert passed > 4
    assert max(away) < 2e-5


def later_effects(rng):
    """Effects that came later, so that the manipulators of `random_manipulator` stay those that are published."""
    u = rng.uniform
    return [
        {"kind": "load_cell", "gain": u(0.8, 1.2), "quadratic_per_n": u(-2e-3, 2e-3), "cables": ["c0"]},
        {"kind": "tension_drift", "offset_n_per_step": u(-1, 2)},
        {"kind": "hanger", "weight_n": u(0, 4)},
        {"kind": "load_dependent_friction", "exponent": u(0, 0.5), "tension_n": u(10, 60)},
        {"kind": "base_compliance", "compliance_rad_per_n_m": u(0, 0.02)},
        {"kind": "plate_softening", "share_per_step": u(-0.03, 0.05)},
        {"kind": "umbilical", "stiffness_n_m_per_rad": u(0, 1)},
        {"kind": "pulley_friction", "efficiency": u(0.8, 1)},
        {"kind": "wrap_saturation", "saturation_per_rad": u(0, 10)},
        {"kind": "stiffness_gradient", "tip_to_base": u(0.5, 2)},
        {"kind": "tension_play", "play_n": u(0, 4)},
        {"kind": "friction_drift", "share_per_step": u(-0.1, 0.3)},
        {"kind": "precurvature_gradient", "change_per_m": u(-2, 2)},
        {"kind": "tip_mass", "mass_kg": u(0, 0.2)},
        {"kind": "base_tilt", "angle_rad": u(-0.3, 0.3)},
        {"kind": "gravity", "x_m_s2": u(-5, 5), "y_m_s2": u(-5, 5)},
        {"kind": "self_weight", "x_n": u(-3, 3), "y_n": u(-3, 3)},
        {"kind": "payload_scale", "scale": u(1, 2)},
        {"kind": "hole_drag", "drag_n": u(0, 1)},
        {"kind": "plate_relaxation", "share": u(0, 0.6), "steps": u(0.5, 8)},
    ]


@pytest.mark.parametrize(("history", "most"), [(False, 1e-4), (True, 5e-4)])
def test_engine_and_rig_agree_on_later_effects_together(history, most):
    """A compliant base with declared slip only, as another set of kernels takes long to compile; friction that drifts
    does not go with history."""
    rng, away, declared = np.random.default_rng(8), [], {"base_compliance", "friction_drift"}
    for _ in range(6):
        data = random_manipulator(rng, 0, history)
        data["effect"] = [each for each in later_effects(rng) if not history or each["kind"] not in declared]
        data["segment"] = [segment | {"plate_mass_kg": rng.uniform(0, 0.05)} for segment in data["segment"]]
        data["disk"] = data["disk"] | {"tip_mass_kg": rng.uniform(0, 0.1)}
        away += disagreement(data, random_steps(rng, data, history))
    assert len(away) > 6
    assert max(away) < most


def test_engine_and_rig_agree_on_friction_that_goes_by_rates():
    """Times of some seconds and of some hours, so that friction is between a fifth and twice the nominal one."""
    rng, away = np.random.default_rng(9), []
    for _ in range(8):
        data = random_manipulator(rng, 0, False)
        rate = {
            "kind": "rate_dependent_friction",
            "rate": rng.uniform(-0.1, 0.1),
            "reference_n_per_s": rng.uniform(0.1, 9),
        }
        data["effect"] = [rate, {"kind": "pulley_friction", "efficiency": rng.uniform(0.8, 1)}]
        steps = random_steps(rng, data, False)
        times = np.cumsum(10 ** rng.uniform(0, 4, len(steps)))
        timed = [step | {"time_s": time} for step, time in zip(steps, times, strict=True)]
        away += disagreement(data, timed)
        assert disagreement(data | {"effect": data["effect"][1:]}, timed) == disagreement(
            data | {"effect": data["effect"][1:]}, steps
        )
    assert len(away) > 8
    assert max(away) < 1e-4
    with pytest.raises(SpecError, match="every step needs a later time_s"):
        simulate(data, steps)


def test_engine_and_rig_agree_on_drifts_that_go_with_the_time():
    """Steps after seconds and after hours; one sequence, and two of one table of which the later stands first."""
    rng, away, moved = np.random.default_rng(12), [], []
    for _ in range(6):
        data = random_manipulator(rng, 0, False)
        drift = {"kind": "tension_drift", "offset_n_per_step": rng.uniform(0.5, 2)}
        soft = {"kind": "plate_softening", "share_per_step": rng.uniform(-0.05, 0.05)}
        creep = {"kind": "plate_relaxation", "share": 0.3, "steps": rng.uniform(0.5, 3)}
        data["effect"] = [drift, soft, creep | ({"step_s": 10 ** rng.uniform(2, 3)} if len(moved) % 2 else {})]
        steps = random_steps(rng, data, False, count=6)
        times = np.cumsum(10 ** rng.uniform(0, 4, len(steps)))
        timed = [step | {"time_s": time} for step, time in zip(steps, times, strict=True)]
        away += disagreement(data, timed)
        even, uneven = simulate(data, steps), simulate(data, timed)
        moved.append(np.nanmax(np.abs(even.x - uneven.x)))
        table = [{"sequence": "b"} | step for step in timed[3:]] + [{"sequence": "a"} | step for step in timed[:3]]
        manipulator = Manipulator.model_validate(data)
        engine = solve(manipulator, pd.DataFrame(table).assign(step=[1, 2, 3] * 2))
        passed = steps_passed(table)
        for name, part in (("b", slice(0, 3)), ("a", slice(3, 6))):
            rig = simulate(data, table[part], before=passed[part])
            rows = engine[engine["sequence"] == name]
            if rig.converged.all() and (rows["outcome"] == "converged").all():
                away.append(np.abs(rows["x_m"].to_numpy() - rig.x.ravel()).max() / manipulator.chain().length)
    assert len(away) > 18
    assert max(away) < 1e-4
    assert max(moved) > 1e-2


@pytest.mark.parametrize(
    "law",
    [
        {"kind": "nonlinear_plate", "law": "smooth", "knee_per_m": 4.0, "ratio": 0.5, "sharpness": 3.0},
        {"kind": "hysteretic_plate", "slipping_share": 0.7, "yield_per_m": 4.0, "elements": 2},
    ],
    ids=lambda law: law["kind"],
)
def test_engine_and_rig_agree_on_cables_that_bend_beside_plates_that_yield(law):
    rng, away, moved = np.random.default_rng(13), [], []
    for _ in range(6):
        data = random_manipulator(rng, 0, False)
        rigidity = Manipulator.model_validate(data).bending_stiffness.mean()
        data["effect"] = [law, {"kind": "cable_bending", "stiffness_n_m2": rng.uniform(0.2, 0.6) * rigidity}]
        steps = random_steps(rng, data, False)
        away += disagreement(data, steps)
        beside, alone = (simulate(data | {"effect": data["effect"][:count]}, steps) for count in (2, 1))
        moved.append(np.nanmax(np.abs(beside.x - alone.x)))
    assert len(away) > 12
    assert max(away) < 1e-4
    assert max(moved) > 1e-2


def test_engine_and_rig_agree_on_static_friction():
    """Cables that turn back, hang slack, are held and pulled on; the excess is up to one and a half times the kinetic
    friction."""
    rng, away, moved = np.random.default_rng(10), [], []
    for _ in range(8):
        data = random_manipulator(rng, 0, False)
        sticks = {"kind": "breakaway_friction", "excess": rng.uniform(0.2, 1.5), "decay_n": rng.uniform(5, 60)}
        data["effect"] = [sticks, {"kind": "pulley_friction", "efficiency": rng.uniform(0.8, 1)}]
        steps = random_steps(rng, data, False, count=6)
        away += disagreement(data, steps)
        kinetic, static = (simulate(data | {"effect": data["effect"][first:]}, steps) for first in (1, 0))
        moved.append(np.nanmax(np.abs(static.x - kinetic.x)))
    assert len(away) > 16
    assert max(away) < 1e-4
    assert max(moved) > 1e-2


@pytest.mark.parametrize("history", [False, True])
def test_engine_and_rig_agree_on_a_fitted_moment_law(history):
    """The rig has the law in its tangent, the engine goes round it."""
    rng = np.random.default_rng(6)
    data = random_manipulator(rng, 2, history)
    steps = random_steps(rng, data, history)
    terms = [{"of": "constant", "coefficient": 0.1}, {"of": "position", "coefficient": -0.2, "plates": [2, 3]}]
    data["effect"].append({"kind": "empirical_moment", "terms": [*terms, {"of": "bend", "coefficient": -5.0}]})
    manipulator = Manipulator.model_validate(data)
    chain = manipulator.chain()
    engine, rig = equilibria_of(chain, loads_of(manipulator, chain, pd.DataFrame(steps))), simulate(data, steps)
    away = np.hypot(engine.x - rig.x, engine.y - rig.y).max(1) / chain.length
    assert away.max() < 1e-5
    bare = solve_chain(chain._replace(closure=(), constant=None), loads_of(manipulator, chain, pd.DataFrame(steps)))
    assert np.hypot(bare.x - rig.x, bare.y - rig.y).max() / chain.length > 1e-2


def test_a_hole_that_turns_back_within_a_step_is_noticed():
    """Several cables change at once: without looking for the turn the engine is 1.9e-3 of the length away."""
    data = {
        "name": "turns back",
        "youngs_modulus_pa": 187000000000.0,
        "model": "elastica",
        "disk": {"thickness_m": 0.006, "mass_kg": 0.04},
        "friction": {"coefficient": 0.289, "direction": "history", "presliding_m": 7.884e-05, "wrap": "edges"},
        "segment": [
            {"plates": 4, "length_m": 0.03, "clamp_m": 0.0, "width_m": 0.03, "thickness_m": 0.0006107},
            {"plates": 2, "length_m": 0.03, "clamp_m": 0.0, "width_m": 0.03, "thickness_m": 0.0008372},
            {"plates": 4, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 0.000732},
        ],
        "cable": [
            {"name": "c0", "offset_m": 0.024, "ends_at_segment": 3},
            {"name": "c1", "offset_m": -0.02488, "ends_at_segment": 3},
            {"name": "c2", "offset_m": 0.01675, "ends_at_segment": 1},
            {"name": "c3", "offset_m": -0.01751, "ends_at_segment": 2},
        ],
        "effect": [
            {"kind": "segment_stiffness", "segment": 1, "factor": 0.9298},
            {"kind": "tip_load_friction", "efficiency": 0.7677},
            {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 2.78, "ratio": 0.6569},
        ],
    }
    steps = [
        {
            "cable_c0_n": 21.71,
            "cable_c1_n": 0.0,
            "cable_c2_n": 0.0,
            "cable_c3_n": 0.0,
            "tip_x_n": 0.4064,
            "tip_y_n": 0.06854,
        },
        {
            "cable_c0_n": 5.394,
            "cable_c1_n": 0.0,
            "cable_c2_n": 0.0,
            "cable_c3_n": 76.83,
            "tip_x_n": 0.2978,
            "tip_y_n": -0.1255,
        },
        {
            "cable_c0_n": 23.2,
            "cable_c1_n": 56.08,
            "cable_c2_n": 0.0,
            "cable_c3_n": 0.0,
            "tip_x_n": -0.2216,
            "tip_y_n": 0.1069,
        },
    ]
    manipulator = Manipulator.model_validate(data)
    chain = manipulator.chain()
    engine, rig = solve_chain(chain, loads_of(manipulator, chain, pd.DataFrame(steps))), simulate(data, steps)
    assert np.hypot(engine.x - rig.x, engine.y - rig.y).max() / chain.length < 5e-4
