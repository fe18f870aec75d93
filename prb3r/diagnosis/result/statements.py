"""Sentences on named effects, such that a mechanical engineer can act upon them."""

from collections.abc import Mapping

from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.hypothesis import Hypothesis
from prb3r.diagnosis.library.suspect import Estimate, Occurrence

IN_WORDS: Mapping[str, tuple[str, float, str]] = {
    "youngs_modulus_pa": ("Young's modulus", 1e-9, " GPa"),
    "friction_coefficient": ("the friction coefficient", 1.0, ""),
    "knee_strain": ("the strain at the knee", 100.0, " %"),
    "plateau_strain": ("the strain at the plateau", 100.0, " %"),
    "presliding_m": ("the presliding travel", 1e6, " micrometres"),
}
"""For some parameters their name in words, and the factor and the unit in which people read them; others go by their
names, in SI units."""


def sentence(hypothesis: Hypothesis, estimates: Mapping[str, Estimate], friction: float = 0.0) -> str:
    """The sentence on an effect with its fitted parameters; `friction` is the calibrated coefficient beside it."""
    return SUSPECTS[hypothesis.kind].sentence(Occurrence(dict(hypothesis.place), estimates, friction))
