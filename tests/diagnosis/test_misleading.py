"""Effects that predict what no fit has seen worse than constants alone do."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from prb3r.diagnosis.check import check
from prb3r.diagnosis.checks import predicting as predicting_module
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.predicting import is_picked, predicting
from prb3r.diagnosis.checks.unseen import Unseen, unseen
from prb3r.diagnosis.checks.verdict import verdict_on, why_misleading
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.result.rig_remarks import too_vague
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search
from tests.diagnosis.simulated import recorded


@pytest.mark.long
def test_effects_that_predict_what_was_set_aside_worse_than_constants_alone_explain_nothing(monkeypatch):
    """Errors of parts as drawn count, as those of another rig would: with parts as this one has them all is well."""
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    assert check(searched).verdict == "explained"
    real = Unseen.errors

    def farther(self: Unseen, calibrated: Fit, explained: Fit) -> HeldOut:
        errors = real(self, calibrated, explained)
        return replace(errors, rmse_explained_m=2.1 * errors.rmse_calibrated_m)

    monkeypatch.setattr(Unseen, "errors", farther)
    found = check(searched)
    assert found.verdict == "unexplained"
    assert found.why.startswith("with all parts as drawn, what is named predicts out, which no fit has seen, to ")


def test_of_errors_those_of_positions_count_before_those_of_angles():
    errors = HeldOut(("a",), 1e-3, 1.9e-3, 1e-4, 0.01, 0.05, 1e-3, 1.0, 1.0, 10)
    assert why_misleading(errors, Settings()) == ""
    farther = why_misleading(replace(errors, rmse_explained_m=4e-3), Settings())
    assert "to 4 mm, and constants alone do to 1;" in farther
    turned = why_misleading(replace(errors, rmse_calibrated_m=None, rmse_explained_m=None), Settings())
    assert "to 2.86 degrees, and constants alone do to 0.573;" in turned
    assert why_misleading(None, Settings()) == ""


def test_an_error_counts_as_worse_only_beyond_that_of_constants_and_noise():
    errors = HeldOut(("a",), 1e-3, 1.1e-3, 2e-3, 0.01, 0.011, 1e-3, 1.0, 1.0, 10)
    assert not errors.is_worse(1.2)
    assert not replace(errors, rmse_explained_m=2.3e-3).is_worse(1.2)  # noise of 2 mm
    assert replace(errors, rmse_explained_m=2.5e-3).is_worse(1.2)
    assert replace(errors, rmse_explained_rad=0.0121).is_worse(1.2)
    assert not replace(errors, rmse_explained_rad=None).is_worse(1.2)
    assert not errors.better_as_made
    assert replace(errors, rmse_made_m=0.8e-3).better_as_made
    assert not replace(errors, rmse_made_m=1.0e-3).better_as_made
    assert replace(errors, rmse_made_rad=0.005).better_as_made


@pytest.mark.parametrize(
    ("likely", "of_any", "structured", "impossible", "verdict"),
    [
        ({}, 0.3, False, True, "adequate"),
        ({"tip_load_friction": 0.7}, 0.7, False, False, "adequate"),
        ({"tip_load_friction": 0.7}, 0.7, False, True, "ambiguous"),
        ({}, 0.8, False, False, "adequate"),
        ({}, 0.95, False, False, "ambiguous"),  # one of several, none of which is likelier there than not
        ({}, 0.95, True, False, "adequate"),  # within a noise that is stated too large
    ],
)
def test_constants_are_not_adequate_where_effects_are_likely_together_or_beside_one_on_a_bound(
    likely, of_any, structured, impossible, verdict
):
    fitted = SimpleNamespace(model=SimpleNamespace(settings=Settings()))
    choice = SimpleNamespace(kinds=(), likely=likely, of_any=of_any, structured=structured, fitted=fitted)
    assert verdict_on(choice, unsure=False, impossible=impossible) == verdict


@pytest.mark.parametrize(
    ("predict", "taken"),
    [
        ({"gradient"}, "gradient"),  # as few effects as the chosen one
        ({"contact gradient hole", "contact gradient"}, "contact gradient hole"),  # the most probable that does
        ({"contact gradient"}, "contact gradient"),
        ({"contact rare"}, "contact"),  # too improbable
        ({"contact", "contact gradient"}, "contact"),
    ],
)
def test_where_the_chosen_model_fails_the_most_probable_one_that_predicts_takes_its_place(monkeypatch, predict, taken):
    """With no more effects if there is one; then it is only picked by what was set aside."""

    def model(names, probability):
        effects = tuple(names.split())
        fitted = SimpleNamespace(
            name=names, converged=True, model=SimpleNamespace(hypotheses=effects, settings=Settings())
        )
        return SimpleNamespace(fitted=fitted, effects=frozenset(effects), probability=probability, log_evidence=0.0)

    likely = [model("contact gradient hole", 0.3), model("contact gradient", 0.2), model("gradient", 0.1)]
    survivors = [model("contact", 0.37), *likely, model("contact rare", 0.03)]
    chosen = survivors[0].fitted
    choice = SimpleNamespace(fitted=chosen, survivors=survivors, effects=survivors[0].effects, kinds={"contact"})
    fresh = SimpleNamespace(refutes=lambda fitted: fitted.name not in predict)
    monkeypatch.setattr(predicting_module, "_by_all_sequences", lambda *_: chosen)
    monkeypatch.setattr(predicting_module, "_with", lambda other, choice, search: SimpleNamespace(fitted=other))
    after = predicting(choice, fresh, None)
    assert after.fitted.name == taken
    assert is_picked(after, chosen, fresh) == (len(taken.split()) > 1)


@pytest.mark.long
def test_what_was_set_aside_names_nothing_that_predicts_it_worse_than_constants(monkeypatch):
    """A fuller model that the readings set aside favour is taken, unless it would be the first to name an effect and is
    farther off with all parts as drawn."""
    searched = to_search(Task(recorded()), lambda stage: None, serially)
    choice, search = searched.choice, searched.tested.doubted.search
    alone = replace(choice, fitted=choice.calibrated)
    fuller = choice.fitted
    monkeypatch.setattr(predicting_module, "_by_all_sequences", lambda *_: fuller)
    fresh = unseen(searched.tested.doubted.recording, searched.tested.doubted.aside, Settings(), choice.doubts)
    monkeypatch.setattr(Unseen, "refutes", lambda *_: False)
    for worse, expected in ((False, fuller.model.hypotheses), (True, ())):
        monkeypatch.setattr(HeldOut, "is_worse", lambda self, times, worse=worse: worse)
        assert predicting(alone, fresh, search).fitted.model.hypotheses == expected
        assert predicting(replace(choice, fitted=fuller), fresh, search).fitted is fuller


@pytest.mark.parametrize(
    ("explained", "made", "said"),
    [(0.0006, None, False), (0.0009, 0.0004, False), (0.0009, None, True), (0.0009, 0.0008, True)],
)
def test_what_is_missed_by_far_more_than_noise_is_said_though_it_is_no_contradiction(explained, made, said):
    """Twice the noise of 0.3 mm and more, unless parts as they were made account for it."""
    of_angles = {"rmse_calibrated_rad": None, "rmse_explained_rad": None, "noise_rad": None}
    errors = HeldOut(
        ("s1",), 0.006, explained, 0.0003, **of_angles, chi2_calibrated=1e4, chi2_explained=50.0, readings=40,
        rmse_made_m=made, positions=40,
    )  # fmt: skip
    told = too_vague(errors, Settings())
    assert bool(told) == said
    assert not said or "what was set aside (s1) is missed by " in told[0]
