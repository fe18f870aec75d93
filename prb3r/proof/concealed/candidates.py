"""Every effect that can be concealed, at every place, as a function of one size that vanishes with the effect.

This is the rig's own list, written from the meaning of the effects; the diagnosis has another.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from prb3r.proof.concealed.designs import Design, X

Place = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class Candidate:
    """One kind of effect at one place, with one shape; its size is free, or it has none."""

    kind: str
    place: Place
    parameters: Callable[[float], Mapping[str, Any]] = field(compare=False)
    """Of a size."""
    low: float = 0.0
    """Sizes that a bench could have; `low = high = 1`: there is no size."""
    high: float = 0.0
    shape: tuple[float, ...] = ()
    """What else was chosen."""

    @property
    def sized(self) -> bool:
        return self.low < self.high

    @property
    def probe(self) -> float:
        """A small size for a derivative, or the whole effect."""
        if not self.sized:
            return 1.0
        return 2e-3 * (self.high if self.high > -self.low else self.low)

    def effect(self, size: float) -> dict[str, Any]:
        """The table of a manipulator file."""
        place = {key: list(value) if isinstance(value, tuple) else value for key, value in self.place}
        return {"kind": self.kind, **place, **self.parameters(size)}


def candidates(design: Design) -> list[list[Candidate]]:
    """All of a design; those of one inner list act together, as the components of a force do."""
    found: list[list[Candidate]] = []
    for family in FAMILIES:
        found += family(design)
    return found


def kinds(design: Design) -> set[str]:
    """Kinds that a design can show."""
    return {group[0].kind for group in candidates(design)}


def _cables(design: Design) -> Iterator[Place]:
    yield ()
    yield from ((("cables", (name,)),) for name in design.cables)


def _pull(design: Design) -> float:
    return max(step[f"cable_{name}_n"] for steps in design.program for step in steps for name in design.cables)


def _arm(design: Design) -> float:
    return max(abs(each["offset_m"]) for each in design.manipulator["cable"])


def _rigidity(design: Design) -> float:
    first = design.manipulator["segment"][0]
    return design.manipulator["youngs_modulus_pa"] * first["width_m"] * first["thickness_m"] ** 3 / 12


def _arc(design: Design) -> float:
    first = design.manipulator["segment"][0]
    return first["length_m"] - 2 * first["clamp_m"]


def _friction(design: Design) -> Iterator[list[Candidate]]:
    mu = design.friction
    declared = design.manipulator["friction"].get("direction", "declared") == "declared"
    if mu == 0:
        yield [Candidate("cable_friction", (), lambda u: {"coefficient": u}, 0, 0.6)]
    for disk in range(design.plates):
        for place in _cables(design):
            reach = design.plates
            if place:
                last = design.manipulator["cable"][design.cables.index(place[0][1][0])]["ends_at_segment"]
                reach = sum(each["plates"] for each in design.manipulator["segment"][:last])
            if disk < reach:
                yield [Candidate("worn_hole", (("disk", disk), *place), lambda u: {"coefficient": mu + u}, -mu, 2.0)]
    if mu > 0 and declared:
        yield [Candidate("edge_wrap", (), lambda u: {}, 1, 1)]
        for slip in (4e-5, 2e-4):
            yield [slipping(slip)]


def _tension(design: Design) -> Iterator[list[Candidate]]:
    pull, arm = _pull(design), _arm(design)
    for place in _cables(design):
        yield [Candidate("pulley_friction", place, lambda u: {"efficiency": float(np.exp(-u))}, 0, 0.6)]
        for low, high in ((0.0, 0.3), (-0.3, 0.0)):  # of an idle cable nothing can be taken away
            yield [Candidate("tension_offset", place, lambda u: {"offset_n": u * pull}, low, high)]
    for name in design.cables:
        yield [Candidate("dead_cable", (("cable", name),), lambda u: {}, 1, 1)]
        yield [Candidate("hole_offset", (("cable", name),), lambda u: {"offset_m": u * arm}, -0.3, 0.3)]
    yield [Candidate("hole_clearance", (), lambda u: {"clearance_m": u * arm}, 0, 0.25)]


def _plates(design: Design) -> Iterator[list[Candidate]]:
    segments = design.manipulator["segment"]
    ends = np.cumsum([each["plates"] for each in segments]).tolist()
    curvature, arc, rigidity = design.largest_bend / _arc(design), _arc(design), _rigidity(design)
    factor = lambda u: {"factor": float(np.exp(u))}  # noqa: E731
    bent = lambda u: {"curvature_per_m": u * curvature}  # noqa: E731
    for plate in range(1, design.plates + 1):
        yield [Candidate("weakened_plate", (("plate", plate),), factor, -1.4, 1.1)]
        yield [Candidate("precurvature", (("plates", (plate,)),), bent, -0.6, 0.6)]
    yield [Candidate("precurvature", (), bent, -0.6, 0.6)]
    for number, end in enumerate(ends, 1):
        if len(ends) > 1:
            own = tuple(range(end - segments[number - 1]["plates"] + 1, end + 1))
            yield [Candidate("segment_stiffness", (("segment", number),), factor, -1.0, 1.0)]
            yield [Candidate("precurvature", (("plates", own),), bent, -0.6, 0.6)]
    cubic = lambda u: {"cubic_m2": u / curvature**2}  # noqa: E731
    yield [Candidate("nonlinear_plate", (("law", "cubic"),), cubic, 0, 3.0)]
    for share in (0.2, 0.35, 0.5, 0.65, 0.8):
        yield [knee(curvature, share)]
        yield [contact(share * design.largest_bend, rigidity / arc)]
    yield [Candidate("clamp_compliance", (), lambda u: {"compliance_rad_per_n_m": u * arc / rigidity}, 0, 1.0)]
    yield [Candidate("cable_bending", (), lambda u: {"stiffness_n_m2": u * rigidity}, 0, 0.6)]


def knee(curvature: float, share: float) -> Candidate:
    """Bilinear plates with a knee at a share of a curvature; the size is ln(ratio)."""
    law = lambda u: {"knee_per_m": share * curvature, "ratio": float(np.exp(u))}  # noqa: E731
    return Candidate("nonlinear_plate", (("law", "bilinear"),), law, -1.2, 1.5, (share * curvature,))


def contact(angle: float, stiffness: float) -> Candidate:
    """Disks that touch at an angle (rad); the size is in units of the plates' own stiffness."""
    law = lambda u: {"angle_rad": angle, "stiffness_n_m_per_rad": u * stiffness}  # noqa: E731
    return Candidate("disk_contact", (), law, 0, 30.0, (angle,))


def slipping(presliding: float) -> Candidate:
    """Friction along the load path, with a presliding distance (m)."""
    return Candidate("slip_history", (), lambda u: {"presliding_m": presliding}, 1, 1, (presliding,))


def _loads(design: Design) -> Iterator[list[Candidate]]:
    size = _pull(design) * _arm(design) / design.length
    yield [force(design, "gravity", angle, 12.0) for angle in (0.0, np.pi / 2)]
    yield [force(design, "tip_force", angle, size) for angle in (0.0, np.pi / 2)]
    if any(step.get("tip_y_n", 0.0) for steps in design.program for step in steps):
        yield [Candidate("tip_load_friction", (), lambda u: {"efficiency": float(np.exp(-u))}, 0, 1.2)]


def force(design: Design, kind: str, angle: float, size: float) -> Candidate:
    """Gravity or a tip force in one direction."""
    x, y = ("x_m_s2", "y_m_s2") if kind == "gravity" else ("x_n", "y_n")
    cos, sin = float(np.cos(angle)), float(np.sin(angle))
    return Candidate(kind, (), lambda u: {x: u * size * cos, y: u * size * sin}, 0, 1.0, (angle,))


def _camera(design: Design) -> Iterator[list[Candidate]]:
    if X in design.kinds:
        yield [Candidate("camera_scale", (), lambda u: {"scale": float(np.exp(u))}, -0.15, 0.15)]
        yield [Candidate("lens_distortion", (), lambda u: {"k1_per_m2": u / design.length**2}, -0.6, 0.6)]


FAMILIES = (_friction, _tension, _plates, _loads, _camera)


def shaped(design: Design, candidate: Candidate, rng: np.random.Generator) -> Candidate:
    """The candidate with its shape drawn anew, where it has one."""
    if candidate.kind in ("gravity", "tip_force"):
        size = 12.0 if candidate.kind == "gravity" else _pull(design) * _arm(design) / design.length
        return force(design, candidate.kind, rng.uniform(0, 2 * np.pi), size)
    if candidate.kind == "disk_contact":
        return contact(rng.uniform(0.25, 0.7) * design.largest_bend, _rigidity(design) / _arc(design))
    if candidate.place == (("law", "bilinear"),):
        return knee(design.largest_bend / _arc(design), rng.uniform(0.25, 0.7))
    if candidate.kind == "slip_history":
        return slipping(10 ** rng.uniform(-4.5, -3.7))
    return candidate


def twins(design: Design, candidate: Candidate, size: float) -> list[Candidate]:
    """Candidates of another kind that are the same law, or nearly so."""
    if candidate.kind == "disk_contact":
        return [knee(candidate.shape[0] / _arc(design), 1.0)]
    if candidate.place == (("law", "bilinear"),) and size > 0:
        return [contact(candidate.shape[0] * _arc(design), _rigidity(design) / _arc(design))]
    return []
