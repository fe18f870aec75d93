"""Foreign laws: physics outside the library of effects, put together step by step from what the rig can do."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from prb3r.proof.concealed.design import Design, Flavour, LoadSteps
from prb3r.proof.rig.simulate import RigStates, simulate
from prb3r.proof.settings import SETTINGS
from prb3r.recording.recording import Kind


class Instant(NamedTuple):
    """One step of a recording before it is simulated."""

    design: Design
    sequence: int
    """Number of the sequence, from 0."""
    step: int
    """Number of the step in its sequence, from 0."""
    bends: np.ndarray
    """(n,) bends of the plates of the nominal manipulator at the step, rad."""
    yielded: bool
    """Whether the plate that may yield has done so at an earlier step."""


class Change(NamedTuple):
    """Changes that a law makes at one step."""

    effects: list[dict[str, Any]]
    """Effects that act in addition, as tables of a manipulator file."""
    loads: Mapping[str, float]
    """Load columns of the step whose true values are not the noted ones."""
    log_stiffness: float
    """ln of a factor on E."""


class ForeignLaw(NamedTuple):
    """One law outside the library."""

    change: Callable[[Instant, float, Mapping[str, float]], Change]
    """The changes at an instant, from the size of the law and the load columns of the step."""
    largest: float
    """Largest size at which it is concealed."""
    signed: bool = False
    """Whether its size may be negative too."""
    jumps: bool = False
    """Whether its action changes in jumps as its size grows."""
    of_the_kind: bool = True
    """Whether another design of the same making has it too; else it is a fault of one arm or of one set-up."""
    held_by: str = ""
    """Kind of effect of the library that is the law in another form, or of which several together are; empty: none."""


def _friction_grows(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """A friction coefficient that grows with the tension."""
    effects = []
    for name in at.design.cables:
        grown = at.design.friction * (1 + u * step[f"cable_{name}_n"] / at.design.pull)
        effects += [
            {"kind": "worn_hole", "disk": disk, "coefficient": grown, "cables": [name]}
            for disk in range(at.design.plates)
        ]
    return Change(effects, {}, 0.0)


def _creep(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """Plates that soften with the logarithm of time, counted in steps of a sequence."""
    return Change([], {}, -u * np.log1p(at.step))


def _waves(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """Stiffness that rises and falls along the arm."""
    along = np.linspace(0, 1, at.design.plates)
    return Change(_plate_factors(u * np.sin(SETTINGS.foreign.half_waves * np.pi * along)), {}, 0.0)


def _plate_factors(logarithms: np.ndarray) -> list[dict[str, Any]]:
    """Effects that multiply the stiffness of each plate, from the logarithms of the factors (n,)."""
    return [
        {"kind": "weakened_plate", "plate": plate, "factor": float(np.exp(value))}
        for plate, value in enumerate(logarithms, 1)
    ]


def _yielding(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """A plate that stays bent once it has been bent far."""
    curvature = at.design.largest_bend / SETTINGS.foreign.prototype_arc_m
    bent = {"kind": "precurvature", "plates": [1 + _watched(at.design)], "curvature_per_m": u * curvature}
    return Change([bent] if at.yielded else [], {}, 0.0)


def _dead_zone(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """A cable that a clutch releases below some tension."""
    name = f"cable_{at.design.cables[at.design.number % len(at.design.cables)]}_n"
    return Change([], {name: step[name] if step[name] > u * at.design.pull else 0.0}, 0.0)


def _saturation(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """Tensions that fall behind the noted ones with the cube of these."""
    names = [f"cable_{name}_n" for name in at.design.cables]
    left = {name: max(1 - u * (step[name] / at.design.pull) ** 2, 0.0) for name in names}
    return Change([], {name: step[name] * left[name] for name in names}, 0.0)


def _leak(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """Cables drag their neighbours along: each tension grows by the part `u` of the sum of the others."""
    names = [f"cable_{name}_n" for name in at.design.cables]
    total = sum(step[name] for name in names)
    return Change([], {name: step[name] + u * (total - step[name]) for name in names}, 0.0)


def _frame_moves(at: Instant, u: float, step: Mapping[str, float]) -> Change:
    """A camera that is knocked between sequences: nothing changes on the rig; see :func:`knocks` for the frames."""
    return Change([], {}, 0.0)


LAWS: dict[str, ForeignLaw] = {
    "friction_grows": ForeignLaw(
        _friction_grows, SETTINGS.foreign.largest_friction_growth, held_by="load_dependent_friction"
    ),
    "creep": ForeignLaw(_creep, SETTINGS.foreign.largest_creep),
    "waves": ForeignLaw(
        _waves, SETTINGS.foreign.largest_waves, signed=True, of_the_kind=False, held_by="weakened_plate"
    ),
    "yielding": ForeignLaw(_yielding, SETTINGS.foreign.largest_yielding, signed=True),
    "dead_zone": ForeignLaw(_dead_zone, SETTINGS.foreign.largest_dead_zone, jumps=True),
    "saturation": ForeignLaw(_saturation, SETTINGS.foreign.largest_saturation),
    "leak": ForeignLaw(_leak, SETTINGS.foreign.largest_leak),
    "frame_moves": ForeignLaw(_frame_moves, SETTINGS.foreign.largest_knock, signed=True, of_the_kind=False),
}
"""The laws by name."""


def possible(design: Design) -> list[str]:
    """Names of the laws that can act on the design of a bench rig.

    None with friction along the load path; no growth of friction where there is none; no knocked camera where only
    bends are read.
    """
    without = set() if design.friction > 0 else {"friction_grows"}
    if not {Kind.X, Kind.ANGLE} & set(design.kinds):
        without |= {"frame_moves"}
    return [] if design.flavour == Flavour.HISTORY else [name for name in LAWS if name not in without]


def knocks(design: Design, law: str, size: float) -> list[tuple[float, float, float]]:
    """Frame (rotation, rad, and shift, m) that a law adds in every sequence; zero but for a knocked camera."""
    if law != "frame_moves":
        return [(0.0, 0.0, 0.0)] * len(design.program)
    rotation, shift = design.measurement["frame_rotation_sd_rad"], design.measurement.get("frame_position_sd_m", 0.0)
    sway = np.cos(SETTINGS.foreign.knock_phase * np.arange(len(design.program)) + design.number)
    return [(size * rotation * w, size * shift * w, -size * shift * w) for w in sway.tolist()]


def _watched(design: Design) -> int:
    """Index from 0 of the plate that may yield; it goes by the number of the design, so that designs differ."""
    return design.number % design.plates


def followed_foreign(
    design: Design, manipulator: Mapping[str, Any], program: Sequence[LoadSteps], law: str, size: float
) -> list[RigStates] | None:
    """States along a whole program under a law; None where a step has no equilibrium.

    Every step is simulated by itself, from rest.

    Parameters
    ----------
    manipulator : contents of a file with the true constants; whether a plate has yielded is decided by the bends of the
        design's nominal manipulator
    """
    out, yielded = [], False
    yield_bend = SETTINGS.foreign.yield_from * design.largest_bend
    for q, steps in enumerate(program):
        plain = simulate(design.manipulator, steps)
        parts = []
        for k, step in enumerate(steps):
            bends = np.diff(plain.angle[k])
            change = LAWS[law].change(Instant(design, q, k, bends, yielded), size, step)
            stiffer = manipulator["youngs_modulus_pa"] * float(np.exp(change.log_stiffness))
            effects = [*manipulator["effect"], *change.effects]
            changed = {**manipulator, "youngs_modulus_pa": stiffer, "effect": effects}
            states = simulate(changed, [{**step, **change.loads}])
            if not states.converged.all():
                return None
            parts.append(states)
            yielded = yielded or bool(np.abs(bends[_watched(design)]) > yield_bend)
        out.append(RigStates(*(np.concatenate([getattr(p, f) for p in parts]) for f in RigStates.__annotations__)))
    return out
