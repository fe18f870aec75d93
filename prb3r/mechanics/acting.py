"""What acts on a chain: the recorded loads as load cells, pulleys, a tilted base, wear and time change them."""

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, no_loads


def acting(chain: Chain, loads: Loads, begins: np.ndarray) -> Loads:
    """(s + 1) steps of what acts on `chain`: the constant loads at rest (row 0), and with each step of `loads` added.

    Tensions may be negative here, which stands for a slack cable: the solver cuts them off at zero after it has
    interpolated between two steps.  Declared slip enters the equations only as a factor of friction, so the factor by
    which rate, travel and elapsed steps change friction is multiplied into it.

    The time is that of the `clock`.

    Parameters
    ----------
    begins : (s,) whether a step follows on rest instead of on the step before.
    """
    constant = chain.constant or no_loads(chain)
    return Loads(
        tension=_from_rest(arriving(chain, loads, begins)) + constant.tension,
        slip=_from_rest(loads.slip * friction_factor(chain, loads)),
        force=_seen_from_base(chain, _from_rest(loads.force * chain.disk_efficiency) + constant.force),
        tip=_seen_from_base(chain, _from_rest(loads.tip * chain.tip_efficiency) + constant.tip),
        moment=_from_rest(loads.moment) + constant.moment,
        elapsed=_from_rest(loads.elapsed),
        rate=_from_rest(loads.rate),
        travel=_from_rest(loads.travel),
        time=_from_rest(clock(chain, loads)),
    )


def clock(chain: Chain, loads: Loads) -> np.ndarray:
    """(s, 1) time at each step in the unit of `Chain.relaxation_time`: elapsed steps, or steps of
    `Chain.relaxation_step` seconds where both that and the times are known."""
    if chain.relaxation_step == 0 or not loads.time.any():
        return loads.elapsed
    return loads.time / chain.relaxation_step


def _seen_from_base(chain: Chain, force: np.ndarray) -> np.ndarray:
    """(..., 2) forces in the frame of a base that is tilted, from those in the frame of the dead loads."""
    if chain.tilt == 0:
        return force
    c, s = np.cos(chain.tilt), np.sin(chain.tilt)
    return force @ np.array([[c, -s], [s, c]])  # rows of the rotation by -tilt, as forces are rows


def arriving(chain: Chain, loads: Loads, begins: np.ndarray) -> np.ndarray:
    """(s, m) true tension of the cables for the recorded one, N, without the constant loads.

    `begins` is that of :func:`acting`.
    """
    true = loads.tension * chain.gain * (1 + chain.quadratic * loads.tension)
    if np.any(chain.hanger):
        true = true + np.where(loads.tension > 0, chain.hanger, 0.0)
    if np.any(chain.play):
        true = with_play(true, chain.play, begins)
    return true + chain.zero_drift * loads.elapsed


def with_play(tension: np.ndarray, play: np.ndarray | float, begins: np.ndarray) -> np.ndarray:
    """(s, m) output of the play operator for tensions (s, m), N (Krejci, Hysteresis, Convexity and Dissipation in
    Hyperbolic Equations, 1996).

    The output stays as long as the tension is within `play` (N) of it, and is dragged along by the tension beyond
    that.  It is 0 at rest, before every step that `begins` (s,).  A negative play leads by as much as a positive one
    lags, so that differences to both sides of none are the derivative there.
    """
    low, high = tension - np.abs(play), tension + np.abs(play)
    out = np.zeros_like(tension)
    for step in range(len(tension)):
        before = 0.0 if begins[step] or step == 0 else out[step - 1]
        out[step] = np.minimum(np.maximum(before, low[step]), high[step])
    return np.where(np.less(play, 0), 2 * tension - out, out)


def dead_loads(chain: Chain, loads: Loads) -> np.ndarray:
    """(s,) whether dead loads, or the couple of an umbilical, act on `chain` at each step."""
    if chain.umbilical:
        return np.ones(loads.steps, bool)
    if not (loads.force.any() or loads.tip.any()):  # the usual case, cheap to see
        return np.zeros(loads.steps, bool)
    return np.array(loads.force.any((1, 2)) | loads.tip.any(1))


LEAST_FRICTION = 0.05
"""Lower bound of `rate_factor` and `drift_factor`, where these would take all of friction away or more."""


def friction_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over that of the coefficients of `chain`: the product of all
    factors."""
    return rate_factor(chain, loads) * breakaway_factor(chain, loads) * drift_factor(chain, loads)


def rate_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over that at the reference rate; 1 where the rate is unknown.

    1 + a ln(v / v_0) with the rate v of the tension: the steady state of rate and state friction (Dieterich, J.
    Geophys. Res. 77 (1972) 3690; Ruina, J. Geophys. Res. 88 (1983) 10359).
    """
    if chain.friction_rate == 0:
        return 1.0
    rate = np.where(loads.rate > 0, loads.rate, chain.friction_reference)
    return np.maximum(1 + chain.friction_rate * np.log(rate / chain.friction_reference), LEAST_FRICTION)


def breakaway_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, m) friction of each cable at each step over the kinetic one.

    1 + r exp(-s / d): friction weakens with slip (Rabinowicz, J. Appl. Phys. 22 (1951) 1373; Ida, J. Geophys. Res. 77
    (1972) 3796; exponentially: Dieterich, J. Geophys. Res. 84 (1979) 2161).  The slip is measured by `Loads.travel`
    s, the change of the tension in N.
    """
    if chain.friction_excess == 0:
        return 1.0
    return 1 + chain.friction_excess * np.exp(-loads.travel / chain.friction_decay)


def drift_factor(chain: Chain, loads: Loads) -> np.ndarray | float:
    """(s, 1) friction at each step over the initial one, which grows in proportion to the elapsed steps."""
    if chain.friction_drift == 0:
        return 1.0
    return np.maximum(1 + chain.friction_drift * loads.elapsed, LEAST_FRICTION)


def _from_rest(steps: np.ndarray) -> np.ndarray:
    """(s + 1, ...) a row of zeros, which stands for rest, followed by the values of the steps (s, ...)."""
    out = np.zeros((len(steps) + 1, *steps.shape[1:]))
    out[1:] = steps
    return out
