"""Real rigs of the benchmark: what is planted is what is meant, and what is scored is what is planted."""

import dataclasses
import re

import numpy as np
import pytest

from prb3r.diagnosis.checks.setup.find import remedies
from prb3r.diagnosis.settings import Settings
from prb3r.errors import RecordingError
from prb3r.proof.concealed.apart import squared_distances
from prb3r.proof.concealed.blunders import BLUNDERS
from prb3r.proof.concealed.build import Build, drawn_build, reading_noise, rig_as_built
from prb3r.proof.concealed.camera import truth
from prb3r.proof.concealed.composition import counts, flavours, requests
from prb3r.proof.concealed.design import Flavour, followed, largest_bend
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.elsewhere import OTHER_DESIGN, OTHER_LOADS, built_there, carried, target_states
from prb3r.proof.concealed.folder import recorded_tables, recording_from_folder
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.real import REAL_CLASSES, build_of, real_label, several_effects
from prb3r.proof.concealed.sealing import Seal
from prb3r.proof.concealed.worth import worths
from prb3r.proof.judging.forecast import Forecast
from prb3r.proof.judging.intervals import share_of
from prb3r.proof.judging.missed import miss_of
from prb3r.proof.judging.opened import OpenedCase
from prb3r.proof.judging.real_scores import REAL_GOALS, REFUSED, is_hit, listed_set, named_of, whole_set
from prb3r.proof.judging.verdict import Claim, Verdict
from prb3r.proof.settings import SETTINGS

SEED = 78
PLAIN = (0.0, 0.0), (0.0, 0.0, 0.0)
"""Constants and frame as they are stated."""


@pytest.fixture(scope="module")
def design():
    """Several segments of few plates, and four of the sequences."""
    drawn = (design_of(SEED, k, Flavour.REAL) for k in range(20))
    small = next(each for each in drawn if len(each.manipulator["segment"]) > 1 and each.plates < 6)
    return dataclasses.replace(small, program=small.program[:4])


@pytest.fixture(scope="module")
def label(design):
    return real_label(Request(0, SEED, "several", 0), design)


def exact(design):
    """A rig built as drawn."""
    n, m = design.plates, len(design.cables)
    return Build([0.0] * n, [0.0] * n, [[0.0] * m] * n, [[0.0] * 2] * n, 1.0, 1.0)


def test_a_rig_built_as_drawn_is_the_drawn_one(design):
    effects = [
        {"kind": "segment_stiffness", "segment": 2, "factor": 0.8},
        {"kind": "worn_hole", "disk": 1, "coefficient": 0.9},
    ]
    drawn = truth(design, effects)
    for a, b in zip(
        followed(drawn, design.program), followed(rig_as_built(drawn, exact(design)), design.program), strict=True
    ):
        assert np.abs(a.x - b.x).max() < 1e-12
        assert np.abs(a.angle - b.angle).max() < 1e-12


def test_imperfections_are_within_what_is_said(design):
    build = drawn_build(np.random.default_rng(0), design)
    built, chosen = rig_as_built(truth(design), build), SETTINGS.real
    lengths = [s["length_m"] for s in design.manipulator["segment"] for _ in range(s["plates"])]
    off = np.array([s["length_m"] for s in built["segment"]]) / lengths - 1
    assert 0 < np.abs(off).max() <= chosen.geometry
    assert np.unique(off).size == design.plates
    assert chosen.noise[0] <= build.noise <= chosen.noise[1]


def test_noise_has_its_scale_its_tails_and_what_neighbours_share(design):
    build = dataclasses.replace(exact(design), noise=1.5)
    drawn = reading_noise(np.random.default_rng(1), build, (20_000, 6, 1))[..., 0]
    assert drawn.std() == pytest.approx(1.5, rel=0.01)
    share = SETTINGS.real.common * np.exp(-1 / SETTINGS.real.common_reach)
    assert np.corrcoef(drawn[:, 2], drawn[:, 3])[0, 1] == pytest.approx(share, abs=0.02)
    assert np.mean((drawn / drawn.std()) ** 4) > 4  # Gauss: 3


def test_several_effects_are_of_as_many_kinds_and_of_sizes_that_rigs_show(design):
    for seed in range(40):
        planted = several_effects(np.random.default_rng(seed), design)
        assert 3 <= len(planted) <= 5
        assert len({each.effect["kind"] for each in planted}) == len(planted)
    bare = design_of(SEED, 3, Flavour.REAL_BARE)
    assert all(
        "cable_friction" in {each.effect["kind"] for each in several_effects(np.random.default_rng(k), bare)}
        for k in range(5)
    )


def test_what_constants_can_imitate_is_worth_nothing(design):
    one = next(d for d in (design_of(SEED, k, Flavour.REAL) for k in range(20)) if len(d.manipulator["segment"]) == 1)
    stiffer = [{"kind": "segment_stiffness", "segment": 1, "factor": 1.02}]
    (nothing,) = worths(dataclasses.replace(one, prior={}), stiffer, *PLAIN, exact(one), one.program)
    assert nothing < 0.02


def test_an_effect_of_twice_the_size_is_worth_twice_as_much(design):
    small, twice = (
        worths(design, [{"kind": "weakened_plate", "plate": 2, "factor": f}], *PLAIN, exact(design), design.program)[0]
        for f in (0.99, 0.98)
    )
    assert twice / small == pytest.approx(2, rel=0.03)


def test_distances_grow_with_the_square_of_a_small_effect(design):
    few = dataclasses.replace(design, program=design.program[:2])
    small, twice = (
        squared_distances(few, [{"kind": "hole_offset", "cable": "1", "offset_m": x}], *PLAIN, exact(few))[0]
        for x in (5e-4, 1e-3)
    )
    assert twice / small == pytest.approx(4, rel=0.1)


def test_a_rig_keeps_its_equilibria_wherever_it_is_asked(design, label):
    assert {target["name"] for target in label.targets} == {OTHER_LOADS, OTHER_DESIGN}
    for target in label.targets:
        states = target_states(design, target, label.effects, label.constants, built_there(target, build_of(label)))
        assert largest_bend(states) < SETTINGS.real.largest_bend_rad
    other = next(target["manipulator"] for target in label.targets if target["name"] == OTHER_DESIGN)
    assert [s["thickness_m"] for s in other["segment"]] != [s["thickness_m"] for s in design.manipulator["segment"]]
    assert len(label.worth) == len(label.effects) == len(label.apart)


def test_another_design_is_made_within_tolerances_and_judged_as_such_by_bands_alone(design, label):
    """Bands around the rig as it was made hold it, and bands as narrow around the drawn one do not; errors count from
    the drawn one, since nobody can know how a rig will come out."""
    target = next(target for target in label.targets if target["name"] == OTHER_DESIGN)
    build, asked = built_there(target, build_of(label)), (design, target, label.effects, label.constants)
    assert 0 < np.abs(build.thickness).max() <= SETTINGS.real.geometry
    assert len(build.thickness) == sum(segment["plates"] for segment in target["manipulator"]["segment"])
    made, drawn = (
        np.stack([np.concatenate([getattr(s, f) for s in states]) for f in ("x", "y", "angle")], -1)
        for states in (target_states(*asked, build), target_states(*asked, None))
    )
    away = np.abs(made - drawn)[:, -1].max() / 10
    for centre, covered in ((made, 1.0), (drawn, 0.5)):
        forecast = Forecast(OTHER_DESIGN, drawn + 0.01, drawn, centre - away, centre + away)
        (missed,) = miss_of(design, label, Verdict(0, "diagnose", "explained", elsewhere=(forecast,)))
        assert missed.removed == pytest.approx(1.0)
        assert missed.covered == 1.0 if covered == 1.0 else missed.covered < 0.9


def test_faults_of_parts_stay_and_ways_of_building_go_along(design):
    thicker = [{**s, "thickness_m": 2 * s["thickness_m"]} for s in design.manipulator["segment"]]
    there = dataclasses.replace(design, manipulator={**design.manipulator, "segment": thicker})
    stays = [{"kind": "dead_cable", "cable": "1"}, {"kind": "pulley_friction", "efficiency": 0.9, "cables": ["1"]}]
    goes = [{"kind": "pulley_friction", "efficiency": 0.9}]
    law = {"kind": "nonlinear_plate", "law": "cubic", "cubic_m2": 1e-3}
    assert carried([*stays, *goes, law], design, there) == [*goes, {**law, "cubic_m2": pytest.approx(4e-3)}]


def test_the_seal_keeps_labels_of_real_rigs(label):
    (opened,) = Seal([label]).opened([0])
    assert (opened.effects, opened.build, opened.worth) == (label.effects, label.build, label.worth)


@pytest.mark.parametrize("kind", BLUNDERS)
def test_every_blunder_is_undone_by_what_is_to_be_said_of_it(design, label, kind):
    """The remedy of that name gives back what the tables held before; or reading them is refused for that reason."""
    if not BLUNDERS[kind].possible(design):
        others = (design_of(SEED, k, Flavour.REAL) for k in range(20))
        design = next(other for other in others if BLUNDERS[kind].possible(other))
        label = real_label(Request(0, SEED, "imperfect-clean", 0), design)
    details = BLUNDERS[kind].possible(design)[-1]
    blunder = {"kind": kind, **details, "said": BLUNDERS[kind].said(details)}
    plain = dataclasses.replace(label, build={**label.build, "gaps": False})
    before = recording_from_folder(design, plain)
    wrong = dataclasses.replace(plain, blunder=blunder)
    if blunder["said"] in REFUSED:
        with pytest.raises(RecordingError, match=re.escape(REFUSED[blunder["said"]])):
            recording_from_folder(design, wrong)
        return
    after = recording_from_folder(design, wrong)
    remedy = next(remedy for remedy in remedies(after, Settings()) if remedy.blunder == blunder["said"])
    mended = remedy.mend(after).recording
    assert np.allclose(mended.loads.tension, before.loads.tension, atol=1e-3)
    assert np.array_equal(mended.loads.slip, before.loads.slip)
    assert [(c.offset_m, c.ends_at_segment) for c in mended.manipulator.cable] == [
        (c.offset_m, c.ends_at_segment) for c in before.manipulator.cable
    ]

    def known(recording):
        keys = zip(*(field.tolist() for field in recording.readings[:3]), strict=True)
        return dict(zip(keys, recording.readings.value.tolist(), strict=True))

    was, now = known(before), known(mended)
    assert len(now) > 0.7 * len(was)
    assert all(was[key] == pytest.approx(value, abs=1e-9) for key, value in now.items())


def test_nothing_of_the_truth_stands_in_the_tables(design, label):
    tables = recorded_tables(design, label)
    assert dict(tables.manipulator) == dict(design.manipulator)
    loads = [name for name in tables.steps if name.startswith("cable_")]
    noted = np.array([[step[name] for name in loads] for steps in design.program for step in steps])
    assert np.array_equal(tables.steps[loads].to_numpy(), noted)


@pytest.mark.long
def test_every_real_rig_is_a_design_of_its_own():
    asked, kinds = counts(100, REAL_CLASSES), flavours(100, REAL_CLASSES)
    assert sum(asked.values()) == 100 == len(kinds)
    assert set(asked) == set(REAL_CLASSES)
    several = kinds[: asked["several"]]
    quarter = len(several) / 4
    assert several.count(Flavour.REAL_BARE) == pytest.approx(quarter, abs=1)
    assert sum(flavour.is_slow for flavour in several) == pytest.approx(quarter, abs=1)
    made = [design_of(SEED, k, flavour) for k, flavour in enumerate(kinds[:4])]
    assert [each.design for each in requests(SEED, 4, made, ["several"])] == [0, 1, 2, 3]


def forecast_of(design, label, away):
    """A forecast of other loads that is off by parts of what calibration alone is off."""
    target = next(each for each in label.targets if each["name"] == OTHER_LOADS)
    states = target_states(design, target, label.effects, label.constants, build_of(label))
    true = np.stack([np.concatenate([getattr(s, f) for s in states]) for f in ("x", "y", "angle")], -1)
    calibrated = true + 0.01
    explained = true + away * 0.01
    return Forecast(OTHER_LOADS, calibrated, explained, explained - 0.002, explained + 0.002)


@pytest.mark.parametrize(("away", "removed", "covered"), [(0.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.1, 0.99, 1.0)])
def test_excess_error_is_removed_by_what_is_right(design, label, away, removed, covered):
    verdict = Verdict(0, "diagnose", "explained", elsewhere=(forecast_of(design, label, away),))
    (missed,) = miss_of(design, label, verdict)
    assert missed.removed == pytest.approx(removed, abs=1e-9)
    assert missed.covered == covered
    assert missed.counts


def test_a_failure_counts_as_nothing_removed(design, label):
    for missed in miss_of(design, label, Verdict(0, "diagnose", "failed")):
        assert missed.counts
        assert (missed.removed, missed.covered) == (0, 0)


def test_names_count_by_kind_and_place():
    effects = ({"kind": "weakened_plate", "plate": 3, "factor": 0.8}, {"kind": "gravity", "y_m_s2": 2.0})
    label = Label(0, "several", 0, 0, effects=effects, worth=(3.0, 3.0))
    gravity = Claim("gravity", {})
    right, beside = Claim("weakened_plate", {"plate": 3}), Claim("weakened_plate", {"plate": 4})
    among = Claim("weakened_plate", {"plate": 4}, sets={"plate": (3, 4)})

    def case(*named, models=()):
        return OpenedCase(label, Verdict(0, "diagnose", "explained", named, models=models), 0.3)

    assert named_of(case(right, gravity)) == [True, True]
    assert named_of(case(beside)) == [False, False]
    assert named_of(case(among)) == [True, False]
    worn = {"kind": "worn_hole", "disk": 3, "cables": ("1",)}
    other_cable = Claim("worn_hole", {"disk": 2, "cables": ("2",)}, sets={"disk": (2, 3)})
    assert is_hit(Claim("worn_hole", {"disk": 2, "cables": ("1",)}, sets={"disk": (2, 3)}), worn)
    assert not is_hit(other_cable, worn), "the disk is among those not told apart, and the cable is another one"
    assert whole_set(case(right, gravity))
    assert not whole_set(case(right, gravity, Claim("dead_cable", {"cable": "1"})))
    assert listed_set(case(right, models=(("weakened_plate (plate 3)", "gravity"),)))
    assert not listed_set(case(right, models=(("weakened_plate (plate 3)",),)))
    (wrong,) = [goal for goal in REAL_GOALS if goal.name == "several: names that are wrong"]
    assert wrong.measure([case(right, gravity, Claim("dead_cable", {"cable": "1"}))]).value == pytest.approx(1 / 3)


def test_outcomes_that_are_alike_within_a_cluster_count_once():
    outcomes = [True, True, False, True, False, True, True, False, True, True] * 3
    alone = share_of(outcomes)
    fivefold = share_of(np.repeat(outcomes, 5), np.repeat(np.arange(30), 5))
    assert fivefold.value == alone.value
    assert (fivefold.low, fivefold.high) == pytest.approx((alone.low, alone.high), abs=0.01)
