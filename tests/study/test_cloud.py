"""Clouds of loads: what is computed block by block, by however many workers, is what is computed at once."""

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import scipy

from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.solve import solve
from prb3r.present.study import thinning
from prb3r.present.study.publish import publish
from prb3r.runs.parts import Parts
from prb3r.runs.tasks import Workers
from prb3r.study import run as running
from prb3r.study import workspace
from prb3r.study.converged import workspace_warnings
from prb3r.study.plan import plan_study
from prb3r.study.run import Options, forecast, solve_study
from prb3r.study.work import tasks_of
from prb3r.study.workspace import cloud_loads

ROOT = Path(__file__).parents[2]
SPEC = f"""
name = "cloud"
title = "A cloud"
manipulator = "{ROOT}/studies/manipulators/two-segment.toml"
states = "path"
state_disks = [14]
[cloud]
count = 40_000
tension_n = {{ 1 = 100.0, 3 = 60.0 }}
[[metric]]
kind = "workspace"
[[plot]]
name = "reach"
kind = "workspace"
"""


@pytest.fixture
def spec(tmp_path):
    def write(text=SPEC) -> Path:
        path = tmp_path / "cloud.toml"
        path.write_text(text)
        return path

    return write


class Heard:
    """A listener that remembers."""

    def __init__(self):
        self.begun, self.steps = [], []

    def begin(self, name, cases, done, what="cases"):
        self.begun.append((cases, done, what))

    def advance(self, cases, failed):
        self.steps.append((cases, failed))

    def end(self): ...


def test_the_loads_of_a_block_are_those_of_the_whole_cloud(spec):
    manipulator = plan_study(spec()).cases[0].manipulator()
    chain, limits = manipulator.chain(), {"1": 100.0, "2": 5.0, "4": 60.0}
    whole = cloud_loads(manipulator, chain, limits, np.arange(3000))
    for numbers in (range(7), range(7, 8), range(1024, 3000), (0, 1, 2, 7, 8, 2999), (5, 2998)):
        block = cloud_loads(manipulator, chain, limits, np.array(numbers))
        for some, every in zip(block, whole, strict=True):
            assert np.array_equal(some, every[list(numbers)])


@pytest.mark.long
def test_blocks_give_what_the_equilibria_of_the_whole_cloud_are(spec, tmp_path):
    heard = Heard()
    result = solve_study(spec(), Options(tmp_path / "out", Workers(jobs=2)), heard)
    assert heard.begun == [(40_000, 0, "loads")]
    assert sorted(heard.steps) == [(40_000 - 2 * 16_384, 0), (16_384, 0), (16_384, 0)]
    assert len(list((result.folder / ".parts").iterdir())) == 4  # the case and three blocks of states
    states = result.states()
    assert states["step"].tolist() == list(range(1, 40_001))
    manipulator = result.plan.cases[0].manipulator()
    chain = manipulator.chain()
    rows = np.array([0, 16_383, 16_384, 39_999])
    loads = cloud_loads(manipulator, chain, {"1": 100.0, "3": 60.0}, np.arange(40_000))
    alone = solve_chain(chain, type(loads)(*(field[rows] for field in loads)), from_rest=True)
    assert np.array_equal(states["x_m"].to_numpy()[rows], alone.x[:, -1])
    assert np.array_equal(states["cable_3_n"].to_numpy()[rows], loads.tension[rows, 2])
    assert result.cases["workspace_area_m2"].item() > 0.001
    hull = scipy.spatial.ConvexHull(states[["x_m", "y_m"]].to_numpy())
    assert np.isclose(result.cases["workspace_hull_m2"].item(), hull.volume, rtol=1e-12, atol=0)
    again = solve_study(spec(), Options(tmp_path / "out"), heard)
    assert (again.computed, heard.begun[-1]) == (0, (40_000, 40_000, "loads"))


def test_however_a_cloud_is_cut_it_is_the_same(spec, tmp_path, monkeypatch):
    text = SPEC.replace("40_000", "2_000")
    whole = solve_study(spec(text), Options(tmp_path / "whole"))
    monkeypatch.setattr(workspace, "MOST_DISKS", 15 * 256)
    plan = plan_study(spec(text))
    (chunk,) = plan.chunks(plan.missing(Parts(tmp_path)))
    assert [task.loads for task in tasks_of(chunk)] == [256] * 7 + [208]
    cut = solve_study(spec(text), Options(tmp_path / "cut"))
    for kind in ("cases", "states"):
        one, other = (pq.read_table(result.folder / f"{kind}.parquet") for result in (whole, cut))
        assert one.equals(other)
    seconds, known = forecast(plan_study(spec(text), tmp_path / "new"))
    assert (seconds > 0, known) == (True, 0)


def test_a_cloud_of_which_a_block_cannot_be_solved_is_one_failed_case(spec, tmp_path):
    bend = 'limit = "bend"\nbend_rad = 3.0\n[[metric]]'
    text = SPEC.replace("[[metric]]", bend, 1).replace("3 = 60.0", "3 = 1e-3")
    result = solve_study(spec(text), Options(tmp_path / "out"))
    assert result.cases["outcome"].item() == "failed"
    assert "does not bend its segment by 3 rad" in result.cases["reason"].item()
    assert len(result.states()) == 0
    assert [path.suffix for path in (result.folder / ".parts").iterdir()] == [".cases"]


def test_a_final_state_of_a_cloud_is_that_of_its_last_load(spec, tmp_path):
    text = SPEC.replace('"path"', '"final"').partition("[[plot]]")[0]
    states = solve_study(spec(text), Options(tmp_path / "out")).states()
    assert states["step"].tolist() == [40_000]


def test_figures_show_the_first_loads_of_large_clouds_and_say_so_where_some_fail(spec, tmp_path, monkeypatch):
    monkeypatch.setattr(thinning, "MOST_ROWS", 3000)
    monkeypatch.setattr(running.Result, "states", lambda self: pytest.fail("all states were read"))
    failing = SPEC.replace("3 = 60.0 }", "3 = 1e6 }\nsafety = 0").replace("40_000", "5_000")
    result = solve_study(spec(failing), Options(tmp_path / "out"))
    drawn = thinning.states_to_draw(result)
    assert (thinning.loads_to_draw(result), drawn["step"].max(), len(drawn)) == (3000, 3000, 3000)
    assert set(drawn) == {"case_id", "step", "disk", "x_m", "y_m"}
    publish(result)
    assert "of the first 3,000 loads without equilibrium" in (result.folder / "reach.svg").read_text()


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        ("count = 40_000", "count = 4_194_305", "must be at most 4194304"),
        (
            'kind = "workspace"\n[[plot]]',
            'kind = "workspace"\ncell = 1e-9\n[[plot]]',
            "must be at least 0.0005",
        ),
    ],
)
def test_what_would_not_fit_into_memory_is_refused_with_the_limit(spec, before, after, said):
    from prb3r.errors import SpecError

    assert before in SPEC
    with pytest.raises(SpecError, match=said):
        plan_study(spec(SPEC.replace(before, after)))


YIELDING = SPEC.replace("100.0", "160.0").replace("40_000", "4_000") + '\n[[metric]]\nkind = "safety"\n'


def test_loads_that_make_plates_yield_count_only_where_they_are_asked_for(spec, tmp_path):
    """What is left out is what a solve of the same loads finds beyond yield; the rest is untouched."""
    found = {
        safety: solve_study(
            spec(YIELDING.replace("[cloud]", f"[cloud]\nsafety = {safety}")), Options(tmp_path / safety)
        )
        for safety in ("0", "1", "1.5")
    }
    manipulator = found["0"].plan.cases[0].manipulator()
    loads = cloud_loads(manipulator, manipulator.chain(), {"1": 160.0, "3": 60.0}, np.arange(4_000))
    pulls = {f"cable_{name}_n": loads.tension[:, k] for k, name in enumerate(manipulator.cable_names)}
    stress = solve(manipulator, {"sequence": range(4_000), "step": 1} | pulls, also=["stress_pa"])
    highest = stress["stress_pa"].to_numpy().reshape(4_000, -1)[:, 1:].max(1)
    for safety, result in found.items():
        row, counted = result.cases.iloc[0], highest * float(safety) <= 1.1e9
        assert result.states()["step"].tolist() == (np.flatnonzero(counted) + 1).tolist()
        assert row["peak_stress_pa"] == pytest.approx(highest[counted].max(), rel=1e-9)
        assert row["workspace_beyond_yield"] == pytest.approx(np.mean(highest * (float(safety) or 1.0) > 1.1e9))
        assert row["workspace_tension_n"] == pytest.approx(loads.tension[counted].max())
    areas = [found[safety].cases["workspace_area_m2"].item() for safety in ("0", "1", "1.5")]
    assert areas == sorted(areas, reverse=True)
    assert areas[2] < areas[1] < areas[0]
    assert found["1.5"].cases["safety_factor"].item() >= 1.5 > found["1"].cases["safety_factor"].item() >= 1
    publish(found["1"])
    assert "of the loads left out, plates would yield" in (found["1"].folder / "reach.svg").read_text()


def test_without_a_yield_stress_all_loads_count(spec, tmp_path):
    path = tmp_path / "arm.toml"
    path.write_text((ROOT / "studies/manipulators/two-segment.toml").read_text().replace("yield_stress_pa", "# "))
    text = YIELDING.replace(f"{ROOT}/studies/manipulators/two-segment.toml", str(path))
    result = solve_study(spec(text), Options(tmp_path / "out"))
    assert len(result.states()) == 4_000
    assert result.cases["workspace_beyond_yield"].isna().all()


def test_a_workspace_that_still_grows_with_its_loads_is_warned_of(spec, tmp_path):
    few = SPEC.replace("40_000", "64").replace('kind = "workspace"\n', 'kind = "workspace"\ncell = 0.002\n', 1)
    result = solve_study(spec(few), Options(tmp_path / "few"))
    publish(result)
    share = result.cases["workspace_half_share"].item()
    assert share < 0.9
    assert f"reaches as little as {100 * share:.0f} % of the area" in (result.folder / "report.html").read_text()
    enough = solve_study(spec(SPEC.replace("40_000", "8_192")), Options(tmp_path / "enough"))
    publish(enough)
    assert "still grow" not in (enough.folder / "report.html").read_text()


ONE_CURVE = SPEC.replace("1 = 100.0, 3 = 60.0", "1 = 100.0, 2 = 100.0, 3 = 100.0, 4 = 100.0").partition("[[plot]]")[0]
ONE_CURVE += """
[[factor]]
name = "broken"
[[factor.level]]
label = "none"
broken = []
[[factor.level]]
label = "2 and 3"
broken = ["2", "3"]
[[comparison]]
name = "retained"
kind = "ratio"
of = "workspace_area_m2"
to = { broken = "none" }
"""


def test_an_area_that_is_that_of_its_cells_is_told_and_warned_of_with_the_remedy(spec, tmp_path):
    """With cables 1 and 4 alone the tip keeps to a curve: its area halves with the cells, and tends to zero."""
    found = {}
    for cell in (0.02, 0.01):
        text = ONE_CURVE.replace('kind = "workspace"', f'kind = "workspace"\ncell = {cell}')
        found[cell] = solve_study(spec(text), Options(tmp_path / str(cell)))
    coarse, fine = (found[cell].cases.set_index("broken") for cell in (0.02, 0.01))
    assert (fine["workspace_half_share"] > 0.95).all()  # by loads alone all is settled
    assert fine["workspace_coarse_m2"].tolist() == pytest.approx(coarse["workspace_area_m2"].tolist(), rel=1e-12)
    assert coarse.loc["2 and 3", "retained"] > 1.4 * fine.loc["2 and 3", "retained"] > 0.25
    assert fine.loc["2 and 3", "workspace_extrapolated_m2"] < 0.05 * fine.loc["2 and 3", "workspace_area_m2"]
    extrapolated = [each.loc["none", "workspace_extrapolated_m2"] for each in (coarse, fine)]
    assert extrapolated[0] == pytest.approx(extrapolated[1], rel=0.07)
    publish(found[0.01])
    report = (found[0.01].folder / "report.html").read_text()
    assert "1 of 2 workspaces are thinner than a cell" in report
    assert "Compare the outline (workspace_hull_m2)" in report
    assert "1 of 2 areas depend on the size of the cells" in report
    here, twice = (each.loc["2 and 3", "retained"] for each in (fine, coarse))
    assert f"in case 1 it is {here:.2g}, in cells twice as wide {twice:.2g}" in report
    outlines = ONE_CURVE.replace("workspace_area_m2", "workspace_hull_m2")
    publish(compared := solve_study(spec(outlines), Options(tmp_path / "outlines")))
    assert "cells" not in " ".join(workspace_warnings(compared.cases, compared.plan.study))


def test_the_area_of_a_disc_is_extrapolated_to_its_own():
    rng = np.random.default_rng(1)
    radius, angle = np.sqrt(rng.uniform(0, 1, 200_000)), rng.uniform(0, 2 * np.pi, 200_000)
    fine, coarse = (workspace.area(radius * np.cos(angle), radius * np.sin(angle), side) for side in (0.04, 0.08))
    assert coarse > 1.06 * np.pi
    assert workspace.extrapolated(fine, coarse) == pytest.approx(np.pi, rel=0.03)


def test_loads_that_are_dropped_are_counted_and_warned_of_where_they_are_many(spec, tmp_path):
    """A workspace within a safety factor rests on the loads that keep it, whatever their number was."""
    for safety, said in (("0", False), ("2.5", True)):
        result = solve_study(
            spec(YIELDING.replace("[cloud]", f"[cloud]\nsafety = {safety}")), Options(tmp_path / safety)
        )
        publish(result)
        (case,) = result.cases.to_dict("records")
        assert case["workspace_loads"] == result.states()["x_m"].notna().sum()
        assert case["workspace_dropped"] == pytest.approx(1 - case["workspace_loads"] / 4_000)
        report = (result.folder / "report.html").read_text()
        assert (f"rest on {case['workspace_loads']:,.0f} loads" in report) == (case["workspace_dropped"] > 0.25) == said


METRICS = """
[[metric]]
kind = "coupling"
cable = "4"
disk = 7
load_n = 5.0
[[metric]]
kind = "drive-tension"
cable = "2"
segment = 1
bend_rad = 0.5
[[metric]]
kind = "tip-compliance"
"""
THICKNESS = """
[[factor]]
name = "thickness_m"
path = "segment.1.thickness_m"
values = [0.0008, 0.0012]
"""


def test_workspace_and_coupling_are_told_and_drawn_by_one_study(spec, tmp_path):
    """Without loads the answer to a little more load is that of a study whose only step pulls nothing."""
    drawn = '\n[[plot]]\nname = "coupling"\nkind = "lines"\nx = "thickness_m"\ny = ["coupling_m_per_n"]\n'
    both = solve_study(spec(SPEC.replace("40_000", "400") + METRICS + THICKNESS + drawn), Options(tmp_path / "both"))
    head = SPEC[: SPEC.index("[cloud]")].replace("path", "none").replace("state_disks = [14]\n", "")
    steps = solve_study(spec(head + "[[step]]\ncable_1_n = 0\n" + METRICS + THICKNESS), Options(tmp_path / "steps"))
    for name in ("coupling_m_per_n", "coupling_rad_per_n", "drive_tension_n", "tip_compliance_m_per_n"):
        expected = steps.cases[name].to_numpy()
        assert (expected > 0).all()
        assert both.cases[name].to_numpy() == pytest.approx(expected, rel=1e-9)
    names = {path.name for path in publish(both)}
    assert {"reach.svg", "coupling.svg", "report.html"} <= names
