"""Draws labels of real rigs: effects of sizes that rigs show, imperfections, blunders, and targets of prediction."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from prb3r.proof.concealed.apart import squared_distances
from prb3r.proof.concealed.blunders import drawn_blunder
from prb3r.proof.concealed.build import Build, applied_tensions, drawn_build, rig_as_built
from prb3r.proof.concealed.camera import truth
from prb3r.proof.concealed.candidates import candidates, shaped
from prb3r.proof.concealed.design import Design, Flavour, followed, largest_bend
from prb3r.proof.concealed.elsewhere import OTHER_LOADS, drawn_targets
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.concealed.sizing import draw_effect
from prb3r.proof.concealed.worth import worths
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.rig.effects.candidate import Candidate
from prb3r.proof.settings import SETTINGS
from prb3r.proof.settings.real import TYPICAL

REAL_CLASSES = ("several", "imperfect-single", "imperfect-clean", "blunder", "rare")
"""Classes of the population whose rigs have imperfections, in the order of the names below."""
_SEVERAL, _SINGLE, _CLEAN, _BLUNDER, _RARE = REAL_CLASSES
"""Several effects; one; none; a blunder of the set-up, with several effects or none; one rare effect beside others."""
OF_NITINOL = "superelastic_plate"
"""The rare effect of a rig with nitinol plates."""
FLAGS = "flag_hysteresis"
"""What its plates may have as well: they give back less than they took."""
STOPS = frozenset({"disk_contact"})
"""Kinds that keep plates from bending to their plateau, so that a superelastic law would not show."""


class Planted(NamedTuple):
    """A concealed effect, as a table of a manipulator file, and its size in the unit of its candidate."""

    effect: Mapping[str, Any]
    size: float


def real_label(request: Request, design: Design) -> Label:
    """The label of a request for a real rig.

    Raises
    ------
    RuntimeError
        If no rig was met that has an equilibrium at every step, nor one without the plateau of nitinol.
    """
    rng = np.random.default_rng([request.seed, 3, request.case])
    for attempt in range(2 * SETTINGS.real.tries):
        kind = request.kind if request.cls != _SINGLE or attempt < SETTINGS.real.tries_of_kind else ""
        planted = _planted(rng, replace(request, kind=kind), design, plateau=attempt < SETTINGS.real.tries)
        label = _held(rng, request, design, planted, attempt)
        if label is not None:
            blunder = drawn_blunder(rng, design) if request.cls == _BLUNDER else None
            return replace(label, blunder=blunder)
    raise RuntimeError(f"case {request.case}: no rig with equilibria was found")


def _planted(rng: np.random.Generator, request: Request, design: Design, plateau: bool) -> list[Planted]:
    """Random effects for a request; none for clean rigs and for blunders that are to stand alone.  `plateau`: as of
    :func:`rare_among_others`."""
    if request.cls == _SINGLE:
        drawn = None
        responses = Responses(design)
        while drawn is None:
            multiple = SETTINGS.real.single_multiple
            drawn = draw_effect(responses, request.kind, multiple, rng) or draw_effect(responses, "", multiple, rng)
        return [Planted(drawn.effect, drawn.size)]
    if request.cls == _CLEAN or (request.cls == _BLUNDER and request.kind != "several"):
        return []
    if request.cls == _RARE:
        return rare_among_others(rng, design, plateau)
    return several_effects(rng, design)


def rare_among_others(rng: np.random.Generator, design: Design, plateau: bool = True) -> list[Planted]:
    """One rare effect, the first, beside one or two others of sizes that rigs show.

    On plates of nitinol it is their `plateau`, unless that is not wanted, as under loads that no plateau can bear.
    """
    of_kind = _by_kind(design, rare=True)
    if not plateau:
        of_kind.pop(OF_NITINOL, None)
    kind = OF_NITINOL if design.flavour == Flavour.REAL_NITINOL and OF_NITINOL in of_kind else rng.choice(list(of_kind))
    rare = _sized(rng, design, of_kind[kind], whole=False)
    others = several_effects(rng, design, SETTINGS.real.beside_rare)
    barred = RECORDS[kind].excludes | (STOPS if kind == OF_NITINOL else frozenset())
    others = [planted for planted in others if planted.effect["kind"] not in barred]
    if kind == OF_NITINOL and rng.random() < SETTINGS.real.flags_share:
        ratio = float(rng.uniform(*SETTINGS.real.flags))
        others.append(Planted({"kind": FLAGS, "reverse_ratio": ratio}, float(np.log(ratio))))
    return [rare, *others]


def _by_kind(design: Design, rare: bool = False) -> dict[str, list[Candidate]]:
    """Candidates of a design by kind, with one to represent each group that acts together."""
    of_kind: dict[str, list[Candidate]] = {}
    for group in candidates(design, rare):
        of_kind.setdefault(group[0].kind, []).append(group[0])
    return of_kind


def several_effects(
    rng: np.random.Generator, design: Design, numbers: tuple[int, int] = SETTINGS.real.effects
) -> list[Planted]:
    """Effects of different kinds, at random places, of sizes that rigs show.

    Parameters
    ----------
    numbers : fewest and most of them.
    """
    fewest, most = numbers
    count = int(rng.integers(fewest, most + 1))
    of_kind = _by_kind(design)
    asked = {Flavour.REAL_BARE: ["cable_friction"], Flavour.REAL_UNTOLD: ["slip_history"]}.get(design.flavour, [])
    kinds = [kind for kind in of_kind if kind not in asked and TYPICAL[kind].common > 0]
    weight = np.array([TYPICAL[kind].common for kind in kinds])
    others = rng.choice(kinds, count - len(asked), replace=False, p=weight / weight.sum()).tolist()
    return [_sized(rng, design, of_kind[kind], whole=kind in asked) for kind in [*asked, *others]]


def _sized(rng: np.random.Generator, design: Design, forms: Sequence[Candidate], whole: bool) -> Planted:
    """A random one of a kind's candidates, with a random shape and a typical size; if `whole`, one without a place."""
    variants = sorted({form.variant for form in forms})
    variant = variants[int(rng.integers(len(variants)))]
    forms = [form for form in forms if form.variant == variant and not (whole and form.place)]
    form = shaped(design, forms[int(rng.integers(len(forms)))], rng)
    if not form.sized:
        return Planted(form.effect(1.0), 1.0)
    typical = TYPICAL[form.kind]
    share = float(np.exp(rng.uniform(np.log(typical.least), np.log(typical.most))))
    ends = [end for end in (form.low, form.high) if end]
    size = share * ends[int(rng.integers(len(ends)))]
    return Planted(form.effect(size), size)


def _held(
    rng: np.random.Generator, request: Request, design: Design, planted: Sequence[Planted], attempt: int
) -> Label | None:
    """The label of a rig with given effects and random constants, frame, imperfections and targets; None where the rig
    lacks an equilibrium or bends too far, or no targets are found."""
    chosen = SETTINGS.imperfections
    drawn = np.clip(rng.standard_normal(5), -chosen.most_deviations, chosen.most_deviations)
    deviations = [chosen.log_stiffness_sd, chosen.log_friction_sd if design.friction > 0 else 0.0]
    constants = tuple((np.array(deviations) * drawn[:2]).tolist())
    rotation, shift = design.measurement["frame_rotation_sd_rad"], design.measurement.get("frame_position_sd_m", 0.0)
    frame = tuple((np.array([rotation, shift, shift]) * drawn[2:]).tolist())
    build, effects = drawn_build(rng, design), [effect.effect for effect in planted]
    states = followed(rig_as_built(truth(design, effects, *constants), build), design.program)
    if states is None or largest_bend(states) > SETTINGS.real.most_bend_rad:
        return None
    targets = drawn_targets(rng, design, effects, constants, build)
    if targets is None:
        return None
    loads = next(target["program"] for target in targets if target["name"] == OTHER_LOADS)
    noise_seed = int(rng.integers(2**62))
    if not _can_be_recorded(design, effects, constants, build, noise_seed):
        return None
    return Label(
        request.case,
        request.cls,
        request.design,
        noise_seed,
        effects=tuple(effects),
        sizes=tuple(effect.size for effect in planted),
        worth=tuple(worths(design, effects, constants, frame, build, loads)),
        apart=tuple(squared_distances(design, effects, constants, frame, build)),
        constants=constants,
        frame=frame,
        build=build.plain(),
        targets=targets,
        note=f"draw {attempt + 1}",
    )


def _can_be_recorded(
    design: Design, effects: Sequence[Mapping[str, Any]], constants: Sequence[float], build: Build, noise_seed: int
) -> bool:
    """Whether the rig has an equilibrium at every step under the true tensions, which scatter about the noted ones."""
    rng, rig = np.random.default_rng(noise_seed), rig_as_built(truth(design, effects, *constants), build)
    return followed(rig, [applied_tensions(rng, design, build, steps) for steps in design.program]) is not None


def build_of(label: Label) -> Build:
    """The imperfections of a real rig, rebuilt from its label; labels of bench rigs have none."""
    assert label.build is not None
    return Build(**label.build)
