"""Blunders of the set-up: each one that is known is undone, and the recording held against its manipulator again.

What speaks for a blunder is the logarithm of a likelihood ratio, a photograph counting as one number (`robust.py`).  By
chance one remedy exceeds :math:`\\ln(k / a)` in a share `a / k` of all right recordings: with `k` the number of kinds
of blunders times that of the places where this kind could have been made, one of all does in a share `a`.  So what can
be done in one way only, as kilograms in all columns of newtons, asks less than what can be done in a hundred.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from prb3r.diagnosis.checks.setup.cables import cable_blunders
from prb3r.diagnosis.checks.setup.order import order_blunders
from prb3r.diagnosis.checks.setup.pictures import picture_blunders
from prb3r.diagnosis.checks.setup.quick import quick_predictor
from prb3r.diagnosis.checks.setup.remedy import File, Mended, Remedy
from prb3r.diagnosis.checks.setup.robust import Sight, Standing, Trier, expected_loss, sight, trier
from prb3r.diagnosis.checks.setup.units import unit_blunders
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.search.apply import Apply, serially
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects import AnyEffect
from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Blunder:
    """A blunder that explains what no constants can."""

    blunder: str
    """What was done, in words that follow "it looks as if"."""
    alike: tuple[str, ...]
    """Other blunders that would look the same."""
    file: File
    """That has to be mended."""
    mended: Recording
    plain: bool
    """Whether constants alone explain the mended recording; else effects that were left out could do as well."""
    least: float
    """Logarithm of the likelihood ratio that has to speak for it."""

    @property
    def statement(self) -> str:
        """What seems to have been done, and what would look the same, in a sentence."""
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


def remedies(recording: Recording, settings: Settings) -> list[Remedy]:
    """The remedy of every blunder that a recording could hold: of pictures, cables, units and order, in this order."""
    others = (cable_blunders, unit_blunders, order_blunders)
    return [*picture_blunders(recording, settings), *(remedy for family in others for remedy in family(recording))]


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
    """Of the recording as it is, at each of `grid`, as :func:`quick_predictor` has it."""
    near: Standing
    """The recording as it is, at the best of them; `here` where predictions are quick anyway."""
    costly: bool
    """Whether predictions are slow, as states follow the load path."""

    def rough(self, remedy: Remedy) -> Trial:
        """A remedy at the best of the coarse constants, seen from where it fits best."""
        mended = remedy.mend(self.recording)
        changed = mended.recording
        alone = changed.loads is self.recording.loads and changed.manipulator is self.recording.manipulator
        predict, tried = quick_predictor(changed, self.trying.settings), []
        for constants, known in zip(self.grid, self.seen, strict=True):
            view = known if alone else sight(predict, constants, predict.equilibria(constants))
            standing = self.trying.framed(predict, mended.rows, constants, view)
            tried.append(trial(self.near, remedy, mended, standing))
        return max(tried, key=_gain)

    def full(self, tried: Trial) -> Trial:
        """The remedy with constants refitted from where it stands; as it is where those have no equilibrium."""
        mended = tried.mended
        standing = self.trying.fitted(mended.recording, mended.rows, tried.standing.constants)
        return tried if standing is None else trial(self.here, tried.remedy, mended, standing)


def attempt_on(recording: Recording, settings: Settings) -> Attempt:
    """A recording as it is, with the constants that fit it best, and all that could be wrong with it."""
    trying = trier(recording, settings)
    quick, rows = quick_predictor(recording, settings), np.arange(recording.readings.count)
    coarse = [Constants(float(np.log(factor))) for factor in settings.coarse_factors]
    starts = (Constants(float(np.log(factor))) for factor in settings.start_factors)
    fitted = next((standing for start in starts if (standing := trying.fitted(recording, rows, start))), None)
    grid = (*coarse, *([fitted.constants] if fitted else []))
    seen = tuple(sight(quick, constants, quick.equilibria(constants)) for constants in grid)
    standings = [trying.framed(quick, rows, *known) for known in zip(grid, seen, strict=True)]
    near = min(standings, key=_total)
    costly = recording.manipulator.follows_history
    here = fitted or near
    if not costly:
        here = near = min(here, near, key=_total)
    return Attempt(recording, remedies(recording, settings), trying, here, grid, seen, near, costly)


def _total(standing: Standing) -> float:
    return standing.total


def blunders_of(recording: Recording, settings: Settings, apply: Apply = serially) -> tuple[Blunder, ...]:
    """The blunders that a recording could hold, each looked for with those before it mended; mostly none.

    Where the last is plain they are plain together: constants alone explain what is mended.
    """
    out: list[Blunder] = []
    while len(out) < settings.most_blunders:
        blunder = find_blunder(out[-1].mended if out else recording, settings, apply=apply)
        if blunder is None:
            break
        out.append(blunder)
    return tuple(out)


def find_blunder(
    recording: Recording, settings: Settings, effects: Sequence[AnyEffect] = (), apply: Apply = serially
) -> Blunder | None:
    """The blunder that explains most of a recording's misfit, if one explains more than chance could.

    Parameters
    ----------
    effects : taken to be there too: beside those that were found a blunder shows that they would hide.
    apply : tries many remedies, in workers for instance, where predictions are slow.
    """
    manipulator = recording.manipulator.model_copy(update={"effect": [*recording.manipulator.effect, *effects]})
    attempt = attempt_on(replace(recording, manipulator=manipulator) if effects else recording, settings)
    least = least_gains(attempt.among, settings)
    best, *others = sorted(trials(attempt, apply), key=lambda tried: least[tried.remedy] - tried.gain)
    if best.gain < least[best.remedy]:
        return None
    alike = tuple(t.remedy.blunder for t in others if t.total < best.total + settings.close_fit / 2)
    within_noise = expected_loss(float(np.exp(settings.far_noise))) * len(recording.of_sequence)
    # photographs miss by noise that is not far off: there is no more to explain
    plain = best.total < within_noise and not effects
    remedy = best.remedy
    return Blunder(remedy.blunder, alike, remedy.file, remedy.mend(recording).recording, plain, least[remedy])


def least_gains(among: Sequence[Remedy], settings: Settings) -> dict[Remedy, float]:
    """Logarithm of the likelihood ratio to ask of each remedy, so that by chance one of all reaches its own in a share
    `Settings.blunder_rate`: kinds share that evenly, and the remedies of a kind its part."""
    places = Counter(remedy.kind for remedy in among)
    return {r: float(np.log(len(places) * places[r.kind] / settings.blunder_rate)) for r in among}


def trials(attempt: Attempt, apply: Apply = serially) -> list[Trial]:
    """The most promising remedies with refitted constants, the best first."""
    settings, apply = attempt.trying.settings, apply if attempt.costly else serially
    rough = sorted(map(attempt.rough, attempt.among), key=_gain, reverse=True)
    promising = rough[: settings.blunders_fitted]
    if attempt.costly:
        promising = _few_of_a_kind(rough, settings.costly_blunders_of_a_kind)[: settings.costly_blunders_fitted]
    full = apply(_in_full, [(attempt, tried) for tried in promising])
    # a remedy is known by its function, of which workers send back a copy
    done = [replace(there, remedy=tried.remedy) for there, tried in zip(full, promising, strict=True)]
    return sorted(done, key=_gain, reverse=True)


def _in_full(task: tuple[Attempt, Trial]) -> Trial:
    attempt, tried = task
    return attempt.full(tried)


def _few_of_a_kind(tried: Sequence[Trial], most: int) -> list[Trial]:
    """The first `most` of every kind of blunder, in their order."""
    count, out = Counter[str](), []
    for candidate in tried:
        count[candidate.remedy.kind] += 1
        if count[candidate.remedy.kind] <= most:
            out.append(candidate)
    return out


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
    """Natural logarithm of every value, in the shape of `values`; minus infinity for zero, without a warning."""
    return np.log(values, out=np.full(values.shape, -np.inf), where=values > 0)


def touched(recording: Recording, mended: Mended) -> np.ndarray:
    """(r,) whether its mending concerns a reading of a recording: its loads, its label or its value, or all of them
    where the manipulator is another one."""
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
