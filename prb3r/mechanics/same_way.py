"""Whether a load step leads on in the direction of the step before, so that it ends where that was lost."""

from prb3r.mechanics.kernel import kernel

SAME_LOAD = 1e-12
"""Difference of two loads, relative, that is rounding."""


@kernel
def way_products(of_step, last, s):
    """Of the ways from row `last` to row `s` and to the row before: their product, and the square of the latter."""
    start, before, target = of_step[last].ravel(), of_step[s - 1].ravel(), of_step[s].ravel()
    product = square = 0.0
    for i in range(len(start)):
        product += (target[i] - start[i]) * (before[i] - start[i])
        square += (before[i] - start[i]) ** 2
    return product, square


@kernel
def is_multiple(of_step, last, s, factor):
    """Whether the way from row `last` to row `s` is `factor` times that to the row before."""
    start, before, target = of_step[last].ravel(), of_step[s - 1].ravel(), of_step[s].ravel()
    for i in range(len(start)):
        if abs(target[i] - start[i] - factor * (before[i] - start[i])) > SAME_LOAD * (abs(target[i]) + abs(start[i])):
            return False
    return True


@kernel
def times_as_far(loads, last, s):
    """How many times as far row `s` is from row `last` as the row before, in the same direction; 0: in another one."""
    for j in range(loads.slip.shape[1]):
        if loads.slip[s, j] != loads.slip[s - 1, j] or (last > 0 and loads.slip[s, j] != loads.slip[last, j]):
            return 0.0
    tension, force = way_products(loads.tension, last, s), way_products(loads.force, last, s)
    tip, moment = way_products(loads.tip, last, s), way_products(loads.moment, last, s)
    square = tension[1] + force[1] + tip[1] + moment[1]
    if square == 0.0:
        return 0.0
    factor = max((tension[0] + force[0] + tip[0] + moment[0]) / square, 0.0)
    same = is_multiple(loads.tension, last, s, factor) and is_multiple(loads.force, last, s, factor)
    same = same and is_multiple(loads.tip, last, s, factor) and is_multiple(loads.moment, last, s, factor)
    return factor if same else 0.0
