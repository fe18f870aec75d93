"""What a named effect means, in a sentence that a mechanical engineer can act upon."""

from collections.abc import Mapping

from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.suspect import Estimate, Occurrence


def sentence(hypothesis: Hypothesis, estimates: Mapping[str, Estimate], friction: float = 0.0) -> str:
    """One sentence on an effect with its fitted parameters, beside a calibrated coefficient of `friction`."""
    return SUSPECTS[hypothesis.kind].sentence(Occurrence(dict(hypothesis.place), estimates, friction))
