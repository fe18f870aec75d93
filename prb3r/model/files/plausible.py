"""Types for the numbers of a rig in SI: values that no rig has are refused, with a unit in which they make sense."""

import math
from dataclasses import dataclass
from typing import Annotated

from pydantic import AfterValidator

from prb3r.model.files.numbers import NonNegative, Positive
from prb3r.quantities import GIVEN_IN

MODULI = (1e6, 2e12)
"""Least and greatest Young's modulus, Pa: from soft rubber to beyond diamond."""
STRONGEST_FRICTION = 5.0
"""Largest friction coefficient: above that of any cable on any rim (steel on steel 0.2 to 0.8, rubber up to 2) and
below friction angles in degrees."""


@dataclass(frozen=True)
class Bounds:
    """Bounds between which the magnitude of a rig's quantity lies; zero is allowed too."""

    low: float
    high: float
    unit: str
    """SI unit of the quantity and of the bounds."""
    others: tuple[tuple[str, float], ...]
    """Other units in which the quantity may have been given by mistake, likely ones first, each with its size in SI."""

    def __call__(self, value: float | list[float] | None):
        """The value, or the list of values, if within the bounds.

        Raises
        ------
        ValueError
            If a value is out of bounds, with the bounds and a unit in which it would be within.
        """
        for number in value if isinstance(value, list) else [value]:
            if number and not self.low <= abs(number) <= self.high:
                raise ValueError(self._remark(number))
        return value

    def _remark(self, number: float) -> str:
        """The message on a value out of bounds."""
        ends = f"{self.low:g} to {self.high:g}" if self.low else f"up to {self.high:g}"
        given = GIVEN_IN.get(self.unit, "SI units are meant")
        text = f"{number:g} {self.unit} is not what rigs are made with ({ends} {self.unit}); {given}"
        for unit, size in self.others:
            if self.low <= abs(number) * size <= self.high:
                return f"{text}: {number:g} {unit} is {number * size:.6g}"
        return text


def _friction_coefficient(value: float) -> float:
    if value <= STRONGEST_FRICTION:
        return value
    text = f"{value:g} is more than any cable rubs; the coefficient is friction force over normal force"
    if value < 80:
        text += f": a friction angle of {value:g} degrees is {math.tan(math.radians(value)):.2g}"
    raise ValueError(text)


_LENGTHS = (("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6))
_WITHIN_LENGTHS = Bounds(0.0, 2.0, "m", _LENGTHS)
_PRESSURES = (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3))

Length = Annotated[Positive, AfterValidator(_WITHIN_LENGTHS)]
ClampLength = Annotated[NonNegative, AfterValidator(_WITHIN_LENGTHS)]
Offset = Annotated[float | list[float], AfterValidator(_WITHIN_LENGTHS)]
Thickness = Annotated[Positive, AfterValidator(Bounds(0.0, 0.1, "m", _LENGTHS))]
DiskThickness = Annotated[NonNegative, AfterValidator(Bounds(0.0, 0.2, "m", _LENGTHS))]
TubeSize = Annotated[NonNegative, AfterValidator(Bounds(0.0, 0.2, "m", _LENGTHS))]
TubeDiameter = Annotated[Positive, AfterValidator(Bounds(0.0, 0.2, "m", _LENGTHS))]
HoleShift = Annotated[float, AfterValidator(Bounds(0.0, 0.2, "m", _LENGTHS))]
Clearance = Annotated[NonNegative, AfterValidator(Bounds(0.0, 0.1, "m", _LENGTHS))]
BendAngle = Annotated[Positive, AfterValidator(Bounds(0.0, 2 * math.pi, "rad", (("degrees", math.pi / 180),)))]
TiltAngle = Annotated[float, AfterValidator(Bounds(0.0, 2 * math.pi, "rad", (("degrees", math.pi / 180),)))]
Mass = Annotated[NonNegative, AfterValidator(Bounds(0.0, 20.0, "kg", (("g", 1e-3),)))]
Acceleration = Annotated[Positive, AfterValidator(Bounds(1e-3, 100.0, "m/s^2", (("cm/s^2", 1e-2), ("mm/s^2", 1e-3))))]
Modulus = Annotated[Positive, AfterValidator(Bounds(*MODULI, "Pa", _PRESSURES))]
Stress = Annotated[Positive, AfterValidator(Bounds(1e5, 2e10, "Pa", _PRESSURES[1:] + _PRESSURES[:1]))]
Stiffness = Annotated[Positive, AfterValidator(Bounds(0.0, 1e4, "N m^2", (("N mm^2", 1e-6),)))]
Coefficient = Annotated[NonNegative, AfterValidator(_friction_coefficient)]
