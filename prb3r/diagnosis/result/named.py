"""All that is found out about an effect that the diagnosis names: intervals, places, rivals, and what it gains."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from prb3r.diagnosis.checks.unseen import Unseen
from prb3r.diagnosis.evidence.model_evidence import bic
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.profile import LikelihoodInterval, Profile, likelihood_interval
from prb3r.diagnosis.library.hypothesis import Hypothesis, place_text
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.numbers import SurvivingModel
from prb3r.diagnosis.result.spread import ends_over_models, held_share, number_of_share
from prb3r.diagnosis.result.statements import Estimate, sentence
from prb3r.diagnosis.search.apply import Apply
from prb3r.diagnosis.search.exchange import without_effect
from prb3r.diagnosis.search.experiment import best_experiments
from prb3r.diagnosis.search.rivals import Rival, rivals
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.search.selection import Choice


@dataclass(frozen=True, eq=False)
class Named:
    """An effect that the diagnosis names, with the fits that were made for it."""

    hypothesis: Hypothesis
    parameters: Mapping[str, Estimate]
    """The fitted parameters by name, in SI units."""
    places: Mapping[str, tuple[Any, tuple[Any, ...]]]
    """For each part of the place, the best value and all values that cannot be told from it, itself included."""
    statement: str
    """What the effect means, in words."""
    rivals: tuple[Rival, ...]
    """Effects that cannot be told from this one, but for the same effect at one of the `places` or in other `forms`."""
    forms: tuple[Rival, ...]
    """The same effect in other forms, such as another law of the plates, that cannot be told from the named one."""
    delta_bic: float
    """Bayesian information criterion with the effect less that without; negative: better with it.  NaN if there is no
    fit without."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that the effect removes; None where nothing is held out
    or there is no fit without the effect."""
    partial: bool
    """Whether the effect helps without the model explaining all."""
    profiles: Mapping[str, Profile]
    """Profiles of the parameters that have one, by name."""
    without: Fit | None
    """The model without the effect, refitted; None if the fit fails."""


def intervals_of(fitted: Fit, effects: Sequence[int], apply: Apply) -> dict[int, LikelihoodInterval]:
    """95 % intervals of all parameters of the `effects` (from 0) of a fit, by the number of the parameter.

    None of a fit whose chi-square is far from one a degree of freedom, unless its predictions are slow.
    """
    model = fitted.model
    if not (fitted.costly or fitted.reduced < model.settings.far_from_one):
        return {}
    numbers = [k for effect in effects for k in range(model.spans[effect].start, model.spans[effect].stop)]
    found = apply(_interval, [(fitted, number) for number in numbers])
    return dict(zip(numbers, found, strict=True))


def _interval(task: tuple[Fit, int]) -> LikelihoodInterval:
    return likelihood_interval(*task)


def named_effect(
    choice: Choice,
    number: int,
    search: Search,
    fresh: Unseen | None,
    reported: Fit,
    intervals: Mapping[int, LikelihoodInterval],
    *,
    partial: bool,
) -> Named:
    """The effect at `number`, from 0, of the chosen model, with its intervals, rivals and gains.

    Parameters
    ----------
    fresh : the sequences set aside, if any were; where the chosen model predicts them, rivals have to do so too.
    reported : the chosen model with the parameters that are reported.
    intervals : of these parameters, as of :func:`intervals_of`; those that are not there have none.
    partial : whether the model leaves something unexplained.
    """
    fitted = choice.fitted
    hypothesis = fitted.model.hypotheses[number]
    near = [
        rival
        for rival in rivals(choice, number, search)
        if rival.indistinguishable and not rival.hypothesis.generalises(hypothesis)
    ]
    if fresh and not partial and not fresh.refutes(fitted):
        near = [rival for rival in near if not fresh.refutes(rival.fitted)]
    special = [rival.hypothesis for rival in near]  # of two forms of one effect the special one says it all
    near = [rival for rival in near if not any(rival.hypothesis.generalises(other) for other in special)]
    elsewhere = [rival for rival in near if _same_but_place(rival.hypothesis, hypothesis)]
    forms = [rival for rival in near if rival not in elsewhere and rival.hypothesis.in_another_form(hypothesis)]
    places = _places(hypothesis, [*(rival.hypothesis for rival in elsewhere), *_in_its_place(choice, hypothesis)])
    parameters, profiles = _estimates(replace(choice, fitted=reported), number, intervals)
    simpler = without_effect(fitted, number)
    statement = sentence(reported, number, parameters)
    for key, (value, among) in places.items():
        if others := [place_text(other) for other in among if other != value]:
            one = key.removesuffix("s") if isinstance(value, tuple) and len(value) == 1 else key
            statement += f" These recordings cannot tell {one} {place_text(value)} from {', '.join(others)}."
    return Named(
        hypothesis=hypothesis,
        parameters=parameters,
        places=places,
        statement=statement,
        rivals=tuple(rival for rival in near if rival not in (*elsewhere, *forms)),
        forms=tuple(forms),
        delta_bic=float(bic(fitted) - bic(simpler)) if simpler is not None else float("nan"),
        heldout_gain=fresh.errors(simpler, fitted).gain if fresh and simpler else None,
        partial=partial,
        profiles=profiles,
        without=simpler,
    )


def is_felt(fitted: Fit, number: int) -> bool:
    """Whether the effect at `number` of a fit moves any reading by more than its standard deviation."""
    others = [effect for k, effect in enumerate(fitted.effects) if k != number]
    moved = fitted.solved.readings - fitted.model.predict(fitted.constants, others)
    return not bool((np.abs(moved) <= fitted.model.noise.total_sd).all())


def _same_but_place(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether two hypotheses are on the same kind of effect with the same law, at places of the same sort."""
    a, b = dict(first.place), dict(second.place)
    return first.kind == second.kind and a.keys() == b.keys() and a.get("law") == b.get("law")


def _in_its_place(choice: Choice, hypothesis: Hypothesis) -> list[Hypothesis]:
    """Hypotheses on the same kind of effect at other places that stand in surviving sets without a chosen one, with a
    probability of `Settings.alike_rate` or more.

    Two effects may be exchanged for two others though none of them can be alone, as the offsets of two cables can for
    those of the two opposite ones.
    """
    probability = dict[Hypothesis, float]()
    for survivor in choice.survivors:
        for other in survivor.effects - choice.effects if hypothesis not in survivor.effects else ():
            if _same_but_place(other, hypothesis):
                probability[other] = probability.get(other, 0.0) + survivor.probability
    return [other for other, share in probability.items() if share >= choice.fitted.model.settings.alike_rate]


def _places(hypothesis: Hypothesis, elsewhere: list[Hypothesis]) -> dict[str, tuple[Any, tuple[Any, ...]]]:
    """For each part of a hypothesis' place but its law, the value, and, sorted, all values that it has here and
    `elsewhere`."""
    places = {}
    for key, value in hypothesis.place:
        if key != "law":
            values = {value, *(dict(other.place)[key] for other in elsewhere)}
            places[key] = (value, tuple(sorted(values, key=str if isinstance(value, str) else None)))
    return places


def _estimates(
    choice: Choice, number: int, intervals: Mapping[int, LikelihoodInterval]
) -> tuple[dict[str, Estimate], dict[str, Profile]]:
    """Estimates of the parameters of the effect at `number` of the chosen model, and their profiles.

    The `intervals` (:func:`intervals_of`) are widened to what the other surviving models with that effect say of it.
    """
    fitted = choice.fitted
    model, hypothesis = fitted.model, fitted.model.hypotheses[number]
    friction = model.friction(fitted.p)
    estimates, profiles = {}, {}
    for part, free in enumerate(hypothesis.free):
        k = model.spans[number].start + part
        estimates[free.name] = Estimate(free.value(fitted.p[k], friction))
        if k not in intervals:
            continue
        low, high, curve = intervals[k]
        if curve is not None:
            profiles[free.name] = curve
        where, held = number_of_share(hypothesis, part), held_share(hypothesis, part)
        ends = ends_over_models(choice, k, where, (low, high), held)
        low, high = sorted(free.value(end, friction) for end in ends)
        estimates[free.name] = Estimate(estimates[free.name].value, low, high, free.open_ends(low, high))
    return estimates, profiles


def separations(choice: Choice, named: Sequence[Named]) -> tuple[Separation, ...]:
    """The load programs that best tell the chosen model from its rivals: every named effect from each of its rivals
    that fit best, at most `Settings.most_rivals`, then the chosen set of effects from each other surviving set."""
    out: list[Separation] = []
    for effect in named:
        near = effect.rivals[: choice.fitted.model.settings.most_rivals]
        best = best_experiments(choice.fitted, [rival.fitted for rival in near]) if near else []
        pairs = zip(near, best, strict=True)
        out += [Separation(effect.hypothesis.name, rival.hypothesis.name, program) for rival, program in pairs]
    return (*out, *_separations_of_sets(choice, named))


def _separations_of_sets(choice: Choice, named: Sequence[Named]) -> Iterator[Separation]:
    """The load programs that best tell the chosen set of effects from each set that could stand in its place.

    Sets of kinds count that survive without a chosen kind, unless such a set is the chosen one with a single rival in
    it; at most `Settings.most_rivals`.
    """
    chosen, most = frozenset(choice.fitted.model.hypotheses), choice.fitted.model.settings.most_rivals
    exchanged = {
        choice.kinds - {effect.hypothesis.kind} | {rival.hypothesis.kind} for effect in named for rival in effect.rivals
    }
    sets = [kinds for kinds in choice.alternatives if kinds not in exchanged][:most]
    others = [next(survivor for survivor in choice.survivors if survivor.kinds == kinds) for kinds in sets]
    best = best_experiments(choice.fitted, [other.fitted for other in others]) if others else []
    for other, program in zip(others, best, strict=True):
        yield Separation(_together(chosen - other.effects), _together(other.effects - chosen), program)


def _together(effects: frozenset[Hypothesis]) -> str:
    """Names of effects that stand together, joined by "with"; `constants alone` where there are none."""
    return " with ".join(sorted(hypothesis.name for hypothesis in effects)) or "constants alone"


def surviving(choice: Choice, fresh: Unseen | None) -> tuple[SurvivingModel, ...]:
    """The surviving models, most probable first, at most `Settings.most_models`.

    All are held against the noise of the chosen one.  Their held-out scores are None where nothing was set aside
    (`fresh` is None).
    """
    models = []
    for survivor in choice.survivors[: choice.fitted.model.settings.most_models]:
        names = tuple(sorted(hypothesis.name for hypothesis in survivor.effects))
        fitted = (
            choice.fitted if survivor.effects == choice.effects else _under_noise_of(choice.fitted, survivor.fitted)
        )
        score = fresh.log_score(fitted) if fresh else None
        models.append(SurvivingModel(survivor.probability, names, fitted.reduced, score))
    return tuple(models)


def _under_noise_of(chosen: Fit, other: Fit) -> Fit:
    """Another fit at its own parameters, with residuals in units of the noise of the `chosen` one: a survivor under a
    coarser likelihood was fitted under more."""
    model = replace(other.model, noise=chosen.model.noise)
    return replace(other, model=model, residual=model.residuals(other.p, other.solved))
