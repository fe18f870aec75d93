"""Suspects in the camera, where positions were read."""

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import OF_THE_SETUP, Suspect
from prb3r.recording.recording import Kind


def _positions(scope: Scope) -> list[Place]:
    return whole_rig_if(bool((scope.recording.readings.kind <= Kind.Y).any()))


def _scale(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Within a quarter, mostly 3 %: a grosser error of the scale is one of units."""
    return (Free("scale", 1.0, 0.8, 1.25, log=True, sd=0.03),)


def _distortion(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Up to where a marker one length away from the image centre is seen twice as far, or at the centre."""
    size = 1 / scope.chain.length**2
    return (Free("k1_per_m2", 0.0, -size, size, scale=size, sd=0.2),)


CAMERA_SUSPECTS = (
    Suspect(
        "camera_scale",
        sentence=lambda fitted: (
            f"The camera's scale is off: measured lengths are {fitted.size:.5g} times the true ones."
        ),
        transfer=OF_THE_SETUP,
        places=_positions,
        free=_scale,
    ),
    Suspect(
        "lens_distortion",
        sentence=lambda fitted: f"The lens distorts: k1 = {fitted.size} 1/m² about the image centre.",
        transfer=OF_THE_SETUP,
        places=_positions,
        free=_distortion,
    ),
)
