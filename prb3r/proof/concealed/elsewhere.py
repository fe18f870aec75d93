"""Targets of prediction: other loads on the rig and another design, and what the rig truly does there."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from prb3r.proof.concealed.build import Build, drawn_build, rig_as_built
from prb3r.proof.concealed.camera import truth
from prb3r.proof.concealed.design import Design, followed, largest_bend
from prb3r.proof.concealed.designs import drawn_program, weaker_program
from prb3r.proof.concealed.foreign import LAWS, followed_foreign
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.rig.simulate import RigStates
from prb3r.proof.settings import SETTINGS

OTHER_LOADS, OTHER_DESIGN = "other loads", "another design"


def carried(effects: Sequence[Mapping[str, Any]], here: Design, there: Design) -> list[dict[str, Any]]:
    """The effects of a rig of design `here` that a rig of design `there`, of the same making, has as well."""
    of_the_kind = [effect for effect in effects if RECORDS[effect["kind"]].of_the_kind and "cables" not in effect]
    return [_of_the_steel(effect, here, there) for effect in of_the_kind]


def _of_the_steel(effect: Mapping[str, Any], here: Design, there: Design) -> dict[str, Any]:
    """The effect on the other design: a law of the material acts on strain, so that its cubic term goes with the square
    of the outer fibre's distance."""
    if "cubic_m2" not in effect:
        return dict(effect)
    fibres = [np.mean([segment["thickness_m"] for segment in d.manipulator["segment"]]) for d in (here, there)]
    return {**effect, "cubic_m2": effect["cubic_m2"] * float(fibres[1] / fibres[0]) ** 2}


def target_states(
    design: Design,
    target: Mapping[str, Any],
    effects: Sequence[Mapping[str, Any]],
    constants: Sequence[float],
    build: Build | None,
    foreign: tuple[str, float] | None = None,
) -> list[RigStates] | None:
    """The true states of the rig along the program of a target; None where a step has no equilibrium.

    Parameters
    ----------
    target : a `name`, the contents of a `manipulator` file and a `program`
    effects, constants : those concealed; constants as ln of the factors on E and mu
    build : imperfections of the rig that is followed, see :func:`built_there`; None: made exactly as drawn
    foreign : law outside the library that acts on the rig, and its size
    """
    there = replace(design, manipulator=target["manipulator"])
    if target["name"] == OTHER_LOADS:
        plain = truth(design, effects, *constants)
    else:
        plain = truth(there, carried(effects, design, there), *constants)
        foreign = foreign if foreign and LAWS[foreign[0]].of_the_kind else None
    manipulator = rig_as_built(plain, build) if build else plain
    if foreign is None:
        return followed(manipulator, target["program"])
    return followed_foreign(there, manipulator, target["program"], *foreign)


def built_there(target: Mapping[str, Any], build: Build | None) -> Build | None:
    """How the rig at a target was made: the recorded rig, with its imperfections `build`, or a rig of another design,
    which has its own; None for bench rigs and their likes."""
    if target["name"] == OTHER_LOADS:
        return build
    return Build(**target["build"]) if "build" in target else None


def drawn_targets(
    rng: np.random.Generator,
    design: Design,
    effects: Sequence[Mapping[str, Any]],
    constants: Sequence[float],
    build: Build | None,
    foreign: tuple[str, float] | None = None,
) -> tuple[dict[str, Any], ...] | None:
    """Targets: other loads on the rig, and another design, each with an equilibrium at every step; None if not found.

    Beside a real rig the other design is made within tolerances, too, but has to stand as drawn as well.  For the
    parameters see :func:`target_states`.
    """
    out = []
    for name in (OTHER_LOADS, OTHER_DESIGN):
        manipulator = dict(design.manipulator) if name == OTHER_LOADS else _another(rng, design)
        there = replace(design, manipulator=manipulator)
        made = drawn_build(rng.spawn(1)[0], there) if build and name == OTHER_DESIGN else None
        program = drawn_program(rng, manipulator, design.flavour)[: SETTINGS.real.sequences]
        for _ in range(SETTINGS.programs.weakenings):
            listed = [list(map(dict, steps)) for steps in program]
            target = {"name": name, "manipulator": manipulator, "program": listed}
            if made:
                target["build"] = made.plain()
            rigs = [build] if name == OTHER_LOADS else [None, *filter(None, [made])]
            followed_there = [target_states(design, target, effects, constants, rig, foreign) for rig in rigs]
            if all(states and largest_bend(states) < SETTINGS.real.largest_bend_rad for states in followed_there):
                out.append(target)
                break
            program = weaker_program(program)
        else:
            return None
    return tuple(out)


def _another(rng: np.random.Generator, design: Design) -> dict[str, Any]:
    """The manipulator of a design with other thicknesses and numbers of plates, all else as it is."""
    chosen, plain = SETTINGS.real, design.manipulator
    most = chosen.history_plates if design.flavour.is_slow else np.inf
    segments = []
    for segment in plain["segment"]:
        more = int(rng.integers(chosen.more_plates[0], chosen.more_plates[1] + 1))
        plates = int(max(min(segment["plates"] + more, most), chosen.fewest_plates))
        factor = rng.uniform(*chosen.thickness)
        segments.append({**segment, "plates": plates, "thickness_m": float(segment["thickness_m"] * factor)})
    return {**plain, "segment": segments}
