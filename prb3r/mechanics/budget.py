"""What a load path may take, counted in evaluations of a plate: the same on every machine, however fast it is.

Sub-steps are halved where they fail, and grow again.  Along a path that is not smooth anywhere there is no end of that,
and where holes are to be found that stick together each try takes the cube of their number.
"""

from typing import NamedTuple

OF_SEQUENCE, OF_STEP = 200_000_000, 2_000_000
"""For a sequence, and what each of its steps adds to it: some 12 to 30 s, and 0.1 to 0.3 s.  Steps of the shipped
studies take 4,400 at most; what the tests need is in docs/limits.md."""
GAVE_UP = -3
"""Beside `FAILED` and `JUMPED`, where that is used up."""


class Allowance(NamedTuple):
    """What a sequence may take, in evaluations of a plate."""

    of_sequence: int
    of_step: int
    """What each of its steps adds to it."""


def usual_allowance() -> Allowance:
    """Where no less is asked for."""
    return Allowance(OF_SEQUENCE, OF_STEP)
