"""Cases are known by their content: only what is new is computed, and how cases are put together changes nothing."""

from pathlib import Path

import pyarrow.parquet as pq
import pytest

from prb3r.runs.parts import Parts
from prb3r.runs.tasks import Workers
from prb3r.study import case_problems
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, solve_study

ROOT = Path(__file__).parents[2]
SPEC = f"""
name = "trial"
title = "A trial"
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "path"
[[factor]]
name = "cable_1_n"
path = "step.1.cable_1_n"
values = [5, 20, 60, 1e6]
[[factor]]
name = "mu"
path = "friction.coefficient"
values = [0.0, 0.3]
[[factor]]
name = "order"
[[factor.level]]
label = "1 then 3"
[[factor.level]]
label = "3 alone"
set = {{ "step.1.cable_1_n" = 1.0 }}
[initial]
cable_4_n = 30
[[step]]
cable_1_n = 0
[[step]]
cable_3_n = 20
slip_1 = 1
[[metric]]
kind = "position"
disk = 7
"""
METRICS = "".join(
    f'[[metric]]\nkind = "{kind}"\n{more}\n'
    for kind, more in (
        ("shift", "disk = 7"),
        ("curvature-error", ""),
        ("coupling", 'cable = "1"\ndisk = 7'),
        ("drive-tension", 'cable = "1"\nsegment = 2\nbend_rad = 0.3'),
        ("changing-point", 'cable = "1"'),
        ("friction-direction", ""),
        ("tip-compliance", ""),
        ("safety", ""),
        ("stability", ""),
        ("limit-load", "up_to = 4"),
        ("workspace", "count = 64\n[metric.tension_n]\n1 = 30.0\n3 = 30.0"),
    )
)


@pytest.fixture
def run(tmp_path):
    def go(text=SPEC, name="trial", **options):
        path = tmp_path / f"{name}.toml"
        path.write_text(text.replace('name = "trial"', f'name = "{name}"'))
        return solve_study(path, Options(tmp_path / "out", Workers(), **options))

    return go


def tables(result):
    return [pq.read_table(result.folder / f"{kind}.parquet").replace_schema_metadata() for kind in ("cases", "states")]


def test_how_cases_are_put_together_changes_no_bit_of_any_metric(run):
    whole = run(SPEC + METRICS)
    cut = run(SPEC.replace("states", "chunk = 1\nstates", 1) + METRICS, fresh=True)
    assert (whole.computed, cut.computed) == (16, 16)
    for one, other in zip(tables(whole), tables(cut), strict=True):
        assert one.equals(other)
    assert (cut.cases["outcome"] == "no equilibrium").sum() == 2
    assert cut.cases["tip_compliance_m_per_n"].notna().sum() == 14


def test_only_what_is_new_is_computed(run, tmp_path):
    first = run()
    assert run(SPEC.replace("1e6]", "1e6, 40]")).computed == 2  # the level overrides it in the others
    more = SPEC + '[[metric]]\nkind = "safety"\n'
    (tmp_path / "trial.toml").write_text(more)
    plan = plan_study(tmp_path / "trial.toml", tmp_path / "out")
    missing = plan.missing(Parts(plan.folder))
    assert missing.any(0).tolist() == [False, False, True, False]
    (chunk,) = plan.chunks(missing)
    assert ([metric.kind for metric in chunk.metrics], chunk.states) == (["safety"], "none")
    assert run(more).computed == 16
    assert run(SPEC.replace('states = "path"', 'states = "none"')).computed == 0
    again = run()
    assert again.computed == 0
    for one, other in zip(tables(first), tables(again), strict=True):
        assert one.equals(other)


def test_a_copy_under_another_name_computes_nothing_even_if_the_first_is_removed_then(run):
    first = run()
    copy = run(name="copy")
    assert copy.computed == 0
    for path in (first.folder / ".parts").iterdir():
        path.unlink()
    assert run(name="copy").computed == 0
    for one, other in zip(tables(first), tables(copy), strict=True):
        assert one.equals(other)
    assert run(name="fresh", fresh=True).computed == 16


def test_a_manipulator_is_checked_once_for_all_loads_on_it(run, tmp_path, monkeypatch):
    checked = []
    validate = case_problems.validate
    monkeypatch.setattr(case_problems, "validate", lambda *a: checked.append(a) or validate(*a))
    grid = "linspace = { from = 0, to = 60, count = 20_000 }"
    (tmp_path / "trial.toml").write_text(SPEC.replace("values = [5, 20, 60, 1e6]", grid))
    plan = plan_study(tmp_path / "trial.toml")
    assert len(plan.cases) == 80_000
    assert len(checked) == 4  # twice the friction, for each order
    assert plan.cases[-1].settings["step"][0] == {"cable_1_n": 1.0}
    assert plan.cases[79_996].factors == {"cable_1_n": 60.0, "mu": 0.0, "order": "1 then 3"}
    assert plan.cases[79_996].settings["step"][0] == {"cable_1_n": 60.0}


def test_a_bad_case_among_many_is_told_with_its_factors(run, tmp_path):
    from prb3r.errors import SpecError

    grid = "linspace = { from = -1, to = 60, count = 62 }"
    (tmp_path / "trial.toml").write_text(SPEC.replace("values = [5, 20, 60, 1e6]", grid))
    with pytest.raises(SpecError) as caught:
        plan_study(tmp_path / "trial.toml")
    assert "(cable_1_n = -1.0, mu = 0.0, order = 1 then 3): column cable_1_n: row 2 is -1: a cable cannot push" in str(
        caught.value
    )
    assert len(caught.value.problems) == 1
