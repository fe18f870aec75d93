"""From the dictionary of a manipulator file to the rig's arrays, with every effect built in."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.rig.effects import EFFECTS, ONCE, OPTIONAL
from prb3r.proof.rig.kernels import LINEAR, Rig


@dataclass(frozen=True)
class Bench:
    """A rig and all that acts on it whatever is recorded: (m,) cables, (n, 2) and (2,) forces in N."""

    rig: Rig
    cables: tuple[str, ...]
    gravity: float
    """Turns `*_kg` loads into newtons, m/s^2."""
    tension_offset: np.ndarray
    disk_force: np.ndarray
    tip_force: np.ndarray
    tip_efficiency: float
    scale: float
    lens: float
    """Camera: scale and k1, 1/m^2."""


def _problems(effect: Mapping[str, Any], kinds: Mapping[str, Callable], draft: SimpleNamespace) -> list[str]:
    """What is wrong with one effect as written."""
    if effect.get("kind") not in kinds:
        return [f"unknown kind {effect.get('kind')!r}" + did_you_mean(str(effect.get("kind")), kinds)]
    checks, given = EFFECTS[kinds[effect["kind"]]], set(effect) - {"kind"}
    wrong = [f"unknown {name}" + did_you_mean(name, checks) for name in sorted(given - set(checks))]
    wrong += [f"{name} is missing" for name in checks if name not in given | OPTIONAL]
    complaints = {name: checks[name](effect[name], draft) for name in checks if name in given}
    return wrong + [f"{name}: {complaint}" for name, complaint in complaints.items() if complaint]


def _nominal(manipulator: Mapping[str, Any]) -> SimpleNamespace:
    """The manipulator before any effect, every array at full length."""
    segments, cables = manipulator["segment"], manipulator.get("cable", [])
    friction, disk = manipulator.get("friction", {}), manipulator.get("disk", {})
    number = np.repeat(np.arange(1, len(segments) + 1), [each["plates"] for each in segments])
    n, m = len(number), len(cables)

    def rigidity(segment):
        if "bending_stiffness_n_m2" in segment:
            return float(segment["bending_stiffness_n_m2"])
        return manipulator["youngs_modulus_pa"] * segment["width_m"] * segment["thickness_m"] ** 3 / 12

    def offset(cable, plate):
        value, last = cable["offset_m"], cable["ends_at_segment"]
        return value[min(number[plate], last) - 1] if isinstance(value, Sequence) else value

    per_segment = {"clamp": np.array([float(each.get("clamp_m", 0)) for each in segments])[number - 1]}
    per_segment["arc"] = np.array([float(each["length_m"]) for each in segments])[number - 1] - 2 * per_segment["clamp"]
    names = tuple(str(cable["name"]) for cable in cables)
    history = friction.get("direction", "declared") == "history"
    return SimpleNamespace(
        **per_segment,
        disk=float(disk.get("thickness_m", 0)),
        mass=disk.get("mass_kg"),
        rigidity=np.array([rigidity(each) for each in segments])[number - 1],
        rest=np.zeros(n),
        law=(LINEAR, 0.0, 1.0),
        compliance=0.0,
        contact=(np.inf, 0.0),
        offset=np.array([[float(offset(each, i)) for each in cables] for i in range(n)]).reshape(n, m),
        clearance=0.0,
        reach=np.array([(number <= each["ends_at_segment"]).sum() for each in cables], int),
        friction=np.full((n, m), float(friction.get("coefficient", 0))),
        pulley=np.zeros(m),
        edges=friction.get("wrap", "net") == "edges",
        presliding=friction["presliding_m"] if history else np.inf,
        cables=names,
        plates=range(1, n + 1),
        disks=range(n),
        segments=range(1, len(segments) + 1),
        laws=("cubic", "bilinear"),
        segment_of=number,
        moment=np.zeros(n),
        moment_per_bend=np.zeros(n),
        tension_offset=np.zeros(m),
        disk_force=np.zeros((n, 2)),
        tip_force=np.zeros(2),
        tip_efficiency=1.0,
        scale=1.0,
        lens=0.0,
    )


def bench(manipulator: Mapping[str, Any]) -> Bench:
    """Build the rig of a manipulator description.

    Raises
    ------
    SpecError
        Every effect that is unknown, doubled, incomplete or outside its bounds.
    """
    d, effects = _nominal(manipulator), manipulator.get("effect", [])
    kinds = {function.__name__: function for function in EFFECTS}
    problems = [Problem(f"effect[{k}]", text) for k, each in enumerate(effects) for text in _problems(each, kinds, d)]
    seen = [each.get("kind") for each in effects]
    problems += [Problem("effect", f"{f.__name__} acts once") for f in ONCE if seen.count(f.__name__) > 1]
    if problems:
        raise SpecError(*problems)
    for function in EFFECTS:
        for k, each in enumerate(effects):
            if each["kind"] == function.__name__:
                try:
                    function(d, **{name: value for name, value in each.items() if name != "kind"})
                except ValueError as error:
                    problems.append(Problem(f"effect[{k}]", str(error)))
    if problems:
        raise SpecError(*problems)
    law, first, second = d.law
    angle, stiffness = map(float, d.contact)
    hinge, clearance = float(d.compliance), float(d.clearance)
    presliding = float(d.presliding if d.cables else np.inf)
    plate = d.arc, d.clamp, d.disk, d.rigidity, d.rest, law, float(first), float(second), hinge, angle, stiffness
    law_of_moment = d.moment, d.moment_per_bend
    rig = Rig(*plate, d.offset, clearance, d.reach, d.friction, d.pulley, d.edges, presliding, *law_of_moment)
    fixed = d.tension_offset, d.disk_force, d.tip_force, d.tip_efficiency, d.scale, d.lens
    return Bench(rig, d.cables, float(manipulator.get("gravity_m_s2", 9.80665)), *fixed)
