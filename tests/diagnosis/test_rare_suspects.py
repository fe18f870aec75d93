"""Effects that few rigs have are named where the rig has them, in size and place, without a rival."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from diagnosis.simulated import Case, E, diagnosed, manipulator, recorded, steps_of
from diagnosis.suspected import SAG

from prb3r import predict
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.proof.rig.simulate import simulate


def case(friction=0.3, **effect):
    return Case(hidden=(tuple(effect.items()),), friction=friction, seed=1)


def timed(friction=0.3, **effect):
    return Case(hidden=(tuple(effect.items()),), friction=friction, seed=1, timed=True)


@pytest.mark.long
def test_times_alone_are_no_reason_to_name_friction_by_rates():
    plain, with_times = (diagnosed(Case(hidden=(), seed=1, timed=told)) for told in (False, True))
    assert (with_times.verdict, with_times.effects) == ("adequate", ())
    told, untold = with_times.calibrated.constants, plain.calibrated.constants
    assert told.log_friction == pytest.approx(untold.log_friction, abs=1e-4)
    assert told.log_stiffness == pytest.approx(untold.log_stiffness, abs=1e-4)


WIDTH = {"wrap_saturation": 0.8, "load_dependent_friction": 0.41, "friction_drift": 0.5, "base_tilt": 0.6}
WIDTH |= {"hole_drag": 0.5, "plate_relaxation": 1.6}
"""Of intervals, in sizes.  What saturates is told from a smaller coefficient by how turns differ alone; of what goes
with the load, other forces at which it has the stated coefficients survive, with exponents of their own; what grows is
the share of a coefficient that is estimated too, beside which a drag is found; 6 N bend the arm little; sequences of
four steps tell little of a time constant of four."""


QUICK = (case(0.6, kind="load_dependent_friction", exponent=0.6, tension_n=95.0), {})
OTHERS = [
    (case(kind="tension_drift", offset_n_per_step=0.5, cables=("1",)), {"cables": ("1",)}),
    (replace(case(kind="payload_scale", scale=2.0), program="hung"), {}),
    (timed(0.6, kind="rate_dependent_friction", rate=0.08, reference_n_per_s=0.0629), {}),
    (case(kind="stiffness_gradient", tip_to_base=0.6), {}),
    (case(kind="umbilical", stiffness_n_m_per_rad=1.5), {}),
    (case(kind="base_compliance", compliance_rad_per_n_m=0.03), {}),
    (case(kind="base_compliance", compliance_rad_per_n_m=0.08), {}),
    (case(0.6, kind="load_dependent_friction", exponent=-0.8, tension_n=95.0), {}),
    (timed(0.6, kind="rate_dependent_friction", rate=-0.06, reference_n_per_s=0.0629), {}),
    (case(0.6, kind="wrap_saturation", saturation_per_rad=8.0), {}),
    (case(0.6, kind="hole_drag", drag_n=0.5), {}),
    (case(kind="precurvature_gradient", change_per_m=1.0), {}),
    (case(kind="plate_softening", share_per_step=0.008), {}),
    (case(kind="plate_relaxation", share=0.2, steps=4.0), {}),
    (timed(kind="plate_relaxation", share=0.2, steps=15.0, step_s=20.0), {"step_s": 20.0}),
    (case(0.6, kind="friction_drift", share_per_step=0.03), {}),
    (case(0.6, kind="friction_drift", share_per_step=-0.02), {}),
    (case(kind="load_cell", quadratic_per_n=0.002), {}),
    (case(kind="tension_play", play_n=2.5), {}),
    (case(kind="hanger", weight_n=3.0), {}),
    (case(kind="camera_aspect", y_over_x=1.03), {}),
    (replace(case(kind="base_tilt", angle_rad=-0.06), program="hung"), {}),
]


@pytest.mark.parametrize(
    ("hidden", "place"),
    [QUICK, *(pytest.param(*other, marks=pytest.mark.long) for other in OTHERS)],
    ids=lambda value: dict(value.hidden[0])["kind"] if isinstance(value, Case) else "",
)
def test_what_few_rigs_have_is_named_with_its_place_and_size(hidden, place):
    found = diagnosed(hidden)
    true = dict(hidden.hidden[0])
    assert found.verdict == "explained"
    (effect,) = found.effects
    assert (effect.kind, not effect.rivals) == (true["kind"], True)
    assert place.items() <= dict(effect.place).items()
    assert effect.parameters
    for name, size in effect.parameters.items():
        assert size.low < true[name] < size.high
        assert size.high - size.low < WIDTH.get(effect.kind, 0.4) * abs(true[name])


@pytest.mark.long
def test_creep_that_was_found_in_seconds_predicts_steps_of_another_pace():
    """The recorded steps last from a second to an hour, these ones ten minutes each: plates creep on in between."""
    creep = {"kind": "plate_relaxation", "share": 0.2, "steps": 15.0, "step_s": 20.0}
    found = diagnosed(timed(**creep))
    steps = [row | {"time_s": 600.0 * k} for k, row in enumerate(steps_of("counter"))]
    true = simulate(manipulator(E * 1.05, 0.27, [creep]), steps)
    plain = simulate(manipulator(E * 1.05, 0.27, [creep]), [row | {"time_s": row["time_s"] / 100} for row in steps])
    off = predict(found, manipulator(), pd.DataFrame(steps), draws=40).positions["y_m"].to_numpy() - true.y.ravel()
    assert np.abs(off).max() < 6e-4  # twice the noise
    assert np.abs(plain.y - true.y).max() > 3e-3
    said = "loads have no time_s here: plates creep as if each step took a recorded one"
    assert said in predict(found, manipulator(), pd.DataFrame(steps).drop(columns="time_s"), draws=40).remarks


@pytest.mark.long
def test_the_gain_of_all_load_cells_is_told_against_known_weights_beside_what_looks_alike():
    """Tensions that are a tenth larger than noted, on an arm a tenth stiffer, are weights of 1 / 1.1 times theirs."""
    found = diagnosed(replace(case(kind="load_cell", gain=1.1), program="hung"))
    (effect,) = found.effects
    (cell,) = (one for one in (effect, *effect.rivals) if one.kind == "load_cell")
    assert {effect.kind, *(rival.kind for rival in effect.rivals)} & {"tip_load_friction", "weight_friction"}
    gain = dict(cell.parameters)["gain"]
    assert getattr(gain, "value", gain) == pytest.approx(1.1, abs=0.02)


@pytest.mark.long
def test_a_heavier_tip_is_likelier_than_a_force_that_nobody_applied_where_the_arm_is_known_to_sag():
    """Constant forces at one point: one position of the arm cannot tell them apart, but few rigs have such a force."""
    found = diagnosed(replace(case(kind="tip_mass", mass_kg=0.15), known=(tuple(SAG.items()),)))
    (effect,) = found.effects
    (rival,) = effect.rivals
    assert (found.verdict, effect.kind, rival.kind) == ("ambiguous", "tip_mass", "tip_force")
    assert effect.parameters["mass_kg"].low < 0.15 < effect.parameters["mass_kg"].high
    assert rival.place == {"x_n": 0.0}  # along gravity alone, as a mass pulls
    assert rival.behind > 0


@pytest.mark.parametrize(
    ("seed", "friction", "excess", "decay"),
    [
        (2, 0.6, 0.5, 15.0),
        pytest.param(3, 0.6, 0.3, 30.0, marks=pytest.mark.long),
        pytest.param(1, 0.3, 0.8, 25.0, marks=pytest.mark.long),
    ],
)
def test_static_friction_is_named_with_its_size_where_cables_turn_back(seed, friction, excess, decay):
    sticks = (("kind", "breakaway_friction"), ("excess", excess), ("decay_n", decay))
    found = diagnosed(Case(hidden=(sticks,), friction=friction, seed=seed, program="reversing"))
    assert found.verdict == "explained"
    (effect,) = found.effects
    assert (effect.kind, effect.rivals) == ("breakaway_friction", ())
    size, over = effect.parameters["excess"], effect.parameters["decay_n"]
    assert size.low < excess < size.high
    assert over.low < decay < over.high
    assert size.high - size.low < 0.5


@pytest.mark.parametrize("friction", [0.3, pytest.param(0.6, marks=pytest.mark.long)])
def test_cables_that_turn_back_alone_are_no_reason_to_name_static_friction(friction):
    found = diagnosed(Case(hidden=(), friction=friction, seed=1, program="reversing"))
    assert (found.verdict, found.effects) == ("adequate", ())


@pytest.mark.long
def test_cables_that_hardly_turn_back_leave_static_friction_ambiguous():
    """Nothing slips by less than 30 N: a load cell that is not linear reads nearly the same, and this is said."""
    sticks = (("kind", "breakaway_friction"), ("excess", 0.6), ("decay_n", 30.0))
    found = diagnosed(Case(hidden=(sticks,), friction=0.6, seed=1))
    assert found.verdict == "ambiguous"
    (effect,) = found.effects
    assert {effect.kind, *(rival.kind for rival in effect.rivals)} >= {"breakaway_friction", "load_cell"}


@pytest.mark.long
def test_a_camera_that_moves_steadily_is_named_with_its_speed():
    """By a tenth of a millimetre a step, and by as much turning as moves the tip by about that."""
    true = {"x_m_per_step": -1e-4, "y_m_per_step": 0.0, "angle_rad_per_step": 3e-4}
    found = diagnosed(case(kind="camera_drift", **true))
    assert found.verdict == "explained"
    (effect,) = found.effects
    assert (effect.kind, effect.rivals) == ("camera_drift", ())
    for name, size in effect.parameters.items():
        assert size.low < true[name] < size.high
        assert size.high - size.low < (4e-4 if name.startswith("angle") else 5e-5)


@pytest.mark.long
def test_of_a_camera_that_moves_angles_alone_show_the_turn():
    turning = (("kind", "camera_drift"), ("x_m_per_step", 1e-3), ("angle_rad_per_step", 1e-3))
    found = diagnosed(Case(hidden=(turning,), read=("angle_rad",), seed=1))
    (effect,) = found.effects
    assert (found.verdict, effect.kind, list(effect.parameters)) == (
        "explained",
        "camera_drift",
        ["angle_rad_per_step"],
    )
    size = effect.parameters["angle_rad_per_step"]
    assert size.low < 1e-3 < size.high
    assert size.high - size.low < 6e-4
    assert "camera_drift" not in suspected(recorded(Case(hidden=(), read=("bend_rad",))))


def test_a_camera_that_stands_is_not_named():
    found = diagnosed(Case(hidden=(), seed=1))
    assert (found.verdict, found.effects) == ("adequate", ())


def suspected(recording):
    predict = predictor(recording)
    scope = Scope.of(recording, predict.chain, predict.equilibria(Constants()))
    return {hypothesis.kind for hypothesis in hypotheses(scope)}


def test_play_is_suspected_of_cables_that_are_let_go(rubbing):
    places = lambda known: [dict(each.place) for each in hypotheses(known) if each.kind == "tension_play"]  # noqa: E731
    recording = rubbing.recording
    assert places(rubbing)[0] == {}
    step = np.arange(recording.loads.steps)
    number = step - np.maximum.accumulate(np.where(recording.begins, step, 0))  # in its sequence
    grows = recording.loads._replace(tension=10.0 * number[:, None] * np.ones(4))
    assert not places(rubbing._replace(recording=replace(recording, loads=grows)))
    for fall, is_suspected in ((2.0, True), (0.9, False)):  # in all, of 10, by at most 1 in a step
        slowly = np.where(number > 0, 10.0 - fall * (number - 1) / number.max(), 0.0)
        slow = recording.loads._replace(tension=np.stack([0.0 * step, slowly, 0.0 * step, 0.0 * step], 1))
        found = places(rubbing._replace(recording=replace(recording, loads=slow)))
        assert ({"cables": ("2",)} in found) == is_suspected
    number[recording.begins.argmax() + 2] = 0
    one = recording.loads._replace(tension=np.stack([0.0 * step, 0.0 * step, 10.0 * number, 0.0 * step], 1))
    assert {"cables": ("3",)} in places(rubbing._replace(recording=replace(recording, loads=one)))


def test_drift_is_suspected_where_time_does_not_go_with_the_load_alone():
    whole = recorded(Case(hidden=()))
    drifts = {"tension_drift", "plate_softening", "camera_drift", "friction_drift"}
    assert drifts <= suspected(whole.only([0, 2, 4]))
    assert drifts.isdisjoint(suspected(whole.only([0, 4])))
    smooth = replace(whole, manipulator=whole.manipulator.replace("friction.coefficient", 0.0))
    assert drifts <= suspected(smooth)  # cables may be found to rub
    along = replace(whole, manipulator=whole.manipulator.replace("friction.direction", "history"))
    assert "friction_drift" not in suspected(along)


def test_drift_is_counted_from_the_first_step_of_the_recording():
    """Of five sequences of four steps the third and the last begin after eight and sixteen steps."""
    part = recorded(Case(hidden=())).only([2, 4])
    assert part.loads.elapsed[:, 0] == pytest.approx([8, 9, 10, 11, 16, 17, 18, 19])
    predict = predictor(part)
    assert Scope.of(part, predict.chain, predict.equilibria(Constants())).elapsed == 19
    assert np.all(part.begins == [True, False, False, False] * 2)
