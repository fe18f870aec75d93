"""Parameters by name: every effect's numbers against differences of whole solves, and names that lead nowhere."""

import numpy as np
import pandas as pd
import pytest

import prb3r
from prb3r.errors import SpecError
from prb3r.model.manipulator import Manipulator
from prb3r.model.parameter import parameter_at
from prb3r.model.paths import with_value
from prb3r.model.solve import solve

STEPS = pd.DataFrame(
    {"sequence": ["a"] * 3, "step": [1, 2, 3], "cable_up_n": [40.0, 25, 40], "cable_down_n": [0.0, 10, 10]}
    | {"tip_y_n": [0.0, 1, 1], "disk2_x_n": [0.0, 0, 0.5], "slip_up": [-1, 1, -1], "time_s": [0, 2, 9]}
)
EFFECTS = [
    {"kind": "cable_friction", "coefficient": 0.2},
    {"kind": "pulley_friction", "efficiency": 1.0},
    {"kind": "worn_hole", "disk": 2, "coefficient": 0.5},
    {"kind": "tension_offset", "offset_n": 0.5},
    {"kind": "load_dependent_friction", "exponent": 0.3, "tension_n": 30.0},
    {"kind": "rate_dependent_friction", "rate": 0.1, "reference_n_per_s": 0.5},
    {"kind": "rate_dependent_friction", "rate": 0.0},
    {"kind": "friction_drift", "share_per_step": 0.1},
    {"kind": "breakaway_friction", "excess": 0.5, "decay_n": 20.0},
    {"kind": "wrap_saturation", "saturation_per_rad": 3.0},
    {"kind": "hole_drag", "drag_n": 0.5},
    {"kind": "stiffness_gradient", "tip_to_base": 1.0},
    {"kind": "tension_drift", "offset_n_per_step": 0.5},
    {"kind": "tension_play", "play_n": 1.5},
    {"kind": "hanger", "weight_n": 1.5},
    {"kind": "plate_softening", "share_per_step": 0.01},
    {"kind": "plate_relaxation", "share": 0.3, "steps": 4.0},
    {"kind": "base_compliance", "compliance_rad_per_n_m": 0.01},
    {"kind": "umbilical", "stiffness_n_m_per_rad": 0.0},
    {"kind": "load_cell", "gain": 1.0, "quadratic_per_n": 0.0},
    {"kind": "hole_offset", "cable": "up", "offset_m": 0.0},
    {"kind": "hole_clearance", "clearance_m": 1e-3},
    {"kind": "weakened_plate", "plate": 3, "factor": 0.8},
    {"kind": "segment_stiffness", "segment": 1, "factor": 1.0},
    {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": 0.0},
    {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 2.0, "ratio": 0.7},
    {"kind": "nonlinear_plate", "law": "smooth", "knee_strain": 8e-4, "ratio": 0.7, "sharpness": 2.0},
    {"kind": "nonlinear_plate", "law": "bilinear", "knee_strain": 8e-4, "ratio": 1.5, "side": "positive"},
    {"kind": "superelastic_plate", "plateau_strain": 6e-4, "compression_ratio": 1.5, "plateau_slope": 0.02},
    {"kind": "superelastic_plate", "plateau_stress_pa": 1.2e8},
    {"kind": "notch_closing", "factor": 0.05, "stiffness_n_m_per_rad": 3.0, "side": "positive"},
    {"kind": "precurvature", "curvature_per_m": 0.0},
    {"kind": "precurvature_gradient", "change_per_m": 0.5},
    {"kind": "disk_contact", "angle_rad": 0.03, "stiffness_n_m_per_rad": 3.0},
    {"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.01},
    {"kind": "cable_bending", "stiffness_n_m2": 0.0},
    {"kind": "gravity", "x_m_s2": 0.0, "y_m_s2": -9.8},
    {"kind": "tip_force", "x_n": 0.0, "y_n": 0.5},
    {"kind": "tip_mass", "mass_kg": 0.02},
    {"kind": "base_tilt", "angle_rad": 0.1},
    {"kind": "tip_load_friction", "efficiency": 1.0},
]
NUMBERS = [
    (effect, name)
    for effect in EFFECTS
    for name, value in effect.items()
    if isinstance(value, float) or name.endswith("_m")
]
NOMINAL = [
    "youngs_modulus_pa",
    "friction.coefficient",
    "disk.thickness_m",
    "segment.1.length_m",
    "segment.1.clamp_m",
    "segment.2.thickness_m",
    "cable.up.offset_m",
    "cable.down.offset_m.2",
]
LOADS = ["tension.up", "cable_down_n", "tip_x_n", "disk3_y_n", "step.2.cable_up_n"]


def rig(*effects, model="prb3r", **friction):
    plate = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 0.0008}
    return Manipulator.model_validate(
        {
            "name": "rig",
            "youngs_modulus_pa": 1.87e11,
            "model": model,
            "disk": {"thickness_m": 0.004, "mass_kg": 0.05},
            "friction": {"coefficient": 0.3} | friction,
            "segment": [plate, plate],
            "cable": [
                {"name": "up", "offset_m": 0.02, "ends_at_segment": 2},
                {"name": "down", "offset_m": [-0.02, -0.015], "ends_at_segment": 2},
            ],
            "effect": list(effects),
        }
    )


def close(manipulator, path, within=1e-5, steps=STEPS):
    """Whether the derivative is that between two solves."""
    found = parameter_at(manipulator, path)
    table = prb3r.sensitivities(manipulator, steps, [path])
    far = 10 * found.step
    ahead, behind = (solve(with_value(manipulator, found.keys, found.value + s * far), steps) for s in (1, -1))
    for name in ("x_m", "y_m", "angle_rad"):
        difference = (ahead[name] - behind[name]).to_numpy() / (2 * far)
        scale = np.abs(difference).max()
        assert scale > 0
        # solves stop at 1e-11 rad
        assert table[f"d{name}"].to_numpy() == pytest.approx(difference, abs=within * scale + 1e-10 / far)


@pytest.mark.parametrize(("effect", "name"), NUMBERS, ids=[f"{e['kind']} {n}" for e, n in NUMBERS])
def test_every_number_of_every_effect(effect, name):
    hinged = "compliance" in effect["kind"]  # kernels of that shape are compiled for the elastica elsewhere
    beside = [{"kind": "gravity", "y_m_s2": -9.8}] if effect["kind"] == "tip_mass" else []
    close(rig(effect, *beside, model="elastica" if hinged else "prb3r"), f"effect.1.{name}")


@pytest.mark.parametrize("friction", [{}, {"direction": "history"}], ids=["declared", "history"])
@pytest.mark.parametrize(
    ("kind", "name", "far"),
    [("tension_play", "play_n", 1e-4), ("base_compliance", "compliance_rad_per_n_m", 1e-5)],
)
def test_at_the_end_of_what_a_number_can_be_it_is_the_derivative_from_within(kind, name, far, friction):
    """By a one-sided difference of the third order between whole solves."""
    rigs = [rig({"kind": kind, name: k * far}, model="elastica", **friction) for k in range(4)]
    solved, table = [solve(arm, STEPS) for arm in rigs], prb3r.sensitivities(rigs[0], STEPS, [f"effect.1.{name}"])
    for column in ("x_m", "y_m", "angle_rad"):
        none, once, twice, thrice = (states[column].to_numpy() for states in solved)
        difference = (-11 * none + 18 * once - 9 * twice + 2 * thrice) / (6 * far)
        within = 1e-5 * np.abs(difference).max()
        assert within > 0
        assert table[f"d{column}"].to_numpy() == pytest.approx(difference, abs=within)


def law(of, coefficient):
    return {"kind": "empirical_moment", "terms": [{"of": of, "coefficient": coefficient, "plates": [1, 2, 5]}]}


def test_a_moment_law_that_does_not_follow_the_state():
    close(rig(law("position", 0.05)), "effect.1.terms.1.coefficient")


@pytest.mark.parametrize("friction", [{}, {"direction": "history", "presliding_m": 1e-3}], ids=["declared", "history"])
@pytest.mark.parametrize("of", ["bend", "bend_cubed", "tension", "wrap", "direction", "time"])
def test_a_moment_law_that_follows_the_state(of, friction):
    stiffening = {"kind": "empirical_moment", "terms": [{"of": "bend", "coefficient": -1.0}]}
    arm = rig(law(of, 2.0 if of == "bend" else 0.05), stiffening, **friction)
    for path in (
        "effect.1.terms.1.coefficient",
        "friction.coefficient",
        "cable.down.offset_m.2",
        "segment.2.thickness_m",
    ):
        close(arm, path)


def test_a_law_that_is_nothing_changes_by_its_coefficient_all_the_same():
    close(rig(law("bend", 0.0)), "effect.1.terms.1.coefficient")


def test_steps_where_a_law_runs_away_have_no_derivatives():
    table = prb3r.sensitivities(rig(law("bend", 1e3)), STEPS, ["youngs_modulus_pa"])
    assert table["dangle_rad"].isna().all()


@pytest.mark.parametrize("path", NOMINAL)
def test_every_kind_of_nominal_number(path):
    close(rig(), path)


@pytest.mark.parametrize("path", ["youngs_modulus_pa", "friction.coefficient", "friction.presliding_m"])
def test_with_history(path):
    close(rig(direction="history", presliding_m=1e-3), path)


BY_RATE = {"kind": "rate_dependent_friction", "rate": 0.2, "reference_n_per_s": 0.5}
HISTORY = {"direction": "history", "presliding_m": 1e-3}


@pytest.mark.parametrize(
    ("effects", "friction"),
    [((), {}), ((), HISTORY), ((law("wrap", 0.05),), {}), ((law("wrap", 0.05),), HISTORY), ((BY_RATE,), {})],
)
def test_loads_by_their_column(friction, effects):
    manipulator, far = rig(*effects, **friction), 1e-3
    table = prb3r.sensitivities(manipulator, STEPS, LOADS).set_index("parameter")

    def moved(path, by):
        steps = STEPS.copy()
        if path == "tension.up":
            steps["cable_up_n"] *= 1 + by
        elif path == "step.2.cable_up_n":
            steps.loc[1, "cable_up_n"] += by
        else:
            steps[path] = steps.get(path, 0.0) + by
        return solve(manipulator, steps)

    for path in LOADS:
        if path == "cable_down_n":  # idle at first: it can only be pulled
            difference = (moved(path, far)["y_m"] - moved(path, 0.0)["y_m"]) / far
            within = 1e-2
        else:
            difference, within = (moved(path, far)["y_m"] - moved(path, -far)["y_m"]) / (2 * far), 1e-4
        scale = np.abs(difference).max()
        assert table.loc[path, "dy_m"].to_numpy() == pytest.approx(difference.to_numpy(), abs=within * scale + 1e-9)


@pytest.mark.parametrize(
    ("effect", "path"),
    [
        ({"kind": "hysteretic_plate", "slipping_share": 0.0, "yield_per_m": 1.0}, "effect.1.slipping_share"),
        ({"kind": "flag_hysteresis", "reverse_ratio": 1.0}, "effect.1.reverse_ratio"),
    ],
)
def test_at_an_end_that_switches_an_effect_off_no_derivative_is_told(effect, path):
    with pytest.raises(SpecError, match=f"{path}: cannot change smoothly at"):
        prb3r.sensitivities(rig(effect), STEPS, [path])


def test_kilograms_follow_gravity_as_tensions_do():
    steps = pd.DataFrame({"sequence": "a", "step": [1, 2], "cable_up_kg": [2.0, 4.0]})
    manipulator = rig()
    table = prb3r.sensitivities(manipulator, steps, ["gravity_m_s2", "tension.up"])
    by = {name: rows["dy_m"].to_numpy() for name, rows in table.groupby("parameter")}
    assert by["gravity_m_s2"] * manipulator.gravity_m_s2 == pytest.approx(by["tension.up"], rel=1e-7)


def test_the_table_is_tidy():
    steps = pd.concat([STEPS, STEPS.assign(sequence="b", time_s=[20, 22, 29])])
    table = prb3r.sensitivities(rig(), steps, ["youngs_modulus_pa", "tip_x_n"])
    assert list(table.columns) == [
        *("sequence", "step", "disk", "parameter", "dx_m", "dy_m", "dangle_rad", "dcable_up_n", "dcable_down_n")
    ]
    assert len(table) == 2 * 3 * 7 * 2
    assert not table.duplicated(["sequence", "step", "disk", "parameter"]).any()
    base = table["disk"] == 0
    assert (table.loc[base, ["dx_m", "dy_m", "dangle_rad"]] == 0).all(axis=None)
    assert table.loc[base, "dcable_up_n"].isna().all()
    assert table.loc[~base, "dcable_up_n"].notna().all()
    first, second = (table[table["sequence"] == name].drop(columns="sequence") for name in "ab")
    assert (first.to_numpy() == second.to_numpy())[:, 3:6].all()


def test_all_names_that_lead_nowhere_are_said_at_once():
    wrong = {
        "youngs_modulus": "did you mean 'youngs_modulus_pa'",
        "segment.3.length_m": "'3' is not a number from 1 to 2",
        "segment.1.plates": "not a number that can change smoothly",
        "segment.1.bending_stiffness_n_m2": "not given",
        "cable.left.offset_m": "there is no cable 'left'",
        "cable.down.offset_m": "not a number that can change smoothly",
        "tension.left": "there is no cable 'left'",
        "step.2.cable_left_n": "steps have no column",
        "step.9.cable_up_n": "there is no such step",
        "effect.1.scale": "camera_scale changes what is read",
        "disk.thickness_m.x": "leads into a plain value",
    }
    with pytest.raises(SpecError) as error:
        prb3r.sensitivities(rig({"kind": "camera_scale", "scale": 1.0}), STEPS, wrong)
    assert len(error.value.problems) == len(wrong)
    for path, what in wrong.items():
        assert any(path in str(problem) and what in str(problem) for problem in error.value.problems), path
    with pytest.raises(SpecError, match="there is no such step"):
        prb3r.sensitivities(rig(), STEPS.assign(step=[1, 2.5, 3]), ["step.2.cable_up_n"])
    with pytest.raises(SpecError, match="none are given"):
        prb3r.sensitivities(rig(), STEPS, [])


@pytest.mark.parametrize("path", ["tension.up", "cable_up_n", "step.2.cable_up_n"])
def test_of_what_is_pulled_static_friction_counts_the_travel(path):
    """Against solves of tables with other tensions, in which cables slip farther."""
    arm = rig({"kind": "breakaway_friction", "excess": 0.8, "decay_n": 10.0})
    table = prb3r.sensitivities(arm, STEPS, [path])

    def pulled(change):
        tension = STEPS["cable_up_n"].to_numpy()
        if path == "tension.up":
            tension = tension * (1 + change)
        else:
            tension = tension + change * ((STEPS["step"] == 2) | (path == "cable_up_n"))
        return solve(arm, STEPS.assign(cable_up_n=tension))["y_m"].to_numpy()

    difference = (pulled(1e-4) - pulled(-1e-4)) / 2e-4
    assert table["dy_m"].to_numpy() == pytest.approx(difference, abs=1e-5 * np.abs(difference).max())


def test_names_of_cables_may_hold_dots():
    """Paths lead to the same numbers as to those of a cable with a plain name; of several names the longest counts."""
    plain, dotted = rig(), rig().replace("cable.up.name", "up.1")
    steps = STEPS.rename(columns={"cable_up_n": "cable_up.1_n", "slip_up": "slip_up.1"})
    paths = ["cable.{}.offset_m", "tension.{}", "step.2.cable_{}_n"]
    tables = (
        prb3r.sensitivities(arm, table, [path.format(name) for path in paths])[["dx_m", "dy_m", "dangle_rad"]]
        for arm, table, name in ((plain, STEPS, "up"), (dotted, steps, "up.1"))
    )
    assert next(tables).equals(next(tables))
    both = dotted.replace("cable.down.name", "up").replace("cable.up.1.offset_m", 0.03)
    assert [cable.offset_m for cable in both.cable] == [0.03, [-0.02, -0.015]]
    assert both.replace("cable.up.offset_m.1", -0.01).cable[1].offset_m == [-0.01, -0.015]
    with pytest.raises(SpecError, match=r"there is no cable 'up'; did you mean 'up\.1'"):
        dotted.replace("cable.up.2.offset_m", 0.03)
