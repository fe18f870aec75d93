"""Prior odds of the hypotheses on several rigs together: what they share, have alike, or have each for itself."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import logit

from prb3r.diagnosis.fit.joint import JointModel
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.groups import Groups
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.joint import JointHypothesis, alike_on_all, alone_on, counterpart, in_common
from prb3r.diagnosis.library.prior_odds import log_prior_odds
from prb3r.diagnosis.search.search import Search
from prb3r.diagnosis.settings import Settings

Odds = dict[JointHypothesis, float]
"""ln of the prior odds of joint hypotheses."""


def joint_log_odds(alone: Sequence[Search], model: JointModel, groups: Groups) -> Odds:
    """ln of the prior odds of every hypothesis of a joint search on rigs that were each searched `alone`.

    - An effect in common has the odds that `log_prior_odds` gives it, or higher ones if it was found before.
    - An effect that all rigs of one make may have alike takes its part (:func:`_alike_presence`) of the odds that one
      rig alone has it; the rest is left to each rig's own.
    - A rig's own value of what it should share has `Settings.parting_presence`.

    Parameters
    ----------
    model : the joint model without effects: its constants, and what each rig states of them.
    """
    shared = _shared(alone, groups, model.settings)
    alike, apart = _alike(alone, model, groups)
    return shared | alike | _own(alone, shared, apart, model.settings) | _parting(model)


def _shared(alone: Sequence[Search], groups: Groups, settings: Settings) -> Odds:
    """Odds of the effects that rigs have in common: of their material, or of the surfaces that rub."""
    common = list(in_common([search.library for search in alone], groups.of, groups.same_sections))
    shareable = [joint.first for joint in common if joint.first is not None]
    odds = Odds(zip(common, log_prior_odds(shareable, settings), strict=True))
    for joint in common:
        known = [
            search.log_odds[hypothesis]
            for search in alone
            for hypothesis in search.assumed.values
            if any(part is not None and part.same_effect(hypothesis) for part in joint.parts)
        ]
        odds[joint] = max([odds[joint], *known])
    return odds


def _alike(
    alone: Sequence[Search], model: JointModel, groups: Groups
) -> tuple[Odds, Mapping[tuple[int, Hypothesis], float]]:
    """Odds of the effects that all rigs of one make may have alike; and what that leaves to each rig's own, as a
    summand of its ln odds, by the number of the rig and its hypothesis."""
    odds, apart = Odds(), dict[tuple[int, Hypothesis], float]()
    for joint in alike_on_all([search.library for search in alone], groups.of_one_make, groups.one_design):
        parts = ((rig, part and counterpart(part, alone[rig].library)) for rig, part in enumerate(joint.parts))
        each = [(rig, one) for rig, one in parts if one]
        alike = _alike_presence(joint, model)
        odds[joint] = max(alone[rig].log_odds[one] for rig, one in each) + float(np.log(alike))
        apart |= dict.fromkeys(each, float(np.log1p(-alike)))
    return odds, apart


def _own(
    alone: Sequence[Search], shared: Odds, apart: Mapping[tuple[int, Hypothesis], float], settings: Settings
) -> Odds:
    """Odds of every effect of each rig alone.

    `apart`: of :func:`_alike`.  Own effects in the place of one that rigs share cost `Settings.parting_presence` on all
    of these rigs together.
    """
    odds, parting = Odds(), float(logit(settings.parting_presence))
    for rig, search in enumerate(alone):
        sharing = {(part.kind, part.place): len(joint.rigs) for joint in shared if (part := joint.parts[rig])}
        for hypothesis in search.library:
            rigs = sharing.get((hypothesis.kind, hypothesis.place))
            less = parting / rigs if rigs else apart.get((rig, hypothesis), 0.0)
            odds[alone_on(rig, hypothesis, len(alone))] = search.log_odds[hypothesis] + less
    return odds


def _parting(model: JointModel) -> Odds:
    """Odds of every shared constant of which one rig has its own value; of two rigs either may be the one that parts,
    so that the second stands for both."""
    odds, count = Odds(), len(model.rigs)
    for name, sharing in model.shared.items():
        could_part = sharing if len(sharing) > 2 else sharing[1:]
        for rig in could_part:
            farthest = model.settings.farthest
            offset = Free(name, 0.0, -farthest, farthest, sd=_parting_sd(model, name, rig))
            own = JointHypothesis(f"own {name}", (None,) * count, (), offset, rig)
            odds[own] = float(logit(model.settings.parting_presence) - np.log(len(could_part)))
    return odds


def _alike_presence(joint: JointHypothesis, model: JointModel) -> float:
    """Prior probability that all rigs have an effect alike, if one of them has it.

    It is large for what carries over from one design to another, as clamps of one make do, and
    `Settings.alike_presence` for what belongs to a bench.
    """
    settings, first = model.settings, joint.first
    assert first is not None
    here, *others = (model.rigs[rig].recording.manipulator for rig in joint.rigs)
    friction = here.friction.coefficient
    effect = first.effect(first.starts(friction)[0], friction)
    carried = [SUSPECTS[joint.kind].transfer(effect, here, other) for other in others]
    return settings.alike_presence if any(isinstance(one, str) for one in carried) else 1 - settings.parting_presence


def _parting_sd(model: JointModel, name: str, rig: int) -> float:
    """Prior standard deviation of the difference between a rig's own value of a constant and the shared one: that of
    handbooks, or a smaller one where the files state both values more narrowly."""
    settings, own = model.settings, model.rigs[rig]
    of_handbooks = {"log_stiffness": settings.modulus_sd, "log_friction": settings.friction_sd}[name]
    shared = model.priors[model.varied.index((name, model.shared[name]))]
    return min(of_handbooks, float(np.hypot(shared, own.priors[own.varied.index(name)])))
