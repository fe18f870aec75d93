"""Friction that changes with load or rate as suspects: laws with a reference, a tension or a rate of the recording, at
which the coefficient is the calibrated one.

Each law has the recordings that can show it, its free parameter with bounds, its sentence, and the same law with
another reference.
"""

import numpy as np

from prb3r.diagnosis.library.hypothesis import Free
from prb3r.diagnosis.library.scope import Place, Scope
from prb3r.diagnosis.library.suspect import Occurrence
from prb3r.model.effects.base import Effect
from prb3r.model.effects.friction import LoadDependentFriction, RateDependentFriction


def load_shows(scope: Scope) -> list[Place]:
    """The place of `load_dependent_friction` where the nominal model has friction, else none: its reference tension, at
    which the coefficient is the calibrated one, is the largest of the recording."""
    pull = float(f"{scope.pull:.3g}")
    return [{"tension_n": pull}] if scope.manipulator.friction.coefficient > 0 else []


def exponent_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `load_dependent_friction`: at most 1, where the friction force does not depend on the load,
    prior sd 0.3, as one elastic contact has a third (Hertz); as far the other way, where cables plough through what is
    softer."""
    return (Free("exponent", 0.0, -1.0, 1.0, sd=0.3),)


def at_tension(effect: Effect, place: Place) -> tuple[Effect, float]:
    """The law of `load_dependent_friction` with the reference tension of another place, and the coefficient there over
    that at its own reference."""
    assert isinstance(effect, LoadDependentFriction)
    factor = (place["tension_n"] / effect.tension_n) ** -effect.exponent
    return effect.model_copy(update=dict(place)), float(factor)


def said_of_load(fitted: Occurrence) -> str:
    tension, falls = fitted.place["tension_n"], fitted.size.value > 0
    how = "falls with the load, as of polymers on metal" if falls else "grows with the load"
    return (
        f"Friction {how}: its coefficient is the calibrated one at {tension} N and goes with the tension as "
        f"(T / {tension} N)^-n, n = {fitted.size}."
    )


def rate_shows(scope: Scope) -> list[Place]:
    """The place of `rate_dependent_friction`, else none: its reference rate, at which friction is the calibrated one,
    is the median of the recording, N/s.

    That takes friction and declared slip in the nominal model, and steps whose times show tensions to change at rates
    `Settings.rates_apart` times apart.
    """
    manipulator, loads = scope.manipulator, scope.recording.loads
    felt = loads.rate[(loads.rate > 0) & (loads.tension > 0)]
    differ = felt.size > 0 and felt.max() > scope.settings.rates_apart * felt.min()
    if not differ or manipulator.friction.coefficient == 0 or manipulator.follows_history:
        return []
    return [{"reference_n_per_s": float(f"{np.median(felt):.3g}")}]


def rate_free(scope: Scope, place: Place) -> tuple[Free, ...]:
    """Free parameter of `rate_dependent_friction`: prior sd 0.05, a few times what rocks and metals show (0.02:
    Dieterich 1972), as polymers creep more."""
    return (Free("rate", 0.0, -0.5, 0.5, sd=0.05),)


def at_rate(effect: Effect, place: Place) -> tuple[Effect, float]:
    """The law of `rate_dependent_friction` with the reference rate of another place, and the coefficient there over
    that at its own reference; its rate is relative to the coefficient at the reference."""
    assert isinstance(effect, RateDependentFriction)
    factor = 1 + effect.rate * float(np.log(place["reference_n_per_s"] / effect.reference_n_per_s))
    if factor <= 0:  # farther from its reference than the law goes
        return effect, 1.0
    return effect.model_copy(update={**place, "rate": effect.rate / factor}), factor


def said_of_rate(fitted: Occurrence) -> str:
    by = "how fast cables are pulled" if fitted.size.value > 0 else "how long cables are held"
    return (
        f"Friction grows with {by}: its coefficient is the calibrated one where the tension changes by "
        f"{fitted.place['reference_n_per_s']} N/s, and differs by {fitted.size.times(100 * np.log(10))} % where it "
        "changes ten times as fast."
    )
