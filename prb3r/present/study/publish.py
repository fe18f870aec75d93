"""Figures and report of a finished study, beside its tables."""

from pathlib import Path

from prb3r.errors import Problem, SpecError
from prb3r.present.page import save_figure
from prb3r.present.study.comparison import DECISION_CAPTIONS, advice_on, decision_pictures
from prb3r.present.study.figures import study_figure
from prb3r.present.study.paths import paths_section
from prb3r.present.study.report import Answers, Source, write_report
from prb3r.present.study.rigs import RIGS_CAPTIONS, rigs_pictures, rigs_section
from prb3r.present.study.search import SEARCH_CAPTION, search_pictures, search_section
from prb3r.present.study.sheet import Scene
from prb3r.present.study.thinning import loads_to_draw, states_to_draw
from prb3r.study.designs import read_designs
from prb3r.study.run import Result


def publish(result: Result) -> list[Path]:
    """Draw every plot of the study and write its report; the files written.

    Raises
    ------
    SpecError
        For plots that cannot be drawn from the tables, after everything else has been written.
    """
    plan, states = result.plan, states_to_draw(result)
    sampled = frozenset(factor.name for factor in plan.study.factor if factor.drawn is not None)
    fits = tuple(result.manifest["fits"])
    scene = Scene(
        lambda n: plan.cases[n].manipulator(),
        tuple(plan.quantities),
        fits,
        sampled,
        lambda n: plan.cases[n].settings["reach"],
        loads_to_draw(result),
    )
    files, figures, problems = [], [], []
    for plot in plan.study.plot:
        try:
            files += save_figure(study_figure(plot, result.cases, states, scene), result.folder, plot.name)
            figures.append((plot.name, plot.caption))
        except ValueError as error:
            problems.append(Problem(f"{plan.path} plot {plot.name}", str(error)))
    counsel = None
    if plan.study.decides:
        counsel = advice_on(read_designs([result.folder]))
        drawn = decision_pictures(counsel.decision, result.folder, "decision")
        files += drawn
        figures = [(name, DECISION_CAPTIONS[name]) for name in dict.fromkeys(path.stem for path in drawn)] + figures
    sections = []
    if counsel is not None and plan.study.search is not None:
        drawn = search_pictures(counsel.decision, result.folder)
        files += drawn
        figures.append((drawn[0].stem, SEARCH_CAPTION))
        sections.append(search_section(plan.study, result.cases, counsel.decision))
    if plan.study.reach is not None:
        sections.append(paths_section(result, scene))
    if result.rigs is not None:
        drawn = rigs_pictures(result)
        files += drawn
        figures = [(name, RIGS_CAPTIONS[name]) for name in dict.fromkeys(path.stem for path in drawn)] + figures
        sections.append(rigs_section(result))
    source = Source(plan.study, result.cases, plan.quantities, result.manifest)
    files += write_report(result.folder, source, figures, Answers(counsel, sections))
    if problems:
        raise SpecError(*problems)
    return files
