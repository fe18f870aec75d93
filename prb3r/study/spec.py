"""What a study file may say: factors, loads, metrics, comparisons and plots."""

import itertools
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from prb3r.model.files.numbers import Positive
from prb3r.model.files.toml import read_toml
from prb3r.model.files.toml_lines import Keys
from prb3r.model.files.validation import KeyedError
from prb3r.model.manipulator import ModelName, Strict
from prb3r.quantities import unit_ending
from prb3r.study.metrics import AnyMetric
from prb3r.study.wishes import Designs, Preference, Requirement, Scalar, Wishes

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
MAX_CASES = 1_000_000
LOADS = ("initial", "step", "sweep", "cloud", "broken")
"""Parameter paths that begin so change what is done to a manipulator, not its design."""


class Range(Strict):
    """A number of values from one end to the other, both included."""

    start: float = Field(alias="from")
    stop: float = Field(alias="to")
    count: Annotated[int, Field(ge=1, le=MAX_CASES)]


class Interval(Strict):
    """The ends between which a sampled factor lies."""

    low: float
    high: float

    @model_validator(mode="after")
    def _ordered(self) -> "Interval":
        if not self.low < self.high:
            raise ValueError(f"low ({self.low:g}) must be less than high ({self.high:g})")
        return self


class Level(Strict):
    """One named alternative of a structural factor: whatever it sets replaces that part of the case."""

    label: Annotated[str, Field(min_length=1)]
    set: dict[str, Any] = {}
    """Parameter paths and their values."""
    broken: list[str] | None = None
    """Cables that carry nothing."""
    initial: dict[str, float] | None = None
    """Loads applied first."""
    step: list[dict[str, float]] | None = None
    """Load steps."""
    model: ModelName | None = None


class Factor(Strict):
    """One axis of a study: a parameter path, a ratio of two, or named alternatives."""

    name: Name
    path: str | None = None
    """Such as `segment.1.thickness_m`, `cable.2.offset_m`, `friction.coefficient`, `step.1.cable_1_n`, `model`."""
    ratio: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None
    """Two paths; the first is set to the factor times the second."""
    values: Annotated[list[Scalar], Field(min_length=1)] | None = None
    linspace: Range | None = None
    geomspace: Range | None = None
    range: Interval | None = None
    """For Sobol and Latin hypercube sampling."""
    level: Annotated[list[Level], Field(min_length=1)] | None = None
    zip: str | None = None
    """Factors with the same word here advance together."""

    @model_validator(mode="after")
    def _consistent(self) -> "Factor":
        targets = [name for name in ("path", "ratio", "level") if getattr(self, name) is not None]
        if len(targets) != 1:
            raise ValueError("give one of path, ratio or level" + (f", not {' and '.join(targets)}" if targets else ""))
        grids = [name for name in ("values", "linspace", "geomspace", "range") if getattr(self, name) is not None]
        if self.level is None and len(grids) != 1:
            raise ValueError(
                "give one of values, linspace, geomspace or range" + (f", not {' and '.join(grids)}" if grids else "")
            )
        if self.level is not None and grids:
            raise ValueError(f"levels have no {grids[0]}")
        if self.geomspace is not None and not min(self.geomspace.start, self.geomspace.stop) > 0:
            raise ValueError("geomspace needs positive ends")
        if self.zip is not None and self.range is not None:
            raise ValueError("a sampled factor (range) cannot be zipped; all sampled factors already advance together")
        ending = unit_ending(self.path.rpartition(".")[2]) if self.path else ""
        if ending and not self.name.endswith(ending):
            raise ValueError(
                f"the name {self.name!r} becomes a column and must end in {ending!r}, the unit of {self.path}"
            )
        labels = [level.label for level in self.level or ()]
        if len(set(labels)) < len(labels) and self.zip is None:
            raise ValueError("labels of levels must differ")
        return self


class Sampling(Strict):
    """How the factors with a `range` are sampled together; all others form a grid around them."""

    method: Literal["sobol", "latin-hypercube"]
    count: Annotated[int, Field(ge=1, le=MAX_CASES)]


class Cloud(Strict):
    """Many independent loads on one case: tensions drawn by a Sobol sequence, each ramped from rest."""

    count: Annotated[int, Field(ge=16, le=4_194_304)]
    tension_n: dict[str, Positive]
    """Largest tension of each cable that is driven."""
    limit: Literal["tension", "bend"] = "tension"
    """`bend`: instead, each cable is driven up to where it alone bends its segment by `bend_rad`."""
    bend_rad: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> "Cloud":
        if self.limit == "bend" and self.bend_rad is None:
            raise ValueError("limit = 'bend' needs bend_rad, the largest bend of a segment")
        return self


class LoadSweep(Strict):
    """Load steps of one column, after all others: from turning point to turning point in equal parts."""

    column: Annotated[str, Field(min_length=1)]
    """Such as `cable_1_n`."""
    turns: Annotated[list[float], Field(min_length=1)]
    """Values that it is brought to, one after the other; it starts where the steps before have left it."""
    count: Annotated[int, Field(ge=1, le=10_000)]
    """Steps from one turning point to the next."""

    @model_validator(mode="after")
    def _turning(self) -> "LoadSweep":
        if any(turn == next_turn for turn, next_turn in itertools.pairwise(self.turns)):
            raise ValueError("turns must differ from one to the next")
        return self


class CaseComparison(Strict):
    """A metric that compares each case with another one that differs in the factors `to` alone."""

    name: Name
    kind: Literal["distance", "difference", "ratio"]
    of: str
    """A column of the cases; for `distance` the stem of `<of>_x_m` and `<of>_y_m`."""
    to: dict[str, Scalar]
    relative_to_length: bool = False
    """Distances are divided by the straight length."""


class LineFit(Strict):
    """A straight line through a column, reported with its largest deviation."""

    x: str
    y: str
    through_origin: bool = False
    where: dict[str, Scalar] = {}


class PublishedPoint(Strict):
    """A published value laid over a plot, in SI units as the columns are."""

    x: float
    y: float
    label: str


class Plot(Strict):
    """A figure made from the tables of a study; written as PNG and SVG."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9-]+$")]
    kind: Literal["lines", "shapes", "workspace", "bars", "loops"]
    caption: str = ""
    where: dict[str, Scalar | list[Scalar]] = {}
    """Only cases with these factor values."""
    x: str | None = None
    """lines, bars: a column.  loops: the tension of a cable."""
    y: list[str] = []
    """lines: columns of one quantity.  bars: metrics, a panel each.  loops: positions of disks, a row of panels each.
    shapes, workspace: not used."""
    x_unit: str | None = None
    y_unit: str | None = None
    by: str | None = None
    """Colour and mark: one line, shape or region for each value of this column."""
    style: str | None = None
    """Second distinction, by line style."""
    panel: str | None = None
    """One panel for each value of this column."""
    note: str | None = None
    """A column whose value follows the title of each panel that has one value of it."""
    reference: dict[str, Scalar] = {}
    """shapes: cases with these factor values are drawn pale behind all others instead of by themselves."""
    mark: list[PublishedPoint] = []
    """Published points."""
    vertical: str | None = None
    """lines: a column whose (median) value is marked by a vertical line."""
    fit: bool = False
    """lines: draw the study's fits of this y over x."""
    y_from_zero: bool = False
    log_y: bool = False

    @model_validator(mode="after")
    def _consistent(self) -> "Plot":
        if self.kind in ("lines", "bars", "loops") and (not self.y or self.x is None):
            raise ValueError(f"a plot of {self.kind} needs x and y")
        if self.log_y and self.y_from_zero:
            raise ValueError("log_y and y_from_zero exclude each other")
        return self


class Study(Strict):
    """A whole study file: question, factors, loads, metrics, comparisons and plots."""

    name: Annotated[str, Field(pattern=r"^[a-z0-9][a-z0-9-]*$")]
    title: str
    question: str = ""
    manipulator: str
    """Path of the manipulator file, relative to the study file."""
    model: ModelName | None = None
    set: dict[str, Any] = {}
    """Parameter paths of the manipulator and their values, for all cases."""
    seed: int = 1
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
    factor: list[Factor] = []
    sampling: Sampling | None = None
    metric: list[AnyMetric] = []
    comparison: list[CaseComparison] = []
    fit: list[LineFit] = []
    plot: list[Plot] = []
    designs: Designs | None = None
    requirement: list[Requirement] = []
    """What a design must keep."""
    preference: list[Preference] = []
    """By what the designs that do are ranked."""
    timing: bool = False
    """Also measure the time per equilibrium of each model; it goes into manifest and summary, never into tables."""

    @property
    def design_factors(self) -> list[str]:
        """The factors that tell designs apart: those of `[designs]`, or else all that change the manipulator."""
        if self.designs is not None:
            return self.designs.factors
        changing = [f for f in self.factor if f.ratio or (f.path and f.path.split(".")[0] not in LOADS)]
        return [factor.name for factor in changing]

    @property
    def wishes(self) -> Wishes:
        """What the study wants of its designs."""
        return Wishes(designs=self.designs, requirement=self.requirement, preference=self.preference)

    @model_validator(mode="after")
    def _consistent(self) -> "Study":
        problems = []
        if self.cloud is not None and (self.step or self.initial or self.sweep):
            problems.append("cloud excludes initial, step and sweep: its loads are independent of each other")
        sampled = [factor.name for factor in self.factor if factor.range is not None]
        if sampled and self.sampling is None:
            problems.append(
                f"{sampled[0]!r} has a range: say how it is sampled, [sampling] method = 'sobol', count = 64"
            )
        if self.sampling is not None and not sampled:
            problems.append("[sampling] needs factors with a range")
        if self.wishes.given and not self.design_factors:
            problems.append(
                "requirements and preferences are of designs, but no factor changes the manipulator: "
                "say which factors tell designs apart, [designs] factors = [...]"
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
    >>> study.name
    'workspace'
    """
    return read_toml(path, Study)
