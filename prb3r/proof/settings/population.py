"""What is asked of a run: how many recordings of which class, and how the label of each is drawn."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Population:
    """Recordings and designs of a run."""

    full: int = 1260
    """Recordings of a full run: intervals of two to six per cent."""
    bench: int = 1200
    """Recordings of bench rigs without imperfections that the numbers of designs below are for."""
    shares: Mapping[str, int] = field(
        default_factory=lambda: {
            "clean": 220,
            "single": 200,
            "pair": 40,
            "foreign": 42,
            "deleted": 22,
            "decoy": 22,
            "confusable": 30,
            "hidden": 32,
            "several": 300,
            "imperfect-single": 60,
            "imperfect-clean": 182,
            "blunder": 50,
            "rare": 60,
        }
    )
    """Recordings of each class in a full run: a rate of 1 % needs 400 (Wilson: 0.4 to 2.5 %), and twenty-one kinds at
    three sizes give twenty a kind."""
    multiples: tuple[float, ...] = (1.0, 2.0, 5.0)
    """Sizes of single effects, in smallest detectable ones: at the edge, plain, and where numbers are scored."""
    pair_multiple: float = 5.0
    """Of each effect of a pair, and of confusable ones: what is not told apart is not for lack of size."""
    history_share: float = 0.03
    """Of clean and single recordings, those with friction along the load path: few, for their cost."""
    plain_designs: int = 24
    """In a full run, fewer in proportion in a smaller one: fifty recordings a design."""
    fewest_plain: int = 4
    """Of them, in the smallest run.  A choice."""
    special_designs: int = 4
    """Of those that load only and of poor ones, each."""
    fewest_special: int = 1
    """Of either, in the smallest run.  A choice."""
    history_designs: int = 2
    """Designs with friction along the load path: few, for their cost."""
    history_from: int = 300
    """Cases from which on there are designs with friction along the path."""
    awkward_every: int = 2
    """One of so many clean recordings is awkward."""
    cancelling_every: int = 2
    """One of so many pairs is asked to cancel in part."""
    frame_decoy_every: int = 4
    """One of so many decoys is an awkward frame; the others are wrong weights."""
    twin_every: int = 5
    """One of so many confusable recordings is a law that another kind may be the same as; the others any kind."""
    hidden_kinds: tuple[str, ...] = ("pulley_friction", "tension_offset", "", "worn_hole", "hole_offset")
    """Asked for in turn where calibration is to hide the effect, empty for any: with loading only, these are what E and
    mu imitate."""


@dataclass(frozen=True)
class Labels:
    """How labels are drawn on a design."""

    tries: int = 5
    """For an effect that is far from all others: the best of five raises the share that is distinguishable at twice the
    detectable size from 60 to 74 % (measured 2026-11-22)."""
    far_enough: float = 1.2
    """Times `apart`, from which on no better draw is sought: refits bring rivals nearer."""
    deleted_multiples: tuple[float, ...] = (5.0, 5.0, 8.0, 8.0, 12.0, 12.0, 20.0, 20.0)
    """Sizes at which an effect that is taken out of the library is tried until it is far outside what is left."""
    pair_tries: int = 10
    """Pairs that are drawn for one that keeps its norms.  A choice, for cost."""
    pair_least: float = 2.0
    """Norm, in detectable ones, that each of a pair keeps once the other is refitted."""
    cancelling: float = 0.4
    """Cosine of opposite changes from which on a pair cancels enough to be taken at once."""
    wrong_weights: tuple[float, ...] = (0.5, 0.75, 1.25, 1.5)
    """Factors on one noted weight: one weight of a stack left out, or put on twice."""
    wrong_weight_tries: int = 25
    """Weights and factors that are drawn for one that shows.  A choice, for cost."""
    wrong_weight_least: float = 3.0
    """Norm that a wrong weight has, in detectable ones."""
    confusable_tries: int = 20
    """Effects that are drawn for one with a rival as near.  A choice, for cost."""
    confusable_near: float = 4.0
    """Times `same`, within which the linear rule may see a rival for a refit to be worth its cost."""
    hidden_tries: int = 30
    """Half of them with the kind asked for, the others with any."""
    hidden_multiples: tuple[float, ...] = (5.0, 3.0, 2.0)
    """Sizes tried in turn: the larger, the plainer what unloading shows."""
    hidden_excess: float = 1.6
    """Standard deviations of chi-square, sqrt(2 r) of r readings, up to which loading alone counts as fitted well:
    p > 0.05."""
    misled: tuple[float, float] = (0.01, 0.05)
    """Changes of ln E and ln mu from which on calibration counts as misled: a choice, what a
    designer would notice."""


@dataclass(frozen=True)
class Foreign:
    """How physics outside the library is drawn."""

    target: tuple[float, float] = (1.2, 4.0)
    """Squared distance asked for, in those far outside: near enough to be mistaken."""
    first_share: float = 0.03
    """Of a law's largest size, tried first."""
    first_dead_zone: tuple[float, float] = (0.25, 0.6)
    """Share tried first of a law that comes in jumps."""
    tries: int = 6
    """Sizes that are tried for one at about the distance asked for.  A choice, for cost."""
    accepted: tuple[float, float] = (1.0, 6.0)
    """Ratio to the distance asked for at which a size is taken."""
    too_near: float = 100.0
    """By which ln of the ratio counts more below one than above: a law that is too near is the last choice."""
    aim: float = 2.0
    """Times the distance asked for, at which the next size aims: the distance grows with the square of the size at
    first, and less than that later."""
    change: tuple[float, float] = (0.4, 4.0)
    """Least and largest factor from one size to the next."""
    reversed_half: float = 0.5
    """Share of laws with two signs that act the other way."""
    largest_friction_growth: float = 1.5
    """Largest size of each law, all chosen so that rigs mostly keep their equilibria.  Here: of the coefficient,
    relative, at the largest tension."""
    largest_creep: float = 0.2
    """ln of stiffness lost per ln of steps under load."""
    largest_waves: float = 0.7
    """ln of stiffness from the middle to a crest."""
    half_waves: int = 3
    """Half waves of it along the arm: stiffness rises and falls one and a half times.  A choice."""
    largest_yielding: float = 0.5
    """Rest curvature of the plate that has yielded, in those of the largest bend on `prototype_arc_m`."""
    largest_dead_zone: float = 0.9
    """Part of the largest tension below which a clutch lets its cable go."""
    largest_saturation: float = 0.4
    """Part of the largest tension that is lost there."""
    largest_leak: float = 0.3
    """Part of each other cable's tension that one drags along."""
    largest_knock: float = 6.0
    """Standard deviations of the frame by which a camera is knocked."""
    yield_from: float = 0.6
    """Part of the largest bend from which on a plate yields."""
    prototype_arc_m: float = 0.014
    """Flexible length of the prototype's plates: 30 mm less two clamps of 8 mm."""
    knock_phase: float = 2.3
    """rad by which the phase of a camera's knocks goes on from sequence to sequence: no simple part of a turn, so that
    sequences are not knocked alike."""
