"""The truth of every recording: what acts on it, how large it is, and what could be told apart."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from prb3r.proof.settings import SETTINGS

AWKWARD = ("missing", "outliers", "heavy", "uniform", "scatter", "frame")
"""Ways in which a recording can be awkward: readings missing, gross outliers, heavy-tailed or uniform noise, tensions
that scatter more, a frame at the edge of what is stated."""


@dataclass(frozen=True)
class Request:
    """A recording that is to be made."""

    case: int
    seed: int
    cls: str
    """One of the classes of the population."""
    design: int
    kind: str = ""
    """Of effect, foreign law or decoy; empty: any."""
    multiple: float = 0.0
    """Size in smallest detectable sizes."""


@dataclass(frozen=True)
class Label:
    """What the diagnosis must not know."""

    case: int
    cls: str
    design: int
    noise_seed: int
    effects: tuple[Mapping[str, Any], ...] = ()
    """Tables of a manipulator file."""
    sizes: tuple[float, ...] = ()
    """In the rig's own scale, zero for nothing."""
    multiple: float = 0.0
    norm: float = 0.0
    """Of the whitened change, calibration refitted."""
    nearest: Mapping[str, float] = field(default_factory=dict)
    """Squared distance to the nearest refitted effect of every other kind."""
    pair_distance: float | None = None
    """Outside the library: squared distance to the nearest two effects together."""
    places: tuple[Any, ...] = ()
    """Places of the same kind that are not told apart, with their squared distances."""
    foreign: tuple[str, float] | None = None
    """Law outside the library, and its size."""
    without: tuple[str, ...] = ()
    """Kinds taken out of the library of the diagnosis."""
    constants: tuple[float, float] = (0.0, 0.0)
    """ln of the factors on E and mu."""
    frame: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation, rad, and shift, m."""
    awkward: tuple[str, ...] = ()
    wrong_weight: tuple[int, int, str, float] | None = None
    """Sequence, step and cable whose applied tension is another than the noted, and its factor."""
    hidden_norm: float | None = None
    """Of the change in the sequences with loading only, calibration refitted."""
    build: Mapping[str, Any] | None = None
    """Imperfections of a real rig: fields of :class:`prb3r.proof.concealed.build.Build`."""
    worth: tuple[float, ...] = ()
    """Of each effect of a real rig: by how much other loads are missed without it, RMS in sd of a reading."""
    apart: tuple[float, ...] = ()
    """Of each effect of a real rig: squared distance to the nearest of a kind that it has not; empty: unknown."""
    targets: tuple[Mapping[str, Any], ...] = ()
    """Other loads and another design, each a name, the contents of a manipulator file and a program."""
    blunder: Mapping[str, Any] | None = None
    """Of the set-up: its kind, its details, and what is to be `said` of it."""
    note: str = ""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kind of each concealed effect, in the order of `effects`; empty where none is concealed."""
        return tuple(effect["kind"] for effect in self.effects)

    @property
    def follows_path(self) -> bool:
        """Whether friction follows the load path, told or untold."""
        told = any(target["manipulator"]["friction"].get("direction") == "history" for target in self.targets)
        return told or "slip_history" in self.kinds

    @property
    def distance(self) -> float:
        """Squared, to the nearest effect of another kind."""
        return min(self.nearest.values(), default=np.inf)

    @property
    def distinguishable(self) -> bool:
        """Whether all other kinds are told apart from it."""
        return self.distance >= SETTINGS.sizes.apart

    def plain(self) -> dict[str, Any]:
        """The fields as a dictionary that JSON can write: what the seal hashes and `Seal.opened` reads back."""
        return asdict(self)
