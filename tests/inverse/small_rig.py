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


def arm(tip_mass_kg=0.08):
    """Three segments of fourteen plates under their weight, tapering, with four cables."""
    sizes = [(5, 0.028, 0.020, 0.0009, 0.004), (5, 0.026, 0.018, 0.0007, 0.003), (4, 0.024, 0.016, 0.0005, 0.002)]
    names = ("plates", "length_m", "width_m", "thickness_m", "plate_mass_kg")
    tip, middle = [0.018, 0.018, 0.015], [0.014, 0.014]
    cables = [("tip_up", tip, 1), ("tip_down", tip, -1), ("mid_up", middle, 1), ("mid_down", middle, -1)]
    return Manipulator.model_validate(
        {
            "name": "arm",
            "youngs_modulus_pa": 2.0e11,
            "yield_stress_pa": 1.2e9,
            "disk": {"thickness_m": 0.005, "mass_kg": 0.015, "tip_mass_kg": tip_mass_kg},
            "friction": {"coefficient": 0.12},
            "segment": [dict(zip(names, size, strict=True)) | {"clamp_m": 0.005} for size in sizes],
            "cable": [
                {"name": name, "offset_m": [side * arm for arm in arms], "ends_at_segment": len(arms)}
                for name, arms, side in cables
            ],
            "effect": [{"kind": "gravity", "y_m_s2": -9.81}],
        }
    )


ARM = arm()


def comes_to(manipulator, answer, disk):
    """(steps, 3) where a forward solve of the answer brings a disk."""
    markers = prb3r.solve(manipulator, answer.steps)
    assert (markers["outcome"] == "converged").all()
    return markers.loc[markers["disk"] == disk, ["x_m", "y_m", "angle_rad"]].to_numpy()


def with_effects(manipulator, *effects):
    """The manipulator with these effects alone."""
    return Manipulator.model_validate(manipulator.model_dump(exclude_none=True) | {"effect": list(effects)})
