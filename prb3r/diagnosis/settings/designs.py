"""What is said of other designs, and of the parts of the recorded rig."""

from dataclasses import dataclass


@dataclass(frozen=True)
class DesignsSettings:
    """What is said of other designs, and of the parts of the recorded rig.

    A diagnosis is made without the numbers of draws: they are what predictions from it draw unless they are asked for
    more.
    """

    told_variance: float = 0.05
    """Share of the variance of a direction of the tolerances that a recording takes away from which on that counts.
    Choice: what takes less leaves 97 % of the standard deviation."""
    most_faults: int = 2
    """Plates of another stiffness that are taken for faults of single parts, which stay behind.  If one rig in ten has
    such a fault, three on one rig come by chance once in six thousand (Poisson): then this is how its plates are
    made."""
    band_draws: int = 120
    """Draws of models and parameters that are solved for a band.  Choice, for time: its ends at 2.5 % are then the
    third draw from either end."""
    learnt_rigs: int = 64
    """Rigs that are drawn for a study.  Choice, for time, a power of two as Sobol's sequences have it: the ends of what
    95 % of them do are then known within a few per cent of the rigs."""
    most_lost_draws: float = 0.5
    """Share of the draws without an equilibrium beyond which no band is told: the few that have one are those that
    bend least.  Choice: half."""
    bent_beyond: float = 1.1
    """How many times as far as in the recording plates have to be bent for that to be said.  Choice: rigs repeat their
    bends within a few per cent, and laws of bending change little over a tenth."""
    pace_apart: float = 30.0
    """How many times as fast, or slow, as those of the recording steps have to follow each other for that to be said.
    Choice: one and a half decades, and less than the thousand between seconds and milliseconds."""
    wider_bands: float = 2.0
    """How many times as wide as without an effect that is not named bands have to be for that to be said.  Choice: a
    designer who is told a tip to 2 mm instead of 1 would do another recording."""
