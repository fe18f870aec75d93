"""Effects on cables: the tension that they carry for the recorded one, and the place of their holes."""

from typing import ClassVar, Literal

import numpy as np

from prb3r.mechanics.chain import Chain, no_loads
from prb3r.model.effects.base import Effect, Host, columns
from prb3r.model.files.numbers import NonNegative, Positive
from prb3r.model.files.plausible import Clearance, HoleShift


def _added(known: np.ndarray | float, by: float, cables: list[str] | None, manipulator: Host) -> np.ndarray:
    """(m,) a parameter of each cable: its value `known` so far, and `by` more for the named cables (None: for all)."""
    out = np.zeros(len(manipulator.cable_names)) + known
    out[columns(cables, manipulator)] += by
    return out


class DeadCable(Effect):
    """A cable that transmits nothing."""

    kind: Literal["dead_cable"]
    cable: str

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        reach = chain.reach.copy()
        reach[manipulator.cable_names.index(self.cable)] = 0
        return chain._replace(reach=reach)


class TensionOffset(Effect):
    """A force that is added to the applied tension of all (or the named) cables, idle ones too; no tension falls below
    zero."""

    kind: Literal["tension_offset"]
    offset_n: float
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        constant = chain.constant or no_loads(chain)
        tension = constant.tension.copy()
        tension[0, columns(self.cables, manipulator)] += self.offset_n
        return chain._replace(constant=constant._replace(tension=tension))


class Hanger(Effect):
    """A hanger or pan that was not weighed with the weights: a force that is added to the tension of all (or the named)
    cables wherever one is noted; idle cables stay idle."""

    kind: Literal["hanger"]
    weight_n: NonNegative
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(hanger=_added(chain.hanger, self.weight_n, self.cables, manipulator))


class LoadCell(Effect):
    """A load cell that reads wrong: the true tension is `gain` x T (1 + `quadratic_per_n` x T) for a recorded T, of all
    (or the named) cables."""

    kind: Literal["load_cell"]
    gain: Positive = 1.0
    quadratic_per_n: float = 0.0
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        read_by = columns(self.cables, manipulator)
        gain, quadratic = (np.ones(len(chain.reach)) * factor for factor in (chain.gain, chain.quadratic))
        gain[read_by] *= self.gain
        quadratic[read_by] += self.quadratic_per_n
        return chain._replace(gain=gain, quadratic=quadratic)


class TensionPlay(Effect):
    """The tension of all (or the named) cables lags behind the recorded one, as of a load cell with play or of a guide
    that drags with a constant force: it stays as long as the recorded one is within `play_n` of it, and is dragged
    along beyond. So it is `play_n` too small as a cable is pulled and `play_n` too large as it is let go, and the first
    2 `play_n` of every reversal change nothing. At the beginning of a sequence it is zero."""

    kind: Literal["tension_play"]
    play_n: NonNegative
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(play=_added(chain.play, self.play_n, self.cables, manipulator))


class TensionDrift(Effect):
    """The zero of load cells drifts: for every step of the table before, this is added to the applied tension of all
    (or the named) cables, idle ones too; no tension falls below zero."""

    kind: Literal["tension_drift"]
    goes_by_time: ClassVar[bool] = True
    offset_n_per_step: float
    cables: list[str] | None = None

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(zero_drift=_added(chain.zero_drift, self.offset_n_per_step, self.cables, manipulator))


class HoleOffset(Effect):
    """Error of a cable's offset, added to it over every plate."""

    kind: Literal["hole_offset"]
    cable: str
    offset_m: HoleShift

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        offset = chain.offset.copy()
        offset[:, manipulator.cable_names.index(self.cable)] += self.offset_m
        return chain._replace(offset=offset)


class HoleClearance(Effect):
    """Cables lie against the inner (concave) side of their holes: both ends of a plate's span move by the clearance,
    times tanh(bend / 0.005 rad) of that plate."""

    kind: Literal["hole_clearance"]
    clearance_m: Clearance

    def change(self, chain: Chain, manipulator: Host) -> Chain:
        return chain._replace(clearance=chain.clearance + self.clearance_m)
