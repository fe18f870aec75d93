"""A design with what a diagnosis teaches: the constants and effects of a rig that the recording leaves possible, as far
as they carry over to the design's file."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

from prb3r.diagnosis.library.suspect import effect_in_words
from prb3r.diagnosis.result.carried_constants import carried_constants, constants_left_behind
from prb3r.diagnosis.result.posterior import Drawn, Posterior
from prb3r.diagnosis.result.same_rig import same_geometry
from prb3r.diagnosis.result.starting_anew import starting_anew
from prb3r.diagnosis.result.tell import adjusted
from prb3r.diagnosis.result.transfer import carried_effects, nominal_left_behind, supposed, without_found
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed
from prb3r.model.effects.base import Effect
from prb3r.model.effects.friction import PulleyFriction
from prb3r.model.effects.plates import PlateRelaxation
from prb3r.model.manipulator import Manipulator
from prb3r.model.step_checks import TIME
from prb3r.quantities import duration


class Learnt(NamedTuple):
    """A design with the constants and effects of one rig."""

    manipulator: Manipulator
    left_behind: tuple[str, ...]
    """Effects and constants that do not carry over, each with its reason."""


_PULLEYS = (
    "the loss of all pulleys or sheaths carries over: take pulley_friction out of the file where this rig has others"
)
"""What is said of a design that is another rig than the recorded one."""


@dataclass(frozen=True)
class LearntDesign:
    """A design to which what is known of a recorded rig is carried over."""

    known: Posterior
    """After the recording."""
    given: Manipulator
    """As the design's file describes it."""
    same_bench: bool = True
    """Whether it stands on the bench of the recording, mounted alike: then what belongs to the set-up carries over."""
    another_copy: bool = False
    """Whether it is another rig even if its file describes the recorded one."""
    made_alike: bool = False
    """Whether, as another rig, it has the rest curvature that all plates of the recorded rig have."""
    timed: bool = True
    """Whether the loads have times; else friction that goes by the rate is taken as it is at its reference rate."""

    @cached_property
    def posterior(self) -> Posterior:
        """The posterior that predictions rest on."""
        return self.known.resting(self.recorded, self.same_bench)

    @cached_property
    def bare(self) -> Manipulator:
        """The design on the elastica plate model, without those of its effects that its file has from the diagnosis."""
        elastica = self.given.model_copy(update={"model": "elastica"})
        plain = elastica.model_copy(update={"effect": []})
        found, _ = self._carried(self.posterior.named.effects, plain)
        return without_found(found, elastica)

    @cached_property
    def recorded(self) -> bool:
        """Whether it is the recorded rig."""
        return not self.another_copy and same_geometry(self.known.manipulator, self.given)

    def of(self, drawn: Drawn) -> Learnt:
        """The design with the constants and effects of a rig, as far as they carry over."""
        here, there = self.posterior.manipulator, self.bare
        felt = [effect for effect in drawn.effects if self.timed or not effect.needs_times]
        effects, left = self._carried(felt, there)
        left = (*left, *nominal_left_behind(here, there), *constants_left_behind(here, there, felt))
        constants = carried_constants(drawn.constants, here, there, felt, another_copy=self.another_copy)
        return Learnt(adjusted(there, constants, effects), left)

    def _carried(self, effects: Iterable[Effect], there: Manipulator) -> tuple[tuple[Effect, ...], tuple[str, ...]]:
        """The `effects` as they act on the design `there`, and the reasons for those that are left behind."""
        return carried_effects(
            effects,
            self.posterior.manipulator,
            there,
            same_bench=self.same_bench,
            another_copy=self.another_copy,
            made_alike=self.made_alike,
        )

    @property
    def named(self) -> Learnt:
        """The design with the effects that the diagnosis names, and all that models leave behind: what others than the
        named one do with its probability over all models, where that is `Settings.alike_rate` or more."""
        learnt, shares = self.of(self.posterior.named), dict[str, float]()
        for probability, rig in self.posterior.centres:
            for reason in set(self.of(rig).left_behind).difference(learnt.left_behind):
                shares[reason] = shares.get(reason, 0.0) + probability
        ranked = sorted(shares.items(), key=lambda each: (-each[1], each[0]))
        others = (f"{reason} (probability {share:.2f})" for reason, share in ranked if share >= Settings.alike_rate)
        return learnt._replace(left_behind=(*dict.fromkeys(learnt.left_behind), *others))

    @property
    def remarks(self) -> list[str]:
        """What is supposed of the design and of its loads, a sentence each."""
        effects = self.of(self.posterior.named).manipulator.effect
        remarks = [*supposed(effects), *starting_anew(effects)]
        learnt = self.posterior.named.effects
        if not self.recorded and any(isinstance(each, PulleyFriction) and each.cables is None for each in learnt):
            remarks.append(_PULLEYS)
        if not self.timed and any(effect.needs_times for model in self.posterior.models for effect in model.effects):
            said = f"loads have no {TIME} here: friction that goes by the rate is taken as it is at its reference rate"
            remarks.insert(0, said)
        if not self.timed and any(_in_seconds(effect) for model in self.posterior.models for effect in model.effects):
            remarks.insert(0, f"loads have no {TIME} here: plates creep as if each step took a recorded one")
        found = any(model.named and model.effects for model in self.known.models)
        if found and self.posterior.rests_on_constants:
            where = "" if self.recorded else ", or not without what stays behind"
            whose = " of the recorded rig's file" if self.posterior.rests_on_the_file else ""
            remarks.insert(0, f"constants alone{whose} are taken: the effects found do not predict better{where}")
        if again := [effect_in_words(effect) for effect in self.given.effect if effect not in self.bare.effect]:
            remarks.insert(0, f"the design's file has {listed(again)} from this diagnosis already, which counts once")
        return remarks

    def at_pace(self, pace: float | None) -> list[str]:
        """A remark where steps, which follow each other at intervals of `pace`, s, do so far faster or more slowly than
        those of the recording, and what carries over goes by the time; else none."""
        seen = self.known.pace_s
        if not pace or not seen or max(pace / seen, seen / pace) <= Settings.pace_apart:
            return []
        felt = [effect for _, rig in self.posterior.centres for effect in self.of(rig).manipulator.effect]
        kinds = [*dict.fromkeys(effect_in_words(effect) for effect in felt if effect.goes_by_time)]
        if not kinds:
            return []
        return [
            f"by {TIME} it takes {duration(pace)} from one step to the next here (median), and took {duration(seen)} "
            f"in the recording: {listed(kinds)} at such a pace was not seen; is either in another unit than seconds?"
        ]


def on_benches(design: LearntDesign, same_bench: bool | None) -> tuple[LearntDesign, ...]:
    """The design on the bench of the recording or on another one, as is said; where nobody says it (None), on the
    former, which is usual, then on the latter, if the two differ."""
    on_bench, elsewhere = (replace(design, same_bench=same) for same in (True, False))
    if same_bench is not None:
        return (on_bench if same_bench else elsewhere,)
    return (on_bench, elsewhere) if _more_of(on_bench, elsewhere) else (on_bench,)


def made_as(benches: tuple[LearntDesign, ...]) -> tuple[LearntDesign, ...]:
    """The designs of :func:`on_benches`, and where all plates of the recorded rig are bent at rest, each of them twice:
    as another rig whose plates are straight, which is what is taken first, and as one whose plates are bent alike.
    Nobody knows which, as plates of one coil are bent alike, and those that a workshop bent are not."""
    straight, alike = benches[0], replace(benches[0], made_alike=True)
    if not _more_of(alike, straight):
        return benches
    return tuple(replace(design, made_alike=bent) for design in benches for bent in (False, True))


def said_of_making(designs: tuple[LearntDesign, ...], half: str = "") -> list[str]:
    """A remark where the `designs` are of both makes, as of :func:`made_as`; `half` says what is of the other one, if
    anything."""
    if not any(design.made_alike for design in designs):
        return []
    kinds = listed(_more_of(*(next(d for d in designs if d.made_alike == alike) for alike in (True, False))))
    other = f"; {half} with it" if half else ""
    return [
        f"the design is taken to be without the {kinds} of all plates of the recorded rig, which those of one coil may "
        f"share{other}: state what it has in its file"
    ]


def said_of_benches(designs: tuple[LearntDesign, ...], half: str = "") -> list[str]:
    """A remark where the `designs` are on both benches, as nobody says on which; `half` says what is for the other one,
    if anything."""
    if len(designs) == 1:
        return []
    other = f"; {half} for another one" if half else ""
    return [
        "the design is taken to stand on the bench of the recording, mounted alike, with "
        f"{listed(_more_of(*designs))}{other}: say --same-bench or --other-bench"
    ]


def _more_of(first: LearntDesign, other: LearntDesign) -> tuple[str, ...]:
    """In words the effects that a design has in the first of two situations alone, as on the bench of the recording:
    those of the named model, and of others those with a probability of `Settings.alike_rate` or more over all of
    them."""
    shares = dict[str, float]()
    for probability, rig in ((1.0, first.posterior.named), *first.posterior.centres):
        here, rest = (where.of(rig).manipulator.effect for where in (first, other))
        for kind in dict.fromkeys(effect_in_words(effect) for effect in here if effect not in rest):
            shares[kind] = shares.get(kind, 0.0) + probability
    return tuple(kind for kind, share in shares.items() if share >= Settings.alike_rate)


def _in_seconds(effect: Effect) -> bool:
    """Whether plates creep with a time constant in seconds."""
    return isinstance(effect, PlateRelaxation) and effect.step_s is not None
