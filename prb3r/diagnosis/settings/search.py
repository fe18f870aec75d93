"""How far and how long sets of effects are sought."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SearchSettings:
    """How far and how long sets of effects are sought."""

    most_new: int = 4
    """Effects that a proposed set has more than the one it is proposed around: as far as linearisation is trusted.
    Choice."""
    most_effects: int = 8
    """Effects of a model at most: real rigs have four or five, and a mismatch that takes more has another cause.
    Choice, for time."""
    gross: float = 4.0
    """Reduced chi-square of the constants alone from which on small loads are explained first, and of a model beyond
    which its effects are not exchanged.  Choice."""
    fewest_small_loads: float = 5.0
    """Readings a parameter that small loads must have to be explained first.  Choice."""
    load_shares: tuple[float, ...] = (0.4, 0.7)
    """Shares of the largest loads up to which readings are explained first, in this order.  Choice."""
    common_presence: float = 0.1
    """Prior probability from which on an effect is common: all such are fitted at once as one of the beginnings."""
    saturated_shares: tuple[float, ...] = (0.25, 0.4, 0.55, 0.7, 0.85)
    """Shares of the largest loads up to which readings are fitted with all of them, in this order.  Choice."""
    saturated_leaves: float = 0.5
    """Share of the chi-square of the constants that all common effects together, or a law of bending and a stop after
    `pair_steps`, must fall below to be searched on from: where all explain next to nothing, as where cables are
    exchanged, no part of them does.  Choice, for time."""
    pair_steps: int = 4
    """Steps of a fit from each pair of sizes at which a law of bending and a stop are tried.  Choice, for time: on a
    simulated notched wrist the best end is the same after 8."""
    pair_starts: int = 4
    """From how many of these, those that leave least then, the fit goes on.  Choice, for time."""
    several_effects: int = 3
    """Effects of an end that explains a recording from which on the other side is searched from too: fewer are hardly
    met by other means.  Choice, for time."""
    beam: int = 12
    """Sets of effects that the linearised selection carries on.  Choice, for time."""
    best_added: int = 4
    """Of all columns that a set could have in addition, how many are tried, the best.  Choice: the best of each step
    alone leads into traps where two together would do."""
    best_exchanged: int = 2
    """Of all that could stand in the place of one or more of its columns, how many are tried.  Choice, for time."""
    many_of_a_kind: int = 3
    """Effects of one kind in a set from which on one effect in the place of all of them is tried: so many parts may be
    one whole.  Choice: in the place of any two effects one is tried anyway."""
    proposals: int = 5
    """New sets that are fitted in full around each fit.  Choice, for time."""
    small_steps: int = 3
    """The best set of each size is fitted too, up to so many effects more than the present one has.  Choice: where much
    is unexplained the linearised model is far from true and favours large sets; small steps are safer."""
    proposal_reach: float = 3.0
    """How far below the present set a proposed one may be in linearised ln evidence.  Choice."""
    costly_proposals: int = 3
    """The same where a prediction is slow.  Choice, for time: with 1 a hole of the wrong cable had no rival on a rig of
    another hand where the right one explains as well."""
    costly_price: float = 2.0
    """Expansions that one counts for where a prediction is slow.  Choice, for time."""
    costly_kept: int = 8
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
    """A part of the most probable model is chosen instead if its ln evidence is at most so much lower: posterior odds
    of 20 to 1, "strong" (Kass and Raftery), is asked of every effect that is named."""
    positive_presence: float = 0.75
    """Probability from which on a kind that is not named makes what is named no certainty, and some effect is told to
    be likely where none is named: odds of 3, "positive" (Kass and Raftery), where those of `simpler_reach` would name
    one."""
    any_presence: float = 0.9
    """Probability from which on some effect, all taken together, makes constants alone not `adequate`.  Choice: odds of
    9; of 78 clean imperfect rigs (seeds 5 and 6) two have more."""
    left_out: int = 3
    """Effects of the best model that are left out in full, one at a time, those first that the linearised model misses
    least.  Choice: of ten effects fitted to a simulated notched wrist it misses least those that are needed, and eight
    of them are found to be none with 3 or with all, none with 1."""
    costly_left_out: int = 1
    """The same where a prediction is slow.  Choice, for time."""
    shortlist: int = 8
    """Replacements of an effect that are fitted in full.  Choice, for time."""
    probes_fitted: int = 2
    """Fits of one such replacement at most, each from another of the values that it is tried at.  Choice, for time."""
    knee_of_plateau: float = 1.3
    """Strain of the outermost fibre at which the knee of a law is that comes next to a rectangle's, over that at which
    its plateau begins: bilinear and smooth laws fitted to recordings of such plates had 1.14 to 1.42."""
    fewest_replacements: int = 6
    """Replacements of an effect that are fitted in full whatever they promise.  Choice, for time: on a measured rod a
    base that gives way promises 0.1 in ln evidence in the place of plates that soften, and gains 5.6."""
    shortlist_share: float = 0.5
    """Share of what an effect gains that a replacement must promise.  Choice."""
    costly_share: float = 0.7
    """Share of the best promise from which on a replacement is fitted that makes every prediction slow.  Choice."""
    exchanges: int = 3
    """How often the search goes on from a better model that has another effect in the place of a chosen one.  Choice,
    for time."""
    better_exchanged: float = 1.0
    """Rise in ln evidence from which on it does: less is "not worth more than a bare mention" (Kass and Raftery)."""
    restarts: int = 24
    """Random points around the best model from which it is fitted anew where it leaves more than noise.  Choice, for
    time: some seconds."""
    restart_sd: float = 5.0
    """How far these points lie from the fit, in posterior standard deviations.  Choice: beyond what the linearised fit
    covers.  On ten simulated rigs that are unexplained 1, 5 and 20 alike led nowhere lower."""
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
    """A model survives while the best is at most so many times as probable: beyond, evidence against it is very
    strong (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)."""
    confounded: float = 1.0
    """Standard deviations that an effect outside the chosen model has to add to those of Young's modulus or friction to
    be fitted beside it.  Choice: as much as is uncertain without it."""
    assumed_presence: float = 0.9
    """Prior probability of an effect that was found before.  Choice: found wrongly, or gone, once in ten."""
    parting_presence: float = 0.1
    """Prior probability that a rig which is said to share something has its own after all.  Choice."""
    alike_presence: float = 0.5
    """Prior probability that an effect of the bench, such as a load cell that reads wrong, is there with every rig and
    of one size, if it is there with one.  Choice: rigs of one make mostly stand on one bench; what is of their making,
    as their clamps, is alike but for `parting_presence`."""
    tested_together: int = 16
    """Hypotheses that one task tests where a prediction is slow: as many as are differentiated together.  Choice, for
    time."""
    most_rivals: int = 4
    """Rivals of an effect that experiments are sought for.  Choice, for the reader."""
