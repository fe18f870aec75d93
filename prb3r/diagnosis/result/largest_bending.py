"""How far plates are bent, and whether they are bent back, to tell whether a design bends them beyond what the
recording has shown of their bending law."""

import numpy as np

from prb3r.diagnosis.library.scope import bends_back
from prb3r.diagnosis.settings import Settings
from prb3r.model.manipulator import Manipulator, Strict


class Bending(Strict):
    """The largest bend of a plate, as the mean along it."""

    curvature_per_m: float
    strain: float | None = None
    """Of the outermost fibre; None where its distance is not known of every plate."""
    unloads: bool | None = None
    """Whether some plate bends back within a sequence (`Scope.unloads`); None where that is not known."""

    def beyond(self, seen: "Bending", times: float) -> str:
        """A remark where plates are bent more than `times` as far as in `seen`, the bending of the recording; empty
        where they are not.

        Strains are compared where both are known, else curvatures.
        """
        if self.strain is not None and seen.strain is not None:
            here, there = self.strain, seen.strain
            said = f"strained by up to {here:.2%} here, by {there:.2%} at most where it was fitted"
        else:
            here, there = self.curvature_per_m, seen.curvature_per_m
            said = f"bent up to {here:.3g} 1/m here, {there:.3g} 1/m at most where it was fitted"
        if here <= times * there:
            return ""
        return f"plates are {said}: beyond that the law of bending is supposed to go on, unseen"

    def back(self, seen: "Bending") -> str:
        """A remark where plates bend back, and in `seen`, the bending of the recording, did not; else empty."""
        if not self.unloads or seen.unloads is not False:
            return ""
        return (
            "plates bend back here, which they never do where it was fitted: what they and the friction of the cables "
            "do then is supposed, unseen"
        )


def bending_of(manipulator: Manipulator, angle: np.ndarray, begins: np.ndarray) -> Bending:
    """The largest bending of any plate at any step.

    Parameters
    ----------
    angle : (s, n + 1) angles of the disks, rad; NaN without an equilibrium.
    begins : (s,) whether a step is the first of its sequence.
    """
    arc = manipulator.per_plate(segment.length_m - 2 * segment.clamp_m for segment in manipulator.segment)
    bend = np.diff(angle, axis=1)
    curvature = np.abs(bend) / arc
    strain = np.nanmax(curvature * manipulator.outer_fibre, initial=0.0)
    known = np.isfinite(manipulator.outer_fibre).all()
    return Bending(
        curvature_per_m=float(np.nanmax(curvature, initial=0.0)),
        strain=float(strain) if known else None,
        unloads=bends_back(bend, begins, Settings.side_share * float(np.nanmax(np.abs(bend), initial=0.0))),
    )
