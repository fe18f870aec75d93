"""Tables in Markdown, and names in a sentence: the one place that knows how."""

from collections.abc import Collection, Iterable, Sequence


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]], numbers: Collection[int] = ()) -> list[str]:
    """The lines of a table.

    Parameters
    ----------
    head : what stands above each column
    rows : cells as text; bars are escaped and line ends become spaces
    numbers : columns (from 0) that are set to the right
    """
    rule = [" ---: " if k in numbers else " --- " for k in range(len(head))]
    return [_line(head), f"|{'|'.join(rule)}|", *map(_line, rows)]


def listed(names: Sequence[str]) -> str:
    """Names in a row, at least one, the last after "and"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def few(names: Sequence[str], most: int = 3) -> str:
    """Names in a row, of many only the first; in quotation marks where one of them has a space or a comma."""
    shown = [f'"{name}"' for name in names] if any(" " in name or "," in name for name in names) else list(names)
    return ", ".join(shown) if len(shown) <= most else f"{', '.join(shown[:most])} and {len(shown) - most} more"


def _line(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"
