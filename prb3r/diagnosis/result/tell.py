"""The last stage of a diagnosis: the plain result, made from all that was fitted and tested."""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from prb3r.diagnosis.confidence import INTERVAL_RISE, NORMAL_REACH
from prb3r.diagnosis.evidence.constants_by_part import clues
from prb3r.diagnosis.evidence.score_test import Scores
from prb3r.diagnosis.fit.constants import FRAME, Constants
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.profile import Profile, interval_ends
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.library.suspect import Estimate
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import FittedLaw, NamedEffect, ProfileCurve, RivalEffect
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.mismatch import mismatch_of
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.result.numbers import (
    CalibratedConstant,
    CameraFrame,
    ChiSquare,
    FittedModel,
    LargestScore,
    NoiseFound,
    ToleranceFound,
)
from prb3r.diagnosis.result.rig_remarks import endings, impossible_rims
from prb3r.diagnosis.result.spread import ends_over_models, number_of_constant
from prb3r.diagnosis.result.surviving import posterior_of
from prb3r.diagnosis.result.tables import diagnosis_tables
from prb3r.diagnosis.search.rivals import Rival
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator

NULL_REACHED = 1e-3
"""How near the end of an interval comes to the value at which an effect vanishes, as a share of its distance from the
estimate, to count as reaching it: a bound of the search that is not quite there.  Choice."""
ONE_POINT = 1e-12
"""Distance of two values in a profile up to which they differ by rounding alone, as a share of the largest value or of
1."""


def tell(investigation: Investigation) -> Diagnosis:
    """The plain result of an investigated recording, without its fits."""
    nominal = investigation.recording.manipulator
    calibrated, explained = investigation.calibrated, investigation.explained
    fits = {"calibrated": investigation.refitted, "explained": investigation.reported}
    if investigation.closure is not None:
        fits["closure"] = investigation.closure.fitted
    constants = investigation.reported.constants
    return Diagnosis(
        name=investigation.recording.name,
        seed=investigation.seed,
        verdict=investigation.verdict,
        why=investigation.why,
        structured=investigation.choice.beyond_stated,
        share_of_stated=investigation.choice.share_of_stated,
        nominal=nominal,
        calibrated=_plain_model(investigation.refitted),
        explained=_plain_model(investigation.reported),
        manipulators={name: adjusted(nominal, fitted.constants, fitted.effects) for name, fitted in fits.items()},
        chi2=ChiSquare(
            nominal=_nominal_chi2(calibrated),
            calibrated=calibrated.reduced,
            explained=explained.reduced,
            total=explained.chi2,
            threshold=investigation.choice.chi2_threshold,
        ),
        noise=_noise(investigation),
        models=investigation.models,
        posterior=posterior_of(investigation),
        alternatives=tuple(tuple(sorted(kinds)) for kinds in investigation.choice.alternatives),
        tolerances=_tolerances(investigation.tolerances),
        checks=investigation.checks,
        score_calibrated=_largest(investigation.before),
        score_explained=_largest(investigation.choice.scores),
        constants={
            "youngs_modulus_pa": _constant(nominal.youngs_modulus_pa, "log_stiffness", investigation),
            "friction_coefficient": _constant(nominal.friction.coefficient, "log_friction", investigation),
        },
        frame=CameraFrame(constants.rotation, constants.x, constants.y),
        effects=tuple(_effect(named, investigation) for named in investigation.named),
        mismatch=mismatch_of(investigation),
        closure=_closure(investigation),
        heldout=investigation.heldout,
        experiments=investigation.experiments,
        clues=tuple(clues(calibrated)),
        remarks=investigation.remarks,
        tables=diagnosis_tables(investigation),
        settings=explained.model.settings.plain(),
        setup=investigation.blunders,
        rival_blunder=investigation.rival_blunder,
    )


def adjusted(nominal: Manipulator, constants: Constants, effects: Sequence[Effect]) -> Manipulator:
    """The nominal manipulator on the elastica plate model, with calibrated constants and with `effects` beside its own.

    A factor on stiffness applies to Young's modulus and to stated bending stiffnesses alike.
    """
    plain = nominal.model_dump(exclude_none=True)
    stiffer = float(np.exp(constants.log_stiffness))
    plain["model"] = "elastica"
    plain["youngs_modulus_pa"] *= stiffer
    for segment in plain["segment"]:
        if "bending_stiffness_n_m2" in segment:
            segment["bending_stiffness_n_m2"] *= stiffer
    plain["friction"]["coefficient"] *= float(np.exp(constants.log_friction))
    plain["effect"] = [*plain.get("effect", []), *(effect.model_dump(exclude_none=True) for effect in effects)]
    return Manipulator.model_validate(plain)


def _plain_model(fitted: Fit) -> FittedModel:
    return FittedModel(fitted.constants, tuple(fitted.effects))


def _nominal_chi2(calibrated: Fit) -> float | None:
    """Chi-square per degree of freedom of the nominal constants in the calibrated frame, whose priors count as they do
    in that of the calibrated ones; None where some step has no equilibrium."""
    model, p = calibrated.model, calibrated.p.copy()
    refitted = [k for k, name in enumerate(model.varied) if name not in FRAME]
    p[refitted] = 0.0
    solved = model.solve(p)
    if not np.isfinite(solved.readings).all():
        return None
    residual = model.residuals(p, solved)
    return float(residual @ residual) / max(calibrated.freedom + len(refitted), 1)


def _largest(scores: Scores) -> LargestScore:
    return LargestScore(scores.largest, scores.threshold)


def _constant(nominal: float, name: str, investigation: Investigation) -> CalibratedConstant:
    """A constant, given its `nominal` value and the `name` of its logarithm, with a 95 % interval where the fit
    deserves one: linearised, unless chi-square at the ends shows that this is wrong.

    The interval is widened to what the other surviving models say of the constant, and ends at the bounds of the fit.
    """
    explained, fits = investigation.explained, (investigation.refitted, investigation.reported)
    alone, best = (nominal * float(np.exp(getattr(fitted.constants, name))) for fitted in fits)
    ends = np.nan, np.nan
    sure = not investigation.why
    if sure and name in explained.model.varied and explained.reduced < explained.model.settings.far_from_one:
        number = explained.model.varied.index(name)
        own = interval_ends(explained, number)
        ends = ends_over_models(investigation.choice, number, number_of_constant(name), own)
    bounds = explained.model.widest[name]
    low, high = np.clip(ends, *bounds)
    low, high = (nominal * float(np.exp(end)) for end in (low, high))
    return CalibratedConstant(nominal, alone, best, low, high, (ends[0] <= bounds[0], ends[1] >= bounds[1]))


def _noise(investigation: Investigation) -> NoiseFound:
    level, reading, tension = (levels := investigation.choice.level).level, levels.reading, levels.tension
    return NoiseFound(
        *reading[:3],
        level.common,
        level.reach,
        *tension[:3],
        level.lasting,
        level.serial,
        level.span,
        tension.open,
    )


def _tolerances(estimates: EstimatedTolerances) -> tuple[ToleranceFound, ...]:
    """Estimated tolerances with 95 % intervals."""
    ends = NORMAL_REACH * estimates.sd
    rows = zip(
        estimates.names,
        estimates.value,
        estimates.value - ends,
        estimates.value + ends,
        estimates.prior_sd,
        strict=True,
    )
    return tuple(ToleranceFound(name, *(float(number) for number in numbers)) for name, *numbers in rows)


def _effect(named: Named, investigation: Investigation) -> NamedEffect:
    """A named effect as plain data: numbers with intervals, sentences and rivals, without its fits."""
    explained, probability = investigation.explained, investigation.choice.probability_of(named.hypothesis)
    settings = explained.model.settings
    hypothesis, friction = named.hypothesis, explained.model.friction(explained.p)
    free = {free.name: free for free in hypothesis.free}
    in_doubt = any(end.hypothesis == hypothesis for end in endings(explained))
    in_doubt |= hypothesis.kind == "disk_contact" and impossible_rims(explained)
    in_doubt |= may_be_absent(hypothesis, named.parameters, friction)
    return NamedEffect(
        name=hypothesis.name,
        kind=hypothesis.kind,
        place=dict(hypothesis.place),
        among={key: values for key, (_, values) in named.places.items()},
        parameters=dict(named.parameters),
        profiles={name: profile_curve(known, free[name], friction, settings) for name, known in named.profiles.items()},
        statement=named.statement,
        rivals=tuple(_rival(rival) for rival in named.rivals),
        forms=tuple(_rival(form) for form in named.forms),
        probability=probability,
        certain=probability >= settings.certain and not named.partial and not in_doubt,
        delta_bic=named.delta_bic,
        heldout_gain=named.heldout_gain,
        partial=named.partial,
        without=None if named.without is None else _plain_model(named.without),
        in_doubt=in_doubt,
    )


def _rival(rival: Rival) -> RivalEffect:
    """A rival, or another form of a named effect, as plain data."""
    return RivalEffect(
        name=rival.hypothesis.name,
        kind=rival.hypothesis.kind,
        place=dict(rival.hypothesis.place),
        distance=float(rival.distance),
        behind=float(rival.behind),
        parameters=rival.parameters,
    )


def may_be_absent(hypothesis: Hypothesis, parameters: Mapping[str, Estimate], friction: float) -> bool:
    """Whether the intervals of all fitted parameters of an effect reach the values at which it vanishes.

    Readings do not rule its absence out then, whatever was set aside says, or what is known beforehand.  An effect that
    does not vanish continuously, or is there in another form where a value ends, has no such interval.  `friction`: the
    fitted coefficient, from which some parameters are told.
    """
    if hypothesis.probes or not hypothesis.free or any(free.limit for free in hypothesis.free):
        return False
    told = [(free, parameters[free.name]) for free in hypothesis.free if free.name in parameters]
    return bool(told) and all(_reaches(estimate, free.value(0.0, friction)) for free, estimate in told)


def _reaches(estimate: Estimate, null: float) -> bool:
    """Whether the interval of an estimate holds a value, or comes within :data:`NULL_REACHED` of the way to it."""
    if estimate.low is None or estimate.high is None:
        return False
    near = NULL_REACHED * abs(estimate.value - null)
    return estimate.low - near <= null <= estimate.high + near


def profile_curve(profile: Profile, free: Free, friction: float, settings: Settings) -> ProfileCurve:
    """A profile in the unit of its parameter, with a smooth curve through it.

    Only points with a rise of chi-square below `Settings.shown_rise` times that at the ends of an interval are kept.
    The signed root of the rise is interpolated, as it is nearly linear.  `friction` is the fitted coefficient, from
    which some parameters are told.
    """
    inside = profile.rise < settings.shown_rise * INTERVAL_RISE
    u, rise = profile.u[inside], np.maximum(profile.rise[inside], 0.0)
    distinct = np.concatenate([[True], np.diff(u) > ONE_POINT * max(1.0, np.abs(u).max())])
    u, rise = u[distinct], rise[distinct]
    fine = fine_rise = np.zeros(0)
    if len(u) > 1:
        signed = np.sqrt(rise) * np.where(np.arange(len(u)) < np.argmin(rise), -1, 1)
        fine = np.linspace(u[0], u[-1], settings.profile_points)
        fine_rise = scipy.interpolate.PchipInterpolator(u, signed)(fine) ** 2
    value, fine_value = (np.array([free.value(at, friction) for at in scale]) for scale in (u, fine))
    return ProfileCurve(value, rise, fine_value, fine_rise)


def _closure(investigation: Investigation) -> FittedLaw | None:
    """The empirical law of an investigation as plain data; None without one."""
    closure = investigation.closure
    if closure is None:
        return None
    return FittedLaw(
        effect=closure.effect,
        statement=closure.statement,
        reduced_chi2=closure.fitted.reduced,
        heldout_gain=investigation.closure_gain,
        beside_named=len(closure.fitted.model.hypotheses) > 1,
    )
