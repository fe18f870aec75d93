"""Noise, doubted readings and weights, sequences set aside."""

from dataclasses import dataclass

from prb3r.recording.plausibility import FEWEST_TO_SET_ASIDE


@dataclass(frozen=True)
class NoiseSettings:
    """What may be found of the noise."""

    noise_log_sd: float = 0.35
    """Prior standard deviation of the ln of the factor on the stated noise: within a factor of two, rarely beyond.
    Choice."""
    noise_scales: tuple[float, float, int] = (-2.5, 2.5, 201)
    """Logarithms of the factors that are considered, from, to, how many: seven prior deviations either way.  Choice."""
    tension_log_sd: float = 0.35
    """The same for the stated scatter of the tensions: nobody knows that of a spring balance better.
    Choice."""
    tension_scales: tuple[float, float, int] = (-1.05, 1.4, 8)
    """The same for these; what lies between is interpolated.  Choice, for time."""
    spline_points: int = 20
    """Points of a cubic spline through the log density for each of `tension_scales`.  Choice: a factor is told to
    2 %."""
    same_scale: float = 0.03
    """Change of the ln of the factor on the noise of the readings below which the search counts as settled.  Choice:
    6 % of chi-square, that no decision depends on."""
    same_scatter: float = 0.1
    """The same for the scatter of the tensions, which is told less exactly."""
    far_noise: float = 0.7
    """ln of the factor from which on the stated noise is called far off.  Choice: a factor of two."""
    common_shares: tuple[float, ...] = (0.1, 0.25, 0.5, 0.8)
    """Shares of the noise that a photograph may have in common.  Choice; the largest for markers that are followed in
    one image: where the noise of a disk is 0.45 times that of the one before it, and its own, a half left clean rigs
    `unexplained`."""
    common_supposed: float = 0.25
    """Share of the noise that the disks of a photograph are supposed to have in common at least where repeated readings
    are counted.  Choice: the second of those that are tried."""
    common_reaches: tuple[float, ...] = (2.0, 1e3)
    """Disks over which: neighbours, or the whole photograph, which has fewer.  Choice."""
    common_sd: float = 0.3
    """Prior standard deviation of the share.  Choice."""
    lasting_shares: tuple[float, ...] = (0.25, 0.5, 0.9)
    """Shares of the variance of the tensions that may last through a sequence.  Choice: less is not seen among few
    sequences, and with more no step would have any scatter of its own."""
    lasting_sd: float = 0.3
    """Prior standard deviation of the share: as of what a photograph has in common."""
    serial_shares: tuple[float, ...] = (0.25, 0.5, 0.75)
    """Shares of the noise that the readings of a disk may have in common along a sequence.  Choice."""
    serial_spans: tuple[float, ...] = (2.0, 10.0)
    """Steps over which: neighbours, or most of a sequence.  What is alike over all of it is no noise but something that
    was moved."""
    serial_factors: tuple[float, ...] = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
    """Factors on the steps over which the noise of a log lasts by itself that the fit of a model may tell.  Choice."""
    serial_log_sd: float = 0.7
    """Prior standard deviation of the ln of that factor: stretches of a log tell 1 to 16 steps where it lasts over 2.8
    (`tests/recording/test_serial_noise.py`)."""
    better_shares: float = 2.0
    """Fall of minus twice the ln of the likelihood from which on another share is believed: less is "not worth more
    than a bare mention" (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)."""
    most_in_sequence: int = 1500
    """Readings of a kind in a sequence up to which a share is sought that goes on along it: their correlation is
    dense.  Choice, for time."""
    most_differences: int = 600
    """Differences of repeated sequences that are held against one another: their covariance is dense.  Choice, for
    time."""
    coarser: int = 10
    """Points of the scales of the noise for each that is tried there.  Choice, for time."""
    fewest_in_photograph: float = 4.0
    """Readings a photograph from which on a common share is sought.  Choice: fewer hardly tell it."""


@dataclass(frozen=True)
class DoubtSettings:
    """Which readings and weights are not believed."""

    believe_all: bool = False
    """Whether every reading and every weight is believed: an ablation of the benchmark."""
    tested_alone: bool = False
    """Whether every hypothesis is judged as if it were the only one: an ablation of the benchmark."""
    gross_sd: float = 5.0
    """Distance from what neighbours lead to expect at which a reading is a gross outlier, sd.  Choice: by chance once
    in 1.7 million readings."""
    fewest_expectations: int = 2
    """Expectations of a reading, from up to twelve lines and parabolas through its neighbours, from which on the
    nearest counts.  Choice: a single one is no evidence, as what it leads through may be an outlier itself."""
    expectations_for_second: int = 4
    """Expectations from which on the second nearest counts instead, as another gross outlier can spoil one either way.
    Choice."""
    least_surprise: float = 0.1
    """Median distance of noise as stated from what neighbours lead to expect that is supposed at least, sd, so that
    distances can be divided by it where most readings have too few neighbours.  Choice."""
    lone_ratio: float = 2.0
    """How many times as far as its neighbours a reading that a fit misses is off if it is alone.  Choice."""
    most_gross: float = 0.1
    """A larger share of the readings than this is not outliers.  Choice."""
    outlier_rounds: int = 4
    """How often outliers are looked for among what is left, at most.  Choice."""
    doubt_rounds: int = 2
    """How often readings are weighed and the model fitted again, at most.  Choice, for time."""
    most_wrong_weights: int = 3
    """Weights that may be doubted before it is no slip any more.  Choice."""
    disbelief: float = 1e3
    """Factor on the standard deviation of all readings under a weight that is not believed: they no longer count."""
    other_weights: tuple[float, float, int] = (0.1, 10.0, 81)
    """What a noted weight is multiplied by to see which one was wrong: from, to, how many, evenly in the logarithm."""
    listed_sd: float = 4.0
    """Readings further off than this are listed.  Choice."""


@dataclass(frozen=True)
class SequencesSettings:
    """Sequences that are set aside, and repeated ones."""

    fewest_sequences: int = FEWEST_TO_SET_ASIDE
    """Sequences from which on some are set aside, as reading a recording remarks: two are left, so that constants are
    not fitted to one way of loading."""
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
    misleading: float = 2.0
    """Effects mislead that, with all parts as drawn, predict what was set aside so many times as far off as constants
    alone do, and so do refitted constants beside those of the file.  Choice: of 20 simulated rigs with effects (seed
    49) none does even as far off as that."""
    missed_in_shared_noise: float = 2.0
    """Another recording is missed from so many times its noise on, where readings share noise.  Choice: of readings
    that go together in fours chi-square scatters by twice as much, so that no table of it holds."""
    led_astray: float = 0.5
    """Share of the fitted sequences that constants of the file have to predict no worse than refitted ones, for the
    others to have led these astray.  Choice: of a rig whose plate was cracked on one side one of five was."""
    worse: float = 1.2
    """Effects predict what was set aside worse than constants alone if their error is so many times as large, and so
    many times the noise.  Choice: by a fifth, as some twenty readings tell an error to a sixth."""
    carried_gain: float = 0.5
    """Share of the squared error beyond noise that constants alone leave, of what was set aside, which effects of an
    unexplained recording must remove to carry over to another geometry.  Choice: the larger part."""
    vague: float = 2.0
    """Times its noise by which what was set aside may be missed, with the rig's parts as they were made, for numbers to
    be relied upon.  Choice: of predictions that are as certain as readings it is 1.4."""
    moved_elsewhere: float = 2.0
    """How many times as far as the recorded rig effects of an unexplained recording may move another geometry, as a
    share of its way from the straight manipulator, to carry over to it.  Choice: beyond, they act where nothing tells
    whether they are right."""
    fewest_repeats: int = 8
    """Repeated steps from which on their scatter is held against the stated noise.  Choice: told to a quarter."""

    told_share: float = 0.8
    """A recording tells a tolerance if it leaves less than this share of its prior standard deviation.  Choice."""
