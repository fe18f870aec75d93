"""How verdicts are scored."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Protocol:
    """Comparison, intervals and goals."""

    compared: int = 10
    """One of so many recordings is judged by the other methods too: each costs as much as a diagnosis."""
    sweep_share: float = 0.2
    """By which each number among the settings of the diagnosis moves, down and up, to show what depends on it: as far
    as somebody else might have chosen it."""
    sweep_cases: int = 60
    """Recordings of such a run unless another number is asked for: each is diagnosed twice for every setting."""
    confidence: float = 0.95
    """Of all intervals."""
    draws: int = 2000
    """Of the bootstrap of ratios: an interval's ends are then known to a tenth of its width."""
    heldout_share: float = 0.25
    """Of the squared norm of an effect that is expected in the sequences set aside: counted against a failure."""
    lost_share: float = 1.0
    """By which each coordinate of a disk counts as off where a prediction has no equilibrium: part of the straight
    length, or of pi where angles alone are read.  A choice: about as far as a disk can be from its place."""
    bare_mention: float = 1.0
    """ln evidence by which the truth may be ahead of what a search has found before it counts as missed: "not worth
    more than a bare mention" (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)."""
    loading_fits: float = 0.01
    """Chance of so large a chi-square above which loading alone counts as fitted."""
