"""Whether recordings agree: shared parameters estimated from each recording alone, and the Bayes factor of sharing."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.chance import chi2_tail
from prb3r.diagnosis.evidence.model_evidence import log_evidence
from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.search.together import Alone, Together
from prb3r.diagnosis.settings import Settings


class ParameterEstimate(NamedTuple):
    """Estimate of a parameter, in its own scale `u`."""

    u: float
    sd: float
    """Standard deviation of `u`; infinite where the readings do not tell it (`Settings.untold_share`)."""
    prior_sd: float = np.inf
    """Standard deviation of the prior around 0 that both contain; infinite: none."""

    @property
    def by_readings(self) -> tuple[float, float]:
        """Value and variance that the readings give by themselves, without the prior."""
        information = self.sd**-2 - self.prior_sd**-2
        return self.u * self.sd**-2 / information, 1 / information


def chance_of_one_value(estimates: Sequence[ParameterEstimate]) -> float:
    """p-value of the chi-square test that estimates are of one value; 1 if fewer than two determine it.

    The prior, which all of them contain, is taken out, so that they are independent.
    """
    known = np.array([told.by_readings for told in estimates if np.isfinite(told.sd)])
    if len(known) < 2:
        return 1.0
    value, weight = known[:, 0], 1 / known[:, 1]
    return float(chi2_tail(weight @ (value - weight @ value / weight.sum()) ** 2, len(known) - 1))


class SharedParameterEstimates(NamedTuple):
    """A shared parameter: estimates from all recordings together, and from each alone with the same effects."""

    effect: str
    """Name of the effect that the parameter belongs to; empty: it is a constant."""
    name: str
    rigs: tuple[int, ...]
    """Numbers of the rigs that share it."""
    joint: ParameterEstimate
    """From the joint fit."""
    alone: tuple[ParameterEstimate, ...]
    """From each recording, in the order of `rigs`."""
    free: Free | None
    """Turns `u` into a value; None: a constant, whose `u` is the ln of a factor on the nominal value."""
    parted: tuple[int, ...]
    """Rigs that have a constant of their own in the joint model, although they should share it."""

    @property
    def p(self) -> float:
        """Chance of values so far apart if all rigs have one (:func:`chance_of_one_value`)."""
        return chance_of_one_value(self.alone)


def shared_parameters(together: Together) -> Iterator[SharedParameterEstimates]:
    """All shared constants of the chosen joint model, then all shared parameters of its effects."""
    fitted = together.fitted
    model, covariance = fitted.model, fitted.covariance
    parts = [fitted.part(k) for k in range(len(model.rigs))]
    alone = [fit(part.model, part.p) or part for part in parts]
    deviations = [np.sqrt(np.diag(single.covariance)) for single in alone]

    def told(rig: int, row: int) -> ParameterEstimate:
        single, sd = alone[rig], float(deviations[rig][row])
        prior_sd = float(single.model.deviations[row])
        untold = sd > single.model.settings.untold_share * prior_sd
        return ParameterEstimate(float(single.p[row]), np.inf if untold else sd, prior_sd)

    def joint(column: int) -> ParameterEstimate:
        return ParameterEstimate(float(fitted.p[column]), float(np.sqrt(covariance[column, column])))

    for column, (name, rigs) in enumerate(model.varied):
        if len(rigs) > 1:
            singly = tuple(told(rig, parts[rig].model.varied.index(name)) for rig in rigs)
            parted = tuple(
                hypothesis.parted
                for hypothesis in model.hypotheses
                if hypothesis.parted is not None and hypothesis.parting and hypothesis.parting.name == name
            )
            yield SharedParameterEstimates("", name, rigs, joint(column), singly, None, parted)
    for hypothesis, span in zip(model.hypotheses, model.spans, strict=True):
        for place, slot in enumerate(hypothesis.slots):
            if slot.rig is None and len(hypothesis.rigs) > 1:
                rows = [int(np.flatnonzero(model.maps[rig][:, span.start + place])[0]) for rig in hypothesis.rigs]
                singly = tuple(told(rig, row) for rig, row in zip(hypothesis.rigs, rows, strict=True))
                yield SharedParameterEstimates(
                    hypothesis.name, slot.free.name, hypothesis.rigs, joint(span.start + place), singly, slot.free, ()
                )


def log_bayes_factor(together: Together) -> float:
    """ln of the Bayes factor of sharing: evidence of the best joint model over the product of the evidences of the best
    model of each recording by itself.

    Either side takes its best set of effects only, without averaging over sets.  Both are computed under the noise of
    the surviving joint models, which is larger than the estimated one if these leave something unexplained.
    """
    survivors: list[Any] = [survivor.fitted for survivor in together.survivors]
    joint = max(whole_evidence(fitted, together.search.log_odds) for fitted in survivors)
    apart = 0.0
    for alone, joined, rig in zip(together.alone, together.joined, survivors[0].model.rigs, strict=True):
        odds = {**joined.search.log_odds, **alone.search.log_odds}
        worth = [whole_evidence(fitted, odds) for fitted in _by_itself(alone, joined, rig.noise)]
        apart += max(worth)
    return joint - apart


def _by_itself(alone: Alone, joined: Alone, noise: Noise) -> Iterator[Any]:
    """Fits of one recording by itself, without what the others say, under a noise.

    Their effects are those of the joint model, of the model chosen on this recording alone and of its survivors, each
    set once.
    """
    settings = joined.choice.fitted.model.settings
    chosen = [joined.choice.fitted, alone.choice.fitted, *(known.fitted for known in alone.choice.survivors)]
    seen = set()
    for fitted in chosen[: settings.later_expansions]:
        effects = frozenset((hypothesis.kind, hypothesis.place) for hypothesis in fitted.model.hypotheses)
        if effects not in seen:
            seen.add(effects)
            again = fit(replace(fitted.model, noise=noise, belief=None), fitted.p)
            if again is not None:
                yield again


def whole_evidence(fitted: Any, log_odds: Any) -> float:
    """ln of the Laplace evidence of a fit or joint fit, including the integral over the constants.

    :func:`log_evidence` leaves that integral out.  Flat priors are replaced by the spread of handbook values
    (`Settings.modulus_sd`, `Settings.friction_sd`), as the evidence of an improper prior is not defined.
    """
    settings: Settings = fitted.model.settings
    constants = len(fitted.model.varied)
    names = [name if isinstance(name, str) else name[0] for name in fitted.model.varied]
    widths = {"log_stiffness": settings.modulus_sd, "log_friction": settings.friction_sd}
    deviations = np.array(
        [sd if np.isfinite(sd) else widths[name] for name, sd in zip(names, fitted.model.priors, strict=True)]
    )
    normal = fitted.jacobian[:, :constants].T @ fitted.jacobian[:, :constants]
    normal += np.diag(np.where(np.isfinite(fitted.model.priors), 0.0, deviations**-2))
    volume = np.linalg.slogdet(normal)[1] + 2 * np.log(deviations).sum()
    return log_evidence(fitted, log_odds) - volume / 2
