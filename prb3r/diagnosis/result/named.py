"""Everything that is found out of an effect that the diagnosis names."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from prb3r.diagnosis.checks.heldout import Unseen
from prb3r.diagnosis.evidence.model_evidence import bic
from prb3r.diagnosis.fit.profile import Profile, linear_interval, profile
from prb3r.diagnosis.library.hypothesis import Hypothesis, place_text
from prb3r.diagnosis.result.effects import Separation
from prb3r.diagnosis.result.numbers import SurvivingModel
from prb3r.diagnosis.result.spread import ends_over_models, number_of_share
from prb3r.diagnosis.result.statements import Estimate, sentence
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
    places: Mapping[str, tuple[Any, tuple[Any, ...]]]
    """Where: the best place, and all that cannot be told from it."""
    statement: str
    rivals: tuple[Rival, ...]
    """Effects of another kind that cannot be told apart."""
    delta_bic: float
    """Negative: better with the effect than without."""
    heldout_gain: float | None
    """Share of the excess squared error on held-out sequences that this effect removes."""
    partial: bool
    profiles: Mapping[str, Profile]


def named_effect(choice: Choice, number: int, search: Search, fresh: Unseen | None, *, partial: bool) -> Named:
    """All about the chosen effect `number`; `fresh` are the sequences set aside, if any were."""
    fitted = choice.fitted
    hypothesis = fitted.model.hypotheses[number]
    near = [rival for rival in rivals(choice, number, search) if rival.indistinguishable]
    if fresh and not partial and not fresh.refutes(fitted):
        near = [rival for rival in near if not fresh.refutes(rival.fitted)]
    elsewhere = [rival for rival in near if _same_but_place(rival.hypothesis, hypothesis)]
    places = _places(hypothesis, [rival.hypothesis for rival in elsewhere])
    parameters, profiles = _estimates(choice, number, sure=not partial)
    simpler = without_effect(fitted, number)
    statement = sentence(hypothesis, parameters, fitted.model.friction(fitted.p))
    for key, (value, among) in places.items():
        if others := [place_text(other) for other in among if other != value]:
            statement += f" These recordings cannot tell {key} {place_text(value)} from {key} {', '.join(others)}."
    return Named(
        hypothesis=hypothesis,
        parameters=parameters,
        places=places,
        statement=statement,
        rivals=tuple(rival for rival in near if rival not in elsewhere),
        delta_bic=float(bic(fitted) - bic(simpler)) if simpler is not None else float("nan"),
        heldout_gain=fresh.judge(simpler, fitted).gain if fresh and simpler else None,
        partial=partial,
        profiles=profiles,
    )


def _same_but_place(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether two hypotheses are the same effect at two places."""
    a, b = dict(first.place), dict(second.place)
    return first.kind == second.kind and a.keys() == b.keys() and a.get("law") == b.get("law")


def _places(hypothesis: Hypothesis, elsewhere: list[Hypothesis]) -> dict[str, tuple[Any, tuple[Any, ...]]]:
    """The place of a hypothesis and, sorted, those of the same effect `elsewhere`; a law is no place."""
    places = {}
    for key, value in hypothesis.place:
        if key != "law":
            values = {value, *(dict(other.place)[key] for other in elsewhere)}
            places[key] = (value, tuple(sorted(values, key=str if isinstance(value, str) else None)))
    return places


def _estimates(choice: Choice, number: int, *, sure: bool) -> tuple[dict[str, Estimate], dict[str, Profile]]:
    """The parameters of the chosen effect `number` and, where it is `sure` enough for intervals, their profiles.

    Intervals hold what the other surviving models with that effect say of it.  Where a prediction is slow those of the
    chosen model are linearised, without profiles, unless chi-square at their ends shows that this is wrong.
    """
    fitted = choice.fitted
    model, hypothesis = fitted.model, fitted.model.hypotheses[number]
    friction, deserved = model.friction(fitted.p), fitted.reduced < model.settings.far_from_one
    estimates, profiles = {}, {}
    for part, free in enumerate(hypothesis.free):
        k = model.spans[number].start + part
        estimates[free.name] = Estimate(free.value(fitted.p[k], friction))
        if not sure or not (deserved or fitted.costly):
            continue
        ends = linear_interval(fitted, k) if fitted.costly else None
        if ends is None:
            curve = profiles[free.name] = profile(fitted, k)
            ends = curve.low, curve.high
        ends = ends_over_models(choice, k, number_of_share(hypothesis, part), ends)
        low, high = sorted(free.value(end, friction) for end in ends)
        estimates[free.name] = Estimate(estimates[free.name].value, low, high, free.open_ends(low, high))
    return estimates, profiles


def separations(choice: Choice, named: Sequence[Named]) -> tuple[Separation, ...]:
    """The load programs that tell apart best every named effect from each of the rivals that fit best, at most
    `Settings.most_rivals`, and what is chosen from the sets of effects that could stand in its place."""
    out: list[Separation] = []
    for effect in named:
        near = effect.rivals[: choice.fitted.model.settings.most_rivals]
        best = best_experiments(choice.fitted, [rival.fitted for rival in near]) if near else []
        pairs = zip(near, best, strict=True)
        out += [Separation(effect.hypothesis.name, rival.hypothesis.name, program) for rival, program in pairs]
    return (*out, *_separations_of_sets(choice, named))


def _separations_of_sets(choice: Choice, named: Sequence[Named]) -> Iterator[Separation]:
    """The same of sets of effects that survive beside the chosen one and are not that with a rival in it."""
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
    """Names of effects that stand together, or that there are none."""
    return " with ".join(sorted(hypothesis.name for hypothesis in effects)) or "constants alone"


def surviving(choice: Choice, fresh: Unseen | None) -> tuple[SurvivingModel, ...]:
    """The models that the recording leaves standing, most probable first."""
    return tuple(
        SurvivingModel(
            survivor.probability,
            tuple(sorted(hypothesis.name for hypothesis in survivor.effects)),
            survivor.fitted.reduced,
            fresh.log_score(survivor.fitted) if fresh else None,
        )
        for survivor in choice.survivors[: choice.fitted.model.settings.most_models]
    )
