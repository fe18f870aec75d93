"""Turns the contents of a manipulator file into the rig's arrays, with every effect built in."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.proof.rig.arrays import Rig
from prb3r.proof.rig.draft import Draft, nominal_draft
from prb3r.proof.rig.effects import RECORDS

STANDARD_GRAVITY = 9.80665
"""m/s^2, exact by convention (CGPM 1901): turns kilograms into newtons where a file gives no gravity."""


@dataclass(frozen=True)
class BuiltRig:
    """A rig of `n` plates and `m` cables with all that effects change of its loads and of its camera."""

    rig: Rig
    cables: tuple[str, ...]
    """Names, in the order of all arrays."""
    gravity: float
    """Turns `*_kg` loads into newtons, m/s^2."""
    hanger: np.ndarray
    """(m,) added to tensions that are noted, N."""
    tension_offset: np.ndarray
    """(m,) added to applied tensions, N."""
    tension_play: np.ndarray
    """(m,) half-width of the backlash by which the pulling tension lags behind the applied one, N."""
    tension_drift: np.ndarray
    """(m,) added to applied tensions for every step taken before, N."""
    softening: float
    """Share of their first stiffness that the plates lose with every step."""
    relaxation: float
    """Share of the moment by the plates' law that relaxes in the long run."""
    relaxation_time: float
    """Time constant of that, in steps."""
    relaxation_step: float
    """What such a step lasts where steps have times, s; 0: the mean time per step."""
    friction_rate: float
    """Relative growth of friction when tensions change e times as fast."""
    friction_reference: float
    """Rate of change of a tension at which the rig's coefficients hold, N/s."""
    friction_excess: float
    """Relative excess of friction where a cable just begins to slide."""
    friction_decay: float
    """Change of tension over which `friction_excess` falls to 1/e, N."""
    friction_growth: float
    """Share of its first value that friction gains with every step."""
    gain: np.ndarray
    """(m,) ratio of true to noted tension, in the limit of small tensions."""
    gain_per_n: np.ndarray
    """(m,) relative growth of `gain` per noted tension, 1/N."""
    disk_force: np.ndarray
    """(n, 2) constant forces at the centres of the disks, N."""
    tip_force: np.ndarray
    """(2,) constant force at the centre of the last disk's distal face, N."""
    tilt: float
    """Rotation of the base against the frame of all dead loads, rad, anticlockwise."""
    tip_efficiency: float
    """Share of the applied tip load that arrives."""
    disk_efficiency: np.ndarray
    """(n, 1) share of the applied load on each disk that arrives."""
    aspect: float
    """Ratio of measured to true lengths along y, over that along x."""
    scale: float
    """Scale of the camera: measured over true."""
    lens: float
    """Distortion k1 of the camera's lens, 1/m^2."""
    camera_shift: np.ndarray
    """(2,) shift of what the camera reads, m for every step taken before."""
    camera_turn: float
    """Rotation of it about the origin, rad for every step taken before."""


def build_rig(manipulator: Mapping[str, Any]) -> BuiltRig:
    """The rig that the contents of a manipulator file describe.

    Raises
    ------
    SpecError
        Effects that are unknown, doubled, incomplete, outside their bounds or not possible beside another one.
    """
    draft, effects = nominal_draft(manipulator), manipulator.get("effect", [])
    problems = [Problem(f"effect[{k}]", text) for k, effect in enumerate(effects) for text in _problems(effect, draft)]
    kinds = [effect.get("kind") for effect in effects]
    doubled = [record.kind for record in RECORDS.values() if record.once and kinds.count(record.kind) > 1]
    problems += [Problem("effect", f"{kind} acts once") for kind in doubled]
    apart = [(record.kind, other) for record in RECORDS.values() for other in record.excludes if record.kind in kinds]
    problems += [Problem("effect", f"the rig has no {a} beside {b}") for a, b in apart if b in kinds]
    if problems:
        raise SpecError(*problems)
    for record in RECORDS.values():
        for k, effect in enumerate(effects):
            if effect["kind"] == record.kind:
                try:
                    record.act(draft, **{name: value for name, value in effect.items() if name != "kind"})
                except ValueError as error:
                    problems.append(Problem(f"effect[{k}]", str(error)))
    if problems:
        raise SpecError(*problems)
    return BuiltRig(
        rig=_arrays(draft),
        cables=draft.cables,
        gravity=float(manipulator.get("gravity_m_s2", STANDARD_GRAVITY)),
        hanger=draft.hanger,
        tension_offset=draft.tension_offset,
        tension_play=draft.tension_play,
        tension_drift=draft.tension_drift,
        softening=float(draft.softening),
        relaxation=float(draft.relaxation),
        relaxation_time=float(draft.relaxation_time),
        relaxation_step=float(draft.relaxation_step),
        friction_rate=float(draft.friction_rate),
        friction_reference=float(draft.friction_reference),
        friction_excess=float(draft.friction_excess),
        friction_decay=float(draft.friction_decay),
        friction_growth=float(draft.friction_growth),
        gain=draft.gain,
        gain_per_n=draft.gain_per_n,
        disk_force=draft.disk_force,
        tip_force=draft.tip_force,
        tilt=float(draft.tilt),
        tip_efficiency=draft.tip_efficiency,
        disk_efficiency=draft.disk_efficiency,
        aspect=draft.aspect,
        scale=draft.scale,
        lens=draft.lens,
        camera_shift=draft.camera_shift,
        camera_turn=draft.camera_turn,
    )


def _problems(effect: Mapping[str, Any], draft: Draft) -> list[str]:
    """Messages on what is wrong with one effect of a manipulator file; empty if nothing is."""
    if effect.get("kind") not in RECORDS:
        return [f"unknown kind {effect.get('kind')!r}" + did_you_mean(str(effect.get("kind")), RECORDS)]
    record, given = RECORDS[effect["kind"]], set(effect) - {"kind"}
    known = record.parameters
    wrong = [f"unknown {name}" + did_you_mean(name, known) for name in sorted(given - set(known))]
    wrong += [f"{name} is missing" for name in known if name not in given | record.optional]
    complaints = {p.name: p.check(effect[p.name], draft) for p in record.taken if p.name in given}
    return wrong + [f"{name}: {complaint}" for name, complaint in complaints.items() if complaint]


def _arrays(draft: Draft) -> Rig:
    """The arrays of the rig that a draft describes, for compiled code.

    Numbers become floats and bending laws get a row for each plate, so that all rigs are of one type and kernels are
    compiled once.
    """
    plates = len(draft.arc)
    first = np.array(np.broadcast_to(draft.law_first, (plates, 2)), float, order="C")
    table = np.array(np.broadcast_to(draft.law_table, (plates, *draft.law_table.shape[1:])), float, order="C")
    return Rig(
        arc=draft.arc,
        clamp=draft.clamp,
        disk=draft.disk,
        rigidity=draft.rigidity,
        wires=draft.wires,
        rest=draft.rest,
        law=draft.law,
        law_first=first,
        law_second=float(draft.law_second),
        law_third=float(draft.law_third),
        law_table=table,
        loop_share=float(draft.loop_share),
        loop_yield=np.array(np.broadcast_to(draft.loop_yield, plates), float),
        loop_springs=int(draft.loop_springs),
        flag_reverse=float(draft.flag_reverse),
        compliance=float(draft.compliance),
        base_compliance=float(draft.base_compliance),
        umbilical=float(draft.umbilical),
        contact_angle=draft.contact_angle,
        contact_stiffness=draft.contact_stiffness,
        offset=draft.offset,
        clearance=float(draft.clearance),
        reach=np.asarray(draft.reach, np.int64),  # also without cables: floats would make kernels compile anew
        friction=draft.friction,
        friction_exponent=float(draft.friction_exponent),
        friction_tension=float(draft.friction_tension),
        hole_drag=float(draft.hole_drag),
        drags=np.ones(len(draft.reach)),
        wrap_saturation=float(draft.wrap_saturation),
        pulley=draft.pulley,
        edges=draft.edges,
        presliding=float(draft.presliding if draft.cables else np.inf),
        moment=draft.moment,
        moment_per_bend=draft.moment_per_bend,
    )
