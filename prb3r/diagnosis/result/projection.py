"""A diagnosis as plain content: the content of `diagnosis.json`, and the closing lines for people."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from prb3r.diagnosis.checks.heldout import MUCH_BETTER, HeldOut
from prb3r.diagnosis.checks.setup.find import Blunder
from prb3r.diagnosis.result.answer import by_sureness, exchanges, outweighs_rivals, sureness, what_to_do
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.effects import FittedLaw, NamedEffect, RivalEffect
from prb3r.diagnosis.result.proposals import proposed
from prb3r.diagnosis.result.statements import IN_WORDS
from prb3r.diagnosis.settings import Settings
from prb3r.markdown import few
from prb3r.model.files.cells import count

SCHEMA = 2
"""Version of the layout of `diagnosis.json`, for programs that read it."""
MENDED = "mended"
"""Name of the folder, beside the report, of the recording without the blunders of its set-up."""


IN_PART = (
    "What follows takes up part of the mismatch; it may stand in for something else: look, but change nothing yet."
)
"""What is said before effects that are named in part."""

MUCH_NOISE = 1.25
"""Factor on the stated noise from which on it is said beside chi-square, which is in units of the noise that was
found.  Choice: it makes chi-square smaller by a third."""


def summary_lines(diagnosis: Diagnosis) -> list[str]:
    """The closing lines: verdict, named effects, alternatives, constants, errors on sequences set aside, notes, and
    what to do next."""
    settings = Settings(**diagnosis.settings)
    fits = f"chi-square per degree of freedom {diagnosis.chi2.calibrated:.3g}"
    if diagnosis.effects:
        fits += f" with refitted constants alone, {diagnosis.chi2.explained:.3g} with what is named"
    if diagnosis.noise.scale >= MUCH_NOISE:
        fits += f" under {diagnosis.noise.scale:.2g} times the stated noise"
    mended = " once that is mended" if diagnosis.setup else ""
    lines = [*setup_sentences(diagnosis), f"{diagnosis.name}: {diagnosis.verdict}; {fits}{mended}"]
    if diagnosis.why:
        lines.append(f"- unexplained, since {diagnosis.why}")
        lines.append(f"- {diagnosis.mismatch.statement}")
    if any(effect.partial for effect in diagnosis.effects):
        lines.append(f"- {IN_PART}")
    for effect in by_sureness(diagnosis):
        sure = "" if diagnosis.verdict == "explained" else f"{sureness(effect)}: "
        lines.append(f"- {sure}{effect.statement}")
        seldom = " by readings, but is less likely beforehand" if outweighs_rivals(effect, settings) else ""
        lines += dict.fromkeys(f"  cannot be told apart{seldom}: {_with_values(rival)}" for rival in effect.rivals)
    if diagnosis.closure:
        lines.append(f"- {diagnosis.closure.statement}")
    if diagnosis.verdict == "ambiguous":
        lines += [f"- or {other.text}, {100 * other.probability:.0f} %" for other in exchanges(diagnosis)]
    lines += _constants_line(diagnosis)
    held = diagnosis.heldout
    for factor, unit, errors in _held_errors(held) if held else ():
        calibrated, explained, noise = (f"{factor * error:.3g}" for error in errors[:3])
        where, before = few(held.sequences) if held else "", f"{calibrated} -> " if diagnosis.effects else ""
        parts = ""
        if (made := errors[3]) is not None and made < MUCH_BETTER * errors[1]:
            parts = f" with all parts as drawn, {factor * made:.3g} {unit} with parts as the other sequences tell them"
        error = f"held out ({where}): error {before}{explained} {unit}{parts}, noise {noise} {unit}"
        lines.append(error + (f"; {count(held.lost, 'reading')} not predicted" if held and held.lost else ""))
    lines += [f"note: {remark}" for remark in diagnosis.remarks]
    if held is None:
        lines.append("not confirmed on held-out data")
    return [*lines, *(f"next: {text}" for text in (what_to_do(diagnosis),) if text)]


def _constants_line(diagnosis: Diagnosis) -> list[str]:
    """A line on Young's modulus and the friction coefficient in the explained model, those that the manipulator has; no
    line where it has none."""
    said = []
    for name, constant in diagnosis.constants.items():
        if constant.nominal and constant.explained:
            words, factor, unit = IN_WORDS[name]
            said.append(f"{words.removeprefix('the ')} {constant.estimate.times(factor)}{unit}")
    return [f"constants: {', '.join(said)}"] if said else []


def setup_sentences(diagnosis: Diagnosis) -> list[str]:
    """The blunders of the set-up, and where the mended recording is, in sentences; empty without blunders."""
    if not diagnosis.setup:
        return []
    last = diagnosis.setup[-1]
    sentences = [blunder.statement for blunder in diagnosis.setup]
    return [*sentences, f"Mended in {mended_file(last)}; if that is right, all below holds: check, and diagnose it."]


def mended_file(blunder: Blunder) -> str:
    """Path of the mended file of a blunder, relative to the folder of the report."""
    return f"{MENDED}/{blunder.file}.{'toml' if blunder.file == 'manipulator' else 'csv'}"


def rival_names(effect: NamedEffect) -> list[str]:
    """Names of the rivals of an effect and of its other forms, each once."""
    return list(dict.fromkeys(rival.name for rival in (*effect.rivals, *effect.forms)))


def _with_values(rival: RivalEffect) -> str:
    """A rival by name, with the fitted values that it would have to have, in SI units."""
    return ", ".join([rival.name, *(f"{name} {value:.3g}" for name, value in rival.parameters.items())])


def _held_errors(held: HeldOut) -> Iterator[tuple[float, str, tuple[float, float, float, float | None]]]:
    """For positions and for angles, as far as they were held out: the factor and unit in which they are shown, then the
    error of the calibrated and of the explained model, the noise, and the error with parts as they were made, if this
    is known, m or rad."""
    for factor, unit, (calibrated, explained, noise), made in (
        (1e3, "mm", (held.rmse_calibrated_m, held.rmse_explained_m, held.noise_m), held.rmse_made_m),
        (
            180 / np.pi,
            "degrees",
            (held.rmse_calibrated_rad, held.rmse_explained_rad, held.noise_rad),
            held.rmse_made_rad,
        ),
    ):
        if calibrated is not None and explained is not None and noise is not None:
            yield factor, unit, (calibrated, explained, noise, made)


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The content of `diagnosis.json`: plain numbers, texts, lists and mappings; None for what is not known."""
    mismatch, held, chi2 = diagnosis.mismatch, diagnosis.heldout, diagnosis.chi2
    record = {
        "schema": SCHEMA,
        "verdict": diagnosis.verdict,
        "noise": {
            "reduced_chi2_nominal": chi2.nominal,
            "reduced_chi2_calibrated": chi2.calibrated,
            "reduced_chi2_explained": chi2.explained,
            **diagnosis.noise.record,
        },
        "calibration": {name: constant.record for name, constant in diagnosis.constants.items()}
        | {"frame": diagnosis.frame._asdict()},
        "effects": [_effect(effect) for effect in diagnosis.effects],
        "models": [model._asdict() for model in diagnosis.models],
        "alternatives": diagnosis.alternatives,
        "tolerances": [tolerance._asdict() for tolerance in diagnosis.tolerances],
        "checks": [check._asdict() for check in diagnosis.checks],
        "setup": [
            {"blunder": blunder.blunder, "statement": blunder.statement, "mended": mended_file(blunder)}
            for blunder in diagnosis.setup
        ],
        "remarks": diagnosis.remarks,
        "mismatch": {
            "plates": mismatch.plates,
            "sequences": mismatch.sequences,
            "depends_on": mismatch.depends_on,
            "statement": mismatch.statement,
        },
        "closure": _closure(diagnosis.closure),
        "heldout": None
        if held is None
        else {
            "sequences": held.sequences,
            "rmse_calibrated_m": held.rmse_calibrated_m,
            "rmse_explained_m": held.rmse_explained_m,
            "noise_m": held.noise_m,
            "rmse_calibrated_rad": held.rmse_calibrated_rad,
            "rmse_explained_rad": held.rmse_explained_rad,
            "noise_rad": held.noise_rad,
        },
        "next_experiment": [
            {
                "statement": proposal.statement,
                "separates": proposal.separates,
                "separation": proposal.separation,
                "steps": proposal.experiment.steps.to_dict("records"),
            }
            for proposal in proposed(diagnosis.experiments)
        ],
    }
    record["posterior"] = diagnosis.posterior.model_dump(exclude_none=True)
    if diagnosis.settings:
        record["settings"] = diagnosis.settings
    return _plain(record)


def _effect(effect: NamedEffect) -> dict[str, Any]:
    """A named effect as `diagnosis.json` holds it."""
    parameters: dict[str, Any] = {
        key: {"value": value, "set": effect.among.get(key, (value,))} for key, value in effect.place.items()
    }
    parameters |= {key: estimate.record for key, estimate in effect.parameters.items()}
    record = {
        "effect": effect.kind,
        "parameters": parameters,
        "statement": effect.statement,
        "probability": effect.probability,
        "certain": effect.certain,
        "indistinguishable_from": rival_names(effect),
        "rivals": [
            {"name": rival.name, "parameters": dict(rival.parameters)} for rival in (*effect.rivals, *effect.forms)
        ],
        "delta_bic": effect.delta_bic,
        "heldout_gain": effect.heldout_gain,
    }
    return record | ({"partial": True} if effect.partial else {})


def _closure(law: FittedLaw | None) -> dict[str, Any] | None:
    """The empirical law as `diagnosis.json` holds it; None without one."""
    if law is None:
        return None
    return {
        "statement": law.statement,
        "effect": law.effect.model_dump(exclude_none=True),
        "reduced_chi2": law.reduced_chi2,
        "heldout_gain": law.heldout_gain,
    }


def _plain(value: Any) -> Any:
    """The value with numbers of numpy as Python's, tuples as lists, and nan and inf as None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value
