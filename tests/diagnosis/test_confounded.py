"""Effects that a recording hardly tells from Young's modulus stay possible, and widen what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, E, diagnosed, investigated, recorded

from prb3r.diagnosis.evidence.linearised import moved_readings, probes_of
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.named import is_felt
from prb3r.diagnosis.search.columns import linear_model
from prb3r.diagnosis.search.confounded import confounded, widening

PULLEYS = (("kind", "pulley_friction"), ("efficiency", 0.9))
CLAMPS = (("kind", "clamp_compliance"), ("compliance_rad_per_n_m", 0.004))


@pytest.fixture(scope="module")
def constants():
    """The constants alone, fitted to a rig without effects, and the library of its recording."""
    recording = recorded(Case(hidden=()))
    fitted = fit_constants(predictor(recording))
    return fitted, hypotheses(Scope.of(recording, fitted.model.predict.chain, fitted.solved.states))


def test_an_effect_widens_the_modulus_as_a_fit_beside_it_does(constants):
    """The inverse of the normal matrix with one column more, its prior included (Golub and Van Loan, Matrix
    Computations, 2.1.4)."""
    fitted, library = constants
    soft = next(each for each in library if each.kind == "clamp_compliance")
    ((_, _), *_) = probes = probes_of(fitted, [soft])
    change = moved_readings(fitted, probes)[0] * soft.deviations
    column = np.vstack([fitted.model.noise.whiten(change), np.zeros((len(fitted.p), 1))])
    jacobian = fitted.jacobian[: len(column)]
    whole = np.block([[jacobian, column], [np.zeros((1, len(fitted.p))), np.ones((1, 1))]])
    beside = np.linalg.inv(whole.T @ whole)
    added = np.sqrt(np.diag(beside)[:-1] - np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    np.testing.assert_allclose(widening(fitted, fitted.model.noise.whiten(change)), added, rtol=1e-6)


def test_soft_parts_are_confounded_with_the_modulus_and_a_dead_cable_is_not(constants):
    fitted, library = constants
    kinds = {hypothesis.kind for hypothesis in confounded(fitted, library)}
    assert "clamp_compliance" in kinds
    assert not kinds & {"dead_cable", "camera_scale", "lens_distortion"}


@pytest.mark.long
def test_soft_clamps_that_are_not_named_are_in_the_interval_of_the_modulus():
    """They take a twelfth of the stiffness, as a lower modulus would, and nothing tells which."""
    found = diagnosed(Case(hidden=(PULLEYS, CLAMPS), seed=2))
    assert (found.verdict, [effect.kind for effect in found.effects]) == ("explained", ["pulley_friction"])
    modulus = found.constants["youngs_modulus_pa"].estimate
    assert modulus.value == pytest.approx(0.92 * E, rel=0.01)
    assert modulus.high > 0.96 * E
    assert any(effect.kind == "clamp_compliance" for model in found.posterior.models for effect in model.effects)


def test_an_effect_that_no_reading_can_feel_stands_in_no_set():
    """Gravity of which rigs have a millionth of the usual at most."""
    fitted = fit_constants(predictor(recorded(Case(hidden=()))))
    library = hypotheses(Scope.of(fitted.recording, fitted.model.predict.chain, fitted.solved.states))
    weight = next(each for each in library if each.kind == "gravity")
    feather = replace(weight, free=tuple(free._replace(sd=1e-6 * free.prior_sd) for free in weight.free))
    sets = [linear_model(fitted, [each], {each: 0.0})[0].columns for each in (weight, feather)]
    assert [len(columns) > 0 for columns in sets] == [True, False]


def test_an_effect_is_felt_where_it_moves_a_reading_by_more_than_its_noise():
    fitted = investigated().explained  # a weak plate
    assert is_felt(fitted, 0)
    nearly_whole = fitted.p.copy()
    nearly_whole[-1] *= 1e-4
    solved = fitted.model.solve(nearly_whole)
    assert not is_felt(replace(fitted, p=nearly_whole, solved=solved), 0)
