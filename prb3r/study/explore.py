"""Runs a search for the best design: each generation of designs is a plan of its own, and at the end all form one."""

from dataclasses import replace

import numpy as np

from prb3r.runs.parts import Parts
from prb3r.runs.tasks import Workers
from prb3r.study.axes import first_designs
from prb3r.study.compute import obtain_results
from prb3r.study.designs import designs_of
from prb3r.study.plan import Plan, Progress, Quiet
from prb3r.study.resolve import resolve
from prb3r.study.search import Evaluated, searched_designs
from prb3r.study.tables import tabulated


def explored(plan: Plan, parts: Parts, workers: Workers, progress: Progress, fresh: bool = False) -> tuple[Plan, int]:
    """The plan of all designs that a search tries, whose results parts then hold, and the number of cases computed.

    The search is deterministic: in a later run it goes through stored designs again without computing them.
    """
    study, counted = plan.study, []
    assert study.search is not None

    def judged(designs: np.ndarray) -> Evaluated:
        """Margins and scores of designs (n, factors), solved where parts lack them."""
        asked = replace(plan, cases=resolve(plan.path, study, designs=designs))
        counted.append(obtain_results(asked, parts, workers, Quiet(progress), fresh))
        cases = designs_of(study, tabulated(asked, asked.places(parts)))
        bounded, wanted = (cases.values(wishes, cases.frame) for wishes in (study.requirement, study.preference))
        margins = [[r.margin(v) for r, v in zip(study.requirement, row, strict=True)] for row in bounded]
        scores = wanted * [preference.sign for preference in study.preference]
        return Evaluated(
            np.array(margins, float).reshape(bounded.shape),
            np.nan_to_num(scores, nan=-np.inf, neginf=-np.inf, posinf=np.inf),
        )

    loads = plan.loads() // len(first_designs(study))
    progress.begin(study.name, study.search.designs * loads, 0)
    try:
        designs = searched_designs(study, judged)
    finally:
        progress.end()
    return replace(plan, cases=resolve(plan.path, study, designs=designs)), sum(counted)
