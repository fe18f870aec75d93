"""Trials of remedies on a recording: first rough ones with a few fixed stiffnesses, then full ones with a refit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np

from prb3r.diagnosis.checks.setup.quick import quick_predictor
from prb3r.diagnosis.checks.setup.remedy import Remedy
from prb3r.diagnosis.checks.setup.robust import Sight, Standing, Trier, sight, trier
from prb3r.diagnosis.checks.setup.trial import Trial, best_trial
from prb3r.diagnosis.checks.setup.units import POUND_KG
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import Predictor
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Loads
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.recording.recording import Recording

LOST_FRICTION = 0.5
"""Size of the ln of the factor on friction, as a share of `Settings.farthest`, above which the fit counts as having
lost the friction coefficient.  Choice: a factor of 7, which turns 0.2 into less than 0.03 or more than 1.4; dry pairs
of any materials lie between these."""

ROUGH_STEPS = 30_000
"""Load steps of the remedies that are tried at once.  Choice, for memory: some 100 MB."""


@dataclass(frozen=True, eq=False)
class Attempt:
    """A recording as it is, with everything that trials of its remedies are compared with."""

    recording: Recording
    trying: Trier
    """Computes the misfit of a recording with given or fitted constants."""
    here: Standing
    """The recording as it is, with the constants that fit it best: fits of remedies are compared with this."""
    grid: tuple[Constants, ...]
    """(c,) constants with which a remedy is tried before any are fitted."""
    seen: Sight
    """What the camera reads of the recording as it is at each of `grid`, as :func:`quick_predictor` has it."""
    near: Standing
    """The recording as it is, at the best of `grid`: rough trials are compared with this.  Equal to `here` where
    predictions are quick."""
    costly: bool
    """Whether predictions are slow, as states follow the load path."""

    def rough(self, among: Sequence[Remedy]) -> list[Trial]:
        """A trial of each remedy at the best constants of `grid`, with the camera frame fitted.

        Equilibria are solved only where the remedy changes loads or manipulator.
        """
        share = max(ROUGH_STEPS // max(len(self.recording.steps), 1), 1)
        return [each for k in range(0, len(among), share) for each in self._rough(among[k : k + share])]

    def _rough(self, among: Sequence[Remedy]) -> list[Trial]:
        """:meth:`rough` of so few remedies that the states of all fit into memory."""
        recordings = [remedy.mend(self.recording) for remedy in among]
        predictors = [quick_predictor(mended.recording, self.trying.settings) for mended in recordings]
        others = [k for k, mended in enumerate(recordings) if self._loads_alone_differ(mended.recording)]
        solved = dict(zip(others, states_at(self.grid, [predictors[k] for k in others]), strict=True))
        out = []
        for k, (remedy, mended, predict) in enumerate(zip(among, recordings, predictors, strict=True)):
            if k in solved:
                seen = sight(predict, self.grid, solved[k])
            elif mended.recording.manipulator is self.recording.manipulator:
                seen = self.seen
            else:
                seen = sight(predict, self.grid, states_at(self.grid, [predict])[0])
            standings = self.trying.framed(predict, mended.rows, self.grid, seen)
            out.append(best_trial(self.near, remedy, mended, standings))
        return out

    def _loads_alone_differ(self, changed: Recording) -> bool:
        """Whether a recording has the same manipulator and other loads."""
        here = self.recording
        return changed.manipulator is here.manipulator and changed.loads is not here.loads

    def full(self, tried: Trial) -> Trial:
        """The trial with constants refitted from those it has; unchanged where the fit fails."""
        mended = tried.mended
        standing = self.trying.fitted(mended.recording, mended.rows, tried.standing.constants)
        return tried if standing is None else best_trial(self.here, tried.remedy, mended, [standing])


def states_at(grid: Sequence[Constants], predictors: Sequence[Predictor]) -> list[list[Equilibria]]:
    """(predictors, c) equilibria of the steps of every predictor at all constants of a grid.

    All predictors are of one manipulator, so that their steps are solved together.
    """
    if not predictors:
        return []
    recordings = [predict.recording for predict in predictors]
    loads = Loads(*(np.concatenate(field) for field in zip(*(each.loads for each in recordings), strict=True)))
    begins = np.concatenate([each.begins for each in recordings])
    number = np.concatenate([predict.number for predict in predictors])
    solved, place = distinct_steps(loads, number)
    follows = np.diff(solved, prepend=-1) == 1
    ends = np.cumsum([each.loads.steps for each in recordings])
    out: list[list[Equilibria]] = [[] for _ in predictors]
    settings = predictors[0].settings
    for constants in grid:
        states = equilibria_of(
            predictors[0].chain_of(constants),
            Loads(*(field[solved] for field in loads)),
            from_rest=begins[solved] | ~follows,
            number=number[solved],
            smallest_step=settings.path_end_error,
            allowance=settings.allowance,
        )
        poses = (np.split(field[place], ends[:-1]) for field in (states.x, states.y, states.angle))
        for equilibria, (x, y, angle) in zip(out, zip(*poses, strict=True), strict=True):
            equilibria.append(replace(states, x=x, y=y, angle=angle))
    return out


def distinct_steps(loads: Loads, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the steps that differ in loads or `number` (s,), in order, and (s,) which of these each step equals.

    A recording with a blunder mended has most of its steps in common with many others, and these are solved once.
    """
    fields = [np.asarray(field).reshape(loads.steps, -1) for field in (*loads, number)]
    varied = np.concatenate([field[:, np.ptp(field, axis=0) > 0] for field in fields], axis=1)
    if not varied.shape[1]:
        return np.zeros(1, int), np.zeros(loads.steps, int)
    _, first, place = np.unique(np.ascontiguousarray(varied), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    return first[order], rank[place.ravel()]


def _around(fitted: Constants, gravity: float) -> list[Constants]:
    """The fitted constants, and those that would fit had newtons been mistaken for kilograms or pounds, or these for
    newtons, or offsets for their halves, where that brings the stiffness nearer to the nominal one."""
    stiffness, factors = fitted.log_stiffness, (gravity, gravity * POUND_KG, 2.0)
    mistaken = [float(stiffness - np.copysign(np.log(factor), stiffness)) for factor in factors]
    return [fitted, *(fitted._replace(log_stiffness=other) for other in mistaken if abs(other) < abs(stiffness))]


def _settled(recording: Recording, rows: np.ndarray, fitted: Standing, trying: Trier) -> Standing:
    """The standing refitted until that brings no more gain, as this gain would otherwise be credited to a remedy, whose
    fit begins where this one ends."""
    for _ in range(trying.settings.most_restarts):
        again = trying.fitted(recording, rows, fitted.constants)
        if again is None or fitted.total - again.total < trying.settings.idle_gain:
            break
        fitted = again
    return fitted


def attempt_on(recording: Recording, settings: Settings) -> Attempt:
    """The attempt on a recording; constants are fitted from the first of `Settings.start_factors` that gives a fit."""
    trying = trier(recording, settings)
    quick, rows = quick_predictor(recording, settings), np.arange(recording.readings.count)
    coarse = [Constants(float(np.log(factor))) for factor in settings.coarse_factors]
    starts = (Constants(float(np.log(factor))) for factor in settings.start_factors)
    fitted = next((standing for start in starts if (standing := trying.fitted(recording, rows, start))), None)
    if fitted and abs(fitted.constants.log_friction) > LOST_FRICTION * settings.farthest:
        # where the stiffness is far from the nominal one, friction is lost on the way to it
        again = trying.fitted(recording, rows, Constants(fitted.constants.log_stiffness))
        fitted = min(filter(None, (fitted, again)), key=attrgetter("total"))
    fitted = fitted and _settled(recording, rows, fitted, trying)
    grid = (*coarse, *(_around(fitted.constants, recording.manipulator.gravity_m_s2) if fitted else []))
    seen = sight(quick, grid, states_at(grid, [quick])[0])
    near = min(trying.framed(quick, rows, grid, seen), key=attrgetter("total"))
    costly = recording.manipulator.follows_history
    here = fitted or near
    if not costly:
        if near.total < here.total:  # the fit ended in another valley
            here = _settled(recording, rows, near, trying)
        near = here
    return Attempt(recording, trying, here, grid, seen, near, costly)
