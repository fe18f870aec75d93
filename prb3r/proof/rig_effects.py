"""From the dictionary of a manipulator file to the rig's arrays, with every effect built in.

Where a meaning leaves room, the rig takes it as follows.

- Bending stiffness of a plate: nominal, times every `weakened_plate` and `segment_stiffness`, plus `cable_bending` per live
  cable that crosses it.  `nonlinear_plate` acts on this sum, in the elastic curvature k = (curvature - stress-free one).
- `disk_contact` compares the bend between the disks, hinges of `clamp_compliance` included; its moment passes beside the plate
  and beside these hinges.  A hinge turns by compliance times the moment that plate carries there.
- `hole_clearance` shifts both ends of a span toward the concave side, +y of the plate's frame where the bend is positive;
  turning angles and lengths are those of the shifted spans, and what happens inside a disk is free of friction.
- `pulley_friction` is one more factor at the base hole and shares its slip state.
- `cable_friction` replaces the nominal coefficient of every hole, `worn_hole` what then stands at one disk.
- `gravity` pulls at the centres of disks 1..n; `tip_load_friction` spares the constant `tip_force`.
- Effects act in the order of `EFFECTS`, whatever their order in the file.  Repeated factors multiply, repeated forces,
  compliances, offsets and curvatures add; a second law, contact, clearance or friction of the whole rig is refused.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.rig_kernels import BILINEAR, CUBIC, LINEAR, Rig


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


def _number(low: float = -np.inf, high: float = np.inf, open_low: bool = False) -> Callable[[Any, Any], str]:
    def complaint(value, _):
        good = isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value)
        if good and low <= value <= high and not (open_low and value == low):
            return ""
        return f"must be a number {'above' if open_low else 'from'} {low:g} to {high:g}, not {value!r}"

    return complaint


def _one_of(options: str) -> Callable[[Any, Any], str]:
    def complaint(value, draft):
        valid = getattr(draft, options)
        same_type = any(type(value) is type(option) and value == option for option in valid)
        return "" if same_type else f"{value!r} is not one of {', '.join(map(str, valid))}"

    return complaint


def _several(options: str) -> Callable[[Any, Any], str]:
    def complaint(value, draft):
        if not isinstance(value, Sequence) or isinstance(value, str) or not value:
            return f"must be a list, not {value!r}"
        return "; ".join(filter(None, (_one_of(options)(each, draft) for each in value)))

    return complaint


def _which(d: SimpleNamespace, names: Sequence[str] | None) -> list[int]:
    return [j for j, name in enumerate(d.cables) if names is None or name in names]


def cable_friction(d, coefficient):
    d.friction[:] = coefficient


def slip_history(d, presliding_m):
    d.presliding = presliding_m


def edge_wrap(d):
    d.edges = True


def worn_hole(d, disk, coefficient, cables=None):
    d.friction[disk, _which(d, cables)] = coefficient


def pulley_friction(d, efficiency, cables=None):
    d.pulley[_which(d, cables)] -= np.log(efficiency)


def dead_cable(d, cable):
    d.reach[d.cables.index(cable)] = 0


def tension_offset(d, offset_n, cables=None):
    d.tension_offset[_which(d, cables)] += offset_n


def hole_offset(d, cable, offset_m):
    d.offset[:, d.cables.index(cable)] += offset_m


def hole_clearance(d, clearance_m):
    d.clearance = clearance_m


def weakened_plate(d, plate, factor):
    d.rigidity[plate - 1] *= factor


def segment_stiffness(d, segment, factor):
    d.rigidity[d.segment_of == segment] *= factor


def cable_bending(d, stiffness_n_m2):
    d.rigidity += stiffness_n_m2 * (np.arange(len(d.rigidity))[:, None] < d.reach).sum(1)


def nonlinear_plate(d, law, cubic_m2=None, knee_per_m=None, ratio=None):
    cubic, bilinear = cubic_m2 is not None, knee_per_m is not None and ratio is not None
    if law == "cubic" and cubic and knee_per_m is None and ratio is None:
        d.law = (CUBIC, cubic_m2, 1.0)
    elif law == "bilinear" and bilinear and not cubic:
        d.law = (BILINEAR, knee_per_m, ratio)
    else:
        raise ValueError("law 'cubic' takes cubic_m2, law 'bilinear' takes knee_per_m and ratio")


def precurvature(d, curvature_per_m, plates=None):
    d.rest[slice(None) if plates is None else np.unique(plates) - 1] += curvature_per_m


def disk_contact(d, angle_rad, stiffness_n_m_per_rad):
    d.contact = (angle_rad, stiffness_n_m_per_rad)


def clamp_compliance(d, compliance_rad_per_n_m):
    d.compliance += compliance_rad_per_n_m


def gravity(d, x_m_s2, y_m_s2):
    if d.mass is None:
        raise ValueError("needs mass_kg in [disk]")
    d.disk_force += d.mass * np.array([x_m_s2, y_m_s2])


def tip_force(d, x_n, y_n):
    d.tip_force += [x_n, y_n]


def tip_load_friction(d, efficiency):
    d.tip_efficiency *= efficiency


def camera_scale(d, scale):
    d.scale *= scale


def lens_distortion(d, k1_per_m2):
    d.lens += k1_per_m2


_ANY, _POSITIVE, _FROM_ZERO, _SHARE = _number(), _number(0, open_low=True), _number(0), _number(0, 1, open_low=True)
_LAW = _one_of("laws")
EFFECTS: dict[Callable, dict[str, Callable[[Any, Any], str]]] = {
    cable_friction: {"coefficient": _FROM_ZERO},
    slip_history: {"presliding_m": _POSITIVE},
    edge_wrap: {},
    worn_hole: {"disk": _one_of("disks"), "coefficient": _FROM_ZERO, "cables": _several("cables")},
    pulley_friction: {"efficiency": _SHARE, "cables": _several("cables")},
    dead_cable: {"cable": _one_of("cables")},
    tension_offset: {"offset_n": _ANY, "cables": _several("cables")},
    hole_offset: {"cable": _one_of("cables"), "offset_m": _ANY},
    hole_clearance: {"clearance_m": _FROM_ZERO},
    weakened_plate: {"plate": _one_of("plates"), "factor": _POSITIVE},
    segment_stiffness: {"segment": _one_of("segments"), "factor": _POSITIVE},
    cable_bending: {"stiffness_n_m2": _FROM_ZERO},
    nonlinear_plate: {"law": _LAW, "cubic_m2": _ANY, "knee_per_m": _POSITIVE, "ratio": _POSITIVE},
    precurvature: {"curvature_per_m": _ANY, "plates": _several("plates")},
    disk_contact: {"angle_rad": _FROM_ZERO, "stiffness_n_m_per_rad": _FROM_ZERO},
    clamp_compliance: {"compliance_rad_per_n_m": _FROM_ZERO},
    gravity: {"x_m_s2": _ANY, "y_m_s2": _ANY},
    tip_force: {"x_n": _ANY, "y_n": _ANY},
    tip_load_friction: {"efficiency": _SHARE},
    camera_scale: {"scale": _POSITIVE},
    lens_distortion: {"k1_per_m2": _ANY},
}
"""What each effect does to a draft, and what is wrong with each of its parameters (nothing: an empty string)."""
_OPTIONAL = {"cables", "plates", "cubic_m2", "knee_per_m", "ratio"}
_ONCE = {cable_friction, slip_history, edge_wrap, hole_clearance, nonlinear_plate, disk_contact}


def _problems(effect: Mapping[str, Any], kinds: Mapping[str, Callable], draft: SimpleNamespace) -> list[str]:
    """What is wrong with one effect as written."""
    if effect.get("kind") not in kinds:
        return [f"unknown kind {effect.get('kind')!r}" + did_you_mean(str(effect.get("kind")), kinds)]
    checks, given = EFFECTS[kinds[effect["kind"]]], set(effect) - {"kind"}
    wrong = [f"unknown {name}" + did_you_mean(name, checks) for name in sorted(given - set(checks))]
    wrong += [f"{name} is missing" for name in checks if name not in given | _OPTIONAL]
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
    problems += [Problem("effect", f"{f.__name__} acts once") for f in _ONCE if seen.count(f.__name__) > 1]
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
    law, contact = (d.law[0], float(d.law[1]), float(d.law[2])), tuple(map(float, d.contact))
    rig = Rig(
        *(d.arc, d.clamp, d.disk, d.rigidity, d.rest, *law, d.compliance + 0.0, *contact, d.offset),
        *(float(d.clearance), d.reach, d.friction, d.pulley, d.edges, float(d.presliding)),
    )
    fixed = d.tension_offset, d.disk_force, d.tip_force, d.tip_efficiency, d.scale, d.lens
    return Bench(rig, d.cables, float(manipulator.get("gravity_m_s2", 9.80665)), *fixed)
