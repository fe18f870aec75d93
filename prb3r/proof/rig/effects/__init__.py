"""All effects of the independent simulator: one record each, in files by family.

To add an effect, write its record in the file of its family; rig, labels and scores then have it.  There a function
that changes a draft is named by an imperative (`_loosen`), the one that yields the candidates for concealing the effect
by the state it leaves or its participle (`_loose`), and one that draws a shape ends in `_anew`.  Effects act in the
order of `RECORDS`, whatever their order in a manipulator file: coefficients of all holes before that of one, factors of
plates and dead cables before the stiffness that cables add.  Repeated factors multiply; repeated forces, compliances,
clearances, offsets and curvatures add; an effect that a rig can have only once is refused if a file has it twice.
"""

from collections.abc import Mapping

from prb3r.proof.rig.effects.cables import CABLE_RECORDS
from prb3r.proof.rig.effects.camera import CAMERA_RECORDS
from prb3r.proof.rig.effects.empirical import EMPIRICAL_RECORDS
from prb3r.proof.rig.effects.friction import FRICTION_RECORDS
from prb3r.proof.rig.effects.loads import LOAD_RECORDS
from prb3r.proof.rig.effects.plates import PLATE_RECORDS
from prb3r.proof.rig.effects.record import Record
from prb3r.proof.rig.effects.sections import SECTION_RECORDS

RECORDS: Mapping[str, Record] = {
    record.kind: record
    for family in (
        FRICTION_RECORDS,
        PLATE_RECORDS,
        SECTION_RECORDS,
        CABLE_RECORDS,
        LOAD_RECORDS,
        CAMERA_RECORDS,
        EMPIRICAL_RECORDS,
    )
    for record in family
}
"""Records by kind of effect."""
