"""The joint search on several rigs: hypotheses that rigs share or have for themselves, joint models that were fitted in
full, and the starts of joint fits."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.joint import JointFit, JointModel
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.library.groups import Groups
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.joint import CONSTANT_GROUPS, SHARED, JointHypothesis
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.search.confounded import jointly_confounded
from prb3r.diagnosis.search.joint_columns import joint_beginning, joint_linear_model
from prb3r.diagnosis.search.joint_odds import joint_log_odds
from prb3r.diagnosis.search.linear_selection import LinearModel
from prb3r.diagnosis.search.pool import Pool
from prb3r.diagnosis.search.search import Search


@dataclass(frozen=True, eq=False)
class JointSearch:
    """What a joint search is given; the counterpart of `Search`."""

    library: tuple[JointHypothesis, ...]
    """All hypotheses that may be in a joint model."""
    log_odds: Mapping[JointHypothesis, float]
    """ln of the prior odds of every hypothesis."""
    apply: Apply = field(default=serially)
    """Runs full fits, in this process or in workers."""


def joint_search(alone: Sequence[Search], model: JointModel, groups: Groups) -> JointSearch:
    """The joint search on rigs that were each searched `alone`, from the joint `model` without effects.

    Its library holds the effects that rigs share or may have alike, every effect of each rig alone, and shared
    constants of which one rig has its own value.
    """
    log_odds = joint_log_odds(alone, model, groups)
    return JointSearch(tuple(log_odds), log_odds, alone[0].apply)


def shared_constants(models: Sequence[Any], groups: Groups) -> dict[str, tuple[int, ...]]:
    """Constants that all rigs of a group fit and therefore share, with the numbers of these rigs."""
    sharing = {name: groups.of.get(group, ()) for name, group in CONSTANT_GROUPS.items()}
    return {name: rigs for name, rigs in sharing.items() if rigs and all(name in models[k].varied for k in rigs)}


class JointPool(Pool):
    """All joint models that were fitted in full under one covariance of each recording, by their sets of effects."""

    def add(self, fitted: Any) -> None:
        """Keep a joint fit as `Pool.add` does, unless it shares friction in name alone
        (`JointFit.shares_in_name_alone`): a rig with its own friction is another model."""
        if fitted is not None and not fitted.shares_in_name_alone:
            super().add(fitted)

    def linearised(self, fitted: Any) -> tuple[LinearModel, frozenset[int]]:
        """The linearised model around a joint fit, and the numbers of the columns that belong to its effects."""
        return joint_linear_model(fitted, self.search.library, self.search.log_odds)  # type: ignore[arg-type]

    def beginning(self, fitted: Any, linear: LinearModel, chosen: Sequence[int]) -> Any:
        """The hypotheses of the `chosen` columns, and the joint parameters (P,) that a full fit of them begins from."""
        return joint_beginning(fitted, linear, chosen)

    def add_confounded(self, fitted: JointFit) -> None:
        """Fit a joint model with one more effect each: those that the recordings do not rule out
        (`Settings.survival_odds`) and beside which the constants are much less certain (:func:`jointly_confounded`)."""
        linear, present = self.linearised(fitted)
        among = jointly_confounded(fitted, self.search.library)  # type: ignore[arg-type]
        rise = np.where(linear.has_any_of(among), linear.additions(present), -np.inf)  # type: ignore[arg-type]
        best = [k for k in np.argsort(-rise).tolist() if rise[k] >= -np.log(self.settings.survival_odds)]
        tasks = []
        for k in best[: self.settings.shortlist]:
            hypotheses, start = self.beginning(fitted, linear, [*sorted(present), k])
            tasks.append((replace(fitted.model, hypotheses=hypotheses), start))
        for wider in self.search.apply(fit_joint, tasks):
            self.add(wider)

    def under_each(self, noises: Sequence[Noise]) -> "JointPool":
        """A new pool under other covariances, one for each recording: the models of `worth_keeping`, refitted."""
        tasks = []
        for effects in self.worth_keeping():
            fitted: Any = self.fits[effects]
            rigs = tuple(replace(rig, noise=noise) for rig, noise in zip(fitted.model.rigs, noises, strict=True))
            tasks.append((replace(fitted.model, rigs=rigs), fitted.p))
        return JointPool(self.search, self.settings, self.search.apply(fit_joint, tasks))


def fit_joint(task: tuple[JointModel, np.ndarray]) -> Any:
    """A joint model fitted from its start (P,); None where chi-square or its slope is not finite."""
    fitted: JointFit | None = fit(*task)
    return fitted


def start_set(
    model: JointModel,
    library: Sequence[JointHypothesis],
    chosen: Sequence[Any],
    first: int,
    apart: Collection[str] = (),
    alike: bool = False,
) -> tuple[JointModel, np.ndarray]:
    """The joint model with the effects that were found on each rig alone, and its start parameters (P,).

    An effect that may be in common is taken from rig `first`; where that rig lacks it, it is left out.

    Parameters
    ----------
    chosen : a fit of every rig alone.
    first : the rig from which shared effects and constants take their values.
    apart : kinds of effects, and constants by name, that each rig has for itself although they could be shared.
    alike : whether all rigs have, of what was found on rig `first`, also those effects that are neither of the material
        nor of its friction.
    """
    effects: dict[JointHypothesis, np.ndarray] = {}
    for rig in (first, *(k for k in range(len(chosen)) if k != first)):
        fitted = chosen[rig]
        friction, shares = fitted.model.friction(fitted.p), fitted.model.shares(fitted.p)
        for hypothesis, u in zip(fitted.model.hypotheses, shares, strict=True):
            joint = _in_library(hypothesis, rig, library, apart, alike)
            if rig != first and joint not in effects and hypothesis.kind not in SHARED:
                joint = _in_library(hypothesis, rig, library, apart, alike_too=False)
            part = joint.parts[rig] if joint else None
            if joint is None or part is None or (rig != first and joint not in effects and len(joint.rigs) > 1):
                continue
            at = effects.setdefault(joint, np.zeros(len(joint.slots)))
            values = [free.value(size, friction) for free, size in zip(hypothesis.free, u, strict=True)]
            for place, free, value in zip(joint.places(rig), part.free, values, strict=True):
                if rig == first or joint.slots[place].rig == rig:
                    at[place] = free.at(value, friction)

    def constant(name: str, rig: int) -> float:
        return float(chosen[rig].p[chosen[rig].model.varied.index(name)])

    for joint in library:
        if joint.parting is not None and joint.parted not in (None, first) and joint.parting.name in apart:
            name = joint.parting.name
            effects[joint] = np.array([constant(name, joint.parted) - constant(name, first)])
    constants = [constant(name, first if first in rigs else rigs[0]) for name, rigs in model.varied]
    return replace(model, hypotheses=tuple(effects)), np.concatenate([constants, *effects.values()])


def _in_library(
    hypothesis: Hypothesis, rig: int, library: Sequence[JointHypothesis], apart: Collection[str], alike_too: bool
) -> JointHypothesis | None:
    """The joint hypothesis that an effect of one rig corresponds to; None where the library has none.

    It is the one in common if there is one and its kind is not kept `apart`, else the rig's own; of kinds that are not
    in `SHARED` only if `alike_too`.
    """
    same = [
        joint
        for joint in library
        if (part := joint.parts[rig]) is not None
        and part.same_form(hypothesis)
        and (len(joint.rigs) == 1 or (joint.kind not in apart and (alike_too or joint.kind in SHARED)))
    ]
    return max(same, key=lambda joint: len(joint.rigs), default=None)
