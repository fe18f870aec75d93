"""Schemas for editors: every field says what it is, and in which unit."""

import pytest

from prb3r.model.parts import Segment
from prb3r.schema import FILES, MEANINGS, schema_of
from prb3r.study.factors import Range
from prb3r.study.wishes import Requirement


def fields(file):
    schema = schema_of(file)
    for title, part in {file: schema, **schema["$defs"]}.items():
        yield from ((f"{title}.{name}", field) for name, field in part.get("properties", {}).items())


@pytest.mark.parametrize("file", FILES)
def test_every_field_is_described(file):
    bare = [name for name, field in fields(file) if len(field["description"].split()) < 2]
    assert not bare


def test_the_length_of_a_plate_is_called_that():
    described = dict(fields("manipulator"))
    assert "one plate" in described["Segment.length_m"]["description"]
    assert "not that of the segment" in described["Segment.length_m"]["description"]


def test_every_meaning_is_that_of_a_field():
    told = {(name.split(".")[1], field["description"]) for file in FILES for name, field in fields(file)}
    assert set(MEANINGS.items()) <= told


@pytest.mark.parametrize(
    ("file", "field", "right", "wrong"),
    [
        ("study", "study.factor", "case to case", "multiplied"),
        ("study", "study.seed", "clouds of loads are the same", "everything"),
        ("study", "LineFit.y", "line is fitted to", "published"),
        ("study", "Range.to", "Last value", "comparison"),
        ("study", "Cloud.bend_rad", 'limit = "bend"', "disk"),
        ("study", "DriveTension.bend_rad", "of the segment", "disk"),
        ("study", "Coupling.load_n", "Tension", "force"),
        ("study", "LinesPlot.where", "columns", "factor"),
        ("manipulator", "MomentTerm.coefficient", "what the law depends on", "Friction"),
        ("manipulator", "WornHole.disk", "0 at the base", "tip"),
        ("manipulator", "WeightFriction.disk", "from 1; absent: all", "base"),
        ("manipulator", "NotchClosing.factor", "angle", "stiffness"),
        ("recording", "Measurement.angle_sd_rad", "Standard deviation", "factor"),
        ("recording", "Tolerance.length_m", "Standard deviation", "clamps"),
    ],
)
def test_a_name_that_means_several_things_is_described_where_it_stands(file, field, right, wrong):
    said = dict(fields(file))[field]["description"]
    assert right in said
    assert wrong not in said


@pytest.mark.parametrize(
    ("kind", "field", "said"),
    [
        (Segment, "length_m", "Length of one plate"),
        (Requirement, "where", "Cases that count"),
        (Range, "from", "First value"),
    ],
)
def test_docstrings_of_fields_and_of_inherited_ones_are_in_schemas_of_single_parts(kind, field, said):
    assert kind.model_json_schema()["properties"][field]["description"].startswith(said)


@pytest.mark.parametrize("file", FILES)
def test_nothing_of_python_is_told_to_those_who_write_files(file):
    schema = schema_of(file)
    assert not [name for name, part in schema["$defs"].items() if ">>>" in part.get("description", "")]
    assert ">>>" not in schema.get("description", "")
