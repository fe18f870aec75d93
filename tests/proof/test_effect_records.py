"""One record per effect on the independent side: its own rig takes what it conceals, and every list follows from it."""

from dataclasses import replace

import numpy as np
import pytest

from prb3r.proof.concealed.candidates import candidates, concealable, shaped, twins
from prb3r.proof.concealed.composition import requests
from prb3r.proof.concealed.design import Flavour
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.rig.build import build_rig
from prb3r.proof.rig.effects import RECORDS

SEED = 77


@pytest.fixture(scope="module")
def designs():
    """Two of every flavour, and a frictionless one."""
    drawn = [design_of(SEED, k, flavour) for k, flavour in enumerate([*Flavour] * 2)]
    smooth = {**drawn[0].manipulator, "friction": {"coefficient": 0.0}}
    return [*drawn, replace(drawn[0], manipulator=smooth)]


@pytest.mark.long
def test_the_rig_takes_every_form_at_every_size_it_is_concealed_in(designs):
    rng = np.random.default_rng(0)
    for design in designs:
        for group in candidates(design):
            for form in [*group, shaped(design, group[0], rng)]:
                sizes = (form.low, form.probe, form.high) if form.sized else (1.0,)
                for size in sizes:
                    build_rig({**design.manipulator, "effect": [form.effect(size)]})
                assert form.low <= form.probe <= form.high
                assert set(form.effect(form.high)) - {"kind"} <= set(RECORDS[form.kind].parameters)


def test_every_kind_that_a_drawn_design_could_have_can_be_concealed_and_is_asked_for(designs):
    """No design that is drawn has notches (its plates bend less than would close such) or weights on its disks; what is
    never suspected is not concealed, what few rigs have among rare effects alone; flags are nothing without a law."""
    absent = {"empirical_moment", "notch_closing", "weight_friction", "hysteretic_plate", "load_cell"}
    absent |= {"superelastic_plate", "flag_hysteresis", "tension_play"}
    absent |= {"load_dependent_friction", "tension_drift", "base_compliance", "plate_softening", "umbilical"}
    absent |= {"wrap_saturation", "stiffness_gradient", "camera_drift", "rate_dependent_friction"}
    absent |= {"breakaway_friction", "friction_drift", "precurvature_gradient", "tip_mass", "base_tilt"}
    absent |= {"self_weight", "payload_scale", "hole_drag", "plate_relaxation", "hanger", "camera_aspect"}
    shown = {group[0].kind for design in designs for group in candidates(design)}
    assert shown == set(concealable()) == set(RECORDS) - absent
    asked = [request.kind for request in requests(SEED, 600, designs) if request.cls == "single"]
    assert asked[: len(concealable())] == list(concealable())
    assert len({RECORDS[kind].turn for kind in concealable()}) == len(concealable())


def test_twins_are_of_another_kind_and_near_each_other_both_ways(designs):
    """A stop stiffens plates as a knee does: each is the other's twin, at the same bend."""
    paired = set()
    for group in candidates(designs[0]):
        for twin in twins(designs[0], group[0], 1.0):
            paired.add((group[0].kind, twin.kind))
            (back,) = twins(designs[0], twin, 1.0)
            assert back.kind == group[0].kind != twin.kind
            assert back.shape[0] == pytest.approx(group[0].shape[0])
    assert paired == {("disk_contact", "nonlinear_plate"), ("nonlinear_plate", "disk_contact")}
