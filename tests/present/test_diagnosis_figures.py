"""Figures and page of a diagnosis: what is drawn, for every verdict and every kind of reading."""

import pickle
import re
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from diagnosis.simulated import UNEXPLAINED, WEAK, Case, diagnosed, investigated, rival_of
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from present.browser import stands

from prb3r.diagnosis.confidence import INTERVAL_RISE
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search.rivals import Rival
from prb3r.front.diagnoses import DiagnosisReport
from prb3r.present import rc
from prb3r.present.diagnosis import sentences as say
from prb3r.present.diagnosis.evidence import moment_map, profiles, ranking
from prb3r.present.diagnosis.fits import held_out_errors, residual_sizes
from prb3r.present.diagnosis.misfits import misfits, telling_steps
from prb3r.present.diagnosis.panels import StepAxis, breaks_between
from prb3r.present.diagnosis.report import FIGURES, content, publish_diagnosis
from prb3r.present.diagnosis.sentences import spaced

CLEAN, BENDS = Case(hidden=()), Case(read=("bend_rad",))
ANGLES = Case(read=("angle_rad",))


@pytest.fixture(autouse=True)
def look():
    with rc.in_use():
        yield


def legend(figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def disputed():
    found = investigated()
    other = rival_of(found)
    named = replace(found.named[0], rivals=(Rival(other.model.hypotheses[0], other, 3.0, 1.0),))
    return tell(replace(found, verdict="ambiguous", named=(named,)))


def test_shapes_are_drawn_at_the_steps_that_calibration_misses_most():
    readings = diagnosed().tables["residuals"]
    steps = telling_steps(readings)
    assert len({name for name, _ in steps}) == len(steps) == 3
    size = readings.groupby(["sequence", "step"])["residual_calibrated"].apply(lambda r: (r**2).mean())
    assert size.idxmax() in steps
    figure = misfits(diagnosed())
    above, below = figure.axes[:3], figure.axes[3:]
    assert legend(figure)[:3] == ["measured", "constants refitted alone", "with the effects named"]
    assert all(axes.get_xlabel() == "$x$ (mm)" for axes in above)
    assert "(mm)" in below[0].get_ylabel()
    before, after = (np.concatenate([axes.lines[k].get_ydata() for axes in below]) for k in (0, 1))
    assert after.max() < before.max() / 3


@pytest.mark.parametrize(
    ("case", "word"),
    [(BENDS, "bend of the plate (°)"), pytest.param(ANGLES, "angle of the disk (°)", marks=pytest.mark.long)],
)
def test_where_no_positions_were_read_bends_or_angles_are_drawn(case, word):
    figure = misfits(diagnosed(case))
    assert figure.axes[0].get_ylabel() == word
    assert held_out_errors(diagnosed(case)) is not None


@pytest.mark.long
def test_angles_differ_by_the_shorter_way_round():
    readings = diagnosed(ANGLES).tables["residuals"]
    turned = readings.assign(measured=readings["measured"] + 2 * np.pi)
    found = replace(diagnosed(ANGLES), tables={**diagnosed(ANGLES).tables, "residuals": turned})
    for figure in (misfits(found).axes[3:], held_out_errors(found).axes[1:]):
        assert max(np.abs(line.get_ydata()).max() for axes in figure for line in axes.lines) < 20


def test_the_map_has_a_cell_for_every_plate_and_step_and_fades_noise():
    moments = diagnosed().tables["mismatch"]
    cells = [patch for patch in moment_map(diagnosed()).axes[0].patches if isinstance(patch, Rectangle)]
    assert len(cells) == len(moments)
    darkness = pd.Series([1 - min(cell.get_facecolor()[:3]) for cell in cells])
    assert darkness.groupby(moments["plate"]).mean().idxmax() == 4
    clean = [cell for cell in moment_map(diagnosed(CLEAN)).axes[0].patches if isinstance(cell, Rectangle)]
    assert max(1 - min(cell.get_facecolor()[:3]) for cell in clean) < 0.8 * darkness.max()


def test_sequences_are_apart_on_the_axis_of_steps():
    rows = pd.DataFrame({"sequence": ["a", "a", "b", "b"], "step": [1, 2, 1, 1]})
    assert StepAxis.of(rows).at(rows).tolist() == [0.0, 1.0, 2.8, 2.8]
    assert StepAxis.of(rows).sequences == {"a": (0.0, 1.0), "b": (2.8, 2.8)}


def test_residuals_shrink_to_the_normal_law():
    figure = residual_sizes(diagnosed())
    before, after = (line.get_ydata() for line in figure.axes[1].lines[1:3])
    assert before.max() > 2 > 1.4 > after.max()
    assert "held out" in legend(figure)
    assert figure.axes[1].get_xlabel() == "disk"
    assert residual_sizes(diagnosed(BENDS)).axes[1].get_xlabel() == "plate"
    assert "with the effects named" not in legend(residual_sizes(diagnosed(CLEAN)))


def test_the_ranking_marks_winner_rivals_and_chance():
    figure = ranking(disputed())
    names = [tick.get_text() for tick in figure.axes[0].get_yticklabels()]
    assert names[0] == "weakened plate"
    assert {"named by the diagnosis", "cannot be told from the named one"} <= set(legend(figure))
    bars = [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]
    assert [names[k] for k, bar in enumerate(bars) if bar.get_hatch()] == ["segment stiffness"]
    assert "segment 2; or weakened plate" in [note.get_text() for note in figure.axes[0].texts]
    widths = [bar.get_width() for bar in bars]
    assert widths == sorted(widths, reverse=True)


def test_what_is_named_is_in_the_ranking_with_its_own_place():
    """Also where its score is smaller than those of many others, and largest at another place."""
    found = diagnosed()
    table = found.tables["ranking"]
    named = table[table["role"] == "named"].assign(place="plate 1", z=0.0)
    others = table[table["role"] != "named"].assign(role="other")
    crowd = pd.concat([others.assign(effect=[f"{kind}_{k}" for kind in others["effect"]]) for k in range(5)])
    (axes,) = ranking(replace(found, tables={**found.tables, "ranking": pd.concat([crowd, named])})).axes
    assert [label.get_text() for label in axes.get_yticklabels()][-1] == "weakened plate"
    assert "plate 1; named: plate 4" in [text.get_text() for text in axes.texts]
    (axes,) = ranking(found).axes
    assert not any("named" in text.get_text() for text in axes.texts)


def test_no_place_in_the_ranking_is_written_across_the_line_of_chance():
    found = diagnosed()
    table = found.tables["ranking"]
    halved = table.assign(z=table["z"] / 2)  # so that some bars end before the line
    (axes,) = ranking(replace(found, tables={**found.tables, "ranking": halved})).axes
    (line,) = [each for each in axes.lines if each.get_linestyle() == "--"]
    places = [note.xy[0] for note in axes.texts if note.get_text()]
    bars = [bar.get_width() for bar in axes.patches]
    assert min(bars) < line.get_xdata()[0] <= min(places)


def test_profiles_meet_the_line_at_the_interval():
    found = diagnosed()
    (axes,) = profiles(found).axes
    x, y = axes.lines[0].get_data()
    factor = found.effects[0].parameters["factor"]
    assert np.interp(factor.low, x, y) == pytest.approx(INTERVAL_RISE, abs=0.3)
    assert np.interp(factor.value, x, y) == pytest.approx(0, abs=0.05)
    assert profiles(diagnosed(UNEXPLAINED)) is None
    assert profiles(diagnosed(CLEAN)) is None


def test_without_held_out_sequences_there_is_no_figure_of_them():
    found = diagnosed()
    fitted = found.tables["residuals"][~found.tables["residuals"]["held_out"]]
    assert held_out_errors(replace(found, tables={**found.tables, "residuals": fitted})) is None
    assert say.confirmation(replace(found, heldout=None)).startswith("Not confirmed on held-out data")


@pytest.mark.parametrize("case", [Case(), pytest.param(CLEAN, marks=pytest.mark.long), BENDS, UNEXPLAINED])
def test_the_page_is_complete_and_needs_nothing_else(case, tmp_path, tmp_path_factory):
    found = diagnosed(case)
    (tmp_path / "profiles.png").write_bytes(b"of an earlier diagnosis")
    files = publish_diagnosis(found, tmp_path)
    names = {path.name for path in files}
    drawn = {name for name in FIGURES if f"{name}.png" in names}
    assert set(FIGURES) - drawn == (set() if found.verdict == "explained" else {"profiles"})
    assert {path.name for path in tmp_path.iterdir()} == names
    if case in (Case(), UNEXPLAINED):
        stands(tmp_path / "report.html", tmp_path_factory.mktemp("browser"))
    page = (tmp_path / "report.html").read_text()
    assert page.count("<img") == page.count("data:image") == len(drawn)
    assert not re.search(r"https?://(?!www\.w3\.org)", re.sub(r'src="[^"]*"', "", page))
    order = [
        page.index(f"<h2>{title}") for title in ("Where", "What</", "How much", "What else", "What to", "What cal")
    ]
    assert order == sorted(order)
    said = re.sub(r"<script>.*?</script>", "", re.sub(r'src="[^"]*"', "", page), flags=re.S)
    assert "nan" not in said.lower()


def test_the_page_says_the_verdict_and_what_calibration_had_hidden():
    told = content(diagnosed())
    assert told["verdict"] == "Explained: one effect, absent from the nominal model, accounts for the mismatch."
    assert any("too low" in text for text in told["hidden"])
    assert told["alternatives"] == []
    assert content(diagnosed(CLEAN))["verdict"].startswith("Adequate")
    unknown = content(diagnosed(UNEXPLAINED))
    assert unknown["verdict"].startswith("Unexplained")
    assert all("Neither is to be trusted" in text for text in unknown["hidden"])
    other = content(disputed())
    (alternative,) = other["alternatives"]
    text, _, size = alternative.removesuffix("; what is known beforehand speaks against that.").partition(
        " with factor "
    )
    assert text == "weakened plate (plate 4): these recordings cannot tell it from segment stiffness (segment 2)"
    assert float(size) == pytest.approx(3 / (2 + 1 / WEAK["factor"]), abs=0.06)  # the same compliance of three plates
    assert other["verdict"].startswith("Explained, but not in one way alone: one effect (certain) accounts for")
    sure = tuple(replace(effect, rivals=()) for effect in disputed().effects)  # as where a number ends at its bound
    alone = replace(disputed(), effects=sure, alternatives=())
    assert content(alone)["verdict"].startswith("Explained, but with a doubt that the notes tell: one effect (certain)")


@pytest.mark.long
def test_effects_that_meet_the_noise_in_vain_are_doubtful_and_not_poor(tmp_path):
    """Where one law outside the library is likelier than the effects, the fit is good all the same."""
    poor = diagnosed(UNEXPLAINED)
    pages = []
    for name, found in (("poor", poor), ("doubtful", replace(poor, structured=False))):
        publish_diagnosis(found, tmp_path / name)
        pages.append((tmp_path / name / "report.html").read_text())
    assert ["where the fit is still poor" in page for page in pages] == [True, False]
    assert ["doubtful for the reason above" in page for page in pages] == [False, True]


def test_a_place_with_a_unit_is_said_with_it():
    assert spaced("load_dependent_friction (tension_n 2.5)") == "load dependent friction (tension 2.5 N)"
    assert spaced("worn_hole (disk 2, cables 1)") == "worn hole (disk 2, cables 1)"


WEAKENED = Case()


def reported(case=WEAKENED):
    return DiagnosisReport(**vars(diagnosed(case)))


@pytest.mark.parametrize("kind", FIGURES)
def test_every_kind_of_figure_can_be_plotted(kind):
    figure = pickle.loads(pickle.dumps(reported())).plot(kind)
    assert isinstance(figure, Figure)
    assert figure.axes


def test_what_cannot_be_plotted_says_what_can():
    with pytest.raises(ValueError, match="no plot 'shape': the kinds are shapes, missing-moment, ranking"):
        reported().plot("shape")
    with pytest.raises(ValueError, match="this diagnosis has no profiles"):
        reported(CLEAN).plot("profiles")


def test_the_report_is_all_that_the_command_writes(tmp_path):
    files = reported().report(tmp_path / "new")
    assert {path.name for path in files} == {path.name for path in (tmp_path / "new").iterdir()}
    assert {"diagnosis.json", "explained.toml", "residuals.parquet", "report.html", "ranking.svg"} <= {
        path.name for path in files
    }


def test_a_diagnosis_shows_itself_in_a_line_or_three():
    told = repr(reported()).splitlines()
    assert "plate 4" in repr(reported().effects)
    assert len(repr(reported().effects)) < 1000
    assert told[0].startswith("small rig: explained; chi-square per degree of freedom ")
    assert re.fullmatch(r"weakened plate \(plate 4\), factor 0\.6\d* \(0\.\d+ to 0\.\d+\)", told[1])
    assert told[2].startswith("held-out gain ")
    assert len(told) == 3
    assert len(repr(reported(CLEAN)).splitlines()) == 1
    assert len(repr(reported(UNEXPLAINED)).splitlines()) == 3


def test_a_notebook_shows_verdict_statements_and_numbers():
    html = reported()._repr_html_()
    assert "Explained: one effect" in html
    assert "Plate 4 bends as if" in html
    assert html.count("<table>") == html.count("</table>") == 2
    assert "<img" not in html


def test_lines_over_steps_break_between_sequences_alone_whatever_the_steps_are():
    rows = pd.DataFrame([(f"s{k}", 0.1 * step) for k in range(40) for step in range(7)], columns=["sequence", "step"])
    assert breaks_between(StepAxis.of(rows).at(rows)).tolist() == list(range(7, 280, 7))
