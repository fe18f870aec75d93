"""The readings that a manipulator with given constants and effects would have given: from physics to readings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.chains import Chains
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Chain, Loads, pose
from prb3r.mechanics.derivatives.solved_path import SolvedPath, solve_path
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.effects import observed, turned
from prb3r.model.effects.base import Effect
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.recording.recording import Kind, Recording


@dataclass(frozen=True, eq=False)
class Solution:
    """The states of all steps of a recording for given constants and effects, and the predicted readings."""

    constants: Constants
    effects: tuple[Effect, ...]
    chain: Chain
    loads: Loads
    states: Equilibria
    path: SolvedPath | None
    """The path that derivatives are taken along; None where moments follow the state (`Chain.closure`)."""
    readings: np.ndarray
    """(r,) predicted, m and rad; NaN where there is no equilibrium."""


class Lost(NamedTuple):
    """The readings of a solution in which steps without equilibrium are held in the last balanced state before them."""

    readings: np.ndarray
    """(r,) m and rad."""
    missing: np.ndarray
    """(r,) share of the reading's load step that could not be followed; 0 for steps in balance."""


@dataclass(frozen=True, eq=False)
class Predictor:
    """Predicts the readings of one recording, on the elastica plate model."""

    recording: Recording
    chain: Chain
    """Nominal, without effects."""
    settings: Settings = Settings()

    @cached_property
    def number(self) -> np.ndarray:
        """(s,) number of each step within its sequence, as recorded."""
        return self.recording.steps["step"].to_numpy(float)

    @cached_property
    def chains(self) -> Chains:
        """Makes the chains of the nominal manipulator."""
        return Chains(self.chain, self.recording.manipulator)

    def chain_of(self, constants: Constants, effects: Sequence[Effect] = ()) -> Chain:
        """The chain with adjusted constants, the nominal effects and `effects`."""
        return self.chains.chain(constants, effects)

    def equilibria(
        self, constants: Constants, effects: Sequence[Effect] = (), loads: Loads | None = None
    ) -> Equilibria:
        """States of all steps, under `loads` instead of the recorded ones."""
        return self._equilibria(self.chain_of(constants, effects), loads or self.recording.loads)

    def _equilibria(self, chain: Chain, loads: Loads) -> Equilibria:
        return equilibria_of(
            chain,
            loads,
            from_rest=self.recording.begins,
            number=self.number,
            smallest_step=self.settings.path_end_error,
            allowance=self.settings.allowance,
        )

    def solve(self, constants: Constants, effects: Sequence[Effect] = ()) -> Solution:
        """States and readings of all recorded steps, with what is needed to differentiate them."""
        chain, loads = self.chain_of(constants, effects), self.recording.loads
        path = None if chain.closure else self._path(chain, loads)
        states = path.equilibria if path else self._equilibria(chain, loads)
        readings = self.read(states, constants, effects)
        return Solution(constants, tuple(effects), chain, loads, states, path, readings)

    def _path(self, chain: Chain, loads: Loads) -> SolvedPath:
        settings = self.settings
        return solve_path(
            chain,
            loads,
            from_rest=self.recording.begins,
            smallest_step=settings.path_end_error,
            allowance=settings.allowance,
        )

    def __call__(self, constants: Constants, effects: Sequence[Effect] = (), loads: Loads | None = None) -> np.ndarray:
        """(r,) predicted readings, m and rad; under `loads` instead of the recorded ones."""
        return self.read(self.equilibria(constants, effects, loads), constants, effects)

    def seen(
        self, points: np.ndarray, step: np.ndarray, constants: Constants, effects: Sequence[Effect] = ()
    ) -> np.ndarray:
        """(..., 2) where the camera sees `points` (..., 2) of the manipulator's own frame at each `step` (...), m."""
        cos, sin = np.cos(constants.rotation), np.sin(constants.rotation)
        x, y = points[..., 0], points[..., 1]
        framed = np.stack([cos * x - sin * y + constants.x, sin * x + cos * y + constants.y], -1)
        effects, elapsed = [*self.recording.manipulator.effect, *effects], self.recording.loads.elapsed[step, 0]
        return observed(framed, effects, self.recording.image_centre_m, elapsed)

    def turned(self, step: np.ndarray, constants: Constants, effects: Sequence[Effect] = ()) -> np.ndarray:
        """(...) angle that the camera adds to every absolute angle at each `step` (...), rad."""
        elapsed = self.recording.loads.elapsed[step, 0]
        return constants.rotation + turned([*self.recording.manipulator.effect, *effects], elapsed)

    def read(self, states: Equilibria, constants: Constants, effects: Sequence[Effect] = ()) -> np.ndarray:
        """(r,) readings that the camera would give of `states`, m and rad; NaN where there is no equilibrium."""
        step, disk, kind, _ = self.recording.readings
        seen = self.seen(np.stack([states.x[step, disk], states.y[step, disk]], -1), step, constants, effects)
        angle = states.angle[step, disk]
        bend = angle - states.angle[step, np.maximum(disk - 1, 0)]
        return np.choose(kind, [seen[:, 0], seen[:, 1], angle + self.turned(step, constants, effects), bend])

    def lost(self, solved: Solution) -> Lost | None:
        """The readings with steps without equilibrium held in the last balanced state of their sequence, or at rest.

        None if every step has an equilibrium.
        """
        states = solved.states
        good = np.isfinite(states.angle[:, -1])
        if good.all():
            return None
        last, before = np.full(len(good), -1), -1
        for s, balanced in enumerate(good):
            before = -1 if self.recording.begins[s] else before
            last[s] = before = s if balanced else before
        still = pose(solved.chain, solved.chain.rest)
        held = [
            np.where((last >= 0)[:, None], values[last], resting)
            for values, resting in zip((states.x, states.y, states.angle), still, strict=True)
        ]
        readings = self.read(replace(states, x=held[0], y=held[1], angle=held[2]), solved.constants, solved.effects)
        missing = np.where(good, 0.0, 1.0 - np.clip(states.reached, 0.0, 1.0))
        least = np.where(good, 0.0, self.settings.least_out_of_balance)
        return Lost(readings, np.maximum(missing, least)[self.recording.readings.step])

    def misfit(self, predicted: np.ndarray) -> np.ndarray:
        """(..., r) readings less `predicted` (..., r), m and rad; absolute angles by the shorter way round."""
        away = self.recording.readings.value - predicted
        turned = self.recording.readings.kind == Kind.ANGLE
        away[..., turned] -= 2 * np.pi * np.round(away[..., turned] / (2 * np.pi))
        return away


def predictor(recording: Recording, settings: Settings | None = None) -> Predictor:
    """The predictor of a recording: its nominal manipulator on the elastica plate model, whatever model its file names.

    `settings`: absent, the defaults.
    """
    manipulator = recording.manipulator.model_copy(update={"model": "elastica"})
    return Predictor(recording, manipulator.plain_chain(), settings or Settings())
