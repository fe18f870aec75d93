"""Cable tensions of one more load step as unknowns: where they bring the disks, and the derivatives of that."""

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
"""Change of a tension to either side, of the largest one: loads are linear in it, so that any small one does."""


Least = Literal["force", "stress"]


@dataclass(frozen=True)
class Aim:
    """What is to be least of all pulls that lead to a target, and what stresses the plates."""

    least: Least
    """The sum of the tensions, or the highest bending stress of a plate."""
    fibre: np.ndarray
    """(n,) bending stress of each plate's outermost fibre for one newton metre, Pa; NaN where it is not known."""


class Answer(NamedTuple):
    """What tensions do to a target; NaN where the manipulator does not stand still under them."""

    off: np.ndarray
    """(k,) what the coordinates asked for are off; see `Target.off`."""
    rate: np.ndarray
    """(k, m) its derivatives by the tensions, per newton."""


@dataclass
class Pull:
    """One more step of tensions on a chain, after steps that stay as they are."""

    chain: Chain
    before: Loads
    """Steps that are applied first; they matter where states depend on those before, and to the travel."""
    slip: np.ndarray
    """(m,) declared slip of the step."""
    target: Target
    aim: Aim
    known: dict[bytes, Answer] = field(default_factory=dict)
    """Answers by the tensions that they were asked with."""

    def path(self, tension: np.ndarray) -> Loads:
        """The loads of all steps, the last with tensions (m,), N; that one alone where no earlier step matters."""
        last = loads(self.chain, tension[None], self.slip[None])
        if self.chain.friction_excess:  # nothing else goes by the travel
            pulled, ways = np.vstack([self.before.tension, last.tension]), np.vstack([self.before.slip, last.slip])
            last = last._replace(travel=tension_travel(pulled, ways, np.arange(len(pulled)) == 0)[-1:])
        if not self.chain.remembers and not self.chain.closure:
            return last
        return Loads(*(np.concatenate(pair) for pair in zip(self.before, last, strict=True)))

    def states(self, tension: np.ndarray) -> Equilibria:
        """The equilibrium of the last step, with its lowest eigenvalue, as one step."""
        return equilibria_of(self.chain, self.path(tension), eigenvalue=True)

    def stress(self, tension: np.ndarray) -> np.ndarray:
        """(n,) highest bending stress of each plate at tensions (m,), Pa."""
        return self.stress_of(self.states(np.maximum(tension, 0.0)))

    def stress_of(self, states: Equilibria) -> np.ndarray:
        """(n,) that of the last of some states."""
        return np.abs(states.moment[-1]).max(-1) * self.aim.fibre

    def cost(self, tension: np.ndarray) -> float:
        """What is to be least, at tensions (m,): N, or Pa."""
        if self.aim.least == "force":
            return float(tension.sum())
        return float(np.fmax.reduce(self.stress(tension)))

    def __call__(self, tension: np.ndarray) -> Answer:
        """What the target is off at tensions (m,), N, and its derivatives; negative tensions count as zero."""
        key = tension.tobytes()
        if key not in self.known:
            self.known[key] = self._solved(np.maximum(tension, 0.0))
        return self.known[key]

    def _solved(self, tension: np.ndarray) -> Answer:
        path, step = self.path(tension), PULL_STEP * max(float(tension.max()), 1.0)
        directions = []
        for cable in range(len(tension)):
            change = np.zeros_like(tension)
            change[cable] = step
            ahead, behind = (self.path(tension + sign * change) for sign in (1, -1))
            directions.append(Direction((self.chain, ahead), (self.chain, behind), 2 * step))
        derivatives = sensitivities_under_law(self.chain, path, directions)
        off = self.target.off(self.target.place(derivatives.equilibria)[-1])
        return Answer(off, self.target.rate(derivatives))

    def stands(self, tension: np.ndarray) -> bool:
        """Whether there is an equilibrium under tensions (m,), and derivatives."""
        off, rate = self(tension)
        return bool(np.isfinite(off).all() and np.isfinite(rate).all())


def lengths(chain: Chain, states: Equilibria) -> np.ndarray:
    """(s, m) length of each cable from the base to its end, m, but for what runs inside the disks."""
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
