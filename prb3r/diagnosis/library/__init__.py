"""What could have been left out: every effect of the library at every place where it could sit.

To let the diagnosis suspect a new effect, add its record to the family of its physics; every list follows from that.
"""

from collections.abc import Mapping
from types import MappingProxyType

from prb3r.diagnosis.library.cables import CABLE_SUSPECTS
from prb3r.diagnosis.library.camera import CAMERA_SUSPECTS
from prb3r.diagnosis.library.friction import FRICTION_SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.loads import LOAD_SUSPECTS
from prb3r.diagnosis.library.plates import PLATE_SUSPECTS
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.library.sections import SECTION_SUSPECTS
from prb3r.diagnosis.library.suspect import Suspect

SUSPECT_FAMILIES: Mapping[str, tuple[Suspect, ...]] = MappingProxyType(
    {
        "friction": FRICTION_SUSPECTS,
        "cables": CABLE_SUSPECTS,
        "plates": PLATE_SUSPECTS,
        "sections": SECTION_SUSPECTS,
        "loads": LOAD_SUSPECTS,
        "camera": CAMERA_SUSPECTS,
    }
)
"""Records by the family of their physics, in the order of `prb3r.model.effects`."""
SUSPECTS: Mapping[str, Suspect] = MappingProxyType(
    {suspect.kind: suspect for suspects in SUSPECT_FAMILIES.values() for suspect in suspects}
)
"""The record of every effect by its kind."""


def hypotheses(scope: Scope, without: frozenset[str] = frozenset()) -> tuple[Hypothesis, ...]:
    """Every hypothesis that makes sense for a recording; `without` names kinds to leave out."""
    suspects = (suspect for kind, suspect in SUSPECTS.items() if kind not in without)
    return tuple(hypothesis for suspect in suspects for hypothesis in suspect.hypotheses(scope))
