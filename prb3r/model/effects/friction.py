"""Effects on friction: at holes and at pulleys before the base, its dependence on load, rate, travel and time, and slip
that follows from the load path."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from prb3r.mechanics.chain import Chain
from prb3r.model.effects.base import Effect, Efficiency, Host, columns
from prb3r.model.files.numbers import NonNegative, Positive


class CableFriction(Effect):
    """Belt friction with this coefficient at every hole of all (or the named) cables, in place of the nominal one."""

    kind: Literal["cable_friction"]
    coefficient: NonNegative
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        friction = chain.friction.copy()
        friction[:, columns(self.cables, manipulator)] = self.coefficient
        return chain._replace(friction=friction)


class LoadDependentFriction(Effect):
    """Friction that falls with the load, as of polymers on metal, or, where the exponent is negative, grows with it: at
    every hole the coefficient times (T / `tension_n`)^-`exponent`, where T is the tension of the cable before the
    hole."""

    kind: Literal["load_dependent_friction"]
    once: ClassVar[bool] = True
    exponent: Annotated[float, Field(ge=-1, le=1)]
    tension_n: Annotated[Positive, Field(description="Tension at which the coefficients hold as they are, N.")]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(friction_exponent=self.exponent, friction_tension=self.tension_n)


class RateDependentFriction(Effect):
    """Friction that grows with the rate at which cables are pulled or, where `rate` is negative, with the time for
    which they are held: at every hole the coefficient, and what pulleys take, times 1 + `rate` ln(v /
    `reference_n_per_s`), but at least times 0.05. The rate v is the change of a cable's tension since the step before,
    at least 0.1 N, over the time between both (column `time_s`); at the first step of a sequence the factor is 1. With
    declared slip only."""

    kind: Literal["rate_dependent_friction"]
    once: ClassVar[bool] = True
    needs_times: ClassVar[bool] = True
    goes_by_time: ClassVar[bool] = True
    instead_of: ClassVar[frozenset[str]] = frozenset({"slip_history"})
    rate: Annotated[
        float, Field(ge=-0.5, le=0.5, description="Change of friction, relative, where v is e times as large.")
    ]
    reference_n_per_s: Annotated[Positive, Field(description="v at which the coefficients hold as they are, N/s.")] = (
        1.0
    )

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(friction_rate=self.rate, friction_reference=self.reference_n_per_s)

    def problems(self, manipulator: Host) -> Iterator[str]:
        yield from super().problems(manipulator)
        yield from _declared_only(self.kind, manipulator)


class BreakawayFriction(Effect):
    """Static friction above the kinetic one, which is lost as the cable slips: at every hole the coefficient, and what
    pulleys take, times 1 + `excess` exp(-s / `decay_n`). Here s is the change of the cable's tension since it began to
    slip in its direction: since the beginning of the sequence, since slip was last declared in the other direction, or
    since the cable was slack. With declared slip only."""

    kind: Literal["breakaway_friction"]
    once: ClassVar[bool] = True
    instead_of: ClassVar[frozenset[str]] = frozenset({"slip_history"})
    excess: Annotated[NonNegative, Field(description="Static over kinetic friction, less one.")]
    decay_n: Annotated[
        Positive, Field(description="Change of the tension over which the excess falls to 1/e of itself, N.")
    ]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(friction_excess=self.excess, friction_decay=self.decay_n)

    def problems(self, manipulator: Host) -> Iterator[str]:
        yield from super().problems(manipulator)
        yield from _declared_only(self.kind, manipulator)


class FrictionDrift(Effect):
    """Friction that grows as cables and holes wear or lose their grease or, where the share is negative, falls as they
    run in: at each step the coefficients, and what pulleys take, are those of the first step times 1 plus this share
    for every step of the table before, but at least times 0.05. With declared slip only."""

    kind: Literal["friction_drift"]
    goes_by_time: ClassVar[bool] = True
    instead_of: ClassVar[frozenset[str]] = frozenset({"slip_history"})
    share_per_step: Annotated[
        float, Field(ge=-1, le=1, description="Growth with every step, as a share of the first step's; negative: less.")
    ]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(friction_drift=chain.friction_drift + self.share_per_step)

    def problems(self, manipulator: Host) -> Iterator[str]:
        yield from super().problems(manipulator)
        yield from _declared_only(self.kind, manipulator)


def _declared_only(kind: str, manipulator: Host) -> Iterator[str]:
    """A message that the effect `kind` needs declared slip, if slip of the manipulator follows from the load path."""
    if manipulator.friction.direction == "history":
        yield f'effect {kind}: goes with declared slip, not with direction = "history"'


class WrapSaturation(Effect):
    """Friction that saturates with the wrap angle, as of cables so stiff that they do not lie against their holes over
    all of a turn: of every turn t at a hole only t / (1 + `saturation_per_rad` t) counts."""

    kind: Literal["wrap_saturation"]
    once: ClassVar[bool] = True
    saturation_per_rad: Annotated[
        NonNegative, Field(description="By how much less each radian of a turn counts, 1/rad.")
    ]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(wrap_saturation=self.saturation_per_rad)


class HoleDrag(Effect):
    """A drag in every hole that does not grow with the tension, as of a seal, a lining or a cable that is bent to and
    fro: where a cable is drawn in, its tension falls by `drag_n` at every hole, and where it is paid out it grows by
    that. Below 1.4 `drag_n` the tension of a cable that is drawn in falls smoothly to nearly nothing, and that of a
    slack one that is paid out grows threefold at most. It goes with the slip of the hole as belt friction does, and
    what changes that with rate, travel or time changes the drag alike."""

    kind: Literal["hole_drag"]
    drag_n: Annotated[NonNegative, Field(description="Force that each hole takes of a large tension, N.")]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(hole_drag=chain.hole_drag + self.drag_n)


class PulleyFriction(Effect):
    """A pulley before the base hole, of all (or the named) cables: behind it the tension is multiplied by `efficiency`
    where the cable is drawn in, and divided by it where it is paid out."""

    kind: Literal["pulley_friction"]
    efficiency: Efficiency
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        pulley = np.ones(len(chain.reach)) * chain.pulley
        pulley[columns(self.cables, manipulator)] *= self.efficiency
        return chain._replace(pulley=pulley)


class SlipHistory(Effect):
    """Slip follows from the load path instead of being declared; friction builds up over `presliding_m` of travel."""

    kind: Literal["slip_history"]
    once: ClassVar[bool] = True
    follows_history: ClassVar[bool] = True
    presliding_m: Annotated[float, Field(ge=1e-7, le=0.1)]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(presliding=self.presliding_m)


class WornHole(Effect):
    """Another friction coefficient at one disk (0 is the base), of all (or the named) cables."""

    kind: Literal["worn_hole"]
    late: ClassVar[int] = 1
    disk: Annotated[int, Field(ge=0, description="Number of the disk, 0 at the base.")]
    coefficient: NonNegative
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        friction = chain.friction.copy()
        friction[self.disk, columns(self.cables, manipulator)] = self.coefficient
        return chain._replace(friction=friction)


class EdgeWrap(Effect):
    """Belt friction counted at both edges of every hole, where the nominal model counts the net turn."""

    kind: Literal["edge_wrap"]
    once: ClassVar[bool] = True

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(edges=True)
