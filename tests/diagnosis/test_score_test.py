"""Score tests: standard normal where nothing is missing, the threshold kept, directions free of calibration."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from scipy.stats import halfnorm, kstest

from prb3r.diagnosis.evidence.detectable import detectable
from prb3r.diagnosis.evidence.outliers import surprise
from prb3r.diagnosis.evidence.score_test import alternatives, alternatives_of, largest_by_chance, scores
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Kind


@pytest.fixture(scope="module")
def tested():
    recording = recorded(Case(hidden=()))
    predict = predictor(recording)
    fitted = fit_constants(predict)
    return fitted, alternatives(fitted, hypotheses(Scope.of(recording, predict.chain, fitted.solved.states)))


def drawn(fitted, count):
    """Residuals of right models after calibration."""
    free = np.random.default_rng(5).standard_normal((len(fitted.residual), count))
    return free - fitted.basis @ (fitted.basis.T @ free)


def test_directions_are_free_of_what_calibration_can_do(tested):
    fitted, found = tested
    for each in found:
        assert np.abs(fitted.jacobian.T @ each.basis).max(initial=0.0) < 1e-5 * np.abs(fitted.jacobian).max()


def test_scores_of_right_models_are_standard_normal(tested):
    fitted, found = tested
    residual = drawn(fitted, 2000)
    continuous = [each for each in found if each.freedom == 1 and not each.one_sided][::5]
    for each in continuous:
        assert kstest(each.z(residual), halfnorm.cdf).pvalue > 1e-3


def test_the_largest_score_passes_its_threshold_in_one_right_model_of_a_hundred(tested):
    fitted, found = tested
    by_chance = largest_by_chance(found, 1, Settings())
    threshold, naming = np.quantile(by_chance, [1 - Settings().alarm_rate, 1 - Settings().naming_rate])
    assert naming > threshold
    residual = drawn(fitted, 4000)
    largest = np.max([each.z(residual) for each in found], axis=0)
    alarms = np.mean(largest > threshold)
    assert 0.3 * Settings().alarm_rate < alarms < 2.5 * Settings().alarm_rate
    assert np.mean(largest > 1.96) > 0.3  # what looking at each score alone would do
    assert scores(fitted, found, seed=1).threshold == threshold
    one_by_one = replace(fitted, model=replace(fitted.model, settings=Settings(tested_alone=True)))
    assert scores(one_by_one, found, seed=1).threshold == pytest.approx(2.576, abs=1e-3)


def test_an_effect_of_the_size_that_is_called_detectable_shows(tested):
    fitted, found = tested
    one = next(each for each in found if each.subject.name == "weakened_plate (plate 2)")
    predict = fitted.model.predict
    u = 5.2 / one.size
    there = predict(fitted.constants, [one.subject.effect(np.array([u]), 0.3)])
    shift = np.zeros(len(fitted.residual))
    shift[: len(there)] = fitted.model.noise.whiten(there - fitted.solved.readings)
    assert one.z(shift) == pytest.approx(5.2, rel=0.1)


def test_an_efficiency_of_one_is_detectable_by_what_it_falls():
    free = Free("efficiency", 1.0, 0.2, 1.0, log=True)
    loss = SimpleNamespace(subject=Hypothesis("pulley_friction", (), (free,)), size=5.0, parameter=0)
    (seen,) = detectable(SimpleNamespace(alternatives=[loss]), Settings())
    assert seen.size == pytest.approx(1 - np.exp(-Settings().detectable / 5.0))


def test_what_is_detectable_of_several_parameters_is_of_the_first_that_is_felt(tested):
    """Along the straight arm gravity moves nothing, and a size is told of its other component."""
    fitted, _ = tested
    gravity = Hypothesis("gravity", (), (Free("x_m_s2", 0.0, -20.0, 20.0), Free("y_m_s2", 0.0, -20.0, 20.0)))
    moved = np.zeros((len(fitted.solved.readings), 2))
    moved[:, 1] = np.random.default_rng(1).standard_normal(len(moved))
    (felt,) = alternatives_of(fitted, [gravity], [moved])
    (seen,) = detectable(SimpleNamespace(alternatives=[felt]), Settings())
    assert seen.free.name == "y_m_s2"
    assert seen.size == pytest.approx(Settings().detectable / felt.size)


def test_gross_outliers_are_told_from_a_large_effect():
    recording = recorded(Case(hidden=((("kind", "dead_cable"), ("cable", "2")),)))
    predict = predictor(recording)
    wrong = np.random.default_rng(2).choice(recording.readings.count, 8, replace=False)
    value = recording.readings.value.copy()
    value[wrong] += np.where(recording.readings.kind[wrong] == Kind.ANGLE, 0.4, 0.03)
    spoilt = recording.with_values(value)
    sd = np.array([3e-4, 3e-4, 5e-3, 5e-3])[recording.readings.kind]
    deviation = (value - predict(Constants())) / sd
    off = surprise(spoilt.readings, deviation, recording.of_sequence, Settings())
    assert np.abs(deviation).mean() > 10  # the dead cable is seen everywhere
    assert (off[wrong] > Settings().gross_sd).all()
    assert np.mean(off > Settings().gross_sd) < 0.05


def test_what_would_need_less_friction_than_none_is_no_mismatch():
    """Holes beside none that rub can only rub more; beside others that do, a hole may rub more or less."""
    for friction, shown in [(0.0, False), (0.3, True)]:
        recording = recorded(Case(hidden=(), friction=friction))
        predict = predictor(recording)
        fitted = fit_constants(predict)
        library = hypotheses(Scope.of(recording, predict.chain, fitted.solved.states))
        worn = [h for h in library if h.kind == "worn_hole" and dict(h.place).get("disk") == 3]
        for each in alternatives(fitted, worn):
            smoother = -each.basis[:, 0]  # residuals as a hole that rubs less leaves them
            assert each.z(5 * smoother) == pytest.approx(5.0 if shown else 0.0)
            assert each.z(-5 * smoother) == pytest.approx(5.0)


def test_a_prior_that_the_readings_contradict_raises_no_score():
    """A base that gives way as few do, many deviations of a narrow prior: the prior pulls at it, and what that leaves
    looks like missing physics only as long as it counts."""
    recording = recorded(Case(hidden=((("kind", "base_compliance"), ("compliance_rad_per_n_m", 0.06)),)))
    predict = predictor(recording)
    plain = fit_constants(predict)
    library = list(hypotheses(Scope.of(recording, predict.chain, plain.solved.states)))
    base = next(each for each in library if each.kind == "base_compliance")
    (free,) = base.free
    narrow = replace(base, free=(free._replace(sd=0.2),))
    largest = {}
    for reach in (Settings().contradicted_sd, np.inf):
        settings = Settings(contradicted_sd=reach)
        model = replace(plain.model, hypotheses=(narrow,), settings=settings)
        fitted = fit(model, np.append(plain.p, 4.0))
        assert fitted.p[-1] / 0.2 > 3
        found = scores(fitted, alternatives(fitted, [each for each in library if each.kind != "base_compliance"]), 1)
        largest[reach] = found.largest / found.naming
    assert largest[Settings().contradicted_sd] < 1 < largest[np.inf]
