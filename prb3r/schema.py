"""JSON Schemas of the TOML files, for editors: every field with its unit and meaning."""

from typing import Any

from pydantic import BaseModel

from prb3r.model.manipulator import Manipulator
from prb3r.quantities import describe, unit_ending
from prb3r.recording.recording import RecordingFile
from prb3r.study.spec import Study

FILES: dict[str, type[BaseModel]] = {"study": Study, "manipulator": Manipulator, "recording": RecordingFile}

MEANINGS = {
    "angle_rad": "Bend of a plate, difference of its disks' angles, from which on the disks touch, rad.",
    "better": "Whether more of it is wanted, or less.",
    "broken": "Names of the cables that carry nothing.",
    "cable": "Name of the cable that it is about.",
    "cables": "Names of the cables that it is about; absent: all.",
    "caption": "Text below the figure.",
    "clearance_m": "How far a cable can move in its holes to the inner side, m.",
    "coefficient": "Friction force over normal force.",
    "comparison": "Columns that compare a case with another one.",
    "compliance_rad_per_n_m": "Turn of the clamp per moment on it, rad per N m.",
    "cubic_m2": "c of the cubic law M = EI k (1 + c k^2), m^2.",
    "curvature_per_m": "Curvature of the arc without stress, 1/m.",
    "disk": "Number of the disk, 0 at the base, or tip.",
    "efficiency": "Share that is passed on.",
    "elements": "Jenkin elements that share the stiffness that slips; absent: one.",
    "factor": "What the bending stiffness is multiplied by.",
    "frame_position_sd_m": "Standard deviation of the frame's origin, m; 0: known.",
    "geomspace": "Values with equal ratios from one end to the other.",
    "high": "Upper end.",
    "image_centre_m": "Centre of the image that lens distortion is about, x and y, m.",
    "k1_per_m2": "k1 of measured = c + (p - c)(1 + k1 r^2), 1/m^2.",
    "knee_per_m": "Curvature from which on a plate is softer, 1/m.",
    "knee_strain": "Instead of knee_per_m: strain of the outermost fibre from which on a plate is softer.",
    "law": "Form of the law between moment and curvature.",
    "level": "Named alternatives.",
    "linspace": "Values with equal differences from one end to the other.",
    "low": "Lower end.",
    "measurement": "How exactly was measured: standard deviations.",
    "at_least": "The requirement holds from this value on, in the unit of its column.",
    "at_most": "The requirement holds up to this value, in the unit of its column.",
    "designs": "What tells designs apart.",
    "factors": "Names of the factors that tell designs apart; none: one design.",
    "model": "How plates bend, instead of what the manipulator file says.",
    "of": "What the law depends on.",
    "offset_m": "Error of the cable's offset, added to it, m.",
    "gain": "True over recorded tension, of small ones.",
    "quadratic_per_n": "How the gain grows with the recorded tension, relative, 1/N.",
    "exponent": "Power of the tension by which friction falls.",
    "share_per_step": "Share of the first step's stiffness that every step takes; negative: adds.",
    "offset_n": "Added to the applied tension, N.",
    "offset_n_per_step": "Added to the applied tension for every step before, N a step.",
    "plate": "Number of the plate, 1 at the base.",
    "plates": "Numbers of the plates that it is about; absent: all.",
    "play_n": "By how much the tension may lag behind the recorded one, either way, N.",
    "plot": "Figures, each written as PNG and SVG.",
    "position_sd_m": "Standard deviation of a position as read, m.",
    "presliding_m": "Travel of a cable over which friction builds up, m.",
    "prior": "Independent knowledge of the constants.",
    "question": "What the study is to answer, for its report.",
    "ratio": "Tangent stiffness beyond the knee over that before it.",
    "sampling": "How factors with a range are sampled.",
    "reverse_ratio": "Stress at which a superelastic material turns back over that at which it yields.",
    "scale": "Measured over true lengths, about the base origin.",
    "sections": "similar: sections of one shape, where no fibre is known: stiffer plates yield at less curvature.",
    "segment": "Number of the segment, 1 at the base.",
    "sharpness": "How sharp the knee of the smooth law is, R; the bilinear law has the sharpest.",
    "slipping_share": "Share of the plates' stiffness that slips.",
    "sharing": "What the rig has in common with those that it is diagnosed together with.",
    "side": "Toward which offsets plates must bend for it; absent: both.",
    "states": "Equilibria that are kept: none, those of last steps (final), or of all steps (path).",
    "stiffness_n_m2": "Bending stiffness that each cable adds to the plates it runs through, N m^2.",
    "stiffness_n_m_per_rad": "Stiffness of the contact, N m per rad.",
    "terms": "Terms of the fitted law, which add up.",
    "through_origin": "Whether the line goes through zero.",
    "title": "Heading of the report.",
    "tolerance": "How exactly the rig was made: standard deviations of its own geometry.",
    "up_to": "Factor on the loads up to which they are grown.",
    "up_to_n": "Largest tension that is tried, N.",
    "values": "The values one by one.",
    "cloud": "Many independent loads on every case, instead of steps.",
    "x_m_s2": "In-plane gravity along the straight manipulator, m/s^2.",
    "x_n": "Force along the straight manipulator, N.",
    "x_unit": "Unit along x, such as mm or deg, instead of the one people read at this size.",
    "y_m_s2": "In-plane gravity toward positive offsets, m/s^2.",
    "y_n": "Force toward positive offsets, N.",
    "y_unit": "Unit along y, such as mm or deg, instead of the one people read at this size.",
    "yield_per_m": "Curvature from which on that share slips, on average over the elements, 1/m.",
    "yield_strain": "Instead of yield_per_m: strain of the outermost fibre from which on that share slips, on average.",
    "youngs_modulus": "Relative standard deviation of Young's modulus; absent: unknown.",
    "friction_coefficient": "Relative standard deviation of the friction coefficient; absent: unknown.",
}
"""Descriptions of fields whose classes do not describe them, by name.  Each holds in every class that has such a field;
where a name means something else, the class says what."""


def schema_of(file: str) -> dict[str, Any]:
    """JSON Schema of a `study`, a `manipulator` or a `recording` file, without the Python examples of its classes."""
    schema = FILES[file].model_json_schema()
    for part in (schema, *schema.get("$defs", {}).values()):
        if "description" in part:
            part["description"] = part["description"].partition("\n\nExamples\n")[0]
        for name, field in part.get("properties", {}).items():
            if "description" not in field:
                field["description"] = _meaning(name, part)
    return schema


def _meaning(name: str, part: dict[str, Any]) -> str:
    """Description of a field that has none; `part` is the schema of its class, which describes the field `kind`."""
    if name == "kind":
        return part.get("description", "").split("\n\n")[0] or "What it is."
    known = describe(name)
    return MEANINGS.get(name) or (f"{known.meaning}, {known.unit}." if unit_ending(name) else "")
