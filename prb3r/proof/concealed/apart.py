"""How far each effect of a real rig is from other explanations, in the linear model.

Meanwhile the rig's other effects may change their sizes, and constants and frame are refitted with their priors.  Where
friction follows the load path this is not computed, for its cost.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.proof.concealed.build import Build, rig_as_built
from prb3r.proof.concealed.camera import exact_readings, truth
from prb3r.proof.concealed.candidates import candidates
from prb3r.proof.concealed.design import Design, followed
from prb3r.proof.concealed.worth import nuisances
from prb3r.proof.rig.effects import RECORDS
from prb3r.proof.settings import SETTINGS


def squared_distances(
    design: Design,
    effects: Sequence[Mapping[str, Any]],
    constants: Sequence[float],
    frame: Sequence[float],
    build: Build,
) -> list[float]:
    """Squared distance from every effect to the nearest effect of a kind that the rig lacks, in variances of the rig's
    own reading noise.

    Empty where nothing is computed; `SETTINGS.real.largest_distance` for an effect without which there is no
    equilibrium.

    Parameters
    ----------
    constants : ln of the factors on E and mu
    frame : rotation, rad, and shift, m

    Raises
    ------
    ValueError
        If the rig has no equilibrium at some step.
    """
    if not effects or design.flavour.is_slow or any(effect["kind"] == "slip_history" for effect in effects):
        return []
    sd = build.noise * np.array([design.deviation(kind) for kind in design.kinds])

    def seen(acting: Sequence[Mapping[str, Any]], p: Sequence[float], at: Sequence[float]) -> list[np.ndarray] | None:
        """The readings (r,) over their noise, in a list of one, with effects, constants `p` and frame `at`."""
        manipulator = rig_as_built(truth(design, acting, *p), build)
        states = followed(manipulator, design.program)
        if states is None:
            return None
        return [(exact_readings(design, manipulator, states, [at] * len(states)) / sd).reshape(-1)]

    whole = seen(effects, constants, frame)
    if whole is None:
        raise ValueError("the rig has no equilibrium at some step")
    columns, priors = nuisances(design, lambda p, at: seen(effects, p, at), whole, constants, frame)
    bare = [seen([*effects[:k], *effects[k + 1 :]], constants, frame) for k in range(len(effects))]
    changes = [None if read is None else whole[0] - read[0] for read in bare]
    rivals = _rival_columns(design, effects, lambda acting: seen(acting, constants, frame), whole[0])
    out = []
    for k, change in enumerate(changes):
        if change is None:
            out.append(np.inf)
            continue
        others = [column for j, column in enumerate(changes) if j != k and column is not None]
        fixed = np.column_stack([columns[0], *others]) if others else columns[0]
        rows = np.vstack([fixed, np.diag([*priors, *[0.0] * len(others)])])
        basis = np.linalg.qr(rows)[0]
        out.append(_nearest(basis, np.append(change, np.zeros(len(fixed.T))), rivals))
    return [round(float(min(value, SETTINGS.real.largest_distance)), 3) for value in out]


def _rival_columns(design: Design, effects: Sequence[Mapping[str, Any]], seen: Any, whole: np.ndarray) -> list[Any]:
    """For every group of candidates of a kind that the rig lacks: (r, k) change of the readings per unit of size, or by
    the whole effect, and whether it has a size.

    Of worn holes only those worn by all their cables are tried: those of single cables are many, and each costs a run
    of the simulator.
    """
    there = {effect["kind"] for effect in effects}
    no_rivals, out = there.union({"slip_history"}, *(RECORDS[kind].excludes for kind in there)), []
    for group in candidates(design):
        if group[0].kind in no_rivals or (group[0].kind == "worn_hole" and len(group[0].place) > 1):
            continue
        parts = [(form, seen([*effects, form.effect(form.probe)])) for form in group]
        changes = [(moved[0] - whole) / form.probe for form, moved in parts if moved is not None]
        if len(changes) == len(group):
            out.append((np.stack(changes, 1), group[0].sized))
    return out


def _nearest(basis: np.ndarray, change: np.ndarray, rivals: Sequence[Any]) -> float:
    """Least squared norm that a rival leaves of a change once the columns of `basis` are projected out; without rivals
    that of the change itself."""

    def free(part: np.ndarray) -> np.ndarray:
        return part - basis @ (basis.T @ part)

    left = free(change)
    best = float(left @ left)
    for columns, sized in rivals:
        rival = free(np.vstack([columns, np.zeros((len(change) - len(columns), columns.shape[1]))]))
        if sized:
            away = left - rival @ np.linalg.lstsq(rival, left, rcond=SETTINGS.sizes.rank_tolerance)[0]
        else:
            away = left - rival[:, 0]
        best = min(best, float(away @ away))
    return best
