"""Declared slip is held against the changes of a cable's own tension, without any fit."""

from dataclasses import replace

import numpy as np
import pytest
from recording.dirty import MANIPULATOR, Bench

from prb3r.recording.let_go import slips_by_tension, turns_back
from prb3r.recording.plausibility import contradicted_slips, slips_the_other_way
from prb3r.recording.recording import Measurement

PULLS = [10.0, 30, 20, 5]
DRAWN_IN_AND_OUT = [-1, -1, 1, 1]


@pytest.fixture
def bench(tmp_path):
    """Two sequences in which cable 1 alone is pulled and let go, with its slip declared so."""
    bench = Bench(tmp_path)
    bench.steps = bench.steps.loc[[0, 0, 0, 0, 3, 3, 3, 3]].assign(
        step=[1, 2, 3, 4] * 2, cable_1_n=PULLS * 2, slip_1=DRAWN_IN_AND_OUT * 2
    )
    return bench


def test_slip_with_the_tension_is_never_doubted(bench):
    assert not contradicted_slips(bench.load())
    assert not list(slips_the_other_way(bench.load()))


def test_slip_against_the_tension_is_told_with_its_sequence(bench):
    bench.steps["slip_1"] *= np.where(bench.steps["sequence"] == "b", -1, 1)
    assert contradicted_slips(bench.load()) == {"1": ["b"]}
    (doubt,) = slips_the_other_way(bench.load())
    assert doubt.startswith("slip_1 says in sequence b that cable 1 is paid out where it is pulled harder")


def test_holes_that_do_not_slip_back_at_once_are_no_contradiction(bench):
    bench.steps["slip_1"] = -1
    assert not contradicted_slips(bench.load())


def test_where_another_cable_moves_too_a_cable_may_slip_either_way(bench):
    bench.steps["slip_1"] *= -1
    bench.steps["cable_2_n"] = PULLS[::-1] * 2
    assert not contradicted_slips(bench.load())


def test_cables_let_go_without_a_column_of_slip_are_told(bench):
    bench.steps = bench.steps.drop(columns="slip_1")
    (doubt,) = slips_the_other_way(bench.load())
    assert doubt.startswith("cable 1 is let go at 4 steps, and there is no column slip_1")


def test_all_cables_let_go_without_a_column_of_slip_are_told_in_one_sentence(bench):
    second = bench.steps["sequence"] == "b"
    bench.steps = bench.steps.assign(
        cable_1_n=np.where(second, 0.0, bench.steps["cable_1_n"]), cable_2_n=np.where(second, PULLS * 2, 0.0)
    ).drop(columns="slip_1")
    (doubt,) = slips_the_other_way(bench.load())
    assert doubt.startswith("cables 1, 2 are let go at 4 steps in all, and there are no columns slip_1, slip_2")


def test_a_cable_that_is_held_slips_as_before_though_no_load_cell_reads_it_twice_the_same(bench):
    """The tension of cable 2 scatters by 0.3 % of its 20 N; that of cable 1 rises, falls, is held and rises."""
    bench.steps = bench.steps.iloc[[0] * 6].assign(
        step=range(1, 7), cable_1_n=[10.0, 30, 20, 20.02, 19.98, 22], cable_2_n=[20.0, 19.95, 20.06, 19.9, 20.1, 20]
    )
    bench.markers = bench.markers[bench.markers["sequence"] == "a"]
    measured = replace(bench.load(), measurement=Measurement(position_sd_m=3e-4, tension_sd_relative=0.003))
    assert slips_by_tension(measured)[:, :2].T.tolist() == [[-1, -1, 1, 1, 1, -1], [-1] * 6]
    exact = replace(measured, measurement=Measurement(position_sd_m=3e-4))
    assert slips_by_tension(exact)[:, 1].tolist() == [-1, 1, -1, 1, -1, 1]


def test_a_cable_turns_back_once_where_it_is_let_go_and_where_it_is_pulled_again(bench):
    """From rest at the beginning of every sequence, so that a first pull is none, and none where it is held."""
    assert turns_back(bench.load())[:, 0].tolist() == [False, False, True, False] * 2
    bench.steps["cable_1_n"] = [10.0, 30, 30, 5, 10, 5, 8, 20]
    assert turns_back(bench.load())[:, 0].tolist() == [False, False, False, True, False, True, True, False]


def test_a_cable_that_is_let_go_little_by_little_is_let_go(bench):
    """By 0.5 % a step, of which no one is felt alone."""
    bench.steps = bench.steps.iloc[[0] * 6].assign(step=range(1, 7), cable_1_n=[20.0, 19.9, 19.8, 19.7, 19.6, 19.5])
    bench.markers = bench.markers[bench.markers["sequence"] == "a"]
    measured = replace(bench.load(), measurement=Measurement(position_sd_m=3e-4, tension_sd_relative=0.003))
    assert slips_by_tension(measured)[:, 0].tolist() == [-1, -1, -1, 1, 1, 1]


def test_without_a_column_nothing_is_declared_that_could_contradict(bench):
    """All but the first of twelve steps let the cable go."""
    long = bench.steps.iloc[[0] * 12].assign(step=range(1, 13), cable_1_n=range(24, 0, -2))
    bench.steps, bench.markers = long.drop(columns="slip_1"), bench.markers[bench.markers["sequence"] == "a"]
    assert not contradicted_slips(bench.load())
    bench.steps = long.assign(slip_1=-1)
    assert contradicted_slips(bench.load()) == {"1": ["a"]}


@pytest.mark.parametrize("friction", ['direction = "history"', "coefficient = 0"])
def test_where_slip_is_not_declared_or_changes_nothing_none_is_doubted(bench, friction):
    bench.steps["slip_1"] *= -1
    kept = [line for line in MANIPULATOR.splitlines() if not line.startswith(friction.split()[0])]
    bench.manipulator = "\n".join(kept).replace("[friction]", f"[friction]\n{friction}")
    assert not list(slips_the_other_way(bench.load()))
