"""How tensions have to be applied: what is said of it is what friction that follows the travel makes of them."""

import numpy as np
import pandas as pd
import pytest
from small_rig import RUBBING, small

import prb3r

WELL_RUBBING = small(coefficient=0.5)


def ends(manipulator, tension, order):
    """(2,) where the tip comes with history if cables are pulled one after the other; an order of one set: together."""
    pulled = [np.isin(list("1234"), [name for part in order[: k + 1] for name in part]) for k in range(len(order))]
    steps = {f"cable_{name}_n": [float(on[j]) * tension[j] for on in pulled] for j, name in enumerate("1234")}
    history = manipulator.replace("friction.direction", "history")
    markers = prb3r.solve(history, {"sequence": ["a"] * len(order), "step": np.arange(1, len(order) + 1)} | steps)
    return markers.loc[markers["disk"] == 6, ["x_m", "y_m"]].to_numpy()[-1]


def test_an_order_of_pulling_is_named_where_pulling_together_leads_elsewhere():
    target = np.array([0.12, 0.12])
    answer = prb3r.reach(WELL_RUBBING, x_m=target[0], y_m=target[1])
    tension = answer.steps.filter(like="cable_").to_numpy()[0]
    assert answer.reached
    assert answer.sentences[-1] == answer.applied
    assert answer.applied.startswith("pull 3, then 1: in this order")
    assert np.hypot(*(ends(WELL_RUBBING, tension, ["3", "1"]) - target)) < 1e-4
    astray = 1e3 * np.hypot(*(ends(WELL_RUBBING, tension, ["31"]) - target))
    assert astray > 1
    assert f"all together they end {astray:.3g} mm off" in answer.applied


def test_where_no_order_leads_there_the_answer_is_that_of_the_declared_slips():
    answer = prb3r.reach(RUBBING, x_m=0.14, y_m=0.05)
    assert answer.reached
    assert "at best end" in answer.applied
    assert answer.applied.endswith("the answer holds for cables that slip as the slip_* columns say")


@pytest.mark.long
def test_nothing_is_said_of_cables_without_friction_or_pulled_together_alike():
    for manipulator in (small(), RUBBING, small(coefficient=0.5, direction="history")):
        assert prb3r.reach(manipulator, x_m=0.17, y_m=0.08).applied == ""
    path = pd.DataFrame({"x_m": [0.12], "y_m": [0.12]})
    assert prb3r.reach(WELL_RUBBING, path=path).applied.startswith("pull 3, then 1")
