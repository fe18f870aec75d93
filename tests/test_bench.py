"""The bench in miniature: its tables are whole and its errors are those of the models.  Time is never judged here."""

import json

import numpy as np
import pytest

from prb3r import bench
from prb3r.bench import ENGINE, HISTORY, INTEGRAL, SEED, markdown, measure, to_json
from prb3r.mechanics.plate import GAUSS_POINTS


@pytest.fixture(scope="module")
def result():
    """Against as many Gauss points as the elastica has: kernels of one more shape would take as long as all else."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "CONVERGED_POINTS", GAUSS_POINTS)
        return measure(equilibria=40, rounds=1, plates=(14, 28))


def test_methods_are_timed_and_their_errors_known(result):
    methods = result.methods.set_index("method")
    assert (methods[["time_of_20_s", "time_each_s", "times_engine"]] > 0).all(axis=None)
    assert methods.loc[ENGINE, "times_engine"] == 1
    assert methods.loc[[SEED, INTEGRAL], "equilibria_per_call"].to_list() == [20, 20]
    error = methods["tip_error_percent"]
    assert error[ENGINE] == pytest.approx(0.077, abs=0.001)  # Table 2
    assert error[SEED] == pytest.approx(error[ENGINE], rel=1e-4)
    assert error[INTEGRAL] < 1e-4
    assert error[HISTORY] == pytest.approx(error["engine, PRB 3R, mu 0.3"], abs=0.1)


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
    page = markdown(result)
    for name in (*result.methods["method"], *result.goals["goal"], result.machine["processor"]):
        assert name in page
    plain = json.loads(to_json(result))
    assert set(plain) == {"machine", "methods", "scaling", "goals"}
    assert plain["methods"][0]["method"] == ENGINE
    assert plain["machine"]["threads"] == 1
