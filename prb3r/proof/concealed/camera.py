"""The manipulator as it really is, and what a perfect camera would read of it."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from prb3r.proof.concealed.designs import Design
from prb3r.proof.rig.simulate import RigStates, observe


def truth(
    design: Design,
    effects: Sequence[Mapping[str, Any]] = (),
    log_stiffness: float = 0.0,
    log_friction: float = 0.0,
) -> dict[str, Any]:
    """The manipulator with other constants and effects."""
    plain = design.manipulator
    friction = {**plain["friction"], "coefficient": plain["friction"]["coefficient"] * float(np.exp(log_friction))}
    stiffer = plain["youngs_modulus_pa"] * float(np.exp(log_stiffness))
    return {**plain, "youngs_modulus_pa": stiffer, "friction": friction, "effect": list(effects)}


def read(
    design: Design,
    manipulator: Mapping[str, Any],
    states: Sequence[RigStates],
    frames: Sequence[Sequence[float]] | None = None,
) -> np.ndarray:
    """(steps, disks, kinds) exact readings of all sequences, each in its frame."""
    parts = []
    for k, found in enumerate(states):
        frame = (0.0, 0.0, 0.0) if frames is None else frames[k]
        x, y, angle = observe(manipulator, found, image_centre=design.image_centre, frame=frame)
        bend = np.diff(found.angle, axis=1)
        all_kinds = np.stack([x[:, 1:], y[:, 1:], angle[:, 1:], bend], -1)
        parts.append(all_kinds[:, :, list(design.kinds)])
    return np.concatenate(parts)
