"""The weight of an arm is found along the axis that it acts along, with the masses of the file or without any."""

from dataclasses import replace
from unittest.mock import Mock

import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.check import check
from prb3r.diagnosis.investigate import run_stages
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.result import named
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.rivals import Rival
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.stages import to_search

SAGGING = Case(hidden=(tuple({"kind": "gravity", "y_m_s2": -6.0}.items()),), seed=1)


def massless(recording):
    """The same readings, with a file that gives nothing a mass."""
    disk = recording.manipulator.disk.model_copy(update={"mass_kg": 0.0, "tip_mass_kg": 0.0})
    plates = [segment.model_copy(update={"plate_mass_kg": 0.0}) for segment in recording.manipulator.segment]
    manipulator = recording.manipulator.model_copy(update={"disk": disk, "segment": plates})
    assert not manipulator.disk_masses.any()
    return replace(recording, manipulator=manipulator)


@pytest.mark.parametrize("weighed", [True, False])
def test_the_weight_of_an_arm_is_named_along_its_axis(weighed):
    """Without masses it is their sum times the gravity that acts, as all disks weigh nearly the same."""
    recording = recorded(SAGGING)
    found = run_stages(Task(recording if weighed else massless(recording)))
    (effect,) = found.effects
    name, true = ("y_m_s2", -6.0) if weighed else ("y_n", -6.0 * recording.manipulator.disk_masses.sum())
    assert (effect.kind, effect.certain) == ("gravity" if weighed else "self_weight", True)
    assert all(rival.behind > 3 for rival in effect.rivals)
    assert effect.place == {name.replace("y", "x"): 0.0}
    ((said, size),) = effect.parameters.items()
    assert said == name
    assert size.low < true < size.high
    assert size.high - size.low < 0.35 * abs(true)


def test_the_general_form_of_what_is_named_is_no_rival_of_it(monkeypatch):
    """It always fits as well; a force at the tip that does is one."""
    searched = to_search(Task(recorded(SAGGING)), lambda stage: None, serially)
    fitted, library = searched.choice.fitted, searched.tested.doubted.search.library
    assert [effect.name for effect in fitted.model.hypotheses] == ["gravity (x_m_s2 0.0)"]
    others = [each for each in library if each.name in ("gravity", "tip_force")]
    monkeypatch.setattr(named, "rivals", Mock(return_value=[Rival(other, fitted, 0.0, 0.0) for other in others]))
    (effect,) = check(searched).named
    assert [rival.hypothesis.name for rival in effect.rivals] == ["tip_force"]


def test_a_model_has_one_form_of_a_weight_and_is_sought_with_the_general_one(rubbing):
    """Any direction, and along x or y alone: one model of a rig cannot have two of them.  A force at the tip has as
    many forms, and so have the load cells, beside whose gain the weights of this rig stand."""
    library = hypotheses(rubbing)
    general, *special = forms = [each for each in library if each.kind == "gravity"]
    assert [{free.name for free in each.free} for each in forms] == [{"x_m_s2", "y_m_s2"}, {"x_m_s2"}, {"y_m_s2"}]
    assert all(first.excludes(second) for first in forms for second in forms)
    assert [general.generalises(each) for each in forms] == [False, True, True]
    assert not any(each.generalises(other) for each in special for other in library)
    cells = [each for each in library if each.kind == "load_cell"]
    assert [{free.name for free in each.free} for each in cells] == [
        {"gain", "quadratic_per_n"},
        {"gain"},
        {"quadratic_per_n"},
    ]
    forces = [each for each in library if each.kind == "tip_force"]
    assert [{free.name for free in each.free} for each in forces] == [{"x_n", "y_n"}, {"x_n"}, {"y_n"}]
    others = [each for each in library if each.kind not in ("gravity", "load_cell", "tip_force")]
    assert not any(each.generalises(other) for each in others for other in library)
    assert set(Search(library, 0).general_forms) == {*others, general, cells[0], forces[0]}
