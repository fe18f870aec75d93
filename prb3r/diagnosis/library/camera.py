"""Suspects in the camera: its scale, its aspect and its lens, where positions were read, and a steady motion."""

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope, whole_rig_if
from prb3r.diagnosis.library.suspect import OF_THE_CAMERA, Occurrence, Suspect, rare
from prb3r.recording.recording import Kind


def _positions(scope: Scope) -> list[Place]:
    """The whole rig where positions were read, else no place."""
    return whole_rig_if(bool(scope.recording.readings.is_position.any()))


def _scale(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `camera_scale`: 0.8 to 1.25, prior sd 3 %; a grosser error of the scale is one of units."""
    return (Free("scale", 1.0, 0.8, 1.25, log=True, sd=0.03),)


def _aspect(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `camera_aspect`: a camera up to 35 degrees off the normal of the plane, in either direction;
    prior sd 2 %, as one 11 degrees off shortens lengths by."""
    return (Free("y_over_x", 1.0, 0.82, 1.22, log=True, sd=0.02),)


def _distortion(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `lens_distortion`: up to where a marker one manipulator length away from the image centre is
    seen twice as far off, or at the centre; prior sd a fifth of that."""
    size = 1 / scope.chain.length**2
    return (Free("k1_per_m2", 0.0, -size, size, scale=size, sd=0.2),)


def _moving(scope: Scope) -> list[Place]:
    """The whole rig where a moving camera can be seen, else no place.

    That takes positions or angles, as bends do not show it, and time that can be told from the load, which moves all
    markers of a photograph too.
    """
    seen = bool((scope.recording.readings.kind != Kind.BEND).any())
    return whole_rig_if(scope.tells_time and seen)


def _motion(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameters of `camera_drift`: over the whole recording a shift of up to a tenth of the manipulator's length
    along each axis and a turn of up to 0.1 rad, prior sd a tenth of these bounds; more is seen by eye.

    The turn alone where no positions were read, as angles do not show a shift.
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
        transfer=OF_THE_CAMERA,
        places=_positions,
        free=_scale,
    ),
    Suspect(
        "camera_aspect",
        sentence=lambda fitted: (
            f"The camera sees lengths along y {fitted.size:.5g} times as long as those along x: it does not look "
            "squarely at the plane, or its pixels are not square."
        ),
        transfer=OF_THE_CAMERA,
        places=_positions,
        free=_aspect,
        presence=rare,
    ),
    Suspect(
        "lens_distortion",
        sentence=lambda fitted: f"The lens distorts: k1 = {fitted.size} 1/m² about the image centre.",
        transfer=OF_THE_CAMERA,
        places=_positions,
        free=_distortion,
    ),
    Suspect(
        "camera_drift", sentence=_motion_sentence, transfer=OF_THE_CAMERA, places=_moving, free=_motion, presence=rare
    ),
)
