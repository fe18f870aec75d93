"""Follows the loads of a sequence in sub-steps that end where a hole begins to slip.

The motion has a kink where a hole begins to slip, so a sub-step ends at the first such event.  A cable that reverses
within a sub-step shows in the parabola through its travel at beginning, middle and end.
"""

import numpy as np

from prb3r.proof.rig.arrays import plates_remember
from prb3r.proof.rig.balance import (
    SHORTEST_SUBSTEP,
    AppliedLoads,
    LoadRamp,
    RigBalance,
    find_balance,
    forces_of,
    rig_at,
)
from prb3r.proof.rig.build import BuiltRig
from prb3r.proof.rig.imbalance import poses

LONGEST_SUBSTEP, MOST_SUBSTEPS = 1 / 32, 1500
"""Longest sub-step where friction follows the load path, in parts of a load step, and most sub-steps of one: a path
that takes more ends at a limit load."""
LONGEST_BEND = 1 / 16
"""Longest sub-step where plates have hysteresis and slip is declared, in parts of a load step: so short that if a plate
reverses within a sub-step its two halves lead elsewhere than the whole, and it is cut."""
EVENT_ERROR, EVENT_TRIALS = 1e-4, 40
"""Error allowed in the slip state (-1 to 1) of a hole that begins to slip where a sub-step ends, and most trials to
find that point."""
TURNING = 0.1
"""Typical angle by which a cable turns at a hole, rad.  Times the friction coefficient it is the relative error of a
tension that an error of one in the slip state may cause later: the weight of such errors."""
LEAST_PART, MOST_PART = 0.05, 0.95
"""Least and largest part of a sub-step at which it is cut where a cable reverses."""


class RigPath:
    """Follows the loads of one sequence from balance to balance.

    Parameters
    ----------
    elements : integration steps along the arc of each plate
    tolerance : largest :meth:`apart` of a sub-step and its two halves, and largest weighted error of a slip state by a
        reversal within one
    """

    def __init__(self, built: BuiltRig, elements: int, tolerance: float) -> None:
        self.built, self.elements, self.tolerance = built, elements, tolerance
        self.length = (built.rig.arc + 2 * built.rig.clamp + built.rig.disk).sum()
        self.history = np.isfinite(built.rig.presliding)
        self.longest = LONGEST_SUBSTEP if self.history else LONGEST_BEND if plates_remember(built.rig) else 1.0
        self.weight = TURNING * built.rig.friction
        self.weight[:1] += built.rig.pulley

    def substep(
        self, state: RigBalance | None, loads: AppliedLoads, guess: np.ndarray | None = None
    ) -> RigBalance | None:
        """The balance under `loads` after one sub-step from `state`, sought from end poses `guess` (those of `state` if
        None); None if there is none."""
        if state is None:
            return None
        memory = state.memory
        if not self.history:
            memory = memory._replace(slip=np.tile(loads.slip, (len(state.ends), 1)))
        guess = state.ends if guess is None else guess
        return find_balance(rig_at(self.built, loads), forces_of(self.built, loads), memory, guess, self.elements)

    def equal_substeps(self, state: RigBalance | None, ramp: LoadRamp, count: int) -> RigBalance | None:
        """The balance at the end of a ramp in `count` equal sub-steps; None where one of them has none."""
        for k in range(1, count + 1):
            state = self.substep(state, ramp.at(k / count))
        return state

    def adaptive(self, state: RigBalance, ramp: LoadRamp) -> RigBalance | None:
        """The balance at the end of a ramp in sub-steps of adapted length; None where the path ends before.

        A sub-step is accepted if it passes no event, hides no reversal of a cable and agrees with its two halves.
        """
        done, longest = 0.0, self.longest
        for _ in range(MOST_SUBSTEPS):
            whole, share = self.until_event(state, ramp, done, min(longest, 1 - done))
            if whole is None:
                return None
            half = self.substep(state, ramp.at(done + share / 2), (state.ends + whole.ends) / 2)
            halves = self.substep(half, ramp.at(done + share), whole.ends)
            cut = self.agreed_part(state, half, whole, halves)
            if cut == 1:
                state, done, longest = whole, done + share, self.longest
                if done >= 1:
                    return state
            elif cut * share < SHORTEST_SUBSTEP:
                return None
            else:
                longest = cut * share
        return None

    def until_event(
        self, state: RigBalance, ramp: LoadRamp, done: float, share: float
    ) -> tuple[RigBalance | None, float]:
        """The balance `share` of the ramp beyond `done`, and the share that was gone: less where a hole begins to slip
        before, or where halving was needed to find a balance.  The balance is None where there is none at all."""
        after = self.substep(state, ramp.at(done + share))
        while after is None and share > SHORTEST_SUBSTEP:
            share /= 2
            after = self.substep(state, ramp.at(done + share))
        if after is None or not self.history or self.overshoot(state, after) <= EVENT_ERROR:
            return after, share
        return self._event(state, ramp, done, share, after)

    def _event(
        self, state: RigBalance, ramp: LoadRamp, done: float, share: float, after: RigBalance
    ) -> tuple[RigBalance | None, float]:
        """The balance between `state` and `after` (`share` ahead) where the first hole begins to slip, and its share.

        By the Illinois variant of regula falsi; if that does not converge, the last balance before the event.
        """
        low, low_over, low_after = 0.0, self.overshoot(state, state), None
        high, high_over = share, self.overshoot(state, after)
        far, far_ends, last_over = share, after.ends, 0.0
        for _ in range(EVENT_TRIALS):
            share = low - (high - low) * low_over / (high_over - low_over)
            guess = state.ends + share / far * (far_ends - state.ends)
            trial = self.substep(state, ramp.at(done + share), guess)
            if trial is None:
                high, high_over = share, -low_over
                continue
            over = self.overshoot(state, trial)
            if abs(over) <= EVENT_ERROR:
                return trial, share
            if over > 0:
                high, high_over, low_over = share, over, low_over / (2 if last_over > 0 else 1)
                far, far_ends = share, trial.ends
            else:
                low, low_over, low_after, high_over = share, over, trial, high_over / (2 if last_over < 0 else 1)
            last_over = over
        return low_after, low

    def overshoot(self, before: RigBalance, after: RigBalance) -> float:
        """Most by which the unclipped slip state of any hole passes -1 or 1 in a sub-step; negative: none does.

        Holes that slipped before already do not count, nor do those without friction.
        """
        old = before.memory.slip
        new = old + (after.memory.beyond - before.memory.beyond) / self.built.rig.presliding
        up = np.where(old < 1 - EVENT_ERROR, new - 1, -1)
        down = np.where(old > EVENT_ERROR - 1, -1 - new, -1)
        return np.maximum(up, down)[self.weight > 0].max(initial=-1)

    def agreed_part(
        self, before: RigBalance, half: RigBalance | None, whole: RigBalance, halves: RigBalance | None
    ) -> float:
        """1 if a sub-step is accepted; else the part of it to try next.

        That is a half where the two halves lead elsewhere than the whole, or the point where a cable reverses.
        """
        if half is None or halves is None or self.apart(whole, halves) > self.tolerance:
            return 0.5
        if not self.history:
            return 1.0
        presliding, old = self.built.rig.presliding, before.memory.slip
        middle = (half.memory.beyond - before.memory.beyond) / presliding
        last = (whole.memory.beyond - before.memory.beyond) / presliding
        slope, bow = 4 * middle - last, 2 * last - 4 * middle  # of the parabola through 0, middle and last
        turning = np.divide(-slope, 2 * bow, out=np.ones_like(bow), where=bow != 0)
        turning = np.where((turning > 0) & (turning < 1), turning, 1.0)
        extreme = turning * (slope + turning * bow)
        path = np.clip(np.clip(old + extreme, -1, 1) + last - extreme, -1, 1)
        lost = self.weight * np.abs(path - np.clip(old + last, -1, 1))
        if lost.size == 0 or lost.max() < self.tolerance:
            return 1.0
        worst = np.unravel_index(np.argmax(lost), lost.shape)
        return float(np.clip(turning[worst], LEAST_PART, MOST_PART))

    def apart(self, a: RigBalance, b: RigBalance) -> float:
        """Largest difference of two balances: of disk positions, relative to the length, or of weighted slip states."""
        shape = np.abs(poses(self.built.rig, a.ends) - poses(self.built.rig, b.ends))[:, :2].max() / self.length
        slip = self.weight * np.abs(a.memory.slip - b.memory.slip)
        return max(shape, slip.max(initial=0) if self.history else 0.0)
