"""The effect of a fitted moment law: moments on the arcs that depend on the state, without a mechanism behind them."""

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from prb3r.mechanics.chain import Chain, Term, no_loads
from prb3r.model.effects.base import Effect, Host, Number, mask_of
from prb3r.model.laws.moment_law import influences_of_place


class MomentTerm(BaseModel):
    """One term of a fitted moment law: `coefficient` times what `of` names, on all (or the named) plates.

    `constant` (1), `position` (-1 at the first plate to 1 at the last) and `time` (step number over the last one of the
    sequence) take N m; `bend` (rad) N m/rad, `bend_cubed` N m/rad^3; the others are multiples of the moment of the
    cables, tension times offset: `tension` of the moment itself, `wrap` (1/rad) of the moment times all bends up to
    the plate, `direction` of the moment signed by the cable's slip.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    of: Literal["constant", "position", "bend", "bend_cubed", "tension", "wrap", "direction", "time"]
    coefficient: Annotated[float, Field(description="Multiple of what the law depends on, in the unit that makes N m.")]
    plates: Annotated[list[Number], Field(min_length=1)] | None = None


class EmpiricalMoment(Effect):
    """A fitted moment law without a mechanism: the sum of its terms bends the arc of each plate."""

    kind: Literal["empirical_moment"]
    terms: Annotated[list[MomentTerm], Field(min_length=1)]

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        constant, closure = chain.constant or no_loads(chain), chain.closure
        for term in self.terms:
            acts = mask_of(term.plates, chain.plates) if term.plates else np.ones(chain.plates)
            if term.of in ("constant", "position"):
                follows = influences_of_place(chain)[term.of]
                constant = constant._replace(moment=constant.moment + term.coefficient * acts * follows)
            else:
                closure = (*closure, Term(term.of, term.coefficient * acts))
        return chain._replace(constant=constant, closure=closure)

    def problems(self, manipulator: Host) -> Iterator[str]:
        for number, term in enumerate(self.terms, 1):
            for plate in term.plates or ():
                if plate > manipulator.plates:
                    yield f"effect {self.kind}: term {number}: there is no plate {plate}, only {manipulator.plates}"
