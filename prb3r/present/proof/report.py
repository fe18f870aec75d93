"""Files of the benchmark: a page, its numbers as JSON, a row for each recording, and the confusion matrix."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from prb3r.markdown import markdown_table
from prb3r.model.files.cells import count
from prb3r.present import rc, style
from prb3r.present.figure_files import save_figure
from prb3r.present.proof.cases import case_columns, concealed_text
from prb3r.present.proof.real import real_section
from prb3r.present.proof.scores import goal_text, scores_table
from prb3r.proof.judging.breakdown import by_effect, confusion
from prb3r.proof.judging.opened import OpenedCase, failed
from prb3r.proof.prove import Proof
from prb3r.proof.settings import SETTINGS
from prb3r.runs.files import write_whole
from prb3r.runs.store import arrow_table, write_arrow


def publish_proof(proof: Proof, folder: Path) -> list[Path]:
    """Write `proof.md`, `proof.json`, the table of recordings as `cases.parquet` and `recordings.csv`, and the figure
    `confusion`, if any recording counts in it; the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    singles = bool(confusion(proof.main)[0])
    with rc.in_use():
        figures = save_figure(confusion_figure(proof), folder, "confusion") if singles else []
    text = write_whole(folder / "proof.md", proof_page(proof).encode())
    write_whole(folder / "recordings.csv", pd.DataFrame(case_columns(proof)).to_csv(index=False).encode())
    numbers = write_whole(folder / "proof.json", json.dumps(plain_proof(proof), indent=1, default=str).encode())
    write_arrow(
        arrow_table(case_columns(proof), provenance={"seed": proof.seed, "labels": proof.digest}),
        folder / "cases.parquet",
    )
    return [text, numbers, folder / "recordings.csv", folder / "cases.parquet", *figures]


def proof_page(proof: Proof) -> str:
    """A run of the benchmark in Markdown: how it was made, its seal, scores with goals, and tables in detail."""
    git = proof.environment["git"]
    revision = f"{git['revision'][:12]}{' with changes' if git['dirty'] else ''}" if git else "unknown"
    seconds = [case.verdict.seconds for case in proof.main]
    lines = [
        "# Concealed effects",
        "",
        f"{count(len(proof.main), 'recording')} of {count(len(proof.designs), 'design')}, "
        f"seed {proof.seed}, revision {revision}, "
        f"{proof.environment['written']}, {proof.environment['platform']}; {proof.seconds / 60:.0f} minutes in all, "
        f"{np.median(seconds):.1f} s a diagnosis (median), {max(seconds):.0f} s the longest.",
        "",
        f"Labels sealed before the first verdict: SHA-256 `{proof.digest}`.",
        "",
        *scores_table(proof),
        "",
        "Shares with Wilson intervals (clustered by design), medians with intervals of order "
        "statistics, held-out error pooled with a bootstrapped interval. *Met* by the point estimate, *shown* by the "
        "whole interval. Numbers in brackets: on how many of the recordings another method was judged. A failure "
        "counts against every score it belongs to. "
        "Seconds are those of a processor.",
        "",
        f"Engine less rig without effects, whitened norm of a whole recording: at most "
        f"{max(proof.bias, default=0.0):.2g} over all designs.",
        "",
        *real_section(proof),
        "",
        *(
            ["![Named effect by true effect](confusion.png)", "", *_effects(proof), ""]
            if confusion(proof.main)[0]
            else []
        ),
        *_hidden(proof),
        "",
        *_designs(proof),
        "",
    ]
    return "\n".join(lines)


def _effects(proof: Proof) -> list[str]:
    """The section on single effects: scores by kind and size."""
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
    """The section on recordings whose effect calibration can hide: constants as calibration alone would have them."""
    chosen = [case for case in proof.main if _is_hidden(case)]
    if not chosen:
        return []
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
    return lines + markdown_table(head, [_hidden_row(case) for case in chosen])


def _is_hidden(case: OpenedCase) -> bool:
    """Whether a recording is of the class `hidden` and has a verdict."""
    return case.label.cls == "hidden" and not failed(case)


def _hidden_row(case: OpenedCase) -> list[str]:
    """A row of that section: errors of E and mu in percent of their true values, in three calibrations."""
    label, verdict = case.label, case.verdict
    estimates = [verdict.loading[:2] if verdict.loading else None, verdict.calibrated, verdict.explained]
    errors = [
        f"{100 * np.expm1(value - true):+.1f} %" if estimate else "–"
        for estimate in estimates
        for value, true in zip(estimate or (0.0, 0.0), label.constants, strict=True)
    ]
    chance = f"{verdict.loading[2]:.2g}" if verdict.loading else "–"
    said = ", ".join(claim.kind for claim in verdict.named) or verdict.verdict
    return [str(label.case), concealed_text(label), chance, *errors, said]


def _designs(proof: Proof) -> list[str]:
    """The section on designs other than real rigs, with the bias of the engine on each; empty without any."""
    bench = [design for design in proof.designs if not design.flavour.is_real]
    rows = [{**design.described(), "bias": bias} for design, bias in zip(bench, proof.bias, strict=True)]
    if not rows:
        return []
    cells = [[f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()] for row in rows]
    return ["## Designs", "", *markdown_table(list(rows[0]), cells)]


def plain_proof(proof: Proof) -> dict[str, Any]:
    """A run as `proof.json` holds it: settings, seal, scores of every method with intervals, confusion matrix."""
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


def confusion_figure(proof: Proof) -> Figure:
    """The confusion matrix: the effect named first by the true effect, of single effects above the detectable size."""
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
