"""The level of confidence of all intervals and regions of a diagnosis, 95 %, and its quantiles."""

from prb3r.diagnosis.chance import chi2_critical, normal_critical

TAIL = 0.025
"""Probability beyond each end of an interval."""
NORMAL_REACH = float(normal_critical(TAIL))
"""Half the width of the interval of a normal variable, in standard deviations: 1.96."""
INTERVAL_RISE = float(chi2_critical(2 * TAIL, 1))
"""Rise of chi-square at the ends of the interval of one parameter, all others refitted: 3.84."""
PLANE_REACH = float(chi2_critical(2 * TAIL, 2)) ** 0.5
"""Length that a normal error in the plane stays within, in standard deviations of each coordinate: 2.45, the root of
5.99."""
