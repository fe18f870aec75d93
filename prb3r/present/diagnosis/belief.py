"""How sure a diagnosis is: surviving models with probabilities, noise, tolerances, model checks, and what carries over.

Tables and sentences for the report.
"""

import re
from collections.abc import Iterator

from prb3r.diagnosis.fit.tolerance import IN_M, IN_RAD, without_unit
from prb3r.diagnosis.result.answer import sureness
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.transfer import other_geometry
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import listed
from prb3r.model.files.cells import count
from prb3r.present.diagnosis import sentences as say
from prb3r.present.page import Table
from prb3r.quantities import unit_ending

ASKED = {
    "chi-square": "all readings together are met as closely as their noise allows",
    "scale of the noise": "the scatter of the readings is as near the stated one as stated noise usually is",
    "scatter of the tensions": "the scatter of the tensions is as near the stated one as stated scatter usually is",
    "largest score": "no further effect, wherever it sits, helps more than one would by chance",
    "smooth missing moments": "no moments are left that change smoothly with the loads, along the arm or in time",
    "neighbours along disks": "what is left at neighbouring disks is not alike",
    "neighbours along steps": "what is left at neighbouring steps is not alike",
    "sequence": "what no fit has seen is predicted as closely as the noise allows",
}
"""What each check asks, by its name or by the beginning of its name."""
OF_PARTS = {
    "clamp_compliance": "clamps",
    "disk_contact": "disks",
    "hole_clearance": "disks",
    "umbilical": "length",
}
"""Parts of a rig, by the kinds of effects that another design has only with the same ones."""
MOST_SHOWN = 6
"""Tolerances that are listed at most, those most prior standard deviations off first."""


def surviving_models(diagnosis: Diagnosis) -> Table | None:
    """A row for each surviving model (set of effects); None if none has an effect or the verdict is `unexplained`."""
    if diagnosis.why or not any(model.effects for model in diagnosis.models):
        return None
    rows = []
    for model in diagnosis.models:
        score = "–" if model.heldout_log_score is None else say.rounded(model.heldout_log_score)
        effects = ", ".join(map(say.spaced, model.effects)) or "none"
        rows.append([effects, say.percent(model.probability), say.rounded(model.reduced_chi2), score])
    head = ["Effects", "Probability", "Squared error per degree of freedom", "Log score, held out"]
    return Table(head, rows)


def noise_sentence(diagnosis: Diagnosis) -> str:
    """Sentences on the noise: its size relative to the stated one, its correlation within photographs and in time."""
    noise = diagnosis.noise
    text = (
        f"The readings scatter {say.rounded(noise.scale)} times as much as was stated "
        f"({say.rounded(noise.scale_low)} to {say.rounded(noise.scale_high)}); all judgements rest on that scatter."
    )
    if noise.tension_scale != 1:
        low, high = say.rounded(noise.tension_scale_low), say.rounded(noise.tension_scale_high)
        below, above = noise.tension_open
        size = f"at least {low}" if above else f"at most {high}" if below else say.rounded(noise.tension_scale)
        text += f" The tensions scatter {size} times as much as was stated"
        text += "." if below or above else f" ({low} to {high})."
    if noise.common:
        whole = noise.reach >= diagnosis.nominal.plates
        over = "the whole photograph has" if whole else f"disks less than about {noise.reach:.0f} apart have"
        text += f" Of the variance of the readings {over} {say.percent(noise.common)} in common."
    if noise.lasting:
        text += (
            f" Sequences under the same loads differ by errors that last: {say.percent(noise.lasting)} of the variance"
            " of the tensions stays through a sequence, which no effect of the loads can explain."
        )
    if noise.serial:
        text += (
            f" Of the variance of a disk's readings neighbouring steps have {say.percent(noise.serial)} in common, over"
            f" some {say.rounded(noise.span)} steps."
        )
    return text


def tolerance_table(diagnosis: Diagnosis) -> Table | None:
    """Estimated deviations of the rig from its drawing, largest first in prior standard deviations; None without any.

    Those beyond `Settings.far_tolerance_sd` are in bold.
    """
    rows, far_sd = [], Settings(**diagnosis.settings).far_tolerance_sd
    far = sorted(diagnosis.tolerances, key=lambda tolerance: -abs(tolerance.value) / tolerance.prior_sd)
    for tolerance in far[:MOST_SHOWN]:
        ends = (tolerance.value, tolerance.low, tolerance.high, tolerance.prior_sd)
        what, unit = _tolerance_in_words(tolerance.name)
        value, low, high, sd = (say.value_text(unit, end) if unit else say.percent(end) for end in ends)
        judgement = "**beyond tolerance**" if tolerance.beyond(far_sd) else "within tolerance"
        rows.append([what, value, f"{low} to {high}", sd, judgement])
    head = ["What", "Off by", "95 % interval", "Tolerance (sd)", ""]
    return Table(head, rows, (0, 4)) if rows else None


def _tolerance_in_words(name: str) -> tuple[str, str]:
    """The words of a tolerance's name, and a column name that has its unit; empty if the tolerance is relative."""
    for unit, column in ((IN_M, "length_m"), (IN_RAD, "angle_rad")):
        if name.endswith(unit):
            return without_unit(name), column
    ending = unit_ending(name)
    what = name.removesuffix(ending) if ending else name
    return re.sub(r"[._]", " ", what), f"value{ending}" if ending else ""


def rare_chance(diagnosis: Diagnosis) -> float:
    """The p-value below which a check speaks against the best model; a larger one where a model without effects leaves
    something, as the search asks more only of those that it led to."""
    settings = Settings(**diagnosis.settings)
    best = max(diagnosis.models, key=lambda model: model.probability, default=None)
    return settings.alarm_rate if diagnosis.why and best is not None and not best.effects else settings.naming_rate


def check_table(diagnosis: Diagnosis) -> Table:
    """The model checks with their p-values: chances of as much misfit or more if the best model were right.

    Those below :func:`rare_chance` are in bold.
    """
    rows = []
    for check in diagnosis.checks:
        chance = "below 0.0001" if check.p < 1e-4 else say.rounded(check.p)
        asked = next((text for name, text in ASKED.items() if check.name.startswith(name)), "")
        rows.append([check.name, asked, f"**{chance}**" if check.p < rare_chance(diagnosis) else chance])
    return Table(["Check", "Whether", "Chance"], rows, (0, 1))


def rare_checks(diagnosis: Diagnosis) -> str:
    """A sentence that names the checks that speak against the best model."""
    limit = rare_chance(diagnosis)
    rare = [check.name for check in diagnosis.checks if check.p < limit]
    if not rare:
        return f"No chance is below {limit:g}: none of these checks speaks against the best model."
    speaks = "speaks" if len(rare) == 1 else "speak"
    return f"Chances below {limit:g} are in bold: {'; '.join(rare)} {speaks} against the best model."


def unlisted_sets(diagnosis: Diagnosis) -> str:
    """A sentence on the sets of effects that stand but are not among the surviving models that are listed."""
    odds, rest = Settings(**diagnosis.settings).survival_odds, diagnosis.posterior.models[len(diagnosis.models) :]
    any_other = f"any other is less probable than the first by a factor of more than {odds:.0f}"
    if not rest:
        return f"{any_other[0].upper()}{any_other[1:]}."
    share, how = say.percent(sum(model.probability for model in rest)), "is" if len(rest) == 1 else "are"
    return f"{count(len(rest), 'more set')} ({share} in all) {how} not listed; {any_other}."


def standing_sets(diagnosis: Diagnosis) -> str:
    """A sentence on whether all surviving sets of effects contain the named ones; empty if alternatives are told."""
    named = {effect.kind for effect in diagnosis.effects}
    if not named or diagnosis.alternatives:
        return ""
    stand = diagnosis.posterior.models
    lacking = [model for model in stand if not named <= {effect.kind for effect in model.effects}]
    if lacking:
        chance = say.percent(sum(model.probability for model in lacking))
        return f"Sets that lack something of what is named have {chance} together, too little to count."
    names = {effect.name for effect in diagnosis.effects}
    elsewhere = sum(model.probability for model in diagnosis.models if not names <= set(model.effects))
    if elsewhere:
        return (
            f"Sets that have effects of the kinds that are named at other places have {say.percent(elsewhere)} "
            "together: the kinds are surer than the places."
        )
    if len(stand) > 1:
        return (
            "What is named is in all of them; the others add an effect that these recordings neither show nor exclude."
        )
    return "No other set of effects stands."


def carry_over(diagnosis: Diagnosis) -> Iterator[str]:
    """Sentences on which constants and named effects carry over to other designs, and which stay with this rig."""
    if diagnosis.why:
        yield "Nothing is sure to carry over while a mismatch remains: E, μ and effects may stand in for it."
        return
    known = [effect for effect in diagnosis.explained.effects if effect.kind != "empirical_moment"]
    most_faults = Settings(**diagnosis.settings).most_faults
    nominal = diagnosis.nominal
    carried, _ = other_geometry(known, nominal, nominal, most_faults)
    benched, left = other_geometry(known, nominal, nominal, most_faults, same_bench=True)
    if carried:
        doubtful = {effect.kind: f" ({sureness(effect)})" for effect in diagnosis.effects if not effect.certain}
        kinds = dict.fromkeys(say.spaced(effect.kind) + doubtful.get(effect.kind, "") for effect in carried)
        constants = say.constants_in_brief(diagnosis).replace(" and", ",")
        parts = dict.fromkeys(part for effect in carried if (part := OF_PARTS.get(effect.kind)))
        alike = listed(["material", "cables", *parts])
        yield f"Carries over to other designs of the same {alike}: {constants}, {', '.join(kinds)}."
    else:
        constants = say.constants_in_brief(diagnosis)
        carry = "carry" if " " in constants else "carries"
        yield f"To other designs of the same material and cables {constants} {carry} over, no effect does."
    if of_the_bench := [say.spaced(effect.kind) for effect in benched if effect not in carried]:
        there = listed(list(dict.fromkeys(of_the_bench)))
        yield f"To other designs on this bench, mounted alike, carries over too: {there} (not with --other-bench)."
    for reason in dict.fromkeys(left):
        yield f"Stays with this rig: {reason}."
    if diagnosis.alternatives:
        yield "Other sets of effects that stand may carry over otherwise: predict weighs them by their probabilities."
