"""Models fitted in full: which are expanded, and what is told of the noise."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis.simulated import MU, NITINOL, recorded
from diagnosis.suspected import scope

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import SUSPECTS, hypotheses
from prb3r.diagnosis.search import pool as pooled
from prb3r.diagnosis.search import starts
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.search.pool import Effects, Pool
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Explored, begun_anew
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search


@pytest.fixture(scope="module")
def library(suspects):
    return tuple(each for each in suspects if each.kind in {"weakened_plate", "segment_stiffness", "precurvature"})


def with_effect(calibrated, library, name):
    chosen = next(each for each in library if each.name == name)
    return fit(calibrated.model.adding(chosen), np.append(calibrated.p, 0.0))


def test_of_an_effect_that_is_kept_no_other_takes_the_place(calibrated, library):
    """The weak plate explains all, so that free proposals around a wrong segment lead back to it alone."""
    wrong = with_effect(calibrated, library, "segment_stiffness (segment 2)")
    there = frozenset(wrong.model.hypotheses)
    free, kept = (Pool(Search(library, 0), Settings(), [calibrated, wrong]) for _ in range(2))
    free.expand(there)
    kept.expand(there, keeping=there)
    assert any(not there <= effects for effects in set(free.fits) - {Effects()})
    assert len(kept.fits) > 2
    assert all(there <= effects for effects in set(kept.fits) - {Effects()})


def test_the_best_fit_has_converged_before_anything_is_told_of_the_noise(calibrated, library):
    hasty = replace(calibrated.model, settings=replace(calibrated.model.settings, most_steps=2))
    weak = next(each for each in library if each.name == "weakened_plate (plate 4)")
    begun = fit(hasty.adding(weak), np.append(calibrated.p, 0.0))
    assert not begun.converged
    patient = replace(begun, model=replace(begun.model, settings=calibrated.model.settings))
    pool = Pool(Search(library, 0), Settings(), [calibrated, patient])
    assert pool.polished_best().converged
    assert pool.best.chi2 <= begun.chi2


def test_an_exchanged_model_is_fitted_without_what_it_no_longer_needs(calibrated, library):
    """The softer segment needs bent plates beside it; the weak plate that explains all needs nothing."""
    softer = with_effect(calibrated, library, "segment_stiffness (segment 2)")
    bent = next(each for each in library if each.name == "precurvature")
    model = replace(calibrated.model, settings=replace(calibrated.model.settings, gross=np.inf))
    wrong = fit(model.adding(*softer.model.hypotheses).adding(bent), np.append(softer.p, 0.0))
    pool = Pool(Search(library, 0), model.settings, [calibrated, wrong])
    assert pool.exchange(wrong)
    assert {each.name for each in pool.best.model.hypotheses} == {"weakened_plate (plate 4)"}


def test_a_model_with_an_effect_that_moves_nothing_does_not_survive(calibrated):
    """Plates that do not soften have no flag-shaped loops: the recording tells nothing of them, prior odds remain."""
    flags = next(each for each in hypotheses(scope(youngs_modulus_pa=NITINOL[0])) if each.kind == "flag_hysteresis")
    model = calibrated.model.adding(flags)
    with_flags = fit(model, np.append(calibrated.p, flags.starts(MU)[0]))
    assert with_flags.idle == {flags}
    pool = Pool(Search((flags,), 0), Settings(), [calibrated, with_flags])
    assert len(pool.fits) == 2
    assert [survivor.effects for survivor in pool.survivors()] == [frozenset()]


def test_a_fit_that_stopped_elsewhere_is_left_for_a_better_one_from_random_points_around_it(calibrated, library):
    right = with_effect(calibrated, library, "weakened_plate (plate 4)")
    model, p = right.model, right.p + 4 * np.sqrt(np.diag(right.covariance))
    solved = model.solve(p)
    stopped = model.fitted(p, model.residuals(p, solved), model.jacobian(p, solved), solved, True)
    assert calibrated.chi2 > stopped.chi2 > right.chi2 + 4
    pool = Pool(Search(library, 0), Settings(), [calibrated, stopped])
    assert pool.restart()
    assert pool.best.chi2 == pytest.approx(right.chi2, abs=Settings().idle_gain)
    assert not pool.restart()
    begun = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pooled, "_fitted", lambda task: begun.append(task[1]))
        assert not Pool(Search(library, 0), Settings(), [calibrated, stopped]).restart()
    posterior = np.sqrt(np.diag(stopped.covariance))
    told = 5 * posterior < stopped.model.deviations  # by the readings, not by priors alone
    away = (np.array(begun) - stopped.p)[:, told] / posterior[told]
    assert told.any()
    assert away.shape[0] == 24
    assert np.sqrt(np.mean(away**2)) == pytest.approx(5, rel=0.25)

    search, doubts = Search(library, 0), Doubts(np.ones(calibrated.recording.readings.count))
    again = begun_anew(Explored(Pool(search, Settings(), [calibrated, stopped]), doubts, None), search)
    assert [each.name for each in again.pool.best.model.hypotheses] == ["weakened_plate (plate 4)"]
    assert again.pool.best.reduced == pytest.approx(1, abs=0.3)
    assert begun_anew(Explored(Pool(search, Settings(), [calibrated]), doubts, None), search) is None


def test_a_search_begins_anew_where_more_than_noise_is_left_and_nowhere_else(monkeypatch):
    """A weak plate, with it among the suspects and without."""
    begun = []
    monkeypatch.setattr(starts, "begun_anew", lambda explored, search: begun.append(explored))
    for known, structured in (("weakened_plate", False), ("gravity", True)):
        begun.clear()
        task = Task(recorded(), without=frozenset(SUSPECTS) - {known})
        assert to_search(task, lambda stage: None, serially).choice.structured == structured
        assert len(begun) == structured
