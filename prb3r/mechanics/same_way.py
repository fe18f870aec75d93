"""Whether a load step leads further in the direction of the step before, so that it fails where that step failed."""

from prb3r.mechanics.kernel import kernel

SAME_LOAD = 1e-12
"""Largest relative difference of two loads that counts as rounding."""


@kernel
def times_as_far(rows, cables, last, s):
    """Distance of row `s` from row `last`, over that of row ``s - 1``, if both lie in the same direction; else 0.

    `rows` are those of `rows_of_loads` for so many `cables`.  Slips have to be equal; elapsed steps are not compared.
    """
    start, before, target = rows[last], rows[s - 1], rows[s]
    slips = len(start) - cables - 1  # tensions, dead loads and moments stand before the slips
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
