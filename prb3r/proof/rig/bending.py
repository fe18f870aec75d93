"""Compiled laws of the rig's plates: the curvature under a moment."""

import numpy as np
from numba import njit

from prb3r.proof.rig.arrays import BILINEAR_LAW, CUBIC_LAW, SECTION_LAW, SMOOTH_LAW

SMOOTH_ITERATIONS = 60
"""Most Newton iterations for a curvature; at a hundred times the knee it takes about ten."""


@njit(cache=True)
def smooth_curvature(bare, knee, ratio, sharpness):
    """Curvature of a plate with a smooth knee, and its derivative by `bare` = M / EI > 0.

    Newton's iteration from `bare` approaches the root from one side, as the law is convex or concave throughout.
    """
    k, slope = bare, 1.0
    for _ in range(SMOOTH_ITERATIONS):
        passed = (k / knee) ** sharpness
        share = (1 - ratio) * (1 + passed) ** (-1 / sharpness)
        slope = ratio + share / (1 + passed)
        move = (bare - k * (ratio + share)) / slope
        k += move
        if abs(move) < 1e-14 * k:
            break
    return k, 1 / slope


@njit(cache=True)
def tabulated_curvature(bare, table):
    """Curvature and its derivative by `bare` = M / EI > 0, from a (k, 3) `table` of `bare` (growing) and these two.

    Hermite's cubic between two rows; linear beyond the last one, elastic before the first.
    """
    last = len(table) - 1
    if bare <= table[0, 0]:
        return bare, 1.0
    if bare >= table[last, 0]:
        return table[last, 1] + table[last, 2] * (bare - table[last, 0]), table[last, 2]
    row = np.searchsorted(table[:, 0], bare) - 1
    width, low, high = table[row + 1, 0] - table[row, 0], table[row], table[row + 1]
    t = (bare - low[0]) / width
    chord = high[1] - low[1]
    bow, lean = width * low[2] - chord, chord - width * high[2]
    k = low[1] + t * chord + t * (1 - t) * ((1 - t) * bow + t * lean)
    by_t = chord + (1 - 2 * t) * ((1 - t) * bow + t * lean) + t * (1 - t) * (lean - bow)
    return k, by_t / width


@njit(cache=True)
def curvature(moment, rigidity, law, numbers, table):
    """Curvature less the stress-free one under a moment, and its derivative by the moment, of a plate without memory.

    NaN where a softening cubic law carries no such moment.  `numbers` are those of the law: the first for either side
    (2,), the second and the third; `table` (2, k, 3) is that of a section.
    """
    firsts, second, third = numbers
    bare = moment / rigidity
    first = firsts[1] if bare > 0 else firsts[0]
    if law == CUBIC_LAW and first != 0:
        root = np.sqrt(3 * abs(first))
        if first > 0:
            k = 2 / root * np.sinh(np.arcsinh(1.5 * root * bare) / 3)
        elif abs(1.5 * root * bare) < 1:
            k = 2 / root * np.sin(np.arcsin(1.5 * root * bare) / 3)
        else:
            k = np.nan
        return k, 1 / (rigidity * (1 + 3 * first * k**2))
    excess = abs(bare) - first
    if law == BILINEAR_LAW and excess > 0:
        return np.sign(bare) * (first + excess / second), 1 / (second * rigidity)
    if law == SMOOTH_LAW and bare != 0:
        k, slope = smooth_curvature(abs(bare), first, second, third)
        return np.sign(bare) * k, slope / rigidity
    if law == SECTION_LAW and bare != 0:
        k, slope = tabulated_curvature(abs(bare), table[1 if bare > 0 else 0])
        return np.sign(bare) * k, slope / rigidity
    return bare, 1 / rigidity


@njit(cache=True)
def bent_in_flag(moment, rigidity, law, before, after):
    """Curvature under a moment, and its derivative by the moment, of a plate with a flag-shaped loop.

    Loaded, the plate follows its law; unloaded, that law with moment and curvature scaled by `reverse`; between the two
    it is elastic, from the moment and curvature in `before`.  Writes those reached to `after`; both (2,).
    """
    kind, numbers, table, reverse = law
    loaded, softness = curvature(moment, rigidity, kind, numbers, table)
    unloaded, yielding = curvature(moment / reverse, rigidity, kind, numbers, table)
    unloaded *= reverse
    k, way = before[1] + (moment - before[0]) / rigidity, 1.0 if moment >= 0 else -1.0
    after[0] = moment
    if way * k <= way * loaded or way * unloaded <= way * loaded:  # the second where the law stiffens: there is no loop
        after[1] = loaded
        return loaded, softness
    if way * k >= way * unloaded:
        after[1] = unloaded
        return unloaded, yielding
    after[1] = k
    return k, 1 / rigidity


@njit(cache=True)
def bent_on(moment, rigidity, loop, before, after):
    """Curvature under a moment, and its derivative by the moment, of a plate with springs that slip (Jenkin elements).

    The moment grows or falls monotonically from that of the state `before`; whenever one more spring reaches its limit,
    the others carry on alone, with less stiffness.  Writes the state `after`; both (2 + springs,), see `Bent`.
    """
    share, slips_at, springs = loop
    spring, left = share * rigidity / springs, moment - before[0]
    way, stiffness = 1.0 if left >= 0 else -1.0, rigidity
    for e in range(2 + springs):
        after[e] = before[e]
    for _ in range(springs + 1):
        stiffness, room = (1 - share) * rigidity, np.inf
        for e in range(springs):
            limit = spring * slips_at * (2 * e + 1) / springs
            if way * after[2 + e] < limit:
                stiffness += spring
                room = min(room, (limit - way * after[2 + e]) / spring)
        move = min(abs(left) / stiffness, room)
        for e in range(springs):
            limit = spring * slips_at * (2 * e + 1) / springs
            grown = way * after[2 + e] + spring * move
            after[2 + e] = way * (limit if grown > limit * (1 - 1e-14) else grown)
        after[1] += way * move
        left -= way * move * stiffness
        if move < room:
            break
    after[0] = moment
    return after[1], 1 / stiffness
