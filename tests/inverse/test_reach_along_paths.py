"""Tensions along a path of targets: friction, drifts and time go on from step to step, as a solve of the steps says."""

import numpy as np
import pandas as pd
import pytest
from small_rig import FREE, RUBBING, STICKY, arm, comes_to, small, with_effects

import prb3r
from prb3r.inverse import search
from prb3r.inverse.pull import lengths
from prb3r.inverse.search import best_pull
from prb3r.mechanics.chain import loads, no_loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.present.study.publish import publish
from prb3r.study.run import Options, Workers, solve_study


@pytest.mark.long
def test_slips_go_with_the_travel_along_a_path_and_history_agrees():
    turn = np.linspace(0, 2 * np.pi, 7)
    path = pd.DataFrame({"x_m": 0.165 + 0.008 * np.cos(turn), "y_m": 0.085 + 0.008 * np.sin(turn)})
    declared, history = prb3r.reach(RUBBING, path=path), prb3r.reach(STICKY, path=path)
    for manipulator, answer in ((RUBBING, declared), (STICKY, history)):
        assert answer.reached, answer.sentences
        assert comes_to(manipulator, answer, 6)[:, :2] == pytest.approx(path.to_numpy(), abs=1e-6)
    names = [f"cable_{name}_n" for name in "1234"]
    tension = declared.steps[names].to_numpy()
    states = solve_chain(RUBBING.chain(), loads(RUBBING.chain(), tension, declared.steps.filter(like="slip")))
    rest = solve_chain(RUBBING.chain(), no_loads(RUBBING.chain()))
    longer = np.diff(np.concatenate([lengths(RUBBING.chain(), rest), lengths(RUBBING.chain(), states)]), axis=0)
    slip = declared.steps.filter(like="slip").to_numpy()
    counts = (tension > 0) & (slip != 0)
    assert (np.sign(longer)[counts] == slip[counts]).all()
    assert (slip[tension > 0] == 1).any()
    sums = tension.sum(1), history.steps[names].to_numpy().sum(1)
    alike = [0, 2, 3, 6]  # elsewhere holes stick here and slip there, which one slip for a cable cannot say
    assert sums[0][alike] == pytest.approx(sums[1][alike], rel=1e-6)


def test_along_a_path_static_friction_counts_how_far_cables_have_slipped():
    sticks = {"kind": "breakaway_friction", "excess": 0.6, "decay_n": 100.0}
    rig = with_effects(RUBBING, sticks)
    path = pd.DataFrame({"x_m": [0.172, 0.165, 0.16, 0.164], "y_m": [0.06, 0.08, 0.09, 0.084]})
    answer = prb3r.reach(rig, path=path)
    assert answer.reached, answer.sentences
    assert comes_to(rig, answer, 6)[:, :2] == pytest.approx(path.to_numpy(), abs=1e-6)
    assert np.abs(comes_to(RUBBING, answer, 6)[:, :2] - path.to_numpy()).max() > 1e-4


@pytest.mark.long
@pytest.mark.parametrize("friction", [{"coefficient": 0.3}, {"coefficient": 0.3, "direction": "history"}])
def test_along_a_path_a_drift_of_the_force_sensor_is_met_at_every_step(friction):
    drifts = {"kind": "tension_drift", "offset_n_per_step": 0.8}
    rig = with_effects(small(**friction), drifts)
    path = pd.DataFrame({"x_m": [0.172, 0.165], "y_m": [0.06, 0.08]})
    answer = prb3r.reach(rig, path=path)
    assert answer.reached, answer.sentences
    assert comes_to(rig, answer, 6)[:, :2] == pytest.approx(path.to_numpy(), abs=1e-6)


WAY = pd.DataFrame({"x_m": [0.172, 0.165, 0.16, 0.166], "y_m": [0.06, 0.08, 0.09, 0.07]})


@pytest.mark.long
@pytest.mark.parametrize(
    ("effects", "broken"),
    [
        ([{"kind": "empirical_moment", "terms": [{"of": "time", "coefficient": 0.05}]}], []),
        ([{"kind": "tension_offset", "offset_n": 0.5}], ["3"]),  # idle cables are pulled by it, broken ones are not
        ([{"kind": "load_dependent_friction", "exponent": 0.3, "tension_n": 30.0}], []),
        ([{"kind": "rate_dependent_friction", "rate": 0.1}], []),
    ],
    ids=["time", "broken", "load", "rate"],
)
def test_a_solve_of_the_steps_finds_the_places_that_are_told(effects, broken):
    answer = prb3r.reach(with_effects(RUBBING, *effects), path=WAY, broken=broken)
    assert answer.reached, answer.sentences
    assert comes_to(answer.manipulator, answer, 6)[:, :2] == pytest.approx(WAY.to_numpy(), abs=1e-6)
    line = max(answer.plot().axes[0].lines, key=lambda line: len(line.get_xydata()))
    assert np.isfinite(line.get_xydata()).all()


def test_a_cable_that_rubs_at_its_pulley_alone_is_paid_out_too():
    free, rubbing = FREE, with_effects(FREE, {"kind": "pulley_friction", "efficiency": 0.9})
    path = pd.DataFrame({"angle_rad": [0.6, 0.3]})
    pulls = [prb3r.reach(rig, disk=3, path=path, broken=["3", "4"]).steps for rig in (free, rubbing)]
    names = ["cable_1_n", "cable_2_n"]
    entering = pulls[1][names].to_numpy() * 0.9 ** -pulls[1][["slip_1", "slip_2"]].to_numpy()
    assert entering == pytest.approx(pulls[0][names].to_numpy(), rel=1e-6)
    assert pulls[1].loc[1, "slip_1"] == 1 or pulls[1].loc[1, "slip_2"] == 1


def test_a_pull_whose_friction_does_not_go_with_the_travel_is_none(monkeypatch):
    found = search.pull_with_slip
    drawn_in = lambda pull, *rest: found(pull, *rest) if (pull.slip == -1).all() else None  # noqa: E731
    monkeypatch.setattr(search, "pull_with_slip", drawn_in)
    back = pd.DataFrame({"angle_rad": [0.6, 0.3]})
    answer = prb3r.reach(RUBBING, disk=3, path=back, broken=["3", "4"])
    assert answer.table["outcome"].tolist() == ["reached", "no equilibrium"]
    assert "the tensions before are held" in answer.sentences[1]


def test_a_step_without_a_pull_holds_the_tensions_and_takes_its_time(monkeypatch):
    drifting = with_effects(small(), {"kind": "tension_drift", "offset_n_per_step": 0.8})
    lost = lambda pull, *rest: None if pull.target.wanted[0] == WAY["x_m"][1] else best_pull(pull, *rest)  # noqa: E731
    monkeypatch.setattr("prb3r.inverse.reach.best_pull", lost)
    answer = prb3r.reach(drifting, path=WAY)
    assert answer.table["outcome"].tolist() == ["reached", "no equilibrium", "reached", "reached"]
    tension = answer.steps.filter(like="cable").to_numpy()
    assert (tension[1] == tension[0]).all()
    places = comes_to(drifting, answer, 6)[:, :2]
    assert places[[0, 2, 3]] == pytest.approx(WAY.to_numpy()[[0, 2, 3]], abs=1e-6)


@pytest.mark.long
def test_where_no_cable_is_pulled_the_straight_manipulator_is_drawn_with_the_targets(tmp_path):
    runs_away = with_effects(FREE, {"kind": "empirical_moment", "terms": [{"of": "tension", "coefficient": -1e3}]})
    for answer in (prb3r.reach(runs_away, path=WAY[:2]), prb3r.reach(FREE, x_m=0.202, y_m=0.0)):
        assert not answer.steps.filter(like="cable").to_numpy().any()
        drawn = [path for part in answer.plot().axes[0].collections for path in part.get_paths()]
        assert max(path.vertices[:, 0].max() for path in drawn) == pytest.approx(204)
        answer.report(tmp_path)
        assert (tmp_path / "reach.svg").exists()


def test_targets_are_taken_in_the_order_of_their_rows():
    path = pd.DataFrame({"x_m": [0.172, 0.165, 0.16], "y_m": [0.06, 0.08, 0.09]})
    backward = prb3r.reach(FREE, path=path.iloc[::-1]).table
    assert backward["wanted_x_m"].tolist() == path["x_m"].tolist()[::-1]
    assert prb3r.reach(FREE, path=path.iloc[1:]).reached


@pytest.mark.long
def test_a_target_that_the_way_along_the_path_misses_is_said_to_be_reached_from_rest(tmp_path):
    """From the first target the second is 4.5 mm away, within 120 N; from rest cables that are paid out lead there."""
    places, heavy = [(0.3666666667, 0.1666666667), (0.35, 0.20)], arm(tip_mass_kg=0.3)
    answer = prb3r.reach(heavy, path=pd.DataFrame(places, columns=["x_m", "y_m"]), most_n=120)
    alone = prb3r.reach(heavy, x_m=0.35, y_m=0.20, most_n=120)
    assert answer.table["reached"].tolist() == [True, False]
    assert alone.reached
    pull = alone.steps.filter(like="cable_").to_numpy()[0]
    said = [f"{name} {n:.4g} N" for name, n in zip(heavy.cable_names, pull, strict=True) if n]
    assert f"from rest it is reached with {', '.join(said)}" in answer.sentences[1]

    (tmp_path / "arm.toml").write_text(heavy.to_toml())
    targets = ", ".join(f"{{ x_m = {x}, y_m = {y} }}" for x, y in places)
    (tmp_path / "way.toml").write_text(
        'name = "way"\ntitle = "Way"\nmanipulator = "arm.toml"\nstates = "path"\n'
        f'[reach]\nmost_n = 120\ntarget = [{targets}]\n[[metric]]\nkind = "follow"\n'
    )
    result = solve_study(tmp_path / "way.toml", Options(tmp_path / "out", Workers(jobs=1)))
    assert result.cases[["reached_share", "reachable_share"]].iloc[0].tolist() == [0.5, 1.0]
    publish(result)
    assert "1 of 2 targets reached" in (said := (result.folder / "summary.md").read_text())
    assert "1 more reached from rest" in said
