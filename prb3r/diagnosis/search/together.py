"""The effects that explain several recordings together.

The search for joint models starts from the effects that each recording shows alone.  The surviving joint models then
tell for every recording what the others know of the parameters that the rigs share.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.evidence.model_evidence import chi2_threshold
from prb3r.diagnosis.evidence.noise_level import EstimatedLevel
from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.evidence.renewal import level_under
from prb3r.diagnosis.evidence.smooth_moments import chance_of_smooth_moments
from prb3r.diagnosis.fit.joint import JointFit, JointModel
from prb3r.diagnosis.fit.least_squares import fit, polished
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.library.groups import Groups
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.joint import CONSTANT_GROUPS, SHARED
from prb3r.diagnosis.search.coarser import told_share
from prb3r.diagnosis.search.joint_pool import (
    JointPool,
    JointSearch,
    fit_joint,
    joint_search,
    shared_constants,
    start_set,
)
from prb3r.diagnosis.search.pool import Effects, Survivor
from prb3r.diagnosis.search.search import Search, examine
from prb3r.diagnosis.search.selection import Choice, simplest


class Alone(NamedTuple):
    """What is known of one recording."""

    choice: Choice
    """The chosen effects; if they do not explain the recording, those that stand under a coarser likelihood
    (`coarser.py`)."""
    search: Search
    best: Fit
    """The most probable model, whether it explains the recording or not."""


@dataclass(frozen=True, eq=False)
class Together:
    """The result of a search on several recordings together."""

    alone: tuple[Alone, ...]
    """Every recording by itself."""
    groups: Groups
    """Which rigs share material and friction."""
    search: JointSearch
    fitted: JointFit
    """The chosen joint model: the smallest part of the most probable one that is not much less probable."""
    joined: tuple[Alone, ...]
    """Every recording, given what the others tell of shared parameters."""
    survivors: tuple[Survivor, ...]
    """Surviving joint models, most probable first; their `fitted` are joint fits."""

    def shared_probability(self, effect: str, constant: str) -> float:
        """Probability that a parameter has the same value on all rigs that share it.

        The parameter is one of the effect named `effect`, or `constant` if that is empty.
        """

        return float(sum(each.probability for each in self.survivors if self.shares(each, effect, constant)))

    @staticmethod
    def shares(survivor: Survivor, effect: str, constant: str) -> bool:
        """Whether a joint model has one value of a parameter, named as for :meth:`shared_probability`, for all rigs."""
        hypotheses: frozenset[Any] = survivor.effects
        if effect:
            return any(hypothesis.name == effect for hypothesis in hypotheses)
        return not any(hypothesis.parting and hypothesis.parting.name == constant for hypothesis in hypotheses)


class _Explored(NamedTuple):
    """A finished joint search, under the noise estimated from its best model."""

    pool: JointPool
    noise: tuple[tuple[Doubts, EstimatedLevel], ...]
    """For every recording: what is not believed, with the noise level of the pool, and the estimated level."""


def choose_together(alone: Sequence[Alone], groups: Groups) -> Together:
    """Search for joint models: the chosen one, the survivors, and the choice that follows for every recording.

    If some recordings are not explained, the effects are chosen that stand under a coarser likelihood of these.
    """
    settings = alone[0].choice.fitted.model.settings
    rigs = tuple(replace(part.choice.fitted.model, hypotheses=()) for part in alone)
    shared = shared_constants(rigs, groups)
    sisters = shared.get("log_stiffness", ())
    rigs = tuple(
        _of_sisters(part, rig) if k in sisters else rig for k, (part, rig) in enumerate(zip(alone, rigs, strict=True))
    )
    model = JointModel(rigs, shared)
    search = joint_search([part.search for part in alone], model, groups)
    known_apart = [part._replace(search=_own_search(part.search, k, search)) for k, part in enumerate(alone)]
    explored = _explore(model, search, known_apart)
    explored.pool.add_confounded(polished(simplest(explored.pool.survivors(), settings)))  # type: ignore[arg-type]
    survivors = explored.pool.survivors()
    fitted: Any = polished(simplest(survivors, settings))
    joined = _on_each(known_apart, explored, fitted, survivors)
    if any(rig.choice.structured for rig in joined):
        fitted, survivors = _standing(explored.pool, fitted, joined)
        joined = _on_each(known_apart, explored, fitted, survivors)
    return Together(tuple(alone), groups, search, fitted, joined, survivors)


def _of_sisters(alone: Alone, rig: Model) -> Model:
    """The model of a rig without effects whose Young's modulus is also that of others, but whose thickness is its
    own."""
    predict = replace(rig.predict, recording=replace(rig.recording, modulus_of_several=True))
    noise = alone.choice.doubts.noise(predict, alone.choice.fitted.solved, rig.settings)
    return replace(rig, predict=predict, noise=noise)


def _explore(model: JointModel, search: JointSearch, alone: Sequence[Alone]) -> _Explored:
    """Search from the effects that each recording shows alone, and re-estimate the noise until neither changes.

    Parameters
    ----------
    alone : the recordings, each with the hypotheses of the joint search in its library (:func:`_own_search`).
    """
    settings = model.settings
    wide: Any = replace(settings, most_effects=settings.most_effects * len(alone))
    pool = JointPool(search, wide, search.apply(fit_joint, _starts(model, search, alone)))  # type: ignore[arg-type]
    doubts, around = [single.choice.doubts for single in alone], Effects()
    for _ in range(settings.renewals):
        pool.explore(settings.later_expansions)
        best: Any = pool.best
        parts = [best.part(k) for k in range(len(alone))]
        levels = [
            level_under(part, doubted, single.search.library)
            for part, doubted, single in zip(parts, doubts, alone, strict=True)
        ]
        near = all(level.level.near(doubted.level, settings) for level, doubted in zip(levels, doubts, strict=True))
        if near and around == frozenset(best.model.hypotheses):
            break
        around = frozenset(best.model.hypotheses)
        doubts = [replace(doubted, level=level.level) for doubted, level in zip(doubts, levels, strict=True)]
        pairs = zip(parts, doubts, strict=True)
        pool = pool.under_each([doubted.noise(part.model.predict, part.solved, settings) for part, doubted in pairs])
    return _Explored(pool, tuple(zip(doubts, levels, strict=True)))


def _on_each(
    alone: Sequence[Alone], explored: _Explored, fitted: JointFit, survivors: Sequence[Survivor]
) -> tuple[Alone, ...]:
    """Every recording, in order, given what the others tell of shared parameters.

    Parameters
    ----------
    fitted, survivors : the chosen joint model, and all that survive.
    """
    out = []
    for rig, (single, noise) in enumerate(zip(alone, explored.noise, strict=True)):
        search = _knowing(single.search, fitted.model.members[rig].hypotheses)
        choice = _with_others(rig, single.choice.calibrated, search, (fitted, survivors), noise)
        out.append(Alone(choice, search, choice.survivors[0].fitted))
    return tuple(out)


def _knowing(search: Search, chosen: Sequence[Hypothesis]) -> Search:
    """A copy of a search whose library holds the `chosen` hypotheses instead of those of the same kind and place.

    The two differ in their bounds: a shared effect has the widest bounds of all its rigs.
    """
    by_place = {(hypothesis.kind, hypothesis.place): hypothesis for hypothesis in chosen}
    return replace(
        search,
        library=tuple(by_place.get((hypothesis.kind, hypothesis.place), hypothesis) for hypothesis in search.library),
    )


def _standing(pool: JointPool, fitted: JointFit, joined: Sequence[Alone]) -> tuple[JointFit, tuple[Survivor, ...]]:
    """The chosen and the surviving joint models under a coarser likelihood of the recordings that are not explained.

    The method is that of :mod:`coarser`; the chosen model is refitted under the exact likelihood.
    """
    settings, noises = fitted.model.settings, []
    for rig, single in enumerate(joined):
        part, doubts = fitted.part(rig), single.choice.doubts
        if single.choice.structured:
            scale = doubts.level.scale / np.sqrt(told_share(part))
            coarser = replace(doubts, level=doubts.level._replace(scale=float(scale)))
            noises.append(coarser.noise(part.model.predict, part.solved, settings))
        else:
            noises.append(part.model.noise)
    coarse = pool.under_each(noises)
    coarse.explore(settings.later_expansions)
    survivors = coarse.survivors()
    standing: Any = simplest(survivors, settings)
    exact = fit(replace(standing.model, rigs=fitted.model.rigs), standing.p)
    return (fitted if exact is None else polished(exact)), survivors


def _starts(model: JointModel, search: JointSearch, alone: Sequence[Alone]) -> list[tuple[JointModel, np.ndarray]]:
    """Joint models and their start parameters (P,): without effects, and with the effects that each recording shows.

    Shared values are taken from each rig in turn; further starts leave every rig its own constants, its own effects of
    shared kinds, or both, or give all rigs what one of them has.
    """
    plain = [single.choice.calibrated for single in alone]
    starts, sets = (
        [start_set(model, (), plain, first=0)],
        [
            [single.choice.fitted for single in alone],
            [single.choice.survivors[0].fitted for single in alone],
            [single.best for single in alone],
        ],
    )
    for chosen in sets:
        for first in range(len(alone)):
            starts.append(start_set(model, search.library, chosen, first))
            starts.append(start_set(model, search.library, chosen, first, alike=True))
        for apart in (CONSTANT_GROUPS, SHARED, {**CONSTANT_GROUPS, **SHARED}):
            starts.append(start_set(model, search.library, chosen, 0, apart))
    different = {(whole.hypotheses, p.tobytes()): (whole, p) for whole, p in starts}
    return list(different.values())


def _with_others(
    rig: int,
    plain: Fit,
    search: Search,
    joint: tuple[JointFit, Sequence[Survivor]],
    noise: tuple[Doubts, EstimatedLevel],
) -> Choice:
    """The choice on one recording, given what the others tell: joint models reduced to the rig numbered `rig`.

    Surviving joint models that have the same effects on that rig become one survivor.

    Parameters
    ----------
    plain : the fit of the constants alone.
    search : the search of this recording.
    joint : the chosen joint model, and all that survive.
    noise : readings and weights of the recording that are not believed, and the estimated noise level.
    """
    fitted, survivors = joint
    doubts, level = noise
    chosen = polished(at_minimum(fitted, rig))
    calibrated = replace(plain.model, predict=chosen.model.predict, noise=chosen.model.noise)
    fits = {frozenset(chosen.model.hypotheses): chosen}
    shares, worth = dict[Effects, float](), dict[Effects, float]()
    for survivor in survivors:
        whole: Any = survivor.fitted
        effects = frozenset(whole.model.members[rig].hypotheses)
        if effects not in fits:
            fits[effects] = at_minimum(whole, rig)
        shares[effects] = shares.get(effects, 0.0) + survivor.probability
        worth[effects] = max(worth.get(effects, -np.inf), survivor.log_evidence)
    ranked = sorted(shares, key=lambda effects: -shares[effects])
    scores, best = examine(chosen, search), fits[ranked[0]]
    return Choice(
        calibrated=fit(calibrated, plain.p) or plain,
        fitted=chosen,
        tried=tuple(fits.values()),
        survivors=tuple(Survivor(fits[effects], worth[effects], shares[effects]) for effects in ranked),
        scores=scores,
        scores_of_best=scores if best is chosen else examine(best, search),
        smooth_moments=chance_of_smooth_moments(best, search.seed),
        chi2_threshold=chi2_threshold(chosen),
        doubts=doubts,
        level=level,
        settled=frozenset(
            part
            for hypothesis in fitted.model.hypotheses
            if len(hypothesis.rigs) > 1 and (part := hypothesis.parts[rig]) is not None
        ),
    )


def at_minimum(fitted: JointFit, rig: int) -> Fit:
    """The fit of one recording, given what the others tell of shared parameters.

    Its minimum is that of the joint fit, so that nothing has to be refitted.  The exception is a rig with a constant of
    its own instead of a shared one, of which the others tell nothing.
    """
    part = fitted.believed(rig)
    parted = any(hypothesis.parted == rig for hypothesis in fitted.model.hypotheses)
    return (fit(part.model, part.p) or part) if parted else part


def _own_search(search: Search, rig: int, joint: JointSearch) -> Search:
    """A copy of the search of one rig in which effects that may be shared have the bounds of the joint search."""
    common = [
        part for hypothesis in joint.library if len(hypothesis.rigs) > 1 and (part := hypothesis.parts[rig]) is not None
    ]
    by_place = {(part.kind, part.place): part for part in common}

    def moved(part: Hypothesis) -> Hypothesis:
        return by_place.get((part.kind, part.place), part)

    assumed = replace(search.assumed, values={moved(known): size for known, size in search.assumed.values.items()})
    return replace(search, library=tuple(moved(known) for known in search.library), assumed=assumed)
