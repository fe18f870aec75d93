"""Effects at sizes that count: multiples of the smallest detectable one, and how far they are from all others."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from prb3r.proof.concealed.candidates import shaped, twins
from prb3r.proof.concealed.responses import APART, NEAR, NORM, Bench, Response, nearest
from prb3r.proof.rig.effects.candidate import Candidate


@dataclass(frozen=True)
class Found:
    """An effect with a size, as the rig sees it."""

    candidate: Candidate
    size: float
    change: np.ndarray
    norm: float

    @property
    def effect(self) -> dict[str, Any]:
        return self.candidate.effect(self.size)


def found(bench: Bench, candidate: Candidate, norm: float, sign: float) -> Found | None:
    """The size at which a candidate stands out by `norm`, checked with the full rig; None if no bench has it."""
    if not candidate.sized:
        change = bench.response([candidate.effect(1.0)])
        return None if change is None else Found(candidate, 1.0, change, bench.norm(change))
    probe = abs(candidate.probe) * sign
    if not candidate.low <= probe <= candidate.high:
        return None
    size, change = probe, bench.response([candidate.effect(probe)])
    for _ in range(5):
        if change is None or not (strength := bench.norm(change)):
            return None
        if abs(strength / norm - 1) < 0.05:
            return Found(candidate, size, change, strength)
        size *= norm / strength
        if not candidate.low <= size <= candidate.high:
            return None
        change = bench.response([candidate.effect(size)])
    return None


def of_kind(bench: Bench, kind: str, rng: np.random.Generator) -> Candidate | None:
    """A candidate of a kind (any, if empty) at a random place with a random shape."""
    own = [each for each in bench.responses if kind in ("", each.kind)]
    if not own:
        return None
    kinds = sorted({each.kind for each in own})
    kind = kinds[int(rng.integers(len(kinds)))]
    group = [each for each in own if each.kind == kind]
    variants = sorted({each.group[0].variant for each in group})
    variant = variants[int(rng.integers(len(variants)))]
    group = [each for each in group if each.group[0].variant == variant]
    return shaped(bench.design, group[int(rng.integers(len(group)))].group[0], rng)


def _signs(candidate: Candidate, rng: np.random.Generator) -> list[float]:
    return [1.0] if candidate.low >= 0 else rng.permutation([-1.0, 1.0]).tolist()


def drawn(bench: Bench, kind: str, multiple: float, rng: np.random.Generator) -> Found | None:
    """A random effect of a kind at a multiple of its smallest detectable size."""
    candidate = of_kind(bench, kind, rng)
    if candidate is None:
        return None
    for sign in _signs(candidate, rng):
        if (one := found(bench, candidate, multiple * NORM, sign)) is not None:
            return one
    return None


def rivals_of(bench: Bench, one: Found, near: float = NEAR) -> dict[str, float]:
    """Squared distances to the other kinds, laws that are the same under another name included; see `nearest`."""
    twin = []
    for each in twins(bench.design, one.candidate, one.size):
        if (column := bench.unit(each)) is not None:
            twin.append(Response((each,), column[:, None]))
    return nearest(bench, one.change, [*bench.responses, *twin], [one.candidate.kind], near)


def places_of(bench: Bench, one: Found) -> tuple[Any, ...]:
    same = [r for r in bench.responses if r.kind == one.candidate.kind and r.group[0].place != one.candidate.place]
    near = [(dict(r.group[0].place), round(bench.distance(one.change, r), 3)) for r in same]
    return tuple((place, far) for place, far in near if far < APART)
