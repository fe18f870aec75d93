"""Time of equilibria through each interface, against the kernel alone in turns with it, and how it grows with size."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd

from prb3r.bench.prototype import PLATES, Timed, seconds_in_turns
from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.mechanics.equilibrium import solve_chain
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import solve
from prb3r.model.steps import LoadTable, load_steps
from prb3r.recording.recording import Kind, Measurement, Prior, Readings, Recording

SEGMENT_COUNTS, CABLE_COUNTS, CASE_COUNTS = (1, 2, 7), (2, 4, 8, 16), (10_000, 1_000, 100, 10)
"""Numbers of segments that the 14 plates are divided into, of cables, and of sequences in one call; times are given as
ratios to the first of each."""
RECORDED = (6, 6, 6, 6, 6, 5, 5)
"""Steps of each sequence of the recording that is predicted."""
LOAD_SEED = 7
"""Seed of the random tensions."""
KERNEL, SOLVE, PREDICTION = "kernel", "prb3r.solve, one-step sequences", "prediction of a recording"


def wrist(segments: int = 2, cables: int = 4, model: str = "prb3r") -> dict[str, Any]:
    """The prototype as the contents of a manipulator file: 14 plates in so many `segments`, friction 0.3."""
    plates = [PLATES // segments + (k < PLATES % segments) for k in range(segments)]
    plate = {"length_m": 0.030, "clamp_m": 0.008, "width_m": 0.030, "thickness_m": 0.0008}
    offsets = 0.0255 * (1 - 0.1 * (np.arange(cables) // 2)) * np.where(np.arange(cables) % 2, -1, 1)
    return {
        "name": "prototype",
        "model": model,
        "youngs_modulus_pa": 1.87e11,
        "disk": {"thickness_m": 0.004},
        "friction": {"coefficient": 0.3},
        "segment": [{"plates": count, **plate} for count in plates],
        "cable": [
            {"name": str(k + 1), "offset_m": float(offset), "ends_at_segment": segments - k % segments}
            for k, offset in enumerate(offsets)
        ],
    }


def pulls(manipulator: Manipulator, steps: Sequence[int]) -> dict[str, Any]:
    """A table of random tensions, N, with a sequence for each number of `steps`; on average half the cables idle."""
    rng, count = np.random.default_rng(LOAD_SEED), sum(steps)
    most = 100.0 / max(1, len(manipulator.cable) // 4)
    tension = np.maximum(rng.uniform(-most, most, (count, len(manipulator.cable))), 0)
    return {
        "sequence": np.repeat(np.arange(len(steps)), steps).astype(str),
        "step": np.concatenate([np.arange(1, number + 1) for number in steps]),
        **{f"cable_{name}_n": tension[:, k] for k, name in enumerate(manipulator.cable_names)},
    }


def path_tasks(sequences: int, times: int) -> list[Timed]:
    """Pairs of tasks, the kernel and an interface to the same equilibria.

    `prb3r.solve` takes `sequences` of one step each, the prediction of a recording is repeated `times`.
    """
    rig = Manipulator.model_validate(wrist())
    table = pulls(rig, [1] * sequences)
    predict = predictor(_recording(rig))
    chain, known = predict.chain_of(Constants()), predict.recording

    def tables() -> np.ndarray:
        return solve(rig, table)["x_m"].to_numpy()

    def states() -> np.ndarray:
        return np.stack([solve_chain(chain, known.loads, from_rest=known.begins).x for _ in range(times)])

    def readings() -> np.ndarray:
        return np.stack([predict(Constants()) for _ in range(times)])

    predicted = times * len(known.steps)
    tasks = [
        Timed(KERNEL, sequences, _kernel(rig, load_steps(rig, table))),
        Timed(SOLVE, sequences, tables),
        Timed(KERNEL, predicted, states),
        Timed(PREDICTION, predicted, readings),
    ]
    return _warm(tasks)


def path_table(tasks: Sequence[Timed], seconds: np.ndarray) -> pd.DataFrame:
    """One row an interface: its time over that of the kernel, the median of the ratios within a round.

    `seconds` (rounds, tasks) are per equilibrium.
    """
    kernel, ways = seconds[:, ::2], seconds[:, 1::2]
    return pd.DataFrame(
        {
            "path": [task.name for task in tasks[1::2]],
            "equilibria_per_call": [task.equilibria for task in tasks[1::2]],
            "times_kernel": np.median(ways / kernel, axis=0),
            "time_each_s": np.median(ways, axis=0),
            "kernel_time_each_s": np.median(kernel, axis=0),
        }
    )


def growth_tasks(equilibria: int) -> list[Timed]:
    """A task for each number of segments, cables and cases; no task solves more than `equilibria`."""
    tasks = []
    described = [("segments", wrist(segments=number)) for number in SEGMENT_COUNTS]
    described += [("cables", wrist(cables=number)) for number in CABLE_COUNTS]
    for name, description in described:
        rig = Manipulator.model_validate(description)
        tasks.append(Timed(name, equilibria, _kernel(rig, load_steps(rig, pulls(rig, [1] * equilibria)))))
    rig = Manipulator.model_validate(wrist())
    for number in CASE_COUNTS:
        count = min(number, equilibria)
        table, times = pulls(rig, [1] * count), max(1, equilibria // count // 10)
        tasks.append(Timed("cases", count * times, _again(rig, table, times)))
    return _warm(tasks)


def growth_table(tasks: Sequence[Timed], seconds: np.ndarray, equilibria: int) -> pd.DataFrame:
    """One row a task of :func:`growth_tasks` for as many `equilibria`: the time of an equilibrium over that with the
    first number of its kind."""
    names = np.array([task.name for task in tasks])
    first = np.array([np.flatnonzero(names == name)[0] for name in names])
    return pd.DataFrame(
        {
            "varied": names,
            "number": [*SEGMENT_COUNTS, *CABLE_COUNTS, *(min(number, equilibria) for number in CASE_COUNTS)],
            "of_first": np.median(seconds / seconds[:, first], axis=0),
            "time_each_s": np.median(seconds, axis=0),
        }
    )


def _recording(rig: Manipulator) -> Recording:
    """A recording of 40 steps with position and angle of every disk; the readings are zero, as only time counts."""
    table = load_steps(rig, pulls(rig, RECORDED))
    step, disk, kind = (field.ravel() for field in np.indices((len(table.steps), PLATES, 3)))
    return Recording(
        name="bench",
        manipulator=rig,
        measurement=Measurement(position_sd_m=3e-4, angle_sd_rad=5e-3),
        prior=Prior(),
        image_centre_m=(0.0, 0.0),
        sequences=tuple(table.names),
        steps=pd.DataFrame({"sequence": np.repeat(table.names, RECORDED), "step": table.steps}),
        of_sequence=np.repeat(np.arange(len(RECORDED)), RECORDED),
        loads=table.loads,
        readings=Readings(step, disk + 1, np.array([Kind.X, Kind.Y, Kind.ANGLE])[kind], np.zeros(len(step))),
    )


def _kernel(rig: Manipulator, table: LoadTable) -> Callable[[], np.ndarray]:
    """A function that solves the table by the mechanics alone, without details."""
    chain = rig.chain()
    return lambda: solve_chain(chain, table.loads, from_rest=table.begins, detail=False).x


def _again(rig: Manipulator, table: dict[str, Any], times: int) -> Callable[[], np.ndarray]:
    """A function that solves the table `times` over by `prb3r.solve`."""
    return lambda: np.stack([solve(rig, table)["x_m"].to_numpy() for _ in range(times)])


def _warm(tasks: list[Timed]) -> list[Timed]:
    """The tasks after a first run of each, which is not to be timed."""
    for task in tasks:
        task.run()  # fills caches
    return tasks


def kernel_in(rounds: int) -> Iterator[float]:
    """Seconds per equilibrium in the kernel, measured anew at each of `rounds` iterations, in turns with the caller."""
    rig = Manipulator.model_validate(wrist())
    (task,) = _warm([Timed(KERNEL, CASE_COUNTS[0], _kernel(rig, load_steps(rig, pulls(rig, [1] * CASE_COUNTS[0]))))])
    return (float(seconds_in_turns([task], 1).item()) for _ in range(rounds))
