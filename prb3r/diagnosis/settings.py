"""Every number that a diagnosis was given: what it means, and where its value comes from.

"Choice" marks what was set by judgement; what it is worth shows `prb3r prove --settings`, which moves each threshold by
20 % to either side.  Closed forms are computed here and nowhere else.
"""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import norm


@dataclass(frozen=True)
class Settings:
    """Thresholds, limits and choices of a diagnosis."""

    # Rates of error
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

    # Evidence
    bic_fall: float = 10.0
    """Fall of the Bayesian information criterion from which on an effect is accepted.  "Very strong" evidence: Kass and
    Raftery, J. Am. Stat. Assoc. 90 (1995) 773."""
    refuted_rise: float = 10.0
    """Rise of chi-square on held-out readings at which what was named is taken back.  The same scale."""
    likelihood_ratio: float = 20.0
    """A rival is listed while it is at most so much less likely than what is named.  "Strong" on the same scale."""
    hopeless_rise: float = 40.0
    """A rival that fits worse by so much in chi-square is none, whatever its linearised distance.  Choice: a likelihood
    ratio of 5e8."""
    exchange_fall: float = 2.0
    """Fall of cost for which an effect is exchanged for another one.  Akaike's price of a parameter."""
    far_from_one: float = 1.5
    """Reduced chi-square from which on no interval is printed.  Choice: the error bars would be a fifth too small."""

    # Search
    most_new: int = 4
    """Effects that a proposed set has more than the one it is proposed around: as far as linearisation is trusted.
    Choice."""
    most_effects: int = 8
    """Effects of a model at most: real rigs have four or five, and a mismatch that takes more has another cause.
    Choice, for time."""
    gross: float = 4.0
    """Reduced chi-square of the constants alone from which on small loads are explained first.  Choice."""
    fewest_small_loads: float = 5.0
    """Readings a parameter that small loads must have to be explained first.  Choice."""
    load_shares: tuple[float, ...] = (0.4, 0.7)
    """Shares of the largest loads up to which readings are explained first, in this order."""
    beam: int = 12
    """Sets of effects that the linearised selection carries on.  Choice, for time."""
    proposals: int = 5
    """New sets that are fitted in full around each fit.  Choice, for time."""
    proposal_reach: float = 3.0
    """How far below the present set a proposed one may be in linearised ln evidence.  Choice."""
    costly_proposals: int = 1
    """The same where a prediction is slow."""
    costly_price: float = 2.0
    """Expansions that one counts for where a prediction is slow.  Choice, for time."""
    costly_kept: int = 4
    """Models that are refitted under a new covariance where a prediction is slow.  Choice, for time."""
    costly_shortlist: int = 3
    """Replacements of an effect that are fitted in full where a prediction is slow.  Choice, for time."""
    costly_gain: float = 2.0
    """Rise in linearised ln evidence from which on an effect is fitted that makes every prediction slow.  Choice."""
    useful_reach: float = 15.0
    """A fit that is farther below the best model, in ln evidence, after `patience` steps is given up.  Choice."""
    expansion_reach: float = 6.0
    """How far below the best a model may be, in ln evidence, and still be expanded.  Choice."""
    most_expansions: int = 12
    """Models that are expanded under one covariance.  Choice, for time."""
    later_expansions: int = 4
    """The same once the noise was renewed.  Choice, for time."""
    simpler_reach: float = 3.0
    """A part of the most probable model is chosen instead if its ln evidence is at most so much lower: an odds ratio of
    20, "strong" (Kass and Raftery), is asked of every effect that is named."""
    shortlist: int = 8
    """Replacements of an effect that are fitted in full.  Choice, for time."""
    shortlist_share: float = 0.5
    """Share of what an effect gains that a replacement must promise.  Choice."""
    costly_share: float = 0.7
    """Share of the best promise from which on a replacement is fitted that makes every prediction slow.  Choice."""
    renewals: int = 4
    """How often the noise is estimated anew from what the best model leaves.  Choice."""
    kept_models: int = 12
    """Models that are refitted under a new covariance.  Choice, for time."""
    most_alike: float = 0.9
    """Correlation of neighbouring residuals beyond which what is left tells no less: of 19 readings one.  Choice."""
    certain: float = 0.95
    """Probability from which on an effect is called certain.  Choice."""
    most_models: int = 12
    """Surviving models that are listed.  Choice, for the reader."""
    survival_odds: float = 150.0
    """A model survives while the best is at most so many times as probable: beyond, evidence against it is decisive
    (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)."""
    assumed_presence: float = 0.9
    """Prior probability of an effect that was found before.  Choice: found wrongly, or gone, once in ten."""
    parting_presence: float = 0.1
    """Prior probability that a rig which is said to share something has its own after all.  Choice."""
    most_rivals: int = 4
    """Rivals of an effect that experiments are sought for.  Choice, for the reader."""

    # Noise
    noise_log_sd: float = 0.35
    """Prior standard deviation of the ln of the factor on the stated noise: within a factor of two, rarely beyond."""
    noise_scales: tuple[float, float, int] = (-2.5, 2.5, 201)
    """Logarithms of the factors that are considered: from, to, how many."""
    tension_log_sd: float = 0.35
    """The same for the stated scatter of the tensions: nobody knows that of a spring balance better."""
    tension_scales: tuple[float, float, int] = (-1.05, 1.4, 8)
    """The same for these; what lies between is interpolated."""
    far_noise: float = 0.7
    """ln of the factor from which on the stated noise is called far off.  Choice: a factor of two."""
    common_shares: tuple[float, ...] = (0.1, 0.25, 0.5)
    """Shares of the noise that a photograph may have in common."""
    common_reaches: tuple[float, ...] = (2.0, 1e3)
    """Disks over which: neighbours, or the whole photograph, which has fewer."""
    common_sd: float = 0.3
    """Prior standard deviation of the share."""
    fewest_in_photograph: float = 4.0
    """Readings a photograph from which on a common share is sought."""

    # Fits
    most_steps: int = 40
    """Steps of a fit."""
    patience: int = 10
    """Steps after which a fit that is of no use yet is given up.  Choice, for time."""
    most_restarts: int = 4
    """How often the fit of the chosen model is begun again where it has not converged.  Choice, for time."""
    idle_gain: float = 0.05
    """Fall of chi-square that beginning again must bring: odds of less than 1.03."""
    small_gain: float = 1e-5
    """Fall of chi-square that is not worth a step."""
    small_share: float = 1e-6
    """The same as a share of chi-square."""
    widest_factor: float = 50.0
    """Largest factor on stiffness or friction, either way: further off the manipulator is another one."""
    start_factors: tuple[float, ...] = (1, 0.7, 1.4, 0.5, 2, 3, 5, 8, 12)
    """Stiffnesses from which calibration begins until one has an equilibrium."""
    softer: tuple[float, ...] = (0.35, 0.7)
    """Falls of ln stiffness that a fit begins from too where softer plates alone have no equilibrium."""
    pinned_fall: float = 0.1
    """Fall of ln stiffness at which a fit without equilibrium there counts as pinned.  Choice."""
    strong_effect: float = 0.2
    """Size of an effect that such a fit begins with, in its own scale.  Choice."""
    profile_trials: int = 5
    """Refits on either side of a profile."""
    profile_error: float = 0.1
    """Error of the rise of chi-square at the end of an interval."""
    draws: int = 4000
    """Random residuals that thresholds are drawn from: the last of them in 333 is told to a tenth."""

    # Blunders of the set-up
    blunder_rate: float = 1e-3
    """Share of right recordings in which a blunder may be said: one in a thousand.  Choice."""
    modulus_sd: float = float(np.log(1.5))
    """Of ln E: a handbook's modulus of the right material is right within a half.  Choice."""
    friction_sd: float = float(np.log(3.0))
    """Of ln mu: a handbook's coefficient is right within a factor of three.  Choice."""
    coarse_factors: tuple[float, ...] = (0.6, 1.0, 1.6)
    """Stiffnesses at which a blunder is tried before constants are fitted."""
    blunders_fitted: int = 12
    """Of the most promising blunders, how many are fitted in full.  Choice, for time."""
    robust_rounds: int = 3
    """Reweighted fits, in which readings count less the further they are off."""
    strained_sd: float = 4.0
    """Standard deviations of its prior from which on a constant is remarked upon: by chance once in 16,000."""
    blunder_fall: float = 10.0
    """Fall of the mean square from which on a blunder is said although effects do not explain the rest.  Choice: an
    order of magnitude."""
    most_blunders: int = 3
    """Blunders that are looked for in one recording.  Choice."""

    # Doubt
    believe_all: bool = False
    """Whether every reading and every weight is believed: an ablation of the benchmark."""
    tested_alone: bool = False
    """Whether every hypothesis is judged as if it were the only one: an ablation of the benchmark."""
    gross_sd: float = 5.0
    """Distance from what neighbours lead to expect at which a reading is a gross outlier, sd.  Choice: by chance once
    in 1.7 million readings."""
    lone_ratio: float = 2.0
    """How many times as far as its neighbours a reading that a fit misses is off if it is alone.  Choice."""
    most_gross: float = 0.1
    """A larger share of the readings than this is not outliers.  Choice."""
    outlier_rounds: int = 4
    """How often outliers are looked for among what is left."""
    doubt_rounds: int = 2
    """How often readings are weighed and the model fitted again."""
    most_wrong_weights: int = 3
    """Weights that may be doubted before it is no slip any more.  Choice."""
    disbelief: float = 1e3
    """Factor on the standard deviation of all readings under a weight that is not believed: they no longer count."""
    other_weights: tuple[float, float, int] = (0.1, 10.0, 81)
    """What a noted weight is multiplied by to see which one was wrong: from, to, how many, evenly in the logarithm."""
    listed_sd: float = 4.0
    """Readings further off than this are listed.  Choice."""

    # Sequences set aside, and repeated ones
    held_out_share: float = 0.25
    """Share of the sequences that is set aside.  Choice."""
    farthest_sd: float = 3.0
    """A reading of a sequence set aside counts as at most so far off, as noise has heavier tails than Gauss's: physics
    that is missing moves many readings.  Choice."""
    hard_pull: float = 0.8
    """Share of a cable's highest tension from which on it is pulled hard.  Choice."""
    same_loads: float = 0.05
    """Share of the highest load by which repeated loads differ at most.  Choice."""
    closely_read: float = 0.2
    """Share of the highest load by which two steps differ at most that a third is compared with in between.  Choice."""
    fewest_repeats: int = 8
    """Repeated steps from which on their scatter is held against the stated noise.  Choice: told to a quarter."""

    told_share: float = 0.8
    """A recording tells a tolerance if it leaves less than this share of its standard deviation.  Choice."""

    # Location and dependence
    alike_plates: float = 2.0
    """Missing moments are alike over so many plates.  Choice."""
    own_share: float = 0.1
    """But for this share of their variance.  Choice."""
    moment_sizes: tuple[float, ...] = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3)
    """Sizes of missing moments that are considered, in shares of the largest cable moment."""
    near_largest: float = 0.7
    """Laws whose score is at least this share of the largest are said to be what the mismatch goes with.  Choice."""
    loud_sd: float = 3.0
    """A sequence is said to show the mismatch where its mean square is so many sd above one.  Choice."""
    part_sd: float = 0.5
    """A part of the recording tells a constant if it leaves a smaller relative sd than this.  Choice."""

    # Empirical law and next experiment
    most_terms: int = 3
    """Terms of an empirical law.  Choice, for the reader."""
    term_share: float = 0.1
    """Scale of a term: the moment that is this share of the largest cable moment."""
    farthest_term: float = 30.0
    """Bound of a term in that scale: three times the largest cable moment."""
    harder: float = 1.25
    """Proposed programs pull up to so many times the largest recorded tension.  Choice."""

    @cached_property
    def detectable(self) -> float:
        """Norm of an effect's whitened change at which it is noticed but for `missed_rate`: 5.17."""
        return float(norm.isf(self.alarm_rate / 2 / self.directions_assumed) + norm.isf(self.missed_rate))

    @cached_property
    def alike(self) -> float:
        """Squared whitened distance of two predictions that are ranked wrongly with `alike_rate`: 10.8.

        Their log likelihoods differ by d^2 / 2 on the average and scatter by d, so the rate is Phi(-d / 2).
        """
        return float(4 * norm.isf(self.alike_rate) ** 2)

    @cached_property
    def resolved(self) -> float:
        """The same for `resolved_rate`: 21.6."""
        return float(4 * norm.isf(self.resolved_rate) ** 2)

    @cached_property
    def close_fit(self) -> float:
        """Twice the logarithm of `likelihood_ratio`: 5.99."""
        return float(2 * np.log(self.likelihood_ratio))

    @cached_property
    def farthest(self) -> float:
        """Largest ln of a factor on stiffness or friction."""
        return float(np.log(self.widest_factor))

    def plain(self) -> dict[str, Any]:
        """By name, for files."""
        return asdict(self)
