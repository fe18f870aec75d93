"""The posterior of the models that survive a search, from their fits.

A normal distribution of `u` holds as far as the readings are linear in `u`.  Where other parts stand beside the plates
Young's modulus may be free over decades, and the readings tell a sum: of stiffnesses where cables stiffen the arm, of
compliances where clamps soften it, of logarithms where a segment has another stiffness.  So the modulus is drawn in the
scale in which the recording is most nearly linear.
"""

from collections.abc import Sequence

import numpy as np

from prb3r.diagnosis.evidence.outliers import Doubts
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.result.as_made import parts_posterior
from prb3r.diagnosis.result.discrepancy import Discrepancy
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.largest_bending import bending_of
from prb3r.diagnosis.result.posterior import FILE_NAMES, FreeParameter, ModelPosterior, Posterior
from prb3r.diagnosis.result.rig_remarks import impossible_rims
from prb3r.diagnosis.result.unexplained import best_elsewhere, best_of_rig, constants_alone, moved_by_effects
from prb3r.model.manipulator import Manipulator

MODULUS = FILE_NAMES["log_stiffness"]
WIDE = 0.2
"""Standard deviation of the ln of the modulus from which scales are compared; below it they agree within 2 % of it."""
TRIED = (-2.0, -1.0, 1.0, 2.0)
"""Deviations of the modulus, in standard deviations, at which the rise of chi-square is compared with a quadratic."""


def posterior_of(investigation: Investigation) -> Posterior:
    """The posterior of the surviving models; where the recording is unexplained, with the model that predicts best.

    Where it is explained by disks that cannot touch so, with that which predicts best without them, for other designs.
    """
    choice = investigation.choice
    recording = choice.fitted.recording
    models = [
        _model_posterior(survivor.fitted, survivor.probability, choice.doubts, named=survivor.effects == choice.effects)
        for survivor in choice.survivors
    ]
    unexplained = bool(investigation.why)
    doubted = unexplained or impossible_rims(choice.fitted)
    carried, on_bench = (_carried(investigation, bench) if doubted else None for bench in (False, True))
    beside = any(model is not None and model.moved is not None for model in (carried, on_bench))
    return Posterior(
        manipulator=recording.manipulator,
        as_filed=investigation.as_filed,
        mended_loads=[blunder.blunder for blunder in investigation.blunders if blunder.file == "steps"],
        tolerance=recording.tolerance,
        models=models,
        reported=_alone(*best_of_rig(investigation)) if unexplained else None,
        carried=carried,
        on_bench=on_bench,
        alone=_alone(*constants_alone(investigation)) if beside else None,
        bending=bending_of(recording.manipulator, choice.fitted.solved.states.angle, recording.begins),
        pace_s=recording.pace_s,
    )


def _carried(investigation: Investigation, same_bench: bool) -> ModelPosterior:
    """The posterior of the model on which predictions for designs of another geometry rest."""
    best, discrepancy = best_elsewhere(investigation, same_bench)
    moved = moved_by_effects(investigation, same_bench) if best is investigation.reported else np.inf
    return _alone(best, discrepancy).model_copy(update={"moved": moved if np.isfinite(moved) else None})


def _alone(best: Fit, discrepancy: Discrepancy | None) -> ModelPosterior:
    """The posterior of a model that stands alone, with every part as drawn."""
    return _model_posterior(best, 1.0, None, named=True).model_copy(update={"discrepancy": discrepancy})


def _free(name: str, nominal: float, ends: tuple[float, float]) -> Free:
    """A calibrated constant as a free parameter; `ends` are the bounds of the logarithm of its factor on `nominal`."""
    low, high = (nominal * np.exp(ends)).tolist()
    return Free(name, nominal, low, high, log=True)


def _model_posterior(fitted: Fit, probability: float, doubts: Doubts | None, named: bool) -> ModelPosterior:
    """The posterior of one model, the frame of the camera left out.

    Parameters
    ----------
    doubts : what is not believed of the readings, from which the parts of the rig are estimated; None where they are
        as drawn.
    """
    model, nominal = fitted.model, fitted.recording.manipulator
    values = {"log_stiffness": nominal.youngs_modulus_pa, "log_friction": nominal.friction.coefficient}
    frees = {
        k: _free(FILE_NAMES[name], values[name], model.widest[name])
        for k, name in enumerate(model.varied)
        if name in FILE_NAMES
    }
    of_effects = [(n, free) for n, hypothesis in enumerate(model.hypotheses, 1) for free in hypothesis.free]
    frees |= {
        k: free._replace(name=f"effect.{n}.{free.name}") for k, (n, free) in enumerate(of_effects, len(model.varied))
    }
    kept = list(frees)
    posterior = ModelPosterior(
        probability=probability,
        named=named,
        constants={
            FILE_NAMES[name]: float(value * np.exp(getattr(fitted.constants, name))) for name, value in values.items()
        },
        effects=list(fitted.effects),
        free=[_parameter(free, float(fitted.p[k])) for k, free in frees.items()],
        covariance=fitted.covariance[np.ix_(kept, kept)].tolist(),
        parts=None if doubts is None else parts_posterior(fitted, doubts, kept),
    )
    return _in_linear_scale(posterior, fitted, kept)


def _parameter(free: Free, u: float) -> FreeParameter:
    """A free parameter with its best `u`."""
    return FreeParameter(
        u=u, **{name: each for name, each in free._asdict().items() if name in FreeParameter.model_fields}
    )


def _in_linear_scale(posterior: ModelPosterior, fitted: Fit, kept: Sequence[int]) -> ModelPosterior:
    """The `posterior` of a fit with Young's modulus in that of the scales ln E, E and 1/E in which chi-square is most
    nearly that of the normal distribution.

    `kept`: numbers of its parameters among those of the fit.
    """
    names = [part.name for part in posterior.free]
    if MODULUS not in names or posterior.covariance[names.index(MODULUS)][names.index(MODULUS)] < WIDE**2:
        return posterior
    number = names.index(MODULUS)
    free = posterior.free[number].free
    value = free.value(posterior.free[number].u)
    scales = [
        free,
        free._replace(log=False, scale=value),  # in each the derivative of ln E by u is 1 at the best value,
        free._replace(log=False, scale=free.null / value, inverse=True),  # so that the covariance holds for all
    ]
    before, after = posterior.free[:number], posterior.free[number + 1 :]
    ways = [
        posterior.model_copy(update={"free": [*before, _parameter(scale, scale.at(value)), *after]}) for scale in scales
    ]
    return min(ways, key=lambda way: _bent(way, number, fitted, kept))


def _bent(posterior: ModelPosterior, number: int, fitted: Fit, kept: Sequence[int]) -> float:
    """Deviation of the recording's chi-square from that of the normal distribution of `posterior`.

    It is summed over the steps `TRIED` of parameter `number`; the other parameters take their conditional means.
    """
    covariance, model = np.array(posterior.covariance), fitted.model
    nominal: Manipulator = model.recording.manipulator
    known = np.linalg.pinv(covariance, hermitian=True)
    others = fitted.covariance[:, kept] @ known
    off = 0.0
    for share in TRIED:
        along = share * covariance[:, number] / np.sqrt(covariance[number, number])
        there = posterior.within(posterior.best + along, nominal)
        away = there - posterior.best
        p = fitted.p + others @ away
        free = posterior.free[number].free
        p[kept] = fitted.p[kept] + away
        p[kept[number]] = np.log(free.value(there[number]) / free.null)
        rise = np.sum(model.residuals(p, model.solve(p)) ** 2) - fitted.chi2
        off += abs(float(rise - away @ known @ away))
    return off if np.isfinite(off) else np.inf
