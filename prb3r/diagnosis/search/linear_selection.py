r"""Selection of sets of effects in the linearised model: their evidence if readings were linear in their parameters.

Around a fit every hypothesis moves the whitened readings by its columns, one column a coefficient in units of its prior
standard deviation, made orthogonal to what the constants do.  With the columns :math:`\Phi_A` of a set `A` and the
target :math:`y`, the whitened residuals without any effect made orthogonal likewise, the set has the evidence

.. math:: \ln Z_A = \tfrac12 b^T (I + G)^{-1} b - \tfrac12 \ln |I + G| + \ln P(A),
          \quad G = \Phi_A^T \Phi_A, \; b = \Phi_A^T y,

so thousands of sets are compared without solving anything.  A beam search looks for the best, from the set of the fit
and from the empty one, by adding, leaving out and exchanging columns.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.spans import spans_of
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.settings import Settings


@dataclass(frozen=True, eq=False)
class Column:
    """How a hypothesis, at one of its starts, moves the whitened readings."""

    hypothesis: Hypothesis
    moved: np.ndarray
    """(r + c, k) change per prior standard deviation of each coefficient, freed of the constants (`projected_out`)."""
    start: np.ndarray
    """(k0,) free parameters `u` near which a full fit begins."""
    sign: int = 0
    """1 where the first coefficient must not be negative; 0 where it may have either sign."""
    log_odds: float = 0.0
    """ln of the prior odds that the effect is present."""


@dataclass(frozen=True)
class Proposal:
    """A set of columns, by number, and its linearised ln evidence relative to the empty set."""

    chosen: frozenset[int]
    evidence: float


@dataclass(frozen=True, eq=False)
class LinearModel:
    """All columns around one fit, and the target that they have to explain."""

    columns: Sequence[Column]
    target: np.ndarray
    """(r + c,) whitened residuals without any effect, freed of the constants."""

    @cached_property
    def spans(self) -> tuple[slice, ...]:
        """Where the coefficients of every column stand among all K, in the order of `columns`."""
        return spans_of(column.moved.shape[1] for column in self.columns)

    @cached_property
    def whole(self) -> np.ndarray:
        """(r + c, K) the arrays `moved` of all columns, side by side."""
        return np.hstack([np.empty((len(self.target), 0)), *(column.moved for column in self.columns)])

    @cached_property
    def products(self) -> np.ndarray:
        """(K, K) inner products of all columns."""
        return self.whole.T @ self.whole

    @cached_property
    def along(self) -> np.ndarray:
        """(K,) inner products of all columns with the target."""
        return self.whole.T @ self.target

    def rows(self, chosen: Sequence[int]) -> np.ndarray:
        """Indices of the coefficients of the `chosen` columns among all K."""
        spans = [self.spans[k] for k in chosen]
        return np.array([row for span in spans for row in range(span.start, span.stop)], int)

    def coefficients(self, chosen: Sequence[int]) -> list[np.ndarray]:
        """Most probable coefficients of each chosen column, in units of their prior standard deviations, in the order
        of `chosen`."""
        best = self._most_probable(self.rows(chosen)[None])[0][0]
        return [best[span] for span in spans_of(self.columns[k].moved.shape[1] for k in chosen)]

    def evidence(self, chosen: frozenset[int]) -> float:
        """ln Z of a set relative to the empty set; minus infinity where a first coefficient has the wrong sign."""
        return self.evidences([chosen])[0]

    def evidences(self, sets: Sequence[frozenset[int]]) -> list[float]:
        """:meth:`evidence` of each of many sets, all sets of one size at once."""
        out = np.empty(len(sets))
        for which, rows in self._of_one_size(sets):
            best, log_determinant = self._most_probable(rows)
            wrong = (self.signs[rows] * best < 0).any(1)
            ln_z = ((self.along[rows] * best).sum(1) - log_determinant) / 2 + self.odds[rows].sum(1)
            out[which] = np.where(wrong, -np.inf, ln_z)
        return out.tolist()

    def _of_one_size(self, sets: Sequence[frozenset[int]]) -> list[tuple[list[int], np.ndarray]]:
        """Sets grouped by their number w of coefficients: positions in `sets`, and (sets, w) :meth:`rows` of each."""
        rows = [self.rows(sorted(chosen)) for chosen in sets]
        sizes = {len(of_one) for of_one in rows}
        gathered = [[k for k, of_one in enumerate(rows) if len(of_one) == size] for size in sorted(sizes)]
        return [(which, np.array([rows[k] for k in which], int)) for which in gathered]

    @cached_property
    def signs(self) -> np.ndarray:
        """(K,) the sign of every column at the place of its first coefficient, 0 elsewhere."""
        return self._at_first([column.sign for column in self.columns])

    @cached_property
    def odds(self) -> np.ndarray:
        """(K,) ln of the prior odds of every column at the place of its first coefficient, 0 elsewhere."""
        return self._at_first(self.log_odds)

    def _at_first(self, numbers: Sequence[float] | np.ndarray) -> np.ndarray:
        out = np.zeros(len(self.along))
        out[[span.start for span in self.spans]] = numbers
        return out

    def _most_probable(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(sets, w) coefficients at `rows` of as many sets, and (sets,) ln of the determinants of their normal
        matrices, priors included."""
        precision, axes = _spectrum(self._normal(rows))
        along = np.einsum("swk,sw->sk", axes, self.along[rows]) / precision
        return np.einsum("swk,sk->sw", axes, along), np.log(precision).sum(1)

    def _normal(self, rows: np.ndarray) -> np.ndarray:
        """(sets, w, w) normal matrices of the coefficients at `rows` (sets, w), priors included."""
        return np.eye(rows.shape[1]) + self.products[rows[:, :, None], rows[:, None, :]]

    @cached_property
    def groups(self) -> list["ColumnGroup"]:
        """The columns grouped by their number of coefficients, so that one array holds all of a group."""
        widths = np.array([column.moved.shape[1] for column in self.columns], int)
        out = []
        for width in np.unique(widths):
            which = np.flatnonzero(widths == width)
            at = np.array([self.spans[k].start for k in which.tolist()])[:, None] + np.arange(width)
            normal = np.eye(width) + self.products[at[:, :, None], at[:, None, :]]
            out.append(ColumnGroup(which, at, normal, np.array([self.columns[k].sign for k in which.tolist()])))
        return out

    def additions(self, chosen: frozenset[int]) -> np.ndarray:
        """(columns,) rise of ln Z as each further column is added to the chosen ones.

        Minus infinity for columns that are chosen, cannot stand beside a chosen one, or whose only coefficient would
        have the wrong sign.
        """
        return self.additions_to([chosen])[0]

    def additions_to(self, sets: Sequence[frozenset[int]]) -> list[np.ndarray]:
        """:meth:`additions` to each of many sets, all sets of one size at once."""
        new = list(dict.fromkeys(chosen for chosen in sets if chosen not in self.risen))
        for which, rows in self._of_one_size(new):
            rise = self._rise(rows)
            for row, k in zip(rise, which, strict=True):
                row[self.barred[sorted(new[k])].any(0)] = -np.inf
                self.risen[new[k]] = row
        return [self.risen[chosen] for chosen in sets]

    def _rise(self, rows: np.ndarray) -> np.ndarray:
        """(sets, columns) rise of ln Z as each column is added to sets whose coefficients stand at `rows` (sets, w);
        what cannot stand beside each other is not excluded yet."""
        beside = self.products[rows]
        across = np.linalg.solve(self._normal(rows), beside)
        rest = self.along - np.einsum("swk,sw->sk", across, self.along[rows])
        rise = np.empty((len(rows), len(self.columns)))
        for group in self.groups:
            normal = group.normal - np.einsum("swmi,swmj->smij", across[:, :, group.at], beside[:, :, group.at])
            along = rest[:, group.at]
            precision, axes = _spectrum(normal)
            worth = (np.einsum("smi,smij->smj", along, axes) ** 2 / precision).sum(2) - np.log(precision).sum(2)
            wrong = (group.sign * along[:, :, 0] < 0) & (along.shape[2] == 1)
            rise[:, group.which] = np.where(wrong, -np.inf, worth / 2)
        return rise + self.log_odds

    @cached_property
    def risen(self) -> dict[frozenset[int], np.ndarray]:
        """Results of `additions` by set, kept because a search comes back to the same sets."""
        return {}

    def has_any_of(self, hypotheses: Collection[Hypothesis]) -> np.ndarray:
        """(columns,) whether each column is that of one of the `hypotheses`."""
        return np.array([column.hypothesis in hypotheses for column in self.columns], bool)

    @cached_property
    def log_odds(self) -> np.ndarray:
        """(columns,) ln of the prior odds that each effect is present."""
        return np.array([column.log_odds for column in self.columns])

    @cached_property
    def barred(self) -> np.ndarray:
        """(columns, columns) whether a set cannot hold both columns: equal ones, probes of one hypothesis, and
        hypotheses that exclude each other."""
        hypotheses = [column.hypothesis for column in self.columns]
        of_kind: dict[str, list[int]] = {}
        of_rigs: dict[tuple[str, tuple[int, ...]], list[int]] = {}
        for number, hypothesis in enumerate(hypotheses):
            of_kind.setdefault(hypothesis.kind, []).append(number)
            of_rigs.setdefault((hypothesis.kind, getattr(hypothesis, "rigs", ())), []).append(number)
        group = np.empty(len(hypotheses), int)
        for place, numbers in enumerate(of_rigs.values()):
            group[numbers] = place
        firsts = [hypotheses[numbers[0]] for numbers in of_rigs.values()]  # kinds, and of joint ones their rigs, decide
        apart = [[one.kind != other.kind and one.excludes(other) for other in firsts] for one in firsts]
        out = np.array(apart, bool).reshape(len(firsts), len(firsts))[group[:, None], group]
        np.fill_diagonal(out, True)
        for numbers in of_kind.values():
            for j, k in permutations(numbers, 2):
                out[j, k] = hypotheses[j].excludes(hypotheses[k])
        return out


class ColumnGroup(NamedTuple):
    """The `m` columns that have the same number `w` of coefficients."""

    which: np.ndarray
    """(m,) numbers of the columns."""
    at: np.ndarray
    """(m, w) indices of their coefficients among all K."""
    normal: np.ndarray
    """(m, w, w) their normal matrices, priors included."""
    sign: np.ndarray
    """(m,) `Column.sign` of each."""


def _spectrum(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(..., w) eigenvalues and (..., w, w) eigenvectors of normal matrices that hold a prior of unit variance.

    Eigenvalues are 1 or more; smaller ones are rounding and raised to 1.  They occur beside a coefficient whose effect
    is a hundred million times the noise, as near the end of a branch.
    """
    if normal.shape[-1] == 1:
        return np.maximum(normal[..., 0], 1.0), np.ones_like(normal)
    precision, axes = np.linalg.eigh(normal)
    return np.maximum(precision, 1.0), axes


def best_sets(model: LinearModel, starts: Sequence[frozenset[int]], settings: Settings, most: int) -> list[Proposal]:
    """The sets of at most `most` columns that a beam search visits, best first.

    In each round the neighbours of the best `Settings.beam` sets are evaluated, until none of these sets is new.
    """
    known = dict(zip(starts, model.evidences(starts), strict=True))
    grown: set[frozenset[int]] = set()
    while True:
        best = sorted(known, key=lambda chosen: -known[chosen])
        fresh = [chosen for chosen in best[: settings.beam] if chosen not in grown]
        if not fresh:
            return [Proposal(chosen, known[chosen]) for chosen in best]
        grown.update(fresh)
        new = list(dict.fromkeys(near for near in _neighbours(model, fresh, settings, most) if near not in known))
        known.update(zip(new, model.evidences(new), strict=True))


def _neighbours(
    model: LinearModel, sets: Sequence[frozenset[int]], settings: Settings, most: int
) -> Iterator[frozenset[int]]:
    """Sets that differ from one of `sets` by one column added, left out or exchanged, or by one column in the place of
    any two or of all of a kind; of the additions only the most promising."""
    added_to = [(chosen, settings.best_added) for chosen in sets if len(chosen) < most]
    for chosen in sets:
        less = [chosen - {k} for k in chosen]
        yield from less
        many = _of_one_kind(model, chosen, settings.many_of_a_kind)
        less += [chosen - several for several in {*map(frozenset, combinations(chosen, 2)), *many}]
        added_to += [(fewer, settings.best_exchanged) for fewer in less]
    rises = model.additions_to([base for base, _ in added_to])
    for (base, count), rise in zip(added_to, rises, strict=True):
        for k in np.argsort(-rise)[:count].tolist():
            if np.isfinite(rise[k]):
                yield base | {k}


def _of_one_kind(model: LinearModel, chosen: frozenset[int], least: int) -> Iterator[frozenset[int]]:
    """The chosen columns of every kind that is chosen `least` times or more: so many parts may be one whole."""
    kinds = [model.columns[k].hypothesis.kind for k in chosen]
    for kind in {kind for kind in kinds if kinds.count(kind) >= least}:
        yield frozenset(k for k in chosen if model.columns[k].hypothesis.kind == kind)


def worth_fitting(sets: Sequence[Proposal], present: int, count: int, steps_up: int) -> list[Proposal]:
    """Sets worth a full fit, each once: the best `count`, then the best of each size up to `steps_up` effects more than
    are `present`.

    Parameters
    ----------
    sets : best first.
    present : number of effects of the fit that the sets were found around.
    """
    sizes = range(present + 1, present + steps_up + 1)
    steps = [next((p for p in sets if len(p.chosen) == size), None) for size in sizes]
    return list(dict.fromkeys([*sets[:count], *(step for step in steps if step is not None)]))
