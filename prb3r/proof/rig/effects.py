"""What each effect does to the draft of a rig, and which parameters it takes.

Where a meaning leaves room, the rig takes it as follows.

- Bending stiffness of a plate: nominal, times every `weakened_plate` and `segment_stiffness`, plus `cable_bending` for
  each live cable that crosses it.  `nonlinear_plate` acts on this sum, k being curvature less stress-free curvature.
- `disk_contact` compares the bend between the disks, hinges of `clamp_compliance` included; its moment passes beside
  plate and hinges.  A hinge turns by compliance times the moment that the plate carries there.
- `hole_clearance` shifts both ends of a span toward the concave side, +y of the plate's frame where the bend is
  positive; angles and lengths are those of the shifted spans; what happens inside a disk is free of friction.
- `pulley_friction` is one more factor at the base hole and shares its slip state.
- `cable_friction` replaces the nominal coefficient of every hole, `worn_hole` what then stands at one disk.
- `empirical_moment` acts on arc and hinges alike, as a couple from disk to disk beside the plate would; the rig knows
  its terms in `constant`, `position` and `bend`.
- `gravity` pulls at the centres of disks 1..n; `tip_load_friction` spares the constant `tip_force`.
- Effects act in the order of `EFFECTS`, whatever their order in the file.  Repeated factors multiply; repeated forces,
  compliances, offsets and curvatures add; a second law, contact, clearance or friction of the whole rig is refused.
"""

from collections.abc import Callable, Sequence
from numbers import Integral, Real
from types import SimpleNamespace
from typing import Any

import numpy as np

from prb3r.proof.rig.kernels import BILINEAR, CUBIC


def _number(low: float = -np.inf, high: float = np.inf, open_low: bool = False) -> Callable[[Any, Any], str]:
    def complaint(value, _):
        good = isinstance(value, Real) and not isinstance(value, bool) and np.isfinite(float(value))
        if good and low <= value <= high and not (open_low and value == low):
            return ""
        return f"must be a number {'above' if open_low else 'from'} {low:g} to {high:g}, not {value!r}"

    return complaint


def _one_of(options: str) -> Callable[[Any, Any], str]:
    def complaint(value, draft):
        valid = getattr(draft, options)
        if isinstance(value, str | Integral) and not isinstance(value, bool) and value in valid:
            return ""
        return f"{value!r} is not one of {', '.join(map(str, valid))}"

    return complaint


def _several(options: str) -> Callable[[Any, Any], str]:
    def complaint(value, draft):
        if not isinstance(value, Sequence) or isinstance(value, str) or not value:
            return f"must be a list, not {value!r}"
        return "; ".join(filter(None, (_one_of(options)(each, draft) for each in value)))

    return complaint


def _terms(value: Any, draft: Any) -> str:
    if not isinstance(value, Sequence) or isinstance(value, str) or not value:
        return f"must be a list of terms, not {value!r}"
    known = [isinstance(term, dict) and term.get("of") in ("constant", "position", "bend") for term in value]
    return "" if all(known) else "the rig has terms of constant, position and bend only"


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


def empirical_moment(d, terms):
    numbers = np.array(d.plates)
    for term in terms:
        acting = term["coefficient"] * np.isin(numbers, term.get("plates", numbers))
        if term["of"] == "bend":
            d.moment_per_bend += acting
        elif term["of"] == "position":
            d.moment += acting * (2 * (numbers - 1) / max(len(numbers) - 1, 1) - (len(numbers) > 1))
        else:
            d.moment += acting


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
    empirical_moment: {"terms": _terms},
    gravity: {"x_m_s2": _ANY, "y_m_s2": _ANY},
    tip_force: {"x_n": _ANY, "y_n": _ANY},
    tip_load_friction: {"efficiency": _SHARE},
    camera_scale: {"scale": _POSITIVE},
    lens_distortion: {"k1_per_m2": _ANY},
}
"""What each effect does to a draft, and what is wrong with each of its parameters (nothing: an empty string)."""
OPTIONAL = {"cables", "plates", "cubic_m2", "knee_per_m", "ratio"}
ONCE = {cable_friction, slip_history, edge_wrap, hole_clearance, nonlinear_plate, disk_contact}
