"""The stage of a diagnosis before the last: the choice is tested on sequences that were set aside, and judged."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.predicting import is_picked, predicting
from prb3r.diagnosis.checks.residuals import ModelCheck, model_checks
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.checks.unread import disk_to_read
from prb3r.diagnosis.checks.unseen import JudgedSequence, Unseen, unseen
from prb3r.diagnosis.checks.verdict import empirical_law, verdict_on, why_doubtful, why_misleading, why_unexplained
from prb3r.diagnosis.evidence.stated_accuracy import share_of_stated
from prb3r.diagnosis.fit.calibrate import as_drawn, constants_as_drawn, constants_as_filed
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances
from prb3r.diagnosis.known import Doubted, Searched
from prb3r.diagnosis.result.constant_remarks import (
    end_on_bounds,
    far_constants,
    far_frame,
    frame_of_constants_alone,
    frame_that_was_taken,
)
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.named import intervals_of, is_felt, named_effect, separations, surviving
from prb3r.diagnosis.result.remarks import (
    against_the_best,
    as_many_as_sought,
    as_the_file_has_it,
    chosen_by,
    found_before,
    likely_too,
    never_unloaded,
    not_predicted,
    not_ruled_out,
    or_a_blunder,
    other_forms,
    predicted_by_others,
    refuted_sets,
)
from prb3r.diagnosis.result.rig_remarks import (
    at_bounds,
    below_stated,
    bent_at_many_places,
    beyond_tolerance,
    far_rims,
    impossible_rims,
    misplaced_marker,
    noisy,
    off_as_drawn,
    scattered,
    too_vague,
    uneven_plates,
    weighed,
    wrong_weights,
)
from prb3r.diagnosis.search.contradicted import without_contradicted
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.search.rivals import with_replacements
from prb3r.diagnosis.search.selection import Choice
from prb3r.model.effects.base import Effect
from prb3r.recording.frozen import frozen
from prb3r.recording.holds import creeping
from prb3r.recording.plausibility import slips_the_other_way
from prb3r.recording.times import odd_times


def check(searched: Searched, blunder: Blunder | None = None) -> Investigation:
    """Test the choice on the sequences set aside, and give the verdict, the named effects and the remarks.

    Parameters
    ----------
    blunder : a blunder of the set-up that would explain the recording instead of effects.
    """
    tested = searched.tested
    choice = without_contradicted(searched.choice, tested.doubted.search)
    if choice.structured:
        choice = replace(choice, share_of_stated=share_of_stated(choice.fitted, choice.doubts))
    doubted, calibrated = tested.doubted, choice.calibrated
    fresh, before = _set_aside(doubted, choice), choice.fitted
    choice, refitted, checks, failed, refuted, why = _tested_on(fresh, choice, doubted)

    reported = as_drawn(choice.fitted) if why else choice.fitted
    effects = [k for k in range(len(reported.effects)) if not why or is_felt(reported, k)]
    intervals = {} if why else intervals_of(reported, effects, doubted.search.apply)
    compared = with_replacements(choice, effects, doubted.search)
    named = tuple(
        named_effect(compared, k, doubted.search, fresh, reported, intervals, partial=bool(why)) for k in effects
    )
    law, gain = empirical_law(fresh, calibrated, choice.fitted, doubted.task.seed) if why else (None, None)
    filed = better_as_filed(choice.calibrated, refitted or reported, fresh) if why and fresh else None
    missed = predicted_by_others(choice, fresh, failed)
    odd = bool(at_bounds(choice.fitted) or missed) or impossible_rims(choice.fitted)
    errors = _errors(fresh, choice.fitted, refitted or reported, reported) if fresh else None
    vague = too_vague(errors, choice.fitted.model.settings) if errors and not (why or failed) else []
    odd = odd or is_picked(choice, before, fresh) or bool(vague)
    unsure = odd or blunder is not None or any(effect.rivals for effect in named)
    verdict = "unexplained" if why else verdict_on(choice, unsure, end_on_bounds(reported))
    tolerances = tolerances_told(choice.fitted, choice.doubts)
    return Investigation(
        recording=doubted.recording,
        seed=doubted.task.seed,
        verdict=verdict,
        why=why,
        training=calibrated.recording,
        fresh=fresh,
        calibrated=calibrated,
        refitted=refitted or reported,
        filed=filed,
        reported=reported,
        before=tested.scores,
        choice=choice,
        doubts=choice.doubts,
        named=named,
        models=surviving(choice, fresh),
        tolerances=tolerances,
        checks=checks,
        closure=law,
        closure_gain=gain,
        heldout=errors,
        experiments=separations(choice, named) if verdict == "ambiguous" else (),
        failed=tuple(sequence.name for sequence in failed),
        rival_blunder=blunder,
        remarks=(
            *doubted.recording.remarks,
            *slips_the_other_way(doubted.recording),
            *odd_times(doubted.recording),
            *creeping(doubted.recording),
            *frozen(doubted.recording),
            *or_a_blunder(blunder),
            *_on_what_is_reported(doubted, reported, [reported.effects[k] for k in effects]),
            *frame_of_constants_alone(refitted),
            *_on_the_model(choice, doubted, checks, tolerances, unexplained=bool(why)),
            *_on_the_noise(choice, doubted, fresh),
            *(() if why else other_forms(named)),
            *(off_as_drawn(fresh, choice.fitted, reported) if not failed else ()),
            *missed,
            *vague,
            *(disk_to_read(choice) if verdict == "ambiguous" else ()),
            *(as_the_file_has_it(fresh, refitted or reported, filed) if fresh and filed else ()),
            *_on_what_was_set_aside(choice, before, fresh, failed, refuted),
        ),
    )


class _Checked(NamedTuple):
    """A choice that was tested on the sequences set aside."""

    choice: Choice
    """The choice among the models that survive this test."""
    refitted: Fit | None
    """The constants alone with all parts as drawn; None for a choice without effects."""
    checks: tuple[ModelCheck, ...]
    """All checks of the chosen model."""
    failed: list[JudgedSequence]
    """Sequences that the chosen model does not predict."""
    refuted: tuple[Survivor, ...]
    """Other models that explain the fitted sequences but do not predict these."""
    why: str
    """Why the verdict is `unexplained`; empty if it is not."""


def _tested_on(fresh: Unseen | None, choice: Choice, doubted: Doubted) -> _Checked:
    """The choice after the test on the sequences set aside (None without any), with all checks of its model."""
    models = [(survivor.probability, survivor.fitted) for survivor in choice.survivors]
    choice = predicting(choice, fresh, doubted.search)
    refitted = constants_as_drawn(choice.calibrated) if choice.fitted.model.hypotheses else None
    judged = fresh.by_sequence_averaged(choice.fitted, models) if fresh else ()
    failed = [sequence for sequence in judged if fresh and sequence.p < fresh.rate]
    checks = model_checks(choice, judged)
    cables = choice.calibrated.recording.manipulator.cable_names
    weights = (*choice.doubts.weights, *(fresh.doubted if fresh else ()))
    why = why_unexplained(choice, failed, [cables[weight.cable] for weight in weights], checks)
    refuted = () if fresh is None or why else choice.refuted_by(fresh.refutes)
    choice = choice.without(refuted)
    if not why and fresh is not None and refitted is not None:
        why = why_misleading(fresh.errors(refitted, choice.fitted), doubted.task.settings)
    return _Checked(choice, refitted, checks, failed, refuted, why or why_doubtful(choice, doubted.search))


def _set_aside(doubted: Doubted, choice: Choice) -> Unseen | None:
    """The sequences set aside, without weights that neither the choice nor its likely rivals believe; None without
    any."""
    fresh = unseen(doubted.recording, doubted.aside, doubted.task.settings, choice.doubts)
    if fresh is None:
        return None
    likely = [survivor for survivor in choice.survivors if survivor.probability >= doubted.task.settings.alike_rate]
    return fresh.doubting(choice.fitted, [s.fitted for s in likely if s.effects != choice.effects])


def better_as_filed(calibrated: Fit, refitted: Fit, fresh: Unseen) -> Fit | None:
    """The constants of the manipulator file, if they predict the sequences set aside clearly better than `refitted`
    ones (`Settings.misleading`), and at least half of the fitted sequences too; else None.

    Then few fitted sequences lead the refitted constants astray.  Where most do, the rig differs from its file, and
    what was set aside happens not to show it.
    """
    filed, settings = constants_as_filed(calibrated), calibrated.model.settings
    if filed is None or not fresh.errors(filed, refitted).is_worse(settings.misleading):
        return None
    recording, predict = calibrated.recording, calibrated.model.predict
    of_reading, sd = recording.of_sequence[recording.readings.step], reading_sd(recording)
    missed = [np.nan_to_num(predict.misfit(predict(fit.constants)), nan=np.inf) / sd for fit in (filed, refitted)]
    as_filed, again = (np.bincount(of_reading, each**2) for each in missed)
    read = np.bincount(of_reading) > 0
    return filed if np.mean((as_filed <= again)[read]) >= settings.led_astray else None


def _errors(fresh: Unseen, fitted: Fit, calibrated: Fit, reported: Fit) -> HeldOut:
    """Errors of the constants alone and of the reported model on the sequences set aside, with all parts as drawn, and
    of the chosen fit with parts as the fitted sequences tell them."""
    made = fresh.as_drawn_and_made(reported, fitted)
    errors = fresh.errors(calibrated, reported)
    return replace(
        errors, rmse_made_m=made.rmse_explained_m, rmse_made_rad=made.rmse_explained_rad, felt=fresh.feels(reported)
    )


def _on_what_is_reported(doubted: Doubted, reported: Fit, named: Sequence[Effect]) -> tuple[str, ...]:
    """Remarks on the constants of the reported model, on the camera's frame, and on the `named` effects together."""
    task = doubted.task
    return (
        *far_constants(reported),
        *frame_that_was_taken(reported, task.frame_taken),
        *far_frame(reported, task.frame_taken),
        *uneven_plates(doubted.recording, named),
        *bent_at_many_places(named, task.settings),
    )


def _on_the_model(
    choice: Choice,
    doubted: Doubted,
    checks: Sequence[ModelCheck],
    tolerances: EstimatedTolerances,
    unexplained: bool,
) -> tuple[str, ...]:
    """Remarks on the chosen model, on its rivals and on the parts of the rig."""
    settings = doubted.task.settings
    beside = misplaced_marker(choice.calibrated, choice.doubts) if unexplained else likely_too(choice)
    return (
        *at_bounds(choice.fitted),
        *far_rims(choice.fitted),
        *found_before(doubted.search.assumed, choice),
        *as_many_as_sought(choice),
        *beside,
        *([] if unexplained else not_ruled_out(choice)),
        *([] if unexplained or choice.share_of_stated < 1 else against_the_best(checks, settings)),
        *beyond_tolerance(tolerances, settings),
        *never_unloaded(choice, doubted.search.library),
    )


def _on_the_noise(choice: Choice, doubted: Doubted, fresh: Unseen | None) -> tuple[str, ...]:
    """Remarks on the noise, and on weights that are not believed."""
    return (
        *scattered(doubted.repeated),
        *noisy(choice.level, doubted.task.settings, doubted.recording.serial_noise.share > 0),
        *below_stated(choice.share_of_stated),
        *wrong_weights(choice.calibrated.recording, choice.doubts.weights, choice.fitted.solved.chain),
        *(wrong_weights(fresh.recording, fresh.doubted, choice.fitted.solved.chain) if fresh else ()),
        *weighed(choice.doubts),
    )


def _on_what_was_set_aside(
    choice: Choice, before: Fit, fresh: Unseen | None, failed: Sequence[JudgedSequence], refuted: Sequence[Survivor]
) -> tuple[str, ...]:
    """Remarks on what the sequences set aside say of the choice, and of the model chosen `before` they were asked."""
    return (
        *not_predicted(failed),
        *refuted_sets(choice, refuted),
        *chosen_by(before, choice.fitted, fresh),
    )
