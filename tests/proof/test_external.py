"""Fixed recordings of the independent rig, made here, against the diagnosis as it is: no tuning saw them.

Twelve of all classes, several effects at once among them, which takes minutes: `prb3r prove --cases 12 --seed 20261122
--class several --class imperfect-single --class imperfect-clean --class blunder`.
"""

import pytest

from prb3r.proof.concealed.design import Flavour
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.labels import Request
from prb3r.proof.concealed.real import real_label
from prb3r.proof.judging.opened import OpenedCase
from prb3r.proof.judging.real_scores import blunder_said
from prb3r.proof.prove import MAIN
from prb3r.proof.tasks import RecordingTask, VerdictTask, answer, record

SEED = 20261122


def judged(number, cls):
    """A recording of the class, opened."""
    design = design_of(SEED, number, Flavour.REAL)
    label = real_label(Request(number, SEED, cls, number), design)
    verdict = answer(VerdictTask(number, record(RecordingTask(design, label)), frozenset(), MAIN, SEED))
    assert not verdict.reason
    return OpenedCase(label, verdict, design.friction)


@pytest.mark.long
def test_nothing_is_said_of_a_rig_that_is_merely_imperfect():
    case = judged(0, "imperfect-clean")
    assert case.verdict.verdict == "adequate"
    assert not case.verdict.named
    assert case.verdict.noise == pytest.approx(case.label.build["noise"], rel=0.25)


def test_a_blunder_is_said_before_all_else():
    case = judged(2, "blunder")
    assert case.verdict.verdict == "set-up"
    assert blunder_said(case)
