"""Load paths to their ends: changing points, long chains, the loss of stability and folds."""

import numpy as np
import pytest
from mechanics.solved import MODELS, NO_CABLES, good
from prototype import ELASTICA, PRB_3R, RIGIDITY, cantilever, prototype, random_chain, random_loads, row

from prb3r.mechanics import block_eigenvalue
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.kernel import entrance
from prb3r.mechanics.plate_law import Contact
from prb3r.mechanics.reference import seed_residual

lowest_of_block = entrance(block_eigenvalue.lowest_of_block.py_func)


@pytest.mark.parametrize("mu", [0, 0.1, 0.3, 0.6, 1.5])
@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA], ids=["PRB 3R", "elastica"])
def test_ramp_to_the_changing_point_of_figure_14(plate, mu):
    """Where the moments of cables 2 and 4 cancel, Segment 1 stays straight: friction has its kinks there."""
    chain, balance = prototype(mu, plate=plate), 50 * 0.0255 / 0.021
    states = good(chain, loads(chain, np.linspace(0.1, 1, 10)[:, None] * [0, balance, 0, 50]))
    assert np.abs(states.angle[:, :8]).max() < 1e-12
    assert states.angle[-1, 14] < -0.1
    for tension in (balance - 1e-6, balance + 1e-6, balance - 0.1, balance + 0.1):
        near = good(chain, loads(chain, [0, tension, 0, 50]))
        assert np.sign(tension - balance) * near.angle[0, 7] > 0


def test_loads_without_equilibrium_are_rows_and_later_steps_go_on():
    """At 2 kN the holes of neighbouring disks would be pulled into each other."""
    chain = prototype(0)
    tension = np.array([50, 2000, 60, np.inf, np.nan, 70])
    with np.errstate(invalid="ignore"):
        states = solve_chain(chain, loads(chain, tension[:, None] * [1, 0, 0, 0]), eigenvalue=True)
    failed = np.array([False, True, False, True, True, False])
    assert [Outcome(code).label for code in states.outcome] == [
        "converged",
        "no equilibrium",
        "detour",
        "no equilibrium",
        "no equilibrium",
        "detour",
    ]
    assert 0 < states.reached[1] < 1
    assert (states.reached[~failed] == 1).all()
    for field in (states.residual, states.q, states.x[:, 1:], states.y[:, 1:], states.tension, states.moment):
        assert np.isnan(field[failed]).all()
        assert np.isfinite(field[~failed]).all()
    assert np.isnan(states.lowest_eigenvalue[failed]).all()
    alone = solve_chain(chain, loads(chain, tension[~failed, None] * [1, 0, 0, 0]))
    assert states.q[~failed] == pytest.approx(alone.q, abs=1e-10)
    assert "No equilibrium" in states.reason(1)
    assert "leaves out a step" in states.reason(2)


@pytest.mark.parametrize("plate", [PRB_3R, ELASTICA], ids=["PRB 3R", "elastica"])
def test_large_loads_at_once_equal_the_ramp(plate):
    """500 N bend the chain by more than 1.5 turns; 10 N at the tip is ten times EI / L^2."""
    chain = prototype(0, plate=plate)
    for most, tip in (([500, 0, 0, 0], (0, 0)), ([0, 0, 0, 0], (0, -10)), ([0, 0, 60, 150], (3, 5))):
        share = np.linspace(0.02, 1, 50)[:, None]
        once, ramp = (good(chain, loads(chain, s * most, tip=s * tip)) for s in (np.ones((1, 1)), share))
        assert once.q[0] == pytest.approx(ramp.q[-1], abs=1e-9)
        assert np.abs(once.angle[0, -1]) > 1.1


@pytest.mark.parametrize("mu", [0, 0.3])
def test_1400_plates_approach_a_cable_in_a_bending_rod(mu):
    """With ever more disks ``EI theta' = T b`` and ``T' = -mu T theta'``: theta = ln(1 + mu T b L / EI) / mu."""
    plates, flexible, offset, tension = 1400, 14 * 0.014, 0.0255, 60
    coarse = prototype(mu)
    chain = coarse._replace(
        arc=np.full(plates, flexible / plates),
        clamp=np.full(plates, 14 * 0.008 / plates),
        disk=14 * 0.004 / plates,
        stiffness=np.full((plates, 3), RIGIDITY * plates / flexible) * PRB_3R.stiffness,
        rest=np.zeros((plates, 3)),
        offset=np.full((plates, 1), offset),
        reach=np.array([plates]),
        friction=np.full((plates, 1), mu),
        segment=np.zeros(plates, int),
    )
    states = good(chain, loads(chain, [tension]))
    turn = tension * offset * flexible / RIGIDITY * (1 / np.array(PRB_3R.stiffness)).sum()
    assert states.angle[0, -1] == pytest.approx(np.log1p(mu * turn) / mu if mu else turn, rel=1e-4)


def test_dead_load_on_1400_plates_from_zero():
    chain = cantilever(1400)
    states = solve_chain(chain, loads(chain, NO_CABLES, tip=(0, 10)))
    assert [states.y[0, -1], 1 - states.x[0, -1], states.angle[0, -1]] == pytest.approx(
        [0.81061, 0.55500, 1.43029], abs=6e-6
    )


def test_euler_column():
    """A straight cantilever buckles at pi^2 EI / (4 L^2): the lowest eigenvalue changes sign there."""
    critical = np.pi**2 / 4
    for plate, plates, tolerance in ((ELASTICA, 8, 1e-6), (PRB_3R, 1, 0.03), (PRB_3R, 8, 1e-3)):
        chain = cantilever(plates, plate)
        push = critical * np.array([0.5, 1 - tolerance, 1 + tolerance, 1.5])
        states = solve_chain(chain, loads(chain, np.zeros((4, 0)), tip=push[:, None] * [-1, 0]), eigenvalue=True)
        assert (states.y == 0).all()
        assert (np.diff(states.lowest_eigenvalue) < 0).all()
        assert list(states.outcome) == [Outcome.CONVERGED] * 2 + [Outcome.UNSTABLE] * 2
    assert "unstable" in Outcome.UNSTABLE.sentence


@pytest.mark.parametrize("n", range(1, block_eigenvalue.CLOSED_FORM_ROWS + 1))
def test_lowest_eigenvalue_of_a_block(n):
    """Spread, equal and complex eigenvalues."""
    rng = np.random.default_rng(n)
    for scale in (0.1, 1.0, 10.0):
        block = np.diag(rng.integers(1, 4, n).astype(float)) + scale * rng.standard_normal((n, n))
        assert lowest_of_block(block.copy()) == pytest.approx(np.linalg.eigvals(block).real.min(), abs=1e-9)
    assert lowest_of_block(3.0 * np.eye(n)) == pytest.approx(3.0)


def test_lowest_eigenvalue_keeps_its_digits():
    rng = np.random.default_rng(7)
    for block in rng.standard_normal((200, 4, 4)):
        assert lowest_of_block(block.copy()) == pytest.approx(np.linalg.eigvals(block).real.min(), abs=1e-12)


@pytest.mark.parametrize("stiffness", [1e2, 1e7])
def test_disks_that_touch_hide_no_small_eigenvalue(stiffness):
    """What touching adds has rank one, so the lowest of four eigenvalues stays between the lowest two without it."""
    chain = prototype(plate=ELASTICA)._replace(contact=Contact(0.05, stiffness))
    states = solve_chain(chain, loads(chain, [[60.0, 0.0, 0.0, 0.0]]), eigenvalue=True)
    assert np.diff(states.angle[0]).max() > 0.05
    assert states.lowest_eigenvalue[0] == pytest.approx(chain.stiffness.min(), rel=0.05)


@pytest.mark.parametrize("apart", [0.0, 1e-12, 1e-9, 1e-6, 1e-3, 1.0])
def test_lowest_eigenvalue_of_a_block_with_pairs(apart):
    """Blocks of the elastica's plates: at rest two and two are equal, and a load moves them apart; any basis."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        basis = np.linalg.qr(rng.standard_normal((4, 4)))[0]
        block = basis @ np.diag([52.0, 52.0 + apart, 98.0, 98.0 + 2 * apart]) @ basis.T
        assert lowest_of_block(block) == pytest.approx(52.0, rel=1e-7 if apart < 1e-3 else 1e-11)


def test_lowest_eigenvalue_of_the_blocks_of_each_step():
    """Known ones: multiples of the unit matrix, one of which is turned; a step without blocks has none."""
    block = np.full((3, 2, 5, 5), np.nan)
    turned = 4.0 * np.eye(5)
    turned[:2, :2] = [[0.5, -7.0], [7.0, 0.5]]  # 0.5 +- 7 i
    block[0], block[2] = [2.0 * np.eye(5), 3.0 * np.eye(5)], [9.0 * np.eye(5), turned]
    assert block_eigenvalue.lowest_of_blocks(block) == pytest.approx([2.0, np.nan, 0.5], nan_ok=True)


@MODELS
@pytest.mark.parametrize("dead", [0, 0.4])
def test_lowest_eigenvalue_is_that_of_the_reference_balance(plate, dead):
    """Without dead loads the engine takes the plates' own blocks: here the whole tangent by differences."""
    rng = np.random.default_rng(10)
    chain = random_chain(rng, plate)
    steps = random_loads(rng, chain, steps=3, dead=dead)
    states = good(chain, steps)
    for s, q in enumerate(states.q):
        tangent = []
        for change in 1e-6 * np.eye(q.size).reshape(q.size, *q.shape):
            tangent.append(
                seed_residual(chain, row(steps, s), q + change) - seed_residual(chain, row(steps, s), q - change)
            )
        expected = np.linalg.eigvals(np.reshape(tangent, (q.size, q.size)).T / 2e-6).real.min()
        assert states.lowest_eigenvalue[s] == pytest.approx(expected, rel=1e-5)


def test_path_ends_at_a_fold():
    """Tip load against cables: the branch turns back where the eigenvalue falls to zero like a square root."""
    chain = prototype(0)
    share = np.concatenate([np.linspace(0.1, 0.69, 7), np.linspace(0.70, 0.74, 41)])
    states = solve_chain(
        chain, loads(chain, share[:, None] * [0, 0, 60, 150], tip=share[:, None] * [3, 10]), eigenvalue=True
    )
    last = int(np.argmax(states.outcome))
    assert (states.outcome[:last] == Outcome.CONVERGED).all()
    assert (states.outcome[last:] == Outcome.LIMIT_POINT).all()
    near = slice(last - 5, last)
    _, fold = np.polyfit(states.lowest_eigenvalue[near] ** 2, share[near], 1)
    assert share[last - 1] < fold < share[last]
    step = share[last] - share[last - 1]
    assert share[last - 1] + states.reached[last] * step == pytest.approx(fold, abs=0.3 * step)
    assert "jump; reached" in states.reason(last)


def test_all_steps_beyond_a_fold_end_at_the_fold():
    """Each is lost at the same load as if it alone came after the last good step; less load finds back."""
    chain = prototype(0)
    share = np.array([0.3, 0.5, 0.65, 0.74, 0.76, 0.9, 2.0, 0.68, 0.8])
    steps = loads(chain, share[:, None] * [0, 0, 60, 150], tip=share[:, None] * [3, 10])
    states = solve_chain(chain, steps, eigenvalue=True)
    lost = states.outcome == Outcome.LIMIT_POINT
    assert lost.tolist() == [False, False, False, True, True, True, True, False, True]
    came_from = np.where(np.arange(len(share)) < 7, 0.65, 0.68)
    fold = came_from + states.reached * (share - came_from)
    for k in np.flatnonzero(lost):
        before = [0, 1, 2] if k < 7 else [0, 1, 2, 7]
        alone = solve_chain(chain, row(steps, [*before, k]), eigenvalue=True)
        assert states.reached[k] == pytest.approx(alone.reached[-1], abs=1e-5)
        assert fold[k] == pytest.approx(fold[3], abs=1e-5)


@pytest.mark.parametrize("other", ["slip", "tension", "tip", "moment", "softer plates"])
def test_a_step_after_a_lost_one_that_leads_elsewhere_is_followed_by_itself(other):
    """It ends where it ends alone: a fold is known only to steps on the very same way to it."""
    chain = prototype(0.3)
    if other == "softer plates":
        chain = chain._replace(softening=0.05)
    share = np.array([0.3, 0.5, 1.5, 2.0])
    steps = loads(
        chain, share[:, None] * [0, 0, 60, 150], tip=share[:, None] * [3, 10], elapsed=np.arange(4.0)[:, None]
    )
    if other == "slip":
        steps.slip[-1] = 1.0
    elif other == "moment":
        steps.moment[-1] = 0.05
    elif other in ("tension", "tip"):
        getattr(steps, other)[-1, -1] *= 0.8
    states, alone = solve_chain(chain, steps), solve_chain(chain, row(steps, [0, 1, 3]))
    assert states.outcome[2] != Outcome.CONVERGED
    assert states.reached[3] == pytest.approx(alone.reached[2], abs=1e-5)
    on_the_way = states.reached[2] * (1.5 - 0.5) / (2.0 - 0.5)
    assert states.reached[3] != pytest.approx(on_the_way, abs=1e-3)
