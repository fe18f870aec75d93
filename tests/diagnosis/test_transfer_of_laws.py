"""How laws of the material and contact are carried over to sections and gaps of other sizes."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import Case, investigated, recorded
from diagnosis.suspected import bare_sections, other_design, rods, scaled

import prb3r
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.result.surviving import posterior_of
from prb3r.diagnosis.result.tell import adjusted
from prb3r.diagnosis.result.transfer import carried_effects, given, supposed
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.effects.plates import DiskContact, NonlinearPlate
from prb3r.model.manipulator import Manipulator


@pytest.mark.parametrize(
    "law", [{"law": "cubic", "cubic_m2": 0.01}, {"law": "bilinear", "knee_per_m": 2.0, "ratio": 0.4}]
)
def test_a_bending_law_carries_over_as_strain(law):
    """At equal strain of the outermost fibre stress over strain is the same: M / (EI k) at curvature times fibre."""
    here, there = recorded(Case(hidden=())).manipulator, other_design(2.0)
    effect = EFFECT_KINDS["nonlinear_plate"](kind="nonlinear_plate", **law)
    moved = SUSPECTS["nonlinear_plate"].transfer(effect, here, there)

    def softening(effect, manipulator, strain):
        k = strain / manipulator.outer_fibre[0]
        if effect.law == "cubic":
            return 1 + effect.cubic_m2 * k**2
        return (min(k, effect.knee_per_m) + effect.ratio * max(k - effect.knee_per_m, 0)) / k

    for strain in (2e-4, 1e-3, 3e-3):
        assert softening(moved, there, strain) == pytest.approx(softening(effect, here, strain))
    assert SUSPECTS["nonlinear_plate"].transfer(moved, there, here) == effect


def test_between_sections_known_by_their_stiffness_alone_a_law_carries_over_as_if_they_had_one_shape():
    """Round rods of another diameter: the same strain is reached at a curvature smaller by the ratio of diameters."""
    diameter = 1e-3
    here, there = rods(diameter, diameter), rods(2 * diameter, 1.5 * diameter)
    law = NonlinearPlate(kind="nonlinear_plate", law="bilinear", knee_per_m=2.0, ratio=0.4)
    transfer = SUSPECTS["nonlinear_plate"].transfer
    moved = transfer(law, here, there)
    assert moved.knee_per_m == pytest.approx(1.0)  # of plate 1
    knees = moved.change(there.chain(), there).law.knee[:, 0]
    assert knees == pytest.approx(2.0 * diameter / np.repeat([2 * diameter, 1.5 * diameter], 3))
    back = transfer(moved, there, here)
    assert back.knee_per_m == pytest.approx(2.0)
    turned = rods(1.5 * diameter, 2 * diameter)  # the same sections, but plate 1 is another one
    assert transfer(moved, there, turned).knee_per_m == pytest.approx(4 / 3)
    cubic = transfer(NonlinearPlate(kind="nonlinear_plate", law="cubic", cubic_m2=0.01), here, rods(3e-3, 3e-3))
    assert cubic.cubic_m2 == pytest.approx(0.09)
    carried, left = carried_effects([law], here, there)
    assert not left
    assert supposed([law]) == []
    assert "as if all had one shape" in supposed(carried)[0]


def test_loops_carry_over_as_strain():
    here, there = recorded(Case(hidden=())).manipulator, other_design(2.0)
    curved = EFFECT_KINDS["hysteretic_plate"](kind="hysteretic_plate", slipping_share=0.4, yield_per_m=2.0)
    transfer = SUSPECTS["hysteretic_plate"].transfer
    moved = transfer(curved, here, there)
    assert moved.yield_per_m * there.outer_fibre[0] == pytest.approx(curved.yield_per_m * here.outer_fibre[0])
    assert transfer(curved, here, here) == curved
    strained = EFFECT_KINDS["hysteretic_plate"](kind="hysteretic_plate", slipping_share=0.4, yield_strain=1e-3)
    assert transfer(strained, here, there) == strained
    unknown = Manipulator.model_validate(here.model_dump(exclude_none=True) | {"segment": bare_sections()})
    assert "needs outer_fibre_m" in transfer(curved, here, unknown)


def test_loops_of_sections_of_one_shape_carry_over_by_their_size():
    """Of round rods, whose fibres no file tells, one twice as thick is as strained at half the curvature; in the mean
    over the plates where they differ."""
    loops = EFFECT_KINDS["hysteretic_plate"](kind="hysteretic_plate", slipping_share=0.4, yield_per_m=2.0)
    transfer, here = SUSPECTS["hysteretic_plate"].transfer, rods(1e-3, 1e-3)
    assert transfer(loops, here, rods(2e-3, 2e-3)).yield_per_m == pytest.approx(1.0)
    assert transfer(loops, here, rods(1e-3, 3e-3)).yield_per_m == pytest.approx(1.0)
    assert transfer(loops, rods(1e-3, 3e-3), here).yield_per_m == pytest.approx(4.0)


def test_a_bending_law_stays_where_no_fibre_is_known():
    here, there = recorded(Case(hidden=())).manipulator, other_design()
    unknown = there.model_dump(exclude_none=True)
    for segment in unknown["segment"]:
        del segment["thickness_m"], segment["width_m"]
        segment["bending_stiffness_n_m2"] = 0.3
    effect = EFFECT_KINDS["nonlinear_plate"](kind="nonlinear_plate", law="cubic", cubic_m2=0.01)
    said = SUSPECTS["nonlinear_plate"].transfer(effect, here, Manipulator.model_validate(unknown))
    assert "needs outer_fibre_m" in said


def test_a_law_in_strain_carries_over_as_it_is_and_one_on_equal_sections_too():
    here, there = recorded(Case(hidden=())).manipulator, other_design(2.0)
    strained = NonlinearPlate(kind="nonlinear_plate", law="bilinear", knee_strain=1e-3, ratio=0.4)
    assert SUSPECTS["nonlinear_plate"].transfer(strained, here, there) == strained
    curved = NonlinearPlate(kind="nonlinear_plate", law="bilinear", knee_per_m=2.0, ratio=0.4)
    plain = here.model_dump(exclude_none=True)
    unknown = [Manipulator.model_validate(plain | {"segment": bare_sections(plates=n)}) for n in (3, 5)]
    assert SUSPECTS["nonlinear_plate"].transfer(curved, *unknown) == curved
    assert "needs outer_fibre_m" in SUSPECTS["nonlinear_plate"].transfer(strained, here, unknown[0])


def test_disks_with_twice_the_gap_touch_at_twice_the_bend():
    """Rims of two disks meet where the gap is used up: at gap / radius.  Of an arm with two gaps nothing is known."""
    here = recorded(Case(hidden=())).manipulator
    touching = DiskContact(kind="disk_contact", angle_rad=0.1, stiffness_n_m_per_rad=9.0)
    transfer, length = SUSPECTS["disk_contact"].transfer, here.segment[0].length_m
    assert transfer(touching, here, other_design()) == touching
    wide = here.replace("segment.1.length_m", 2 * length).replace("segment.2.length_m", 2 * length)
    assert transfer(touching, here, wide) == touching.model_copy(update={"angle_rad": pytest.approx(0.2)})
    mixed = here.replace("segment.2.length_m", 2 * length)
    assert transfer(touching, mixed, mixed) == touching
    for first, other in ((here, mixed), (mixed, here)):
        assert "gaps between disks, and these differ" in transfer(touching, first, other)


def test_disks_that_cannot_touch_teach_nothing_of_another_design():
    """Arcs of 14 mm between disks whose holes lie at 25.5 mm: at 1 degree their rims would lie 0.8 m from the axis."""
    here = recorded(Case(hidden=())).manipulator
    touching = DiskContact(kind="disk_contact", angle_rad=np.pi / 180, stiffness_n_m_per_rad=9.0)
    assert "at which no disks touch" in SUSPECTS["disk_contact"].transfer(touching, here, other_design())
    assert carried_effects([touching], here, here) == ((touching,), ())
    found = investigated(Case(hidden=()))
    assert posterior_of(found).carried is None
    solved = replace(found.explained.solved, effects=(touching,))
    fitted = replace(found.explained, model=found.explained.model.adding(given(touching)), solved=solved)
    doubted = replace(found, choice=replace(found.choice, fitted=fitted), reported=fitted)
    posterior = posterior_of(doubted)
    assert posterior.reported is None
    assert [model.effects for model in (posterior.carried, posterior.on_bench)] == [[], []]


@pytest.mark.parametrize("side", [{}, {"side": "positive"}])
def test_notches_of_an_arm_of_the_same_shape_close_alike(side):
    """All lengths doubled, four times the tension: stresses are the same, and so are all angles."""
    here = recorded(Case(hidden=())).manipulator
    closing = EFFECT_KINDS["notch_closing"](kind="notch_closing", factor=0.1, stiffness_n_m_per_rad=9.0, **side)
    there = scaled(here, 2.0)
    ((moved,), _) = carried_effects([closing], here, there)
    pull = {"sequence": ["a"], "step": [1], "cable_1_n": [90.0]}
    small = prb3r.solve(adjusted(here, Constants(), [closing]), pull)
    large = prb3r.solve(adjusted(there, Constants(), [moved]), pull | {"cable_1_n": [360.0]})
    free = prb3r.solve(here, pull)
    assert large["angle_rad"].tolist() == pytest.approx(small["angle_rad"].tolist(), rel=1e-9, abs=1e-9)
    assert small["angle_rad"].iloc[-1] < 0.9 * free["angle_rad"].iloc[-1]
    ((longer,), _) = carried_effects([closing], here, other_design(1.0))
    assert longer.stiffness_n_m_per_rad == pytest.approx(9.0)


def test_a_fibre_that_one_file_alone_states_makes_no_edge_stiffer():
    """The same notched tube in two files, of which one gives the outer fibre, half the arm of the cables."""
    bare = rods(1e-3, 1e-3)
    arm = float(bare.cable_arm(1)[0])
    told = bare.model_dump(exclude_none=True)
    told["segment"] = [segment | {"outer_fibre_m": arm / 2} for segment in told["segment"]]
    stated = Manipulator.model_validate(told)
    closing = EFFECT_KINDS["notch_closing"](kind="notch_closing", factor=0.9, stiffness_n_m_per_rad=9.0)
    for here, there in ((bare, stated), (stated, bare)):
        assert SUSPECTS["notch_closing"].transfer(closing, here, there).stiffness_n_m_per_rad == pytest.approx(9.0)
