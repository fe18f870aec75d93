"""A law outside the library: its odds are those of Gaussian models, small where effects are true, and large where one
law is imitated by several effects."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from scipy.special import logit, logsumexp
from scipy.stats import multivariate_normal

from prb3r.diagnosis.fit.basis import basis_of, projected_out
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.search.columns import linear_model
from prb3r.diagnosis.search.unknown_law import OF_TENSIONS, STAYING, law_fields, unknown_law
from prb3r.model.steps import with_tensions

OFFSETS = tuple(f"tension_offset (cables {cable})" for cable in (1, 2, 3, 4))
SEVERAL = (*OFFSETS, "load_cell", "pulley_friction (cables 1)")
LOG_ODDS = -4.0
"""Prior log odds of each effect at its place: of one rig in ten, shared by half a dozen places."""
STRONG = np.log(20)


@pytest.fixture(scope="module")
def constants():
    """The constants of a rig of which the file says all."""
    return fit_constants(predictor(recorded(Case(hidden=()))))


def with_effects(constants, names, readings=None):
    """The fit of the effects `names` beside the constants, to other `readings` of the same steps if given."""
    predict = constants.model.predict
    library = hypotheses(Scope.of(predict.recording, predict.chain, constants.solved.states))
    model = constants.model.adding(*(next(each for each in library if each.name == name) for name in names))
    if readings is not None:
        model = replace(model, predict=predictor(predict.recording.with_values(readings)))
    friction = constants.model.friction(constants.p)
    return fit(model, np.concatenate([constants.p, *(each.starts(friction)[0] for each in model.hypotheses)]))


def law_of(fitted):
    return unknown_law(fitted, dict.fromkeys(fitted.model.hypotheses, LOG_ODDS))


def under_tensions(constants, tension, seed):
    """Readings with noise as stated, where cables pull by other tensions (s, m) than those that are noted."""
    recording = constants.model.predict.recording
    return read(constants, with_tensions(recording.loads, tension, recording.begins), seed)


def read(constants, loads, seed):
    """Readings with noise as stated under other loads than those that are noted."""
    predict = constants.model.predict
    exact = predict(constants.constants, (), loads)
    return exact + reading_sd(predict.recording) * np.random.default_rng(seed).standard_normal(len(exact))


def test_odds_are_those_of_gaussian_models(constants):
    """Sets of effects, fields and sizes summed; each set with each field is a normal distribution of the readings."""
    fitted = with_effects(constants, ("hole_clearance", "weakened_plate (plate 4)"))
    odds = dict(zip(fitted.model.hypotheses, (-2.0, -5.0), strict=True))
    linear, _ = linear_model(fitted, (), odds)
    settings, count = fitted.model.settings, len(linear.target)
    basis = basis_of(fitted.jacobian[:count, : len(fitted.model.varied)])
    fields = [projected_out(white, basis) for _, white in law_fields(fitted)]
    sets = [part for size in range(3) for part in combinations(range(2), size)]

    def summed(noise):
        worth = []
        for part in sets:
            moved = np.hstack([np.zeros((count, 0)), *(linear.columns[k].moved for k in part)])
            known = sum(linear.columns[k].log_odds for k in part)
            worth.append(multivariate_normal(cov=noise + moved @ moved.T).logpdf(linear.target) + known)
        return logsumexp(worth)

    scatter = [size**2 * field @ field.T for field in fields for size in settings.moment_sizes]
    with_law = logsumexp([summed(np.eye(count) + part) for part in scatter]) - np.log(len(scatter))
    expected = with_law + logit(settings.rare_presence) - summed(np.eye(count))
    assert len(fields) == 5
    assert unknown_law(fitted, odds).log_odds == pytest.approx(expected, abs=1e-6)


@pytest.mark.long
def test_true_effects_of_any_size_stand(constants):
    """Of six true effects with sizes as their priors have them, an unknown law hardly ever takes the place.

    In the linearised model they are doubted in one recording of twenty at most, at odds of twenty: Markov's inequality
    for a ratio of likelihoods.
    """
    fitted = with_effects(constants, SEVERAL)
    first, count = len(fitted.model.varied), fitted.model.predict.recording.readings.count
    rng, found = np.random.default_rng(0), []
    for _ in range(60):
        p, residual = fitted.p.copy(), np.zeros(len(fitted.residual))
        p[first:] = rng.standard_normal(len(p) - first) * fitted.model.deviations[first:]
        residual[:count] = rng.standard_normal(count)
        residual -= fitted.basis @ (fitted.basis.T @ residual)
        found.append(law_of(replace(fitted, p=p, residual=residual)).log_odds)
    assert np.mean(np.array(found) > STRONG) <= 1 / 20
    assert np.median(found) < 0


@pytest.mark.parametrize("seed", range(3))
def test_a_law_of_tensions_takes_the_place_of_effects_that_imitate_it(constants, seed):
    tension = constants.model.predict.recording.loads.tension
    wavy = tension * (1 + 0.05 * np.sin(2 * np.pi * tension / tension.max()))
    law = law_of(with_effects(constants, SEVERAL, under_tensions(constants, wavy, seed)))
    assert law.log_odds > STRONG
    assert law.field == OF_TENSIONS
    assert {hypothesis.name for hypothesis in law.instead_of} > set(OFFSETS[:2])


@pytest.mark.parametrize("seed", range(3))
def test_a_set_of_one_plate_takes_the_place_of_drifts_and_offsets(constants, seed):
    """From some step on a plate is bent, as if a tenth of the largest moment of the cables acted on it."""
    loads = constants.model.predict.recording.loads
    moment = loads.moment.copy()
    moment[9:, 3] += 0.1 * 95.0 * 0.0255
    law = law_of(
        with_effects(constants, (*OFFSETS, "tension_drift"), read(constants, loads._replace(moment=moment), seed))
    )
    assert law.log_odds > STRONG
    assert law.field == STAYING


@pytest.mark.parametrize("seed", range(3))
def test_one_true_effect_is_not_doubted_for_noise(constants, seed):
    weak = recorded(Case(seed=seed)).readings.value
    law = law_of(with_effects(constants, ("weakened_plate (plate 4)",), weak))
    assert law.log_odds < 0
    assert not law.instead_of
