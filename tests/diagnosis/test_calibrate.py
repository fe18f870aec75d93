"""Calibration: what was put in comes out, derivatives are derivatives, priors pull as they should."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from scipy.optimize import least_squares

from prb3r.diagnosis.evidence.model_evidence import left_out_deviance
from prb3r.diagnosis.fit.calibrate import as_drawn, constants_as_drawn, fit_constants, nominal_noise
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.least_squares import fit, polished
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.recording.recording import Kind, Prior

TRUE = Constants(0.05, -0.1, 0.004, 0.001, -0.0005)


def exact(constants=TRUE):
    """A recording whose readings are what the model itself predicts, without noise."""
    recording = recorded(Case(hidden=()))
    predict = predictor(recording)
    recording = recording.with_values(predict(constants))
    predict = predictor(recording)
    return predict, nominal_noise(predict)


def test_constants_that_made_the_readings_are_found_from_the_nominal_ones():
    predict, noise = exact()
    flat = replace(
        predict.recording,
        prior=Prior(),
        measurement=predict.recording.measurement.model_copy(
            update={"frame_rotation_sd_rad": 10.0, "frame_position_sd_m": 10.0}
        ),
    )
    found = fit_constants(replace(predict, recording=flat), noise)
    assert found.constants == pytest.approx(TRUE, abs=1e-5)
    assert found.chi2 < 1e-3


def test_a_narrow_prior_holds_the_nominal_value():
    predict, noise = exact()
    narrow = replace(predict.recording, prior=Prior(youngs_modulus=1e-6))
    found = fit_constants(replace(predict, recording=narrow), noise)
    assert abs(found.constants.log_stiffness) < 1e-4


def test_refitted_as_drawn_the_constants_of_a_wrong_model_predict_as_well_as_any():
    """Where tensions may scatter by a tenth, what a lossy pulley takes is left to them, and constants miss twice as
    much as they need to."""
    recording = recorded(Case(hidden=((("kind", "pulley_friction"), ("efficiency", 0.8)),), seed=1))
    measurement = recording.measurement.model_copy(update={"tension_sd_relative": 0.1})
    calibrated = fit_constants(predictor(replace(recording, measurement=measurement)))
    predict, sd = calibrated.model.predict, calibrated.model.noise.total_sd

    def missed(constants):
        return predict.misfit(predict(Constants(*constants))) / sd

    refitted = constants_as_drawn(calibrated).constants
    best = least_squares(missed, np.zeros(len(refitted)), x_scale=0.01, diff_step=1e-4)
    ways = refitted, as_drawn(calibrated).constants, best.x, calibrated.constants
    left = [float(np.mean(missed(each) ** 2)) for each in ways]
    assert left[:2] == pytest.approx([left[2]] * 2, rel=0.01)
    assert left[0] < 0.5 * left[3]


def test_angles_are_compared_modulo_a_turn():
    predict, _ = exact()
    turned = predict.recording.readings.kind == Kind.ANGLE
    value = predict.recording.readings.value + 2 * np.pi * turned
    again = predictor(predict.recording.with_values(value))
    assert again.misfit(predict(TRUE)) == pytest.approx(np.zeros(len(value)), abs=1e-12)


def test_the_jacobian_is_the_derivative_of_the_residuals():
    predict, noise = exact()
    library = hypotheses(Scope.of(predict.recording, predict.chain, predict.equilibria(Constants())))
    chosen = [each for each in library if each.name in ("weakened_plate (plate 2)", "camera_scale", "gravity")]
    model = Model(predict, noise, tuple(chosen))
    p = np.random.default_rng(3).normal(0, 0.01, model.count)
    jacobian = model.jacobian(p, model.solve(p))
    for k in range(model.count):
        ends = []
        for sign in (-1, 1):
            moved = p.copy()
            moved[k] += sign * 1e-4
            ends.append(model.residuals(moved, model.solve(moved)))
        assert jacobian[:, k] == pytest.approx(
            (ends[1] - ends[0]) / 2e-4, rel=1e-6, abs=1e-6 * np.abs(jacobian[:, k]).max()
        )


def test_a_start_without_equilibrium_is_no_wall():
    """At a fiftieth of the stiffness hardly a step is in balance; the fit ends where the others end."""
    predict, noise = exact()
    start = np.zeros(5)
    start[0] = -3.9
    model = Model(predict, noise)
    lost = predict.lost(model.solve(start))
    assert lost is not None
    assert np.isfinite(lost.readings).all()
    found = fit(model, start)
    assert found.balanced
    assert found.p == pytest.approx(fit(model, np.zeros(5)).p, abs=1e-4)


def test_a_step_counts_dearer_the_less_of_it_is_followed():
    """The cost falls all the way from a fiftieth of the stiffness to where all steps are in balance."""
    predict, noise = exact()
    model, chi2 = Model(predict, noise), []
    for log_stiffness in np.linspace(-3.9, 0.0, 14):
        p = np.array([log_stiffness, 0, 0, 0, 0])
        residual = model.residuals(p, model.solve(p))
        chi2.append(residual @ residual)
    assert (np.diff(chi2) < 0).mean() > 0.8


def test_a_fit_ends_where_an_independent_minimiser_ends():
    """From a start far off, with an effect: `scipy.optimize.least_squares` on the same residuals."""
    recording = recorded(Case())
    predict = predictor(recording)
    library = hypotheses(Scope.of(recording, predict.chain, predict.equilibria(Constants())))
    weak = next(each for each in library if each.name == "weakened_plate (plate 4)")
    model = Model(predict, nominal_noise(predict), (weak,))
    start = np.array([0.3, 0.5, 0, 0, 0, 0.4])
    found = fit(model, start, least_promise=model.settings.small_gain)
    other = least_squares(
        lambda p: model.residuals(p, model.solve(p)), start, x_scale=[0.1, 0.1, 1e-2, 1e-2, 1e-2, 0.1]
    )
    assert found.chi2 == pytest.approx(2 * other.cost, abs=1e-3)
    sd = np.sqrt(np.diag(found.covariance))
    assert np.abs((found.p - other.x) / sd).max() < 0.01
    assert found.jacobian == pytest.approx(model.jacobian(found.p, found.solved), rel=1e-9)
    assert found.converged


def test_a_fit_ends_where_nothing_that_counts_is_promised_and_one_that_is_told_at_the_minimum():
    recording = recorded(Case())
    predict = predictor(recording)
    model = Model(predict, nominal_noise(predict))
    start, settings = np.array([0.3, 0.5, 0.0, 0.0, 0.0]), model.settings

    def promised(fitted):
        """Fall of chi-square by a Gauss-Newton step."""
        step = np.linalg.lstsq(fitted.jacobian, -fitted.residual, rcond=None)[0]
        return fitted.chi2 - float(np.square(fitted.residual + fitted.jacobian @ step).sum())

    rough, usual = fit(model, start, least_promise=1e3), fit(model, start)
    assert rough.converged
    assert usual.converged
    assert settings.idle_gain < promised(rough) < 1.1e3
    assert promised(usual) < settings.idle_gain + settings.small_share * usual.chi2
    told = polished(rough)
    assert told.converged
    assert promised(told) < settings.small_gain + settings.small_share * told.chi2


def test_a_fit_that_comes_nowhere_near_what_is_useful_is_given_up():
    recording = recorded(Case())
    predict = predictor(recording)
    model = Model(predict, nominal_noise(predict))
    assert fit(model, np.array([1.0, 1.0, 0, 0, 0]), give_up_above=0.0) is None
    assert fit(model, np.array([1.0, 1.0, 0, 0, 0]), give_up_above=1e9) is not None


def test_leaving_a_sequence_out_in_closed_form_is_refitting_without_it():
    recording = recorded(Case(hidden=()))
    predict = predictor(recording)
    noise = nominal_noise(predict)
    closed = left_out_deviance(fit_constants(predict, noise))
    for k in range(len(recording.sequences)):
        rest = recording.only(set(range(len(recording.sequences))) - {k})
        part = predictor(rest)
        without = fit_constants(part)
        own = recording.of_sequence[recording.readings.step] == k
        error = noise.whiten(predict.misfit(predict(without.constants)))[own]
        whole = Model(predict, noise)
        columns = whole.jacobian(without.p, whole.solve(without.p))[: len(own)][own]
        scatter = np.eye(len(error)) + columns @ without.covariance @ columns.T
        deviance = error @ np.linalg.solve(scatter, error) + np.linalg.slogdet(scatter)[1]
        assert closed[k] == pytest.approx(deviance, rel=0.01)
