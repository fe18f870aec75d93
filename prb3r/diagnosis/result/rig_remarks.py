"""Remarks of a diagnosis on the rig and its readings: noise, parts, and weights that were not believed.

Each function returns sentences, and none where there is nothing to remark.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.checks.odd_part import OddPart
from prb3r.diagnosis.checks.repeats import Scatter
from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.checks.unseen import ALL_MARKERS, Unseen
from prb3r.diagnosis.evidence.model_evidence import AT_BOUND
from prb3r.diagnosis.evidence.noise_level import EstimatedLevel
from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import IN_RAD, MARKER, STIFFNESS, EstimatedTolerances, without_unit
from prb3r.diagnosis.library.contact import is_impossible, rim_of
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Chain
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import DiskContact
from prb3r.model.files.cells import count
from prb3r.recording.let_go import turns_back
from prb3r.recording.recording import Recording

PARTS_NAMED = 3
"""Largest number of parts beyond their tolerance that a remark names."""


def scattered(repeated: Scatter | None) -> list[str]:
    """How much repeated sequences scatter, compared with the stated noise; no remark where too few steps are
    repeated."""
    if repeated is None:
        return []
    within = "which chance alone can do" if repeated.factor > 1 else "so that no less noise is stated than there is"
    taken = "more than chance allows" if repeated.beyond_chance else within
    often = f"{repeated.factor:.2g} times as much as stated"
    return [f"what was pulled again ({count(repeated.steps, 'step')}) scatters {often}, {taken}"]


def noisy(estimate: EstimatedLevel, settings: Settings, logged: bool = False) -> list[str]:
    """Estimates of the noise that differ from what is stated: its scales, and the shares that readings have in common
    or that last through a sequence.

    Parameters
    ----------
    logged : whether what lasts from step to step is that of the recording's `serial_noise`.
    """
    level, remarks = estimate.level, []
    for name, scale, disturbed in [
        ("reading noise", estimate.reading, "the readings"),
        ("scatter of the tensions", estimate.tension, "the tensions"),
    ]:
        if not scale.low <= 1 <= scale.high:
            far = abs(np.log(scale.value)) > settings.far_noise
            within = "" if any(scale.open) else f" ({scale.low:.2g} to {scale.high:.2g})"
            so = "more" if scale.open[1] else "less" if scale.open[0] else "it so"
            remarks.append(
                f"the {name} is {scale.text} times the stated one{within}"
                + (f": state {so}" if far else "")
                + (f", or look for what disturbs {disturbed}" if far and scale.value > 1 else "")
            )
    if level.common:
        where = "neighbouring disks" if level.reach < settings.neighbouring_reach else "all disks of a photograph"
        remarks.append(f"about {100 * level.common:.0f} % of the variance of the readings is common to {where}")
    lasts = f"noise of a disk's readings lasts over some {level.span:.2g} steps"
    if logged:
        remarks.append(f"about {100 * level.serial:.0f} % of the {lasts}, as those that follow one another are alike")
    gain = (
        "scatter of the tensions lasts through a sequence and changes in the next, as of a load cell whose gain drifts"
    )
    for share, differing in [
        (level.lasting, gain),
        (0.0 if logged else level.serial, lasts),
    ]:
        if share:
            remarks.append(f"what was pulled again differs: about {100 * share:.0f} % of the {differing}")
    return remarks


def below_stated(share: float) -> list[str]:
    """A remark that the structure which is left lies within the stated accuracy, if its `share` of that is below 1."""
    if share >= 1.0:
        return []
    return [
        f"what is left does not look like noise, but is only {share:.2g} times what is stated of readings and "
        "tensions: within their accuracy, if that is stated rightly"
    ]


class Ending(NamedTuple):
    """A parameter of an effect that ends on a bound of the search, where the effect is still there."""

    hypothesis: Hypothesis
    free: Free
    value: float
    above: bool
    """Whether it ends on the upper bound."""


def endings(fitted: Fit) -> Iterator[Ending]:
    """The parameters of effects that end on a bound of the search."""
    (low, high), friction = fitted.model.bounds(fitted.p), fitted.model.friction(fitted.p)
    for hypothesis, span in zip(fitted.model.hypotheses, fitted.model.spans, strict=True):
        for number, free in enumerate(hypothesis.free, span.start):
            below = fitted.p[number] < low[number] + AT_BOUND and free.low != free.null and not free.limit
            above = fitted.p[number] > high[number] - AT_BOUND and free.high != free.null
            if below or above:
                yield Ending(hypothesis, free, free.value(fitted.p[number], friction), bool(above))


def at_bounds(fitted: Fit) -> list[str]:
    """A remark on every parameter of an effect that ends on a bound of the search."""
    return [
        f"{end.free.name} of {end.hypothesis.name} ends at {end.value:.3g}, as far as was sought: it may be "
        f"{'larger' if end.above else 'smaller'}, or something else is wrong"
        for end in endings(fitted)
    ]


def impossible_rims(fitted: Fit) -> bool:
    """Whether disks would have to reach farther than any disk does to touch as a fit has it."""
    chain, settings = fitted.solved.chain, fitted.model.settings
    return any(is_impossible(contact, chain.arc, chain.offset, settings) for contact in _contacts(fitted))


def _contacts(fitted: Fit) -> list[DiskContact]:
    """The contacts of disks of a fit."""
    return [effect for effect in fitted.effects if isinstance(effect, DiskContact) and effect.angle_rad > 0]


def far_rims(fitted: Fit) -> list[str]:
    """A remark on disks that touch at so small a bend that their rims would lie far outside all holes."""
    chain, settings, remarks = fitted.solved.chain, fitted.model.settings, []
    hole = float(np.abs(chain.offset).max(initial=0.0))
    for contact in _contacts(fitted):
        rim = rim_of(contact, chain.arc)
        if rim > settings.farthest_rim * hole > 0:
            remarks.append(
                f"disks that touch at {180 / np.pi * contact.angle_rad:.3g} degrees have rims {1e3 * rim:.3g} mm "
                f"from the axis, where the farthest hole lies at {1e3 * hole:.3g} mm: if these do not reach so "
                "far, something else stiffens the arm beyond that bend"
            )
    return remarks


def misplaced_marker(calibrated: Fit, doubts: Doubts) -> list[str]:
    """A remark on a single marker that would be far beyond its tolerance, and much farther than all others, if
    constants alone were right."""
    settings = calibrated.model.settings
    told, off = tolerances_told(calibrated, doubts), dict[str, tuple[float, str, float]]()
    for name, value, prior in zip(told.names, told.value, told.prior_sd, strict=True):
        if name.startswith(MARKER):
            disk, far = name.split()[1], abs(value) / prior
            off[disk] = max(off.get(disk, (0.0, "", 0.0)), (float(far), name, float(value)))
    ranked = sorted(off.values(), reverse=True)
    if not ranked or ranked[0][0] < settings.strained_sd:
        return []
    (far, name, value), *others = ranked
    if others and far < settings.lone_marker_ratio * others[0][0]:
        return []
    turned = name.endswith(IN_RAD)
    size = f"{180 / np.pi * value:.2g} degrees" if turned else f"{1e3 * value:.2g} mm"
    return [
        f"if nothing but constants were at work, {without_unit(name)} would be off by {size}, {far:.0f} times its "
        "tolerance, and no other marker nearly as far: look at it; if it sits so, state "
        f"{'marker_rad' if turned else 'marker_m'} under [tolerance], or leave its readings out, and diagnose again"
    ]


def beyond_tolerance(told: EstimatedTolerances, settings: Settings) -> list[str]:
    """A remark on the parts of the rig that are beyond their tolerance, the farthest first."""
    far = np.abs(told.value) / told.prior_sd
    order = [k for k in np.argsort(-far).tolist() if far[k] > settings.far_tolerance_sd]
    parts = [f"{without_unit(told.names[k])} by {far[k]:.1f} times its tolerance" for k in order]
    if not parts:
        return []
    more = f" and {len(parts) - PARTS_NAMED} more" if len(parts) > PARTS_NAMED else ""
    return [f"off its drawing: {', '.join(parts[:PARTS_NAMED])}{more}: measure it, or look for what moves it"]


def off_drawing(odd: OddPart) -> str:
    """A part and by how much it is not as drawn, such as "plate 4 stiffness about 0.76 times that drawn"."""
    name = without_unit(odd.name)
    if name.endswith(STIFFNESS):
        return f"{name} about {np.exp(odd.size):.2g} times that drawn"
    if odd.name.endswith(IN_RAD):
        return f"{name} off by about {180 / np.pi * odd.size:.2g} degrees"
    return f"{name.removesuffix('_m')} off by about {1e3 * odd.size:.2g} mm"


def off_as_drawn(fresh: Unseen | None, fitted: Fit, reported: Fit) -> list[str]:
    """A remark where parts off their drawing, within tolerance, make more of the mean square error on the sequences set
    aside than the noise does.

    `fitted` is the chosen model, `reported` the same with the parameters that are reported for parts as drawn.
    """
    if fresh is None:
        return []
    errors, part = fresh.as_drawn_and_made(reported, fitted), fresh.prediction(fitted).part
    drawn, made, noise = errors.rmse_calibrated_m, errors.rmse_explained_m, errors.noise_m
    factor, unit = 1e3, "mm"
    if drawn is None or made is None or noise is None:
        drawn, made, noise = errors.rmse_calibrated_rad, errors.rmse_explained_rad, errors.noise_rad
        factor, unit = 180 / np.pi, "degrees"
    if drawn is None or made is None or noise is None or drawn**2 - made**2 <= noise**2:
        return []
    said = f"{factor * drawn:.3g} {unit} with all as drawn; no part does more of that than {part}"
    return [
        f"what was set aside is predicted to {factor * made:.3g} {unit} with the parts of the rig as the other "
        f"sequences tell them, and to {said}: measure {'them' if part == ALL_MARKERS else 'it'}"
    ]


def too_vague(errors: HeldOut, settings: Settings) -> list[str]:
    """A remark where what was set aside is missed by far more than its noise, also with parts as the fitted sequences
    tell them (`Settings.vague`): it is then no contradiction only as the numbers of the model are uncertain."""
    units = errors.in_noise
    if units is None or units.made <= settings.vague:
        return []
    aside = ", ".join(errors.sequences)
    return [
        f"what was set aside ({aside}) is missed by {units.made:.2g} times its noise, which is no contradiction only "
        "because the numbers found are so uncertain: do not rely on them"
    ]


def wrong_weights(recording: Recording, doubted: Sequence[NotedWeight], chosen: Chain) -> list[str]:
    """Weights of a recording that are not believed, a sentence each.

    Where cables rub on the `chosen` chain, and slip as the steps declare, one that sticks looks the same at the step at
    which its tension turns back.
    """
    remarks, turned = [], turns_back(recording)
    sticks = chosen.presliding == 0 and bool(np.any(chosen.friction))
    for step, cable in doubted:
        row, name = recording.steps.iloc[step], recording.manipulator.cable_names[cable]
        noted = recording.loads.tension[step, cable]
        alone = (recording.loads.tension[step] > 0).sum() == 1
        other = "" if alone else ", or that on another cable"
        if sticks and turned[step, cable]:
            other += (
                ', or that cable had not yet slipped back where its tension turned (direction = "history" under '
                "[friction] of the manipulator file follows that)"
            )
        remarks.append(
            f"sequence {row['sequence']}, step {row['step']}: the weight on cable {name}, noted as {noted:.4g} N, does "
            f"not go with its readings{other}; it was not believed"
        )
    return remarks


def weighed(doubts: Doubts) -> list[str]:
    """How many readings were down-weighted as gross outliers."""
    count = int((doubts.inflation > 1).sum())
    far, down = ("reading is", "it was") if count == 1 else ("readings are", "they were")
    return [f"{count} {far} far from what the neighbours show; {down} down-weighted"] if count else []


def bent_at_many_places(named: Sequence[Effect], settings: Settings) -> list[str]:
    """A sentence where rest curvature is named at more than `Settings.most_faults` places; else none."""
    places = [effect.kind for effect in named].count("precurvature")
    if places <= settings.most_faults:
        return []
    return [
        f"rest curvature is named at {places} places: it may change along the arm in a form that the library lacks; "
        "then no single place means what it says, and bands for sister rigs may be wrong: record the arm without any "
        "load, which shows its form"
    ]


def uneven_plates(recording: Recording, named: Sequence[Effect]) -> list[str]:
    """A sentence where two plates or more, or plates along the arm, are named as of other stiffness, and the recording
    does not state how exactly plates are made; else none."""
    tolerance, kinds = recording.tolerance, [effect.kind for effect in named]
    differ = kinds.count("weakened_plate") > 1 or "stiffness_gradient" in kinds
    if "thickness_relative" in tolerance.model_fields_set or not differ:
        return []
    taken = 100 * tolerance.thickness_relative
    return [
        f"plates differ, and how exactly they are made is not stated ([tolerance] thickness_relative; {taken:g} % is "
        "taken): if such plates come out of the workshop, as notches that are cut a little too deep do, state more; "
        "bands for other designs hold what is stated"
    ]
