"""Location of a mismatch, empirical laws, the next experiment, what is remarked on and shown."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LocationSettings:
    """Where a mismatch is, and what it goes with."""

    alike_plates: float = 2.0
    """Missing moments are alike over so many plates.  Choice."""
    own_share: float = 0.1
    """But for this share of their variance.  Choice."""
    moment_sizes: tuple[float, ...] = (1e-4, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3)
    """Sizes of missing moments that are considered, in shares of the largest cable moment, and of errors of tensions,
    in shares of these: half decades up to a third.  Choice."""
    alike_loads: float = 0.3
    """Of the largest load: missing moments, or errors of tensions, are alike under loads that differ by less.
    Choice."""
    alike_steps: float = 2.0
    """Steps of a sequence over which missing moments are alike.  Choice."""
    field_directions: tuple[int, ...] = (10, 100)
    """How many directions of a field of missing moments stand out of the noise, by its size.  Choice."""
    field_share: float = 0.99
    """Modes of a field are followed up to this share of its variance, along the arm and over the loads each.
    Choice: what is left of a field is a tenth of its deviation."""
    most_field_modes: int = 60
    """But no more of them over the loads.  Choice, for time."""
    near_largest: float = 0.7
    """Laws whose score is at least this share of the largest are said to be what the mismatch goes with.  Choice."""
    loud_sd: float = 3.0
    """A sequence is said to show the mismatch where its mean square is so many sd above one.  Choice."""
    most_places_said: int = 4
    """Places of a mismatch that are said, the strongest.  Choice: a sentence holds no more."""
    most_quantities_said: int = 3
    """Quantities that a mismatch is said to go with, those of the strongest laws.  Choice, as of places."""
    part_sd: float = 0.5
    """A part of the recording tells a constant if it leaves a smaller relative sd than this.  Choice."""
    fewest_readings_of_part: int = 3
    """Readings from which on a part of the recording tells the two constants: one to spare."""
    most_segments_told: int = 8
    """Segments, from the base, whose constants are told.  Choice, for the reader."""


@dataclass(frozen=True)
class LawsSettings:
    """Empirical laws and the next experiment."""

    most_terms: int = 3
    """Terms of an empirical law.  Choice, for the reader."""
    term_share: float = 0.1
    """Scale of a term: the moment that is this share of the largest cable moment.  Choice."""
    farthest_term: float = 30.0
    """Bound of a term in that scale: three times the largest cable moment.  Choice."""
    harder: float = 1.25
    """Proposed programs pull up to so many times the largest recorded tension.  Choice."""
    pull_shares: tuple[float, ...] = (0.25, 0.5, 0.75, 1.0, 0.75, 0.5, 0.25, 0.0)
    """Shares of the largest pull that a proposed program pulls a cable by, step by step: drawn in up to the largest,
    then let out.  Choice: quarters, up and down."""
    held_pull: float = 0.7
    """Share of the largest pull at which one cable is held while another one is drawn in and let go.  Choice: less than
    all, as the two may pull together."""


@dataclass(frozen=True)
class RemarksSettings:
    """What is remarked on, and how much of what was found is shown."""

    neighbouring_reach: float = 10.0
    """Disks below which noise that disks have in common is said to be that of neighbours, else of the whole photograph.
    Choice: between the two `common_reaches`."""
    far_tolerance_sd: float = 3.0
    """Prior standard deviations from which on a part is said to be beyond its tolerance: by chance once in 370."""
    far_factor: float = 3.0
    """Factor off its nominal value, either way, from which on such a constant is remarked on whatever is stated: beyond
    handbook values, as of `friction_sd`.  Choice."""
    far_frame_sd: float = 2.5
    """Standard deviations, as stated, from which on a coordinate of the camera's frame is said to be far from zero: by
    chance once in 80, of three coordinates once in 27.  Choice, after a simulated arm whose uneven rest curvature had
    turned the frame by 2.9: a note on a right frame costs a look at the camera."""
    lone_marker_ratio: float = 3.0
    """How many times as far off as any other marker one is that seems misplaced.  Choice: what bends the arm moves the
    others behind it too."""
    farthest_rim: float = 3.0
    """How many times as far from the axis as any hole the rims of disks may lie before contact of these is doubted.
    Choice: holes mostly lie near the rims."""
    told_presence: float = 0.1
    """Probability from which a kind of effect that is not named is told to be possible.  Choice, for the reader."""
    impossible_rim: float = 30.0
    """How many times as far from the axis as any hole no rim lies: contact of disks that asks for more stands for
    something else, such as play in clamps, and nothing is `explained` by it.  Choice, ten times `farthest_rim`."""
    shown_rise: float = 4.0
    """Profiles are shown up to so many times the rise of chi-square at the ends of an interval.  Choice: twice the
    interval to either side, where chi-square is a parabola."""
    profile_points: int = 101
    """Points of the smooth curve through a profile.  Choice, for the eye."""
