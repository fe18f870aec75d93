"""Effects that predict what no fit has seen worse than constants alone do."""

from dataclasses import replace

from prb3r.diagnosis.check import check
from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.unseen import Unseen
from prb3r.diagnosis.checks.verdict import why_misleading
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.search.apply import serially
from prb3r.diagnosis.settings import Settings
from prb3r.diagnosis.stages import to_search
from tests.diagnosis.simulated import recorded


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
