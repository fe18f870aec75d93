"""How recordings of the bench differ from exact ones: constants nobody knows, and awkward readings."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from prb3r.recording.recording import Kind


@dataclass(frozen=True)
class Imperfections:
    """Of every recording; the awkward ones of those that ask for them."""

    log_stiffness_sd: float = 0.08
    """Of ln E about the nominal one: inside the prior of those that have one."""
    log_friction_sd: float = 0.2
    """Of ln mu."""
    most_deviations: float = 2.0
    """At which constants and frame are cut off: no recording fails for an improbable one."""
    narrowings: tuple[float, ...] = (1.0, 0.7, 0.4, 0.2, 0.0)
    """Factors on the deviations of the constants, tried until the rig keeps its equilibria."""
    second_awkwardness: float = 0.3
    """Share of awkward recordings that are so in two ways."""
    frame_edge: float = 2.0
    """Deviations by which an awkward frame is off, in each of its parts."""
    far_tensions: float = 0.1
    """Share of tensions that are two deviations off, where tensions scatter awkwardly."""
    far_by: float = 2.0
    """Their deviation, over the stated one."""
    heavy_freedom: float = 5.0
    """Degrees of freedom of Student's law for heavy-tailed noise, scaled to the stated deviation."""
    outliers: float = 0.02
    """Share of readings that are gross outliers."""
    gross: Mapping[Kind, float] = field(
        default_factory=lambda: {Kind.X: 0.02, Kind.Y: 0.02, Kind.ANGLE: 0.3, Kind.BEND: 0.3}
    )
    """Their size, m or rad: a marker taken for its neighbour."""
    gross_spread: tuple[float, float] = (0.5, 1.5)
    """Range of their size in parts of it."""
    missing: float = 0.2
    """Share of readings that are missing, where some are."""
