"""What is put on the bench: manipulators, load programs and cameras, drawn from a seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from prb3r.proof.rig.simulate import RigStates, simulate

PLAIN, HISTORY, LOADING, POOR = "plain", "history", "loading", "poor"
"""Flavours: declared slip directions; friction that follows the load path; unloading in the last two sequences alone;
few sequences, loading only, with little read."""
X, Y, ANGLE, BEND = range(4)
READ = ((X, Y, ANGLE), (X, Y, ANGLE), (X, Y, ANGLE), (X, Y), (X, Y, BEND), (ANGLE, BEND))
"""What cameras read, each as often as it stands here."""
LARGEST_BEND, LARGEST_TURN = 0.42, 2.2
"""Of a plate and of the whole arm under the largest load of a design, rad."""
ATTEMPTS = 40

Steps = tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class Design:
    """A manipulator as its owner describes it, and how it is recorded."""

    number: int
    flavour: str
    manipulator: Mapping[str, Any]
    measurement: Mapping[str, float]
    prior: Mapping[str, float]
    """Relative standard deviations; absent: flat."""
    kinds: tuple[int, ...]
    """What is read at every disk: `X`, `Y`, `ANGLE`, `BEND`."""
    program: tuple[Steps, ...]
    """Load steps of every sequence, as noted."""
    largest_bend: float
    """Of a plate of the nominal manipulator, rad."""

    @property
    def plates(self) -> int:
        return sum(each["plates"] for each in self.manipulator["segment"])

    @property
    def cables(self) -> tuple[str, ...]:
        return tuple(each["name"] for each in self.manipulator["cable"])

    @property
    def length(self) -> float:
        """m."""
        disk = self.manipulator["disk"]["thickness_m"]
        return sum(each["plates"] * (each["length_m"] + disk) for each in self.manipulator["segment"])

    @property
    def friction(self) -> float:
        return self.manipulator["friction"]["coefficient"]

    @property
    def pull(self) -> float:
        """Largest noted tension, N."""
        return max(step[f"cable_{name}_n"] for steps in self.program for step in steps for name in self.cables)

    @property
    def image_centre(self) -> tuple[float, float]:
        """m."""
        return (self.length / 2, 0.0)

    @property
    def loading_only(self) -> tuple[int, ...]:
        """Sequences in which no tension ever falls."""
        names = [f"cable_{name}_n" for name in self.cables]
        rising = [all(b[n] >= a[n] for a, b in pairwise(s) for n in names) for s in self.program]
        return tuple(k for k, on in enumerate(rising) if on)

    def deviation(self, kind: int) -> float:
        """Standard deviation of a reading, m or rad."""
        return self.measurement["position_sd_m" if kind <= Y else "angle_sd_rad"]

    def described(self) -> dict[str, Any]:
        """What may be said of it before the seal is broken."""
        return {
            "design": self.number,
            "flavour": self.flavour,
            "segments": len(self.manipulator["segment"]),
            "plates": self.plates,
            "cables": len(self.cables),
            "sequences": len(self.program),
            "steps": sum(len(steps) for steps in self.program),
            "read": ", ".join(("x", "y", "angle", "bend")[kind] for kind in self.kinds),
            "friction": self.friction,
            "largest_bend_rad": self.largest_bend,
        }


def design_of(seed: int, number: int, flavour: str = PLAIN) -> Design:
    """Design `number` of a seed; the rig has an equilibrium at all its steps, at moderate bends."""
    rng = np.random.default_rng([seed, 1, number])
    for _ in range(ATTEMPTS):
        drawn = _drawn(rng, number, flavour)
        fitted = _moderate(drawn)
        if fitted is not None:
            return fitted
    raise RuntimeError(f"no design {number} with moderate bends was found from seed {seed}")


def _drawn(rng: np.random.Generator, number: int, flavour: str) -> Design:
    u = rng.uniform
    manipulator = _manipulator(rng, flavour)
    kinds = READ[int(rng.integers(len(READ)))] if flavour == PLAIN else READ[0]
    kinds = kinds if flavour != POOR else ((X, Y), (ANGLE, BEND))[int(rng.integers(2))]
    measurement = {"tension_sd_relative": u(0.002, 0.005), "frame_rotation_sd_rad": u(0.002, 0.006)}
    if X in kinds:
        measurement |= {"position_sd_m": u(2e-4, 5e-4), "frame_position_sd_m": u(0.0005, 0.0025)}
    if ANGLE in kinds or BEND in kinds:
        measurement |= {"angle_sd_rad": u(3e-3, 8e-3)}
    prior = {} if rng.random() < 0.4 or flavour == POOR else {"youngs_modulus": 0.1, "friction_coefficient": 0.3}
    program = _program(rng, manipulator, flavour)
    return Design(number, flavour, manipulator, measurement, prior, kinds, program, 0.0)


def _manipulator(rng: np.random.Generator, flavour: str) -> dict[str, Any]:
    u, small = rng.uniform, flavour == HISTORY
    segments = int(rng.choice([1, 2]) if small else rng.choice([1, 2, 2, 3]))
    total = int(rng.integers(4, 6) if small else rng.integers(max(5, 2 * segments), 10))
    plates = np.full(segments, total // segments)
    plates[: total % segments] += 1
    length, clamp, width = u(0.026, 0.034), u(0.005, 0.008), 0.03
    thickness = np.sort(u(7.5e-4, 1e-3, segments))[::-1]
    pairs = list(range(segments, 0, -1)) if segments > 1 else [1] * int(rng.integers(1, 3))
    cables, arm = [], u(0.023, 0.026)
    for end in pairs:
        for side in (1, -1):
            cables.append({"offset_m": side * (arm + u(-0.001, 0.001)), "ends_at_segment": end})
        arm -= u(0.0035, 0.005)
    if len(cables) > 2 and rng.random() < 0.3:
        cables.pop(int(rng.integers(len(cables))))
    low = not small and flavour == PLAIN and rng.random() < 0.25
    friction: dict[str, Any] = {"coefficient": 0.0 if low else u(0.15, 0.4)}
    friction |= {"direction": "history", "presliding_m": 10 ** u(-4.5, -3.7)} if small else {}
    return {
        "name": "concealed",
        "youngs_modulus_pa": 1.87e11 * u(0.8, 1.1),
        "gravity_m_s2": 9.81,
        "disk": {"thickness_m": u(0.003, 0.006), "mass_kg": u(0.04, 0.1)},
        "friction": friction,
        "segment": [
            {"plates": int(n), "length_m": length, "clamp_m": clamp, "width_m": width, "thickness_m": float(t)}
            for n, t in zip(plates, thickness, strict=True)
        ],
        "cable": [{"name": str(j + 1), **each} for j, each in enumerate(cables)],
        "effect": [],
    }


def _program(rng: np.random.Generator, manipulator: Mapping[str, Any], flavour: str) -> tuple[Steps, ...]:
    """Sequences in which cables rise and fall, in N for a plate bend of a third of a radian by one cable alone."""
    cables = manipulator["cable"]
    m = len(cables)
    sequences = 4 if flavour in (HISTORY, POOR) else 6 if flavour == LOADING else int(rng.integers(5, 8))
    use: list[list[int]] = [[] for _ in range(sequences)]
    for j in rng.permutation(m).tolist():
        for k in sorted(range(sequences), key=lambda k: (len(use[k]), rng.random()))[:3]:
            use[k].append(j)
    pull = np.array([_tension(manipulator, cable) for cable in cables])
    loaded = rng.random() < 1 / 3
    program = []
    for k in range(sequences):
        used = rng.permutation(use[k] or [int(rng.integers(m))]).tolist()
        count = 4 if flavour in (HISTORY, POOR) else int(rng.integers(4, 7))
        rising = flavour == POOR or (flavour == LOADING and k < sequences - 2)
        tension = np.zeros((count, m))
        for rank, j in enumerate(used):
            tension[:, j] = _profile(rng, count, rising) * (1.0 if rank == 0 else rng.uniform(0.3, 0.7)) * pull[j]
        tip = np.zeros(2)
        if loaded and rng.random() < 0.6:
            tip = rng.choice([-1, 1]) * rng.uniform(0.1, 0.3) * np.array([0.3, 1.0]) * _tip(manipulator, pull)
        program.append(_steps(manipulator, tension.round(3), tip.round(4), loaded))
    return tuple(program)


def _tension(manipulator: Mapping[str, Any], cable: Mapping[str, Any]) -> float:
    soft = manipulator["segment"][cable["ends_at_segment"] - 1]
    rigidity = manipulator["youngs_modulus_pa"] * soft["width_m"] * soft["thickness_m"] ** 3 / 12
    return 0.33 * rigidity / ((soft["length_m"] - 2 * soft["clamp_m"]) * abs(cable["offset_m"]))


def _tip(manipulator: Mapping[str, Any], pull: np.ndarray) -> float:
    """Force whose moment about the base is that of the strongest cable, N."""
    arms = np.array([abs(each["offset_m"]) for each in manipulator["cable"]])
    return float((pull * arms).max() / sum(each["plates"] * each["length_m"] for each in manipulator["segment"]))


def _profile(rng: np.random.Generator, count: int, rising: bool) -> np.ndarray:
    """Shares of the largest tension, up to a peak and down again, or up alone."""
    if rising:
        return np.linspace(rng.uniform(0.15, 0.4), 1.0, count)
    peak = int(rng.integers(1, count - 1))
    up = np.linspace(rng.uniform(0.25, 0.5), 1.0, peak + 1)
    down = np.linspace(1.0, rng.uniform(0.15, 0.4), count - peak)[1:]
    return np.concatenate([up, down])


def _steps(manipulator: Mapping[str, Any], tension: np.ndarray, tip: np.ndarray, loaded: bool) -> Steps:
    """With the slip directions that the changes of tension declare."""
    names = [each["name"] for each in manipulator["cable"]]
    rows, way, before = [], -np.ones(len(names)), np.zeros(len(names))
    for row in tension:
        way = np.where(row < before, 1.0, np.where(row > before, -1.0, way))
        before = row
        step = {f"cable_{name}_n": float(t) for name, t in zip(names, row, strict=True)}
        step |= {f"slip_{name}": float(w) for name, w in zip(names, way, strict=True)}
        rows.append(step | ({"tip_x_n": float(tip[0]), "tip_y_n": float(tip[1])} if loaded else {}))
    return tuple(rows)


def followed(manipulator: Mapping[str, Any], program: Sequence[Steps]) -> list[RigStates] | None:
    """The rig's states along a program; None where an equilibrium ceases."""
    found = []
    for steps in program:
        states = simulate(manipulator, steps)
        if not states.converged.all():
            return None
        found.append(states)
    return found


def largest_bend(found: Sequence[RigStates]) -> float:
    """Of any plate at any step, rad."""
    return float(max(np.abs(np.diff(states.angle, axis=1)).max() for states in found))


def _moderate(design: Design) -> Design | None:
    """The design with tensions reduced until bends are moderate; None where that takes too much."""
    for _ in range(12):
        found = followed(design.manipulator, design.program)
        if found is not None:
            bend = largest_bend(found)
            turn = float(max(np.abs(states.angle).max() for states in found))
            if bend <= LARGEST_BEND and turn <= LARGEST_TURN:
                return replace(design, largest_bend=bend) if bend > 0.12 and not _idle(found) else None
        design = replace(design, program=tuple(tuple(map(_weaker, steps)) for steps in design.program))
    return None


def _weaker(step: Mapping[str, float]) -> dict[str, float]:
    return {key: value if key.startswith("slip") else round(0.88 * value, 4) for key, value in step.items()}


def _idle(found: Sequence[RigStates]) -> bool:
    """Whether some plate never bends."""
    bends = np.concatenate([np.abs(np.diff(states.angle, axis=1)) for states in found])
    return bool((bends.max(0) < 0.03).any())
