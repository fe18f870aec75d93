"""What a fit leaves: gross readings, misfits that repeat, and bounds that constants stay within."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import Case, recorded

from prb3r.diagnosis.checks import doubt
from prb3r.diagnosis.evidence.neighbours import correlation, neighbours
from prb3r.diagnosis.evidence.outliers import Doubts, lone_inflation, lone_outliers
from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.covariance import NoiseLevel, reading_sd
from prb3r.diagnosis.fit.model import Model
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.coarser import told_share
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.stages import calibrate
from prb3r.diagnosis.stages import doubt as doubting
from prb3r.model.steps import with_tensions
from prb3r.recording.recording import Kind


@pytest.fixture(scope="module")
def fitted():
    """The constants of a rig of which the file says all."""
    return fit_constants(predictor(recorded(Case(hidden=()))))


def missing(fitted, rows, by):
    """The fit with some readings missed by so many standard deviations."""
    residual = fitted.residual.copy()
    residual[rows] = by
    return replace(fitted, residual=residual)


def believed(fitted):
    return Doubts(np.ones(fitted.model.predict.recording.readings.count))


def at(fitted, step, disks, kind=Kind.Y):
    readings = fitted.model.predict.recording.readings
    return np.flatnonzero((readings.step == step) & np.isin(readings.disk, disks) & (readings.kind == kind))


def test_a_reading_that_a_fit_misses_grossly_and_alone_is_weighed_down_by_its_misfit(fitted):
    assert (lone_outliers(fitted, believed(fitted)) == 1).all()
    (row,) = at(fitted, 7, [3])
    inflation = lone_outliers(missing(fitted, [row], 30.0), believed(fitted))
    assert np.flatnonzero(inflation > 1).tolist() == [row]
    assert inflation[row] == pytest.approx(30.0, rel=0.2)


def test_what_neighbours_miss_alike_is_no_slip_unless_it_was_doubted_before(fitted):
    """A photograph or a plate that is off is physics; two slips side by side were told by the disks around them."""
    rows = at(fitted, 7, [3, 4])
    both = missing(fitted, rows, 30.0)
    assert (lone_outliers(both, believed(fitted)) == 1).all()
    doubts = believed(fitted)
    doubts.inflation[rows] = 30.0
    again = lone_outliers(missing(fitted, rows, 1.0), doubts)  # down-weighted, they leave one standard deviation
    assert np.flatnonzero(again > 1).tolist() == rows.tolist()
    settled = lone_outliers(missing(fitted, rows, 0.01), doubts)  # a better model meets them after all
    assert (settled == 1).all()


def test_a_wrong_reading_is_alone_however_its_neighbours_give_way(fitted):
    """Where tensions scatter much, the others of its photograph are missed the other way; without it they are met."""
    model = fitted.model
    (row,) = at(fitted, 13, [model.predict.recording.readings.disk.max()], Kind.ANGLE)
    scattering = replace(believed(fitted), level=NoiseLevel(tension=30.0))
    noise = scattering.noise(model.predict, fitted.solved, model.settings)
    wrong = np.zeros(len(noise.sd))
    wrong[row] = -40.0 * noise.sd[row]
    white = noise.whiten(wrong)
    assert np.sort(np.abs(white))[-2] > np.abs(white).max() / 4
    strict = replace(model.settings, lone_ratio=4.0)
    inflation = lone_inflation(model.predict.recording, white, noise, np.ones(len(white)), strict)
    assert np.flatnonzero(inflation > 1).tolist() == [row]


def test_one_that_is_doubted_says_nothing_of_the_reading_beside_it(fitted):
    """However far off it is by now."""
    rows = at(fitted, 7, [3, 4])
    doubts = believed(fitted)
    assert (lone_outliers(missing(fitted, rows, 30.0), doubts) == 1).all()
    doubts.inflation[rows[0]] = 40.0
    white = fitted.residual.copy()
    white[rows] = 20.0, 30.0
    inflation = lone_outliers(replace(fitted, residual=white), doubts)
    assert np.flatnonzero(inflation > 1).tolist() == rows.tolist()


def test_neighbours_are_of_one_kind_and_one_line(fitted):
    recording = fitted.model.predict.recording
    step, disk, kind, _ = recording.readings
    first, second = neighbours(recording, "disks")
    assert (step[first] == step[second]).all()
    assert (kind[first] == kind[second]).all()
    assert (disk[second] - disk[first] == 1).all()
    first, second = neighbours(recording, "steps")
    assert (disk[first] == disk[second]).all()
    assert (recording.of_sequence[step[first]] == recording.of_sequence[step[second]]).all()


def test_a_misfit_that_repeats_tells_as_little_as_an_autoregressive_series_of_its_correlation(fitted):
    recording = fitted.model.predict.recording
    count = recording.readings.count
    rng = np.random.default_rng(3)
    alone = missing(fitted, np.arange(count), rng.standard_normal(count))
    assert abs(correlation(recording, alone.residual[:count], "disks")) < 0.15
    assert told_share(alone) == pytest.approx(1.0, abs=0.3)
    common = rng.standard_normal(len(recording.of_sequence))[recording.readings.step]
    alike = missing(fitted, np.arange(count), common)
    assert correlation(recording, alike.residual[:count], "disks") == pytest.approx(1.0)
    most = fitted.model.settings.most_alike
    assert told_share(alike) < 1.3 * (1 - most) / (1 + most)
    louder = missing(fitted, np.arange(count), 3 * alone.residual[:count])
    assert told_share(louder) == pytest.approx(told_share(alone) * alone.reduced / louder.reduced, rel=0.05)


def test_constants_stay_where_their_manipulator_file_can_be_read_again(fitted):
    model: Model = fitted.model
    nominal = model.predict.recording.manipulator
    low, high = model.bounds(fitted.p)
    for name, path in (("log_stiffness", "youngs_modulus_pa"), ("log_friction", "friction.coefficient")):
        value = nominal.youngs_modulus_pa if name == "log_stiffness" else nominal.friction.coefficient
        for end in (low, high):
            factor = float(np.exp(0.999999 * end[model.varied.index(name)]))  # rounding apart
            assert nominal.replace(path, value * factor) != nominal


@pytest.mark.long
def test_a_disk_that_slides_along_the_arm_step_by_step_leaves_something_to_explain():
    known = recorded(Case(hidden=()))
    readings = known.readings
    sliding = (readings.kind == Kind.X) & (readings.disk == 3)
    slid = 0.004 * readings.step / readings.step.max()
    found = investigate(Task(known.with_values(readings.value - np.where(sliding, slid, 0.0))))
    assert found.verdict == "unexplained"
    assert "lasts from step to step" in found.why


@pytest.mark.long
def test_a_right_model_is_not_said_to_leave_what_lasts():
    found = investigate(Task(recorded(Case(hidden=(), seed=7))))
    assert found.verdict == "adequate"
    assert not any("speak against" in remark or "off its drawing" in remark for remark in found.remarks)


@pytest.mark.parametrize(("share", "doubted"), [(0.5, False), (1.5, True)])
def test_a_weight_is_doubted_at_the_rate_at_which_effects_are_named(fitted, monkeypatch, share, doubted):
    """Between the rate of alarms and that of names it is believed, beyond both it is not."""
    known = Search((), 0)
    told = doubt.scores

    def as_large(fit, tested, seed):
        plain = told(fit, tested, seed)
        return replace(plain, z=np.full(len(plain.z), plain.threshold + share * (plain.naming - plain.threshold)))

    monkeypatch.setattr(doubt, "scores", as_large)
    monkeypatch.setattr(doubt, "examine", lambda *_: SimpleNamespace(largest=0.0))
    monkeypatch.setattr(doubt, "level_under", lambda *_: SimpleNamespace(level=NoiseLevel()))
    assert (doubt.wrong_weight(fitted, known, believed(fitted)) is not None) == doubted


def test_a_weight_is_doubted_beyond_the_noise_that_is_there_not_that_which_is_stated():
    """Readings scatter 1.8 times as much as stated; the draw is one in which a right weight stands out of that."""
    right = recorded(Case(hidden=()))
    scatter = np.random.default_rng(3).standard_normal(right.readings.count)
    noisy = right.with_values(right.readings.value + 1.5 * reading_sd(right) * scatter)
    half = right.loads.tension.copy()
    half[9] *= 0.5
    halved = replace(noisy, loads=with_tensions(noisy.loads, half, noisy.begins))
    for noted, doubted in ((noisy, []), (halved, [half[9].max()])):
        known = doubting(calibrate(Task(noted)), serially)
        pulled = known.fitted.model.predict.recording.loads.tension
        assert [pulled[weight.step, weight.cable] for weight in known.doubts.weights] == doubted


@pytest.mark.long
@pytest.mark.parametrize("told_apart", [True, pytest.param(False, marks=pytest.mark.long)])
def test_one_wrong_reading_at_the_tip_is_no_wrong_weight(monkeypatch, told_apart):
    """Beyond the tip there is no neighbour that would show it, so that a weight may seem wrong: were it not told."""
    if not told_apart:
        monkeypatch.setattr(doubt, "FEWEST_TO_TELL", 10**6)
    known = recorded(Case(hidden=()))
    readings = known.readings
    last = (readings.kind == Kind.ANGLE) & (readings.disk == known.manipulator.plates) & (readings.step == 4)
    assert last.sum() == 1
    found = investigate(Task(known.with_values(readings.value + np.where(last, 0.1, 0.0))))
    assert found.verdict == "adequate"
    assert any("it was not believed" in remark for remark in found.remarks) != told_apart
