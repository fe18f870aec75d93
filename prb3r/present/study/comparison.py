"""A comparison of designs on disk: text, table and a figure."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from prb3r.markdown import markdown_table
from prb3r.present import style
from prb3r.present.page import save_figure
from prb3r.runs.files import ensure_writable, write_whole
from prb3r.runs.store import arrow_table, write_arrow
from prb3r.study.designs import DesignComparison, recommendation, value_in_words


def publish_comparison(comparison: DesignComparison, folder: Path) -> list[str]:
    """Write `comparison.md`, `comparison.parquet` and `comparison.png/svg`; the names written."""
    ensure_writable(folder)
    write_whole(folder / "comparison.md", (comparison_page(comparison) + "\n").encode())
    values = comparison.values
    columns = {"design": list(values.index), "on_pareto_front": comparison.front}
    write_arrow(
        arrow_table(columns | {name: values[name].to_numpy(float) for name in values}, comparison.quantities),
        folder / "comparison.parquet",
    )
    with matplotlib.rc_context(style.RC):
        figures = save_figure(worth_figure(comparison), folder, "comparison")
    return ["comparison.md", "comparison.parquet", *(path.name for path in figures)]


def comparison_page(comparison: DesignComparison) -> str:
    """Table, Pareto front and recommendation as Markdown; the best values are bold."""
    rows = [
        [f"{objective.words} ({objective.better} is better)", *_cells(comparison, k)]
        for k, objective in enumerate(comparison.objectives)
    ]
    rows.append(["on the Pareto front", *("**yes**" if on else "no" for on in comparison.front)])
    note = f"Worst value over the {comparison.shared} cases that all designs share"
    if comparison.failed:
        note += f"; {comparison.failed} of them left out because a design has no stable equilibrium there"
    if comparison.left_out:
        note += f"; {comparison.left_out} cases that only some designs have are not used"
    table = markdown_table(["", *comparison.values.index], rows)
    return "\n".join([*table, "", f"{note}. Best values in bold.", "", *recommendation(comparison)])


def _cells(comparison: DesignComparison, k: int) -> list[str]:
    """The values of one objective, a design each."""
    column, scores = comparison.values.iloc[:, k], comparison.scores[:, k]
    texts = [value_in_words(value, comparison.quantities[k]) for value in column]
    return [f"**{text}**" if score == scores.max() else text for text, score in zip(texts, scores, strict=True)]


def worth_figure(comparison: DesignComparison) -> Figure:
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
