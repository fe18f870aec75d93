"""What a load path may take is counted, not timed: it ends with a word, wherever it is solved."""

import numpy as np
import pytest
from prototype import PRB_3R, cantilever, prototype

from prb3r.mechanics import budget
from prb3r.mechanics.chain import loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.limit import limit_load
from prb3r.mechanics.plate_law import Law

PULLS = np.array([[20.0, 0, 0, 0], [60, 0, 0, 0], [10, 0, 0, 0], [0, 0, 50, 0]])


@pytest.fixture(params=[0.0, 3e-5], ids=["declared", "history"])
def chain(request):
    return prototype()._replace(presliding=request.param)


def allow(monkeypatch, sequence, step=0):
    monkeypatch.setattr(budget, "OF_SEQUENCE", sequence)
    monkeypatch.setattr(budget, "OF_STEP", step)


@pytest.mark.long
def test_a_step_that_may_take_no_more_gives_up_and_says_how_far_it_came(monkeypatch, chain):
    steps = loads(chain, PULLS, tip=(2.0, 1.0))
    enough = int(solve_chain(chain, steps).work.sum())
    allow(monkeypatch, enough)
    assert (solve_chain(chain, steps).outcome == Outcome.CONVERGED).all()
    allow(monkeypatch, enough // 4)
    found = solve_chain(chain, steps, eigenvalue=True)
    assert found.outcome[-1] == Outcome.GAVE_UP
    assert np.isnan(found.x[-1, 1:]).all()
    assert found.reason(3).startswith("Given up")
    assert "% of the step" in found.reason(3)
    assert Outcome.GAVE_UP.label == "gave up"


@pytest.mark.long
def test_each_sequence_has_its_own(monkeypatch, chain):
    steps = loads(chain, np.concatenate([PULLS, PULLS, 2 * PULLS]))
    begins = np.arange(12) % 4 == 0
    alone = solve_chain(chain, loads(chain, PULLS), from_rest=begins[:4])
    allow(monkeypatch, int(alone.work.sum()))
    together = solve_chain(chain, steps, from_rest=begins)
    assert (together.outcome[:8] == Outcome.CONVERGED).all()
    assert together.work[:8].tolist() == [*alone.work, *alone.work]
    assert (together.x[4:8] == alone.x).all()


def test_each_step_adds_to_it(monkeypatch, chain):
    many = loads(chain, np.tile(PULLS, (30, 1)))
    allow(monkeypatch, 0, int(solve_chain(chain, many).work.max()))
    assert (solve_chain(chain, many).outcome == Outcome.CONVERGED).all()


def test_where_a_path_ends_is_found_with_few_tries():
    """Each try beyond the end takes sixty evaluations: 1,490 in all where each step on the way tried it again."""
    chain = prototype()
    chain = chain._replace(law=Law(knee=np.full((chain.plates, 2), 5.0), ratio=0.1))
    found = solve_chain(chain, loads(chain, np.array([[150.0, 0, 0, 0]])), smallest_step=2**-10)
    assert found.reached[0] == pytest.approx(0.8622, abs=2**-10)
    assert found.work[0] < 1100


def test_work_grows_with_the_plates():
    tip = [solve_chain(rod, loads(rod, np.zeros((1, 0)), tip=(0, 1))).work[0] for rod in map(cantilever, (10, 1000))]
    assert tip[1] / tip[0] == pytest.approx(100, rel=0.5)


def test_a_path_that_would_go_on_and_on_ends(monkeypatch):
    """Twenty-one plates, half of them at their stops, with edges that count and a rough hole: 68 s before."""
    first, plates = 7, 21
    segment = np.repeat([0, 1], [first, plates - first])
    arc = np.where(segment == 0, 0.0237, 0.0399)
    offset = np.where(segment[:, None] == 0, [[-0.0087, -0.005, 0.07, -0.0032, -0.0039]], [[0.0, 0, 0, 0, -0.0039]])
    wild = prototype()._replace(
        arc=arc,
        clamp=np.where(segment == 0, 0.0013, 0.0299),
        disk=0.00126,
        stiffness=(np.where(segment == 0, 0.000594, 0.0364) / arc)[:, None] * PRB_3R.stiffness,
        rest=np.zeros((plates, len(PRB_3R.stiffness))),
        offset=offset,
        reach=np.array([7, 7, 7, 7, 21]),
        friction=np.full((plates, 5), 0.107),
        segment=segment,
        presliding=2.8e-4,
    )
    pulls = [[0, 1.9, 0.76, 0, 3.8], [0, 3.1, 0.44, 0, 1.1], [0, 0.03, 0, 23.9, 9.0], [0, 3.2, 0.46, 8.5, 0]]
    allow(monkeypatch, 1_000_000)
    found = solve_chain(wild, loads(wild, pulls), eigenvalue=True)
    assert Outcome.GAVE_UP in found.outcome
    assert found.work.sum() < 3_000_000  # a sub-step under way is ended


def test_a_limit_that_was_not_found_is_none(monkeypatch):
    rod = cantilever(8)
    allow(monkeypatch, 400)
    limit = limit_load(rod, loads(rod, np.zeros((1, 0)), tip=(-1, 0.1)), from_rest=True)
    assert np.isnan(limit.factor)
    assert limit.outcome == Outcome.GAVE_UP


@pytest.mark.parametrize(("tip", "most"), [(0.0, 6_000), ((2.0, 1.0), 40_000)], ids=["no dead load", "tip load"])
def test_a_step_beyond_the_limit_costs_few_evaluations(tip, most):
    """Plates that yield: under a tip load 56,112, with each of Newton's failures taking all its 60 steps."""
    yielding = prototype()._replace(law=Law(knee=2.0, ratio=0.02), friction=np.full((14, 4), 0.3))
    found = solve_chain(yielding, loads(yielding, [[60, 0, 0, 0], [400, 0, 0, 0]], tip=tip))
    assert (found.outcome == Outcome.NO_EQUILIBRIUM).all()
    assert found.work.sum() < most
