"""Draws labels of two effects at once, on request such that they cancel in part."""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.proof.concealed.labels import Label, Request
from prb3r.proof.concealed.responses import Responses
from prb3r.proof.concealed.sizing import SizedEffect, draw_effect
from prb3r.proof.settings import SETTINGS


def pair_label(request: Request, responses: Responses, rng: np.random.Generator) -> Label | None:
    """The label of two effects of two kinds, each detectable with the other refitted; None if no such pair was drawn.

    A pair is preferred of which no third kind imitates either effect; where a cancelling one is asked for, the one of
    these that cancels most.
    """
    chosen, cancelling = SETTINGS.labels, request.kind == "cancelling"
    best: tuple[tuple[bool, float], list[SizedEffect], dict[str, float]] | None = None
    for _ in range(chosen.pair_tries):
        pair = _drawn_pair(request, responses, rng)
        if pair is None:
            continue
        a, b = (responses.free(effect.change) for effect in pair)
        cos = float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
        alone = SETTINGS.sizes.detectable * request.multiple * np.sqrt(1 - cos**2)
        least = chosen.pair_least * SETTINGS.sizes.detectable
        if alone < least or responses.readings([effect.effect for effect in pair]) is None:
            continue
        nearest = _nearest_thirds(responses, pair)
        rank = pair_rank(cos, nearest, cancelling)
        if best is None or rank > best[0]:
            best = rank, pair, nearest
        if best[0] >= (True, chosen.cancelling if cancelling else 0.0):
            break
    if best is None:
        return None
    _, pair, nearest = best
    change = responses.to([effect.effect for effect in pair])
    return Label(
        request.case,
        "pair",
        request.design,
        0,
        effects=tuple(effect.effect for effect in pair),
        sizes=tuple(effect.size for effect in pair),
        multiple=request.multiple,
        norm=responses.norm(change) if change is not None else 0.0,
        nearest=nearest,
        note=request.kind,
    )


def pair_rank(cos: float, nearest: Mapping[str, float], cancelling: bool) -> tuple[bool, float]:
    """Which pair is preferred, the greater rank: whether no third kind imitates an effect of it and, where one that
    cancels is asked for, how much it does.

    Parameters
    ----------
    cos : cosine between what calibration leaves of the two changes; negative where they cancel.
    nearest : squared distance to the nearest rival of each third kind.
    """
    apart = min(nearest.values(), default=np.inf) >= SETTINGS.sizes.apart
    return bool(apart), -cos if cancelling else 0.0


def _drawn_pair(request: Request, responses: Responses, rng: np.random.Generator) -> list[SizedEffect] | None:
    """Two random effects of different kinds, both with a size; None if the draw is no such pair."""
    drawn = [draw_effect(responses, "", request.multiple, rng) for _ in range(2)]
    pair = [effect for effect in drawn if effect is not None and effect.candidate.sized]
    return pair if len({effect.kind for effect in pair}) == 2 else None


def _nearest_thirds(responses: Responses, pair: Sequence[SizedEffect]) -> dict[str, float]:
    """Squared distance from either effect of a pair to the nearest rival of each third kind, in the linear model with
    the other effect refitted."""
    out: dict[str, float] = {}
    kinds = [effect.kind for effect in pair]
    for effect, other in (pair, pair[::-1]):
        unit = responses.free(other.change)
        unit = unit / np.linalg.norm(unit)
        a = responses.free(effect.change)
        a = a - unit * (unit @ a)
        for rival in responses.of_candidates:
            if rival.kind in kinds:
                continue
            b = responses.free(rival.columns)
            b = b - np.outer(unit, unit @ b)
            left = a - b @ np.linalg.lstsq(b, a, rcond=None)[0] if rival.sized else a - b[:, 0]
            out[rival.kind] = min(out.get(rival.kind, np.inf), round(float(left @ left), 3))
    return out
