"""Quantities of plates, cables and disks to which several effects may contribute, and what these make together."""

from collections.abc import Callable, Sequence

import numpy as np

from prb3r.mechanics.chain import Chain, no_loads
from prb3r.model.effects import with_effects
from prb3r.model.effects.base import Effect
from prb3r.model.manipulator import Manipulator

Contributed = Callable[[Chain, Chain], np.ndarray]
"""A number of each plate, cable or disk on a chain, beside the same chain without any effect."""


def stiffness_of_plates(chain: Chain, bare: Chain) -> np.ndarray:
    """(n,) bending stiffness of each plate over that without effects."""
    return (chain.elastic_stiffness / bare.elastic_stiffness).mean(1)


def rest_of_plates(chain: Chain, bare: Chain) -> np.ndarray:
    """(n,) stress-free curvature of each plate, 1/m."""
    return ((chain.rest - bare.rest) * chain.plate.stiffness).mean(1) / chain.arc


def zero_of_cables(chain: Chain, bare: Chain) -> np.ndarray:
    """(m,) tension added to the applied one of each cable, N."""
    return (chain.constant or no_loads(chain)).tension[0]


def gravity_on_disks(chain: Chain, bare: Chain) -> np.ndarray:
    """(n,) gravity in the plane that acts on each disk's mass, m/s^2."""
    return np.full(chain.plates, float(np.linalg.norm(chain.gravity)))


def drift_of_cables(chain: Chain, bare: Chain) -> np.ndarray:
    """(m,) tension added to the applied one of each cable with every step, N."""
    return np.zeros(len(chain.reach)) + chain.zero_drift


def play_of_cables(chain: Chain, bare: Chain) -> np.ndarray:
    """(m,) tension by which each cable lags behind the recorded one, N."""
    return np.zeros(len(chain.reach)) + chain.play


def pulley_of_cables(chain: Chain, bare: Chain) -> np.ndarray:
    """(m,) efficiency of the pulley of each cable."""
    return np.ones(len(chain.reach)) * chain.pulley


def load_of_disks(chain: Chain, bare: Chain) -> np.ndarray:
    """(n,) share of the recorded load on each disk that arrives."""
    return (np.ones((chain.plates, 1)) * chain.disk_efficiency)[:, 0]


def total_with_others(
    quantity: Contributed, effect: Effect, others: Sequence[Effect], bare: Chain, manipulator: Manipulator
) -> float | None:
    """The quantity wherever an effect changes it, with the contributions of the `others` too.

    None where they contribute nothing there, or not the same everywhere, so that no one number tells it.

    Parameters
    ----------
    others : the other effects on the same quantity.
    bare : the chain of the manipulator without any effect.
    """
    nothing, alone = quantity(bare, bare), quantity(effect.change(bare, manipulator), bare)
    changed = alone != nothing
    total = quantity(with_effects(bare, manipulator, [*others, effect]), bare)[changed]
    if not total.size or np.allclose(total, alone[changed]) or not np.allclose(total, total[0]):
        return None
    return float(total[0])
