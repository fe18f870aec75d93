"""A decision between designs told: in Markdown, in a report, as an HTML page, a table on disk and figures."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from prb3r.markdown import listed
from prb3r.model.files.cells import count
from prb3r.present import rc, style
from prb3r.present.figure_files import save_figure
from prb3r.present.page import Cell, Table, picture, templates
from prb3r.present.spots import spots_of
from prb3r.present.study.firsts import designs_standing
from prb3r.present.study.front import decision_figure, front_figure
from prb3r.runs.files import ensure_writable, write_whole
from prb3r.runs.store import arrow_table, write_arrow
from prb3r.study import advice
from prb3r.study.decide import by_circumstance, decide
from prb3r.study.decision import Decision
from prb3r.study.designs import DesignCases, factor_value_in_words
from prb3r.study.phrases import bound_in_words, capitalised, known_in_words, wish_in_words
from prb3r.study.recommend import recommendation

MOST_BESIDE = 5
"""Up to this many designs are columns of the table; more are rows."""

MOST_LISTED_DESIGNS = 24
"""Designs that are listed in Markdown at most, the best ranked ones."""
MOST_IN_PAGE = 500
"""Designs that are listed in an HTML page at most."""


@dataclass(frozen=True)
class Advice:
    """A decision in words and as a table."""

    decision: Decision
    recommendation: str
    table: Table
    note: str
    """Which cases the numbers of the table are over, and how they are to be read."""
    points: list[tuple[str, list[str]]]
    """Headings with the sentences below them; headings without a sentence are left out."""
    firsts: Mapping[str, tuple[Path, int]] = field(default_factory=dict)
    """Folder and number of each design's first case, by the design's name; that case is drawn for the design."""

    @property
    def heading(self) -> str:
        """What the advice is about, as the heading above it."""
        return "Requirements" if self.decision.alone else "Which design"

    @property
    def markdown(self) -> str:
        """The whole advice as Markdown: recommendation, table of designs, reasons."""
        lines = [self.recommendation, "", *self.table.markdown.splitlines(), "", self.note]
        for heading, sentences in self.points:
            lines += ["", f"**{heading}**", "", *(f"- {sentence}" for sentence in sentences)]
        return "\n".join(lines)


def advice_on(cases: DesignCases) -> Advice:
    """The decision between the designs of `cases` with its table and reasons; raises what `decide` raises."""
    decision = decide(cases)
    winners = {
        style.quantity_of(column, ()).title: [
            (factor_value_in_words(column, value) or "none", winner) for value, winner in pairs
        ]
        for column, pairs in by_circumstance(cases).items()
    }
    of_one = [
        ("Each requirement", advice.reserves(decision)),
        ("In each circumstance", advice.kept_in_circumstances(winners)),
    ]
    of_several = [
        ("What is out", advice.exclusions(decision)),
        ("Which requirement binds", advice.bindings(decision)),
        ("The others", advice.trades(decision)),
        ("If weights change", advice.changes_with_weights(decision)),
        ("In each circumstance", advice.changes_with_circumstances(winners)),
    ]
    return Advice(
        decision,
        recommendation(decision),
        decision_table(decision),
        note_on(decision, MOST_LISTED_DESIGNS),
        [(heading, sentences) for heading, sentences in (of_one if decision.alone else of_several) if sentences],
        cases.firsts,
    )


def decision_table(decision: Decision) -> Table:
    """The table for Markdown: requirements, preferences, ranking, with a column for each design.

    Of more than `MOST_BESIDE` designs the best `MOST_LISTED_DESIGNS` have a row each.
    """
    table = all_designs(decision)
    if len(decision.designs) > MOST_BESIDE:
        return replace(table, rows=table.rows[:MOST_LISTED_DESIGNS])
    turned = [list(row) for row in zip(table.head, *table.rows, strict=True)]
    return Table(turned[0], turned[1:])


def listed_designs(decision: Decision) -> Table:
    """The table for an HTML page: a column for each design or, of more than `MOST_BESIDE`, a row for each."""
    if len(decision.designs) <= MOST_BESIDE:
        return decision_table(decision)
    table = all_designs(decision)
    return replace(table, head=["Design", *table.head[1:]])


def all_designs(decision: Decision) -> Table:
    """A row for each design, up to `MOST_IN_PAGE`.

    More than `MOST_LISTED_DESIGNS` are in the order of the ranking, those that break a requirement last.
    """
    columns = [("", decision.designs), *_required(decision), *_preferred(decision), *_ranked(decision)]
    rows = [list(row) for row in zip(*(cells for _, cells in columns), strict=True)]
    order = list(range(len(rows)))
    if len(rows) > MOST_LISTED_DESIGNS:
        order = [*decision.ranking, *(k for k in order if not decision.feasible[k])]
    return Table([head for head, _ in columns], [rows[k] for k in order[:MOST_IN_PAGE]], sortable=True)


# Each of the next three functions gives columns of the table: a heading, and a cell for each design.
def _required(decision: Decision) -> list[tuple[str, list[str]]]:
    columns = []
    for r, requirement in enumerate(decision.requirements):
        quantity = decision.quantities[r]
        beside = decision.beside(r)
        head = f"{wish_in_words(requirement, quantity)}, {bound_in_words(requirement, quantity, beside)}"
        texts = [known_in_words(value, quantity, beside, requirement.sign) for value in decision.bounded[:, r]]
        kept = decision.margins[:, r] >= 0
        marked = [text if ok else f"{text} ✗" for text, ok in zip(texts, kept, strict=True)]
        columns.append((head, _keyed(marked, decision.bounded[:, r])))
    return columns


def _preferred(decision: Decision) -> list[tuple[str, list[str]]]:
    columns = []
    for j, preference in enumerate(decision.preferences):
        c = len(decision.requirements) + j
        quantity, beside = decision.quantities[c], decision.beside(c)
        weight = f", weight {preference.weight:g}" if len(set(decision.weights)) > 1 else ""
        head = f"{wish_in_words(preference, quantity)} ({preference.better} is better{weight})"
        scores = decision.scores[:, j]
        best = np.isfinite(scores) & (scores == scores.max(where=decision.feasible, initial=-np.inf))
        best &= not decision.alone
        texts = [known_in_words(value, quantity, beside, preference.sign) for value in decision.values.iloc[:, j]]
        marked = [f"**{t}**" if b else t for t, b in zip(texts, best & decision.feasible, strict=True)]
        columns.append((head, _keyed(marked, decision.values.iloc[:, j])))
    return columns


def _keyed(texts: list[str], values: Iterable[float]) -> list[str]:
    """Cells with these texts, which sort by these values."""
    return [Cell(text, float(value)) for text, value in zip(texts, values, strict=True)]


def _ranked(decision: Decision) -> list[tuple[str, list[str]]]:
    columns = []
    if decision.requirements:
        columns.append(("keeps every requirement", ["**yes**" if able else "no" for able in decision.feasible]))
    if decision.preferences and not decision.alone:
        rank = {k: str(place) for place, k in enumerate(decision.ranking, 1)}
        columns += [
            ("on the Pareto front", ["**yes**" if on else "no" for on in decision.front]),
            ("rank", [rank.get(k, "-") for k in range(len(decision.designs))]),
        ]
    if _scored(decision):
        columns += [
            ("score", [f"{score:.2f}" if np.isfinite(score) else "-" for score in decision.score]),
            ("first at this share of all weights", [f"{100 * share:.0f} %" for share in decision.win_share]),
        ]
    return columns


def _scored(decision: Decision) -> bool:
    """Whether scores tell designs apart: preferences rank several on the front."""
    return bool(decision.preferences) and sum(decision.front) > 1


def note_on(decision: Decision, most: int) -> str:
    """Sentences below a table of at most `most` designs: which cases its numbers are over and how they are read."""
    parts = []
    if decision.requirements:
        parts.append(
            "Requirements hold in the worst case of a design, or as brackets say; ✗ marks those that are broken"
        )
    if decision.preferences:
        cases = "one case" if decision.shared == 1 else f"{decision.shared} cases"
        shared = "" if decision.alone else " that all designs share"
        counted, whole = list(dict.fromkeys(decision.counted)), decision.shared - decision.failed
        part = (
            f"{listed([str(number) for number in counted])} of " if any(number != whole for number in counted) else ""
        )
        note = f"Preferences are over {part}the {cases}{shared}"
        if decision.failed == decision.shared:
            each = "the one case" if decision.shared == 1 else f"each of the {cases}"
            note = f"Preferences have no case to go by: in {each}{shared} a design fails"
        elif decision.failed:
            note += f", without {decision.failed} of them in which a design fails"
        if decision.left_out:
            note += f"; without {count(decision.left_out, 'case')} that only some designs have"
        parts.append(note)
        if any(decision.feasible) and not decision.alone:
            parts.append(f"Best values{' of those that keep every requirement' * (not all(decision.feasible))} in bold")
    if len(decision.designs) > most:
        parts.append(f"The {most} best ranked of {len(decision.designs):,} designs are listed")
    if _scored(decision):
        parts.append("Scores go from 0, worst in everything, to 1, best in everything")
    return ". ".join(parts) + "."


def designs_told(decision: Decision) -> list[str]:
    """A text of two lines for each design: its name, and its values by all requirements and preferences."""
    columns = [*_required(decision), *_preferred(decision), *_ranked(decision)]
    worth = zip(*([f"{head}: {cell}" for cell in cells] for head, cells in columns), strict=True)
    lines = ["; ".join(row).replace("**", "") for row in worth]
    return [f"{name}.\n{line}." for name, line in zip(decision.designs, lines, strict=True)]


def decision_captions(decision: Decision, name: str = "decision") -> dict[str, str]:
    """The caption of each figure of a decision, whose names begin with `name`; of `name`, by the panels that it has."""
    reserves = ["how far each design is inside the requirements"] * bool(decision.requirements)
    worth = ["what it is worth by each preference" if reserves else "what each design is worth by each preference"]
    told = [*reserves, *(worth if _scored(decision) else [])]
    front = "The designs over the two preferences of greatest weight, and the Pareto front of these two."
    panels = {name: f"{capitalised(listed(told))}."} if told else {}
    return panels | {f"{name}-front": front}


def write_comparison(counsel: Advice, folder: Path, name: str, spots: Mapping[str, dict | None]) -> Path:
    """Write the HTML page of a comparison, whose figures are in `folder` already, and return its path.

    It is `report.html` or, in the folder of a study or a diagnosis, which has a page of that name, `<name>.html`.
    `spots` are those of each figure, by its name.
    """
    captions = decision_captions(counsel.decision, name)
    pointed = {key: part for key, part in spots.items() if part is not None}
    told = dict(enumerate(designs_told(counsel.decision)))
    states, half = designs_standing(counsel.firsts, counsel.decision.designs) if pointed else ({}, 0.0)
    page = templates().get_template("comparison.html.j2")
    text = page.render(
        counsel=counsel,
        designs=listed_designs(counsel.decision),
        note=note_on(counsel.decision, MOST_IN_PAGE),
        parquet=f"{name}.parquet",
        title=f"{count(len(counsel.decision.designs), 'design')} compared",
        answer=counsel.recommendation.replace("**", ""),
        figures=[picture(folder, key, captions[key], "", spots[key]) for key in spots],
        pointed={"figures": pointed, "cases": told, "states": states, "half": half, "paths": []} if pointed else None,
    )
    taken = any((folder / other).exists() for other in ("manifest.json", "diagnosis.json"))
    return write_whole(folder / (f"{name}.html" if taken else "report.html"), text.encode())


def publish_comparison(counsel: Advice, folder: Path, name: str = "comparison") -> list[str]:
    """Write Markdown, table, figures and HTML page of a decision; the names of the files.

    They begin with `name`, except that the page is `report.html` where :func:`write_comparison` says so.
    """
    ensure_writable(folder)
    decision = counsel.decision
    write_whole(folder / f"{name}.md", (counsel.markdown + "\n").encode())
    table = decision.table
    columns = {column: table[column].tolist() for column in table}
    write_arrow(arrow_table(columns, decision.column_quantities), folder / f"{name}.parquet")
    drawn = decision_pictures(decision, folder, name)
    page = write_comparison(counsel, folder, name, {part: spots for part, (_, spots) in drawn.items()})
    pictures = [path.name for paths, _ in drawn.values() for path in paths]
    return [f"{name}.md", f"{name}.parquet", page.name, *pictures]


def decision_pictures(decision: Decision, folder: Path, name: str) -> dict[str, tuple[list[Path], dict | None]]:
    """Draw the figures of a decision, `name` and `name-front`, as far as there is something to compare.

    For each figure the files written, and its spots.
    """
    drawn = {}
    with rc.in_use():
        if decision.requirements or _scored(decision):
            figure = decision_figure(decision)
            drawn[name] = save_figure(figure, folder, name), spots_of(figure)
        if len(decision.preferences) > 1:
            figure = front_figure(decision)
            drawn[f"{name}-front"] = save_figure(figure, folder, f"{name}-front"), spots_of(figure)
    return drawn
