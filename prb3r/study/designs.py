"""Designs side by side: what each is worth on the cases they share, the Pareto front, and the trade in sentences."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.quantities import Quantity, describe
from prb3r.runs.provenance import read_manifest
from prb3r.runs.store import read_arrow
from prb3r.study.compare import select
from prb3r.study.spec import Designs, Objective, Study

ALIKE_SHARE = 0.05
"""Designs within this share of each other are called alike."""


@dataclass(frozen=True)
class DesignComparison:
    """Designs side by side: what each is worth by the objectives of its study."""

    values: pd.DataFrame
    """One row a design, one column an objective (its metric's name); the worst of the cases that count."""
    objectives: list[Objective]
    quantities: list[Quantity]
    """Of the objectives, in their order."""
    shared: int
    """Cases that every design has."""
    left_out: int
    """Cases that only some designs have."""
    failed: int
    """Shared cases without a stable equilibrium, left out for all designs."""

    @property
    def front(self) -> list[bool]:
        """Whether a design is on the Pareto front: none is as good in everything and better in something."""
        scores = self.scores
        better = lambda a, b: np.all(a >= b) and np.any(a > b)  # noqa: E731
        return [not any(better(other, score) for other in scores) for score in scores]

    @property
    def scores(self) -> np.ndarray:
        """(designs, objectives), more is better; what could not be had is worst."""
        signs = np.array([1.0 if objective.better == "high" else -1.0 for objective in self.objectives])
        return np.nan_to_num(self.values.to_numpy(float) * signs, nan=-np.inf)


def value_in_words(value: float, quantity: Quantity) -> str:
    """A value with three digits and its unit, small lengths in millimetres; `-` where there is none."""
    if not np.isfinite(value):
        return "-"
    unit = "" if quantity.unit == "1" else quantity.unit
    if unit in ("m", "m/N") and abs(value) < 0.1:
        value, unit = value * 1e3, f"m{unit}"
    text = f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"
    return f"{text} {unit}".rstrip()


def compare_results(folders: list[Path]) -> DesignComparison:
    """Designs of one or several study results.

    Raises
    ------
    SpecError
        If a folder holds no result, or the results do not say what a design is or share nothing.
    """
    frames, plans = [], []
    quantities: dict[str, Quantity] = {}
    for folder in folders:
        manifest = read_manifest(folder)
        if manifest is None:
            raise SpecError(
                Problem(str(folder), "holds no result of a study (no manifest.json); give folders under results/")
            )
        study = Study.model_validate(manifest["study"])
        if study.designs is None:
            raise SpecError(
                Problem(str(folder), "its study has no [designs]: name the factors that tell designs apart")
            )
        table = read_arrow(folder / "cases.parquet")
        quantities |= {f.name: _described(f) for f in table.schema}
        frame, label = table.to_pandas(), [describe(name).title for name in study.designs.factors]
        names = [
            ", ".join(f"{word} {_plain(value)}" for word, value in zip(label, row, strict=True))
            for row in frame[study.designs.factors].itertuples(index=False)
        ]
        frame["design"] = names if len(folders) == 1 else [f"{study.name}: {name}" for name in names]
        rest = [factor.name for factor in study.factor if factor.name not in study.designs.factors]
        frame["scenario"] = [tuple(map(_plain, row)) for row in frame[rest].itertuples(index=False)]
        frames.append(frame)
        plans.append((study.designs, rest))
    designs, rest = plans[0]
    if any(other != rest for _, other in plans):
        raise SpecError(Problem(", ".join(map(str, folders)), "vary different factors, so they share no cases"))
    frame = pd.concat(frames, ignore_index=True)
    return worth_of_designs(frame, designs, quantities)


def _described(field: Any) -> Quantity:
    metadata = {key.decode(): text.decode() for key, text in (field.metadata or {}).items()}
    return Quantity(field.name, "", metadata.get("unit", "1"), metadata.get("description", field.name))


def _plain(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)


def worth_of_designs(frame: pd.DataFrame, designs: Designs, quantities: dict[str, Quantity]) -> DesignComparison:
    """Worth of each `design` over the `scenario`s that all of them have."""
    names = list(dict.fromkeys(frame["design"]))
    if len(names) < 2:
        raise SpecError(Problem("compare", "there is only one design; nothing to lay beside it"))
    per_design = [set(frame.loc[frame["design"] == name, "scenario"]) for name in names]
    shared, every = set.intersection(*per_design), set.union(*per_design)
    if not shared:
        raise SpecError(Problem("compare", "the designs share no case"))
    broken = set(frame.loc[frame["outcome"] != "converged", "scenario"]) & shared
    used = frame[frame["scenario"].isin(shared - broken)]
    missing = [o.metric for o in designs.objective if o.metric not in used]
    if missing:
        raise SpecError(Problem("compare", f"a result has no column {missing[0]!r}"))
    columns = {}
    for objective in designs.objective:
        worst = "max" if objective.better == "low" else "min"
        grouped = select(used, objective.where).groupby("design")[objective.metric]
        columns[objective.metric] = grouped.agg(worst).reindex(names)
    known = [quantities[objective.metric] for objective in designs.objective]
    values = pd.DataFrame(columns, index=names)
    return DesignComparison(values, designs.objective, known, len(shared), len(every) - len(shared), len(broken))


def recommendation(comparison: DesignComparison) -> list[str]:
    """The trade in sentences: which designs are out, what each of the others is best at and what it gives up."""
    values, objectives, front = comparison.values, comparison.objectives, comparison.front
    said = []
    for k, name in enumerate(values.index):
        if not front[k]:
            rival = _dominating(comparison, k)
            said.append(
                f"- **{name}** can be dropped: {rival} is at least as good in everything and better in something."
            )
    kept = [k for k in range(len(values)) if front[k]]
    if len(kept) == 1:
        return [*said, f"**Recommendation:** {values.index[kept[0]]}; it is best in everything that was asked."]
    wins = {k: [j for j in range(len(objectives)) if _is_best(comparison, k, j)] for k in kept}
    for k in kept:
        said.append(f"- **{values.index[k]}** {_trade(comparison, k, wins[k], kept)}.")
    ranked = sorted(kept, key=lambda k: -len(wins[k]))
    first, second = ranked[0], ranked[1]
    return [
        *said,
        "",
        f"**Recommendation:** {values.index[first]} where {_listed([objectives[j].words for j in wins[first]])} "
        f"matter{'s' if len(wins[first]) == 1 else ''}"
        + (
            f"; {values.index[second]} where {_listed([objectives[j].words for j in wins[second]])} "
            f"matter{'s' if len(wins[second]) == 1 else ''} more."
            if wins[second]
            else "; the designs between them are compromises."
        ),
    ]


def _is_best(comparison: DesignComparison, k: int, j: int) -> bool:
    scores = comparison.scores[:, j]
    return bool(scores[k] == scores.max() and np.ptp(scores[np.isfinite(scores)]) > ALIKE_SHARE * np.abs(scores[k]))


def _dominating(comparison: DesignComparison, k: int) -> str:
    scores = comparison.scores
    for other in range(len(scores)):
        if np.all(scores[other] >= scores[k]) and np.any(scores[other] > scores[k]):
            return comparison.values.index[other]
    raise ValueError("a design off the front is dominated")


def _trade(comparison: DesignComparison, k: int, wins: list[int], kept: list[int]) -> str:
    """What a design is best at, and the price against the best of the others."""
    objectives, values = comparison.objectives, comparison.values.to_numpy(float)
    if not wins:
        return "is a compromise: on the front, best in nothing"
    best = f"has the best {_listed([_with_number(comparison, k, j) for j in wins])}"
    prices = []
    for j in range(len(objectives)):
        rival = max((i for i in kept if i != k), key=lambda i: comparison.scores[i, j])
        worth, other = values[k, j], values[rival, j]
        if j in wins or not np.isfinite([worth, other]).all() or min(abs(worth), abs(other)) == 0:
            continue
        worse = worth / other if objectives[j].better == "low" else other / worth
        if worse > 1 + ALIKE_SHARE:
            prices.append((worse, j, worth, other))
    if not prices:
        return best
    worst = sorted(prices, reverse=True)[:2]
    number = lambda value, j: value_in_words(value, comparison.quantities[j])  # noqa: E731
    texts = [f"{objectives[j].words} is {number(worth, j)} against {number(other, j)}" for _, j, worth, other in worst]
    return f"{best}; the price: {_listed(texts)}"


def _with_number(comparison: DesignComparison, k: int, j: int) -> str:
    return (
        f"{comparison.objectives[j].words} ({value_in_words(comparison.values.iloc[k, j], comparison.quantities[j])})"
    )


def _listed(words: list[str]) -> str:
    if not words:
        return "nothing in particular"
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
