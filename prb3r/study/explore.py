"""A search for the best design as a run: every generation of designs is a plan of its own, then all are one."""

from dataclasses import replace

import numpy as np

from prb3r.runs.parts import Parts
from prb3r.runs.tasks import Workers
from prb3r.study.axes import first_designs
from prb3r.study.compute import brought
from prb3r.study.designs import designs_of
from prb3r.study.plan import Plan, Progress, Quiet
from prb3r.study.resolve import resolve
from prb3r.study.search import Judged, searched_designs
from prb3r.study.tables import tabulated


def explored(plan: Plan, parts: Parts, workers: Workers, progress: Progress, fresh: bool = False) -> tuple[Plan, int]:
    """The plan with every design that a search tries, generation by generation, and the number of computed cases.

    The search is the same every time: where designs are known already it goes through them again without computing.
    """
    study, counted = plan.study, []
    assert study.search is not None

    def judged(designs: np.ndarray) -> Judged:
        asked = replace(plan, cases=resolve(plan.path, study, designs=designs))
        counted.append(brought(asked, parts, workers, Quiet(progress), fresh))
        cases = designs_of(study, tabulated(asked, parts))
        bounded, wanted = (cases.values(wishes, cases.frame) for wishes in (study.requirement, study.preference))
        margins = [[r.margin(v) for r, v in zip(study.requirement, row, strict=True)] for row in bounded]
        scores = wanted * [preference.sign for preference in study.preference]
        return Judged(np.array(margins, float).reshape(bounded.shape), np.nan_to_num(scores, nan=-np.inf))

    loads = plan.loads() // len(first_designs(study))
    progress.begin(study.name, study.search.designs * loads, 0)
    try:
        designs = searched_designs(study, judged)
    finally:
        progress.end()
    return replace(plan, cases=resolve(plan.path, study, designs=designs)), sum(counted)
