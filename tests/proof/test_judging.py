"""How verdicts are judged: intervals of shares and medians, sizes that are noticed, scores."""

import numpy as np
import pytest

from prb3r.proof.concealed.elsewhere import OTHER_DESIGN, OTHER_LOADS
from prb3r.proof.concealed.labels import Label
from prb3r.proof.judging.intervals import median_of, share_of
from prb3r.proof.judging.missed import Missed
from prb3r.proof.judging.opened import OpenedCase, first_right, parameters, plate_error
from prb3r.proof.judging.scores import GOALS, does_no_harm
from prb3r.proof.judging.verdict import Claim, Verdict
from prb3r.proof.settings import SETTINGS
from prb3r.proof.settings.sizes import detectable_norm, squared_distance

NORM = SETTINGS.sizes.detectable


def test_wilson_intervals_are_the_published_ones():
    """Newcombe, Statistics in Medicine 17 (1998) 857, table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29."""
    for hits, count, low, high in [
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ]:
        score = share_of([True] * hits + [False] * (count - hits))
        assert (score.low, score.high) == pytest.approx((low, high), abs=5e-5)


def test_two_effects_are_apart_where_the_likelihood_ratio_errs_once_in_a_hundred():
    rng, count = np.random.default_rng(1), 400_000
    for error, distance in ((0.05, 11.0), (0.01, 22.0)):
        assert squared_distance(error) == distance
        readings = rng.standard_normal(count)  # along the line that joins the two, the truth at 0, the rival at d
        wrong = np.mean(readings**2 > (readings - np.sqrt(distance)) ** 2)
        assert 0.9 * error < wrong < error


def test_the_detectable_norm_is_noticed_nine_times_in_ten():
    rng, count, tests = np.random.default_rng(2), 20_000, 100
    assert detectable_norm(0.01, tests, 0.1) == 5.2
    largest = np.abs(rng.standard_normal((count, tests))).max(1)
    threshold = np.quantile(largest, 0.99)
    assert np.mean(np.abs(5.2 + rng.standard_normal(count)) > threshold) == pytest.approx(0.9, abs=0.02)


def test_medians_have_intervals_of_order_statistics():
    score = median_of(range(1, 101))
    assert (score.value, score.count) == (50.5, 100)
    assert 38 <= score.low <= 42
    assert 59 <= score.high <= 63


def test_scores_of_one_verdict():
    true = {"kind": "weakened_plate", "plate": 3, "factor": 0.8}
    label = Label(0, "single", 0, 0, effects=(true,), norm=5 * NORM, nearest={"gravity": 50.0})
    claim = Claim("weakened_plate", {"plate": 3}, {"factor": (0.81, 0.79, 0.83)})
    case = OpenedCase(label, Verdict(0, "diagnose", "explained", (claim,)), 0.3)
    assert first_right(case)
    assert plate_error(case) == 0
    ((error, covered),) = parameters(case)
    assert error == pytest.approx(1 - np.log(0.81) / np.log(0.8))
    assert covered
    beside = Claim("weakened_plate", {"plate": 4}, {"factor": (0.81, 0.79, 0.83)})
    assert plate_error(case._replace(verdict=Verdict(0, "diagnose", "explained", (beside,)))) == 1
    assert not first_right(case._replace(verdict=Verdict(0, "diagnose", "unexplained", (claim,))))
    assert parameters(case._replace(verdict=Verdict(0, "diagnose", "failed"))) == [(np.inf, False)]


def test_harm_is_a_name_that_predicts_another_design_worse_than_constants_do():
    """Mean squares in standard deviations of a reading: 9 by constants alone, the noise is 1."""
    label = Label(0, "foreign", 0, 0, foreign=("leak", 0.1), nearest={"gravity": 1e4})

    def judged(verdict, explained, calibrated=9.0):
        missed = (
            Missed(OTHER_LOADS, 1.0, 99.0, 0.9, 0.0, 0.0),
            Missed(OTHER_DESIGN, calibrated, explained, 0.9, 0.0, 0.0),
        )
        return OpenedCase(label, Verdict(0, "diagnose", verdict), 0.3, missed)

    assert does_no_harm(judged("explained", 8.0))
    assert not does_no_harm(judged("explained", 10.0))
    assert does_no_harm(judged("unexplained", 10.0))
    assert does_no_harm(judged("ambiguous", 0.9, calibrated=0.5))  # both within the noise
    assert not does_no_harm(judged("failed", np.inf, calibrated=np.inf))
    (goal,) = [goal for goal in GOALS if goal.short == "outside, no harm"]
    cases = [
        judged("explained", 8.0),
        judged("explained", 10.0),
        OpenedCase(label, Verdict(0, "diagnose", "failed"), 0.3),
    ]
    assert (goal.measure(cases).value, goal.measure(cases).count) == (0.5, 2)
