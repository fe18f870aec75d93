"""Selection in the linearised model: its evidences are those of Gaussian models, at any size of an effect."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search import columns
from prb3r.diagnosis.search.columns import linear_model
from prb3r.diagnosis.search.linear_selection import Column, LinearModel, best_sets
from prb3r.diagnosis.settings import Settings

KINDS = {"gravity": 2, "lens_distortion": 1, "tip_force": 2, "camera_scale": 1}


@pytest.fixture
def model():
    """Effects with one and with two coefficients, and what one of each makes of forty readings."""
    rng = np.random.default_rng(3)
    columns = [
        Column(Hypothesis(kind, (), ()), rng.standard_normal((40, width)), np.zeros(width), log_odds=-1.0 - width)
        for kind, width in KINDS.items()
    ]
    return LinearModel(columns, columns[0].moved @ [1.5, -2.0] + columns[1].moved[:, 0] + rng.standard_normal(40))


def marginal(model, chosen):
    """ln of the odds against no effect: readings are Gaussian, coefficients have unit variance."""
    moved = np.hstack([np.zeros((len(model.target), 0)), *(model.columns[k].moved for k in sorted(chosen))])
    none = np.eye(len(model.target))
    density = [multivariate_normal(cov=cov).logpdf(model.target) for cov in (none + moved @ moved.T, none)]
    return density[0] - density[1] + sum(model.columns[k].log_odds for k in chosen)


SETS = [frozenset(s) for s in ((), (0,), (1,), (0, 1), (2, 3), (0, 1, 2, 3))]


@pytest.mark.parametrize("chosen", SETS, ids=lambda chosen: "-".join(map(str, sorted(chosen))) or "none")
def test_evidence_is_that_of_the_gaussian_model(model, chosen):
    assert model.evidence(chosen) == pytest.approx(marginal(model, chosen), abs=1e-9)
    further = [k for k in range(len(KINDS)) if k not in chosen]
    rises = [marginal(model, chosen | {k}) - marginal(model, chosen) for k in further]
    assert model.additions(chosen)[further] == pytest.approx(rises, abs=1e-9)
    assert (model.additions(chosen)[sorted(chosen)] == -np.inf).all()


def test_true_set_is_found_from_nothing(model):
    assert best_sets(model, [frozenset()], Settings(beam=3), most=4)[0].chosen == {0, 1}


def test_without_a_column_there_is_nothing_to_add(model):
    """As at the end of a branch, where every effect moves readings without bound and none is proposed."""
    nothing = LinearModel([], model.target)
    assert nothing.evidence(frozenset()) == 0
    assert nothing.additions(frozenset()).shape == (0,)
    assert [found.chosen for found in best_sets(nothing, [frozenset()], Settings(), most=4)] == [frozenset()]


@pytest.mark.parametrize("size", [1e4, 1.5e8, 1e12])
def test_beside_an_effect_that_moves_readings_without_bound(model, size):
    """As near the end of a branch: its own prior no longer counts, and what is beside it is judged as before."""
    huge, bounded = LinearModel([*model.columns], model.target), LinearModel([*model.columns], model.target)
    direction = np.linalg.qr(np.random.default_rng(5).standard_normal((40, 1)))[0]
    for other, norm in ((huge, size), (bounded, 1e4)):
        other.columns[3] = Column(Hypothesis("camera_scale", (), ()), norm * direction, np.zeros(1))
    for chosen in (frozenset({3}), frozenset({1, 3})):
        rise = huge.additions(chosen)
        assert rise[[0, 2]] == pytest.approx(bounded.additions(chosen)[[0, 2]], abs=1e-2)
        assert np.isfinite(huge.evidence(chosen))


@pytest.mark.parametrize("size", [1e160, np.nan])
def test_derivatives_without_bound_propose_nothing(calibrated, suspects, monkeypatch, size):
    """Their products would overflow: of what is not there yet there is no column."""
    library = [hypothesis for hypothesis in suspects if hypothesis.kind == "weakened_plate"]
    odds = dict.fromkeys(library, -2.0)
    derived = columns.moved_readings

    def steep(fitted, probes):
        moved = derived(fitted, probes)
        return [
            size * values if probe[0] == library[0] else values for probe, values in zip(probes, moved, strict=True)
        ]

    assert len(linear_model(calibrated, library, odds)[0].columns) == len(library)
    monkeypatch.setattr(columns, "moved_readings", steep)
    linear, _ = linear_model(calibrated, library, odds)
    assert [column.hypothesis for column in linear.columns] == library[1:]


def test_derivatives_without_bound_of_an_effect_that_is_there_are_cut(calibrated, suspects):
    weak = next(hypothesis for hypothesis in suspects if hypothesis.name == "weakened_plate (plate 4)")
    fitted = fit(calibrated.model.adding(weak), np.append(calibrated.p, 0.0))
    steep = replace(fitted, jacobian=fitted.jacobian * np.append(np.ones(len(fitted.p) - 1), 1e160))
    linear, there = linear_model(steep, [weak], {weak: -2.0})
    assert np.isfinite(linear.products).all()
    assert np.isfinite(linear.evidence(there))
