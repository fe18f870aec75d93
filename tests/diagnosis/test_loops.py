"""Plates that dissipate are told from plates that soften and from cables that rub, where something unloads."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from diagnosis.simulated import NITINOL, Case, investigated, recorded

from prb3r.diagnosis.fit.calibrate import fit_constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.library import SUSPECTS, hypotheses
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.remarks import never_unloaded
from prb3r.diagnosis.result.tell import tell
from prb3r.diagnosis.search import starts
from prb3r.diagnosis.search.dissipating import dissipating
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.plates import NonlinearPlate

LOOPS = {"kind": "hysteretic_plate", "slipping_share": 0.4, "yield_strain": 1.2e-3}
SMOOTH = Case(hidden=(tuple(LOOPS.items()),), friction=0.0)
"""Cables that do not rub: all that is lost is lost in the plates."""
SOFT = {"kind": "nonlinear_plate", "law": "smooth", "knee_strain": 0.008, "ratio": 0.15, "sharpness": 3.0}
FLAG = {"kind": "flag_hysteresis", "reverse_ratio": 0.5}
"""As wires of nitinol bend: the plateau of unloading is at half of that of loading."""
ALIKE = {"flag_hysteresis", "hysteretic_plate", "pulley_friction", "cable_friction"}
"""Kinds by which less comes back than went in."""
AMONG_ALIKE = replace(
    SMOOTH, without=frozenset(SUSPECTS) - {*ALIKE, "slip_history", "tension_play", "nonlinear_plate", "plate_softening"}
)
"""Searched among those and plates that soften, in half the time; plates that slip little by little, among all kinds."""


@pytest.mark.long
def test_loops_of_plates_are_named_and_not_taken_for_friction():
    found = tell(investigated(AMONG_ALIKE))
    assert found.verdict == "explained"
    assert [effect.kind for effect in found.effects] == ["hysteretic_plate"]
    (effect,) = found.effects
    assert not effect.rivals
    assert effect.parameters["slipping_share"].value == pytest.approx(0.4, rel=0.1)
    assert effect.parameters["yield_strain"].value == pytest.approx(1.2e-3, rel=0.1)


@pytest.mark.long
def test_plates_that_slip_little_by_little_are_told_from_those_that_slip_at_once():
    """As layers and braids do, of which each slips at a bend of its own: three elements, on average at 1.2e-3."""
    slowly = LOOPS | {"elements": 3}
    found = tell(investigated(replace(SMOOTH, hidden=(tuple(slowly.items()),))))
    assert found.verdict == "explained"
    (effect,) = found.effects
    assert (effect.kind, effect.place) == ("hysteretic_plate", {"elements": 3})
    assert effect.parameters["slipping_share"].value == pytest.approx(0.4, rel=0.1)
    assert effect.parameters["yield_strain"].value == pytest.approx(1.2e-3, rel=0.1)


@pytest.mark.long
def test_flags_of_superelastic_plates_are_named_and_not_taken_for_a_pulley():
    hidden = tuple(tuple(effect.items()) for effect in (SOFT, FLAG))
    without = frozenset(SUSPECTS) - {"nonlinear_plate", "disk_contact", *ALIKE}
    found = tell(investigated(Case(hidden, without=without, friction=0.0, plates=NITINOL)))
    assert found.verdict == "explained"
    assert {effect.kind for effect in found.effects} == {"nonlinear_plate", "flag_hysteresis"}
    flag = next(effect for effect in found.effects if effect.kind == "flag_hysteresis")
    told = flag.parameters["reverse_ratio"]
    assert told.value == pytest.approx(0.5, rel=0.1)
    assert told.high < 1.3 * told.low


def laws_of_plates(recording):
    """The constants alone of a recording, and a search among laws of all plates that its loops suggest."""
    settings = Settings()
    calibrated = fit_constants(predictor(recording, settings), settings=settings)
    scope = Scope.of(recording, calibrated.model.predict.chain, calibrated.solved.states)
    laws = [each for each in hypotheses(scope) if each.kind in ("hysteretic_plate", "nonlinear_plate")]
    return calibrated, SimpleNamespace(library=laws, apply=lambda function, tasks: list(map(function, tasks)))


def test_a_search_that_explains_nothing_begins_anew_from_plates_that_dissipate():
    """From the law that makes the loops, with its numbers; from none where plates are soft and make none."""
    fitted = dissipating(*laws_of_plates(recorded(SMOOTH)))
    (law,) = fitted.effects
    assert law.kind == "hysteretic_plate"
    assert law.slipping_share == pytest.approx(0.4, rel=0.15)
    assert law.yield_strain == pytest.approx(1.2e-3, rel=0.15)
    assert dissipating(*laws_of_plates(recorded(Case(friction=0.0)))) is None


@pytest.mark.parametrize(
    ("kinds", "ahead", "structured", "taken"),
    [
        ({"plate_relaxation"}, 30.0, True, True),
        ({"plate_relaxation"}, -30.0, False, True),  # nothing is left but noise
        ({"plate_relaxation"}, -30.0, True, False),
        ({"hysteretic_plate"}, 30.0, False, False),  # it is there already
    ],
)
def test_what_is_found_from_dissipating_plates_has_to_be_better(monkeypatch, kinds, ahead, structured, taken):
    fitted = SimpleNamespace(costly=False, model=SimpleNamespace(settings=Settings()))
    survivors = [SimpleNamespace(fitted=fitted)]
    choice = SimpleNamespace(fitted=fitted, kinds=frozenset(kinds), survivors=survivors, structured=True)
    other = SimpleNamespace(survivors=survivors, structured=structured)
    beginning = SimpleNamespace(calibrated=fitted, search=None)
    monkeypatch.setattr(starts, "dissipating", lambda *_: fitted)
    monkeypatch.setattr(starts, "_from_known", lambda *_: SimpleNamespace(explored=None))
    monkeypatch.setattr(starts, "exchange_effects", lambda *_: None)
    monkeypatch.setattr(starts, "choose", lambda *_: other)
    monkeypatch.setattr(starts, "mean_log_odds", lambda *_: ahead)
    assert (starts._or_dissipating(choice, beginning) is other) == taken


def test_flags_are_suspected_of_superelastic_metals_that_are_bent_back(nitinol, rubbing):
    def suspected(known):
        return "flag_hysteresis" in {each.kind for each in hypotheses(known)}

    assert suspected(nitinol)
    assert not suspected(rubbing), "steel springs back as it went"
    assert not suspected(nitinol._replace(bend=np.zeros_like(nitinol.bend))), "nothing is bent back"


@pytest.mark.long
def test_derivatives_of_loops_are_those_that_fits_follow():
    """Of the chosen model: the readings' derivatives against differences of whole predictions."""
    fitted = investigated(AMONG_ALIKE).choice.fitted
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
