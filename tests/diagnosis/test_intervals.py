"""Intervals of parameters: where chi-square has risen as it should, and what all surviving models say."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.confidence import INTERVAL_RISE, NORMAL_REACH
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.profile import interval_ends, linear_interval, profile
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.result.spread import (
    SplitNormal,
    ends_over_models,
    held_share,
    number_of_constant,
    number_of_share,
    quantile_over_models,
)
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Prior


@pytest.fixture(scope="module")
def effects(suspects):
    return {each.name: each for each in suspects}


def with_effects(calibrated, *chosen):
    start = np.concatenate([calibrated.p, *(np.zeros(len(each.free)) for each in chosen)])
    return fit(calibrated.model.adding(*chosen), start)


def survivor(fitted, probability):
    return Survivor(fitted, 0.0, probability)


def normal_ends(fitted, number):
    reach = NORMAL_REACH * np.sqrt(fitted.covariance[number, number])
    return fitted.p[number] - reach, fitted.p[number] + reach


def test_a_quantile_is_that_of_draws_from_all_models():
    told = [
        SplitNormal(0.5, 0.0, 1.0, 1.0),
        SplitNormal(0.3, 4.0, 0.5, 0.5),
        SplitNormal(0.2, -3.0, 2.0, 2.0),
    ]
    rng = np.random.default_rng(0)
    draws = np.concatenate([rng.normal(each.value, each.below, int(2e5 * each.probability)) for each in told])
    for share in (0.025, 0.3, 0.975):
        assert quantile_over_models(told, share) == pytest.approx(np.quantile(draws, share), abs=0.03)
    assert quantile_over_models([SplitNormal(1.0, 2.0, 1.0, 3.0)], 0.975) == pytest.approx(2.0 + 3 * NORMAL_REACH)


def test_an_interval_holds_what_every_probable_model_says(calibrated, effects):
    """Segment 2 alone is softened by its weak plate; beside the weak plate nothing is left for it to do."""
    segment, weak = effects["segment_stiffness (segment 2)"], effects["weakened_plate (plate 4)"]
    alone, beside = with_effects(calibrated, segment), with_effects(calibrated, weak, segment)
    number, there = alone.model.spans[0].start, beside.model.spans[1].start
    own, other = normal_ends(alone, number), normal_ends(beside, there)
    assert max(own[0], other[0]) > min(own[1], other[1])  # they contradict each other

    def ends(probability):
        choice = SimpleNamespace(
            fitted=alone, survivors=(survivor(alone, 1 - probability), survivor(beside, probability))
        )
        return ends_over_models(choice, number, number_of_share(segment, 0), own)

    low, high = ends(0.5)
    assert low <= min(own[0], beside.p[there])
    assert high >= max(own[1], beside.p[there])
    assert ends(1e-6) == pytest.approx(own, abs=1e-3)


def test_a_model_without_the_parameter_says_nothing_of_it(calibrated, effects):
    segment, weak = effects["segment_stiffness (segment 2)"], effects["weakened_plate (plate 4)"]
    alone, other = with_effects(calibrated, segment), with_effects(calibrated, weak)
    choice = SimpleNamespace(fitted=alone, survivors=(survivor(alone, 0.5), survivor(other, 0.5)))
    number = alone.model.spans[0].start
    own = normal_ends(alone, number)
    assert ends_over_models(choice, number, number_of_share(segment, 0), own) == own
    stiffness = alone.model.varied.index("log_stiffness")
    wide = ends_over_models(choice, stiffness, number_of_constant("log_stiffness"), normal_ends(alone, stiffness))
    assert wide[0] <= other.p[stiffness] <= wide[1]  # every model has the constants


def test_a_model_that_holds_the_parameter_puts_all_its_probability_there(calibrated):
    """A force along both axes beside one along y alone: along x it is 0 with the probability of that one."""
    free = (Free("x_n", 0.0, -10.0, 10.0, 1.0), Free("y_n", 0.0, -10.0, 10.0, 1.0))
    both = Hypothesis("tip_force", (), free)
    along_y = Hypothesis("tip_force", (("x_n", 0.0),), free[1:])
    assert both.generalises(along_y)
    alone, special = with_effects(calibrated, both), with_effects(calibrated, along_y)
    x, y = range(alone.model.spans[0].start, alone.model.spans[0].stop)

    def ends(part, number, probability, own):
        choice = SimpleNamespace(
            fitted=alone, survivors=(survivor(alone, 1 - probability), survivor(special, probability))
        )
        return ends_over_models(choice, number, number_of_share(both, part), own, held_share(both, part))

    own = 1.0, 2.0  # as if it were told to be far from 0
    assert ends(0, x, 0.3, own) == (0.0, own[1])
    assert ends(0, x, 0.01, own) == pytest.approx(own, abs=0.1)
    there = special.p[special.model.spans[0].start]
    assert ends(1, y, 0.3, (there + 5.0, there + 6.0))[0] <= there


def test_a_linear_interval_is_that_of_the_profile_where_readings_tell_both_sides(calibrated, effects):
    weak = with_effects(calibrated, effects["weakened_plate (plate 4)"])
    number = weak.model.spans[0].start
    curve = profile(weak, number)
    assert linear_interval(weak, number) == pytest.approx((curve.low, curve.high), abs=0.1 * (curve.high - curve.low))


def test_the_interval_of_a_friction_that_is_next_to_none_ends_where_chi_square_has_risen():
    """At a hundredth of the nominal friction its logarithm hardly moves a reading, and the straight line goes on."""
    right = replace(recorded(Case(hidden=())), prior=Prior())
    smooth = right.with_values(predictor(right)(Constants(log_friction=np.log(0.01))))
    fitted = fit_constants(predictor(smooth))
    number = fitted.model.varied.index("log_friction")
    low, high = interval_ends(fitted, number)
    assert high < normal_ends(fitted, number)[1] - 0.5
    p = fitted.p.copy()
    p[number] = high
    assert fit(fitted.model, p, fixed=(number,)).chi2 - fitted.chi2 == pytest.approx(INTERVAL_RISE, rel=0.1)
    assert low == fitted.model.bounds(fitted.p)[0][number]


class Lengthening:
    """A length that was fitted by its logarithm to readings which see the length: r = 100 (exp(u) - exp(best))."""

    def __init__(self, u):
        self.p, self.model, self.settings = np.array([u]), self, Settings()
        slope = 100 * np.exp(u)
        self.covariance = np.array([[1 / (slope**2 + 0.05**2)]])  # with a weak prior
        self.chi2 = 0.0

    def bounds(self, p):
        return np.array([-15.0]), np.array([15.0])

    def solve(self, p):
        return None

    def residuals(self, p, solved):
        return np.array([100 * (np.exp(p[0]) - np.exp(self.p[0])), 0.05 * (p[0] - self.p[0])])


def test_no_linear_interval_reaches_where_readings_contradict_it():
    """At exp(-10) the slope is next to nothing, and the straight line goes on to lengths that are plainly refuted."""
    short = Lengthening(-10.0)
    assert NORMAL_REACH * np.sqrt(short.covariance[0, 0]) > 10
    assert linear_interval(short, 0) is None
    assert linear_interval(Lengthening(0.0), 0) == pytest.approx((-NORMAL_REACH / 100, NORMAL_REACH / 100), rel=1e-3)


def test_another_model_whose_straight_line_is_wrong_moves_an_interval_but_does_not_stretch_it():
    chosen, other = Lengthening(-4.0), Lengthening(-10.0)
    for fitted, effects in ((chosen, ()), (other, ("more",))):
        fitted.hypotheses = effects
    wide = NORMAL_REACH * np.sqrt(other.covariance[0, 0])
    choice = SimpleNamespace(
        fitted=chosen,
        survivors=tuple(
            SimpleNamespace(fitted=fitted, effects=frozenset(fitted.hypotheses), probability=0.5)
            for fitted in (chosen, other)
        ),
    )
    low, high = ends_over_models(choice, 0, lambda model: 0, (-5.0, -3.5))
    assert low < -10.0
    assert -3.5 <= high < -3.0 < -10.0 + wide
