"""What a factor of a study may say: what it sets, and its values one by one, on a grid, sampled or searched."""

import itertools
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from prb3r.model.manipulator import ModelName, Strict
from prb3r.quantities import unit_ending
from prb3r.study.distributions import Alternatives, Distribution, Interval, Lognormal, Normal
from prb3r.study.wishes import Scalar

Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
Paths = str | Annotated[list[str], Field(min_length=1)]
MAX_CASES = 1_000_000
"""Largest number of cases of a study."""
LOADS = ("initial", "step", "sweep", "cloud", "reach", "broken")
"""First parts of the parameter paths that change what is done to a manipulator, not its design."""
PAYLOAD = "disk.tip_mass_kg"
"""The path of the manipulator that is what it carries, rather than how it is built."""
TARGETS = ("path", "ratio", "added_to", "times", "level")
"""Fields of a factor that say what it sets; exactly one of them is given."""
GRIDS = ("values", "linspace", "geomspace")
"""Fields that list the values of a factor."""
DRAWN = ("range", "normal", "lognormal")
"""Fields that give a range or distribution from which the values of a factor are drawn."""


class Range(Strict):
    """A number of values from one end to the other, both included."""

    start: float = Field(alias="from")
    """First value."""
    stop: float = Field(alias="to")
    """Last value."""
    count: Annotated[int, Field(ge=1, le=MAX_CASES)]
    """Number of values, both ends among them."""


class Level(Strict):
    """One named alternative of a structural factor: whatever it sets replaces that part of the case."""

    label: Annotated[str, Field(min_length=1)]
    """Value of the factor in tables and legends."""
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
    """One axis of a study: a parameter path, a ratio of two, an error of some, or named alternatives."""

    name: Name
    """Name of the factor and of its column, with the unit as ending."""
    path: str | None = None
    """Such as `segment.1.thickness_m`, `cable.2.offset_m`, `friction.coefficient`, `step.1.cable_1_n`, `model`."""
    ratio: Annotated[list[str], Field(min_length=2, max_length=2)] | None = None
    """Two paths; the first is set to the factor times the second."""
    added_to: Paths | None = None
    """A path, or several that share an error: the factor is added to what stands there."""
    times: Paths | None = None
    """A path, or several that share an error: what stands there is multiplied by the factor."""
    values: Annotated[list[Scalar], Field(min_length=1)] | None = None
    linspace: Range | None = None
    geomspace: Range | None = None
    range: Interval | None = None
    """Ends between which [sampling] samples, or [search] searches."""
    normal: Normal | None = None
    """For [sampling]: a mean and a standard deviation."""
    lognormal: Lognormal | None = None
    """For [sampling]: a median and the standard deviation of the logarithm."""
    level: Annotated[list[Level], Field(min_length=1)] | None = None
    chosen: bool = True
    """Of levels: `false` where nobody chooses between them; [sampling] then draws them, all alike likely."""
    zip: str | None = None
    """Factors with the same word here advance together."""

    @property
    def drawn(self) -> Distribution | None:
        """The distribution that values are drawn from, or the range that is searched; None if the values are listed."""
        if self.level and not self.chosen:
            return Alternatives(count=len(self.level))
        return self.range or self.normal or self.lognormal

    @property
    def is_error(self) -> bool:
        """Whether nobody chooses the value of the factor: it is an error of the rig, or scatter."""
        return bool(self.added_to or self.times or self.normal or self.lognormal) or not self.chosen

    @property
    def neutral(self) -> float:
        """The value of an error that changes nothing: 0 for one that is added, else 1."""
        return 0.0 if self.added_to else 1.0

    @property
    def changed(self) -> list[str]:
        """Parameter paths whose values the factor sets or changes; empty for named alternatives (levels)."""
        several = self.added_to or self.times or ()
        paths = [several] if isinstance(several, str) else list(several)
        return [*([self.path] if self.path else []), *(self.ratio or ())[:1], *paths]

    @property
    def of_manipulator(self) -> set[str]:
        """Parameter paths of the manipulator that the factor, or one of its levels, sets or changes."""
        levels = [[*level.set, *(["model"] if level.model else [])] for level in self.level or ()]
        paths = [path.removeprefix("manipulator.") for path in itertools.chain(self.changed, *levels)]
        return {path for path in paths if path.partition(".")[0] not in LOADS}

    @property
    def target(self) -> str:
        """What the factor sets, in words; empty for named alternatives (levels)."""
        if self.ratio is not None:
            return f"{self.ratio[0]} over {self.ratio[1]}"
        before = "error of " if self.added_to else "factor on " if self.times else ""
        return before + " and ".join(self.changed) if self.changed else ""

    @model_validator(mode="after")
    def _consistent(self) -> "Factor":
        for problem in _factor_problems(self):
            raise ValueError(problem)
        return self


def _factor_problems(factor: Factor) -> Iterator[str]:
    """Contradictions and gaps within a factor, as sentences; the first of them is reported."""
    targets, grids, drawn = (
        [name for name in names if getattr(factor, name) is not None] for names in (TARGETS, GRIDS, DRAWN)
    )
    given, valid = [*grids, *drawn], ", ".join((*GRIDS, *DRAWN[:-1]))
    if len(targets) != 1:
        yield "give one of path, ratio, added_to, times or level" + (f", not {' and '.join(targets)}" * bool(targets))
    elif factor.level is None and len(given) != 1:
        yield f"give one of {valid} or {DRAWN[-1]}" + (f", not {' and '.join(given)}" * bool(given))
    if factor.level is not None and given:
        yield f"levels have no {given[0]}"
    if factor.level is None and not factor.chosen:
        yield "chosen = false is of levels; numbers that nobody chooses are drawn (normal or lognormal) or errors"
    if factor.geomspace is not None and not min(factor.geomspace.start, factor.geomspace.stop) > 0:
        yield "geomspace needs positive ends"
    if factor.zip is not None and factor.drawn is not None:
        how = drawn[0] if drawn else "chosen = false"
        yield f"a sampled factor ({how}) cannot be zipped; all sampled factors already advance together"
    middle = {"normal": "mean", "lognormal": "median"}
    for name, word in middle.items():
        given_by = getattr(factor, name)
        if given_by is None or getattr(given_by, word) is not None:
            continue
        if not factor.times and not (factor.added_to and name == "normal"):
            yield f"{name} needs its {word}: only of what is added or multiplied is it known"
    ending = unit_ending(factor.changed[0].rpartition(".")[2]) if factor.changed and not factor.ratio else ""
    if ending and not factor.times and not factor.name.endswith(ending):
        yield (f"the name {factor.name!r} becomes a column and must end in {ending!r}, the unit of {factor.changed[0]}")
    if factor.times and (wrong := unit_ending(factor.name)):
        yield f"the name {factor.name!r} becomes a column and ends in {wrong!r}, but a multiplier has no unit"
    labels = [level.label for level in factor.level or ()]
    if len(set(labels)) < len(labels) and factor.zip is None:
        yield "labels of levels must differ"


class Sampling(Strict):
    """How the factors that are drawn are sampled together; all others form a grid around them."""

    method: Literal["sobol", "latin-hypercube", "saltelli"]
    """`sobol` and `latin-hypercube` fill the ranges evenly; `saltelli` is a Sobol sequence so arranged that it tells
    which factor matters, `count` (factors + 2) cases."""
    count: Annotated[int, Field(ge=1, le=MAX_CASES)]
    """Number of points."""

    @model_validator(mode="after")
    def _power_of_two(self) -> "Sampling":
        if self.method == "saltelli" and (self.count < 4 or self.count & (self.count - 1)):
            raise ValueError(f"the method 'saltelli' needs a count that is a power of 2, from 4 on, not {self.count}")
        return self


class DesignSearch(Strict):
    """How the factors with a range are searched for the designs that [[requirement]] and [[preference]] ask for."""

    designs: Annotated[int, Field(ge=8, le=100_000)]
    """So many are tried at most."""
    generation: Annotated[int, Field(ge=5, le=1024)] = 32
    """So many are tried at once, before the next ones are chosen."""
