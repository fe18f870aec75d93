r"""How readings scatter together, and the whitening that makes them comparable.

The readings scatter as :math:`C = s^2 D^{1/2} P D^{1/2} + t^2 J S J^T + G T G^T`: reading noise of stated variances
`D`, `s` times as large as stated, with a correlation `P` between the disks of one photograph, or between photographs
that follow one another where what was pulled again tells so; the scatter `S` of the
applied tensions, `t` times as large as stated, carried to the readings of a sequence by their sensitivities `J`, a
share of it lasting through the sequence; and the tolerances `T` of the geometry of the rig by theirs, `G`, which all
sequences share.

With :math:`P = L L^T` and the columns :math:`U \Sigma V^T = (s D^{1/2} L)^{-1} t J S^{1/2}` the symmetric root of what
the first two leave is :math:`I - U (1 - (1 + \Sigma^2)^{-1/2}) U^T`, and the tolerances, whitened by it, are treated
alike.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array

from prb3r.diagnosis.settings import Settings
from prb3r.recording.recording import Recording

FELT = 1e-9
"""Standard deviation, in units of reading noise, below which a direction of common scatter is none."""


class NoiseLevel(NamedTuple):
    """What is believed of the noise beside the stated standard deviations."""

    scale: float = 1.0
    """Factor on those of the readings."""
    common: float = 0.0
    """Share of the variance that the disks of a photograph have in common."""
    reach: float = np.inf
    """Disks over which it is common: correlated as exp(-distance / reach)."""
    tension: float = 1.0
    """Factor on that of the tensions."""
    lasting: float = 0.0
    """Share of the variance of a cable's tensions that lasts through a sequence: a gain that the next one has not."""
    serial: float = 0.0
    """Share of the variance that readings of a disk have in common along a sequence, which the next one has not."""
    span: float = np.inf
    """Steps over which: correlated as exp(-distance / span)."""

    @property
    def correlations(self) -> tuple[float, ...]:
        """What correlates, without the factors on the scales: `common`, `reach`, `lasting`, `serial`, `span`."""
        return self.common, self.reach, self.lasting, self.serial, self.span

    def near(self, other: "NoiseLevel", settings: Settings) -> bool:
        """Whether both have the same correlations, and scales within `same_scale` and `same_scatter`."""
        return (
            abs(np.log(self.scale / other.scale)) < settings.same_scale
            and abs(np.log(self.tension / other.tension)) < settings.same_scatter
            and self.correlations == other.correlations
        )


AS_STATED = NoiseLevel()
"""Independent noise of the stated size."""


@dataclass(frozen=True, eq=False)
class Block:
    """Readings that scatter together in a few directions."""

    rows: np.ndarray
    """(b,) readings."""
    basis: np.ndarray
    """(b, k) orthonormal directions of common scatter, in units of what was whitened before."""
    shrink: np.ndarray
    """(k,) 1 - 1 / standard deviation along them."""


def block_of(rows: np.ndarray, columns: np.ndarray) -> Block:
    """The block of `columns` (b, k), each one standard deviation of one common scatter, in whitened units."""
    basis, size, _ = np.linalg.svd(columns, full_matrices=False)
    kept = size > FELT
    return Block(rows, basis[:, kept], 1 - 1 / np.sqrt(1 + size[kept] ** 2))


@dataclass(frozen=True, eq=False)
class Noise:
    """The covariance of all readings of a recording."""

    sd: np.ndarray
    """(r,) reading noise as it is believed, m or rad."""
    root: csr_array
    """(r, r) turns deviations into independent ones of unit variance, as far as reading noise goes."""
    blocks: tuple[Block, ...]
    """In the order in which they are whitened."""
    believed: np.ndarray
    """(r,) whether a reading is not weighed down."""
    total_sd: np.ndarray
    """(r,) standard deviation of every reading, tension scatter included but not tolerances, m or rad."""
    level: NoiseLevel = AS_STATED

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """(r, ...) deviations in units of the noise, made independent of each other."""
        out = self.root @ values
        for block in self.blocks:
            out[block.rows] = _shrunk(block, out[block.rows])
        return out


def independent(sd: np.ndarray) -> Noise:
    """Noise of standard deviations `sd` (r,), m or rad, that no two readings have in common."""
    return Noise(sd, csr_array(diags_array(1 / sd)), (), np.ones(len(sd), bool), sd)


def _shrunk(block: Block, part: np.ndarray) -> np.ndarray:
    across = block.basis.T @ part
    across *= block.shrink if part.ndim == 1 else block.shrink[:, None]
    return part - block.basis @ across


def reading_sd(recording: Recording) -> np.ndarray:
    """(r,) stated standard deviation of each reading, m or rad."""
    measurement = recording.measurement
    position, angle = measurement.position_sd_m or np.nan, measurement.angle_sd_rad or np.nan
    return np.asarray([position, position, angle, angle])[recording.readings.kind]


def noise_of(
    recording: Recording,
    sensitivity: np.ndarray,
    inflation: np.ndarray | None = None,
    level: NoiseLevel = AS_STATED,
    tolerances: np.ndarray | None = None,
) -> Noise:
    """The covariance of a recording's readings.

    Parameters
    ----------
    sensitivity : (r, s, m) of :func:`prb3r.diagnosis.fit.response.tension_response`.
    inflation : (r,) factor on the standard deviation of each reading; absent: 1.
    tolerances : (r, t) change of every reading by one standard deviation of each tolerance; absent: exact geometry.
    """
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
    """(r, s, m) changes of readings by one standard deviation each of what the tensions of a sequence scatter by.

    Parameters
    ----------
    change : (r, s, m) by one standard deviation of the tension of every step and cable.
    share : of its variance that lasts: times the symmetric root of (1 - share) I + share 1 1^T over the steps.
    """
    passing, all_steps = np.sqrt(1 - share), np.sqrt(1 - share + share * change.shape[1])
    return passing * change + (all_steps - passing) * change.mean(1, keepdims=True)


def correlation_root(recording: Recording, sd: np.ndarray, level: NoiseLevel) -> csr_array:
    """(r, r) inverse root of the reading noise of standard deviations `sd` (r,), triangular in the order of a block."""
    return _of_blocks(recording, level, lambda block: np.linalg.inv(np.linalg.cholesky(block))) @ diags_array(1 / sd)


def noise_correlation(recording: Recording, level: NoiseLevel) -> csr_array:
    """(r, r) correlation of the reading noise at a `level`, sparse: 1 on the diagonal, in the order of the readings."""
    return _of_blocks(recording, level, lambda block: block)


def _of_blocks(recording: Recording, level: NoiseLevel, form: Callable[[np.ndarray], np.ndarray]) -> csr_array:
    """(r, r) a `form` of every block of the correlation."""
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
    """Readings that have noise in common, (b,) rows, and their correlation, (b, b): of a photograph and a kind, or of a
    sequence and a kind where noise goes on from one photograph to the next.  Each reading is in one."""
    step, disk, kind, _ = recording.readings
    together = recording.of_sequence[step] if level.serial else step
    order = np.lexsort((disk, step, kind, together))
    edges = np.flatnonzero(np.diff(together[order]) | np.diff(kind[order])) + 1
    known, out = dict[bytes, np.ndarray](), []
    for rows in np.split(order, edges):
        key = np.concatenate([disk[rows], step[rows] - step[rows[0]]]).tobytes()
        if key not in known:
            disks, steps = (np.abs(np.subtract.outer(place[rows], place[rows])) for place in (disk, step))
            photograph = (1 - level.common) * (disks == 0) + level.common * np.exp(-disks / level.reach)
            along = np.exp(-steps / level.span) * (disks == 0)
            known[key] = (1 - level.serial) * photograph * (steps == 0) + level.serial * along
        out.append((rows, known[key]))
    return out
