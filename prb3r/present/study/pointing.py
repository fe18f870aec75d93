"""What a page shows of the case that a reader points at: its text and, where states are kept, its manipulator."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from prb3r.mechanics.chain import loads
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.present.spots import LAST
from prb3r.present.study.comparison import designs_told
from prb3r.present.study.firsts import disk_half, packed_state, stored_states, tensions_in_words
from prb3r.present.study.source import Source
from prb3r.study.cases import Case
from prb3r.study.cloud import limits_of
from prb3r.study.decision import Decision
from prb3r.study.designs import design_names
from prb3r.study.loading import Cloud
from prb3r.study.run import Result
from prb3r.study.workspace import cloud_tension

MOST_FRAMES = 3000
"""States of load paths that go into a page at most; where there are more, only the first cases have theirs."""
SAME_TIP_M = 1e-6
"""A manipulator that is solved again is drawn only if its tip is this near to that in the table, m."""


@dataclass(frozen=True)
class Pointed:
    """What a page knows of the cases, and designs, that a reader can point at, by the numbers in the spots."""

    figures: Mapping[str, Mapping[str, Any]]
    """Spots of each figure, by its name."""
    cases: Mapping[int, str]
    """Text on each case or design, by its number."""
    states: Mapping[str, tuple[list[int], str]] = field(default_factory=dict)
    """By `case:step`, or `case:-1` for the last step: `PackedState` of the manipulator."""
    half: float = 0.0
    """Half the height of a disk, mm."""
    paths: Sequence[tuple[int, list[int]]] = ()
    """Cases whose paths can be played, with the numbers of their steps."""

    @property
    def plain(self) -> dict[str, Any]:
        """The fields by their names, with plain lists, as the script of the page gets them in JSON."""
        return vars(self) | {"paths": list(self.paths)}


def about_designs(spots: Mapping[str, Any] | None, cases: int) -> dict[str, Any] | None:
    """Spots of designs, renumbered to follow those of all `cases` of the study, so that no number stands for both."""
    if spots is None:
        return None
    return {**spots, "points": [[*place, design + cases, step] for *place, design, step in spots["points"]]}


def pointed(
    source: Source,
    result: Result,
    kept: pd.DataFrame | None,
    figures: Mapping[str, Mapping[str, Any]],
    decision: Decision | None,
) -> Pointed:
    """Everything that the page of a study shows of the spots in its figures, and the load paths that it can play.

    Parameters
    ----------
    kept : the states that the figures are drawn from.
    figures : by name, as `spots_of` and `about_designs` give them.
    decision : between the designs, if the study makes one.
    """
    plan, count = result.plan, len(result.cases)
    asked = {(int(case), int(step)) for figure in figures.values() for *_, case, step in figure["points"]}
    wanted = {(case, step) for case, step in asked if case < count}
    states: dict[str, tuple[list[int], str]] = {}
    paths: list[tuple[int, list[int]]] = []
    if kept is not None:
        plates = plan.cases[0].manipulator().plates
        whole = kept["disk"].nunique() == plates + 1
        if plan.study.cloud is not None:
            loaded = sorted((case, step) for case, step in wanted if step != LAST)  # no load of a cloud is its last
            for case, steps in pd.DataFrame(loaded, columns=["case", "step"]).groupby("case")["step"]:
                states |= _of_cloud(plan.cases[int(case)], steps.to_numpy(), kept[kept["case_id"] == case])
        elif whole:
            paths = _paths(kept) if plan.study.states == "path" else []
            played = {(case, step) for case, steps in paths for step in steps}
            states = dict(stored_states(kept, wanted | played))
    first = _first_cases(source, decision) if decision else []
    if kept is not None and plan.study.cloud is None and whole and first:
        stood = dict(stored_states(kept, {(case, LAST) for case in first}))
        keys = {k: f"{case}:{LAST}" for k, case in enumerate(first)}
        states |= {f"{count + k}:{LAST}": stood[key] for k, key in keys.items() if key in stood}
    shown = source.cases[source.cases["case_id"].isin({case for case, _ in wanted} | {case for case, _ in paths})]
    known = {int(row["case_id"]): source.told(row) for row in shown.to_dict("records")}
    if decision is not None:
        known |= {count + k: text for k, text in enumerate(designs_told(decision)) if (count + k, LAST) in asked}
    half = disk_half(plan.cases[0].manipulator())
    return Pointed(figures, known, states, round(half, 2), paths)


def _first_cases(source: Source, decision: Decision) -> list[int]:
    """Number of the first case of each design of the decision."""
    names = design_names(source.cases, source.study.design_factors)
    first = dict(zip(reversed(names), reversed(source.cases["case_id"].tolist()), strict=True))
    return [first[name] for name in decision.designs]


def _paths(states: pd.DataFrame) -> list[tuple[int, list[int]]]:
    """Cases with more than two steps in equilibrium, and these steps, up to `MOST_FRAMES` states in all."""
    paths, room = [], MOST_FRAMES
    for case, part in states[np.isfinite(states["x_m"])].groupby("case_id"):
        steps = sorted(part["step"].unique().tolist())
        room -= len(steps)
        if room < 0:
            break
        if len(steps) > 2:
            paths.append((int(case), steps))
    return paths


def _of_cloud(case: Case, steps: np.ndarray, kept: pd.DataFrame) -> dict[str, tuple[list[int], str]]:
    """States of the manipulator under some loads of a cloud (`steps`, from 1), solved again, by `case:step`.

    The table `kept` may hold tips alone; by these it is checked that the states are the same.
    """
    manipulator = case.manipulator()
    chain = manipulator.chain(case.settings["broken"])
    cloud = Cloud.model_validate(case.settings["cloud"])
    tension = cloud_tension(manipulator, limits_of(cloud, manipulator, chain), steps - 1)
    solved = equilibria_of(chain, loads(chain, tension), from_rest=True)
    tips = kept[kept["disk"] == kept["disk"].max()].set_index("step").loc[steps, ["x_m", "y_m"]].to_numpy(float)
    states = {}
    for row, step in enumerate(steps):
        places = np.stack([solved.x[row], solved.y[row], solved.angle[row]], -1)
        if np.isfinite(places).all() and np.abs(places[-1, :2] - tips[row]).max() < SAME_TIP_M:
            pulls = dict(zip(manipulator.cable_names, tension[row].tolist(), strict=True))
            states[f"{case.number}:{step}"] = packed_state(places), tensions_in_words(pulls)
    return states
