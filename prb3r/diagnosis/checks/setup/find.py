"""Blunders of the set-up: each one that is known is undone, and the recording held against its manipulator again.

What speaks for a blunder is the logarithm of a likelihood ratio, a photograph counting as one number (`robust.py`): by
chance the largest among `k` remedies exceeds :math:`\\ln(k / a)` in a share `a` of all right recordings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.checks.setup.cables import cable_blunders
from prb3r.diagnosis.checks.setup.order import order_blunders
from prb3r.diagnosis.checks.setup.physics import imitations
from prb3r.diagnosis.checks.setup.pictures import picture_blunders
from prb3r.diagnosis.checks.setup.remedy import File, Mended, Remedy, with_manipulator
from prb3r.diagnosis.checks.setup.robust import Sight, Standing, Trier, sight, trier
from prb3r.diagnosis.checks.setup.units import unit_blunders
from prb3r.diagnosis.fit.prediction import Constants, predictor
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.recording.recording import Recording

IMITATIONS_FITTED = 2
"""Of the effects that imitate a blunder, how many are fitted in full before the best is kept."""


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
    """A remedy, and how the recording stands with its manipulator then."""

    remedy: Remedy
    mended: Mended
    standing: Standing
    gain: float
    """Logarithm of the likelihood ratio to the recording as it is."""
    total: float
    """Robust misfit of all photographs and improbability of the constants."""


def remedies(recording: Recording) -> list[Remedy]:
    """Every blunder that a recording could hold."""
    families = (picture_blunders, cable_blunders, unit_blunders, order_blunders)
    return [remedy for family in families for remedy in family(recording)]


@dataclass(frozen=True, eq=False)
class Attempt:
    """A recording, what could be wrong with it, and where that is tried."""

    recording: Recording
    among: list[Remedy]
    trying: Trier
    here: Standing
    """The recording as it is."""
    grid: tuple[Constants, ...]
    """Constants with which a remedy is tried before any are fitted."""
    seen: tuple[Sight, ...]
    """Of the recording as it is, at each of `grid`."""

    def rough(self, remedy: Remedy) -> Trial:
        """A remedy at the best of the coarse constants, seen from where it fits best."""
        mended = remedy.mend(self.recording)
        changed = mended.recording
        alone = changed.loads is self.recording.loads and changed.manipulator is self.recording.manipulator
        predict, tried = predictor(changed), []
        for constants, known in zip(self.grid, self.seen, strict=True):
            view = known if alone else sight(predict, constants, predict.equilibria(constants))
            standing = self.trying.framed(predict, mended.rows, constants, view)
            tried.append(trial(self.here, remedy, mended, standing))
        return max(tried, key=_gain)

    def full(self, tried: Trial) -> Trial:
        """The same with refitted constants."""
        mended = tried.mended
        standing = self.trying.fitted(mended.recording, mended.rows, tried.standing.constants)
        return tried if standing is None else trial(self.here, tried.remedy, mended, standing)


def attempt_on(recording: Recording, settings: Settings) -> Attempt:
    """A recording as it is, with the constants that fit it best, and all that could be wrong with it."""
    trying, base = trier(recording, settings), predictor(recording)
    rows = np.arange(recording.readings.count)
    coarse = [Constants(float(np.log(factor))) for factor in settings.coarse_factors]
    starts = (Constants(float(np.log(factor))) for factor in settings.start_factors)
    fitted = next((standing for start in starts if (standing := trying.fitted(recording, rows, start))), None)
    grid = (*coarse, *([fitted.constants] if fitted else []))
    seen = tuple(sight(base, constants, base.equilibria(constants)) for constants in grid)
    standings = [trying.framed(base, rows, *known) for known in zip(grid, seen, strict=True)]
    here = min([*standings, *([fitted] if fitted else [])], key=lambda standing: standing.total)
    return Attempt(recording, remedies(recording), trying, here, grid, seen)


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
    attempt = attempt_on(recording, settings)
    tried, threshold = trials(attempt), np.log(len(attempt.among) / settings.blunder_rate)
    best = tried[0]
    if best.gain < threshold or is_physics(attempt, best, threshold):
        return None
    alike = tuple(t.remedy.blunder for t in tried[1:] if t.total < best.total + settings.close_fit / 2)
    return Blunder(best.remedy.blunder, alike, best.remedy.file, best.mended.recording, best.gain)


def is_physics(attempt: Attempt, best: Trial, threshold: float) -> bool:
    """Whether physics that imitates blunders explains more, and the blunder neither much beside it nor a part of it."""
    if best.total < len(attempt.recording.of_sequence):  # within the noise: there is no more to explain
        return False
    imitated = imitation(attempt, best.gain)
    if imitated is None or imitated.gain <= best.gain:
        return False
    effects = imitated.mended.recording.manipulator.effect
    if _beside(attempt, effects, best).gain >= threshold:
        return False
    added = range(len(attempt.recording.manipulator.effect), len(effects))
    instead = (_beside(attempt, [*effects[:k], *effects[k + 1 :]], best) for k in added)
    return all(tried.total > imitated.total for tried in instead)


def _beside(attempt: Attempt, effects: Sequence[Effect], best: Trial) -> Trial:
    """A remedy, granted that the manipulator has these effects."""
    granted = attempt_on(_physics(tuple(effects)).mend(attempt.recording).recording, attempt.trying.settings)
    return granted.full(granted.rough(best.remedy))


def trials(attempt: Attempt) -> list[Trial]:
    """The most promising remedies with refitted constants, the best first."""
    rough = sorted(map(attempt.rough, attempt.among), key=_gain, reverse=True)
    full = map(attempt.full, rough[: attempt.trying.settings.blunders_fitted])
    return sorted(full, key=_gain, reverse=True)


def imitation(attempt: Attempt, enough: float) -> Trial | None:
    """The misfit explained by physics that imitates blunders: effects added while they gain, until it is `enough`."""
    best: Trial | None = None
    for _ in range(attempt.trying.settings.most_imitated):
        already = best.mended.recording.manipulator.effect if best else attempt.recording.manipulator.effect
        rough = [attempt.rough(_physics((*already, more))) for more in imitations(attempt.recording, already)]
        full = [attempt.full(tried) for tried in sorted(rough, key=_gain, reverse=True)[:IMITATIONS_FITTED]]
        better = max(full, key=_gain, default=None)
        if better is None or (best and better.gain < best.gain + 1):
            break
        best = better
        if best.gain > enough:
            break
    return best


def _physics(effects: tuple[Effect, ...]) -> Remedy:
    """A recording whose manipulator has these effects."""
    return Remedy(
        "physics",
        "manipulator",
        lambda known: with_manipulator(known, known.manipulator.model_copy(update={"effect": list(effects)})),
    )


def _gain(tried: Trial) -> float:
    return tried.gain


def trial(here: Standing, remedy: Remedy, mended: Mended, there: Standing) -> Trial:
    """A remedy against the recording as it is.

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
    total = float((after / np.bincount(step)[step]).sum()) + there.improbable
    return Trial(remedy, mended, there, gain, total)


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
    out[mended.rows] = moved[before.step] | np.any(
        [a != b for a, b in zip(changed.readings, before, strict=True)], axis=0
    )
    return out
