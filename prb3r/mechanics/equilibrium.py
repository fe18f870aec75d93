r"""Equilibria of a chain along a load path: `solve_chain`, the entrance to the mechanics, and what it returns."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from prb3r.mechanics.accepted import AcceptedStates, room_for_states
from prb3r.mechanics.acting import acting, dead_loads
from prb3r.mechanics.attempt import JUMPED, Way
from prb3r.mechanics.block_eigenvalue import has_closed_form, lowest_of_blocks
from prb3r.mechanics.budget import GAVE_UP, Allowance
from prb3r.mechanics.chain import Chain, Loads, no_loads
from prb3r.mechanics.definite import mark_definite
from prb3r.mechanics.eigenvalue import WRITTEN_OUT, lowest_under_load
from prb3r.mechanics.load_row import load_row, rows_of_loads
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.path import SMALLEST_STEP, PathSpace, Program, follow, history_space, path_space
from prb3r.mechanics.path_output import Path
from prb3r.mechanics.records import Packed, pack
from prb3r.mechanics.side_by_side import lane_space, solve_side_by_side, stand_alone
from prb3r.mechanics.tangent import segment_modes, unit_modes
from prb3r.mechanics.variation import scratch


class Outcome(IntEnum):
    """How a solve ended; `sentence` says what it means."""

    CONVERGED = 0
    UNSTABLE = 1
    NO_EQUILIBRIUM = 2
    LIMIT_POINT = 3
    DETOUR = 4
    GAVE_UP = 5

    @property
    def label(self) -> str:
        return self.name.lower().replace("_", " ")

    @property
    def sentence(self) -> str:
        return (
            "In balance.",
            "In balance, but the lowest eigenvalue of the tangent is not positive: the branch is unstable.",
            "No equilibrium was found on the branch that the load path leads along.",
            "The branch ends before this load: the manipulator would jump.",
            "In balance, but the path to it leaves out a step before that was not reached.",
            "Given up: the work that a path may take is done, and its next equilibrium was not found.",
        )[self]

    @property
    def solved(self) -> bool:
        """Whether the step has a state in balance, be it unstable or reached by a detour."""
        return self not in (Outcome.NO_EQUILIBRIUM, Outcome.LIMIT_POINT, Outcome.GAVE_UP)


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of `s` load steps of a chain with `n` plates and `m` cables; NaN for failed steps."""

    outcome: np.ndarray
    """(s,) values of :class:`Outcome`; limit points are told from other failures only with the eigenvalue."""
    reached: np.ndarray
    """(s,) part of the way from the last solved step (or rest) to which the branch was followed; 1 for solved steps."""
    iterations: np.ndarray
    """(s,) Newton steps, summed over the accepted sub-steps; of plates solved one by one the most that a plate took."""
    work: np.ndarray
    """(s,) evaluations of a plate that the step took, failed sub-steps included."""
    residual: np.ndarray
    """(s,) largest unbalanced moment, N m."""
    q: np.ndarray
    """(s, n, nodes) node angles, rad."""
    x: np.ndarray
    """(s, n + 1) centres of disks 0..n, m."""
    y: np.ndarray
    """(s, n + 1), m."""
    angle: np.ndarray
    """(s, n + 1) absolute angles of the disks, rad."""
    tension: np.ndarray
    """(s, n, m) cable tension across each plate, N."""
    moment: np.ndarray
    """(s, n, nodes + 2) bending moment where each arc begins, at its nodes and where it ends, N m."""
    slip: np.ndarray
    """(s, n, m) slip at the hole before each plate, -1 drawn in to +1 paid out; no steps where slip is declared."""
    lowest_eigenvalue: np.ndarray | None
    """(s,) lowest eigenvalue of the tangent, N m/rad; None where it, or more than its sign, was not asked for."""
    closed: np.ndarray | None = None
    """(s,) whether the moments of the chain's terms agree with the state; None for a chain without terms."""

    def reason(self, step: int) -> str:
        """A sentence on the outcome of a step; if the step failed, with the part of it to which its branch led."""
        outcome = Outcome(self.outcome[step])
        if outcome.solved or np.isnan(self.reached[step]):
            return outcome.sentence
        share = np.floor(1e3 * self.reached[step]) / 10
        return f"{outcome.sentence.rstrip('.')}; reached {share:g} % of the step."


LIMIT = 0.05
"""Lowest eigenvalue, over that of the unloaded chain, up to which a branch that leads no further counts as ending at a
limit point."""


def last_solved(failed: np.ndarray) -> np.ndarray:
    """(s,) row of the last solved step before each step, from which it starts unless it starts from rest.

    Row 0 is rest, row k the k-th step.
    """
    solved = np.where(failed, 0, np.arange(1, len(failed) + 1))
    return np.concatenate([[0], np.maximum.accumulate(solved)[:-1]])


def left_out(failed: np.ndarray, anew: np.ndarray) -> np.ndarray:
    """(s,) whether each step, or a step between it and the rest from which its path begins, has failed.

    `failed` (s,) and `anew` (s,): the steps that start from rest.
    """
    if not failed.any() or anew.all():
        return failed
    passed, sofar = np.zeros(len(failed), bool), False
    for s in range(len(failed)):
        sofar = (sofar and not anew[s]) or bool(failed[s])
        passed[s] = sofar
    return passed


def solve_chain(
    chain: Chain,
    loads: Loads,
    *,
    from_rest: bool | np.ndarray = False,
    eigenvalue: bool = False,
    only_its_sign: bool = False,
    detail: bool = True,
    accepted: AcceptedStates | None = None,
    smallest_step: float = SMALLEST_STEP,
    allowance: Allowance | None = None,
) -> Equilibria:
    """Equilibria of `chain` under every step of `loads`.

    The path begins at rest, with the constant loads alone and no slip at any hole.  Moments of `chain.closure` are
    ignored; `prb3r.model.laws.self_consistent` takes them into account.

    Parameters
    ----------
    from_rest : (s,) or one for all: the steps that are ramped from rest instead of from the step before.
    eigenvalue : also compute the lowest eigenvalue of the tangent and mark unstable equilibria.
    only_its_sign : mark these, but leave out the eigenvalues, which under dead loads take most of the time.
    detail : False may leave `q`, `tension`, `moment` and `slip` without steps, to save memory in clouds of many loads.
    accepted : arrays in which the accepted sub-steps are kept, where states depend on those before.
    smallest_step : accuracy of `reached` for a step without equilibrium, relative to the part that is reached; not
        used where friction follows the cables' travel.
    allowance : most work that a sequence may take before its steps are given up; absent: `usual_allowance`.
    """
    anew = np.array(np.broadcast_to(from_rest, loads.steps), bool)
    problem = _problem(chain, loads, anew)
    every_state = detail or (eigenvalue and (chain.tied or chain.presliding > 0 or problem.dead.any()))
    path = _empty_path(chain, loads.steps, loads.steps if every_state else 0, eigenvalue)
    done = _solve_independent_steps(problem, path, eigenvalue)
    if not done.all():
        space = path_space(chain, problem.rows, accepted or room_for_states(chain), smallest_step, allowance)
        _follow_steps(problem, path, space, done)

    failed = path.status[:, 0] < 0
    outcome = _outcomes(path.status[:, 0], anew)
    if eigenvalue:
        if only_its_sign:
            path.lowest[_surely_stable(problem, path, failed)] = np.inf
        _find_lowest(problem, path, failed)
        outcome[~failed & (path.lowest <= 0)] = Outcome.UNSTABLE
        if failed.any():
            ends = outcome == Outcome.NO_EQUILIBRIUM
            outcome[ends & (path.lowest <= LIMIT * _lowest_at_rest(problem))] = Outcome.LIMIT_POINT
            for field in (path.lowest, path.q, path.slip, path.beyond):
                if len(field):
                    field[failed] = np.nan
    x, y, angle = np.moveaxis(path.disk, -1, 0)
    return Equilibria(
        outcome=outcome,
        reached=np.where(failed, path.reached, 1.0),
        iterations=path.status[:, 1],
        work=path.spent,
        residual=path.residual,
        q=path.q,
        x=x,
        y=y,
        angle=angle,
        tension=path.tension,
        moment=path.moment,
        slip=path.slip,
        lowest_eigenvalue=path.lowest if eigenvalue and not only_its_sign else None,
    )


@dataclass(frozen=True, eq=False)
class _Problem:
    """A chain and its loads as compiled code takes them."""

    chain: Chain
    packed: Packed
    """Records of the chain, in which every solve leaves its last state."""
    modes: np.ndarray | None
    """Modes that tie the node angles together; None: the angles are free."""
    rows: Loads
    """What acts at rest (row 0) and at each of the `s` steps."""
    dead: np.ndarray
    """(s + 1,) whether dead loads act."""
    anew: np.ndarray
    """(s,) whether a step is ramped from rest."""


def _problem(chain: Chain, loads: Loads, anew: np.ndarray) -> _Problem:
    """The problem of a chain under `loads`, of which the steps `anew` (s,) are ramped from rest."""
    packed, rows = pack(chain), acting(chain, loads, anew)
    return _Problem(chain, packed, segment_modes(chain) if chain.tied else None, rows, dead_loads(chain, rows), anew)


def _empty_path(chain: Chain, steps: int, kept: int, eigenvalue: bool) -> Path:
    """Arrays for the results of `steps` load steps, of which `kept` (all or none) keep their inner states."""
    (plates, n), cables, history = chain.stiffness.shape, chain.offset.shape[1], chain.presliding > 0
    path = Path(
        status=np.full((steps, 2), FAILED),
        reached=np.zeros(steps),
        spent=np.zeros(steps, np.int64),
        residual=np.full(steps, np.nan),
        q=np.full((kept, plates, n), np.nan),
        disk=np.full((steps, plates + 1, 3), np.nan),
        tension=np.full((kept, plates, cables), np.nan),
        moment=np.full((kept, plates, n + 2), np.nan),
        slip=np.full((kept if history else 0, plates, cables), np.nan),
        beyond=np.full((kept if history else 0, plates, cables), np.nan),
        slider=np.full((kept, plates, n, chain.hysteresis.slipping), np.nan),
        stiff=np.ones(steps if eigenvalue else 0),
        lowest=np.full(steps if eigenvalue else 0, np.nan),
        block=np.full((0 if not eigenvalue or has_closed_form(chain) else steps, plates, n, n), np.nan),
    )
    path.disk[:, 0] = 0.0
    return path


def _solve_independent_steps(problem: _Problem, path: Path, eigenvalue: bool) -> np.ndarray:
    """Solve the steps that depend on no other one side by side and write them to `path`; returns a mask (s,)."""
    rows = problem.rows
    alone, done = stand_alone(problem.chain, rows, problem.anew, eigenvalue), np.zeros(len(problem.anew), bool)
    if alone.any():
        space = lane_space(problem.packed)
        solve_side_by_side(problem.packed, rows.tension[1:], rows.slip[1:], alone, space, path, done)
    return done


def _follow_steps(problem: _Problem, path: Path, space: PathSpace, done: np.ndarray) -> None:
    """Solve the steps that are not `done` one after the other, and write them to `path`."""
    chain, packed, modes = problem.chain, problem.packed, problem.modes
    load_path, history = rows_of_loads(problem.rows), chain.presliding > 0
    onset = Way(np.stack([np.zeros_like(load_path[0]), load_path[0]]), np.array([0, 1]), np.zeros(1))
    program = Program(onset, _way(problem), problem.dead, problem.anew, done)
    memory = history_space(chain, packed, space) if history else None
    columns = modes.shape[2] if modes is not None else 2 + chain.offset.shape[1] if history else 2
    follow(packed, program, modes, space, memory, scratch(packed, columns), path)


def _way(problem: _Problem) -> Way:
    """The way through the loads of a problem, whose ends are still to be set."""
    return Way(rows_of_loads(problem.rows), np.zeros(2, np.int64), np.zeros(1))


def _outcomes(status: np.ndarray, anew: np.ndarray) -> np.ndarray:
    """(s,) outcome of each step, as far as it is known without eigenvalues, from the first column of `Path.status`."""
    failed = status < 0
    outcome = np.where(failed, Outcome.NO_EQUILIBRIUM, Outcome.CONVERGED).astype(np.int8)
    outcome[status == JUMPED] = Outcome.LIMIT_POINT
    outcome[status == GAVE_UP] = Outcome.GAVE_UP
    outcome[~failed & left_out(failed, anew)] = Outcome.DETOUR
    return outcome


def _surely_stable(problem: _Problem, path: Path, failed: np.ndarray) -> np.ndarray:
    """(s,) whether a step that has not `failed` is known to be stable without its eigenvalues, by a tangent that is
    positive definite; True only where these have not been found."""
    chain, packed = problem.chain, problem.packed
    definite = ~failed & np.isnan(path.lowest)
    if len(path.block) or chain.tied or chain.remembers or not definite.any() or path.q[0].size > WRITTEN_OUT:
        return np.zeros(len(failed), bool)
    modes, begin = unit_modes(path.q.shape[1:]), np.where(problem.anew, 0, last_solved(failed))
    now, work = load_row(problem.rows), scratch(packed, modes.shape[2])
    mark_definite(packed, _way(problem), begin, now, modes, path.q, definite, work)
    return definite


def _find_lowest(problem: _Problem, path: Path, failed: np.ndarray) -> None:
    """Write the lowest eigenvalues that the solve itself has not written to `path.lowest`.

    That of a `failed` step is of the last state on the way to it.
    """
    packed, rows = problem.packed, problem.rows
    if len(path.block):
        path.lowest[:] = lowest_of_blocks(path.block)
    starts = np.where(problem.anew, 0, last_solved(failed))
    for s in np.flatnonzero(np.isnan(path.lowest)):
        if problem.chain.presliding > 0:
            for name, values in (("slip", path.slip), ("new_slip", path.slip), ("beyond", path.beyond)):
                packed.span[name] = values[s]
            packed.span["sticks"] = np.abs(path.slip[s]) < 1
        packed.plate["slider"][:-1, :, : problem.chain.hysteresis.slipping] = path.slider[s]
        packed.model["stiff"] = path.stiff[s]
        share = path.reached[s] if failed[s] else 1.0
        step = Loads(*((1 - share) * field[starts[s]] + share * field[s + 1] for field in rows))
        slip = step.slip if starts[s] else rows.slip[s + 1]
        step = step._replace(tension=np.maximum(step.tension, 0.0), slip=slip)
        path.lowest[s] = lowest_under_load(packed, problem.modes, step, path.q[s])


def _lowest_at_rest(problem: _Problem) -> float:
    """Lowest eigenvalue of the chain without loads, N m/rad."""
    problem.packed.span["sticks"], problem.packed.plate["slider"], problem.packed.model["stiff"] = False, 0.0, 1.0
    unloaded = Loads(*(field[0] for field in no_loads(problem.chain)))
    return lowest_under_load(problem.packed, problem.modes, unloaded, problem.chain.rest)
