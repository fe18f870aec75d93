r"""How readings scatter together, and the whitening that makes them comparable.

Within a sequence the readings scatter as :math:`C = D + J S J^T`: reading noise `D`, one variance a reading, and the
scatter `S` of the applied tensions, carried to the readings by their sensitivities `J`.  With
:math:`D^{-1/2} J S^{1/2} = U \Sigma V^T` the symmetric root of its inverse is
:math:`C^{-1/2} = (I - U (1 - (1 + \Sigma^2)^{-1/2}) U^T) D^{-1/2}`.
"""

from dataclasses import dataclass

import numpy as np

from prb3r.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Block:
    """The readings of one sequence, which scatter together."""

    rows: np.ndarray
    """(b,) readings."""
    basis: np.ndarray
    """(b, k) orthonormal directions of common scatter, in units of reading noise."""
    shrink: np.ndarray
    """(k,) 1 - 1 / standard deviation along them."""


@dataclass(frozen=True, eq=False)
class Noise:
    """The covariance of all readings of a recording."""

    sd: np.ndarray
    """(r,) reading noise, m or rad."""
    blocks: tuple[Block, ...]
    believed: np.ndarray
    """(r,) whether a reading is not weighed down."""

    @property
    def total_sd(self) -> np.ndarray:
        """(r,) standard deviation of every reading, tension scatter included, m or rad."""
        out = self.sd**2
        for block in self.blocks:
            common = block.basis**2 @ (1 / (1 - block.shrink) ** 2 - 1)
            out[block.rows] += self.sd[block.rows] ** 2 * common
        return np.sqrt(out)

    def whiten(self, values: np.ndarray) -> np.ndarray:
        """(r, ...) deviations in units of the noise, made independent of each other."""
        out = values / (self.sd if values.ndim == 1 else self.sd[:, None])
        for block in self.blocks:
            part = out[block.rows]
            across = block.basis.T @ part
            across *= block.shrink if values.ndim == 1 else block.shrink[:, None]
            out[block.rows] = part - block.basis @ across
        return out


def reading_sd(recording: Recording) -> np.ndarray:
    """(r,) standard deviation of each reading, m or rad."""
    measurement = recording.measurement
    position, angle = measurement.position_sd_m or np.nan, measurement.angle_sd_rad or np.nan
    return np.asarray([position, position, angle, angle])[recording.readings.kind]


def noise_of(
    recording: Recording,
    sensitivity: np.ndarray,
    inflation: np.ndarray | None = None,
) -> Noise:
    """The covariance of a recording's readings.

    Parameters
    ----------
    sensitivity : (r, s, m) of :func:`prb3r.diagnosis.fit.response.tension_response`.
    inflation : (r,) factor on the standard deviation of each reading; absent: 1.
    """
    sd = reading_sd(recording) * (1.0 if inflation is None else inflation)
    scatter = np.full(len(recording.of_sequence), recording.measurement.tension_sd_relative)
    blocks = []
    for k in range(len(recording.sequences)):
        steps = np.flatnonzero(recording.of_sequence == k)
        rows = np.flatnonzero(np.isin(recording.readings.step, steps))
        columns = (sensitivity[np.ix_(rows, steps)] * scatter[steps, None]).reshape(len(rows), -1)
        columns = columns[:, columns.any(0)] / sd[rows, None]
        if not columns.size:
            continue
        basis, size, _ = np.linalg.svd(columns, full_matrices=False)
        kept = size > 1e-9
        blocks.append(Block(rows, basis[:, kept], 1 - 1 / np.sqrt(1 + size[kept] ** 2)))
    return Noise(sd, tuple(blocks), sd == reading_sd(recording))
