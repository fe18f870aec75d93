"""A part of a study's report that one kind of study adds: sentences and tables under a heading."""

from dataclasses import dataclass

from prb3r.present.page import Table


@dataclass(frozen=True)
class Section:
    """A heading with sentences and tables below."""

    heading: str
    sentences: list[str]
    tables: list[tuple[str, Table]]
    """Each with its caption."""
    note: str = ""
    """How the numbers are to be read."""
