"""The library of suspects: what is suspected where, and within which bounds."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from diagnosis.suspected import MU, bare_sections, recording, scope

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import SUSPECTS, hypotheses
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.prior_odds import log_prior_odds
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Kind


def names(scope, *kinds):
    return [hypothesis.name for hypothesis in hypotheses(scope) if hypothesis.kind in kinds]


def test_every_kind_is_suspected_on_some_rig_and_every_suspicion_has_a_name(library, rubbing):
    assert {hypothesis.kind for hypothesis, _ in library} == set(SUSPECTS)
    suspected = [hypothesis.name for hypothesis in hypotheses(rubbing)]
    assert len(set(suspected)) == len(suspected)


def test_of_one_plate_alone_twice_the_stiffness_is_less_likely_beforehand_than_half_of_it(rubbing):
    """Plates crack and come loose; of a whole segment, which may be of another sheet, both are alike."""
    alone, together = (
        next(one for one in hypotheses(rubbing) if one.kind == kind).free[0]
        for kind in ("weakened_plate", "segment_stiffness")
    )
    stiff, soft = (abs(alone.at(factor)) / alone.prior_sd for factor in (2.0, 0.5))
    assert stiff > 2 > soft
    assert together.at(2.0) == pytest.approx(-together.at(0.5))


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
            if friction == coefficient and hypothesis.continuous and not hypothesis.kinked:
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


def projected_out(scope, kind):
    """Names of what is fitted, by the place."""
    return {h.place: [free.name for free in h.free] for h in hypotheses(scope) if h.kind == kind}


def test_a_knee_is_sought_as_strain_where_every_fibre_is_known(rubbing):
    bilinear, smooth = (("law", "bilinear"),), (("law", "smooth"),)
    known = projected_out(rubbing, "nonlinear_plate")
    assert known[bilinear] == ["knee_strain", "ratio"]
    assert known[smooth] == ["knee_strain", "ratio", "sharpness"]
    segments = bare_sections()
    assert projected_out(scope(segment=segments), "nonlinear_plate")[bilinear] == ["knee_per_m", "ratio"]
    segments[0]["outer_fibre_m"] = 4e-4
    assert projected_out(scope(segment=segments), "nonlinear_plate")[bilinear] == ["knee_per_m", "ratio"]


def test_of_unlike_sections_whose_fibres_are_unknown_the_law_is_sought_as_if_they_had_one_shape():
    segments = bare_sections()
    segments[1]["bending_stiffness_n_m2"] /= 2
    known = projected_out(scope(segment=segments), "nonlinear_plate")
    assert known[(("law", "bilinear"), ("sections", "similar"))] == ["knee_per_m", "ratio"]
    assert (("law", "bilinear"),) not in known


def test_one_side_is_suspected_where_plates_bend_to_both(rubbing, limp):
    sided = "nonlinear_plate (law bilinear, side negative)"
    assert sided in names(rubbing, "nonlinear_plate")
    assert sided not in names(rubbing._replace(bend=np.abs(rubbing.bend)), "nonlinear_plate")
    assert not names(rubbing, "notch_closing")
    closing = ["notch_closing (side negative)", "notch_closing (side positive)", "notch_closing"]
    assert names(limp, "notch_closing") == closing
    assert names(limp._replace(bend=np.abs(limp.bend)), "notch_closing") == closing[1:2]


def test_disks_may_touch_at_bends_that_were_read_though_constants_bend_none_so_far(limp):
    """Most of the bends: one that was misread says nothing."""
    predict, stiff = predictor(limp.recording), limp._replace(bend=0.1 * limp.bend)
    true = predict.read(predict.equilibria(Constants()), Constants())

    def farthest(scope, values):
        read = scope._replace(recording=scope.recording.with_values(values))
        return next(each for each in hypotheses(read) if each.kind == "disk_contact").free[0].high

    assert farthest(limp, true) == pytest.approx(np.abs(limp.bend).max())
    assert farthest(limp, 0 * true) == farthest(limp, true)
    read = farthest(stiff, true)
    assert 0.6 * np.abs(limp.bend).max() < read <= np.abs(limp.bend).max()
    wrong = true.copy()
    wrong[np.flatnonzero(limp.recording.readings.kind == Kind.ANGLE)[0]] = 3.0
    assert farthest(stiff, wrong) == pytest.approx(read, rel=0.2)


def test_notches_that_were_read_to_bend_far_may_close_though_constants_bend_none_so_far(limp):
    predict, stiff = predictor(limp.recording), limp._replace(bend=0.1 * limp.bend)
    read = limp.recording.with_values(predict.read(predict.equilibria(Constants()), Constants()))
    assert not names(stiff, "notch_closing")
    assert names(stiff._replace(recording=read), "notch_closing") == names(limp, "notch_closing")


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
    assert names(frictionless, *rubs) == ["slip_history"]  # of cables that may be found to rub, and are let go again
    falling = frictionless.recording.loads
    pulled = falling._replace(tension=np.maximum.accumulate(falling.tension))
    assert not names(frictionless._replace(recording=replace(frictionless.recording, loads=pulled)), *rubs)
    along = scope(friction={"coefficient": MU, "direction": "history", "wrap": "edges"})
    assert names(along, *rubs, "rate_dependent_friction", "breakaway_friction") == ["slip_history"]
    (travel,) = [h for h in hypotheses(along) if h.kind == "slip_history"]
    nominal = along.manipulator.friction.presliding_m
    tried = [travel.effect(start, MU).presliding_m for start in travel.starts(MU)]
    assert min(tried) < nominal < max(tried)
    assert nominal not in tried
    weightless = scope(disk={"thickness_m": 0.004})
    assert not names(weightless, "gravity")
    idle = rubbing.recording.loads.tension.copy()
    idle[:, 1] = 0
    known = rubbing.recording.loads
    loads = known._replace(tension=idle, tip=0 * known.tip, force=0 * known.force)
    unloaded = rubbing._replace(recording=replace(rubbing.recording, loads=loads))
    assert "dead_cable (cable 2)" not in names(unloaded, "dead_cable")
    assert not names(unloaded, "tip_load_friction", "weight_friction", "payload_scale")
    assert names(rubbing, "weight_friction") == [f"weight_friction{disk}" for disk in ("", " (disk 2)", " (disk 5)")]
    ways = ["gravity", "gravity (y_m_s2 0.0)", "gravity (x_m_s2 0.0)"]
    assert names(rubbing, "gravity", "self_weight", "tip_load_friction") == [*ways, "tip_load_friction"]
    ways = ["self_weight", "self_weight (y_n 0.0)", "self_weight (x_n 0.0)"]
    assert names(weightless, "gravity", "self_weight", "tip_mass") == ways
    blind = rubbing.recording.readings.where(rubbing.recording.readings.kind == 2)
    assert not names(
        rubbing._replace(recording=replace(rubbing.recording, readings=blind)),
        *("camera_scale", "camera_aspect", "lens_distortion"),
    )


def test_friction_by_rates_is_suspected_where_times_say_different_rates(rubbing, frictionless):
    """Rates of 0.02 and 5 N/s in turn; the other law of slip and this one leave each other out."""
    kind, loads = "rate_dependent_friction", rubbing.recording.loads
    assert names(rubbing, kind) == ["rate_dependent_friction (reference_n_per_s 5.0)"]

    def at(rate):
        return rubbing._replace(recording=replace(rubbing.recording, loads=loads._replace(rate=rate)))

    assert not names(frictionless, kind)
    assert not names(at(np.zeros_like(loads.rate)), kind)
    assert not names(at(np.where(loads.rate > 1, 5.0, 2.0)), kind)
    assert not names(at(np.where(loads.tension > 0, 5.0, 0.02)), kind)
    both = [h for h in hypotheses(rubbing) if h.kind in (kind, "slip_history")]
    assert both[0].excludes(both[1])
    assert both[1].excludes(both[0])
    assert not names(scope(effect=[{"kind": kind, "rate": 0.01}]), kind, "slip_history")


def test_static_friction_is_suspected_where_cables_slipped_little_and_far(rubbing, frictionless):
    """Of the recording's own travels the least is 30 N, the largest 95 N: an excess is lost within 10 to 95 N."""
    kind, loads = "breakaway_friction", rubbing.recording.loads

    def at(**changes):
        return rubbing._replace(recording=replace(rubbing.recording, loads=loads._replace(**changes)))

    (found,) = [h for h in hypotheses(rubbing) if h.kind == kind]
    assert (found.free[1].low, found.free[1].high) == pytest.approx((10.0, 95.0))
    assert not names(frictionless, kind)
    assert not names(at(travel=np.where(loads.travel > 50, 60.0, 30.0)), kind)
    assert not names(at(slip=np.zeros_like(loads.slip)), kind)
    slips = next(h for h in hypotheses(rubbing) if h.kind == "slip_history")
    assert found.excludes(slips)
    assert slips.excludes(found)
    assert not names(scope(effect=[{"kind": kind, "excess": 0.1, "decay_n": 9.0}]), kind, "slip_history")


def test_loops_are_suspected_where_a_plate_is_bent_back(rubbing):
    """Loading to either side is no unloading, however the steps of sequences lie side by side."""
    begins, count = rubbing.recording.begins, rubbing.recording.loads.steps
    number = np.arange(count) - np.maximum.accumulate(np.where(begins, np.arange(count), 0)) + 1
    side = np.where(np.cumsum(begins) % 2, 1.0, -1.0)
    grows = (side * number)[:, None] * np.array([0.02, 0.01, 0.01, -0.01, 0.0, 0.03])
    loops = ["hysteretic_plate", "hysteretic_plate (elements 2)", "hysteretic_plate (elements 3)"]
    assert names(rubbing, "hysteretic_plate") == loops
    assert not names(rubbing._replace(bend=grows), "hysteretic_plate")
    back = grows.copy()
    back[3, 5] = grows[1, 5]
    assert number[3] == 4
    assert names(rubbing._replace(bend=back), "hysteretic_plate") == loops
    lost = back.copy()
    lost[3] = np.nan
    assert not names(rubbing._replace(bend=lost), "hysteretic_plate")
    assert projected_out(rubbing, "hysteretic_plate")[()] == ["yield_strain", "slipping_share"]
    assert projected_out(scope(segment=bare_sections()), "hysteretic_plate")[()] == ["yield_per_m", "slipping_share"]


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


def test_what_is_suspected_follows_the_settings(nitinol, limp):
    kinds = [{each.kind for each in hypotheses(known)} for known in (nitinol, stricter(nitinol), limp, stricter(limp))]
    assert "superelastic_plate" in kinds[0] - kinds[1]
    assert "notch_closing" in kinds[2] - kinds[3]


def stricter(known):
    """A scope with settings by which less is suspected."""
    return known._replace(settings=Settings(stiffest_superelastic_pa=1e10, closing_range=(50.0, 100.0)))


def test_how_common_kinds_are_follows_the_settings(rubbing):
    suspected = hypotheses(rubbing)
    usual, rarer = (Search(suspected, 0, settings=Settings(usual_presence=p)).log_odds for p in (0.1, 0.05))
    moved = {each.kind for each in suspected if usual[each] != rarer[each]}
    assert {"worn_hole", "weakened_plate"} <= moved
    assert not {"cable_friction", "dead_cable", "hysteretic_plate"} & moved
    places = sum(each.kind == "worn_hole" for each in suspected)
    worn = next(each for each in suspected if each.kind == "worn_hole")
    assert np.exp(rarer[worn]) * places == pytest.approx(0.05 / 0.95)


def test_what_all_parts_have_from_one_cause_is_as_likely_as_a_fault_of_any_one(rubbing):
    library = [each for each in hypotheses(rubbing) if each.kind == "precurvature"]
    odds = np.exp(log_prior_odds(library, Settings()))
    whole = np.array([each.of_whole_rig for each in library])
    assert 0 < whole.sum() < len(whole)
    assert odds[whole].sum() == pytest.approx(odds[~whole].sum())
    assert odds.sum() == pytest.approx(0.1 / 0.9)
