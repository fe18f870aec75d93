"""The weight of an arm is found along the axis that it acts along, with the masses of the file or without any."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pandas as pd
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
from prb3r.model.files.toml import toml_text
from prb3r.proof.rig.simulate import simulate
from prb3r.recording.reading import load_recording

SAGGING = Case(hidden=(tuple({"kind": "gravity", "y_m_s2": -6.0}.items()),), seed=1)


ROD = {
    "name": "rod",
    "youngs_modulus_pa": 6e10,
    "disk": {"thickness_m": 0.003},
    "friction": {"coefficient": 0.2},
    "segment": [{"plates": 8, "length_m": 0.03, "bending_stiffness_n_m2": 0.0149}],
    "cable": [{"name": "1", "offset_m": 0.01, "ends_at_segment": 1}],
}
"""A spring wire of 1.5 mm, some 0.27 m long, with one tendon."""


def hanging_rod(folder, weight, seed=0):
    """A recording of the rod, hung tip down, whose disks weigh `weight`, N, in all; its file gives them no mass."""
    rng, steps, markers = np.random.default_rng(seed), [], []
    for name, most in (("a", 6.0), ("b", 5.0), ("c", 4.5)):
        rows = [{"cable_1_n": pull, "slip_1": -1} for pull in np.linspace(0.15, 1.0, 6) * most]
        states = simulate(ROD | {"effect": [{"kind": "self_weight", "x_n": weight, "y_n": 0.0}]}, rows)
        for k, row in enumerate(rows):
            steps.append({"sequence": name, "step": k + 1, **row})
            for disk in range(1, states.x.shape[1]):
                x, y = rng.normal((states.x[k, disk], states.y[k, disk]), 3e-4)
                markers.append({"sequence": name, "step": k + 1, "disk": disk, "x_m": x, "y_m": y})
    measured = {"position_sd_m": 3e-4, "frame_rotation_sd_rad": 0.005, "frame_position_sd_m": 0.002}
    described = {"name": "rod", "manipulator": "manipulator.toml", "measurement": measured}
    described |= {"prior": {"youngs_modulus": 0.05, "friction_coefficient": 0.3}}
    (folder / "manipulator.toml").write_text(toml_text(ROD))
    (folder / "recording.toml").write_text(toml_text(described))
    pd.DataFrame(steps).to_csv(folder / "steps.csv", index=False)
    pd.DataFrame(markers).to_csv(folder / "markers.csv", index=False)
    return load_recording(folder)


@pytest.mark.long
def test_a_hanging_rod_may_weigh_nearly_all_that_its_tendon_would_hold(tmp_path):
    """Of 0.45 N, which act at half of 0.27 m, and a largest moment of the tendon of 0.06 N m: no force at the tip and
    no plate of another stiffness is named in its place."""
    found = run_stages(Task(hanging_rod(tmp_path, 0.45)))
    assert [effect.kind for effect in found.effects] == ["self_weight"]
    (size,) = found.effects[0].parameters.values()
    assert size.low < 0.45 < size.high
    assert size.high - size.low < 0.25


def massless(recording):
    """The same readings, with a file that gives nothing a mass."""
    disk = recording.manipulator.disk.model_copy(update={"mass_kg": 0.0, "tip_mass_kg": 0.0})
    plates = [segment.model_copy(update={"plate_mass_kg": 0.0}) for segment in recording.manipulator.segment]
    manipulator = recording.manipulator.model_copy(update={"disk": disk, "segment": plates})
    assert not manipulator.disk_masses.any()
    return replace(recording, manipulator=manipulator)


@pytest.mark.parametrize("weighed", [True, pytest.param(False, marks=pytest.mark.long)])
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


@pytest.mark.long
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
