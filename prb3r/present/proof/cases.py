"""The table of recordings of the benchmark: what was concealed, the verdict of each method, and how right it was."""

import math
from typing import Any

from prb3r.proof.concealed.labels import Label
from prb3r.proof.judging.opened import OpenedCase, first_right, mentioned
from prb3r.proof.judging.verdict import Verdict
from prb3r.proof.prove import Proof


def concealed_text(label: Label) -> str:
    """What a recording conceals, in one line: effects with places and sizes, or a foreign law, or a wrong weight."""
    if label.foreign is not None:
        return f"{label.foreign[0]} {label.foreign[1]:.3g}"
    if label.wrong_weight is not None:
        q, k, name, factor = label.wrong_weight
        return f"sequence s{q + 1}, step {k + 1}: {factor:g} of the noted weight on cable {name}"
    shown = lambda value: f"{value:.4g}" if isinstance(value, float) else str(value)  # noqa: E731
    return "; ".join(
        f"{effect['kind']} {', '.join(f'{name} {shown(v)}' for name, v in effect.items() if name != 'kind')}".strip()
        for effect in label.effects
    )


def case_columns(proof: Proof) -> dict[str, list[Any]]:
    """Columns of the table of recordings, a row for each recording and method; most numbers that are not finite are
    None."""
    cases = [case for cases in proof.cases.values() for case in cases]
    return {
        "case": [c.label.case for c in cases],
        "method": [c.verdict.method for c in cases],
        "class": [c.label.cls for c in cases],
        "design": [c.label.design for c in cases],
        "concealed": [concealed_text(c.label) for c in cases],
        "kinds": [", ".join(c.label.kinds) for c in cases],
        "awkward": [", ".join(c.label.awkward) for c in cases],
        "worth": [", ".join(f"{worth:.2g}" for worth in c.label.worth) for c in cases],
        "imperfections": [_build(c.label) for c in cases],
        "blunder": [c.label.blunder["said"] if c.label.blunder else "" for c in cases],
        "blunder_said": ["; ".join(" = ".join(said) for said in c.verdict.setup) for c in cases],
        "missed": [_missed(c) for c in cases],
        "models": [" | ".join(", ".join(model) for model in c.verdict.models[:4]) for c in cases],
        "noise": [_finite(c.verdict.noise) for c in cases],
        "norm": [c.label.norm for c in cases],
        "distance": [_finite(c.label.distance) for c in cases],
        "nearest": [min(c.label.nearest, key=c.label.nearest.__getitem__, default="") for c in cases],
        "verdict": [c.verdict.verdict for c in cases],
        "named": [_claims(c.verdict) for c in cases],
        "indistinguishable": [", ".join(sorted(mentioned(c.verdict))) for c in cases],
        "first_right": [_right(c) for c in cases],
        "reduced_chi2_calibrated": [_finite(c.verdict.reduced[0]) for c in cases],
        "reduced_chi2_explained": [_finite(c.verdict.reduced[1]) for c in cases],
        "seconds": [c.verdict.seconds for c in cases],
        "reason": [c.verdict.reason for c in cases],
    }


def _build(label: Label) -> str:
    """Imperfections of a real rig in brief: noise, tension scatter, `gaps` and `gross` outliers; empty for others."""
    if label.build is None:
        return ""
    slips = [name for name in ("gaps", "gross") if label.build[name]]
    return ", ".join([f"noise {label.build['noise']:.2f}", f"tension {label.build['tension']:.2f}", *slips])


def _missed(case: OpenedCase) -> str:
    """Errors at other loads and on another design, before and after, and the share of readings that bands cover."""
    return "; ".join(
        f"{m.name}: {1e3 * m.calibrated_m:.2f} -> {1e3 * m.explained_m:.2f} mm, covered {m.covered:.0%}"
        for m in case.missed
    )


def _right(case: OpenedCase) -> bool | None:
    """Whether the effect named first is of the true kind; None where no effect is concealed."""
    return first_right(case) if case.label.effects else None


def _finite(value: float) -> float | None:
    """A number, None if it is not finite."""
    return float(value) if math.isfinite(value) else None


def _claims(verdict: Verdict) -> str:
    """The effects that a verdict names, in one line: kind, place and fitted values to four digits."""
    texts = []
    for claim in verdict.named:
        places = [f"{key} {value}" for key, value in claim.place.items()]
        values = [f"{name} {value[0]:.4g}" for name, value in claim.parameters.items()]
        texts.append(" ".join([claim.kind, *places, *values]) + (" (in part)" if claim.partial else ""))
    return "; ".join(texts)
