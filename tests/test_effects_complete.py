"""One record of every effect on each side of the wall: physics, suspect and rig say the same of names and places."""

import inspect
import re
from pathlib import Path

import pytest

from prb3r.diagnosis.library import SUSPECT_FAMILIES, SUSPECTS
from prb3r.model.effects import EFFECT_KINDS
from prb3r.proof.rig.effects import RECORDS

PAGE = (Path(__file__).parents[1] / "docs/effects.md").read_text()
NEVER_SUSPECTED = {
    "empirical_moment",  # a law without a mechanism: what the diagnosis says when no suspect explains a recording
}


def parameters(kind):
    """Names of an effect's parameters in their order, and whether each must be given."""
    fields = EFFECT_KINDS[kind].model_fields
    return {name: field.is_required() for name, field in fields.items() if name != "kind"}


def row(kind):
    """What the documentation says of an effect."""
    names = ", ".join(f"`{name}`" + "?" * (not needed) for name, needed in parameters(kind).items())
    return f"| `{kind}` | {names} | {' '.join(inspect.getdoc(EFFECT_KINDS[kind]).split())} |"


def test_every_effect_has_one_suspect_in_the_family_of_its_physics():
    assert [kind for kind in EFFECT_KINDS if kind not in NEVER_SUSPECTED] == list(SUSPECTS)
    suspects = [(suspect.kind, family) for family, records in SUSPECT_FAMILIES.items() for suspect in records]
    assert len(suspects) == len(SUSPECTS)
    for kind, family in suspects:
        assert EFFECT_KINDS[kind].__module__ == f"prb3r.model.effects.{family}"


def test_every_effect_has_one_record_in_the_rig():
    assert set(RECORDS) == set(EFFECT_KINDS)
    assert all(record.kind == kind for kind, record in RECORDS.items())


@pytest.mark.parametrize("kind", EFFECT_KINDS)
def test_both_sides_take_the_same_parameters(kind):
    assert sorted(RECORDS[kind].parameters) == sorted(parameters(kind))
    assert RECORDS[kind].optional == {name for name, needed in parameters(kind).items() if not needed}


@pytest.mark.parametrize("kind", EFFECT_KINDS)
def test_both_sides_have_an_effect_once_or_as_often_as_it_is_named(kind):
    assert RECORDS[kind].once == EFFECT_KINDS[kind].once


def test_the_documentation_describes_every_effect_as_its_class_does():
    said = PAGE.split("<!-- effects -->")[1].split("<!-- /effects -->")[0].strip().splitlines()
    assert said == ["| kind | parameters | meaning |", "|---|---|---|", *map(row, EFFECT_KINDS)]


def test_the_documentation_lists_what_a_manipulator_has_but_once():
    said = PAGE.split("adds to the first; of")[1].split("which a manipulator has but once")[0]
    assert re.findall(r"`(\w+)`", said) == [kind for kind, effect in EFFECT_KINDS.items() if effect.once]
