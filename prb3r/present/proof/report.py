"""The benchmark on paper: table of scores, confusion matrix, one row a case."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from prb3r.markdown import markdown_table
from prb3r.present import style
from prb3r.present.page import save_figure
from prb3r.present.proof.scores import goal_text, scores_table
from prb3r.proof.concealed.labels import Label
from prb3r.proof.judging.breakdown import by_effect, confusion
from prb3r.proof.judging.methods import Verdict
from prb3r.proof.judging.opened import OpenedCase, failed, first_right, mentioned
from prb3r.proof.prove import Proof
from prb3r.proof.settings import SETTINGS
from prb3r.runs.files import write_whole
from prb3r.runs.store import arrow_table, write_arrow


def publish_proof(proof: Proof, folder: Path) -> list[Path]:
    """Write `proof.md`, `proof.json`, `cases.parquet` and the figure of the confusion matrix."""
    folder.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(style.RC):
        figures = save_figure(confusion_figure(proof), folder, "confusion")
    text = write_whole(folder / "proof.md", proof_page(proof).encode())
    write_whole(folder / "recordings.csv", pd.DataFrame(case_columns(proof)).to_csv(index=False).encode())
    numbers = write_whole(folder / "proof.json", json.dumps(plain_proof(proof), indent=1, default=str).encode())
    write_arrow(
        arrow_table(case_columns(proof), provenance={"seed": proof.seed, "labels": proof.digest}),
        folder / "cases.parquet",
    )
    return [text, numbers, folder / "recordings.csv", folder / "cases.parquet", *figures]


def proof_page(proof: Proof) -> str:
    """The whole result as a page."""
    git = proof.environment["git"]
    revision = f"{git['revision'][:12]}{' with changes' if git['dirty'] else ''}" if git else "unknown"
    seconds = [case.verdict.seconds for case in proof.main]
    lines = [
        "# Concealed effects",
        "",
        f"{len(proof.main)} recordings of {len(proof.designs)} designs, seed {proof.seed}, revision {revision}, "
        f"{proof.environment['written']}, {proof.environment['platform']}; {proof.seconds / 60:.0f} minutes in all, "
        f"{np.median(seconds):.1f} s a diagnosis (median), {max(seconds):.0f} s the longest.",
        "",
        f"Labels sealed before the first verdict: SHA-256 `{proof.digest}`.",
        "",
        *scores_table(proof),
        "",
        "Shares with Wilson intervals, medians with intervals of order statistics, held-out error pooled with a "
        "bootstrapped interval. *Met* by the point estimate, *shown* by the whole interval. Numbers in brackets: "
        "on how many of the recordings another method was judged. A failure counts against every score it belongs to.",
        "",
        f"Engine less rig without effects, whitened norm of a whole recording: at most "
        f"{max(proof.bias, default=0.0):.2g} over all designs.",
        "",
        "![Named effect by true effect](confusion.png)",
        "",
        *_effects(proof),
        "",
        *_hidden(proof),
        "",
        *_designs(proof),
        "",
    ]
    return "\n".join(lines)


def _effects(proof: Proof) -> list[str]:
    lines = [
        "## By effect and size",
        "",
        "Sizes in smallest detectable sizes. *First*: named first, of the distinguishable. *Among*: named or listed as "
        "indistinguishable, of all.",
        "",
    ]
    rows = [
        [row["kind"], f"{row['size']:g}", *(f"{row[key].hits} of {row[key].count}" for key in ("first", "among"))]
        for row in by_effect(proof.main)
    ]
    return lines + markdown_table(("effect", "size", "first", "among"), rows)


def _hidden(proof: Proof) -> list[str]:
    """What calibration alone would have reported where it hides the effect."""
    lines = [
        "## Where calibration hides the effect",
        "",
        "Six sequences, unloading in the last two alone. *Loading alone*: E and mu refitted to the others, which they "
        "fit (p: chance of so large a chi-square). Errors against the true constants.",
        "",
    ]
    head = (
        "case",
        "concealed",
        "p",
        "E, loading alone",
        "mu",
        "E, all sequences",
        "mu",
        "E, explained",
        "mu",
        "verdict",
    )
    return lines + markdown_table(head, [_hidden_row(case) for case in proof.main if _is_hidden(case)])


def _is_hidden(case: OpenedCase) -> bool:
    return case.label.cls == "hidden" and not failed(case)


def _hidden_row(case: OpenedCase) -> list[str]:
    label, verdict = case.label, case.verdict
    estimates = [verdict.loading[:2] if verdict.loading else None, verdict.calibrated, verdict.explained]
    errors = [
        f"{100 * np.expm1(value - true):+.1f} %" if estimate else "–"
        for estimate in estimates
        for value, true in zip(estimate or (0.0, 0.0), label.constants, strict=True)
    ]
    chance = f"{verdict.loading[2]:.2g}" if verdict.loading else "–"
    said = ", ".join(claim.kind for claim in verdict.named) or verdict.verdict
    return [str(label.case), _concealed(label), chance, *errors, said]


def _designs(proof: Proof) -> list[str]:
    bench = [design for design in proof.designs if not design.flavour.is_real]
    rows = [{**design.described(), "bias": bias} for design, bias in zip(bench, proof.bias, strict=True)]
    if not rows:
        return []
    cells = [[f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()] for row in rows]
    return ["## Designs", "", *markdown_table(list(rows[0]), cells)]


def _concealed(label: Label) -> str:
    """The truth in one line."""
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


def plain_proof(proof: Proof) -> dict[str, Any]:
    """The whole result as `proof.json` holds it."""
    methods = {
        name: [
            {"score": g.name, "goal": goal_text(g), **vars(s), "met": g.met(s), "shown": g.shown(s)} for g, s in scores
        ]
        for name, scores in ((name, proof.scores(name)) for name in proof.cases)
    }
    rows, columns, table = confusion(proof.main)
    return {
        "schema": 1,
        "settings": asdict(SETTINGS),
        "seed": proof.seed,
        "labels_sha256": proof.digest,
        "recordings": len(proof.main),
        "by_class": {cls: sum(case.label.cls == cls for case in proof.main) for cls in SETTINGS.population.shares},
        "seconds": proof.seconds,
        "environment": dict(proof.environment),
        "scores": methods,
        "confusion": {"true": rows, "named": columns, "count": table.tolist()},
        "bias": list(proof.bias),
    }


def case_columns(proof: Proof) -> dict[str, list[Any]]:
    """One row a recording and method."""
    cases = [case for cases in proof.cases.values() for case in cases]
    return {
        "case": [c.label.case for c in cases],
        "method": [c.verdict.method for c in cases],
        "class": [c.label.cls for c in cases],
        "design": [c.label.design for c in cases],
        "concealed": [_concealed(c.label) for c in cases],
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
    """Of a real rig, what was off in one number each."""
    if label.build is None:
        return ""
    slips = [name for name in ("gaps", "gross") if label.build[name]]
    return ", ".join([f"noise {label.build['noise']:.2f}", f"tension {label.build['tension']:.2f}", *slips])


def _missed(case: OpenedCase) -> str:
    """Errors elsewhere before and after, and how much bands cover."""
    return "; ".join(
        f"{m.name}: {1e3 * m.calibrated_m:.2f} -> {1e3 * m.explained_m:.2f} mm, covered {m.covered:.0%}"
        for m in case.missed
    )


def _right(case: OpenedCase) -> bool | None:
    return first_right(case) if case.label.effects else None


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _claims(verdict: Verdict) -> str:
    """Named effects with their values."""
    texts = []
    for claim in verdict.named:
        places = [f"{key} {value}" for key, value in claim.place.items()]
        values = [f"{name} {value[0]:.4g}" for name, value in claim.parameters.items()]
        texts.append(" ".join([claim.kind, *places, *values]) + (" (in part)" if claim.partial else ""))
    return "; ".join(texts)


def confusion_figure(proof: Proof) -> Figure:
    """Named effect by true effect, single effects above the detectable size."""
    rows, columns, table = confusion(proof.main)
    width = style.DOUBLE * style.MM
    figure = Figure(figsize=(width, width * (0.35 + 0.6 * len(rows) / max(len(columns), 1))), layout="constrained")
    axes = figure.subplots()
    share = table / np.maximum(table.sum(1, keepdims=True), 1)
    axes.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, k in zip(*np.nonzero(table), strict=True):
        axes.text(k, i, str(table[i, k]), ha="center", va="center", color="white" if share[i, k] > 0.6 else style.INK)
    axes.set_xticks(range(len(columns)), [name.replace("_", " ") for name in columns], rotation=60, ha="right")
    axes.set_yticks(range(len(rows)), [name.replace("_", " ") for name in rows])
    axes.set_xlabel("named first, or the verdict where nothing is")
    axes.set_ylabel("concealed")
    axes.grid(False)
    return figure
