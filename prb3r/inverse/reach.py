"""Tensions that bring a disk to targets: the entrance, which checks the input, searches, and tabulates the answer."""

from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack, get_args

import numpy as np
import pandas as pd

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.inverse.applied import application
from prb3r.inverse.pull import Aim, Least, Pull, lengths
from prb3r.inverse.reached import BEYOND_YIELD, IS_REACHED, NO_PULL, NOT_REACHED, Reached
from prb3r.inverse.search import Found, best_pull, natural_limits
from prb3r.inverse.target import COORDINATES, Target, out_of_reach, targets_of
from prb3r.markdown import listed
from prb3r.mechanics.chain import Chain, Loads, loads, no_loads
from prb3r.model.effects.cables import DeadCable
from prb3r.model.given import of_given
from prb3r.model.laws.moment_law import chain_until
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.manipulator import Manipulator
from prb3r.model.steps import tension_travel


class Wanted(TypedDict, total=False):
    """Where a disk should be, m and rad; coordinates that are left out are free."""

    disk: int | Literal["tip"]
    x_m: float
    y_m: float
    angle_rad: float


@of_given
def pulls_to(
    manipulator: Manipulator,
    *,
    path: pd.DataFrame | str | Path | None = None,
    most_n: float | None = None,
    broken: Collection[str] = (),
    least: Least = "force",
    tell: Callable[[str], object] = str,
    **wanted: Unpack[Wanted],
) -> Reached:
    """Tensions of least sum, or of least stress, that bring a disk to a place, an angle, both, or along a path of them.

    Parameters and errors are those of `prb3r.reach`; `tell` hears, before the search, of targets far out of reach.
    """
    disk = wanted.pop("disk", "tip")
    place = {name: float(value) for name, value in wanted.items() if value is not None}  # type: ignore[arg-type]
    problems = _problems(manipulator, place, most_n, broken)
    if least not in get_args(Least):
        problems.append(Problem("least", f"unknown {least!r}; valid: {', '.join(get_args(Least))}"))
    if least == "stress" and np.isnan(manipulator.outer_fibre).all():
        problems.append(Problem("least", "stress needs thickness_m or outer_fibre_m of a segment"))
    if problems:
        raise SpecError(*problems)
    manipulator = as_searched(manipulator, broken)
    chain = manipulator.chain()
    if lags := lag_problem(chain):
        raise SpecError(Problem(manipulator.name, lags))
    targets = targets_of(chain, disk, place, path)
    for far in out_of_reach(chain, [target.row for target in targets]):
        tell(far)
    most = limits(chain, most_n)
    pulls = pulls_along(chain, targets, most, aim_of(manipulator, least))
    alone = pulls_from_rest(chain, targets, pulls, most, aim_of(manipulator, least))
    table = _table(targets, pulls, alone, most, manipulator)
    applied = application(chain, manipulator.friction.presliding_m, manipulator.cable_names, targets, pulls)
    return Reached(manipulator, _steps(manipulator, pulls), table, applied)


def as_searched(manipulator: Manipulator, broken: Collection[str]) -> Manipulator:
    """The manipulator as tensions are searched for it: `broken` cables are dead ones, friction has its reference rate.

    Targets have no times, so effects that go by the times of steps are left out.
    """
    timeless = [effect for effect in manipulator.effect if not effect.needs_times]
    dead = [DeadCable(kind="dead_cable", cable=name) for name in broken]
    return manipulator.model_copy(update={"effect": [*timeless, *dead]})


def _problems(
    manipulator: Manipulator, wanted: dict[str, float], most_n: float | None, broken: Collection[str]
) -> list[Problem]:
    """Everything wrong with the names, coordinates and the largest tension that were given."""
    names = manipulator.cable_names
    problems = [
        Problem("broken", f"there is no cable {name!r}{did_you_mean(name, names)}")
        for name in broken
        if name not in names
    ]
    problems += [
        Problem("target", f"unknown coordinate {name!r}{did_you_mean(name, COORDINATES)}")
        for name in wanted
        if name not in COORDINATES
    ]
    problems += [
        Problem("target", f"{name} = {value:g} is not allowed; give a finite number")
        for name, value in wanted.items()
        if not np.isfinite(value)
    ]
    if most_n is not None and not 0 < most_n < np.inf:
        problems.append(Problem("most_n", "the largest tension must be more than 0 N"))
    if not set(names) - set(broken):
        problems.append(Problem("manipulator", "no cable is left to pull"))
    return problems


def lag_problem(chain: Chain) -> str:
    """Why tensions are not searched for a chain with `Chain.play`; empty without play.

    Within the play a change of the noted tension moves nothing.
    """
    if not np.any(chain.play):
        return ""
    return (
        "tension_play: which tension to pull with depends on the way it changes; leave the effect out, and pull with "
        "play_n more where the tension grows and with play_n less where it falls"
    )


def limits(chain: Chain, most_n: float | None) -> np.ndarray:
    """(m,) largest tension of each cable, N: `most_n`, or without it the `natural_limits`; 0 for a broken cable."""
    return np.where(chain.reach > 0, natural_limits(chain) if most_n is None else most_n, 0.0)


def aim_of(manipulator: Manipulator, least: Least) -> Aim:
    """The aim of a search: force or stress, and the stress per bending moment in the manipulator's plates."""
    return Aim(least, manipulator.youngs_modulus_pa * manipulator.outer_fibre / manipulator.bending_stiffness)


def pulls_along(chain: Chain, targets: list[Target], most: np.ndarray, aim: Aim) -> list[Found | None]:
    """The best pull for each target, each beginning in the state that the pull before it left.

    None where no pull has a stable equilibrium; the tensions of the step before are held there, see `held_loads`.

    Parameters
    ----------
    most : (m,) largest tension of each cable, N; 0 for one that cannot be pulled.
    """
    rest = chain_until(chain, 0.0)
    length = lengths(rest, equilibria_of(rest, no_loads(rest)))[-1]
    pulls: list[Found | None] = []
    near = None
    for number, target in enumerate(targets, 1):
        part = chain_until(chain, number / len(targets))
        pull = Pull(part, held_loads(part, pulls), -np.ones(len(most)), target.sought, aim)
        best = best_pull(pull, most, length, near)
        pulls.append(best)
        if best is not None:
            length, near = best.lengths, best.tension
            continue
        held = lengths(part, equilibria_of(part, held_loads(part, pulls)))[-1]
        length = np.where(np.isfinite(held), held, length)
    return pulls


def pulls_from_rest(
    chain: Chain, targets: list[Target], pulls: list[Found | None], most: np.ndarray, aim: Aim
) -> list[Found | None]:
    """For each target that its pull of `pulls_along` does not reach, the pull that reaches it from rest; else None.

    From rest: as if the target were the only one.
    """
    found: list[Found | None] = []
    for number, (target, pull) in enumerate(zip(targets, pulls, strict=True)):
        missed = number > 0 and (pull is None or not target.reached(pull.place))
        alone = pulls_along(chain, [target], most, aim)[0] if missed else None
        found.append(alone if alone is not None and target.reached(alone.place) else None)
    return found


def held_loads(chain: Chain, pulls: list[Found | None]) -> Loads:
    """The loads of a step for each of the `pulls`, one after the other.

    Without a pull the step holds tensions and slip of the step before; the first one then pulls nothing.
    """
    tension, slip = np.zeros((2, len(pulls), len(chain.reach)))
    for step, pull in enumerate(pulls):
        held = (tension[step - 1], slip[step - 1]) if step else (0.0, -1.0)
        tension[step], slip[step] = held if pull is None else (pull.tension, pull.slip)
    number = np.arange(len(pulls))
    return loads(chain, tension, slip, elapsed=number[:, None])._replace(
        travel=tension_travel(tension, slip, number == 0)
    )


def _steps(manipulator: Manipulator, pulls: list[Found | None]) -> pd.DataFrame:
    """The loads of the pulls as a table of load steps, numbered by their targets; see `held_loads`."""
    held, names = held_loads(manipulator.chain(), pulls), manipulator.cable_names
    columns: dict[str, Any] = {"sequence": "reach", "step": range(1, len(pulls) + 1)}
    columns |= {f"cable_{name}_n": held.tension[:, j] for j, name in enumerate(names)}
    if not manipulator.follows_history:
        columns |= {f"slip_{name}": held.slip[:, j].astype(int) for j, name in enumerate(names)}
    return pd.DataFrame(columns)


def _table(
    targets: list[Target],
    pulls: list[Found | None],
    alone: list[Found | None],
    most: np.ndarray,
    manipulator: Manipulator,
) -> pd.DataFrame:
    """A row for each target with the columns of `Reached.table`."""
    rows, names, chain = [], manipulator.cable_names, manipulator.chain()
    for number, (target, best, rested) in enumerate(zip(targets, pulls, alone, strict=True), 1):
        place = np.full(3, np.nan) if best is None else best.place
        off = np.where(target.asked, place - target.wanted, 0.0)
        reached = best is not None and target.reached(place)
        safety = np.nan if best is None else _safety(manipulator, best.stress)
        rows.append(
            {
                "step": number,
                "disk": target.disk,
                **{f"wanted_{name}": value for name, value in zip(COORDINATES, target.wanted, strict=True)},
                **dict(zip(COORDINATES, place, strict=True)),
                "distance_m": float(np.hypot(off[0], off[1])),
                "turn_off_rad": float(abs(off[2])),
                "total_n": np.nan if best is None else float(best.tension.sum()),
                "peak_stress_pa": np.nan if best is None else best.stress,
                "safety_factor": safety,
                "reached": reached,
                "outcome": _outcome(best, reached, safety),
                "note": _note(target, best, most, names) + _from_rest(rested, names) + _remark(chain, target, reached),
            }
        )
    return pd.DataFrame(rows)


def _outcome(best: Found | None, reached: bool, safety: float) -> str:
    if best is None:
        return NO_PULL
    return NOT_REACHED if not reached else BEYOND_YIELD if safety < 1 else IS_REACHED


def _safety(manipulator: Manipulator, stress: float) -> float:
    """Yield stress over `stress` (Pa), infinite without stress; NaN where either is not known."""
    if manipulator.yield_stress_pa is None or not np.isfinite(stress):
        return np.nan
    return manipulator.yield_stress_pa / stress if stress else np.inf


def _from_rest(rested: Found | None, names: list[str]) -> str:
    """Ending of the note on a target that is not reached from the one before, but from rest: with which tensions."""
    if rested is None:
        return ""
    pulled = [f"{name} {pull:.4g} N" for name, pull in zip(names, rested.tension, strict=True) if pull > 0]
    return f"; this is from the target before; from rest it is reached with {', '.join(pulled)}"


def _remark(chain: Chain, target: Target, reached: bool) -> str:
    """Ending of the note on a target that is not reached: how far out of reach it is, where that is far."""
    return "" if reached else "".join(f"; {what}" for what in out_of_reach(chain, [target.row]))


def _note(target: Target, best: Found | None, most: np.ndarray, names: list[str]) -> str:
    """Why a target is not reached or, where it is, which cables stick; empty if there is nothing to note."""
    if best is None:
        return "no pull leads to a stable equilibrium; the tensions before are held"
    if not target.reached(best.place):
        full = [
            name for name, pull, limit in zip(names, best.tension, most, strict=True) if 0 < limit <= pull * (1 + 1e-6)
        ]
        return f"cable {' and '.join(full)} at the largest tension" if full else "no nearer pull was found"
    stuck = [name for name, pull, slip in zip(names, best.tension, best.slip, strict=True) if pull > 0 and slip == 0]
    if not stuck:
        return ""
    turn = "sticks: its" if len(stuck) == 1 else "stick: their"
    return f"{_cables(stuck)} {turn} friction, either way, is taken as none"


def _cables(names: list[str]) -> str:
    """Cables by name, such as `cables 1 and 2`."""
    return f"cable{'s' * (len(names) > 1)} {listed(names)}"
