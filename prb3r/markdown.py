"""Tables in Markdown, and lists of names within a sentence, for all reports and messages."""

from collections.abc import Collection, Iterable, Sequence


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Collection[int] = ()) -> list[str]:
    """The lines of a Markdown table.

    Parameters
    ----------
    head : headings of the columns
    rows : cells as text; bars are escaped and line ends become spaces
    numbers : columns (from 0) that are aligned to the right
    """
    rule = [" ---: " if k in numbers else " --- " for k in range(len(head))]
    return [_line(head), f"|{'|'.join(rule)}|", *map(_line, rows)]


def listed(names: Sequence[str]) -> str:
    """Names (at least one) separated by commas, the last by "and"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def quoted(names: Sequence[str]) -> list[str]:
    """The names, all in quotation marks if one of them has a comma, which would look like the end of the name."""
    return [f'"{name}"' for name in names] if any("," in name for name in names) else list(names)


def few(names: Sequence[str], most: int = 3) -> str:
    """Names separated by commas; of more than `most` only the first, with the number of the others.

    All are in quotation marks if one of them has a space or a comma.
    """
    shown = [f'"{name}"' for name in names] if any(" " in name or "," in name for name in names) else list(names)
    return ", ".join(shown) if len(shown) <= most else f"{', '.join(shown[:most])} and {len(shown) - most} more"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
