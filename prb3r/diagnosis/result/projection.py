"""A diagnosis as plain content: what goes into `diagnosis.json`, and a few lines for people."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from prb3r.diagnosis.checks.heldout import HeldOut
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.named import Named
from prb3r.diagnosis.result.statements import Estimate
from prb3r.diagnosis.search.experiment import Experiment

SCHEMA = 1


class Proposal(NamedTuple):
    """A load program that is proposed, and which explanations it tells apart."""

    experiment: Experiment
    separates: tuple[tuple[str, str], ...]
    separation: float
    """Squared whitened distance of the pair that it separates least."""
    asked: float
    """Distance that is enough to rank two explanations rightly."""

    @property
    def statement(self) -> str:
        rivals = "; ".join(f"{a} from {b}" for a, b in self.separates).replace("_", " ")
        enough = "enough to rank them rightly" if self.experiment.resolves else "still too little to rank them surely"
        title = self.experiment.title[0].upper() + self.experiment.title[1:]
        return (
            f"{title}: together with what is recorded, that separates {rivals} by a squared distance of "
            f"{self.separation:.3g} in units of the noise ({self.asked:.3g} is asked), {enough}."
        )


def proposals(diagnosis: Diagnosis) -> list[Proposal]:
    """The proposed experiments, each load program once."""
    asked = diagnosis.explained.model.settings.resolved
    by_title: dict[str, list[tuple[str, str, Experiment]]] = {}
    for each in diagnosis.experiments:
        by_title.setdefault(each[2].title, []).append(each)
    return [
        Proposal(own[0][2], tuple((a, b) for a, b, _ in own), min(each.separation for _, _, each in own), asked)
        for own in by_title.values()
    ]


def summary(diagnosis: Diagnosis) -> list[str]:
    """A few lines: the verdict, what was found, how much better the sequences set aside are predicted."""
    before, after = diagnosis.calibrated.reduced, diagnosis.explained.reduced
    fits = f"chi-square per degree of freedom {before:.3g}"
    if diagnosis.named:
        fits += f" with refitted constants alone, {after:.3g} with what is named"
    lines = [f"{diagnosis.recording.name}: {diagnosis.verdict}; {fits}"]
    for each in diagnosis.named:
        lines.append(f"- {'in part: ' if each.partial else ''}{each.statement}")
        lines += [f"  cannot be told apart: {name}" for name in dict.fromkeys(r.hypothesis.name for r in each.rivals)]
    if diagnosis.verdict == "unexplained":
        lines.append(f"- {diagnosis.mismatch.statement}")
        if diagnosis.closure:
            lines.append(f"- {diagnosis.closure.statement}")
    held = diagnosis.heldout
    for factor, unit, errors in _held_errors(held) if held and diagnosis.named else ():
        calibrated, explained, noise = (f"{factor * each:.3g}" for each in errors)
        where = few(held.sequences) if held else ""
        lines.append(f"held out ({where}): error {calibrated} -> {explained} {unit}, noise {noise} {unit}")
    if held is None:
        lines.append("not confirmed on held-out data")
    return lines


def few(names: Sequence[str], most: int = 3) -> str:
    """Names in a row, of many only the first."""
    return ", ".join(names) if len(names) <= most else f"{', '.join(names[:most])} and {len(names) - most} more"


def _held_errors(held: HeldOut) -> Iterator[tuple[float, str, tuple[float, float, float]]]:
    """Factor and unit they are shown in, then errors calibrated and explained, and the noise; m or rad."""
    for factor, unit, errors in (
        (1e3, "mm", (held.rmse_calibrated_m, held.rmse_explained_m, held.noise_m)),
        (180 / np.pi, "degrees", (held.rmse_calibrated_rad, held.rmse_explained_rad, held.noise_rad)),
    ):
        calibrated, explained, noise = errors
        if calibrated is not None and explained is not None and noise is not None:
            yield factor, unit, (calibrated, explained, noise)


def as_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The diagnosis as plain numbers, texts, lists and mappings; what is not known is None."""
    mismatch, held = diagnosis.mismatch, diagnosis.heldout
    plain = {
        "schema": SCHEMA,
        "verdict": diagnosis.verdict,
        "noise": {
            "reduced_chi2_nominal": diagnosis.nominal_chi2,
            "reduced_chi2_calibrated": diagnosis.calibrated.reduced,
            "reduced_chi2_explained": diagnosis.explained.reduced,
        },
        "calibration": calibration(diagnosis),
        "effects": [_effect(each) for each in diagnosis.named],
        "mismatch": {
            "plates": mismatch.plates,
            "sequences": mismatch.sequences,
            "depends_on": mismatch.depends_on,
            "statement": mismatch.statement,
        },
        "closure": _closure(diagnosis),
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
                "statement": each.statement,
                "separates": each.separates,
                "separation": each.separation,
                "steps": each.experiment.steps.to_dict("records"),
            }
            for each in proposals(diagnosis)
        ],
    }
    return _plain(plain)


def calibration(diagnosis: Diagnosis) -> dict[str, Any]:
    """The constants: nominal, calibrated alone, and with the effects; a 95 % interval where one is deserved."""
    nominal = diagnosis.recording.manipulator
    constants = diagnosis.explained.constants
    return {
        "youngs_modulus_pa": _constant(diagnosis, nominal.youngs_modulus_pa, "log_stiffness"),
        "friction_coefficient": _constant(diagnosis, nominal.friction.coefficient, "log_friction"),
        "frame": {"rotation_rad": constants.rotation, "x_m": constants.x, "y_m": constants.y},
    }


def _constant(diagnosis: Diagnosis, nominal: float, name: str) -> dict[str, Any]:
    explained = diagnosis.explained
    found = {"nominal": nominal}
    for key, fitted in (("calibrated", diagnosis.calibrated), ("explained", explained)):
        found[key] = nominal * float(np.exp(getattr(fitted.constants, name)))
    reach = _reach(explained, name)
    return found | {"low": found["explained"] * np.exp(-reach), "high": found["explained"] * np.exp(reach)}


def _reach(fitted: Fit, name: str) -> float:
    """Half the 95 % interval of a constant by the linearised covariance; NaN where none is deserved."""
    if name not in fitted.model.varied or fitted.reduced >= fitted.model.settings.far_from_one:
        return np.nan
    number = fitted.model.varied.index(name)
    return fitted.model.settings.interval_sd * float(np.sqrt(fitted.covariance[number, number]))


def _effect(named: Named) -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    for key, value in named.hypothesis.place:  # a law has no other place
        best, among = named.places.get(key, (value, (value,)))
        parameters[key] = {"value": best, "set": among}
    parameters |= {key: _estimate(each) for key, each in named.parameters.items()}
    plain = {
        "effect": named.hypothesis.kind,
        "parameters": parameters,
        "statement": named.statement,
        "indistinguishable_from": list(dict.fromkeys(rival.hypothesis.name for rival in named.rivals)),
        "delta_bic": named.delta_bic,
        "heldout_gain": named.heldout_gain,
    }
    return plain | ({"partial": True} if named.partial else {})


def _estimate(each: Estimate) -> dict[str, Any]:
    return {"value": each.value, "low": each.low, "high": each.high}


def _closure(diagnosis: Diagnosis) -> dict[str, Any] | None:
    """The fitted empirical law of an unexplained diagnosis."""
    closure = diagnosis.closure
    if closure is None:
        return None
    return {
        "statement": closure.statement,
        "effect": closure.effect.model_dump(exclude_none=True),
        "reduced_chi2": closure.fitted.reduced,
        "heldout_gain": diagnosis.closure_gain,
    }


def _plain(value: Any) -> Any:
    """Numbers of numpy as Python's, tuples as lists, nan and inf as None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return value
