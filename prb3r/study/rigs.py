"""Effects of drawn errors on the rigs that are built: quantiles, shares that keep requirements, Sobol indices.

A rig is one sample of the errors; it is solved in every circumstance of the study (loads, broken cables).  Sobol's
indices tell which error matters: the share of a metric's variance that an error makes by itself (first order), and
including its interactions with other errors (total).  Their estimates are those of Saltelli et al., Computer Physics
Communications 181 (2010) 259, and Jansen, ibid. 117 (1999) 35, by scipy, with intervals from resampled rigs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import scipy

from prb3r.model.files.cells import count
from prb3r.quantities import Quantity
from prb3r.runs.store import arrow_table, write_arrow
from prb3r.study.axes import sample_count
from prb3r.study.columns import described
from prb3r.study.compare import select
from prb3r.study.designs import design_names, known_values
from prb3r.study.spec import Study
from prb3r.study.wishes import Requirement

QUANTILES = (0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99)
"""Shares of the rigs below the quantiles that are listed."""
CONFIDENCE = 0.95
"""Confidence of every interval."""
RESAMPLED, RESAMPLING_SEED = 999, 2010
"""Number and seed of resamples of the rigs for the intervals of indices, whose ends are known within a twentieth."""
ALL_REQUIREMENTS = 0
"""Number in the table of shares that stands for all requirements together; single ones are numbered from 1."""
TABLES = ("quantiles", "shares", "indices")
"""Names of the tables that are written besides the table of cases."""
COLUMNS = (
    Quantity("metric", "", "", "column of the cases"),
    Quantity("unit", "", "", "unit of mean, sd and quantiles"),
    Quantity("error", "", "", "factor that nobody chooses"),
    Quantity("design", "", "", "factors that tell designs apart, with their values"),
    Quantity("requirement", "", "1", "number of the requirement in the study file; 0: all of them together"),
    Quantity("rigs", "", "1", "rigs that were drawn"),
    Quantity("kept", "", "1", "rigs that keep the requirement"),
    Quantity("failed", "", "1", "rigs without a value"),
    Quantity("share", "", "1", "share of the rigs that keep the requirement"),
    Quantity("first_order", "S", "1", "share of the variance that the error makes by itself"),
    Quantity("total", "S_T", "1", "share of the variance that the error makes by itself and together with others"),
)
"""Unit and meaning of columns of these tables that the nomenclature lacks."""


@dataclass(frozen=True)
class Rigs:
    """Tables of the effects of errors; empty where a study has nothing to fill them."""

    quantiles: pd.DataFrame
    """A row for each setting of the other factors and metric: `metric, unit, rigs, failed, mean, sd, q_0_01, ...`."""
    shares: pd.DataFrame
    """A row for each design and requirement: `design, requirement, rigs, kept, share, share_low, share_high`;
    requirement 0 is all of them together."""
    indices: pd.DataFrame
    """With the method `saltelli`, a row for each setting of the other factors, metric and error: `metric, error,
    first_order, first_order_low, first_order_high, total, total_low, total_high`; missing where a case has no value."""


def rigs_of(study: Study, cases: pd.DataFrame) -> Rigs:
    """Effects of the errors of a study on its metrics and comparisons; `cases` is the whole table in its order."""
    sampled = {factor.name for factor in study.sampled}
    fixed = [factor.name for factor in study.factor if factor.name not in sampled]
    blocks = sampled_cases(study, cases)
    drawn = cases[blocks < 2]  # the other blocks are mixtures of these two samples
    groups = list(_settings(drawn, fixed))
    quantiles = [given | row for given, part in groups for row in _quantiles(part, metrics_of(study))]
    indices = []
    if study.sampling is not None and study.sampling.method == "saltelli":
        for given, part in _settings(cases, fixed):
            indices += [given | row for row in _indices(study, part)]
    return Rigs(pd.DataFrame(quantiles), pd.DataFrame(_shares(study, drawn)), pd.DataFrame(indices))


def write_rigs(rigs: Rigs | None, folder: Path, provenance: Mapping[str, Any]) -> None:
    """Write the tables that have rows and remove old files of the others; raises what `write_arrow` raises."""
    for name in TABLES:
        table = pd.DataFrame() if rigs is None else getattr(rigs, name)
        if table.empty:
            (folder / f"{name}.parquet").unlink(missing_ok=True)
        else:
            columns = {column: table[column].tolist() for column in table}
            write_arrow(arrow_table(columns, COLUMNS, provenance), folder / f"{name}.parquet")


def metrics_of(study: Study) -> list[Quantity]:
    """Columns of the metrics and comparisons of a study."""
    return described(study)[len(study.factor) :]


def sampled_cases(study: Study, cases: pd.DataFrame) -> np.ndarray:
    """(cases,) number of the block of samples that each case belongs to; 0 unless the method is `saltelli`.

    See `sampled_points` for the blocks.
    """
    assert study.sampling is not None
    return cases["case_id"].to_numpy() % sample_count(study) // study.sampling.count


def _settings(cases: pd.DataFrame, fixed: Sequence[str]) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    """Each combination of values of the factors `fixed`, by name, with its cases."""
    if not fixed:
        yield {}, cases
        return
    for values, part in cases.groupby(list(fixed), sort=False, dropna=False):
        yield dict(zip(fixed, values, strict=True)), part


def _quantiles(part: pd.DataFrame, metrics: Sequence[Quantity]) -> Iterator[dict[str, Any]]:
    """Rows of the table of quantiles for each metric, over cases of one setting.

    Infinite values count as they are ranked, such as a factor of limit load that no load reaches: mean and standard
    deviation are not numbers then.
    """
    for quantity in metrics:
        values = known_values(part, quantity.name)
        good = values[~np.isnan(values)]
        row = {"metric": quantity.name, "unit": quantity.unit, "rigs": len(values), "failed": len(values) - len(good)}
        if len(good) > 1:
            finite = bool(np.isfinite(good).all())
            spread = np.quantile(good, QUANTILES, method="linear" if finite else "inverted_cdf")
            row |= {"mean": good.mean(), "sd": good.std(ddof=1)} if finite else {"mean": np.nan, "sd": np.nan}
            row |= {quantile_column(share): value for share, value in zip(QUANTILES, spread, strict=True)}
        yield row


def quantile_column(share: float) -> str:
    """Name of the column of the quantile of a share, such as `q_0_05`."""
    return f"q_{share:g}".replace(".", "_")


def _shares(study: Study, drawn: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows of the table of shares: how many rigs of each design keep each requirement, and all of them together.

    The number that a requirement bounds is taken for each rig by itself, over its circumstances.
    """
    frame = drawn.assign(design=design_names(drawn, study.design_factors))
    for name, part in frame.groupby("design", sort=False) if study.requirement else ():
        bounded = [(requirement, rig_numbers(study, part, requirement)) for requirement in study.requirement]
        margins = [[requirement.margin(number) for number in numbers] for requirement, numbers in bounded]
        kept = np.array(margins).T >= 0
        for r, which in enumerate([kept.all(1), *kept.T]):
            interval = scipy.stats.binomtest(int(which.sum()), len(which)).proportion_ci(CONFIDENCE, method="wilson")
            yield {
                "design": name,
                "requirement": r,
                "rigs": len(which),
                "kept": int(which.sum()),
                "share": float(which.mean()),
                "share_low": float(interval.low),
                "share_high": float(interval.high),
            }


def rig_numbers(study: Study, part: pd.DataFrame, requirement: Requirement) -> np.ndarray:
    """(rigs,) the number that a requirement bounds, of each rig over its circumstances among the cases `part`; as
    `Requirement.value` has it, infinitely bad where a case has no value and NaN where no case counts.

    A quantile is one of rigs: a single rig counts at the worst of its cases."""
    of_case = part["case_id"].to_numpy() % sample_count(study)
    counted = select(part.assign(rig=of_case), requirement.where).sort_values("rig", kind="stable")
    values, of_rig, order = known_values(counted, requirement.metric), counted["rig"].to_numpy(), np.unique(of_case)
    ends = zip(*(np.searchsorted(of_rig, order, side) for side in ("left", "right")), strict=True)
    alone = np.zeros(len(part), int)
    return np.array([requirement.value(values[first:last], alone[first:last]) for first, last in ends])


def _indices(study: Study, part: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """Rows of the table of Sobol's indices for every metric, from all cases of one setting of the other factors."""
    assert study.sampling is not None
    count, names = study.sampling.count, [factor.name for factor in study.sampled]
    for quantity in metrics_of(study):
        blocks = known_values(part.sort_values("case_id"), quantity.name).reshape(-1, count)
        known = bool(np.isfinite(blocks).all())
        table = sobol_table(blocks) if known else np.full((len(names), 6), np.nan)
        for name, numbers in zip(names, table, strict=True):
            columns = [f"{kind}{end}" for kind in ("first_order", "total") for end in ("", "_low", "_high")]
            yield {"metric": quantity.name, "error": name, **dict(zip(columns, numbers.tolist(), strict=True))}


def sobol_table(blocks: np.ndarray) -> np.ndarray:
    """(factors, 6) first-order index with the ends of its interval, then total index with the ends of its interval.

    Parameters
    ----------
    blocks : (factors + 2, n) values of a metric on the samples A, B and, for each factor, A with its column from B.
    """
    count = blocks.shape[1]
    rng = np.random.default_rng(RESAMPLING_SEED)
    draws = np.array([_sobol(blocks[:, rows]) for rows in rng.integers(count, size=(RESAMPLED, count))])
    low, high = np.quantile(draws, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2], axis=0)
    estimate = _sobol(blocks)
    return np.stack([estimate[0], low[0], high[0], estimate[1], low[1], high[1]], 1)


def _sobol(blocks: np.ndarray) -> np.ndarray:
    """(2, factors) first-order and total indices from the values `blocks` of a metric, see `sobol_table`."""
    factors = len(blocks) - 2
    mixed = np.concatenate([blocks[2:], blocks[-1:]])  # the last one twice: scipy fails on a single constant one
    evaluated = {"f_A": blocks[:1], "f_B": blocks[1:2], "f_AB": mixed[:, None]}
    indices = scipy.stats.sobol_indices(func=evaluated, n=blocks.shape[1])
    return np.stack([indices.first_order.ravel()[:factors], indices.total_order.ravel()[:factors]])


def share_sentences(rigs: Rigs) -> list[str]:
    """A sentence for each design: the share of its rigs that keeps every requirement; none without requirements."""
    if rigs.shares.empty:
        return []
    together = rigs.shares[rigs.shares["requirement"] == ALL_REQUIREMENTS]
    return [
        f"{share_in_words(row)} of {count(row['rigs'], 'rig', ',')} of {row['design']} keep every requirement"
        for row in together.to_dict("records")
    ]


def share_in_words(row: Mapping[str, Any]) -> str:
    """A row's `share`, `share_low` and `share_high` in percent, to a tenth: `97.3 % (96.1 to 98.2 %)`."""
    share, low, high = (f"{100 * row[name]:.1f}" for name in ("share", "share_low", "share_high"))
    return f"{share} % ({low} to {high} %)"
