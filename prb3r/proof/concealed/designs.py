"""Designs drawn from a seed: manipulators, load programs and cameras in the ranges of the settings."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from prb3r.proof.concealed.design import Design, Flavour, LoadSteps, followed, largest_bend, plate_bends
from prb3r.proof.settings import SETTINGS
from prb3r.recording.recording import Kind


def design_of(seed: int, number: int, flavour: Flavour = Flavour.PLAIN) -> Design:
    """Design `number` of a seed, drawn so that its rig has an equilibrium with moderate bends at every step.

    Raises
    ------
    RuntimeError
        If none of the designs that are tried is so.
    """
    rng = np.random.default_rng([seed, 1, number])
    for _ in range(SETTINGS.programs.attempts):
        moderate = _moderate(_drawn(rng, number, flavour))
        if moderate is not None:
            return moderate
    raise RuntimeError(f"no design {number} with moderate bends was found from seed {seed}")


def _drawn(rng: np.random.Generator, number: int, flavour: Flavour) -> Design:
    """A random design, with loads that may still be too large."""
    u, cameras = rng.uniform, SETTINGS.cameras
    manipulator = _manipulator(rng, flavour)
    kinds = cameras.read_of_others
    if flavour == Flavour.PLAIN or flavour.is_real:
        kinds = cameras.read[int(rng.integers(len(cameras.read)))]
    elif flavour == Flavour.POOR:
        kinds = cameras.read_of_poor[int(rng.integers(len(cameras.read_of_poor)))]
    measurement = {
        "tension_sd_relative": u(*cameras.tension_sd_relative),
        "frame_rotation_sd_rad": u(*cameras.frame_rotation_sd_rad),
    }
    if Kind.X in kinds:
        measurement["position_sd_m"] = u(*cameras.position_sd_m)
        measurement["frame_position_sd_m"] = u(*cameras.frame_position_sd_m)
    if Kind.ANGLE in kinds or Kind.BEND in kinds:
        measurement["angle_sd_rad"] = u(*cameras.angle_sd_rad)
    flat = rng.random() < cameras.no_prior or flavour == Flavour.POOR
    program = drawn_program(rng, manipulator, flavour)
    return Design(number, flavour, manipulator, measurement, {} if flat else cameras.prior, kinds, program, 0.0)


def _manipulator(rng: np.random.Generator, flavour: Flavour) -> dict[str, Any]:
    """What a manipulator file would hold, in SI units and without effects, drawn in the ranges of
    `SETTINGS.manipulators`; by its flavour a design has fewer plates, no friction, friction along the load path or
    plates of nitinol."""
    u, ranges, slow = rng.uniform, SETTINGS.manipulators, flavour.is_slow
    segments = int(rng.choice(ranges.history_segments if slow else ranges.segments))
    fewest, most = ranges.history_plates if slow else ranges.plates
    if flavour.is_real and not slow:
        fewest, most = SETTINGS.real.plates
    total = int(rng.integers(max(fewest, ranges.plates_per_segment * segments), most + 1))
    plates = np.full(segments, total // segments)
    plates[: total % segments] += 1
    length, clamp = u(*ranges.length_m), u(*ranges.clamp_m)
    nitinol = flavour == Flavour.REAL_NITINOL
    thickness = np.sort(u(*(ranges.nitinol_thickness_m if nitinol else ranges.thickness_m), segments))[::-1]
    cables = _cables(rng, segments)
    frictionless = flavour == Flavour.REAL_BARE or (flavour == Flavour.PLAIN and rng.random() < ranges.frictionless)
    friction: dict[str, Any] = {"coefficient": 0.0 if frictionless else u(*ranges.friction)}
    if flavour in (Flavour.HISTORY, Flavour.REAL_HISTORY):
        friction |= {"direction": "history", "presliding_m": 10 ** u(*ranges.presliding_log10_m)}
    return {
        "name": "concealed",
        "youngs_modulus_pa": u(*ranges.nitinol_pa) if nitinol else ranges.youngs_modulus_pa * u(*ranges.stiffness),
        "gravity_m_s2": ranges.gravity_m_s2,
        "disk": {"thickness_m": u(*ranges.disk_thickness_m), "mass_kg": u(*ranges.disk_mass_kg)},
        "friction": friction,
        "segment": [
            {
                "plates": int(count),
                "length_m": length,
                "clamp_m": clamp,
                "width_m": ranges.width_m,
                "thickness_m": float(thick),
            }
            for count, thick in zip(plates, thickness, strict=True)
        ],
        "cable": cables,
        "effect": [],
    }


def _cables(rng: np.random.Generator, segments: int) -> list[dict[str, Any]]:
    """The cables of a manipulator file: a pair for each segment, the last segment's in the outer row of holes.

    A single segment has one pair or two.  Of more than two cables one is left out at times.
    """
    ranges, cables = SETTINGS.manipulators, list[dict[str, Any]]()
    fewest, most = ranges.pairs_of_one_segment
    ends = list(range(segments, 0, -1)) if segments > 1 else [1] * int(rng.integers(fewest, most + 1))
    arm = rng.uniform(*ranges.arm_m)
    for end in ends:
        for side in (1, -1):
            offset = side * (arm + rng.uniform(-ranges.arm_scatter_m, ranges.arm_scatter_m))
            cables.append({"offset_m": offset, "ends_at_segment": end})
        arm -= rng.uniform(*ranges.row_m)
    if len(cables) > 2 and rng.random() < ranges.spare:
        cables.pop(int(rng.integers(len(cables))))
    return [{"name": str(j + 1), **cable} for j, cable in enumerate(cables)]


def drawn_program(rng: np.random.Generator, manipulator: Mapping[str, Any], flavour: Flavour) -> tuple[LoadSteps, ...]:
    """A random load program for a manipulator: sequences in which tensions rise and fall, or only rise, as the flavour
    asks."""
    ranges, cables = SETTINGS.programs, manipulator["cable"]
    m, few = len(cables), flavour.is_slow or flavour == Flavour.POOR
    if few:
        sequences = ranges.few_sequences
    elif flavour == Flavour.LOADING:
        sequences = ranges.loading_sequences
    else:
        sequences = int(rng.integers(ranges.sequences[0], ranges.sequences[1] + 1))
    use: list[list[int]] = [[] for _ in range(sequences)]
    for j in rng.permutation(m).tolist():
        for k in sorted(range(sequences), key=lambda k: (len(use[k]), rng.random()))[: ranges.uses]:
            use[k].append(j)
    pull = np.array([_tension(manipulator, cable) for cable in cables])
    loaded = rng.random() < ranges.tip_loaded
    program = []
    for k in range(sequences):
        used = rng.permutation(use[k] or [int(rng.integers(m))]).tolist()
        count = ranges.few_steps if few else int(rng.integers(ranges.steps[0], ranges.steps[1] + 1))
        unloads = k >= sequences - ranges.unloading_last if flavour == Flavour.LOADING else flavour != Flavour.POOR
        tension = np.zeros((count, m))
        for rank, j in enumerate(used):
            shares = _profile(rng, count, unloads)
            tension[:, j] = shares * (1.0 if rank == 0 else rng.uniform(*ranges.second_cable)) * pull[j]
        tip = np.zeros(2)
        if loaded and rng.random() < ranges.tip_sequences:
            size = rng.choice([-1, 1]) * rng.uniform(*ranges.tip_share)
            tip = size * np.array([ranges.tip_slope, 1.0]) * _tip(manipulator, pull)
        program.append(_steps(manipulator, tension.round(3), tip.round(4), loaded))
    return tuple(program)


def _tension(manipulator: Mapping[str, Any], cable: Mapping[str, Any]) -> float:
    """Largest tension of a cable, N: alone, it bends a plate of its last segment by `SETTINGS.programs.bend_rad`."""
    soft = manipulator["segment"][cable["ends_at_segment"] - 1]
    rigidity = manipulator["youngs_modulus_pa"] * soft["width_m"] * soft["thickness_m"] ** 3 / 12
    arc = soft["length_m"] - 2 * soft["clamp_m"]
    return SETTINGS.programs.bend_rad * rigidity / (arc * abs(cable["offset_m"]))


def _tip(manipulator: Mapping[str, Any], pull: np.ndarray) -> float:
    """Transverse tip force whose moment about the base is that of the strongest cable, N."""
    arms = np.array([abs(cable["offset_m"]) for cable in manipulator["cable"]])
    length = sum(segment["plates"] * segment["length_m"] for segment in manipulator["segment"])
    return float((pull * arms).max() / length)


def _profile(rng: np.random.Generator, count: int, unloads: bool) -> np.ndarray:
    """(count,) shares of the largest tension: up to a peak and down again if the sequence `unloads`, else up alone."""
    ranges = SETTINGS.programs
    if not unloads:
        return np.linspace(rng.uniform(*ranges.last_share), 1.0, count)
    peak = int(rng.integers(1, count - 1))
    up = np.linspace(rng.uniform(*ranges.first_share), 1.0, peak + 1)
    down = np.linspace(1.0, rng.uniform(*ranges.last_share), count - peak)[1:]
    return np.concatenate([up, down])


def _steps(manipulator: Mapping[str, Any], tension: np.ndarray, tip: np.ndarray, loaded: bool) -> LoadSteps:
    """The steps of one sequence with tensions (steps, m), the slip directions that these declare, and the tip load."""
    names = [cable["name"] for cable in manipulator["cable"]]
    rows, slip, before = [], -np.ones(len(names)), np.zeros(len(names))
    for row in tension:
        slip = np.where(row < before, 1.0, np.where(row > before, -1.0, slip))
        before = row
        step = {f"cable_{name}_n": float(t) for name, t in zip(names, row, strict=True)}
        step |= {f"slip_{name}": float(s) for name, s in zip(names, slip, strict=True)}
        rows.append(step | ({"tip_x_n": float(tip[0]), "tip_y_n": float(tip[1])} if loaded else {}))
    return tuple(rows)


def _moderate(design: Design) -> Design | None:
    """The design with loads reduced until bends are moderate; None if that takes too many reductions, or if bends are
    too small then."""
    ranges = SETTINGS.programs
    for _ in range(ranges.weakenings):
        states = followed(design.manipulator, design.program)
        if states is not None:
            bend = largest_bend(states)
            turn = float(max(np.abs(part.angle).max() for part in states))
            if bend <= ranges.largest_bend_rad and turn <= ranges.largest_turn_rad:
                idle = (np.abs(plate_bends(states)).max(0) < ranges.idle_rad).any()
                return replace(design, largest_bend=bend) if bend > ranges.least_bend_rad and not idle else None
        design = replace(design, program=weaker_program(design.program))
    return None


def weaker_program(program: Sequence[LoadSteps]) -> tuple[LoadSteps, ...]:
    """A program with all loads reduced by the factor `SETTINGS.programs.weaker`."""
    return tuple(tuple(map(_weaker, steps)) for steps in program)


def _weaker(step: Mapping[str, float]) -> dict[str, float]:
    factor = SETTINGS.programs.weaker
    return {key: value if key.startswith("slip") else round(factor * value, 4) for key, value in step.items()}
