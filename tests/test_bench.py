"""The bench in miniature: its tables are whole and its errors are those of the models.  Time is never judged here."""

import json
import re
from collections import Counter
from itertools import pairwise
from math import hypot, sqrt

import numpy as np
import pandas as pd
import pytest

from prb3r.bench import arithmetic, commands, methods
from prb3r.bench.arithmetic import APART, SCALAR, VECTOR
from prb3r.bench.commands import Cost, cost_of
from prb3r.bench.counting import OPERATION_WEIGHTS, Counted, count_solve, text_of, weighted
from prb3r.bench.diagnosis import GOALS_S, SEQUENCES, WORST, diagnosis_goals, grown
from prb3r.bench.measure import measure
from prb3r.bench.methods import ELASTICA_ENGINE, FSOLVE, HISTORY_ENGINE, INTEGRAL, PRB_ENGINE
from prb3r.bench.paths import PREDICTION, SOLVE, path_tasks, wrist
from prb3r.bench.prototype import prototype, table_2
from prb3r.bench.tables import bench_json, bench_page
from prb3r.mechanics.angle import exponential
from prb3r.mechanics.chain import Loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.mechanics.kernel import kernel
from prb3r.mechanics.plate import GAUSS_POINTS, gauss_collocation, plate_model
from prb3r.model.manipulator import Manipulator
from prb3r.proof.concealed.designs import design_of, followed


@pytest.fixture(scope="module")
def result():
    """Against as many Gauss points as the elastica has: kernels of one more shape would take as long as all else.
    Operations are counted of springs alone, one by one in Python."""
    of_springs = [(name, of) for name, of in arithmetic._counted() if ELASTICA_ENGINE not in name]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(methods, "CONVERGED_POINTS", GAUSS_POINTS)
        patch.setattr(arithmetic, "_counted", lambda: of_springs)
        return measure(equilibria=40, rounds=1, lengths=(14, 28))


@pytest.mark.long
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


def test_every_way_to_equilibria_is_timed_beside_the_kernel(result):
    paths, growth = result.paths, result.growth
    assert paths["path"].tolist() == [SOLVE, PREDICTION]
    assert (paths[["times_kernel", "time_each_s", "kernel_time_each_s"]] > 0).all(axis=None)
    firsts = growth.groupby("varied", sort=False).first()
    assert firsts["of_first"].tolist() == [1, 1, 1]
    assert firsts.index.tolist() == ["segments", "cables", "cases"]
    assert result.commands is None
    assert result.compilation is None


def test_tasks_of_a_way_solve_what_the_kernel_solves():
    kernel, table, states, readings = (task.run() for task in path_tasks(6, 2))
    assert np.array_equal(table.reshape(kernel.shape), kernel)
    x = readings.reshape(2, 40, 14, 3)[..., 0]
    assert np.array_equal(x, states[:, :, 1:])


@pytest.mark.parametrize("segments", [1, 2, 7])
def test_the_prototype_has_as_many_plates_in_any_number_of_segments(segments):
    chain = Manipulator.model_validate(wrist(segments, 5)).chain()
    assert (chain.plates, chain.offset.shape) == (14, (14, 5))
    assert chain.reach.max() == 14


def test_costs_of_commands_are_told_by_what_one_more_configuration_takes(monkeypatch):
    def cost_of(words, folder, **environment):
        count, fast = next(int(n) for n in re.findall(r"\d+", words[1] + words[2]) if int(n) > 1), "2" in words[-1:]
        assert (folder / "wrist.toml").exists()
        return Cost(3.0 + 20e-6 * count, 5.0 + 20e-6 * count / (1.6 if fast else 1), 100.0)

    monkeypatch.setattr(commands, "cost_of", cost_of)
    monkeypatch.setattr(commands, "kernel_in", lambda rounds: iter([10e-6] * rounds))
    told, ratios = commands.command_tables(2, lambda text: None)
    assert len(told) == 8
    assert ratios["times_kernel"].tolist() == pytest.approx([2, 2, 2])
    assert ratios["two_workers"].tolist()[2] == pytest.approx(1.6)
    assert told["peak_mib"].tolist() == [100.0] * 8


def test_a_command_is_run_to_its_end_and_what_it_took_is_known(tmp_path):
    cost = cost_of(["schema", "manipulator"], tmp_path)
    assert min(cost) > 0
    assert cost.peak_mib > 10
    with pytest.raises(RuntimeError, match="no such file"):
        cost_of(["check", "none.toml"], tmp_path)


def test_result_is_a_page_and_json(result):
    page = bench_page(result)
    for name in (*result.methods["method"], *result.goals["goal"], result.machine["processor"]):
        assert name in page
    plain = json.loads(bench_json(result))
    assert set(plain) == {
        *("machine", "compilation", "methods", "scaling", "jacobians", "paths", "growth", "commands"),
        *("arithmetic", "peaks", "diagnosis", "goals"),
    }
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


@kernel
def _area(x, y):
    return 0.5 * x * y


@kernel
def _mixed(x, y):
    """Products: two of the area and the quotient by a number of the text; the first sum and the unit are free."""
    total = 0.0
    for number in (x, y):
        total += number
    total = 1.0 * total - (3.0 - 1.0)
    return sqrt(abs(-total)) / y + hypot(_area(x, y) / 4.0, max(x, y))


def test_operations_of_a_small_expression_are_counted_exactly():
    tally = Counter()
    found = text_of(_mixed)(Counted(3.0, tally), Counted(8.0, tally))
    assert float(found) == 3 / 8 + hypot(3, 8)
    assert tally == {"additions": 3, "products": 3, "quotients": 1, "square_roots": 1, "functions": 1}
    assert weighted(tally) == 3 + 3 + 4 + 4 + 8


def test_functions_that_kernels_work_out_in_line_are_counted_as_they_stand():
    inside, beyond = Counter(), Counter()
    assert float(text_of(exponential)(Counted(0.2, inside))) == pytest.approx(np.exp(0.2), rel=1e-15)
    assert float(text_of(exponential)(Counted(2.0, beyond))) == np.exp(2.0)
    assert beyond["functions"] == 1
    assert inside["functions"] == 0 < inside["products"]


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_counted_solve_is_the_solve_and_grows_with_the_plates(mu):
    counted = {}
    for finer in (1, 3):
        chain = prototype(plate_model("prb3r"), mu, finer)
        steps = table_2(chain)
        states, tally = count_solve(chain, steps)
        compiled = solve_chain(chain, steps, detail=False)
        assert states.work.tolist() == compiled.work.tolist()
        assert np.abs(states.angle - compiled.angle).max() < 1e-13
        assert set(tally) <= set(OPERATION_WEIGHTS)
        counted[finer] = weighted(tally) / compiled.work.sum()
    assert counted[3] == pytest.approx(counted[1], rel=0.2)  # an evaluation of a plate is what it is in any chain
    assert counted[1] > 14  # multiply-adds that place a plate's nodes alone


@pytest.mark.parametrize("mu", [0.0, 0.3])
def test_a_counted_solve_of_the_elastica_is_the_solve_and_takes_more_than_springs_do(mu):
    operations = []
    for plate in (plate_model("prb3r"), gauss_collocation()):
        chain = prototype(plate, mu)
        steps = Loads(*(values[:2] for values in table_2(chain)))
        states, tally = count_solve(chain, steps)
        assert np.abs(states.angle - solve_chain(chain, steps, detail=False).angle).max() < 1e-13
        operations.append(weighted(tally))
    assert operations[1] > operations[0]


def test_friction_and_plates_take_operations_and_no_peak_is_passed(result):
    table = result.arithmetic.set_index("method")
    assert (
        table.loc["engine, PRB 3R, mu 0.3", list(OPERATION_WEIGHTS)[:4]]
        > table.loc[PRB_ENGINE, list(OPERATION_WEIGHTS)[:4]]
    ).all()
    assert (table["operations"] > table["additions"] + table["products"]).all()
    for share in ("of_scalar_peak", "of_vector_peak"):
        assert table[share].between(0, 1, inclusive="neither").all()
    peaks = result.peaks.set_index("peak")["operations_per_s"]
    assert peaks.index.tolist() == [SCALAR, APART, VECTOR]
    assert (peaks > 1e8).all()
    reached = table["operations"] / table["time_each_s"]
    assert (reached / peaks[SCALAR]).to_numpy() == pytest.approx(table["of_scalar_peak"].to_numpy())
