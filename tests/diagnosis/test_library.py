"""The library of suspects: what is suspected where, within which bounds, what is said of it and what carries over."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.fit.prediction import Constants, predictor
from prb3r.diagnosis.library import SUSPECTS, hypotheses
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.library.suspect import Estimate, Occurrence
from prb3r.model.effects import EFFECT_KINDS
from prb3r.model.effects.plates import NonlinearPlate
from prb3r.model.manipulator import Manipulator

MU = 0.3


def recording(**changes):
    """The small rig with another manipulator file, pushed at its tip so that no kind is out of the question."""
    plain = recorded(Case(hidden=()))
    data = plain.manipulator.model_dump(exclude_none=True) | changes
    hung = np.zeros_like(plain.loads.force)
    hung[0, [1, 4]] = 0.2  # weights at disks 2 and 5
    loads = plain.loads._replace(tip=np.full_like(plain.loads.tip, 0.5), force=hung)
    return replace(plain, manipulator=Manipulator.model_validate(data), loads=loads)


def scope(**changes):
    made = recording(**changes)
    predict = predictor(made)
    return Scope.of(made, predict.chain, predict.equilibria(Constants()))


@pytest.fixture(scope="module")
def rubbing():
    return scope()


@pytest.fixture(scope="module")
def frictionless():
    return scope(friction={"coefficient": 0.0})


@pytest.fixture(scope="module")
def limp():
    """Plates that bend to 0.3 rad and more, where notches of their length close at 0.5."""
    return scope(segment=sections(thickness_m=0.0006))


def sections(**changes):
    plain = recorded(Case(hidden=())).manipulator.model_dump(exclude_none=True)
    return [segment | changes for segment in plain["segment"]]


def bare_sections(**changes):
    """Of plates that are known by their stiffness alone."""
    unsaid = "width_m", "thickness_m"
    known = {"bending_stiffness_n_m2": 0.24} | changes
    return [{k: v for k, v in (each | known).items() if k not in unsaid} for each in sections()]


@pytest.fixture(scope="module")
def library(rubbing, frictionless, limp):
    """Every hypothesis on some rig, with the friction coefficient beside it."""
    closing = [each for each in hypotheses(limp) if each.kind == "notch_closing"]
    return [(each, MU) for each in (*hypotheses(rubbing), *closing)] + [
        (each, 0.0) for each in hypotheses(frictionless)
    ]


def names(scope, *kinds):
    return [hypothesis.name for hypothesis in hypotheses(scope) if hypothesis.kind in kinds]


def test_every_kind_is_suspected_on_some_rig_and_every_suspicion_has_a_name(library, rubbing):
    assert {hypothesis.kind for hypothesis, _ in library} == set(SUSPECTS)
    suspected = [hypothesis.name for hypothesis in hypotheses(rubbing)]
    assert len(set(suspected)) == len(suspected)


def test_free_parameters_are_at_the_values_they_take():
    for free in (
        Free("a", 0.0, -2.0, 3.0, scale=0.5),
        Free("b", 1.0, 0.05, 20.0, log=True),
        Free("c", 0.0, 0.0, 5.0, above=True),
    ):
        for value in (0.1, 1.0, 2.5):
            assert free.value(free.at(value, MU), MU) == pytest.approx(value)
        low, high = free.bounds(MU)
        assert free.value(low - 1, MU) == free.low == pytest.approx(free.value(low, MU))
        assert free.value(1e4 * high, MU) == free.high == pytest.approx(free.value(high, MU))


def test_all_within_the_bounds_is_an_effect_that_a_manipulator_file_may_have(library, rubbing):
    for hypothesis, friction in library:
        ends = [free.bounds(friction) for free in hypothesis.free]
        for u in [*product(*ends), *hypothesis.starts(friction)]:
            effect = hypothesis.effect(np.array(u), friction)
            assert not list(effect.problems(rubbing.manipulator))
        for probe in hypothesis.probes:
            assert all(free.low < value < free.high for free, value in zip(hypothesis.free, probe, strict=True))


def test_what_comes_by_degrees_is_nothing_at_its_start(library):
    for coefficient in (MU, 0.0):
        predict = predictor(recording(friction={"coefficient": coefficient}))
        nominal = predict(Constants())
        for hypothesis, friction in library:
            if friction == coefficient and hypothesis.by_degrees and not hypothesis.kinked:
                start = hypothesis.effect(np.zeros(len(hypothesis.free)), friction)
                assert predict(Constants(), [start]) == pytest.approx(nominal, abs=1e-6)


def test_a_place_is_one_where_the_recording_could_show_the_effect(rubbing):
    """Four cables, the inner two of the first of two segments of three plates; holes rub before every plate."""
    assert names(rubbing, "dead_cable") == [f"dead_cable (cable {name})" for name in "1234"]
    assert names(rubbing, "weakened_plate") == [f"weakened_plate (plate {plate})" for plate in range(1, 7)]
    holes = names(rubbing, "worn_hole")
    assert [name for name in holes if name.startswith("worn_hole (disk 2")] == [
        "worn_hole (disk 2)",
        *(f"worn_hole (disk 2, cables {name})" for name in "1234"),
    ]
    assert [name for name in holes if name.startswith("worn_hole (disk 3")] == [
        "worn_hole (disk 3)",
        *(f"worn_hole (disk 3, cables {name})" for name in "14"),
    ]
    assert names(rubbing, "precurvature")[:3] == [
        "precurvature",
        "precurvature (plates 1+2+3)",
        "precurvature (plates 4+5+6)",
    ]


def freed(scope, kind):
    """Names of what is fitted, by the place."""
    return {h.place: [free.name for free in h.free] for h in hypotheses(scope) if h.kind == kind}


def test_a_knee_is_sought_as_strain_where_every_fibre_is_known(rubbing):
    bilinear, smooth = (("law", "bilinear"),), (("law", "smooth"),)
    known = freed(rubbing, "nonlinear_plate")
    assert known[bilinear] == ["knee_strain", "ratio"]
    assert known[smooth] == ["knee_strain", "ratio", "sharpness"]
    segments = bare_sections()
    assert freed(scope(segment=segments), "nonlinear_plate")[bilinear] == ["knee_per_m", "ratio"]
    segments[0]["outer_fibre_m"] = 4e-4
    assert freed(scope(segment=segments), "nonlinear_plate")[bilinear] == ["knee_per_m", "ratio"]


def test_one_side_is_suspected_where_plates_bend_to_both(rubbing, limp):
    sided = "nonlinear_plate (law bilinear, side negative)"
    assert sided in names(rubbing, "nonlinear_plate")
    assert sided not in names(rubbing._replace(bend=np.abs(rubbing.bend)), "nonlinear_plate")
    assert not names(rubbing, "notch_closing")
    closing = ["notch_closing (side negative)", "notch_closing (side positive)", "notch_closing"]
    assert names(limp, "notch_closing") == closing
    assert names(limp._replace(bend=np.abs(limp.bend)), "notch_closing") == closing[1:2]


def test_what_cannot_be_is_not_suspected(rubbing, frictionless):
    rubs = {"slip_history", "edge_wrap"}
    alone = [f"cable_friction (cables {name})" for name in "1234"]
    assert names(rubbing, "cable_friction") == alone
    assert names(frictionless, "cable_friction") == ["cable_friction", *alone]
    known = {"kind": "cable_friction", "coefficient": 0.5, "cables": ["2"]}
    others = [name for name in alone if "2" not in name]
    assert names(scope(effect=[known]), "cable_friction") == others
    assert names(scope(effect=[known], friction={"coefficient": 0.0}), "cable_friction") == others
    assert set(names(rubbing, *rubs)) == rubs
    assert not names(frictionless, *rubs)
    along = scope(friction={"coefficient": MU, "direction": "history", "wrap": "edges"})
    assert not names(along, *rubs)
    weightless = scope(disk={"thickness_m": 0.004})
    assert not names(weightless, "gravity")
    idle = rubbing.recording.loads.tension.copy()
    idle[:, 1] = 0
    known = rubbing.recording.loads
    loads = known._replace(tension=idle, tip=0 * known.tip, force=0 * known.force)
    unloaded = rubbing._replace(recording=replace(rubbing.recording, loads=loads))
    assert "dead_cable (cable 2)" not in names(unloaded, "dead_cable")
    assert not names(unloaded, "tip_load_friction", "weight_friction")
    assert names(rubbing, "weight_friction") == [f"weight_friction{disk}" for disk in ("", " (disk 2)", " (disk 5)")]
    assert names(rubbing, "gravity", "tip_load_friction") == ["gravity", "tip_load_friction"]
    blind = rubbing.recording.readings.where(rubbing.recording.readings.kind == 2)
    assert not names(
        rubbing._replace(recording=replace(rubbing.recording, readings=blind)), "camera_scale", "lens_distortion"
    )


def test_what_a_rig_has_once_is_not_suspected_where_it_is_known(rubbing):
    known = [
        {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": 1e-3},
        {"kind": "edge_wrap"},
        {"kind": "hole_clearance", "clearance_m": 1e-4},
        {"kind": "tip_force", "x_n": 0.1, "y_n": 0.0},
    ]
    rest = {hypothesis.kind for hypothesis in hypotheses(scope(effect=known))}
    assert {hypothesis.kind for hypothesis in hypotheses(rubbing)} - rest == {"nonlinear_plate", "edge_wrap"}


def test_kinds_can_be_left_out(rubbing):
    rest = hypotheses(rubbing, frozenset({"worn_hole", "gravity"}))
    assert rest == tuple(h for h in hypotheses(rubbing) if h.kind not in ("worn_hole", "gravity"))


def test_what_differs_in_kind_from_a_chain_without_it_is_said(library):
    """Hinges at the clamps are nodes more, a dead cable is another routing, the others are rules of friction."""
    structural = {hypothesis.kind for hypothesis, _ in library if hypothesis.structural}
    assert structural == {"clamp_compliance", "dead_cable", "slip_history", "edge_wrap"}
    assert {kind for kind, suspect in SUSPECTS.items() if suspect.costly} == {"slip_history"}
    assert {h.kind for h, _ in library if not h.mechanical} == {"camera_scale", "lens_distortion"}


def test_one_direction_makes_sense_where_the_other_does_not_exist(library):
    losses = {"pulley_friction", "tip_load_friction", "weight_friction"}
    amounts = {"cable_friction", "hole_clearance", "clamp_compliance", "cable_bending"}
    assert {h.kind for h, _ in library if h.by_degrees and h.sided} == losses | amounts | {"nonlinear_plate"}


@pytest.mark.parametrize(
    ("kind", "place", "sizes", "said"),
    [
        ("pulley_friction", {}, {"efficiency": (0.9, 0.88, 0.93)}, "of all cables takes 10 (7 to 12) % of the tension"),
        ("pulley_friction", {"cables": ("3",)}, {"efficiency": (0.9, None, None)}, "of cable 3 takes 10 % of"),
        ("cable_friction", {"cables": ("2",)}, {"coefficient": (0.5, 0.4, 0.6)}, "Cable 2 rubs more in its holes"),
        ("cable_friction", {"cables": ("2",)}, {"coefficient": (0.1, 0.0, 0.2)}, "Cable 2 rubs less in its holes"),
        ("slip_history", {}, {"presliding_m": (3e-5, None, None)}, "over 30 micrometres of travel"),
        ("slip_history", {}, {"presliding_m": (2.41e-3, 9e-4, 5e-3)}, "over 2410 (900 to 5000) micrometres of travel"),
        ("worn_hole", {"disk": 0}, {"coefficient": (0.5, None, None)}, "The holes of the base disk rub more than"),
        ("worn_hole", {"disk": 3, "cables": ("1",)}, {"coefficient": (0.1, None, None)}, "disk 3 rub less than"),
        ("hole_offset", {"cable": "2"}, {"offset_m": (-0.002, -0.003, -0.001)}, "runs -2 (-3 to -1) mm off"),
        ("nonlinear_plate", {"law": "bilinear"}, {"knee_per_m": (2, 1, 3), "ratio": (0.5, 0.4, 0.6)}, "soften (yield)"),
        ("nonlinear_plate", {"law": "bilinear"}, {"knee_per_m": (2, 1, 3), "ratio": (1.5, 1, 2)}, "stiffen (touch)"),
        (
            "nonlinear_plate",
            {"law": "smooth", "side": "negative"},
            {"knee_strain": (0.018, 0.017, 0.019), "ratio": (0.4, 0.3, 0.5), "sharpness": (3, None, None)},
            "soften (yield) beyond a strain of 1.8 (1.7 to 1.9) % where they bend toward negative offsets",
        ),
        (
            "notch_closing",
            {"side": "positive"},
            {"factor": (1.02, 0.98, 1.05), "stiffness_n_m_per_rad": (3, None, None)},
            "The notches close where they bend toward positive offsets at 1.02 (0.98 to 1.05) times the bend that",
        ),
        ("precurvature", {}, {"curvature_per_m": (1, None, None)}, "All plates are bent"),
        ("precurvature", {"plates": (4,)}, {"curvature_per_m": (1, None, None)}, "Plate 4 is bent"),
        ("precurvature", {"plates": (4, 5, 6)}, {"curvature_per_m": (1, None, None)}, "Plates 4 to 6 are bent"),
        ("tip_load_friction", {}, {"efficiency": (0.8, None, None)}, "only 80 % arrives"),
        (
            "weight_friction",
            {"disk": 6},
            {"efficiency": (0.74, 0.7, 0.8)},
            "disk 6 only 74 (70 to 80) % arrives",
        ),
        ("camera_scale", {}, {"scale": (1.00123, None, None)}, "1.0012 times the true ones"),
    ],
)
def test_a_sentence_says_where_and_how_much_in_the_units_of_the_workshop(kind, place, sizes, said):
    estimates = {name: Estimate(*size) for name, size in sizes.items()}
    assert said in SUSPECTS[kind].sentence(Occurrence(place, estimates, MU))


def test_every_sentence_names_its_place_and_follows_every_estimate(library):
    for hypothesis, _ in library:

        def said(values, hypothesis=hypothesis):
            estimates = {free.name: Estimate(value) for free, value in zip(hypothesis.free, values, strict=True)}
            return SUSPECTS[hypothesis.kind].sentence(Occurrence(dict(hypothesis.place), estimates, MU))

        middle = np.full(len(hypothesis.free), 0.7)
        assert said(middle)[0].isupper()
        assert said(middle).endswith(".")
        for unit in np.eye(len(middle)):
            assert said(middle + 0.1 * unit) != said(middle)
        for name, value in hypothesis.place:
            first = value[0] if isinstance(value, tuple) else value
            assert name == "law" or str(first) in said(middle) or (first == 0 and "base disk" in said(middle))


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
            assert moved.startswith(f"{hypothesis.kind}: ")
        else:
            assert not [name for name, _ in hypothesis.place if name not in ("law", "side")]
            carried.add(hypothesis.kind)
    rules = {"cable_friction", "pulley_friction", "slip_history", "edge_wrap", "tip_load_friction"}
    parts = {"clamp_compliance", "disk_contact", "hole_clearance", "cable_bending"}
    assert carried == rules | parts | {"nonlinear_plate", "notch_closing"}


@pytest.mark.parametrize(
    ("effect", "changed"),
    [
        ({"kind": "clamp_compliance", "compliance_rad_per_n_m": 0.01}, {"segment": {"clamp_m": 0.006}}),
        ({"kind": "disk_contact", "angle_rad": 0.1, "stiffness_n_m_per_rad": 9.0}, {"segment": {"length_m": 0.04}}),
        ({"kind": "hole_clearance", "clearance_m": 1e-3}, {"disk": {"thickness_m": 0.006, "mass_kg": 0.05}}),
    ],
)
def test_what_belongs_to_clamps_gaps_or_holes_carries_over_with_them_alone(effect, changed):
    here, there = recorded(Case(hidden=())).manipulator, other_design(**changed.get("segment", {}))
    if "disk" in changed:
        there = there.replace("disk", changed["disk"])
    known = EFFECT_KINDS[effect["kind"]].model_validate(effect)
    assert SUSPECTS[known.kind].transfer(known, here, other_design()) == known
    assert "which differ" in SUSPECTS[known.kind].transfer(known, here, there)


def test_names_read_as_kind_and_place():
    assert Hypothesis("dead_cable", (("cable", "left"),)).name == "dead_cable (cable left)"
    assert Hypothesis("precurvature", (("plates", (1, 2)),)).name == "precurvature (plates 1+2)"
    assert Hypothesis("edge_wrap").name == "edge_wrap"
