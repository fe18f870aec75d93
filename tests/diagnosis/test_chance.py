"""Tails are those of `scipy.stats`, far out too, and no process loads that for them."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.stats import chi2, norm

from prb3r.diagnosis.chance import chi2_critical, chi2_tail, exceeded, normal_critical, normal_tail
from prb3r.diagnosis.checks.setup.robust import expected_loss

RATES = np.array([1e-300, 1e-12, 0.001, 0.025, 0.5, 0.99])


def test_tails_and_limits_are_those_of_the_laws():
    assert normal_critical(RATES) == pytest.approx(norm.isf(RATES), rel=1e-13)
    assert normal_tail(normal_critical(RATES)) == pytest.approx(RATES, rel=1e-9)
    assert np.isnan(chi2_tail(3.0, 0))
    for freedom in (1, 2, 300):
        assert chi2_critical(RATES, freedom) == pytest.approx(chi2.isf(RATES, freedom), rel=1e-9)
        assert chi2_tail(np.array([0.0, 0.3, 300.0]), freedom) == pytest.approx(
            chi2.sf([0.0, 0.3, 300.0], freedom), rel=1e-9
        )


@pytest.mark.parametrize("scale", [0.3, 1.0, 7.0])
def test_the_mean_robust_misfit_is_that_of_draws(scale):
    drawn = np.log1p((scale * np.random.default_rng(3).standard_normal(400_000)) ** 2)
    assert expected_loss(scale) == pytest.approx(drawn.mean(), abs=5 * drawn.std() / 400_000**0.5)


def test_a_process_that_diagnoses_begins_without_what_takes_long_to_import():
    code = "import sys, prb3r.diagnosis.stages; print(*({'scipy.stats', 'scipy.optimize'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.split() == []


def test_every_rank_among_simulated_scores_is_as_probable_as_any_other():
    """So the p-value of a score of the same law is at most k / (n + 1) in that share of cases, ties counted fully."""
    drawn = np.array([1.0, 2.0, 2.0, 3.0])
    assert exceeded(drawn, np.array([0.0, 2.0, 2.5, 3.0, 4.0])).tolist() == [1.0, 0.8, 0.4, 0.4, 0.2]
