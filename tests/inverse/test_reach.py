"""Tensions for a target: they lead there, nothing less does, and what cannot be reached is said."""

import numpy as np
import pandas as pd
import pytest
from small_rig import ARM, FREE, RUBBING, STICKY, comes_to, with_effects

import prb3r
from prb3r.errors import SpecError
from prb3r.inverse.pull import Pull, lengths
from prb3r.inverse.reach import aim_of
from prb3r.inverse.search import natural_limits
from prb3r.inverse.target import targets_of
from prb3r.mechanics.chain import loads, no_loads
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.manipulator import Manipulator


def bent(manipulator, tension):
    """(s, disks, 3) all disks under tensions (s, cables), each from rest."""
    states = solve_chain(manipulator.chain(), loads(manipulator.chain(), tension), from_rest=True, detail=False)
    return np.stack([states.x, states.y, states.angle], -1)


@pytest.mark.parametrize(
    ("manipulator", "disk", "wanted"),
    [
        (FREE, 6, {"x_m": 0.17, "y_m": 0.08}),
        (RUBBING, 6, {"y_m": 0.05, "angle_rad": 0.2}),
        (STICKY, 6, {"x_m": 0.17, "y_m": 0.08}),
        *(
            pytest.param(*other, marks=pytest.mark.long)
            for other in [
                (FREE, 3, {"angle_rad": -0.3}),
                (RUBBING, 6, {"x_m": 0.16, "y_m": -0.03}),
                (RUBBING, 6, {"angle_rad": 0.6}),
                (RUBBING, 3, {"angle_rad": -0.3}),
                (STICKY, 6, {"y_m": 0.05, "angle_rad": 0.2}),
            ]
        ),
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


@pytest.mark.long
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


@pytest.mark.long
def test_out_of_reach_cables_that_pull_against_each_other_bring_the_disk_nearest():
    """On the rim the distance is flat in such tensions; of 20,000 pulls that rub the same way none leads nearer."""
    target, most = np.array([0.25, 0.02]), 120.0
    answer = prb3r.reach(RUBBING, x_m=target[0], y_m=target[1], most_n=most)
    tension = np.random.default_rng(2).uniform(0, most, (20_000, 4))
    columns = {f"cable_{name}_n": tension[:, j] for j, name in enumerate("1234")}
    slips = {f"slip_{name}": np.full(len(tension), answer.steps[f"slip_{name}"][0]) for name in "1234"}
    tips = prb3r.solve(RUBBING, {"sequence": np.arange(len(tension)), "step": np.ones(len(tension))} | columns | slips)
    tips = tips[(tips["disk"] == 6) & (tips["outcome"] == "converged")]
    assert answer.table["distance_m"][0] <= np.hypot(tips["x_m"] - target[0], tips["y_m"] - target[1]).min() + 1e-9


@pytest.mark.long
@pytest.mark.parametrize("target", [(0.45, 0.1), (0.3, 0.3)])
def test_an_arm_that_may_pull_harder_comes_no_less_near(target):
    """Three segments under their weight; pulls of 48.1, 46.0, 353 and 291 N lead within 32.8 mm of the first."""
    answers = [prb3r.reach(ARM, x_m=target[0], y_m=target[1], most_n=most) for most in (60, 120, 385, 800)]
    distances = [answer.table["distance_m"][0] for answer in answers]
    assert distances == sorted(distances, reverse=True)
    assert distances[2] < 0.0328
    assert "nearest is" in answers[-1].sentences[0]


def test_broken_and_dead_cables_are_not_pulled():
    broken = prb3r.reach(FREE, x_m=0.17, y_m=0.08, broken=["1"])
    dead = prb3r.reach(with_effects(FREE, {"kind": "dead_cable", "cable": "1"}), x_m=0.17, y_m=0.08)
    assert broken.steps["cable_1_n"][0] == dead.steps["cable_1_n"][0] == 0
    assert broken.steps.equals(dead.steps)


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


@pytest.mark.parametrize("far", [1.0, 1e9])
def test_the_nearest_to_a_place_far_away_is_the_farthest_that_way(far):
    """However far the place is: of 4,000 pulls none leads farther toward it."""
    way = np.array([0.8, 0.6])
    answer = prb3r.reach(FREE, x_m=0.8 * far, y_m=0.6 * far)
    tension = np.maximum(np.random.default_rng(1).uniform(-1, 1, (4_000, 4)), 0) * natural_limits(FREE.chain())
    tips = bent(FREE, tension)[:, -1, :2]
    place = answer.table.loc[0, ["x_m", "y_m"]].to_numpy(float)
    distance = np.hypot(*(tips - far * way).T) if far == 1 else -tips @ way
    assert (np.hypot(*(place - far * way)) if far == 1 else -place @ way) <= np.nanmin(distance)
    assert not answer.reached
    assert answer.table["distance_m"][0] == pytest.approx(np.hypot(*(place - far * way)), rel=1e-12)


def test_a_target_in_millimetres_is_not_reached_and_the_note_says_why():
    file = prb3r.load_manipulator("studies/manipulators/two-segment.toml")
    note = prb3r.reach(file, x_m=0.2, y_m=80).table["note"][0]
    assert "y_m = 80 m is far beyond" in note
    assert "80 mm is 0.08" in note


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
    turned = prb3r.reach(thin, angle_rad=270.0, most_n=2.0)
    assert "angle_rad = 270 rad is 43 turns" in turned.table["note"][0]
    assert turned.steps["cable_1_n"][0] == pytest.approx(2.0)


def test_cables_whose_tension_lags_are_not_asked_for():
    """Within the play nothing moves, so that no way leads from there; without any the effect is nothing."""
    lagging, none = (with_effects(FREE, {"kind": "tension_play", "play_n": n}) for n in (4.0, 0.0))
    with pytest.raises(SpecError, match="small: tension_play: which tension to pull with"):
        prb3r.reach(lagging, y_m=0.03)
    assert prb3r.reach(none, y_m=0.03).steps.equals(prb3r.reach(FREE, y_m=0.03).steps)
