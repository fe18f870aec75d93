"""How verdicts are scored."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Protocol:
    """Comparison, intervals and goals."""

    compared: int = 10
    """One of so many recordings is judged by the other methods too: each costs as much as a diagnosis."""
    confidence: float = 0.95
    """Of all intervals."""
    draws: int = 2000
    """Of the bootstrap of ratios: an interval's ends are then known to a tenth of its width."""
    heldout_share: float = 0.25
    """Of the squared norm of an effect that is expected in the sequences set aside: counted against a failure."""
    loading_fits: float = 0.01
    """Chance of so large a chi-square above which loading alone counts as fitted."""
