"""A log of a rig of which the file says all: its noise lasts from reading to reading, and is no missing physics."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.run import diagnosis_of
from prb3r.model.steps import loads_of
from prb3r.recording.recording import Readings

ENDS = {
    "a": [(0, 0, 0, 1), (90, 0, 0, 1), (30, 0, 0, 1)],
    "b": [(0, 0, 2, 0), (0, 0, 95, 0)],
    "c": [(1, 0, 0, 1), (1, 0, 0, 80), (1, 0, 0, 20)],
}
"""Tensions between which each sequence goes steadily, N."""
STEPS, CORRELATION, SCATTER, SEEN = 70, 0.8, 0.003, (3, 6)


def log(seed):
    """Tensions scatter by a load cell's noise, and readings by noise that lasts, about what the engine predicts."""
    rng, plain = np.random.default_rng(seed), recorded(Case(hidden=()))
    at = np.linspace(0, 1, STEPS)
    true = np.concatenate(
        [
            np.stack([np.interp(at * (len(way) - 1), range(len(way)), [step[k] for step in way]) for k in range(4)], 1)
            for way in ENDS.values()
        ]
    )
    names = plain.manipulator.cable_names
    table = plain.steps.iloc[np.zeros(len(true), int)].reset_index(drop=True)
    table["sequence"], table["step"] = np.repeat(list(ENDS), STEPS), np.tile(np.arange(1, STEPS + 1), len(ENDS))
    falls = np.diff(true, axis=0, prepend=true[:1]) < 0
    for k, name in enumerate(names):
        table[f"cable_{name}_n"], table[f"slip_{name}"] = true[:, k], np.where(falls[:, k], 1, -1)
    chain = plain.manipulator.chain()
    step, disk, kind = (each.ravel() for each in np.meshgrid(np.arange(len(true)), SEEN, range(3), indexing="ij"))
    exact = replace(
        plain,
        sequences=tuple(ENDS),
        steps=table,
        of_sequence=np.repeat(np.arange(len(ENDS)), STEPS),
        loads=loads_of(plain.manipulator, chain, table),
        readings=Readings(step, disk, kind, np.zeros(len(step))),
        measurement=plain.measurement.model_copy(update={"tension_sd_relative": SCATTER}),
    )
    noise = rng.standard_normal((len(true), len(SEEN) * 3))
    for k in range(1, len(true)):
        noise[k] = CORRELATION * noise[k - 1] + np.sqrt(1 - CORRELATION**2) * noise[k]
    value = predictor(exact).solve(Constants(0.05)).readings + reading_sd(exact) * noise.ravel()
    for k, name in enumerate(names):
        table[f"cable_{name}_n"] = true[:, k] * (1 + SCATTER * rng.standard_normal(len(true)))
    read = replace(exact, steps=table, loads=loads_of(plain.manipulator, chain, table))
    return read.with_values(value)


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1])
def test_noise_that_lasts_is_no_missing_physics(seed):
    diagnosis = diagnosis_of(log(seed))
    assert diagnosis.verdict == "adequate"
    assert diagnosis.noise.serial > 0
    assert diagnosis.constants["youngs_modulus_pa"].explained == pytest.approx(1.87e11 * np.exp(0.05), rel=0.02)
    assert any("of 210 steps 180 are used" in said for said in diagnosis.remarks)
