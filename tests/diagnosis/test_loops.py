"""Plates that dissipate are told from plates that soften and from cables that rub, where something unloads."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import Case, investigated

from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.remarks import never_unloaded, or_loops
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.plates import NonlinearPlate

LOOPS = {"kind": "hysteretic_plate", "slipping_share": 0.4, "yield_strain": 1.2e-3}
SMOOTH = Case(hidden=(tuple(LOOPS.items()),), friction=0.0)
"""Cables that do not rub: all that is lost is lost in the plates."""


def test_loops_of_plates_are_named_and_not_taken_for_friction():
    found = tell(investigated(SMOOTH))
    assert found.verdict == "explained"
    assert [effect.kind for effect in found.effects] == ["hysteretic_plate"]
    (effect,) = found.effects
    assert not effect.rivals
    assert effect.parameters["slipping_share"].value == pytest.approx(0.4, rel=0.1)
    assert effect.parameters["yield_strain"].value == pytest.approx(1.2e-3, rel=0.1)


def test_derivatives_of_loops_are_those_that_fits_follow():
    """Of the chosen model: the readings' derivatives against differences of whole predictions."""
    fitted = investigated(SMOOTH).choice.fitted
    moved = fitted.model.moved(fitted.p, fitted.solved)
    for k in range(len(fitted.p)):
        step = 1e-5 * np.eye(len(fitted.p))[k]
        ahead, behind = (fitted.model.solve(fitted.p + side * step).readings for side in (1, -1))
        assert moved[:, k] == pytest.approx((ahead - behind) / 2e-5, abs=1e-3 * np.abs(moved[:, k]).max())


@pytest.mark.parametrize(
    ("ratio", "suspected", "said"), [(0.5, False, True), (0.5, True, False), (1.5, False, False), (None, False, False)]
)
def test_where_nothing_unloads_softening_and_dissipating_are_said_to_be_alike(ratio, suspected, said):
    law = (
        {"law": "cubic", "cubic_m2": 0.01} if ratio is None else {"law": "bilinear", "knee_per_m": 2.0, "ratio": ratio}
    )
    found = SimpleNamespace(fitted=SimpleNamespace(effects=(NonlinearPlate(kind="nonlinear_plate", **law),)))
    remarks = never_unloaded(found, [Hypothesis("hysteretic_plate")] if suspected else [])
    assert len(remarks) == said
    assert all("are alike here" in remark and "unload" in remark for remark in remarks)


@pytest.mark.parametrize(
    ("modulus", "kinds", "unloads", "said"),
    [
        (6e10, {"pulley_friction", "worn_hole"}, True, True),
        (2e11, {"pulley_friction"}, True, False),
        (6e10, {"pulley_friction"}, False, False),
        (6e10, {"precurvature"}, True, False),
    ],
)
def test_loops_of_plates_that_may_be_superelastic_may_have_been_taken_for_friction(modulus, kinds, unloads, said):
    law = NonlinearPlate(kind="nonlinear_plate", law="bilinear", knee_per_m=2.0, ratio=0.2)
    rig = SimpleNamespace(recording=SimpleNamespace(manipulator=SimpleNamespace(youngs_modulus_pa=modulus / 2)))
    fitted = SimpleNamespace(
        effects=(law,),
        constants=SimpleNamespace(log_stiffness=np.log(2)),
        model=SimpleNamespace(settings=Settings(), predict=rig),
    )
    remarks = or_loops(
        SimpleNamespace(kinds=frozenset(kinds), fitted=fitted), [Hypothesis("hysteretic_plate")] if unloads else []
    )
    assert len(remarks) == said
    assert all("pulley_friction and worn_hole may stand for that" in remark for remark in remarks)
