"""What a diagnosis says in sentences for a mechanical engineer."""

from collections.abc import Iterator

import numpy as np

from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.projection import calibration, few
from prb3r.present import style
from prb3r.quantities import describe, unit_ending

CONSTANTS = {"youngs_modulus_pa": "E", "friction_coefficient": "μ"}


def verdict(diagnosis: Diagnosis) -> str:
    """The verdict in a sentence or two."""
    count = len(diagnosis.named)
    one, effects = count == 1, "one effect" if count == 1 else f"{count} effects together"
    if diagnosis.verdict == "adequate":
        return "Adequate: with its constants refitted, the nominal model leaves nothing that these recordings show."
    if diagnosis.verdict == "explained":
        return f"Explained: {effects}, absent from the nominal model, account{'s' * one} for the mismatch."
    if diagnosis.verdict == "ambiguous":
        what = f"{effects} account{'s' * one} for the mismatch, but so would others"
        return f"Explained, but not by one cause alone: {what} that these recordings cannot tell apart."
    text = f"Unexplained: {diagnosis.why}."
    if not count:
        return text
    if not diagnosis.choice.structured:
        return f"{text} {'That' if one else 'Those'} named below would do it: a lead, not a finding."
    which = "One effect of the library helps" if one else f"{count} effects of the library together help"
    return f"{text} {which} in part."


def fit_quality(diagnosis: Diagnosis) -> str:
    """Chi-squares, and how to read them."""
    nominal = diagnosis.nominal_chi2
    first = "no equilibrium at all with the nominal constants" if nominal is None else f"{number(nominal)} nominal"
    after = f", {number(diagnosis.explained.reduced)} with what is named" if diagnosis.named else ""
    return (
        f"Squared error per degree of freedom, in units of the noise: {first}, "
        f"{number(diagnosis.calibrated.reduced)} with E and μ refitted{after}. A right model is near 1."
    )


def number(value: float | None) -> str:
    """Three significant digits."""
    return "–" if value is None or not np.isfinite(value) else style.digits(float(f"{value:.3g}"))


def percent(share: float) -> str:
    return f"{number(100 * share)} %" if abs(share) < 0.02 else f"{100 * share:.0f} %".replace("-", "−")


def quantity(name: str, value: float | None) -> str:
    """A value with the unit that people read."""
    if value is None or not np.isfinite(value):
        return "–"
    unit = describe(name).unit
    shown = style.shown(describe(name), [value], unit if unit in ("m^2", "1/m^2") else None)
    return style.with_unit(float(f"{value * shown.factor:.4g}"), shown.unit)


def parameter(name: str) -> str:
    """`offset_m` as `offset`, `k1_per_m2` as `k1`."""
    return name.removesuffix(unit_ending(name)).replace("_", " ")


def effect(hypothesis: Hypothesis) -> str:
    """`weakened_plate (plate 4)` as `weakened plate (plate 4)`."""
    return hypothesis.name.replace("_", " ")


def hidden(diagnosis: Diagnosis) -> Iterator[str]:
    """What calibration alone had hidden: how far off its constants are."""
    found = calibration(diagnosis)
    for name, symbol in CONSTANTS.items():
        nominal, calibrated, explained = (found[name][key] for key in ("nominal", "calibrated", "explained"))
        if not nominal or not explained or not diagnosis.named:
            continue
        off = calibrated / explained - 1
        low, high = found[name]["low"], found[name]["high"]
        interval = f" ({quantity(name, low)} to {quantity(name, high)})" if np.isfinite(low) else ""
        said = f"Refitted alone, {symbol} came out as {quantity(name, calibrated)}; "
        said += f"with what is named it is {quantity(name, explained)}{interval}"
        if diagnosis.verdict == "unexplained":
            yield f"{said}. Neither is to be trusted while a mismatch remains."
        elif (np.isfinite(low) and low <= calibrated <= high) or abs(off) < 0.005:
            yield f"{said}: little had hidden there."
        else:
            way = "high" if off > 0 else "low"
            yield f"{said}: part of the missing physics had hidden in a value {percent(abs(off))} too {way}."


def held_out(diagnosis: Diagnosis) -> str:
    """What the sequences say that no fit has seen."""
    held = diagnosis.heldout
    if held is None:
        return "Not confirmed on held-out data: there are fewer than three sequences, so none was set aside."
    kept = f"Sequence{'s' * (len(held.sequences) > 1)} {few(held.sequences)} stayed out of every fit."
    if not diagnosis.named:
        return kept
    if held.chi2_calibrated <= held.readings:
        return f"{kept} There the calibrated model errs no more than the noise."
    if held.gain <= 0:
        return f"{kept} There what is named does not predict better than refitted constants."
    return f"{kept} There what is named removes {percent(held.gain)} of the squared error beyond the noise."


def closure(diagnosis: Diagnosis) -> str | None:
    """The empirical law of an unexplained diagnosis, and what it is worth."""
    if diagnosis.closure is None:
        return None
    gain = diagnosis.closure_gain
    worth = (
        "" if gain is None else f"; on held-out sequences it removes {percent(gain)} of the squared error beyond noise"
    )
    beside = len(diagnosis.closure.fitted.model.hypotheses) > 1
    base, what = (
        (diagnosis.explained, "with what is named") if beside else (diagnosis.calibrated, "with E and μ refitted")
    )
    fall = f"from {number(base.reduced)} {what} to {number(diagnosis.closure.fitted.reduced)}"
    return f"{diagnosis.closure.statement} It brings the squared error per degree of freedom {fall}{worth}."


def alternatives(diagnosis: Diagnosis) -> Iterator[str]:
    """What else it could be."""
    for each in diagnosis.named:
        name = effect(each.hypothesis)
        for key, (value, among) in each.places.items():
            others = [_listed(other) for other in among if other != value]
            if others:
                yield f"{name}: {key} {_listed(value)} fits best, {key} {', '.join(others)} cannot be ruled out."
        rivals = list(dict.fromkeys(effect(rival.hypothesis) for rival in each.rivals))
        if rivals:
            yield f"{name}: these recordings cannot tell it from {', '.join(rivals)}."


def _listed(value) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def nothing_else(diagnosis: Diagnosis) -> str:
    """What is said where there are no alternatives."""
    if diagnosis.verdict == "unexplained":
        what = "Something outside the library, or a combination that was not tried"
        return f"{what}: the place and the trend above are the lead."
    if not diagnosis.named:
        return "Effects smaller than the sizes listed below could be present without being seen."
    return (
        "The effects that come nearest were fitted in its place, with everything else refitted, and fit clearly worse."
    )


def nothing_to_measure(diagnosis: Diagnosis) -> str:
    """What is said where no load program is proposed."""
    if diagnosis.verdict == "unexplained":
        return (
            "No load program is proposed while no explanation stands. More readings where the mismatch sits, at loads "
            "between the recorded ones and on the way back, would sharpen the lead."
        )
    return "No rivals are left that another load program would have to tell apart."
