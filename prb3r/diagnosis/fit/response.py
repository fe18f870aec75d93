r"""How readings answer to small changes: exact derivatives along the load path that was solved.

A change of the problem (chain or loads) moves the states by implicit differentiation,
`prb3r.mechanics.derivatives.sensitivity`; a change of states moves the readings by the gradient of what the camera
sees.  No path is solved for a derivative.  Only elementary functions are differenced: unbalanced moments with
the shape held, and the camera.
"""

from collections.abc import Callable, Sequence

import numpy as np

from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.mechanics.chain import Chain, Loads, arriving, no_loads
from prb3r.mechanics.derivatives.sensitivity import Direction, Sensitivities, derivatives
from prb3r.model.laws.derivatives import sensitivities_under_law
from prb3r.recording.recording import Kind

CHANGE = 1e-5
"""Of a parameter in its own scale, for differences of elementary functions: exact to 1e-10 on both sides of a value, to
1e-5 where a bound leaves only one."""
NEAR, AT_A_BOUND = 1e-3, 1e-9
"""Share of the distance of a bound that a change does not exceed, as where a compliance vanishes its stiffness does
not; and the distance at which a value is taken to be on its bound."""
PIXEL = 1e-6
"""Change of a position for the gradient of the camera, m."""


def interval(value: float, low: float = -np.inf, high: float = np.inf) -> tuple[float, float]:
    """Ends of a small interval around `value`, small against the distance of its bounds too; one-sided at a bound."""
    near = [distance for distance in (value - low, high - value) if distance > AT_A_BOUND]
    change = min([CHANGE, *(NEAR * distance for distance in near)])
    return max(value - change, low), min(value + change, high)


def across(problem: Callable[[float], tuple[Chain, Loads]], ends: tuple[float, float]) -> Direction:
    """The direction of a parameter of which `problem` is a function, from one end of an interval to the other."""
    low, high = ends
    return Direction(problem(high), problem(low), high - low)


def without_slack(chain: Chain, loads: Loads, begins: np.ndarray) -> tuple[Chain, Loads]:
    """The same problem with no tension below zero: what slack cables would feel on one side of a kink is left out.

    `begins` (s,) are the steps that follow on rest instead of on the step before.
    """
    constant = chain.constant or no_loads(chain)
    always = np.maximum(constant.tension, 0.0)
    pulling = np.maximum(arriving(chain, loads, begins) + constant.tension, 0.0)
    plain = chain._replace(
        constant=constant._replace(tension=always), gain=1.0, quadratic=0.0, play=0.0, zero_drift=0.0
    )
    return plain, loads._replace(tension=pulling - always)


def response(predict: Predictor, solved: Solution, directions: Sequence[Direction]) -> np.ndarray:
    """(r, p) derivatives of all readings; 0 where a step has no equilibrium.

    Parameters
    ----------
    directions : changes of the problem; of numbers alone, see `prb3r.mechanics.derivatives.sensitivity.derivatives`.
    """
    count = predict.recording.readings.count
    if not directions:
        return np.zeros((count, 0))
    if solved.path is None:
        begins = predict.recording.begins
        sensitivities = sensitivities_under_law(
            solved.chain, solved.loads, directions, from_rest=begins, number=predict.number
        )
    else:
        sensitivities = derivatives(solved.path, directions)
    return np.nan_to_num(seen_change(predict, solved, sensitivities))


def seen_change(predict: Predictor, solved: Solution, sensitivities: Sensitivities) -> np.ndarray:
    """(r, p) change of the readings as the states change."""
    step, disk, kind, _ = predict.recording.readings
    states = solved.states
    points = np.stack([states.x[step, disk], states.y[step, disk]], -1)
    out = np.array(sensitivities.dangle[step, disk])
    bends = kind == Kind.BEND
    out[bends] -= sensitivities.dangle[step[bends], np.maximum(disk[bends] - 1, 0)]
    around = points + PIXEL * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])[:, None]
    seen = predict.seen(around, step, solved.constants, solved.effects)
    gradients = (seen[::2] - seen[1::2]) / (2 * PIXEL)
    for axis, gradient in enumerate(gradients):
        moved = (sensitivities.dx, sensitivities.dy)[axis][step, disk]
        for reads, column in ((Kind.X, 0), (Kind.Y, 1)):
            of_kind = kind == reads
            before = out[of_kind] if axis else 0.0
            out[of_kind] = before + gradient[of_kind, column, None] * moved[of_kind]
    return out


def tension_response(predict: Predictor, solved: Solution) -> np.ndarray:
    """(r, s, m) change of every reading by the relative change of every tension of every step.

    Under a declared slip direction a step's tension moves that step alone; where states depend on those before it
    moves all later steps of its sequence too, so steps of equal place in their sequences are changed together.
    """
    recording, tension = predict.recording, solved.loads.tension
    begins, step = recording.begins, recording.readings.step
    place = np.arange(len(begins)) - np.flatnonzero(begins)[np.cumsum(begins) - 1]
    history = solved.chain.remembers
    together = [place == k for k in range(place.max() + 1)] if history else [np.ones(len(place), bool)]
    changes = [(steps, j) for steps in together for j in np.flatnonzero((tension[steps] > 0).any(0)).tolist()]

    def direction(steps: np.ndarray, cable: int) -> Direction:
        def problem(change: float) -> tuple[Chain, Loads]:
            changed = tension.copy()
            changed[steps, cable] *= 1 + change
            return solved.chain, solved.loads._replace(tension=changed)

        return across(problem, interval(0.0))

    moved = response(predict, solved, [direction(*change) for change in changes])
    out = np.zeros((len(step), *tension.shape))
    for column, (steps, cable) in zip(moved.T, changes, strict=True):
        for s in np.flatnonzero(steps):
            felt = (recording.of_sequence == recording.of_sequence[s])[step] if history else step == s
            out[felt, s, cable] = column[felt]
    return out


def moment_response(predict: Predictor, solved: Solution, size: float) -> np.ndarray:
    """(r, n) change of every reading by a moment on each plate at its step, 1/(N m).

    `size`: a moment that bends a plate, N m, of which a small share is taken for the difference.
    """

    def direction(plate: int) -> Direction:
        def problem(share: float) -> tuple[Chain, Loads]:
            moment = solved.loads.moment.copy()
            moment[:, plate] += share * size
            return solved.chain, solved.loads._replace(moment=moment)

        return across(problem, interval(0.0))

    return response(predict, solved, [direction(plate) for plate in range(solved.chain.plates)]) / size
