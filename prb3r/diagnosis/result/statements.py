"""What a found effect means, in a sentence that a mechanical engineer can act upon."""

from collections.abc import Mapping
from typing import NamedTuple

from prb3r.diagnosis.library.hypothesis import Hypothesis


class Estimate(NamedTuple):
    """A fitted parameter; without an interval where the fit does not deserve one."""

    value: float
    low: float | None = None
    high: float | None = None

    def __format__(self, form: str) -> str:
        """With a number format: value (low to high); a trailing `%`-style scale is not supported."""
        form = form or ".3g"
        if self.low is None or self.high is None:
            return f"{self.value:{form}}"
        return f"{self.value:{form}} ({self.low:{form}} to {self.high:{form}})"

    def times(self, factor: float) -> "Estimate":
        return Estimate(*(None if each is None else factor * each for each in self))  # type: ignore[arg-type]

    def less(self, whole: float) -> "Estimate":
        """whole - value."""
        low, high = (None if each is None else whole - each for each in (self.high, self.low))
        return Estimate(whole - self.value, low, high)


def sentence(hypothesis: Hypothesis, found: Mapping[str, Estimate], nominal_friction: float = 0.0) -> str:
    """One sentence on an effect of the library with its fitted parameters."""
    place = dict(hypothesis.place)
    cables = place.get("cables")
    of_cables = f"cable {', '.join(cables)}" if cables else "all cables"
    value = next(iter(found.values()), Estimate(0.0))
    millimetres = value.times(1e3)
    match hypothesis.kind:
        case "cable_friction":
            return (
                f"The cables rub in their holes with a coefficient of {value}, where the nominal model has no friction."
            )
        case "pulley_friction":
            loss = value.less(1.0).times(100)
            return (
                f"The pulley (or sheath) of {of_cables} takes {loss:.3g} % of the tension before it reaches the base."
            )
        case "slip_history":
            return (
                "The cables stick and slip with the load history: friction builds up over "
                f"{value.times(1e6):.3g} micrometres of travel instead of turning at once as declared."
            )
        case "worn_hole":
            at = f" for {of_cables}" if cables else ""
            where = f"disk {place['disk']}" if place["disk"] else "the base disk"
            more = "more" if value.value > nominal_friction else "less"
            return f"The holes of {where} rub {more} than the others{at}: friction coefficient {value}."
        case "edge_wrap":
            return "The cables rub at both edges of every hole, by the turn at each, not by the net turn of the cable."
        case "dead_cable":
            return f"Cable {place['cable']} transmits nothing: broken, slipped off or never tied."
        case "tension_offset":
            return f"The tension of {of_cables} is off by {value} N at every step: check the zero of the force sensor."
        case "hole_offset":
            return f"Cable {place['cable']} runs {millimetres} mm off its nominal offset (added to the signed offset)."
        case "hole_clearance":
            return f"The cables have play in their holes and lie {millimetres} mm toward the inner side of the bend."
        case "weakened_plate":
            look = "look for a crack, a loose clamp, a wrong plate"
            return f"Plate {place['plate']} bends as if its stiffness were {value} of nominal: {look}."
        case "segment_stiffness":
            return (
                f"The plates of segment {place['segment']} are {value} times as stiff as those of the others suggest."
            )
        case "nonlinear_plate" if place["law"] == "cubic":
            return f"The plates stiffen as they bend: M = EI k (1 + c k^2) with c = {value} m^2."
        case "nonlinear_plate":
            knee, ratio = found["knee_per_m"], found["ratio"]
            how = "soften (yield)" if ratio.value < 1 else "stiffen (touch)"
            return f"The plates {how} beyond a curvature of {knee} 1/m, to {ratio} of their stiffness."
        case "precurvature":
            plates = place.get("plates")
            which = "All plates are" if not plates else f"Plate {plates[0]} is" if len(plates) == 1 else ""
            which = which or f"Plates {plates[0]} to {plates[-1]} are"  # type: ignore[index]
            return f"{which} bent before any load: stress-free curvature {value} 1/m."
        case "disk_contact":
            angle, stiffness = found["angle_rad"], found["stiffness_n_m_per_rad"]
            return f"Neighbouring disks touch beyond a bend of {angle} rad and then add {stiffness} N m/rad."
        case "clamp_compliance":
            return f"The clamps give way: a hinge of {value} rad/(N m) at each end of every plate."
        case "cable_bending":
            return f"The cables themselves resist bending, each with {value} N m^2."
        case "gravity":
            return f"Gravity acts in the plane: ({found['x_m_s2']}, {found['y_m_s2']}) m/s^2 on every disk's mass."
        case "tip_force":
            return f"An unrecorded force of ({found['x_n']}, {found['y_n']}) N acts at the tip."
        case "tip_load_friction":
            return f"Of the recorded tip load only {value.times(100)} % arrives: friction in its guide or pulley."
        case "camera_scale":
            return f"The camera's scale is off: measured lengths are {value:.5g} times the true ones."
        case "lens_distortion":
            return f"The lens distorts: k1 = {value} 1/m^2 about the image centre."
        case _:
            values = ", ".join(f"{name} = {each}" for name, each in found.items())
            return f"{hypothesis.name}: {values}."
