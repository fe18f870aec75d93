"""An independent simulator of cable-driven continuum manipulators, to check the engine and to make concealed recordings.

It shares no code and no method with the statics engine: plates are stepped along their arcs and shot at their end poses
(`rig_kernels`), all of them balanced together; loads are followed from rest in adaptive sub-steps, each converged or
halved.  Over a sub-step the slip state of a hole uses the cable lengths at its end,

    sigma <- clip(sigma + (length beyond the hole: after - before) / presliding, -1, 1),

which is exact while every length moves one way; a reversal within a sub-step is found by comparing it with its halves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.rig_effects import Bench, bench
from prb3r.proof.rig_kernels import Forces, Rig, imbalance, lengths_beyond, poses

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


@dataclass(frozen=True)
class RigStates:
    """Equilibria after each of `s` steps of one sequence; NaN from the step on that has none.

    Disks 0..n; cables and their span tensions in file order, zero beyond a cable's end.
    """

    x: np.ndarray
    """(s, n + 1) centres of the disks at mid-thickness, m."""
    y: np.ndarray
    angle: np.ndarray
    """(s, n + 1) absolute, rad."""
    converged: np.ndarray
    """(s,) bool."""
    tension: np.ndarray
    """(s, n, m) in the span across each plate, N."""
    slip: np.ndarray
    """(s, n, m) slip state at the hole before each plate."""


class _Memory(NamedTuple):
    """What the holes remember: slip state and cable length beyond each, (n, m) both."""

    slip: np.ndarray
    beyond: np.ndarray

    def slip_at(self, rig: Rig, ends: np.ndarray) -> np.ndarray:
        """Slip states that follow the cables' lengths without limit."""
        return self.slip + (lengths_beyond(rig, ends) - self.beyond) / rig.presliding


class _State(NamedTuple):
    ends: np.ndarray
    memory: _Memory
    tension: np.ndarray


class _Load(NamedTuple):
    """Applied loads, (m,), (m,), (n, 2), (2,): what varies linearly between steps."""

    tension: np.ndarray
    slip: np.ndarray
    disk: np.ndarray
    tip: np.ndarray

    def toward(self, other: "_Load", share: float) -> "_Load":
        return _Load(*((1 - share) * a + share * b for a, b in zip(self, other, strict=True)))


def _forces(setup: Bench, load: _Load, constant: float = 1.0) -> Forces:
    """What arrives at the rig: `constant` is the share of the constant effects."""
    return Forces(
        np.maximum(load.tension + constant * setup.tension_offset, 0),
        load.disk + constant * setup.disk_force,
        setup.tip_efficiency * load.tip + constant * setup.tip_force,
    )


def _balance(rig: Rig, forces: Forces, memory: _Memory, guess: np.ndarray, elements: int) -> _State | None:
    """Equilibrium near `guess` at the end of a sub-step that began with `memory`, or None."""
    first = _iterate(rig, forces, memory, guess, elements, careful=False)
    if first is not None or not np.isfinite(rig.presliding):
        return first
    return _iterate(rig, forces, memory, guess, elements, careful=True)


def _iterate(
    rig: Rig, forces: Forces, memory: _Memory, ends: np.ndarray, elements: int, careful: bool
) -> _State | None:
    """Newton's iteration; if `careful`, each move stops where the first hole begins or ceases to slip."""
    lengths = rig.arc + 2 * rig.clamp
    scale = np.stack([lengths, lengths, np.ones_like(lengths)], 1)
    slip = memory.slip_at(rig, ends)
    sticking, moved = np.abs(slip) < 1, np.inf
    for _ in range(NEWTON + 2 * slip.size if careful else NEWTON):
        gap, tangent, tension = imbalance(rig, forces, np.clip(slip, -1, 1), sticking, ends, elements)
        error = np.abs(gap / scale).max()
        if error < RESIDUAL or (error < ROUNDED and moved < RESIDUAL):
            return _State(ends, _Memory(np.clip(slip, -1, 1), lengths_beyond(rig, ends)), tension)
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


def _rest(setup: Bench, nothing: _Load, elements: int) -> _State | None:
    """No applied load, the constant effects raised from nothing, no slip at any hole."""
    rig = setup.rig._replace(presliding=np.inf)
    zero, lengths = np.zeros_like(rig.offset), rig.arc + 2 * rig.clamp
    state = _State(np.stack([lengths, 0 * lengths, 0 * lengths], 1), _Memory(zero, zero), zero)
    done, share = 0.0, 1.0
    while done < 1:
        to = min(done + share, 1)
        forces = _forces(setup, nothing, to)
        found = _balance(rig._replace(rest=to * rig.rest), forces, _Memory(zero, zero), state.ends, elements)
        if found is not None:
            done, state = to, found
        elif share < SMALLEST:
            return None
        else:
            share /= 2
    return state


class _Path:
    """The way from one load to the next, in sub-steps."""

    def __init__(self, setup: Bench, elements: int, tolerance: float) -> None:
        self.setup, self.elements, self.tolerance = setup, elements, tolerance
        self.length = (setup.rig.arc + 2 * setup.rig.clamp + setup.rig.disk).sum()
        self.history = np.isfinite(setup.rig.presliding)
        self.longest = LONGEST if self.history else 1.0
        self.grip = TURN * setup.rig.friction
        self.grip[:1] += setup.rig.pulley

    def substep(self, state: _State | None, load: _Load, guess: np.ndarray | None = None) -> _State | None:
        if state is None:
            return None
        memory = (
            state.memory if self.history else _Memory(np.tile(load.slip, (len(state.ends), 1)), state.memory.beyond)
        )
        guess = state.ends if guess is None else guess
        return _balance(self.setup.rig, _forces(self.setup, load), memory, guess, self.elements)

    def equal_substeps(self, state: _State | None, begin: _Load, end: _Load, count: int) -> _State | None:
        for k in range(1, count + 1):
            state = self.substep(state, begin.toward(end, k / count))
        return state

    def adaptive(self, state: _State, begin: _Load, end: _Load) -> _State | None:
        """Accept a sub-step where it passes no event, hides no reversal and agrees with its two halves."""
        done, longest = 0.0, self.longest
        for _ in range(MOST):
            whole, share = self.until_event(state, lambda h: begin.toward(end, done + h), min(longest, 1 - done))  # noqa: B023
            if whole is None:
                return None
            half = self.substep(state, begin.toward(end, done + share / 2), (state.ends + whole.ends) / 2)
            halves = self.substep(half, begin.toward(end, done + share), whole.ends)
            cut = self.agreed_part(state, half, whole, halves)
            if cut < 1:
                longest = cut * share
                if longest < SMALLEST:
                    return None
            else:
                state, done, longest = whole, done + share, self.longest
                if done >= 1:
                    return state
        return None

    def until_event(self, state: _State, load, share: float) -> tuple[_State | None, float]:
        """Go `share` ahead, or to where the first hole begins to slip, or as far as there is a balance."""
        found = self.substep(state, load(share))
        while found is None and share > SMALLEST:
            share /= 2
            found = self.substep(state, load(share))
        if not self.history or found is None:
            return found, share
        low, low_over, low_found = 0.0, self.overshoot(state, state), None
        high, high_over = share, self.overshoot(state, found)
        if high_over <= EVENT:
            return found, share
        far, far_ends, last_over = share, found.ends, 0.0
        for _ in range(TRIALS):
            share = low - (high - low) * low_over / (high_over - low_over)
            found = self.substep(state, load(share), state.ends + share / far * (far_ends - state.ends))
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

    def overshoot(self, before: _State, after: _State) -> float:
        """How far the first hole is beyond the slip state at which it begins to slip; negative: none is."""
        old = before.memory.slip
        new = old + (after.memory.beyond - before.memory.beyond) / self.setup.rig.presliding
        up, down = np.where(old < 1 - EVENT, new - 1, -1), np.where(old > EVENT - 1, -1 - new, -1)
        return np.maximum(up, down)[self.grip > 0].max(initial=-1)

    def agreed_part(self, before: _State, half: _State | None, whole: _State, halves: _State | None) -> float:
        """Part of a sub-step to be trusted, 1 for all of it."""
        if halves is None or self.apart(whole, halves) > self.tolerance:
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

    def apart(self, a: _State, b: _State) -> float:
        """Largest distance of two states, in parts of the length."""
        shape = np.abs(poses(self.setup.rig, a.ends) - poses(self.setup.rig, b.ends))[:, :2].max() / self.length
        slip = self.grip * np.abs(a.memory.slip - b.memory.slip)
        return max(shape, slip.max(initial=0) if self.history else 0.0)


def _loads(setup: Bench, steps: Sequence[Mapping[str, float]]) -> list[_Load]:
    """Read the steps.  Absent and empty loads are zero, absent and empty slips -1."""
    n, m = setup.rig.offset.shape
    weight = setup.gravity
    place = {f"cable_{name}_n": ("tension", j, 1) for j, name in enumerate(setup.cables)}
    place |= {f"cable_{name}_kg": ("tension", j, weight) for j, name in enumerate(setup.cables)}
    place |= {f"slip_{name}": ("slip", j, 1) for j, name in enumerate(setup.cables)}
    place |= {f"disk{k}_{axis}_n": ("disk", (k - 1, c), 1) for k in range(1, n + 1) for c, axis in enumerate("xy")}
    place |= {"tip_x_n": ("tip", 0, 1), "tip_y_n": ("tip", 1, 1), "sequence": ("", 0, 0), "step": ("", 0, 0)}
    loads, problems = [], []
    for k, step in enumerate(steps):
        load = _Load(np.zeros(m), -np.ones(m), np.zeros((n, 2)), np.zeros(2))
        for name, value in step.items():
            if name not in place:
                problems.append(Problem(f"steps[{k}]", f"unknown {name}" + did_you_mean(name, place)))
            elif place[name][0] and value is not None and not np.isnan(value):
                field, where, unit = place[name]
                getattr(load, field)[where] = unit * value
        if (load.tension < 0).any():
            problems.append(Problem(f"steps[{k}]", "a cable cannot push: tensions must not be negative"))
        loads.append(load)
    if problems:
        raise SpecError(*problems)
    return loads


def simulate(
    manipulator: Mapping[str, Any],
    steps: Sequence[Mapping[str, float]],
    *,
    elements: int = 24,
    substeps: int | None = None,
    tolerance: float = 1e-6,
) -> RigStates:
    """Equilibria along one sequence of load steps, from rest.

    Parameters
    ----------
    manipulator : the contents of a manipulator file, effects included; its `model` is not looked at
    steps : load columns of the steps table, in N (or `_kg`), and `slip_*`; slip is read with declared direction only
    elements : steps along the arc of each plate
    substeps : fixed number of equal sub-steps per step; without it they adapt
    tolerance : of one adaptive sub-step against its halves: position in parts of the length, or slip state in the shape it
        may cost

    Raises
    ------
    SpecError
        Effects or load columns that make no sense.
    """
    setup = bench(manipulator)
    loads, (n, m) = _loads(setup, steps), setup.rig.offset.shape
    path = _Path(setup, elements, tolerance)
    before = _Load(np.zeros(m), np.zeros(m), np.zeros((n, 2)), np.zeros(2))
    state = _rest(setup, before, elements)
    pose, tension, slip = (np.full((len(steps), *shape), np.nan) for shape in ((n + 1, 3), (n, m), (n, m)))
    for k, load in enumerate(loads):
        moved = any((a != b).any() for a, b in zip(load, before, strict=True))
        if state is not None and (moved or k == 0):
            state = (
                path.equal_substeps(state, before, load, substeps) if substeps else path.adaptive(state, before, load)
            )
        if state is not None:
            pose[k], tension[k], slip[k] = poses(setup.rig, state.ends), state.tension, state.memory.slip
        before = load
    return RigStates(*np.moveaxis(pose, 2, 0), np.isfinite(pose[:, 0, 0]), tension, slip)


def observe(
    manipulator: Mapping[str, Any],
    states: RigStates,
    *,
    image_centre: Sequence[float] = (0.0, 0.0),
    frame: Sequence[float] = (0.0, 0.0, 0.0),
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y and angle (s, n + 1) as the camera has them: turned and shifted by the frame, scaled, distorted.

    measured = c + (q - c)(1 + k1 r^2), q = scale (R p + d), r = |q - c|.

    Parameters
    ----------
    image_centre : c, m
    frame : rotation in rad, and shift d in m
    """
    setup, (rotation, shift_x, shift_y) = bench(manipulator), frame
    cos, sin = np.cos(rotation), np.sin(rotation)
    x = setup.scale * (cos * states.x - sin * states.y + shift_x) - image_centre[0]
    y = setup.scale * (sin * states.x + cos * states.y + shift_y) - image_centre[1]
    stretch = 1 + setup.lens * (x**2 + y**2)
    return image_centre[0] + x * stretch, image_centre[1] + y * stretch, states.angle + rotation
