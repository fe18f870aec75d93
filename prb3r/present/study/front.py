"""Figures of a decision: reserve of each design to the requirements, worth by the preferences, and the Pareto front."""

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from prb3r.present import canvas, style
from prb3r.present.legends import SHORT_HANDLE, legend_columns, without_repeats
from prb3r.present.spots import point_at
from prb3r.study.decision import NOT_TO_BE_HAD, Decision
from prb3r.study.phrases import bound_in_words, wish_in_words

MOST_TOLD_APART = 6
"""Designs that have a look of their own at most, the first in the ranking; the others are grey."""
PLACES = "best", "second", "third"
"""Names of designs by their places in the ranking, where their own names are too long for a legend."""
MOST_WITH_LONG_NAMES = len(PLACES)
"""Designs that have a look of their own at most if a name is too long for a legend."""
FULL_RESERVE = 1.0
"""Reserves beyond this share of the bound, to either side, are drawn at the edge."""
LABEL_LETTERS = 48
"""Letters of a label that fit along the x axis of a figure of one column; longer names are too long for a legend."""
ROW_LETTERS = 60
"""Letters of a line beside a row: longer lines leave the panel too little room for what is written below it."""
UPRIGHT_LETTERS = 36
"""Letters of a label that fit along the y axis."""
MOST_OTHERS = 40
"""With more designs, the grey ones are left out of the reserves, where they would lie on top of each other."""
LEGEND_ROW = 4.0
"""Height of a row of a legend, mm."""
Ink = dict[str, Any]
"""Keyword arguments of a drawing function of matplotlib."""
OTHERS = style.Look(style.PALE, ".", "-", "")
"""Look of designs without one of their own."""


def looks_of(decision: Decision) -> dict[int, style.Look]:
    """The look of each design, by its number.

    The best ranked designs have their own, then, if there is room, those that break requirements by the least.
    """
    out = [k for k in np.argsort(-decision.margins.min(1, initial=np.inf)) if not decision.feasible[k]]
    long = max(map(len, decision.designs)) > LABEL_LETTERS
    apart = [*decision.ranking, *map(int, out)][: MOST_WITH_LONG_NAMES if long else MOST_TOLD_APART]
    looks = style.looks([decision.designs[k] for k in apart])
    return {k: looks[decision.designs[k]] if k in apart else OTHERS for k in range(len(decision.designs))}


def decision_figure(decision: Decision) -> Figure:
    """Two panels with all designs: their reserve to each requirement, and below it their worth by each preference.

    Raises
    ------
    ValueError
        Without requirements and with at most one design on the front, as there is nothing to compare then.
    """
    choice = decision.preferences if sum(decision.front) > 1 else []
    heights = [len(part) + 0.6 for part in (decision.requirements, choice) if part]
    if not heights:
        raise ValueError("nothing to lay side by side")
    looks = {k: look for k, look in looks_of(decision).items() if _shown_beside(decision, look)}
    handles = _design_handles(decision, looks)
    beside = legend_columns([str(handle.get_label()) for handle in handles], style.DOUBLE)
    height = 7.5 * sum(heights) + 15 * len(heights) + LEGEND_ROW * -(-len(handles) // beside)
    count = len(heights)
    figure, grid = canvas.axes_grid((style.DOUBLE, height), (count, 1), count, height_ratios=heights)
    panels = iter(grid.ravel())
    if decision.requirements:
        axes, quantities = next(panels), decision.quantities[: len(decision.requirements)]
        axes.axvspan(-1.2, 0, color="#f3e3e5", lw=0)
        axes.axvline(0, color=style.ALARM, lw=0.8)
        reserves = np.clip(np.nan_to_num(decision.margins), -FULL_RESERVE, FULL_RESERVE)
        words = [
            f"{wish_in_words(requirement, q)},\n{bound_in_words(requirement, q, decision.beside(r))}"
            for r, (requirement, q) in enumerate(zip(decision.requirements, quantities, strict=True))
        ]
        _rows(axes, reserves, words, looks)
        axes.set_xlim(-1.07 * FULL_RESERVE, 1.07 * FULL_RESERVE)
        axes.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %".replace("-", "−"))
        axes.set_xlabel("reserve to the bound (left of 0: broken;\nmore than 100 % at the edge)")
    if choice:
        axes = next(panels)
        quantities = decision.quantities[len(decision.requirements) :]
        words = [wish_in_words(*pair) for pair in zip(choice, quantities, strict=True)]
        _rows(axes, decision.worth, words, looks)
        least = np.nanmin(decision.worth[list(looks)], initial=0.0)
        axes.set_xlim(1.05 * least - 0.05, 1.05)
        below = ", below 0: worse than these" if least < 0 else ""
        below += ", −1: no value" if least <= NOT_TO_BE_HAD else ""
        axes.set_xlabel(f"worth, from the worst (0) to the best (1)\nof the designs to choose from{below}")
    canvas.legend(figure, grid[-1, 0], beside, handles)
    return figure


def _shown_beside(decision: Decision, look: style.Look) -> bool:
    """Whether a design with this look is drawn: of more than `MOST_OTHERS` only those with a look of their own."""
    return look is not OTHERS or len(decision.designs) <= MOST_OTHERS


def _design_handles(decision: Decision, looks: dict[int, style.Look]) -> list[Line2D]:
    """Legend entries of the designs with a look of their own, best first, and one of all others."""
    order = [*(k for k in decision.ranking if k in looks), *(k for k in looks if not decision.feasible[k])]
    handles = []
    apart = [k for k in order if looks[k] is not OTHERS]
    for k, name in zip(apart, legend_names(decision, apart), strict=True):
        handles.append(_handle(looks[k], style.literal(name) + ("" if decision.feasible[k] else " (out)")))
    if len(handles) < len(order):
        handles.append(_handle(OTHERS, "others"))
    return handles


def legend_names(decision: Decision, apart: Sequence[int]) -> list[str]:
    """Names of the designs `apart` in a legend: their own or, if one is too long, their places in the ranking.

    Designs without such a place keep their own names.
    """
    names = without_repeats([decision.designs[k] for k in apart])
    if max(map(len, names), default=0) <= LABEL_LETTERS:
        return names
    places = dict(zip(decision.ranking, PLACES, strict=False))
    return [places.get(k, decision.designs[k]) for k in apart]


def _handle(look: style.Look, label: str) -> Line2D:
    return Line2D([], [], color=look.colour, marker=look.marker, ls=look.line, label=label)


def _rows(axes: Axes, values: np.ndarray, words: Sequence[str], looks: dict[int, style.Look]) -> None:
    """Draw `values` (designs, rows) in a panel with a row for each column; designs with their own look lie on top."""
    rows = np.arange(values.shape[1])[::-1]
    for k in sorted(looks, key=lambda k: looks[k] is not OTHERS):
        look = looks[k]
        axes.plot(values[k], rows, color=look.colour, marker=look.marker, ls=look.line, lw=0.8, clip_on=False)
    axes.set_yticks(rows, ["\n".join(textwrap.fill(line, ROW_LETTERS) for line in text.split("\n")) for text in words])
    axes.set_ylim(-0.5, len(words) - 0.5)


def front_figure(decision: Decision) -> Figure:
    """All designs over the two preferences of greatest weight; the Pareto front of these two is joined.

    Raises
    ------
    ValueError
        With fewer than two preferences.
    """
    if len(decision.preferences) < 2:
        raise ValueError("a front needs two preferences")
    columns = np.sort(np.argsort(-decision.weights, kind="stable")[:2])
    quantities = [decision.quantities[len(decision.requirements) + j] for j in columns]
    shown = [style.shown(q, decision.values.iloc[:, j]) for q, j in zip(quantities, columns, strict=True)]
    x, y = (decision.values.iloc[:, j].to_numpy(float) * s.factor for j, s in zip(columns, shown, strict=True))
    looks = looks_of(decision)
    apart = [k for k in decision.ranking if looks[k] is not OTHERS]
    short = legend_names(decision, apart)
    told = {k: textwrap.fill(style.literal(name), LABEL_LETTERS) for k, name in zip(apart, short, strict=True)}
    with matplotlib.rc_context({"legend.handlelength": SHORT_HANDLE}):
        beside = legend_columns(["breaks a requirement", "Pareto front", *told.values()], style.SINGLE)
    rows = (sum(text.count("\n") + 1 for text in told.values()) + 2) / beside + 1
    size = style.SINGLE, 0.68 * style.SINGLE + LEGEND_ROW * rows
    figure, ((axes,),) = canvas.axes_grid(size, (1, 1), 1)
    out = ~decision.feasible
    many = len(decision.designs) > MOST_OTHERS
    if out.any():
        crosses: Ink = {"ms": 2.5, "mew": 0.5, "alpha": 0.5, "zorder": 1.5} if many else {"ms": 4, "mew": 0.9}
        axes.plot(x[out], y[out], ls="", marker="x", color=style.QUIET, label="breaks a requirement", **crosses)
    edge = _edge(decision.scores[:, columns], decision.feasible)
    ink: Ink = {"lw": 0.9, "ls": (0, (4, 2)), "zorder": 2.5}
    if edge:
        axes.plot(x[edge], y[edge], color=style.QUIET, label="Pareto front", **ink)
    if many and decision.feasible.any():  # what breaks a requirement may lie anywhere
        axes.set(xlim=_around(x[decision.feasible]), ylim=_around(y[decision.feasible]))
    for k in sorted(decision.ranking, key=lambda k: looks[k] is not OTHERS):
        look = looks[k]
        axes.plot(x[k], y[k], ls="", marker=look.marker, color=look.colour, ms=5, label=told.get(k))
    point_at(axes, np.stack([x, y], 1), np.arange(len(x)))
    sides = (axes.set_xlabel, LABEL_LETTERS), (axes.set_ylabel, UPRIGHT_LETTERS)
    for (setter, letters), j, s in zip(sides, columns, shown, strict=True):
        preference = decision.preferences[j]
        words = wish_in_words(preference, decision.quantities[len(decision.requirements) + j])
        better = "→" if preference.better == "greater" else "←"
        text = f"{words[:1].upper()}{words[1:]}{f' ({s.unit})' if s.unit else ''}, better\N{NO-BREAK SPACE}{better}"
        setter(textwrap.fill(text, letters))
    axes.locator_params(axis="x", nbins=6)
    canvas.legend(figure, axes, beside, handlelength=SHORT_HANDLE)
    return figure


def _around(values: np.ndarray) -> tuple[float, float]:
    """Ends of an axis that shows all finite values with a margin."""
    low, high = np.min(values[np.isfinite(values)]), np.max(values[np.isfinite(values)])
    room = 0.15 * (high - low) or 0.1 * abs(high) or 1.0
    return float(low - room), float(high + room)


def _edge(scores: np.ndarray, feasible: np.ndarray) -> list[int]:
    """Designs on the Pareto front of two preferences, from the worst to the best by the first of them.

    `scores` (d, 2), greater is better; `feasible` (d,) whether a design keeps the requirements.
    """
    edge = [
        k
        for k in np.flatnonzero(feasible).tolist()
        if not any(np.all(scores[j] >= scores[k]) and np.any(scores[j] > scores[k]) for j in np.flatnonzero(feasible))
    ]
    return sorted(edge, key=lambda k: scores[k, 0])
