"""What is said of parameters that several recordings share."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SharingSettings:
    """What is said of parameters that several recordings share."""

    untold_share: float = 0.9
    """A recording does not tell a parameter alone if it leaves more than this share of its prior standard deviation.
    Choice: its readings then took less than a fifth of the variance away."""
    imitated_probability: float = 0.05
    """Probability of one value on all rigs from which on it is said to be possible although each recording tells
    another: an effect of one rig can make up the difference.  Choice."""
    all_probability: float = 0.995
    """Probability of joint models from which on they are said to be all.  Choice: less rounds to 99 %."""
    strong_log_bayes_factor: float = 3.0
    """ln of a Bayes factor for or against sharing from which on it decides: odds of 20, "strong" (Kass and Raftery, J.
    Am. Stat. Assoc. 90 (1995) 773)."""
