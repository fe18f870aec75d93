"""Starting from effects that were found before: those of a manipulator file as hypotheses, which are then refitted.

A size found before serves as a start, not as a prior: if it came from the same recording, the data would count twice.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from prb3r.diagnosis.fit.constants import RUBBING
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.effects.base import Effect
from prb3r.model.effects.friction import CableFriction
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator


@dataclass(frozen=True)
class Assumed:
    """Effects and constants of a rig that were found before."""

    values: Mapping[Hypothesis, Mapping[str, float]] = field(default_factory=dict)
    """Effects that were found before, each with the values of its free parameters by name."""
    constants: Mapping[str, float] = field(default_factory=dict)
    """`log_stiffness` and `log_friction`: ln of the ratios of modulus and friction coefficient to the nominal ones."""
    unknown: tuple[str, ...] = ()
    """Effects of the file that are no hypotheses of this recording, each with the reason, in words."""


def assumed_of(known: Manipulator, nominal: Manipulator, library: Sequence[Hypothesis]) -> Assumed:
    """What a manipulator `known` before says of a rig, in terms of the `library` of its recording.

    Effects that the `nominal` manipulator has too are not assumed: they stay as they are there.
    """
    stated, factor, known = list(nominal.effect), 1.0, _rubbing_as(nominal, known)
    values, unknown = dict[Hypothesis, Mapping[str, float]](), list[str]()
    for effect in known.effect:
        if effect in stated:
            stated.remove(effect)
            continue
        effect, share = _referred(effect, library)
        factor *= share
        hypothesis = hypothesis_at(effect, library)
        rival = next((other for other in values if hypothesis and hypothesis.excludes(other)), None)
        if hypothesis is None:
            unknown.append(f"{_named(effect)}: {_why_unknown(effect, nominal)}")
        elif rival:
            unknown.append(f"{_named(effect)}: cannot stand beside {rival.name}")
        elif beyond := _beyond(effect, hypothesis):
            unknown.append(f"{_named(effect)}: {beyond}")
        else:
            values[hypothesis] = {free.name: getattr(effect, free.name) for free in hypothesis.free}
    constants = {"log_stiffness": float(np.log(known.youngs_modulus_pa / nominal.youngs_modulus_pa))}
    if known.friction.coefficient > 0 and nominal.friction.coefficient > 0:
        coefficient = factor * known.friction.coefficient
        constants["log_friction"] = float(np.log(coefficient / nominal.friction.coefficient))
    return Assumed(values, constants, tuple(unknown))


def _rubbing_as(nominal: Manipulator, known: Manipulator) -> Manipulator:
    """The manipulator `known` with the friction of all cables where the `nominal` one has it: in the coefficient or,
    where that is 0, as an effect."""

    of_all = [effect for effect in known.effect if isinstance(effect, CableFriction) and not effect.cables]
    found = [effect for effect in of_all if effect not in nominal.effect]
    coefficient = known.friction.coefficient
    if nominal.friction.coefficient > 0 and found:
        others = [effect for effect in known.effect if effect not in found]
        friction = known.friction.model_copy(update={"coefficient": found[-1].coefficient})
        return known.model_copy(update={"friction": friction, "effect": others})
    if nominal.friction.coefficient == 0 < coefficient and not of_all:
        rubbing = CableFriction(kind="cable_friction", coefficient=coefficient)
        return known.model_copy(update={"effect": [rubbing, *known.effect]})
    return known


def _referred(effect: Effect, library: Iterable[Hypothesis]) -> tuple[Effect, float]:
    """An effect as a law with the reference that the library has for its kind, and the factor on the friction
    coefficient that goes with it; as it is, and 1, where its place is no reference."""
    suspect = SUSPECTS.get(effect.kind)
    other = next((hypothesis for hypothesis in library if hypothesis.kind == effect.kind), None)
    if suspect is None or suspect.referred is None or other is None:
        return effect, 1.0
    return suspect.referred(effect, dict(other.place))


def hypothesis_at(effect: Effect, library: Iterable[Hypothesis]) -> Hypothesis | None:
    """The hypothesis of the same kind, place and free parameters as an effect; None where the library has none.

    Where a special form fits as well as a general one (gravity of which one component is zero), it is the special one.
    """
    given, found = _plain(effect), list[Hypothesis]()
    for hypothesis in library:
        place = {name: value for name, value in given.items() if name not in {free.name for free in hypothesis.free}}
        sizes = all(free.name in given for free in hypothesis.free)
        if hypothesis.kind == effect.kind and sizes and place == dict(hypothesis.place):
            found.append(hypothesis)
    return min(found, key=lambda hypothesis: len(hypothesis.free), default=None)


ROUNDED_BOUND = 1e-3
"""How far beyond a bound of the search a size may lie, over the bound, to be taken for the bound as files round it."""


def _beyond(effect: Effect, hypothesis: Hypothesis) -> str:
    """Which size of an effect lies outside of what is looked for in a recording, in words; empty if none does."""
    for free in hypothesis.free:
        value, room = getattr(effect, free.name), ROUNDED_BOUND * max(abs(free.low), abs(free.high))
        if not free.low - room <= value <= free.high + room:
            return (
                f"{free.name} = {value:.3g} is beyond what this recording can show, {free.low:.3g} to {free.high:.3g}"
            )
    return ""


def _plain(effect: Effect) -> dict[str, Any]:
    """All given fields of an effect but its kind, lists as tuples."""
    values = effect.model_dump(exclude={"kind"}, exclude_none=True)
    return {name: tuple(value) if isinstance(value, list) else value for name, value in values.items()}


def _named(effect: Effect) -> str:
    """Kind and place of an effect in words, without its sizes."""
    places = {name: value for name, value in _plain(effect).items() if not isinstance(value, float | tuple)}
    listed = ", ".join(f"{name} {value}" for name, value in places.items())
    return effect.kind + (f" ({listed})" if listed else "")


def _why_unknown(effect: Effect, nominal: Manipulator) -> str:
    """Why an effect is no hypothesis of a recording of the `nominal` manipulator, in words."""
    problems = [problem.removeprefix(f"effect {effect.kind}: ") for problem in effect.problems(nominal)]
    if problems:
        return "; ".join(problems)
    if effect.kind not in SUSPECTS:
        return "no effect that a diagnosis looks for"
    if SUSPECTS[effect.kind].once and effect.kind in {known.kind for known in nominal.effect}:
        return "the nominal manipulator has one already"
    return "not looked for at that place or in that form, as this recording could not show it there"


def fit_assumed(calibrated: Fit, assumed: Assumed) -> Fit | None:
    """The calibrated model with all effects of `assumed`, fitted from their former values; None without effects, or
    where the fit fails."""
    if not assumed.values:
        return None
    model = calibrated.model.adding(*assumed.values)
    known = zip(model.varied, calibrated.p, strict=True)
    constants = [assumed.constants.get(name, value) for name, value in known]
    friction = calibrated.model.friction(np.array(constants))
    for hypothesis, values in assumed.values.items():
        if hypothesis.kind == RUBBING and not hypothesis.place:
            friction = values["coefficient"]
    sizes = [
        free.at(values[free.name], friction)
        for hypothesis, values in assumed.values.items()
        for free in hypothesis.free
    ]
    return fit(model, np.array([*constants, *sizes]))


def another_size(fitted: Fit, hypothesis: Hypothesis, sizes: Mapping[str, float]) -> str:
    """The parameter of an effect that is farthest, in standard deviations, from its earlier value in `sizes`, in words;
    empty if none is off by `Settings.strained_sd`."""
    model, number = fitted.model, fitted.model.hypotheses.index(hypothesis)
    friction, sd = model.friction(fitted.p), np.sqrt(np.diag(fitted.covariance))[model.spans[number]]
    found = fitted.p[model.spans[number]]
    before = np.array([free.at(sizes[free.name], friction) for free in hypothesis.free])
    away = np.abs(found - before) / np.maximum(sd, np.finfo(float).tiny)
    if not len(away) or away.max() < model.settings.strained_sd:
        return ""
    free = hypothesis.free[int(away.argmax())]
    now = free.value(found[away.argmax()], friction)
    return f"{free.name} {now:.3g} in the place of {sizes[free.name]:.3g}"


def known_states(known: Manipulator, predict: Predictor) -> Equilibria | None:
    """Equilibria of a manipulator `known` before under the recorded loads.

    From these states the effects of the library take their scales: with constants alone plates may bend far otherwise.
    None where a step has no equilibrium, or where the numbers of plates or cables differ from those of the recording.
    """
    recording, chain = predict.recording, known.chain()
    if chain.offset.shape != predict.chain.offset.shape:
        return None
    states = equilibria_of(
        chain,
        recording.loads,
        from_rest=recording.begins,
        number=predict.number,
        allowance=predict.settings.allowance,
    )
    return states if np.isfinite(states.angle).all() else None
