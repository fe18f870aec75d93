"""A small recording with hidden physics, made by the rig: six plates, five sequences of four steps."""

import hashlib
import os
import pickle
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from prb3r.diagnosis.fit.constants import Constants
from prb3r.diagnosis.fit.covariance import reading_sd
from prb3r.diagnosis.fit.least_squares import fit
from prb3r.diagnosis.fit.model import Fit
from prb3r.diagnosis.fit.prediction import predictor
from prb3r.diagnosis.investigate import investigate
from prb3r.diagnosis.known import Task
from prb3r.diagnosis.library import hypotheses
from prb3r.diagnosis.library.scope import Scope
from prb3r.diagnosis.result.diagnosis import Diagnosis
from prb3r.diagnosis.result.investigation import Investigation
from prb3r.diagnosis.result.tell import tell
from prb3r.mechanics.chain import Loads
from prb3r.mechanics.code_cache import once_at_a_time
from prb3r.model.files.toml import toml_text
from prb3r.proof.rig.simulate import observe, simulate
from prb3r.recording.reading import load_recording
from prb3r.recording.recording import Recording
from prb3r.runs.files import write_whole

SHARED = "PRB3R_TESTS_SHARED"
"""Names the folder for what is computed once in a run of tests; `conftest.py` makes it."""
CABLES = {"1": (0.0255, 2), "2": (0.021, 1), "3": (-0.021, 1), "4": (-0.0255, 2)}
"""Offset, m, and the segment that each cable drives."""
PROGRAM = {
    "out": [(30, 0, 0, 0), (90, 0, 0, 0), (60, 0, 0, 0), (25, 0, 0, 0)],
    "down": [(0, 0, 0, 40), (0, 0, 0, 95), (0, 0, 0, 60), (0, 0, 0, 20)],
    "in": [(0, 50, 0, 0), (0, 95, 0, 0), (45, 95, 0, 0), (45, 50, 0, 0)],
    "counter": [(0, 0, 90, 0), (60, 0, 90, 0), (90, 0, 60, 0), (30, 0, 60, 0)],
    "mixed": [(0, 0, 0, 50), (0, 80, 0, 50), (0, 80, 0, 90), (0, 30, 0, 90)],
}
"""Tensions of each step of each sequence, N."""
REVERSING = {
    "out": [(20, 0, 0, 0), (90, 0, 0, 0), (80, 0, 0, 0), (60, 0, 0, 0), (10, 0, 0, 0), (20, 0, 0, 0), (50, 0, 0, 0)],
    "down": [(0, 0, 0, 10), (0, 0, 0, 25), (0, 0, 0, 95), (0, 0, 0, 85), (0, 0, 0, 30), (0, 0, 0, 40), (0, 0, 0, 80)],
    "in": [
        (0, 50, 0, 0),
        (0, 95, 0, 0),
        (10, 95, 0, 0),
        (45, 95, 0, 0),
        (45, 85, 0, 0),
        (45, 50, 0, 0),
        (55, 50, 0, 0),
    ],
    "counter": [(0, 0, 90, 0), (60, 0, 90, 0), (90, 0, 80, 0), (80, 0, 40, 0), (30, 0, 50, 0), (40, 0, 90, 0)],
    "mixed": [(0, 0, 0, 50), (0, 80, 0, 50), (0, 70, 0, 90), (0, 30, 0, 80), (0, 40, 0, 30), (0, 90, 0, 40)],
}
"""Cables that turn back again and again, some by a little, some far."""
PROGRAMS = {"plain": PROGRAM, "reversing": REVERSING, "hung": PROGRAM, "laden": PROGRAM}
HUNG = {"out": 6.0, "down": 0.0, "in": 3.0, "counter": 0.0, "mixed": 6.0}
"""Weight on the tip of an arm that hangs down, by sequence, N along x."""
LADEN = {"out": (0.0, 4.0), "down": (0.0, 9.0), "in": (-2.0, 4.0), "counter": (0.0, -9.0), "mixed": (2.0, 9.0)}
"""Weights on the tip and on disk 4 of an arm that lies, by sequence, N along y; they are hung in four equal parts."""
MEASUREMENT = {
    "position_sd_m": 3e-4,
    "angle_sd_rad": 0.005,
    "tension_sd_relative": 0.003,
    "frame_rotation_sd_rad": 0.005,
    "frame_position_sd_m": 0.002,
}
EXACT = {"offset_m": 0.0, "length_m": 0.0, "thickness_relative": 0.0, "marker_m": 0.0}
"""Tolerances of a rig that was measured in all its parts."""
WEAK = {"kind": "weakened_plate", "plate": 4, "factor": 0.7}
CENTRE = (0.1, 0.0)
"""Of the image, m."""
E, MU = 1.87e11, 0.3
"""Nominal; the rig's own are a little off."""
STEEL, NITINOL = (E, 8e-4), (5e10, 1e-3)
"""Modulus and thickness of plates that the program bends well, and of such as it strains by a per cent."""


def manipulator(modulus=E, friction=MU, effects=(), thickness=STEEL[1]) -> dict:
    """A manipulator file as a table."""
    segment = {"plates": 3, "length_m": 0.03, "clamp_m": 0.008, "width_m": 0.03, "thickness_m": thickness}
    cables = [{"name": n, "offset_m": at, "ends_at_segment": end} for n, (at, end) in CABLES.items()]
    plain = {"name": "rig", "youngs_modulus_pa": modulus, "disk": {"thickness_m": 0.004, "mass_kg": 0.05}}
    plain |= {"friction": {"coefficient": friction}, "segment": [segment, segment], "cable": cables}
    return plain | ({"effect": list(effects)} if effects else {})


def steps_of(name: str, program: str = "plain") -> list[dict]:
    """The rows of one sequence; a cable slips out once it has been eased, in once it has been pulled again."""
    tension = np.array(PROGRAMS[program][name], float)
    change, slip, rows = np.diff(tension, axis=0, prepend=0.0), -np.ones(len(CABLES)), []
    for k, row in enumerate(tension):
        slip = np.where(change[k] == 0, slip, -np.sign(change[k]))
        loads = {f"cable_{n}_n": row[j] for j, n in enumerate(CABLES)} | {
            f"slip_{n}": slip[j] for j, n in enumerate(CABLES)
        }
        loads |= {"tip_x_n": HUNG[name]} if program == "hung" else {}
        if program == "laden":
            loads |= {
                column: weight * (k + 1) / 4
                for column, weight in zip(("tip_y_n", "disk4_y_n"), LADEN[name], strict=True)
            }
        rows.append({"sequence": name, "step": k + 1, **loads})
    return rows


def write_recording(
    folder: Path,
    hidden=(WEAK,),
    seed: int = 0,
    read=("x_m", "y_m", "angle_rad"),
    friction: float = MU,
    plates=STEEL,
    timed=False,
    program="plain",
    known=(),
) -> Path:
    """Record the rig with `hidden` effects into `folder`; `read` are the columns of the markers.

    `known` are effects that the manipulator file has as well.  `timed`: with times of steps, which take from some
    seconds to an hour.
    """
    rng = np.random.default_rng(seed)
    modulus, thickness = plates
    true = manipulator(modulus * 1.05, friction * 0.9, [*known, *hidden], thickness)
    frame = (rng.normal(0, 0.005), *rng.normal(0, 0.002, 2))
    noise = {"x_m": 3e-4, "y_m": 3e-4, "angle_rad": 0.005, "bend_rad": 0.005}
    steps, markers = [], []
    for name in PROGRAM:
        rows = steps_of(name, program)
        if timed:
            times = np.cumsum(10 ** np.random.default_rng(len(steps)).uniform(0, 3.5, len(rows))).round(1).tolist()
            times = [time + 1e5 * list(PROGRAM).index(name) for time in times]
            rows = [row | {"time_s": time} for row, time in zip(rows, times, strict=True)]
        steps += rows
        scattered = [
            {
                key: value * (1 + 0.003 * rng.standard_normal()) if key.startswith("cable") else value
                for key, value in row.items()
            }
            for row in rows
        ]
        before = len(steps) - len(rows)
        states = simulate(true, scattered, before=before)
        x, y, angle = observe(true, states, image_centre=CENTRE, frame=frame, before=before)
        bend = np.diff(angle, axis=1, prepend=0.0)
        for k, row in enumerate(rows):
            for disk in range(1, x.shape[1]):
                values = {"x_m": x[k, disk], "y_m": y[k, disk], "angle_rad": angle[k, disk], "bend_rad": bend[k, disk]}
                seen = {column: values[column] + noise[column] * rng.standard_normal() for column in read}
                markers.append({"sequence": name, "step": row["step"], "disk": disk, **seen})
    folder.mkdir(parents=True, exist_ok=True)
    described = {"name": "small rig", "manipulator": "manipulator.toml", "image_centre_m": list(CENTRE)}
    described |= {"measurement": MEASUREMENT, "prior": {"youngs_modulus": 0.1, "friction_coefficient": 0.3}}
    described |= {"tolerance": EXACT}
    (folder / "recording.toml").write_text(toml_text(described))
    (folder / "manipulator.toml").write_text(toml_text(manipulator(modulus, friction, known, thickness)))
    pd.DataFrame(steps).to_csv(folder / "steps.csv", index=False)
    pd.DataFrame(markers).to_csv(folder / "markers.csv", index=False)
    return folder


@dataclass(frozen=True)
class Case:
    """What is recorded and how it is diagnosed; equal cases are computed once."""

    hidden: tuple[tuple[tuple[str, object], ...], ...] = (tuple(WEAK.items()),)
    read: tuple[str, ...] = ("x_m", "y_m", "angle_rad")
    without: frozenset[str] = frozenset()
    seed: int = 0
    friction: float = MU
    plates: tuple[float, float] = STEEL
    timed: bool = False
    program: str = "plain"
    known: tuple[tuple[tuple[str, object], ...], ...] = ()


LOSSY = {"kind": "pulley_friction", "cables": ("1",), "efficiency": 0.8}
RUBBING = frozenset(
    {
        "cable_friction",
        "worn_hole",
        "edge_wrap",
        "slip_history",
        "load_dependent_friction",
        "breakaway_friction",
        "load_cell",
        "wrap_saturation",
    }
)
YIELDING = frozenset({"hysteretic_plate", "plate_softening", "nonlinear_plate", "tension_drift"})
"""Kinds that could stand in for others in part, among which a search for what is not there takes most of its time."""
IMITATING = frozenset({"stiffness_gradient", "umbilical", "cable_bending"})
"""Kinds of which several together come near what is left of a weak plate."""
UNEXPLAINED = Case(
    hidden=(tuple(WEAK.items()), tuple(LOSSY.items())),
    without=RUBBING | YIELDING | IMITATING | {"weakened_plate", "segment_stiffness", "precurvature"},
)
"""Two effects, of which the library names one: the other is left out, with what could stand in for it."""


@cache
def recorded(case: Case = Case()) -> Recording:
    with TemporaryDirectory() as folder:
        hidden = [dict(effect) for effect in case.hidden]
        described = case.seed, case.read, case.friction, case.plates, case.timed, case.program
        known = [dict(effect) for effect in case.known]
        return load_recording(write_recording(Path(folder), hidden, *described, known))


def rival_of(found: Investigation) -> Fit:
    """The calibrated model of an investigation with another stiffness of the second segment, fitted."""
    model = found.calibrated.model
    scope = Scope.of(found.training, model.predict.chain, found.calibrated.solved.states)
    softer = next(each for each in hypotheses(scope) if each.name == "segment_stiffness (segment 2)")
    return fit(model.adding(softer), np.append(found.calibrated.p, 0.0))


@cache
def investigated(case: Case = Case()) -> Investigation:
    """Computed by one of the processes that test side by side, for all of them."""
    if SHARED not in os.environ:
        return investigate(Task(recorded(case), without=case.without))
    described = case.hidden, case.read, sorted(case.without), case.seed, case.friction, case.plates
    content = repr((*described, case.timed, case.program))
    path = Path(os.environ[SHARED]) / hashlib.sha256(content.encode()).hexdigest()
    with once_at_a_time(path.with_suffix(".lock")):
        if not path.exists():
            write_whole(path, pickle.dumps(investigate(Task(recorded(case), without=case.without))))
    return pickle.loads(path.read_bytes())


@cache
def diagnosed(case: Case = Case()) -> Diagnosis:
    return tell(investigated(case))


def pulled_again(factor: float, times: int = 3, other: float = 1.0, seed: int = 0) -> Recording:
    """Everything `times` times over, read with `factor` times the stated noise, all but the first at `other` loads."""
    plain = recorded(Case(hidden=()))
    measurement = plain.measurement.model_copy(update={"tension_sd_relative": 0.0})
    count, readings = plain.loads.steps, plain.readings
    share = np.repeat([1.0] + [other] * (times - 1), count)
    loads = Loads(*(np.concatenate([field] * times) for field in plain.loads))
    loads = loads._replace(tension=loads.tension * share[:, None])
    steps = pd.concat([plain.steps] * times, ignore_index=True)
    own = np.concatenate([plain.of_sequence + k * len(plain.sequences) for k in range(times)])
    tiled = [np.tile(field, times) for field in readings]
    tiled[0] = np.concatenate([readings.step + k * count for k in range(times)])
    names = tuple(f"{name}-{k}" for k in range(times) for name in plain.sequences)
    many = replace(
        plain, measurement=measurement, sequences=names, steps=steps, of_sequence=own, loads=loads,
        readings=type(readings)(*tiled),
    )  # fmt: skip
    exact = predictor(many)(Constants())
    noise = factor * reading_sd(many) * np.random.default_rng(seed).standard_normal(len(exact))
    return many.with_values(exact + noise)
