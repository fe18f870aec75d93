"""What sequences that no fit has seen hold against a model, and what they do not."""

import re
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.stats import chi2

from prb3r.diagnosis import investigate as around
from prb3r.diagnosis import stages
from prb3r.diagnosis.check import check
from prb3r.diagnosis.checks.unseen import (
    ALL_MARKERS,
    JudgedSequence,
    Unseen,
    chance_of_size,
    part_that_does_most,
    unseen,
    usual_square,
)
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.renewal import renewed
from prb3r.diagnosis.fit.calibrate import OutOfBalance, fit_constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result import named
from prb3r.diagnosis.result.remarks import predicted_by_others
from prb3r.diagnosis.result.rig_remarks import off_as_drawn
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.search.rivals import Rival
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search
from prb3r.recording.recording import Recording, Tolerance
from tests.diagnosis.simulated import WEAK, Case, recorded

ASIDE = 4
"""The sequence set aside: "mixed"."""
RATE = Settings().naming_rate


def fitted_to_the_others(recording: Recording) -> Fit:
    return fit_constants(predictor(recording.only(set(range(ASIDE)))))


def aside(recording: Recording) -> Unseen:
    """The sequence that was set aside, where all other readings are believed."""
    others = recording.only(set(range(ASIDE)))
    return unseen(recording, [ASIDE], Settings(), Doubts(np.ones(others.readings.count)))


def with_changed(recording: Recording, step: int, disks: Sequence[int], by: float) -> Recording:
    """A reading at each of some disks, of one step of the sequence set aside, off by so many standard deviations."""
    number, readings = np.flatnonzero(recording.of_sequence == ASIDE)[step], recording.readings
    first = (readings.step == number) & (readings.kind == readings.kind[readings.step == number][0])
    value = readings.value.copy()
    rows = np.flatnonzero(first & np.isin(readings.disk, disks))
    assert len(rows) == len(disks)
    value[rows] += by * reading_sd(recording)[rows]
    return recording.with_values(value)


@pytest.fixture(scope="module")
def clean() -> tuple[Recording, Fit]:
    recording = recorded(Case(hidden=()))
    return recording, fitted_to_the_others(recording)


@pytest.mark.parametrize("off", [7.0, 20.0, 300.0])
def test_a_slip_of_the_eye_refutes_nothing_and_counts_for_no_error(clean, off):
    recording, fitted = clean
    spoilt = aside(with_changed(recording, 1, [3], off))
    (sequence,) = spoilt.by_sequence(fitted)
    assert sequence.p > RATE
    error = [one.errors(fitted, fitted).rmse_explained_m for one in (spoilt, aside(recording))]
    assert error[0] == pytest.approx(error[1], rel=0.05)


def test_two_readings_in_the_tails_refute_nothing(clean):
    """Side by side they are no slips; by Gauss's law they would refute."""
    recording, fitted = clean
    spoilt = aside(with_changed(recording, 1, [3, 4], 5.5))
    (sequence,), count = spoilt.by_sequence(fitted), spoilt.predict.recording.readings.count
    assert chi2.sf(count * sequence.error_sd**2, count) < RATE
    assert sequence.p > RATE


def test_a_noise_that_is_taken_too_large_hides_nothing():
    """Errors are held against those of the fitted readings, in the sentence as in the test."""
    rng = np.random.default_rng(3)
    known, new = rng.normal(size=300), 1.3 * rng.normal(size=80)
    known /= np.sqrt(np.mean(known**2))
    (chance, usual), (other, less) = (
        (chance_of_size(scale * new, scale * known, 300, np.inf), usual_square(scale * known, 300, np.inf))
        for scale in (1.0, 0.7)
    )
    assert other == pytest.approx(chance)
    assert (usual, less) == (pytest.approx(1.0), pytest.approx(0.49))
    assert chance < RATE


@pytest.mark.parametrize("tails", [5, np.inf])
@pytest.mark.parametrize("fitted", [150, 600])
def test_as_many_right_models_are_refuted_as_is_asked_whatever_the_tails_and_the_readings_that_tell_the_noise(
    tails, fitted
):
    """The level is that of the fitted readings; as if it was known, and by Gauss's law, up to 30 times as many are."""
    rng, chances, of_gauss = np.random.default_rng(2), [], []
    for _ in range(4000):
        drawn = rng.standard_t(tails, fitted + 80) if np.isfinite(tails) else rng.normal(size=fitted + 80)
        known, new = np.split(drawn / np.sqrt(np.mean(drawn[:fitted] ** 2)), [fitted])
        chances.append(chance_of_size(new, known, fitted, 3.0))
        of_gauss.append(chi2.sf(new @ new, 80))
    assert np.mean(np.less(chances, RATE)) < 2 * RATE
    assert 0.035 < np.mean(np.less(chances, 0.05)) < 0.065
    assert np.mean(np.less(of_gauss, RATE)) > 1.5 * RATE


def test_where_the_noise_is_known_and_gaussian_the_chance_is_that_of_chi_square():
    rng = np.random.default_rng(0)
    known, new = rng.normal(size=10**6), 1.2 * rng.normal(size=90)
    assert chance_of_size(new, known, 10**6, np.inf) == pytest.approx(chi2.sf(new @ new, 90), rel=0.05)


def test_physics_that_is_missing_refutes():
    """A plate that is 30 % too soft moves all disks beyond it."""
    recording = recorded(Case(hidden=(tuple(WEAK.items()),)))
    (sequence,) = aside(recording).by_sequence(fitted_to_the_others(recording))
    assert sequence.p < RATE / 1000


def test_what_one_of_the_surviving_models_predicts_is_not_refuted():
    """By as much as that model is probable: the mean of the chances, never less than that of the named one."""
    recording = recorded(Case(hidden=(tuple(WEAK.items()),)))
    poor = fitted_to_the_others(recording)
    library = hypotheses(Scope.of(recording, poor.model.predict.chain, poor.solved.states), frozenset())
    (weak,) = [one for one in library if one.kind == "weakened_plate" and dict(one.place)["plate"] == 4]
    good = fit(poor.model.adding(weak), np.append(poor.p, 0.0))
    alone = aside(recording)
    (right,), (wrong,) = alone.by_sequence(good), alone.by_sequence(poor)
    assert right.p > 0.01
    (both,) = alone.by_sequence_averaged(poor, [(0.6, poor), (0.3, good)])
    assert both.p == pytest.approx((0.6 * wrong.p + 0.3 * right.p) / 0.9)
    (named,) = alone.by_sequence_averaged(good, [(0.6, poor), (0.3, good)])
    assert named == right
    chosen = [SimpleNamespace(fitted=fit, kinds={"gravity"}) for fit in (poor, good)]
    said, silent = (predicted_by_others(choice, alone, []) for choice in chosen)
    (plain,) = predicted_by_others(SimpleNamespace(fitted=poor, kinds=set()), alone, [])
    assert plain.startswith(f"constants alone do not predict sequence {wrong.name}, which no fit has seen")
    assert silent == predicted_by_others(chosen[0], alone, [wrong]) == predicted_by_others(chosen[0], None, []) == []
    assert said[0].startswith(
        f"what is named does not predict sequence {wrong.name}, which no fit has seen; only other"
    )


def test_parts_that_the_other_sequences_tell_are_expected_of_the_one_set_aside():
    """Plates a few per cent off: what is foreseen is closer, and its covariance narrower, than of a rig as drawn."""
    uneven = {1: 1.04, 2: 0.95, 4: 0.96, 5: 1.05, 6: 0.95}
    hidden = tuple(tuple({"kind": "weakened_plate", "plate": k, "factor": f}.items()) for k, f in uneven.items())
    tolerance = Tolerance(offset_m=0.0, length_m=0.0, thickness_relative=0.015, marker_m=0.0)
    nearer, narrower = [], []
    for seed in range(3):
        recording = replace(recorded(Case(hidden=hidden, seed=seed)), tolerance=tolerance)
        rough, fresh = fitted_to_the_others(recording), aside(recording)
        fitted = renewed(rough, fresh.doubts)
        foreseen, drawn = fresh.prediction(fitted), fresh.noise(fitted)
        as_drawn, as_made = (
            fresh.predict.misfit(readings) for readings in (fresh.solved(fitted).readings, foreseen.readings)
        )
        nearer.append(np.sum(drawn.whiten(as_made) ** 2) / np.sum(drawn.whiten(as_drawn) ** 2))
        narrower.append(np.sum(foreseen.noise.whiten(as_drawn) ** 2) / np.sum(drawn.whiten(as_drawn) ** 2))
        (sequence,) = fresh.by_sequence(fitted)
        assert sequence.p > RATE
    assert np.mean(nearer) < 0.99
    assert np.mean(narrower) > 1.05


def test_it_is_said_where_parts_off_their_drawing_make_the_error_on_what_was_set_aside():
    """Every plate is longer by 1.5 %, which the recording allows; a rig as drawn gives no cause for it."""
    tolerance = Tolerance(offset_m=0.0, length_m=3e-4, thickness_relative=0.0, marker_m=0.0)
    right, longer = replace(recorded(Case(hidden=())), tolerance=tolerance), []
    for segment in right.manipulator.segment:
        longer.append(segment.model_copy(update={"length_m": segment.length_m * 0.985}))
    drawn = replace(right, manipulator=right.manipulator.model_copy(update={"segment": tuple(longer)}))
    said = []
    for recording in (right, drawn):
        rough, fresh = fitted_to_the_others(recording), aside(recording)
        fitted = renewed(rough, fresh.doubts)
        said.append(off_as_drawn(fresh, fitted, fitted))
    assert said[0] == []
    (sentence,) = said[1]
    assert re.search(r"no part does more of that than .*length_m: measure it$", sentence)
    made, as_drawn = (float(number) for number in re.findall(r"to ([0-9.]+) mm", sentence))
    assert as_drawn > 1.4 * made
    assert off_as_drawn(None, fitted, fitted) == []


def test_many_markers_that_sit_off_their_disks_count_as_one_part():
    """Each moves the readings of its own disk alone, and less than a length moves those of all: together they do more.
    What one part undoes of another counts against it."""
    names = ["segment.1.length_m", "plate 1 length_m", "marker 1 across its disk, m", "marker 2 across its disk, m"]
    moved = np.array([[1.2, -0.9, 1.5, 0.0], [1.2, -0.9, 0.0, 1.5]])
    assert part_that_does_most(names, moved) == ALL_MARKERS
    assert part_that_does_most(names[:2], moved[:, :2]) == "segment.1.length_m"
    assert part_that_does_most([], np.zeros((2, 0))) == ""


def misread(recording: Recording, fitted: Fit, step: int, tip: float) -> Recording:
    """The sequence set aside with an unrecorded force on the tip, N, at one of its steps."""
    number = np.flatnonzero(recording.of_sequence == ASIDE)[step]
    force = np.zeros_like(recording.loads.tip)
    force[number, 1] = tip
    predict = predictor(recording)
    there = [predict(fitted.constants, loads=recording.loads._replace(tip=f)) for f in (force, 0.0 * force)]
    return recording.with_values(recording.readings.value + there[0] - there[1])


@pytest.mark.parametrize("factor", [0.7, 1.15, 9.81])
def test_a_weight_is_not_believed_where_another_one_explains_all(clean, factor):
    recording, fitted = clean
    step = np.flatnonzero(recording.of_sequence == ASIDE)[2]
    tension = recording.loads.tension.copy()
    cable = int(np.argmax(tension[step]))
    tension[step, cable] *= factor
    noted = aside(replace(recording, loads=recording.loads._replace(tension=tension)))
    (weight,) = noted.doubting(fitted).doubted
    assert (weight.step, weight.cable) == (2, cable)
    (sequence,) = noted.doubting(fitted).by_sequence(fitted)
    assert sequence.p > RATE


def test_a_right_weight_is_not_blamed_for_what_no_other_one_explains(clean):
    """What is missed at its step stays a failure of the model."""
    recording, fitted = clean
    assert not aside(recording).doubting(fitted).doubted
    pulled = aside(misread(recording, fitted, 2, 4.0))
    (sequence,) = pulled.by_sequence(fitted)
    assert sequence.p < RATE
    assert pulled.doubting(fitted) is pulled


def test_a_weight_is_believed_that_another_model_predicts_as_it_is_noted():
    """Disks touch at one step alone, of a sequence set aside: without them another weight would explain it."""
    touching = {"kind": "disk_contact", "angle_rad": 0.15, "stiffness_n_m_per_rad": 8.0}
    recording = recorded(Case(hidden=(tuple(touching.items()),)))
    number = recording.sequences.index("in")
    others = recording.only(set(range(5)) - {number})
    fresh = unseen(recording, [number], Settings(), Doubts(np.ones(others.readings.count)))
    plain, whole = fit_constants(predictor(others)), fit_constants(predictor(recording))
    library = hypotheses(Scope.of(recording, plain.model.predict.chain, whole.solved.states), frozenset())
    contact = next(one for one in library if one.kind == "disk_contact")
    sizes = [free.at(touching[free.name]) for free in contact.free]
    there = fit(plain.model.adding(contact), np.append(plain.p, sizes), fixed=range(len(plain.p), len(plain.p) + 2))
    assert [weight.step for weight in fresh.doubting(plain).doubted] == [2]
    assert fresh.doubting(plain, [there]) is fresh
    assert fresh.doubting(plain, [plain]).doubted


@pytest.mark.long
def test_of_models_that_explain_what_was_fitted_alike_the_one_stands_that_predicts_the_rest(monkeypatch):
    """A weak plate at its place predicts what was set aside, one at another place does not; whichever was chosen."""
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    choice, library = searched.choice, searched.tested.doubted.search.library
    elsewhere = next(one for one in library if one.name == "weakened_plate (plate 2)")
    calibrated = choice.calibrated
    wrong = fit(calibrated.model.adding(elsewhere), np.append(calibrated.p, 0.0))
    good, poor, plain = (Survivor(fitted, 0.0, 1 / 3) for fitted in (choice.fitted, wrong, calibrated))
    alike = [Rival(elsewhere, fitted, 0.0, 0.0) for fitted in (wrong, choice.fitted)]
    for rival, plates in zip(alike, [(4,), (2, 4)], strict=True):
        monkeypatch.setattr(named, "rivals", Mock(return_value=[rival]))
        (effect,) = check(searched).named
        assert effect.places["plate"] == (4, plates)
    monkeypatch.undo()
    for first in (good, poor):
        beside = replace(choice, fitted=first.fitted, survivors=(poor, good, plain))
        found = check(replace(searched, choice=beside))
        assert found.choice.fitted is good.fitted
        assert [(survivor.fitted, survivor.probability) for survivor in found.choice.survivors] == [(good.fitted, 1.0)]
        said = [remark for remark in found.remarks if "would explain what was fitted too" in remark]
        assert [remark.partition(":")[0] for remark in said] == ["constants alone", "weakened_plate (plate 2)"]
        assert any("it confirms nothing" in remark for remark in found.remarks) == (first is poor)
    halfway = replace(good, fitted=replace(good.fitted, converged=False))
    found = check(replace(searched, choice=replace(choice, fitted=wrong, survivors=(poor, halfway, plain))))
    assert found.choice.fitted.converged  # no verdict rests on a fit that has not
    assert found.verdict != "unexplained"


@pytest.mark.long
def test_effects_that_two_others_replace_together_are_not_sure_of_their_place():
    """As the offsets of two cables for those of the two opposite ones; here two plates for one."""
    searched = to_search(Task(recorded(), hold_out=False), lambda stage: None, serially)
    choice, library = searched.choice, searched.tested.doubted.search.library
    plates = {k: next(one for one in library if one.name == f"weakened_plate (plate {k})") for k in (2, 3)}

    def with_plates(*numbers: int) -> Fit:
        model = replace(choice.calibrated.model, hypotheses=tuple(plates[k] for k in numbers))
        return fit(model, np.append(choice.calibrated.p, np.zeros(len(numbers))))

    for share, among in [(0.06, (2, 3, 4)), (0.04, (4,))]:
        first, other = Survivor(choice.fitted, 0.0, 1 - share), Survivor(with_plates(2, 3), 0.0, share)
        (effect,) = check(replace(searched, choice=replace(choice, survivors=(first, other)))).named
        assert effect.places["plate"] == (4, among)


@pytest.mark.long
def test_an_effect_of_the_most_probable_model_is_named_where_fitted_and_held_out_sequences_together_show_it(
    monkeypatch,
):
    """The constants alone are as probable as the weak plate by what was fitted; what was set aside shows the plate."""
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    choice = searched.choice
    survivors = (Survivor(choice.fitted, 0.0, 0.5), Survivor(choice.calibrated, 0.0, 0.5))
    simple = replace(searched, choice=replace(choice, fitted=choice.calibrated, survivors=survivors))
    found = check(simple)
    assert [effect.hypothesis.name for effect in found.named] == ["weakened_plate (plate 4)"]
    assert found.refitted.effects == ()  # constants alone, though these were chosen before
    (said,) = (remark for remark in found.remarks if remark.startswith("what was set aside"))
    assert "decided that weakened_plate (plate 4) is named" in said
    assert said.endswith("it confirms nothing")
    missed = Mock(return_value=(JudgedSequence("twist", 0.04, 1.2, False),))
    monkeypatch.setattr(Unseen, "by_sequence", missed)  # not refuted, but no model predicts what was set aside well
    assert not check(simple).named
    monkeypatch.undo()
    monkeypatch.setattr(Unseen, "log_score", lambda *_: -0.5)  # nothing of what was set aside speaks for the plate
    monkeypatch.setattr(Unseen, "refutes", lambda *_: False)  # nor against constants alone
    assert not check(simple).named
    worse = (
        replace(survivors[1], probability=0.993),
        replace(survivors[0], log_evidence=-5.0, probability=0.007),
    )
    monkeypatch.undo()
    assert not check(replace(simple, choice=replace(simple.choice, survivors=worse))).named


@pytest.mark.long
def test_what_it_would_take_to_predict_a_sequence_is_said(monkeypatch):
    """A loss in the pulley of a cable that one sequence alone pulls, and that one set aside."""
    hidden = {"kind": "pulley_friction", "cables": ("3",), "efficiency": 0.8}
    recording = recorded(Case(hidden=(tuple(hidden.items()),)))
    monkeypatch.setattr(stages, "set_aside", lambda *_: (recording.sequences.index("counter"),))
    found = around.investigate(Task(recording))
    assert (found.verdict, found.failed, found.named) == ("unexplained", ("counter",), ())
    (said,) = [remark for remark in found.remarks if remark.startswith("what it would take to predict counter")]
    assert "pulley_friction (cables 3) too, as all sequences fitted together have it; nothing unseen" in said


def test_where_nothing_brings_all_sequences_into_balance_it_is_said_that_nobody_knows(monkeypatch):
    found = SimpleNamespace(
        recording=recorded(), failed=("in",), choice=SimpleNamespace(fitted=fitted_to_the_others(recorded()))
    )
    monkeypatch.setattr(around, "calibrate", raised := Mock(side_effect=OutOfBalance("nothing is")))
    said = around.fitted_too(Task(recorded()), found, serially)
    assert not raised.call_args.args[0].hold_out
    assert said.startswith("what it would take to predict in: not known")
