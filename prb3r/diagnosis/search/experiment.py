"""The next experiment: which of some candidate load programs tells rival models apart best."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pandas as pd

from prb3r.diagnosis.fit.basis import basis_of
from prb3r.diagnosis.fit.covariance import noise_of
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.settings import Settings
from prb3r.mechanics.chain import Loads
from prb3r.model.steps import loads_of
from prb3r.recording.recording import Readings, Recording


@dataclass(frozen=True)
class Experiment:
    """A load program, and how well it separates two models together with the readings recorded already."""

    title: str
    """What to do, in words."""
    steps: pd.DataFrame
    """The table of steps."""
    separation: float
    """Squared whitened distance of the two models on recorded and proposed steps (:func:`separation`)."""
    asked: float
    """Squared distance that suffices to rank them rightly (`Settings.resolved`)."""

    @property
    def resolves(self) -> bool:
        """Whether the separation suffices."""
        return self.separation >= self.asked


def programs(recording: Recording, settings: Settings) -> Iterator[tuple[str, pd.DataFrame]]:
    """Title and steps of candidate programs.

    Each cable is pulled and let go, without and, if one was recorded, with the largest tip load; one cable of each pair
    is pulled and let go while the other is held; and the shape is read without any load.
    """
    names = recording.manipulator.cable_names
    pull = recording.loads.tension.max(0)
    pull = np.where(pull > 0, pull, pull.max(initial=0.0)) * settings.harder
    shares = np.array(settings.pull_shares)
    way = np.where(np.diff(shares, prepend=0.0) > 0, -1, 1)
    tip = recording.loads.tip[np.argmax(np.abs(recording.loads.tip).sum(1))]

    def table(tension: np.ndarray, slip: np.ndarray, load=(0.0, 0.0)) -> pd.DataFrame:
        columns = {"sequence": "proposed", "step": np.arange(1, len(tension) + 1)}
        columns |= {f"cable_{name}_n": tension[:, j].round(4) for j, name in enumerate(names)}
        columns |= {f"slip_{name}": slip[:, j] for j, name in enumerate(names)}
        if np.any(load):
            columns |= {"tip_x_n": load[0], "tip_y_n": load[1]}
        return pd.DataFrame(columns)

    for j, name in enumerate(names if pull.any() else ()):
        alone, ways = np.zeros((len(shares), len(names))), -np.ones((len(shares), len(names)), int)
        alone[:, j], ways[:, j] = shares * pull[j], way
        yield f"pull cable {name} and let it go", table(alone, ways)
        if tip.any():
            yield f"pull cable {name} and let it go under the tip load", table(alone, ways, tip)
    for a, b in combinations(range(len(names) if pull.any() else 0), 2):
        both, ways = np.zeros((len(shares), len(names))), -np.ones((len(shares), len(names)), int)
        both[:, a], both[:, b] = settings.held_pull * pull[a], shares * pull[b]
        ways[:, b] = way
        yield f"hold cable {names[a]} and pull cable {names[b]}, then let it go", table(both, ways)
    yield "read the shape without any load", table(np.zeros((1, len(names))), -np.ones((1, len(names)), int))


def imagined(recording: Recording, steps: pd.DataFrame) -> Recording:
    """A recording of other steps, with every disk and kind of the given one read at each step; values are 0."""
    kinds = sorted(set(zip(recording.readings.disk.tolist(), recording.readings.kind.tolist(), strict=True)))
    disk, kind = np.array(kinds).T
    count = len(steps)
    loads: Loads = loads_of(recording.manipulator, recording.manipulator.chain(), steps)
    readings = Readings(
        np.repeat(np.arange(count), len(disk)), np.tile(disk, count), np.tile(kind, count), np.zeros(count * len(disk))
    )
    return replace(
        recording,
        sequences=("proposed",),
        steps=steps,
        of_sequence=np.zeros(count, int),
        loads=loads,
        readings=readings,
        remarks=(),
    )


def separation(fitted: Fit, other: Fit, steps: pd.DataFrame) -> float:
    """Squared whitened distance of two models on recorded and proposed steps together, `other` refitted to `fitted`.

    The refit is linearised, and proposed readings are as noisy as the recorded ones were found to be.  0 where a model
    has no equilibrium at one of the proposed `steps`.
    """
    predict = predictor(imagined(fitted.recording, steps), fitted.model.settings)
    here = predict.solve(fitted.constants, fitted.effects)
    noise = noise_of(predict.recording, tension_response(predict, here), level=fitted.model.noise.level)
    model = replace(other.model, predict=predict, noise=noise)
    there = model.solve(other.p)
    apart = noise.whiten(here.readings - there.readings)
    if not np.isfinite(apart).all():
        return 0.0
    jacobian = model.jacobian(other.p, there)[: len(apart)]
    whole = np.concatenate([other.apart(fitted), apart])
    basis = basis_of(np.vstack([other.jacobian, jacobian]))
    whole = whole - basis @ (basis.T @ whole)
    return float(whole @ whole)


def best_experiments(fitted: Fit, others: Sequence[Fit]) -> list[Experiment]:
    """For each of `others`, in their order, the program that separates it from `fitted`.

    One common program serves all, the one whose smallest separation is largest; a rival that it does not resolve gets
    the program that separates this rival best.
    """
    settings, trials = fitted.model.settings, []
    for title, steps in programs(fitted.recording, settings):
        apart = [separation(fitted, other, steps) for other in others]
        trials.append([Experiment(title, steps, distance, settings.resolved) for distance in apart])
    common = max(trials, key=lambda row: min(trial.separation for trial in row))
    best = [max(column, key=lambda trial: trial.separation) for column in zip(*trials, strict=True)]
    return [shared if shared.resolves else single for shared, single in zip(common, best, strict=True)]
