r"""Derivatives of the readings by changes of the chain or the loads, along the load path that was solved.

The derivatives of the states come from implicit differentiation, `prb3r.mechanics.derivatives.sensitivity`; those of
the readings by the states from the gradient of the camera.  No path is solved for a derivative.  Only elementary
functions are differenced: unbalanced moments with the shape held, and the camera.
"""

from collections.abc import Callable, Sequence

import numpy as np

from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.mechanics.acting import arriving
from prb3r.mechanics.chain import Chain, Loads, no_loads
from prb3r.mechanics.derivatives.sensitivity import Direction, Sensitivities, derivatives
from prb3r.model.laws.derivatives import sensitivities_under_law
from prb3r.model.steps import with_tensions
from prb3r.recording.recording import Kind

CHANGE = 1e-5
"""Step of a parameter, in its own scale, by which elementary functions are differenced: exact to 1e-10 with steps to
both sides, to 1e-5 where a bound leaves only one side."""
NEAR, AT_A_BOUND = 1e-3, 1e-9
"""Largest step as a share of the distance to a bound or a pole, near which functions are strongly curved; and the
distance up to which a value counts as on its bound."""
PIXEL = 1e-6
"""Step of a position, to either side, by which the camera is differenced, m."""


def interval(value: float, low: float = -np.inf, high: float = np.inf, pole: float = -np.inf) -> tuple[float, float]:
    """Ends of an interval around `value` to difference over, small against the distance to its bounds and to a `pole`
    below it; one-sided at a bound."""
    near = [value - pole, *(distance for distance in (value - low, high - value) if distance > AT_A_BOUND)]
    change = min([CHANGE, *(NEAR * distance for distance in near)])
    return max(value - change, low), min(value + change, high)


def across(problem: Callable[[float], tuple[Chain, Loads]], ends: tuple[float, float]) -> Direction:
    """The direction of a parameter that `problem` is a function of, differenced over the interval with these `ends`."""
    low, high = ends
    return Direction(problem(high), problem(low), high - low)


def without_slack(chain: Chain, loads: Loads, begins: np.ndarray) -> tuple[Chain, Loads]:
    """The same problem with the tensions that arrive as its loads, cut off at zero: slack cables pull nothing.

    The gain, play and drift of the load cells are in these tensions, and neutral in the chain that comes back.
    `begins`: (s,) whether a step follows on rest instead of on the step before.
    """
    constant = chain.constant or no_loads(chain)
    always = np.maximum(constant.tension, 0.0)
    pulling = np.maximum(arriving(chain, loads, begins) + constant.tension, 0.0)
    plain = chain._replace(
        constant=constant._replace(tension=always), gain=1.0, quadratic=0.0, play=0.0, zero_drift=0.0
    )
    return plain, loads._replace(tension=pulling - always)


def response(predict: Predictor, solved: Solution, directions: Sequence[Direction]) -> np.ndarray:
    """(r, p) derivatives of all readings along `directions` (p of them); 0 where a step has no equilibrium.

    Parameters
    ----------
    directions : changes of the numbers in a problem, not of its structure, as
        `prb3r.mechanics.derivatives.sensitivity.derivatives` takes them.
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
    """(r, p) derivatives of the readings, given those of the states; the camera itself stays as it is."""
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
    """(r, s, m) derivative of every reading by the relative change of the tension of every step and cable, m or rad.

    With declared slip the tension of a step moves the readings of that step alone, so all steps are changed at once.
    Where states depend on those before, tensions lag, or friction goes by the change of the tension since the step
    before, it moves the later steps of its sequence too; then only steps of equal place in different sequences are
    changed at once.
    """
    recording, tension = predict.recording, solved.loads.tension
    begins, step = recording.begins, recording.readings.step
    place = np.arange(len(begins)) - np.flatnonzero(begins)[np.cumsum(begins) - 1]
    chain = solved.chain
    history = bool(chain.remembers or np.any(chain.play) or chain.friction_excess or chain.friction_rate)
    together = [place == k for k in range(place.max() + 1)] if history else [np.ones(len(place), bool)]
    changes = [(steps, j) for steps in together for j in np.flatnonzero((tension[steps] > 0).any(0)).tolist()]

    def direction(steps: np.ndarray, cable: int) -> Direction:
        def problem(change: float) -> tuple[Chain, Loads]:
            changed = tension.copy()
            changed[steps, cable] *= 1 + change
            return chain, with_tensions(solved.loads, changed, begins)

        return across(problem, interval(0.0))

    moved = response(predict, solved, [direction(*change) for change in changes])
    out = np.zeros((len(step), *tension.shape))
    for column, (steps, cable) in zip(moved.T, changes, strict=True):
        for s in np.flatnonzero(steps):
            felt = (recording.of_sequence == recording.of_sequence[s])[step] if history else step == s
            out[felt, s, cable] = column[felt]
    return out


def moment_response(predict: Predictor, solved: Solution, size: float) -> np.ndarray:
    """(r, n) derivative of every reading by a moment on each plate at the reading's own step, m or rad per N m.

    The moment acts at every step.  `size`: typical moment of the recording, N m, of which a small share is the step of
    the difference.
    """

    def direction(plate: int) -> Direction:
        def problem(share: float) -> tuple[Chain, Loads]:
            moment = solved.loads.moment.copy()
            moment[:, plate] += share * size
            return solved.chain, solved.loads._replace(moment=moment)

        return across(problem, interval(0.0))

    return response(predict, solved, [direction(plate) for plate in range(solved.chain.plates)]) / size
