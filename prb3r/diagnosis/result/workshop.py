"""Random rigs as a workshop makes them of a drawing, within the tolerances of a recording."""

import numpy as np

from prb3r.diagnosis.fit.tolerance import THICKNESS_TO_STIFFNESS, mechanical_tolerances
from prb3r.mechanics.chain import Chain
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Tolerance


def within_tolerances(
    manipulator: Manipulator, tolerance: Tolerance, rng: np.random.Generator, stiffness_sd: float
) -> Chain:
    """The chain of a random rig made of the drawing `manipulator`: its plates and cables are off as wholes and each, as
    a diagnosis has it of the recorded rig.

    Parameters
    ----------
    stiffness_sd : standard deviation of the ln of a factor on the stiffness of all plates.
    """
    chain = manipulator.chain()
    parts = list(mechanical_tolerances(manipulator, tolerance, chain, np.ones(chain.offset.shape[1], bool)))
    off = rng.standard_normal(1 + len(parts))
    chain = chain._replace(stiffness=chain.stiffness * np.exp(stiffness_sd * off[0]))
    for part, by in zip(parts, off[1:], strict=True):
        chain = part.change(chain, by * part.sd)
    return chain


def common_stiffness_sd(here: Manipulator, there: Manipulator, tolerance: Tolerance, apart: bool) -> float:
    """Standard deviation of the ln of the stiffness of all plates of `there`, beside what the recording of `here` tells
    of Young's modulus.

    The thickness of an only segment as a whole cannot be told from the modulus: that of the recorded rig is in the
    modulus that was found, unless other rigs tell it `apart`, and that of the other rig comes on top.
    """
    rigs = (there,) if apart else (here, there)
    only = sum(len(rig.segment) == 1 and rig.plates > 1 for rig in rigs)
    return float(np.sqrt(only)) * THICKNESS_TO_STIFFNESS * tolerance.thickness_relative
