"""All that is drawn of a finished study, written beside its tables, and what its report says along with it."""

from pathlib import Path
from typing import Any, NamedTuple

from prb3r.errors import Problem
from prb3r.present.figure_files import save_figure
from prb3r.present.spots import spots_of
from prb3r.present.study.comparison import (
    MOST_IN_PAGE,
    advice_on,
    decision_captions,
    decision_pictures,
    listed_designs,
    note_on,
)
from prb3r.present.study.figures import study_figure
from prb3r.present.study.paths import paths_section
from prb3r.present.study.pointing import about_designs, pointed
from prb3r.present.study.report import Answers
from prb3r.present.study.rigs import RIGS_CAPTIONS, rigs_pictures, rigs_section
from prb3r.present.study.search import SEARCH_CAPTION, search_picture, search_section
from prb3r.present.study.sheet import Scene
from prb3r.present.study.source import Source
from prb3r.present.study.thinning import loads_to_draw, states_to_draw
from prb3r.study.designs import read_designs
from prb3r.study.run import Result


class Pictures(NamedTuple):
    """What was drawn of a study, and what its report says along with it."""

    files: list[Path]
    figures: list[tuple[str, str]]
    """Name and caption of each figure, in the order of the report."""
    answers: Answers
    problems: list[Problem]
    """Plots that cannot be drawn from the tables."""


def scene_of(result: Result) -> Scene:
    """Everything beside the tables that the figures of a study are drawn from."""
    plan = result.plan
    return Scene(
        lambda n: plan.cases[n].manipulator(),
        tuple(plan.quantities),
        tuple(result.manifest["fits"]),
        frozenset(factor.name for factor in plan.study.factor if factor.drawn is not None),
        lambda n: plan.cases[n].settings["reach"],
        loads_to_draw(result),
        tuple(factor.name for factor in plan.study.factor),
        {comparison.name: comparison.to for comparison in plan.study.comparison},
    )


def draw_pictures(result: Result, source: Source) -> Pictures:
    """Draw every plot of a study and what its decision, search, path and rigs call for."""
    plan, states, scene = result.plan, states_to_draw(result), scene_of(result)
    files, figures, problems = [], [], []
    spots: dict[str, Any] = {}
    for plot in plan.study.plot:
        try:
            figure = study_figure(plot, result.cases, states, scene)
            files += save_figure(figure, result.folder, plot.name)
            spots[plot.name] = spots_of(figure)
            figures.append((plot.name, plot.caption))
        except ValueError as error:
            problems.append(Problem(f"{plan.path} plot {plot.name}", str(error)))
    counsel = None
    if plan.study.decides:
        counsel = advice_on(read_designs([result.folder]))
        drawn = decision_pictures(counsel.decision, result.folder, "decision")
        files += [path for paths, _ in drawn.values() for path in paths]
        spots |= {name: about_designs(about, len(plan.cases)) for name, (_, about) in drawn.items()}
        captions = decision_captions(counsel.decision)
        figures = [(name, captions[name]) for name in drawn] + figures
    sections = []
    if counsel is not None and plan.study.search is not None:
        figure = search_picture(counsel.decision)
        files += save_figure(figure, result.folder, "search")
        spots["search"] = about_designs(spots_of(figure), len(plan.cases))
        figures.append(("search", SEARCH_CAPTION))
        sections.append(search_section(plan.study, result.cases, counsel.decision))
    if plan.study.reach is not None:
        sections.append(paths_section(result, scene))
    if result.rigs is not None:
        pictures = rigs_pictures(result)
        files += pictures
        figures = [(name, RIGS_CAPTIONS[name]) for name in dict.fromkeys(path.stem for path in pictures)] + figures
        sections.append(rigs_section(result))
    shown = {name: about for name, about in spots.items() if about is not None}
    known = pointed(source, result, states, shown, counsel.decision if counsel else None) if shown else None
    if counsel is None:
        return Pictures(files, figures, Answers(sections=sections, pointed=known), problems)
    designs, note = listed_designs(counsel.decision), note_on(counsel.decision, MOST_IN_PAGE)
    return Pictures(files, figures, Answers(counsel, designs, note, sections, known), problems)
