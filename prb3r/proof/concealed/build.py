"""Imperfections of a real rig: how it was built, measured and read, which no file tells."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from prb3r.proof.concealed.design import Design, LoadSteps
from prb3r.proof.settings import SETTINGS

NestedFloats = Sequence[Sequence[float]]


@dataclass(frozen=True)
class Build:
    """Imperfections of one rig and its camera; `n` plates, `m` cables.  Deviations without a unit are relative."""

    length: Sequence[float]
    """(n,) deviation of each plate's length."""
    thickness: Sequence[float]
    """(n,) deviation of each plate's thickness."""
    offset: NestedFloats
    """(n, m) deviation of each cable's offset at each plate."""
    marker_m: NestedFloats
    """(n, 2) place of each disk's marker in the frame of the disk, m; the base disk has none."""
    noise: float
    """Factor on the stated deviation of readings."""
    tension: float
    """Factor on the stated scatter of tensions."""
    gaps: bool = False
    """Whether readings are missing."""
    gross: bool = False
    """Whether there are gross outliers."""

    def plain(self) -> dict[str, Any]:
        """The fields as a dictionary of numbers, lists and truth values, which a label holds and JSON can write."""
        return asdict(self)


def drawn_build(rng: np.random.Generator, design: Design) -> Build:
    """Imperfections of a rig that is built after a design and of its recording, drawn as `SETTINGS.real` says."""
    chosen, n, m = SETTINGS.real, design.plates, len(design.cables)
    segment = np.repeat(np.arange(len(design.manipulator["segment"])), _plates(design.manipulator))

    def off(*shape: int) -> np.ndarray:
        """Half of a deviation; two such add up to `chosen.geometry` at most."""
        return rng.uniform(-chosen.geometry / 2, chosen.geometry / 2, shape)

    def factor(low: float, high: float) -> float:
        """A random factor, uniform in its logarithm."""
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    return Build(
        length=(off(segment[-1] + 1)[segment] + off(n)).tolist(),
        thickness=(off(segment[-1] + 1)[segment] + off(n)).tolist(),
        offset=(off(m)[None, :] + off(n, m)).tolist(),
        marker_m=(chosen.marker_sd_m * np.clip(rng.standard_normal((n, 2)), -2, 2)).tolist(),
        noise=factor(*chosen.noise),
        tension=factor(*chosen.tension),
        gaps=bool(rng.random() < 1 / chosen.gaps_every),
        gross=bool(rng.random() < 1 / chosen.gaps_every),
    )


def rig_as_built(manipulator: Mapping[str, Any], build: Build) -> dict[str, Any]:
    """The contents of a manipulator file of the rig as it was made: every plate is a segment of its own, with its own
    length, thickness and offsets."""
    counts = _plates(manipulator)
    ends = np.cumsum(counts)
    drawn = [segment for segment in manipulator["segment"] for _ in range(segment["plates"])]
    segments = [
        {
            **segment,
            "plates": 1,
            "length_m": segment["length_m"] * (1 + build.length[i]),
            "thickness_m": segment["thickness_m"] * (1 + build.thickness[i]),
        }
        for i, segment in enumerate(drawn)
    ]
    cables = []
    for j, cable in enumerate(manipulator["cable"]):
        reach = int(ends[cable["ends_at_segment"] - 1])
        holes = [cable["offset_m"] * (1 + build.offset[i][j]) for i in range(reach)]
        cables.append({**cable, "offset_m": holes, "ends_at_segment": reach})
    effects = [part for effect in manipulator["effect"] for part in _by_plate(effect, counts)]
    return {**manipulator, "segment": segments, "cable": cables, "effect": effects}


def _plates(manipulator: Mapping[str, Any]) -> list[int]:
    """Number of plates of each segment."""
    return [segment["plates"] for segment in manipulator["segment"]]


def _by_plate(effect: Mapping[str, Any], counts: Sequence[int]) -> list[dict[str, Any]]:
    """A stiffness factor on a segment as one on each of its plates; any other effect as it is."""
    if effect["kind"] != "segment_stiffness":
        return [dict(effect)]
    last = int(np.sum(counts[: effect["segment"]]))
    first = last - counts[effect["segment"] - 1] + 1
    return [{"kind": "weakened_plate", "plate": i, "factor": effect["factor"]} for i in range(first, last + 1)]


def applied_tensions(rng: np.random.Generator, design: Design, build: Build, steps: LoadSteps) -> LoadSteps:
    """The steps of a sequence with true tensions (N), scattered about the noted ones."""
    sd, names = build.tension * design.measurement["tension_sd_relative"], [f"cable_{c}_n" for c in design.cables]
    return tuple({**step, **{n: step[n] * float(1 + sd * rng.standard_normal()) for n in names}} for step in steps)


def reading_noise(rng: np.random.Generator, build: Build, shape: tuple[int, int, int]) -> np.ndarray:
    """(steps, disks, kinds) reading noise over the stated deviation: heavy-tailed, in part common to neighbours."""
    chosen = SETTINGS.real
    nu = chosen.noise_freedom
    single = rng.standard_t(nu, shape) / np.sqrt(nu / (nu - 2))
    disk = np.arange(shape[1])
    alike = np.exp(-np.abs(disk[:, None] - disk) / chosen.common_reach)
    common = np.einsum("ij,sjk->sik", np.linalg.cholesky(alike), rng.standard_normal(shape))
    return build.noise * (np.sqrt(1 - chosen.common) * single + np.sqrt(chosen.common) * common)
