r"""The covariance of the readings of a recording, and the whitening by its inverse root.

The covariance is :math:`C = s^2 D^{1/2} P D^{1/2} + t^2 J S J^T + G T G^T`.  Its first term is reading noise of stated
variances `D`, with `s` times the stated standard deviations and a correlation `P` between the disks of one photograph
and, where repeated sequences show it, between photographs that follow one another.  The second is the scatter `S` of
the applied tensions, `t` times as large as stated and in part lasting through a sequence, carried to the readings by
their sensitivities `J`.  The third are the tolerances `T` of the rig's geometry with their sensitivities `G`; all
sequences share them.

With :math:`P = L L^T` and :math:`U \Sigma V^T = (s D^{1/2} L)^{-1} t J S^{1/2}`, readings whitened by the reading noise
are whitened against the tensions by the symmetric root :math:`I - U (1 - (1 + \Sigma^2)^{-1/2}) U^T`, one sequence
after the other.  The tolerances, whitened by both, are then treated in the same way.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array

from prb3r.diagnosis.fit.basis import left_singular
from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording

FELT = 1e-9
"""Standard deviation, in units of the noise whitened so far, up to which a direction of scatter is dropped."""


class NoiseLevel(NamedTuple):
    """Factors on the stated standard deviations of readings and tensions, and the correlations of both."""

    scale: float = 1.0
    """Factor on the standard deviations of the readings."""
    common: float = 0.0
    """Share of the variance of the reading noise that the disks of a photograph have in common."""
    reach: float = np.inf
    """Correlation length of the common share, in disks: exp(-distance / reach)."""
    tension: float = 1.0
    """Factor on the standard deviation of the tensions."""
    lasting: float = 0.0
    """Share of the variance of a cable's tensions that is one error throughout a sequence, and another in the next."""
    serial: float = 0.0
    """Share of the variance of the reading noise that the readings of a disk have in common along one sequence."""
    span: float = np.inf
    """Correlation length of the serial share, in steps: exp(-distance / span)."""

    @property
    def correlations(self) -> tuple[float, ...]:
        """The fields that describe correlation: `common`, `reach`, `lasting`, `serial`, `span`."""
        return self.common, self.reach, self.lasting, self.serial, self.span

    def near(self, other: "NoiseLevel", settings: Settings) -> bool:
        """Whether both have the same correlations, and factors whose ln differ by less than `Settings.same_scale` and
        `Settings.same_scatter`."""
        return (
            abs(np.log(self.scale / other.scale)) < settings.same_scale
            and abs(np.log(self.tension / other.tension)) < settings.same_scatter
            and self.correlations == other.correlations
        )


AS_STATED = NoiseLevel()
"""Noise of the stated standard deviations without correlations."""


def as_stated(recording: Recording) -> NoiseLevel:
    """Noise of the stated standard deviations, with the correlation from step to step that a log tells."""
    return AS_STATED._replace(serial=recording.serial_noise.share, span=recording.serial_noise.span)


@dataclass(frozen=True, eq=False)
class Block:
    """One step of the whitening: some readings, and the few directions in which they scatter together."""

    rows: np.ndarray
    """(b,) numbers of the readings."""
    basis: np.ndarray
    """(b, k) orthonormal directions of common scatter, in the units that earlier steps have whitened to."""
    shrink: np.ndarray
    """(k,) 1 - 1 / sd, with sd the standard deviation along each direction: the share that whitening removes."""


def block_of(rows: np.ndarray, columns: np.ndarray) -> Block:
    """The block of the readings numbered `rows` (b,); each of the `columns` (b, k) is their change by one standard
    deviation of one common cause, in units whitened so far."""
    basis, size = left_singular(columns)
    kept = size > FELT
    return Block(rows, basis[:, kept], 1 - 1 / np.sqrt(1 + size[kept] ** 2))


@dataclass(frozen=True, eq=False)
class Noise:
    """The covariance of all readings of a recording, held as the steps that whiten them."""

    sd: np.ndarray
    """(r,) standard deviation of the reading noise alone, m or rad; larger where a reading is down-weighted."""
    root: csr_array
    """(r, r) inverse root of the covariance of the reading noise alone: whitens this part of the deviations."""
    blocks: tuple[Block, ...]
    """The scatter of the tensions of each sequence, then the tolerances, in the order in which they are whitened."""
    believed: np.ndarray
    """(r,) whether a reading counts fully; False where it is down-weighted."""
    total_sd: np.ndarray
    """(r,) standard deviation of every reading, tension scatter included but not tolerances, m or rad."""
    level: NoiseLevel = AS_STATED
    """The level that the covariance was made for."""

    def log_density(self, misfit: np.ndarray) -> float:
        """ln density of a `misfit` (r,) of the readings, m or rad, without the constant -r ln(2 pi) / 2."""
        shrunk = sum(float(np.log1p(-block.shrink).sum()) for block in self.blocks)
        return float(np.log(self.root.diagonal()).sum()) + shrunk - float((self.whiten(misfit) ** 2).sum()) / 2

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """(r, ...) deviations `values` of the readings, made independent and of unit variance."""
        out = self.root @ values
        for block in self.blocks:
            out[block.rows] = _shrunk(block, out[block.rows])
        return out


def independent(sd: np.ndarray) -> Noise:
    """Independent noise of standard deviations `sd` (r,), m or rad, without tension scatter and tolerances."""
    return Noise(sd, csr_array(diags_array(1 / sd)), (), np.ones(len(sd), bool), sd)


def _shrunk(block: Block, part: np.ndarray) -> np.ndarray:
    """The values `part` (b, ...) of a block's readings, of unit variance along its directions too."""
    across = block.basis.T @ part
    across *= block.shrink if part.ndim == 1 else block.shrink[:, None]
    return part - block.basis @ across


def reading_sd(recording: Recording) -> np.ndarray:
    """(r,) stated standard deviation of each reading, m or rad; NaN where none is stated for its kind."""
    measurement = recording.measurement
    position, angle = measurement.position_sd_m or np.nan, measurement.angle_sd_rad or np.nan
    return np.asarray([position, position, angle, angle])[recording.readings.kind]


def noise_of(
    recording: Recording,
    sensitivity: np.ndarray,
    inflation: np.ndarray | None = None,
    level: NoiseLevel | None = None,
    tolerances: np.ndarray | None = None,
) -> Noise:
    """The covariance of the readings of a recording: reading noise, scatter of the tensions and tolerances.

    Parameters
    ----------
    sensitivity : (r, s, m) of :func:`prb3r.diagnosis.fit.response.tension_response`.
    inflation : (r,) factor on the standard deviation of each reading, above 1 where it is down-weighted; absent: 1.
    level : absent: as stated (:func:`as_stated`).
    tolerances : (r, t) change of every reading by one standard deviation of each tolerance; absent: exact geometry.
    """
    level = as_stated(recording) if level is None else level
    believed = np.ones(recording.readings.count) if inflation is None else inflation
    sd = reading_sd(recording) * level.scale * believed
    root = correlation_root(recording, sd, level)
    scatter = recording.measurement.tension_sd_relative * level.tension
    variance, blocks = sd**2, []
    for k in range(len(recording.sequences)):
        steps = np.flatnonzero(recording.of_sequence == k)
        rows = np.flatnonzero(np.isin(recording.readings.step, steps))
        columns = lasting_scatter(sensitivity[np.ix_(rows, steps)] * scatter, level.lasting)
        columns = columns.reshape(len(rows), len(steps) * sensitivity.shape[2])
        columns = columns[:, columns.any(0)]
        if columns.size:
            variance[rows] += (columns**2).sum(1)
            blocks.append(block_of(rows, root[rows][:, rows] @ columns))
    noise = Noise(sd, root, tuple(blocks), believed == 1, np.sqrt(variance), level)
    if tolerances is None or not tolerances.size:
        return noise
    return replace(noise, blocks=(*blocks, block_of(np.arange(len(sd)), noise.whiten(tolerances))))


def lasting_scatter(change: np.ndarray, share: float) -> np.ndarray:
    """(r, s, m) change of the readings by one standard deviation of each independent part of the tension scatter of a
    sequence of s steps and m cables.

    Parameters
    ----------
    change : (r, s, m) change of the readings by one standard deviation of the tension of every step and cable.
    share : share of the tensions' variance that lasts through the sequence.  What comes back is `change` times the
        symmetric root of (1 - share) I + share 1 1^T over the steps.
    """
    passing, all_steps = np.sqrt(1 - share), np.sqrt(1 - share + share * change.shape[1])
    return passing * change + (all_steps - passing) * change.mean(1, keepdims=True)


def correlation_root(recording: Recording, sd: np.ndarray, level: NoiseLevel) -> csr_array:
    """(r, r) inverse root of the covariance of the reading noise with standard deviations `sd` (r,).

    Within a correlated group of readings, in the order of :func:`_blocks`, the root is lower triangular.
    """
    return _of_blocks(recording, level, lambda block: np.linalg.inv(np.linalg.cholesky(block))) @ diags_array(1 / sd)


def noise_correlation(recording: Recording, level: NoiseLevel) -> csr_array:
    """(r, r) correlation of the reading noise at a `level`, sparse: 1 on the diagonal, in the order of the readings."""
    return _of_blocks(recording, level, lambda block: block)


def _of_blocks(recording: Recording, level: NoiseLevel, form: Callable[[np.ndarray], np.ndarray]) -> csr_array:
    """(r, r) block-diagonal matrix with `form` of each block of the correlation; identity where nothing correlates."""
    if not level.common and not level.serial:
        return csr_array(eye_array(recording.readings.count))
    at, to, entries, known = [], [], [], dict[int, np.ndarray]()
    for rows, block in _blocks(recording, level):
        if id(block) not in known:
            known[id(block)] = form(block)
        at.append(np.repeat(rows, len(rows)))
        to.append(np.tile(rows, len(rows)))
        entries.append(known[id(block)].ravel())
    shape = (recording.readings.count,) * 2
    return csr_array((np.concatenate(entries), (np.concatenate(at), np.concatenate(to))), shape=shape)


def _blocks(recording: Recording, level: NoiseLevel) -> list[tuple[np.ndarray, np.ndarray]]:
    """Groups of readings with correlated noise: their numbers (b,) and correlation (b, b).

    A group is one kind in one photograph or, where noise lasts from one photograph to the next, one kind in one
    sequence.  Each reading is in one group; equal correlations are one and the same array.
    """
    step, disk, kind, _ = recording.readings
    together = recording.of_sequence[step] if level.serial else step
    order = np.lexsort((disk, step, kind, together))
    edges = np.flatnonzero(np.diff(together[order]) | np.diff(kind[order])) + 1
    known, out, when = dict[bytes, np.ndarray](), [], recording.row_as_read[step]
    for rows in np.split(order, edges):
        key = np.concatenate([disk[rows], when[rows] - when[rows[0]]]).tobytes()
        if key not in known:
            disks, steps = (np.abs(np.subtract.outer(place[rows], place[rows])) for place in (disk, when))
            photograph = (1 - level.common) * (disks == 0) + level.common * np.exp(-disks / level.reach)
            along = np.exp(-steps / level.span) * (disks == 0)
            known[key] = (1 - level.serial) * photograph * (steps == 0) + level.serial * along
        out.append((rows, known[key]))
    return out
