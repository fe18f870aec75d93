"""Friction that follows the cables' travel: robust, rate-independent, independent of sampling, and what is measured."""

import itertools

import numpy as np
import pytest
from prototype import ELASTICA, PRB_3R, prototype

from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain

G = 9.785
LENGTH = 0.476


def chain(presliding=3e-5, mu=0.3):
    return prototype(mu, plate=PRB_3R)._replace(presliding=presliding)


def pulls(*tensions):
    """Loads of cables 1 and 3, step by step, N."""
    table = np.zeros((len(tensions), 4))
    table[:, [0, 2]] = tensions
    return table


def path(chain, table, tip=0.0, moment=0.0):
    found = solve_chain(chain, loads(chain, table, tip=tip, moment=moment))
    assert (found.outcome == Outcome.CONVERGED).all()
    return found


def between(table, count):
    """Every step of `table`, reached in `count` equal parts; the last step is the same."""
    start = np.vstack([np.zeros_like(table[:1]), table])
    share = np.arange(1, count + 1)[:, None] / count
    return np.concatenate([a + share * (b - a) for a, b in itertools.pairwise(start)])


def apart(a, b):
    return np.hypot(a.x[-1] - b.x[-1], a.y[-1] - b.y[-1]).max() / LENGTH


def test_published_unloading_sticks_first():
    """An independent simulation: history against instant full reversal moves the tip by 64 mm, then by 1 mm."""
    steps = pulls((10 * G, 0), (7.5 * G, 0), (5 * G, 0))
    history = path(chain(), steps)
    reversed_ = solve_chain(chain(0.0), loads(chain(0.0), steps, np.array([[-1.0] * 4, [1.0] * 4, [1.0] * 4])))
    tip = 1e3 * np.hypot(history.x[:, 14] - reversed_.x[:, 14], history.y[:, 14] - reversed_.y[:, 14])
    assert tip == pytest.approx([0, 63, 0.9], abs=1.5)


def test_published_pulling_order_shift_is_67_mm():
    one = path(chain(), pulls((0, 10 * G), (2.5 * G, 10 * G)))
    other = path(chain(), pulls((2.5 * G, 0), (2.5 * G, 10 * G)))
    assert 1e3 * np.hypot(one.x[-1, 14] - other.x[-1, 14], one.y[-1, 14] - other.y[-1, 14]) == pytest.approx(67, abs=1)


@pytest.mark.parametrize("presliding", [1e-6, 3e-6, 1e-5, 1e-4, 1e-3])
def test_robust_through_reversals_minor_loops_slack_cables_and_tip_loads(presliding):
    table = pulls((100, 0), (60, 0), (80, 0), (20, 0), (90, 60), (0, 60), (0, 0), (50, 30), (40, 40))
    tip = np.zeros((len(table), 2))
    tip[4:7] = [0.5, -2.0]
    found = path(chain(presliding), table, tip)
    assert found.residual.max() < 1e-8
    assert np.abs(found.slip).max() <= 1


def random_path(rng, presliding, plate):
    """A prototype and ten steps of one to four of its cables: reversals, minor loops, slack cables, tip loads."""
    chain = prototype(rng.uniform(0.05, 0.4), rng.uniform(1, 4), plate)
    chain = chain._replace(
        presliding=presliding,
        offset=chain.offset * rng.uniform(0.8, 1.2, 4),
        stiffness=chain.stiffness * rng.uniform(0.8, 1.5, (14, 1)),
    )
    used = rng.permutation(4)[: rng.integers(1, 5)]
    tension = np.zeros((10, 4))
    tension[:, used] = rng.uniform(0, 90, (10, len(used))) * (rng.random((10, len(used))) < 0.75)
    tip = rng.uniform(-1.5, 1.5, (10, 2)) * (rng.random((10, 1)) < 0.4) * (rng.random() < 0.6)
    return chain, loads(chain, tension, tip=tip)


@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA], ids=["prb3r", "elastica"])
@pytest.mark.parametrize(("presliding", "paths"), [(1e-6, 30), (1e-5, 20), (1e-4, 10)])
def test_robust_along_random_paths(presliding, paths, plate):
    for seed in range(paths):
        chain, steps = random_path(np.random.default_rng(seed), presliding, plate)
        found = solve_chain(chain, steps)
        assert (found.outcome == Outcome.CONVERGED).all(), seed
        assert found.residual.max() < 1e-8
        assert np.abs(found.slip).max() <= 1


@pytest.mark.parametrize("presliding", [1e-6, 1e-5, 1e-3])
def test_the_result_does_not_depend_on_how_finely_the_path_is_sampled(presliding):
    table = pulls((100, 0), (50, 20), (90, 50), (30, 60))
    coarse = path(chain(presliding), table)
    for count in (3, 16):
        assert apart(path(chain(presliding), between(table, count)), coarse) < 2e-5


def test_rate_independent_repeated_points_change_nothing():
    table = pulls((80, 0), (40, 30))
    assert apart(path(chain(), np.repeat(table, 4, axis=0)), path(chain(), table)) < 1e-9


def test_pulling_once_from_rest_is_the_declared_law_once_all_holes_slip():
    table = pulls((100, 0))
    declared = solve_chain(chain(0.0), loads(chain(0.0), table))
    assert apart(path(chain(1e-5), table), declared) < 1e-6


def test_without_friction_there_is_no_memory():
    table = pulls((100, 0), (50, 20))
    free = chain(mu=0.0)
    assert apart(path(free, table), path(free, table[-1:])) < 1e-9


def test_mirrored_cables_mirror_the_loop():
    table = pulls((100, 0), (40, 30), (70, 10))
    one, other = path(chain(), table), path(chain(), table[:, ::-1].copy())
    mirrored = pulls((100, 0), (40, 0))
    left, right = path(chain(), mirrored), path(chain(), mirrored[:, ::-1].copy())
    assert np.abs(left.y + right.y).max() < 1e-9
    assert np.abs(one.y[0]).max() > 0.1
    assert other.outcome.max() == Outcome.CONVERGED


def test_a_closed_loop_dissipates_work():
    """Cable tension over drawn-in length: the loop's area is positive, and grows with friction."""

    def work(mu):
        rig = chain(mu=mu)
        table = between(pulls((100, 0), (20, 0), (100, 0)), 40)[40:]
        full = np.vstack([between(pulls((100, 0)), 10), table])
        found = path(rig, full)
        length = spans(rig, found)
        pull = full[:, 0]
        drawn = -np.diff(length[10 - 1 :])
        return float(((pull[9:-1] + pull[10:]) / 2 * drawn).sum())

    assert 0 < work(0.1) < work(0.3)


def spans(chain, found):
    """(s,) length of cable 1 from its hole in the base disk's distal face to its end, from the poses alone, m."""
    half, offset = chain.disk / 2, 0.0255
    c, s = np.cos(found.angle), np.sin(found.angle)
    out_x, out_y = found.x + half * c - offset * s, found.y + half * s + offset * c
    in_x, in_y = found.x - half * c - offset * s, found.y - half * s + offset * c
    return np.hypot(in_x[:, 1:] - out_x[:, :-1], in_y[:, 1:] - out_y[:, :-1]).sum(1)


def test_sequences_that_start_from_rest_can_share_one_call():
    first, second = pulls((80, 0), (40, 30)), pulls((0, 60), (50, 60))
    together = solve_chain(chain(), loads(chain(), np.vstack([first, second])), from_rest=np.array([0, 0, 1, 0], bool))
    for half, table in ((slice(0, 2), first), (slice(2, 4), second)):
        alone = path(chain(), table)
        assert (together.x[half] == alone.x).all()
        assert (together.slip[half] == alone.slip).all()


@pytest.mark.parametrize("rig", [chain(), chain(0.0), prototype(plate=ELASTICA)._replace(tied=True)])
def test_a_tip_load_of_one_sequence_is_gone_in_the_next(rig):
    table, tip = np.vstack([pulls((80, 0)), pulls((30, 20))]), np.array([[0.5, -1.5], [0.0, 0.0]])
    together = solve_chain(rig, loads(rig, table, tip=tip), from_rest=True)
    alone = solve_chain(rig, loads(rig, table[1:]))
    assert (together.outcome == 0).all()
    assert (together.x[1:] == alone.x).all()
    assert np.abs(together.y[1] - solve_chain(rig, loads(rig, table[1:], tip=tip[:1])).y[0]).max() > 1e-3


def test_moments_act_along_the_path_too():
    """Moments that hold an idle, rubbing chain bent, and the same shape from stress-free angles that change nothing."""
    extra = np.linspace(0.3, -0.1, 14)
    straight, steps = chain(), pulls((40, 0), (20, 30))
    always = straight._replace(constant=loads(straight, np.zeros((1, 4)), moment=extra))
    bent = straight._replace(rest=extra[:, None] / straight.stiffness)
    one, other = path(always, steps), path(bent, steps)
    assert one.q == pytest.approx(other.q, abs=1e-8)
    assert one.slip == pytest.approx(other.slip, abs=1e-6)
    ramped = path(straight, np.zeros((1, 4)), moment=extra)
    assert (np.abs(ramped.slip[0]) == 1).any()  # cables have travelled while the moments grew
    assert ramped.q[0] == pytest.approx(bent.rest, abs=1e-9)
