"""Rigs that show what few do."""

import numpy as np

from prb3r.proof.concealed.design import Flavour
from prb3r.proof.concealed.designs import design_of
from prb3r.proof.concealed.real import rare_among_others
from prb3r.proof.rig.effects import RECORDS


def test_one_rare_effect_comes_before_others_that_the_rig_knows_beside_it():
    rng, design, seen = np.random.default_rng(5), design_of(1, 0, Flavour.REAL), set()
    for _ in range(60):
        rare, *others = (RECORDS[each.effect["kind"]] for each in rare_among_others(rng, design))
        seen.add(rare.kind)
        assert rare.rare
        assert not any(record.rare for record in others)
        assert rare.excludes.isdisjoint(record.kind for record in others)
    assert seen == {kind for kind, record in RECORDS.items() if record.rare}
