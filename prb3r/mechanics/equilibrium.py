r"""Equilibria of a chain along a load path: the entrance to the mechanics."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from prb3r.mechanics.chain import Chain, Loads, acting
from prb3r.mechanics.drift import scratch
from prb3r.mechanics.grip import grip_space
from prb3r.mechanics.march import FAILED
from prb3r.mechanics.path import Path, follow, state
from prb3r.mechanics.records import Packed, pack
from prb3r.mechanics.tangent import chain_tangent, segment_modes, unit_modes
from prb3r.mechanics.trail import Trail, empty_trail


class Outcome(IntEnum):
    """How a solve ended; `sentence` says what it means."""

    CONVERGED = 0
    UNSTABLE = 1
    NO_EQUILIBRIUM = 2

    @property
    def label(self) -> str:
        return self.name.lower().replace("_", " ")

    @property
    def sentence(self) -> str:
        return (
            "In balance.",
            "In balance, but the lowest eigenvalue of the tangent is not positive: the branch is unstable.",
            "No equilibrium was found on the branch that the load path leads along.",
        )[self]


@dataclass(frozen=True)
class Equilibria:
    """Equilibria of `s` load steps of a chain with `n` plates and `m` cables.  Failed steps hold NaN."""

    outcome: np.ndarray
    """(s,) values of :class:`Outcome`."""
    iterations: np.ndarray
    """(s,) Newton steps, of the plate that took most, summed over the halved steps."""
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
    """(s, n, m) slip at the hole before each plate, -1 drawn in to +1 paid out; empty where slip is declared."""
    lowest_eigenvalue: np.ndarray | None
    """(s,) of the tangent, N m/rad; None where it was not asked for."""
    closed: np.ndarray | None = None
    """(s,) whether moments that follow the state agree with it; None where there are none."""


def lowest_under_load(packed: Packed, modes: np.ndarray, loads: Loads, q: np.ndarray) -> float:
    """Lowest eigenvalue of the whole tangent in `modes` at node angles `q`, under one step of loads, N m/rad.

    Slip and cable lengths of the state are in `packed`, where friction follows the cables' travel.
    """
    work = scratch(packed, modes.shape[2])
    packed.plate["q"][:-1] = q
    chain_tangent(packed, loads.tension, loads.slip, loads.force, loads.tip, modes, work)
    return float(np.linalg.eigvals(work.system[:, :-1]).real.min())


def solve(
    chain: Chain,
    loads: Loads,
    *,
    from_rest: bool | np.ndarray = False,
    eigenvalue: bool = False,
    detail: bool = True,
    trail: Trail | None = None,
) -> Equilibria:
    """Equilibria of `chain` under every step of `loads`, from rest: no slip at any hole, constant loads alone.

    Parameters
    ----------
    from_rest : (s,) or one for all: the steps that are ramped from rest instead of from the step before.
    eigenvalue : also compute the lowest eigenvalue of the tangent and mark unstable equilibria.
    detail : False leaves `q`, `tension`, `moment` and `slip` empty (zero steps), for clouds of a great many loads.
    trail : where accepted sub-steps are kept, if friction follows the cables' travel.
    """
    (plates, n), cables, history = chain.stiffness.shape, chain.offset.shape[1], chain.presliding > 0
    steps, packed = loads.steps, pack(chain)
    modes = segment_modes(chain) if chain.tied else None
    rows = acting(chain, loads)
    onset = Loads(*(np.concatenate([np.zeros_like(field[:1]), field[:1]]) for field in rows))
    dead = rows.force.any((1, 2)) | rows.tip.any(1)
    packed.model["extra"] = rows.moment.any()
    kept = steps if detail or (eigenvalue and (chain.tied or history or dead.any())) else 0
    path = Path(
        status=np.full((steps, 2), FAILED),
        residual=np.full(steps, np.nan),
        q=np.full((kept, plates, n), np.nan),
        disk=np.concatenate([np.zeros((steps, 1, 3)), np.full((steps, plates, 3), np.nan)], axis=1),
        tension=np.full((kept, plates, cables), np.nan),
        moment=np.full((kept, plates, n + 2), np.nan),
        slip=np.full((kept if history else 0, plates, cables), np.nan),
        beyond=np.full((kept if history else 0, plates, cables), np.nan),
        lowest=np.full(steps if eigenvalue else 0, np.nan),
    )
    now = Loads(*(np.zeros_like(field[0]) for field in loads))
    states = (state(chain) for _ in range(5))
    space = (now, grip_space(packed, history), *states, np.zeros((plates, 2)), trail or empty_trail(chain))
    work = scratch(packed, modes.shape[2] if modes is not None else 2 + cables if history else 2)
    anew = np.array(np.broadcast_to(from_rest, steps), bool)
    follow(packed, onset, rows, dead, anew, modes, work, space, path)
    outcome = np.where(path.status[:, 0] == FAILED, Outcome.NO_EQUILIBRIUM, Outcome.CONVERGED).astype(np.int8)
    if eigenvalue:
        modes = unit_modes(chain) if modes is None else modes
        for s in np.flatnonzero((outcome == Outcome.CONVERGED) & np.isnan(path.lowest)):
            if history:
                for name, values in (("slip", path.slip), ("new_slip", path.slip), ("beyond", path.beyond)):
                    packed.span[name] = values[s]
                packed.span["sticks"] = np.abs(path.slip[s]) < 1
            step = Loads(*(field[s + 1] for field in rows))._replace(tension=np.maximum(rows.tension[s + 1], 0.0))
            path.lowest[s] = lowest_under_load(packed, modes, step, path.q[s])
        outcome[path.lowest <= 0] = Outcome.UNSTABLE
    x, y, angle = np.moveaxis(path.disk, -1, 0)
    return Equilibria(
        outcome=outcome,
        iterations=path.status[:, 1],
        residual=path.residual,
        q=path.q,
        x=x,
        y=y,
        angle=angle,
        tension=path.tension,
        moment=path.moment,
        slip=path.slip,
        lowest_eigenvalue=path.lowest if eigenvalue else None,
    )
