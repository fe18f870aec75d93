"""An independent simulator of cable-driven continuum manipulators: checks the engine, makes concealed recordings.

It shares no code and no method with the statics engine.  Plates are integrated along their arcs by shooting, and all
are balanced together (`imbalance`, `balance`).  Loads are followed from rest in sub-steps, each of which converges or
is made shorter (`path`).  `draft`, `effects` and `build` turn a manipulator file into the rig.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.rig.arrays import plates_remember
from prb3r.proof.rig.balance import AppliedLoads, LoadRamp, rest
from prb3r.proof.rig.build import BuiltRig, build_rig
from prb3r.proof.rig.imbalance import poses
from prb3r.proof.rig.path import RigPath
from prb3r.proof.rig.relaxing import lost_moments, relaxing

ELEMENTS, ELEMENTS_WITH_MEMORY = 12, 24
"""Integration steps along the arc of a plate whose curvature follows from its moment, and of one with hysteresis.

Twice the former move positions in 400 sequences of rigs of the proof by at most 1e-6 of the length, and the end of one
plate that is bent by 1.4 rad by 1e-5.  Plates with flags turn back at one station after the other: half of the latter
move positions by 4e-4.
"""


@dataclass(frozen=True)
class RigStates:
    """Equilibria after each of `s` steps of one sequence: disks 0..n, cables in file order.

    A path ends where its equilibrium ceases or jumps: from that step on `converged` is false and all else NaN.
    """

    x: np.ndarray
    """(s, n + 1) centres of the disks at mid-thickness, m."""
    y: np.ndarray
    angle: np.ndarray
    """(s, n + 1) absolute angles of the disks, rad."""
    converged: np.ndarray
    """(s,) whether the path has reached the step."""
    tension: np.ndarray
    """(s, n, m) tension of the span across each plate, N; zero beyond a cable's end."""
    slip: np.ndarray
    """(s, n, m) slip state at the hole before each plate: -1 drawn in, 1 paid out."""


def steps_passed(steps: Sequence[Mapping[str, float]]) -> np.ndarray:
    """(s,) number of steps that had passed before each step of a table, by which drifts go.

    Where every step has its `time_s`, it is the time since the first one, in mean times per step.
    """
    times = np.array([step.get("time_s", np.nan) for step in steps], float)
    if len(times) < 2 or not np.isfinite(times).all() or not np.ptp(times):
        return np.arange(float(len(times)))
    return (times - times.min()) / (np.ptp(times) / (len(times) - 1))


def _loads(built: BuiltRig, steps: Sequence[Mapping[str, float]], passed: np.ndarray) -> list[AppliedLoads]:
    """The loads of every step as load cells and play let them act, with the factors on friction.

    `passed` (s,) is the number of steps that had passed before each.  Absent and empty loads are zero, absent and empty
    slips -1.  Raises SpecError for unknown columns, negative tensions, and times that do not increase where friction
    needs them.
    """
    n, m = built.rig.offset.shape
    weight = built.gravity
    place: dict[str, tuple[str, Any, float]] = {
        f"cable_{name}_n": ("tension", j, 1) for j, name in enumerate(built.cables)
    }
    place |= {f"cable_{name}_kg": ("tension", j, weight) for j, name in enumerate(built.cables)}
    place |= {f"slip_{name}": ("slip", j, 1) for j, name in enumerate(built.cables)}
    place |= {f"disk{k}_{axis}_n": ("disk", (k - 1, c), 1) for k in range(1, n + 1) for c, axis in enumerate("xy")}
    place |= {"tip_x_n": ("tip", 0, 1), "tip_y_n": ("tip", 1, 1), "sequence": ("", 0, 0), "step": ("", 0, 0)}
    place |= {"time_s": ("", 0, 0)}
    loads, problems, noted = [], [], np.zeros(m)
    slid, way, behind = np.zeros(m), np.zeros(m), np.zeros(m)
    for k, step in enumerate(steps):
        load = _nothing(n, m)._replace(slip=-np.ones(m), elapsed=passed[k : k + 1])
        for name, value in step.items():
            if name not in place:
                problems.append(Problem(f"steps[{k}]", f"unknown {name}" + did_you_mean(name, place)))
            elif place[name][0] and value is not None and not np.isnan(value):
                field, where, unit = place[name]
                getattr(load, field)[where] = unit * value
        if (load.tension < 0).any():
            problems.append(Problem(f"steps[{k}]", "a cable cannot push: tensions must not be negative"))
        if k and built.friction_rate:
            problems += _rub_by_rate(built, load, noted, step, steps[k - 1])
        slid, way = _slide_on(load, noted, slid, way)
        load.rubbing[:] *= 1 + built.friction_excess * np.exp(-slid / built.friction_decay)
        load.rubbing[:] *= max(1 + built.friction_growth * float(passed[k]), LEAST_RUBBING)
        noted = load.tension.copy()
        load.tension[:] = built.gain * (load.tension + built.gain_per_n * load.tension**2) + built.hanger * (noted > 0)
        ahead = load.tension - behind  # the true tension is dragged along once the play is taken up
        behind = behind + np.sign(ahead) * np.maximum(np.abs(ahead) - built.tension_play, 0)
        load.tension[:] = np.where(built.tension_play > 0, behind, load.tension)  # exact without play
        loads.append(load)
    if problems:
        raise SpecError(*problems)
    return loads


def _nothing(plates: int, cables: int) -> AppliedLoads:
    """No loads on so many plates and cables, whose friction is as it was."""
    none, one = np.zeros(cables), np.zeros(1)
    return AppliedLoads(
        none, none.copy(), np.zeros((plates, 2)), np.zeros(2), one, np.ones(cables), one.copy(), np.zeros(plates)
    )


CREEP = 0.1
"""Least change of a tension between two steps for the rate at which its cable is pulled, N, from the definition of
`rate_dependent_friction` in docs/effects.md: smaller changes count as this."""
LEAST_RUBBING = 0.05
"""Least factor on friction, whatever the rate or the number of steps, from the same definition and that of
`friction_drift`."""


def _rub_by_rate(
    built: BuiltRig,
    load: AppliedLoads,
    noted: np.ndarray,
    step: Mapping[str, float],
    last: Mapping[str, float],
) -> list[Problem]:
    """Write to `load` the factor on friction by the rate at which each tension changed since the `last` step.

    `noted` are the tensions of that step as noted, N.  Returns the problem if the times of the steps do not increase.
    """
    waited = step.get("time_s", np.nan) - last.get("time_s", np.nan)
    if not waited > 0:
        return [Problem("steps", "friction goes by the rate of tensions: every step needs a later time_s")]
    for j, change in enumerate(load.tension - noted):
        speed = max(abs(change), CREEP) / waited / built.friction_reference
        load.rubbing[j] = max(1 + built.friction_rate * np.log(speed), LEAST_RUBBING)
    return []


def _waited(built: BuiltRig, steps: Sequence[Mapping[str, float]], passed: np.ndarray, k: int) -> float:
    """Time from the step before to step `k`, or from rest to the first one, in steps of `relaxation_time`."""
    if k == 0:
        return 1.0
    if built.relaxation_step and "time_s" in steps[k]:
        return (steps[k]["time_s"] - steps[k - 1]["time_s"]) / built.relaxation_step
    return float(passed[k] - passed[k - 1])


def _slide_on(
    load: AppliedLoads, noted: np.ndarray, slid: np.ndarray, way: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Change of tension (m,) of each cable since it began to slide its present way, N, and that way (m,), -1 or 1.

    Parameters
    ----------
    noted, slid, way : noted tensions (m,) at the step before, and what this function returned for that step; a cable
        that reverses or hung slack starts anew.
    """
    far = np.zeros_like(slid)
    for j, (tension, last) in enumerate(zip(load.tension, noted, strict=True)):
        on = last > 0 and load.slip[j] == way[j]
        far[j] = abs(tension - last) + (slid[j] if on else 0.0)
    return far, load.slip.copy()


def simulate(
    manipulator: Mapping[str, Any],
    steps: Sequence[Mapping[str, float]],
    *,
    elements: int | None = None,
    substeps: int | None = None,
    tolerance: float = 1e-6,
    before: float | np.ndarray = 0.0,
) -> RigStates:
    """Equilibria along one sequence of load steps, from rest.

    Parameters
    ----------
    manipulator : the contents of a manipulator file, effects included; its `model` is not looked at
    steps : load columns of the steps table, in N (or `_kg`), and `slip_*`; slip is read with declared direction only
    elements : integration steps along the arc of each plate; without it `ELEMENTS`, of plates with hysteresis
        `ELEMENTS_WITH_MEMORY`
    substeps : fixed number of equal sub-steps per step; without it they adapt
    tolerance : of one adaptive sub-step: see :class:`prb3r.proof.rig.path.RigPath`
    before : number of steps that were taken before the sequence, for drifting tensions and softening plates; or
        :func:`steps_passed` (s,) of its steps, where it is a part of a table with times

    Raises
    ------
    SpecError
        Invalid effects or load columns.
    """
    built = build_rig(manipulator)
    passed = before + steps_passed(steps) if np.ndim(before) == 0 else np.asarray(before, float)
    loads, (n, m) = _loads(built, steps, passed), built.rig.offset.shape
    if elements is None:
        elements = ELEMENTS_WITH_MEMORY if plates_remember(built.rig) else ELEMENTS
    path = RigPath(built, elements, tolerance)
    last, relaxed = _nothing(n, m), np.zeros(n)
    state = rest(built, last, elements)
    pose, tension, slip = (np.full((len(steps), *shape), np.nan) for shape in ((n + 1, 3), (n, m), (n, m)))
    for k, load in enumerate(loads):
        load = relaxing(built, load, _waited(built, steps, passed, k), relaxed)
        ramp, last = LoadRamp(last._replace(fresh=np.zeros(1), relaxed=relaxed), load), load
        if state is not None and (k == 0 or any((a != b).any() for a, b in zip(*ramp, strict=True))):
            state = path.equal_substeps(state, ramp, substeps) if substeps else path.adaptive(state, ramp)
        if state is not None:
            pose[k], tension[k], slip[k] = poses(built.rig, state.ends), state.tension, state.memory.slip
            relaxed = lost_moments(built, load, state)
    x, y, angle = np.moveaxis(pose, 2, 0)
    return RigStates(x, y, angle, np.isfinite(x[:, 0]), tension, slip)


def observe(
    manipulator: Mapping[str, Any],
    states: RigStates,
    *,
    image_centre: Sequence[float] = (0.0, 0.0),
    frame: Sequence[float] = (0.0, 0.0, 0.0),
    before: float | np.ndarray = 0.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x, y (m) and angle (rad), (s, n + 1) each, as the camera reads them without noise.

    Positions are turned and shifted by the frame, then by the camera's drift, then scaled, along y by the aspect more,
    then distorted:

    measured = c + (q - c)(1 + k1 r^2), q = scale diag(1, aspect) (R' (R p + d) + d'), r = |q - c|.

    Parameters
    ----------
    image_centre : c, m
    frame : rotation in rad, and shift d in m
    before : number of steps taken before the sequence, for the drift R' and d', which grow in proportion to it; or
        :func:`steps_passed` (s,) of its steps, where they have times
    """
    built, (rotation, shift_x, shift_y) = build_rig(manipulator), frame
    passed = (before + np.arange(len(states.x)) if np.ndim(before) == 0 else np.asarray(before))[:, None]
    plane = np.exp(1j * rotation) * (states.x + 1j * states.y) + complex(shift_x, shift_y)
    plane = np.exp(1j * passed * built.camera_turn) * plane + passed * complex(*built.camera_shift)
    seen = plane.real + 1j * built.aspect * plane.imag
    away = built.scale * seen - complex(*image_centre)
    read = complex(*image_centre) + away * (1 + built.lens * np.abs(away) ** 2)
    return read.real, read.imag, states.angle + rotation + passed * built.camera_turn
