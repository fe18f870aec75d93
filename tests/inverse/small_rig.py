"""A small manipulator whose tensions are sought, and where tensions bring it."""

import prb3r
from prb3r.model.manipulator import Manipulator


def small(**friction):
    """Two segments of three plates, four cables."""
    segment = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 0.0008}
    cables = [("1", 0.0255, 2), ("2", 0.021, 1), ("3", -0.021, 1), ("4", -0.0255, 2)]
    return Manipulator.model_validate(
        {
            "name": "small",
            "youngs_modulus_pa": 1.87e11,
            "disk": {"thickness_m": 0.004, "mass_kg": 0.04},
            "friction": friction,
            "segment": [segment, segment],
            "cable": [{"name": name, "offset_m": offset, "ends_at_segment": end} for name, offset, end in cables],
        }
    )


FREE, RUBBING, STICKY = small(), small(coefficient=0.3), small(coefficient=0.3, direction="history")


def comes_to(manipulator, answer, disk):
    """(steps, 3) where a forward solve of the answer brings a disk."""
    markers = prb3r.solve(manipulator, answer.steps)
    assert (markers["outcome"] == "converged").all()
    return markers.loc[markers["disk"] == disk, ["x_m", "y_m", "angle_rad"]].to_numpy()


def with_effects(manipulator, *effects):
    """The manipulator with these effects alone."""
    return Manipulator.model_validate(manipulator.model_dump(exclude_none=True) | {"effect": list(effects)})
