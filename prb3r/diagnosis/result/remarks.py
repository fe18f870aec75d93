"""What a diagnosis remarks on beside its verdict: noise, readings and weights that were not believed."""

from collections.abc import Mapping, Sequence

import numpy as np

from prb3r.diagnosis.checks.heldout import JudgedSequence, Unseen
from prb3r.diagnosis.checks.repeats import Scatter
from prb3r.diagnosis.checks.residuals import ModelCheck
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.checks.tolerated import tolerances_told
from prb3r.diagnosis.evidence.model_evidence import AT_BOUND
from prb3r.diagnosis.evidence.noise_level import EstimatedLevel
from prb3r.diagnosis.evidence.outliers import Doubts, NotedWeight
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.tolerance import EstimatedTolerances
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.assumed import Assumed
from prb3r.diagnosis.search.pool import Survivor
from prb3r.diagnosis.search.selection import Choice, presence_of
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.effects.plates import NonlinearPlate
from prb3r.model.effects.sections import SuperelasticPlate
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Recording

LIKE_LOOPS = {"pulley_friction", "worn_hole", "slip_history", "breakaway_friction", "load_dependent_friction"}
"""Kinds of effects that take more in loading than they give back in unloading, as plates do that go through loops."""
PARTS_NAMED = 3
"""Parts beyond their tolerance that a remark names."""


def scattered(repeated: Scatter | None) -> list[str]:
    """How much repeated sequences scatter beside what the recording states; nothing where none repeats another."""
    if repeated is None:
        return []
    taken = "more than chance allows" if repeated.beyond_chance else "which chance allows"
    often = f"{repeated.factor:.2g} times as much as stated"
    return [f"what was pulled again ({repeated.steps} steps) scatters {often}, {taken}"]


def noisy(estimate: EstimatedLevel, settings: Settings) -> list[str]:
    """What is found of the noise where it is not as stated."""
    level, remarks = estimate.level, []
    for name, scale, disturbed in [
        ("reading noise", estimate.reading, "the readings"),
        ("scatter of the tensions", estimate.tension, "the tensions"),
    ]:
        if not scale.low <= 1 <= scale.high:
            far = abs(np.log(scale.value)) > settings.far_noise
            remarks.append(
                f"the {name} is {scale.value:.2g} times the stated one ({scale.low:.2g} to {scale.high:.2g})"
                + (f": state it so, or look for what disturbs {disturbed}" if far else "")
            )
    if level.common:
        where = "neighbouring disks" if level.reach < settings.neighbouring_reach else "all disks of a photograph"
        remarks.append(f"about {100 * level.common:.0f} % of the variance of the readings is common to {where}")
    for share, differing in [
        (level.lasting, "scatter of the tensions lasts through a sequence: a gain that the next one has not"),
        (level.serial, f"noise of a disk's readings lasts over some {level.span:.0f} steps"),
    ]:
        if share:
            remarks.append(f"what was pulled again differs: about {100 * share:.0f} % of the {differing}")
    return remarks


def below_stated(share: float) -> list[str]:
    """What is left that noise would not leave, where it is less than the recording states of its accuracy."""
    if share >= 1.0:
        return []
    return [
        f"what is left does not look like noise, but is only {share:.2g} times what is stated of readings and "
        "tensions: within their accuracy, if that is stated rightly"
    ]


def not_predicted(failed: Sequence[JudgedSequence]) -> list[str]:
    """The sequences set aside that the explanation does not predict."""
    remarks = []
    for sequence in failed:
        beyond = f"its errors are {sequence.error_sd:.2g} times what noise, tensions and the fit together allow"
        remarks.append(
            f"sequence {sequence.name}, which no fit has seen, is not predicted: "
            f"{'no equilibrium at some step' if sequence.lost else beyond}; "
            "look at its weights and its order, or at what it loads that no other sequence does"
        )
    return remarks


def refuted_sets(choice: Choice, refuted: Sequence[Survivor]) -> list[str]:
    """Sets of effects that explain what was fitted as well as what is chosen, and do not predict what was set aside."""
    counts = [survivor for survivor in refuted if survivor.probability >= choice.fitted.model.settings.alike_rate]
    sets = {tuple(sorted(effect.name for effect in survivor.effects)) for survivor in counts}
    return [
        f"{' with '.join(names) or 'constants alone'}: would explain what was fitted too, but does not predict what no "
        "fit has seen"
        for names in sorted(sets)
    ]


def chosen_by(first: Fit, chosen: Fit, fresh: Unseen | None) -> list[str]:
    """That what was set aside chose between models, and confirms nothing, where the `first` choice was another."""
    if fresh is None or chosen is first:
        return []
    before, after = ({effect.name for effect in fitted.model.hypotheses} for fitted in (first, chosen))
    sets = [", ".join(sorted(some)) or "nothing more" for some in (after - before, before - after)]
    return [
        f"what was set aside ({', '.join(fresh.predict.recording.sequences)}) chose between {sets[0]} and {sets[1]}, "
        "which explain what was fitted alike: it confirms nothing"
    ]


def what_it_takes(choice: Choice, with_them: Choice | None, failed: Sequence[str]) -> str:
    """What explains sequences that were set aside and are not predicted, once they are fitted too.

    Parameters
    ----------
    choice : of the other sequences.
    with_them : of all; None where no constants bring all into balance.
    """
    asked = f"what it would take to predict {' and '.join(failed)}"
    if with_them is None or with_them.structured or not with_them.fitted.balanced:
        return f"{asked}: not known; fitted with the others it is not explained either"
    before, after = ({effect.name for effect in each.fitted.model.hypotheses} for each in (choice, with_them))
    if after == before:
        return f"{asked}: the same effects at other sizes, which explain all sequences once they are fitted together"
    more, less = ", ".join(sorted(after - before)), ", ".join(sorted(before - after))
    change = f"{more} in the place of {less}" if more and less else f"{more} too" if more else f"no {less}"
    return (
        f"{asked}: {change}, as all sequences fitted together have it; nothing unseen confirms that: record more of "
        "its kind, or judge it on another recording (--holdout)"
    )


def found_before(assumed: Assumed, choice: Choice) -> list[str]:
    """What was assumed and cannot be looked for, and what was not found again; nothing where nothing was assumed."""
    remarks = [f"assumed, but not looked for: {reason}" for reason in assumed.unknown]
    for hypothesis, sizes in assumed.values.items():
        if hypothesis not in choice.fitted.model.hypotheses:
            having = [survivor for survivor in choice.survivors if hypothesis in survivor.effects]
            share = sum(survivor.probability for survivor in having)
            if share < choice.fitted.model.settings.alike_rate:
                how = "these data contradict it"
            elif other := _another_size(having[0].fitted, hypothesis, sizes):
                how = f"these data contradict its size, {other}"
            else:
                how = f"these data do not tell it (probability {share:.2g})"
            remarks.append(f"assumed, but not found again: {hypothesis.name}: {how}")
    return remarks


def _another_size(fitted: Fit, hypothesis: Hypothesis, sizes: Mapping[str, float]) -> str:
    """The parameter of an effect that is farthest from what it was before, in words; empty if none is by
    `Settings.strained_sd`."""
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


def never_unloaded(choice: Choice, library: Sequence[Hypothesis]) -> list[str]:
    """That plates which soften may as well dissipate, where no sequence unloads and could tell; nothing elsewhere."""
    suspected = any(hypothesis.kind == "hysteretic_plate" for hypothesis in library)
    softening = [effect.kind for effect in choice.fitted.effects if _softens(effect)]
    if suspected or not softening:
        return []
    return [
        f"plates that soften ({softening[0]}) and plates that dissipate (hysteretic_plate) are alike here, as no "
        "sequence bends a plate back: unload in steps to tell them apart"
    ]


def or_loops(choice: Choice, library: Sequence[Hypothesis]) -> list[str]:
    """That loops of plates which may be superelastic look like friction, where a recording that unloads is explained by
    both: the library holds loops about the straight plate, and none that close at rest as theirs do."""
    looks, fitted = sorted(choice.kinds & LIKE_LOOPS), choice.fitted
    softening = [effect.kind for effect in fitted.effects if _softens(effect)]
    unloads = any(hypothesis.kind == "hysteretic_plate" for hypothesis in library)
    modulus = fitted.model.predict.recording.manipulator.youngs_modulus_pa * np.exp(fitted.constants.log_stiffness)
    if not (looks and softening and unloads and modulus < fitted.model.settings.stiffest_superelastic_pa):
        return []
    return [
        f"plates that soften ({softening[0]}) may give back less than they took, as superelastic ones do, in loops "
        f"which the library lacks: {' and '.join(looks)} may stand for that, and Young's modulus be off with it"
    ]


def _softens(effect: Effect) -> bool:
    """Whether plates soften under an effect that follows no history: beyond a knee, or on a plateau."""
    if isinstance(effect, NonlinearPlate):
        return effect.ratio is not None and effect.ratio < 1
    return isinstance(effect, SuperelasticPlate)


def without_mass(manipulator: Manipulator) -> list[str]:
    """That gravity is not among the suspects, where the file gives no mass on which it could act."""
    if manipulator.disk.mass_kg > 0:
        return []
    return ["gravity was not suspected, as the manipulator file gives the disks no mass (mass_kg)"]


def as_many_as_sought(choice: Choice) -> list[str]:
    """That the search ended at its largest number of effects, if the most probable model has so many."""
    count, most = len(choice.survivors[0].effects), choice.fitted.model.settings.most_effects
    if count < most:
        return []
    sought = f"{most} effect{'s' * (most != 1)}, as many as are sought"
    return [f"the most probable model has {sought}: there may be more, or another one behind them"]


def likely_too(choice: Choice) -> list[str]:
    """Kinds of effects that are likelier there than not, though what is named does without them: beside that, or in
    the place of some of it."""
    remarks = []
    for kind, probability in sorted(choice.likely.items(), key=lambda pair: -pair[1]):
        having = [survivor for survivor in choice.survivors if kind in survivor.kinds]
        beside = presence_of(having)
        gone = [named for named in sorted(choice.kinds) if beside.get(named, 0.0) < probability / 2]
        told = f"(probability {probability:.2f})"
        if gone:
            remarks.append(f"{kind} is likelier there than not {told}, in the place of {' and '.join(gone)}")
        else:
            remarks.append(f"{kind} is likely there too {told}, though not sure enough to be named")
    return remarks


def or_a_blunder(blunder: Blunder | None) -> list[str]:
    """The blunder of the set-up that is a rival of what is named, if there is one."""
    if blunder is None:
        return []
    looks = blunder.statement.removesuffix(".").removeprefix("It looks")
    return [
        f"it looks{looks} just as well, which would explain these recordings with fewer effects: look at that before "
        "you believe what is named"
    ]


CONSTANT_NAMES = {
    "log_stiffness": "Young's modulus",
    "log_friction": "the friction coefficient",
    "rotation": "the camera's rotation",
    "x": "the camera's shift along x",
    "y": "the camera's shift along y",
}


def strained(fitted: Fit) -> list[str]:
    """Constants far from what was known of them beforehand, and those at the end of what is allowed."""
    model, remarks = fitted.model, []
    for name, value, sd in zip(model.varied, fitted.p, model.priors, strict=False):
        text, far = CONSTANT_NAMES[name], abs(value) / sd
        ended = f"{np.exp(value):.3g} times the nominal one" if name.startswith("log") else f"{value:.3g}"
        low, high = model.widest.get(name, (-np.inf, np.inf))
        if not low + AT_BOUND < value < high - AT_BOUND:
            remarks.append(f"{text} ends at {ended}, as far off as is allowed: something else is wrong")
        elif far > model.settings.strained_sd:
            remarks.append(
                f"{text} ends at {ended}, {far:.0f} standard deviations from what the recording states of it"
            )
    return remarks


def misplaced_marker(calibrated: Fit, doubts: Doubts) -> list[str]:
    """That one marker alone seems to sit far beyond its tolerance, if constants alone are right; mostly nothing."""
    settings = calibrated.model.settings
    told, off = tolerances_told(calibrated, doubts), dict[str, tuple[float, str, float]]()
    for name, value, prior in zip(told.names, told.value, told.prior_sd, strict=True):
        if name.startswith("marker "):
            disk, far = name.split()[1], abs(value) / prior
            off[disk] = max(off.get(disk, (0.0, "", 0.0)), (float(far), name.removesuffix(", m"), float(value)))
    ranked = sorted(off.values(), reverse=True)
    if not ranked or ranked[0][0] < settings.strained_sd:
        return []
    (far, name, value), *others = ranked
    if others and far < settings.lone_marker_ratio * others[0][0]:
        return []
    return [
        f"if nothing but constants were at work, {name} would be off by {1e3 * value:.2g} mm, {far:.0f} times its "
        "tolerance, and no other marker nearly as far: look at it; if it sits so, state marker_m under [tolerance], "
        "or leave its readings out, and diagnose again"
    ]


def beyond_tolerance(told: EstimatedTolerances, settings: Settings) -> list[str]:
    """The parts of the rig that are beyond their tolerance, the farthest first."""
    far = np.abs(told.value) / told.prior_sd
    order = [k for k in np.argsort(-far).tolist() if far[k] > settings.far_tolerance_sd]
    parts = [f"{told.names[k].removesuffix(', m')} by {far[k]:.1f} times its tolerance" for k in order]
    if not parts:
        return []
    more = f" and {len(parts) - PARTS_NAMED} more" if len(parts) > PARTS_NAMED else ""
    return [f"off its drawing: {', '.join(parts[:PARTS_NAMED])}{more}: measure it, or look for what moves it"]


def against_the_best(checks: Sequence[ModelCheck], settings: Settings) -> list[str]:
    """The checks that speak against the best model, with their chances."""
    rare = [
        f"{check.name} ({'below 0.0001' if check.p < 1e-4 else f'{check.p:.1g}'})"
        for check in checks
        if check.p < settings.naming_rate
    ]
    if not rare:
        return []
    return [f"checks with a chance of less than {settings.naming_rate:g} speak against what is said: {'; '.join(rare)}"]


def wrong_weights(recording: Recording, doubted: Sequence[NotedWeight]) -> list[str]:
    """The weights of a recording that are not believed, a sentence each."""
    remarks = []
    for step, cable in doubted:
        row, name = recording.steps.iloc[step], recording.manipulator.cable_names[cable]
        noted = recording.loads.tension[step, cable]
        alone = (recording.loads.tension[step] > 0).sum() == 1
        remarks.append(
            f"sequence {row['sequence']}, step {row['step']}: the weight on cable {name}, noted as {noted:.4g} N, does "
            f"not go with its readings{'' if alone else ', or that on another cable'}; it was not believed"
        )
    return remarks


def weighed(doubts: Doubts) -> list[str]:
    """How many readings were weighed down as gross outliers, if any were."""
    count = int((doubts.inflation > 1).sum())
    far, down = ("reading is", "it was") if count == 1 else ("readings are", "they were")
    return [f"{count} {far} far from what the neighbours show; {down} weighed down"] if count else []
