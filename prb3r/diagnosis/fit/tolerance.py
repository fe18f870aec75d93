"""Tolerances of the rig's geometry: small unmeasured errors, each with a standard deviation and a derivative.

They are nuisance parameters, not effects.  The covariance of the readings includes them (`covariance`), so that a
plate that is a per cent too thick does not count as a misfit.  How far off they probably are follows from what the best
model leaves.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from prb3r.diagnosis.fit.covariance import Noise
from prb3r.diagnosis.fit.prediction import Predictor, Solution
from prb3r.diagnosis.fit.response import PIXEL, across, response
from prb3r.mechanics.chain import Chain, Loads
from prb3r.model.manipulator import Manipulator
from prb3r.recording.recording import Kind, Tolerance

THICKNESS_TO_STIFFNESS = 3.0
"""Bending stiffness grows with the third power of a plate's thickness."""
MARKER = "marker "
"""Beginning of the names of the tolerances of markers."""
IN_M, IN_RAD = ", m", ", rad"
"""Endings of the names of the tolerances of markers: their units."""
STIFFNESS = " stiffness"
"""Ending of the names of the tolerances of stiffnesses, whose logarithms they are."""
TOLERANCE_STEP = 0.01
"""Step of a tolerance for central differences, in its standard deviations."""
FLAT_PRIOR_SHARE = 1e-9
"""Prior information on a parameter of the model, relative to that of the readings: just enough to make the matrix
invertible."""
SOLUTIONS_KEPT = 4
"""Number of solutions for which :func:`tolerances` is cached.  Few, to save memory: in six small diagnoses 4 of them
serve 84 of 220 calls, 16 serve 109."""
LEAST_NORM = 1e-12
"""Lower bound of the norm of the change of the readings by a parameter, in units of the noise: keeps the prior of a
parameter that moves no reading from being 0."""


class Tolerances(NamedTuple):
    """All tolerances of a rig, with what each does to the readings."""

    names: tuple[str, ...]
    """(t,) such as `segment.1.length_m` or `cable.2.offset_m`; in words for single plates, holes and markers."""
    sd: np.ndarray
    """(t,) standard deviations, m or rad; relative for stiffnesses."""
    moved: np.ndarray
    """(r, t) change of every reading by one standard deviation of each, m or rad."""


class EstimatedTolerances(NamedTuple):
    """Posterior of the tolerances, given what a model leaves."""

    names: tuple[str, ...]
    value: np.ndarray
    """(t,) posterior means, m or rad; relative for stiffnesses."""
    sd: np.ndarray
    """(t,) posterior standard deviations, in the same units."""
    prior_sd: np.ndarray
    """(t,) prior standard deviations, in the same units."""


@dataclass(frozen=True)
class MechanicalTolerance:
    """A tolerance that moves the states."""

    name: str
    sd: float
    """In m; of the ln of a stiffness."""
    change: Callable[[Chain, float], Chain]
    """The chain with the tolerance off by a number, in the unit of `sd`."""


@lru_cache(maxsize=SOLUTIONS_KEPT)
def tolerances(predict: Predictor, solved: Solution) -> Tolerances:
    """All tolerances of a recording, with the readings differentiated along the path of `solved`; cached."""
    acting = mechanical_tolerances_of(predict, solved)

    def problem_of(tolerance: MechanicalTolerance) -> Callable[[float], tuple[Chain, Loads]]:
        return lambda share: (tolerance.change(solved.chain, share * tolerance.sd), solved.loads)

    felt = [k for k, tolerance in enumerate(acting) if tolerance.sd > 0]
    moved = np.zeros((predict.recording.readings.count, len(acting)))
    moved[:, felt] = response(
        predict, solved, [across(problem_of(acting[k]), (-TOLERANCE_STEP, TOLERANCE_STEP)) for k in felt]
    )
    marked = list(_markers(predict, solved))
    return Tolerances(
        (*(tolerance.name for tolerance in acting), *(name for name, _, _ in marked)),
        np.array([*(tolerance.sd for tolerance in acting), *(sd for _, sd, _ in marked)]),
        np.hstack([moved, *(column[:, None] for _, _, column in marked)]),
    )


def mechanical_tolerances_of(predict: Predictor, solved: Solution) -> list[MechanicalTolerance]:
    """The tolerances that move the states of a recording: of all plates, and of the cables that it pulls."""
    recording = predict.recording
    pulled = np.asarray((recording.loads.tension > 0).any(0))
    known, apart = recording.tolerance, recording.modulus_of_several
    return list(mechanical_tolerances(recording.manipulator, known, solved.chain, pulled, apart))


def mechanical_tolerances(
    manipulator: Manipulator, known: Tolerance, chain: Chain, pulled: np.ndarray, apart: bool = False
) -> Iterator[MechanicalTolerance]:
    """The tolerances of stiffness and length, of a segment as a whole and of each plate, then of the offsets of cables.

    An offset is off along the whole cable and at each plate.  What a segment of one plate has as a whole is left out,
    as that is the plate's.

    Parameters
    ----------
    known : the standard deviations.
    chain : chain of the manipulator, with effects.
    pulled : (m,) cables whose offsets count.
    apart : whether the stiffness of an only segment is told apart from Young's modulus, as where several rigs share the
        modulus; otherwise it is left out.
    """
    plates = np.arange(chain.plates)
    stiffness = THICKNESS_TO_STIFFNESS * known.thickness_relative
    for number, segment in enumerate(manipulator.segment, 1):
        rows, length = plates[chain.segment == number - 1], known.length(segment)
        if (apart or len(manipulator.segment) > 1) and len(rows) > 1:
            yield MechanicalTolerance(stiffness_of(number), stiffness, _stiffer(rows))
        if len(rows) > 1:
            yield MechanicalTolerance(f"segment.{number}.length_m", length, _longer(rows))
        for plate in rows:
            yield MechanicalTolerance(f"plate {plate + 1}{STIFFNESS}", stiffness, _stiffer(plate))
            yield MechanicalTolerance(f"plate {plate + 1} length_m", length, _longer(plate))
    for j in np.flatnonzero(pulled & np.abs(chain.offset).any(0)).tolist():
        name, crossed = manipulator.cable_names[j], plates[: chain.reach[j]]
        offset = known.offset(float(np.abs(chain.offset[:, j]).max()))
        if len(crossed) > 1:
            yield MechanicalTolerance(f"cable.{name}.offset_m", offset, _shifted(crossed, j))
        for plate in crossed:
            yield MechanicalTolerance(f"cable {name} at plate {plate + 1} offset_m", offset, _shifted(plate, j))


def stiffness_of(segment: int) -> str:
    """The name of the tolerance of the stiffness of a segment, counted from 1, as a whole."""
    return f"segment.{segment}{STIFFNESS}"


def _stiffer(rows: np.ndarray) -> Callable[[Chain, float], Chain]:
    """A function that changes a chain by a number: the ln of a factor on the stiffness of the plates at `rows`."""

    def change(chain: Chain, by: float) -> Chain:
        stiffness = chain.stiffness.copy()
        stiffness[rows] *= np.exp(by)
        return chain._replace(stiffness=stiffness)

    return change


def _longer(rows: np.ndarray) -> Callable[[Chain, float], Chain]:
    """A function that changes a chain by a number, m: plates at `rows` with longer arcs of the same section."""

    def change(chain: Chain, by: float) -> Chain:
        arc = chain.arc.copy()
        arc[rows] += by
        softer = (chain.arc / arc)[:, None]
        return chain._replace(
            arc=arc, stiffness=softer * chain.stiffness, cable_stiffness=softer * chain.cable_stiffness
        )

    return change


def _shifted(rows: np.ndarray, cable: int) -> Callable[[Chain, float], Chain]:
    """A function that changes a chain by a number, m, added to the offset of a cable over the plates at `rows`."""

    def change(chain: Chain, by: float) -> Chain:
        offset = chain.offset.copy()
        offset[rows, cable] += by
        return chain._replace(offset=offset)

    return change


def without_unit(name: str) -> str:
    """The name of a tolerance without its unit."""
    return name.removesuffix(IN_M).removesuffix(IN_RAD)


def _markers(predict: Predictor, solved: Solution) -> Iterator[tuple[str, float, np.ndarray]]:
    """Name, standard deviation (m or rad) and change (r,) of the readings by one of these, of every marker's place and
    angle.

    In its disk's frame, a marker is off along the axis of the arm there ("along") or perpendicular to it ("across").
    Bends are read without markers, as from edges of notches.
    """
    recording, states = predict.recording, solved.states
    step, disk, kind, _ = recording.readings
    if turn := recording.tolerance.marker_turn:
        for number in np.unique(disk[kind == Kind.ANGLE]).tolist():
            yield f"{MARKER}{number} turned on its disk{IN_RAD}", turn, turn * ((kind == Kind.ANGLE) & (disk == number))
    sd = recording.tolerance.marker(recording.manipulator.segment)
    if not recording.readings.is_position.any() or sd == 0:
        return
    points = np.nan_to_num(np.stack([states.x[step, disk], states.y[step, disk]], -1))
    angle = np.nan_to_num(states.angle[step, disk])
    cos, sin = np.cos(angle), np.sin(angle)
    for way, turned in (("along", (cos, sin)), ("across", (-sin, cos))):
        away = PIXEL * np.stack(turned, -1)
        ahead = predict.seen(points + away, step, solved.constants, solved.effects)
        behind = predict.seen(points - away, step, solved.constants, solved.effects)
        change = (ahead - behind) / (2 * PIXEL)
        seen = np.select([kind == Kind.X, kind == Kind.Y], [change[:, 0], change[:, 1]], 0.0)
        for number in np.unique(disk[recording.readings.is_position]).tolist():
            yield f"{MARKER}{number} {way} its disk{IN_M}", sd, np.where(disk == number, seen, 0.0) * sd


def estimated(known: Tolerances, plain: Noise, misfit: np.ndarray, moved: np.ndarray) -> EstimatedTolerances:
    """The tolerances given the misfit (r,) of a model whose parameters move the readings by `moved` (r, p).

    The parameters of the model are fitted too, with next to no prior.  `plain`: the covariance of the readings without
    tolerances.
    """
    whole, count = plain.whiten(np.hstack([known.moved, moved])), len(known.sd)
    scale = np.maximum(np.linalg.norm(whole, axis=0), LEAST_NORM)
    prior = np.concatenate([np.ones(count), FLAT_PRIOR_SHARE * scale[count:] ** 2])
    covariance = np.linalg.inv(whole.T @ whole + np.diag(prior))
    share = covariance @ (whole.T @ plain.whiten(misfit))
    sd = np.sqrt(np.diag(covariance))
    return EstimatedTolerances(known.names, share[:count] * known.sd, sd[:count] * known.sd, known.sd)
