"""The chains of one rig for given constants and effects, made from the chain before as far as both agree."""

from collections.abc import Sequence
from operator import attrgetter

import numpy as np

from prb3r.diagnosis.fit.constants import Constants
from prb3r.mechanics.chain import Chain
from prb3r.model.effects.base import CachedHost, Effect, Host


class Chains:
    """Makes chains of a rig, and reuses the last one up to the first effect that differs.

    Derivatives ask for a chain on either side of every parameter, and most parameters change one effect only.
    """

    def __init__(self, plain: Chain, manipulator: Host) -> None:
        self._plain, self._host = plain, CachedHost(manipulator)
        self._scales: tuple[float, float] | None = None
        self._made: list[tuple[Effect | None, Chain]] = []  # the last chain: without effects, with the first, and so on

    def chain(self, constants: Constants, effects: Sequence[Effect] = ()) -> Chain:
        """The chain with adjusted constants, the nominal effects and `effects`."""
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
