"""Draws labels of foreign laws, at sizes at which they are far from every effect of the library."""

import numpy as np

from prb3r.proof.concealed.camera import exact_readings
from prb3r.proof.concealed.distances import (
    distance_to_pairs,
    distance_without_a_step,
    nearest_by_kind,
    refitted_distance,
)
from prb3r.proof.concealed.foreign import LAWS, followed_foreign, knocks, possible
from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.settings import SETTINGS

TINY = 1e-9
"""Least squared distance, in units of noise, of which the logarithm is taken: zero has none."""


def foreign_label(request: Request, responses: Responses, rng: np.random.Generator) -> Label | None:
    """The label of a foreign law at the size, of a few that are tried, whose distance is nearest to a random target.

    None if no law is possible on the design, or the first size has no equilibrium.
    """
    names, chosen = possible(responses.design), SETTINGS.foreign
    if not names:
        return None
    law = request.kind if request.kind in names else names[int(rng.integers(len(names)))]
    sign = -1.0 if LAWS[law].signed and rng.random() < chosen.reversed_half else 1.0
    target, share = SETTINGS.sizes.far_outside * rng.uniform(*chosen.target), chosen.first_share
    if LAWS[law].jumps:
        share = rng.uniform(*chosen.first_dead_zone)
    best: Label | None = None
    for _ in range(chosen.tries):
        label = _label_of_size(request, responses, law, sign * share * LAWS[law].largest)
        if label is None:
            break
        if best is None or _outsideness(label, target) < _outsideness(best, target):
            best = label
        least, most = chosen.accepted
        if least <= label.distance / target <= most:
            break
        change = np.sqrt(chosen.aim * target / max(label.distance, TINY))
        share = float(np.clip(share * np.clip(change, *chosen.change), 0, 1))
    return best


def _outsideness(label: Label, target: float) -> float:
    """Deviation of a label's squared distance from the target, as a logarithm; too near counts many times more."""
    ratio = float(np.log(max(label.distance, TINY) / target))
    return ratio if ratio >= 0 else -SETTINGS.foreign.too_near * ratio


def _label_of_size(request: Request, responses: Responses, law: str, size: float) -> Label | None:
    """The label of a foreign law at a size; None where a step has no equilibrium."""
    design = responses.design
    states = followed_foreign(design, design.manipulator, design.program, law, size)
    if states is None:
        return None
    readings = exact_readings(design, design.manipulator, states, knocks(design, law, size))
    change = responses.whiten(readings - responses.nominal)
    nearest = nearest_by_kind(responses, change, responses.of_candidates, [], near=np.inf)
    return Label(
        request.case,
        "foreign",
        request.design,
        0,
        foreign=(law, size),
        sizes=(size,),
        norm=float(np.sqrt(refitted_distance(responses, change, None))),
        nearest={**nearest, "wrong weight": distance_without_a_step(responses, change)},
        pair_distance=distance_to_pairs(responses, change, responses.of_candidates),
    )
