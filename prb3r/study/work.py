"""The work of a worker: solve and measure the cases of one task.  A case that fails becomes a row with its reason."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from prb3r.inverse.reach import aim_of, held_loads, lag_problem, limits, pulls_along, pulls_from_rest
from prb3r.inverse.target import chain_targets
from prb3r.mechanics.chain import Chain
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.model.solve import history_problem
from prb3r.model.steps import loads_of, tension_travel
from prb3r.runs.states import Columns
from prb3r.study.cases import Family
from prb3r.study.chunk import CASE_FAILED, FAILURES, Chunk, blank_columns, one_below_another, state_columns
from prb3r.study.cloud import CloudBlock, SolvedCloudBlock, blocks, cloud_tables, solve_cloud_block
from prb3r.study.loads import load_columns, load_rows
from prb3r.study.measure import kept_states, measured_columns
from prb3r.study.metrics.base import Solved
from prb3r.study.tree import Tree
from prb3r.study.workspace import MOST_DISKS

StudyTask = Chunk | CloudBlock
"""A task for one worker: cases, or a block of the loads of a cloud."""


def tasks_of(chunk: Chunk) -> list[StudyTask]:
    """The tasks of a chunk: the chunk itself, or if a cloud in it has several blocks, the blocks of all its clouds.

    Cases without a cloud then are chunks of their own.
    """
    if not any(family.settings["cloud"] for family in chunk.families):
        return [chunk]
    parts = [blocks(case) if case.families[0].settings["cloud"] else [case] for case in chunk.single()]
    return [task for tasks in parts for task in tasks] if any(len(tasks) > 1 for tasks in parts) else [chunk]


def solve_task(task: StudyTask) -> tuple[Columns, Columns] | SolvedCloudBlock:
    """The results of a task: columns of its cases and of their states, or the loads of a block of a cloud."""
    return solve_cloud_block(task) if isinstance(task, CloudBlock) else solve_chunk(task)


def solve_chunk(chunk: Chunk) -> tuple[Columns, Columns]:
    """Columns of the cases of a chunk, in the order of their numbers, and of the states that are kept."""
    tables = [table for family in chunk.families for table in _family_tables(family, chunk)]
    cases, states = (_joined(kind) for kind in zip(*tables, strict=True))
    return cases, states


# Solving --------------------------------------------------------------------------------------------------------------


def solve_cases(family: Family, manipulator: Manipulator, chain: Chain) -> Solved:
    """The equilibria of a family of cases at all its load steps; each case starts from rest.

    Raises
    ------
    ValueError
        If the chain has too many plates for its loading history, or is to follow targets with tensions that lag.
    """
    settings, count = family.settings, len(family)
    if settings["reach"]:
        return _followed(settings["reach"], manipulator, chain)
    columns = load_columns(settings, count)
    steps = next(iter(columns.values())).shape[1]
    path = loads_of(manipulator, chain, {name: values.ravel() for name, values in columns.items()})
    initial = bool(settings["initial"])
    path = path._replace(elapsed=np.tile(np.arange(float(steps)), count)[:, None])
    numbers = np.tile(np.arange(steps) + (0 if initial else 1), count)
    begins = np.arange(count * steps) % steps == 0
    path = path._replace(travel=tension_travel(path.tension, path.slip, begins))
    if problem := history_problem(chain):
        raise ValueError(problem)
    states = equilibria_of(chain, path, from_rest=begins, eigenvalue=True, number=numbers)
    return Solved(manipulator, chain, path, states, initial, count=count)


def _parts(family: Family, chain: Chain) -> Iterator[Family]:
    """The family cut into parts that are solved in one call each, by the memory that they take.

    Cases with targets, or with moments that follow the state (`chain.closure`), are solved one by one.
    """
    alone = bool(family.settings["reach"] or chain.closure)
    most = 1 if alone else max(1, MOST_DISKS // (len(load_rows(family.settings)) * (chain.plates + 1)))
    return (family.part(slice(start, start + most)) for start in range(0, len(family), most))


def _followed(reach: Tree, manipulator: Manipulator, chain: Chain) -> Solved:
    """A solved case that brings a disk from target to target, one load step for each target, see `held_loads`.

    Raises ValueError where tensions lag behind what is applied.
    """
    if lags := lag_problem(chain):
        raise ValueError(lags)
    targets = chain_targets(chain, chain.plates if reach["disk"] == "tip" else int(reach["disk"]), reach["target"])
    most, aim = limits(chain, reach.get("most_n")), aim_of(manipulator, reach["least"])
    pulls = pulls_along(chain, targets, most, aim)
    steps = held_loads(chain, pulls)
    states = equilibria_of(chain, steps, eigenvalue=True)
    alone = tuple(pull is not None for pull in pulls_from_rest(chain, targets, pulls, most, aim))
    return Solved(manipulator, chain, steps, states, targets=tuple(targets), from_rest=alone)


# Chunks ------------------------------------------------------------------------------------------------------------


def _family_tables(family: Family, chunk: Chunk) -> list[tuple[Columns, Columns]]:
    """Columns of cases and of states, for each part of a family.  A part that fails is solved again case by case."""
    if family.settings["cloud"]:
        return [cloud_tables(case) for case in replace(chunk, families=(family,)).single()]
    try:
        manipulator = family.manipulator()
        chain = manipulator.chain(family.settings["broken"])
    except FAILURES as error:
        return [_failed(family, chunk, error)]
    tables = []
    parts = list(_parts(family, chain))[::-1]
    while parts:
        part = parts.pop()
        try:
            solved = solve_cases(part, manipulator, chain)
        except FAILURES as error:
            if len(part) > 1:  # solve its cases one by one
                parts += list(part.single())[::-1]
            else:
                tables.append(_failed(part, chunk, error))
            continue
        states = kept_states(part.numbers, solved, chunk) if chunk.states != "none" else state_columns(chunk.cables)
        tables.append((measured_columns(part.numbers, solved, chunk.metrics), states))
    return tables


def _failed(family: Family, chunk: Chunk, error: Exception) -> tuple[Columns, Columns]:
    """Rows of cases that failed by an error, and no states."""
    reason = f"{type(error).__name__}: {error}"
    return blank_columns(family.numbers, chunk.metrics, CASE_FAILED, reason), state_columns(chunk.cables)


def _joined(tables: Sequence[Mapping[str, np.ndarray]]) -> Columns:
    """Tables of different cases below each other, their rows sorted by number of the case."""
    columns = one_below_another(tables) if len(tables) > 1 else dict(tables[0])
    if (np.diff(columns["case_id"]) >= 0).all():
        return columns
    order = np.argsort(columns["case_id"], kind="stable")
    return {name: values[order] for name, values in columns.items()}
