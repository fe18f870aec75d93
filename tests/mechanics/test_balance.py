"""The tangent is the derivative of the balance, and the balance is the paper's."""

import numpy as np
import pytest
from prototype import ELASTICA, PRB_1R, PRB_3R, random_chain, random_loads, row

from prb3r.bench.counting import text_of
from prb3r.mechanics import balance
from prb3r.mechanics.records import Packed, pack
from prb3r.mechanics.reference import seed_residual
from prb3r.mechanics.tangent import chain_tangent, segment_modes, unit_modes
from prb3r.mechanics.variation import scratch

balance_plate = np.errstate(invalid="ignore")(text_of(balance.balance_plate))
"""The kernel's text in plain Python, which need not be compiled for each plate model by itself."""

MODELS = pytest.mark.parametrize("plate", [PRB_3R, PRB_1R, ELASTICA], ids=["PRB 3R", "PRB 1R", "elastica"])
STEP = 1e-6


def by_differences(function, q):
    """Central differences of `function` by every entry of `q`; its values come first."""
    columns = []
    for change in STEP * np.eye(q.size).reshape(q.size, *q.shape):
        columns.append((function(q + change) - function(q - change)) / (2 * STEP))
    return np.stack(columns, axis=-1)


@MODELS
@pytest.mark.parametrize("seed", range(4))
def test_tangent_of_a_plate_is_the_derivative_of_its_balance(plate, seed):
    """Cables arrive from anywhere and rub either way; dead loads pull at the frame."""
    rng = np.random.default_rng(seed)
    chain = random_chain(rng, plate, plates=2)._replace(reach=np.full(3, 2))
    packed = Packed(*(records.view(np.recarray) for records in pack(chain)))
    model, record, span, cable = packed.model[0], packed.plate[0], packed.span[0], packed.cable
    cable["tension"], cable["approach"], cable["slip"] = [30, 0, 12], rng.uniform(-0.4, 0.4, 3), [-1, 1, 0.3]
    record["load"] = rng.normal(0, 2, 3)

    def residual(q):
        record["q"] = q
        balance_plate(model, record, span, cable)
        return record["residual"].copy()

    q = rng.uniform(-0.3, 0.3, len(plate.stiffness))
    expected = by_differences(residual, q)
    record["q"] = q
    largest = balance_plate(model, record, span, cable)
    assert largest == pytest.approx(np.abs(record["residual"] / record["stiffness"]).max())
    assert record["tangent"] == pytest.approx(expected, abs=1e-7 * record["stiffness"].max())
    assert span["tension"][1] == 0


@MODELS
@pytest.mark.parametrize("seed", range(6))
def test_tangent_of_the_chain_is_the_derivative_of_the_reference_balance(plate, seed):
    """Friction, several cables, dead loads on all disks and on the tip, in all angles and in one bend per segment."""
    rng = np.random.default_rng([seed, 1])
    chain = random_chain(rng, plate)
    step = row(random_loads(rng, chain))
    q = rng.uniform(-0.1, 0.1, chain.rest.shape)
    residual = seed_residual(chain, step, q)
    tangent = by_differences(lambda q: seed_residual(chain, step, q).ravel(), q)
    for modes in (unit_modes(chain.stiffness.shape), segment_modes(chain)):
        packed, columns = pack(chain), modes.shape[-1]
        work, flat = scratch(packed, columns), modes.reshape(q.size, columns)
        packed.plate["q"][:-1], packed.plate["extra"][:-1] = q, step.moment
        largest, _ = chain_tangent(packed, step.tension, step.slip, step.force, step.tip, modes, work)
        scale = chain.stiffness.max()
        assert work.system[:, -1] == pytest.approx(flat.T @ residual.ravel(), abs=1e-13 * scale)
        assert work.system[:, :-1] == pytest.approx(flat.T @ tangent @ flat, abs=1e-7 * scale)
        assert largest == np.abs(work.system[:, -1]).max()


def test_segment_modes_spread_one_radian_evenly():
    for plate in (PRB_3R, ELASTICA):
        chain = random_chain(np.random.default_rng(3), plate)
        bends = segment_modes(chain).sum(1)
        assert bends / bends.max() == pytest.approx(np.eye(2)[chain.segment])
        assert bends.max() == pytest.approx(1, abs=2e-3)  # Table 1: the springs' sum is 0.9988
