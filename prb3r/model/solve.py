"""Equilibria of a manipulator under a table of load steps, as a table: `solve`, or `solve_in_blocks` for many steps."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.mechanics.chain import Chain, Loads
from prb3r.mechanics.equilibrium import Equilibria, Outcome
from prb3r.mechanics.strain import peak_strain
from prb3r.model.effects import observed, turned
from prb3r.model.files.validation import validate
from prb3r.model.given import of_given
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator, ModelName
from prb3r.model.steps import LoadTable, load_steps

BLOCK = 16_384
"""Steps that are solved in one call: a block of the wrist of 14 plates takes 30 MB, a longer one is no faster."""
MOST_COUPLED_PLATES = 1000
"""Most plates of a chain whose friction follows the cables' travel: with four cables the matrix by which it is found
which holes stick takes 200 MB."""
POSITION_COLUMNS = ["sequence", "step", "disk", "x_m", "y_m", "angle_rad", "outcome"]
"""Columns that :func:`solve` returns for every manipulator."""

Extra = Literal["stress_pa", "lowest_eigenvalue_n_m_per_rad"]


@dataclass(frozen=True, eq=False)
class SolvedBlocks:
    """Equilibria of many load steps, solved block by block while they are iterated over; each iteration solves anew.

    Each block is a table like that of :func:`solve`, with whole sequences: some 16,000 steps, or one longer sequence.
    """

    manipulator: Manipulator
    chain: Chain
    table: LoadTable
    also: Collection[Extra] = ()

    @property
    def steps(self) -> int:
        """Number of load steps of all sequences and blocks together."""
        return len(self.table.steps)

    @property
    def elapsed(self) -> np.ndarray:
        """(s,) number of steps that had passed before each; not a whole number where it follows from `time_s`."""
        return self.table.loads.elapsed[:, 0]

    def __iter__(self) -> Iterator[pd.DataFrame]:
        return (_framed(block, columns) for block, columns in self.columns())

    def whole(self) -> pd.DataFrame:
        """All blocks, solved anew, as one table like that of :func:`solve`."""
        blocks = [columns for _, columns in self.columns()]
        return _framed(
            self.table, {name: np.concatenate([block.pop(name) for block in blocks]) for name in [*blocks[0]]}
        )

    def columns(self) -> Iterator[tuple[LoadTable, dict[str, np.ndarray]]]:
        """Each block of load steps with the solved columns of numbers, a row for every disk of every step."""
        for block in self.table.blocks(BLOCK):
            # under a moment law all sequences of a call are iterated together, so each gets a call of its own
            parts = block.blocks(1) if self.chain.closure else [block]
            solved = [_solved(self.manipulator, self.chain, part, self.also) for part in parts]
            yield block, {name: np.concatenate([part[name] for part in solved]) for name in solved[0]}


@of_given
def solve_in_blocks(
    manipulator: Manipulator,
    steps: pd.DataFrame | Mapping[str, Any] | str | Path,
    model: ModelName | None = None,
    also: Collection[Extra] = (),
) -> SolvedBlocks:
    """The equilibria of :func:`solve` in blocks, so that of a million steps only one block of results is in memory.

    Parameters are those of :func:`solve`.

    Raises
    ------
    SpecError
        With every problem of the table, before anything is solved.

    Examples
    --------
    >>> import prb3r
    >>> blocks = prb3r.solve_in_blocks("studies/manipulators/two-segment.toml", {"sequence": range(20_000), "step": 1})
    >>> blocks.steps, [int(block["step"].count()) // 15 for block in blocks]
    (20000, [16384, 3616])
    """
    if unknown := [name for name in also if name not in get_args(Extra)]:
        valid = get_args(Extra)
        raise SpecError(*(Problem("also", f"no column {name!r}{did_you_mean(name, valid)}") for name in unknown))
    if model is not None:
        changed, wrong = validate(manipulator.model_dump(exclude_none=True) | {"model": model}, Manipulator)
        if changed is None or wrong:
            raise SpecError(*(Problem(f"{manipulator.name} as {model}", what) for _, what in wrong))
        manipulator = changed
    table, chain = load_steps(manipulator, steps), manipulator.chain()
    if problem := history_problem(chain):
        raise SpecError(Problem(manipulator.name, problem))
    return SolvedBlocks(manipulator, chain, table, also)


@of_given
def solve(
    manipulator: Manipulator,
    steps: pd.DataFrame | Mapping[str, Any] | str | Path,
    model: ModelName | None = None,
    as_measured: bool = False,
    image_centre_m: tuple[float, float] = (0.0, 0.0),
    also: Collection[Extra] = (),
) -> pd.DataFrame:
    """Equilibria along each sequence of load steps; every sequence starts from rest.

    A call takes some 6 ms whatever it solves, and each equilibrium some 10 microseconds: put many loads into one table,
    in one sequence or in many.

    Parameters
    ----------
    manipulator : a `Manipulator`, the path of its file, or what the file would hold as a dict.
    steps : a table of steps, its columns by name, or the CSV or Parquet file of such a table (docs/my-manipulator.md).
    model : plate model to use instead of the manipulator's own.
    as_measured : return positions and angles as a camera with the manipulator's observation effects measures them.
    image_centre_m : x and y of the centre of that camera's image, m.
    also : further columns: `stress_pa`, the highest bending stress of the plate that ends at the disk (NaN for the base
        and where `outer_fibre_m` is not known); `lowest_eigenvalue_n_m_per_rad` of the step's tangent stiffness.

    Returns
    -------
    DataFrame with `sequence, step, disk, x_m, y_m, angle_rad, outcome` for disks 0..n of every step, and for each cable
    `cable_<name>_n`, its tension over the plate that ends at the disk (for the base disk, the tension of the table).
    Positions, angles and tensions of a step without equilibrium are NaN, except at the base.

    Raises
    ------
    SpecError
        With every problem of the manipulator or the table.

    Examples
    --------
    >>> import prb3r
    >>> pull = {"sequence": "a", "step": [1, 2], "cable_1_n": [0.0, 20.0]}
    >>> markers = prb3r.solve("studies/manipulators/two-segment.toml", pull)
    >>> tip = markers[markers["disk"] == 14]
    >>> tip["y_m"].round(3).tolist(), tip["outcome"].tolist()
    ([0.0, 0.095], ['converged', 'converged'])
    """
    blocks = solve_in_blocks(manipulator, steps, model, also)
    table = blocks.whole()
    return as_read(table, blocks.manipulator, image_centre_m, blocks.elapsed) if as_measured else table


def as_read(
    table: pd.DataFrame, manipulator: Manipulator, image_centre_m: tuple[float, float], elapsed: np.ndarray
) -> pd.DataFrame:
    """A table of equilibria with positions and angles as a camera with the manipulator's observation effects measures
    them.

    `elapsed` (s,) is the number of steps that had passed before each step of the table.
    """
    elapsed = np.repeat(elapsed, manipulator.plates + 1)
    x, y = observed(table[["x_m", "y_m"]].to_numpy(), manipulator.effect, image_centre_m, elapsed).T
    return table.assign(x_m=x, y_m=y, angle_rad=table["angle_rad"] + turned(manipulator.effect, elapsed))


def peak_stress(block: pd.DataFrame, steps: int) -> np.ndarray:
    """(s,) highest bending stress of a plate in each of the `steps` of a block solved with `stress_pa`, Pa; NaN where
    it is not known."""
    return np.fmax.reduce(block["stress_pa"].to_numpy().reshape(steps, -1), axis=1)


def _framed(table: LoadTable, columns: dict[str, np.ndarray]) -> pd.DataFrame:
    """Load steps and the solved `columns` of their states as one table; entries are removed from `columns`."""
    count = len(table.steps)
    disks = len(columns["x_m"]) // count
    sequence = np.repeat(np.cumsum(table.begins) - 1, disks)
    return pd.DataFrame(
        {
            "sequence": texts(table.names, sequence),
            "step": np.repeat(table.steps, disks),
            "disk": np.tile(np.arange(disks), count),
            "x_m": columns.pop("x_m"),
            "y_m": columns.pop("y_m"),
            "angle_rad": columns.pop("angle_rad"),
            "outcome": texts([outcome.label for outcome in Outcome], columns.pop("outcome")),
            **columns,
        },
        copy=False,
    )


def history_problem(chain: Chain) -> str:
    """A message if a chain has too many plates to be solved along its loading history; else empty.

    Which holes stick is found for all holes together, with a full matrix.
    """
    if chain.tied or not chain.presliding > 0 or chain.plates <= MOST_COUPLED_PLATES:
        return ""
    return (
        f"{chain.plates:,} plates with friction that follows the cables' travel: at most {MOST_COUPLED_PLATES:,}, as "
        "which holes stick takes memory with the square of the plates"
    )


def _solved(manipulator: Manipulator, chain: Chain, block: LoadTable, also: Collection[Extra]) -> dict[str, np.ndarray]:
    """Solved columns of a block of whole sequences, a row for every disk of every step."""
    sign = "lowest_eigenvalue_n_m_per_rad" not in also
    asked: dict[str, Any] = {"eigenvalue": True, "only_its_sign": sign, "number": block.steps}
    states = equilibria_of(chain, block.loads, from_rest=block.begins, **asked)
    disks = states.x.shape[1]
    columns = {"x_m": states.x, "y_m": states.y, "angle_rad": states.angle}
    tension = disk_tension(chain, block.loads, states)
    columns |= {f"cable_{name}_n": tension[:, :, j] for j, name in enumerate(manipulator.cable_names)}
    if "stress_pa" in also:
        strain = peak_strain(states, manipulator.bending_stiffness, manipulator.outer_fibre)
        columns["stress_pa"] = np.pad(strain * manipulator.youngs_modulus_pa, [(0, 0), (1, 0)], constant_values=np.nan)
    columns = {name: values.ravel() for name, values in columns.items()}
    if "lowest_eigenvalue_n_m_per_rad" in also and states.lowest_eigenvalue is not None:
        columns["lowest_eigenvalue_n_m_per_rad"] = np.repeat(states.lowest_eigenvalue, disks)
    return columns | {"outcome": np.repeat(states.outcome, disks)}


def disk_tension(chain: Chain, loads: Loads, states: Equilibria) -> np.ndarray:
    """(s, n + 1, m) tension of each cable over the plate that ends at each disk, N; at the base disk the tension of
    `loads`.

    Broken cables carry nothing.  Tensions over the plates of a step without equilibrium are NaN.  For states without
    detail, the tension of `loads` stands at every disk.
    """
    entering = (loads.tension * (chain.reach > 0))[:, None]
    if not len(states.tension):
        return np.broadcast_to(entering, (loads.steps, chain.plates + 1, entering.shape[-1]))
    return np.concatenate([entering, states.tension], axis=1)


def texts(values: Collection[str], rows: np.ndarray) -> Any:
    """A column of text: `values` in the given rows."""
    return pd.Series(list(values), dtype=None if len(values) else object).array.take(rows)
