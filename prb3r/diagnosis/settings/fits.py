"""How fits and profiles are made."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FitsSettings:
    """How fits and profiles are made."""

    steps_used: int = 180
    """Load steps of a recording that are used at most (:func:`prb3r.recording.thinning.thinned`).  Choice, for time and
    memory."""
    steps_of_sequence: int = 45
    """Steps that a sequence keeps even if all have more than `steps_used`.  Choice: enough for loops within loops."""
    most_steps: int = 40
    """Steps of a fit at most.  Choice, for time."""
    patience: int = 10
    """Steps after which a fit that is of no use yet is given up.  Choice, for time."""
    most_restarts: int = 4
    """How often the fit of the chosen model is begun again where it has not converged.  Choice, for time."""
    idle_gain: float = 0.05
    """Fall of chi-square that is not worth looking for, as odds change by less than 1.03: a fit has converged where no
    more is promised, and exact derivatives in place of secants, or beginning again, must bring as much."""
    idle_rounds: int = 2
    """Exact derivatives in a row that bring less, after which a fit is taken to be at a kink.  Choice, for time.  One
    of them, or less than 3 % of what they promise in the place of less than `idle_gain`, saves a sixth of the
    solutions; a search lost the valley of its five effects with that (seed 5, case 163)."""
    kink_trials: int = 8
    """Steps that are tried to get past it.  Of 60 starts before a wall of two parameters 31 end at the least without,
    39 with 4 or 8 and 40 with 12 to 24 (`tests/diagnosis/test_kinks.py`)."""
    small_gain: float = 1e-5
    """The same of a fit that is told.  With `small_share` no estimate is farther than 0.03 of its standard deviation
    from the minimum where chi-square is 1,000.  Choice."""
    small_share: float = 1e-6
    """Share of chi-square that is not worth looking for either, of models that are far from explaining the readings.
    Choice."""
    widest_factor: float = 50.0
    """Largest factor on stiffness or friction, either way: further off the manipulator is another one.  Choice."""
    start_factors: tuple[float, ...] = (1, 0.7, 1.4, 0.5, 2, 3, 5, 8, 12)
    """Stiffnesses from which calibration begins until one has an equilibrium.  Choice."""
    far_stated_sd: float = 3.0
    """Stated standard deviations from which on a constant contradicts what is stated of it: by chance once in 370."""
    misstated: float = 0.1
    """Prior probability that what is stated of a constant, or of the places of markers, is wrong.  Choice: as common as
    a common effect."""
    fewest_turned: int = 2
    """Markers that are turned far beyond their tolerance, from which on a wider one is tried.  Choice: one alone is
    looked at."""
    wider_marker: float = 10.0
    """How many times as wide that one is, and one of places that is tried.  Choice: three degrees in the place of 0.3,
    or a few millimetres in the place of some tenths, which are seen by eye."""
    profile_trials: int = 5
    """Refits on either side of a profile at most.  Choice, for time."""
    profile_error: float = 0.1
    """Error of the rise of chi-square at the end of an interval.  Choice: of 3.84, so that 95 % are 94.7 to 95.3 %."""
    least_trial_ratio: float = 0.3
    """Distance of a trial of a profile from the best value over that of the trial before, at least: one poor trial does
    not send a profile back to where it began.  Choice, for time."""
    most_trial_ratio: float = 3.0
    """The same at most: where chi-square hardly rises, its square root tells little of where it will.  Choice, for
    time."""
    least_trial_rise: float = 0.05
    """Rise of chi-square from which the end of an interval is extrapolated at the least, as the square root of a
    smaller one would promise an end beyond `most_trial_ratio`: 3.84 is reached at 8.8 times the distance."""
    linear_interval_factor: float = 2.0
    """Factor within which the length of a linearised interval is believed, as chi-square at its ends tells.  Choice."""
    out_of_balance_sd: float = 3.0
    """What a reading costs whose step is not in balance, sd, beside what the last step in balance misses it by.
    Choice: more than noise alone mostly moves a reading by."""
    out_of_balance_factor: float = 10.0
    """How many times itself the misfit of such a reading has in addition where nothing of its step has an equilibrium;
    in proportion where a part has none.  Choice: large, so that a fit is drawn to where more of a step has one."""
    path_end_error: float = 1.0 / 2**10
    """Error of the place, as a share of a load step, at which the step loses its equilibrium; a power of a half, as
    steps are halved to find it.  Choice: fits count what is missing in per cents.  With 1/256 the 48 recordings of seed
    47 take as long; with 1/64 some fits stall."""
    least_out_of_balance: float = 1e-6
    """Share of a step without equilibrium that is missing at least, so that none counts as in balance.  Choice: far
    less than `path_end_error`."""
    work_of_sequence: int = 500_000
    """Evaluations of a plate that a load path of a fit may take for each sequence; steps that are left count as without
    equilibrium.  Where friction follows the path and plates hardly resist, a path may creep on for half a minute.  Of
    4,900 paths of seven real rigs of the proof (seed 103) one step in a thousand that was solved took more than 1,300,
    the hardest 45,000; the hardest of steps that pull four cables against each other at random, up to 60 N with a
    presliding length of 10 micrometres or more, 89,000."""
    work_of_step: int = 20_000
    """What each of its steps adds to that.  Choice, for time."""
    draws: int = 4000
    """Random residuals that thresholds are drawn from: the last of them in 333 is told to a tenth."""
