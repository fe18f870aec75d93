"""Errors that nobody chooses: distributions, shares of rigs, and which error matters."""

import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from prb3r.errors import SpecError
from prb3r.present.study.publish import publish
from prb3r.present.study.rigs import _no_number, rigs_below
from prb3r.quantities import Quantity
from prb3r.runs.store import read_arrow
from prb3r.study.axes import sampled_points
from prb3r.study.decide import decide
from prb3r.study.designs import read_designs
from prb3r.study.plan import plan_study
from prb3r.study.rigs import _quantiles, sobol_table
from prb3r.study.run import Options, Workers, solve_study
from prb3r.study.spec import Study

MANIPULATOR = Path(__file__).parents[2] / "studies" / "manipulators" / "two-segment.toml"
HEAD = f"""
name = "errors"
title = "Errors"
manipulator = "{MANIPULATOR}"
states = "none"
"""
MODULUS = """
[[factor]]
name = "modulus_factor"
times = "youngs_modulus_pa"
lognormal = { sd = 0.1 }
"""
DRIVE = """
[[step]]
cable_1_n = 20
[[metric]]
kind = "drive-tension"
cable = "2"
segment = 1
bend_rad = 1.0
"""


def sampling(method: str, count: int) -> str:
    return f'[sampling]\nmethod = "{method}"\ncount = {count}\n'


def solved(folder: Path, text: str):
    (folder / "errors.toml").write_text(text)
    return solve_study(folder / "errors.toml", Options(folder / "out", Workers(jobs=1)))


def refused(folder: Path, text: str) -> str:
    (folder / "errors.toml").write_text(text)
    with pytest.raises(SpecError) as error:
        plan_study(folder / "errors.toml")
    return str(error.value)


def on_samples(function, drawn: dict, count: int = 4096) -> np.ndarray:
    factors = [{"name": name, "path": f"friction.{name}", **values} for name, values in drawn.items()]
    spec = {"name": "s", "title": "s", "manipulator": "m", "factor": factors}
    study = Study.model_validate(spec | {"sampling": {"method": "saltelli", "count": count}})
    return sobol_table(function(*sampled_points(study).T).reshape(-1, count))


def test_indices_of_ishigamis_function():
    """Ishigami and Homma 1990 with a = 7, b = 0.1: S = 0.3139, 0.4424, 0; S_T = 0.5576, 0.4424, 0.2437."""
    ends = {"range": {"low": -math.pi, "high": math.pi}}
    table = on_samples(
        lambda x, y, z: np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x), {"x": ends, "y": ends, "z": ends}
    )
    assert table[:, 0] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert table[:, 3] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.01)
    exact = np.array([[0.3139, 0.4424, 0.0], [0.5576, 0.4424, 0.2437]])
    assert (exact > table[:, [1, 4]].T).all()
    assert (exact < table[:, [2, 5]].T).all()


def test_indices_of_a_sum_are_shares_of_its_variance():
    normal = {"normal": {"mean": 5.0, "sd": 1.0}}
    table = on_samples(lambda x, y: 3 * x + y, {"x": normal, "y": normal})
    assert table[:, 0] == pytest.approx([0.9, 0.1], abs=0.01)
    assert table[:, 3] == pytest.approx([0.9, 0.1], abs=0.01)


def test_tension_scatters_as_the_modulus_that_it_is_proportional_to(tmp_path):
    result = solved(tmp_path, HEAD + MODULUS + DRIVE + sampling("sobol", 256))
    row = read_arrow(result.folder / "quantiles.parquet").to_pandas().set_index("metric").loc["drive_tension_n"]
    assert row["q_0_95"] / row["q_0_5"] == pytest.approx(math.exp(0.1 * 1.6449), rel=0.01)
    assert row["q_0_05"] / row["q_0_5"] == pytest.approx(math.exp(-0.1 * 1.6449), rel=0.01)
    assert row["rigs"] == 256


def test_more_samples_compute_only_what_is_new(tmp_path):
    solved(tmp_path, HEAD + MODULUS + DRIVE + sampling("sobol", 16))
    again = solved(tmp_path, HEAD + MODULUS + DRIVE + sampling("sobol", 32))
    assert (len(again.cases), again.computed) == (32, 16)


def test_half_of_the_rigs_keep_a_bound_at_the_median(tmp_path):
    """Wilson's interval of 32 of 64 is 0.381 to 0.619."""
    bound = '[[requirement]]\nmetric = "drive_tension_n"\nat_most = {}\n'
    right = solved(tmp_path, HEAD + DRIVE).cases["drive_tension_n"].item()
    result = solved(tmp_path, HEAD + MODULUS + DRIVE + sampling("sobol", 64) + bound.format(right))
    shares = read_arrow(result.folder / "shares.parquet").to_pandas()
    assert shares["kept"].tolist() == [32, 32]  # all of them together, and the only one
    assert shares.iloc[0][["share_low", "share_high"]].tolist() == pytest.approx([0.381, 0.619], abs=5e-4)
    publish(result)
    summary = (result.folder / "summary.md").read_text()
    assert "50.0 % (38.1 to 61.9 %) of 64 rigs of the design keep every requirement" in summary


def test_the_figure_of_rigs_has_the_shares_that_the_text_tells(tmp_path):
    """A rig that breaks a bound in one of two circumstances breaks it."""
    cut = '[[factor]]\nname = "cut"\n[[factor.level]]\nlabel = "none"\n[[factor.level]]\nlabel = "3"\nbroken = ["3"]\n'
    loads = "[[step]]\ncable_1_n = 20\ncable_3_n = 15\n"
    metrics = '[[metric]]\nkind = "position"\n'
    found = solved(tmp_path, HEAD + sampling("sobol", 16) + MODULUS + cut + loads + metrics)
    worst = found.cases.groupby(found.cases["case_id"] % 16)["tip_y_m"].min()
    bound = float(worst.sort_values().iloc[4:6].mean())  # which 11 of 16 rigs keep
    wish = f'[[requirement]]\nmetric = "tip_y_m"\nat_least = {bound}\n'
    result = solved(tmp_path, HEAD + sampling("sobol", 16) + MODULUS + cut + loads + metrics + wish)
    told = result.rigs.shares.iloc[-1]["share"]
    study, quantity = result.plan.study, Quantity("tip_y_m", "y", "m", "")
    values, height = rigs_below(study, result.cases, quantity, study.requirement[0])
    assert told == pytest.approx(11 / 16)
    assert height[values < bound].max() == pytest.approx(1 - told)
    lost = result.cases.assign(tip_y_m=result.cases["tip_y_m"].where(result.cases["case_id"] % 16 != 3))
    values, height = rigs_below(study, lost, quantity, study.requirement[0])
    assert len(values) == 15
    assert height[0] == pytest.approx(2 / 16)  # a rig without a value is on the side that breaks the bound


def test_it_is_said_why_there_are_no_indices():
    cases = pd.DataFrame({"limit_load_factor": [1.0, np.inf, np.inf, np.nan], "outcome": ["converged"] * 4})
    told = "no bound was found in 2 of 4 cases and there is no value in 1 of 4 cases"
    assert _no_number(cases, "limit_load_factor") == told


def test_values_without_end_are_values(tmp_path):
    """Of seven rigs that no load bends too far and one that some does, the quantiles are those of the order."""
    quantity = Quantity("limit_load_factor", "", "1", "factor")
    part = pd.DataFrame({"limit_load_factor": [np.inf] * 7 + [2.0, np.nan], "outcome": "converged"})
    (row,) = _quantiles(part, [quantity])
    assert (row["rigs"], row["failed"]) == (9, 1)
    assert (row["q_0_05"], row["q_0_5"], row["q_0_95"]) == (2.0, np.inf, np.inf)
    assert np.isnan(row["mean"])


def test_a_group_of_factors_may_have_any_name(tmp_path):
    zipped = "".join(
        f'[[factor]]\nname = "{name}"\npath = "segment.{k}.thickness_m"\nvalues = [8e-4, 9e-4]\nzip = "sampled"\n'
        for k, name in ((1, "first_m"), (2, "second_m"))
    )
    result = solved(tmp_path, HEAD + zipped + MODULUS + DRIVE + sampling("sobol", 4))
    assert result.cases[["first_m", "second_m"]].drop_duplicates().to_numpy().tolist() == [[8e-4, 8e-4], [9e-4, 9e-4]]
    assert len(result.cases) == 8


def test_a_time_of_loads_that_a_study_has_not_is_refused(tmp_path):
    cloud = "timing = true\n[cloud]\ncount = 16\ntension_n = { 1 = 20.0 }\n"
    assert "timing goes with [[step]], [initial] or [sweep]" in refused(tmp_path, HEAD + cloud)


def test_a_segment_that_rests_bent_takes_no_tension(tmp_path):
    bent = HEAD + 'set = { effect = [{ kind = "precurvature", curvature_per_m = 12.0 }] }\n'
    assert solved(tmp_path, bent + DRIVE).cases["drive_tension_n"].item() == 0.0


def test_only_the_error_of_a_design_matters_that_its_number_depends_on(tmp_path):
    other = '[[factor]]\nname = "hole_error_m"\nadded_to = "cable.4.offset_m"\nnormal = { sd = 1e-4 }\n'
    result = solved(tmp_path, HEAD + MODULUS + other + DRIVE + sampling("saltelli", 16))
    assert len(result.cases) == 16 * 4
    indices = read_arrow(result.folder / "indices.parquet").to_pandas().set_index(["metric", "error"])
    of_tension = indices.loc["drive_tension_n"]
    assert of_tension.loc["hole_error_m", ["first_order", "total"]].tolist() == pytest.approx([0, 0], abs=1e-9)
    assert of_tension.loc["modulus_factor", "total_high"] > 0.9
    publish(result)
    assert (result.folder / "indices.png").exists()


def test_an_error_of_a_list_is_one_of_each_of_its_numbers(tmp_path):
    error = '[[factor]]\nname = "hole_error_m"\nadded_to = "cable.1.offset_m"\nnormal = { sd = 1e-4 }\n'
    scale = '[[factor]]\nname = "scale"\ntimes = "cable.4.offset_m.1"\nnormal = { sd = 0.01 }\n'
    listed = 'set = { "cable.1.offset_m" = [0.0255, 0.021], "cable.4.offset_m" = [-0.0255, -0.021] }\n'
    (tmp_path / "errors.toml").write_text(listed + HEAD + error + scale + DRIVE + sampling("sobol", 4))
    for case in plan_study(tmp_path / "errors.toml").cases:
        first, second = (cable["offset_m"] for cable in case.settings["manipulator"]["cable"][::3])
        error, scale = case.factors["hole_error_m"], case.factors["scale"]
        assert first == pytest.approx([0.0255 + error, 0.021 + error], rel=1e-15)
        assert second == pytest.approx([-0.0255 * scale, -0.021], rel=1e-15)


LEARNT = """
[[factor]]
name = "learnt"
chosen = false
[[factor.level]]
label = "weak"
set = { youngs_modulus_pa = 1.5e11 }
[[factor.level]]
label = "strong"
set = { youngs_modulus_pa = 2e11 }
"""


def test_levels_that_nobody_chooses_are_rigs_alike_likely(tmp_path):
    thick = '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [8e-4, 1.6e-3]\n'
    bound = '[[requirement]]\nmetric = "drive_tension_n"\nat_most = {}\n'
    result = solved(tmp_path, HEAD + LEARNT + thick + DRIVE + sampling("sobol", 8) + bound.format(1e4))
    counts = result.cases.groupby(["learnt", "thickness_m"]).size()
    assert counts.tolist() == [4, 4, 4, 4]
    drive = result.cases.groupby(["thickness_m", "learnt"])["drive_tension_n"].mean()
    for thickness in (8e-4, 1.6e-3):
        assert drive[thickness, "strong"] / drive[thickness, "weak"] == pytest.approx(2.0 / 1.5, rel=1e-6)
    assert result.plan.study.design_factors == ["thickness_m"]
    shares = read_arrow(result.folder / "shares.parquet").to_pandas()
    assert shares["rigs"].tolist() == [8] * 4
    publish(result)
    summary = (result.folder / "summary.md").read_text()
    assert "Learnt: 2 alternatives that nobody chooses" in summary
    assert "Drive tension (Thickness 0.8 mm)" in summary


def test_errors_add_to_what_earlier_factors_have_set_and_are_no_designs(tmp_path):
    text = HEAD + (
        '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [1e-3, 2e-3]\n'
        '[[factor]]\nname = "sheet_m"\nadded_to = ["segment.1.thickness_m", "segment.2.thickness_m"]\n'
        "normal = { sd = 1e-5, low = 0.0 }\n"
    )
    (tmp_path / "errors.toml").write_text(text + DRIVE + sampling("latin-hypercube", 4))
    plan = plan_study(tmp_path / "errors.toml")
    assert plan.study.design_factors == ["thickness_m"]
    for case in plan.cases:
        first, second = (segment["thickness_m"] for segment in case.settings["manipulator"]["segment"])
        assert first - case.factors["thickness_m"] == pytest.approx(second - 8e-4, abs=1e-15)
        assert case.factors["sheet_m"] >= 0


@pytest.mark.parametrize(
    ("factor", "what"),
    [
        ('name = "mu"\npath = "friction.coefficient"\nnormal = { sd = 0.1 }', "normal needs its mean"),
        ('name = "a"\nadded_to = "cable.1.offset_m"\nnormal = { sd = 0.1 }', "must end in '_m'"),
        ('name = "a_m"\nadded_to = "cable.1.offset_m"\nnormal = { sd = 0.1 }', "0.1 m: lengths are given in metres"),
        ('name = "a_m"\ntimes = "cable.1.offset_m"\nnormal = { sd = 0.1 }', "a multiplier has no unit"),
        ('name = "a"\nadded_to = "model"\nnormal = { sd = 0.1 }', "leads to no number that could be changed: 'prb3r'"),
        ('name = "a"\nchosen = false\npath = "friction.coefficient"\nvalues = [0.1]', "chosen = false is of levels"),
        ('name = "a_m"\nadded_to = "cable.9.offset_m"\nnormal = { sd = 0.1 }', "there is no cable '9'"),
        ('name = "a"\ntimes = "youngs_modulus_pa"\nnormal = { sd = 0.1, low = 2, high = 1 }', "must be less than high"),
    ],
)
def test_a_wrong_error_is_refused(tmp_path, factor, what):
    assert what in refused(tmp_path, HEAD + "[[factor]]\n" + factor + "\n" + DRIVE + sampling("sobol", 4))


def test_wrong_sampling_is_refused(tmp_path):
    assert "power of 2" in refused(tmp_path, HEAD + MODULUS + DRIVE + sampling("saltelli", 100))
    assert "say how it is sampled" in refused(tmp_path, HEAD + MODULUS + DRIVE)
    assert "needs factors that are drawn" in refused(tmp_path, HEAD + DRIVE + sampling("sobol", 4))


def test_what_does_not_scatter_has_no_indices():
    blocks = np.ones((4, 8))
    assert (sobol_table(blocks) == 0).all()


def test_a_robust_requirement_judges_a_design_by_its_rigs(tmp_path):
    """Where the modulus scatters by a tenth, 95 of 100 rigs need less than 1.179 times the nominal tension."""
    right = solved(tmp_path, HEAD + DRIVE).cases["drive_tension_n"].item()
    text = HEAD + '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [0.8e-3, 0.9e-3]\n'
    text += MODULUS + DRIVE + sampling("sobol", 128)
    text += f'[[requirement]]\nmetric = "drive_tension_n"\nat_most = {1.2 * right}\n'
    text += 'over = "quantile"\nquantile = 0.95\n'
    result = solved(tmp_path, text)
    decision = decide(read_designs([result.folder]))
    assert decision.feasible.tolist() == [True, False]
    assert decision.bounded[0, 0] / right == pytest.approx(math.exp(0.1 * 1.6449), rel=0.02)


def test_a_rig_counts_at_the_worst_of_its_circumstances(tmp_path):
    """Under much friction each rig needs more tension than under little: these cases alone make the quantile, and the
    share of the rigs that keep the bound."""
    text = HEAD + '[designs]\nfactors = ["thickness_m"]\n'
    text += '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [0.8e-3, 0.9e-3]\n'
    text += '[[factor]]\nname = "mu"\npath = "friction.coefficient"\nvalues = [0.1, 0.5]\n'
    text += MODULUS + DRIVE + sampling("sobol", 64)
    text += '[[requirement]]\nmetric = "drive_tension_n"\nat_most = 150\nover = "quantile"\nquantile = 0.95\n'
    result = solved(tmp_path, text)
    decision = decide(read_designs([result.folder]))
    shares = read_arrow(result.folder / "shares.parquet").to_pandas()
    much = result.cases[result.cases["mu"] == 0.5].groupby("thickness_m", sort=False)["drive_tension_n"]
    assert decision.bounded[:, 0] == pytest.approx(much.quantile(0.95).to_numpy())
    kept = much.apply(lambda needed: int((needed <= 150).sum())).tolist()
    assert shares[shares["requirement"] == 1]["kept"].tolist() == kept
    assert 0 < kept[0] < 64
