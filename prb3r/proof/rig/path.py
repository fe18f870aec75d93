"""Following a load path: balances by Newton's iteration, sub-steps that end where a hole begins to slip.

Over a sub-step the slip state of a hole uses the cable lengths at its end,

    sigma <- clip(sigma + (length beyond the hole: after - before) / presliding, -1, 1),

which is exact while that length moves one way.  Motion kinks where a hole begins to slip, so a sub-step ends at the
first such event; a turn between events shows in the parabola through beginning, middle and end.  Just after an event
any small load may change which holes slip, a problem without scale that no halving cures: the careful iteration
changes one hole at a time (Katzenelson's way through piecewise linear equations).
"""

from typing import NamedTuple

import numpy as np

from prb3r.proof.rig.build import BuiltRig
from prb3r.proof.rig.kernels import Forces, Rig, imbalance, lengths_beyond, poses

RESIDUAL, ROUNDED = 1e-11, 1e-8
"""Largest gap of a converged balance (bends in rad, positions in plate lengths); where rounding forbids it, largest
move of the last iteration, with a gap no larger than the second."""
NEWTON, LEAP = 25, 0.3
"""Iterations, and largest change of a plate's bend in one of them, rad."""
LONGEST, SMALLEST, MOST = 1 / 32, 1e-10, 1500
"""Sub-steps with loading history, in parts of a step, and their number: beyond, the path ends at a limit load."""
EVENT, TRIALS = 1e-4, 40
"""How exactly in slip state a sub-step ends where a hole begins to slip, and in how many trials."""
TURN = 0.1
"""A turning angle, rad: what an error of slip state may later cost in shape."""


class Memory(NamedTuple):
    """What the holes remember: slip state and cable length beyond each, (n, m) both."""

    slip: np.ndarray
    beyond: np.ndarray

    def slip_at(self, rig: Rig, ends: np.ndarray) -> np.ndarray:
        """Slip states that follow the cables' lengths without limit."""
        return self.slip + (lengths_beyond(rig, ends) - self.beyond) / rig.presliding


class State(NamedTuple):
    """A balance: end poses of the plates (n, 3), what its holes remember, span tensions (n, m)."""

    ends: np.ndarray
    memory: Memory
    tension: np.ndarray


class Load(NamedTuple):
    """Applied tensions, declared slips, forces on disks and tip, (m,), (m,), (n, 2), (2,): linear between steps."""

    tension: np.ndarray
    slip: np.ndarray
    disk: np.ndarray
    tip: np.ndarray


class Way(NamedTuple):
    """From one load to the next."""

    begin: Load
    end: Load

    def at(self, share: float) -> Load:
        return Load(*((1 - share) * a + share * b for a, b in zip(*self, strict=True)))


def forces_of(setup: BuiltRig, load: Load, constant: float = 1.0) -> Forces:
    """What arrives at the rig: `constant` is the share of the constant effects."""
    return Forces(
        np.maximum(load.tension + constant * setup.tension_offset, 0),
        load.disk + constant * setup.disk_force,
        setup.tip_efficiency * load.tip + constant * setup.tip_force,
    )


def balance(rig: Rig, forces: Forces, memory: Memory, guess: np.ndarray, elements: int) -> State | None:
    """Equilibrium near `guess` at the end of a sub-step that began with `memory`, or None."""
    first = _iterate(rig, forces, memory, guess, elements, careful=False)
    if first is not None or not np.isfinite(rig.presliding):
        return first
    return _iterate(rig, forces, memory, guess, elements, careful=True)


@np.errstate(all="ignore")
def _iterate(rig: Rig, forces: Forces, memory: Memory, ends: np.ndarray, elements: int, careful: bool) -> State | None:
    """Newton's iteration; if `careful`, each move stops where the first hole begins or ceases to slip."""
    lengths = rig.arc + 2 * rig.clamp
    scale = np.stack([lengths, lengths, np.ones_like(lengths)], 1)
    slip = memory.slip_at(rig, ends)
    sticking, moved = np.abs(slip) < 1, np.inf
    for _ in range(NEWTON + 2 * slip.size if careful else NEWTON):
        gap, tangent, tension = imbalance(rig, forces, np.clip(slip, -1, 1), sticking, ends, elements)
        error = np.abs(gap / scale).max()
        if error < RESIDUAL or (error < ROUNDED and moved < RESIDUAL):
            return State(ends, Memory(np.clip(slip, -1, 1), lengths_beyond(rig, ends)), tension)
        if not np.isfinite(error):
            return None
        try:
            move = np.linalg.solve(tangent, -gap.ravel()).reshape(ends.shape)
        except np.linalg.LinAlgError:
            return None
        moved = np.abs(move / scale).max()
        move = move * min(1, LEAP / moved)
        after = memory.slip_at(rig, ends + move)
        if careful:
            side = np.sign(np.where(sticking, after, slip))
            change = sticking != (side * after < 1)
            way = np.divide(side - slip, after - slip, out=np.ones_like(slip), where=change & (after != slip))
            hole = np.unravel_index(np.argmin(way), way.shape)
            if way[hole] < 1:
                move = move * max(way[hole], 0)
                sticking[hole] ^= True
                after = memory.slip_at(rig, ends + move)
        else:
            sticking = np.abs(after) < 1
        ends, slip = ends + move, after
    return None


def rest(setup: BuiltRig, nothing: Load, elements: int) -> State | None:
    """No applied load, the constant effects raised from nothing, no slip at any hole."""
    rig = setup.rig._replace(presliding=np.inf)
    zero, lengths = np.zeros_like(rig.offset), rig.arc + 2 * rig.clamp
    state = State(np.stack([lengths, 0 * lengths, 0 * lengths], 1), Memory(zero, zero), zero)
    done, share = 0.0, 1.0
    while done < 1:
        to = min(done + share, 1)
        forces = forces_of(setup, nothing, to)
        found = balance(rig._replace(rest=to * rig.rest), forces, Memory(zero, zero), state.ends, elements)
        if found is not None:
            done, state = to, found
        elif share < SMALLEST:
            return None
        else:
            share /= 2
    return state


class Path:
    """Follows the loads of one sequence."""

    def __init__(self, setup: BuiltRig, elements: int, tolerance: float) -> None:
        self.setup, self.elements, self.tolerance = setup, elements, tolerance
        self.length = (setup.rig.arc + 2 * setup.rig.clamp + setup.rig.disk).sum()
        self.history = np.isfinite(setup.rig.presliding)
        self.longest = LONGEST if self.history else 1.0
        self.grip = TURN * setup.rig.friction
        self.grip[:1] += setup.rig.pulley

    def substep(self, state: State | None, load: Load, guess: np.ndarray | None = None) -> State | None:
        if state is None:
            return None
        memory = state.memory if self.history else Memory(np.tile(load.slip, (len(state.ends), 1)), state.memory.beyond)
        guess = state.ends if guess is None else guess
        return balance(self.setup.rig, forces_of(self.setup, load), memory, guess, self.elements)

    def equal_substeps(self, state: State | None, way: Way, count: int) -> State | None:
        for k in range(1, count + 1):
            state = self.substep(state, way.at(k / count))
        return state

    def adaptive(self, state: State, way: Way) -> State | None:
        """Accept a sub-step where it passes no event, hides no reversal and agrees with its two halves."""
        done, longest = 0.0, self.longest
        for _ in range(MOST):
            whole, share = self.until_event(state, way, done, min(longest, 1 - done))
            if whole is None:
                return None
            half = self.substep(state, way.at(done + share / 2), (state.ends + whole.ends) / 2)
            halves = self.substep(half, way.at(done + share), whole.ends)
            cut = self.agreed_part(state, half, whole, halves)
            if cut == 1:
                state, done, longest = whole, done + share, self.longest
                if done >= 1:
                    return state
            elif cut * share < SMALLEST:
                return None
            else:
                longest = cut * share
        return None

    def until_event(self, state: State, way: Way, done: float, share: float) -> tuple[State | None, float]:
        """Go `share` ahead, or to where the first hole begins to slip, or as far as there is a balance."""
        found = self.substep(state, way.at(done + share))
        while found is None and share > SMALLEST:
            share /= 2
            found = self.substep(state, way.at(done + share))
        if not self.history or found is None:
            return found, share
        low, low_over, low_found = 0.0, self.overshoot(state, state), None
        high, high_over = share, self.overshoot(state, found)
        if high_over <= EVENT:
            return found, share
        far, far_ends, last_over = share, found.ends, 0.0
        for _ in range(TRIALS):
            share = low - (high - low) * low_over / (high_over - low_over)
            found = self.substep(state, way.at(done + share), state.ends + share / far * (far_ends - state.ends))
            if found is None:
                high, high_over = share, -low_over
                continue
            over = self.overshoot(state, found)
            if abs(over) <= EVENT:
                return found, share
            if over > 0:
                high, high_over, low_over = share, over, low_over / (2 if last_over > 0 else 1)
                far, far_ends = share, found.ends
            else:
                low, low_over, low_found, high_over = share, over, found, high_over / (2 if last_over < 0 else 1)
            last_over = over
        return low_found, low

    def overshoot(self, before: State, after: State) -> float:
        """How far the first hole is beyond the slip state at which it begins to slip; negative: none is."""
        old = before.memory.slip
        new = old + (after.memory.beyond - before.memory.beyond) / self.setup.rig.presliding
        up, down = np.where(old < 1 - EVENT, new - 1, -1), np.where(old > EVENT - 1, -1 - new, -1)
        return np.maximum(up, down)[self.grip > 0].max(initial=-1)

    def agreed_part(self, before: State, half: State | None, whole: State, halves: State | None) -> float:
        """Part of a sub-step to be trusted, 1 for all of it."""
        if half is None or halves is None or self.apart(whole, halves) > self.tolerance:
            return 0.5
        if not self.history:
            return 1.0
        presliding, old = self.setup.rig.presliding, before.memory.slip
        middle = (half.memory.beyond - before.memory.beyond) / presliding
        last = (whole.memory.beyond - before.memory.beyond) / presliding
        slope, bow = 4 * middle - last, 2 * last - 4 * middle  # of the parabola through the three
        turning = np.divide(-slope, 2 * bow, out=np.ones_like(bow), where=bow != 0)
        turning = np.where((turning > 0) & (turning < 1), turning, 1.0)
        extreme = turning * (slope + turning * bow)
        path = np.clip(np.clip(old + extreme, -1, 1) + last - extreme, -1, 1)
        lost = self.grip * np.abs(path - np.clip(old + last, -1, 1))
        worst = np.unravel_index(np.argmax(lost), lost.shape)
        return 1.0 if lost.size == 0 or lost[worst] < self.tolerance else float(np.clip(turning[worst], 0.05, 0.95))

    def apart(self, a: State, b: State) -> float:
        """Largest distance of two states, in parts of the length."""
        shape = np.abs(poses(self.setup.rig, a.ends) - poses(self.setup.rig, b.ends))[:, :2].max() / self.length
        slip = self.grip * np.abs(a.memory.slip - b.memory.slip)
        return max(shape, slip.max(initial=0) if self.history else 0.0)
