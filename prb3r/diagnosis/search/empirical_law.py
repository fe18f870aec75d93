"""An empirical law of what is left unexplained: a sum of few moments on the plates that follow the state, fitted inside
the equilibrium.

It names a dependence, not a mechanism, and a term is kept only if whole sequences left out are predicted better.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from prb3r.diagnosis.evidence.missing_moments import Mechanism, MomentPattern, law_alternatives, laws, mechanism
from prb3r.diagnosis.evidence.model_evidence import bic, improves_left_out
from prb3r.diagnosis.evidence.score_test import scores
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.library.hypothesis import Free, Hypothesis
from prb3r.diagnosis.settings import Settings
from prb3r.model.effects.base import Effect
from prb3r.model.effects.empirical import EmpiricalMoment, MomentTerm

MEANT = {
    "constant": "1",
    "position": "-1 at the first plate to 1 at the last",
    "time": "step number over the last of its sequence",
    "bend": "bend of the plate, rad",
    "bend_cubed": "cube of the bend of the plate, rad^3",
    "tension": "moment of the cables, tensions times offsets",
    "wrap": "moment of the cables times all bends up to the plate",
    "direction": "moment of the cables, each signed by its slip",
}
"""In words: the quantities that the coefficients of a law are multiplied by."""


@dataclass(frozen=True)
class EmpiricalLaw(Hypothesis):
    """An `empirical_moment` as a hypothesis: `place` holds quantity and plate (None: all) of each term, and the free
    parameters are the coefficients of the terms."""

    def effect(self, u: np.ndarray, friction: float) -> Effect:
        terms = []
        for free, size, (of, plate) in zip(self.free, u, self.place, strict=True):
            plates = [plate] if plate else None
            terms.append(MomentTerm(of=of, coefficient=free.value(size), plates=plates))  # type: ignore[arg-type]
        return EmpiricalMoment(kind="empirical_moment", terms=terms)

    @property
    def name(self) -> str:
        return "empirical moment: " + ", ".join(f"{of} at plate {at}" if at else of for of, at in self.place)


@dataclass(frozen=True, eq=False)
class Closure:
    """A fitted empirical law of the missing moments."""

    fitted: Fit
    """The model with the law."""
    effect: EmpiricalMoment
    """The law."""
    statement: str
    """A sentence on it."""


UNITS = {"constant": "N m", "position": "N m", "time": "N m", "bend": "N m/rad", "bend_cubed": "N m/rad^3"}
"""Of the coefficients by quantity; those not listed are pure numbers, as they multiply a moment."""


def _free(law: MomentPattern, mechanics: Mechanism, number: int, settings: Settings) -> Free:
    """The coefficient of term `number`; u = 1 makes its largest moment `Settings.term_share` of that of the cables."""
    largest = float(np.abs(law.values).max()) or 1.0
    pull = float(np.abs(mechanics.pull).max(initial=0.0)) or 1.0  # N m, without cables
    scale = settings.term_share * pull / largest
    farthest = settings.farthest_term * scale
    return Free(f"coefficient_{number}", 0.0, -farthest, farthest, scale=scale)


def close(best: Fit, seed: int) -> Closure | None:
    """The empirical law of what the model `best` leaves; None where no term is kept.

    The term with the largest score is added as long as that score is beyond chance, the Bayesian information criterion
    falls by `Settings.bic_fall`, and whole sequences left out are predicted better.

    Parameters
    ----------
    seed : of the draws that tell how large a score is by chance.
    """
    current, base, settings = best, best, best.model.settings
    terms: tuple[tuple[str, int | None], ...] = ()
    frees: tuple[Free, ...] = ()
    for number in range(1, settings.most_terms + 1):
        mechanics = mechanism(current)
        usable = [law for law in laws(current, mechanics) if law.values.ndim == 2 and law.of in mechanics.influences]
        usable = [law for law in usable if law.values.any() and _is_term(law, mechanics)]
        tested = scores(current, law_alternatives(current, mechanics, usable), seed)
        best_first = (tested.alternatives[k].subject for k in tested.best())
        new = next((law for law in best_first if _key(law) not in terms), None)
        if new is None or tested.largest <= tested.threshold:
            break
        terms, frees = (*terms, _key(new)), (*frees, _free(new, mechanics, number, settings))
        start = np.concatenate([current.p, [0.0]])
        richer = fit(base.model.adding(EmpiricalLaw("empirical_moment", terms, frees)), start)
        if richer is None or bic(current) - bic(richer) < settings.bic_fall or not improves_left_out(current, richer):
            break
        current = richer
    if current is base:
        return None
    law = current.effects[-1]
    assert isinstance(law, EmpiricalMoment)
    return Closure(current, law, statement(law))


def _key(law: MomentPattern) -> tuple[str, int | None]:
    """Quantity and plate of a term; None: all plates."""
    return law.of, law.plate


def _is_term(law: MomentPattern, mechanics: Mechanism) -> bool:
    """Whether a single term of an `empirical_moment` gives the same moments as a pattern."""
    values = mechanics.influences[law.of]
    plates = np.ones(values.shape[1], bool) if law.plate is None else np.arange(values.shape[1]) + 1 == law.plate
    return bool(np.array_equal(law.values, values * plates))


def statement(law: EmpiricalMoment) -> str:
    """A sentence on a fitted law that claims no mechanism."""
    parts: Sequence[str] = [
        f"{term.coefficient:.3g} {UNITS.get(term.of, '')} x {term.of}".replace("  ", " ")
        + (f" on plate {term.plates[0]}" if term.plates else " on every plate")
        for term in law.terms
    ]
    meant = "; ".join(f"{of}: {MEANT[of]}" for of in dict.fromkeys(term.of for term in law.terms))
    return (
        f"As an empirical law, without a mechanism, a missing moment of {' plus '.join(parts)} describes what is left "
        f"({meant})."
    )
