"""Labels of real rigs: what is drawn again."""

import numpy as np

from prb3r.proof.concealed.build import applied_tensions
from prb3r.proof.concealed.design import Flavour, followed
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.folder import recorded_tables
from prb3r.proof.concealed.labels import Request
from prb3r.proof.concealed.real import build_of, real_label


def test_a_rig_without_equilibrium_under_its_real_tensions_is_drawn_again(monkeypatch):
    design, asked = design_of(78, 0, Flavour.REAL), Request(0, 78, "imperfect-clean", 0)
    first = real_label(asked, design)
    of_first = applied_tensions(np.random.default_rng(first.noise_seed), design, build_of(first), design.program[0])

    def breaking(manipulator, program):
        return None if program[0] == of_first else followed(manipulator, program)

    monkeypatch.setattr("prb3r.proof.concealed.real.followed", breaking)
    again = real_label(asked, design)
    assert (first.note, again.note) == ("draw 1", "draw 2")
    assert again.noise_seed != first.noise_seed
    assert len(recorded_tables(design, again).steps) == sum(map(len, design.program))
