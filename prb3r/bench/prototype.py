"""The paper's prototype and the loads of Table 2 as tasks, and how tasks are timed in turns."""

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.mechanics.equilibrium import Outcome, solve_chain
from prb3r.mechanics.plate import PlateModel

TENSIONS = np.linspace(10, 200, 20)
"""Tensions of cable 1 in Table 2, N."""
NO_LOAD, TIP_LOAD = (0.0, 0.0), (0.0, -5.0)
"""Dead loads on the tip, N."""
PRESLIDING = 3e-5
"""Presliding travel of friction that follows the path, m; the default of manipulator files."""
PLATES = 14
"""Plates of the prototype."""


class Timed(NamedTuple):
    """A task to be timed: `run` solves `equilibria` equilibria; each section of the bench returns another array."""

    name: str
    equilibria: int
    run: Callable[[], np.ndarray]


def prototype(plate: PlateModel, mu: float = 0.0, finer: int = 1) -> Chain:
    """The paper's prototype (Table 3, Section IV) with E = 187 GPa; `finer` divides each of its 14 plates and disks."""
    plates, arc, bending = PLATES * finer, 0.014 / finer, 187e9 * 0.030 * 0.0008**3 / 12
    return Chain(
        plate=plate,
        arc=np.full(plates, arc),
        clamp=np.full(plates, 0.008 / finer),
        disk=0.004 / finer,
        stiffness=np.tile(bending / arc * plate.stiffness, (plates, 1)),
        rest=np.zeros((plates, len(plate.stiffness))),
        offset=np.tile([0.0255, 0.021, -0.021, -0.0255], (plates, 1)),
        reach=np.array([2, 1, 1, 2]) * plates // 2,
        friction=np.full((plates, 4), mu),
        segment=np.repeat([0, 1], plates // 2),
    )


def table_2(chain: Chain, times: int = 1, tip: tuple[float, float] = NO_LOAD) -> Loads:
    """The 20 loads of Table 2, cable 1 drawn in with 10 to 200 N, `times` over, with a force on the tip (N)."""
    return loads(chain, np.tile(TENSIONS, times)[:, None] * [1.0, 0, 0, 0], tip=tip)


def reversals(chain: Chain) -> Loads:
    """40 steps in which cables 1 and 3 are drawn in and let go again and again, out of step with each other."""
    step, tension = np.arange(1, 41), np.zeros((40, 4))
    tension[:, 0] = 50 + 50 * np.sin(2 * np.pi * step / 16)
    tension[:, 2] = 40 * np.abs(np.sin(2 * np.pi * step / 23))
    return loads(chain, tension)


def tips(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(s,) centres of the tip disk, m, as complex numbers, from positions (s, disks)."""
    return x[:, -1] + 1j * y[:, -1]


def engine_task(name: str, chain: Chain, steps: Loads, alone: bool = False) -> Timed:
    """A task that solves all `steps` in one call, each from the step before or, `alone`, from rest; it returns `tips`.

    Raises
    ------
    RuntimeError
        When run, if an equilibrium is not found.
    """

    def run() -> np.ndarray:
        states = solve_chain(chain, steps, from_rest=alone, detail=False)
        if (states.outcome != Outcome.CONVERGED).any():
            raise RuntimeError(f"{name}: not all equilibria were found")
        return tips(states.x, states.y)

    return Timed(name, steps.steps, run)


def seconds_in_turns(tasks: Sequence[Timed], rounds: int) -> np.ndarray:
    """(rounds, tasks) processor time per equilibrium, s; tasks take turns, so a busy machine disturbs all alike."""
    seconds = np.empty((rounds, len(tasks)))
    for r in range(rounds):
        for t, task in enumerate(tasks):
            begin = time.process_time()
            task.run()
            seconds[r, t] = (time.process_time() - begin) / task.equilibria
    return seconds
