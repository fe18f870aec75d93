import itertools
import re

import numpy as np
import pandas as pd
import pytest

from prb3r.present import style
from prb3r.present.study.report import Source, write_report
from prb3r.quantities import Quantity
from prb3r.study.spec import Study

STUDY = Study.model_validate(
    {
        "name": "small",
        "title": "Shift <over> friction",
        "question": "How far?",
        "manipulator": "m.toml",
        "factor": [
            {"name": "friction_coefficient", "path": "friction.coefficient", "values": [0.0, 0.3, 0.6]},
            {"name": "order", "level": [{"label": "1 | first"}]},
        ],
        "comparison": [{"name": "gain", "kind": "ratio", "of": "tip_x_m", "to": {"friction_coefficient": 0.0}}],
        "plot": [{"name": "shift", "kind": "workspace"}],
    }
)
QUANTITIES = [Quantity("tip_x_m", "x", "m", "where the tip is"), Quantity("gain", "", "1", "ratio to no friction")]
MANIFEST = {
    "key": "abcdef0123456789ff",
    "versions": {"numpy": "2.1"},
    "git": {"revision": "0123456789abcdef", "dirty": True},
    "run": {"seconds": 1.25, "cases_computed": 3},
    "timing": [{"model": "prb3r", "microseconds_per_equilibrium": 8.123456}],
    "fits": [
        {"x": "friction_coefficient", "y": "tip_x_m", "slope": 0.0568, "intercept": 0.1, "largest_deviation": 1.1e-3}
    ],
}


@pytest.fixture
def cases() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "case_id": [0, 1, 2],
            "friction_coefficient": [0.0, 0.3, 0.6],
            "order": ["1 | first"] * 3,
            "outcome": ["converged", "converged", "no equilibrium"],
            "reason": ["", "", "lost & gone"],
            "tip_x_m": [0.1, 0.123456, np.nan],
            "gain": [1.0, 1.5, np.nan],
        }
    )


@pytest.fixture
def pages(tmp_path, cases) -> tuple[str, str]:
    (tmp_path / "shift.png").write_bytes(b"picture")
    (tmp_path / "shift.svg").write_bytes(b"<svg/>")
    summary, page = write_report(tmp_path, Source(STUDY, cases, QUANTITIES, MANIFEST), [("shift", "How it looks.")])
    return summary.read_text(), page.read_text()


def test_both_pages_say_what_was_found(pages):
    for text in pages:
        assert "3 cases, 1 of them without a stable equilibrium" in text
        assert "Tip x (mm)" in text
        assert "123.5" in text
        assert "Tip x: 56.8 mm per unit μ, within 1.1 mm, 100 mm at μ = 0" in text
        assert "8.123" in text
        assert "012345678" in text
        assert "How it looks." in text


def test_page_is_one_file_and_escapes_words(pages):
    page = pages[1]
    assert "Shift &lt;over&gt; friction" in page
    assert "lost &amp; gone" in page
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert page.count('src="data:image/png;base64,') == 1  # a workspace, although its SVG is smaller
    assert page.count("<tr>") > len(MANIFEST["timing"]) + 3


def test_summary_links_pictures_and_keeps_its_tables_whole(pages):
    summary = pages[0]
    assert "![shift](shift.png)" in summary
    tables = re.findall(r"(?:^\|.*\|$\n?)+", summary, re.M)
    assert len(tables) == 5
    for table in tables:
        rows = table.strip().splitlines()
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in rows}) == 1


def test_cases_compared_with_themselves_do_not_count(pages):
    assert "| Gain | 1.5 | 1.5 | 1.5 |" in pages[0]


def test_large_studies_are_not_listed_case_by_case(tmp_path, cases):
    many = pd.concat([cases] * 200, ignore_index=True)
    page = write_report(tmp_path, Source(STUDY, many, QUANTITIES, {}))[1].read_text()
    assert page.count("<tr>") < 60
    assert "600 cases are too many for this page" in page
    assert "Laws" not in page


def test_the_first_lines_tell_what_differs_and_by_how_much(tmp_path, cases):
    cases = cases.assign(gain=[1.0, 1.5, 2.5], outcome="converged")
    pages = write_report(tmp_path, Source(STUDY, cases, QUANTITIES, MANIFEST))
    told = "Gain, against Friction coefficient 0: from 1.5 (Friction coefficient 0.3) to 2.5 (Friction coefficient 0.6)"
    summary, page = (path.read_text() for path in pages)
    assert summary.index(told) < summary.index("## What was varied")
    assert page.index(told) < page.index("</head>") < page.index(f'<p class="answer">{told}')


def test_missing_figure_is_named(tmp_path, cases):
    with pytest.raises(FileNotFoundError, match="plot 'shift' is missing"):
        write_report(tmp_path, Source(STUDY, cases, QUANTITIES, MANIFEST), [("shift", "")])
    assert list(tmp_path.iterdir()) == []


def test_numbers_for_people():
    assert [style.digits(value) for value in (0, 1234.56, -0.0567891, 3.2e-7, 1e9, np.nan, 12.0)] == [
        "0", "1,235", "−0.05679", "3.2e−7", "1e9", "–", "12"
    ]  # fmt: skip
    assert style.with_unit(30, "°") == "30°"
    shown = style.shown(Quantity("tip_angle_rad", "", "rad", ""), [0.1])
    assert (shown.label, shown.factor * np.pi) == ("Tip angle (°)", pytest.approx(180))
    assert style.shown(Quantity("area_m2", "", "m^2", ""), [0.3]).label == "Area (m²)"


def test_key_numbers_stand_apart_for_alternatives(tmp_path):
    study = Study.model_validate(
        {
            "name": "small",
            "title": "Cut",
            "manipulator": "m.toml",
            "factor": [{"name": "cut", "level": [{"label": "intact"}, {"label": "cable 1"}]}],
        }
    )
    cases = pd.DataFrame({"case_id": [0, 1], "cut": ["intact", "cable 1"], "tip_x_m": [0.4, 0.1]})
    cases = cases.assign(outcome="converged", reason="")
    write_report(tmp_path, Source(study, cases, QUANTITIES[:1], MANIFEST | {"fits": []}))
    lines = (tmp_path / "summary.md").read_text().split("## Key numbers")[1].split("\n\n")[1].splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    assert [row[1:5] for row in rows] == [["intact", *["400"] * 3], ["cable 1", *["100"] * 3]]


def test_key_numbers_are_of_every_alternative_as_far_as_they_can_be_read(tmp_path):
    names = {"payload": ["80 g", "300 g"], "most": ["60 N", "120 N"], "cut": ["none", "up", "down"]}
    factors = [{"name": name, "level": [{"label": label} for label in labels]} for name, labels in names.items()]
    few = [{"kind": "position"}]
    many = [*few, {"kind": "safety"}, {"kind": "workspace", "tension_n": {"1": 9}}]
    for metric, groups, mixed in ((few, 12, ""), (many, 6, "Each row is over all values of Most.")):
        study = Study.model_validate(
            {"name": "small", "title": "Cut", "manipulator": "m.toml", "factor": factors, "metric": metric}
        )
        quantities = [quantity for each in study.metric for quantity in each.quantities()]
        columns = {quantity.name: np.arange(12.0) for quantity in quantities}
        columns |= {"case_id": range(12), "outcome": "converged", "reason": ""}
        cases = pd.DataFrame(itertools.product(*names.values()), columns=list(names)).assign(**columns)
        summary, _ = write_report(tmp_path, Source(study, cases, quantities, {}))
        numbers, every = summary.read_text().split("## Key numbers")[1].split("## Every case")
        assert numbers.count("| Tip x") == groups
        assert ("Each row is over" in numbers) == bool(mixed)
        assert mixed in numbers
        assert "Workspace tension" not in numbers  # that is what the loads were drawn up to
        assert ("Workspace tension" in every) == (metric is many)
        assert every.split("##")[0].count("| converged |") == 12


def test_words_that_go_along_with_a_number_do_not_part_key_numbers(tmp_path):
    levels = [{"name": "cut", "level": [{"label": "intact"}, {"label": "cable 1"}]}]
    levels += [{"name": "force", "zip": "z", "level": [{"label": f"{n} N"} for n in (1, 2, 3)]}]
    levels += [{"name": "ratio", "zip": "z", "path": "friction.coefficient", "values": [0.1, 0.2, 0.3]}]
    study = Study.model_validate({"name": "small", "title": "Cut", "manipulator": "m.toml", "factor": levels})
    cases = pd.DataFrame(
        {
            "case_id": range(6),
            "cut": ["intact", "cable 1"] * 3,
            "force": [f"{n} N" for n in (1, 1, 2, 2, 3, 3)],
            "ratio": [0.1, 0.1, 0.2, 0.2, 0.3, 0.3],
            "tip_x_m": [0.4, 0.1, 0.3, 0.2, 0.2, 0.3],
        }
    ).assign(outcome="converged", reason="")
    write_report(tmp_path, Source(study, cases, QUANTITIES[:1], MANIFEST | {"fits": []}))
    lines = (tmp_path / "summary.md").read_text().split("## Key numbers")[1].split("\n\n")[1].splitlines()
    assert [line.split("|")[2].strip() for line in lines[2:]] == ["intact", "cable 1"]


def test_what_has_no_bound_is_told_and_the_least_beside_it_is_true(tmp_path, cases):
    study = STUDY.model_copy(update={"factor": [], "comparison": [], "plot": []})
    unbounded = cases.assign(tip_x_m=[0.4, 0.5, np.inf], outcome="converged")
    summary, page = (path.read_text() for path in write_report(tmp_path, Source(study, unbounded, QUANTITIES[:1], {})))
    assert "| Tip x (mm) | 400 | 500 | without bound |" in summary
    assert re.search(r"400</td>\s*<td[^>]*>500</td>\s*<td[^>]*>without bound</td>", page)
