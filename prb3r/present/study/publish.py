"""Figures and report of a finished study, written beside its tables."""

from dataclasses import replace
from pathlib import Path

from prb3r.errors import Problem, SpecError
from prb3r.present.study.report import Answers, write_report
from prb3r.present.study.section import Section
from prb3r.present.study.source import Source
from prb3r.study.converged import workspace_warnings
from prb3r.study.run import Result
from prb3r.study.unasked import unasked_warnings


def publish(result: Result) -> list[Path]:
    """Draw every plot of the study and write its report; the files written.

    Raises
    ------
    SpecError
        For plots that cannot be drawn from the tables, after everything else has been written.
    """
    study, answers = result.plan.study, Answers()
    source = Source(study, result.cases, result.plan.quantities, result.manifest)
    files: list[Path] = []
    figures: list[tuple[str, str]] = []
    problems: list[Problem] = []
    if study.plot or study.decides or study.reach is not None or result.rigs is not None:
        from prb3r.present.study.pictures import draw_pictures  # loads matplotlib

        files, figures, answers, problems = draw_pictures(result, source)
    if unasked := unasked_warnings(result.cases, study):
        answers = replace(answers, sections=[*answers.sections, Section("What nothing asks for", unasked, [])])
    if warnings := workspace_warnings(result.cases, study):
        answers = replace(answers, sections=[*answers.sections, Section("Convergence", warnings, [])])
    files += write_report(result.folder, source, figures, answers)
    if problems:
        raise SpecError(*problems)
    return files
