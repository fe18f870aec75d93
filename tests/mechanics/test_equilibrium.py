"""The engine against the references and against the laws that any equilibrium obeys."""

import numpy as np
import pytest
from mechanics.solved import MODELS, NO_CABLES, good
from prototype import ELASTICA, cantilever, prototype, random_chain, random_loads, row, tip_face

from prb3r.mechanics.chain import loads, pose
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.mechanics.plate import gauss_collocation
from prb3r.mechanics.reference import elastica_shooting, seed_fsolve

# against the references


@MODELS
@pytest.mark.parametrize("seed", range(3))
def test_engine_equals_the_seeds_method(plate, seed):
    rng = np.random.default_rng([seed, 3])
    chain = random_chain(rng, plate)
    once = random_loads(rng, chain)
    steps = type(once)(*(np.linspace(0.25, 1, 4).reshape(-1, *[1] * (field.ndim - 1)) * field for field in once))
    steps = steps._replace(slip=np.repeat(once.slip, 4, 0))
    states = good(chain, steps)
    q, _ = seed_fsolve(chain, steps)
    assert states.q == pytest.approx(q, abs=1e-9)
    disks = pose(chain, states.q)
    for mine, independent in zip((states.x, states.y, states.angle), disks, strict=True):
        assert mine == pytest.approx(independent, abs=1e-12)


@pytest.mark.parametrize("points", [2, 3])
def test_collocation_converges_at_order_2n_to_the_shot_elastica(points):
    """By the paper's method: the engine solves the same equations, with one set of kernels a number of points."""
    chain = cantilever(4)
    bends, exact = elastica_shooting(chain, row(loads(chain, NO_CABLES, tip=(0, 3))))
    errors = []
    for plates in (4, 8):
        finer = cantilever(plates, gauss_collocation(points))
        q, _ = seed_fsolve(finer, loads(finer, np.vstack(4 * [NO_CABLES]), tip=np.outer([0.75, 1.5, 2.25, 3], [0, 1])))
        errors.append(abs(tip_face(finer, pose(finer, q[-1])) - tip_face(chain, exact)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * points, abs=0.35)
    assert bends.sum() == pytest.approx(0.986, abs=1e-3)  # the case is far from linear


def test_elastica_equals_shooting_with_friction_cables_and_dead_loads():
    chain = prototype(plate=ELASTICA)
    dead = np.linspace([0, -0.3], [0.2, 0.1], 14)
    steps = loads(chain, [60, 30, 10, 20], [-1, 1, -1, 1], dead, [-1, 0.8], np.linspace(0.2, -0.1, 14))
    bends, exact = elastica_shooting(chain, row(steps))
    states = good(chain, steps)
    assert np.diff(states.angle[0]) == pytest.approx(bends, abs=1e-9)
    assert abs(tip_face(chain, states)[0] - tip_face(chain, exact)) < 1e-9


# laws


@MODELS
def test_no_load_is_the_rest_shape(plate):
    chain = random_chain(np.random.default_rng(4), plate)
    states = good(chain, loads(chain, np.zeros((2, 3))))
    assert (states.q == chain.rest).all()
    assert (states.iterations == 0).all()
    straight = prototype(plate=plate)
    assert (solve_chain(straight, loads(straight, np.zeros(4))).y == 0).all()


@MODELS
def test_mirror(plate):
    rng = np.random.default_rng(5)
    chain = random_chain(rng, plate)
    steps = random_loads(rng, chain, steps=3)
    mirrored = chain._replace(offset=-chain.offset, rest=-chain.rest)
    across = steps._replace(force=steps.force * [1, -1], tip=steps.tip * [1, -1], moment=-steps.moment)
    one, other = good(chain, steps), good(mirrored, across)
    assert other.q == pytest.approx(-one.q, abs=1e-11)
    assert other.tension == pytest.approx(one.tension)
    assert other.lowest_eigenvalue == pytest.approx(one.lowest_eigenvalue)


@MODELS
def test_similar_manipulators_take_similar_shapes(plate):
    """Lengths times 3, rigidity times 5: forces times 5 / 9 give the same angles."""
    rng = np.random.default_rng(6)
    chain = random_chain(rng, plate)
    steps = random_loads(rng, chain, steps=3)
    lengths = {name: 3 * getattr(chain, name) for name in ("arc", "clamp", "disk", "offset")}
    similar = chain._replace(stiffness=chain.stiffness * 5 / 3, **lengths)
    factor = 5 / 9
    forces = {name: factor * getattr(steps, name) for name in ("tension", "force", "tip")}
    one, other = good(chain, steps), good(similar, steps._replace(moment=3 * factor * steps.moment, **forces))
    assert other.q == pytest.approx(one.q, abs=1e-10)
    assert other.x == pytest.approx(3 * one.x, abs=1e-10)
    assert other.tension == pytest.approx(factor * one.tension)
    assert other.moment == pytest.approx(factor * 3 * one.moment)


@MODELS
@pytest.mark.parametrize("dead", [0, 0.4])
def test_declared_friction_forgets_the_path(plate, dead):
    """One by one from rest, along the path, along a finer path, backwards and as a batch of one."""
    rng = np.random.default_rng(7)
    chain = random_chain(rng, plate)
    steps = random_loads(rng, chain, steps=5, dead=dead)
    along, alone = good(chain, steps), good(chain, steps, from_rest=True)
    assert alone.q == pytest.approx(along.q, abs=1e-9)
    backwards = type(steps)(*(field[::-1].copy() for field in steps))
    assert good(chain, backwards).q[::-1] == pytest.approx(along.q, abs=1e-9)
    between = np.linspace(0, 4, 41)
    low = np.minimum(between.astype(int), 3)
    share = lambda field: (between - low).reshape(-1, *[1] * (field.ndim - 1))  # noqa: E731
    fine = type(steps)(*(field[low] + share(field) * (field[low + 1] - field[low]) for field in steps))
    assert good(chain, fine).q[::10] == pytest.approx(along.q, abs=1e-9)
    single = solve_chain(chain, type(steps)(*(field[2:3].copy() for field in steps)), from_rest=True)
    for name in ("outcome", "iterations", "residual", "q", "x", "y", "angle", "tension", "moment"):
        assert (getattr(single, name)[0] == getattr(alone, name)[2]).all(), name


def test_details_can_be_left_out():
    chain = prototype()
    steps = loads(chain, np.linspace(0, 80, 5)[:, None] * [1, 0.5, 0, 0], tip=(0, -0.5))
    full, lean = solve_chain(chain, steps), solve_chain(chain, steps, detail=False)
    assert (lean.x == full.x).all()
    assert (lean.residual == full.residual).all()
    assert lean.q.shape == (0, 14, 3)


@pytest.mark.parametrize("slip", [-1, 1, 0])
def test_opposite_cables_of_equal_tension_hold_it_straight(slip):
    """Every hole is at the kink of friction."""
    chain = prototype(0.4)
    states = good(chain, loads(chain, np.linspace(10, 100, 4)[:, None] * [1, 1.5, 1.5, 1], slip))
    assert (states.y == 0).all()


def test_a_broken_cable_is_one_without_tension():
    rng = np.random.default_rng(8)
    chain = random_chain(rng)._replace(reach=np.array([6, 6, 3]))
    steps = random_loads(rng, chain, steps=3)
    broken = good(chain._replace(reach=np.array([6, 0, 3])), steps)
    idle = good(chain, steps._replace(tension=steps.tension * [1, 0, 1]))
    assert (broken.q == idle.q).all()
    assert (broken.tension == idle.tension).all()
    assert (broken.tension[:, :, 1] == 0).all()


@pytest.mark.parametrize("slip", [-1, 1])
def test_tension_changes_by_the_turning_of_the_cable_alone(slip):
    """Seen from the shape: ln(T / T_0) is slip mu times all turning so far, the base hole's too [Eq. 6, 7]."""
    chain, mu = prototype(0.3), 0.3
    states = good(chain, loads(chain, [60, 0, 25, 0], slip))
    axis, centre = np.exp(1j * states.angle[0]), states.x[0] + 1j * states.y[0]
    for j, reach in ((0, 14), (2, 7)):
        hole = 1j * chain.offset[0, j]
        spans = np.diff(centre) - 0.002 * (axis[1:] + axis[:-1]) + hole * (axis[1:] - axis[:-1])
        directions = np.append(0, np.angle(spans / axis[0]))
        turning = np.abs(np.angle(np.exp(1j * np.diff(np.unwrap(directions)))))
        expected = [60, 0, 25][j] * np.exp(slip * mu * np.cumsum(turning))
        assert states.tension[0, :reach, j] == pytest.approx(expected[:reach])
        assert (states.tension[0, reach:, j] == 0).all()


@MODELS
def test_moments_at_the_base_balance_all_cables_and_all_dead_loads(plate):
    """The first arc carries what the cables' first spans and the dead loads, where they now are, ask of it."""
    rng = np.random.default_rng(9)
    chain = random_chain(rng, plate)._replace(reach=np.array([6, 6, 3]))
    steps = random_loads(rng, chain, steps=4)
    states = good(chain, steps)
    start = chain.clamp[0]
    axis, centre = np.exp(1j * states.angle), states.x + 1j * states.y
    cross = lambda a, b: a.real * b.imag - a.imag * b.real  # noqa: E731
    moment = cross(centre[:, 1:] - start, steps.force @ (1, 1j)).sum(1)
    moment += cross(tip_face(chain, states) - start, steps.tip @ (1, 1j))
    for j, offset in enumerate(chain.offset[0]):
        arrival = centre[:, 1] + (-chain.disk / 2 + 1j * offset) * axis[:, 1]
        span = 1j * offset - arrival  # from Q to H
        moment += cross(arrival - start, states.tension[:, 0, j] * span / np.abs(span))
    assert states.moment[:, 0, 0] == pytest.approx(moment + steps.moment[:, 0], abs=1e-8)


@MODELS
def test_a_moment_bends_the_arc_it_acts_on_by_moment_times_compliance_and_no_other(plate):
    chain, extra = cantilever(4, plate), np.array([[0.0, 0.3, 0.0, -0.2], [0.0, 0.0, 0.1, 0.0]])
    states = good(chain, loads(chain, np.zeros((2, 0)), moment=extra))
    compliance = (1 / plate.stiffness).sum() / 4  # l / EI; the springs of PRB 3R make 0.9988 of it
    assert np.diff(states.angle) == pytest.approx(compliance * extra, abs=1e-12)
    assert states.moment == pytest.approx(np.repeat(extra[..., None], states.moment.shape[-1], -1), abs=1e-12)
    always = chain._replace(constant=loads(chain, NO_CABLES, moment=extra[0]))
    assert solve_chain(always, loads(chain, NO_CABLES)).q[0] == pytest.approx(states.q[0], abs=1e-12)
