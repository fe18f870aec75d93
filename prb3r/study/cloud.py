"""Clouds of loads, solved block by block by any number of workers, so that none has more than a block in memory.

A few numbers for each load are gathered from all blocks, and the metrics of the case are computed from these; states
that are kept go to disk block by block.
"""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.runs.states import Columns
from prb3r.study.chunk import CASE_FAILED, FAILURES, Chunk, blank_columns, one_below_another, state_columns
from prb3r.study.loading import Cloud
from prb3r.study.measure import kept_states, measured_columns
from prb3r.study.metrics.base import Solved
from prb3r.study.metrics.drive import drive_tension
from prb3r.study.workspace import Tips, block_size, cloud_loads, tips_of

GATHERED = {
    "outcome": np.int8,
    "iterations": np.int64,
    "residual": float,
    "lowest_eigenvalue": float,
}
"""Fields of `Equilibria` that are gathered for each load, with their types."""
OF_TIPS = {"x": float, "y": float, "solved": bool, "strain": float, "pull": float, "corner": bool}
"""Fields of `Tips` that are gathered for each load, with their types."""


@dataclass(frozen=True)
class CloudBlock:
    """A block of the loads of a cloud, and what to compute for them."""

    chunk: Chunk
    """The single case of the cloud, with its metrics and states."""
    number: int
    """Number of the block, from 0."""
    start: int
    """Number of its first load in the cloud, from 0."""
    stop: int
    """Number after its last load."""

    @property
    def loads(self) -> int:
        """Number of loads in the block."""
        return self.stop - self.start

    @property
    def case(self) -> int:
        """Number of the case whose loads these are."""
        return int(self.chunk.numbers[0])

    def single(self) -> list["CloudBlock"]:
        """The block itself, as its loads are never separated."""
        return [self]


@dataclass(frozen=True)
class SolvedCloudBlock:
    """Results of the loads of a block."""

    loads: Columns
    """(loads,) each of the fields in `GATHERED` and `OF_TIPS`."""
    states: Columns
    """Columns of the states that are kept."""

    @property
    def rows(self) -> int:
        """Number of rows of states: one for each kept disk under each kept load."""
        return len(self.states["case_id"])

    @property
    def failed(self) -> int:
        """Number of loads without a stable equilibrium."""
        return int((self.loads["outcome"] != Outcome.CONVERGED).sum())


def blocks(chunk: Chunk) -> list[CloudBlock]:
    """The blocks of the cloud of a chunk of a single case; they do not depend on the workers."""
    settings = chunk.families[0].settings
    count = int(settings["cloud"]["count"])
    size = block_size(sum(segment["plates"] for segment in settings["manipulator"]["segment"]))
    return [CloudBlock(chunk, k, start, min(start + size, count)) for k, start in enumerate(range(0, count, size))]


def solve_cloud_block(block: CloudBlock) -> SolvedCloudBlock:
    """Solve the loads of a block, each from rest.

    States of loads that bring a plate nearer to yield than the safety factor of the cloud are not kept.
    """
    (family,), chunk = block.chunk.families, block.chunk
    manipulator = family.manipulator()
    chain, cloud = manipulator.chain(family.settings["broken"]), Cloud.model_validate(family.settings["cloud"])
    loads = cloud_loads(manipulator, chain, limits_of(cloud, manipulator, chain), np.arange(block.start, block.stop))
    states = equilibria_of(chain, loads, from_rest=True, eigenvalue=True)
    tips = tips_of(manipulator, loads, states, cloud.safety)
    known = {name: getattr(states, name) for name in GATHERED} | {name: getattr(tips, name) for name in OF_TIPS}
    kept = state_columns(chunk.cables)
    if chunk.states == "path" or (chunk.states == "final" and block.stop == cloud.count):
        solved = Solved(manipulator, chain, loads, replace(states, tension=states.tension[:0]), cloud=True)
        kept = kept_states(family.numbers, solved, chunk, block.start)
        left_out = np.flatnonzero(tips.beyond(manipulator, cloud.safety)) + block.start + 1
        counted = ~np.isin(kept["step"], left_out)
        kept = {name: values[counted] for name, values in kept.items()}
    return SolvedCloudBlock({name: np.ascontiguousarray(values) for name, values in known.items()}, kept)


class Gathering:
    """Collects the results of the blocks of a cloud, in any order, until the case can be measured.

    Parameters
    ----------
    block : any block of the cloud.
    """

    def __init__(self, block: CloudBlock) -> None:
        (self.family,), self.chunk, self.block = block.chunk.families, block.chunk, block
        self.count = self.family.loads
        self.known = {name: np.empty(self.count, kind) for name, kind in (GATHERED | OF_TIPS).items()}
        self.rows = [0] * len(blocks(self.chunk))
        """Number of rows of states of each block."""
        self.missing = len(self.rows)
        """Number of blocks still to come."""
        self.lost: tuple[str, str] | None = None
        """Outcome and reason of the case if a block could not be computed."""

    def add(self, block: CloudBlock, loads: Columns, rows: int) -> None:
        """Take in the results of the loads of a block, of which `rows` rows of states are kept."""
        for name, values in loads.items():
            self.known[name][block.start : block.stop] = values
        self.rows[block.number] = rows
        self.missing -= 1

    def lose(self, outcome: str, reason: str) -> None:
        """Record that a block could not be computed, which leaves the case without results."""
        self.lost, self.missing = self.lost or (outcome, reason), self.missing - 1

    def columns(self) -> Columns:
        """Columns of the outcome and metrics of the case, once no block is missing."""
        numbers, metrics = self.family.numbers, self.chunk.metrics
        if self.lost:
            return blank_columns(numbers, metrics, *self.lost)
        manipulator = self.family.manipulator()
        chain = manipulator.chain(self.family.settings["broken"])
        nothing: dict[str, Any] = {field.name: np.zeros((0, 0, 0)) for field in fields(Equilibria)}
        known = {name: self.known[name] for name in GATHERED} | {name: self.known[name][:, None] for name in ("x", "y")}
        states = Equilibria(**nothing | known | {"closed": None})
        none = Loads(*(np.zeros((0, 0)) for _ in Loads._fields))
        tips, safety = Tips(**{name: self.known[name] for name in OF_TIPS}), self.family.settings["cloud"]["safety"]
        solved = Solved(manipulator, chain, none, states, cloud=True, tips=tips, safety=safety)
        return measured_columns(numbers, solved, metrics)


def cloud_tables(chunk: Chunk) -> tuple[Columns, Columns]:
    """Columns of the single case of a chunk, which has a cloud, and of its states that are kept."""
    todo = blocks(chunk)
    gathering, states = Gathering(todo[0]), []
    try:
        for block in todo:
            solved = solve_cloud_block(block)
            gathering.add(block, solved.loads, solved.rows)
            states.append(solved.states)
    except FAILURES as error:
        reason = f"{type(error).__name__}: {error}"
        return blank_columns(chunk.numbers, chunk.metrics, CASE_FAILED, reason), state_columns(chunk.cables)
    return gathering.columns(), one_below_another(states)


def limits_of(cloud: Cloud, manipulator: Manipulator, chain: Chain) -> dict[str, float]:
    """Largest tension of each cable that is driven and not broken, N."""
    names = [name for name in cloud.tension_n if chain.reach[manipulator.cable_names.index(name)]]
    if cloud.limit == "bend":
        return {name: bend_limit(manipulator, name, cloud) for name in names}
    return {name: cloud.tension_n[name] for name in names}


def bend_limit(manipulator: Manipulator, cable: str, cloud: Cloud) -> float:
    """Tension at which `cable` alone, with no cable broken, bends the last segment it drives by the cloud's bend, N.

    Raises
    ------
    ValueError
        If it does not up to 20 times the tension that the cloud gives for the cable.
    """
    most = 20 * cloud.tension_n[cable]
    segment = next(other.ends_at_segment for other in manipulator.cable if other.name == cable)
    tension = drive_tension(manipulator, manipulator.chain(), cable, segment, cloud.bend_rad or np.pi, most)
    if not np.isfinite(tension):
        raise ValueError(f"up to {most:g} N cable {cable!r} does not bend its segment by {cloud.bend_rad:g} rad")
    return tension
