"""The true manipulator, and the readings that a perfect camera would take of it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.proof.concealed.design import Design
from prb3r.proof.rig.simulate import RigStates, observe


def truth(
    design: Design,
    effects: Sequence[Mapping[str, Any]] = (),
    log_stiffness: float = 0.0,
    log_friction: float = 0.0,
) -> dict[str, Any]:
    """The contents of a file of the design's manipulator with other constants (ln of factors on E and mu) and with
    effects."""
    plain = design.manipulator
    friction = {**plain["friction"], "coefficient": plain["friction"]["coefficient"] * float(np.exp(log_friction))}
    stiffer = plain["youngs_modulus_pa"] * float(np.exp(log_stiffness))
    return {**plain, "youngs_modulus_pa": stiffer, "friction": friction, "effect": list(effects)}


def exact_readings(
    design: Design,
    manipulator: Mapping[str, Any],
    states: Sequence[RigStates],
    frames: Sequence[Sequence[float]] | None = None,
) -> np.ndarray:
    """(steps, disks, kinds) readings of all sequences without noise, m and rad.

    Parameters
    ----------
    manipulator : contents of a manipulator file, of which the camera effects act
    states : states of the rig in each sequence, in the order in which they were taken
    frames : rotation (rad) and shift (m) of each sequence; None: zero
    """
    parts, before = [], 0
    for k, part in enumerate(states):
        frame = (0.0, 0.0, 0.0) if frames is None else frames[k]
        x, y, angle = observe(manipulator, part, image_centre=design.image_centre, frame=frame, before=before)
        before += len(part.x)
        bend = np.diff(part.angle, axis=1)
        all_kinds = np.stack([x[:, 1:], y[:, 1:], angle[:, 1:], bend], -1)
        parts.append(all_kinds[:, :, list(design.kinds)])
    return np.concatenate(parts)
