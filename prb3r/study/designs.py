"""Designs of one or several study results: the cases of each, and its number by each requirement or preference."""

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import ValidationError

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.markdown import listed
from prb3r.model.files.toml import place_of
from prb3r.model.files.toml_lines import Keys, dotted
from prb3r.quantities import SHORT_FOR, Quantity, describe, printed, titled
from prb3r.runs.provenance import read_manifest
from prb3r.runs.store import read_arrow
from prb3r.study.axes import sample_count
from prb3r.study.chunk import CASE_FAILED
from prb3r.study.columns import described, made_by
from prb3r.study.compare import select
from prb3r.study.spec import Study
from prb3r.study.wishes import Criterion, Wishes, load_wishes, plain_text

THE_DESIGN = "the design"
"""Name of the only design of a study in which no factor tells designs apart."""
DRAWN_RIG = "drawn_rig"
"""Column of the number of the rig that a case is of, in studies that draw errors."""
HANDIER_UNITS = {
    "m": (0.0, 0.1, 1e3, "mm"),
    "m/N": (0.0, 0.1, 1e3, "mm/N"),
    "m^2": (0.0, 0.01, 1e4, "cm^2"),
    "Pa": (1e5, np.inf, 1e-6, "MPa"),
}
"""By SI unit: lower and upper end of the magnitudes that are shown in another unit, factor to that unit, its name."""


@dataclass(frozen=True)
class Missing:
    """Cases of a design that count for a requirement and have no value."""

    count: int
    of: int
    """Number of the cases of the design that count."""
    unsolved: int
    """Number of the cases without a value that have no stable equilibrium."""
    reason: str
    """Why the first of them has none, without the full stop; empty if nothing is told."""


@dataclass(frozen=True)
class DesignCases:
    """The cases of several designs, and the requirements and preferences for the designs."""

    frame: pd.DataFrame
    """The table of cases with columns `design`, its name, and `scenario`, the values (text) of the factors that tell no
    designs apart: cases of different designs with the same scenario are compared.  Where rigs are drawn it has their
    numbers in :data:`DRAWN_RIG`, NaN for cases of other studies."""
    circumstances: list[str]
    """Names of the factors that tell neither designs nor rigs apart."""
    wishes: Wishes
    """Requirements and preferences."""
    quantities: dict[str, Quantity] = dataclasses.field(default_factory=dict)
    """Unit and meaning of columns, by name."""
    firsts: dict[str, tuple[Path, int]] = dataclasses.field(default_factory=dict)
    """Folder of the results and number of the first case of each design; empty for cases that are not on disk."""
    remark: str = ""
    """What is to be known of what tells the designs apart, as a sentence."""

    @property
    def names(self) -> list[str]:
        """Names of the designs in the order of their first cases."""
        return list(dict.fromkeys(self.frame["design"]))

    def quantity(self, criterion: Criterion) -> Quantity:
        """Meaning and unit of the column of a criterion, from the studies or else from its name."""
        return self.quantities.get(criterion.metric) or describe(criterion.metric)

    def only(self, column: str, value: Any) -> "DesignCases":
        """The cases in which the factor `column` has the value."""
        return replace(self, frame=select(self.frame, {column: value}))

    def values(self, criteria: Sequence[Criterion], rows: pd.DataFrame) -> np.ndarray:
        """(designs, criteria) numbers of designs by the criteria over the cases `rows`; NaN where no case counts."""
        numbers = np.full((len(self.names), len(criteria)), np.nan)
        for j, criterion in enumerate(criteria):
            counted = select(rows, criterion.where)
            column, drawn = known_values(counted, criterion.metric), DRAWN_RIG in counted
            for k, name in enumerate(self.names):
                own = (counted["design"] == name).to_numpy()
                rigs = counted[DRAWN_RIG].to_numpy(float)[own] if drawn else np.array([np.nan])
                numbers[k, j] = criterion.value(column[own], None if np.isnan(rigs).all() else rigs)
        return numbers

    def missing(self, criteria: Sequence[Criterion]) -> dict[tuple[int, int], Missing]:
        """By number of the design and of the criterion, the cases that count and have no value, if there are any."""
        found, numbers = {}, {name: k for k, name in enumerate(self.names)}
        for j, criterion in enumerate(criteria):
            counted = select(self.frame, criterion.where)
            lost = counted[np.isnan(known_values(counted, criterion.metric))]
            firsts = lost.drop_duplicates("design")
            reasons = firsts["reason"].astype(str) if "reason" in firsts else [""] * len(firsts)
            all_of, absent, unsolved = (
                rows["design"].value_counts().to_dict() for rows in (counted, lost, lost[~_solved(lost)])
            )
            for name, reason in zip(firsts["design"], reasons, strict=True):
                told = f"{reason[:1].lower()}{reason[1:]}".rstrip(".")
                found[numbers[name], j] = Missing(absent[name], all_of[name], unsolved.get(name, 0), told)
        return found


def _solved(cases: pd.DataFrame) -> pd.Series:
    """(cases,) whether a case has an equilibrium, so that other metrics than one that failed are known."""
    return cases["outcome"].isin(["converged", CASE_FAILED])


def known_values(cases: pd.DataFrame, column: str) -> np.ndarray:
    """(cases,) numbers in a column; NaN where a case did not converge, or the metric of the column failed."""
    return cases[column].where(_solved(cases)).to_numpy(float)


def read_designs(folders: Sequence[Path], requirements: str | Path | None = None) -> DesignCases:
    """The designs of one or several study results.

    Parameters
    ----------
    folders : of the results.
    requirements : file of wishes; without any wish in it, those of the first study count.

    Raises
    ------
    SpecError
        If a folder holds no result, the results do not say what a design is or share nothing, or the file is wrong.
    """
    asked = load_wishes(requirements) if requirements else Wishes()
    studies = [_study_of(folder) for folder in folders]
    wishes = asked if asked.given else studies[0].wishes
    frames, rests = [], []
    firsts: dict[str, tuple[Path, int]] = {}
    quantities: dict[str, Quantity] = {}
    for folder, study in zip(folders, studies, strict=True):
        table = read_arrow(folder / "cases.parquet")
        quantities |= {field.name: _quantity_of(field) for field in table.schema}
        factors = _factors_of(study, asked, str(folder))
        rests.append([factor.name for factor in study.factor if factor.name not in factors])
        prefix = f"{study.name}: " if len(folders) > 1 else ""
        frames.append(_with_designs(study, table.to_pandas(), factors, sorted(rests[-1]), prefix))
        known = frames[-1].drop_duplicates("design")
        pairs = zip(known["design"], known["case_id"].tolist(), strict=True)
        firsts = {name: (folder, case) for name, case in pairs} | firsts
    where = ", ".join(map(str, folders))
    if any(sorted(rest) != sorted(rests[0]) for rest in rests):
        one_alone = sorted({name for rest in rests for name in rest if any(name not in other for other in rests)})
        raise SpecError(
            Problem(
                where,
                f"share no cases, as only some of them vary {listed(one_alone)}: if that tells designs apart, name it "
                "in [designs] factors = [...] of the requirements; if it is a circumstance, vary it in all of them",
            )
        )
    errors = {error.name for study in studies for error in study.errors}
    circumstances = [name for name in rests[0] if name not in errors]
    remark = "" if asked.designs else _remark(studies[0])
    cases = DesignCases(pd.concat(frames, ignore_index=True), circumstances, wishes, quantities, firsts, remark)
    if requirements and asked.given:
        _check(cases, where, lambda keys: place_of(requirements, keys))
    else:
        _check(cases, where, lambda keys: f"{where} {dotted(keys, wishes.model_dump())}")
    return cases


def _factors_of(study: Study, asked: Wishes, where: str) -> list[str]:
    """Names of the factors that tell the designs of a study apart, by the wishes `asked` or else by the study.

    Raises SpecError, with `where` as its place, if the study has no such factor, or if there are none and no
    requirement of a single design.
    """
    names, factors = [factor.name for factor in study.factor], study.design_factors
    if asked.designs is not None:
        factors = asked.designs.factors
    problems = [
        Problem(where, f"there is no factor {name!r}{did_you_mean(name, names)}")
        for name in factors
        if name not in names
    ]
    if not factors and not (asked if asked.given else study.wishes).requirement:
        what = "its study has no [designs], and no factor changes the manipulator: name those that tell designs apart"
        problems.append(Problem(where, what))
    if problems:
        raise SpecError(*problems)
    return factors


def _remark(study: Study) -> str:
    """That payloads tell the designs of a study apart, and how to say that they do not; empty for other studies."""
    if not study.payloads:
        return ""
    titles = listed([describe(SHORT_FOR.get(name, name)).title for name in study.payloads])
    rest = ", ".join(f'"{name}"' for name in study.design_factors if name not in study.payloads)
    tell = "tells" if len(study.payloads) == 1 else "tell"
    return f"{titles} {tell} designs apart; if each design has to bear all of it, say [designs] factors = [{rest}]."


def _study_of(folder: Path) -> Study:
    """The study, without plots, whose results are in a folder, from its manifest; raises SpecError if there is none."""
    manifest = read_manifest(folder)
    if manifest is None:
        what = "holds no result of a study (no manifest.json); give folders under results/"
        raise SpecError(Problem(str(folder), what))
    try:
        return Study.model_validate(manifest["study"] | {"plot": []})  # plots say nothing of designs
    except (ValidationError, KeyError):
        what = "is the result of a study in another format; run the study again"
        raise SpecError(Problem(str(folder), what)) from None


def designs_of(study: Study, frame: pd.DataFrame) -> DesignCases:
    """The designs in a table of cases of a study that need not be on disk, with the wishes of the study."""
    names = [factor.name for factor in study.factor]
    rest = [name for name in names if name not in study.design_factors]
    circumstances = [name for name in rest if name not in {error.name for error in study.errors}]
    quantities = {quantity.name: quantity for quantity in described(study)}
    designed = _with_designs(study, frame, study.design_factors, rest, "")
    return DesignCases(designed, circumstances, study.wishes, quantities)


def _with_designs(study: Study, frame: pd.DataFrame, factors: list[str], rest: list[str], prefix: str) -> pd.DataFrame:
    """The table of cases with columns `design`, named after `factors`, `scenario`, the values of factors `rest`, and,
    if the study draws errors, `drawn_rig`."""
    rows = frame[rest].itertuples(index=False) if rest else [()] * len(frame)
    scenarios = [tuple(map(plain_text, row)) for row in rows]
    rigs = {DRAWN_RIG: frame["case_id"].to_numpy() % sample_count(study)} if study.errors else {}
    designs = [prefix + name for name in design_names(frame, factors)]
    return frame.assign(design=designs, scenario=scenarios, **rigs)


def design_names(frame: pd.DataFrame, factors: list[str]) -> list[str]:
    """The name of the design of each case, made of the values of `factors`; without factors, `THE_DESIGN`."""
    if not factors:
        return [THE_DESIGN] * len(frame)
    return [
        ", ".join(_named(name, value) for name, value in zip(factors, row, strict=True))
        for row in frame[factors].itertuples(index=False)
    ]


def _named(factor: str, value: Any) -> str:
    """A factor with its value to six digits, as `titled` says it."""
    return titled(describe(SHORT_FOR.get(factor, factor)).title, factor_value_in_words(factor, value))


def factor_value_in_words(factor: str, value: Any) -> str:
    """A value of a factor to six digits with its unit and a real minus sign, or a name."""
    quantity = describe(SHORT_FOR.get(factor, factor))
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return plain_text(value)
    per_unit, unit = _unit_of([value], quantity) if quantity.unit not in ("1", "") else (1.0, "")
    return f"{plain_text(value * per_unit).replace('-', '−')} {unit}".rstrip()


def _check(cases: DesignCases, where: str, place_in: Callable[[Keys], str]) -> None:
    """Raise SpecError if there is nothing to decide, or a wish names a missing or non-numeric column or fits no case.

    Parameters
    ----------
    where : place of problems of the results.
    place_in : place of a wish, from its keys.
    """
    problems, frame = [], cases.frame
    if not cases.wishes.given:
        problems.append(Problem(where, "nothing says what is wanted: give [[preference]] or [[requirement]]"))
    elif len(cases.names) < 2 and not cases.wishes.requirement:
        problems.append(Problem(where, "there is only one design, and no requirement; nothing to lay beside it"))
    for keys, criterion in cases.wishes.placed:
        absent = [name for name in (criterion.metric, *criterion.where) if name not in frame]
        for name in absent:
            key = (*keys, "metric") if name == criterion.metric else (*keys, "where", name)
            problems.append(
                Problem(place_in(key), f"there is no column {name!r}{made_by(name) or did_you_mean(name, frame)}")
            )
        if absent:
            continue
        if not pd.api.types.is_numeric_dtype(frame[criterion.metric]):
            problems.append(Problem(place_in((*keys, "metric")), f"column {criterion.metric!r} holds no numbers"))
        elif select(frame, criterion.where).empty:
            problems.append(Problem(place_in((*keys, "where")), f"no case has {criterion.where}"))
    if problems:
        raise SpecError(*problems)


def _quantity_of(field: Any) -> Quantity:
    """Unit and meaning of a column, from the metadata of its Parquet field."""
    metadata = {key.decode(): text.decode() for key, text in (field.metadata or {}).items()}
    name = field.name
    return Quantity(name, "", metadata.get("unit", "1"), metadata.get("description", name))


def _unit_of(values: Iterable[float], quantity: Quantity) -> tuple[float, str]:
    """Factor from the SI unit to the unit that values are shown in, and that unit.

    It is the handier unit if one of the values lies in the interval of `HANDIER_UNITS`.
    """
    low, high, per_unit, handier = HANDIER_UNITS.get(quantity.unit, (0.0, 0.0, 1.0, ""))
    called_for = any(low < abs(value) < high for value in values)
    return (per_unit, printed(handier)) if called_for else (1.0, printed(quantity.unit))


def value_in_words(value: float, quantity: Quantity, beside: Iterable[float] = ()) -> str:
    """A value with three digits, a real minus sign and its unit; `-` if it is not finite.

    The unit is chosen for the value and those `beside` it: lengths are in mm and areas in cm² where one of them is
    small, stresses in MPa where one of them is large.
    """
    if not np.isfinite(value):
        return "-"
    factor, unit = _unit_of([value, *beside], quantity)
    value *= factor
    text = f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"
    return f"{text.replace('-', '−')} {unit}".rstrip()
