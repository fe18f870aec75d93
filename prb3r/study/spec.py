"""What a study file may say: factors, loads, metrics, comparisons and plots."""

import json
from html import escape
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from prb3r.model.files.toml import read_toml
from prb3r.model.files.toml_lines import Keys
from prb3r.model.files.validation import KeyedError
from prb3r.model.manipulator import ModelName, Strict
from prb3r.study.factors import PAYLOAD, DesignSearch, Factor, Name, Sampling
from prb3r.study.loading import Cloud, LoadSweep, TargetPath
from prb3r.study.metrics import AnyMetric
from prb3r.study.plots import AnyPlot
from prb3r.study.plots.base import KeptTables
from prb3r.study.wishes import Designs, Preference, Requirement, Scalar, Wishes


class CaseComparison(Strict):
    """A metric that compares each case with another one that differs in the factors `to` alone."""

    name: Name
    """Name of its column, with the unit as ending."""
    kind: Literal["distance", "difference", "ratio"]
    of: str
    """A column of the cases; for `distance` the stem of `<of>_x_m` and `<of>_y_m`."""
    to: dict[str, Scalar]
    """Factor values of the case to compare with; all other factors have those of the case itself."""
    relative_to_length: bool = False
    """Distances are divided by the straight length."""


class LineFit(Strict):
    """A straight line through a column, reported with its largest deviation."""

    x: str
    """Column along which the line runs."""
    y: str
    """Column that the line is fitted to."""
    through_origin: bool = False
    where: dict[str, Scalar] = {}
    """Only cases with these values of columns count."""


class Study(Strict):
    """A whole study file: question, factors, loads, metrics, comparisons and plots."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$")]
    """Name of the study and of its folder of results."""
    title: str
    question: str = ""
    manipulator: str
    """Path of the manipulator file, relative to the study file."""
    model: ModelName | None = None
    set: dict[str, Any] = {}
    """Parameter paths of the manipulator and their values, for all cases."""
    seed: int = 1
    """Seed of what [sampling] draws and [search] tries; clouds of loads are the same for all seeds."""
    states: Literal["none", "final", "path"] = "final"
    state_disks: list[Annotated[int, Field(ge=0)]] | None = None
    """Only these disks are kept in the table of states."""
    chunk: Annotated[int, Field(ge=1)] | None = None
    """Cases in one task of a worker; absent: 32, or more of them in a large study."""
    broken: list[str] = []
    initial: dict[str, float] = {}
    """Loads applied first, ramped from rest."""
    step: list[dict[str, float]] = []
    """Load steps after that; each keeps what it does not name."""
    sweep: LoadSweep | None = None
    """And after those, many steps of one column."""
    cloud: Cloud | None = None
    reach: TargetPath | None = None
    """Instead of loads: the targets that they bring a disk to."""
    factor: list[Factor] = []
    """What changes from case to case, one axis each."""
    sampling: Sampling | None = None
    search: DesignSearch | None = None
    """Instead of sampling: the factors with a range are searched for the best design."""
    metric: list[AnyMetric] = []
    """What is told of every case, as columns."""
    comparison: list[CaseComparison] = []
    fit: list[LineFit] = []
    """Straight lines through columns."""
    plot: list[AnyPlot] = []
    designs: Designs | None = None
    requirement: list[Requirement] = []
    """What a design must keep."""
    preference: list[Preference] = []
    """By what the designs that keep every requirement are ranked."""
    timing: bool = False
    """Also measure the time per equilibrium of each model; it goes into manifest and summary, never into tables."""

    def __repr__(self) -> str:
        """The name of the study and the names of its factors, metrics and plots, in one line."""
        parts = {
            "factors": [factor.name for factor in self.factor],
            "metrics": [metric.kind for metric in self.metric],
            "plots": [plot.name for plot in self.plot],
        }
        return f"Study({self.name!r}, {', '.join(f'{name}={names}' for name, names in parts.items())})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        head = f"<p><strong>{escape(self.title)}</strong></p><p>{escape(self.question)}</p>"
        return f"{head}<p>{escape(repr(self))}</p>"

    @property
    def design_factors(self) -> list[str]:
        """Names of the factors that tell designs apart: those of `[designs]`, or else all that change the manipulator.

        Errors are left out of the latter.  The list is empty for a study of one design.
        """
        if self.designs is not None:
            return self.designs.factors
        return [factor.name for factor in self.factor if factor.of_manipulator and not factor.is_error]

    @property
    def payloads(self) -> list[str]:
        """Names of the factors that tell designs apart by what they carry alone, as no `[designs]` says otherwise."""
        names = self.design_factors if self.designs is None else []
        return [factor.name for factor in self.factor if factor.name in names and factor.of_manipulator == {PAYLOAD}]

    @property
    def errors(self) -> list[Factor]:
        """The factors that nobody chooses and that are drawn from a distribution: errors of rigs, or scatter."""
        return [factor for factor in self.factor if factor.is_error and factor.drawn is not None]

    @property
    def searched(self) -> list[Factor]:
        """The factors whose ranges `[search]` searches for the best design; none without `[search]`."""
        return [factor for factor in self.factor if self.search is not None and factor.range and not factor.is_error]

    @property
    def sampled(self) -> list[Factor]:
        """The factors whose values are drawn together, as points of one sample; searched ones are left out."""
        searched = [factor.name for factor in self.searched]
        return [factor for factor in self.factor if factor.drawn is not None and factor.name not in searched]

    @property
    def kept(self) -> KeptTables:
        """What the study keeps for its plots besides the table of cases."""
        return KeptTables(
            states=self.states,
            disks=None if self.state_disks is None else tuple(self.state_disks),
            cloud=self.cloud is not None,
            targets=self.reach is not None,
            fits=frozenset((fit.x, fit.y) for fit in self.fit),
        )

    @property
    def decides(self) -> bool:
        """Whether the study has wishes for designs, or requirements of a single one without errors.

        Rigs of a single design are judged one by one instead.
        """
        return self.wishes.given and (bool(self.design_factors) or not self.errors)

    @property
    def wishes(self) -> Wishes:
        """Designs, requirements and preferences of the study as one object, the same as a file of wishes gives."""
        return Wishes(designs=self.designs, requirement=self.requirement, preference=self.preference)

    def _zip_problems(self) -> list[str]:
        """Zipped factors of which some tell designs apart and others do not, so that designs would share no case."""
        designs, apart = set(self.design_factors), []
        for name in {factor.zip for factor in self.factor if factor.zip}:
            tied = [factor.name for factor in self.factor if factor.zip == name]
            if len({factor in designs for factor in tied}) > 1:
                apart.append(
                    f"zip {name!r} ties {', '.join(tied)}, of which some tell designs apart and others do not, so that "
                    "no two designs would have a case in common: name them all in [designs] factors = [...]"
                )
        return sorted(apart)

    @model_validator(mode="after")
    def _consistent(self) -> "Study":
        problems = []
        if self.cloud is not None and (self.step or self.initial or self.sweep):
            problems.append("cloud excludes initial, step and sweep: its loads are independent of each other")
        if self.timing and (self.cloud or self.reach):
            problems.append("timing goes with [[step]], [initial] or [sweep]: leave it out beside cloud and reach")
        if self.reach is not None and (self.step or self.initial or self.sweep or self.cloud):
            problems.append(
                "reach excludes initial, step, sweep and cloud: its loads are those that lead to the targets"
            )
        if self.sampled and self.sampling is None:
            problems.append(
                f"{self.sampled[0].name!r} is drawn: say how it is sampled, [sampling] method = 'sobol', count = 64"
            )
        if self.sampling is not None and not self.sampled:
            problems.append(
                "[sampling] needs factors that are drawn (range, normal, lognormal, or levels with chosen = false)"
            )
        problems += self._search_problems()
        if self.decides:
            problems += self._zip_problems()
        if self.preference and not self.requirement and not self.design_factors and not self.errors:
            problems.append(
                "preferences rank designs, but no factor tells designs apart: name those that do, "
                "[designs] factors = [...], or give a [[requirement]] that the one design must keep"
            )
        places: list[tuple[Keys, str]] = [((), what) for what in problems]
        for kind in ("factor", "plot", "comparison"):
            names = [part.name for part in getattr(self, kind)]
            for number, name in enumerate(names):
                if name in names[:number]:
                    places.append(((kind, number, "name"), f"two {kind}s are named {name!r}"))
        if places:
            raise KeyedError(*places)
        return self

    def _search_problems(self) -> list[str]:
        """What is wrong with `[search]` and the factors that it searches."""
        if self.search is None:
            return []
        problems = [] if self.searched else ["[search] needs factors with a range to search"]
        if not self.wishes.given:
            problems.append("[search] needs to know what is best: give [[preference]] or [[requirement]]")
        searched, apart = {factor.name for factor in self.searched}, set(self.design_factors)
        name_them = f"[designs] factors = {json.dumps(sorted(searched))}"
        problems += [
            f"{name!r} has a range, so it is searched, but [designs] does not name it: name it there, "
            f"{name_them}, or give it values instead of a range"
            for name in sorted(searched - apart)
        ]
        problems += [
            f"{name!r} tells designs apart but is not searched, as it has no range: give it a range or, if it is a "
            f"circumstance that each design meets, name the others alone, {name_them}"
            for name in sorted(apart - searched)
        ]
        if self.search.designs < self.search.generation:
            problems.append("[search] tries at least one generation: designs must not be fewer")
        return problems


def load_study(path: str | Path) -> Study:
    """Read a study file.

    Raises
    ------
    SpecError
        With every problem of the file and its line.

    Examples
    --------
    >>> import prb3r
    >>> study = prb3r.load_study("studies/workspace.toml")
    >>> study
    Study('workspace', factors=['thickness_ratio', 'segment_1_force', 'limit'], metrics=['workspace'], \
plots=['workspaces', 'areas'])
    """
    return read_toml(path, Study)
