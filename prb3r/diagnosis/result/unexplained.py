"""What predictions rest on where a recording is unexplained: the model that predicts best, and how far it misses."""

from collections.abc import Callable

import numpy as np

from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.suspect import OF_A_PART
from prb3r.diagnosis.result.discrepancy import Discrepancy, from_straight
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.transfer import other_geometry
from prb3r.model.effects.base import Effect
from prb3r.recording.recording import Kind


def best_predicting(investigation: Investigation) -> Fit | None:
    """The model that is reported, or constants alone where these predict the sequences set aside as well; None where the
    recording is explained."""
    return _better(investigation.reported, investigation) if investigation.why else None


def best_carried(investigation: Investigation) -> Fit | None:
    """As :func:`best_predicting`, for designs of another geometry: refitted without faults of single parts.

    In an unexplained recording such faults may balance effects that do carry over: without the ones, the sizes of the
    others are wrong.
    """
    if not investigation.why:
        return None
    return _refitted_with(investigation, lambda effect: SUSPECTS[effect.kind].transfer is not OF_A_PART)


def carried_alone(investigation: Investigation) -> Fit | None:
    """The model of what carries over to designs of another geometry and nothing else, refitted: how much it misses of
    the recording tells how much it may miss there.  None where the recording is explained."""
    if not investigation.why:
        return None
    nominal = investigation.recording.manipulator
    return _refitted_with(investigation, lambda effect: bool(other_geometry([effect], nominal, nominal)[0]))


def _refitted_with(investigation: Investigation, kept: Callable[[Effect], bool]) -> Fit:
    """The model that is reported with those of its effects that are `kept`, refitted; the constants alone where these
    predict the sequences set aside as well."""
    reported = investigation.reported
    model, p, dropped = reported.model, reported.p, [k for k, effect in enumerate(reported.effects) if not kept(effect)]
    for k in reversed(dropped):
        model, p = model.without(k), model.without_share(p, k)
    fitted = fit(model, p) if dropped else reported
    return investigation.refitted if fitted is None else _better(fitted, investigation)


def _better(fitted: Fit, investigation: Investigation) -> Fit:
    """The fit, or the constants alone where these predict the sequences set aside as well."""
    fresh, alone = investigation.fresh, investigation.refitted
    if fresh is None:
        return fitted
    held = fresh.errors(alone, fitted)
    return fitted if held.chi2_explained < held.chi2_calibrated else alone


def discrepancy_of(fitted: Fit, investigation: Investigation) -> Discrepancy | None:
    """The discrepancy of `fitted`: the largest of the fitted and of the sequences set aside, of positions and of
    angles; None where nothing was read that moves."""
    fresh = investigation.fresh
    shares = _shares(fitted, fitted.model.predict, fitted.model.noise.believed)
    if fresh is not None:
        shares += _shares(fitted, fresh.predict, fresh.noise(investigation.explained).believed)
    return Discrepancy(share=max(shares)) if shares else None


def _shares(fitted: Fit, predict: Predictor, believed: np.ndarray) -> list[float]:
    """The discrepancy of `fitted` in a recording, of positions and of angles and bends, as far as they were read."""
    solved = predict.solve(fitted.constants, fitted.effects)
    states, (step, disk, kind, _) = solved.states, predict.recording.readings
    angle = states.angle[step, disk]
    bend = angle - states.angle[step, np.maximum(disk - 1, 0)]
    away = from_straight(solved.chain, states.x, states.y)[step, disk]
    way = np.where(kind <= Kind.Y, away, np.where(kind == Kind.ANGLE, angle, bend))
    error = predict.misfit(solved.readings)
    beyond = error**2 - reading_sd(predict.recording) ** 2
    shares, known = [], believed & np.isfinite(error)
    for chosen in (known & (kind <= Kind.Y), known & (kind > Kind.Y)):
        if moved := float(np.sum(way[chosen] ** 2)):
            shares.append(float(np.sqrt(max(beyond[chosen].sum(), 0.0) / moved)))
    return shares
