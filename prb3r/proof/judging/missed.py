"""Errors of predictions for other loads and another design, against what the rig truly does there."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from prb3r.proof.concealed.design import Design
from prb3r.proof.concealed.elsewhere import OTHER_DESIGN, built_there, target_states
from prb3r.proof.concealed.labels import Label
from prb3r.proof.concealed.real import build_of
from prb3r.proof.judging.verdict import Verdict
from prb3r.proof.rig.simulate import RigStates
from prb3r.proof.settings import SETTINGS


class Missed(NamedTuple):
    """Errors of the predictions at one target."""

    name: str
    """Name of the target."""
    calibrated: float
    """Mean squared error by calibration alone, in variances of a reading: of positions, or of angles where no positions
    are read.  Of another design that is made exactly as drawn, since nobody knows better what rigs of it do."""
    explained: float
    """Mean squared error with the explanation, likewise."""
    covered: float
    """Share of the coordinates of the rig as it was made inside their 95 % bands, which hold how rigs are made."""
    calibrated_m: float
    """Root mean square distance of predicted and true disk positions by calibration alone, m."""
    explained_m: float
    """Root mean square distance with the explanation, m."""

    @property
    def removed(self) -> float:
        """Share of the squared error of calibration alone that the explanation removes; 0 without a verdict."""
        return 1 - self.explained / self.calibrated if np.isfinite(self.calibrated) else 0.0

    @property
    def counts(self) -> bool:
        """Whether calibration alone misses by more than the noise."""
        return self.calibrated > SETTINGS.real.excess**2


def miss_of(design: Design, label: Label, verdict: Verdict) -> tuple[Missed, ...]:
    """The errors of a verdict's predictions, target by target; a failed verdict removes no error and covers nothing."""
    if verdict.verdict == "failed" and not label.blunder:
        return tuple(Missed(target["name"], np.inf, np.inf, 0.0, np.nan, np.nan) for target in label.targets)
    out = []
    for forecast in verdict.elsewhere:
        target = next(target for target in label.targets if target["name"] == forecast.name)
        build = build_of(label) if label.build else None
        asked = design, target, label.effects, label.constants
        made = _places(target_states(*asked, built_there(target, build), label.foreign))
        drawn = target["name"] == OTHER_DESIGN
        true = _places(target_states(*asked, None, label.foreign)) if drawn else made
        sd = design.measurement.get("position_sd_m")
        columns, unit = (slice(0, 2), sd) if sd else (slice(2, 3), design.measurement["angle_sd_rad"])
        lost = SETTINGS.protocol.lost_share * (design.length if sd else np.pi)

        def off(predicted: np.ndarray, true=true, columns=columns, lost=lost) -> np.ndarray:
            """Errors of the coordinates that count; `lost` where there is no prediction."""
            away = (predicted[:, 1:] - true)[..., columns]
            return np.where(np.isfinite(away), away, lost)

        inside = (forecast.low[:, 1:] <= made) & (made <= forecast.high[:, 1:])
        before, after = (
            float(np.mean((off(predicted) / unit) ** 2)) for predicted in (forecast.calibrated, forecast.explained)
        )
        before_m, after_m = (
            _distance(predicted[:, 1:] - true) for predicted in (forecast.calibrated, forecast.explained)
        )
        out.append(Missed(forecast.name, before, after, float(inside.mean()), before_m, after_m))
    return tuple(out)


def _places(states: Sequence[RigStates] | None) -> np.ndarray:
    """(s, n, 3) x, y (m) and angle (rad) of disks 1..n at all steps of a rig that has an equilibrium at each."""
    assert states is not None
    return np.stack([np.concatenate([getattr(s, f) for s in states]) for f in ("x", "y", "angle")], -1)[:, 1:]


def _distance(away: np.ndarray) -> float:
    """Root mean square length of the position errors in `away` (s, n, 3), m, of those that are finite; NaN of none."""
    squares = (away[..., :2] ** 2).sum(-1)
    known = np.isfinite(squares)
    return float(np.sqrt(squares[known].mean())) if known.any() else np.nan
