"""The plot `path`: targets of a disk, where the disk comes, and the manipulator at some of them; with sentences."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from prb3r.inverse.target import COORDINATES, Target, chain_targets
from prb3r.model.files.cells import count
from prb3r.present import canvas, style
from prb3r.present.framing import to_scale, view_of
from prb3r.present.spots import point_at
from prb3r.present.study.section import Section
from prb3r.present.study.shapes import Body, body, draw_body, draw_ghost, not_drawn, notes, straight
from prb3r.present.study.sheet import Scene, Sheet
from prb3r.study.designs import factor_value_in_words
from prb3r.study.plots.kinds import PathPlot
from prb3r.study.run import Result

DRAWN_STATES = 4
"""Manipulators that are drawn along a path, evenly spaced from the first to the last target."""
MOST_TOLD_PATHS = 24
"""Cases that have a sentence at most; all are in the table."""
MISSED_NOTE = (
    "Each target is sought from the target before, with the slips of that change. Missed targets: the disk is as near "
    "as a pull from there was found to bring it; those that are reached alone, from rest, are counted."
)
REACHED: dict[str, Any] = {"ls": "", "marker": "o", "ms": 3.2, "mfc": "white", "mec": style.INK, "mew": 0.8}
MISSED: dict[str, Any] = {"ls": "", "marker": "x", "ms": 4.5, "mew": 1.2, "color": style.ALARM}


def paths_figure(sheet: Sheet[PathPlot]) -> Figure:
    """The way of a disk past its targets, with the manipulator at some of them; missed targets are crosses."""
    if sheet.states is None:
        raise ValueError(f"plot {sheet.plot.name!r} draws paths and needs states")
    titles, parts = sheet.panels()
    ways = {case: _Way.of(sheet, case) for part in parts for case in part["case_id"]}
    corners = np.concatenate([way.corners for way in ways.values()])
    failed = [
        not_drawn(sheet, row, f"{count} of {len(ways[row['case_id']].targets)} targets not reached")
        for part in parts
        for _, row in part.iterrows()
        if (count := int((~ways[row["case_id"]].reached).sum()))
    ]
    marks = [
        Line2D([], [], **REACHED, label="target"),
        Line2D([], [], **MISSED, label="not reached, and the way to it"),
    ]
    marks = [
        mark for mark, drawn in zip(marks, (any(w.reached.any() for w in ways.values()), failed), strict=True) if drawn
    ]
    figure, axes = canvas.panels(
        titles, [*sheet.handles(solid=True), *marks, *notes(failed, mark={"ls": ""})], view_of(corners)[2]
    )
    for panel, part in zip(axes, parts, strict=True):
        for look, _, group in sheet.groups(part):
            for case in group["case_id"]:
                ways[case].draw(panel, look)
                point_at(panel, 1e3 * ways[case].places[:, :2], case, ways[case].steps, to_scale=True)
        to_scale(panel, corners)
    canvas.outer_labels(axes, "$x$ (mm)", "$y$ (mm)")
    return figure


class _Way:
    """The targets of a case, the places where its disk comes, and the manipulators to draw.

    `at` has the states of the disk, a row for each target; `rest` is the straight manipulator.
    """

    def __init__(self, targets: list[Target], at: pd.DataFrame, rest: Body, bodies: list[Body]) -> None:
        self.targets, self.rest, self.bodies = targets, rest, bodies
        places, steps = at[list(COORDINATES)].to_numpy(float), at["step"].to_numpy()
        if not len(places):  # a case that failed has no states
            places, steps = np.full((len(targets), len(COORDINATES)), np.nan), np.arange(1, len(targets) + 1)
        self.places, self.steps = places, steps
        self.reached = np.array([target.reached(place) for target, place in zip(targets, places, strict=True)])

    @classmethod
    def of(cls, sheet: Sheet[PathPlot], case: int) -> "_Way":
        """The way of a case, from the table of states."""
        manipulator, states = sheet.scene.manipulator(int(case)), sheet.states
        assert states is not None
        targets = targets_of_case(sheet.scene, int(case))
        rows = states[states["case_id"] == case]
        at = rows[rows["disk"] == targets[0].disk].sort_values("step")
        steps = at["step"].to_numpy()
        some = steps[np.linspace(0, len(steps) - 1, DRAWN_STATES).round().astype(int)] if len(steps) else steps
        shown = [rows[rows["step"] == step] for step in dict.fromkeys(some.tolist())]
        bodies = [body(manipulator, state) for state in shown if state["x_m"].notna().all()]
        return cls(targets, at, straight(manipulator), bodies)

    @property
    def corners(self) -> np.ndarray:
        """(n, 2) points that the picture must show, m: targets, places of the disk, manipulators."""
        wanted = np.array([target.wanted[:2] for target in self.targets])
        points = [np.where(np.isfinite(wanted), wanted, self.places[:, :2]), self.places[:, :2]]
        points += [drawn.disks.reshape(-1, 2) for drawn in (self.rest, *self.bodies)]
        corners = np.concatenate(points)
        return corners[np.isfinite(corners).all(1)]

    def draw(self, axes: Axes, look: style.Look) -> None:
        """Draw manipulators, the way of the disk and targets; a line from each missed one to the disk, and the number
        of the first."""
        draw_ghost(axes, self.rest)
        strongest = max((tension.max() for drawn in self.bodies for tension in drawn.tensions), default=0.0)
        for drawn in self.bodies:
            draw_body(axes, drawn, look, "-", strongest)
        axes.plot(*1e3 * self.places[:, :2].T, color=look.colour, lw=1.2, zorder=3.2)
        for target, place, reached in zip(self.targets, self.places, self.reached, strict=True):
            wanted = np.where(np.isfinite(target.wanted[:2]), target.wanted[:2], place[:2])
            axes.plot(*1e3 * wanted, **(REACHED if reached else MISSED), zorder=3.4)
            if not reached:
                axes.plot(*1e3 * np.stack([wanted, place[:2]], 1), color=style.ALARM, lw=0.5, zorder=3.1)
        if not self.reached.all():
            first = int(np.argmin(self.reached))
            x, y, *_ = 1e3 * np.array(self.targets[first].wanted, float)
            if np.isfinite([x, y]).all():
                axes.annotate(f"{first + 1}", (x, y), (-2, -11), textcoords="offset points", color=style.ALARM, size=7)


def targets_of_case(scene: Scene, case: int) -> list[Target]:
    """The targets of a case, in their order."""
    reach, chain = scene.reach(case), scene.manipulator(case).chain()
    return chain_targets(chain, chain.plates if reach["disk"] == "tip" else reach["disk"], reach["target"])


def paths_section(result: Result, scene: Scene) -> Section:
    """A section with a sentence for each case: how many targets are reached, the first that is missed, tensions.

    Without the metric `follow` it has no sentences.
    """
    said = list(_followed(result, scene)) if "reached_share" in result.cases else []
    return Section("Along the path", said, [], MISSED_NOTE)


def _followed(result: Result, scene: Scene) -> Iterator[str]:
    """The sentences of that section, of the first `MOST_TOLD_PATHS` cases."""
    factors = [factor.name for factor in result.plan.study.factor]
    for row in result.cases.head(MOST_TOLD_PATHS).to_dict("records"):
        named = ", ".join(
            f"{style.quantity_of(name, ()).title}: {factor_value_in_words(name, row[name]) or 'none'}"
            for name in factors
        )
        before = f"**{named}.** " if named else ""
        if row["outcome"] != "converged" or pd.isna(row["reached_share"]):
            yield f"{before}{row['reason'] or row['outcome']}."
            continue
        targets = targets_of_case(scene, row["case_id"])
        met = round(row["reached_share"] * len(targets))
        force = f"highest tension {row['highest_tension_n']:.4g} N, highest sum {row['highest_sum_n']:.4g} N"
        if met == len(targets):
            yield f"{before}{'Target' if met == 1 else f'All {met} targets'} reached; {force}."
            continue
        first = int(row["first_missed"])
        place = ", ".join(
            f"{name.split('_')[0]} {value:.4g} {name.split('_')[1]}"
            for name, value in zip(COORDINATES, targets[first - 1].wanted, strict=True)
            if np.isfinite(value)
        )
        alone = round(row["reachable_share"] * len(targets)) - met
        rest = (
            f"; {alone} more reached from rest (`prb3r reach` with that target alone tells the pull)" if alone else ""
        )
        off = [f"{1e3 * row['farthest_off_m']:.3g} mm"] if row["farthest_off_m"] > 0 else []
        off += [f"{row['most_turned_off_rad']:.3g} rad"] if row["most_turned_off_rad"] > 0 else []
        yield (
            f"{before}{met} of {count(len(targets), 'target')} reached; the first that is not is number {first} "
            f"({place}); at most {' and '.join(off)} off{rest}; {force}."
        )
