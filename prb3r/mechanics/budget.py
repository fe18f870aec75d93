"""What a load path may take, counted in evaluations of a plate: the same on every machine, however fast it is.

Sub-steps are halved where they fail, and grow again.  Along a path that is not smooth anywhere there is no end of that,
and where holes are to be found that stick together each try takes the cube of their number.
"""

import numpy as np

OF_SEQUENCE, OF_STEP = 200_000_000, 2_000_000
"""For a sequence, and what each of its steps adds to it: some 12 to 30 s, and 0.1 to 0.3 s.  Steps of the shipped
studies take 4,400 at most; what the tests need is in docs/limits.md."""
GAVE_UP = -3
"""Beside `FAILED` and `JUMPED`, where that is used up."""


def allowance() -> np.ndarray:
    """(2,) for a sequence and for each step, in evaluations of a plate."""
    return np.array([OF_SEQUENCE, OF_STEP])
