"""Derivatives of a manipulator's equilibria under a table of load steps by named parameters, as a table."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError
from prb3r.mechanics.derivatives.sensitivity import Direction, OtherKindError, direction
from prb3r.model.given import of_given
from prb3r.model.laws.derivatives import sensitivities_under_law
from prb3r.model.manipulator import Manipulator
from prb3r.model.parameter import Parameter, changed_loads, parameter_at
from prb3r.model.paths import with_value
from prb3r.model.steps import LoadSequence, sequences_of


@of_given
def sensitivities(
    manipulator: Manipulator, steps: pd.DataFrame | str | Path, parameters: Iterable[str]
) -> pd.DataFrame:
    """Derivatives of the equilibria along each sequence of load steps; every sequence starts from rest.

    Parameters
    ----------
    manipulator, steps : as for `solve`.
    parameters : paths such as `youngs_modulus_pa`, `segment.1.thickness_m`, `cable.2.offset_m` or `effect.1.factor`;
        `tension.2`, a factor on all tensions of cable 2; `tip_y_n`, a load that is added in every step, or
        `step.3.cable_1_n`, one that is added in step 3 alone.

    Returns
    -------
    DataFrame with `sequence, step, disk, parameter` and the derivatives `dx_m, dy_m, dangle_rad` of each disk and, for
    each cable, `dcable_<name>_n` of its tension over the plate that ends at the disk; all per unit of the parameter.
    Steps without equilibrium hold NaN.

    Raises
    ------
    SpecError
        With every problem of the table and of the parameters.

    Examples
    --------
    >>> import pandas as pd, prb3r
    >>> steps = pd.DataFrame({"sequence": ["a"], "step": [1], "cable_1_n": [20.0]})
    >>> table = prb3r.sensitivities("studies/manipulators/two-segment.toml", steps, ["cable_1_n"])
    >>> bool(table["dangle_rad"].iloc[-1] > 0)
    True
    """
    known, problems = [], []
    for path in parameters:
        try:
            known.append(parameter_at(manipulator, path))
        except ValueError as error:
            problems.append(Problem("parameters", str(error)))
    sequences = sequences_of(manipulator, steps)
    numbers = {float(number) for sequence in sequences for number in sequence.steps}
    for path in (parameter.path for parameter in known if parameter.path.startswith("step.")):
        if int(path.split(".")[1]) not in numbers:
            problems.append(Problem("parameters", f"{path}: there is no such step"))
    if not known and not problems:
        problems.append(Problem("parameters", "none are given"))
    if problems:
        raise SpecError(*problems)
    tables = []
    for index, sequence in enumerate(sequences):
        directions = _directions(manipulator, steps, index, sequence, known)
        try:
            tables.append(_table(manipulator, sequence, known, directions))
        except OtherKindError as error:
            path, value = known[error.number].path, known[error.number].value
            what = f"{path}: cannot change smoothly at {value:g}, at the end of what it can be"
            raise SpecError(Problem("parameters", what)) from None
    return pd.concat(tables, ignore_index=True)


def _directions(
    manipulator: Manipulator,
    steps: pd.DataFrame | str | Path,
    index: int,
    sequence: LoadSequence,
    known: list[Parameter],
) -> list[Direction]:
    """The direction of each parameter for one sequence, the one with this `index` in the table `steps`."""
    chain = manipulator.chain()

    def problem(parameter: Parameter, value: float):
        if not parameter.keys:
            return chain, changed_loads(manipulator, chain, sequence.loads, sequence.steps, parameter.path, value)
        other = with_value(manipulator, parameter.keys, value)  # unchecked: a derivative may look past a bound
        if parameter.keys == ("gravity_m_s2",):  # turns kilograms into newtons
            return chain, sequences_of(other, steps)[index].loads
        return other.chain(), sequence.loads

    return [
        direction(lambda value, parameter=parameter: problem(parameter, value), parameter.value, parameter.step)  # type: ignore[misc]
        for parameter in known
    ]


def _table(
    manipulator: Manipulator, sequence: LoadSequence, known: list[Parameter], directions: list[Direction]
) -> pd.DataFrame:
    """The table of `sensitivities` for one sequence."""
    derivatives = sensitivities_under_law(manipulator.chain(), sequence.loads, directions, number=sequence.steps)
    count, disks, parameters = derivatives.dx.shape
    tension = np.full((count, disks, len(manipulator.cable), parameters), np.nan)
    tension[:, 1:] = derivatives.dtension
    return pd.DataFrame(
        {
            "sequence": sequence.name,
            "step": np.repeat(sequence.steps, disks * parameters),
            "disk": np.tile(np.repeat(np.arange(disks), parameters), count),
            "parameter": np.tile([parameter.path for parameter in known], count * disks),
            "dx_m": derivatives.dx.ravel(),
            "dy_m": derivatives.dy.ravel(),
            "dangle_rad": derivatives.dangle.ravel(),
            **{f"dcable_{name}_n": tension[:, :, j].ravel() for j, name in enumerate(manipulator.cable_names)},
        }
    )
