"""How a rig's parts came out: the normal distribution that all readings leave, and predictions on the same rig."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import MU, Case, E, manipulator, recorded

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.covariance import noise_of
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.fit.tolerance import tolerances
from prb3r.diagnosis.result.as_made import as_made, parts_posterior
from prb3r.diagnosis.result.tell import adjusted
from prb3r.errors import SpecError
from prb3r.model.solve import solve_in_blocks
from prb3r.proof.rig.simulate import simulate
from prb3r.recording.recording import Tolerance

OFF = {1: 1.03, 2: 0.965, 4: 0.975, 5: 1.035, 6: 0.97}
"""Factors on the stiffness of plates that nobody measured."""
ROUGH = Tolerance(offset_m=0.0, length_m=0.0, thickness_relative=0.01, marker_m=0.0)
LOADS = {"cable_1_n": [20.0, 45.0, 70.0], "cable_4_n": [80.0, 60.0, 10.0]}
"""That were not recorded."""


UNEVEN = tuple(tuple({"kind": "weakened_plate", "plate": k, "factor": f}.items()) for k, f in OFF.items())


def calibrated(seed=0):
    """The constants of the rig with uneven plates, under the covariance of its tolerances; `seed` of the noise."""
    predict = predictor(replace(recorded(Case(hidden=UNEVEN, seed=seed)), tolerance=ROUGH))
    rough = fit_constants(predict)
    noise = noise_of(
        predict.recording,
        tension_response(predict, rough.solved),
        tolerances=tolerances(predict, rough.solved).moved,
    )
    return fit(replace(rough.model, noise=noise), rough.p)


@pytest.fixture(scope="module")
def rough():
    return calibrated()


def believed(fitted):
    return Doubts(np.ones(fitted.model.predict.recording.readings.count))


def kept_of(fitted):
    return [k for k, name in enumerate(fitted.model.varied) if name not in FRAME]


def test_parts_and_parameters_have_the_distribution_that_a_fit_of_both_together_has(rough):
    """One linear problem: parameters and tolerances side by side, these with a prior, under noise without them."""
    predict = rough.model.predict
    known = tolerances(predict, rough.solved)
    felt = known.sd > 0
    plain = noise_of(predict.recording, tension_response(predict, rough.solved))
    prior = -np.diag(1 / rough.model.deviations)
    parameters = -plain.whiten(rough.model.moved(rough.p, rough.solved))
    parts, misfit = -plain.whiten(known.moved[:, felt]), predict.misfit(rough.solved.readings)
    sizes = len(rough.p), int(felt.sum())
    rows = np.block([
        [parameters, parts],
        [prior, np.zeros((sizes[0], sizes[1]))],
        [np.zeros((sizes[1], sizes[0])), np.eye(sizes[1])],
    ])  # fmt: skip
    target = np.concatenate([plain.whiten(misfit), -rough.p / rough.model.deviations, np.zeros(sizes[1])])
    covariance = np.linalg.inv(rows.T @ rows)
    best = -covariance @ rows.T @ target
    kept = kept_of(rough)
    both = [*kept, *range(sizes[0], sum(sizes))]
    found = parts_posterior(rough, believed(rough), kept)
    assert found.names == [name for name, own in zip(known.names, felt, strict=True) if own]
    slope = covariance[np.ix_(both, both)][len(kept) :, : len(kept)]
    slope = slope @ np.linalg.inv(covariance[np.ix_(kept, kept)])
    np.testing.assert_allclose(found.mean, best[sizes[0] :] - slope @ best[kept], atol=0.02)
    np.testing.assert_allclose(found.slope, slope, rtol=2e-3, atol=2e-3 * np.abs(slope).max())
    drawn = np.array([list(found.at(np.zeros(len(kept)), z).values()) for z in np.eye(sizes[1])]) / known.sd[felt]
    drawn = drawn - found.mean
    conditional = covariance[sizes[0] :, sizes[0] :] - slope @ covariance[np.ix_(kept, kept)] @ slope.T
    np.testing.assert_allclose(drawn.T @ drawn, conditional, atol=0.06)


def on_other_loads(fitted):
    """Tip-to-base turns (3, 7) as the file has its parts, as the readings tell them, drawn (k, 3, 7), and the rig's."""
    kept = kept_of(fitted)
    assert [fitted.model.varied[k] for k in kept] == ["log_stiffness", "log_friction"]
    found, nominal = parts_posterior(fitted, believed(fitted), kept), fitted.model.predict.recording.manipulator
    cables = {f"cable_{name}_n": 0.0 for name in "1234"} | {f"slip_{name}": -1.0 for name in "1234"}
    rows = [cables | {key: LOADS[key][k] for key in LOADS} for k in range(3)]
    true = simulate(manipulator(E * 1.05, MU * 0.9, [dict(effect) for effect in UNEVEN]), rows).angle
    steps = {"sequence": ["a"] * 3, "step": [1, 2, 3], **LOADS}

    def turns(away, scatter=None, made=True):
        stiffness, friction = away + fitted.p[kept]
        known = adjusted(nominal, Constants(log_stiffness=stiffness, log_friction=friction), ())
        blocks = solve_in_blocks(known, steps)
        solved = replace(blocks, chain=as_made(known, found.at(away, scatter))) if made else blocks
        return solved.whole()["angle_rad"].to_numpy().reshape(3, -1)

    rng, covariance = np.random.default_rng(1), fitted.covariance[np.ix_(kept, kept)]
    draws = [
        turns(rng.multivariate_normal(np.zeros(2), covariance), rng.standard_normal(len(found.names)))
        for _ in range(40)
    ]
    return turns(np.zeros(2), made=False), turns(np.zeros(2)), np.stack(draws), true


@pytest.mark.long
def test_under_other_loads_the_same_rig_is_met_more_closely_and_as_surely_as_is_said():
    as_drawn, as_told, covered = [], [], []
    for seed in range(5):
        plain, told, draws, true = on_other_loads(calibrated(seed))
        as_drawn.append(np.mean((plain - true) ** 2))
        as_told.append(np.mean((told - true) ** 2))
        low, high = np.quantile(draws, [0.025, 0.975], axis=0)
        covered.append(((low <= true) & (true <= high))[:, 1:].mean())
        assert (high - low).max() < 8 * np.sqrt(as_drawn[-1])
    assert np.mean(as_told) < 0.4 * np.mean(as_drawn)
    assert np.mean(covered) > 0.75


def test_parts_that_are_known_exactly_have_no_distribution():
    exact = fit_constants(predictor(recorded(Case(hidden=()))))
    assert parts_posterior(exact, believed(exact), kept_of(exact)) is None


def test_a_part_that_a_manipulator_lacks_is_refused(rough):
    with pytest.raises(SpecError, match="plate 99 length_m"):
        as_made(rough.model.predict.recording.manipulator, {"plate 99 length_m": 1e-4})
