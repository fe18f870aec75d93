"""Say what a file is and whether it is in order."""

import tomllib
from pathlib import Path

from prb3r.errors import Problem, SpecError
from prb3r.model.manipulator import load_manipulator
from prb3r.model.table import SUFFIXES, read_table


def check_file(path: Path) -> str:
    """One line on a manipulator, study or step table that is in order.

    Raises
    ------
    SpecError
        With every problem of the file.
    """
    if not path.exists():
        raise SpecError(Problem(str(path), "no such file"))
    if path.suffix in SUFFIXES:
        return _check_table(path)
    if path.suffix != ".toml":
        raise SpecError(Problem(str(path), "not a .toml, .csv or .parquet file"))
    if _is_manipulator(path):
        manipulator = load_manipulator(path)
        return (
            f"manipulator, {len(manipulator.segment)} segments, {manipulator.plates} plates, "
            f"{len(manipulator.cable)} cables, {manipulator.chain().length:.4g} m long"
        )
    from prb3r.study.run import plan_study

    plan = plan_study(path)
    return f"study of {len(plan.cases)} cases"


def _is_manipulator(path: Path) -> bool:
    try:
        keys = set(tomllib.loads(path.read_text()))
    except (OSError, ValueError):
        return False  # the strict reader says what is wrong
    return bool(keys & {"segment", "cable", "disk", "youngs_modulus_pa"})


def _check_table(path: Path) -> str:
    frame = read_table(path)
    missing = [key for key in ("sequence", "step") if key not in frame]
    if missing:
        raise SpecError(*(Problem(str(path), f"column {key!r} is missing") for key in missing))
    sequences = frame["sequence"].nunique()
    return (
        f"table of {len(frame)} rows in {sequences} sequences; its columns are checked with the manipulator they load"
    )
