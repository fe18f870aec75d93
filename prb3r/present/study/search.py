"""The search for the best design in a report: how many designs were tried, and whether the search has settled."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from prb3r.model.files.cells import count
from prb3r.present import canvas, rc, style
from prb3r.present.spots import point_at
from prb3r.present.study.section import Section
from prb3r.study.decision import Decision
from prb3r.study.designs import design_names
from prb3r.study.recommend import LEVEL
from prb3r.study.settled import unsettled
from prb3r.study.spec import Study

SEARCH_CAPTION = (
    "The score of each design and the best so far, in the order in which they were tried: where the line ends flat, "
    "the last designs were no better by the given weights; the rest of the front may still have moved."
)


def search_section(study: Study, cases: pd.DataFrame, decision: Decision) -> Section:
    """How many designs were tried, which was best, and whether more of them would have changed that."""
    tried, able = len(decision.designs), int(decision.feasible.sum())
    were = "was" if tried == 1 else "were"
    said = [f"{count(tried, 'design', ',')} {were} tried; {able:,} of them keep{'s' * (able == 1)} every requirement."]
    if decision.preferences:
        said[0] = said[0][:-1] + f", {sum(decision.front):,} are on the Pareto front."
    score = merit(decision)
    if able:
        best = np.maximum.accumulate(np.where(np.isfinite(score), score, -np.inf))
        first = int(np.argmax(best))
        level = int(np.argmax(best >= best[-1] - LEVEL))
        said.append(
            f"The best of them was number {first + 1:,}; from number {level + 1:,} on the best score has grown by less "
            f"than {LEVEL:g}."
        )
        if level > 0.9 * tried:
            said.append("**The search has not settled: try more designs.**")
    if moving := unsettled(decision):
        said.append(f"**{moving}**")
    said += _at_the_ends(study, cases, decision)
    note = "Scores are those of the ranking, by the given weights." if decision.preferences else "Scores are reserves."
    return Section("Search", said, [], note)


def merit(decision: Decision) -> np.ndarray:
    """(d,) the number by which designs are ranked: score or, without preferences, smallest reserve.

    NaN for designs that break a requirement.  Scores are those among all designs that keep the requirements where a
    single one is on the Pareto front, as always with one preference.
    """
    if decision.preferences:
        return decision.score if sum(decision.front) > 1 else decision.score_of_kept
    return np.where(decision.feasible, decision.margins.min(1, initial=np.inf), np.nan)


def _at_the_ends(study: Study, cases: pd.DataFrame, decision: Decision) -> list[str]:
    """A sentence for each searched factor that the best design has within 1 % of an end of its range."""
    if decision.winner is None:
        return []
    said = []
    row = cases.iloc[design_names(cases, study.design_factors).index(decision.winner)]
    for factor in study.searched:
        ends = factor.range
        assert ends is not None
        near = 0.01 * (ends.high - ends.low)
        end = "low" if row[factor.name] - ends.low < near else "high" if ends.high - row[factor.name] < near else ""
        if end:
            title = style.quantity_of(factor.name, ()).title
            said.append(
                f"{title} of the best design lies at the {end} end of its range: a wider one may hold a better design."
            )
    return said


def search_picture(decision: Decision) -> Figure:
    """The score of every design, and the best so far, in the order in which they were tried."""
    with rc.in_use():
        return _search_figure(decision)


def _search_figure(decision: Decision) -> Figure:
    figure, (axes,) = canvas.panels([""], [], 0.62)
    number, score = np.arange(1, len(decision.designs) + 1), merit(decision)
    able = np.isfinite(score)
    axes.plot(number[able], score[able], ls="", marker=".", ms=3, color=style.PALE, label="keeps every requirement")
    out = number[~decision.feasible]
    edge = np.full(len(out), 0.02)
    axes.plot(out, edge, ls="", marker="x", ms=3, mew=0.6, color=style.QUIET, transform=axes.get_xaxis_transform())
    axes.plot([], [], ls="", marker="x", ms=3, mew=0.6, color=style.QUIET, label="breaks a requirement")
    best = np.maximum.accumulate(np.where(able, score, -np.inf))
    shown = np.isfinite(best)
    axes.step(number[shown], best[shown], where="post", color=style.PALETTE[0], label="best so far")
    point_at(axes, np.stack([number, score], 1), number - 1)
    axes.set(xlabel="designs tried", ylabel="score" if decision.preferences else "smallest reserve")
    canvas.legend(figure, axes, 2)
    return figure
