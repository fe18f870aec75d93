"""Which blunders of the set-up are said."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class BlundersSettings:
    """Which blunders of the set-up are said."""

    blunder_rate: float = 1e-3
    """Share of right recordings in which a blunder may be said: one in a thousand.  Choice."""
    faint_blunder: float = 3.0
    """Logarithm of the likelihood ratio from which on a blunder is held against the effects that are found: odds of 20,
    "strong" (Kass and Raftery).  Four wrong signs of slip, which friction that lags imitates, had 4.0 to 8.6 where
    9.7 to 12.0 are asked to say them."""
    imitated_rate: float = 1e-2
    """Share of recordings with an effect that looks like a blunder, in which the blunder may be said in its place: one
    in a hundred.  A pulley may take of a weight what a lever that is shorter by a disk would.  Choice: few recordings
    have such an effect."""
    factors_told: int = 25
    """Factors that can be told between two of those by which the weights of a sequence are first multiplied.  Choice:
    from a third to three times a hundred, a fiftieth apart."""
    factor_rounds: int = 3
    """Rounds in which a factor is refined, each four times as close.  Choice, for time: to less than a hundredth."""
    modulus_sd: float = float(np.log(1.5))
    """Of ln E: a handbook's modulus of the right material is right within a half.  Choice."""
    friction_sd: float = float(np.log(3.0))
    """Of ln mu: a handbook's coefficient is right within a factor of three.  Choice."""
    coarse_factors: tuple[float, ...] = (0.6, 1.0, 1.6)
    """Factors on stiffness at which a blunder is tried before constants are fitted.  Choice, for time."""
    blunders_fitted: int = 12
    """Of the most promising blunders, how many are fitted in full.  Choice, for time."""
    blunders_of_a_kind: int = 4
    """Of these, how many of one kind, as exchanged labels are many and much alike.  Choice: of a rig whose pulleys rub
    twelve others were as promising as the right count of its disks, ten of them of two kinds."""
    costly_blunders_fitted: int = 6
    """The same where states follow the load path.  Choice, for time: with 12 they took a fifth of all."""
    costly_blunders_of_a_kind: int = 2
    """Of these, how many of one kind.  Choice, for time."""
    robust_rounds: int = 3
    """Rounds in which the frame of the coarse constants is seen to, readings counting less the further they are off.
    Choice, for time."""
    robust_steps: int = 5
    """Steps of a robust fit at most.  Choice, for time: of 240 remedies of 20 simulated recordings with and without
    blunders the misfits sum to 10,578 after 5 steps, 10,554 after 10 and 10,545 after any number, for 2,179, 3,208 and
    4,877 solutions."""
    widened_from: float = 2.0
    """How many times the stated noise has to be what half of the readings scatter by for a robust fit to begin with
    that in its place: it is blind to what is far off, and ends at whichever valley is near.  Choice: with 1.5 to 5 the
    fits of 24 simulated recordings whose modulus is stated up to four times too large or small are the same."""
    widened_steps: int = 4
    """Steps of such a first fit at most.  Choice, for time: the misfits of these recordings sum to 753 without it, 675
    after 3 steps, 651 after 4 and 646 after 6."""
    strained_sd: float = 4.0
    """Standard deviations of its prior from which on a single marker, or a size that was found before, is remarked
    upon: by chance once in 16,000."""
    frame_rotation: float = 0.05
    """Standard deviation of the camera's rotation where none is stated and a rigid motion removes most of a misfit,
    rad: three degrees.  Choice: a camera that was set up by eye."""
    frame_shift: float = 0.05
    """The same of its origin, as a share of the arm's length.  Choice: a base that is as thick as a plate is long."""
    frame_share: float = 0.75
    """Share of what constants leave beyond noise that counts as most of it.  Choice: of simulated arms whose frame was
    right a motion took at most 0.65 of what missing physics left; of one with its origin 6 mm off it took all."""
    blunder_fall: float = 10.0
    """Fall of the mean square from which on a blunder is said although effects do not explain the rest; and rise of
    that of what explains the recording as it is from which on the mended one is not searched (:func:`is_left_behind`).
    Choice: an order of magnitude."""
    clear_blunder: float = 3.0
    """How many times what has to speak for a blunder the first end of the search with it mended must be ahead for the
    search of the recording as it is to be given up.  Choice, for time: four recordings with exchanged disks, cables or
    units are ahead by 9 to 11 times."""
    most_angle_rad: float = float(np.pi)
    """Largest angle from which on angles may be in degrees: below, the whole arm would turn by three degrees.  Choice:
    half a turn."""
    most_bend_rad: float = 1.0
    """The same of a plate's bend: below, plates would bend by one degree.  Choice."""
    most_blunders: int = 3
    """Blunders that are looked for in one recording.  Choice."""
    most_missed_steps: int = 3
    """Steps set aside and not predicted at most, of which two may be exchanged: more are missed for another reason.
    Choice."""
