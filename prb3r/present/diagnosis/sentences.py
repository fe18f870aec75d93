"""Sentences of a diagnosis for a mechanical engineer, and how its numbers are put into words."""

import math
import re
from collections.abc import Iterator, Sequence

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.result.answer import in_words, outweighs_rivals, possible_unnamed
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import NamedEffect, RivalEffect
from prb3r.diagnosis.result.projection import setup_sentences
from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import few
from prb3r.present import style
from prb3r.quantities import describe, unit_ending

CONSTANTS = {"youngs_modulus_pa": "E", "friction_coefficient": "μ"}
"""Symbols of the constants that are refitted."""


def verdict_sentences(diagnosis: Diagnosis) -> str:
    """The verdict in a sentence or two; where the set-up has a blunder, sentences on that instead."""
    if diagnosis.setup:
        first, *others = setup_sentences(diagnosis)
        return " ".join([f"Set-up: {first[0].lower()}{first[1:]}", *others])
    count = len(diagnosis.effects)
    sure = f" ({_how_many_are_certain(diagnosis)})" if diagnosis.verdict == "ambiguous" else ""
    account, effects = (
        ("accounts", f"one effect{sure}") if count == 1 else ("account", f"{count} effects{sure} together")
    )
    if diagnosis.verdict in ("adequate", "ambiguous") and diagnosis.share_of_stated < 1.0:
        return _within_stated(diagnosis, f"{effects} {account}")
    if diagnosis.verdict == "adequate":
        return "Adequate: with its constants refitted, the nominal model leaves nothing that these recordings show."
    if diagnosis.verdict == "explained":
        return f"Explained: {effects}, absent from the nominal model, {account} for the mismatch."
    if diagnosis.verdict == "ambiguous" and not count:
        return (
            "Not explained surely: with its constants refitted the nominal model leaves nothing that these recordings "
            "show, but some effect is likelier there than none, though the recording does not tell which."
        )
    if diagnosis.verdict == "ambiguous":
        rivalled = diagnosis.alternatives or any(effect.rivals or not effect.certain for effect in diagnosis.effects)
        how = "but not in one way alone" if rivalled else "but with a doubt that the notes tell"
        return f"Explained, {how}: {effects} {account} for the mismatch."
    text = f"Unexplained: {diagnosis.why}."
    if not count:
        return text
    if not diagnosis.structured:
        return f"{text} {'That' if count == 1 else 'Those'} named below would do it: a lead, not a finding."
    which = "One effect of the library helps" if count == 1 else f"{count} effects of the library together help"
    return f"{text} {which} in part."


def _within_stated(diagnosis: Diagnosis, effects_account: str) -> str:
    """The verdict if the residuals do not look like noise but are smaller than the stated accuracy.

    `effects_account` begins its sentence: `one effect accounts`.
    """
    left = "what is left does not look like noise"
    if not diagnosis.effects:
        return f"Adequate within the accuracy that is stated: {left}, but is less than that."
    return (
        f"Explained within the accuracy that is stated, not to the noise: {effects_account} for the mismatch, but "
        f"{left}, so that something else may stand behind what is named."
    )


def _how_many_are_certain(diagnosis: Diagnosis) -> str:
    """How many of the named effects are certain, such as `2 of them certain`."""
    count, certain = len(diagnosis.effects), sum(effect.certain for effect in diagnosis.effects)
    if count == 1:
        return "certain" if certain else "not certain"
    return f"{'all' if certain == count else certain or 'none'} of them certain"


def headlines(diagnosis: Diagnosis) -> list[str]:
    """Up to three lines: verdict and chi-square; the named effects with their values; the held-out gain."""
    chi2 = rounded(diagnosis.chi2.calibrated)
    if not diagnosis.effects:
        return [f"{diagnosis.name}: {diagnosis.verdict}; chi-square per degree of freedom {chi2}"]
    chi2 += f" with refitted constants alone, {rounded(diagnosis.chi2.explained)} with what is named"
    named = []
    for effect in diagnosis.effects:
        values = [f"{parameter_title(key)} {_with_interval(key, part)}" for key, part in effect.parameters.items()]
        named.append(", ".join([spaced(effect.name), *values]))
    return [
        f"{diagnosis.name}: {diagnosis.verdict}; chi-square per degree of freedom {chi2}",
        "; ".join(named),
        *([] if diagnosis.heldout is None else [f"held-out gain {gain_text(diagnosis.heldout.gain)}"]),
    ]


def _with_interval(name: str, estimate: Estimate) -> str:
    """The value of a parameter with its interval, if it has one."""
    value, interval = estimate_texts(name, estimate)
    return value if estimate.low is None else f"{value} ({interval})"


def estimate_texts(name: str, estimate: Estimate) -> tuple[str, str]:
    """The value of a parameter and its interval as text with its unit, which an interval has once; a dash for none."""
    known = [end for end in estimate.numbers if end is not None]
    shown = _in_unit(name, known)
    numbers = [float(f"{end * shown.factor:.3g}") for end in known]
    value, *ends = (style.with_unit(number, shown.unit) for number in numbers)
    if not ends:
        return value, "–"
    low, high = ends
    return value, estimate.interval(low if estimate.open[1] else style.digits(numbers[1]), high)


def fit_quality(diagnosis: Diagnosis) -> str:
    """Sentences on chi-square per degree of freedom of the nominal, the calibrated and the explained model."""
    chi2 = diagnosis.chi2
    nominal = chi2.nominal
    first = "no equilibrium at all with the nominal constants" if nominal is None else f"{rounded(nominal)} nominal"
    after = f", {rounded(chi2.explained)} with what is named" if diagnosis.effects else ""
    return (
        f"Squared error per degree of freedom, in units of the noise: {first}, "
        f"{rounded(chi2.calibrated)} with {constants_in_words(diagnosis)} refitted{after}. A right model is near 1; "
        "as the size of the noise is estimated too, the checks below are the test."
    )


def constants_in_words(diagnosis: Diagnosis) -> str:
    """Names and symbols of the refitted constants: without friction if the nominal manipulator has none."""
    modulus, friction = "Young's modulus E", "the friction coefficient μ"
    return f"{modulus} and {friction}" if diagnosis.nominal.friction.coefficient else modulus


def constants_in_brief(diagnosis: Diagnosis) -> str:
    """Symbols of the refitted constants: `E and μ`, or `E` if the nominal manipulator has no friction."""
    return "E and μ" if diagnosis.nominal.friction.coefficient else "E"


def rounded(value: float | None) -> str:
    """A number with three significant digits; a dash for None or one that is not finite."""
    return "–" if value is None or not np.isfinite(value) else style.digits(float(f"{value:.3g}"))


def percent(share: float) -> str:
    """A share in whole percent, below 10 % with two digits; a share below 1 is never rounded to 100 %."""
    if 0.995 <= share < 1:
        return f"{math.floor(1000 * share) / 10:.1f} %" if share < 0.999 else "above 99.9 %"
    return (
        f"{style.digits(float(f'{100 * share:.2g}'))} %"
        if abs(share) < 0.1
        else f"{100 * share:.0f} %".replace("-", "−")
    )


def gain_text(gain: float) -> str:
    """A held-out gain in percent; `worse` below -100 %, where the excess error that is divided by was next to none."""
    return percent(gain) if gain >= -1 else "worse"


def value_text(name: str, value: float | None, digits: int = 3) -> str:
    """A value (SI) of the column or parameter `name` as text, in the unit that people read; a dash without a value."""
    if value is None or not np.isfinite(value):
        return "–"
    shown = _in_unit(name, [value])
    return style.with_unit(float(f"{value * shown.factor:.{digits}g}"), shown.unit)


def _in_unit(name: str, values: Sequence[float]) -> style.Shown:
    """How values of the column or parameter `name` are shown: in one unit that suits them."""
    unit = describe(name).unit
    return style.shown(describe(name), values, unit if unit in ("m^2", "1/m^2") else None)


def parameter_title(name: str) -> str:
    """The words of a parameter's name without its unit: `offset_m` as `offset`, `k1_per_m2` as `k1`."""
    return name.removesuffix(unit_ending(name)).replace("_", " ")


def spaced(name: str) -> str:
    """A name in words: `weakened_plate (plate 4)` as `weakened plate (plate 4)`, `tension_n 2.5` as `tension 2.5 N`."""

    def with_unit(match: re.Match[str]) -> str:
        key, value = match.groups()
        return f"{parameter_title(key)} {value_text(key, float(value))}" if unit_ending(key) else match[0]

    return re.sub(r"([a-z][a-z0-9_]*) (-?\d[\d.e+-]*)", with_unit, name).replace("_", " ")


def bias_of_calibration(diagnosis: Diagnosis) -> Iterator[str]:
    """A sentence for each constant on how far calibration without the named effects had biased it."""
    for name, symbol in CONSTANTS.items():
        constant = diagnosis.constants[name]
        nominal, calibrated, explained, low, high, _ = constant
        if not nominal or not explained or not diagnosis.effects:
            continue
        off = calibrated / explained - 1
        interval = f" ({estimate_texts(name, constant.estimate)[1]})" if np.isfinite(low) else ""
        said = f"Refitted alone, {symbol} came out as {value_text(name, calibrated)}; "
        said += f"with what is named it is {value_text(name, explained)}{interval}"
        if diagnosis.why:
            yield f"{said}. Neither is to be trusted while a mismatch remains."
        elif (np.isfinite(low) and low <= calibrated <= high) or abs(off) < 0.005:
            yield f"{said}: the same, as far as these recordings tell it."
        else:
            way = "high" if off > 0 else "low"
            yield f"{said}: part of the missing physics had hidden in a value {percent(abs(off))} too {way}."


def confirmation(diagnosis: Diagnosis) -> str:
    """Sentences on whether the held-out sequences confirm the named effects."""
    held = diagnosis.heldout
    if held is None:
        return "Not confirmed on held-out data: there are fewer than three sequences, so none was set aside."
    kept = f"Sequence{'s' * (len(held.sequences) > 1)} {few(held.sequences)} stayed out of every fit."
    if held.lost:
        kept += f" {held.lost} of their readings have no prediction, as a model has no equilibrium there."
    if not diagnosis.effects:
        return kept
    if not held.felt:
        kept += " Nothing of what is named acts there, so that it judges only the constants beside it."
    if held.chi2_calibrated <= held.readings:
        worse = ", and what is named predicts it less well" if held.chi2_explained > held.chi2_calibrated else ""
        return f"{kept} There the calibrated model errs no more than noise, tensions and tolerances allow{worse}."
    if held.gain <= 0:
        return f"{kept} There what is named does not predict better than refitted constants."
    removed = "leaves none" if held.gain == 1 else f"removes {percent(held.gain)}"
    together = f"There what is named {removed} of the squared error beyond the noise, all readings weighed together"
    return f"{kept} {together}. {_left_of_errors(held)}"


def _left_of_errors(held: HeldOut) -> str:
    """A sentence on the root mean square errors of the explained model on held-out sequences, relative to the noise."""
    pairs = (
        ("positions", held.rmse_explained_m, held.noise_m),
        ("angles", held.rmse_explained_rad, held.noise_rad),
    )
    told = [f"{error / noise:.2f} times the reading noise in {name}" for name, error, noise in pairs if error and noise]
    return f"The root mean square error, with what tensions and tolerances add to it, is then {' and '.join(told)}."


def law_sentence(diagnosis: Diagnosis) -> str | None:
    """Sentences on the empirical moment law of an unexplained diagnosis and its fit; None without a law."""
    law, chi2 = diagnosis.closure, diagnosis.chi2
    if law is None:
        return None
    gain = law.heldout_gain
    worth = ""
    if gain is not None:
        removed = "is worse than none" if gain < -1 else f"removes {percent(gain)} of the squared error beyond noise"
        worth = f"; on held-out sequences it {removed}"
    before, base = (
        (chi2.explained, "with what is named")
        if law.beside_named
        else (chi2.calibrated, f"with {constants_in_brief(diagnosis)} refitted")
    )
    fall = f"from {rounded(before)} {base} to {rounded(law.reduced_chi2)}"
    return f"{law.statement} It brings the squared error per degree of freedom {fall}{worth}."


def other_explanations(diagnosis: Diagnosis) -> Iterator[str]:
    """A sentence for each named effect on other places, on rivals and on other forms that the recording does not rule
    out."""
    for effect in diagnosis.effects:
        name = spaced(effect.name)
        for key, values in effect.among.items():
            best = effect.place[key]
            others = [_listed(other) for other in values if other != best]
            if others:
                yield f"{name}: {key} {_listed(best)} fits best, {key} {', '.join(others)} cannot be ruled out."
        if effect.rivals:
            rivals = dict.fromkeys(_rival_in_words(effect, rival) for rival in effect.rivals)
            sure = outweighs_rivals(effect, Settings(**diagnosis.settings))
            known = "; what is known beforehand speaks against that" if sure else ""
            yield f"{name}: these recordings cannot tell it from {', or '.join(rivals)}{known}."
        if effect.forms:
            forms = dict.fromkeys(_rival_in_words(effect, form) for form in effect.forms)
            yield f"{name}: the same effect in another form, {', or '.join(forms)}, explains these recordings too."


def _rival_in_words(effect: NamedEffect, rival: RivalEffect) -> str:
    """A rival by name and size; one of other cables alone as `the same of all cables` or `of cables 1, 2 alone`."""
    rest, other = (
        {key: value for key, value in occurrence.place.items() if key != "cables"} for occurrence in (effect, rival)
    )
    sizes = [f"{parameter_title(name)} {value_text(name, value)}" for name, value in rival.parameters.items()]
    sized = f" with {' and '.join(sizes)}" if sizes else ""
    if effect.kind != rival.kind or rest != other:
        return f"{spaced(rival.name)}{sized}"
    cables = rival.place.get("cables", ())
    which = "cable" if len(cables) == 1 else "cables"
    return (
        f"the same of {which} {few(cables, len(cables))} alone{sized}" if cables else f"the same of all cables{sized}"
    )


def _listed(value) -> str:
    """A value of a place as text; several values with commas."""
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def nothing_named(diagnosis: Diagnosis) -> str:
    """A sentence for the section of effects where none is named."""
    if diagnosis.why:
        return "No effect of the library explains what is left."
    if diagnosis.verdict == "ambiguous":
        return "Some effect is likely, but the recording does not tell which."
    if possible := possible_unnamed(diagnosis):
        verb = "is" if len(possible) == 1 else "are"
        return f"No effect is needed to explain these recordings; {in_words(possible)} {verb} not ruled out."
    return "Nothing is missing that these recordings could show."


def nothing_else(diagnosis: Diagnosis) -> str:
    """A sentence for the section of alternatives where there are none."""
    if diagnosis.why:
        cause = "Something outside the library, or a combination that was not tried"
        return f"{cause}: the place and the trend above are the lead."
    if not diagnosis.effects:
        return "Effects smaller than the sizes listed below could be present without being seen."
    place = "its place" if len(diagnosis.effects) == 1 else "place of each"
    return (
        f"The effects that come nearest were fitted in {place}, with everything else refitted, and fit clearly worse."
    )


def nothing_to_measure(diagnosis: Diagnosis) -> str:
    """A sentence for the section of further measurements where no load program is proposed."""
    if diagnosis.why:
        return (
            "No load program is proposed while no explanation stands. More readings where the mismatch sits, at loads "
            "between the recorded ones and on the way back, would sharpen the lead."
        )
    if diagnosis.share_of_stated < 1.0:
        return "No load program is proposed: no effect of the library rivals what is named. Quieter readings help."
    if not diagnosis.effects and (possible := possible_unnamed(diagnosis)):
        ruled = f"{in_words(possible).capitalize()} {'is' if len(possible) == 1 else 'are'} not ruled out."
        return f"No load program is proposed where nothing is named. {ruled}"
    return "No rivals are left that another load program would have to tell apart."
