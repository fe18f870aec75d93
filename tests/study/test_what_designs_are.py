"""Which factors tell designs apart, and what is said where none does."""

import pytest
from command import PROTOTYPE

from prb3r.study.spec import Study

STUDY = {
    "name": "small",
    "title": "Which",
    "manipulator": str(PROTOTYPE),
    "step": [{"cable_1_n": 20}],
    "metric": [{"kind": "position"}],
    "requirement": [{"metric": "tip_y_m", "at_least": 0.0}],
}
THICKNESS = {"name": "thickness_m", "path": "segment.1.thickness_m", "values": [8e-4, 1e-3]}


def named(*settings, **more):
    """A factor of named alternatives, the first of which changes nothing."""
    levels = [{"label": "as drawn"}, *({"label": str(k)} | part for k, part in enumerate(settings))]
    return {"name": "kind", "level": levels, **more}


def design_factors(*factors, **more):
    return Study.model_validate(STUDY | {"factor": list(factors)} | more).design_factors


@pytest.mark.parametrize("path", ["segment.1.thickness_m", "manipulator.friction.coefficient", "disk.tip_mass_kg"])
def test_what_changes_the_manipulator_tells_designs_apart_by_a_path_or_in_a_level(path):
    by_path = {"name": "kind", "path": path, "values": [0.1, 0.2]} | ({"name": "kind_m"} if path.endswith("_m") else {})
    by_path |= {"name": "kind_kg"} if path.endswith("_kg") else {}
    assert design_factors(by_path) == [by_path["name"]]
    assert design_factors(named({"set": {path: 0.1}})) == ["kind"]
    assert design_factors(named({"model": "elastica"})) == ["kind"]


def test_what_changes_loads_alone_is_a_circumstance():
    loads = named({"broken": ["2"]}, {"step": [{"cable_1_n": 5}]}, {"set": {"step.1.cable_2_n": 5.0}})
    assert design_factors(THICKNESS, loads) == ["thickness_m"]


def test_alternatives_that_nobody_chooses_are_errors():
    spread = named({"set": {"friction.coefficient": 0.2}}, chosen=False)
    assert design_factors(THICKNESS, spread, sampling={"method": "sobol", "count": 4}) == ["thickness_m"]
