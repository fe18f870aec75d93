"""Figures and report of a finished study, written beside its tables."""

from pathlib import Path
from typing import Any

from prb3r.errors import Problem, SpecError
from prb3r.present.page import save_figure
from prb3r.present.spots import spots_of
from prb3r.present.study.comparison import DECISION_CAPTIONS, advice_on, decision_pictures
from prb3r.present.study.figures import study_figure
from prb3r.present.study.paths import paths_section
from prb3r.present.study.pointing import about_designs, pointed
from prb3r.present.study.report import Answers, write_report
from prb3r.present.study.rigs import RIGS_CAPTIONS, rigs_pictures, rigs_section
from prb3r.present.study.search import SEARCH_CAPTION, search_picture, search_section
from prb3r.present.study.section import Section
from prb3r.present.study.sheet import Scene
from prb3r.present.study.source import Source
from prb3r.present.study.thinning import loads_to_draw, states_to_draw
from prb3r.study.designs import read_designs
from prb3r.study.run import Result
from prb3r.study.workspace import convergence_warning


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
    )


def publish(result: Result) -> list[Path]:
    """Draw every plot of the study and write its report; the files written.

    Raises
    ------
    SpecError
        For plots that cannot be drawn from the tables, after everything else has been written.
    """
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
        figures = [(name, DECISION_CAPTIONS[name]) for name in drawn] + figures
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
    if "workspace_half_share" in result.cases:
        warning = convergence_warning(result.cases["workspace_half_share"].to_numpy(float))
        sections += [Section("Convergence", [warning], [])] if warning else []
    source = Source(plan.study, result.cases, plan.quantities, result.manifest)
    shown = {name: about for name, about in spots.items() if about is not None}
    known = pointed(source, result, states, shown, counsel.decision if counsel else None) if shown else None
    files += write_report(result.folder, source, figures, Answers(counsel, sections, known))
    if problems:
        raise SpecError(*problems)
    return files
