"""The look of figures and numbers: widths, colours and marks that survive grey print, and the units people read."""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import matplotlib
import numpy as np

from prb3r.quantities import SHORT_FOR, Quantity, describe, label, printed, scale

MM = 1 / 25.4
"""A millimetre in inches, which matplotlib measures in."""
SINGLE, DOUBLE = 88.0, 180.0
"""Widths of one and of two text columns of a paper, mm."""

INK, QUIET, PALE = "#1a1a1a", "#6e6e6e", "#c4c4c4"
"""Dark, middle and light grey."""
ALARM = "#b00020"
"""Red of bounds and of missed targets."""

PALETTE = ("#004488", "#DDAA33", "#BB5566", "#222222", "#6699CC", "#997700", "#EE99AA", "#117733")
"""Paul Tol's high and medium contrast colours, ordered so that neighbours differ in lightness as well as in hue."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<")
LINES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.6)),
    (0, (1.2, 1.3)),
    (0, (6, 1.4, 1.2, 1.4)),
    (0, (9, 2)),
    (0, (3, 1.2, 1, 1.2, 1, 1.2)),
    (0, (2.4, 1.6)),
    (0, (1, 2.4)),
)
HATCHES = ("", "////", "\\\\\\\\", "xxxx", "----", "||||", "++++", "//")
OPEN_MARKERS = ("D", "o", "s", "^", "v", "p", "h", "*")
RAMP_FROM = 4
"""From this many numbers on, their colours are a ramp from dark to light instead of distinct ones."""

NATURAL = {
    "m": ((1.0, "mm"),),
    "rad": ((math.inf, "deg"),),
    "Pa": ((1e9, "MPa"), (math.inf, "GPa")),
    "kg": ((0.1, "g"),),
    "s": ((1e-3, "us"), (1.0, "ms")),
    "m^2": ((0.01, "cm^2"),),
    "m/N": ((1.0, "mm/N"),),
    "rad/N": ((math.inf, "deg/N"),),
}
"""For each SI unit the units people read instead: (bound, unit), the first whose bound exceeds the largest value."""


@dataclass(frozen=True)
class Look:
    """How one group is drawn: groups differ in colour, mark, line and hatch at once."""

    colour: Any
    marker: str
    line: Any
    hatch: str


@dataclass(frozen=True)
class Shown:
    """How a quantity is shown: its label, the factor from SI values to the shown unit, and that unit as printed."""

    label: str
    factor: float
    unit: str


def palette() -> Sequence[str]:
    """Colours of groups: those of the user's own style, or `PALETTE`."""
    cycle = matplotlib.rcParams["axes.prop_cycle"]
    chosen = cycle.by_key().get("color") if cycle != matplotlib.rcParamsDefault["axes.prop_cycle"] else None
    return chosen or PALETTE


def looks(values: Sequence[Any]) -> dict[Any, Look]:
    """A look for each of the distinct `values`; `RAMP_FROM` numbers or more get colours of the user's colour map, dark
    to light in rising order."""
    numeric = all(isinstance(value, (int, float, np.number)) and not isinstance(value, bool) for value in values)
    cycle = palette()
    colours: Sequence[Any] = [cycle[i % len(cycle)] for i in range(len(values))]
    if numeric and len(values) >= RAMP_FROM:
        values = sorted(values)
        ramp = matplotlib.colormaps[matplotlib.rcParams["image.cmap"]](np.linspace(0, 0.84, len(values)))
        colours = [matplotlib.colors.to_hex(colour) for colour in ramp]
    pick = lambda marks, i: marks[i % len(marks)]  # noqa: E731
    return {v: Look(colours[i], pick(MARKERS, i), pick(LINES, i), pick(HATCHES, i)) for i, v in enumerate(values)}


def pale(colour: Any, share: float = 0.25) -> tuple[float, ...]:
    """RGB of a colour mixed with white, of which `share` is left."""
    return tuple(1 - share * (1 - part) for part in matplotlib.colors.to_rgb(colour))


def quantity_of(column: str, given: Iterable[Quantity]) -> Quantity:
    """Name, symbol, unit and meaning of a column: as `given` describes it, else by its name.

    A given quantity without symbol gets that of the nomenclature.
    """
    known = describe(SHORT_FOR.get(column, column))
    quantity = next((quantity for quantity in given if quantity.name == column), None)
    if quantity is None or column in SHORT_FOR:
        return known
    return quantity if quantity.symbol else replace(quantity, symbol=known.symbol)


def shown(quantity: Quantity, values: Any = (), unit: str | None = None) -> Shown:
    """How to show values of a quantity (SI): in `unit`, or in the one that `NATURAL` has for their size.

    Raises
    ------
    ValueError
        If `unit` measures something else.
    """
    if unit is None:
        finite = np.abs(np.asarray(values, float).ravel()) if quantity.unit in NATURAL else np.zeros(0)
        largest = np.nanmax(finite[np.isfinite(finite)], initial=0.0)
        unit = next((unit for bound, unit in NATURAL.get(quantity.unit, ()) if largest < bound), None)
    if unit is None:
        return Shown(label(quantity), 1.0, printed(quantity.unit))
    return Shown(label(quantity, unit), scale(quantity, unit), printed(unit))


def literal(text: str) -> str:
    """A user's words for a figure of matplotlib, with `$` escaped, which would begin a formula."""
    return text.replace("$", r"\$")


def symbol_text(symbol: str) -> str:
    """A symbol of the nomenclature for a figure of matplotlib: what follows the first underscore as its index, upright
    if it is a word; in plain text if that is no letters and digits, as a name of a cable may be anything."""
    head, _, index = symbol.partition("_")
    if not index:
        return f"${symbol}$"
    if not re.fullmatch("[A-Za-z0-9]+", index):
        return literal(f"{head} {index}")
    return f"${symbol}$" if len(index) == 1 else rf"${head}_{{\mathrm{{{index}}}}}$"


def digits(value: float) -> str:
    """A number with four significant digits, commas between thousands and a real minus: `1,234`, `0.05678`,
    `−3.2e−7`; a dash if it is not finite."""
    if not math.isfinite(value):
        return "–"
    if value != 0 and not 1e-4 <= abs(value) < 1e7:
        digits, _, power = f"{value:.3e}".partition("e")
        text = f"{digits.rstrip('0').rstrip('.')}e{int(power)}"
    else:
        places = 3 - math.floor(math.log10(abs(value))) if value else 0
        text = f"{round(value, places):,.{max(places, 0)}f}"
        text = text.rstrip("0").rstrip(".") if "." in text else text
    return text.replace("-", "−")


def with_unit(value: float, unit: str) -> str:
    """A number of four digits with its unit as printed: `12.5 mm`, `30°`, `0.3`."""
    return f"{digits(value)}{'' if unit in ('', '°', '°/N') else ' '}{unit}"


def law_in_words(slope: float, deviation: float, y_unit: str, x_unit: str) -> str:
    """A fitted line with its largest deviation in words: `56.8 mm per unit μ, within 1.1 mm`."""
    rate = f"{with_unit(float(f'{slope:.3g}'), y_unit)} per {x_unit}"
    return f"{rate}, within {with_unit(float(f'{deviation:.2g}'), y_unit)}"
