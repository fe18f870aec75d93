"""The library of effects that a model may lack: every effect at every place where it could sit in a recording.

To let the diagnosis suspect a new effect, add a `Suspect` to the tuple of its family; all lists here follow from that.
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
"""Suspects by family, in the order of `prb3r.model.effects`."""
SUSPECTS: Mapping[str, Suspect] = MappingProxyType(
    {suspect.kind: suspect for suspects in SUSPECT_FAMILIES.values() for suspect in suspects}
)
"""The suspect of every effect, by the kind of the effect."""


def hypotheses(scope: Scope, without: frozenset[str] = frozenset()) -> tuple[Hypothesis, ...]:
    """All hypotheses that make sense for the recording of `scope`, but for the kinds named in `without`."""
    suspects = (suspect for kind, suspect in SUSPECTS.items() if kind not in without)
    return tuple(hypothesis for suspect in suspects for hypothesis in suspect.hypotheses(scope))
