"""Blunders of the set-up: each one that is known is undone, and the recording held against its manipulator again.

What is said of a blunder is the logarithm of a likelihood ratio, a photograph counting as one number (`robust.py`): by
chance the largest among `k` alternatives exceeds :math:`\\ln(k / a)` in a share `a` of all right recordings.
"""

from dataclasses import dataclass, replace

import numpy as np

from prb3r.diagnosis.checks.setup.alternative import Alternative, File, Mended
from prb3r.diagnosis.checks.setup.cables import cable_blunders
from prb3r.diagnosis.checks.setup.order import order_blunders
from prb3r.diagnosis.checks.setup.pictures import picture_blunders
from prb3r.diagnosis.checks.setup.robust import Standing, Trier, sight, trier
from prb3r.diagnosis.checks.setup.units import unit_blunders
from prb3r.diagnosis.fit.prediction import Constants, predictor
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording

NOISE_LOSS = 0.534
"""Mean robust misfit of a reading with the stated Gaussian noise: the mean of ln(1 + z^2)."""


@dataclass(frozen=True, eq=False)
class Blunder:
    """A blunder that explains what no constants can."""

    blunder: str
    """What was done."""
    alike: tuple[str, ...]
    """Other blunders that would look the same."""
    file: File
    """That has to be mended."""
    mended: Recording
    gain: float
    """Logarithm of the likelihood ratio."""

    @property
    def statement(self) -> str:
        """One sentence."""
        others = f", or what looks the same here: {'; or '.join(self.alike)}" if self.alike else ""
        return f"It looks as if {self.blunder}{others}."


@dataclass(frozen=True, eq=False)
class Trial:
    """An alternative, and how the recording stands with its manipulator then."""

    alternative: Alternative
    mended: Mended
    standing: Standing
    gain: float


def alternatives(recording: Recording) -> list[Alternative]:
    """Every blunder that a recording could hold."""
    families = (picture_blunders, cable_blunders, unit_blunders, order_blunders)
    return [alternative for family in families for alternative in family(recording)]


def find_blunders(recording: Recording, settings: Settings) -> tuple[Blunder, ...]:
    """The blunders of a recording, the plainest first, each looked for with those before it mended; mostly none."""
    out: list[Blunder] = []
    for _ in range(settings.most_blunders):
        blunder = find_blunder(out[-1].mended if out else recording, settings)
        if blunder is None:
            break
        out.append(blunder)
    return tuple(out)


def find_blunder(recording: Recording, settings: Settings) -> Blunder | None:
    """The blunder that explains most of a recording's misfit, if one explains more than chance and physics could."""
    tried, among = trials(recording, settings)
    threshold = np.log(among / settings.blunder_rate)
    if not tried or tried[0].gain < threshold:
        return None
    best = tried[0]
    alike = tuple(t.alternative.blunder for t in tried[1:] if t.gain > best.gain - settings.close_fit / 2)
    return Blunder(best.alternative.blunder, alike, best.alternative.file, best.mended.recording, best.gain)


def trials(recording: Recording, settings: Settings) -> tuple[list[Trial], int]:
    """The most promising alternatives with refitted constants, the best first, and among how many they are."""
    among, trying, base = alternatives(recording), trier(recording, settings), predictor(recording)
    whole = np.arange(recording.readings.count)
    here = as_recorded(recording, trying)
    grid = [*(Constants(float(np.log(factor))) for factor in settings.coarse_factors), here.constants]
    seen = [sight(base, constants, base.equilibria(constants)) for constants in grid]
    framed = [trying.framed(base, whole, *known) for known in zip(grid, seen, strict=True)]
    here = min(here, *framed, key=lambda standing: standing.total)
    rough = []
    for alternative in among:
        mended = alternative.mend(recording)
        alone = mended.recording.loads is recording.loads and mended.recording.manipulator is recording.manipulator
        predict = replace(base, recording=mended.recording) if alone else predictor(mended.recording)
        standings = []
        for constants, known in zip(grid, seen, strict=True):
            view = known if alone else sight(predict, constants, predict.equilibria(constants))
            standings.append(trying.framed(predict, mended.rows, constants, view))
        rough.append(max((trial(here, alternative, mended, standing) for standing in standings), key=_gain))
    full = []
    for tried in sorted(rough, key=_gain)[: -settings.blunders_fitted - 1 : -1]:
        standing = trying.fitted(tried.mended.recording, tried.mended.rows, tried.standing.constants)
        full.append(tried if standing is None else trial(here, tried.alternative, tried.mended, standing))
    return sorted(full, key=_gain, reverse=True), len(among)


def _gain(tried: Trial) -> float:
    return tried.gain


def as_recorded(recording: Recording, trying: Trier) -> Standing:
    """The recording as it is with the constants that fit it best, from the first stiffness at which all is in balance."""
    rows = np.arange(recording.readings.count)
    for factor in trying.settings.start_factors:
        standing = trying.fitted(recording, rows, Constants(float(np.log(factor))))
        if standing is not None:
            return standing
    predict = predictor(recording)
    return trying.framed(predict, rows, Constants(), sight(predict, Constants(), predict.equilibria(Constants())))


def trial(here: Standing, alternative: Alternative, mended: Mended, there: Standing) -> Trial:
    """An alternative against the recording as it is.

    Of a photograph only what the blunder concerns counts, as one number, in units of how far off the rest of the
    photograph is: where all is wrong, it is no evidence that some of it is less so with other labels.
    """
    step, before, after = here.recording.readings.step, here.loss, here.loss.copy()
    after[mended.rows] = there.loss
    concerned = touched(here.recording, mended)
    count, others = (np.bincount(step, chosen, minlength=step.max() + 1) for chosen in (concerned, ~concerned))
    rest = np.bincount(step, np.where(concerned, 0.0, after), minlength=step.max() + 1) / np.maximum(others, 1)
    slack = np.where(concerned, np.expm1(rest)[step], 0.0)
    fall = np.logaddexp(before, _log(slack)) - np.logaddexp(after, _log(slack))
    weight = np.where(count[step] > 0, concerned, True) / np.where(count > 0, count, others)[step]
    gain = float((fall * weight).sum()) + here.improbable - there.improbable
    return Trial(alternative, mended, there, gain)


def _log(values: np.ndarray) -> np.ndarray:
    """Natural logarithm, minus infinity for zero."""
    return np.log(values, out=np.full(values.shape, -np.inf), where=values > 0)


def touched(recording: Recording, mended: Mended) -> np.ndarray:
    """(r,) readings of a recording that its mending concerns."""
    changed, before = mended.recording, recording.readings.where(mended.rows)
    if changed.manipulator is not recording.manipulator:
        return np.ones(recording.readings.count, bool)
    loads = zip(changed.loads, recording.loads, strict=True)
    moved = np.any([(a != b).reshape(len(a), -1).any(1) for a, b in loads if a is not None], axis=0)
    out = np.ones(recording.readings.count, bool)  # what belongs nowhere any more is concerned
    out[mended.rows] = moved[before.step] | np.any([a != b for a, b in zip(changed.readings, before, strict=True)], axis=0)
    return out
