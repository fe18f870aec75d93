"""Whether a load step leads on in the direction of the step before, so that it ends where that was lost."""

from prb3r.mechanics.kernel import kernel

SAME_LOAD = 1e-12
"""Difference of two loads, relative, that is rounding."""


@kernel
def times_as_far(rows, cables, last, s):
    """How many times as far row `s` is from row `last` as the row before, in the same direction; 0: in another one.

    `rows` are those of `rows_of_loads` for so many `cables`.
    """
    start, before, target = rows[last], rows[s - 1], rows[s]
    slips = len(start) - cables - 1  # what comes first hangs on the chain
    for j in range(slips, slips + cables):
        if target[j] != before[j] or (last > 0 and target[j] != start[j]):
            return 0.0
    product = square = 0.0
    for i in range(slips):
        product += (target[i] - start[i]) * (before[i] - start[i])
        square += (before[i] - start[i]) ** 2
    if square == 0.0:
        return 0.0
    factor = max(product / square, 0.0)
    for i in range(slips):
        if abs(target[i] - start[i] - factor * (before[i] - start[i])) > SAME_LOAD * (abs(target[i]) + abs(start[i])):
            return 0.0
    return factor
