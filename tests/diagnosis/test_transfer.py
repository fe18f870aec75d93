"""What is carried over from a diagnosed rig to another design, and what is not."""

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded
from diagnosis.suspected import bare_sections, other_design, scaled

import prb3r
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.result.carried_constants import carried_constants, constants_left_behind
from prb3r.diagnosis.result.tell import adjusted
from prb3r.diagnosis.result.transfer import carried_effects
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.effects.plates import WeakenedPlate
from prb3r.model.manipulator import Manipulator


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
    rules |= {
        "load_dependent_friction",
        "wrap_saturation",
        "rate_dependent_friction",
        "breakaway_friction",
        "hole_drag",
    }
    parts = {"clamp_compliance", "disk_contact", "hole_clearance", "cable_bending", "umbilical"}
    laws = {"nonlinear_plate", "hysteretic_plate", "superelastic_plate", "flag_hysteresis", "plate_relaxation"}
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


@pytest.mark.parametrize("effect", [{"kind": "tip_load_friction"}, {"kind": "weight_friction"}])
def test_the_pulley_over_which_a_load_hangs_stays_with_its_bench(effect):
    """The load of another design is what it carries: what a bench loses on the way is nothing of the arm."""
    here, lossy = recorded(Case(hidden=())).manipulator, EFFECT_KINDS[effect["kind"]](**effect, efficiency=0.7)
    carried, (said,) = carried_effects([lossy], here, other_design())
    assert carried == ()
    assert "belongs to the bench" in said
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


def test_an_umbilical_of_another_length_has_another_stiffness():
    """Whatever the plates are: bent evenly, it turns by its moment times its length over its bending stiffness."""
    here = recorded(Case(hidden=())).manipulator
    tube = EFFECT_KINDS["umbilical"](kind="umbilical", stiffness_n_m_per_rad=1.0)
    transfer = SUSPECTS["umbilical"].transfer
    assert transfer(tube, here, other_design(2.0, plates=3)) == tube
    rounded = here.segment[0].length_m + 1e-12  # as sums of other numbers come out
    assert transfer(tube, here, other_design(2.0, plates=3, length_m=rounded)) == tube
    longer = other_design(1.0, plates=4)
    share = here.chain().length / longer.chain().length
    assert transfer(tube, here, longer).stiffness_n_m_per_rad == pytest.approx(share)


def test_what_the_mounting_does_stays_behind_and_the_design_is_asked_for_it_if_it_lacks_it():
    here, there = recorded(Case(hidden=())).manipulator, other_design()
    pulls = EFFECT_KINDS["gravity"](x_m_s2=-9.81)
    carried, (said,) = carried_effects([pulls], here, there)
    assert carried == ()
    assert said.endswith("a design that is mounted alike needs gravity, and masses, in its file")
    assert carried_effects([pulls], here, there, same_bench=True) == ((pulls,), ())
    mounted = there.model_copy(update={"effect": (EFFECT_KINDS["gravity"](y_m_s2=-9.81),)})
    carried, (said,) = carried_effects([pulls], here, mounted)
    assert carried == ()
    assert said.endswith("the gravity in the file of this design acts")


def test_the_weight_of_an_arm_goes_by_its_disks_where_it_is_mounted_alike():
    here, there = recorded(Case(hidden=())).manipulator, other_design(plates=4)
    heavy = EFFECT_KINDS["self_weight"](x_n=-0.6)
    assert carried_effects([heavy], here, there)[0] == ()
    (lighter,), left = carried_effects([heavy], here, there, same_bench=True)
    assert left == ()
    assert lighter.x_n / there.plates == pytest.approx(heavy.x_n / here.plates)


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


def test_segments_all_of_which_differ_go_with_the_modulus():
    """Two equal segments that a cable bends with one moment: their mean compliance counts."""
    plates = recorded(Case(hidden=())).manipulator.replace("friction.coefficient", 0.0)
    segment, cable = plates.segment[0], plates.cable[0]
    two = {"segment": (segment, segment), "cable": (cable.model_copy(update={"ends_at_segment": 2}),)}
    here = plates.model_copy(update=two)
    softer = [EFFECT_KINDS["segment_stiffness"](segment=k, factor=f) for k, f in ((1, 0.2), (2, 0.3))]
    carried, (said,) = carried_effects(softer, here, other_design())
    assert carried == ()
    assert said == (
        "which segments are softer or stiffer, as every one is; that they are all in all 0.24 times as stiff goes with "
        "Young's modulus"
    )
    found = [carried_constants(Constants(0.1), here, other_design(), effects) for effects in (softer, ())]
    assert found[0].log_stiffness - found[1].log_stiffness == pytest.approx(np.log(0.24))
    assert len(carried_effects(softer[:1], here, other_design())[1]) == 1  # against the other one: a fault of a part


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


def test_a_hole_off_its_place_that_may_be_a_load_cell_is_said_with_its_gain_on_the_same_bench():
    """The moment of a cable that runs a tenth farther out is that of one that is pulled a tenth harder."""
    here = recorded(Case(hidden=())).manipulator
    arm = here.chain().offset[0, here.cable_names.index("1")]
    farther = EFFECT_KINDS["hole_offset"](kind="hole_offset", cable="1", offset_m=0.1 * arm)
    carried, (said,) = carried_effects([farther], here, other_design(), same_bench=True)
    assert carried == ()
    assert 'kind = "load_cell", gain = 1.1 and cables = ["1"]' in said
    _, (elsewhere,) = carried_effects([farther], here, other_design())
    assert "load_cell" not in elsewhere
