r"""Several recordings fitted together: their parameters, of which some are shared, and one least-squares problem.

The parameters of the model of rig `i` are :math:`A_i P` with the joint ones `P`: a shared one stands in several rigs,
and a constant that parts from the shared one is their sum.  Residuals of the rigs stand one below the other, priors
once.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from prb3r.diagnosis.fit.belief import NOTHING_TOLD, Belief
from prb3r.diagnosis.fit.model import Fit, Model
from prb3r.diagnosis.fit.prediction import Solution
from prb3r.diagnosis.library.joint import JointHypothesis
from prb3r.diagnosis.settings import Settings

Constant = tuple[str, tuple[int, ...]]
"""A constant and the rigs that have it."""


@dataclass(frozen=True, eq=False)
class JointModel:
    """The models of several recordings, and what is fitted to all of them."""

    rigs: tuple[Model, ...]
    """Each without effects."""
    shared: Mapping[str, tuple[int, ...]]
    """Constants that rigs share, and which of them do."""
    hypotheses: tuple[JointHypothesis, ...] = ()

    @property
    def settings(self) -> Settings:
        """The settings of the first recording: all have the same."""
        return self.rigs[0].settings

    @cached_property
    def members(self) -> tuple[Model, ...]:
        """The model of every rig with its effects."""
        return tuple(
            replace(
                rig,
                hypotheses=tuple(part for hypothesis in self.hypotheses if (part := hypothesis.parts[k]) is not None),
            )
            for k, rig in enumerate(self.rigs)
        )

    @cached_property
    def varied(self) -> tuple[Constant, ...]:
        """The constants: the shared ones, then those of each rig."""
        shared = [(name, rigs) for name, rigs in self.shared.items()]
        unshared = [
            (name, (k,)) for k, rig in enumerate(self.rigs) for name in rig.varied if k not in self.shared.get(name, ())
        ]
        return (*shared, *unshared)

    @property
    def count(self) -> int:
        """Number P of joint parameters: a shared one counts once."""
        return len(self.varied) + sum(len(hypothesis.free) for hypothesis in self.hypotheses)

    @cached_property
    def spans(self) -> tuple[slice, ...]:
        """Where the parameters of every effect stand among all (P,), in the order of `hypotheses`."""
        ends = len(self.varied) + np.cumsum([0, *(len(hypothesis.free) for hypothesis in self.hypotheses)])
        return tuple(slice(a, b) for a, b in pairwise(ends.tolist()))

    @cached_property
    def maps(self) -> tuple[np.ndarray, ...]:
        """(p_i, P) of every rig: its own parameters from the joint ones."""
        out = []
        for k, member in enumerate(self.members):
            whole = np.zeros((member.count, self.count))
            for column, (name, rigs) in enumerate(self.varied):
                if k in rigs:
                    whole[member.varied.index(name), column] = 1.0
            row = len(member.varied)
            for hypothesis, span in zip(self.hypotheses, self.spans, strict=True):
                if hypothesis.parting is not None and hypothesis.parted == k:
                    whole[member.varied.index(hypothesis.parting.name), span.start] = 1.0
                for place in hypothesis.places(k):
                    whole[row, span.start + place] = 1.0
                    row += 1
            out.append(whole)
        return tuple(out)

    @cached_property
    def priors(self) -> np.ndarray:
        """(c,) standard deviations of the constants; of one that is shared the narrowest that a recording states."""
        return np.array(
            [min(self.rigs[k].priors[self.rigs[k].varied.index(name)] for k in rigs) for name, rigs in self.varied]
        )

    @cached_property
    def deviations(self) -> np.ndarray:
        """(P,) prior standard deviations of all parameters, each once; infinite: flat."""
        free = [free.prior_sd for hypothesis in self.hypotheses for free in hypothesis.free]
        return np.concatenate([self.priors, free])

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest value of every parameter: what all rigs that have it allow."""
        low, high = np.full(self.count, -np.inf), np.full(self.count, np.inf)
        for member, whole in zip(self.members, self.maps, strict=True):
            for row, ends in enumerate(zip(*member.bounds(whole @ p), strict=True)):
                column = np.flatnonzero(whole[row])[0]  # of a constant that parts: the shared one
                low[column], high[column] = max(low[column], ends[0]), min(high[column], ends[1])
        for hypothesis, span in zip(self.hypotheses, self.spans, strict=True):
            if hypothesis.parting is not None:
                low[span], high[span] = hypothesis.parting.bounds()
        return low, high

    def solve(self, p: np.ndarray) -> tuple[Solution, ...]:
        """States and readings of every recording, in their order, for the joint parameters `p` (P,)."""
        return tuple(member.solve(whole @ p) for member, whole in zip(self.members, self.maps, strict=True))

    def residuals(self, p: np.ndarray, solved: tuple[Solution, ...]) -> np.ndarray:
        """(R + P,) whitened misfits of all recordings, then the priors."""
        parts = [
            member.residuals(whole @ p, solution)[: member.predict.recording.readings.count]
            for member, whole, solution in zip(self.members, self.maps, solved, strict=True)
        ]
        return np.concatenate([*parts, -p / self.deviations])

    def jacobian(self, p: np.ndarray, solved: tuple[Solution, ...]) -> np.ndarray:
        """(R + P, P) derivatives of the residuals."""
        parts = [
            -member.noise.whiten(member.moved(whole @ p, solution)) @ whole
            for member, whole, solution in zip(self.members, self.maps, solved, strict=True)
        ]
        return np.vstack([*parts, -np.diag(1 / self.deviations)])

    def fitted(
        self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: tuple[Solution, ...], done: bool
    ) -> "JointFit":
        """The fit that ended at `p`; `done`: whether it has converged."""
        return JointFit(self, p, residual, jacobian, solved, done)


@dataclass(frozen=True, eq=False)
class JointFit:
    """A joint model fitted to its recordings."""

    model: JointModel
    p: np.ndarray
    """(P,) parameters."""
    residual: np.ndarray
    """(R + P,) whitened, with prior rows."""
    jacobian: np.ndarray
    """(R + P, P) of the residuals."""
    solved: tuple[Solution, ...]
    converged: bool = True

    @property
    def chi2(self) -> float:
        """Sum of squared residuals of all recordings, priors of constants and effects included."""
        return float(self.residual @ self.residual)

    @property
    def balanced(self) -> bool:
        """Whether every step of every recording has an equilibrium, so that all readings are predicted as numbers."""
        return all(np.isfinite(solved.readings).all() for solved in self.solved)

    @property
    def costly(self) -> bool:
        """Whether a prediction is slow, as states follow the load path."""
        return any(solved.chain.presliding > 0 for solved in self.solved)

    @property
    def covariance(self) -> np.ndarray:
        """(P, P) covariance of the joint parameters, linearised: the inverse of the normal equations."""
        return np.linalg.pinv(self.jacobian.T @ self.jacobian, hermitian=True)

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Where the readings of every recording stand among the residuals."""
        ends = np.cumsum([0, *(rig.predict.recording.readings.count for rig in self.model.rigs)])
        return tuple(slice(a, b) for a, b in pairwise(ends.tolist()))

    def part(self, rig: int) -> Fit:
        """One recording's model where the joint fit ended, as if it stood alone."""
        return self._at(self.model.members[rig], rig)

    def believed(self, rig: int) -> Fit:
        """The same with what the other recordings say of its parameters, so that it is at its own minimum."""
        return self._at(replace(self.model.members[rig], belief=self._belief(rig)), rig)

    def _at(self, member: Model, rig: int) -> Fit:
        p, solved = self.model.maps[rig] @ self.p, self.solved[rig]
        return Fit(member, p, member.residuals(p, solved), member.jacobian(p, solved), solved, self.converged)

    def _belief(self, rig: int) -> Belief | None:
        """What the others say of the parameters of one rig, whatever their own are, around the minimum.

        Of a constant that parts from the shared one they say nothing.
        """
        whole, names = self.model.maps[rig], self.model.members[rig].names
        parted = whole.sum(1) > 1
        of_rig = np.zeros(len(self.residual), bool)
        of_rig[self.rows[rig]] = True
        of_rig[self.rows[-1].stop + np.flatnonzero(whole.any(0))] = True  # its priors
        others, left = self.jacobian[~of_rig], self.residual[~of_rig]
        kept = whole[~parted].any(0) & others.any(0)
        if not kept.any():
            return None
        normal, along = others.T @ others, -others.T @ left
        across = normal[np.ix_(kept, ~kept)] @ np.linalg.pinv(
            normal[np.ix_(~kept, ~kept)], NOTHING_TOLD, hermitian=True
        )
        precision = normal[np.ix_(kept, kept)] - across @ normal[np.ix_(~kept, kept)]
        vector = precision @ self.p[kept] + along[kept] - across @ along[~kept]
        said = [names[int(np.flatnonzero(whole[:, k])[0])] for k in np.flatnonzero(kept)]
        return Belief(tuple(said), precision, vector)
