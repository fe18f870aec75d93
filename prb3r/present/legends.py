"""Legends that fit into a column of a paper: which values they name, without repeated words, in how many columns."""

import re
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.cbook import is_math_text
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

MOST_NUMBERS, SOME_NUMBERS = 8, 7
"""Numbers that a legend names at most, and how many it names, evenly spaced, where there are more (their colours are a
ramp, so that the others can be read off)."""
MOST_WORDS = 16
"""Values with names instead of numbers that a legend names at most."""
MOST_LEGEND_ROWS = 2
"""A legend with more rows gets short lines if that saves a row."""
SHORT_HANDLE = 2.0
"""Length of the lines in such a legend, and in one of marks, in font sizes."""
UNIT = r"[µmcdkMG]?(?:m|N|Pa|g|s|rad|deg|°)(?:[\^²⁴/]\S*)?|%"
"""Pattern of the units that values may have."""
VALUE = re.compile(rf"(.+?) ([−-]?\d[\d.,e+−-]*(?: ?(?:{UNIT}))?)")
"""Pattern of a part of a name: words, and a number with its unit."""


def named_in_legend(values: Sequence) -> list:
    """The values that a legend names: all or, of too many, `SOME_NUMBERS` evenly spaced from the first to the last."""
    numbers = all(isinstance(value, (int, float, np.number)) and not isinstance(value, bool) for value in values)
    if len(values) <= (MOST_NUMBERS if numbers else MOST_WORDS):
        return list(values)
    return [values[k] for k in np.linspace(0, len(values) - 1, SOME_NUMBERS).round().astype(int)]


def without_repeats(names: Sequence[str]) -> list[str]:
    """The names, all but the first without the words before numbers that every name has in the same place.

    Examples
    --------
    >>> without_repeats(["Thickness 1 mm, Plates 6", "Thickness 1.2 mm, Plates 6", "Thickness 2 mm, Plates 5"])
    ['Thickness 1 mm, Plates 6', '1.2 mm, 6', '2 mm, 5']
    >>> without_repeats(["cable 3 first", "cable 1 first"])
    ['cable 3 first', 'cable 1 first']
    """
    matches = [[VALUE.fullmatch(part) for part in name.split(", ")] for name in names]
    words = {tuple(part[1] if part else "" for part in parts) for parts in matches}
    if len(words) != 1 or "" in next(iter(words)):
        return list(names)
    return [*names[:1], *(", ".join(part[2] for part in parts if part) for parts in matches[1:])]


def legend_shape(entries: Sequence[str], width: float) -> tuple[int, float]:
    """Number of columns of a legend that fits into `width` (mm), and the length of its lines, in font sizes.

    Lines are as long as the style says, or `SHORT_HANDLE` where that saves one of more than two rows.
    """
    columns, usual = legend_columns(entries, width), float(matplotlib.rcParams["legend.handlelength"])
    if len(entries) <= MOST_LEGEND_ROWS * columns or usual <= SHORT_HANDLE:
        return columns, usual
    with matplotlib.rc_context({"legend.handlelength": SHORT_HANDLE}):
        more = legend_columns(entries, width)
    return (more, SHORT_HANDLE) if -(-len(entries) // more) < -(-len(entries) // columns) else (columns, usual)


def legend_columns(entries: Sequence[str], width: float) -> int:
    """The most columns in which a legend, filled column by column, fits into `width` (mm)."""
    font = FontProperties(size=matplotlib.rcParams["legend.fontsize"])
    size, said = font.get_size_in_points() / 72 * 25.4, matplotlib.rcParams
    beside = size * (said["legend.handlelength"] + said["legend.handletextpad"])
    between, around = size * said["legend.columnspacing"], 2 * size * said["legend.borderpad"]
    wide = [beside + _width(text, font) for text in entries]
    for columns in range(len(entries), 1, -1):
        longest = [max(column) for column in np.array_split(wide, columns)]
        if sum(longest) + (columns - 1) * between + around < width:
            return columns
    return 1


def _width(text: str, font: FontProperties) -> float:
    """Width of a text of one or several lines, mm."""
    lines = text.split("\n")
    measured = [text_to_path.get_text_width_height_descent(line, font, is_math_text(line))[0] for line in lines]
    return float(max(measured)) / 72 * 25.4
