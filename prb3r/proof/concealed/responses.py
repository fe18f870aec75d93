r"""How far apart effects are on one design: the rig's own responses, whitened with its own dense covariance.

The covariance of a sequence is reading noise plus tension scatter through the rig's own Jacobian.  Calibration (E, mu,
frame, with their priors as further rows) is projected out of every response, at the nominal constants.  Where two
effects come close, both refits are iterated with the full rig (Gauss-Newton with the Jacobian kept).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular

from prb3r.proof.concealed.camera import read, truth
from prb3r.proof.concealed.candidates import candidates
from prb3r.proof.concealed.designs import ANGLE, BEND, Design, Steps, Y, followed
from prb3r.proof.rig.effects.candidate import Candidate

CHANGE = 1e-3
"""Relative change of constants and tensions for derivatives."""
REFITS = 3
SAME, APART, NORM = 11.0, 22.0, 5.2
"""Squared distances below which effects are one, and from which on they are two; norm of the smallest detectable."""
NEAR, MOST_REFITTED = 60.0, 3
"""Rivals that are nearer by the linear rule are refitted, and so many of them."""


@dataclass(frozen=True)
class Response:
    """What one group of candidates does to the whitened readings."""

    group: tuple[Candidate, ...]
    columns: np.ndarray
    """(r + c, k) change per unit of each size, or of the whole effect; calibration still in it."""

    @property
    def kind(self) -> str:
        return self.group[0].kind


@dataclass(frozen=True)
class Bench:
    """A design with the rig's own idea of what its recordings can tell."""

    design: Design
    subset: tuple[int, ...] | None = None
    """Sequences that count; None: all."""

    @cached_property
    def program(self) -> tuple[Steps, ...]:
        chosen = range(len(self.design.program)) if self.subset is None else self.subset
        return tuple(self.design.program[k] for k in chosen)

    def readings(
        self,
        effects: Sequence[Mapping[str, Any]] = (),
        constants: Sequence[float] = (0.0, 0.0),
        frame: Sequence[float] = (0.0, 0.0, 0.0),
        program: Sequence[Steps] | None = None,
    ) -> np.ndarray | None:
        """(steps, disks, kinds); None where an equilibrium ceases."""
        manipulator = truth(self.design, effects, *constants)
        found = followed(manipulator, self.program if program is None else program)
        return None if found is None else read(self.design, manipulator, found, [frame] * len(found))

    @cached_property
    def nominal(self) -> np.ndarray:
        found = self.readings()
        if found is None:
            raise RuntimeError(f"design {self.design.number} has lost its equilibria")
        return found

    @cached_property
    def sensitivity(self) -> list[np.ndarray]:
        """Of each sequence (rows, k): readings per relative change of each tension of each step."""
        longest = max(len(steps) for steps in self.program)
        history = self.design.manipulator["friction"].get("direction") == "history"
        columns: list[list[np.ndarray]] = [[] for _ in self.program]
        begins = np.cumsum([0] + [len(steps) for steps in self.program])
        for name in self.design.cables:
            for place in range(longest) if history else [None]:
                key = f"cable_{name}_n"
                changed = [
                    tuple(
                        {**step, key: step[key] * (1 + CHANGE * (place is None or place == k))}
                        for k, step in enumerate(steps)
                    )
                    for steps in self.program
                ]
                moved = (self.readings(program=changed) - self.nominal) / CHANGE
                for q in range(len(self.program)):
                    own = moved[begins[q] : begins[q + 1]]
                    if place is not None:
                        columns[q].append(own.ravel())
                        continue
                    for k in range(len(own)):
                        alone = np.zeros_like(own)
                        alone[k] = own[k]
                        columns[q].append(alone.ravel())
        return [np.stack(each, 1) for each in columns]

    @cached_property
    def deviation(self) -> np.ndarray:
        """(steps, disks, kinds) of reading noise."""
        sd = np.array([self.design.deviation(kind) for kind in self.design.kinds])
        return np.broadcast_to(sd, self.nominal.shape)

    @cached_property
    def roots(self) -> list[np.ndarray]:
        """Cholesky factor of the covariance of each sequence."""
        sd, out, at = self.deviation.reshape(len(self.nominal), -1), [], 0
        for steps, scatter in zip(self.program, self.sensitivity, strict=True):
            own = sd[at : at + len(steps)].ravel()
            common = scatter * self.design.measurement["tension_sd_relative"]
            out.append(np.linalg.cholesky(np.diag(own**2) + common @ common.T))
            at += len(steps)
        return out

    def whiten(self, change: np.ndarray) -> np.ndarray:
        """Changes of readings (steps, disks, kinds) in units of noise, with zeros where the priors stand."""
        change = change.copy()
        turned = [k for k, kind in enumerate(self.design.kinds) if kind in (ANGLE, BEND)]
        change[..., turned] -= 2 * np.pi * np.round(change[..., turned] / (2 * np.pi))
        parts, at = [], 0
        for steps, root in zip(self.program, self.roots, strict=True):
            parts.append(solve_triangular(root, change[at : at + len(steps)].ravel(), lower=True))
            at += len(steps)
        return np.concatenate([*parts, np.zeros(len(self.constants))])

    @cached_property
    def constants(self) -> list[tuple[str, float]]:
        """Names and prior deviations of what calibration may adjust."""
        measurement, prior = self.design.measurement, self.design.prior
        found = [("log_stiffness", prior.get("youngs_modulus", np.inf))]
        if self.design.friction > 0:
            found.append(("log_friction", prior.get("friction_coefficient", np.inf)))
        if any(kind <= ANGLE for kind in self.design.kinds):
            found.append(("rotation", measurement["frame_rotation_sd_rad"]))
        if any(kind <= Y for kind in self.design.kinds):
            found += [(axis, measurement["frame_position_sd_m"]) for axis in ("x", "y")]
        return found

    def at(self, p: Sequence[float] | np.ndarray, effects: Sequence[Mapping[str, Any]] = ()) -> np.ndarray | None:
        """Whitened change from the nominal readings at calibrated constants `p`, priors at the end."""
        values = dict(zip((name for name, _ in self.constants), p, strict=False))
        constants = values.get("log_stiffness", 0.0), values.get("log_friction", 0.0)
        frame = tuple(values.get(name, 0.0) for name in ("rotation", "x", "y"))
        found = self.readings(effects, constants, frame)
        if found is None:
            return None
        white = self.whiten(found - self.nominal)
        white[len(white) - len(self.constants) :] = [
            values.get(name, 0.0) / sd if np.isfinite(sd) else 0.0 for name, sd in self.constants
        ]
        return white

    @cached_property
    def calibration(self) -> np.ndarray:
        """(r + c, c) whitened responses to the constants."""
        steps = [CHANGE * (self.design.length if name in "xy" else 1.0) for name, _ in self.constants]
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
        return np.linalg.qr(self.calibration)[0]

    def free(self, columns: np.ndarray) -> np.ndarray:
        """What calibration cannot do as well."""
        left = columns - self.basis @ (self.basis.T @ columns)
        return left - self.basis @ (self.basis.T @ left)

    def response(self, effects: Sequence[Mapping[str, Any]]) -> np.ndarray | None:
        """(r + c,) whitened change of the readings by effects at the nominal constants."""
        return self.at((), effects)

    def unit(self, candidate: Candidate) -> np.ndarray | None:
        """(r + c,) whitened change per unit of a candidate's size, or by the whole effect."""
        change = self.response([candidate.effect(candidate.probe)])
        return None if change is None else change / candidate.probe

    @cached_property
    def responses(self) -> list[Response]:
        """Of every candidate of the design."""
        out = []
        for group in candidates(self.design):
            columns = [column for each in group if (column := self.unit(each)) is not None]
            if len(columns) == len(group):
                out.append(Response(tuple(group), np.stack(columns, 1)))
        return out

    def norm(self, change: np.ndarray) -> float:
        """How strongly a whitened change stands out of calibration."""
        return float(np.linalg.norm(self.free(change)))

    def distance(self, change: np.ndarray, rival: Response) -> float:
        """Squared distance from a whitened change to the best refit of a rival, linearised."""
        a, b = self.free(change), self.free(rival.columns)
        if not rival.group[0].sized:
            return float(((a - b[:, 0]) ** 2).sum())
        sizes = np.linalg.lstsq(b, a, rcond=None)[0]
        if len(sizes) == 1:  # gravity and tip forces may point anywhere
            sizes = np.clip(sizes, rival.group[0].low, rival.group[0].high)
        return float(((a - b @ sizes) ** 2).sum())

    def without_a_step(self, change: np.ndarray) -> float:
        """The squared distance to one step under another weight, whatever that may have been, linearised."""
        count, whole = len(self.nominal), len(change) - len(self.constants)
        step = np.append(np.repeat(np.arange(count), whole // count), np.full(len(self.constants), count))
        left = []
        for k in range(count):
            own = step != k
            basis = np.linalg.qr(self.calibration[own])[0]
            left.append(change[own] - basis @ (basis.T @ change[own]))
        return float(min(each @ each for each in left))

    def to_pairs(self, change: np.ndarray, rivals: Sequence[Response]) -> float:
        """The squared distance to the best refit of any two effects together, linearised, of whatever size."""
        a, columns = self.free(change), [self.free(each.columns) for each in rivals]
        best = np.inf
        for one, other in combinations(range(len(rivals)), 2):
            fixed = [k for k in (one, other) if not rivals[k].group[0].sized]
            left = a - sum(columns[k][:, 0] for k in fixed)
            free = [columns[k] for k in (one, other) if k not in fixed]
            if free:
                both = np.hstack(free)
                normal, along = both.T @ both, both.T @ left
                gain = along @ np.linalg.lstsq(normal, along, rcond=1e-9)[0]
            best = min(best, float(left @ left - (gain if free else 0.0)))
        return max(best, 0.0)

    def refitted(self, change: np.ndarray, rival: Response | None) -> float:
        """The same with the full rig, refitted from the nominal constants; a rival of None is calibration alone."""
        group = rival.group if rival is not None else ()
        free = [each for each in group if each.sized]
        whole = np.hstack([self.calibration, rival.columns]) if rival is not None and free else self.calibration
        inverse, c = np.linalg.pinv(whole), self.calibration.shape[1]
        p = np.zeros(whole.shape[1])
        fixed = [each.effect(1.0) for each in group if not each.sized]
        start = self.at(p, fixed) if fixed else np.zeros_like(change)
        if start is None:
            return np.inf
        left = change - start
        best = float(left @ left)
        for _ in range(REFITS):
            step = inverse @ left
            p = p + step
            for k, each in enumerate(free):
                p[c + k] = np.clip(p[c + k], each.low if len(free) == 1 else -each.high, each.high)
            effects = fixed + [each.effect(p[c + k]) for k, each in enumerate(free)]
            moved = self.at(p[:c], effects)
            if moved is None:
                break
            left = change - moved
            if left @ left > 0.99 * best:
                best = min(best, float(left @ left))
                break
            best = float(left @ left)
        return best


def nearest(
    bench: Bench, change: np.ndarray, rivals: Sequence[Response], without: Sequence[str], near: float = NEAR
) -> dict[str, float]:
    """The squared distance to the nearest rival of every kind but those `without`, refitted if below `near`."""
    best: dict[str, tuple[float, Response]] = {}
    for rival in rivals:
        if rival.kind not in without:
            far = bench.distance(change, rival)
            if rival.kind not in best or far < best[rival.kind][0]:
                best[rival.kind] = far, rival
    out: dict[str, float] = {}
    for kind, (far, rival) in sorted(best.items(), key=lambda item: item[1][0]):
        if far < near and len(out) < MOST_REFITTED and rival.group[0].sized:
            far = min(far, bench.refitted(change, rival))
        out[kind] = round(float(far), 3)
    return out
