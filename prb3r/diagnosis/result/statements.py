"""Sentences on named effects, such that a mechanical engineer can act upon them."""

from collections.abc import Mapping

from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library import SUSPECTS
from prb3r.diagnosis.library.suspect import Estimate, Occurrence
from prb3r.diagnosis.library.totals import total_with_others

IN_WORDS: Mapping[str, tuple[str, float, str]] = {
    "youngs_modulus_pa": ("Young's modulus", 1e-9, " GPa"),
    "friction_coefficient": ("the friction coefficient", 1.0, ""),
    "knee_strain": ("the strain at the knee", 100.0, " %"),
    "plateau_strain": ("the strain at the plateau", 100.0, " %"),
    "presliding_m": ("the presliding travel", 1e6, " micrometres"),
}
"""For some parameters their name in words, and the factor and the unit in which people read them; others go by their
names, in SI units."""


def sentence(fitted: Fit, number: int, estimates: Mapping[str, Estimate]) -> str:
    """The sentence on the effect at `number`, from 0, of a model, with its fitted parameters.

    It also tells what the effect makes together with the other effects of the model and of the manipulator file.
    """
    hypothesis, nominal = fitted.model.hypotheses[number], fitted.recording.manipulator
    suspect, total = SUSPECTS[hypothesis.kind], None
    if suspect.quantity:
        there = [*fitted.effects[:number], *fitted.effects[number + 1 :], *nominal.effect]
        alike = {kind for kind, other in SUSPECTS.items() if other.quantity is suspect.quantity}
        others = [effect for effect in there if effect.kind in alike]
        effect = fitted.effects[number]
        total = total_with_others(suspect.quantity, effect, others, nominal.plain_chain(), nominal)
    friction = fitted.model.friction(fitted.p)
    return suspect.sentence(Occurrence(dict(hypothesis.place), estimates, friction, total))
