"""Everything that is said of an effect that the diagnosis names."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from prb3r.diagnosis.checks.heldout import Unseen
from prb3r.diagnosis.evidence.model_evidence import bic
from prb3r.diagnosis.fit.profile import Profile, profile
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.statements import Estimate, sentence
from prb3r.diagnosis.search.full_fits import without_effect
from prb3r.diagnosis.search.rivals import Rival, rivals
from prb3r.diagnosis.search.selection import Choice, Search
from prb3r.model.effects.base import Effect


@dataclass(frozen=True, eq=False)
class Named:
    """An effect that the diagnosis names."""

    hypothesis: Hypothesis
    effect: Effect
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
    """Everything that is said of one chosen effect."""
    fitted = choice.fitted
    hypothesis = fitted.model.hypotheses[number]
    friction = fitted.model.friction(fitted.p)
    found = rivals(choice, number, search)
    near = [rival for rival in found if rival.indistinguishable]
    places, others = {}, []
    same = [rival for rival in near if _same_but_place(rival.hypothesis, hypothesis)]
    for key, value in hypothesis.place:
        if key != "law":
            values = {value, *(dict(rival.hypothesis.place)[key] for rival in same)}
            places[key] = (value, tuple(sorted(values, key=str if isinstance(value, str) else None)))
    others = [rival for rival in near if rival not in same]
    first = len(fitted.model.varied) + sum(len(each.free) for each in fitted.model.hypotheses[:number])
    sure = fitted.reduced < fitted.model.settings.far_from_one
    parameters, profiles = {}, {}
    for k, free in enumerate(hypothesis.free):
        u = fitted.p[first + k]
        if sure:
            profiles[free.name] = profile(fitted, first + k)
            ends = sorted(free.value(end, friction) for end in (profiles[free.name].low, profiles[free.name].high))
            parameters[free.name] = Estimate(free.value(u, friction), *ends)
        else:
            parameters[free.name] = Estimate(free.value(u, friction))
    simpler = without_effect(fitted, number)
    gain = fresh.judge(simpler, fitted).gain if fresh and simpler else None
    statement = sentence(hypothesis, parameters, friction)
    for key, (value, among) in places.items():
        if len(among) > 1:
            listed = ", ".join(str(each) for each in among)
            statement += f" These recordings cannot tell {key} {value} from {key} {listed}."
    return Named(
        hypothesis,
        fitted.effects[number],
        parameters,
        places,
        statement,
        tuple(others),
        bic(fitted) - bic(simpler) if simpler is not None else float("nan"),
        gain,
        partial,
        profiles,
    )


def _same_but_place(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two hypotheses are the same effect elsewhere."""
    a, b = dict(one.place), dict(other.place)
    return one.kind == other.kind and a.keys() == b.keys() and a.get("law") == b.get("law")
