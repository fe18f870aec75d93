"""Files on how the scores of the benchmark move with the settings of the diagnosis: a row for each setting."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from prb3r.markdown import markdown_table
from prb3r.model.files.cells import count
from prb3r.present.proof.scores import score_text
from prb3r.proof.judging.goals import Goal
from prb3r.proof.judging.intervals import Score
from prb3r.proof.settings import SETTINGS
from prb3r.proof.sweep import SettingsSweep, VariantScores
from prb3r.runs.files import write_whole


def publish_sweep(sweep: SettingsSweep, folder: Path) -> list[Path]:
    """Write `settings.md` and `settings.json` into a folder and return both paths."""
    folder.mkdir(parents=True, exist_ok=True)
    share = 100 * SETTINGS.protocol.sweep_share
    lines = [
        "# How scores move with the settings",
        "",
        f"{count(sweep.cases, 'recording')}, seed {sweep.seed}, {sweep.seconds / 60:.0f} minutes; labels sealed before "
        f"the first verdict: SHA-256 `{sweep.digest}`.",
        "",
        f"Each number moved by {share:g} % down / up, on the same recordings (whole numbers by one at least; of shares "
        "near one what is left to one). *Read*: recordings in whose diagnosis the number was looked at. *Changed*: "
        "those on which the verdict or a name is another, down / up. Scores: change in percentage points, the row on "
        "top as they are.",
        "",
        *sweep_table(sweep),
        "",
    ]
    text = write_whole(folder / "settings.md", "\n".join(lines).encode())
    return [text, write_whole(folder / "settings.json", json.dumps(plain_sweep(sweep), indent=1).encode())]


def sweep_table(sweep: SettingsSweep) -> list[str]:
    """Lines of a Markdown table: how the headline scores change as each setting is moved down / up.

    Settings on which the verdicts of most recordings depend come first; scores over no recording are left out.
    """
    headline = [(goal, score) for goal, score in sweep.scores if goal.short and score.count]
    shorts = [f"{goal.short} (n = {score.count})" for goal, score in headline]
    head = ["setting", "value", "moved to", "read", "changed", *shorts]
    rows = [["as they are", "", "", "", "", *(score_text(goal, score.value) for goal, score in headline)]]
    values = asdict(sweep.settings)
    pairs = sorted(zip(sweep.lower, sweep.higher, strict=True), key=lambda pair: -pair[0].changed - pair[1].changed)
    for low, high in pairs:
        cells = [f"{_change(low, goal, score)} / {_change(high, goal, score)}" for goal, score in headline]
        moved_to = f"{low.value:.4g} / {high.value:.4g}"
        changed = f"{low.changed} / {high.changed}"
        rows.append([low.field, f"{values[low.field]:.4g}", moved_to, str(low.read), changed, *cells])
    return markdown_table(head, rows, range(1, len(head)))


def _change(variant: VariantScores, goal: Goal, before: Score) -> str:
    """Change of a score from `before` to a variant of the settings, in percentage points."""
    change = 100 * (dict(_values(variant))[goal.name] - before.value)
    return "–" if not math.isfinite(change) else f"{change:+.1f}" if abs(change) >= 0.05 else "0"


def _values(variant: VariantScores) -> list[tuple[str, float]]:
    """Name and value of every score of a variant."""
    return [(goal.name, score.value) for goal, score in variant.scores]


def plain_sweep(sweep: SettingsSweep) -> dict[str, Any]:
    """A sweep as `settings.json` holds it: scores with all settings as they are, then with each one moved."""

    def plain_scores(scores: tuple[tuple[Goal, Score], ...]) -> list[dict[str, Any]]:
        return [{"score": goal.name, **asdict(score)} for goal, score in scores]

    values = asdict(sweep.settings)
    return {
        "schema": 1,
        "seed": sweep.seed,
        "labels_sha256": sweep.digest,
        "recordings": sweep.cases,
        "seconds": sweep.seconds,
        "settings": values,
        "scores": plain_scores(sweep.scores),
        "moved": [
            {
                "setting": variant.field,
                "value": values[variant.field],
                "moved_to": variant.value,
                "read": variant.read,
                "changed": variant.changed,
                "scores": plain_scores(variant.scores),
            }
            for pair in zip(sweep.lower, sweep.higher, strict=True)
            for variant in pair
        ],
    }
