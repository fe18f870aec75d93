"""Whatever the numbers of designs are, there is a decision, in sentences, figures and a table; it keeps its laws."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from study.decided import cases

from prb3r.present.study.comparison import advice_on, decision_pictures
from prb3r.study.wishes import Preference, Requirement

NUMBERS = st.sampled_from([np.nan, np.inf, -np.inf, 0.0, 1.0, 1.0, 2.0, 2.0 + 1e-12, -3.0, 1e-9, 7e8])
METRICS = st.sampled_from(["a_m", "b_n", "c"])
OVERS = st.sampled_from([{}, {"over": "mean"}, {"over": "median"}, {"over": "quantile", "quantile": 0.25}])


@st.composite
def tables(draw):
    """Designs in the same loads, their metrics of any number, some cases without an equilibrium, some of drawn rigs."""
    designs, loads = draw(st.integers(1, 4)), draw(st.integers(1, 3))
    rows = designs * loads
    lost = draw(st.lists(st.booleans(), min_size=rows, max_size=rows))
    table = {
        "design": np.repeat([f"d{k}" for k in range(designs)], loads),
        "load_n": np.tile(np.arange(loads), designs),
    }
    table |= {"scenario": table["load_n"], "outcome": np.where(lost, "limit point", "converged")}
    for metric in ("a_m", "b_n", "c"):
        values = np.array(draw(st.lists(NUMBERS, min_size=rows, max_size=rows)))
        table[metric] = np.where(lost, np.nan, values)
    return table


@st.composite
def wishes(draw):
    bound = st.sampled_from(["at_least", "at_most"])
    asked = [
        Requirement(metric=draw(METRICS), **{draw(bound): draw(st.sampled_from([0.0, 1.5, -1.0]))}, **draw(OVERS))
        for _ in range(draw(st.integers(0, 2)))
    ]
    least = 0 if asked else 1
    better = st.sampled_from(["greater", "less"])
    liked = [
        Preference(metric=draw(METRICS), better=draw(better), weight=draw(st.sampled_from([1.0, 3.0])), **draw(OVERS))
        for _ in range(draw(st.integers(least, 3)))
    ]
    return asked, liked


@pytest.mark.filterwarnings("error")
@settings(max_examples=100, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(tables(), wishes())
def test_any_numbers_make_a_decision(table, wished):
    counsel = advice_on(cases(table, *wished, ["load_n"]))
    decision = counsel.decision
    assert counsel.markdown
    able = [all(r.margin(v) >= 0 for r, v in zip(wished[0], row, strict=True)) for row in decision.bounded]
    assert (decision.winner is not None) == any(able)
    if decision.winner is not None:
        first = decision.designs.index(decision.winner)
        assert able[first]
        assert all(
            not (
                np.all(decision.scores[k] >= decision.scores[first])
                and np.any(decision.scores[k] > decision.scores[first])
            )
            for k in np.flatnonzero(able)
        )


@pytest.mark.filterwarnings("error")
@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(tables(), wishes())
def test_any_decision_is_drawn(tmp_path_factory, table, wished):
    decision = advice_on(cases(table, *wished, ["load_n"])).decision
    folder = tmp_path_factory.mktemp("drawn")
    for paths, _ in decision_pictures(decision, folder, "decision").values():
        assert all(path.stat().st_size > 1000 for path in paths)
