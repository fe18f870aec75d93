"""Chains of one rig with constants and effects, of which most differ by little from the one made before."""

from collections.abc import Sequence
from operator import attrgetter

import numpy as np

from prb3r.diagnosis.fit.constants import Constants
from prb3r.mechanics.chain import Chain
from prb3r.model.effects.base import CachedHost, Effect, Host


class Chains:
    """Makes chains of a rig; what the last one has in common with the next, effects in their order, is not made again.

    Derivatives ask for a chain on either side of every parameter, and a parameter changes one effect.
    """

    def __init__(self, plain: Chain, manipulator: Host) -> None:
        self._plain, self._host = plain, CachedHost(manipulator)
        self._scales: tuple[float, float] | None = None
        self._made: list[tuple[Effect | None, Chain]] = []  # the last one: without effects, with the first, and so on

    def chain(self, constants: Constants, effects: Sequence[Effect] = ()) -> Chain:
        """The mechanical problem with adjusted constants, the nominal effects and `effects`."""
        scales = constants.log_stiffness, constants.log_friction
        if scales != self._scales:
            stiffness, friction = np.exp(scales)
            scaled = self._plain._replace(
                stiffness=self._plain.stiffness * stiffness, friction=self._plain.friction * friction
            )
            self._scales, self._made = scales, [(None, scaled)]
        ordered = sorted([*self._host.effect, *effects], key=attrgetter("late"))
        same = 1
        while same < len(self._made) and same <= len(ordered) and self._made[same][0] is ordered[same - 1]:
            same += 1
        del self._made[same:]
        for effect in ordered[same - 1 :]:
            self._made.append((effect, effect.change(self._made[-1][1], self._host)))
        return self._made[-1][1]
