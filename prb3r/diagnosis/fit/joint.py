r"""Several recordings fitted together: one least-squares problem with parameters that some rigs share.

The model of rig `i` has the parameters :math:`A_i P`, with the joint parameters `P`.  A shared parameter has entries in
several :math:`A_i`.  Where a rig's constant parts from the shared one, it is the sum of that and of an offset.  The
residuals are the misfits of all rigs, one below the other, then one row for the prior of each joint parameter.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from prb3r.diagnosis.fit.belief import Belief, marginal_precision
from prb3r.diagnosis.fit.model import Fit, Model, idle_effects, normal_matrix
from prb3r.diagnosis.fit.prediction import Solution
from prb3r.diagnosis.fit.spans import spans_of
from prb3r.diagnosis.library.joint import JointHypothesis
from prb3r.diagnosis.settings import Settings

Constant = tuple[str, tuple[int, ...]]
"""Name of a constant, and numbers of the rigs that have it in common."""


@dataclass(frozen=True, eq=False)
class JointModel:
    """The models of several recordings with joint parameters, in the form that `least_squares.fit` minimises.

    Below, R is the number of readings of all recordings and P that of joint parameters.
    """

    rigs: tuple[Model, ...]
    """The model of each recording, without effects."""
    shared: Mapping[str, tuple[int, ...]]
    """For every shared constant, by name, the numbers of the rigs that share it."""
    hypotheses: tuple[JointHypothesis, ...] = ()

    @property
    def settings(self) -> Settings:
        """The settings of the first recording; all recordings have the same."""
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
        """The joint constants: the shared ones, then those that each rig has for itself."""
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
        """Where the parameters of each joint hypothesis stand among all (P,), in the order of `hypotheses`."""
        return spans_of((len(hypothesis.free) for hypothesis in self.hypotheses), len(self.varied))

    @cached_property
    def maps(self) -> tuple[np.ndarray, ...]:
        """(p_i, P) for every rig: the matrix that gives its parameters from the joint ones."""
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

    def narrower(self, rig: int) -> np.ndarray:
        """(P,) by how much the prior of a joint constant is more precise than that which recording `rig` states."""
        out, member = np.zeros(self.count), self.rigs[rig]
        for column, ((name, rigs), sd) in enumerate(zip(self.varied, self.priors, strict=True)):
            if rig in rigs:
                out[column] = 1 / sd**2 - 1 / member.priors[member.varied.index(name)] ** 2
        return out

    @cached_property
    def priors(self) -> np.ndarray:
        """(c,) prior standard deviations of the joint constants; of a shared one the narrowest of its recordings."""
        return np.array(
            [min(self.rigs[k].priors[self.rigs[k].varied.index(name)] for k in rigs) for name, rigs in self.varied]
        )

    @cached_property
    def deviations(self) -> np.ndarray:
        """(P,) prior standard deviations of the joint parameters; infinite: flat."""
        free = [free.prior_sd for hypothesis in self.hypotheses for free in hypothesis.free]
        return np.concatenate([self.priors, free])

    def bounds(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(P,) lowest and highest value of every joint parameter that all rigs which have it allow.

        Where a constant parts from the shared one, the rig's bounds limit the shared one, and its offset has its own.
        """
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
        """The solution of every recording, in their order, for the joint parameters `p` (P,)."""
        return tuple(member.solve(whole @ p) for member, whole in zip(self.members, self.maps, strict=True))

    def residuals(self, p: np.ndarray, solved: tuple[Solution, ...]) -> np.ndarray:
        """(R + P,) whitened misfits of all recordings, then one row for each prior."""
        parts = [
            member.residuals(whole @ p, solution)[: member.recording.readings.count]
            for member, whole, solution in zip(self.members, self.maps, solved, strict=True)
        ]
        return np.concatenate([*parts, -p / self.deviations])

    def jacobian(self, p: np.ndarray, solved: tuple[Solution, ...]) -> np.ndarray:
        """(R + P, P) derivatives of the residuals by the joint parameters."""
        parts = [
            -member.noise.whiten(member.moved(whole @ p, solution)) @ whole
            for member, whole, solution in zip(self.members, self.maps, solved, strict=True)
        ]
        return np.vstack([*parts, -np.diag(1 / self.deviations)])

    def fitted(
        self, p: np.ndarray, residual: np.ndarray, jacobian: np.ndarray, solved: tuple[Solution, ...], done: bool
    ) -> "JointFit":
        """The finished fit with the joint parameters `p`; `done`: whether the minimiser has converged."""
        return JointFit(self, p, residual, jacobian, solved, done)


@dataclass(frozen=True, eq=False)
class JointFit:
    """A joint model fitted to its recordings."""

    model: JointModel
    p: np.ndarray
    """(P,) joint parameters."""
    residual: np.ndarray
    """(R + P,) whitened misfits, then rows of the priors."""
    jacobian: np.ndarray
    """(R + P, P) derivatives of the residuals."""
    solved: tuple[Solution, ...]
    """Of each recording, in their order."""
    converged: bool = True
    """As of `Fit.converged`."""

    @property
    def chi2(self) -> float:
        """Sum of squared residuals of all recordings, priors of constants and effects included."""
        return float(self.residual @ self.residual)

    @property
    def balanced(self) -> bool:
        """Whether every step of every recording has an equilibrium, so that no predicted reading is NaN."""
        return all(np.isfinite(solved.readings).all() for solved in self.solved)

    @property
    def costly(self) -> bool:
        """Whether a prediction is slow: on some rig, friction makes the state of a step depend on those before it."""
        return any(solved.chain.presliding > 0 for solved in self.solved)

    @property
    def covariance(self) -> np.ndarray:
        """(P, P) linearised covariance of the joint parameters: the pseudo-inverse of the normal matrix."""
        return np.linalg.pinv(normal_matrix(self), hermitian=True)

    @cached_property
    def idle(self) -> frozenset[JointHypothesis]:
        """The fitted effects that move no reading of any recording."""
        return idle_effects(self.model, self.jacobian[: self.rows[-1].stop])

    @property
    def shares_in_name_alone(self) -> bool:
        """Whether every cable that a rig pulls has a friction coefficient of its own although the rig is to share one:
        it then has its own friction under another name."""
        for rig in self.model.shared.get("log_friction", ()):
            member = self.model.members[rig]
            pulled = np.asarray((member.recording.loads.tension > 0).any(0))
            names = {name for name, used in zip(member.recording.manipulator.cable_names, pulled, strict=True) if used}
            own = [dict(part.place) for part in member.hypotheses if part.kind == "cable_friction"]
            if names and names <= {cable for place in own for cable in place.get("cables", ())}:
                return True
        return False

    @cached_property
    def rows(self) -> tuple[slice, ...]:
        """Where the readings of each recording stand among the residuals."""
        return spans_of(rig.recording.readings.count for rig in self.model.rigs)

    def part(self, rig: int) -> Fit:
        """The model of one recording at the joint minimum, as if nothing were known from the other recordings."""
        return self._at(self.model.members[rig], rig)

    def believed(self, rig: int) -> Fit:
        """The model of one recording at the joint minimum, with what the other recordings say of its parameters.

        The joint minimum is its own too, unless a constant of it parts from the shared one.
        """
        return self._at(replace(self.model.members[rig], belief=self._belief(rig)), rig)

    def _at(self, member: Model, rig: int) -> Fit:
        """The `member` model of a rig with the parameters and states of the joint fit."""
        p, solved = self.model.maps[rig] @ self.p, self.solved[rig]
        return Fit(member, p, member.residuals(p, solved), member.jacobian(p, solved), solved, self.converged)

    def _belief(self, rig: int) -> Belief | None:
        """What the other recordings say of the parameters of one rig, linearised around the minimum; None: nothing.

        The parameters that the rig does not have are marginalised.  Priors of its own parameters are left out, as its
        model has them already, but for what a narrower prior of another recording says of a shared constant.  Of a
        constant that parts from the shared one the others say nothing.
        """
        whole, member = self.model.maps[rig], self.model.members[rig]
        names, narrower = member.names, self.model.narrower(rig)
        parted = whole.sum(1) > 1
        of_rig = np.zeros(len(self.residual), bool)
        of_rig[self.rows[rig]] = True
        of_rig[self.rows[-1].stop + np.flatnonzero(whole.any(0))] = True  # priors of its parameters
        others, left = self.jacobian[~of_rig], self.residual[~of_rig]
        kept = whole[~parted].any(0) & (others.any(0) | (narrower > 0))
        if not kept.any():
            return None
        normal, along = others.T @ others, -others.T @ left
        precision, across = marginal_precision(normal, kept)
        precision = precision + np.diag(narrower[kept])
        along -= narrower * self.p  # of a prior around zero
        vector = precision @ self.p[kept] + along[kept] - across @ along[~kept]
        said = [names[int(np.flatnonzero(whole[:, k])[0])] for k in np.flatnonzero(kept)]
        return Belief(tuple(said), precision, vector)
