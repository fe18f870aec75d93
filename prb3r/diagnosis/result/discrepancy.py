"""The discrepancy between an unexplained rig and the best model of it, and what it adds to the bands of predictions.

What the library lacks follows no known law.  It is supposed to move a disk in proportion to how far the disk is from
its place on the straight manipulator, on other designs as on the recorded one.
"""

import numpy as np

from prb3r.mechanics.chain import Chain, pose
from prb3r.model.files.cells import written_out
from prb3r.model.manipulator import Strict


class Discrepancy(Strict):
    """The root mean square error beyond the stated noise, as a share of the way from the straight manipulator."""

    share: float
    """Of a coordinate: error over the distance of the disk from its place on the straight manipulator.  Of the angle of
    a disk, or the bend of a plate: error over this angle or bend."""

    @property
    def statement(self) -> str:
        """What bands hold of it, as a sentence."""
        share = written_out(100 * self.share, ".2g")
        return (
            f"bands hold what is unexplained as an error of {share} % (root mean square) of the way of each disk from "
            "the straight manipulator, and of its angle, as on the recorded rig"
        )

    def errors(self, chain: Chain, predicted: np.ndarray, draws: int, rng: np.random.Generator) -> np.ndarray:
        """(d, rows, 3) random errors of x, y (m) and angle (rad) of every disk of `chain`; each of the `draws` misses
        all disks at all steps by the same share of their way.

        Parameters
        ----------
        predicted : (rows, 3) x, y and angle of all disks, step after step; where they are NaN there is no error.
        """
        x, y, angle = np.moveaxis(predicted.reshape(-1, len(chain.arc) + 1, 3), -1, 0)
        away = from_straight(chain, x, y)
        way = np.nan_to_num(np.stack([away, away, angle], -1)).reshape(predicted.shape)
        return self.share * rng.standard_normal((draws, 1, 3)) * way


def share_moved(chain: Chain, one: np.ndarray, other: np.ndarray) -> float:
    """How far two predictions (2, s, n + 1), x and y of all disks, are from one another, as a share of the way of the
    `other` from the straight manipulator, both root mean square; NaN are left out, and it is infinite without a way."""
    apart, way = np.hypot(*(one - other)), from_straight(chain, *other)
    known = np.isfinite(apart)
    moved = float(np.sum(way[known] ** 2))
    return float(np.sqrt(np.sum(apart[known] ** 2) / moved)) if moved else np.inf


def from_straight(chain: Chain, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(s, n + 1) distances of the disks of `chain`, at `x` and `y` (s, n + 1), from their places on the straight one,
    m."""
    straight = pose(chain, np.zeros_like(chain.rest))
    return np.hypot(x - straight.x, y - straight.y)
