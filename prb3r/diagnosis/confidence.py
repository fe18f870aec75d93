"""How sure the intervals and regions of a diagnosis are, 95 %, and the quantiles that belong to it."""

from scipy.stats import chi2, norm

TAIL = 0.025
"""Probability beyond either end of an interval."""
NORMAL_REACH = float(norm.isf(TAIL))
"""Half the interval of a normal variable, in standard deviations: 1.96."""
INTERVAL_RISE = float(chi2.isf(2 * TAIL, 1))
"""Rise of chi-square at the ends of the interval of one parameter, all others refitted: 3.84."""
PLANE_REACH = float(chi2.isf(2 * TAIL, 2)) ** 0.5
"""Length, in standard deviations of each coordinate, that errors in the plane stay within: 2.45, the root of 5.99."""
