"""Rates of error, and what counts as evidence."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RatesSettings:
    """Rates of error."""

    alarm_rate: float = 0.01
    """Share of right models that may be said to leave something.  Choice: one recording in a hundred."""
    naming_rate: float = 0.003
    """Share of right models to which an effect may be added, or that fail a check after one was.  Choice: stricter, as
    a search asks several times."""
    missed_rate: float = 0.1
    """Share of recordings in which an effect of the size that is called detectable stays unnoticed.  Choice."""
    directions_assumed: float = 100.0
    """Hypotheses among which the detectable size has to show: a manipulator of 14 plates and four cables has about so
    many."""
    alike_rate: float = 0.05
    """Two explanations count as alike while a recording ranks them wrongly more often than that.  Choice."""
    resolved_rate: float = 0.01
    """A proposed experiment is enough once it ranks them wrongly less often than that.  Choice."""


@dataclass(frozen=True)
class EvidenceSettings:
    """What counts as evidence."""

    bic_fall: float = 10.0
    """Fall of the Bayesian information criterion from which on an effect is accepted.  "Very strong" evidence: Kass and
    Raftery, J. Am. Stat. Assoc. 90 (1995) 773."""
    contradicted_sd: float = 3.0
    """Prior standard deviations from nothing beyond which a parameter of an effect is tested without its prior, which
    the readings contradict.  Choice: by chance once in 370."""
    likelihood_ratio: float = 20.0
    """A rival is listed while it is at most so much less likely than what is named, and a law outside the library takes
    the place of effects that it is so much likelier than.  "Strong" on the scale of Kass and Raftery."""
    hopeless_rise: float = 40.0
    """A rival that fits worse by so much in chi-square is none, whatever its linearised distance.  Choice: a likelihood
    ratio of 5e8."""
    far_from_one: float = 1.5
    """Reduced chi-square from which on no interval is printed.  Choice: the error bars would be a fifth too small."""
