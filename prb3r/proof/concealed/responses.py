r"""The rig's responses to effects on one design, whitened with the rig's own dense covariance.

The covariance of a sequence is reading noise plus tension scatter through the rig's own Jacobian.  Calibration (E, mu,
frame, with their priors as further rows) is projected out of every response, at the nominal constants.  Distances
between effects follow from them in `distances`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from prb3r.proof.concealed.camera import exact_readings, truth
from prb3r.proof.concealed.candidates import candidates
from prb3r.proof.concealed.design import Design, LoadSteps, followed
from prb3r.proof.rig.effects.candidate import Candidate
from prb3r.proof.settings import SETTINGS
from prb3r.recording.recording import Kind


@dataclass(frozen=True)
class Response:
    """Change of the whitened readings by one group of candidates that act together."""

    group: tuple[Candidate, ...]
    columns: np.ndarray
    """(r + c, k) change per unit of each candidate's size, or by the whole effect; calibration not projected out."""

    @property
    def kind(self) -> str:
        """Kind of effect of the group."""
        return self.group[0].kind

    @property
    def sized(self) -> bool:
        """Whether the effect has a size; without one (a dead cable) `columns` is the change by the whole effect."""
        return self.group[0].sized


@dataclass(frozen=True)
class Responses:
    """Responses of a design's readings to effects, computed by the rig.

    `r` is the number of readings of the sequences that count, `c` that of the constants that calibration may adjust.  A
    whitened vector (r + c,) holds the readings in units of noise, then one row for the prior of each constant.
    """

    design: Design
    subset: tuple[int, ...] | None = None
    """Numbers of the sequences that count; None: all."""

    @cached_property
    def program(self) -> tuple[LoadSteps, ...]:
        """Load steps, as noted, of the sequences that `subset` counts, in its order; of all where it is None."""
        chosen = range(len(self.design.program)) if self.subset is None else self.subset
        return tuple(self.design.program[k] for k in chosen)

    def readings(
        self,
        effects: Sequence[Mapping[str, Any]] = (),
        constants: Sequence[float] = (0.0, 0.0),
        frame: Sequence[float] = (0.0, 0.0, 0.0),
        program: Sequence[LoadSteps] | None = None,
    ) -> np.ndarray | None:
        """(steps, disks, kinds) exact readings, m and rad; None where a step has no equilibrium.

        Parameters
        ----------
        effects : tables of a manipulator file
        constants : ln of the factors on E and mu
        frame : rotation, rad, and shift, m
        program : true loads in place of those of the design's sequences
        """
        manipulator = truth(self.design, effects, *constants)
        states = followed(manipulator, self.program if program is None else program)
        return None if states is None else exact_readings(self.design, manipulator, states, [frame] * len(states))

    @cached_property
    def nominal(self) -> np.ndarray:
        """(steps, disks, kinds) exact readings of the nominal manipulator."""
        readings = self.readings()
        if readings is None:
            raise RuntimeError(f"design {self.design.number} has lost its equilibria")
        return readings

    @cached_property
    def sensitivity(self) -> list[np.ndarray]:
        """For each sequence (readings, k): derivatives of its readings by the relative tensions of each step."""
        longest = max(len(steps) for steps in self.program)
        columns: list[list[np.ndarray]] = [[] for _ in self.program]
        begins = np.cumsum([0] + [len(steps) for steps in self.program])
        for name in self.design.cables:
            for place in range(longest) if self.design.follows_path else [None]:
                change = self._scaled_tension(f"cable_{name}_n", place)
                for q in range(len(self.program)):
                    rows = change[begins[q] : begins[q + 1]]
                    if place is not None:
                        if place < len(rows):
                            columns[q].append(rows.ravel())
                    else:
                        for k in range(len(rows)):
                            at_step = np.zeros_like(rows)
                            at_step[k] = rows[k]
                            columns[q].append(at_step.ravel())
        return [np.stack(sequence, 1) for sequence in columns]

    def _scaled_tension(self, column: str, place: int | None) -> np.ndarray:
        """(steps, disks, kinds) derivative of the readings by the relative change of a tension at step `place` of every
        sequence, or at all steps."""
        step_size = SETTINGS.sizes.relative_change
        changed = [
            tuple(
                {**step, column: step[column] * (1 + step_size * (place is None or place == k))}
                for k, step in enumerate(steps)
            )
            for steps in self.program
        ]
        return (self.readings(program=changed) - self.nominal) / step_size

    @cached_property
    def deviation(self) -> np.ndarray:
        """(steps, disks, kinds) standard deviations of reading noise."""
        sd = np.array([self.design.deviation(kind) for kind in self.design.kinds])
        return np.broadcast_to(sd, self.nominal.shape)

    @cached_property
    def roots(self) -> list[np.ndarray]:
        """Lower Cholesky factor of the covariance of each sequence's readings."""
        sd, out, at = self.deviation.reshape(len(self.nominal), -1), [], 0
        for steps, scatter in zip(self.program, self.sensitivity, strict=True):
            reading = sd[at : at + len(steps)].ravel()
            common = scatter * self.design.measurement["tension_sd_relative"]
            out.append(np.linalg.cholesky(np.diag(reading**2) + common @ common.T))
            at += len(steps)
        return out

    def whiten(self, change: np.ndarray) -> np.ndarray:
        """(r + c,) changes of readings (steps, disks, kinds), whitened; zero in the rows of the priors.

        Changes of angles are taken modulo a full turn.
        """
        change = change.copy()
        turned = [k for k, kind in enumerate(self.design.kinds) if not kind.is_position]
        change[..., turned] -= 2 * np.pi * np.round(change[..., turned] / (2 * np.pi))
        parts, at = [], 0
        for steps, root in zip(self.program, self.roots, strict=True):
            parts.append(solve_triangular(root, change[at : at + len(steps)].ravel(), lower=True))
            at += len(steps)
        return np.concatenate([*parts, np.zeros(len(self.constants))])

    @cached_property
    def constants(self) -> list[tuple[str, float]]:
        """Names and prior standard deviations of the constants that calibration may adjust; infinite: a flat prior."""
        measurement, prior = self.design.measurement, self.design.prior
        out = [("log_stiffness", prior.get("youngs_modulus", np.inf))]
        if self.design.friction > 0:
            out.append(("log_friction", prior.get("friction_coefficient", np.inf)))
        if any(kind <= Kind.ANGLE for kind in self.design.kinds):
            out.append(("rotation", measurement["frame_rotation_sd_rad"]))
        if any(kind.is_position for kind in self.design.kinds):
            out += [(axis, measurement["frame_position_sd_m"]) for axis in ("x", "y")]
        return out

    def at(self, p: Sequence[float] | np.ndarray, effects: Sequence[Mapping[str, Any]] = ()) -> np.ndarray | None:
        """(r + c,) whitened change from the nominal readings with effects and constants `p`; None without equilibrium.

        `p` is in the order of `constants`; missing ones are 0.
        """
        values = dict(zip((name for name, _ in self.constants), p, strict=False))
        constants = values.get("log_stiffness", 0.0), values.get("log_friction", 0.0)
        frame = tuple(values.get(name, 0.0) for name in ("rotation", "x", "y"))
        readings = self.readings(effects, constants, frame)
        if readings is None:
            return None
        white = self.whiten(readings - self.nominal)
        white[len(white) - len(self.constants) :] = [
            values.get(name, 0.0) / sd if np.isfinite(sd) else 0.0 for name, sd in self.constants
        ]
        return white

    @cached_property
    def calibration(self) -> np.ndarray:
        """(r + c, c) derivatives of the whitened readings by the constants, rows of the priors included."""
        relative = SETTINGS.sizes.relative_change
        steps = [relative * (self.design.length if name in "xy" else 1.0) for name, _ in self.constants]
        columns = []
        for k, step in enumerate(steps):
            p = np.zeros(len(steps))
            p[k] = step
            moved = self.at(p)
            if moved is None:
                raise RuntimeError(f"design {self.design.number}: the constants cannot be changed")
            columns.append(moved / step)
        return np.stack(columns, 1)

    @cached_property
    def basis(self) -> np.ndarray:
        """(r + c, c) orthonormal basis of the changes that calibration can make."""
        return np.linalg.qr(self.calibration)[0]

    def free(self, columns: np.ndarray) -> np.ndarray:
        """(r + c, ...) columns with all that calibration can do projected out, twice because of rounding."""
        left = columns - self.basis @ (self.basis.T @ columns)
        return left - self.basis @ (self.basis.T @ left)

    def norm(self, change: np.ndarray) -> float:
        """Norm of what calibration leaves of a whitened change."""
        return float(np.linalg.norm(self.free(change)))

    def to(self, effects: Sequence[Mapping[str, Any]]) -> np.ndarray | None:
        """(r + c,) whitened change of the readings by effects at the nominal constants; None without equilibrium."""
        return self.at((), effects)

    def per_unit(self, candidate: Candidate) -> np.ndarray | None:
        """(r + c,) whitened change per unit of a candidate's size, or by the whole effect; None without equilibrium."""
        change = self.to([candidate.effect(candidate.probe)])
        return None if change is None else change / candidate.probe

    @property
    def of_candidates(self) -> list[Response]:
        """Responses to all groups of candidates of the design that leave it in equilibrium, rare kinds last."""
        return [response for kind in self.groups for response in self.of_kind(kind)]

    @cached_property
    def groups(self) -> dict[str, list[list[Candidate]]]:
        """All groups of candidates of the design by their kind, rare kinds last."""
        out: dict[str, list[list[Candidate]]] = {}
        for group in [*candidates(self.design), *candidates(self.design, rare=True)]:
            out.setdefault(group[0].kind, []).append(group)
        return out

    @cached_property
    def _of_kind(self) -> dict[str, list[Response]]:
        """What `of_kind` has computed so far."""
        return {}

    def of_kind(self, kind: str) -> list[Response]:
        """Responses to the groups of candidates of one kind that leave the design in equilibrium."""
        if kind not in self._of_kind:
            out = self._of_kind[kind] = []
            for group in self.groups.get(kind, []):
                columns = [column for form in group if (column := self.per_unit(form)) is not None]
                if len(columns) == len(group):
                    out.append(Response(tuple(group), np.stack(columns, 1)))
        return self._of_kind[kind]
