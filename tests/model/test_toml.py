import os
import re
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, model_validator

from prb3r.errors import SpecError
from prb3r.model.files.toml import read_toml
from prb3r.model.files.toml_lines import lines_of_keys

Positive = Annotated[float, Field(gt=0)]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Weak(Strict):
    kind: Literal["weakened_plate"]
    plate: int
    factor: Positive


class Dead(Strict):
    kind: Literal["dead_cable"]
    cable: str


class Segment(Strict):
    plates: int = 7
    length_m: Positive
    thickness_m: Positive
    offset_m: float | tuple[float, ...] = 0.0
    clamped: bool = True

    @model_validator(mode="after")
    def fits(self):
        if self.thickness_m > self.length_m:
            raise ValueError("the plate is thicker than long")
        return self


class Machine(Strict):
    name: str = ""
    law: Literal["chen", "su", "one"] = "chen"
    youngs_modulus_pa: Positive = 1e11
    segment: list[Segment] = []
    effect: list[Annotated[Weak | Dead, Field(discriminator="kind")]] = []
    options: dict[str, Segment] = {}

    @model_validator(mode="before")
    @classmethod
    def untouched(cls, data):
        return dict(data)


def problems(folder, text):
    path = folder / "x.toml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with pytest.raises(SpecError) as caught:
        read_toml(path, Machine)
    return [str(problem).removeprefix(str(path)) for problem in caught.value.problems]


def test_a_decimal_comma_is_called_that(tmp_path):
    (tmp_path / "comma.toml").write_text("[disk]\nthickness_m = 0,00015 # m\n")
    with pytest.raises(SpecError, match=r"comma.toml:2: .*decimals have a point, not a comma: 0.00015"):
        read_toml(tmp_path / "comma.toml", Strict)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[disk]\n[disk]\n", ":2: not valid TOML: [disk] stands here for the second time; each of several is [[disk]]"),
        ('name = "a"\nname = "b"\n', ":2: not valid TOML: name is given twice in one table"),
        ("values = [0,05, 0,7]\n", ":1: not valid TOML: decimals have a point, not a comma, as in [0.5, 1.5]"),
        ("name = \u201ca\u201d\n", ':1: not valid TOML: quotation marks have to be plain ones: "..."'),
        (
            'file = "C:\\work"\n',
            ":1: not valid TOML: a backslash means something else in double quotes: write / in paths, or single quotes",
        ),
        ("a = 1 2  # the arm\u2019s\n", ":1: not valid TOML: expected newline or end of document after a statement"),
        ("name = arm\n", ':1: not valid TOML: invalid value; text needs quotes: "..."'),
        ("a = [1, 2\n", ":2: not valid TOML: unclosed array"),
    ],
)  # fmt: skip
def test_mistakes_of_writing_are_called_what_they_are(tmp_path, text, said):
    assert problems(tmp_path, text) == [said]


def test_all_problems_of_a_file_come_at_once_in_file_order_each_in_its_place(tmp_path):
    text = """\
law = "cheng"   # not a hinge set
youngs_modulus_gpa = 187

[[segment]]
length_m = 0.03
thicknes_m = 0.0008
[[segment]]
length_m = -0.03
thickness_mm = 0.8
plates = "7"
offset_m = "left"
clamped = 1
[[effect]]
kind = "weakened_plate"
plate = 2.5
factr = 0.8
[[effect]]
kind = "dead_cables"
[[effect]]
cable = "1"
[[segment]]
length_m = 0.001
thickness_m = 0.002
[[segment]]
length_m = nan
thickness_m = 0.002
offset_m = [0.1, "a", -inf]
[options.small]
length_m = 3
thickness_m = true
"""
    assert problems(tmp_path, text) == [
        ":1 law: must be 'chen', 'su' or 'one', not \"cheng\"",
        ":2 youngs_modulus_gpa: unknown key 'youngs_modulus_gpa': "
        "moduli and stresses are given in pascals, as 'youngs_modulus_pa'",
        ":4 segment.1: 'thickness_m' is missing",
        ":6 segment.1.thicknes_m: unknown key 'thicknes_m'; did you mean 'thickness_m'?",
        ":7 segment.2: 'thickness_m' is missing",
        ":8 segment.2.length_m: must be greater than 0, not -0.03",
        ":9 segment.2.thickness_mm: unknown key 'thickness_mm': lengths are given in metres, as 'thickness_m'",
        ':10 segment.2.plates: must be a whole number, not "7"',
        ':11 segment.2.offset_m: must be a number or a list, not "left"',
        ":12 segment.2.clamped: must be true or false, not 1",
        ":13 effect.1: 'factor' is missing",
        ":15 effect.1.plate: must be a whole number, not 2.5",
        ":16 effect.1.factr: unknown key 'factr'; did you mean 'factor'?",
        ":18 effect.2.kind: unknown kind 'dead_cables'; did you mean 'dead_cable'?",
        ":19 effect.3: 'kind' is missing",
        ":21 segment.3: the plate is thicker than long",
        ":25 segment.4.length_m: nan is not allowed; write a finite number",
        ':27 segment.4.offset_m.2: must be a number, not "a"',
        ":27 segment.4.offset_m.3: -inf is not allowed; write a finite number",
        ":30 options.small.thickness_m: must be a number, not true",
    ]


def test_a_right_file_is_read_with_its_numbers_as_written(tmp_path):
    path = tmp_path / "x.toml"
    path.write_text('\ufeffname = "µ"\r\nsegment = [{ length_m = 1, thickness_m = 8e-4, offset_m = [0, 1.5] }]\r\n')
    machine = read_toml(path, Machine)
    assert machine.name == "µ"
    assert machine.segment[0].length_m == 1.0
    assert machine.segment[0].offset_m == (0.0, 1.5)


def test_every_key_has_the_line_it_stands_on():
    text = '''\
# comment with a = "key"
title = """
not = a key # really
"""
a.b."c.d" = [ # list
  1, { x = '#]', y = [2,
  3] },
  "]",
]
when = 1979-05-27 07:32:00

  [ table . inner ]
k = 1
[[list]]
[list.sub]
k = 1
[[list]]
  [[list.deep]]
  k = 1
  [[list.deep]]
  k = 1
'''
    lines = lines_of_keys(text)
    expected = {
        ("title",): 2,
        ("a", "b", "c.d"): 5,
        ("a", "b", "c.d", 0): 6,
        ("a", "b", "c.d", 1, "x"): 6,
        ("a", "b", "c.d", 1, "y", 0): 6,
        ("a", "b", "c.d", 1, "y", 1): 7,
        ("a", "b", "c.d", 2): 8,
        ("when",): 10,
        ("table",): 12,
        ("table", "inner", "k"): 13,
        ("list", 0): 14,
        ("list", 0, "sub", "k"): 16,
        ("list", 1): 17,
        ("list", 1, "deep", 0, "k"): 19,
        ("list", 1, "deep", 1): 20,
    }
    assert {keys: lines[keys] for keys in expected} == expected
    assert not any("not" in keys for keys in lines)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = 1\nb = \n", r":2: not valid TOML: invalid value"),
        ("a = 1\na = 2\n", r":2: not valid TOML: a is given twice in one table"),
        ('a = 1\nb = """x\n', r":\d: not valid TOML: .*"),
        (b"a = 1\nb = '\xff'\n", r": is not UTF-8 text \(line 2\)"),
    ],
)
def test_text_that_is_not_toml_names_its_line(tmp_path, text, said):
    (problem,) = problems(tmp_path, text)
    assert re.fullmatch(said, problem)


def test_files_that_cannot_be_read_are_problems_too(tmp_path):
    (tmp_path / "prototype.toml").write_text("")
    with pytest.raises(SpecError, match=r"no such file; did you mean 'prototype.toml'\?"):
        read_toml(tmp_path / "prototyp.toml", Machine)
    with pytest.raises(SpecError, match="is a folder"):
        read_toml(tmp_path, Machine)
    if os.geteuid():
        (tmp_path / "prototype.toml").chmod(0)
        with pytest.raises(SpecError, match="cannot be read: permission denied"):
            read_toml(tmp_path / "prototype.toml", Machine)
