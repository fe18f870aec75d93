"""The bench in miniature: its tables are whole and its errors are those of the models.  Time is never judged here."""

import json
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest

from prb3r.bench import methods
from prb3r.bench.diagnosis import GOALS_S, SEQUENCES, WORST, diagnosis_goals, grown
from prb3r.bench.measure import measure
from prb3r.bench.methods import FSOLVE, HISTORY_ENGINE, INTEGRAL, PRB_ENGINE
from prb3r.bench.tables import bench_json, bench_page
from prb3r.mechanics.plate import GAUSS_POINTS
from prb3r.proof.concealed.designs import design_of, followed


@pytest.fixture(scope="module")
def result():
    """Against as many Gauss points as the elastica has: kernels of one more shape would take as long as all else."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(methods, "CONVERGED_POINTS", GAUSS_POINTS)
        return measure(equilibria=40, rounds=1, lengths=(14, 28))


def test_methods_are_timed_and_their_errors_known(result):
    table = result.methods.set_index("method")
    assert (table[["time_of_20_s", "time_each_s", "times_engine"]] > 0).all(axis=None)
    assert table.loc[PRB_ENGINE, "times_engine"] == 1
    assert table.loc[[FSOLVE, INTEGRAL], "equilibria_per_call"].to_list() == [20, 20]
    error = table["tip_error_percent"]
    assert error[PRB_ENGINE] == pytest.approx(0.077, abs=0.001)  # Table 2
    assert error[FSOLVE] == pytest.approx(error[PRB_ENGINE], rel=1e-4)
    assert error[INTEGRAL] < 1e-4
    assert error[HISTORY_ENGINE] == pytest.approx(error["engine, PRB 3R, mu 0.3"], abs=0.1)


def test_scaling_and_goals(result):
    assert result.scaling["plates"].to_list() == [14, 14, 28, 28]
    assert result.scaling["per_plate_of_shortest"].to_list()[:2] == [1, 1]
    goals = result.goals
    larger = goals["relation"] == ">="
    assert list(goals["met"]) == list(
        np.where(larger, goals["measured"] >= goals["asked"], goals["measured"] <= goals["asked"])
    )
    assert goals.loc[goals["goal"].str.contains("tip error"), "met"].all()
    assert (goals.loc[goals["goal"].str.contains("Jacobian"), "measured"] > 0).tolist() == [True] * 3


def test_result_is_a_page_and_json(result):
    page = bench_page(result)
    for name in (*result.methods["method"], *result.goals["goal"], result.machine["processor"]):
        assert name in page
    plain = json.loads(bench_json(result))
    assert set(plain) == {"machine", "methods", "scaling", "jacobians", "diagnosis", "goals"}
    assert plain["methods"][0]["method"] == PRB_ENGINE
    assert plain["machine"]["threads"] == 1


@pytest.mark.parametrize("friction", ["declared", "history"])
def test_recordings_to_diagnose_are_as_large_as_asked(friction):
    design = grown(design_of(3, 0), friction)
    assert design.plates == 14
    assert [len(steps) for steps in design.program] == list(SEQUENCES)
    assert sum(SEQUENCES) == 40
    assert design.manipulator["friction"]["direction"] == friction


def test_a_grown_arm_turns_about_as_far_as_the_drawn_one():
    drawn = design_of(3, 0)
    turns = []
    for design in (drawn, grown(drawn, "declared")):
        path = followed(design.manipulator, design.program[:1])
        assert path is not None
        turns.append(np.abs(path[0].angle).max())
    assert turns[1] == pytest.approx(turns[0], rel=0.25)


def test_declared_slips_of_a_grown_design_are_those_of_its_tensions():
    design = grown(design_of(3, 0), "declared")
    for steps in design.program:
        for before, after in pairwise(steps):
            for name in design.cables:
                change = after[f"cable_{name}_n"] - before[f"cable_{name}_n"]
                assert change * after[f"slip_{name}"] <= 0 or abs(change) < 1e-9


def test_goals_of_the_diagnosis_are_median_and_longest_of_each_kind_of_friction():
    seconds = {"declared": [1.0, 2.0, 40.0], "history": [50.0, 70.0, 90.0]}
    table = pd.DataFrame([{"friction": name, "seconds": s} for name, values in seconds.items() for s in values])
    asked, measured = zip(*((goal[2], goal[3]) for goal in diagnosis_goals(table)), strict=True)
    assert measured == (2.0, 40.0, 70.0, 90.0)
    assert asked == (10.0, 30.0, 60.0, 180.0)
    assert (GOALS_S, WORST) == ({"declared": 10.0, "history": 60.0}, 3.0)
