"""The nomenclature: name, symbol, unit and meaning of every column, in SI with angles in radians.

The unit is the last part of a name, so any column can be described; `NOMENCLATURE` and `PATTERNS` add symbols and exact
meanings.
"""

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

UNIT_OF_ENDING = {
    "_n_m_per_rad": "N m/rad",
    "_rad_per_n_m": "rad/(N m)",
    "_rad_per_n": "rad/N",
    "_m_per_rad": "m/rad",
    "_m_per_n": "m/N",
    "_rad_per_step": "rad/step",
    "_m_per_step": "m/step",
    "_n_per_step": "N/step",
    "_per_step": "1/step",
    "_per_rad": "1/rad",
    "_per_m2": "1/m^2",
    "_per_m": "1/m",
    "_per_n": "1/N",
    "_n_m2": "N m^2",
    "_n_m": "N m",
    "_m_s2": "m/s^2",
    "_m2": "m^2",
    "_m4": "m^4",
    "_n_per_s": "N/s",
    "_rad": "rad",
    "_pa": "Pa",
    "_kg": "kg",
    "_m": "m",
    "_n": "N",
    "_s": "s",
}
"""Unit of each name ending; an ending stands before all that it ends with itself, as the first that fits is taken."""

SHOWN = {
    "um": ("m", 1e-6),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "deg": ("rad", math.pi / 180),
    "mrad": ("rad", 1e-3),
    "kN": ("N", 1e3),
    "mN": ("N", 1e-3),
    "MPa": ("Pa", 1e6),
    "GPa": ("Pa", 1e9),
    "g": ("kg", 1e-3),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "%": ("1", 1e-2),
}
"""Units that figures may show instead of SI units, each with its SI unit and its size in that."""

GIVEN_IN = {
    "m": "lengths are given in metres",
    "rad": "angles are given in radians",
    "N": "forces are given in newtons",
    "Pa": "moduli and stresses are given in pascals",
    "kg": "masses are given in kilograms",
    "s": "times are given in seconds",
}
"""What a message says of the unit to a person who used another one, by SI unit."""

_UNIT_PARTS = re.compile(
    r"(_(([mcuk]?m|in|inch|ft)\d?|n?m?m|m?rad|deg|degrees?|[km]?n|[kmg]?pa|psi|k?g|lb|[mu]?s|s2|per|percent))*"
)
_PRETTY = {"^2": "²", "^4": "⁴", "deg": "°", "um": "µm", "us": "µs"}

SHORT_FOR = {"mu": "friction_coefficient"}
"""Short names of factors, and the quantities of the nomenclature for which they stand."""


@dataclass(frozen=True)
class Quantity:
    """The quantity in a column of numbers or text: its name, symbol, SI unit and meaning."""

    name: str
    symbol: str
    unit: str
    """SI unit, `"1"` for a pure number, `""` for text."""
    meaning: str

    @property
    def title(self) -> str:
        """The name without its unit, as words that begin a sentence."""
        return name_in_words(self.name)

    @property
    def if_empty(self) -> str:
        """What a missing value means, as the meaning ends with `; empty: ...`; without such an end, nothing."""
        return self.meaning.partition("; empty: ")[2]


def name_in_words(column: str) -> str:
    """The name of a column in words, without its unit: `tip_shift_m` as `Tip shift`; a single letter stays as it is."""
    ending = unit_ending(column)
    text = re.sub(r"[_\s]+", " ", column.removesuffix(ending) if ending else column).strip()
    text = re.sub(r"(?<=[a-z])(?=\d)", " ", text)
    return text if len(text) < 2 else text[0].upper() + text[1:]


def unit_ending(column: str) -> str:
    """The ending of a column's name that tells the unit, such as `_n_m`; `""` for none."""
    return next((ending for ending in UNIT_OF_ENDING if column.endswith(ending) and column != ending), "")


NOMENCLATURE = {
    quantity.name: quantity
    for quantity in (
        Quantity("case_id", "", "1", "number of the case within its study"),
        Quantity("sequence", "", "", "load sequence; each starts from rest"),
        Quantity("step", "", "1", "load step within the case or sequence, in order of application"),
        Quantity("disk", "i", "1", "disk, counted from the base (0) to the tip"),
        Quantity("plate", "i", "1", "plate, counted from 1; it ends at the disk of the same number"),
        Quantity("x_m", "x", "m", "disk centre along the straight manipulator, from the base disk's distal face"),
        Quantity("y_m", "y", "m", "disk centre across the manipulator, positive toward positive cable offsets"),
        Quantity("angle_rad", "θ", "rad", "absolute angle of the disk, anticlockwise"),
        Quantity("bend_rad", "Δθ", "rad", "bend of the plate that ends at the disk"),
        Quantity("outcome", "", "", "how the solution ended; anything but a stable equilibrium carries a reason"),
        Quantity("reason", "", "", "why a case is not converged, or how many of its loads are not; empty otherwise"),
        Quantity("iterations", "", "1", "Newton iterations of all load steps together"),
        Quantity("residual_n_m", "r", "N m", "largest moment left unbalanced at a hinge or node, over all load steps"),
        Quantity(
            "lowest_eigenvalue_n_m_per_rad",
            "λ_min",
            "N m/rad",
            "lowest real part of the tangent's eigenvalues, over all load steps; negative on an unstable branch",
        ),
        Quantity(
            "limit_load_factor",
            "",
            "1",
            "factor on all loads at which the branch ends or loses stability; inf: none found",
        ),
        Quantity("broken_cables", "", "", "names of the cables that carry nothing, separated by commas"),
        Quantity("time_s", "t", "s", "when a step was taken, by one clock for all sequences"),
        Quantity("tip_x_n", "F_x", "N", "dead load along x at the centre of the tip disk's distal face"),
        Quantity("tip_y_n", "F_y", "N", "dead load along y at the centre of the tip disk's distal face"),
        Quantity("youngs_modulus_pa", "E", "Pa", "Young's modulus of the plates"),
        Quantity("bending_stiffness_n_m2", "EI", "N m^2", "bending stiffness of a plate"),
        Quantity("coefficient", "μ", "1", "belt friction coefficient between cable and hole"),
        Quantity("friction_coefficient", "μ", "1", "belt friction coefficient between cable and hole"),
        Quantity("length_m", "L", "m", "length of a plate, clamps included"),
        Quantity("clamp_m", "a", "m", "rigid clamp at either end of a plate"),
        Quantity("thickness_m", "h", "m", "thickness"),
        Quantity("width_m", "b", "m", "width of a plate"),
        Quantity("offset_m", "d", "m", "signed distance of a cable's holes from the axis"),
    )
}
"""Columns known by their exact name."""

PATTERNS = (
    (
        r"cable_(.+)_n",
        r"T_\1",
        "N",
        r"tension of cable \1: as applied, and at disks beyond the base over the plate that ends there",
    ),
    (r"cable_(.+)_kg", r"m_\1", "kg", r"mass that hangs on cable \1"),
    (r"slip_(.+)", r"s_\1", "1", r"declared slip of cable \1: -1 drawn toward the base, +1 paid out, 0 no friction"),
    (r"disk(\d+)_([xy])_n", r"F_\1\2", "N", r"dead load along \2 at the centre of disk \1"),
)
"""Columns known by pattern: regular expression of the name, then symbol, unit and meaning, with the groups of the
expression."""


def describe(column: str) -> Quantity:
    """The quantity in a column: by `NOMENCLATURE` or `PATTERNS`, else by the words and the unit ending of its name."""
    if column in NOMENCLATURE:
        return NOMENCLATURE[column]
    for pattern, symbol, unit, meaning in PATTERNS:
        if match := re.fullmatch(pattern, column):
            return Quantity(column, match.expand(symbol), unit, match.expand(meaning))
    return Quantity(column, "", UNIT_OF_ENDING.get(unit_ending(column), "1"), name_in_words(column))


def titled(title: str, value: str) -> str:
    """A title with a value: `Thickness 0.8 mm`; `Thickness 1 = 0.8 mm` where the title ends in a number itself."""
    return f"{title} = {value}" if title[-1:].isdigit() else f"{title} {value}"


def label(column: str | Quantity, unit: str | None = None) -> str:
    """Axis label of a column, such as `Tip x (m)`, in its SI unit or in `unit`.

    The values then have to be multiplied by :func:`scale`, which raises ValueError for a unit that does not fit.
    """
    quantity = column if isinstance(column, Quantity) else describe(column)
    if unit is not None:
        scale(quantity, unit)
        quantity = replace(quantity, unit=unit)
    shown = printed(quantity.unit)
    return f"{quantity.title} ({shown})" if shown else quantity.title


def printed(unit: str) -> str:
    """A unit as it is printed, such as `mm²` or `°`; empty for a pure number."""
    return "" if unit == "1" else re.sub(r"[A-Za-z]+|\^\d", lambda part: _PRETTY.get(part[0], part[0]), unit)


def scale(column: str | Quantity, unit: str) -> float:
    """Factor that converts values of a column to `unit`.

    Raises
    ------
    ValueError
        If `unit` is one of another quantity.
    """
    quantity = column if isinstance(column, Quantity) else describe(column)
    base, size = _in_si(unit)
    if base != quantity.unit:
        others = [name for name, (si, _) in SHOWN.items() if re.search(rf"\b{si}\b", quantity.unit)]
        parts = f"; for units write {', '.join(others)}, and powers as in {quantity.unit}" if others else ""
        raise ValueError(f"{quantity.name} is in {quantity.unit or 'text'} and cannot be shown in {unit}{parts}")
    return 1.0 / size


def duration(seconds: float) -> str:
    """A time in the unit in which people say it, to three digits: `20 ms`, `1.5 min`, `5.56 h`, `22.3 days`."""
    units = [("days", 86400.0, 2.0), ("h", 3600.0, 1.5), ("min", 60.0, 1.5), ("s", 1.0, 0.1)]
    unit, size = next(((unit, size) for unit, size, least in units if seconds >= least * size), ("ms", 1e-3))
    return f"{seconds / size:.3g} {unit}"


def _in_si(unit: str) -> tuple[str, float]:
    """The SI unit of `unit`, with every part replaced by its SI unit, and the size of `unit` in it."""
    base = re.sub(r"[A-Za-z]+|%", lambda part: SHOWN.get(part[0], (part[0], 1.0))[0], unit)
    size = 1.0
    for side, sign in zip(unit.split("/"), (1, -1), strict=False):
        for part, power in re.findall(r"([A-Za-z]+|%)(?:\^(\d))?", side):
            size *= SHOWN.get(part, ("", 1.0))[1] ** (sign * int(power or 1))
    return base, size


def other_unit(name: str, valid: Iterable[str]) -> str:
    """The message on an unknown `name` that is a `valid` one with another unit or none; `""` for all other names."""
    for right in valid:
        ending = unit_ending(right)
        stem = right.removesuffix(ending)
        if ending and name.startswith(stem) and _UNIT_PARTS.fullmatch(name.removeprefix(stem)):
            unit = UNIT_OF_ENDING[ending]
            return f"{GIVEN_IN.get(unit, f'it is given in {unit}')}, as {right!r}"
    return ""
