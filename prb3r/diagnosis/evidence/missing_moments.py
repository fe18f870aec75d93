"""The residuals of a fit without a mechanism: missing moments on the plates, and what they depend on.

The sensitivities of the readings to a moment on each plate serve every law of bend, tension, wrap, direction, position
and time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.score_test import Alternative, alternatives_of
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.response import moment_response
from prb3r.model.laws.moment_law import influences, time_within
from prb3r.recording.recording import Kind

WHOLE = "the whole arm"


@dataclass(frozen=True, eq=False)
class MomentPattern:
    """A pattern of missing moments, or of shifted readings, that a recording can be tested for."""

    of: str
    """What it depends on: constant, position, bend, bend_cubed, tension, wrap, direction, time, sequence, frame."""
    place: str
    """Where: the whole arm, a plate, a sequence."""
    values: np.ndarray
    """(s, n) moments on the plates for a coefficient of 1; or (r,) shift of the readings."""
    plate: int | None = None
    """Number of the plate, counted from 1, where the pattern is of one plate."""


@dataclass(frozen=True, eq=False)
class Mechanism:
    """What laws of missing moments are made of, around a fit."""

    moment: np.ndarray
    """(r, n) derivative of every reading by a moment on each plate at the reading's step, m or rad per N m."""
    pull: np.ndarray
    """(s, n) moment of the cables over each plate, N m."""
    influences: Mapping[str, np.ndarray]
    """(s, n) of each quantity that a moment may follow, by its name; 0 where a step has no equilibrium."""


def mechanism(fitted: Fit) -> Mechanism:
    """The moment sensitivities of a fitted model, and the quantities that a missing moment may follow."""
    predict, solved = fitted.model.predict, fitted.solved
    time = time_within(predict.recording.begins, predict.number)
    known = influences(solved.chain, solved.loads, solved.states, time)
    finite = {name: np.nan_to_num(values) for name, values in known.items()}
    largest = float(np.abs(finite["tension"]).max(initial=0.0)) or 1.0
    return Mechanism(moment_response(predict, solved, largest), finite["tension"], finite)


def laws(fitted: Fit, mechanics: Mechanism) -> list[MomentPattern]:
    """The dictionary of patterns: of the whole arm, of each plate, of each sequence, and frames that moved.

    Where all cables slip one way at every step, the direction of slip makes no pattern beside the tensions.
    """
    recording, known = fitted.recording, dict(mechanics.influences)
    if np.array_equal(np.abs(known["direction"]), np.abs(known["tension"])):
        del known["direction"]
    patterns = [MomentPattern(of, WHOLE, values) for of, values in known.items()]
    n = mechanics.pull.shape[1]
    for plate in range(n):
        only = np.arange(n) == plate
        for of in ("constant", "bend", "tension", "direction"):
            if of in known:
                patterns.append(MomentPattern(of, f"plate {plate + 1}", known[of] * only, plate + 1))
    patterns.append(MomentPattern("time", WHOLE, mechanics.pull * recording.of_sequence[:, None]))
    patterns.append(MomentPattern("time", WHOLE, mechanics.pull * mechanics.influences["time"]))
    for k, name in enumerate(recording.sequences):
        in_sequence = (recording.of_sequence == k)[:, None]
        patterns.append(MomentPattern("sequence", f"sequence {name}", mechanics.pull * in_sequence))
        for kind in (Kind.X, Kind.Y, Kind.ANGLE):
            shifted = (recording.readings.kind == kind) & in_sequence[recording.readings.step, 0]
            if shifted.any():
                patterns.append(MomentPattern("frame", f"sequence {name}", shifted.astype(float)))
    return patterns


def law_alternatives(fitted: Fit, mechanics: Mechanism, dictionary: Sequence[MomentPattern]) -> list[Alternative]:
    """The alternative of every pattern around `fitted`: how its moments, or its shift, change the readings."""
    step = fitted.recording.readings.step
    moved = [law.values if law.values.ndim == 1 else (mechanics.moment * law.values[step]).sum(1) for law in dictionary]
    return alternatives_of(fitted, dictionary, [shift[:, None] for shift in moved])


@dataclass(frozen=True, eq=False)
class MomentMap:
    """The missing moment on every plate at every step, with its uncertainty."""

    moment: np.ndarray
    """(s, n) posterior mean, N m."""
    sd: np.ndarray
    """(s, n) posterior standard deviation, N m."""
    known: np.ndarray
    """(s, n) share of the prior variance that the readings remove: 0 where they tell nothing, 1 where they tell all."""


def missing_moments(fitted: Fit, mechanics: Mechanism) -> MomentMap:
    """The missing moments, step by step, with a Gaussian process along the arm as their prior.

    Moments that are free on every plate would drown in the noise.  The prior correlates those of neighbouring plates,
    except for an independent share of their variance (`Settings.own_share`).  Its standard deviation is one of
    `Settings.moment_sizes` times the largest moment of the cables: the one of the largest evidence over all steps.
    """
    recording, settings = fitted.recording, fitted.model.settings
    count = recording.readings.count
    s, n = mechanics.pull.shape
    plates = np.arange(n)
    alike = np.exp(-(((plates[:, None] - plates) / settings.alike_plates) ** 2) / 2)
    shape = settings.own_share * np.eye(n) + (1 - settings.own_share) * alike
    normal, along = np.zeros((s, n, n)), np.zeros((s, n))
    for k in range(s):
        at_step = np.flatnonzero(recording.readings.step == k)
        whole = np.zeros((count, n))
        whole[at_step] = mechanics.moment[at_step]
        columns = fitted.model.noise.whiten(whole)
        normal[k], along[k] = columns.T @ columns, columns.T @ fitted.misfit
    largest = float(np.abs(mechanics.pull).max(initial=0.0)) or 1.0

    def posterior(size: float) -> tuple[np.ndarray, np.ndarray, float]:
        """(s, n) mean, (s, n, n) covariance and twice the ln of the evidence for a prior standard deviation, N m."""
        inverse = np.linalg.inv(shape) / size**2
        covariance = np.linalg.inv(normal + inverse)
        mean = (covariance @ along[:, :, None])[:, :, 0]
        evidence = (along * mean).sum() + np.linalg.slogdet(covariance)[1].sum() + s * np.linalg.slogdet(inverse)[1]
        return mean, covariance, float(evidence)

    size = max((share * largest for share in settings.moment_sizes), key=lambda trial: posterior(trial)[2])
    mean, covariance, _ = posterior(size)
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return MomentMap(mean, sd, 1 - sd**2 / size**2)
