r"""Errors of readings and tensions that last through a sequence, estimated from sequences that repeat one another.

A drive is warmer, a load cell is tared anew, a marker is set down again: such an error stays through a sequence and is
another in the next, and no effect of the loads can imitate it.  The difference of two sequences under the same loads
holds such errors and noise alone, whatever physics a model lacks ("pure error").  With weights `W` of such
differences, their likelihood under the covariance :math:`W C W^T` tells which share of the scatter of the tensions
lasts through a sequence, and which share of the noise the readings of a disk have in common along it.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular
from scipy.sparse import csr_array, diags_array

from prb3r.diagnosis.evidence.repeated_loads import Match, matches
from prb3r.diagnosis.fit.basis import left_singular
from prb3r.diagnosis.fit.covariance import AS_STATED, NoiseLevel, as_stated, lasting_scatter, noise_correlation
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording


class Uncertain(NamedTuple):
    """The stated sources of scatter of the readings."""

    sd: np.ndarray
    """(r,) stated standard deviation of the readings, m or rad; larger where a reading is down-weighted."""
    tensions: np.ndarray
    """(r, s, m) change of the readings by one stated standard deviation of the tension of every step and cable."""


def repeatability(
    recording: Recording,
    misfit: np.ndarray,
    uncertain: Uncertain,
    settings: Settings,
    believed: NoiseLevel = AS_STATED,
) -> NoiseLevel:
    """The shares of the noise that last through a sequence, as a level with factors of 1; 0 if too few steps repeat.

    The share of the readings is that of the recording's `serial_noise` if there is any.  From the shares that are
    `believed`, one share at a time moves to the next smaller or larger value, as long as that lowers the deviance by
    `Settings.better_shares`.  They begin at what is believed because they do not depend on the
    model: few repetitions hardly tell them apart, and a search whose noise went to and fro would not come to rest.

    Parameters
    ----------
    misfit : (r,) readings less those that a model predicts, m or rad; this removes the effect of small differences of
        the loads that were repeated.
    believed : level with the shares believed so far.
    """
    weights = differences(recording, settings, np.square(uncertain.tensions).sum((1, 2)) / uncertain.sd**2)
    stated = as_stated(recording)
    if weights is None:
        return stated
    _, sizes = np.unique(
        [recording.of_sequence[recording.readings.step], recording.readings.kind], axis=1, return_counts=True
    )
    if stated.serial or sizes.max() > settings.most_in_sequence:
        settings = replace(settings, serial_shares=())
        believed = believed._replace(serial=stated.serial, span=stated.span)
    level = AS_STATED._replace(lasting=believed.lasting, serial=believed.serial, span=believed.span)
    least = _deviance(recording, weights, misfit, uncertain, level, settings)
    while True:
        near = [
            (_deviance(recording, weights, misfit, uncertain, other, settings), other)
            for other in _beside(level, settings)
        ]
        if not near or least - (best := min(near, key=lambda pair: pair[0]))[0] < settings.better_shares:
            return level
        least, level = best


def differences(recording: Recording, settings: Settings, felt: np.ndarray) -> csr_array | None:
    """(d, r) matrix that takes the readings to d differences of sequences under the same loads; None if too few repeat.

    Each sequence is compared with one later one only, so that no difference follows from others.  Of more than
    `Settings.most_differences`, those of the first sequences are kept, at the disks and kinds that feel the tensions
    most.

    Parameters
    ----------
    felt : (r,) variance of each reading by the scatter of the tensions, over that by its noise.
    """
    step, disk, kind, _ = (field.tolist() for field in recording.readings)
    row = {key: k for k, key in enumerate(zip(step, disk, kind, strict=True))}
    matched = list(_of_next(recording, settings))
    if len({match.step for match in matched}) < settings.fewest_repeats:
        return None
    matched = matched[: settings.most_differences]
    strength = defaultdict[tuple[int, int], float](float)
    for place, share in zip(zip(disk, kind, strict=True), felt.tolist(), strict=True):
        strength[place] += share
    strongest = sorted(strength, key=lambda place: -strength[place])
    kept = sorted(strongest[: max(settings.most_differences // len(matched), 1)])
    at, to, entries = list[int](), list[int](), list[float]()
    count = 0
    for place in kept:
        for match in matched:
            rows = [row.get((at_step, *place)) for at_step in (match.step, match.before, match.after)]
            if None in rows:
                continue
            at += [count] * 3
            to += rows  # type: ignore[arg-type]
            entries += [1.0, match.share - 1, -match.share]
            count += 1
    return csr_array((entries, (at, to)), shape=(count, recording.readings.count)) if count else None


def of_sequences(recording: Recording, change: np.ndarray, share: float) -> np.ndarray:
    """(r, q) change of the readings by one standard deviation of each independent part of the tension scatter.

    Sequences are independent of each other.  `change` and `share`: as of :func:`lasting_scatter`, for all steps.
    """
    every = range(len(recording.sequences))
    lasting = [lasting_scatter(change[:, recording.of_sequence == k], share) for k in every]
    columns = np.hstack([part.reshape(len(part), -1) for part in lasting])
    return columns[:, columns.any(0)]


def _of_next(recording: Recording, settings: Settings) -> Iterator[Match]:
    """The matches of every sequence with the first later one that repeats steps of it."""
    compared = dict[int, int]()
    for pair, match in matches(recording, settings):
        if compared.setdefault(int(recording.of_sequence[match.step]), pair) == pair:
            yield match


def _beside(level: NoiseLevel, settings: Settings) -> Iterator[NoiseLevel]:
    """The levels in which one share, `lasting` or `serial`, is the next larger or smaller one, `serial` at any span."""
    for share in _next_to(level.lasting, settings.lasting_shares):
        yield level._replace(lasting=share)
    for share in _next_to(level.serial, settings.serial_shares) if settings.serial_shares else ():
        spans = settings.serial_spans if share else (np.inf,)
        yield from (level._replace(serial=share, span=span) for span in spans)


def _next_to(share: float, shares: tuple[float, ...]) -> list[float]:
    """The next smaller one of `shares` and 0, and the next larger one, as far as there are any."""
    smaller, larger = [s for s in (0.0, *shares) if s < share], [s for s in shares if s > share]
    return [*smaller[-1:], *larger[:1]]


def _deviance(
    recording: Recording,
    weights: csr_array,
    misfit: np.ndarray,
    uncertain: Uncertain,
    level: NoiseLevel,
    settings: Settings,
) -> float:
    r"""Minus twice the ln of likelihood and prior of a level, given the differences, at the likeliest of both factors.

    The noise of the readings is :math:`L L^T`, that of the tensions :math:`U \Sigma^2 U^T` in units of it, so that one
    decomposition serves all factors.
    """
    apart = weights @ diags_array(uncertain.sd)
    noise = (apart @ noise_correlation(recording, level) @ apart.T).toarray()
    root = np.linalg.cholesky(noise)
    tensions = of_sequences(recording, uncertain.tensions, level.lasting)
    white = solve_triangular(root, np.column_stack([weights @ misfit, weights @ tensions]), lower=True)
    left, columns = white[:, 0], white[:, 1:]
    axes, size = left_singular(columns)
    along = (axes.T @ left) ** 2
    beside = max(float(left @ left - along.sum()), 0.0)
    first, last, count = settings.noise_scales
    log_scale = np.linspace(first, last, 1 + (count - 1) // settings.coarser)[:, None, None]
    log_factor = np.linspace(*settings.tension_scales)[:, None]
    spread = np.exp(2 * log_scale) + np.exp(2 * log_factor) * size**2
    inside = (np.log(spread) + along / spread).sum(-1)
    rest = (len(left) - len(size)) * 2 * log_scale[..., 0] + beside / np.exp(2 * log_scale[..., 0])
    prior = (log_scale[..., 0] / settings.noise_log_sd) ** 2 + (log_factor[:, 0] / settings.tension_log_sd) ** 2
    shares = (level.lasting / settings.lasting_sd) ** 2 + (level.serial / settings.common_sd) ** 2
    return float((inside + rest + prior).min() + 2 * np.log(np.diag(root)).sum() + shares)
