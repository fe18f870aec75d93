"""The table of residuals: of the fits, of the sequences set aside, of readings that are doubted."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from diagnosis.simulated import (
    investigated,
)

from prb3r.diagnosis.evidence.outliers import NotedWeight
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.result.tables import residual_table
from prb3r.diagnosis.result.tell import tell


def test_residuals_are_those_of_the_fits_and_of_the_sequences_set_aside(tmp_path):
    found = investigated()
    write_record(tell(found), tmp_path)
    table = pd.read_parquet(tmp_path / "residuals.parquet")
    assert len(table) == found.recording.readings.count
    assert set(table["sequence"][table["held_out"]]) == set(found.heldout.sequences)
    assert (table["residual_explained"][table["held_out"]] ** 2).sum() == pytest.approx(found.heldout.chi2_explained)
    assert (table["residual_calibrated"][table["held_out"]] ** 2).sum() == pytest.approx(found.heldout.chi2_calibrated)
    fitted = table[~table["held_out"]]
    np.testing.assert_array_equal(fitted["residual_calibrated"], found.refitted.residual[: len(fitted)])
    assert fitted["residual_explained"].std() < 0.6 * fitted["residual_calibrated"].std()
    np.testing.assert_array_equal(fitted["weighed_down"], found.doubts.inflation > 1)
    assert (table["sd"] > 0).all()


def test_a_held_out_step_that_is_lost_leaves_the_other_residuals():
    found = investigated()
    models = {"calibrated": found.refitted, "explained": found.explained}
    states = {
        name: predictor(found.recording).equilibria(each.constants, each.effects) for name, each in models.items()
    }
    whole = residual_table(found, models, states)
    (step,) = np.flatnonzero(found.recording.steps["sequence"] == found.heldout.sequences[0])[:1]
    for each in states.values():
        each.x[step], each.y[step], each.angle[step] = np.nan, np.nan, np.nan
    lost = residual_table(found, models, states)
    gone = lost["residual_explained"].isna()
    key = found.recording.steps.iloc[step]
    assert (lost[gone]["sequence"] == key["sequence"]).all()
    assert (lost[gone]["step"] == key["step"]).all()
    assert gone.sum() == (whole["sequence"].eq(key["sequence"]) & whole["step"].eq(key["step"])).sum()


def test_gross_outliers_and_disbelieved_weights_are_flagged():
    found = investigated()
    inflation = np.where(np.arange(len(found.doubts.inflation)) == 7, 9.0, 1.0)
    doubts = replace(found.doubts, inflation=inflation, weights=(NotedWeight(step=5, cable=0),))
    table = tell(replace(found, doubts=doubts)).tables["residuals"]
    fitted = table[~table["held_out"]].reset_index(drop=True)
    assert np.flatnonzero(fitted["weighed_down"]).tolist() == [7]
    row = found.training.steps.iloc[5]
    assert set(zip(*fitted.loc[fitted["weight_doubted"], ["sequence", "step"]].to_numpy().T, strict=True)) == {
        (row["sequence"], row["step"])
    }
