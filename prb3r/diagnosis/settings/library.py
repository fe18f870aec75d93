"""Which effects are suspected of a recording at all, and how common they are."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LibrarySettings:
    """Which effects are suspected of a recording at all, and how common they are.

    How large an effect may be stands beside it in `prb3r.diagnosis.library`, with the reason.
    """

    usual_presence: float = 0.1
    """Prior probability that a rig has an effect of a kind, at any place.  Choice: of some twenty kinds two."""
    rare_presence: float = 0.03
    """The same of what few rigs have, and whoever built one knows of; and of a law that no effect of the library has.
    Choice: of thirty rigs one."""
    rubbing_presence: float = 0.3
    """The same of cables that rub other than the file says.  Choice: nearly every rig has friction."""
    weighing_presence: float = 0.3
    """The same of gravity in the plane.  Choice: every arm weighs something, and not all lie flat."""
    dissipating_presence: float = 0.05
    """The same of plates that dissipate as they bend to and fro.  Choice: those of spring steel, as most are, do
    not."""
    flag_presence: float = 0.3
    """The same of flag-shaped loops, of plates with a modulus of superelastic materials that are bent back.  Choice:
    where such plates soften they have them."""
    side_share: float = 0.1
    """Share of the largest bend from which on plates count as bent to a side, or as bent back.  Choice: below, a law of
    that side, or a loop, is not felt."""
    fewest_to_tell_time: int = 3
    """Sequences from which on what goes with time is told from what goes with the load: two may be two cables, each
    with its zero."""
    closing_range: tuple[float, float] = (0.5, 2.0)
    """Least and largest bend at which notches close, over the one that geometry gives.  Choice: rounded edges, burrs
    and a tendon off the wall make a factor of two at most."""
    stiffest_superelastic_pa: float = 1e11
    """Young's modulus below which plates may be superelastic, Pa: nitinol has 28 (martensite) to 83 GPa (austenite),
    copper and titanium alloys that transform some 60 to 90; steels, which yield at such strains, have 180 and more."""
    plateau_strains_tried: tuple[float, ...] = (0.006, 0.008, 0.011)
    """Strains at which a plateau is supposed to begin where its fit does: low, in the middle and high in what nitinol
    shows (`prb3r.diagnosis.library.sections.PLATEAU`)."""
    presliding_tried_m: tuple[float, ...] = (3e-5, 3e-4)
    """Presliding travels at which slip along the load path is tried, m: the first is what manipulator files have unless
    they say more, the second that of a cable ten times as soft in its holes."""
    rates_apart: float = 3.0
    """How many times as fast as the slowest the fastest tension must have changed, for friction to show by which it
    goes.  Choice: with a logarithm of 1.1, a rate of 0.1 is a tenth of the friction."""
    travels_apart: float = 3.0
    """How many times as far as the least the farthest cable must have slipped one way, for static friction to show
    apart from the kinetic one.  Choice: where the least slip leaves half of an excess, the farthest leaves an
    eighth."""
