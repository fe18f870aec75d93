r"""What is left, as a law without a mechanism: missing moments on the plates, and what they depend on.

A moment that acts on a plate in addition moves the readings as a stress-free curvature of the plate would, so one
sensitivity a plate serves every law of bend, tension, wrap, direction, position and time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.mechanics.equilibrium import solve
from prb3r.model.effect import Base, Precurvature
from prb3r.recording.calibrate import DECLARED_CHANGE, HISTORY_CHANGE, Fit
from prb3r.recording.locate import Direction, direction
from prb3r.recording.recording import Kind


@dataclass(frozen=True, eq=False)
class Law:
    """A pattern of missing moments, or of shifted readings, that a recording can be tested for."""

    of: str
    """What it depends on: bend, tension, wrap, direction, position, time, constant, sequence, frame."""
    place: str
    """Where: the whole arm, a plate, a sequence."""
    values: np.ndarray
    """(s, n) moment for a unit coefficient, N m; or (r,) shift of the readings."""


@dataclass(frozen=True)
class Mechanism:
    """The fitted states that laws are made of."""

    moment: np.ndarray
    """(r, n) change of every reading by a moment on each plate at its step, 1/(N m)."""
    bend: np.ndarray
    """(s, n) rad."""
    pull: np.ndarray
    """(s, n) moment of the cables over each plate, N m."""
    slip: np.ndarray
    """(s, n) the same with every cable's slip direction as a factor."""
    time: np.ndarray
    """(s,) share of the sequence that has passed."""


def mechanism(fitted: Fit) -> Mechanism:
    """Moments, bends and moment sensitivities of a fitted model."""
    model, recording = fitted.model, fitted.model.predict.recording
    chain = model.predict.chain_of(fitted.constants, fitted.effects)
    found = solve(chain, recording.loads, from_rest=recording.begins)
    rigidity = (chain.stiffness * chain.arc[:, None]).mean(1) / np.mean(chain.plate.stiffness)
    curvature = 1e-3 * float(np.nanmax(np.abs(np.diff(found.angle, axis=1)) / chain.arc)) or 1e-3
    change = curvature if chain.presliding == 0 else curvature * HISTORY_CHANGE / DECLARED_CHANGE
    middle = fitted.predicted()
    columns = []
    for plate in range(chain.plates):
        effect: Base = Precurvature(kind="precurvature", curvature_per_m=change, plates=[plate + 1])
        moved = model.predict(fitted.constants, [*fitted.effects, effect])
        columns.append((moved - middle) / (change * rigidity[plate]))
    across = found.tension * chain.offset
    slip = np.broadcast_to(recording.loads.slip[:, None, :], across.shape) if not found.slip.size else found.slip
    steps = np.arange(len(recording.of_sequence))
    first = steps[recording.begins][recording.of_sequence]
    last = np.maximum(np.bincount(recording.of_sequence)[recording.of_sequence], 1)
    return Mechanism(
        np.nan_to_num(np.stack(columns, 1)),
        np.diff(found.angle, axis=1),
        across.sum(-1),
        (across * slip).sum(-1),
        (steps - first + 1) / last,
    )


def laws(fitted: Fit, mechanics: Mechanism) -> list[Law]:
    """The dictionary: laws of the whole arm, of each plate, of each sequence, and frames that moved."""
    recording = fitted.model.predict.recording
    s, n = mechanics.bend.shape
    one = np.ones((s, n))
    wrap = np.cumsum(np.abs(mechanics.bend), 1)
    whole = {
        "constant": one,
        "position": one * np.linspace(-1, 1, n) if n > 1 else one,
        "bend": mechanics.bend,
        "bend_cubed": mechanics.bend**3,
        "tension": mechanics.pull,
        "wrap": mechanics.pull * wrap,
        "direction": mechanics.slip,
        "time": one * mechanics.time[:, None],
    }
    found = [Law(of, "the whole arm", values) for of, values in whole.items()]
    for plate in range(n):
        only = np.zeros((s, n))
        only[:, plate] = 1
        found += [
            Law(of, f"plate {plate + 1}", whole[of] * only) for of in ("constant", "bend", "tension", "direction")
        ]
    found.append(Law("time", "the whole arm", mechanics.pull * recording.of_sequence[:, None]))
    found.append(Law("time", "the whole arm", mechanics.pull * mechanics.time[:, None]))
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


@dataclass(frozen=True)
class MomentMap:
    """Missing moment of every plate at every step, by ridge regression, with its uncertainty."""

    moment: np.ndarray
    """(s, n) N m."""
    sd: np.ndarray
    """(s, n) N m."""
    known: np.ndarray
    """(s, n) share of the prior variance that the readings took away: 0 nothing is known, 1 all."""


def missing_moments(fitted: Fit, mechanics: Mechanism) -> MomentMap:
    """The missing moments; a prior of a fifth of the largest cable moment keeps what readings do not tell small."""
    recording, count = fitted.model.predict.recording, fitted.model.predict.recording.readings.count
    s, n = mechanics.bend.shape
    prior = 0.2 * float(np.abs(mechanics.pull).max(initial=0.0)) or 1.0
    moment, sd, known = np.zeros((s, n)), np.full((s, n), prior), np.zeros((s, n))
    for k in range(s):
        own = np.flatnonzero(recording.readings.step == k)
        if not len(own):
            continue
        whole = np.zeros((count, n))
        whole[own] = mechanics.moment[own]
        columns = fitted.model.noise.whiten(whole)
        information = columns.T @ columns + np.eye(n) / prior**2
        covariance = np.linalg.inv(information)
        moment[k] = covariance @ (columns.T @ fitted.residual[:count])
        sd[k] = np.sqrt(np.diag(covariance))
        known[k] = 1 - sd[k] ** 2 / prior**2
    return MomentMap(moment, sd, known)
