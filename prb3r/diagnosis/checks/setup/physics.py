"""Physics that imitates blunders: what a dead cable or heavy friction explains, no blunder is said of."""

from collections.abc import Iterator, Sequence

from prb3r.model.effects.base import Effect
from prb3r.model.effects.cables import DeadCable
from prb3r.model.effects.friction import PulleyFriction, SlipHistory
from prb3r.recording.recording import Recording

PULLEYS, LAGS = (0.9, 0.8, 0.65), (3e-5, 3e-4)
"""Coarse sizes of friction at the base (share that arrives) and of travel until friction has turned, m: the range that
`diagnosis.library` allows, a factor apart that leaves less than the half of either."""


def imitations(recording: Recording, already: Sequence[Effect] = ()) -> Iterator[Effect]:
    """Effects beside those `already` there that change pictures as much as a blunder does."""
    manipulator, kinds = recording.manipulator, {type(effect) for effect in already}
    dead = {effect.cable for effect in already if isinstance(effect, DeadCable)}
    for name, column in zip(manipulator.cable_names, recording.loads.tension.T, strict=True):
        if name not in dead and (column > 0).any():
            yield DeadCable(kind="dead_cable", cable=name)
    if PulleyFriction not in kinds:
        for efficiency in PULLEYS:
            yield PulleyFriction(kind="pulley_friction", efficiency=efficiency)
    if SlipHistory not in kinds and not manipulator.follows_history and manipulator.friction.coefficient > 0:
        for presliding in LAGS:
            yield SlipHistory(kind="slip_history", presliding_m=presliding)
