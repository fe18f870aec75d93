"""Draws the labels of recordings of bench rigs: one function for each class of recordings."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from prb3r.proof.concealed.camera import truth
from prb3r.proof.concealed.design import Design
from prb3r.proof.concealed.distances import distance_to_pairs, refitted_distance
from prb3r.proof.concealed.elsewhere import drawn_targets
from prb3r.proof.concealed.foreign import followed_foreign
from prb3r.proof.concealed.labels import AWKWARD, Label, Request
from prb3r.proof.concealed.outside import foreign_label
from prb3r.proof.concealed.pairs import pair_label
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.concealed.sizing import SizedEffect, distances_by_kind, draw_effect, places_near
from prb3r.proof.settings import SETTINGS

OUTSIDE = "foreign", "deleted"
"""Classes of recordings whose physics the library of the diagnosis lacks."""
Drawing = Callable[[Request, Responses, Responses | None, np.random.Generator], Label | None]
"""Draws a label from a request, the responses of its design, those to its loading-only sequences, and a generator; None
if the request cannot be met."""


def label_of(request: Request, responses: Responses, loading: Responses | None) -> Label:
    """The label for a request; where the design cannot show the kind asked for, of another kind, else a clean label."""
    rng = np.random.default_rng([request.seed, 2, request.case])
    label = _DRAWINGS[request.cls](request, responses, loading, rng)
    if label is None and request.kind:
        label = _DRAWINGS[request.cls](replace(request, kind=""), responses, loading, rng)
    if label is None:
        label = Label(request.case, "clean", request.design, 0, note=f"no {request.cls} {request.kind} on this design")
    return _with_targets(_with_constants(label, responses, rng), responses.design, rng)


def _with_targets(label: Label, design: Design, rng: np.random.Generator) -> Label:
    """The label with other loads and another design as targets, where its physics is outside the library and both have
    equilibria."""
    if label.cls not in OUTSIDE:
        return label
    asked = drawn_targets(rng, design, label.effects, label.constants, None, label.foreign)
    return replace(label, targets=asked or ())


def _with_constants(label: Label, responses: Responses, rng: np.random.Generator) -> Label:
    """The label with random constants, frame and noise seed, such that the rig keeps its equilibria."""
    chosen, design = SETTINGS.imperfections, responses.design
    rotation, shift = design.measurement["frame_rotation_sd_rad"], design.measurement.get("frame_position_sd_m", 0.0)
    if "frame" in label.awkward:
        frame = rng.choice([-chosen.frame_edge, chosen.frame_edge], 3)
    else:
        frame = np.clip(rng.standard_normal(3), -chosen.most_deviations, chosen.most_deviations)
    label = replace(
        label,
        noise_seed=int(rng.integers(2**62)),
        frame=(float(rotation * frame[0]), float(shift * frame[1]), float(shift * frame[2])),
    )
    for narrowing in chosen.narrowings:
        deviations = [chosen.log_stiffness_sd, chosen.log_friction_sd if design.friction > 0 else 0.0]
        drawn = np.clip(rng.standard_normal(2), -chosen.most_deviations, chosen.most_deviations)
        constants = tuple((np.array(deviations) * narrowing * drawn).tolist())
        if label.foreign is not None:
            plain = truth(design, (), *constants)
            if followed_foreign(design, plain, design.program, *label.foreign) is None:
                continue
        elif responses.readings(label.effects, constants) is None:
            continue
        return replace(label, constants=constants)
    return replace(label, note="constants are the nominal ones")


def _labelled(request: Request, responses: Responses, drawn: SizedEffect, nearest: Mapping[str, float]) -> Label:
    """The label of a recording with one effect: its size, its norm beyond calibration by the full rig, the squared
    distances to the `nearest` effects of other kinds, and the places of its own kind that are not told apart."""
    return Label(
        request.case,
        request.cls,
        request.design,
        0,
        effects=(drawn.effect,),
        sizes=(drawn.size,),
        multiple=request.multiple,
        norm=float(np.sqrt(refitted_distance(responses, drawn.change, None))),
        nearest=nearest,
        places=places_near(responses, drawn),
    )


def _clean(request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator) -> Label:
    """A label without effects; of a request for `awkward`, with one way or two, drawn from `AWKWARD`."""
    awkward = ()
    if request.kind == "awkward":
        count = 1 + int(rng.random() < SETTINGS.imperfections.second_awkwardness)
        awkward = tuple(rng.choice(AWKWARD, count, replace=False).tolist())
    return Label(request.case, "clean", request.design, 0, awkward=awkward)


def _single(
    request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator
) -> Label | None:
    """One effect at the size asked for; of several draws the one that is farthest from all other kinds."""
    enough = SETTINGS.labels.far_enough * SETTINGS.sizes.apart
    best: tuple[float, SizedEffect] | None = None
    for _ in range(SETTINGS.labels.tries):
        drawn = draw_effect(responses, request.kind, request.multiple, rng)
        if drawn is None:
            continue
        far = min(distances_by_kind(responses, drawn, near=0.0).values(), default=np.inf)
        if best is None or far > best[0]:
            best = far, drawn
        if best[0] >= enough or request.multiple < SETTINGS.population.multiples[1] or not drawn.candidate.sized:
            break
    return None if best is None else _labelled(request, responses, best[1], distances_by_kind(responses, best[1]))


def _deleted(
    request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator
) -> Label | None:
    """One effect that is taken out of the library of the diagnosis, large enough to be far from all that are left."""
    best: Label | None = None
    for multiple in SETTINGS.labels.deleted_multiples:
        drawn = draw_effect(responses, request.kind, multiple, rng)
        if drawn is None:
            continue
        far = distances_by_kind(responses, drawn, near=np.inf)
        label = _labelled(replace(request, multiple=multiple), responses, drawn, far)
        if best is None or label.distance > best.distance:
            others = [response for response in responses.of_candidates if response.kind not in label.kinds]
            pairs = distance_to_pairs(responses, drawn.change, others)
            best = replace(label, without=label.kinds, pair_distance=pairs)
        if best.distance >= SETTINGS.sizes.far_outside:
            break
    return best


def _pair(request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator) -> Label | None:
    return pair_label(request, responses, rng)


def _foreign(
    request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator
) -> Label | None:
    return foreign_label(request, responses, rng)


def _decoy(request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator) -> Label | None:
    """No physics left out: an awkward frame, or one weight that is noted wrongly."""
    chosen, label = SETTINGS.labels, Label(request.case, "decoy", request.design, 0, note=request.kind)
    if request.kind == "frame":
        return replace(label, awkward=("frame",))
    program, cables = responses.design.program, responses.design.cables
    for _ in range(chosen.wrong_weight_tries):
        q = int(rng.integers(len(program)))
        k = int(rng.integers(len(program[q])))
        name = cables[int(rng.integers(len(cables)))]
        noted, factor = program[q][k][f"cable_{name}_n"], float(rng.choice(chosen.wrong_weights))
        if noted == 0:
            continue
        changed = [list(steps) for steps in program]
        changed[q][k] = {**program[q][k], f"cable_{name}_n": noted * factor}
        readings = responses.readings(program=[tuple(steps) for steps in changed])
        if readings is None:
            continue
        norm = responses.norm(responses.whiten(readings - responses.nominal))
        if norm >= chosen.wrong_weight_least * SETTINGS.sizes.detectable:
            return replace(label, wrong_weight=(q, k, name, factor), norm=norm)
    return None


def _confusable(
    request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator
) -> Label | None:
    """One effect that cannot be told from an effect of another kind."""
    same = SETTINGS.sizes.same
    for _ in range(SETTINGS.labels.confusable_tries):
        drawn = draw_effect(responses, request.kind, request.multiple, rng)
        if drawn is None or not drawn.candidate.sized:
            continue
        far = min(distances_by_kind(responses, drawn, near=0.0).values(), default=np.inf)
        if far < SETTINGS.labels.confusable_near * same:
            nearest = distances_by_kind(responses, drawn)
            if min(nearest.values()) < same:
                return _labelled(request, responses, drawn, nearest)
    return None


def _hidden(
    request: Request, responses: Responses, loading: Responses | None, rng: np.random.Generator
) -> Label | None:
    """One effect that E and mu imitate in the sequences in which cables are only drawn in."""
    if loading is None:
        return None
    chosen = SETTINGS.labels
    fits_well = chosen.hidden_excess * np.sqrt(2 * loading.nominal.size)
    for attempt in range(chosen.hidden_tries):
        multiple = chosen.hidden_multiples[attempt % len(chosen.hidden_multiples)]
        kind = request.kind if attempt < chosen.hidden_tries // 2 else ""
        drawn = draw_effect(responses, kind, multiple, rng)
        if drawn is None or not drawn.candidate.sized:
            continue
        part = loading.to([drawn.effect])
        if part is None or loading.norm(part) ** 2 > fits_well or not _misleads(loading, part):
            continue
        nearest = distances_by_kind(responses, drawn)
        if min(nearest.values()) >= SETTINGS.sizes.apart:
            label = _labelled(replace(request, multiple=multiple), responses, drawn, nearest)
            return replace(label, hidden_norm=loading.norm(part))
    return None


def _misleads(loading: Responses, change: np.ndarray) -> bool:
    """Whether calibration on loading alone would take a change for other constants, beyond the settings' limits."""
    stiffness, friction = SETTINGS.labels.misled
    false = np.abs(np.linalg.lstsq(loading.calibration, change, rcond=None)[0])
    return bool(false[0] >= stiffness or (loading.design.friction > 0 and false[1] > friction))


_DRAWINGS: dict[str, Drawing] = {
    "clean": _clean,
    "single": _single,
    "pair": _pair,
    "foreign": _foreign,
    "deleted": _deleted,
    "decoy": _decoy,
    "confusable": _confusable,
    "hidden": _hidden,
}
