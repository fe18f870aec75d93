"""What is carried over from a diagnosed rig to another design, and what is not."""

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from diagnosis.suspected import bare_sections

import prb3r
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.result.carried_constants import carried_constants, constants_left_behind
from prb3r.diagnosis.result.tell import adjusted
from prb3r.diagnosis.result.transfer import carried_effects, supposed
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.effects.plates import DiskContact, NonlinearPlate, WeakenedPlate
from prb3r.model.manipulator import Manipulator


def other_design(factor=2.0, **changes):
    plain = recorded(Case(hidden=())).manipulator.model_dump(exclude_none=True)
    segments = [
        segment | {"thickness_m": factor * segment["thickness_m"], "plates": 2, **changes}
        for segment in plain["segment"]
    ]
    return Manipulator.model_validate(plain | {"segment": segments})


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


def rods(*diameters):
    """An arm of segments of round rods of these diameters, m, known by their stiffness alone."""
    plain, modulus = recorded(Case(hidden=())).manipulator.model_dump(exclude_none=True), 1.87e11
    stiffness = [modulus * np.pi * d**4 / 64 for d in diameters]
    segments = [bare_sections(bending_stiffness_n_m2=each)[0] for each in stiffness]
    return Manipulator.model_validate(plain | {"segment": segments})


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


def test_friction_carries_over_and_what_sits_somewhere_does_not(library):
    here, there = recorded(Case(hidden=())).manipulator, other_design()
    carried = set()
    for hypothesis, friction in library:
        effect = hypothesis.effect(hypothesis.starts(friction)[0], friction)
        moved = SUSPECTS[hypothesis.kind].transfer(effect, here, there)
        if isinstance(moved, str):
            assert moved.startswith(f"{hypothesis.kind.replace('_', ' ')}, which ")
        else:
            assert not [
                name
                for name, _ in hypothesis.place
                if name not in ("law", "side", "elements", "tension_n", "reference_n_per_s")
            ]
            carried.add(hypothesis.kind)
    rules = {"cable_friction", "pulley_friction", "slip_history", "edge_wrap"}
    rules |= {"load_dependent_friction", "wrap_saturation", "rate_dependent_friction", "breakaway_friction"}
    parts = {"clamp_compliance", "disk_contact", "hole_clearance", "cable_bending"}
    laws = {"nonlinear_plate", "hysteretic_plate", "superelastic_plate", "flag_hysteresis"}
    assert carried == rules | parts | laws | {"notch_closing"}


@pytest.mark.parametrize(
    ("effect", "changed"),
    [
        ({"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.01}, {"segment": {"clamp_m": 0.006}}),
        ({"kind": "hole_clearance", "clearance_m": 1e-3}, {"disk": {"thickness_m": 0.006, "mass_kg": 0.05}}),
    ],
)
def test_what_belongs_to_clamps_or_holes_carries_over_with_them_alone(effect, changed):
    here, there = recorded(Case(hidden=())).manipulator, other_design(**changed.get("segment", {}))
    if "disk" in changed:
        there = there.replace("disk", changed["disk"])
    known = EFFECT_KINDS[effect["kind"]].model_validate(effect)
    assert SUSPECTS[known.kind].transfer(known, here, other_design()) == known
    assert "and these differ" in SUSPECTS[known.kind].transfer(known, here, there)


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


def scaled(manipulator, size):
    """The manipulator with all its lengths `size` times as large."""
    plain = manipulator.model_dump(exclude_none=True)
    lengths = ("length_m", "clamp_m", "width_m", "thickness_m", "offset_m")
    for part in (plain["disk"], *plain["segment"], *plain["cable"]):
        part |= {name: size * value for name, value in part.items() if name in lengths}
    return Manipulator.model_validate(plain)


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


@pytest.mark.parametrize("effect", [{"kind": "tip_load_friction"}, {"kind": "weight_friction"}])
def test_the_pulley_over_which_a_load_hangs_stays_with_its_bench(effect):
    """The load of another design is what it carries: what a bench loses on the way is nothing of the arm."""
    here, lossy = recorded(Case(hidden=())).manipulator, EFFECT_KINDS[effect["kind"]](**effect, efficiency=0.7)
    carried, (said,) = carried_effects([lossy], here, other_design())
    assert carried == ()
    assert "belongs to the set-up" in said
    assert carried_effects([lossy], here, here)[0] == (lossy,)


ROUNDED = 1 + 4e-4
"""What rounding to four digits may make of a number."""


@pytest.mark.parametrize(
    "effect",
    [
        {"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.01},
        {"kind": "hole_clearance", "clearance_m": 1e-3},
        {"kind": "umbilical", "stiffness_n_m_per_rad": 1.0},
        {"kind": "disk_contact", "angle_rad": 0.1, "stiffness_n_m_per_rad": 9.0},
        {"kind": "nonlinear_plate", "law": "bilinear", "knee_per_m": 2.0, "ratio": 0.4},
    ],
)
def test_parts_that_files_only_round_differently_are_the_same(effect):
    """Of another arm, with one cable fewer, whose clamps, disks, lengths and sections are written with fewer digits."""
    here, known = recorded(Case(hidden=())).manipulator, EFFECT_KINDS[effect["kind"]].model_validate(effect)
    plain = scaled(here, ROUNDED).model_dump(exclude_none=True)
    there = Manipulator.model_validate(plain | {"cable": plain["cable"][1:]})
    assert carried_effects([known], here, there) == ((known,), ())


def test_turns_counted_at_edges_by_an_effect_of_the_file_count_too():
    plain, found = recorded(Case(hidden=())).manipulator, Constants(log_friction=0.2)
    stated = {"effect": [{"kind": "edge_wrap"}]}
    here, there = (
        Manipulator.model_validate(rig.model_dump(exclude_none=True) | stated) for rig in (plain, other_design())
    )
    (said,) = constants_left_behind(plain, there, [])
    assert said == 'the friction coefficient found, which goes with wrap = "net": the design keeps its own'
    (said,) = constants_left_behind(here, other_design(), [])
    assert said == 'the friction coefficient found, which goes with wrap = "edges": the design keeps its own'
    for edges in (there, other_design().replace("friction.wrap", "edges")):
        assert carried_constants(found, here, edges).log_friction == pytest.approx(0.2)
        assert constants_left_behind(here, edges, []) == ()


def test_clamps_of_plates_that_are_known_by_their_stiffness_alone_are_told_by_their_length():
    here, effect = recorded(Case(hidden=())).manipulator, EFFECT_KINDS["clamp_compliance"](compliance_rad_per_n_m=0.01)
    plain = here.model_dump(exclude_none=True)
    same, shorter = (
        Manipulator.model_validate(plain | {"segment": bare_sections(plates=2, clamp_m=clamp)})
        for clamp in (0.008, 0.007)
    )
    transfer = SUSPECTS["clamp_compliance"].transfer
    assert transfer(effect, here, same) == effect
    assert "clamps, and these differ" in transfer(effect, here, shorter)
    assert "clamps, and these differ" in transfer(effect, here, other_design(width_m=0.02))


def test_a_coefficient_goes_with_the_turns_that_it_was_found_with():
    """Counted at both edges of a hole a cable turns more, so that the same friction is a smaller coefficient."""
    here, found = recorded(Case(hidden=())).manipulator, Constants(log_friction=0.2)
    edges = other_design().replace("friction.wrap", "edges")
    assert carried_constants(found, here, edges).log_friction == 0.0
    (said,) = constants_left_behind(here, edges, [])
    assert said == 'the friction coefficient found, which goes with wrap = "net": the design keeps its own'
    at_edges = [EFFECT_KINDS["edge_wrap"]()]
    for there in (other_design(), edges):
        assert carried_constants(found, here, there, at_edges).log_friction == pytest.approx(0.2)
        assert constants_left_behind(here, there, at_edges) == ()


@pytest.mark.parametrize("place", [{"kind": "cable_friction"}, {"kind": "worn_hole", "disk": 2}])
def test_a_coefficient_that_was_found_as_an_effect_goes_with_the_turns_too(place):
    here = recorded(Case(hidden=())).manipulator
    edges, rubs = here.replace("friction.wrap", "edges"), EFFECT_KINDS[place["kind"]](**place, coefficient=0.4)
    carried, (said,) = carried_effects([rubs], here, edges)
    assert carried == ()
    assert said == f'{place["kind"].replace("_", " ")}, which goes with wrap = "net"'
    assert carried_effects([rubs], here, here) == ((rubs,), ())
    both = (EFFECT_KINDS["edge_wrap"](), rubs)
    assert carried_effects(both, here, edges)[0] == both


def test_an_umbilical_carries_over_to_a_rig_as_long():
    """Whatever its plates are; a tube of another length has another stiffness."""
    here = recorded(Case(hidden=())).manipulator
    tube = EFFECT_KINDS["umbilical"](kind="umbilical", stiffness_n_m_per_rad=1.0)
    transfer = SUSPECTS["umbilical"].transfer
    assert transfer(tube, here, other_design(2.0, plates=3)) == tube
    rounded = here.segment[0].length_m + 1e-12  # as sums of other numbers come out
    assert transfer(tube, here, other_design(2.0, plates=3, length_m=rounded)) == tube
    assert "lengths, and these differ" in transfer(tube, here, other_design(1.0, plates=4))


def weakened(*plates, factor=0.7):
    return tuple(WeakenedPlate(kind="weakened_plate", plate=plate, factor=factor) for plate in plates)


def test_many_plates_that_differ_are_how_a_rig_is_made_and_go_with_the_modulus():
    """Without friction a cable bends all its plates with one moment: the turn of the tip tells the mean compliance."""
    here = recorded(Case(hidden=())).manipulator.replace("friction.coefficient", 0.0)
    there, effects = other_design(), weakened(1, 3, 4, 6)
    carried, left = carried_effects(effects, here, there)
    assert carried == ()
    assert left == (plate_scatter_said(4, 0.7778),)
    constants = carried_constants(Constants(log_stiffness=0.1), here, there, effects)
    pull = {"sequence": ["a"], "step": [1], "cable_1_n": [0.2]}
    turn = prb3r.solve(adjusted(here, Constants(log_stiffness=0.1), effects), pull)["angle_rad"].iloc[-1]
    assert prb3r.solve(adjusted(here, constants, ()), pull)["angle_rad"].iloc[-1] == pytest.approx(turn, rel=3e-6)


def plate_scatter_said(count, stiffness):
    return (
        f"which plates are softer or stiffer, as {count} of them are too many for faults of single parts; "
        f"that they are all in all {stiffness:.3g} times as stiff goes with Young's modulus"
    )


def test_one_or_two_plates_that_differ_are_faults_and_stay_behind():
    here, there, plain = recorded(Case(hidden=())).manipulator, other_design(), Constants(log_stiffness=0.1)
    effects = weakened(1, 4)
    assert all(
        reason.startswith("weakened plate, which is a fault") for reason in carried_effects(effects, here, there)[1]
    )
    assert carried_constants(plain, here, there, effects) == carried_constants(plain, here, there)
    many = weakened(1, 2, 3)
    assert carried_effects(many, here, here) == (many, ())
    assert carried_constants(plain, here, here, many) == carried_constants(plain, here, here)
