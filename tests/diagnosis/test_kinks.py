"""The minimiser at a kink, where derivatives of one side promise what the other does not keep."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.settings import Settings

LEAST = 9 + 4**2 * 0.04 / 1.04
"""Along the kink x = y, where (x - 4)^2 + (x / 5)^2 is least; the wall's share is 3^2."""


@dataclass(frozen=True)
class Wall:
    """Residuals that fall with `x` until it passes `y`, and grow steeply beyond."""

    settings: Settings

    def bounds(self, p):
        return np.full(2, -10.0), np.full(2, 10.0)

    def solve(self, p):
        return p

    def residuals(self, p, solved):
        x, y = p
        return np.array([3 + 10 * max(0.0, x - y), x - 4, y / 5])

    def jacobian(self, p, solved):
        beyond = 10.0 if p[0] > p[1] else 0.0
        return np.array([[beyond, -beyond], [1.0, 0.0], [0.0, 0.2]])

    def fitted(self, p, residual, jacobian, solved, done):
        return SimpleNamespace(p=p, chi2=float(residual @ residual), converged=done)


STARTS = np.random.default_rng(0).uniform(-5, 5, (60, 2))


def test_fits_get_past_a_kink_where_exact_derivatives_stop():
    stopped, past = (
        np.array([fit(Wall(Settings(kink_trials=trials)), start).chi2 for start in STARTS])
        for trials in (0, Settings().kink_trials)
    )
    assert (past <= stopped).all()
    at_the_least = [(ends < LEAST + 2 * Settings().idle_gain).sum() for ends in (stopped, past)]
    assert at_the_least[1] >= at_the_least[0] + 5
    assert past.min() == pytest.approx(LEAST, abs=Settings().idle_gain)


def test_a_fit_that_stops_at_a_kink_does_not_call_itself_converged():
    stopped = fit(Wall(Settings(kink_trials=0)), np.array([0.0, 1.0]))
    assert stopped.chi2 > LEAST + 1
    assert not stopped.converged


@dataclass(frozen=True)
class Cliff(Wall):
    """The same with a derivative beyond `edge` that no square of a number can hold."""

    edge: float = 0.0

    def jacobian(self, p, solved):
        slope = super().jacobian(p, solved)
        return slope * np.where(p[0] > self.edge, 1e215, 1.0)


def test_where_derivatives_have_no_squares_a_fit_ends_without_a_model():
    assert fit(Cliff(Settings()), np.array([1.0, 5.0])) is None
    assert fit(Cliff(Settings()), np.array([-1.0, 5.0])) is None  # the way down leads there
    away, plain = (fit(model, np.array([1.0, 5.0])) for model in (Cliff(Settings(), edge=9.0), Wall(Settings())))
    assert away.chi2 == plain.chi2
    assert fit(Cliff(Settings(), edge=-0.9), np.array([-1.0, 5.0]), most_steps=1) is None  # where it ends


def test_evidence_of_a_constant_that_no_reading_feels_is_that_of_a_flat_prior_within_its_bounds():
    """Beside an effect whose column is hardly apart from that of the constant, the constant is known to its bounds."""
    farthest = Settings().farthest
    model = SimpleNamespace(
        varied=("log_stiffness",),
        hypotheses=(),
        deviations=np.array([np.inf, 2.0]),
        bounds=lambda p: (-np.ones(2), np.ones(2)),
        settings=Settings(),
    )

    def evidence(of_constant):
        jacobian = np.array([[of_constant, 1.0], [0.0, 1 / 2.0]])
        return log_evidence(SimpleNamespace(model=model, jacobian=jacobian, chi2=2.0, p=np.zeros(2)), {})

    assert evidence(0.0) == pytest.approx(-1.0 - np.log(1 + 1 / 4) / 2 - np.log(2.0))
    slope = 3.0
    normal = np.array([[slope**2 + 1 / farthest**2, slope], [slope, 1 + 1 / 4]])
    volume = np.log(np.linalg.det(normal) / normal[0, 0]) + 2 * np.log(2.0)
    assert evidence(slope) == pytest.approx(-1.0 - volume / 2)
