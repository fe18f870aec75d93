"""What is wrong with a study is said before anything is solved, all of it at once, each with its line."""

import pytest
from command import PROTOTYPE

from prb3r.errors import SpecError
from prb3r.study.plan import plan_study

HEAD = f"""name = "wrong"
title = "wrong"
manipulator = "{PROTOTYPE}"
[[factor]]
name = "load_n"
path = "step.1.cable_1_n"
values = [1.0, 2.0]
[[factor]]
name = "broken"
[[factor.level]]
label = "none"
[[factor.level]]
label = "cable 2"
broken = ["2"]
[[step]]
cable_1_n = 20
"""
TIP = '[[metric]]\nkind = "position"\n'
WRONG = (
    ('[[metric]]\nkind = "position"\ndisk = 77\n', "metric position: there is no disk 77"),
    ('[[metric]]\nkind = "changing-point"\ncable = "9"\n', "metric changing-point: there is no cable '9'"),
    ('[[metric]]\nkind = "workspace"\n', "metric workspace: needs tension_n, as there is no cloud"),
    ('[[metric]]\nkind = "follow"\n', "metric follow: needs [reach]"),
    ('[[plot]]\nname = "w"\nkind = "workspace"\n', "needs [cloud] and states = 'path'"),
    ('[[plot]]\nname = "l"\nkind = "lines"\nx = "load_n"\ny = ["nothing_m"]\n', "there is no column 'nothing_m'"),
    ('[[comparison]]\nname = "c_m"\nkind = "difference"\nof = "none_m"\nto = { load_n = 1.0 }\n', "no column 'none_m'"),
    (
        '[[plot]]\nname = "y"\nkind = "lines"\nx = "load_n"\ny = ["broken"]\n',
        "plot.y: column 'broken' holds words; numbers are needed",
    ),
    ('[[plot]]\nname = "b"\nkind = "bars"\nx = "load_n"\ny = ["reason"]\n', "column 'reason' holds words"),
    (
        '[[plot]]\nname = "v"\nkind = "lines"\nx = "load_n"\ny = ["load_n"]\nvertical = "broken_cables"\n',
        "column 'broken_cables' holds words",
    ),
    (
        '[[plot]]\nname = "u"\nkind = "lines"\nx = "residual_n_m"\ny = ["load_n"]\nvertical = "load_n"\n',
        "load_n in N cannot stand on the axis of residual_n_m in N m",
    ),
    ('[[fit]]\nx = "broken"\ny = "load_n"\n', "fit.1: column 'broken' holds words"),
    (
        '[[comparison]]\nname = "c"\nkind = "ratio"\nof = "outcome"\nto = { load_n = 1.0 }\n',
        "column 'outcome' holds words",
    ),
)
SELECTED = (
    ('[[plot]]\nname = "l"\nkind = "lines"\nx = "load_n"\ny = ["tip_y_m"]\nwhere = { load_n = 3.0 }\n', "load_n = 3.0"),
    (
        '[[plot]]\nname = "s"\nkind = "shapes"\nreference = { broken_cables = "3" }\n',
        "broken_cables = '3'",
    ),
    ('[[fit]]\nx = "load_n"\ny = "tip_y_m"\nwhere = { broken = "cable 3" }\n', "broken = 'cable 3'"),
    ('[[comparison]]\nname = "c_m"\nkind = "difference"\nof = "tip_y_m"\nto = { load_n = 9.0 }\n', "load_n = 9.0"),
)


def problems(folder, text):
    path = folder / "wrong.toml"
    path.write_text(text)
    with pytest.raises(SpecError) as refused:
        plan_study(path)
    return path, [str(problem) for problem in refused.value.problems]


def placed(text, parts):
    """A text with all parts (each with what is to be said of it) behind it, and the line at which each begins."""
    lines = []
    for part, _ in parts:
        lines.append(text.count("\n") + 1)
        text += part
    return text, lines


@pytest.mark.parametrize(("parts", "said"), [(WRONG, ""), (SELECTED, "no case has ")])
def test_everything_that_needs_no_solve_is_told_at_once_with_its_line(tmp_path, parts, said):
    text, lines = placed(HEAD + (TIP if parts is SELECTED else ""), parts)
    path, told = problems(tmp_path, text)
    assert len(told) == len(parts)
    for line, (_, what) in zip(lines, parts, strict=True):
        (problem,) = [problem for problem in told if said + what in problem]
        assert problem.startswith(f"{path}:{line} ")


@pytest.mark.parametrize(
    ("bound", "said"),
    [
        ("at_least = 90", ".at_least: at_least = 90 rad is 14 turns; angles are given in radians: 90 degrees is 1.571"),
        ("at_least = 1.571", None),
    ],
)
def test_a_bound_in_another_unit_is_refused(tmp_path, bound, said):
    text = HEAD + TIP + f'[[requirement]]\nmetric = "tip_angle_rad"\n{bound}\n'
    if said:
        assert said in problems(tmp_path, text)[1][0]
    else:
        (tmp_path / "right.toml").write_text(text)
        plan_study(tmp_path / "right.toml")
    far = HEAD + TIP + '[[requirement]]\nmetric = "tip_x_m"\nat_most = 300\n'
    assert "at_most = 300 m is far beyond the manipulator" in problems(tmp_path, far)[1][0]


def test_mistakes_within_levels_and_values_of_factors_are_told_once_with_their_line(tmp_path):
    level = '[[factor.level]]\nlabel = "{}"\n{}\n'
    text = HEAD + '[[factor]]\nname = "thickness_m"\npath = "segment.2.thickness_m"\nvalues = [-0.1, -0.2, 0.001]\n'
    text += '[[factor]]\nname = "share"\nratio = ["segment.1.thickness_m", "segment.2.thickness_m"]\nvalues = [1, 2]\n'
    path, told = problems(tmp_path, text)
    assert len(told) == 1
    assert told[0].startswith(f"{path}:17 factor.thickness_m ")
    assert told[0].endswith("must be greater than 0, not -0.1; 4 more like this")
    text = HEAD + '[[factor]]\nname = "load"\n' + level.format("tip", "step = [{ tip_z_n = 1.0 }]")
    path, told = problems(tmp_path, text + level.format("cut", 'broken = ["22"]'))
    assert [f"{path}:21 factor.load.level.1.step" in told[0], f"{path}:24 factor.load.level.2" in told[1]] == [True] * 2


MISTAKES = (
    ('[[metric]]\nkind = "positon"\n', "metric.1.kind: unknown kind 'positon'"),
    ('[[factor]]\nname = "no_m"\npath = "segment.9.thickness_m"\nvalues = [1.0]\n', "'9' is not a number from 1 to 2"),
    ('[[factor]]\nname = "late_n"\npath = "step.1.cable_9_n"\nvalues = [1.0]\n', "there is no cable 9"),
    ('[[factor]]\nname = "twice_n"\nvalues = 3\npath = "step.1.cable_2_n"\n', "values: must be a list"),
    ('[[metric]]\nkind = "position"\ndisk = 77\n', "metric position: there is no disk 77"),
    ("[[step]]\ncable_7_n = 3\n", "there is no cable 7"),
    ('[[metric]]\nkind = "changing-point"\ncable = "9"\n', "metric changing-point: there is no cable '9'"),
)
"""Mistakes that show in the file alone, when factors are set, and when loads and metrics meet the manipulator."""


def test_mistakes_of_every_kind_are_told_at_once_each_with_its_line(tmp_path):
    text, lines = placed(HEAD, MISTAKES)
    path, told = problems(tmp_path, text)
    assert len(told) == len(MISTAKES)
    for line, (part, what) in zip(lines, MISTAKES, strict=True):
        (problem,) = [problem for problem in told if what in problem]
        at = int(problem.removeprefix(f"{path}:").partition(" ")[0])
        assert line <= at < line + part.count("\n")


def test_nothing_is_said_that_follows_from_another_mistake_alone(tmp_path):
    step = "[[step]]\ncable_1_n = 20\n"
    plot = '[[plot]]\nname = "l"\nkind = "lines"\nx = "load_n"\ny = ["tip_y_m"]\n'
    for mistaken, instead in ((step, '[[step]]\ncable_1_n = "20"\n'), (TIP, TIP.replace("ition", "iton"))):
        right = HEAD + TIP + plot
        assert mistaken in right
        _, told = problems(tmp_path, right.replace(mistaken, instead))
        assert len(told) == 1  # neither that there are no loads, nor that the plot lacks a column


KEPT = '[[comparison]]\nname = "kept"\nkind = "ratio"\nof = "safety_factor"\nto = { broken = "none" }\n'
STEELS = """[[factor]]
name = "steel"
[[factor.level]]
label = "unknown"
[[factor.level]]
label = "spring steel"
set = { yield_stress_pa = 1e9 }
"""


@pytest.mark.parametrize(("kind", "wanted"), [("requirement", "at_least = 1.5"), ("preference", 'better = "greater"')])
@pytest.mark.parametrize("column", ["safety_factor", "kept"])
def test_a_wish_for_what_no_manipulator_can_have_is_refused_with_what_it_needs(tmp_path, kind, wanted, column):
    arm = "".join(line for line in PROTOTYPE.read_text().splitlines(True) if "yield_stress" not in line)
    (tmp_path / "arm.toml").write_text(arm)
    text = HEAD.replace(str(PROTOTYPE), "arm.toml") + '[[metric]]\nkind = "safety"\n' + KEPT
    text += '[[factor]]\nname = "thickness_m"\npath = "segment.1.thickness_m"\nvalues = [8e-4, 9e-4]\n'
    text += f'[[{kind}]]\n{wanted}\nmetric = "{column}"\n'
    path, told = problems(tmp_path, text)
    assert told == [
        f"{path}:{text.count(chr(10))} {kind}.1.metric: column {column!r} has no value in any case: "
        "it needs yield_stress_pa of the manipulator; give it in arm.toml"
    ]
    path.write_text(text + STEELS)  # one of two steels has it
    assert len(plan_study(path).cases) == 16


def test_selections_by_what_is_there_or_by_metrics_are_in_order(tmp_path):
    path = tmp_path / "right.toml"
    plot = '[[plot]]\nname = "l"\nkind = "lines"\nx = "load_n"\ny = ["tip_y_m"]\nwhere = '
    path.write_text(HEAD + TIP + plot + '{ load_n = [3.0, 2.0], broken_cables = "2", tip_x_m = 17.0 }\n')
    assert len(plan_study(path).cases) == 4


def test_a_word_among_the_values_of_a_load_is_refused_without_a_warning(tmp_path):
    _, said = problems(
        tmp_path, HEAD.replace("[1.0, 2.0]", "[1, 'a']").replace("[[step]]", "[initial]\ncable_2_n = 5\n[[step]]") + TIP
    )
    assert any("load_n" in line or "cable_1_n" in line for line in said), said


def test_loads_and_metrics_that_are_wrong_are_told_together(tmp_path):
    (tmp_path / "wrong.toml").write_text(HEAD.replace("cable_1_n = 20", "cable_7_n = 20") + WRONG[0][0])
    with pytest.raises(SpecError) as error:
        plan_study(tmp_path / "wrong.toml")
    said = [problem.what for problem in error.value.problems]
    assert any(WRONG[0][1] in what for what in said)
    assert any("cable_7_n: unknown column" in what for what in said)
