"""Physics that no library of effects holds, put together from what the rig can do at one step."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from prb3r.proof.concealed.designs import ANGLE, HISTORY, Design, Steps, X
from prb3r.proof.rig.simulate import RigStates, simulate

Frame = tuple[float, float, float]


class Moment(NamedTuple):
    """One step of a recording, as it is about to be loaded."""

    design: Design
    sequence: int
    step: int
    bends: np.ndarray
    """(n,) of the nominal manipulator there, rad."""
    yielded: bool
    """Whether the most loaded plate has been bent far before."""


Change = Callable[[Moment, float, Mapping[str, float]], tuple[list[dict[str, Any]], dict[str, float], float]]
"""Of a moment, a size and a step: effects, changes of the step, and ln of a factor on stiffness."""


def friction_grows(at: Moment, u: float, step: Mapping[str, float]):
    """A friction coefficient that grows with the tension."""
    mu, effects = at.design.friction, []
    for name in at.design.cables:
        grown = mu * (1 + u * step[f"cable_{name}_n"] / at.design.pull)
        effects += [
            {"kind": "worn_hole", "disk": disk, "coefficient": grown, "cables": [name]}
            for disk in range(at.design.plates)
        ]
    return effects, {}, 0.0


def creep(at: Moment, u: float, step: Mapping[str, float]):
    """Plates that give way with time under load."""
    return [], {}, -u * np.log1p(at.step)


def drift(at: Moment, u: float, step: Mapping[str, float]):
    """A stiffness that drifts from sequence to sequence."""
    return [], {}, u * (at.sequence / max(len(at.design.program) - 1, 1) - 0.5)


def gradient(at: Moment, u: float, step: Mapping[str, float]):
    """Stiffness that changes steadily along the arm."""
    along = np.linspace(-1, 1, at.design.plates)
    effects = [{"kind": "weakened_plate", "plate": k + 1, "factor": float(np.exp(u * a))} for k, a in enumerate(along)]
    return effects, {}, 0.0


def one_way(at: Moment, u: float, step: Mapping[str, float]):
    """Plates that are stiffer one way than the other."""
    signs = np.sign(at.bends)
    effects = [{"kind": "weakened_plate", "plate": k + 1, "factor": float(np.exp(u * s))} for k, s in enumerate(signs)]
    return effects, {}, 0.0


def yielding(at: Moment, u: float, step: Mapping[str, float]):
    """A plate that stays bent once it has been bent far."""
    curvature = at.design.largest_bend / 0.014
    plate = 1 + at.design.number % at.design.plates
    bent = {"kind": "precurvature", "plates": [plate], "curvature_per_m": u * curvature}
    return [bent] if at.yielded else [], {}, 0.0


def dead_zone(at: Moment, u: float, step: Mapping[str, float]):
    """A cable that a clutch lets go below some tension."""
    name = f"cable_{at.design.cables[at.design.number % len(at.design.cables)]}_n"
    return [], {name: step[name] if step[name] > u * at.design.pull else 0.0}, 0.0


def saturation(at: Moment, u: float, step: Mapping[str, float]):
    """Tensions that fall behind the more, the higher they are."""
    names = [f"cable_{name}_n" for name in at.design.cables]
    return [], {name: step[name] * (1 - u * (step[name] / at.design.pull) ** 2) for name in names}, 0.0


def leak(at: Moment, u: float, step: Mapping[str, float]):
    """Cables that drag their neighbours along."""
    names = [f"cable_{name}_n" for name in at.design.cables]
    total = sum(step[name] for name in names)
    return [], {name: step[name] + u * (total - step[name]) for name in names}, 0.0


def frame_moves(at: Moment, u: float, step: Mapping[str, float]):
    """A camera that is knocked between sequences; see :func:`knocks`."""
    return [], {}, 0.0


LAWS: dict[str, tuple[Change, float]] = {
    "friction_grows": (friction_grows, 1.5),
    "creep": (creep, 0.2),
    "drift": (drift, 0.4),
    "gradient": (gradient, 0.7),
    "one_way": (one_way, 0.4),
    "yielding": (yielding, 0.5),
    "dead_zone": (dead_zone, 0.9),
    "saturation": (saturation, 0.4),
    "leak": (leak, 0.3),
    "frame_moves": (frame_moves, 6.0),
}
"""Each with its largest size."""


def possible(design: Design) -> list[str]:
    """Laws that make sense on a design."""
    without = set() if design.friction > 0 else {"friction_grows"}
    if not {X, ANGLE} & set(design.kinds):
        without |= {"frame_moves"}
    return [] if design.flavour == HISTORY else [name for name in LAWS if name not in without]


def knocks(design: Design, law: str, size: float) -> list[Frame]:
    """Additional frame of every sequence."""
    if law != "frame_moves":
        return [(0.0, 0.0, 0.0)] * len(design.program)
    rotation, shift = design.measurement["frame_rotation_sd_rad"], design.measurement.get("frame_position_sd_m", 0.0)
    way = np.cos(2.3 * np.arange(len(design.program)) + design.number)
    return [(size * rotation * w, size * shift * w, -size * shift * w) for w in way.tolist()]


def followed_foreign(
    design: Design, manipulator: Mapping[str, Any], program: Sequence[Steps], law: str, size: float
) -> list[RigStates] | None:
    """States along the whole program under a law; None where an equilibrium ceases."""
    change, _ = LAWS[law]
    found, yielded = [], False
    watched = design.number % design.plates
    for q, steps in enumerate(program):
        plain = simulate(design.manipulator, steps)
        parts = []
        for k, step in enumerate(steps):
            bends = np.diff(plain.angle[k])
            effects, moved, log_stiffness = change(Moment(design, q, k, bends, yielded), size, step)
            stiffer = manipulator["youngs_modulus_pa"] * float(np.exp(log_stiffness))
            changed = {**manipulator, "youngs_modulus_pa": stiffer, "effect": [*manipulator["effect"], *effects]}
            states = simulate(changed, [{**step, **moved}])
            if not states.converged.all():
                return None
            parts.append(states)
            yielded = yielded or bool(np.abs(bends[watched]) > 0.6 * design.largest_bend)
        found.append(RigStates(*(np.concatenate([getattr(p, f) for p in parts]) for f in RigStates.__annotations__)))
    return found
