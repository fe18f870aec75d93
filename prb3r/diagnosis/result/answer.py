"""The answer of a diagnosis in a few lines: how sure each effect is, what could stand in its place, what to do."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect
from prb3r.diagnosis.result.proposals import files_of, proposed
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import few, listed


class Exchange(NamedTuple):
    """A set of effects that could stand in the place of the named one, by what sets the two apart."""

    other: tuple[str, ...]
    """Kinds that the other set has and the named one lacks."""
    instead_of: tuple[str, ...]
    """Named kinds that the other set lacks."""
    probability: float
    """Of the other set, among all that stand."""

    @property
    def text(self) -> str:
        """What would change, in words: `a and b instead of c`, or `no c`."""
        given_up = in_words(self.instead_of)
        return f"{in_words(self.other)} instead of {given_up}" if self.other else f"no {given_up}"


def in_words(kinds: Sequence[str]) -> str:
    """Kinds of effects (at least one) as part of a sentence: `clamp compliance and gravity`."""
    return listed([kind.replace("_", " ") for kind in kinds])


def by_sureness(diagnosis: Diagnosis) -> tuple[NamedEffect, ...]:
    """The named effects, the most probable first; in their own order where no set of effects stands."""
    if diagnosis.why:
        return diagnosis.effects
    return tuple(sorted(diagnosis.effects, key=lambda effect: -effect.probability))


def sureness(effect: NamedEffect) -> str:
    """How sure it is that an effect of this kind is there: `in part`, `in doubt` (`NamedEffect.in_doubt`),
    `certain`, or the probability."""
    if effect.partial:
        return "in part"
    if effect.in_doubt:
        return "in doubt"
    return "certain" if effect.certain else f"{100 * effect.probability:.0f} %"


def outweighs_rivals(effect: NamedEffect, settings: Settings) -> bool:
    """Whether an effect is so probable that what is known beforehand decides against the rivals that readings do not
    tell it from."""
    return effect.certain or (not effect.partial and effect.probability > settings.positive_presence)


def exchanges(diagnosis: Diagnosis) -> Iterator[Exchange]:
    """What sets each alternative apart from the named set, the most probable first."""
    named = [effect.kind for effect in by_sureness(diagnosis)]
    for kinds in diagnosis.alternatives:
        stand = diagnosis.posterior.models
        share = sum(model.probability for model in stand if {effect.kind for effect in model.effects} == set(kinds))
        other = tuple(kind for kind in kinds if kind not in named)
        yield Exchange(other, tuple(kind for kind in named if kind not in kinds), share)


def likely_unnamed(diagnosis: Diagnosis) -> list[str]:
    """Kinds of effects that are likelier there than not, over all sets of effects that stand, but are not named; the
    most probable first."""
    return _unnamed(diagnosis, 1 / 2)


def possible_unnamed(diagnosis: Diagnosis) -> list[str]:
    """Kinds of effects that may be there (`Settings.told_presence`) but are not named; the most probable first."""
    return _unnamed(diagnosis, Settings(**diagnosis.settings).told_presence)


def _unnamed(diagnosis: Diagnosis, least: float) -> list[str]:
    """Kinds of effects that are there with a probability above `least`, over all sets of effects that stand, but are
    not named; the most probable first."""
    named, models = {effect.kind for effect in diagnosis.effects}, diagnosis.posterior.models
    share = {
        kind: sum(model.probability for model in models if any(effect.kind == kind for effect in model.effects))
        for kind in dict.fromkeys(effect.kind for model in models for effect in model.effects)
    }
    likely = (kind for kind, p in share.items() if kind not in named and p > least)
    return sorted(likely, key=lambda kind: -share[kind])


def what_to_do(diagnosis: Diagnosis) -> str:
    """What a reader should do next, in a sentence or two; empty where a blunder of the set-up says so itself."""
    if diagnosis.setup:
        return ""
    first = f"Look first whether {diagnosis.rival_blunder.blunder}. " if diagnosis.rival_blunder else ""
    return first + _after_the_setup(diagnosis)


def _after_the_setup(diagnosis: Diagnosis) -> str:
    """What to do next where the set-up is right."""
    if diagnosis.why:
        return _where_unexplained(diagnosis)
    if diagnosis.verdict == "adequate":
        return f"{_simulate(diagnosis, 'calibrated.toml')}; {_where_nothing_is_named(diagnosis)}."
    unjudged, worse = _unjudged(diagnosis), predicted_worse(diagnosis)
    if worse and not unjudged:
        return (
            f"What is named predicts {worse}: believe it once it predicts another recording better, and take nothing "
            "of it to other designs before."
        )
    return " ".join(filter(None, [_where_explained(diagnosis), unjudged]))


def _unjudged(diagnosis: Diagnosis) -> str:
    """A sentence where nothing of what is named acts in what was set aside, which then cannot judge it; else empty."""
    held = diagnosis.heldout
    if held is None or held.felt or not diagnosis.effects:
        return ""
    alone = ", only the constants refitted beside it, with which it is predicted worse" * bool(
        predicted_worse(diagnosis)
    )
    return (
        f"Nothing of what is named acts in {few(held.sequences)}, which no fit has seen and so cannot judge it{alone}: "
        "record another sequence in which it acts, or judge it on another recording (--holdout)."
    )


def _where_explained(diagnosis: Diagnosis) -> str:
    """What to do next where the verdict is `explained` or `ambiguous`."""
    carried = "prb3r predict takes what was learnt to other designs"
    if diagnosis.verdict == "explained":
        unseen = "" if diagnosis.heldout else " Record three sequences or more to confirm it: none was set aside."
        return f"{_simulate(diagnosis, 'explained.toml')}; {carried}.{unseen}"
    weighed = f"{carried} with every set of effects that stands, by its probability"
    programs = files_of(proposed(diagnosis.experiments))
    if telling := [name for name, program in programs.items() if program.resolves]:
        return f"Record the steps of {listed(telling)} and diagnose again. Until then {weighed}."
    doubtful = [effect for effect in diagnosis.effects if not effect.certain or effect.rivals]
    if not doubtful and (unnamed := likely_unnamed(diagnosis)):
        return (
            f"Look at the rig itself for {in_words(unnamed)}, likelier there than not, though no set of effects with "
            f"{'it' if len(unnamed) == 1 else 'them'} is sure. Until then {weighed}."
        )
    if not diagnosis.effects and (possible := possible_unnamed(diagnosis)):
        return (
            f"Look at the rig itself for {in_words(possible)}: some effect is likelier there than none, though which "
            f"these recordings do not tell. Until then {weighed}."
        )
    if not doubtful:
        first = "then" if diagnosis.rival_blunder else "first"
        return f"Look {first} at what the notes doubt. {_simulate(diagnosis, 'explained.toml')}; {weighed}."
    kinds = in_words(list(dict.fromkeys(effect.kind for effect in doubtful)))
    questions = listed(list(dict.fromkeys(_open_question(effect) for effect in doubtful)))
    return (
        f"Look at the rig itself for {kinds}: no load program that was tried tells {questions}. Until then {weighed}."
    )


def _simulate(diagnosis: Diagnosis, file: str) -> str:
    """How to simulate the recorded rig: with `file`, or, where its parts as the recording tells them predict better
    than as drawn, by `prb3r predict`."""
    if diagnosis.heldout is None or not diagnosis.heldout.better_as_made:
        return f"Simulate this rig with {file}"
    return f"Predict this rig by prb3r predict, with its parts as the recording tells them ({file} has them as drawn)"


def predicted_worse(diagnosis: Diagnosis) -> str:
    """What no fit has seen and the named effects predict worse than constants alone do, with the errors that grow, to
    follow "predicts"; empty where there is none.

    All readings count together, each in units of its noise: with an error of `Settings.worse` times that of constants
    alone, and as many times the noise, also with the parts of the rig as the fitted sequences tell them.
    """
    held, least = diagnosis.heldout, Settings(**diagnosis.settings).worse
    together = None if held is None else held.in_noise
    if held is None or together is None or not diagnosis.effects:
        return ""
    if min(together.explained, together.made) <= least * max(together.calibrated, 1.0):
        return ""
    errors = (
        (held.rmse_calibrated_m, held.rmse_explained_m, 1e3, "mm"),
        (held.rmse_calibrated_rad, held.rmse_explained_rad, 180 / np.pi, "degrees"),
    )
    said = [
        f"to {factor * after:.3g} {unit} where constants alone do to {factor * before:.3g}"
        for before, after, factor, unit in errors
        if before is not None and after is not None and after > before
    ]
    return f"{few(held.sequences)}, which no fit has seen, {listed(said)}"


def _where_nothing_is_named(diagnosis: Diagnosis) -> str:
    """What is said of effects where none is named: that none is needed, or which may be there nevertheless."""
    unnamed, settings = likely_unnamed(diagnosis), Settings(**diagnosis.settings)
    some = sum(model.probability for model in diagnosis.posterior.models if model.effects)
    if not unnamed and some > settings.positive_presence and diagnosis.share_of_stated >= 1:
        return f"no effect is sure enough to be added, though some effect is likely there ({100 * some:.0f} %)"
    if not unnamed:
        possible = possible_unnamed(diagnosis)
        ruled = (
            f", though {in_words(possible)} {'is' if len(possible) == 1 else 'are'} not ruled out" if possible else ""
        )
        return f"no effect needs to be added{ruled}"
    return f"no effect is sure enough to be added, though {in_words(unnamed)} may be there, likelier than not"


def _open_question(effect: NamedEffect) -> str:
    """What is left open of an effect, as the object of a sentence: what it could be instead, where it sits, or whether
    it is there."""
    name, rivals = in_words([effect.kind]), list(dict.fromkeys(rival.kind for rival in effect.rivals))
    if others := [kind for kind in rivals if kind != effect.kind]:
        return f"{name} from {in_words(others)}"
    return f"where or in which direction {name} acts" if rivals else f"whether there is {name}"


def _where_unexplained(diagnosis: Diagnosis) -> str:
    """What to do where the verdict is that something is left."""
    first, where = "Settle first why it is unexplained", diagnosis.mismatch
    least = min((check.p for check in diagnosis.checks), default=0.0)
    if diagnosis.structured and least >= Settings(**diagnosis.settings).naming_rate:
        first = "Record the same again, since chance is not seen twice"
    elif diagnosis.structured:
        first = "Read more where the mismatch sits, at loads between the recorded ones and on the way back"
        if len(where.sequences) == 1 and "sequence" in where.depends_on:
            first = (
                f"Leave out sequence {where.sequences[0]}: if the others are explained without it, look for what was "
                f"different there. Else r{first[1:]}"
            )
    return (
        f"{first}, and diagnose again. Until then use no name and no number of this diagnosis elsewhere; prb3r predict "
        "takes from it what predicts best, with bands as wide as what is missed here; other loads may miss by more."
    )
