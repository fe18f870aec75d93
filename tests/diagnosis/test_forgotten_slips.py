"""Columns of slip that were forgotten are told from the tensions, and only where readings speak for them."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from diagnosis.planted import (
    FORGOTTEN_SLIPS,
    example,
    lagging,
    other_steps,
    sorted_by_tension,
    without_slips,
)
from diagnosis.simulated import LOSSY, Case, recorded

from prb3r.diagnosis import blunders as weighed
from prb3r.diagnosis.blunders import without_blunders
from prb3r.diagnosis.checks.setup.find import blunders_of, find_blunder, remedies
from prb3r.diagnosis.checks.setup.quick import slips_as_pulled
from prb3r.diagnosis.checks.setup.slips import FORGOTTEN
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.files import write_record
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.recording.holds import creeping
from prb3r.recording.reading import load_recording


def test_cables_slip_as_their_tensions_change():
    tension = np.array([[10.0, 0.0], [10.0, 5.0], [4.0, 5.0], [6.0, 0.0], [3.0, 1.0]])
    begins = np.array([True, False, False, False, True])
    assert slips_as_pulled(tension, begins).tolist() == [[-1, 0], [-1, -1], [1, -1], [-1, 1], [-1, -1]]


@pytest.mark.long
def test_forgotten_slips_are_taken_from_the_tensions_and_give_the_friction_back(tmp_path):
    """The rig's own friction is 0.27."""
    right = recorded(Case(hidden=(), program="reversing"))
    diagnosis = run_stages(Task(without_slips(right)))
    assert (diagnosis.verdict, [blunder.blunder for blunder in diagnosis.setup]) == ("set-up", [FORGOTTEN_SLIPS])
    assert not diagnosis.effects
    assert diagnosis.constants["friction_coefficient"].explained == pytest.approx(0.27, abs=0.01)
    write_record(diagnosis, tmp_path)
    again = load_recording(tmp_path / "mended")
    np.testing.assert_array_equal(again.loads.slip, right.loads.slip)


@pytest.mark.long
def test_what_is_sure_is_not_held_against_a_search_for_effects_in_its_place(monkeypatch):
    """The tables speak for forgotten slips, and without effects the readings do as much as for any other blunder."""
    lossy = recorded(Case(hidden=(tuple(LOSSY.items()),), program="reversing"))
    (plain,) = blunders_of(without_slips(recorded(Case(hidden=(), program="reversing"))), Settings())
    faint, *_ = blunders_of(without_slips(lossy), Settings())
    assert plain.expected
    assert not faint.sure  # between the odds that suffice and those of other blunders: the two searches are compared
    begun = Mock(side_effect=AssertionError("the recording as it is was searched"))
    monkeypatch.setattr(weighed, "_both_begun", begun)
    monkeypatch.setattr(weighed, "blunders_of", Mock(return_value=(replace(faint, expected=True),)))
    searched, (said,), _, _ = without_blunders(Task(without_slips(lossy)), lambda stage: None, serially)
    assert said.blunder == FORGOTTEN_SLIPS
    assert searched.choice.kinds == {"pulley_friction"}


@pytest.mark.long
def test_columns_of_slip_are_not_said_to_be_forgotten_where_friction_is_hardly_felt():
    for program in ("plain", "reversing"):
        smooth = without_slips(recorded(Case(hidden=(), friction=1e-3, program=program)))
        assert FORGOTTEN in {remedy.kind for remedy in remedies(smooth, Settings())}
        assert not blunders_of(smooth, Settings())


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_columns_of_slip_are_not_said_to_be_forgotten_where_cables_are_drawn_in_throughout(seed):
    """Shaken at every step while the arm is pulled on, for instance."""
    right = recorded(Case(hidden=(), program="reversing"))
    drawn = other_steps(right, **{f"slip_{name}": -1 for name in "1234"})
    noise = np.random.default_rng(seed).standard_normal(right.readings.count) * reading_sd(right)
    read = without_slips(drawn).with_values(predictor(drawn)(Constants()) + noise)
    assert not blunders_of(read, Settings())


@pytest.mark.parametrize(
    ("names", "said"),
    [
        ("1", "the column slip_1 was forgotten"),
        ("14", "the columns slip_1 and slip_4 were forgotten"),
        ("1234", "the slip columns were forgotten"),
        ("", ""),
    ],
)
def test_columns_of_slip_are_missed_where_a_cable_without_one_is_let_go(names, said):
    right = recorded(Case(hidden=(), program="reversing"))
    without = without_slips(right, names)
    forgotten = [remedy for remedy in remedies(without, Settings()) if remedy.kind == FORGOTTEN]
    assert [remedy.blunder.split(":")[0] for remedy in forgotten] == ([said] if said else [])
    for remedy in forgotten:
        np.testing.assert_array_equal(remedy.mend(without).recording.loads.slip, right.loads.slip)


def test_columns_of_slip_are_not_missed_where_slip_follows_the_path_or_nothing_is_let_go():
    loading = other_steps(example(), **{f"cable_{name}_n": range(1, len(example().steps) + 1) for name in "1234"})
    for right in (lagging(), loading):
        assert FORGOTTEN not in {remedy.kind for remedy in remedies(without_slips(right), Settings())}


def test_steps_that_were_sorted_by_tension_are_said_and_let_go_again():
    right = example().only([0, 1, 2, 3])
    noise = np.random.default_rng(0).normal(0.0, reading_sd(right))
    right = right.with_values(predictor(right)(Constants()) + noise)  # with nothing hidden
    wrong = sorted_by_tension(right)
    found = find_blunder(wrong, Settings())
    assert found.blunder == "steps were sorted by tension without a column of slip: of two alike the second was let go"
    order = np.lexsort((right.loads.tension.max(1), right.of_sequence))
    np.testing.assert_array_equal(found.mended.loads.slip, right.loads.slip[order])
    assert list(creeping(wrong))
    assert not list(creeping(found.mended))
