"""A manipulator as its designer describes it, and its translation into a chain."""

from collections.abc import Iterable
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from prb3r.errors import Problem, SpecError, did_you_mean
from prb3r.mechanics.chain import Chain
from prb3r.mechanics.plate import plate_model
from prb3r.model.effects import AnyEffect, with_effects
from prb3r.model.files.plain import plain
from prb3r.model.files.plausible import Acceleration, Modulus, Stress
from prb3r.model.files.toml import read_toml, toml_text
from prb3r.model.files.toml_lines import Keys
from prb3r.model.files.validation import KeyedError, validated
from prb3r.model.parts import MAX_PLATES, Cable, Disk, Friction, Segment, Strict
from prb3r.model.paths import keys_of_path, with_value

FARTHEST_BESIDE = 2.0
"""Offset of a cable, in lengths of the manipulator, beyond which it is most likely given in millimetres."""
ModelName = Literal["prb3r", "elastica", "constant-curvature"]


class Manipulator(Strict):
    """A planar manipulator of one or several segments in a row; its file is described in docs/my-manipulator.md.

    Examples
    --------
    >>> import prb3r
    >>> plates = {"plates": 7, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": 8e-4}
    >>> manipulator = prb3r.Manipulator(
    ...     name="one segment",
    ...     youngs_modulus_pa=187e9,
    ...     disk=prb3r.Disk(thickness_m=0.004),
    ...     segment=[prb3r.Segment(**plates)],
    ...     cable=[prb3r.Cable(name="up", offset_m=0.02, ends_at_segment=1)],
    ... )
    >>> manipulator.plates, manipulator.cable_names
    (7, ['up'])
    >>> manipulator
    Manipulator('one segment', plates=[7], cables=['up'], model='prb3r')
    """

    name: str
    """Any text, for figures and reports."""
    youngs_modulus_pa: Modulus
    """Young's modulus of the plates, Pa; where bending stiffnesses are given, it turns strain into stress alone."""
    gravity_m_s2: Acceleration = 9.80665
    """Acceleration that turns loads in kilograms into newtons, m/s^2; not a load on the manipulator itself."""
    yield_stress_pa: Stress | None = None
    """Stress at which plates yield, Pa, for safety factors."""
    model: ModelName = "prb3r"
    """How plates bend: three hinges each, as an elastic curve, or with one curvature in each segment."""
    hinges: Literal["chen", "su", "one", "howell"] = "chen"
    """With model = "prb3r": where the hinges of a plate lie and how stiff they are."""
    disk: Disk
    """The disks, which are all alike."""
    friction: Friction = Friction()
    """Belt friction between cables and holes."""
    segment: Annotated[list[Segment], Field(min_length=1)]
    """Segments from base to tip."""
    cable: list[Cable] = []
    """Cables in any order, told apart by their names."""
    effect: list[AnyEffect] = []
    """Extra physics, each a switch."""

    @model_validator(mode="after")
    def _consistent(self) -> "Manipulator":
        problems: list[tuple[Keys, str]] = []
        names = [cable.name for cable in self.cable]
        length = sum(segment.plates * (segment.length_m + self.disk.thickness_m) for segment in self.segment)
        for number, cable in enumerate(self.cable):
            if cable.name in names[:number]:
                what = f"{names.count(cable.name)} cables are named {cable.name!r}; names must differ"
                problems.append((("cable", number, "name"), what))
            if cable.ends_at_segment > len(self.segment):
                what = f"cable {cable.name!r} ends at segment {cable.ends_at_segment}, but there are only "
                problems.append((("cable", number, "ends_at_segment"), f"{what}{len(self.segment)}"))
            offsets = cable.offset_m if isinstance(cable.offset_m, list) else [cable.offset_m]
            if (beside := max(map(abs, offsets), default=0.0)) > FARTHEST_BESIDE * length:
                what = f"{beside:g} m beside a manipulator that is {length:.3g} m long; lengths are given in metres"
                problems.append((("cable", number, "offset_m"), f"{what}: {beside:g} mm is {beside / 1e3:g}"))
        if self.model == "constant-curvature" and self.follows_history:
            what = "friction.direction = 'history' needs the model 'prb3r' or 'elastica'"
            problems.append((("friction", "direction"), what))
        if sum(segment.plates for segment in self.segment) > MAX_PLATES:
            problems.append((("segment",), f"more than {MAX_PLATES} plates"))
        for number, effect in enumerate(self.effect):
            problems += [(("effect", number), what) for what in effect.problems(self)]
        if problems:
            raise KeyedError(*problems)
        return self

    def replace(self, path: str, value: Any) -> "Manipulator":
        """A copy with another value at `path`, checked as a file is.

        Parameters
        ----------
        path : to a value or a whole part, as in studies: `segment.1.thickness_m`, `cable.2.offset_m`, `effect`.
        value : a number, text, a part such as a `Segment` or what its table in a file would hold; None for absent.

        Raises
        ------
        SpecError
            If there is no such path, or if the manipulator would not be in order; with every problem.

        Examples
        --------
        >>> import prb3r
        >>> manipulator = prb3r.load_manipulator("studies/manipulators/two-segment.toml")
        >>> thicker = manipulator.replace("segment.1.thickness_m", 1e-3)
        >>> thicker.segment[0].thickness_m, manipulator.segment[0].thickness_m
        (0.001, 0.0008)
        >>> manipulator.replace("cable.3.offset_m", -21)
        Traceback (most recent call last):
        prb3r.errors.SpecError: cable.3.offset_m: -21 m is not what rigs are made with (up to 2 m); lengths are given \
in metres: -21 mm is -0.021
        """
        try:
            keys = keys_of_path(self, path)
        except ValueError as error:
            raise SpecError(Problem("", str(error))) from None
        return validated(plain(with_value(plain(self), keys, plain(value))), Manipulator)

    def to_toml(self) -> str:
        """The text of a manipulator file that reads back equal.

        Examples
        --------
        >>> import prb3r, tomllib
        >>> manipulator = prb3r.load_manipulator("studies/manipulators/two-segment.toml")
        >>> prb3r.Manipulator(**tomllib.loads(manipulator.to_toml())) == manipulator
        True
        """
        return toml_text({key: value for key, value in plain(self).items() if value != []})

    def __repr__(self) -> str:
        """Name, plates of each segment, cables, model and kinds of effects on one line; `to_toml` gives everything."""
        plates = [segment.plates for segment in self.segment]
        effects = f", effects={[effect.kind for effect in self.effect]}" if self.effect else ""
        return f"Manipulator({self.name!r}, {plates=}, cables={self.cable_names}, model={self.model!r}{effects})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self.to_toml())}</pre>"

    @property
    def follows_history(self) -> bool:
        """Whether slip follows from the load path, so that the slip that steps declare is ignored."""
        return self.friction.direction == "history" or any(effect.follows_history for effect in self.effect)

    @property
    def plates(self) -> int:
        """Number of plates of all segments together, which is the number of the tip disk too."""
        return sum(segment.plates for segment in self.segment)

    @property
    def cable_names(self) -> list[str]:
        """Names of the cables in the order of the file, which is that of all arrays."""
        return [cable.name for cable in self.cable]

    @cached_property
    def segment_ends(self) -> list[int]:
        """Number of the last disk of each segment."""
        return np.cumsum([segment.plates for segment in self.segment]).tolist()

    def per_plate(self, values: Iterable[float]) -> np.ndarray:
        """(plates,) one value for each segment, repeated for its plates."""
        return np.repeat(np.asarray(list(values), float), [segment.plates for segment in self.segment])

    @property
    def bending_stiffness(self) -> np.ndarray:
        """(plates,) bending stiffness EI of every plate as designed, without effects, N m^2 [Eq. 17]."""
        return self.per_plate(segment.bending_stiffness(self.youngs_modulus_pa) for segment in self.segment)

    @property
    def outer_fibre(self) -> np.ndarray:
        """(plates,) distance of the outermost fibre from the neutral axis, m; NaN where it is not known."""
        return self.per_plate(segment.outer_fibre for segment in self.segment)

    @property
    def disk_masses(self) -> np.ndarray:
        """(plates,) mass on which gravity acts at the centre of each disk but the base, kg: the disk, half of the plate
        on either side, and at the tip what it carries besides."""
        plate = self.per_plate(segment.plate_mass_kg for segment in self.segment)
        mass = self.disk.mass_kg + 0.5 * (plate + np.append(plate[1:], 0.0))
        mass[-1] += self.disk.tip_mass_kg
        return mass

    def cable_arm(self, side: int) -> np.ndarray:
        """(plates,) largest distance of a cable from the axis on the side of positive (`side` 1) or negative (-1)
        offsets, m; 0 for plates without a cable on that side."""
        arms = [self.per_plate(side * cable.offset(k) for k in range(len(self.segment))) for cable in self.cable]
        return np.maximum.reduce([np.zeros(self.plates), *arms])

    def chain(self, broken: Iterable[str] = ()) -> Chain:
        """The chain of the mechanics for this manipulator, effects included; `broken` names cables that carry nothing.

        Raises
        ------
        ValueError
            For a broken cable that does not exist.
        """
        return with_effects(self.plain_chain(broken), self, self.effect)

    def plain_chain(self, broken: Iterable[str] = ()) -> Chain:
        """The chain that :meth:`chain` returns, but without any effect; raises the same error."""
        broken = set(broken)
        for name in sorted(broken.difference(self.cable_names)):
            raise ValueError(f"there is no cable {name!r} to break{did_you_mean(name, self.cable_names)}")
        model = plate_model(self.model, self.hinges)
        clamp = self.per_plate(segment.clamp_m for segment in self.segment)
        arc = self.per_plate(segment.length_m for segment in self.segment) - 2 * clamp
        stiffness = (self.bending_stiffness / arc)[:, None] * model.stiffness
        segment = self.per_plate(range(len(self.segment))).astype(np.int64)
        offset = [self.per_plate(cable.offset(k) for k in range(len(self.segment))) for cable in self.cable]
        reach = [0 if cable.name in broken else self.segment_ends[cable.ends_at_segment - 1] for cable in self.cable]
        shape = self.plates, len(self.cable)
        return Chain(
            plate=model,
            arc=arc,
            clamp=clamp,
            disk=self.disk.thickness_m,
            stiffness=stiffness,
            rest=np.zeros_like(stiffness),
            offset=np.array(offset, float).T.reshape(shape).copy(),
            reach=np.array(reach, np.int64),
            friction=np.full(shape, self.friction.coefficient),
            segment=segment,
            tied=self.model == "constant-curvature",
            presliding=self.friction.presliding_m if self.friction.direction == "history" else 0.0,
            edges=self.friction.wrap == "edges",
        )


def load_manipulator(path: str | Path) -> Manipulator:
    """Read a manipulator file.

    Raises
    ------
    SpecError
        With every problem of the file and its line.

    Examples
    --------
    >>> import prb3r
    >>> prb3r.load_manipulator("studies/manipulators/two-segment.toml").plates
    14
    """
    return read_toml(path, Manipulator)
