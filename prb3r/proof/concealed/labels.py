"""Labels: the truth of every recording, with what acts on the rig, how large it is, and what could be told apart."""

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
    """Number of the recording in its run, from 0."""
    seed: int
    """Seed of the run."""
    cls: str
    """Class of the recording, one of those of the population."""
    design: int
    """Number of the design."""
    kind: str = ""
    """Kind of effect, foreign law or decoy that is asked for; empty: any.  Some classes have words of their own."""
    multiple: float = 0.0
    """Size that is asked for, in smallest detectable ones."""


@dataclass(frozen=True)
class Label:
    """The truth of one recording, which the diagnosis must not know."""

    case: int
    cls: str
    """Class of the recording: that of its request, or `clean` where this could not be met."""
    design: int
    """Number of the design."""
    noise_seed: int
    effects: tuple[Mapping[str, Any], ...] = ()
    """Concealed effects, as tables of a manipulator file."""
    sizes: tuple[float, ...] = ()
    """Size of each effect in the unit of its candidate, or of the foreign law; zero is no effect."""
    multiple: float = 0.0
    """Size that was asked for, in smallest detectable ones."""
    norm: float = 0.0
    """Norm of the whitened change of the readings, calibration refitted."""
    nearest: Mapping[str, float] = field(default_factory=dict)
    """Squared distance to the nearest refitted effect of every other kind."""
    pair_distance: float | None = None
    """For physics outside the library: squared distance to the nearest two effects together."""
    places: tuple[Any, ...] = ()
    """Other places of the same kind that cannot be told apart, each with its squared distance."""
    foreign: tuple[str, float] | None = None
    """Foreign law, outside the library, and its size."""
    without: tuple[str, ...] = ()
    """Kinds taken out of the library of the diagnosis."""
    constants: tuple[float, float] = (0.0, 0.0)
    """ln of the true factors on E and mu."""
    frame: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation, rad, and shift, m, of the camera's frame."""
    awkward: tuple[str, ...] = ()
    """Ways in which the recording is awkward, of `AWKWARD`."""
    wrong_weight: tuple[int, int, str, float] | None = None
    """Sequence and step (from 0) and cable whose applied tension is not the noted one, and the factor on it."""
    hidden_norm: float | None = None
    """Norm of the change in the loading-only sequences, calibration refitted."""
    build: Mapping[str, Any] | None = None
    """Imperfections of a real rig: fields of :class:`prb3r.proof.concealed.build.Build`."""
    worth: tuple[float, ...] = ()
    """Of each effect of a real rig: RMS error of predictions of other loads without it, in sd of a reading."""
    apart: tuple[float, ...] = ()
    """Of each effect of a real rig: squared distance to the nearest of a kind that the rig lacks; empty: unknown."""
    targets: tuple[Mapping[str, Any], ...] = ()
    """Other loads and another design, each a `name`, the contents of a `manipulator` file and a `program`."""
    blunder: Mapping[str, Any] | None = None
    """Blunder of the set-up: its `kind`, its details, and the sentence `said` that names it."""
    note: str = ""
    """Remark on how the label was drawn."""

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
        """Squared distance to the nearest effect of another kind; infinite where none was computed."""
        return min(self.nearest.values(), default=np.inf)

    @property
    def distinguishable(self) -> bool:
        """Whether the effect can be told apart from every other kind."""
        return self.distance >= SETTINGS.sizes.apart

    def plain(self) -> dict[str, Any]:
        """The fields as a dictionary that JSON can write: what the seal hashes and `Seal.opened` reads back."""
        return asdict(self)
