"""A comparison of designs on disk: text, table and a figure."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from prb3r.present import style
from prb3r.present.page import save_figure
from prb3r.runs import store
from prb3r.study.designs import Comparison


def publish_comparison(comparison: Comparison, folder: Path) -> list[str]:
    """Write `comparison.md`, `comparison.parquet` and `comparison.png/svg`; the names written."""
    store.ensure_writable(folder)
    store.write_whole(folder / "comparison.md", (comparison.markdown() + "\n").encode())
    values = comparison.values
    columns = {"design": list(values.index), "on_pareto_front": comparison.front}
    store.write(
        store.table(columns | {name: values[name].to_numpy(float) for name in values}, comparison.quantities),
        folder / "comparison.parquet",
    )
    with matplotlib.rc_context(style.RC):
        figures = save_figure(profile(comparison), folder, "comparison")
    return ["comparison.md", "comparison.parquet", *(path.name for path in figures)]


def profile(comparison: Comparison) -> Figure:
    """Designs over the objectives, each as a share of the best design there: 1 is best."""
    figure = Figure(figsize=(style.DOUBLE / 25.4, 0.34 * len(comparison.objectives) + 0.9), layout="constrained")
    axes = figure.subplots()
    rows = np.arange(len(comparison.objectives))[::-1]
    values = comparison.values.to_numpy(float)
    looks = style.looks(list(comparison.values.index))
    for k, (name, look) in enumerate(looks.items()):
        worth = []
        for j, objective in enumerate(comparison.objectives):
            column = np.abs(values[:, j])
            worth.append(column.min() / column[k] if objective.better == "low" else column[k] / column.max())
        label = name + ("" if comparison.front[k] else " (dominated)")
        axes.plot(worth, rows, color=look.colour, marker=look.marker, ls=look.line, lw=0.8, label=label)
    axes.set_yticks(rows, [objective.words for objective in comparison.objectives])
    axes.set_xlim(0, 1.05)
    axes.set_xlabel("worth, as a share of the best design")
    figure.legend(loc="outside lower center", ncols=min(4, len(values)))
    return figure
