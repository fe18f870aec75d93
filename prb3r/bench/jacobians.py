"""Cost of exact derivatives, in solves of the same equilibria."""

from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd

from prb3r.bench.prototype import PRESLIDING, TIP_LOAD, Timed, prototype, table_2
from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.mechanics.derivatives.sensitivity import Direction, chain_sensitivities, direction
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.mechanics.plate import plate_model

PARAMETERS = 10
"""Parameters of each Jacobian that is timed."""
STEP = 1e-5
"""Relative step to either side of a parameter; only loads and chain are differenced by it, no solutions."""
LOOP = np.outer([100, 60, 80, 20], [1.0, 0, 0, 0]) + np.outer([0, 0, 40, 70], [0, 0, 1.0, 0])
"""Tensions of a loading history, N: cable 1 let go and pulled again, then cable 3."""


def jacobian_tasks(times: int) -> Iterator[Timed]:
    """Pairs of tasks, a solve and the Jacobian of the same equilibria; the loads of Table 2 are repeated `times`."""
    bare = prototype(plate_model("prb3r"), 0.3)
    history = bare._replace(presliding=PRESLIDING)
    cases = [
        ("no dead load", bare, table_2(bare, times)),
        ("tip load 5 N", bare, table_2(bare, times, TIP_LOAD)),
        ("history", history, loads(history, LOOP)),
    ]
    for name, chain, steps in cases:
        directions = _directions(chain, steps)

        def solved(chain=chain, steps=steps) -> np.ndarray:
            return solve_chain(chain, steps).x

        def differentiated(chain=chain, steps=steps, directions=directions) -> np.ndarray:
            return chain_sensitivities(chain, steps, directions).dx

        for task in (Timed(name, steps.steps, solved), Timed(name, steps.steps, differentiated)):
            task.run()  # fills caches
            yield task


def jacobian_table(tasks: Sequence[Timed], seconds: np.ndarray) -> pd.DataFrame:
    """One row a kind of load: the time of a Jacobian over that of as many solves as it has parameters.

    `seconds` (rounds, tasks) are per equilibrium, as `seconds_in_turns` measures them.
    """
    solved, differentiated = seconds[:, ::2], seconds[:, 1::2]
    return pd.DataFrame(
        {
            "loads": [task.name for task in tasks[::2]],
            "parameters": PARAMETERS,
            "of_as_many_solves": np.median(differentiated / (PARAMETERS * solved), axis=0),
            "time_each_s": np.median(differentiated, axis=0),
        }
    )


def _directions(chain: Chain, steps: Loads) -> list[Direction]:
    """`PARAMETERS` directions: factors on stiffness, friction, offsets and tensions, and a rest angle, in rotation."""
    kinds = [
        lambda v: (chain._replace(stiffness=v * chain.stiffness), steps),
        lambda v: (chain._replace(friction=v * chain.friction), steps),
        lambda v: (chain._replace(offset=v * chain.offset), steps),
        lambda v: (chain._replace(rest=chain.rest + v - 1), steps),
        lambda v: (chain, steps._replace(tension=v * steps.tension)),
    ]
    return [direction(kinds[k % len(kinds)], 1.0, STEP) for k in range(PARAMETERS)]
