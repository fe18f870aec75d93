"""Manipulators as files and as objects: what is refused with its line, changed copies, text that reads back."""

import re
import tomllib
from pathlib import Path

import pytest

from prb3r.check import check_file
from prb3r.errors import SpecError
from prb3r.model.manipulator import Manipulator, load_manipulator

PROTOTYPE = Path(__file__).parents[2] / "studies/manipulators/two-segment.toml"


@pytest.fixture(scope="module")
def prototype():
    return load_manipulator(PROTOTYPE)


def refusal(folder, old, new):
    """What is said of the prototype's file with `old` replaced once, and the line of the replacement."""
    text = PROTOTYPE.read_text()
    assert old in text
    path = folder / "m.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(SpecError) as caught:
        load_manipulator(path)
    return str(caught.value).replace(str(path), "m.toml"), path.read_text().split("\n")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("1.87e11", "187", "youngs_modulus_pa: 187 Pa is not .* pascals: 187 GPa is 1.87e\\+11"),
        ("1.1e9", "1100", "yield_stress_pa: 1100 Pa is not .*: 1100 MPa is 1.1e\\+09"),
        ("length_m = 0.030", "length_m = 30", "segment.1.length_m: 30 m is not .* metres: 30 mm is 0.03"),
        ("thickness_m = 0.0008", "thickness_m = 0.8", "segment.1.thickness_m: 0.8 m is not .*: 0.8 mm is 0.0008"),
        ("thickness_m = 0.004", "thickness_m = 4", "disk.thickness_m: 4 m is not .*: 4 mm is 0.004"),
        (
            "offset_m = -0.021",
            "offset_m = -1.2",
            "cable.3.offset_m: 1.2 m beside a .* 0.476 m long.*: 1.2 mm is 0.0012",
        ),
        ("offset_m = -0.021", "offset_m = -21", "cable.3.offset_m: -21 m is not .*: -21 mm is -0.021"),
        ("mass_kg = 0.0447", "mass_kg = 44.7", "disk.mass_kg: 44.7 kg is not .*: 44.7 g is 0.0447"),
        ("coefficient = 0.3", "coefficient = 15", "friction.coefficient: 15 is more .* 15 degrees is 0.27"),
        ("gravity_m_s2 = 9.785", "gravity_m_s2 = 978.5", "gravity_m_s2: 978.5 m/s\\^2 .*: 978.5 cm/s\\^2 is 9.785"),
    ],
)
def test_numbers_in_another_unit_are_refused_with_what_would_be_right(tmp_path, old, new, said):
    text, lines = refusal(tmp_path, old, new)
    number = next(k for k, line in enumerate(lines, 1) if new in line)
    assert text.startswith(f"m.toml:{number} ")
    assert re.search(said, text), text
    assert "\n" not in text


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "2"', 'name = "1"', "2 cables are named '1'"),
        ("ends_at_segment = 1", "ends_at_segment = 5", "cable '2' ends at segment 5, but there are only 2"),
    ],
)
def test_duplicate_names_and_bad_ends_point_at_their_line(tmp_path, old, new, said):
    text, lines = refusal(tmp_path, old, new)
    assert said in text
    number = int(text.removeprefix("m.toml:").split(" ")[0])
    assert lines[number - 1] == new
    assert number > 1


def test_bad_places_of_effects_point_at_their_effect(tmp_path):
    text, lines = refusal(tmp_path, "[[cable]] ", '[[effect]]\nkind = "dead_cable"\ncable = "9"\n[[cable]] ')
    assert text.startswith(f"m.toml:{lines.index('[[effect]]') + 1} effect.1: ")
    assert "there is no cable '9'" in text


def test_unknown_kinds_of_effects_are_told_with_all_that_there_are(tmp_path):
    text, _ = refusal(tmp_path, "[[cable]] ", '[[effect]]\nkind = "zzz"\n[[cable]] ')
    assert "unknown kind 'zzz'; valid: " in text
    assert {"dead_cable", "gravity", "worn_hole"} <= set(text.split("valid: ")[1].split(", "))


def test_an_empty_file_is_called_that(tmp_path):
    (tmp_path / "m.toml").write_text("# nothing yet\n")
    with pytest.raises(SpecError, match="is empty; a manipulator begins with 'name', 'youngs_modulus_pa'"):
        load_manipulator(tmp_path / "m.toml")
    with pytest.raises(SpecError, match="is empty: no manipulator, study or recording"):
        check_file(tmp_path / "m.toml")
    (tmp_path / "m.toml").write_text('name = "x"\n')
    with pytest.raises(SpecError, match="says nothing of a manipulator"):
        check_file(tmp_path / "m.toml")


@pytest.mark.parametrize(
    ("path", "value", "read"),
    [
        ("segment.1.thickness_m", 1e-3, lambda m: m.segment[0].thickness_m),
        ("cable.3.offset_m", -0.02, lambda m: m.cable[2].offset_m),
        ("model", "elastica", lambda m: m.model),
        ("segment.2.plates", 3, lambda m: m.segment[1].plates),
        ("friction.coefficient", 0.1, lambda m: m.friction.coefficient),
    ],
)
def test_a_changed_copy_has_the_value_and_nothing_else_changed(prototype, path, value, read):
    before = prototype.model_dump()
    other = prototype.replace(path, value)
    assert read(other) == value
    assert read(other) != read(prototype)
    assert other.replace(path, read(prototype)) == prototype
    assert prototype.model_dump() == before


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("segment.3.thickness_m", 1e-3, "'3' is not a number from 1 to 2"),
        ("segment.1.thicknes_m", 1e-3, "did you mean 'thickness_m'"),
        ("cable.9.offset_m", 0.01, "there is no cable '9'"),
        ("segment.1.clamp_m", 0.02, "segment.1: clamps of 0.02 m"),
        ("youngs_modulus_pa", "stiff", "youngs_modulus_pa: must be a number"),
        ("cable.2.name", "1", "2 cables are named '1'"),
        ("name.first", "x", "leads into a plain value"),
    ],
)
def test_copies_that_would_not_be_in_order_are_refused(prototype, path, value, said):
    with pytest.raises(SpecError, match=said):
        prototype.replace(path, value)


def test_a_path_into_an_empty_list_says_that_it_is_empty(prototype):
    with pytest.raises(SpecError, match="there is no effect 1, nor any other"):
        prototype.replace("effect.1.y_m_s2", -9.81)


def test_parts_are_not_set_in_place_and_it_is_said_how_a_copy_is_made(prototype):
    with pytest.raises(
        AttributeError, match=r"thickness_m of a Segment is not set in place; Manipulator.replace gives"
    ):
        prototype.segment[0].thickness_m = 1e-3


def test_a_manipulator_with_effects_reads_back_equal_from_its_text(prototype):
    effects = [{"kind": "dead_cable", "cable": "2"}, {"kind": "weakened_plate", "plate": 3, "factor": 0.8}]
    other = prototype.replace("effect", effects).replace("yield_stress_pa", None)
    assert [effect.kind for effect in other.effect] == ["dead_cable", "weakened_plate"]
    assert other.yield_stress_pa is None
    for manipulator in (prototype, other):
        assert Manipulator(**tomllib.loads(manipulator.to_toml())) == manipulator
