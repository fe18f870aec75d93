"""How tensions have to be applied: where they lead if friction follows the cables' travel as they are pulled."""

from itertools import islice, permutations

import numpy as np

from prb3r.inverse.search import Found
from prb3r.inverse.target import ARRIVED, Target
from prb3r.mechanics.chain import Chain, loads
from prb3r.mechanics.equilibrium import Outcome
from prb3r.model.laws.self_consistent import equilibria_of

SAME_PLACE = 1e-3
"""Norm of the scaled errors, see `Target.off`, up to which places count as the same: friction that follows the travel
lags by the presliding length.  Choice."""
MOST_ORDERS = 24
"""Orders of pulling that are tried at most: all of four cables, of more cables those that begin with slack ones."""
AS_DECLARED = "the answer holds for cables that slip as the slip_* columns say"


def application(
    chain: Chain, presliding_m: float, names: list[str], targets: list[Target], pulls: list[Found | None]
) -> str:
    """A sentence on how the tensions have to be applied for their declared slips to come about; empty if it is alike.

    The same tensions are applied to the `chain` with friction that follows the travel: for a single target all cables
    together from rest, and one after the other in each order; for a path together from target to target.
    """
    rubs = chain.friction.any() or bool(np.any(chain.pulley != 1))
    known = [pull for pull in pulls if pull is not None]
    if chain.presliding > 0 or chain.tied or not rubs or len(known) < len(pulls):
        return ""
    history = chain._replace(presliding=presliding_m)
    tension = np.array([pull.tension for pull in known])
    (together,) = _ends(history, targets, tension[None])
    off = np.array([np.linalg.norm(target.off(place)) for target, place in zip(targets, together, strict=True)])
    meant = np.array([pull.distance <= ARRIVED for pull in known])
    off = np.where(meant, np.nan_to_num(off, nan=np.inf), 0.0)
    if off.max() <= SAME_PLACE:
        return ""
    worst = int(np.argmax(off))
    astray = _astray(targets[worst], together[worst])
    if len(targets) > 1:
        return (
            "changed together from target to target, with friction that follows the cables' travel, these tensions "
            f"at worst {astray} (step {worst + 1}); {AS_DECLARED}"
        )
    (pull,), (target,) = known, targets
    drawn = sorted(np.flatnonzero(pull.tension), key=lambda cable: (-pull.slip[cable], pull.tension[cable]))
    orders = list(islice(permutations(drawn), MOST_ORDERS))
    applied = np.array(
        [
            [np.where(np.isin(np.arange(len(names)), order[: k + 1]), pull.tension, 0.0) for k in range(len(order))]
            for order in orders
        ]
    )
    places = [steps[-1] for steps in _ends(history, [target] * len(drawn), applied)]
    ends = np.nan_to_num([np.linalg.norm(target.off(place)) for place in places], nan=np.inf)
    best = int(np.argmax(ends <= SAME_PLACE)) if ends.min() <= SAME_PLACE else int(np.argmin(ends))
    turn = ", then ".join(names[cable] for cable in orders[best])
    if ends[best] <= SAME_PLACE:
        return (
            f"pull {turn}: in this order, with friction that follows the cables' travel, they lead there; "
            f"all together they {astray}"
        )
    return (
        f"all together, with friction that follows the cables' travel, these tensions {astray}; one after the other "
        f"({turn}) they at best {_astray(target, places[best])}; {AS_DECLARED}"
    )


def _astray(target: Target, place: np.ndarray) -> str:
    """What becomes of tensions that bring the disk to `place` (3,), NaN without an equilibrium: `end 3.1 mm off`."""
    return f"end {target.off_in_words(place)} off" if np.isfinite(place).all() else "have no stable equilibrium"


def _ends(chain: Chain, targets: list[Target], tension: np.ndarray) -> np.ndarray:
    """(o, s, 3) places of the targets' disk after each of `s` steps of `o` sequences of tensions (o, s, m), N.

    NaN where there is no stable equilibrium.
    """
    sequences, steps, cables = tension.shape
    number = np.tile(np.arange(steps), sequences)
    path = loads(chain, tension.reshape(-1, cables), elapsed=number[:, None].astype(float))
    states = equilibria_of(chain, path, from_rest=number == 0, eigenvalue=True, only_its_sign=True)
    place = targets[0].place(states)
    place[states.outcome != Outcome.CONVERGED] = np.nan
    return place.reshape(sequences, steps, 3)
