"""Effects that go with the steps or with time begin anew with the steps that are predicted; this is said."""

import json

import numpy as np
import pandas as pd
import pytest
from diagnosis.learnt import STEPS, run
from diagnosis.simulated import steps_of

from prb3r import predict, solve
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.result.starting_anew import starting_anew

SOFTENING = {"kind": "plate_softening", "share_per_step": 0.004}
CREEP = {"kind": "plate_relaxation", "share": 0.4, "steps": 5.0}
LATER = pd.DataFrame(steps_of("out")[:2]).assign(sequence="later")


def with_effect(weak_rig, folder, effect):
    """The folder of a diagnosis whose one model has another effect beside the weak plate."""
    record = json.loads((weak_rig / "diagnosis.json").read_text())
    (plain, *_) = record["posterior"]["models"]
    record["posterior"]["models"] = [plain | {"probability": 1.0, "effects": [*plain["effects"], effect]}]
    (folder / "diagnosis.json").write_text(json.dumps(record))
    return folder


def test_every_effect_that_counts_steps_or_relaxes_is_told(rubbing):
    told, counting = set(), set()
    for hypothesis in hypotheses(rubbing):
        effect = hypothesis.effect(0.1 * hypothesis.deviations, 0.3)
        chain = effect.change(rubbing.chain, rubbing.manipulator)
        if any(np.any(part) for part in (chain.softening, chain.zero_drift, chain.friction_drift, chain.relaxation)):
            counting.add(effect.kind)
        if starting_anew([effect]):
            told.add(effect.kind)
    assert told == counting == {"plate_softening", "tension_drift", "friction_drift", "plate_relaxation"}


def test_a_drift_is_said_to_begin_anew_and_goes_on_behind_the_recorded_steps(weak_rig, tmp_path):
    """After the twenty recorded steps the plates have 0.92 of their stiffness, as if so much softer to begin with."""
    learnt = predict(with_effect(weak_rig, tmp_path, SOFTENING), weak_rig / "same.toml", LATER, draws=40)
    (said,) = [remark for remark in learnt.remarks if "anew" in remark]
    assert said.startswith("plate softening goes by the number of the step and begins anew at the first row")
    assert "put the recorded steps before these" in said
    both = pd.concat([STEPS, LATER], ignore_index=True)
    assert len(STEPS) == 20
    later = predict(tmp_path, weak_rig / "same.toml", both, draws=40).positions.query("sequence == 'later'")
    plain = learnt.manipulator.model_dump(exclude_none=True)
    worn = [effect for effect in plain["effect"] if effect["kind"] != "plate_softening"]
    worn += [{"kind": "segment_stiffness", "segment": segment, "factor": 1 - 20 * 0.004} for segment in (1, 2)]
    worn += [SOFTENING | {"share_per_step": 0.004 / (1 - 20 * 0.004)}]
    np.testing.assert_allclose(later["y_m"], solve(plain | {"effect": worn}, LATER)["y_m"], atol=1e-9)
    assert np.abs(later["y_m"].to_numpy() - learnt.positions["y_m"]).max() > 1e-3


def test_creep_is_said_to_begin_anew_with_every_sequence(weak_rig, tmp_path):
    """Behind other sequences nothing changes; behind steps of the same one the arm has bent on."""
    folder = with_effect(weak_rig, tmp_path, CREEP)
    learnt = predict(folder, weak_rig / "same.toml", LATER, draws=40)
    (said,) = [remark for remark in learnt.remarks if "anew" in remark]
    assert said.startswith("plate relaxation begins anew with every sequence")
    before = pd.concat([LATER.tail(1)] * 3, ignore_index=True).assign(step=[1, 2, 3])
    fresh = learnt.positions["y_m"].to_numpy()
    for name, moved in (("before", False), ("later", True)):
        steps = pd.concat([before.assign(sequence=name), LATER.assign(step=[4, 5])], ignore_index=True)
        behind = predict(folder, weak_rig / "same.toml", steps, draws=40).positions["y_m"].to_numpy()[-len(fresh) :]
        assert (np.abs(behind - fresh).max() > 1e-3) == moved


@pytest.mark.long
@pytest.mark.parametrize("effect", [SOFTENING, None])
def test_the_command_says_so_where_such_an_effect_is_carried_over(weak_rig, tmp_path, effect):
    folder = with_effect(weak_rig, tmp_path, effect) if effect else weak_rig
    result = run(folder, weak_rig / "same.toml", weak_rig / "steps.csv", "-o", tmp_path / "out.csv")
    assert result.exit_code == 0, result.output
    assert ("begins anew" in result.stderr) == bool(effect)
    elsewhere = run(folder, weak_rig / "longer.toml", weak_rig / "steps.csv", "-o", tmp_path / "out.csv")
    assert "begins anew" not in elsewhere.stderr
