"""Suspects in the camera, where positions were read."""

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import OF_THE_SETUP, Occurrence, Suspect, rare
from prb3r.recording.recording import Kind


def _positions(scope: Scope) -> list[Place]:
    return whole_rig_if(bool((scope.recording.readings.kind <= Kind.Y).any()))


def _scale(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Within a quarter, mostly 3 %: a grosser error of the scale is one of units."""
    return (Free("scale", 1.0, 0.8, 1.25, log=True, sd=0.03),)


def _distortion(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Up to where a marker one length away from the image centre is seen twice as far, or at the centre; mostly a
    fifth of that."""
    size = 1 / scope.chain.length**2
    return (Free("k1_per_m2", 0.0, -size, size, scale=size, sd=0.2),)


def _moving(scope: Scope) -> list[Place]:
    """Where time is told from the load, which would move all markers of a photograph too; bends do not show it."""
    seen = bool((scope.recording.readings.kind != Kind.BEND).any())
    return whole_rig_if(scope.tells_time and seen)


def _motion(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Up to a tenth of the length, or 0.1 rad, over the whole recording; mostly a hundredth: more is seen by eye.

    Angles alone show that a camera turns, not that it shifts.
    """
    shift, turn = scope.chain.length / scope.elapsed, 1 / scope.elapsed
    shifts = (Free(f"{axis}_m_per_step", 0.0, -0.1 * shift, 0.1 * shift, scale=shift, sd=0.01) for axis in "xy")
    turns = Free("angle_rad_per_step", 0.0, -0.1 * turn, 0.1 * turn, scale=turn, sd=0.01)
    return (*shifts, turns) if _positions(scope) else (turns,)


def _motion_sentence(fitted: Occurrence) -> str:
    turns = f"turns by {fitted.estimates['angle_rad_per_step'].times(1e6)} microradians"
    if len(fitted.estimates) > 1:
        x, y = (fitted.estimates[f"{axis}_m_per_step"].times(1e6) for axis in "xy")
        turns = f"shifts by ({x}, {y}) micrometres and {turns}"
    return (
        f"The camera (or what it stands on) moves steadily: from step to step the picture {turns}; photograph "
        "something that stands still."
    )


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
    Suspect(
        "camera_drift", sentence=_motion_sentence, transfer=OF_THE_SETUP, places=_moving, free=_motion, presence=rare
    ),
)
