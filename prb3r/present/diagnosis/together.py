"""The page of several recordings diagnosed together: shared parameters as figure and table, links to their pages."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from prb3r.diagnosis.result.common import Common
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.shared_parameter import SharedParameter
from prb3r.diagnosis.result.statements import IN_WORDS
from prb3r.markdown import listed, quoted
from prb3r.present import rc, style
from prb3r.present.diagnosis import sentences as say
from prb3r.present.diagnosis.panels import panel_grid
from prb3r.present.figure_files import save_figure
from prb3r.present.page import Table, picture, templates
from prb3r.quantities import describe
from prb3r.runs.files import ensure_writable, write_whole

SHARED_FIGURE = "shared"
SHARED_CAPTION = (
    "What the rigs share, from each recording with the same effects and from all of them, with 95 % intervals under "
    "these effects alone; the pages of the recordings have intervals over all sets of effects that are left."
)
# looks of values from all recordings, from one of them, and from one that was given a value of its own
OF_ALL: dict[str, Any] = {"color": style.PALETTE[0], "marker": "o", "ms": 4.0, "lw": 1.6}
OF_ONE: dict[str, Any] = {"color": style.PALETTE[2], "marker": "s", "ms": 3.4, "lw": 1.0}
PARTED: dict[str, Any] = {**OF_ONE, "mfc": "white"}
ROW_MM = 5.5
"""Height of a line of a recording's row in the figure, mm."""
WIDEST_NAME = 24
"""Characters in a line of a recording's name in the figure."""


def shared_figure(common: Common) -> Figure | None:
    """A panel for each shared parameter with its value from all recordings and from each; None if none is shared."""
    if not common.shared:
        return None
    with rc.in_use():
        names, columns = ["together", *common.recordings], min(len(common.shared), 3)
        rows = -(-len(common.shared) // columns)
        handles = [Line2D([], [], **OF_ALL, label="together"), Line2D([], [], **OF_ONE, label="from each by itself")]
        if any(shared.own for shared in common.shared):
            handles.append(Line2D([], [], **PARTED, label="the same, with a value of its own"))
        lines = max(len(wrap(name, WIDEST_NAME)) for name in names)
        width, height = style.SINGLE if columns == 1 else style.DOUBLE, rows * (16 + ROW_MM * lines * len(names))
        figure, grid = panel_grid(rows, columns, height, handles, width, sharey=True, count=len(common.shared))
        for axes, shared in zip(grid.ravel(), common.shared, strict=False):
            _values(axes, shared, names)
    return figure


def _values(axes, shared: SharedParameter, names: Sequence[str]) -> None:
    """Draw the estimates of one shared parameter; rows are `names`: `together` and all recordings."""
    known, (words, factor, unit) = [shared.together, *shared.alone], _in_words(shared)
    looks = {name: PARTED if name in shared.own else OF_ONE for name in shared.recordings}
    for name, estimate in zip(["together", *shared.recordings], known, strict=True):
        row = names.index(name)
        if estimate.low is None or estimate.high is None:
            axes.text(0.5, row, "not told", transform=axes.get_yaxis_transform(), ha="center", va="center")
            continue
        low, value, high = (factor * end for end in (estimate.low, estimate.value, estimate.high))
        look = looks.get(name, OF_ALL) if row else OF_ALL
        axes.plot([low, high], [row, row], color=look["color"], lw=look["lw"])
        axes.plot([value], [row], **{**look, "ls": ""})
    axes.set_yticks(range(len(names)), ["\n".join(wrap(style.literal(name), WIDEST_NAME)) for name in names])
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.grid(False, axis="y")
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel(f"{words} ({unit})" if unit else words)
    axes.set_title(say.spaced(shared.effect) if shared.effect else "constants", pad=3)


def _in_words(shared: SharedParameter) -> tuple[str, float, str]:
    """Name of a parameter in figures and tables, the factor from SI to the shown unit, and that unit."""
    if shared.parameter in IN_WORDS:
        words, factor, unit = IN_WORDS[shared.parameter]
        words = words.removeprefix("the ")
        return words[0].upper() + words[1:], factor, unit.strip()
    ends = [end for estimate in (shared.together, *shared.alone) for end in estimate.numbers if end is not None]
    shown = style.shown(describe(shared.parameter), ends)
    return say.parameter_title(shared.parameter).capitalize(), shown.factor, shown.unit


def shared_table(common: Common) -> Table | None:
    """A row for each shared parameter: its value from all recordings and from each; None if none is shared."""
    rows = []
    for shared in common.shared:
        alone = dict(zip(shared.recordings, shared.alone, strict=True))
        cells = [_cell(shared, alone.get(name), name in shared.own) for name in common.recordings]
        about = [say.spaced(shared.effect) or "constant", _in_words(shared)[0]]
        rows.append([*about, _cell(shared, shared.together), *cells, _agreement(shared)])
    head = ["Of", "Parameter", "Together", *common.recordings, "Agree"]
    return Table(head, rows, (0, 1, len(head) - 1)) if rows else None


def _agreement(shared: SharedParameter) -> str:
    """Whether recordings agree on a parameter; a dash where no two tell it."""
    if not shared.agrees:
        return "**no**"
    return "yes" if shared.compared else "–"


def _cell(shared: SharedParameter, estimate, parted: bool = False) -> str:
    """An estimate with interval and unit; `parted`: the recording was given a value of its own."""
    if estimate is None:
        return "–"
    if estimate.low is None:
        return "not told"
    _, factor, unit = _in_words(shared)
    value, low, high = (style.digits(factor * end) for end in estimate.numbers)
    return f"{value} ({estimate.interval(low, high)}){f' {unit}' if unit else ''}{', its own' if parted else ''}"


def publish_together(
    diagnoses: Sequence[Diagnosis], common: Common, folder: str | Path, pages: Mapping[str, str]
) -> list[Path]:
    """Write the figure `shared` and `report.html` over several recordings; the files written.

    Parameters
    ----------
    pages : link from `folder` to the page of each recording's own diagnosis, by the recording's name.

    Raises
    ------
    SpecError
        If the folder cannot be made or written to.
    EngineError
        If the disk is full.
    """
    folder = Path(folder)
    ensure_writable(folder)
    figure, files, shown = shared_figure(common), [], None
    if figure is not None:
        files = save_figure(figure, folder, SHARED_FIGURE)
        shown = picture(folder, SHARED_FIGURE, SHARED_CAPTION)
    rows = [
        (diagnosis.name, pages[diagnosis.name], [say.verdict_sentences(diagnosis), *say.headlines(diagnosis)[1:]])
        for diagnosis in diagnoses
    ]
    content = {
        "names": listed(quoted(common.recordings)),
        "sentences": list(common.sentences),
        "table_of_shared": shared_table(common),
    }
    page = templates().get_template("together.html.j2").render(content, figure=shown, diagnoses=rows)
    return [*files, write_whole(folder / "report.html", page.encode())]
