r"""Which sets of effects would explain a recording if all acted by degrees: selection in the linearised model.

Around a fit every hypothesis moves the whitened readings by its columns, in units of its prior standard deviation and
freed of the constants.  With the columns :math:`\Phi_A` of a set `A` and what is to be explained :math:`y`, the set has
the evidence

.. math:: \ln Z_A = \tfrac12 b^T (I + G)^{-1} b - \tfrac12 \ln |I + G| + \ln P(A),
          \quad G = \Phi_A^T \Phi_A, \; b = \Phi_A^T y,

so thousands of sets are compared without solving anything.  They are sought from both sides: from the present set and
from none, by adding, leaving out and exchanging.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise, permutations, product
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings


@dataclass(frozen=True, eq=False)
class Column:
    """How a hypothesis moves the whitened readings."""

    hypothesis: Hypothesis
    moved: np.ndarray
    """(r + c, k) per prior standard deviation of each coefficient."""
    start: np.ndarray
    """(k0,) free parameters `u` that a full fit begins near."""
    sign: int = 0
    """1 where the first coefficient must not be negative; 0: either way."""
    log_odds: float = 0.0
    """ln of the prior odds of its presence."""


@dataclass(frozen=True)
class Proposal:
    """A set of columns, by number, and its linearised log evidence against the set without any."""

    chosen: frozenset[int]
    evidence: float


@dataclass(frozen=True, eq=False)
class LinearModel:
    """All columns together, and what is to be explained."""

    columns: Sequence[Column]
    target: np.ndarray
    """(r + c,) freed of the constants, without any effect."""

    @cached_property
    def spans(self) -> list[slice]:
        """Where the coefficients of every column stand among all K, in the order of `columns`."""
        ends = np.cumsum([0, *(column.moved.shape[1] for column in self.columns)])
        return [slice(a, b) for a, b in pairwise(ends)]

    @cached_property
    def whole(self) -> np.ndarray:
        """(r + c, K) how all columns move the whitened readings, side by side."""
        return np.hstack([np.empty((len(self.target), 0)), *(column.moved for column in self.columns)])

    @cached_property
    def products(self) -> np.ndarray:
        """(K, K) inner products of all columns, whitened and freed of the constants."""
        return self.whole.T @ self.whole

    @cached_property
    def along(self) -> np.ndarray:
        """(K,) inner products of all columns with the target."""
        return self.whole.T @ self.target

    def rows(self, chosen: Sequence[int]) -> np.ndarray:
        """Where the coefficients of several columns stand among all K."""
        return np.concatenate([np.arange(self.spans[k].start, self.spans[k].stop) for k in chosen]).astype(int)

    def coefficients(self, chosen: Sequence[int]) -> list[np.ndarray]:
        """Most probable coefficients of each chosen column, in units of their prior deviations, in the order of
        `chosen`."""
        rows = self.rows(chosen) if chosen else np.zeros(0, int)
        best = self._most_probable(rows)[0]
        ends = np.cumsum([0, *(self.columns[k].moved.shape[1] for k in chosen)])
        return [best[a:b] for a, b in pairwise(ends)]

    def evidence(self, chosen: frozenset[int]) -> float:
        """ln Z of a set against none; minus infinity where a coefficient has the wrong sign."""
        if not chosen:
            return 0.0
        order = sorted(chosen)
        rows = self.rows(order)
        best, log_determinant = self._most_probable(rows)
        first = 0
        for k in order:
            if self.columns[k].sign * best[first] < 0:
                return -np.inf
            first += self.columns[k].moved.shape[1]
        odds = sum(self.columns[k].log_odds for k in order)
        return float(self.along[rows] @ best / 2 - log_determinant / 2 + odds)

    def _most_probable(self, rows: np.ndarray) -> tuple[np.ndarray, float]:
        """Coefficients at `rows`, and ln of the determinant of their normal matrix, priors included."""
        precision, axes = _spectrum(np.eye(len(rows)) + self.products[np.ix_(rows, rows)])
        return axes @ (axes.T @ self.along[rows] / precision), float(np.log(precision).sum())

    @cached_property
    def alike(self) -> list["Alike"]:
        """The columns gathered by their number of coefficients, so that arrays hold all of one number at once."""
        widths = np.array([column.moved.shape[1] for column in self.columns], int)
        out = []
        for width in np.unique(widths):
            which = np.flatnonzero(widths == width)
            at = np.array([self.spans[k].start for k in which.tolist()])[:, None] + np.arange(width)
            normal = np.eye(width) + self.products[at[:, :, None], at[:, None, :]]
            out.append(Alike(which, at, normal, np.array([self.columns[k].sign for k in which.tolist()])))
        return out

    def additions(self, chosen: frozenset[int]) -> np.ndarray:
        """(columns,) rise of ln Z by each further column; minus infinity for those that do not go with the chosen."""
        if chosen in self.risen:
            return self.risen[chosen]
        rows = self.rows(sorted(chosen)) if chosen else np.zeros(0, int)
        beside = self.products[rows]
        across = np.linalg.solve(np.eye(len(rows)) + beside[:, rows], beside).T
        rest = self.along - across @ self.along[rows]
        rise = np.full(len(self.columns), -np.inf)
        for group in self.alike:
            normal = group.normal - across[group.at] @ beside[:, group.at].transpose(1, 0, 2)
            along = rest[group.at]
            precision, axes = _spectrum(normal)
            worth = ((along[:, None, :] @ axes)[:, 0] ** 2 / precision).sum(1) - np.log(precision).sum(1)
            wrong = group.sign * along[:, 0] < 0 if along.shape[1] == 1 else np.zeros(len(along), bool)
            rise[group.which] = np.where(wrong, -np.inf, worth / 2)
        rise += self.log_odds
        rise[sorted(chosen)] = -np.inf
        rise[self.rivals[sorted(chosen)].any(0)] = -np.inf
        self.risen[chosen] = rise
        return rise

    @cached_property
    def risen(self) -> dict[frozenset[int], np.ndarray]:
        """What `additions` has said: searches come back to the same sets."""
        return {}

    @cached_property
    def log_odds(self) -> np.ndarray:
        """(columns,) ln of the prior odds of their presence."""
        return np.array([column.log_odds for column in self.columns])

    @cached_property
    def rivals(self) -> np.ndarray:
        """(columns, columns) whether two cannot stand beside each other: probes of the same hypothesis, a kind that
        occurs once, kinds in the place of each other."""
        hypotheses = [column.hypothesis for column in self.columns]
        of_kind: dict[str, list[int]] = {}
        for number, hypothesis in enumerate(hypotheses):
            of_kind.setdefault(hypothesis.kind, []).append(number)
        out = np.zeros((len(hypotheses), len(hypotheses)), bool)
        for numbers, others in product(of_kind.values(), repeat=2):
            if numbers is not others:  # their kinds alone decide
                out[np.ix_(numbers, others)] = excludes(hypotheses[numbers[0]], hypotheses[others[0]])
        for numbers in of_kind.values():
            for j, k in permutations(numbers, 2):
                out[j, k] = excludes(hypotheses[j], hypotheses[k])
        return out


class Alike(NamedTuple):
    """Columns of one number of coefficients, `w`."""

    which: np.ndarray
    """(m,) their numbers."""
    at: np.ndarray
    """(m, w) where their coefficients stand."""
    normal: np.ndarray
    """(m, w, w) their normal matrices, priors included."""
    sign: np.ndarray
    """(m,) as of the columns."""


def _spectrum(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(..., w) eigenvalues and (..., w, w) eigenvectors of normal matrices that hold a prior of unit variance.

    They are 1 or more; beside a coefficient whose effect is a hundred million times the noise, as near the end of a
    branch, less is rounding.
    """
    if normal.shape[-1] == 1:
        return np.maximum(normal[..., 0], 1.0), np.ones_like(normal)
    precision, axes = np.linalg.eigh(normal)
    return np.maximum(precision, 1.0), axes


def excludes(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether a model cannot have both hypotheses (`Hypothesis.excludes`)."""
    return first.excludes(second)


def best_sets(model: LinearModel, starts: Sequence[frozenset[int]], settings: Settings, most: int) -> list[Proposal]:
    """The best sets of at most `most` columns, best first: a beam of sets that moves until none is better."""
    known = {chosen: model.evidence(chosen) for chosen in starts}
    grown: set[frozenset[int]] = set()
    while True:
        beam = sorted(known, key=lambda chosen: -known[chosen])[: settings.beam]
        fresh = [chosen for chosen in beam if chosen not in grown]
        if not fresh:
            return [Proposal(chosen, known[chosen]) for chosen in sorted(known, key=lambda chosen: -known[chosen])]
        for chosen in fresh:
            grown.add(chosen)
            for neighbour in _neighbours(model, chosen, settings, most):
                if neighbour not in known:
                    known[neighbour] = model.evidence(neighbour)


def _neighbours(model: LinearModel, chosen: frozenset[int], settings: Settings, most: int) -> Iterator[frozenset[int]]:
    """Sets with one column more, less or exchanged, and with one instead of all of a kind or of any two; of many
    additions the best."""
    if len(chosen) < most:
        yield from _with_best(model, chosen, settings.best_added)
    for k in chosen:
        less = chosen - {k}
        yield less
        yield from _with_best(model, less, settings.best_exchanged)
    many = _of_one_kind(model, chosen, settings.many_of_a_kind)
    for several in {*map(frozenset, combinations(chosen, 2)), *many}:
        yield from _with_best(model, chosen - several, settings.best_exchanged)


def _of_one_kind(model: LinearModel, chosen: frozenset[int], least: int) -> Iterator[frozenset[int]]:
    """The chosen columns of every kind that is chosen `least` times or more: many parts that may be one whole."""
    kinds = [model.columns[k].hypothesis.kind for k in chosen]
    for kind in {kind for kind in kinds if kinds.count(kind) >= least}:
        yield frozenset(k for k in chosen if model.columns[k].hypothesis.kind == kind)


def _with_best(model: LinearModel, chosen: frozenset[int], count: int) -> Iterator[frozenset[int]]:
    rise = model.additions(chosen)
    for k in np.argsort(-rise)[:count].tolist():
        if np.isfinite(rise[k]):
            yield chosen | {k}


def worth_fitting(sets: Sequence[Proposal], present: int, count: int, steps_up: int) -> list[Proposal]:
    """Sets worth a full fit, each once: of `sets`, which stand best first, the best `count`, then the best of each size
    with one to `steps_up` effects more than are `present`."""
    sizes = range(present + 1, present + steps_up + 1)
    steps = [next((p for p in sets if len(p.chosen) == size), None) for size in sizes]
    return list(dict.fromkeys([*sets[:count], *(step for step in steps if step is not None)]))
