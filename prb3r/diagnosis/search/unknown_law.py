r"""Whether a law that no effect of the library has explains a recording better than the effects that were found.

A law outside the library is described by several effects together, each of which is then named although it is not
there.  But these effects cost the evidence their improbability and their sizes, where one law would do.  Such a law is
supposed as a Gaussian process, the discrepancy of Kennedy and O'Hagan (J. R. Statist. Soc. B 63 (2001) 425): moments on
the plates that change smoothly with the loads, with loads and slips or from step to step (:func:`moment_fields`), or
that come to single plates and stay; or tensions that are smooth functions of the noted ones.  In the linearised model a
field with the covariance :math:`z^2 \Phi \Phi^T` of the whitened readings is one more noise.  With its directions
:math:`u_i` and the variances :math:`z^2 \lambda_i` along them, the empty set of effects gains

.. math:: \tfrac12 \sum_i \frac{z^2 \lambda_i}{1 + z^2 \lambda_i} (u_i \cdot y)^2
          - \tfrac12 \sum_i \ln (1 + z^2 \lambda_i)

over the one without a field, and every set of effects beside the field has the evidence of the linearised model whose
columns and target are whitened by it (`linear_selection`).  The evidences of all parts of the fitted set, with a field
of each kind and size, are summed and held against those without a field.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from scipy.special import logit, logsumexp

from prb3r.diagnosis.evidence.smooth_moments import (
    gaussian_correlation,
    leading_modes,
    modes_of_field,
    moment_fields,
    response_to_moments,
)
from prb3r.diagnosis.fit.basis import basis_of, left_singular, projected_out
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.response import tension_response
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.search.columns import linear_model
from prb3r.diagnosis.search.linear_selection import LinearModel

OF_TENSIONS, STAYING = "tensions", "staying"
"""Names of the fields of tensions and of moments that stay; the others are named after what their moments go with."""


class UnknownLaw(NamedTuple):
    """A law that no effect of the library has, as an explanation of a recording."""

    log_odds: float
    """ln of its posterior odds, beside any of the effects that were found, against these effects without it."""
    field: str
    """What the most probable field goes with: a name of :func:`moment_fields`, `STAYING` or `OF_TENSIONS`."""
    instead_of: tuple[Hypothesis, ...]
    """Effects that are not in the most probable set beside that field."""


def unknown_law(fitted: Fit, log_odds: Mapping[Hypothesis, float]) -> UnknownLaw:
    """The law outside the library that would explain most in the place of effects of `fitted`.

    Parameters
    ----------
    log_odds : ln of the prior odds of presence of every hypothesis of the fit; those of an unknown law are
        `Settings.rare_presence`, shared evenly among its fields and sizes.
    """
    settings, (linear, present) = fitted.model.settings, linear_model(fitted, (), log_odds)
    sets = [frozenset(part) for size in range(len(present) + 1) for part in combinations(sorted(present), size)]
    fields = dict(law_fields(fitted))
    beside = [
        (float(np.max(worth)), name, sets[int(np.argmax(worth))], float(logsumexp(worth)))
        for name, white in fields.items()
        for worth in _with_field(fitted, linear, white, sets)
    ]
    chance = logit(settings.rare_presence) - np.log(max(len(beside), 1))
    with_law = float(logsumexp([total for *_, total in beside])) if beside else -np.inf
    _, name, kept, _ = max(beside, key=lambda each: each[0], default=(0.0, "", frozenset(present), 0.0))
    left_out = tuple(fitted.model.hypotheses[k] for k in sorted(present - kept))
    return UnknownLaw(with_law + chance - float(logsumexp(linear.evidences(sets))), name, left_out)


def law_fields(fitted: Fit) -> Iterator[tuple[str, np.ndarray]]:
    """Name and (r, k) whitened modes of every field that the readings feel, each of unit size."""
    others = {STAYING: _staying_field, OF_TENSIONS: _tension_field}
    for name, white in (*moment_fields(fitted).items(), *((name, of(fitted)) for name, of in others.items())):
        if white.any():
            yield name, white


def _staying_field(fitted: Fit) -> np.ndarray:
    """(r, k) whitened change of the readings by each mode of moments that every plate has of its own and that go on as
    a random walk from step to step, of unit size at the last: as of a plate that takes a set, or of a crack."""
    place = np.arange(1.0, fitted.recording.loads.steps + 1)
    return modes_of_field(fitted, response_to_moments(fitted), np.minimum(place[:, None], place) / len(place))


def _tension_field(fitted: Fit) -> np.ndarray:
    """(r, k) whitened change of the readings by each mode of relative errors of the tensions, each cable's a smooth
    function of its own tension."""
    settings, tension = fitted.model.settings, fitted.solved.loads.tension
    share = tension / (float(np.abs(tension).max(initial=0.0)) or 1.0)
    moved = tension_response(fitted.model.predict, fitted.solved)
    errors = [
        moved[:, :, cable] @ leading_modes(gaussian_correlation(of_cable[:, None], settings.alike_loads), settings)
        for cable, of_cable in enumerate(share.T)
    ]
    return fitted.model.noise.whiten(np.hstack(errors))


def _with_field(
    fitted: Fit, linear: LinearModel, white: np.ndarray, sets: list[frozenset[int]]
) -> Iterator[np.ndarray]:
    """(sets,) ln evidence of every set of columns beside a field, for each of `Settings.moment_sizes`, relative to the
    empty set without a field; `white` (r, k) are the field's modes."""
    constants = len(fitted.model.varied)
    rows = fitted.recording.readings.count + constants
    axes, root = left_singular(projected_out(white, basis_of(fitted.jacobian[:rows, :constants])))
    for size in fitted.model.settings.moment_sizes:
        variance = (size * root) ** 2
        taken = 1 - 1 / np.sqrt(1 + variance)

        def shrunk(values: np.ndarray, taken: np.ndarray = taken) -> np.ndarray:
            return values - (axes * taken) @ (axes.T @ values)

        columns = [replace(column, moved=shrunk(column.moved)) for column in linear.columns]
        gain = (variance / (1 + variance)) @ (axes.T @ linear.target) ** 2 - np.log1p(variance).sum()
        yield gain / 2 + np.array(LinearModel(columns, shrunk(linear.target)).evidences(sets))
