"""What is left, without a mechanism: missing moments on the plates, and what they depend on.

One sensitivity a plate, of the readings to a moment on it, serves every law of bend, tension, wrap, direction,
position and time.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.score_test import Direction, direction
from prb3r.diagnosis.fit.calibrate import Fit
from prb3r.model.laws.moment_law import influences, time_within
from prb3r.recording.recording import Kind

WHOLE = "the whole arm"
ALIKE, OWN_SHARE = 2.0, 0.1
"""Missing moments are alike over so many plates, but for a share of their variance."""
SIZES = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3)
"""Sizes of missing moments that are considered, in shares of the largest cable moment."""
MOMENT_CHANGE = 1e-4
"""Share of the largest cable moment that moment sensitivities are measured with."""


@dataclass(frozen=True, eq=False)
class Law:
    """A pattern of missing moments, or of shifted readings, that a recording can be tested for."""

    of: str
    """What it depends on: bend, tension, wrap, direction, position, time, constant, sequence, frame."""
    place: str
    """Where: the whole arm, a plate, a sequence."""
    values: np.ndarray
    """(s, n) moment for a unit coefficient, N m; or (r,) shift of the readings."""
    plate: int | None = None
    """The plate, where it is one."""


@dataclass(frozen=True, eq=False)
class Mechanism:
    """The fitted states that laws are made of."""

    moment: np.ndarray
    """(r, n) change of every reading by a moment on each plate at its step, 1/(N m)."""
    pull: np.ndarray
    """(s, n) moment of the cables over each plate, N m."""
    influences: Mapping[str, np.ndarray]
    """(s, n) what a moment may follow, by name."""


def mechanism(fitted: Fit) -> Mechanism:
    """Moments, bends and moment sensitivities of a fitted model."""
    predict, recording = fitted.model.predict, fitted.model.predict.recording
    chain = predict.chain_of(fitted.constants, fitted.effects)
    states = predict.equilibria(fitted.constants, fitted.effects, detail=True)
    time = time_within(recording.begins, recording.steps["step"].to_numpy(float))
    known = influences(chain, recording.loads, states, time)
    change = MOMENT_CHANGE * float(np.nanmax(np.abs(known["tension"]), initial=0.0)) or 1e-6
    middle, loads = fitted.predicted(), recording.loads
    columns = []
    for plate in range(chain.plates):
        more = loads.moment.copy()
        more[:, plate] += change
        moved = predict(fitted.constants, fitted.effects, loads._replace(moment=more))
        columns.append((moved - middle) / change)
    finite = {name: np.nan_to_num(values) for name, values in known.items()}
    return Mechanism(np.nan_to_num(np.stack(columns, 1)), finite["tension"], finite)


def laws(fitted: Fit, mechanics: Mechanism) -> list[Law]:
    """The dictionary: laws of the whole arm, of each plate, of each sequence, and frames that moved."""
    recording = fitted.model.predict.recording
    found = [Law(of, WHOLE, values) for of, values in mechanics.influences.items()]
    n = mechanics.pull.shape[1]
    for plate in range(n):
        only = np.arange(n) == plate
        for of in ("constant", "bend", "tension", "direction"):
            found.append(Law(of, f"plate {plate + 1}", mechanics.influences[of] * only, plate + 1))
    found.append(Law("time", WHOLE, mechanics.pull * recording.of_sequence[:, None]))
    found.append(Law("time", WHOLE, mechanics.pull * mechanics.influences["time"]))
    for k, name in enumerate(recording.sequences):
        own = (recording.of_sequence == k)[:, None]
        found.append(Law("sequence", f"sequence {name}", mechanics.pull * own))
        for kind in (Kind.X, Kind.Y, Kind.ANGLE):
            shifted = (recording.readings.kind == kind) & own[recording.readings.step, 0]
            if shifted.any():
                found.append(Law("frame", f"sequence {name}", shifted.astype(float)))
    return found


def law_directions(fitted: Fit, mechanics: Mechanism, dictionary: Sequence[Law]) -> list[Direction]:
    """The direction of every law in the whitened residuals of `fitted`."""
    basis, step = fitted.basis, fitted.model.predict.recording.readings.step
    moved = [law.values if law.values.ndim == 1 else (mechanics.moment * law.values[step]).sum(1) for law in dictionary]
    return [direction(fitted, law, shift[:, None], basis) for law, shift in zip(dictionary, moved, strict=True)]


@dataclass(frozen=True, eq=False)
class MomentMap:
    """Missing moment of every plate at every step, with its uncertainty."""

    moment: np.ndarray
    """(s, n) N m."""
    sd: np.ndarray
    """(s, n) N m."""
    known: np.ndarray
    """(s, n) share of the prior variance that the readings took away: 0 nothing is known, 1 all."""


def missing_moments(fitted: Fit, mechanics: Mechanism) -> MomentMap:
    """The missing moments of each step, as a Gaussian process along the arm.

    A moment that is free on every plate would drown in the noise.  Moments of neighbouring plates are alike instead,
    but for a share of their own; how large they are is chosen by the likelihood of all readings.
    """
    recording, count = fitted.model.predict.recording, fitted.model.predict.recording.readings.count
    s, n = mechanics.pull.shape
    plates = np.arange(n)
    alike = np.exp(-(((plates[:, None] - plates) / ALIKE) ** 2) / 2)
    shape = OWN_SHARE * np.eye(n) + (1 - OWN_SHARE) * alike
    normal, along = np.zeros((s, n, n)), np.zeros((s, n))
    for k in range(s):
        own = np.flatnonzero(recording.readings.step == k)
        whole = np.zeros((count, n))
        whole[own] = mechanics.moment[own]
        columns = fitted.model.noise.whiten(whole)
        normal[k], along[k] = columns.T @ columns, columns.T @ fitted.residual[:count]
    largest = float(np.abs(mechanics.pull).max(initial=0.0)) or 1.0

    def posterior(size: float) -> tuple[np.ndarray, np.ndarray, float]:
        inverse = np.linalg.inv(shape) / size**2
        covariance = np.linalg.inv(normal + inverse)
        mean = (covariance @ along[:, :, None])[:, :, 0]
        evidence = (along * mean).sum() + np.linalg.slogdet(covariance)[1].sum() + s * np.linalg.slogdet(inverse)[1]
        return mean, covariance, float(evidence)

    size = max((share * largest for share in SIZES), key=lambda each: posterior(each)[2])
    mean, covariance, _ = posterior(size)
    sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
    return MomentMap(mean, sd, 1 - sd**2 / size**2)
