"""Why text is not valid TOML, in words that say what would be right."""

import re
import tomllib

DECIMAL_COMMA = re.compile(r"^[^#\"'\[{]*=\s*([-+]?\d+),(\d+)\s*(#.*)?$")
"""A line with a number that has a comma where a point is meant."""
COMMAS_IN_LIST = re.compile(r"\[\s*[-+]?0,\d+\s*,\s*[-+]?0,\d+")
"""A list whose numbers look like decimals with commas, all of them below 1."""
UNQUOTED = re.compile(r"[=\[,]\s*[A-Za-z_]")
"""Where a value begins that may be text without its quotes."""
CURLY = re.compile("[=\\[,]\\s*[\u2018\u2019\u201c\u201d\u201e]")
"""Where a value begins with a quotation mark as word processors set it."""
TABLE_LINE = re.compile(r"^\s*\[\s*([^\[\]]+?)\s*\]")
"""A line that begins a table."""
KEY_OF_LINE = re.compile(r"^\s*([A-Za-z0-9_.\"' -]+?)\s*=")
"""The key of a line."""


def what_is_wrong(error: ValueError, text: str) -> tuple[int, str]:
    """The line, from 1, on which `text` stops being TOML, and what is wrong there, for an `error` of `tomllib`."""
    what, _, place = str(error).removesuffix(")").partition(" (at line ")
    number = int(place.partition(",")[0] or text.count("\n") + 1)
    if not isinstance(error, tomllib.TOMLDecodeError):  # Python reads no number of thousands of digits
        return _longest_line(text), "a number has too many digits"
    what = what.removesuffix(" (at end of document")
    line = text.split("\n")[number - 1]
    return number, _hint(what, line) or f"{what[:1].lower()}{what[1:]}"


def _hint(what: str, line: str) -> str:
    """What is wrong with a line, if it is one of the mistakes that people make; else empty.

    Parameters
    ----------
    what : the words of `tomllib`.
    """
    if comma := DECIMAL_COMMA.match(line):
        return f"decimals have a point, not a comma: {comma[1]}.{comma[2]}"
    if COMMAS_IN_LIST.search(line):
        return "decimals have a point, not a comma, as in [0.5, 1.5]"
    if CURLY.search(line):
        return 'quotation marks have to be plain ones: "..."'
    table, key = TABLE_LINE.match(line), KEY_OF_LINE.match(line)
    if table and what.startswith(("Cannot declare", "Cannot overwrite", "Cannot mutate")):
        return f"[{table[1]}] stands here for the second time; each of several is [[{table[1]}]]"
    if key and what == "Cannot overwrite a value":
        return f"{key[1]} is given twice in one table"
    if "\\" in line and ("escape" in what or "Unescaped" in what or "hex" in what.lower()):
        return "a backslash means something else in double quotes: write / in paths, or single quotes"
    if what == "Invalid value" and UNQUOTED.search(line):
        return 'invalid value; text needs quotes: "..."'
    return ""


def _longest_line(text: str) -> int:
    """Number, from 1, of the longest line of a text."""
    lines = text.split("\n")
    return max(range(len(lines)), key=lambda number: len(lines[number])) + 1
