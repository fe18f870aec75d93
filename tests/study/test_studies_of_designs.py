"""Shipped studies that compare designs and their tolerances, run in small, assert one of their numbers."""

import numpy as np
import pytest
from study.small import STUDIES, small

from prb3r.present.study.comparison import advice_on
from prb3r.present.study.publish import publish
from prb3r.study.designs import read_designs
from prb3r.study.run import Options, Workers, solve_study


def test_best_design_begins_with_designs_spread_over_the_ranges():
    frame = small("best-design")
    assert len(frame) == 32
    assert frame["segment_1_plates"].nunique() == 6
    assert (frame["safety_factor"] >= 2).any()


def test_stiffness_designs_trade_coupling_for_tension(tmp_path):
    spec = (STUDIES / "stiffness-designs.toml").read_text()
    spec = spec.replace("manipulators/", f"{STUDIES}/manipulators/").replace("count = 8192", "count = 256")
    spec = spec.replace("values = [0.0, 0.15, 0.3]", "values = [0.3]").replace("[1.0, 1.26, 1.587, 2.0]", "[1.0, 2.0]")
    (tmp_path / "small.toml").write_text(spec)
    result = solve_study(tmp_path / "small.toml", Options(tmp_path / "out", Workers(jobs=2)))
    assert result.failed == 0
    advice = advice_on(read_designs([result.folder]))
    comparison = advice.decision
    worth = comparison.values
    assert (
        worth.loc["Thickness ratio 2", "coupling_m_per_n"] < 0.15 * worth.loc["Thickness ratio 1", "coupling_m_per_n"]
    )
    assert worth["drive_tension_n"].iloc[1] == pytest.approx(8 * worth["drive_tension_n"].iloc[0], rel=0.01)
    assert comparison.front == [True, True]
    assert "Recommendation" in advice.markdown


def test_which_design_excludes_both_ends_and_recommends_between_them(tmp_path):
    spec = (STUDIES / "which-design.toml").read_text()
    spec = spec.replace("manipulators/", f"{STUDIES}/manipulators/").replace("count = 4096", "count = 256")
    spec = spec.replace("values = [0.1, 0.2, 0.3]", "values = [0.3]")
    spec = spec.replace("[1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.8, 2.0]", "[1.0, 1.2, 1.4, 2.0]")
    (tmp_path / "small.toml").write_text(spec)
    result = solve_study(tmp_path / "small.toml", Options(tmp_path / "out", Workers(jobs=2)))
    publish(result)
    advice = advice_on(read_designs([result.folder]))
    assert advice.decision.feasible.tolist() == [False, True, True, False]
    assert advice.decision.excluded_alone(0) == ["Thickness ratio 1"]  # coupling
    assert advice.decision.excluded_alone(1) == ["Thickness ratio 2"]  # tension
    assert advice.recommendation in (result.folder / "summary.md").read_text()
    page = (result.folder / "report.html").read_text()
    assert "<strong>Recommendation: Thickness ratio 1.2.</strong>" in page
    assert "**" not in page


@pytest.mark.long
def test_tolerances_make_the_middle_design_alone_safe_to_build():
    frame = small("tolerances", thickness_ratio=[1.2])
    assert (frame["coupling_m_per_n"] <= 0.82e-3).mean() == pytest.approx(0.98, abs=0.015)
    scatter = np.log(frame["drive_tension_n"]).std()
    assert scatter == pytest.approx(np.hypot(3 * 0.01, 0.02) * np.sqrt(1 / 0.65), rel=0.1)  # EI alone makes 65 %


@pytest.mark.long
def test_sensitivity_of_the_stress_is_to_the_thickness_of_segment_1():
    """Segment 1 is stressed by the moment of cable 3 and its thickness: sigma goes with h^-2, 2 % of 1 %."""
    from prb3r.study.rigs import sobol_table

    frame = small("sensitivity", metrics=["safety"])
    table = sobol_table(frame["peak_stress_pa"].to_numpy().reshape(9, 256))
    assert table[0, 1] < 0.95 < table[0, 2]
    hole = (1e-4 / 0.021) ** 2
    assert table[4, 0] == pytest.approx(hole / (hole + 0.02**2), abs=0.03)
