"""Bound on the work of a load path, counted in evaluations of a plate, so that it is the same on every machine.

Without a bound, a path that is smooth nowhere could go on without end, as sub-steps are halved where they fail and grow
again; and each search for the holes that stick takes work with the cube of their number.
"""

from typing import NamedTuple

OF_SEQUENCE, OF_STEP = 200_000_000, 2_000_000
"""Evaluations of a plate that a sequence may take, and that each of its steps adds: some 12 to 30 s, and 0.1 to 0.3 s.
Steps of the shipped studies take 4,400 at most; what the tests need is in docs/limits.md."""
GAVE_UP = -3
"""What a path returns, beside `FAILED` and `JUMPED`, where its allowance is used up."""


class Allowance(NamedTuple):
    """Work that a sequence of load steps may take, in evaluations of a plate."""

    of_sequence: int
    """Work allowed whatever the number of steps."""
    of_step: int
    """Work that each step adds."""


def usual_allowance() -> Allowance:
    """The allowance of `solve_chain` if none is given."""
    return Allowance(OF_SEQUENCE, OF_STEP)
