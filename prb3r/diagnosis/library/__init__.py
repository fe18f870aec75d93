"""What could have been left out: every effect of the library at every place where it could sit.

To let the diagnosis suspect a new effect, add its record to the family of its physics; every list follows from that.
"""

from collections.abc import Mapping
from types import MappingProxyType

from prb3r.diagnosis.library import cables, camera, friction, loads, plates
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.library.suspect import Suspect

FAMILIES = (friction, cables, plates, loads, camera)
SUSPECTS: Mapping[str, Suspect] = MappingProxyType(
    {suspect.kind: suspect for family in FAMILIES for suspect in family.SUSPECTS}
)
"""The record of every effect by its kind."""


def hypotheses(scope: Scope, without: frozenset[str] = frozenset()) -> tuple[Hypothesis, ...]:
    """Every hypothesis that makes sense for a recording; `without` names kinds to leave out."""
    suspects = (suspect for kind, suspect in SUSPECTS.items() if kind not in without)
    return tuple(hypothesis for suspect in suspects for hypothesis in suspect.hypotheses(scope))
