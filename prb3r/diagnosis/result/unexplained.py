"""What predictions rest on where a recording is unexplained: the model that predicts best, and how far it misses."""

from collections.abc import Sequence

import numpy as np

from prb3r.diagnosis.checks.heldout import compared
from prb3r.diagnosis.fit.calibrate import constants_as_filed
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.covariance import Noise, reading_sd
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.result.carried_constants import log_of_scatter
from prb3r.diagnosis.result.discrepancy import Discrepancy, from_straight, share_moved
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.transfer import other_geometry
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.recording.recording import Kind


def best_of_rig(investigation: Investigation) -> tuple[Fit, Discrepancy | None]:
    """The model on which predictions for the recorded rig rest, with its discrepancy: the reported one, or constants
    alone, refitted or of the manipulator file, if they predict the held-out readings as well."""
    return _best(investigation, investigation.reported.constants, investigation.reported.effects)


def best_elsewhere(investigation: Investigation, same_bench: bool) -> tuple[Fit, Discrepancy | None]:
    """As :func:`best_of_rig`, for designs of another geometry, on the bench of the recording or elsewhere.  There the
    effects that do not carry over are missing: the reported model is held against the readings without them, with a
    modulus as it carries over.

    In an unexplained recording faults of single parts may balance effects that do carry over, which are of no use then.
    And what stands in for physics that is left out fits its own rig: it has to remove `Settings.carried_gain` of what
    constants alone leave.  Constants alone that the recording pulls far from what it states of them
    (`Settings.strained_sd`) stand in for that physics too: then those of the file are taken.
    """
    best, missed = _best(investigation, *_carried(investigation, same_bench), Settings.carried_gain)
    if best is investigation.reported or not _strained(best) or (filed := constants_as_filed(best)) is None:
        return best, missed
    return filed, _discrepancy(_recorded(investigation), filed.constants, filed.effects)


def constants_alone(investigation: Investigation) -> tuple[Fit, Discrepancy | None]:
    """The constants alone that predict best, refitted or of the file, with their discrepancy."""
    alone = investigation.filed or investigation.refitted
    return alone, _discrepancy(_recorded(investigation), alone.constants, alone.effects)


def moved_by_effects(investigation: Investigation, same_bench: bool) -> float:
    """How far the effects that carry over move the recorded rig from where constants alone have it
    (:func:`constants_alone`), as a share of its way from the straight manipulator (:func:`share_moved`); the larger
    one of the fitted and the held-out sequences."""
    alone, _ = constants_alone(investigation)
    shares = []
    for predict, _ in _recorded(investigation):
        models = _carried(investigation, same_bench), (alone.constants, alone.effects)
        with_effects, without = (predict.solve(*model) for model in models)
        places = (np.stack([each.states.x, each.states.y]) for each in (with_effects, without))
        shares.append(share_moved(without.chain, *places))
    return max(shares)


def _carried(investigation: Investigation, same_bench: bool) -> tuple[Constants, Sequence[Effect]]:
    """Constants and effects of the reported model as they carry over to another geometry."""
    nominal, reported = investigation.recording.manipulator, investigation.reported
    stiffness = reported.constants.log_stiffness + log_of_scatter(reported.effects, nominal)
    effects, _ = other_geometry(reported.effects, nominal, nominal, same_bench=same_bench)
    return reported.constants._replace(log_stiffness=stiffness), effects


def _strained(alone: Fit) -> bool:
    """Whether constants are farther from what the recording states of them than `Settings.strained_sd`."""
    known = zip(alone.model.varied, alone.p, alone.model.priors, strict=False)
    far = alone.model.settings.strained_sd
    return any(name not in FRAME and abs(value) > far * sd for name, value, sd in known)


def _best(
    investigation: Investigation, constants: Constants, effects: Sequence[Effect], least_gain: float = 0.0
) -> tuple[Fit, Discrepancy | None]:
    """The reported model if it predicts better with `constants` and `effects` in the place of its own than constants
    alone do, refitted or of the file, by more than `least_gain` of what these leave beyond noise, else these; with its
    discrepancy."""
    reported, alone = investigation.reported, investigation.filed or investigation.refitted
    (predict, noise), *_ = parts = _recorded(investigation)
    before, after = predict.solve(alone.constants, alone.effects), predict.solve(constants, effects)
    errors = compared(predict, noise, before.readings, after.readings)
    lost = np.isnan(after.readings).sum() > np.isnan(before.readings).sum()
    if lost or errors.gain <= least_gain:
        return alone, _discrepancy(parts, alone.constants, alone.effects)
    return reported, _discrepancy(parts, constants, effects)


def _recorded(investigation: Investigation) -> list[tuple[Predictor, Noise]]:
    """The held-out readings, if any, then the fitted ones, each with the noise about the reported model."""
    reported, fresh = investigation.reported, investigation.fresh
    fitted = reported.model.predict, reported.model.noise
    return [fitted] if fresh is None else [(fresh.predict, fresh.noise(reported)), fitted]


def _discrepancy(
    parts: Sequence[tuple[Predictor, Noise]], constants: Constants, effects: Sequence[Effect]
) -> Discrepancy | None:
    """The discrepancy of a model: the largest of all parts of the recording, of positions and of angles; None where
    nothing was read that moves."""
    solutions = [(predict.solve(constants, effects), predict, noise.believed) for predict, noise in parts]
    shares = [share for solution in solutions for share in _shares(*solution)]
    return Discrepancy(share=max(shares)) if shares else None


def _shares(solved: Solution, predict: Predictor, believed: np.ndarray) -> list[float]:
    """Root mean square errors of a solution beyond the stated noise, over the way from the straight manipulator: of
    positions, and of angles and bends, as far as they were read.

    Parameters
    ----------
    believed : (r,) whether a reading is believed.
    """
    states, (step, disk, kind, _) = solved.states, predict.recording.readings
    angle = states.angle[step, disk]
    bend = angle - states.angle[step, np.maximum(disk - 1, 0)]
    away = from_straight(solved.chain, states.x, states.y)[step, disk]
    position = predict.recording.readings.is_position
    way = np.where(position, away, np.where(kind == Kind.ANGLE, angle, bend))
    error = predict.misfit(solved.readings)
    beyond, known = error**2 - reading_sd(predict.recording) ** 2, believed & np.isfinite(error)
    shares = []
    for chosen in (known & position, known & ~position):
        if moved := float(np.sum(way[chosen] ** 2)):
            shares.append(float(np.sqrt(max(beyond[chosen].sum(), 0.0) / moved)))
    return shares
