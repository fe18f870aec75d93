r"""Which holes stick and which slip: a linear complementarity problem on a box, solved by pivoting.

Find `x` between -1 and 1 with

    M x + w = c,    w = 0 where |x| < 1,    w >= 0 where x = 1,    w <= 0 where x = -1.

As the box is bounded there always is a solution, whatever `M`.  Friction makes `M` unsymmetric: changing the set of
sticking holes as Newton's method asks may go round in circles, and there may be several solutions.  Here one variable
changes between free and bound at a time, on a path of solutions for ``c + s d`` (Katzenelson, Lemke) that leads from a
known one to ``s = 0``; where the determinant changes its sign, `s` rises for a while.  The path from the present state
is the one that the loads follow; if it does not lead to ``s = 0``, the path from far out, where all `x` are held at
their bounds, always leads to a solution.
"""

from prb3r.mechanics.kernel import kernel

SMALLEST_PIVOT = 1e-12
"""Pivot at or below which two variables are not exchanged: the diagonal of `M` is near 1."""
GOLDEN = 0.6180339887498949
"""Fraction of the golden ratio, whose multiples lie as far from one another as they can."""
MAX_PIVOTS = 100
"""Most pivots of a path per variable.  A path usually takes one or two per variable, many more only where `M` is far
from that of a stable chain."""
MOST_MULTIPLICATIONS, FEWEST_PIVOTS = 2_000_000_000, 4
"""Most multiplications of a path, which lowers the number of its pivots for large problems, and fewest pivots per
variable that are allowed nevertheless."""


@kernel
def exchange(table, value, rate, h):
    """Exchange the basic and the nonbasic variable `h` in ``r = value + s rate - table z``.

    Returns whether that was done; nothing changes if the pivot is smaller than `SMALLEST_PIVOT`.
    """
    n, pivot = len(value), table[h, h]
    if not abs(pivot) > SMALLEST_PIVOT:
        return False
    inverse = 1.0 / pivot
    for k in range(n):
        table[h, k] *= inverse
    table[h, h] = inverse
    value[h] *= inverse
    rate[h] *= inverse
    for i in range(n):
        factor = table[i, h]
        if i != h and factor != 0.0:
            table[i, h] = 0.0
            for k in range(n):
                table[i, k] -= factor * table[h, k]
            value[i] -= factor * value[h]
            rate[i] -= factor * rate[h]
    return True


@kernel
def next_change(now, rate, side, free, last, way):
    """The change of `s` in the direction `way` (1 or -1) until the first variable reaches its bound, and its index.

    A free `x` reaches -1 or 1, a `w` reaches 0; the variable `last`, which has just been bound, is not considered as
    `w`.  The index is -1 if no variable reaches a bound.
    """
    least, which = 1e300, -1
    for i in range(len(now)):
        speed = way * rate[i]
        if speed == 0.0:
            continue
        if free[i]:
            room = (1.0 if speed > 0.0 else -1.0) - now[i]
        elif speed * side[i] < 0.0 and i != last:
            room = -now[i]
        else:
            continue
        part = max(room / speed, 0.0)
        if part < least:
            least, which = part, i
    return least, which


@kernel
def walk(table, value, rate, side, free, now, s):
    """Follow the path of solutions for ``c + s rate`` from the given `s` to ``s = 0``.

    `side`, `free` and `now` are those of `solve_near`; `table` has been exchanged for the free variables.  Returns the
    number of sets of free variables on the path; negative if the path does not lead to ``s = 0``.
    """
    n, last, way = len(value), -1, -1.0
    most = max(min(MAX_PIVOTS * (n + 1), MOST_MULTIPLICATIONS // (n * n + 1)), FEWEST_PIVOTS * (n + 1))
    for sets in range(1, most + 1):
        for i in range(n):
            now[i] = value[i] + s * rate[i]
            for k in range(n):
                if not free[k]:
                    now[i] -= table[i, k] * side[k]
        step, last = next_change(now, rate, side, free, last, way)
        if way < 0.0 and step >= s:
            for i in range(n):
                now[i] -= s * rate[i]
            return sets
        if last < 0:
            return -sets
        if free[last]:
            side[last] = 1.0 if way * rate[last] > 0.0 else -1.0
        s += way * step
        if not exchange(table, value, rate, last):
            return -sets
        free[last] = not free[last]
        way = -1.0 if free[last] == (side[last] * rate[last] > 0.0) else 1.0
    return -most


@kernel
def solve_near(table, value, rate, side, free, now):
    """Solve the complementarity problem with ``M = table`` and ``c = value``, on the path from the present state.

    Returns what `walk` returns.  `table` and `value` are overwritten; `side`, `free` and `now` hold the present state
    before and the solution afterwards.

    Parameters
    ----------
    rate : (n,) working space.
    side : (n,) the bound, 1 or -1, at which each `x` is that is not free.
    free : (n,) whether `x` is between its bounds.
    now : (n,) `x` where it is free and `w` elsewhere.
    """
    n = len(value)
    for i in range(n):
        rate[i] = -value[i] + (0.0 if free[i] else now[i])
        for k in range(n):
            rate[i] += table[i, k] * (now[k] if free[k] else side[k])
    for h in range(n):
        if free[h] and not exchange(table, value, rate, h):
            return -1
    return walk(table, value, rate, side, free, now, 1.0)


@kernel
def distinct(row):
    """A number from 1 to 2, another one for every row, from 0, so that ties are broken alike in every run."""
    return 1.0 + (GOLDEN * (row + 1)) % 1.0


@kernel
def solve_from_afar(table, value, rate, side, free, now):
    """Solve the same problem as `solve_near`, on the path from far out, where every `x` is held at its bound `side`.

    `free` and `now` need not hold anything at first.
    """
    s = 0.0
    for i in range(len(value)):
        free[i] = False
        rate[i] = side[i] * distinct(i)  # no two alike: one change at a time
        now[i] = value[i]
        for k in range(len(value)):
            now[i] -= table[i, k] * side[k]
        s = max(s, -now[i] / rate[i])
    return walk(table, value, rate, side, free, now, 2.0 * s)
