"""Every effect on the independent side of the wall: one record each, in files by family.

To add an effect, write its record in the file of its family; rig, labels and scores then have it.  Effects act in the
order of `RECORDS`, whatever their order in a manipulator file: coefficients of all holes before that of one, factors of
plates and dead cables before the stiffness that cables add.  Repeated factors multiply; repeated forces, compliances,
clearances, offsets and curvatures add; what a rig can have only once is refused if it stands there twice.
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
"""By kind."""
