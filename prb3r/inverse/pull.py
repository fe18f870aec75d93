"""One more load step whose cable tensions are unknown: its equilibrium, distance to the target and derivatives."""

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from prb3r.inverse.target import Target
from prb3r.mechanics.chain import Chain, Loads, loads
from prb3r.mechanics.derivatives.sensitivity import Direction
from prb3r.mechanics.equilibrium import Equilibria
from prb3r.model.laws.derivatives import sensitivities_under_law
from prb3r.model.laws.self_consistent import equilibria_of
from prb3r.model.steps import tension_travel

PULL_STEP = 1e-5
"""Step of a tension for the derivatives, as a share of the largest tension (of 1 N at least).  Only moments at the held
shape are differenced; they are linear in the tension, so that any small step will do, but for friction that depends on
it, where the derivatives are as exact as the step is small."""


Least = Literal["force", "stress"]


@dataclass(frozen=True)
class Aim:
    """What is minimised among the pulls that lead to a target, and how bending moments stress the plates."""

    least: Least
    """`force`: the sum of the tensions; `stress`: the highest bending stress of all plates."""
    fibre: np.ndarray
    """(n,) bending stress of each plate's outermost fibre per bending moment, Pa/(N m); NaN where it is not known."""


class Answer(NamedTuple):
    """The error at a target under some tensions, with its Jacobian; NaN where they have no equilibrium."""

    off: np.ndarray
    """(k,) scaled errors of the `k` coordinates asked for; see `Target.off`."""
    rate: np.ndarray
    """(k, m) their derivatives by the tensions, 1/N."""


@dataclass
class Pull:
    """One more step with unknown tensions on a chain, after steps that are known."""

    chain: Chain
    before: Loads
    """The known steps; they matter where states depend on those before (`Chain.remembers`, moments that follow the
    state) and where friction is larger at the onset of slip (`Loads.travel`)."""
    slip: np.ndarray
    """(m,) declared slip of the step: -1 drawn in, 0 no friction, +1 paid out."""
    target: Target
    aim: Aim
    known: dict[bytes, Answer] = field(default_factory=dict)
    """Answers so far, by the bytes of their tensions."""

    def path(self, tension: np.ndarray) -> Loads:
        """The loads of all steps, the last with tensions (m,), N; the last one alone where no earlier step matters."""
        last = loads(self.chain, tension[None], self.slip[None], elapsed=float(self.before.steps))
        if self.chain.friction_excess:  # nothing else goes by the travel
            pulled, ways = np.vstack([self.before.tension, last.tension]), np.vstack([self.before.slip, last.slip])
            last = last._replace(travel=tension_travel(pulled, ways, np.arange(len(pulled)) == 0)[-1:])
        if not self.chain.follows_path:
            return last
        return Loads(*(np.concatenate(pair) for pair in zip(self.before, last, strict=True)))

    def states(self, tension: np.ndarray) -> Equilibria:
        """Equilibria of all steps of `path` at tensions (m,), N, with lowest eigenvalues; the pull is the last row."""
        return equilibria_of(self.chain, self.path(tension), eigenvalue=True)

    def stress(self, tension: np.ndarray) -> np.ndarray:
        """(n,) highest bending stress of each plate at tensions (m,), Pa."""
        return self.stress_of(self.states(np.maximum(tension, 0.0)))

    def stress_of(self, states: Equilibria) -> np.ndarray:
        """(n,) highest bending stress of each plate in the last of some states, Pa; NaN where no fibre is known."""
        return np.abs(states.moment[-1]).max(-1) * self.aim.fibre

    def cost(self, tension: np.ndarray) -> float:
        """What the aim minimises, at tensions (m,): their sum, N, or the highest bending stress, Pa."""
        if self.aim.least == "force":
            return float(tension.sum())
        return float(np.fmax.reduce(self.stress(tension)))

    def __call__(self, tension: np.ndarray) -> Answer:
        """Error at the target and its Jacobian at tensions (m,), N; negative tensions count as zero."""
        key = tension.tobytes()
        if key not in self.known:
            self.known[key] = self._solved(np.maximum(tension, 0.0))
        return self.known[key]

    def _solved(self, tension: np.ndarray) -> Answer:
        """The answer at tensions (m,), N, none of them negative, solved anew."""
        path, step = self.path(tension), PULL_STEP * max(float(tension.max()), 1.0)
        directions, sound = [], np.flatnonzero(self.chain.reach)
        for cable in sound.tolist():
            more = tension.copy()
            more[cable] += step
            directions.append(Direction((self.chain, self.path(more)), (self.chain, path), step))
        derivatives = sensitivities_under_law(self.chain, path, directions)
        off = self.target.off(self.target.place(derivatives.equilibria)[-1])
        rate = np.zeros((len(off), len(tension)))  # a broken cable moves nothing
        rate[:, sound] = self.target.rate(derivatives)
        return Answer(off, rate)

    def stands(self, tension: np.ndarray) -> bool:
        """Whether the chain has an equilibrium under tensions (m,), N, and finite derivatives there."""
        off, rate = self(tension)
        return bool(np.isfinite(off).all() and np.isfinite(rate).all())


def lengths(chain: Chain, states: Equilibria) -> np.ndarray:
    """(s, m) length of each cable from the base to its end, m, without the parts inside the disks, which never change.

    The spans between disks are straight; `Chain.clearance` is not counted.
    """
    cos, sin = np.cos(states.angle), np.sin(states.angle)
    half = chain.disk / 2
    span = np.zeros((len(states.x), *chain.offset.shape))
    for cable in range(chain.offset.shape[1]):
        offset = chain.offset[:, cable]
        near = np.stack(  # on the distal face of the disk before each plate
            [
                states.x[:, :-1] + half * cos[:, :-1] - offset * sin[:, :-1],
                states.y[:, :-1] + half * sin[:, :-1] + offset * cos[:, :-1],
            ]
        )
        far = np.stack(  # on the proximal face of the disk behind it
            [
                states.x[:, 1:] - half * cos[:, 1:] - offset * sin[:, 1:],
                states.y[:, 1:] - half * sin[:, 1:] + offset * cos[:, 1:],
            ]
        )
        span[:, :, cable] = np.hypot(*(far - near))
    passed = np.arange(chain.plates)[:, None] < chain.reach
    return (span * passed).sum(1)
