"""Tensions for targets: they lead there, nothing less does, and what cannot be reached is said."""

import numpy as np
import pandas as pd
import pytest

import prb3r
from prb3r.errors import SpecError
from prb3r.inverse import search
from prb3r.inverse.pull import Pull, lengths
from prb3r.inverse.reach import aim_of
from prb3r.inverse.search import best_pull, natural_limits
from prb3r.inverse.target import targets_of
from prb3r.mechanics.chain import loads, no_loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.manipulator import Manipulator


def small(**friction):
    """Two segments of three plates, four cables."""
    segment = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 0.0008}
    cables = [("1", 0.0255, 2), ("2", 0.021, 1), ("3", -0.021, 1), ("4", -0.0255, 2)]
    return Manipulator.model_validate(
        {
            "name": "small",
            "youngs_modulus_pa": 1.87e11,
            "disk": {"thickness_m": 0.004, "mass_kg": 0.04},
            "friction": friction,
            "segment": [segment, segment],
            "cable": [{"name": name, "offset_m": offset, "ends_at_segment": end} for name, offset, end in cables],
        }
    )


FREE, RUBBING, STICKY = small(), small(coefficient=0.3), small(coefficient=0.3, direction="history")


def comes_to(manipulator, answer, disk):
    """(steps, 3) where a forward solve of the answer brings a disk."""
    markers = prb3r.solve(manipulator, answer.steps)
    assert (markers["outcome"] == "converged").all()
    return markers.loc[markers["disk"] == disk, ["x_m", "y_m", "angle_rad"]].to_numpy()


def bent(manipulator, tension):
    """(s, disks, 3) all disks under tensions (s, cables), each from rest."""
    states = solve_chain(manipulator.chain(), loads(manipulator.chain(), tension), from_rest=True, detail=False)
    return np.stack([states.x, states.y, states.angle], -1)


@pytest.mark.parametrize(
    ("manipulator", "disk", "wanted"),
    [
        (FREE, 6, {"x_m": 0.17, "y_m": 0.08}),
        (FREE, 3, {"angle_rad": -0.3}),
        (RUBBING, 6, {"x_m": 0.16, "y_m": -0.03}),
        (RUBBING, 6, {"angle_rad": 0.6}),
        (RUBBING, 3, {"angle_rad": -0.3}),
        (RUBBING, 6, {"y_m": 0.05, "angle_rad": 0.2}),
        (STICKY, 6, {"x_m": 0.17, "y_m": 0.08}),
        (STICKY, 6, {"y_m": 0.05, "angle_rad": 0.2}),
    ],
)
def test_a_forward_solve_of_the_answer_meets_the_target(manipulator, disk, wanted):
    answer = prb3r.reach(manipulator, disk=disk, **wanted)
    assert answer.reached, answer.sentences
    place = dict(zip(("x_m", "y_m", "angle_rad"), comes_to(manipulator, answer, disk)[-1], strict=True))
    assert {name: place[name] for name in wanted} == pytest.approx(wanted, abs=1e-6)
    assert answer.table.loc[0, ["x_m", "y_m", "angle_rad"]].tolist() == pytest.approx(list(place.values()), abs=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_no_pull_of_a_hundred_thousand_gets_there_with_less(seed):
    rng = np.random.default_rng(seed)
    chain = FREE.chain()
    most = natural_limits(chain) / 3
    tension = np.maximum(rng.uniform(-1, 1, (100_000, 4)), 0) * most
    tips = bent(FREE, tension)[:, -1]
    target = tips[rng.integers(len(tips)), :2]
    answer = prb3r.reach(FREE, x_m=target[0], y_m=target[1], most_n=most.max())
    off = np.hypot(*(tips[:, :2] - target).T)
    least = answer.table["total_n"][0]
    (asked,) = targets_of(chain, "tip", {"x_m": target[0], "y_m": target[1]}, None)
    pull = Pull(chain, loads(chain, np.zeros((0, 4))), -np.ones(4), asked, aim_of(FREE, "force"))
    rate = pull(answer.steps.filter(like="_n").to_numpy(float)[0]).rate / chain.length  # share of the length per N
    per_metre = np.linalg.norm(np.linalg.pinv(rate * chain.length**2), 1)  # N of all cables per metre, at most
    for metres in (0.002, 0.004, 0.008):
        assert tension[off < metres].sum(1).min(initial=np.inf) > least - 3 * per_metre * metres
    assert answer.reached


def test_a_grid_of_two_cables_finds_the_same_least_force():
    grid = np.linspace(0, 60, 601)
    tension = np.zeros((len(grid) ** 2, 4))
    tension[:, 0], tension[:, 1] = (axis.ravel() for axis in np.meshgrid(grid, grid))
    angle = bent(RUBBING, tension)[:, -1, 2]
    wanted = 0.4
    near = np.abs(angle - wanted) < 2e-4
    brute = tension[near].sum(1).min()
    answer = prb3r.reach(RUBBING, angle_rad=wanted, broken=["3", "4"])
    assert answer.table["total_n"][0] == pytest.approx(brute, abs=0.1)


def test_a_grid_of_two_cables_finds_the_same_least_stress():
    """Stress from a solve of every pull; a grid this fine misses the least one by less than a percent."""
    grid = np.linspace(0, 140, 281)
    first, second = (axis.ravel() for axis in np.meshgrid(grid, grid))
    pulls = {"sequence": range(len(first)), "step": 1, "cable_1_n": first, "cable_3_n": second, "slip_3": 1}
    disks = prb3r.solve(RUBBING, pulls, also=["stress_pa"])
    shape = (len(first), 7)
    angle, stress = (disks[name].to_numpy().reshape(shape) for name in ("angle_rad", "stress_pa"))
    near = np.abs(angle[:, -1] - 0.8) < 2e-3
    lightest, least = (
        prb3r.reach(RUBBING, angle_rad=0.8, broken=["2", "4"], least=kind) for kind in ("force", "stress")
    )
    assert least.reached
    assert least.table["peak_stress_pa"][0] == pytest.approx(stress[near, 1:].max(1).min(), rel=0.01)
    assert least.table["peak_stress_pa"][0] < 0.97 * lightest.table["peak_stress_pa"][0]
    assert least.table["total_n"][0] > lightest.table["total_n"][0]


def test_of_pulls_that_stress_plates_alike_the_lightest_is_told():
    """Two even bends lead to a place without friction, whichever cables make them: more force stresses no less."""
    light, gentle = (prb3r.reach(FREE, x_m=0.17, y_m=0.08, least=kind).table.iloc[0] for kind in ("force", "stress"))
    assert gentle["peak_stress_pa"] == pytest.approx(light["peak_stress_pa"], rel=2e-3)
    assert gentle["total_n"] == pytest.approx(light["total_n"], rel=1e-2)


def test_what_is_told_of_strength_is_what_a_solve_finds():
    strong = RUBBING.replace("yield_stress_pa", 1.1e9)
    path = pd.DataFrame({"y_m": [0.04, 0.13, -0.03]})
    for manipulator in (strong, strong.replace("friction.direction", "history")):
        answer = prb3r.reach(manipulator, path=path)
        stress = prb3r.solve(manipulator, answer.steps, also=["stress_pa"]).groupby("step")["stress_pa"].max()
        assert answer.table["peak_stress_pa"].tolist() == pytest.approx(stress.tolist(), rel=1e-6)
        assert answer.table["safety_factor"].tolist() == pytest.approx((1.1e9 / stress).tolist(), rel=1e-6)
        said = ["beyond yield" in sentence for sentence in answer.sentences]
        assert said == (answer.table["safety_factor"] < 1).tolist() == [False, True, False]
        assert answer.table["outcome"].tolist() == ["reached", "beyond yield", "reached"]
    unknown = prb3r.reach(RUBBING, y_m=0.04)
    assert unknown.table["safety_factor"].isna().all()
    assert "highest stress" in unknown.sentences[0]


@pytest.mark.parametrize("manipulator", [FREE, RUBBING, STICKY], ids=["free", "rubbing", "history"])
def test_mirrored_targets_take_mirrored_cables(manipulator):
    up = prb3r.reach(manipulator, x_m=0.17, y_m=0.07)
    down = prb3r.reach(manipulator, x_m=0.17, y_m=-0.07)
    names = [f"cable_{name}_n" for name in "1234"]
    assert up.steps[names].to_numpy() == pytest.approx(down.steps[names[::-1]].to_numpy(), abs=1e-4)


def test_what_is_out_of_reach_is_told_with_the_nearest_point():
    target = np.array([0.25, 0.1])  # farther than the manipulator is long
    answer = prb3r.reach(FREE, x_m=target[0], y_m=target[1])
    assert not answer.reached
    assert "is not reached; nearest is" in answer.sentences[0]
    distance = answer.table["distance_m"][0]
    assert np.hypot(*(comes_to(FREE, answer, 6)[-1, :2] - target)) == pytest.approx(distance)
    rng = np.random.default_rng(1)
    tension = np.maximum(rng.uniform(-1, 1, (4_000, 4)), 0) * natural_limits(FREE.chain())
    assert distance <= np.nanmin(np.hypot(*(bent(FREE, tension)[:, -1, :2] - target).T)) + 1e-9


def test_a_smaller_largest_tension_reaches_no_farther_and_is_kept():
    distances = []
    for most in (5.0, 20.0, 80.0):
        answer = prb3r.reach(FREE, x_m=0.10, y_m=0.13, most_n=most)
        assert answer.steps.filter(like="_n").to_numpy(float).max() <= most * (1 + 1e-9)
        distances.append(answer.table["distance_m"][0])
    assert distances == sorted(distances, reverse=True)
    assert distances[0] > 2 * distances[-1]
    assert "at the largest tension" in prb3r.reach(FREE, x_m=0.10, y_m=0.13, most_n=5.0).sentences[0]


def test_broken_and_dead_cables_are_not_pulled():
    broken = prb3r.reach(FREE, x_m=0.17, y_m=0.08, broken=["1"])
    effect = FREE.model_dump(exclude_none=True) | {"effect": [{"kind": "dead_cable", "cable": "1"}]}
    dead = prb3r.reach(Manipulator.model_validate(effect), x_m=0.17, y_m=0.08)
    assert broken.steps["cable_1_n"][0] == dead.steps["cable_1_n"][0] == 0
    assert broken.steps.equals(dead.steps)


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
    rig = Manipulator.model_validate(RUBBING.model_dump(exclude_none=True) | {"effect": [sticks]})
    path = pd.DataFrame({"x_m": [0.172, 0.165, 0.16, 0.164], "y_m": [0.06, 0.08, 0.09, 0.084]})
    answer = prb3r.reach(rig, path=path)
    assert answer.reached, answer.sentences
    assert comes_to(rig, answer, 6)[:, :2] == pytest.approx(path.to_numpy(), abs=1e-6)
    assert np.abs(comes_to(RUBBING, answer, 6)[:, :2] - path.to_numpy()).max() > 1e-4


@pytest.mark.parametrize("friction", [{"coefficient": 0.3}, {"coefficient": 0.3, "direction": "history"}])
def test_along_a_path_a_drift_of_the_force_sensor_is_met_at_every_step(friction):
    drifts = {"kind": "tension_drift", "offset_n_per_step": 0.8}
    rig = Manipulator.model_validate(small(**friction).model_dump(exclude_none=True) | {"effect": [drifts]})
    path = pd.DataFrame({"x_m": [0.172, 0.165], "y_m": [0.06, 0.08]})
    answer = prb3r.reach(rig, path=path)
    assert answer.reached, answer.sentences
    assert comes_to(rig, answer, 6)[:, :2] == pytest.approx(path.to_numpy(), abs=1e-6)


def with_effects(manipulator, *effects):
    return Manipulator.model_validate(manipulator.model_dump(exclude_none=True) | {"effect": list(effects)})


WAY = pd.DataFrame({"x_m": [0.172, 0.165, 0.16, 0.166], "y_m": [0.06, 0.08, 0.09, 0.07]})


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


def test_where_no_cable_is_pulled_the_straight_manipulator_is_drawn_with_the_targets(tmp_path):
    runs_away = with_effects(FREE, {"kind": "empirical_moment", "terms": [{"of": "tension", "coefficient": -1e3}]})
    for answer in (prb3r.reach(runs_away, path=WAY), prb3r.reach(FREE, x_m=0.202, y_m=0.0)):
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


def test_lengths_of_cables_of_a_straight_and_of_an_evenly_bent_manipulator():
    chain = FREE.chain()
    rest = lengths(chain, solve_chain(chain, no_loads(chain)))[0]
    assert rest == pytest.approx([6 * 0.03, 3 * 0.03, 3 * 0.03, 6 * 0.03])
    moment = loads(chain, np.zeros((1, 4)), moment=0.05)
    states = solve_chain(chain, moment)
    bend = np.diff(states.angle[0])
    longer = lengths(chain, states)[0] - rest
    assert bend == pytest.approx(bend[0])
    # each span is the chord between two disks that have turned by `bend`: half its change is offset sin(bend / 2)
    assert longer[0] - longer[3] == pytest.approx(-2 * 6 * 2 * 0.0255 * np.sin(bend[0] / 2))


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({}, "say where to"),
        ({"x_m": 0.1, "disk": 9}, "there is no disk 9"),
        ({"x_m": 0.1, "broken": ["5"]}, "there is no cable '5'"),
        ({"x_m": 0.1, "broken": ["1", "2", "3", "4"]}, "no cable is left"),
        ({"x_m": 0.1, "most_n": -1.0}, "must be more than 0 N"),
        ({"x_m": 0.1, "least": "pain"}, "valid: force, stress"),
        ({"z_m": 0.1}, "unknown coordinate 'z_m'"),
        ({"path": pd.DataFrame({"x_mm": [1.0]})}, "unknown column 'x_mm'"),
        ({"x_m": 0.1, "path": pd.DataFrame({"x_m": [0.1]})}, "exclude each other"),
    ],
)
def test_questions_that_make_no_sense(asked, message):
    with pytest.raises(SpecError, match=message):
        prb3r.reach(FREE, **asked)


def test_a_target_in_millimetres_is_refused():
    file = prb3r.load_manipulator("studies/manipulators/two-segment.toml")
    with pytest.raises(SpecError, match=r"y_m = 80 m is far beyond .* 80 mm is 0\.08"):
        prb3r.reach(file, x_m=0.2, y_m=80)


def test_a_long_thin_manipulator_coils_up_as_far_as_it_is_asked_to():
    """Each of 60 plates takes a 60th of 11 rad, nearly two turns, under the mean lever of its span of cable."""
    plates, arc, clamp, arm, stiffness = 60, 0.026, 0.002, 0.01, 1.125e-3
    segment = {"plates": plates, "length_m": 0.03, "clamp_m": clamp, "bending_stiffness_n_m2": stiffness}
    cable = {"name": "1", "offset_m": arm, "ends_at_segment": 1}
    thin = Manipulator.model_validate(
        {
            "name": "thin",
            "youngs_modulus_pa": 5e10,
            "model": "elastica",
            "disk": {"thickness_m": 0.002},
            "segment": [segment],
            "cable": [cable],
        }
    )
    answer = prb3r.reach(thin, angle_rad=11.0, most_n=2.0)
    assert answer.reached
    half, radius = 11.0 / plates / 2, arc * plates / 11.0
    lever = arm * np.cos(half) + clamp * np.sin(half) + radius * (np.sin(half) / half - np.cos(half))
    assert answer.steps["cable_1_n"][0] == pytest.approx(stiffness / radius / lever, rel=1e-3)
    with pytest.raises(SpecError, match="angle_rad = 270 rad is 43 turns"):
        prb3r.reach(thin, angle_rad=270.0)


def test_cables_whose_tension_lags_are_not_asked_for():
    """Within the play nothing moves, so that no way leads from there; without any the effect is nothing."""
    lagging, none = (
        Manipulator.model_validate(
            FREE.model_dump(exclude_none=True) | {"effect": [{"kind": "tension_play", "play_n": n}]}
        )
        for n in (4.0, 0.0)
    )
    with pytest.raises(SpecError, match="small: tension_play: which tension to pull with"):
        prb3r.reach(lagging, y_m=0.03)
    assert prb3r.reach(none, y_m=0.03).steps.equals(prb3r.reach(FREE, y_m=0.03).steps)
